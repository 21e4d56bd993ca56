"""The benchmark of the readers runs, and its errors are small; its times are not tested."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def test_the_benchmark_reads_a_small_recording():
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.readers", "--megabytes", "0.1", "--repeats", "1"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    rows = [line.split("|") for line in done.stdout.splitlines()[2:]]
    assert [row[1].strip() for row in rows] == [
        "pandas, CSV",
        "asperity, CSV",
        "h5py, HDF5",
        "asperity, HDF5",
    ]
    # Numbers up to 10 of six decimals, in double precision.
    assert all(float(row[-2]) < 1e-14 for row in rows)
