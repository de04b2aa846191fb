#!/usr/bin/env python3
"""Writes tables/baseline.csv: error and size of every fabric's tables, and their time on this machine.

    scripts/baseline.py [PRESET…] [FABRIC…]     default: draft standard fine, of all fabrics; other rows stay as they are

Errors, sizes and differences of pictures are the same everywhere; tests/table/accuracy.rs fails when an error has grown. Times are a record of the
machine that the script ran on, in batches and one pair at a time, and tested by nothing.
"""
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
OUTPUT = ROOT / "tables" / "baseline.csv"
COLUMNS = "fabric preset mean p99 max grazing_p99 rim_p99 rim_both_p99 rim_last_p99 decoded_bytes file_bytes ns speedup ns_scalar speedup_scalar sphere_flip sphere_error cylinders_flip cylinders_error".split()
LOOKS = COLUMNS[-4:]
PRESETS = ["draft", "standard", "fine"]


def build(folder):
    """The tool as it is now, whatever becomes of the sources meanwhile."""
    subprocess.run(["cargo", "build", "--quiet", "--release", "--locked"], cwd=ROOT, check=True)
    return shutil.copy(ROOT / "target" / "release" / "sateen", folder)


def rows(tool, preset, fabrics, folder):
    def sateen(*arguments):
        return subprocess.run([tool, *arguments], check=True, stdout=subprocess.PIPE).stdout

    bakes = json.loads(sateen("bake", *(fabrics or ["--all"]), "--json", "--preset", preset, "-o", f"{folder}/tables-{preset}/"))["tables"]
    report = f"{folder}/report-{preset}"
    sateen("report", *fabrics, "--presets", preset, "--no-sweep", "--no-fits", "--pairs", "4096", "-o", report)
    times, looks = {}, {}
    for row in csv.DictReader(open(f"{report}/report.csv")):
        times[row["fabric"], row["evaluator"], row["batch"]] = row["ns"], row["speedup"]
        looks[row["fabric"], row["evaluator"]] = [row[c] and f"{float(row[c]):.6f}" for c in LOOKS]
    for bake in bakes:
        fabric, error = bake["fabric"], bake["error"]
        ns, speedup = times[fabric, f"table:{preset}", "true"]
        ns_scalar, speedup_scalar = times[fabric, f"table:{preset}", "false"]
        numbers = [error["all"]["mean"], error["all"]["p99"], error["all"]["max"]]
        numbers += [error[pairs]["p99"] for pairs in ("grazing", "rim", "rim_both", "rim_last")]
        sizes = [bake["decoded_bytes"], bake["file_bytes"]]
        yield [fabric, preset, *(f"{number:.6f}" for number in numbers), *sizes, ns, speedup, ns_scalar, speedup_scalar,
               *looks[fabric, f"table:{preset}"]]


def main():
    presets = [argument for argument in sys.argv[1:] if argument in PRESETS] or PRESETS
    fabrics = [argument for argument in sys.argv[1:] if argument not in PRESETS]
    table = {}
    if OUTPUT.exists():
        table = {(row["fabric"], row["preset"]): [row.get(c, "") for c in COLUMNS] for row in csv.DictReader(open(OUTPUT))}
    with tempfile.TemporaryDirectory() as folder:
        tool = build(folder)
        for preset in presets:
            table |= {(row[0], row[1]): row for row in rows(tool, preset, fabrics, folder)}
    order = lambda key: (PRESETS.index(key[1]), key[0])
    with open(OUTPUT, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(table[key] for key in sorted(table, key=order))


if __name__ == "__main__":
    main()
