"""Many recordings in one table: rows, reasons, interruption and going on."""

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from asperity.cli.measure import FileRows
from asperity.errors import InputError
from asperity.measurement.campaign import run_campaign
from asperity.measurement.measure import measure_amplitudes
from asperity.outputs import Interrupted
from asperity.questions.recording import Measurement, Measurement as Question, Source
from asperity.recording.readers.from_file import read

AMPLITUDES, STARTS = (0.05, 0.1, 0.2), (5.0, 17.0, 29.0)


@pytest.fixture(scope="module")
def amplitudes(tmp_path_factory) -> Path:
    """Three amplitudes of 6 s between rests; the drop of friction is a fifth of each."""
    rng = np.random.default_rng(0)
    time = np.arange(41_000) * 1e-3
    load, friction = np.full(time.size, 7.0), np.full(time.size, 0.5)
    for epsilon, start in zip(AMPLITUDES, STARTS, strict=True):
        on = (time >= start) & (time < start + 6)
        phi = 2 * np.pi * 40.01 * time
        load = np.where(on, 7 * (1 + epsilon * np.cos(phi)), load)
        since = [-np.expm1(-np.clip(time - at, 0, None) / 0.1) for at in (start, start + 6)]
        friction = friction - 0.2 * epsilon * (since[0] - since[1])
        friction = friction + on * 0.01 * epsilon * np.cos(phi - 1.2)
    columns = time, load, 7 * friction
    noise = [0 * time, *(1e-3 * rng.standard_normal((2, time.size)))]
    path = tmp_path_factory.mktemp("lab") / "amplitudes.csv"
    header = "time (s),normal force (N),shear force (N)"
    values = np.stack(columns, axis=1) + np.stack(noise, axis=1)
    np.savetxt(path, values, "%.6f", ",", header=header, comments="")
    return path


def options(**changes) -> Question:
    chosen = {
        "modulated": True,
        "frequency": None,
        "exact_frequency": False,
        "harmonics": 2,
        "window": None,
        "whole_periods": False,
        "detrend": "linear",
    }
    return Question(**(chosen | changes))


ROWS = FileRows(Source(), options())


def table_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_every_amplitude_of_a_recording_has_its_delta_mu(amplitudes) -> None:
    found = measure_amplitudes(read(amplitudes), Measurement(harmonics=2))
    assert len(found) == 3
    for measurement, epsilon, start in zip(found, AMPLITUDES, STARTS, strict=True):
        reading = measurement.reading
        assert start < reading.start < reading.end < start + 6.1
        assert abs(reading.epsilon - epsilon) < 5 * reading.uncertainty("epsilon")
        # Five standard uncertainties: the seed is fixed.
        assert abs(measurement.delta_mu + 0.2 * epsilon) < 5 * measurement.delta_mu_uncertainty
        assert abs(reading.phasor(1).amplitude - 0.01 * epsilon) < 5 * reading.uncertainty("mu1")
        assert measurement.delta_mu_interval_95 > 1.9 * measurement.delta_mu_uncertainty


def test_a_table_has_a_row_for_each_part_and_a_reason_for_each_failure(
    amplitudes, tmp_path
) -> None:
    broken, missing = tmp_path / "broken.csv", tmp_path / "missing.csv"
    broken.write_text("time (s),temperature (K)\n1,2\n2,3\n", encoding="utf-8")
    files = [amplitudes, broken, missing]
    out = tmp_path / "campaign.csv"
    done = run_campaign(files, ROWS, out, inputs=ROWS.inputs())
    assert (done.files, done.rows, done.failed) == (3, 5, 2)
    rows = table_of(out)
    assert [r["file"] for r in rows] == [str(f) for f in (*3 * [amplitudes], broken, missing)]
    assert [float(r["epsilon"]) for r in rows[:3]] == pytest.approx(AMPLITUDES, rel=1e-3)
    assert [r["reason"] for r in rows[:3]] == ["", "", ""]
    assert all(r["epsilon"] == "" for r in rows[3:])
    assert "--" in rows[3]["reason"]
    assert "must be a file" in rows[4]["reason"]
    netcdf = tmp_path / "campaign.nc"
    run_campaign(files, ROWS, netcdf, inputs=ROWS.inputs(), jobs=2)
    with xr.open_dataset(netcdf) as data:
        assert data["delta_mu"].values[:3] == pytest.approx(
            [float(r["delta_mu"]) for r in rows[:3]]
        )
        assert np.isnan(data["delta_mu"].values[3:]).all()
        assert data["phase1"].attrs["units"] == "rad"
        assert data["reason"].values[4] == rows[4]["reason"]
    assert {p.name for p in tmp_path.iterdir()} == {"broken.csv", "campaign.csv", "campaign.nc"}


def test_a_campaign_of_which_a_process_ends_says_so_and_goes_on(amplitudes, tmp_path) -> None:
    files = [tmp_path / f"{name}.csv" for name in "ab"]
    part = b"".join(amplitudes.read_bytes().splitlines(keepends=True)[:14_000])
    for file in files:
        file.write_bytes(part)

    def rows_of(path: Path) -> list:
        if path.name == "b.csv":
            os._exit(9)  # as the system ends a process for want of memory
        return ROWS(path)

    out = tmp_path / "campaign.csv"
    with pytest.raises(InputError, match="jobs must be processes for which there is memory, got 2"):
        run_campaign(files, rows_of, out, inputs=ROWS.inputs(), jobs=2)
    assert not out.exists()
    done = run_campaign(files, ROWS, out, inputs=ROWS.inputs(), resume=True, jobs=2)
    assert (done.files, done.failed) == (2, 0)


def test_an_interrupted_campaign_goes_on(amplitudes, tmp_path) -> None:
    files = [tmp_path / f"{name}.csv" for name in "abc"]
    # The first amplitude alone.
    part = b"".join(amplitudes.read_bytes().splitlines(keepends=True)[:14_000])
    for file in files:
        file.write_bytes(part)
    out, asked = tmp_path / "campaign.csv", []

    def stop(done: int, total: int, label: str) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="2 of 3 files"):
        run_campaign(files, ROWS, out, inputs=ROWS.inputs(), progress=stop)
    assert not out.exists()
    with pytest.raises(InputError, match="go on with --resume"):
        run_campaign(files, ROWS, out, inputs=ROWS.inputs())
    other = FileRows(Source(), options(harmonics=3))
    with pytest.raises(InputError, match=r"options\.harmonics"):
        run_campaign(files, other, out, inputs=other.inputs(), resume=True)

    def counted(path: Path):
        asked.append(path)
        return ROWS(path)

    done = run_campaign(files, counted, out, inputs=ROWS.inputs(), resume=True)
    assert asked == files[2:]
    assert done.rows == 3
    straight = tmp_path / "straight.csv"
    run_campaign(files, ROWS, straight, inputs=ROWS.inputs())
    assert out.read_bytes() == straight.read_bytes()


def test_a_changed_reduction_file_is_noticed(amplitudes, tmp_path) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('[channels]\nload = "1 * normal force"\n', encoding="utf-8")
    files = [tmp_path / f"{name}.csv" for name in "ab"]
    for file in files:
        file.write_bytes(amplitudes.read_bytes())
    rows_of = FileRows(Source(recipe=recipe), options())
    out = tmp_path / "campaign.csv"

    def stop(done: int, total: int, label: str) -> None:
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        run_campaign(files, rows_of, out, inputs=rows_of.inputs(), progress=stop)
    recipe.write_text('[channels]\nload = "2 * normal force"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"source\.recipe\.channels\.load"):
        run_campaign(files, rows_of, out, inputs=rows_of.inputs(), resume=True)


def test_steps_and_holds_are_rows(pulled, tmp_path) -> None:
    velocities, lengths = (3e-6, 10e-6, 0.0, 10e-6), (200e-6, 300e-6, 20.0, 300e-6)
    time, slip, _, friction, bounds = pulled(velocities, lengths, (20,) * 4, noise=2e-4)
    file = tmp_path / "sliding.txt"
    header = "Time(s)\tDispl(microns)\tFriction"
    values = np.stack([time, 1e6 * slip, friction], axis=1)
    np.savetxt(file, values, "%.6f", "\t", header=header, comments="")
    rows_of = FileRows(Source(), options(modulated=False, harmonics=4))
    out = tmp_path / "campaign.csv"
    run_campaign([file], rows_of, out, inputs=rows_of.inputs())
    step, hold = table_of(out)
    assert (step["kind"], hold["kind"]) == ("step", "hold")
    assert float(step["start"]) == pytest.approx(bounds[1], abs=0.1)
    assert abs(float(step["rate_dependence"]) + 0.004) < float(step["rate_interval_95"])
    assert float(hold["hold_time"]) == pytest.approx(20, abs=0.1)
    assert step["hold_time"] == ""
    assert json.loads(json.dumps(rows_of.inputs()))["options"]["modulated"] is False


@pytest.mark.parametrize("name", ["campaign.txt", "campaign"])
def test_a_table_is_csv_or_netcdf(amplitudes, tmp_path, name) -> None:
    with pytest.raises(InputError, match="--out must be a CSV or a NetCDF file"):
        run_campaign([amplitudes], ROWS, tmp_path / name, inputs={})


def test_a_recording_is_not_overwritten(amplitudes, tmp_path) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes(amplitudes.read_bytes())
    with pytest.raises(InputError, match=r"a\.csv"):
        run_campaign([file], ROWS, file, inputs={})
    assert file.read_bytes() == amplitudes.read_bytes()
