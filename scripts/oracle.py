#!/usr/bin/env python3
# /// script
# requires-python = ">=3.11"
# dependencies = ["numpy>=1.26"]
# ///
"""The model of thesis equations 3.15 to 3.26, written without reference to the Rust code, so that the two can check each other.

    scripts/oracle.py                                      computes tests/data/golden_*.csv anew, of the pairs that they hold
    scripts/oracle.py --check                              writes nothing, and fails where a value differs in its stored digits
    scripts/oracle.py PAIRS.csv FABRIC [--q view|both]     other pairs, to stdout

Needs numpy: `uv run scripts/oracle.py` brings it.

Directions are unit vectors in the surface's frame (x = warp, y = weft, z = normal), away from the surface; wi = light, wr = viewer.
Columns: of every thread its surface and volume response S and V, averaged over the tangents, without colour, with M, P and the longitudinal
cos θ_i in them, and its mean projection P; then Q, and ρ of red, green and blue: BRDF × cosine in 1/sr, so that L_r = ∫ L_i ρ dω_i.
"""
import pathlib
import sys
import tomllib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATA = ROOT / "tests" / "data"
D = np.pi / 180.0
SIGMA_U = 20.0 * D  # width of the correlation Gaussian u, whose height is 1
X, WEIGHT = np.polynomial.legendre.leggauss(8)


def thread(albedo, scale, eta, kd, gamma_s, gamma_v, coverage, offsets, lengths, directions=0.0):
    """Angles in degrees; `directions` are those of the curve's points, or one of all."""
    return dict(
        albedo=np.array(albedo, float) * scale, eta=eta, kd=kd, gs=gamma_s * D, gv=gamma_v * D, coverage=coverage,
        offsets=np.array(offsets, float) * D, lengths=np.array(lengths, float),
        directions=np.broadcast_to(np.array(directions, float) * D, len(offsets)),
    )


def warp(*numbers):
    return thread(*numbers)


def weft(*numbers):
    return thread(*numbers, 90.0)


# Copied from the tables of the papers, not from tables/fabrics: warp, then weft, of which one may be absent.
WOVEN = {
    "linen-plain": (
        warp((.2, .8, 1), .3, 1.46, .3, 12, 24, .33, (-25, 25), (1,)),
        weft((.2, .8, 1), .3, 1.46, .3, 12, 24, .33, (-25, 25), (1,))),
    "silk-crepe-de-chine": (
        warp((1, .95, .05), .12, 1.345, .2, 5, 10, .75, (-35, -35, 35, 35), (1, 1, 1)),
        weft((1, .95, .05), .16, 1.345, .3, 18, 32, .25, (0, 0), (1,))),
    "polyester-satin-charmeuse-front": (
        warp((1, .37, .3), .035, 1.539, .1, 2.5, 5, .9, (-32, -32, -18, 0, 0, 18, 32, 32), (1.33, .66, 2, 2, 2, .66, 1.33)),
        weft((1, .37, .3), .2, 1.539, .7, 30, 60, .1, (0, 0), (1,))),
    "polyester-satin-charmeuse-back": (
        warp((1, .37, .3), .035, 1.539, .1, 2.5, 5, .67, (-30, -30, 30, 30, -5, -5, 5, 5), (1.33, 1.33, 1.33, 0, .67, .67, .67)),
        weft((1, .37, .3), .2, 1.539, .7, 30, 60, .33, (0, 0), (3,))),
    "silk-shot": (
        warp((.1, 1, .4), .2, 1.345, .1, 4, 8, .86, (-25, -25, 25, 25), (1.33, 2.67, 1.33)),
        weft((1, 0, .1), .6, 1.345, .1, 5, 10, .14, (0, 0), (1,))),
    "velvet": (
        warp((.05, .02, 0), .3, 1.46, .1, 6, 12, .5, (-90, -50), (1,)),
        weft((.05, .02, 0), .3, 1.46, .1, 6, 12, .5, (-90, -55, 55, 90), (.5, 0, .5))),
    "denim": (
        warp((.5, .75, 1), .07, 1.4, 0, 15, 30, .7, (-20, -5, 5, 20), (1, 1, 1)),
        weft((.9, .85, .07), .1, 1.4, 0, 15, 30, .3, (-20, 20), (1,))),
    "polyester-lining": (
        warp((1, .04, .18), .7, 1.3, .2, 1.5, 3, .7, (-25, 25), (1,)),
        weft((1, .04, .18), .7, 1.3, .2, 1.5, 3, .3, (-5, -5, 5, 5), (1, 0, 1))),
    "polka-dot-lining-white": (
        warp((.8, .7, .6), .5, 1.2, .1, 1.5, 3, .6, (-15, -15, 15, 15), (.1, .8, .1)),
        weft((.8, .7, .6), .5, 1.2, .1, 1.5, 3, .4, (-7, -7, 7, 7), (.2, .6, .2))),
    "polka-dot-lining-pink": (
        warp((1, 0, .25), .35, 1.2, .1, 1.5, 3, .6, (-15, -15, 15, 15), (.1, .8, .1)),
        weft((1, 0, .25), .35, 1.2, .1, 1.5, 3, .4, (-7, -7, 7, 7), (.2, .6, .2))),
    "swimwear-front": (
        warp((1, .9, .3), 1, 1.3, 0, 8, 16, .8, (-30, 30), (1,)),
        weft((.1, 1, .2), .7, 1.3, 1, 32, 64, .2, (-25, 25), (1,))),
    "swimwear-back": (
        warp((.1, 1, .2), .7, 1.3, 1, 32, 64, .2, (-25, 25), (1,)),
        weft((1, .9, .3), 1, 1.3, 0, 8, 16, .8, (-30, 30), (1,))),
    "tshirt-white": (warp((1, .9, .75), 1, 1.3, 1, 24, 48, 1, (-5, 5), (1,)), None),
    "tshirt-black-front": (warp((.89, .68, .48), .05, 1.1, .1, 15, 30, 1, (-5, 5, -90, -90, 90, 90), (10, 0, .2, 0, .2)), None),
    "tshirt-black-back": (None, weft((.89, .68, .48), .05, 1.1, .1, 15, 30, 1, (-5, 5, -90, -90, 90, 90), (10, 0, .2, 0, .2))),
    "faux-suede": (None, weft((1, .27, .2), .15, 1.15, .7, 15, 30, 1, (-45, -45, 0, 0, 45, 45), (2, 0, 1, 0, 1))),
    "corduroy": (
        warp((.83, .58, .35), .4, 1.5, .3, 8, 16, .5, (-90, 90, -30, 10), (1, 0, .5)),
        weft((.83, .58, .35), .4, 1.4, .3, 8, 16, .5, (-35, -5), (1,))),
}


def knitted(name):
    """Fabrics that no paper has numbers of are what their files say."""
    text = tomllib.loads((ROOT / "tables" / "fabrics" / f"{name}.toml").read_text())
    return [
        thread(
            t["albedo"]["color"], t["albedo"].get("scale", 1.0), t["eta"], t["k_d"], t["gamma_s_deg"], t["gamma_v_deg"], t["coverage"],
            t["tangent_offsets_deg"], t["tangent_lengths"], t["direction_deg"])
        for t in text["thread"]
    ]


def gauss(sigma, x):
    return np.exp(-0.5 * (x / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))


def wrapped(x):
    return (x + np.pi) % (2 * np.pi) - np.pi


def u(x):
    return np.exp(-0.5 * (wrapped(x) / SIGMA_U) ** 2)


def fresnel(eta, c):
    """Unpolarised reflectance of a dielectric of relative index eta ≥ 1, at the cosine of incidence c."""
    ct = np.sqrt(np.maximum(1 - (1 - c * c) / (eta * eta), 0))
    rs = (c - eta * ct) / (c + eta * ct)
    rp = (eta * c - ct) / (eta * c + ct)
    return 0.5 * (rs * rs + rp * rp)


def blend(k, a, b):
    return (1 - k) * a * b + k * np.minimum(a, b)


def along(direction, w):
    """A direction as a thread sees it that runs at this angle from the warp: along it, to its side, and the normal."""
    c, s = np.cos(direction), np.sin(direction)
    return c * w[0] + s * w[1], c * w[1] - s * w[0], w[2]


def tilted(th, direction, delta, wi, wr):
    """S, V, P of both directions and P of the viewer's, for arrays of directions and tilts of a thread."""
    c, s = np.cos(delta), np.sin(delta)
    wi, wr = along(direction, wi), along(direction, wr)
    xi, yi, zi = c * wi[0] + s * wi[2], wi[1], c * wi[2] - s * wi[0]
    xr, yr, zr = c * wr[0] + s * wr[2], wr[1], c * wr[2] - s * wr[0]
    ti, tr = np.arcsin(np.clip(xi, -1, 1)), np.arcsin(np.clip(xr, -1, 1))
    fi, fr = np.arctan2(yi, zi), np.arctan2(yr, zr)
    si, sr = np.arctan2(xi, zi), np.arctan2(xr, zr)
    ci, cr = np.hypot(yi, zi), np.hypot(yr, zr)
    fd = wrapped(fi - fr)
    th_h, th_d = (ti + tr) / 2, (ti - tr) / 2
    M = blend(u(fd), np.maximum(np.cos(fi), 0), np.maximum(np.cos(fr), 0))
    p_r = np.maximum(np.cos(sr), 0)
    P = blend(u(si - sr), np.maximum(np.cos(si), 0), p_r)
    F = fresnel(th["eta"], np.clip(np.cos(th_d) * np.cos(fd / 2), 0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        k = np.where(M * P > 0, M * P * ci / np.cos(th_d) ** 2, 0.0)
        S = k * F * np.cos(fd / 2) * gauss(th["gs"], th_h)
        V = np.where(k > 0, k * (1 - F) ** 2 * ((1 - th["kd"]) * gauss(th["gv"], th_h) + th["kd"]) / (ci + cr), 0.0)
    return np.array([S, V, P, p_r])


def cuts_of(th, direction, wi, wr, a, b):
    """Places between two tilts of a straight thread to split panels at: every kink that can be located, and around the highlight."""
    wi, wr = along(direction, wi), along(direction, wr)
    p_i, p_r = np.arctan2(wi[0], wi[2]), np.arctan2(wr[0], wr[2])
    h = np.arctan2(wi[0] + wr[0], wi[2] + wr[2])
    # A tilt d turns ψ into ψ + d: visibility ends at ψ + d = ±90°, |ψ_i| = |ψ_r| at d = −(ψ_i + ψ_r) / 2,
    # and the highlight is at ψ_h + d = 0.
    cuts = [a, b, -p_i + np.pi / 2, -p_i - np.pi / 2, -p_r + np.pi / 2, -p_r - np.pi / 2, -(p_i + p_r) / 2]
    cuts += [-h + m * g for g in (th["gs"], th["gv"]) for m in (-8, -4, -2, -1, 0, 1, 2, 4, 8)]
    return np.unique([c for c in cuts if a <= c <= b])


def nodes(edges):
    """Gauss and Legendre's nodes and weights of panels."""
    middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
    return (middle[:, None] + half[:, None] * X).ravel(), (half[:, None] * WEIGHT).ravel()


def woven_part(th, direction, a, b, wi, wr):
    """The mean over tilts from a to b, of a thread of one direction."""
    cuts = cuts_of(th, direction, wi, wr, min(a, b), max(a, b))
    total = np.zeros(4)
    for p, q in zip(cuts[:-1], cuts[1:]):
        delta, weight = nodes(np.linspace(p, q, max(8, int(np.ceil((q - p) / (0.25 * D)))) + 1))
        total += tilted(th, direction, delta, wi, wr) @ weight
    return total / abs(b - a)


def curved_part(th, ends, offsets, wi, wr):
    """The mean over a part of a curve, along which direction and tilt change evenly, in panels of 0.02°."""
    span = max(abs(ends[1] - ends[0]), abs(offsets[1] - offsets[0]))
    at, weight = nodes(np.linspace(0, 1, int(np.ceil(span / (0.02 * D))) + 1))
    directions, delta = ends[0] + (ends[1] - ends[0]) * at, offsets[0] + (offsets[1] - offsets[0]) * at
    return tilted(th, directions, delta, wi, wr) @ weight


def averaged(th, wi, wr, is_woven):
    """S, V, P of both directions and P of the viewer's, averaged over a thread's tangents."""
    mean = np.zeros(4)
    for k, length in enumerate(th["lengths"]):
        ends, offsets = th["directions"][k:k + 2], th["offsets"][k:k + 2]
        if length == 0:
            continue
        if ends[0] == ends[1] and offsets[0] == offsets[1]:
            part = tilted(th, ends[0], offsets[0], wi, wr)
        elif is_woven:
            part = woven_part(th, ends[0], *offsets, wi, wr)
        else:
            part = curved_part(th, ends, offsets, wi, wr)
        mean += length / th["lengths"].sum() * part
    return mean


def values(threads, wi, wr, q, is_woven):
    """All columns after the pair."""
    columns, light, projected, covered = [], np.zeros(3), 0.0, 0.0
    for th in threads:
        if th is None:
            columns += [0.0] * 3
            continue
        S, V, both, view = averaged(th, wi, wr, is_woven)
        P = view if q == "view" else both
        columns += [S, V, P]
        light += th["coverage"] * (S + V * th["albedo"])
        projected += th["coverage"] * P
        covered += th["coverage"]
    Q = projected + (1 - covered) * max(wr[2], 0.0)
    rho = light / Q if Q > 0 and wi[2] > 0 and wr[2] > 0 else np.zeros(3)
    return [*columns, Q, *rho]


def unit(v):
    v = np.asarray(v, float)
    return v / np.sqrt(v @ v)


def text(numbers):
    return ",".join(format(float(x), ".12g") for x in numbers)


def golden(name):
    """The file as it is, and as it is computed now, by lines."""
    lines = (DATA / name).read_text().splitlines()
    computed = [lines[0]]
    knits = {}
    for line in lines[1:]:
        cells = line.split(",")
        is_woven = name != "golden_curves.csv"
        fabric, q = (cells[0], name[7:11]) if is_woven else cells[:2]
        known = 1 if is_woven else 2
        pair = [float(x) for x in cells[known:known + 6]]
        threads = WOVEN[fabric] if is_woven else knits.setdefault(fabric, knitted(fabric))
        found = values(threads, unit(pair[:3]), unit(pair[3:]), q, is_woven)
        computed.append(",".join(cells[:known + 6]) + "," + text(found))
    return lines, computed


def differences(lines, computed):
    """The largest difference of two files' numbers in units of 1e-12 of the number, and its line."""
    worst = (0.0, "")
    for old, new in zip(lines, computed, strict=True):
        for a, b in zip(old.split(","), new.split(","), strict=True):
            if a != b:
                a, b = float(a), float(b)
                worst = max(worst, (abs(a - b) / max(abs(a), 1e-6) * 1e12, new))
    return worst


def main():
    arguments = sys.argv[1:]
    if arguments in ([], ["--check"]):
        failed = False
        for name in ("golden_view.csv", "golden_both.csv", "golden_curves.csv"):
            lines, computed = golden(name)
            worst, line = differences(lines, computed)
            print(f"{name}: {len(lines) - 1} rows, differences up to {worst:.3g} units of the last digit")
            if worst > 10:
                print(f"  {line}")
                failed = True
            if not arguments:
                (DATA / name).write_text("\n".join(computed) + "\n")
        sys.exit(int(failed and bool(arguments)))
    q = arguments[arguments.index("--q") + 1] if "--q" in arguments else "view"
    file, fabric = arguments[:2]
    threads, is_woven = (WOVEN[fabric], True) if fabric in WOVEN else (knitted(fabric), False)
    for row in np.genfromtxt(file, delimiter=",", names=True):
        wi, wr = ([row[f"{w}_{axis}"] for axis in "xyz"] for w in ("wi", "wr"))
        print(text([*wi, *wr, *values(threads, unit(wi), unit(wr), q, is_woven)]))


if __name__ == "__main__":
    main()
