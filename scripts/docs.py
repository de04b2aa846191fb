#!/usr/bin/env python3
"""Writes what documents quote: tables of results, drawings of tangent curves, and what commands print.

    scripts/docs.py [--all] [--check]

What stands between `<!-- generated: NAME -->` and `<!-- /generated -->` in a Markdown file is written by the function of that name below.
Without --all only what follows from files of the repository, within a second; with it also what commands print, within minutes
(SATEEN=PATH takes that tool; else it is built). --check writes nothing and fails when something differs. It also fails when a key of a TOML
file that the sources read is in no document, when a link leads to no file, and when README.md has more than 120 lines.
"""
import csv
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"(<!-- generated: (\S+) -->\n).*?(<!-- /generated -->)", re.S)
MAX_README_LINES = 120


def baseline(preset):
    with open(ROOT / "tables" / "baseline.csv") as file:
        return [row for row in csv.DictReader(file) if row["preset"] == preset]


def size(count):
    """Bytes for people, in powers of 1000 as the tool prints them."""
    count = int(count)
    if count < 1000:
        return f"{count} B" if count else "–"
    unit, divisor = ("MB", 1e6) if count >= 999_500 else ("kB", 1e3)
    value = count / divisor
    return f"{value:.2f} {unit}" if value < 10 else f"{value:.1f} {unit}" if value < 100 else f"{value:.0f} {unit}"


def percent(x, digits=2):
    return f"{100 * float(x):.{digits}f} %"


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


# ---- What follows from the repository.


def numbers():
    rows = baseline("standard")
    mean = sum(float(row["mean"]) for row in rows) / len(rows)
    worst = max(rows, key=lambda row: float(row["mean"]))
    speedups = [[round(float(row[key])) for row in rows] for key in ("speedup", "speedup_scalar")]
    largest = max(int(row["file_bytes"]) for row in rows)
    small = sum(int(row["decoded_bytes"]) == 0 for row in rows)
    return (
        f"- **Error**: {percent(mean)} on average over the library's {len(rows)} fabrics, {percent(worst['mean'])} for the worst of them"
        f" ({worst['fabric']}).\n"
        f"- **Time**: a batched lookup takes {min(speedups[0])} to {max(speedups[0])} times less time than the published rule of 50 tilts, one pair"
        f" at a time;\n  a single lookup {min(speedups[1])} to {max(speedups[1])} times less. (In batches that rule, too, is several times faster.)\n"
        f"- **Size**: at most 4 MiB in memory and {size(largest)} in the file; {small} of the fabrics take no samples at all and about 1 kB.\n"
    )


def results(preset):
    # A baseline from before there were rims lacks them.
    rims = [key for key in ("rim_p99", "rim_both_p99", "rim_last_p99") if all(row.get(key) for row in baseline(preset))]
    names = {"rim_p99": "rim p99", "rim_both_p99": "both", "rim_last_p99": "last"}
    head = ["fabric", "mean", "p99", "grazing p99", *(names[key] for key in rims), "in memory", "in the file", "FLIP", "batch", "single"]
    rows = [
        [
            row["fabric"],
            percent(row["mean"], 3),
            percent(row["p99"]),
            percent(row["grazing_p99"]),
            *(percent(row[key]) for key in rims),
            size(row["decoded_bytes"]),
            size(row["file_bytes"]),
            f"{float(row['sphere_flip']):.4f}",
            f"{float(row['speedup']):.0f} ×",
            f"{float(row['speedup_scalar']):.0f} ×",
        ]
        for row in baseline(preset)
    ]
    return table(head, rows)


def library():
    rows = []
    for path in sorted((ROOT / "tables" / "fabrics").glob("*.toml")):
        fabric = tomllib.loads(path.read_text())
        threads = [thread for thread in fabric["thread"] if thread["coverage"] > 0]
        narrow = min(thread["gamma_s_deg"] for thread in threads)
        tilts = [offset for thread in threads for offset in thread["tangent_offsets_deg"]]
        turns = "yes" if any(isinstance(thread["direction_deg"], list) for thread in threads) else ""
        names = ", ".join(thread["name"] for thread in threads)
        rows.append([f"[{path.stem}](../tables/fabrics/{path.name})", names, f"{narrow:g}°", f"{min(tilts):g}° to {max(tilts):g}°", turns])
    return table(["file", "visible threads", "narrowest γ_s", "tilts", "direction changes along the curve"], rows)


# ---- Drawings: a thread's curve, and how much of its length has which tilt.

DRAWN = [
    ("linen-plain", "warp", "one segment"),
    ("silk-shot", "warp", "two single tilts, a segment between"),
    ("denim", "warp", "three segments"),
    ("velvet", "weft", "two segments and a jump"),
]
PANEL, HEIGHT, MARGIN = 210, 260, 18


def curve(fabric, name, caption):
    """SVG of one thread: its side view above, its distribution of tilts below."""
    data = tomllib.loads((ROOT / "tables" / "fabrics" / f"{fabric}.toml").read_text())
    thread = next(thread for thread in data["thread"] if thread["name"] == name)
    offsets, lengths = thread["tangent_offsets_deg"], thread["tangent_lengths"]
    total = sum(lengths)
    x, z, pieces, path = 0.0, 0.0, [], []
    # From the last part to the first, as which the thread lies on the cloth like a bridge; their order does not matter.
    for start, end, length in reversed(list(zip(offsets[1:], offsets, lengths))):
        if length == 0:
            pieces.append(path)
            path = []
            continue
        if not path:
            path = [(x, z)]
        for k in range(24):
            tilt = math.radians(start + (end - start) * (k + 0.5) / 24)
            x, z = x + length / 24 * math.cos(tilt), z + length / 24 * math.sin(tilt)
            path.append((x, z))
    pieces = [piece for piece in [*pieces, path] if piece]
    points = [point for piece in pieces for point in piece]
    low, high = min(point[1] for point in points), max(point[1] for point in points)
    width = max(point[0] for point in points)
    scale = min((PANEL - 2 * MARGIN) / max(width, 1e-9), 84 / max(high - low, 1e-9))
    left = 0.5 * (PANEL - scale * width)
    middle = 130 + scale * low
    text = [f'<text x="{PANEL / 2:.0f}" y="14" class="t">{fabric}, {name}</text>', f'<text x="{PANEL / 2:.0f}" y="30" class="c">{caption}</text>']
    text += [f'<line x1="{MARGIN}" y1="132" x2="{PANEL - MARGIN}" y2="132" class="a"/>']
    for piece in pieces:
        text.append('<polyline class="p" points="' + " ".join(f"{left + scale * x:.1f},{middle - scale * z:.1f}" for x, z in piece) + '"/>')
    base, tall = HEIGHT - 30, 78
    at = lambda degrees: MARGIN + (PANEL - 2 * MARGIN) * (degrees + 90) / 180
    segments = [(min(a, b), max(a, b), l / total) for a, b, l in zip(offsets, offsets[1:], lengths) if l > 0]
    densest = max((share / (end - start) for start, end, share in segments if end > start), default=1.0)
    for start, end, share in sorted(segments, key=lambda segment: segment[0] == segment[1]):
        if start == end:
            text.append(f'<line x1="{at(start):.1f}" y1="{base}" x2="{at(start):.1f}" y2="{base - tall * min(1.0, 2 * share):.1f}" class="s"/>')
        else:
            rise = 0.6 * tall * share / (end - start) / densest
            text.append(f'<rect x="{at(start):.1f}" y="{base - rise:.1f}" width="{at(end) - at(start):.1f}" height="{rise:.1f}" class="b"/>')
    text.append(f'<line x1="{MARGIN}" y1="{base}" x2="{PANEL - MARGIN}" y2="{base}" class="a"/>')
    for degrees in (-90, 0, 90):
        text.append(f'<text x="{at(degrees):.1f}" y="{base + 14}" class="c">{degrees}°</text>')
    return "\n".join(text)


def drawing():
    style = (
        "text{font:11px sans-serif;text-anchor:middle;fill:#374151}.t{font-weight:bold}.c{font-size:9.5px}"
        ".a{stroke:#9ca3af}.p{fill:none;stroke:#2563eb;stroke-width:3;stroke-linecap:round}.s{stroke:#b91c1c;stroke-width:3}.b{fill:#93c5fd;stroke:#2563eb}"
    )
    wide = PANEL * len(DRAWN)
    text = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {HEIGHT}" width="{wide}" height="{HEIGHT}">\n'
    text += f'<style>{style}</style>\n<rect width="{wide}" height="{HEIGHT}" fill="#fff"/>\n'
    for index, (fabric, thread, caption) in enumerate(DRAWN):
        text += f'<g transform="translate({index * PANEL} 0)">\n{curve(fabric, thread, caption)}\n</g>\n'
    return text + "</svg>\n"


# ---- What commands print.


class Tool:
    """The tool, and a folder for what it writes."""

    def __init__(self, folder):
        found = subprocess.run([ROOT / "scripts" / "tool.sh"], check=True, stdout=subprocess.PIPE, text=True)
        self.path, self.folder = found.stdout.strip(), pathlib.Path(folder)
        self.denim = self.folder / "denim.sateen"

    def run(self, *arguments):
        done = subprocess.run([self.path, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, check=True)
        return done.stdout, done.stderr

    def json(self, *arguments):
        return json.loads(self.run(*arguments, "--json")[0])

    def bake_denim(self):
        if not self.denim.exists():
            self.printed = self.run("bake", "denim", "-o", "denim.sateen")[0]
        return self.printed


def bake(tool):
    return "```text\n" + tool.bake_denim() + "```\n"


SCENES = {
    "product-shot": "product shot: nothing moves, an error of 0.5 % is good enough, colours are fixed",
    "collocated-scanner": "scanner: light from the camera",
    "character": "dancer under three lamps, the camera anywhere around her",
    "sun-path": "curtain in the sun of an afternoon, seen by who walks by",
}


def scenes(tool):
    whole = {row["fabric"]: int(row["decoded_bytes"]) for row in baseline("standard")}
    rows = []
    for name, title in SCENES.items():
        bakes = tool.json("bake", "--scene", ROOT / "tables" / "scenes" / f"{name}.toml", "-o", f"{name}/")["tables"]
        # Cloth without a grid takes no room anyway.
        for bake in (bake for bake in bakes if whole[bake["fabric"]]):
            sizes = [size(bake["decoded_bytes"]), size(whole[bake["fabric"]])]
            link = f"[{title}](../tables/scenes/{name}.toml)"
            rows.append([link, bake["fabric"], *sizes, percent(bake["error"]["all"]["mean"], 3)])
    return table(["scene", "fabric", "in memory", "instead of", "mean error in the scene"], rows)


def exports(tool):
    tool.bake_denim()
    rows = []
    for limit in ("8MiB", "1MiB"):
        for name, fetches in (("ktx2", 1), ("rgb9e5", 2), ("bc6h", 2)):
            said = tool.json("export", "denim.sateen", "--format", name, "--max-bytes", limit, "-o", f"{limit}-{name}.ktx2")
            mean = percent(said["error"]["exported"]["all"]["mean"])
            rows.append([f"`--format {name} --max-bytes {limit}`", size(said["texel_bytes"]), size(said["files"][0]["bytes"]), str(fetches), mean])
    return table(["denim, standard table", "texels in memory", "file", "fetches per thread", "mean error"], rows)


def ggx(tool):
    errors = {row["fabric"]: row["mean"] for row in baseline("standard")}
    rows = []
    for fabric in ("denim", "polyester-satin-charmeuse-front", "silk-shot", "velvet"):
        mean = tool.json("fit", "torrance-sparrow", fabric)["error"]["all"]["mean"]
        rows.append([fabric, percent(mean, 1), percent(errors[fabric], 3)])
    return table(["fabric", "anisotropic GGX over a diffuse base, best fit", "sateen, standard table"], rows)


FAST = {"numbers": numbers, "results-standard": lambda: results("standard"), "results-draft": lambda: results("draft"), "library": library}
SLOW = {"bake": bake, "scenes": scenes, "exports": exports, "ggx": ggx}


# ---- Checks.


def documents():
    top = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")]
    return [*top, *sorted((ROOT / "docs").glob("*.md")), ROOT / "examples" / "README.md", *sorted((ROOT / "examples").glob("*/README.md"))]


def missing_keys():
    """Keys of fabrics, patterns and scenes that no document names."""
    for room, document in (("fabric", "fabrics"), ("pattern", "patterns"), ("scene", "scenes")):
        text = (ROOT / "docs" / f"{document}.md").read_text()
        source = "\n".join(path.read_text() for path in sorted((ROOT / "src" / room).rglob("*.rs")))
        for body in re.findall(r"struct \w+Toml \{(.*?)\n\}", source, re.S):
            for key in re.findall(r"^\s*(?:pub(?:\([a-z]+\))? )?(\w+):", body, re.M):
                if not re.search(rf"`[^`\n]*\b{key}\b", text):
                    yield f"docs/{document}.md does not explain the key {key}"


def anchors(path):
    """The anchors of a document's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", re.sub(r"```.*?```", "", path.read_text(), flags=re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def dead_links():
    for path in documents():
        prose = re.sub(r"```.*?```", "", path.read_text(), flags=re.S)
        for target, anchor in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", prose):
            found = path.parent / target if target else path
            if re.match(r"[a-z]+:", target):
                continue
            if not found.exists() or (anchor and found.suffix == ".md" and anchor not in anchors(found)):
                yield f"{path.relative_to(ROOT)} links to {target}{'#' * bool(anchor)}{anchor}, which does not exist"


def same(a, b):
    """Whether two texts say the same, but for seconds, which no run repeats."""
    still = lambda text: re.sub(r"\b\d+(\.\d+)? s\b", "… s", text)
    return still(a) == still(b)


def main():
    arguments = set(sys.argv[1:])
    if not arguments <= {"--all", "--check"}:
        sys.exit(__doc__)
    is_check = "--check" in arguments
    wrong = [*missing_keys(), *dead_links()] if is_check else []
    with tempfile.TemporaryDirectory() as folder:
        tool = Tool(folder) if "--all" in arguments else None
        blocks = dict(FAST) | ({name: (lambda of=of: of(tool)) for name, of in SLOW.items()} if tool else {})
        known = FAST.keys() | SLOW.keys()
        files = {ROOT / "docs" / "pictures" / "tangents.svg": drawing()}
        for path in documents():
            text = path.read_text()
            for name in (match[2] for match in BLOCK.finditer(text) if match[2] not in known):
                wrong.append(f"{path.relative_to(ROOT)}: nothing makes the block {name}")
            replace = lambda match: match[1] + blocks[match[2]]() + match[3] if match[2] in blocks else match[0]
            files[path] = BLOCK.sub(replace, text)
    for path, text in files.items():
        before = path.read_text() if path.exists() else ""
        if same(before, text):
            continue
        if is_check:
            wrong.append(f"{path.relative_to(ROOT)} is not what scripts/docs.py writes: run it")
        else:
            path.write_text(text)
            print(path.relative_to(ROOT))
    lines = len((ROOT / "README.md").read_text().splitlines())
    if is_check and lines > MAX_README_LINES:
        wrong.append(f"README.md has {lines} lines, more than {MAX_README_LINES}")
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
