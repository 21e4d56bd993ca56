"""Measurements in separate processes: all cores, memory, and the time of a command."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time

from benchmarks.table import Row

#: Run with the law, points, repeats and cores; prints seconds, cores and peak memory in bytes.
_WHOLE_BATCH = """
import json, os, resource, sys, time

if len(sys.argv) > 4:  # before libraries count the cores
    os.sched_setaffinity(0, map(int, sys.argv[4:]))
from benchmarks.cases import batch
from benchmarks.ours import respond
from asperity._processes import available_cores

if __name__ == "__main__":
    law, points, repeats = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    cores = available_cores()
    everything = batch(law, points)
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        converged = respond(everything, workers=cores).converged
        times.append(time.perf_counter() - start)
    assert converged.all()
    # Kibibytes on Linux, bytes on macOS; for the workers it is the largest of them.
    unit = 1 if sys.platform == "darwin" else 1024
    driver, worker = (
        resource.getrusage(who).ru_maxrss * unit
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    print(json.dumps({"seconds": times, "cores": cores, "bytes": driver, "worker": worker}))
"""

_COMMAND = (sys.executable, "-m", "asperity")
_RESPONSE = (
    *_COMMAND,
    *("response", "--law", "elasto-plastic", "--material", "bureau2000"),
    *("-V", "1 um/s", "-e", "0.24", "-f", "120 Hz", "--json"),
)


def whole_batch_rows(law: str, points: int, repeats: int, cores: set[int]) -> list[Row]:
    """`periodic_response` on all cores: the first call, which starts processes, and later calls."""
    measured = _on_all_cores(law, points, repeats + 1, cores)
    first, *warm = measured["seconds"]
    used = measured["cores"]
    peak = measured["bytes"] + used * measured["worker"]
    note = f"peak memory below {peak / 1e9:.2f} GB in all processes"
    rows = [Row(f"asperity on all cores, first call, {law}", points, first, used, note=note)]
    if warm:
        rows.append(Row(f"asperity on all cores, {law}", points, statistics.median(warm), used))
    return rows


def _on_all_cores(law: str, points: int, repeats: int, cores: set[int]) -> dict:
    arguments = map(str, (law, points, repeats, *sorted(cores)))
    done = subprocess.run(
        (sys.executable, "-c", _WHOLE_BATCH, *arguments), check=True, stdout=subprocess.PIPE
    )
    return json.loads(done.stdout.splitlines()[-1])


def start_up_rows(repeats: int) -> list[Row]:
    """Wall time of two commands in new processes, with compiled programs in the cache."""
    commands = {"asperity --version": (*_COMMAND, "--version"), "asperity response": _RESPONSE}
    return [
        Row(f"{what}, fresh process", 1, _wall_time(command, repeats))
        for what, command in commands.items()
    ]


def _wall_time(command: tuple[str, ...], repeats: int) -> float:
    times = []
    for _ in range(repeats + 1):  # the first fills the caches
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - start)
    return statistics.median(times[1:])
