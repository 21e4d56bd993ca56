"""The recipe of irregular stick-slip gives back its truth; a reader of one's own reads its file."""

import runpy
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import asperity as asp
from asperity.protocol import load_protocol, record_run, run_protocol

RECIPE = Path(__file__).parents[2] / "examples" / "irregular_stick_slip.toml"


def test_the_recipe_gives_slips_and_friction_along_the_track(tmp_path) -> None:
    protocol = load_protocol(RECIPE)
    run_protocol(protocol, tmp_path / "slips.nc")
    trace = record_run(protocol.setup, tmp_path / "slips.nc")
    result = asp.measure(trace, stiffness="0.05 N/um", velocity="100 um/s", mass="1.6 kg")
    assert result.kind == "irregular stick-slip"
    with xr.open_dataset(tmp_path / "slips.nc") as run:
        time, position = run.time.values, run.displacement.values
    events = result.events
    before, after = np.interp([events.onset, events.end], time, position)
    # The slider creeps ever faster before its onset, which is no sharp instant.
    np.testing.assert_allclose(result.slip, after - before, rtol=0.03, atol=3e-7)
    # Where friction is higher the spring loads further.
    level = np.asarray(protocol.slider.law.level(before / 20e-6))
    assert np.corrcoef(events.force_before[1:], level[1:])[0, 1] > 0.8
    assert np.std(events.force_before) == pytest.approx(0.02, rel=0.5)


SCRIPT = Path(__file__).parents[2] / "examples" / "lab_reader.py"


def test_script_recognises_and_reads_its_own_file(capsys):
    runpy.run_path(str(SCRIPT))["main"]()
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["recognised: True", "columns: load cell (N), shear gauge (N)"]
