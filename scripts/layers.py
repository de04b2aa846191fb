#!/usr/bin/env python3
"""Whether each module names only those below it.

    scripts/layers.py [FOLDER]

The order, from the bottom to the top, is the list under "# Modules" in FOLDER/lib.rs (default: src). Every upward name is printed
with its file and line, but for those in comments, which may link anywhere. Exit status 1 if there is one.
"""

import re
import sys
from pathlib import Path

source = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent / "src")


def order() -> list[str]:
    """The modules of the list, the lowest first."""
    section = re.search(r"^//! # Modules\n(.*?)^//! # ", (source / "lib.rs").read_text(), re.M | re.S)
    return re.findall(r"^//! - \[?`(?:mod@)?(\w+)`", section[1], re.M) if section else []


def without_comments(text: str) -> str:
    """As many lines, without comments."""
    text = re.sub(r"/\*.*?\*/", lambda found: "\n" * found[0].count("\n"), text, flags=re.S)
    return re.sub(r"//[^\n]*", "", text)


def first_names(text: str, start: int) -> list[tuple[int, str]]:
    """The places and first names of the paths that begin at a place: one, or those of a group in braces."""
    if text[start : start + 1] != "{":
        name = re.match(r"\w+", text[start:])
        return [(start, name[0])] if name else []
    names, depth, is_first = [], 0, True
    for place in range(start, len(text)):
        character = text[place]
        if character == "{":
            depth += 1
        elif character == "}":
            depth -= 1
            if depth == 0:
                break
        elif depth == 1 and character == ",":
            is_first = True
        elif depth == 1 and is_first and not character.isspace():
            names += first_names(text, place)
            is_first = False
    return names


def names_from_root(text: str, depth: int) -> list[tuple[int, str]]:
    """Places and names of what a file names of the crate's root, in which it is a module so many levels deep."""
    root = re.compile(r"\bcrate\s*::\s*|\b(?:super\s*::\s*){%d,}(?!super\b)" % depth)
    return [name for found in root.finditer(text) for name in first_names(text, found.end())]


layers = order()
failures = []
for file in sorted(source.rglob("*.rs")):
    path = file.relative_to(source)
    module = path.parts[0].removesuffix(".rs")
    if module in ("lib", "bin"):
        continue
    if module not in layers:
        failures.append(f"{file}: {module} is not in the list of {source}/lib.rs")
        continue
    text = without_comments(file.read_text())
    depth = len(path.parts) - (path.name == "mod.rs")
    for place, name in names_from_root(text, depth):
        if name in layers and layers.index(name) > layers.index(module):
            line = text.count("\n", 0, place) + 1
            failures.append(f"{file}:{line}: {module} names {name}, which is above it in the list of {source}/lib.rs")
failures += [f"{source}/lib.rs: there is no module {name}" for name in layers if not list(source.glob(name + "*"))]
if not layers:
    failures.append(f"{source}/lib.rs: no list under # Modules")
print(*sorted(set(failures)), sep="\n", end="\n" if failures else "", file=sys.stderr)
sys.exit(bool(failures))
