"""``asperity fit`` of a recording: a file in, numbers out; bad options in one sentence."""

import json

import numpy as np
import pytest
from benchmarks.coverage import CASES, runs_of
from click.testing import CliRunner

from asperity.cli.main import main


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


def test_a_recording_is_fitted(recording):
    found = run_fit(recording, "--law", "rice-ruina", "--free", "A,B,D0,K", "--json")
    assert found.exit_code == 0, found.output
    record = json.loads(found.output)
    K = record["parameters"]["K"]
    assert K["unit"] == "1/m"
    # The stiffness over the load that the recording was computed with.
    assert abs(K["value"] - 4e3) < 4 * K["se"]
    assert record["noise"]["model"].startswith("AR(")
    assert record["noise"]["effective_samples"] < 1400


def test_priors_of_a_material_want_the_free_parameters(recording):
    found = run_fit(recording, "--law", "rice-ruina", "--prior", "bureau2000")
    assert "--prior bureau2000 must go with --free" in found.output + str(found.exception)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--trend", "cubic"], "--trend must be none, linear or quadratic"),
        (["--initial", "any"], "--initial must be steady or free"),
        (["--prior", "K=3"], "--prior must be a material or NAME=VALUE+-DEVIATION"),
        (["--prior", "K=3+-0 1/um"], "must have a positive deviation"),
        (["--velocities", "1 um/s"], "must be one more than the steps"),
        (["--gauge", "-1 Hz"], "--gauge must be positive"),
        (["--fit-rate", "-1 Hz"], "fit_rate must be positive"),
        (
            ["--fit-rate", "0.1 Hz"],
            "fit_rate must leave 16 means or more of steps",
        ),
    ],
)
def test_bad_options_are_refused(recording, more, said):
    found = run_fit(recording, "--law", "rice-ruina", "--free", "A", *more)
    assert said in found.output + str(found.exception)
    assert "Traceback" not in found.output


def test_the_choice_of_the_window_is_an_uncertainty(recording):
    options = ["--windows", "auto", "--fit-rate", "5 Hz"]
    found = run_fit(recording, "--law", "rice-ruina", "--free", "A,B,D0,K", *options)
    assert found.exit_code == 0, found.output
    assert "1400 samples are compared as 700 means over blocks of 2" in found.output
    assert "over 4 windows (0 to 139.9, " in found.output
    assert "of the window" in found.output


def test_windows_and_a_window_are_refused(recording):
    more = ["--windows", "0:100,0:140", "--window", "0:100"]
    found = run_fit(recording, "--law", "rice-ruina", "--free", "A", *more)
    assert "--windows must stand alone" in found.output + str(found.exception)


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
    found = fit_of_steps(with_unloading, *more)
    assert found.exit_code == 0, found.output
    K = json.loads(found.output)["parameters"]["K"]
    prior = K["prior"]
    assert prior["source"] == "slope of the force from -10 to -0.05 s"
    assert abs(prior["mean"] - 4e3) < 3 * prior["sd"] < 200
    assert K["se"] < prior["sd"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--stiffness-from", "-10:-1"], "must lie outside what is fitted"),
        (["--stiffness-from", "-10:1", "--window", "0:140"], "must lie outside what is fitted"),
        (["--stiffness-from", "-10:-1", "--windows", "0:140,auto"], "must lie outside"),
        (["--stiffness-from", "-10:-1", "--fix", "K=4000 1/m"], "must be the only number of K"),
        (["--stiffness-from", "41:60", "--window", "70:140"], "must have a force that rises"),
    ],
)
def test_spans_that_give_no_prior_are_refused(with_unloading, more, said):
    found = fit_of_steps(with_unloading, *more)
    assert said in found.output + str(found.exception)
    assert "Traceback" not in found.output


def test_a_slope_by_a_gauge_of_unknown_gain_is_refused(with_unloading):
    more = ["--stiffness-from", "-10:-0.05", "--window", "0:140", "--prior", "gain=1+-0.02"]
    found = fit_of_steps(with_unloading, *more)
    assert "must be without a prior of gain" in found.output + str(found.exception)
