#!/usr/bin/env -S uv run --script
# /// script
# requires-python = ">=3.10"
# dependencies = ["numpy", "pillow"]
# ///
"""Renders tables/pictures/fabrics.jpg, the strip of the README: folded cloth, made here, by `sateen render scene`.

    scripts/pictures.py [FILE]      SATEEN=PATH takes that tool; else it is built. Without uv: pip install numpy pillow; python3 …
"""
import pathlib
import subprocess
import sys
import tempfile

import numpy
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIDE = 300  # of a panel, pixels
GAP = 6
CELLS = 220  # of the mesh, along each side


def folds(x, y):
    """Long soft folds that run from the lower left to the upper right and join."""
    along, across = (x + y) / 2**0.5, (y - x) / 2**0.5
    bent = across + 0.16 * numpy.sin(1.7 * along + 0.6) + 0.07 * numpy.sin(3.1 * along - 1.1 * across)
    return 0.14 * numpy.sin(5.2 * bent) + 0.03 * numpy.sin(11.3 * bent + 1.3 * along) + 0.06 * numpy.sin(2.3 * along + across)


def gathered(x, y):
    """Pleats that fan out from a point beyond the upper left corner."""
    u, v = x + 1.45, 1.5 - y
    radius, angle = numpy.hypot(u, v), numpy.arctan2(v, u)
    bent = angle + 0.05 * numpy.sin(2.6 * radius)
    return radius * (0.044 * numpy.sin(17.0 * bent) + 0.013 * numpy.sin(31.0 * bent + 2.0 * radius)) + 0.05 * numpy.sin(2.2 * radius)


def swirl(x, y):
    """A twist: folds that wind around the middle."""
    radius, angle = numpy.hypot(x - 0.1, y + 0.05), numpy.arctan2(y + 0.05, x - 0.1)
    rise = radius**2 / (radius**2 + 0.12)
    return 0.15 * rise * numpy.sin(3.0 * angle + 4.6 * radius) * numpy.exp(-0.35 * radius) + 0.03 * rise * numpy.sin(7.0 * angle + 5.0 * radius)


def waves(x, y):
    """Cloth that lies loosely."""
    height = 0.1 * numpy.sin(2.4 * x + 1.1 * y + 0.9 * numpy.sin(1.3 * y))
    return height + 0.08 * numpy.sin(3.3 * y - 1.7 * x + 0.8 * numpy.sin(2.0 * x)) + 0.05 * numpy.sin(5.1 * x + 2.9 * y)


# Dyed satin: a table holds no albedo, so this is charmeuse with two numbers changed.
SATIN = """name = "satin"
[[material]]
name = "satin"
fabric = "polyester-satin-charmeuse-front"
albedo = { warp = { color = [0.005, 0.025, 0.11] }, weft = { color = [0.005, 0.025, 0.11] } }
"""
DOTS = (ROOT / "tables" / "patterns" / "polka-dot-lining.toml").read_text()
# Cloth, how often its pattern repeats, shape, direction of the warp in degrees from x to y, lights: direction and strength.
PANELS = [
    ("silk-shot", 1.0, folds, 0.0, [((-0.45, 0.75, 0.65), 1.5), ((0.9, -0.2, 0.45), 0.8), ((0.1, 0.3, 1.0), 0.08)]),
    ("satin.toml", 1.0, gathered, -45.0, [((-0.5, 0.7, 0.7), 2.4), ((0.9, -0.2, 0.5), 1.4), ((0.1, 0.2, 1.0), 0.15)]),
    ("polyester-lining", 1.0, swirl, 90.0, [((-0.6, 0.7, 0.6), 0.7), ((0.8, -0.5, 0.5), 0.35), ((0.0, 0.2, 1.0), 0.05)]),
    ("dots.toml", 1.5, waves, 0.0, [((-0.7, 0.6, 0.7), 0.8), ((0.9, 0.1, 0.5), 0.25), ((0.0, 0.2, 1.0), 0.12)]),
]


def write_mesh(path, height, warp_deg):
    """The height over a square, as OBJ, with normals and texture coordinates."""
    line = numpy.linspace(-1.6, 1.6, CELLS + 1)
    x, y = numpy.meshgrid(line, line)
    z = height(x, y)
    dy, dx = numpy.gradient(z, line, line)
    normals = numpy.stack([-dx, -dy, numpy.ones_like(z)], -1)
    normals /= numpy.linalg.norm(normals, axis=-1, keepdims=True)
    cos, sin = numpy.cos(numpy.radians(warp_deg)), numpy.sin(numpy.radians(warp_deg))
    columns = {"v": (x, y, z), "vt": (cos * x + sin * y, cos * y - sin * x), "vn": numpy.moveaxis(normals, -1, 0)}
    with open(path, "w") as file:
        for name, values in columns.items():
            for row in numpy.stack([value.ravel() for value in values], -1):
                print(name, *(f"{number:.6f}" for number in row), file=file)
        first = (1 + numpy.arange(CELLS)[:, None] * (CELLS + 1) + numpy.arange(CELLS)).ravel()
        for a in first:
            b, c, d = a + 1, a + CELLS + 2, a + CELLS + 1
            print(f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\nf {a}/{a}/{a} {c}/{c}/{c} {d}/{d}/{d}", file=file)


def scene(cloth, repeats, lights):
    text = 'name = "panel"\n[[camera]]\nposition = [0.0, -0.9, 3.4]\ntarget = [0.0, 0.0, 0.0]\nfov_deg = 33.0\n'
    for direction, strength in lights:
        text += f'[[light]]\nkind = "directional"\ndirection = {list(direction)}\nstrength = {strength}\n'
    return text + f'[[object]]\nmesh = "cloth.obj"\ncloth = "{cloth}"\nrepeats = {repeats}\n'


def main():
    output = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "tables" / "pictures" / "fabrics.jpg"
    tool = subprocess.run([ROOT / "scripts" / "tool.sh"], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    strip = Image.new("RGB", (len(PANELS) * (SIDE + GAP) - GAP, SIDE), "white")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "satin.toml").write_text(SATIN)
        (folder / "dots.toml").write_text(DOTS)
        for index, (cloth, repeats, height, warp_deg, lights) in enumerate(PANELS):
            write_mesh(folder / "cloth.obj", height, warp_deg)
            (folder / "scene.toml").write_text(scene(cloth, repeats, lights))
            picture = folder / "panel.png"
            subprocess.run([tool, "--quiet", "render", "scene", folder / "scene.toml", "--size", str(SIDE), "-o", picture], check=True)
            strip.paste(Image.open(picture).convert("RGB"), (index * (SIDE + GAP), 0))
    strip.save(output, quality=92, subsampling=0)
    print(output, output.stat().st_size)


if __name__ == "__main__":
    main()
