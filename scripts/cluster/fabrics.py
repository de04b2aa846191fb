#!/usr/bin/env python3
"""Makes many fabrics to try a cluster with: those of the library with varied parameters.

    scripts/cluster/fabrics.py FOLDER COUNT [--flat]

Writes COUNT TOML files into FOLDER, and FOLDER/list.txt, which names them: every time the same. Only fabrics with straight threads are
taken, of which draft tables take a few seconds. --flat takes faux suede alone, whose tables take milliseconds and 1 kB.
"""
import pathlib
import random
import re
import sys
import tomllib

LIBRARY = pathlib.Path(__file__).resolve().parent.parent.parent / "tables" / "fabrics"
# Widths of lobes by up to this factor, both ways; coverages, lengths and the index of refraction stay.
WIDER = 1.3


def is_straight(text):
    return not any(isinstance(thread["direction_deg"], list) for thread in tomllib.loads(text)["thread"])


def varied(text, name, rng):
    """The text of a fabric with another name, widths and colours."""
    text = re.sub(r'^name = ".*"', f'name = "{name}"', text, count=1, flags=re.M)
    wider = WIDER ** rng.uniform(-1, 1)
    width = lambda found: f"{found[1]} = {float(found[2]) * wider:.3f}"
    text = re.sub(r"^(gamma_[sv]_deg) = (\S+)", width, text, flags=re.M)
    darker = rng.uniform(0.5, 1)
    return re.sub(r"(scale) = ([\d.]+)", lambda found: f"{found[1]} = {float(found[2]) * darker:.4f}", text)


def write(folder, count, flat=False):
    """Returns the list's path."""
    texts = {path.stem: path.read_text() for path in sorted(LIBRARY.glob("*.toml"))}
    texts = {name: text for name, text in texts.items() if (name == "faux-suede" if flat else is_straight(text))}
    rng = random.Random(2013)
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for number in range(count):
        base = sorted(texts)[number % len(texts)]
        names.append(f"{base}-{number:06}")
        (folder / f"{names[-1]}.toml").write_text(varied(texts[base], names[-1], rng))
    path = folder / "list.txt"
    path.write_text("# Made by scripts/cluster/fabrics.py\n" + "".join(f"{name}.toml\n" for name in names))
    return path


if __name__ == "__main__":
    arguments = [argument for argument in sys.argv[1:] if argument != "--flat"]
    if len(arguments) != 2:
        sys.exit(__doc__)
    print(write(arguments[0], int(arguments[1]), "--flat" in sys.argv))
