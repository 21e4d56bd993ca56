"""The benchmark runs from end to end; no time is asserted, the errors are."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

#: Largest error of each method on the benchmark's points, with a margin over what it reaches.
WORST = {
    "asperity": 1e-8,
    "asperity, collocation only": 1e-8,
    "heyoka shooting": 1e-8,
    "SciPy shooting": 1e-7,
    "SciPy LSODA marching": 1e-7,
    "diffrax marching": 1e-7,
    "asperity transient": 1e-8,
    "mean and two harmonics": 1e-8,
    # Held against differences of orbits that are solved to some 1e-10, over steps of a hundredth.
    "the same with all derivatives": 1e-6,
    "solve_ivp LSODA": 1e-8,
    "odeint LSODA": 1e-8,
}


@pytest.mark.long
def test_two_points(tmp_path):
    out = tmp_path / "rows.json"
    options = ["--law", "elasto-plastic", "--points", "2", "--repeats", "1", "--million", "0"]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", *options, "--out", str(out)],
        cwd=ROOT,
        # Most programs are run once or twice: less time goes into compiling them.
        env=os.environ | {"JAX_DISABLE_MOST_OPTIMIZATIONS": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads(out.read_text())
    assert done.stdout.count("\n|") == len(rows) + 1
    found = {row["what"].rpartition(", ")[0] for row in rows}
    # These peers need not be installed.
    assert set(WORST) - {"heyoka shooting", "diffrax marching"} <= found
    for row in rows:
        assert row["seconds"] > 0
        method = row["what"].rpartition(", ")[0]
        errors = [row[name] for name in ("mean", "mu1", "mu2", "multipliers")]
        for error in errors:
            assert error is None or error < WORST[method], row
    assert all(row["mean"] is not None for row in rows if row["what"] == "asperity, elasto-plastic")
