"""One table of many recordings: its rows, the reasons of failures, and resuming."""

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from asperity.cli.measure import FileRows
from asperity.errors import InputError
from asperity.measurement.campaign import labelled_rows, run_campaign, sliding_rows
from asperity.measurement.conditions import conditions_of
from asperity.measurement.measure import measure_amplitudes
from asperity.measurement.sliding.measure import measure_sliding
from asperity.outputs import Interrupted
from asperity.questions.recording import Measurement as Question, Source
from asperity.recording.readers.from_file import read

AMPLITUDES, STARTS = (0.05, 0.1, 0.2), (5.0, 17.0, 29.0)


@pytest.fixture(scope="module")
def amplitudes(tmp_path_factory) -> Path:
    """A recording of three amplitudes between pauses; each lowers friction by a fifth of it."""
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


OPTIONS = Question(modulated=True, harmonics=2)
ROWS = FileRows(Source(), OPTIONS)


def copies(source: Path, folder: Path, names: str, lines: int | None = None) -> list[Path]:
    """Files of the first lines of a recording, one for each letter of `names`."""
    content = b"".join(source.read_bytes().splitlines(keepends=True)[:lines])
    files = [folder / f"{name}.csv" for name in names]
    for file in files:
        file.write_bytes(content)
    return files


def table_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_delta_mu_is_measured_at_every_amplitude(amplitudes) -> None:
    measurements = measure_amplitudes(read(amplitudes), OPTIONS)
    assert len(measurements) == 3
    for measurement, epsilon, start in zip(measurements, AMPLITUDES, STARTS, strict=True):
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


def test_a_campaign_whose_process_dies_is_refused_and_can_be_resumed(amplitudes, tmp_path) -> None:
    files = copies(amplitudes, tmp_path, "ab", lines=14_000)

    def rows_of(path: Path) -> list:
        if path.name == "b.csv":
            os._exit(9)  # as when the system kills a process that takes too much memory
        return ROWS(path)

    out = tmp_path / "campaign.csv"
    with pytest.raises(InputError, match="jobs must be processes for which there is memory, got 2"):
        run_campaign(files, rows_of, out, inputs=ROWS.inputs(), jobs=2)
    assert not out.exists()
    done = run_campaign(files, ROWS, out, inputs=ROWS.inputs(), resume=True)
    assert (done.files, done.failed) == (2, 0)


def test_an_interrupted_campaign_is_resumed_where_it_stopped(amplitudes, tmp_path) -> None:
    files = copies(amplitudes, tmp_path, "abc", lines=14_000)
    out, measured = tmp_path / "campaign.csv", []

    def stop(done: int, total: int, label: str) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="2 of 3 files"):
        run_campaign(files, ROWS, out, inputs=ROWS.inputs(), progress=stop)
    assert not out.exists()
    with pytest.raises(InputError, match="go on with --resume"):
        run_campaign(files, ROWS, out, inputs=ROWS.inputs())
    changed = FileRows(Source(), Question(modulated=True, harmonics=3))
    with pytest.raises(InputError, match=r"options\.harmonics"):
        run_campaign(files, changed, out, inputs=changed.inputs(), resume=True)

    def listed(path: Path):
        measured.append(path)
        return ROWS(path)

    done = run_campaign(files, listed, out, inputs=ROWS.inputs(), resume=True)
    assert measured == files[2:]
    assert done.rows == 3
    uninterrupted = tmp_path / "uninterrupted.csv"
    run_campaign(files, ROWS, uninterrupted, inputs=ROWS.inputs())
    assert out.read_bytes() == uninterrupted.read_bytes()


def test_resuming_with_a_changed_reduction_file_is_refused(amplitudes, tmp_path) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('[channels]\nload = "1 * normal force"\n', encoding="utf-8")
    files = copies(amplitudes, tmp_path, "ab")
    rows_of = FileRows(Source(recipe=recipe), OPTIONS)
    out = tmp_path / "campaign.csv"

    def stop(done: int, total: int, label: str) -> None:
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        run_campaign(files, rows_of, out, inputs=rows_of.inputs(), progress=stop)
    recipe.write_text('[channels]\nload = "2 * normal force"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"source\.recipe\.channels\.load"):
        run_campaign(files, rows_of, out, inputs=rows_of.inputs(), resume=True)


def test_each_velocity_step_and_hold_has_a_row(pulled, tmp_path) -> None:
    velocities, lengths = (3e-6, 10e-6, 0.0, 10e-6), (200e-6, 300e-6, 20.0, 300e-6)
    time, slip, _, friction, bounds = pulled(velocities, lengths, (20,) * 4, noise=2e-4)
    file = tmp_path / "sliding.txt"
    header = "Time(s)\tDispl(microns)\tFriction"
    values = np.stack([time, 1e6 * slip, friction], axis=1)
    np.savetxt(file, values, "%.6f", "\t", header=header, comments="")
    rows_of = FileRows(Source(), Question(modulated=False))
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
def test_a_table_must_be_csv_or_netcdf(amplitudes, tmp_path, name) -> None:
    with pytest.raises(InputError, match="--out must be a CSV or a NetCDF file"):
        run_campaign([amplitudes], ROWS, tmp_path / name, inputs={})


def test_a_recording_is_not_overwritten(amplitudes, tmp_path) -> None:
    (file,) = copies(amplitudes, tmp_path, "a")
    with pytest.raises(InputError, match=r"a\.csv"):
        run_campaign([file], ROWS, file, inputs={})
    assert file.read_bytes() == amplitudes.read_bytes()


@pytest.mark.parametrize("known", [True, False])
def test_the_settling_slip_of_a_table_is_a_length(pulled, sliding_trace, known) -> None:
    time, _, _, friction, bounds = pulled((3e-6, 10e-6), (4e-4, 6e-4), (50, 50))
    velocities = (3e-6, 10e-6) if known else None
    question = Question(steps=bounds[1:2], velocities=velocities)
    measurement = measure_sliding(sliding_trace(time, friction), question)
    table = labelled_rows(sliding_rows(Path("run.csv"), measurement))
    assert table.settling_slip.units == "m"
    (slip,) = table.settling_slip.values
    assert 0 < slip < 6e-4 if known else np.isnan(slip)


def test_recordings_of_one_name_do_not_share_a_row_of_conditions(tmp_path) -> None:
    files, table = [tmp_path / day / "run.csv" for day in ("day1", "day2")], tmp_path / "rigs.csv"
    table.write_text("file,K\nday1/run.csv,100\nday2/run.csv,300\n")
    assert [c["stiffness"] for c in conditions_of(files, str(table)).values()] == [100, 300]
    for name in ("day1/run.csv", "run"):
        table.write_text(f"file,K\n{name},100\n")
        with pytest.raises(InputError, match="must have one row for each recording, got one for"):
            conditions_of(files, str(table))
        assert conditions_of(files[:1], str(table)) == {files[0]: {"stiffness": 100.0}}


def test_two_quantities_of_a_name_have_text_between_them() -> None:
    files = [Path("k12_v3.csv")]
    both = conditions_of(files, "k{K N/m}_v{V um/s}")
    assert both[files[0]] == {"stiffness": "12 N/m", "velocity": "3 um/s"}
    with pytest.raises(InputError, match="must have text between two quantities"):
        conditions_of([Path("123.csv")], "{K N/m}{V um/s}")
