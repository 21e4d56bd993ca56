"""The averaged cycle of stick-slip against the limit cycle that made the recording."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from benchmarks.stick_slip_recordings import repeated, trace_of
from scipy.stats import chi2

import asperity as asp
from asperity.errors import InputError
from asperity.inference import Prior, compare
from asperity.inference.answers import read_data
from asperity.inference.cycles import CycleTerm, averaged_cycle
from asperity.inference.fitting.fit import fit
from asperity.inference.report import fit_in_words
from asperity.inference.runs.assembly import RunOptions
from asperity.inference.runs.run import RecordedRun
from asperity.laws import RiceRuina
from asperity.measurement.from_file import reads_cycles
from asperity.questions.fit import Fit
from asperity.questions.recording import Measurement as Question
from asperity.transients.limit_cycle import limit_cycle
from references.populations import draws

W0, V, RATE, CYCLES = 1.0, 1e-4, 200.0, 40
LAW = {"A": 0.01, "B": 0.015, "D0": 1e-6}
MACHINE = {"K": 300.0, "M": 0.3}
FIXED = {"mu0": 0.5, "V0": V}
TRUTH = {**LAW, **MACHINE}


@cache
def made():
    slider = asp.Slider(RiceRuina(**FIXED, **LAW), spring=300.0, load=W0, mass=0.3)
    return limit_cycle(slider, V)


def recorded(seed, noise=0.02, spread=0.0, rate=RATE):
    """The cycle over and over, its level and size normal from slip to slip, with white noise."""
    cycle, rng = made(), np.random.default_rng(seed)
    t, force = repeated(cycle, CYCLES, 1 / rate, rng, spread)
    return trace_of(t, force + noise * cycle.drop * rng.standard_normal(t.size))


def measured(seed, noise=0.02, spread=0.0, rate=RATE, **machine):
    trace = recorded(seed, noise, spread, rate)
    return asp.measure(trace, stick_slip=True, **{"velocity": V, "normal_load": W0} | machine)


@draws(1, 3)
def test_residuals_at_the_truth_are_chi_squared(draws):
    """Sums over recordings, of noise that is 2 % of the drop, and of cycles that are unlike too."""
    for spread in (0.0, 0.03):
        total, count = 0.0, 0
        for seed in range(draws):
            term = CycleTerm(averaged_cycle(measured(seed, spread=spread)), RiceRuina, FIXED)
            residuals = term.residuals(TRUTH).values
            total, count = total + float(residuals @ residuals), count + residuals.size
        assert 1e-3 < chi2.sf(total, count) < 1 - 1e-9


def test_a_level_and_an_instant_do_not_count():
    measurement = measured(1)
    cycle = averaged_cycle(measurement)
    residuals = CycleTerm(cycle, RiceRuina, FIXED).residuals(TRUTH).values
    moved = CycleTerm(cycle, RiceRuina, FIXED | {"mu0": 0.53}).residuals(TRUTH).values
    np.testing.assert_allclose(moved, residuals, atol=1e-2)


def test_a_recording_in_memory_is_fitted_as_its_file_is():
    fixed = {**FIXED, **LAW, "V": V}
    with pytest.raises(InputError, match=r"have W0 .* as fixed=\{'W0': '0\.3 N'\}"):
        asp.fit(recorded(1), free=["K"], fixed=fixed)
    fixed |= {"W0": W0, "M": MACHINE["M"]}
    fitted = asp.fit(recorded(1), free=["K"], fixed=fixed, starts=2).parameters["K"]
    assert fitted.value == pytest.approx(MACHINE["K"], abs=4 * fitted.se)


def test_a_force_alone_is_measured_once(monkeypatch):
    """It has no velocity steps that could be read in place of its slips."""
    monkeypatch.setattr("asperity.measurement.from_file.measure_sliding", None)
    trace = recorded(1)
    question = Question(velocity=V, normal_load=W0)
    assert reads_cycles(trace, question, measured(1))


def test_files_with_the_drive_bring_their_velocities(tmp_path):
    """Two velocities in one fit: the displacement of the drive says which is which."""
    files = []
    for name, speed in (("slow", 1.0), ("fast", 4.0)):
        measurement = measured(1)
        time, force = measurement.time / speed, measurement.friction
        files.append(tmp_path / f"{name}.csv")
        head = "t (s),friction,displacement (um)"
        columns = np.c_[time, force, 1e6 * speed * V * time]
        np.savetxt(files[-1], columns, "%.8g", ",", header=head, comments="")
    question = Fit(data=[{"file": file} for file in files], fixed=MACHINE | {"W0": "1 N"})
    slow, fast = read_data(question)
    assert pytest.approx((V, 4 * V), rel=1e-6) == (slow.V, fast.V)
    # No gauge is applied to cycles, and no trend.
    with pytest.raises(InputError, match="gauge must go with velocity steps and holds, got 50 Hz"):
        read_data(question.model_copy(update={"gauge": "50 Hz", "data": question.data[:1]}))
    with pytest.raises(InputError, match="runs must go with recorded runs"):
        fit(slow, "rice-ruina", runs=RunOptions(gauge=(1, 50.0)), fixed=MACHINE)
    with pytest.raises(InputError, match="recordings must have different names, got slow, slow"):
        fit([slow, replace(fast, name="slow")], "rice-ruina", fixed=MACHINE)


def test_velocity_steps_that_fall_like_slips_are_no_stick_slip(tmp_path):
    """On a stiff machine each step down is a drop, and friction rises between them."""
    a, b, slip, rate = 0.012, 0.009, 10.0, 10.0
    time = np.arange(6000) / rate
    speed = np.where(time // 60 % 2 == 0, 1.0, 10.0)
    friction, age = np.empty(time.size), 1.0
    for k in range(10):
        stretch = slice(k * 600, (k + 1) * 600)
        v = speed[stretch][0]
        ages = 1 / v + (age - 1 / v) * np.exp(-np.arange(1, 601) / rate * v / slip)
        friction[stretch], age = 0.62 + a * np.log(v) + b * np.log(ages), ages[-1]
    moved = np.cumsum(speed) / rate
    noise = np.random.default_rng(0).standard_normal((2, time.size))
    columns = np.c_[time, friction + 2e-6 * moved + 4.5e-4 * noise[0], moved + 0.02 * noise[1]]
    head = "time (s),friction,load point displacement (um)"
    np.savetxt(tmp_path / "a.csv", columns, "%.8g", ",", header=head, comments="")
    trace = asp.read(tmp_path / "a.csv")
    assert asp.measure(trace, stick_slip=True).clear
    assert len(asp.measure(trace).steps) == 9
    (run,) = read_data(Fit(data=[{"file": tmp_path / "a.csv"}]))
    assert isinstance(run, RecordedRun)


def test_a_modulated_recording_is_no_stick_slip(tmp_path):
    """Of its force alone it is an oscillation about sliding."""
    time = np.arange(4000) / 2000
    turn = np.cos(2 * np.pi * 100 * time)
    noise = 2e-3 * np.random.default_rng(1).normal(size=(2, time.size))
    columns = np.c_[time, 2.5 + 0.02 * turn + noise[0], 7 * (1 + 0.2 * turn) + noise[1]]
    head = "time (s),shear force (N),normal force (N)"
    np.savetxt(tmp_path / "a.csv", columns, "%.8g", ",", header=head, comments="")
    with pytest.raises(InputError, match="modulated at 100 Hz; read its harmonics first"):
        read_data(Fit(data=[{"file": tmp_path / "a.csv"}]))
    with pytest.raises(InputError, match="a load that is modulated at 100 Hz"):
        asp.fit(asp.read(tmp_path / "a.csv"))


def test_derivatives_are_those_of_the_residuals():
    """Of a cycle that the law describes exactly; about noise, those of the sum of squares."""
    noisy = averaged_cycle(measured(2))
    term = CycleTerm(noisy, RiceRuina, FIXED)
    off = np.linalg.solve(noisy.whitening, term._aligned(term.limit_cycle(TRUTH))[1])
    exact = CycleTerm(replace(noisy, values=noisy.values + off), RiceRuina, FIXED)
    jacobian = exact.residuals(TRUTH).jacobian
    at_truth = term.residuals(TRUTH)
    gradient = 2 * at_truth.values @ at_truth.jacobian
    for i, (name, value) in enumerate(TRUTH.items()):
        change = 1e-4 * value
        sides = [{**TRUTH, name: value + sign * change} for sign in (1, -1)]
        up, down = (exact.residuals(side).values for side in sides)
        slope = (up - down) / (2 * change)
        scale = np.linalg.norm(slope)
        np.testing.assert_allclose(jacobian[:, i], slope, atol=1e-3 * scale)
        up, down = term.chi2_of_many(sides)
        np.testing.assert_allclose(gradient[i], (up - down) / (2 * change), atol=2e-2 * scale)


def test_what_is_irregular_is_said_and_what_is_not_there_is_asked_for():
    term = CycleTerm(averaged_cycle(measured(3, spread=0.05)), RiceRuina, FIXED)
    (warning,) = term.warnings(None, None)
    assert "irregular cycles" in warning
    assert CycleTerm(averaged_cycle(measured(3)), RiceRuina, FIXED).warnings(None, None) == ()
    with pytest.raises(InputError, match="must have V for a fit of its cycles"):
        averaged_cycle(measured(3, velocity=None))
    with pytest.raises(InputError, match="must be regular stick-slip"):
        averaged_cycle(measured(3, spread=0.4))
    coarse = averaged_cycle(measured(3, rate=20.0))
    assert not coarse.resolved
    with pytest.raises(InputError, match="M must be fixed where a slip is shorter"):
        fit(coarse, "rice-ruina", fixed={"K": 300.0})
    with pytest.raises(InputError, match="free must be what the shape of a cycle shows"):
        fit(coarse, "rice-ruina", ["mu0"], fixed=TRUTH)
    with pytest.raises(InputError, match="M must be free or fixed"):
        fit(coarse, "rice-ruina", ["A"], fixed={"B": 0.015, "D0": 1e-6, "K": 300.0})
    with pytest.raises(InputError, match=r"fixed\['W0'\] must agree with the column"):
        fit(coarse, "rice-ruina", ["B"], fixed=TRUTH | {"W0": 2 * coarse.W0})


@pytest.mark.long
def test_a_fit_gives_the_truth_within_its_intervals():
    cycle = averaged_cycle(measured(4))
    result = fit(
        cycle, "rice-ruina", ["B", "D0"], fixed={"A": 0.01, **MACHINE}, starts=2,
        start={"B": 0.0155, "D0": 1.2e-6},
    )  # fmt: skip
    assert result.converged
    assert result.p_value > 1e-3
    for name in ("B", "D0"):
        low, high = result.parameters[name].interval_95
        assert low < TRUTH[name] < high


def test_a_stiffness_over_the_load_is_one_of_the_cycle():
    """Twice the load, stiffness and mass: the same friction."""
    cycle = replace(averaged_cycle(measured(4)), W0=2.0)
    prior = Prior(300.0, 3.0, "unloading", "1/m")
    ask = {"fixed": {**LAW, "M": 0.6}, "start": {"K": "590 N/m"}, "starts": 0}
    result = fit(cycle, "rice-ruina", ["K"], prior={"K": prior}, **ask)
    assert result.values["K"] == pytest.approx(600.0, rel=0.03)
    with pytest.raises(InputError, match=r"prior\['K'\] must be in N/m or 1/m"):
        fit(cycle, "rice-ruina", ["K"], prior={"K": replace(prior, unit="Pa/m")}, **ask)


@pytest.mark.long
def test_laws_are_compared_with_all_that_a_cycle_determines():
    """B, the stiffness and the mass are free without being named."""
    cycle = averaged_cycle(measured(5, noise=0.002))
    fixed = {"A": LAW["A"], "D0": LAW["D0"]}
    comparison = compare(cycle, ["rice-ruina", "ruina-slip"], fixed=fixed, starts=2, evidence=False)
    assert comparison.best == "rice-ruina"
    assert comparison.laws["ruina-slip"].excluded
    found = comparison.laws["rice-ruina"].fit
    assert list(found.parameters) == ["B", "K", "M"]
    for name, estimate in found.parameters.items():
        low, high = estimate.interval_95
        assert low < TRUTH[name] < high


def test_an_assumed_level_of_friction_is_no_result():
    """The report of a fit of cycles has no mu0: it would be the mean force of the cycle."""
    fixed = {**LAW, "V": V, "W0": W0, "M": MACHINE["M"]}
    words = fit_in_words(asp.fit(recorded(1), free=["K"], fixed=fixed, starts=0))
    assert not [sentence for sentence in words if sentence.startswith("mu0")]
