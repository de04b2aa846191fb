#!/usr/bin/env python3
"""Bakes a list on a cluster's engine, kills some of it, and checks that the result is that of one undisturbed process.

    scripts/cluster/test.py slurm|parallel … [--count N] [--shards N] [--seed N] [--reference FOLDER]

slurm     starts slurmctld, slurmd and munged on loopback, all of their files in a temporary folder, and submits bake.sbatch as an array.
          It needs Debian's slurm-wlm and munge, and root. A random task is killed, then the daemon of the node with all that runs there.
parallel  runs GNU parallel with a job log. A random task is killed, then parallel itself with all that it runs.

Each then submits the same again until nothing is left to do. In the end `sateen validate` must find every table whole, all tables must
have the bytes of those that one process made, and no table may have been baked twice: what a kill costs is what was in hand.
Default: 200 draft fabrics in 8 shards. --reference keeps the undisturbed library there, for another run. SATEEN=PATH takes that tool.
"""
import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

import fabrics

HERE = pathlib.Path(__file__).resolve().parent
PRESET = ["--preset", "draft"]


def sateen():
    found = subprocess.run([HERE.parent / "tool.sh"], check=True, stdout=subprocess.PIPE, text=True)
    return found.stdout.strip()


def tables(folder):
    return {path.name: path.read_bytes() for path in pathlib.Path(folder).glob("*.sateen")}


def rows(folder):
    """Lines of all manifests that tell of a table."""
    lines = [line for path in pathlib.Path(folder).glob("manifest-*.jsonl") for line in path.read_text().splitlines()]
    return [row for row in map(json.loads, lines) if "name" in row]


def bakes(folder):
    """Processes that bake into a folder of this test, which no other has."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (path / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if b"bake" in words[:2] and os.fsencode(folder) in words:
            found.append(int(path.name))
    return found


def kill(*pids):
    for pid in pids:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass


def wait_until(what, ready, seconds=3600):
    deadline = time.monotonic() + seconds
    while not ready():
        if time.monotonic() > deadline:
            sys.exit(f"{what}: not within {seconds} s")
        time.sleep(0.2)


class Test:
    """A list, and what one process makes of it."""

    def __init__(self, arguments, folder):
        self.tool, self.folder, self.arguments = sateen(), pathlib.Path(folder), arguments
        self.list = fabrics.write(self.folder / "fabrics", arguments.count)
        self.reference = pathlib.Path(arguments.reference or self.folder / "reference")
        start = time.monotonic()
        command = [self.tool, "bake", "--list", self.list, "--resume", *PRESET, "-o", f"{self.reference}/"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        print(f"{len(tables(self.reference))} tables by one process in {time.monotonic() - start:.0f} s", flush=True)

    def validate(self, output):
        command = [self.tool, "validate", output, "--list", self.list, "--json", "--quiet"]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
        return done.returncode, json.loads(done.stdout)

    def run(self, engine, name):
        """Submits, kills, submits again."""
        output = self.folder / f"{name}-tables"
        output.mkdir()
        start = time.monotonic()
        engine.submit(output)
        disturbances = [
            (0.2, "a random task", lambda: kill(random.choice(bakes(output)))),
            (0.5, "the node", lambda: engine.crash(output)),
        ]
        for share, what, disturb in disturbances:
            made = lambda: len(list(output.glob("*.sateen")))
            wait_until(name, lambda: made() >= share * self.arguments.count and bakes(output) or engine.is_idle())
            if engine.is_idle():
                sys.exit(f"{name} ended before {what} was killed")
            before = len(bakes(output))
            disturb()
            print(f"{name}: killed {what} with {made()} tables done and {before} in hand", flush=True)
        wait_until(name, engine.is_idle)
        for attempt in range(1, 6):
            status, found = self.validate(output)
            print(f"{name}: {found['whole']} of {found['fabrics']} whole, validate exits with {status}", flush=True)
            if status == 0:
                break
            print(f"{name}: submitted again", flush=True)
            engine.submit(output)
            wait_until(name, engine.is_idle)
        else:
            sys.exit(f"{name}: not complete after {attempt} submissions")
        self.check(name, output, time.monotonic() - start)

    def check(self, name, output, seconds):
        expected = tables(self.reference)
        if tables(output) != expected:
            sys.exit(f"{name}: the tables differ from those of one process")
        baked = [row["name"] for row in rows(output)]
        if len(baked) != len(set(baked)):
            sys.exit(f"{name}: a table was baked twice")
        left = list(output.glob(".sateen-*.tmp"))
        if left:
            sys.exit(f"{name}: left over: {left}")
        print(f"{name}: {len(expected)} tables, the bytes of one process, none baked twice, in {seconds:.0f} s", flush=True)


class Parallel:
    def __init__(self, test):
        self.test, self.process = test, None

    def submit(self, output):
        shards = map(str, range(1, self.test.arguments.shards + 1))
        bake = [self.test.tool, "bake", "--list", self.test.list, "--shard", f"{{}}/{self.test.arguments.shards}"]
        bake += ["--resume", "--jobs", "1", "--quiet", *PRESET, "-o", output]
        log = self.test.folder / "parallel.log"
        command = ["parallel", "--will-cite", "--joblog", log, "--resume-failed", "--jobs", str(os.cpu_count()), *bake, ":::", *shards]
        self.process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def crash(self, output):
        kill(self.process.pid, *bakes(output))
        self.process.wait()

    def is_idle(self):
        return self.process.poll() is not None

    def stop(self):
        kill(self.process.pid)


class Slurm:
    def __init__(self, test):
        self.test, self.folder = test, test.folder / "slurm"
        for name in ("state", "spool"):
            (self.folder / name).mkdir(parents=True)
        host = socket.gethostname().split(".")[0]
        ports = [free_port(), free_port()]
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o600)
        munge = self.folder / "munge"
        munge.mkdir(mode=0o755)
        files = {name: munge / name for name in ("socket", "pid-file", "log-file", "seed-file")}
        self.munged = start("munged", "--foreground", "--force", f"--key-file={key}", *(f"--{name}={path}" for name, path in files.items()))
        wait_until("munged", files["socket"].exists, 30)
        configuration = self.folder / "slurm.conf"
        configuration.write_text(
            f"""ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={files["socket"]}
CredType=cred/munge
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
SlurmctldLogFile={self.folder}/slurmctld.log
SlurmdLogFile={self.folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=20
SlurmdParameters=config_overrides
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
        )
        os.environ["SLURM_CONF"] = str(configuration)
        self.controller = start("slurmctld", "-D")
        self.daemon = start("slurmd", "-D")
        wait_until("slurm", lambda: "idle" in ask("sinfo", "--noheader", "--format=%T"), 60)

    def submit(self, output):
        script = HERE / "bake.sbatch"
        array = ["--parsable", f"--array=1-{self.test.arguments.shards}", f"--output={self.folder}/task-%a-%j.log"]
        said = ask("sbatch", *array, f"--export=ALL,SATEEN={self.test.tool}", script, self.test.list, output, "--quiet", *PRESET)
        print(f"slurm: job {said.strip()}", flush=True)

    def crash(self, output):
        """As if the node lost its power: the daemon, what it started for the tasks, and these; then it comes back."""
        steps = [int(pid) for pid in ask("ps", "-C", "slurmstepd", "-o", "pid=").split() if is_of(pid, self.folder)]
        kill(self.daemon.pid, *steps, *bakes(output))
        self.daemon.wait()
        time.sleep(2)
        self.daemon = start("slurmd", "-D")

    def is_idle(self):
        return not ask("squeue", "--noheader").strip()

    def stop(self):
        for process in (self.daemon, self.controller, self.munged):
            process.terminate()
            process.wait()


def start(*command):
    return subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def ask(*command):
    done = subprocess.run(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0 and command[0] in ("sbatch",):
        sys.exit(f"{command[0]}: {done.stderr}")
    return done.stdout


def is_of(pid, folder):
    """Whether a process was started by the Slurm of this test."""
    try:
        return os.fsencode(folder) in pathlib.Path(f"/proc/{pid}/environ").read_bytes()
    except OSError:
        return False


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


ENGINES = {"slurm": Slurm, "parallel": Parallel}


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("engines", nargs="+", choices=ENGINES)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--shards", type=int, default=8)
    parser.add_argument("--seed", type=int, default=2013)
    parser.add_argument("--reference")
    arguments = parser.parse_args()
    random.seed(arguments.seed)
    needed = {"slurm": ("munged", "slurmctld", "slurmd", "sbatch"), "parallel": ("parallel",)}
    lacking = [name for engine in arguments.engines for name in needed[engine] if not shutil.which(name)]
    if lacking:
        sys.exit(f"install what is lacking: {', '.join(lacking)} (apt install slurm-wlm munge parallel)")
    with tempfile.TemporaryDirectory() as folder:
        test = Test(arguments, folder)
        for name in arguments.engines:
            engine = ENGINES[name](test)
            try:
                test.run(engine, name)
            finally:
                engine.stop()


if __name__ == "__main__":
    main()
