#!/usr/bin/env python3
"""Kills bakes at random moments and checks that nothing is ever half written.

    scripts/kill.py [COUNT] [SEED]       default: 100 kills, seed 2013

`sateen bake --all --preset draft --resume` is killed with SIGKILL again and again: at moments spread over start-up, baking
and, every third time, as soon as a table is being written. After each kill every table there must load and have the bytes of an
undisturbed bake. When all tables are done, some are removed. The last bake is left alone: all tables must be the same, those
that were there must not have been touched, and no temporary file may be left.
"""
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# From start to kill, in mean times of a table: long enough to make one now and then, so that kills reach the whole library.
LONGEST = 1.5
# Tables are written within milliseconds: these are waited for, and then as long at most.
LONGEST_WRITE = 0.01


def build():
    subprocess.run(["cargo", "build", "--release", "--locked"], cwd=ROOT, check=True)
    target = os.environ.get("CARGO_TARGET_DIR", ROOT / "target")
    return pathlib.Path(target).resolve() / "release" / "sateen"


def command(sateen, folder):
    return [sateen, "bake", "--all", "--preset", "draft", "--resume", "--quiet", "-o", f"{folder}/"]


def bake(sateen, folder):
    subprocess.run(command(sateen, folder), check=True, stdout=subprocess.DEVNULL)


def tables(folder):
    return {path.name: path for path in folder.glob("*.sateen")}


def temporaries(folder):
    return list(folder.glob(".sateen-*.tmp"))


def check(sateen, folder, expected):
    """Every table loads, and is the one of the undisturbed bake."""
    for name, path in tables(folder).items():
        subprocess.run([sateen, "info", path], check=True, stdout=subprocess.DEVNULL)
        if path.read_bytes() != expected[name]:
            sys.exit(f"{path} differs from an undisturbed bake")


def kill_once(sateen, folder, moment, while_writing):
    """How the bake ended: "early" of itself, or where it was killed."""
    before = set(tables(folder))
    process = subprocess.Popen(command(sateen, folder), stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + moment
    while time.monotonic() < deadline and process.poll() is None:
        time.sleep(min(0.005, max(0.0, deadline - time.monotonic())))
    if while_writing:
        while process.poll() is None and not temporaries(folder):
            time.sleep(0.0002)
        time.sleep(random.uniform(0, LONGEST_WRITE))
    if process.poll() is not None:
        if process.returncode != 0:
            sys.exit(f"the bake ended with {process.returncode}")
        return "early"
    process.kill()
    process.wait()
    if process.returncode == 0:
        return "early"
    if temporaries(folder):
        return "writing"
    return "baking" if set(tables(folder)) != before or moment > 0.1 else "start-up"


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 2013
    random.seed(seed)
    sateen = build()
    with tempfile.TemporaryDirectory() as parent:
        undisturbed, folder = pathlib.Path(parent, "undisturbed"), pathlib.Path(parent, "killed")
        folder.mkdir()
        start = time.monotonic()
        bake(sateen, undisturbed)
        seconds = time.monotonic() - start
        expected = {name: path.read_bytes() for name, path in tables(undisturbed).items()}
        longest = LONGEST * seconds / len(expected)
        print(f"seed {seed}, {len(expected)} tables in {seconds:.1f} s, killed after up to {longest:.1f} s")
        ended = {"start-up": 0, "baking": 0, "writing": 0, "early": 0}
        most_left = 0
        while sum(ended.values()) - ended["early"] < count:
            # Start-up is short: a fifth of the moments are within a tenth of a second.
            moment = random.uniform(0, 0.1 if random.random() < 0.2 else longest)
            how = kill_once(sateen, folder, moment, while_writing=random.random() < 1 / 3)
            ended[how] += 1
            most_left = max(most_left, len(temporaries(folder)))
            check(sateen, folder, expected)
            if how == "early" or len(tables(folder)) == len(expected):
                for path in random.sample(sorted(tables(folder).values()), 8):
                    path.unlink()
            print(f"{moment:.3f} s: {how}, {len(tables(folder))} tables, {len(temporaries(folder))} left over", flush=True)

        kept = {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in tables(folder).values()}
        bake(sateen, folder)
        check(sateen, folder, expected)
        if set(tables(folder)) != set(expected):
            sys.exit("a table is missing")
        if any((path.stat().st_ino, path.stat().st_mtime_ns) != before for path, before in kept.items()):
            sys.exit("a whole table was written again")
        if temporaries(folder):
            sys.exit(f"left over: {temporaries(folder)}")
    kills = sum(ended.values()) - ended["early"]
    print(f"{kills} kills: {ended['start-up']} at start-up, {ended['baking']} while baking, {ended['writing']} while writing; ")
    print(f"at most {most_left} temporary files left at a time, none in the end; {len(kept)} of {len(expected)} tables kept by the last bake")


if __name__ == "__main__":
    main()
