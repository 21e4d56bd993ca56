"""`asperity measure` on recordings that the tests write."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.questions.options import measure_options
from asperity.questions.recording import Measurement
from references.commands import refused
from references.populations import population

F, EPSILON, MU1, PHASE1 = 40.02, 0.2, 2e-3, -1.4


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    """Ten seconds of modulation between pauses, with units in the header."""
    rng = np.random.default_rng(0)
    time = np.arange(12_000) * 1e-3
    phi = 2 * np.pi * F * time + 0.3
    on = (time > 2) & (time < 10)
    load = 7 * (1 + EPSILON * on * np.cos(phi)) + 1e-3 * rng.standard_normal(time.size)
    force = 7 * (0.4 - 0.06 * on + on * MU1 * np.cos(phi + PHASE1))
    force = force + 1e-3 * rng.standard_normal(time.size)
    path = tmp_path_factory.mktemp("lab") / "recording.csv"
    header = "time (s),normal force (N),shear force (N)"
    np.savetxt(path, np.c_[time, load, force], "%.7f", ",", header=header, comments="")
    return path


@pytest.fixture(scope="module")
def step(tmp_path_factory) -> Path:
    """A velocity step as rock laboratories write it: tabs, microns, MPa, two rates."""
    rng = np.random.default_rng(1)
    time = np.concatenate([np.arange(0, 60, 0.1), np.arange(60, 120, 0.02)])
    after = np.clip(time - 70, 0, None)
    slip = 3 * np.minimum(time, 70) + 10 * after
    friction = 0.6 + np.where(time >= 70, -0.003 + 0.012 * np.exp(-after), 0)
    friction = friction + 4e-4 * rng.standard_normal(time.size)
    stress = 20 + 1e-3 * rng.standard_normal(time.size)
    path = tmp_path_factory.mktemp("rock") / "step.txt"
    header = "Time(s)\tDispl(microns)\tFriction\tNormal_stress(MPa)"
    np.savetxt(path, np.c_[time, slip, friction, stress], "%.6f", "\t", header=header, comments="")
    return path


def record(result) -> dict:
    assert result.stdout.startswith("{")
    return json.loads(result.stdout)


def test_json_has_the_planted_numbers(asperity, recording) -> None:
    result = asperity("measure", recording, "--json")
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    measurement = record(result)
    doubt = measurement["uncertainties"]
    truth = {"epsilon": EPSILON, "frequency": F, "mu1": MU1, "phase1": PHASE1, "delta_mu": -0.06}
    for name, true in truth.items():
        assert abs(measurement[name] - true) < 5 * doubt[name], name
        assert doubt[name] > 0
    assert 1.9 < measurement["intervals_95"]["delta_mu"] / doubt["delta_mu"] < 13
    assert measurement["verdict"] == "ok"
    assert measurement["unit"] == "N"
    assert measurement["channels"] == {"W": "normal force", "F": "shear force"}
    assert measurement["window"]["chosen_by"] == "program"
    assert 2 < measurement["window"]["start"] < measurement["window"]["end"] < 10
    assert {"name", "number", "suspicious", "bad", "verdict", "sentence"} == set(
        measurement["checks"][0]
    )
    assert measurement["provenance"]["recording"] == str(recording)


def test_text_says_the_same(asperity, recording) -> None:
    result = asperity("measure", recording, "--harmonics", "2")
    assert result.exit_code == 0
    lines = [line.split() for line in result.stdout.splitlines()]
    printed = {words[0]: words[1:] for words in lines if words}
    assert abs(float(printed["mu1"][0]) - MU1) < 5 * float(printed["mu1"][2])
    assert abs(float(printed["frequency"][0]) - F) < 5 * float(printed["frequency"][3])
    assert "mu2" in printed
    assert "mu3" not in printed
    assert "quality" in printed
    checks = record(asperity("measure", recording, "--harmonics", "2", "--json"))["checks"]
    names = {check["name"] for check in checks if check["verdict"] == "ok"}
    assert sum(words[0] == "ok" for words in lines if words) == len(names)


def test_options_reach_the_reading(asperity, recording) -> None:
    options = ("--load", "normal force", "--force", "shear force", "--time", "time")
    reading = ("--window", "3:9.5", "--detrend", "none", "--whole-periods", "-f", "41 Hz")
    measurement = record(asperity("measure", recording, *options, *reading, "--json"))
    window = measurement["window"]
    assert window["start"] == pytest.approx(3)
    assert 9.5 - 1 / F - 2e-3 < window["end"] <= 9.5
    assert window["chosen_by"] == "user"
    assert abs(measurement["frequency"] - F) < 5 * measurement["uncertainties"]["frequency"]


def test_columns_and_units_that_the_file_leaves_open(asperity, recording, tmp_path) -> None:
    bare = tmp_path / "bare.csv"
    rows = recording.read_text().splitlines()[1:]
    bare.write_text("t,a,b\n" + "\n".join(rows))
    options = ("--load", "a", "--force", "b", "--unit", "a=N", "--unit", "b=N", "--time", "t")
    measurement = record(asperity("measure", bare, *options, "--unit", "t=s", "--json"))
    assert measurement["unit"] == "N"
    assert abs(measurement["mu1"] - MU1) < 5 * measurement["uncertainties"]["mu1"]


@pytest.mark.parametrize("window", ["4000 ms: 9", "4:9 s"])
def test_windows_as_people_write_them(asperity, recording, window) -> None:
    measurement = record(asperity("measure", recording, "--window", window, "--json"))
    assert measurement["window"]["start"] == pytest.approx(4, abs=1e-6)
    assert measurement["window"]["end"] == pytest.approx(9, abs=1e-6)


@pytest.mark.parametrize(
    ("fields", "options"),
    [
        ({"steps": (12.5, 60.0)}, ["--steps 12.5,60"]),
        ({"window": (12.5, 60.0)}, ["--window 12.5:60"]),
        ({"holds": ((1.0, 2.0),)}, ["--holds 1:2"]),
    ],
)
def test_a_measurement_as_options(fields, options) -> None:
    assert measure_options(Measurement(**fields), modulated=False)[1:] == options


def test_an_exact_frequency_is_not_fitted(asperity, recording) -> None:
    result = asperity("measure", recording, "-f", f"{F} Hz", "--exact-frequency", "--json")
    measurement = record(result)
    assert measurement["frequency"] == pytest.approx(F, rel=1e-12)
    assert measurement["uncertainties"]["frequency"] == 0


def test_a_bad_verdict_is_exit_code_1_with_its_sentence(asperity, recording, tmp_path) -> None:
    rows = recording.read_text().splitlines()
    noisy = tmp_path / "slow.csv"
    shaken = [rows[0]]
    for row in rows[1:]:
        t, w, f = map(float, row.split(","))
        shaken.append(f"{t:.4f},{w:.6f},{f + 0.2 * np.sin(2 * np.pi * 1.7 * t):.6f}")
    noisy.write_text("\n".join(shaken))
    result = asperity("measure", noisy)
    assert result.exit_code == 1
    assert "asperity: stick-slip is bad" in result.stderr
    assert "1.70" in result.stderr


def test_plots_are_pictures(asperity, recording, step, tmp_path) -> None:
    for arguments in ((recording,), (step, "--no-modulation")):
        picture = tmp_path / f"{arguments[0].stem}.png"
        result = asperity("measure", *arguments, "--plot", picture)
        assert result.exit_code == 0, result.output
        content = picture.read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) > 20_000


def test_a_velocity_step(asperity, step) -> None:
    result = asperity("measure", step, "--no-modulation", "--json")
    assert result.exit_code == 0, result.output
    measurement = record(result)
    first, second = measurement["segments"]
    assert second["start"] == pytest.approx(70, abs=0.2)
    assert first["velocity"] == pytest.approx(3e-6, rel=1e-2)
    assert second["velocity"] == pytest.approx(10e-6, rel=1e-2)
    (change,) = measurement["steps"]
    assert abs(change["change"] + 0.003) < 5 * change["uncertainty"]
    assert change["rate_dependence"] == pytest.approx(-0.003 / np.log(10 / 3), abs=3e-4)
    assert measurement["load"]["value"] == pytest.approx(20e6, rel=1e-3)
    assert [rate["rate"] for rate in measurement["rates"]] == pytest.approx([50, 10])
    text = asperity("measure", step, "--no-modulation", "--window", ":119").stdout
    assert "A - B" in text
    assert "um/s" in text


@pytest.mark.parametrize("load", [True, False])
@pytest.mark.parametrize("seed", population(3))
def test_a_constant_load_is_noticed(asperity, tmp_path, load, seed) -> None:
    """Steps and holds are read without --no-modulation, and stderr says so."""
    rng = np.random.default_rng(seed)
    at, velocities = rng.uniform(50, 70), rng.permutation([2.0, 7.0])
    time = np.arange(0, 120, 0.05)
    after = np.clip(time - at, 0, None)
    slip = velocities[0] * np.minimum(time, at) + velocities[1] * after
    friction = 0.6 - 0.004 * (time >= at) + 4e-4 * rng.standard_normal(time.size)
    names, columns = ["Time(s)", "Displ(microns)", "Friction"], [time, slip, friction]
    if load:
        names.append("Normal_stress(MPa)")
        columns.append(20 + 1e-3 * rng.standard_normal(time.size))
    path = tmp_path / "step.txt"
    np.savetxt(path, np.stack(columns, 1), "%.6f", "\t", header="\t".join(names), comments="")
    chosen = asperity("measure", path, "--no-modulation", "--json")
    noticed = asperity("measure", path, "--json")
    assert len(record(chosen)["steps"]) == 1
    assert (noticed.stdout, noticed.exit_code) == (chosen.stdout, chosen.exit_code)
    extra = noticed.stderr.removesuffix(chosen.stderr)
    assert extra.endswith(": velocity steps and holds are read.\n")
    assert extra.count("\n") == 1
    assert asp.measure(path).steps == asp.measure(path, modulated=False).steps
    # What the user says of it is not set aside.
    for options in (
        *(("--frequency", "5 Hz"), ("--amplitudes",)),
        *(("--harmonics", "2"), ("--whole-periods",), ("--set", "K=1 N/m")),
    ):
        assert asperity("measure", path, *options).exit_code == 2
    with pytest.raises(InputError):
        asp.measure(path, modulated=True)


def test_a_table_of_modulated_and_unmodulated_files(asperity, recording, step, tmp_path) -> None:
    out = tmp_path / "campaign.csv"
    result = asperity("measure", recording, step, "--out", out, "--jobs", 1)
    assert result.exit_code == 0, result.output
    assert "1 of 2 files have a constant load" in result.stderr
    with out.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["kind"] for row in rows] == ["amplitude", "step"]
    assert not any(row["reason"] for row in rows)
    assert abs(float(rows[1]["change"]) + 0.003) < 5 * float(rows[1]["change_uncertainty"])


def test_a_stated_load_that_a_file_of_a_table_contradicts_is_its_reason(
    asperity, recording, tmp_path
) -> None:
    out = tmp_path / "campaign.csv"
    result = asperity("measure", recording, "--out", out, "--set", "W0=50 N")
    assert result.exit_code == 1
    assert "--set W0 must agree with the recorded load, 7 N, got 50.0 N" in out.read_text()


def test_a_file_that_is_not_there(asperity, tmp_path) -> None:
    refused(asperity("measure", tmp_path / "none.csv"))


def test_a_constant_load_is_told_what_to_do(asperity, tmp_path) -> None:
    path = tmp_path / "constant.csv"
    rows = [f"{i * 1e-3:.3f},7,{2.8 + 0.01 * (i % 7)}" for i in range(500)]
    path.write_text("time (s),W (N),F (N)\n" + "\n".join(rows))
    result = asperity("measure", path)
    assert result.exit_code == 2
    assert "got a constant load, and velocity steps cannot be seen: neither" in result.stderr
    assert result.stderr.partition("; --stick-slip reads")[0].endswith("--steps and --velocities")
    result = asperity("measure", path, "-f", "3 Hz", "--velocities", "1 um/s")
    assert "--velocities must be one more than the steps, got 1 for 0" in result.stderr
    # Sorted times would belong to other velocities.
    unsorted = ("--steps", "0.4,0.2", "--velocities", "1 um/s,10 um/s,3 um/s")
    result = asperity("measure", path, *unsorted)
    assert "--steps must rise where velocities are given, got 0.4, 0.2" in result.stderr
    path.write_text("time (s),W,mu\n" + "\n".join(rows))
    assert asperity("measure", path).stderr == asperity("measure", path, "--unit", "W=N").stderr


def test_a_file_without_times_of_stresses_in_groups(asperity, tmp_path) -> None:
    import h5py

    rng = np.random.default_rng(4)
    time = np.arange(8000) * 1e-3
    phi = 2 * np.pi * F * time
    with h5py.File(tmp_path / "runs.h5", "w") as file:
        for name, size in (("short", 500), ("long", 8000)):
            load = 2 * (1 + EPSILON * np.cos(phi)) + 1e-3 * rng.standard_normal(phi.size)
            force = 2 * (0.4 + MU1 * np.cos(phi + PHASE1)) + 1e-4 * rng.standard_normal(phi.size)
            for channel, values in (("normal stress", load), ("shear stress", force)):
                file[f"{name}/{channel}"] = values[:size]
                file[f"{name}/{channel}"].attrs["units"] = "MPa"
    options = ("--rate", "1 kHz", "--group", "long", "--json")
    stress = record(asperity("measure", tmp_path / "runs.h5", *options))
    force = record(asperity("measure", tmp_path / "runs.h5", *options, "--area", "25 cm^2"))
    assert (stress["unit"], force["unit"]) == ("Pa", "N")
    assert stress["W0"] == pytest.approx(2e6, rel=1e-3)
    assert force["W0"] == pytest.approx(2e6 * 25e-4, rel=1e-3)
    assert force["mu1"] == pytest.approx(stress["mu1"], rel=1e-9)
    assert abs(stress["frequency"] - F) < 5 * stress["uncertainties"]["frequency"]
    refused(asperity("measure", tmp_path / "runs.h5", "--rate", "1 kHz"), "'short' (500 rows)")


@pytest.mark.parametrize("part", population([0.777, 0.4, 0.5]))
def test_a_file_cut_in_the_middle_is_measured_and_the_cut_is_bad(
    asperity, recording, tmp_path, part
) -> None:
    whole = recording.read_bytes()
    path = tmp_path / "cut.csv"
    path.write_bytes(whole[: int(part * len(whole)) // 7 * 7 + 3])
    result = asperity("measure", path, "--window", f"2.2:{11 * part}", "--json")
    assert result.exit_code == 1
    measurement = record(result)
    assert "asperity: truncated is bad" in result.stderr
    assert measurement["verdict"] == "bad"
    assert abs(measurement["mu1"] - MU1) < 5 * measurement["uncertainties"]["mu1"]


def test_steps_and_holds_of_the_user(asperity, step, tmp_path) -> None:
    listed = tmp_path / "steps.txt"
    listed.write_text("# time (s)\n69.5\n", encoding="utf-8")
    for given in ("69.5", "69.5 s", listed):
        result = asperity("measure", step, "--no-modulation", "--steps", given, "--json")
        assert result.exit_code == 0, result.output
        measurement = record(result)
        assert [s["time"] for s in measurement["steps"]] == [69.5]
        assert measurement["chosen_by"] == "user"
    spans = tmp_path / "holds.txt"
    spans.write_text("20 30\n40, 45\n", encoding="utf-8")
    for given in ("20:30,40:45", spans):
        result = asperity("measure", step, "--no-modulation", "--holds", given, "--json")
        measurement = record(result)
        assert [(h["start"], h["end"]) for h in measurement["holds"]] == [(20, 30), (40, 45)]


def test_amplitudes_and_a_table(asperity, recording, tmp_path) -> None:
    result = asperity("measure", recording, "--amplitudes", "--json")
    (row,) = record(result)["amplitudes"]
    assert row["epsilon"] == pytest.approx(EPSILON, rel=1e-3)
    picture = tmp_path / "amplitudes.png"
    result = asperity("measure", recording, "--amplitudes", "--plot", picture)
    assert "delta_mu" in result.stdout
    assert picture.read_bytes().startswith(b"\x89PNG")
    out = tmp_path / "table.csv"
    constant = tmp_path / "constant.csv"
    rows = [f"{i * 1e-3:.3f},7,{2.8 + 0.01 * (i % 7)}" for i in range(500)]
    constant.write_text("time (s),W (N),F (N)\n" + "\n".join(rows))
    result = asperity("measure", recording, constant, "--out", out, "--jobs", "1", "--json")
    assert result.exit_code == 1
    assert record(result) == {"files": 2, "rows": 2, "failed": 1, "out": str(out)}
    assert "the column 'reason'" in result.stderr
    assert out.read_text(encoding="utf-8").count("\n") == 3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--window", "12:4"], "--window must end after it begins"),
        (["--window", "4:4.001"], "--window must enclose"),
        (["--window", "10"], "--window must be START:END"),
        (["--set", "K=1 N/m"], "--set K must go with slip events, got it with a recording without"),
        (["--exact-frequency"], "--exact-frequency must go with --frequency"),
        (["--unit", "N"], "--unit must be NAME=VALUE"),
        (["--column", "velocity"], "--column must be NAME=VALUE"),
        (["--plot", "out.pdf"], "--plot must be a PNG file"),
        (["--plot", "no/such/folder/out.png"], "--plot must lie in a folder that exists"),
        (["--force", "nothing"], "--force must be a column"),
        (["--harmonics", "64"], "--harmonics must lie below half the sampling rate"),
        (["--no-modulation", "--steps", "900"], "--steps must lie inside the recording"),
        (["--no-modulation", "--steps", "no/such/file"], "--steps must be times or a file"),
        (["--no-modulation", "--holds", "5"], "--holds must be START:END"),
        (["--no-modulation", "--holds", "5:"], "--holds must have a start and an end"),
        (["--no-modulation", "--amplitudes"], "--amplitudes must go without"),
        (["--amplitudes", "--set", "V=1 um/s"], "--amplitudes must go without --set and --cond"),
        (["--resume"], "--resume, --jobs and --thresholds must go with --out"),
        (["--out", "table.txt"], "--out must be a CSV or a NetCDF file"),
        (["--out", "table.csv", "--plot", "a.png"], "must go with one recording without --out"),
    ],
)
def test_errors_name_the_option(asperity, recording, options, message) -> None:
    result = asperity("measure", recording, *options)
    refused(result, message)
    for inside in ("measure.", "lock_in.", "columns=", "units=", "columns[", "Trace."):
        assert inside not in result.stderr


def test_several_recordings_need_a_table(asperity, recording, step) -> None:
    refused(
        asperity("measure", recording, step),
        "--out must be given with several recordings, got 2 without",
    )


def test_an_ambiguous_column_is_chosen_by_an_option(asperity, tmp_path) -> None:
    path = tmp_path / "two.csv"
    rng = np.random.default_rng(0)
    columns = np.c_[np.arange(100) * 0.1, 7 + rng.random((100, 3))]
    header = "time (s),normal force (N),shear force 1 (N),shear force 2 (N)"
    np.savetxt(path, columns, "%.5f", ",", header=header, comments="")
    refused(
        asperity("measure", path, "--no-modulation"),
        '--force "shear force 1"',
        "--force must name one channel, got several, ",
    )


def test_a_report_renames_parameters_only(asperity, recording, tmp_path):
    path = tmp_path / "A W0.csv"
    path.write_bytes(recording.read_bytes())
    shown = asperity("measure", path, "--names", "geophysics").stdout
    assert shown.startswith("A W0.csv: ")
    assert "mean of F/sigma_n" in shown
    assert "W0" not in shown.removeprefix("A W0.csv")
