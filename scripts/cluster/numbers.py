#!/usr/bin/env python3
"""Measures what docs/cluster.md says of time and room.

    scripts/cluster/numbers.py [--count N] [--rounds N] [--verify N] [--skip shards|verify|capacity …]

shards    N draft fabrics (200) by one process with two workers, and by two shards of one worker each at once, in turn: seconds, and
          seconds of processor time, which other work on the machine hardly changes.
verify    `sateen validate --list` of N small tables (10000): seconds and memory; and how long the list alone takes.
capacity  Tables per core-hour by preset, over six fabrics of the library; bytes of the library's tables by tables/baseline.csv.
SATEEN=PATH takes that tool.
"""
import argparse
import csv
import os
import pathlib
import subprocess
import tempfile
import time

import fabrics
from test import sateen

SAMPLE = ["denim", "linen-plain", "silk-shot", "velvet", "tshirt-white", "corduroy"]


def timed(*commands):
    """Seconds and seconds of processor time of commands that run at once, and the most kilobytes of one."""
    start, before = time.monotonic(), os.times()
    running = [subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL) for command in commands]
    most = 0
    for process in running:
        _, status, usage = os.wait4(process.pid, 0)
        if status != 0:
            raise SystemExit(f"{process.args} failed")
        most = max(most, usage.ru_maxrss)
    after = os.times()
    processor = after.children_user + after.children_system - before.children_user - before.children_system
    return time.monotonic() - start, processor, most


def shards(tool, folder, count, rounds):
    path = fabrics.write(folder / "fabrics", count)
    bake = [tool, "bake", "--list", path, "--preset", "draft", "--quiet"]
    totals = {"one process with -j 2": [0.0, 0.0], "two shards with -j 1": [0.0, 0.0]}
    for turn in range(rounds):
        for name, total in totals.items():
            output = ["-o", folder / f"{turn}-{name[:3]}"]
            of_shard = [[*bake, "--jobs", "1", "--shard", f"{shard}/2", *output] for shard in (1, 2)]
            seconds, processor, _ = timed(*([[*bake, "--jobs", "2", *output]] if "one" in name else of_shard))
            total[0] += seconds / rounds
            total[1] += processor / rounds
            load = os.getloadavg()[0]
            print(f"{count} fabrics, {name}: {seconds:.1f} s, {processor:.1f} s of processor time, load {load:.1f}", flush=True)
    one, two = totals.values()
    print(f"two shards: {two[0] / one[0]:.3f} times the time of one process, {two[1] / one[1]:.3f} times the processor time", flush=True)


def verify(tool, folder, count):
    path = fabrics.write(folder / "small", count, flat=True)
    bake = [tool, "bake", "--list", path, "--preset", "draft", "--quiet", "--resume", "-o", folder / "small-tables"]
    seconds, _, _ = timed(bake)
    print(f"{count} small tables: baked in {seconds:.0f} s", flush=True)
    seconds, processor, most = timed([tool, "validate", folder / "small-tables", "--list", path, "--quiet"])
    print(f"{count} small tables: validate takes {seconds:.1f} s ({processor:.1f} s of processor time), {most / 1000:.0f} MB", flush=True)
    seconds, processor, _ = timed([*bake, "--shard", "1/1000000"])
    print(f"{count} fabrics: a list takes {1e6 * processor / count:.0f} µs of processor time per fabric", flush=True)


def capacity(tool, folder):
    with open(fabrics.LIBRARY.parent / "baseline.csv") as file:
        rows = list(csv.DictReader(file))
    for preset, names in (("draft", SAMPLE), ("standard", SAMPLE), ("fine", ["denim"])):
        _, processor, most = timed([tool, "bake", *names, "--preset", preset, "--quiet", "--jobs", "1", "-o", f"{folder}/{preset}/"])
        sizes = [int(row["file_bytes"]) for row in rows if row["preset"] == preset]
        text = f"{preset}: {3600 * len(names) / processor:.0f} tables per core-hour over {len(names)} fabrics, {most / 1000:.0f} MB"
        if sizes:
            text += f"; {sum(sizes) / len(sizes) / 1e6:.2f} GB per thousand, by {len(sizes)} of the library"
        print(text, flush=True)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--verify", type=int, default=10000)
    parser.add_argument("--skip", nargs="*", default=[])
    arguments = parser.parse_args()
    tool = sateen()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        if "capacity" not in arguments.skip:
            capacity(tool, folder)
        if "verify" not in arguments.skip:
            verify(tool, folder, arguments.verify)
        if "shards" not in arguments.skip:
            shards(tool, folder, arguments.count, arguments.rounds)


if __name__ == "__main__":
    main()
