"""Benchmarks run to their end, and go on where they were; no time is asserted, the errors are."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import whole_range

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


def call(monkeypatch, capsys, folder):
    monkeypatch.setattr(whole_range, "SLICE", 3)
    # Of this seed all points are answered by two methods, and no pulse is narrow.
    options = ["--points", "6", "--seed", "10", "--out", str(folder)]
    monkeypatch.setattr(sys, "argv", ["whole_range", *options])
    whole_range.main()
    return capsys.readouterr().out


def test_goes_on_where_it_was_and_counts_what_is_wrong(tmp_path, monkeypatch, capsys):
    first = call(monkeypatch, capsys, tmp_path)
    assert "0 done\n3 done\n6 points in 2 of 2 slices" in first
    assert "obey the equations                 6" in first
    assert "contradict them                    0" in first
    kept, lost = sorted(tmp_path.iterdir())
    found = dict(np.load(kept))
    found["wrong"][:2] = True
    np.savez(kept, **found)
    written = kept.stat().st_mtime_ns
    lost.unlink()
    second = call(monkeypatch, capsys, tmp_path)
    assert "3 done\n6 points in 2 of 2 slices" in second
    assert "0 done" not in second
    assert kept.stat().st_mtime_ns == written
    assert "contradict them                    2" in second
