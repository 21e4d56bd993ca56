"""A sweep that is killed ten times at random moments, compared with an undisturbed one.

    python benchmarks/sweep_killed.py [KILLS] [SEED]

All files of both stores must be equal, except the attributes, which have version and machine.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

_PLAN = """
law = "{law}"
material = "bureau2000"
chunk = 200
outputs = ["mean_friction", "mu1", "mu2", "log_multiplier", "stable"]
[parameters]
V = "1 um/s"
frequency = "{frequency}"
[axes."K/Kc"]
from = 0.7
to = 2.0
count = 40
[axes.epsilon]
from = 0.01
to = 0.5
count = 200
"""


def files_of(store: Path) -> dict[str, bytes]:
    """All files of a store except its attributes."""
    return {
        str(f.relative_to(store)): f.read_bytes()
        for f in store.rglob("*")
        if f.is_file() and f != store / "zarr.json"
    }


def started(plan: Path, store: Path, workers: int) -> subprocess.Popen[bytes]:
    """A driver in a new process group."""
    command = [sys.executable, "-m", "asperity", "sweep", str(plan), "--out", str(store)]
    return subprocess.Popen(
        [*command, "--workers", str(workers)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def children(process: int) -> list[int]:
    """Processes that a process has started, and those that these have started."""
    processes = []
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        for child in task.read_text().split():
            processes += [int(child), *children(int(child))]
    return processes


def done(store: Path) -> int:
    """Number of chunks with a status."""
    return sum(len(names) for _, _, names in os.walk(store / "status" / "c"))


def main(
    kills: int = 10, seed: int = 1, law: str = "rice-ruina", frequency: str = "120 Hz"
) -> bool:
    """Kill, compare and print; True if all files are equal."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        plan = Path(folder, "plan.toml")
        plan.write_text(_PLAN.format(law=law, frequency=frequency))
        whole, broken = Path(folder, "whole.zarr"), Path(folder, "broken.zarr")
        started(plan, whole, 1).wait()
        total = done(whole)
        counts = {"driver": 0, "worker": 0}
        while sum(counts.values()) < kills:
            before = done(broken) if broken.exists() else 0
            driver = started(plan, broken, 2)
            # The kill comes up to three chunks later.
            target = before + rng.choice([0, 1, 2, 3])
            while driver.poll() is None and (done(broken) if broken.exists() else 0) <= target:
                time.sleep(0.05)
            time.sleep(rng.random() * 0.3)
            if driver.poll() is not None:
                break
            who = rng.choice(["driver", "worker"])
            children_of_driver = children(driver.pid)
            if who == "worker" and children_of_driver:
                os.kill(rng.choice(children_of_driver), signal.SIGKILL)
                counts["worker"] += 1
                time.sleep(rng.random())
            if driver.poll() is None:
                os.kill(driver.pid, signal.SIGKILL)
                counts["driver"] += 1
            driver.wait()
            for process in children_of_driver:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            sys.stdout.write(f"{counts}: {done(broken)} of {total} chunks\n")
            sys.stdout.flush()
        code = started(plan, broken, 2).wait()
        same = files_of(whole) == files_of(broken)
        locks = [p.name for p in Path(folder).iterdir() if p.name.endswith((".lock",))]
        sys.stdout.write(f"killed {counts}, exit {code}, same bits: {same}, left: {locks}\n")
        return same


if __name__ == "__main__":
    sys.exit(0 if main(*map(int, sys.argv[1:])) else 1)
