"""``asperity fit`` of a recording: a file in, numbers out; bad options in one sentence."""

import json
import os

import numpy as np
import pytest
from benchmarks.coverage import CASES, runs_of
from click.testing import CliRunner

from asperity.cli.main import main
from asperity.errors import InputError
from asperity.inference import answers
from asperity.inference.fitting.result import Fit


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    run = next(runs_of(CASES["steps"], 1))
    path = tmp_path_factory.mktemp("fit") / "steps.csv"
    rows = np.column_stack([run.time, 1e6 * run.slip, run.friction])
    header = "time (s),load point displacement (um),friction"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.9g")
    return path


def run_fit(*arguments):
    return CliRunner().invoke(main, ["fit", *map(str, arguments)])


#: Near the numbers of the recording, for a quick search; that of the slope has none.
START = ["--start", "A=0.009", "--start", "B=0.0105", "--start", "D0=6.5 um"]


def test_a_recording_is_fitted(recording):
    # At the rate of the other fits of this file, for one program.
    options = ["--free", "A,B,D0,K", "--fit-rate", "5 Hz", *START, "--json"]
    result = run_fit(recording, "--law", "rice-ruina", *options)
    assert result.exit_code == 0, result.output
    record = json.loads(result.stdout)
    K = record["parameters"]["K"]
    assert K["unit"] == "1/m"
    # The stiffness over the load that the recording was computed with.
    assert abs(K["value"] - 4e3) < 4 * K["se"]
    assert record["noise"]["model"].startswith("AR(")
    assert record["noise"]["effective_samples"] < 700


def test_files_that_a_lost_fit_does_not_have_are_named(recording, monkeypatch, tmp_path):
    """Only the exit code said that there is no report and no figure."""
    lost = Fit("rice-ruina", False, "the search ended", {}, objective=None)
    monkeypatch.setattr(answers, "answer_fit", lambda question, progress: lost)
    report, figure = tmp_path / "report", tmp_path / "fit.png"
    result = run_fit(recording, "--law", "rice-ruina", "--report", report, "--plot", figure)
    assert result.exit_code == 1
    assert f"there is no report {report}: the search ended" in result.stderr
    assert f"there is no figure {figure}: the search ended" in result.stderr


def test_priors_of_a_material_want_the_free_parameters(recording):
    result = run_fit(recording, "--law", "rice-ruina", "--prior", "bureau2000")
    assert "--prior bureau2000 must go with --free" in result.output + str(result.exception)


KNOWN = ["--fix", "B=0.01", "--fix", "D0=1 um"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--posterior", "--draws", "0"], "--draws must be at least 100, got 0; give a larger one"),
        (["--posterior", "--seed", "-1"], "--seed must be at least 0, got -1; give a larger one"),
        (
            ["--window", "1e5:2e5"],
            "--window must lie inside the recording, got 100000 s",
        ),
        (["--trend", "cubic"], "--trend must be one of none, linear, quadratic"),
        (["--initial", "any"], "--initial must be one of steady, free"),
        (["--prior", "K=3"], "--prior K must be VALUE+-DEVIATION UNIT"),
        (["--prior", "K=3+-0 1/um"], "must have a positive deviation"),
        (["--velocities", "1 um/s"], "must be one more than the steps"),
        (["--gauge", "-1 Hz"], "--gauge must be positive"),
        ([*KNOWN, "--inertia"], "--inertia must go with a value of M, got none; add --fix"),
        ([*KNOWN, "--radiation-damping"], "--radiation-damping must go with a value of eta"),
        (["--fix", "M=1 kg"], "--fix must be parameters that count, got 'M', which has no"),
        (["--fix", "eps_ratio=0.5"], "--fix eps_ratio must have an influence"),
        (["--law", "amontons"], "--law must be"),
        (["--fit-rate", "-1 Hz"], "--fit-rate must be positive"),
        (
            ["--fit-rate", "0.1 Hz"],
            "--fit-rate must leave 16 means or more of steps",
        ),
    ],
)
def test_bad_options_are_refused(recording, more, said):
    result = run_fit(recording, "--law", "rice-ruina", "--free", "A", *more)
    assert said in result.output + str(result.exception)
    assert "Traceback" not in result.output


@pytest.mark.long
def test_the_choice_of_the_window_is_an_uncertainty(recording):
    options = ["--windows", "auto", "--fit-rate", "5 Hz"]
    result = run_fit(recording, "--law", "rice-ruina", "--free", "A,B,D0,K", *options)
    assert result.exit_code == 0, result.output
    assert "1400 samples are compared as 700 means over blocks of 2" in result.output
    assert "over 4 windows (0 to 139.9, " in result.output
    assert "of the window" in result.output


def test_windows_and_a_window_are_refused(recording):
    more = ["--windows", "0:100,0:140", "--window", "0:100"]
    result = run_fit(recording, "--law", "rice-ruina", "--free", "A", *more)
    assert "--windows must stand alone" in result.output + str(result.exception)


@pytest.fixture(scope="module")
def with_unloading(tmp_path_factory):
    """Steps as ever, after a stretch of unloading and reloading along the spring alone."""
    run = next(runs_of(CASES["steps"], 1))
    x = 1e-5 * np.abs(np.arange(-100, 100) / 20)
    noise = 8e-4 * np.random.default_rng(2).normal(size=x.size)
    time = np.concatenate([np.arange(-200, 0) / 20, run.time])
    slip = np.concatenate([x - x[-1], run.slip])
    friction = np.concatenate([0.6 + 4e3 * (x - x[-1]) + noise, run.friction])
    path = tmp_path_factory.mktemp("fit") / "unloaded.csv"
    header = "time (s),load point displacement (um),friction"
    rows = np.column_stack([time, 1e6 * slip, friction])
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.9g")
    return path


def fit_of_steps(path, *more):
    return run_fit(path, "--law", "rice-ruina", "--free", "A,B,D0,K", *more)


def test_the_slope_of_unloading_is_the_prior_of_the_stiffness(with_unloading):
    more = ["--window", "0:140", "--stiffness-from", "-10:-0.05", "--fit-rate", "5 Hz", "--json"]
    result = fit_of_steps(with_unloading, *more)
    assert result.exit_code == 0, result.output
    K = json.loads(result.stdout)["parameters"]["K"]
    prior = K["prior"]
    assert prior["source"] == "slope of the force from -10 to -0.05 s"
    assert abs(prior["mean"] - 4e3) < 3 * prior["sd"] < 200
    assert K["se"] < prior["sd"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--stiffness-from", "-10:-1"], "must lie outside what is fitted"),
        (["--stiffness-from", "-10:1", "--window", "0:140"], "must lie outside what is fitted"),
        (["--stiffness-from", "-10:-1", "--windows", "auto"], "must lie outside"),
        (["--stiffness-from", "-10:-1", "--fix", "K=4000 1/m"], "must be the only number of K"),
        (["--stiffness-from", "41:60", "--window", "70:140"], "must have a force that rises"),
    ],
)
def test_spans_that_give_no_prior_are_refused(with_unloading, more, said):
    result = fit_of_steps(with_unloading, *more)
    assert said in result.output + str(result.exception)
    assert "Traceback" not in result.output


def test_a_slope_by_a_gauge_of_unknown_gain_is_refused(with_unloading):
    more = ["--stiffness-from", "-10:-0.05", "--window", "0:140", "--prior", "gain=1+-0.02"]
    result = fit_of_steps(with_unloading, *more)
    assert "must be without a prior of gain" in result.output + str(result.exception)


@pytest.fixture(scope="module")
def under_stress(tmp_path_factory):
    """A recording with its normal stress, and the stress in MPa."""
    run = next(runs_of(CASES["steps"], 1))
    stress = 20.0
    path = tmp_path_factory.mktemp("fit") / "stress.csv"
    rows = [run.time, 1e6 * run.slip, run.friction, np.full(run.time.size, stress)]
    header = "time (s),load point displacement (um),friction,normal stress (MPa)"
    np.savetxt(path, np.column_stack(rows), delimiter=",", header=header, comments="", fmt="%.9g")
    return path, stress


def test_a_stiffness_over_the_stress_is_taken_and_shown(under_stress, tmp_path):
    path, stress = under_stress
    common = [path, "--law", "rice-ruina", *START, "--fit-rate", "5 Hz"]

    def record(*more):
        result = run_fit(*common, *more, "--json")
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout)

    shown = run_fit(*common, "--report", tmp_path / "report")
    free = json.loads((tmp_path / "report" / "fit.json").read_text(encoding="utf-8"))
    K, over = free["parameters"]["K"], free["over_load"]["K/W0"]
    assert (K["unit"], over["unit"]) == ("Pa/m", "1/um")
    for key in ("value", "se"):
        assert over[key] == pytest.approx(K[key] / (stress * 1e6) / 1e6)
    assert over["interval_95"] == pytest.approx([x / (stress * 1e12) for x in K["interval_95"]])
    # That of the spring of the recording.
    assert over["interval_95"][0] < 4e-3 < over["interval_95"][1]
    assert "K/W0" in (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    # As rock laboratories write it, and as the same number of pascals.
    fixed = [record("--fix", f"K={text}") for text in ("4e-3/um", "0.08 MPa/um")]
    for name in ("A", "B", "D0"):
        values = [r["parameters"][name]["value"] for r in fixed]
        assert values == pytest.approx([values[0]] * 2, rel=1e-9)
    (line,) = [t for t in shown.output.splitlines() if t.strip().startswith("K/W0")]
    # With the digits that its error bears.
    assert float(line.split()[1]) == pytest.approx(over["value"], abs=over["se"] / 10)
    assert len(line.split()[1]) < 10
    assert line.rstrip().endswith("1/um")
    assert "chi-squared does not judge the law" in shown.output


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--steps", "40,40"], "--steps must rise, with at least 4 samples between them"),
        (["--steps", "40,40.1"], "got 1 before 40.1 s"),
        (["--steps", "40,500"], "--steps must lie inside the recording, got 500 s"),
        (["--posterior", "--chains", "1000000"], "must be 4000000 at most"),
        (["--posterior", "--draws", "100000000"], "must be 4000000 at most"),
        (["--posterior", "--chains", "1"], "chains must be at least 2"),
    ],
)
def test_what_would_not_end_is_refused_before_computing(recording, more, said, monkeypatch):
    monkeypatch.setattr("asperity.inference.fit", lambda *_, **__: pytest.fail("it is computed"))
    result = run_fit(recording, "--law", "rice-ruina", "--free", "A", *more)
    assert result.exit_code == 2 or isinstance(result.exception, InputError)
    assert said in result.output + str(result.exception)


@pytest.mark.parametrize("command", ["fit", "response"])
def test_a_pipe_is_no_table(tmp_path, command):
    """Nobody writes to it: reading would wait for ever."""
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    where = [pipe] if command == "fit" else ["--table", pipe, "--out", tmp_path / "out.csv"]
    result = CliRunner().invoke(main, [command, *map(str, where), "--law", "rice-ruina"])
    assert "must be a regular file, got" in result.output + str(result.exception)
    assert "a pipe" in result.output + str(result.exception)
