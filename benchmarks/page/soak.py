"""The page left open while its sliders move: memory of the page and of the server.

``python -m benchmarks.page.soak --minutes 60`` moves three sliders of Explore in turn, ``--rate``
times a second. At intervals it prints the memory of the page's scripts after a garbage collection,
the numbers of elements and listeners, and the resident memory of the server and of its workers.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from benchmarks.page.latency import opened, slider
from benchmarks.page.serving import chromium, load, serving

SLIDERS = ("relative amplitude", "pulling velocity", "stiffness of the pulling")


def memory(process: int) -> float:
    """Resident memory (MB) of a process alone."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(x.split()[1]) / 1024 for x in lines if x.startswith("VmRSS"))


def resident(process: int) -> float:
    """Resident memory (MB) of a process and all that it started."""
    tasks = Path(f"/proc/{process}/task").iterdir()
    started = [int(child) for task in tasks for child in (task / "children").read_text().split()]
    return memory(process) + sum(map(resident, started))


def counted(session: Any) -> dict[str, float]:
    """Metrics of the page after a garbage collection."""
    session.send("HeapProfiler.collectGarbage")
    metrics = session.send("Performance.getMetrics")["metrics"]
    return {metric["name"]: metric["value"] for metric in metrics}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--every", type=float, default=3.0, help="minutes between two reports")
    parser.add_argument("--rate", type=float, default=2.0, help="movements a second")
    options = parser.parse_args()
    with serving() as server, chromium() as browser:
        page = opened(browser, server.port)
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable")
        handles = [slider(page, meaning) for meaning in SLIDERS]
        start = reported = time.monotonic()
        moved = 0
        print(
            "minutes  movements  heap MB  elements  listeners  server MB  with workers MB",
            flush=True,
        )
        while True:
            now = time.monotonic()
            over = now - start > 60 * options.minutes
            if moved == 60 or now - reported > 60 * options.every or over:
                reported = now
                held = counted(session)
                print(
                    f"{(now - start) / 60:7.1f}  {moved:9}  {held['JSHeapUsedSize'] / 1e6:7.1f}  "
                    f"{held['Nodes']:8.0f}  {held['JSEventListeners']:9.0f}  "
                    f"{memory(server.process):9.0f}  {resident(server.process):15.0f}  {load()}",
                    flush=True,
                )
            if over:
                break
            handle = handles[moved // 40 % len(handles)]
            handle.press("ArrowRight" if moved // 20 % 2 == 0 else "ArrowLeft")
            moved += 1
            page.wait_for_timeout(1e3 / options.rate)


if __name__ == "__main__":
    main()
