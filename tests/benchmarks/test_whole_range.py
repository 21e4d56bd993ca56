"""Random points over the whole range: a run goes on where it was, and says what is wrong."""

import sys

import numpy as np

from benchmarks import whole_range


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
