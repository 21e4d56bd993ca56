"""Fits of recordings by SciPy with noise, and of real ones: values, intervals, warnings, input."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks.coverage import CASES, TRUE, covered, friction, runs_of, trace_of
from scipy.signal import lfilter

from asperity import materials
from asperity.errors import InputError, worded
from asperity.fit_report.folder import material_text, provenance
from asperity.inference import Prior, RunOptions, fit, recorded_run
from asperity.inference.fitting.assembly import Given, objective_of
from asperity.inference.fitting.description import described_fit
from asperity.inference.fitting.inputs import free_by_default
from asperity.inference.fitting.plausibility import (
    contradicted_stiffness,
    unusual_numbers,
)
from asperity.inference.fitting.result import Optimum, fit_record
from asperity.inference.report import fit_in_words
from asperity.inference.runs.assembly import require_own_samples
from asperity.inference.runs.cleaning import cleaned, with_wrong_samples, without_spikes
from asperity.inference.runs.noise import largest_departure
from asperity.inference.runs.rate_dependence import level_change, level_rates
from asperity.inference.runs.term import RunTerm
from asperity.laws import get_law
from benchmarks import coverage
from references.populations import population

CASE = CASES["steps"]
FREE = ["A", "B", "D0"]


@pytest.fixture(scope="module")
def steps_fit():
    return fit(next(runs_of(CASE, 1)), "rice-ruina", FREE)


def test_the_true_values_are_fitted_without_a_start(steps_fit):
    assert steps_fit.converged
    for name, truth in TRUE.items():
        p = steps_fit.parameters[name]
        assert abs(p.value - truth) < 4 * p.se
        assert p.se < 0.2 * truth
    assert steps_fit.parameters["K"].unit == "Pa/m"
    assert steps_fit.undetermined == ()


def test_priors_of_parameters_that_are_not_free_are_refused():
    (run,) = runs_of(CASE, 1)
    prior = Prior(8e10, 1e9, "")
    with pytest.raises(InputError, match=r"prior must be of free parameters .*, got 'K\[typo\]'"):
        fit(run, "rice-ruina", FREE, prior={"K[typo]": prior})
    with pytest.raises(InputError, match=r"got 'K'; free it"):
        fit(run, "rice-ruina", FREE, prior={"K": prior}, fixed={"K": 8e10})
    # The sampling interval is the prior of the delay of a step.
    with pytest.raises(InputError, match=r"\(A, B, D0, K\), got 'step_time_1'"):
        fit(run, "rice-ruina", FREE, prior={"step_time_1": Prior(0.0, 1.0, "")})


def test_too_few_samples_are_refused_without_and_with_inertia():
    run = next(runs_of(replace(CASE, rate=0.3), 1))
    for free, inertia in ((FREE, False), ([*FREE, "M"], True)):
        with pytest.raises(InputError, match=r"must have at least .* samples for"):
            fit(run, "rice-ruina", free, inertia=inertia)


@pytest.mark.parametrize("name", ["K[typo]", "gain", "step_time_1", "mu0"])
def test_starts_of_nuisances_and_unknown_parameters_are_refused(name):
    (run,) = runs_of(CASE, 1)
    with pytest.raises(InputError, match=r"start must be of free parameters \(A, B, D0, K\), got"):
        fit(run, "rice-ruina", FREE, prior={"gain": Prior(1.0, 0.02, "")}, start={name: 1.0})


def test_minima_that_differ_only_in_the_times_of_steps_are_one(steps_fit):
    objective = steps_fit.objective
    u = objective.coordinates(steps_fit.values)
    sd = np.array(
        [
            abs(p.se / k.slope(p.value))
            for p, k in zip(steps_fit.parameters.values(), objective.unknowns, strict=True)
        ]
    )
    elsewhere = u + np.where([k.name == "D0" for k in objective.unknowns], 3 * sd, 0.0)
    later = elsewhere + np.where([k.nuisance for k in objective.unknowns], 3 * sd, 0.0)
    minima = [(u, steps_fit.chi2), (elsewhere, steps_fit.chi2 + 1), (later, steps_fit.chi2 + 2)]
    described = described_fit(objective, minima, profile=False)
    assert [round(minimum.chi2 - steps_fit.chi2, 6) for minimum in described.optima] == [1.0]


@pytest.mark.parametrize("number", population([2, 3]))
def test_a_drift_larger_than_the_signal_hides_no_minimum(number):
    """With white noise assumed, the drift would be fitted as slow evolution of the friction."""

    def drift(random, n, rate):
        walk = np.cumsum(random.normal(size=n)) / np.sqrt(n)
        return 2e-4 * random.normal(size=n) + 1.2e-2 * walk

    *_, run = runs_of(CASE, number + 1, 0, drift)
    result = fit(run, "rice-ruina", FREE, start=TRUE, starts=1)
    for name, truth in TRUE.items():
        p = result.parameters[name]
        assert abs(p.value - truth) < 4 * p.se


def test_noise_is_reported(steps_fit):
    (term,) = steps_fit.objective.terms
    # Noise correlated over 0.5 and 8 s and a line: 1,400 samples count as far fewer.
    assert 30 < term.noise["effective_samples"] < 700
    assert term.noise["model"].startswith("AR(")
    assert steps_fit.chi2 == pytest.approx(steps_fit.dof, rel=0.05)


def test_a_recording_without_noise_gives_the_true_values():
    time = np.arange(1400) / 10
    (run,) = runs_of(CASE, 1)
    exact = replace(run, friction=friction(CASE, time) + 1e-9 * np.sin(time * time))
    estimates = fit(exact, "rice-ruina", FREE, start=TRUE, starts=1).values
    for name, truth in TRUE.items():
        # The drive is measured by a displacement with noise of 20 nm.
        assert estimates[name] == pytest.approx(truth, rel=2e-3)


@pytest.mark.long
def test_standard_errors_are_too_small_only_if_noise_is_taken_for_white():
    sets = 8
    # One start besides the truth: this test is about the errors, not the search.
    white = covered(runs_of(CASE, sets), CASE, RunOptions(order=0), starts=1)["parameters"]
    right = covered(runs_of(CASE, sets), CASE, starts=1)["parameters"]
    inside = np.mean([right[n]["cover_95"] for n in TRUE])
    # Over 8 sets of 4 correlated parameters the share varies by some 8 %.
    assert inside > 0.8
    assert np.mean([white[n]["cover_68"] for n in TRUE]) < 0.55
    for name in TRUE:
        assert white[name]["mean_se"] < right[name]["mean_se"]
    # The scatter is known to 27 % from 8 sets; a factor of 2 in the likelihood would change
    # every ratio by a factor of 1.41.
    ratio = np.array([right[n]["mean_se"] / right[n]["scatter"] for n in TRUE])
    assert 0.75 < ratio.mean() < 1.33


@pytest.mark.parametrize(
    ("case", "law", "free"),
    [
        ("steps", "rice-ruina", FREE),
        ("steps", "linker-dieterich", FREE),
        ("loads", "linker-dieterich", [*FREE, "alpha"]),
        ("steps", "nagata", [*FREE, "c"]),
    ],
)
def test_parameters_that_a_recording_can_determine_are_free_by_default(case, law, free):
    (run,) = runs_of(CASES[case], 1)
    assert free_by_default(get_law(law), [run], None, None) == free
    assert free_by_default(get_law(law), [run], {"A": 0.01}, None) == free[1:]


def test_alpha_under_a_constant_load_is_refused():
    with pytest.raises(InputError, match="alpha must be seen in a change of the load"):
        fit(next(runs_of(CASE, 1)), "linker-dieterich", [*FREE, "alpha"])


def test_a_reference_velocity_without_its_friction_is_refused(steps_fit):
    """The friction at the first velocity was reported as that at V0."""
    (term,) = steps_fit.objective.terms
    with pytest.raises(InputError, match=r"fixed\['V0'\] must come with mu0, got it alone"):
        fit(term.run, "rice-ruina", FREE, fixed={"V0": "1 mm/s"})


def test_a_recording_without_steps_is_refused():
    time = np.arange(400) / 10
    noise = 1e-3 * np.random.default_rng(0).normal(size=400)
    run = recorded_run(trace_of(time, 0.6 + noise, 1e-6 * time), name="flat")
    with pytest.raises(InputError, match="A must be seen in a change of the velocity"):
        fit(run, "rice-ruina", FREE)


def test_a_recording_that_begins_with_a_hold_is_refused():
    time = np.arange(600) / 10
    slip = np.where(time < 30, 0.0, 1e-6 * (time - 30))
    with pytest.raises(InputError, match="must begin with sliding"):
        recorded_run(trace_of(time, 0.6 + 0 * time, slip), steps=[30.0])


def test_samples_without_a_number_are_left_out_with_a_doubt():
    time = np.arange(600) / 10
    friction = 0.6 + 1e-3 * np.sin(time)
    friction[[5, 310]] = np.nan
    run = recorded_run(trace_of(time, friction, 1e-6 * time), steps=[30.0])
    assert run.time.size == 598
    assert any(doubt.startswith("2 samples are left out") for doubt in run.doubts)


def doubts_of(friction, **options):
    time = np.arange(friction.size) / 10
    options = {"steps": [30.0], **options}
    return recorded_run(trace_of(time, friction, 1e-6 * time), **options).doubts


def test_a_clipped_gauge_is_named():
    time = np.arange(600) / 10
    noise = 1e-3 * np.random.default_rng(0).normal(size=600)
    whole = 0.6 + noise + 0.02 * np.exp(-np.abs(time - 31.0))
    assert doubts_of(whole) == ()
    (doubt,) = doubts_of(np.minimum(whole, 0.61))
    assert "at the largest value, 0.61" in doubt
    # Coarsely rounded values repeat everywhere, and a computed recording begins with equal ones.
    (doubt,) = doubts_of(np.round(whole, 2))
    assert "rounded more coarsely" in doubt
    assert "differ from it by 0.01" in doubt
    assert doubts_of(np.round(whole, 3)) == ()
    assert doubts_of(np.where(time < 30, 0.6, 0.6 + np.abs(whole - 0.6))) == ()


def test_friction_in_wrong_units_is_named():
    (doubt,) = doubts_of(600 + np.random.default_rng(0).normal(size=600))
    assert "friction is 600" in doubt


def test_given_velocities_that_the_displacement_contradicts_are_named():
    friction = 0.6 + 1e-3 * np.random.default_rng(0).normal(size=600)
    assert doubts_of(friction, velocities=[1e-6, 1.02e-6]) == ()
    (doubt,) = doubts_of(friction, velocities=[1e-6, 1.1e-6])
    assert "velocity 2 is given as 1.1e-06 m/s" in doubt


def test_a_load_that_is_not_positive_is_refused():
    time = np.arange(600) / 10
    load = np.where(time < 30, 1e6, -1.0)
    with pytest.raises(InputError, match="must be under a positive load"):
        recorded_run(trace_of(time, 0.6 + 0 * time, 1e-6 * time, load), steps=[30.0])


def test_samples_that_two_recordings_share_are_refused():
    first, second = runs_of(CASE, 2)
    later = replace(
        first, name="later", time=first.time[500:] - first.time[500], friction=first.friction[500:]
    )
    with pytest.raises(InputError, match=r"later must hold samples of its own, got those from"):
        fit([first, later], "rice-ruina", FREE)
    require_own_samples([first, replace(second, name="other")])
    # Many samples of a coarse gauge at rest are equal by chance.
    coarse = [replace(run, friction=np.round(run.friction, 3)) for run in (first, second)]
    require_own_samples(coarse)


def test_unknown_options_are_refused():
    with pytest.raises(InputError, match=r"linear\[1\] must be one of offset"):
        RunOptions(linear=("offset", "trends"))
    with pytest.raises(InputError, match="initial must be one of"):
        RunOptions(initial="unsteady")


def test_a_prior_of_the_stiffness_over_the_load_is_converted():
    run = next(runs_of(CASE, 1))
    over_load = Prior(3e3, 1.0, "unloading", "1/m")
    result = fit(run, "rice-ruina", FREE, prior={"K": over_load}, start=TRUE, starts=1)
    # The prior is far narrower than the uncertainty from the recording.
    assert result.values["K"] == pytest.approx(3e3 * run.W0, rel=2e-3)
    assert any("prior of K" in w for w in result.warnings)
    with pytest.raises(InputError, match=r"prior\['K'\] must be in Pa/m or 1/m"):
        fit(run, "rice-ruina", FREE, prior={"K": replace(over_load, unit="N/m")})


def test_spikes_are_left_out_and_named(steps_fit):
    (run,) = runs_of(CASE, 1)
    spoiled = run.friction.copy()
    # 10 to 30 standard deviations of the noise; one spike is just after the first step.
    spoiled[[300, 401, 705, 1100]] += [0.02, 0.04, -0.03, 0.05]
    result = fit(replace(run, friction=spoiled), "rice-ruina", FREE, start=TRUE, starts=1)
    (warning,) = (w for w in result.warnings if "are spikes, which no motion" in w)
    assert "4 samples" in warning
    assert "30, 40.1, 70.5, 110 s" in warning
    for name in TRUE:
        assert abs(result.values[name] - steps_fit.values[name]) < steps_fit.parameters[name].se


def test_large_spikes_are_not_reported_as_jumps_too():
    """Noise estimated with the spikes included would make some of them jumps."""
    case = coverage.Case((3e-5, 1e-4, 3e-5), (2.5, 6.0), 10.0, 400.0)
    time = np.arange(4_000) / case.rate
    turn = 1.8 * np.cos(2 * np.pi * 35 / case.rate)
    noise = lfilter([1.0], [1.0, -turn, 0.81], np.random.default_rng(0).normal(size=time.size))
    values = coverage.friction(case, time) + 3e-4 * noise / noise.std()
    spoiled = [323, 1814, 2042, 3520, 3757, 3765, 3879, 3902]
    random = np.random.default_rng(4)
    values[spoiled] += random.choice([-1, 1], 8) * random.uniform(0.3, 1.0, 8)
    path = np.interp(time, [0, 2.5, 6, 10], [0, 7.5e-5, 4.25e-4, 5.45e-4])
    run = recorded_run(
        trace_of(time, values, path, np.full(time.size, coverage.LOAD)),
        name="run",
        steps=case.changes,
        velocities=case.velocities,
    )
    clean_run = cleaned(run)
    assert clean_run.spikes == tuple(k / case.rate for k in spoiled)
    assert clean_run.jumps == ()


@pytest.mark.long
def test_a_spike_as_small_as_changes_of_friction_is_left_out_by_the_fit():
    """The spike is where the reloading after a hold ends; the data alone do not show it."""
    case = CASES["holds"]
    (run,) = runs_of(case, 1)
    k = round((case.changes[3] + 2.1) * case.rate)
    spoiled = run.friction.copy()
    spoiled[k] -= 0.03
    bad = replace(run, friction=spoiled)
    assert cleaned(bad).spikes == ()
    clean, result, kept = (
        fit(r, "rice-ruina", FREE, start=TRUE, starts=1)
        for r in (run, bad, replace(bad, spikes=(), wrong=()))
    )
    (warning,) = (w for w in result.warnings if "farther from the motion of rice-ruina" in w)
    assert "at 82.1 s, is farther" in warning
    assert result.objective.terms[0].noise["outliers"] == [run.time[k]]
    assert clean.objective.terms[0].noise["outliers"] == []
    shifts = [abs(result.values[n] - clean.values[n]) / clean.parameters[n].se for n in TRUE]
    assert max(shifts) < 0.3
    # spikes=() and wrong=() of the user keep the sample, although it shifts the answer.
    assert not any("farther from the motion" in w for w in kept.warnings)
    shifts = [abs(kept.values[n] - clean.values[n]) / clean.parameters[n].se for n in TRUE]
    assert max(shifts) > 3


def test_the_friction_at_the_load_is_of_a_recording_whose_load_changes():
    """An offset of 0.05 in a gauge under a constant load shifted alpha by 6 standard errors."""
    (constant,), (changing,) = (runs_of(CASES[name], 1) for name in ("steps", "loads"))
    offset = replace(constant, name="constant", friction=constant.friction + 0.05)
    for runs in ([offset, changing], [changing, offset]):
        objective = objective_of(
            get_law("linker-dieterich"), runs, [*FREE, "alpha"], Given({}, None, None, None)
        )
        assert objective.fixed["mu0"] == np.median(changing.friction[:16])
        assert objective.fixed["V0"] == changing.velocity


@pytest.mark.long
def test_an_unknown_lag_of_the_gauge_leaves_no_stretch_out():
    """Many samples in a row that depart from the fit are a motion that the law cannot describe."""
    case = CASES["loads"]
    (run,) = runs_of(case, 1)
    lagging = lfilter([0.3], [1.0, -0.7], run.friction, zi=[0.7 * run.friction[0]])[0]
    free = [*FREE, "alpha"]
    result = fit(replace(run, friction=lagging), case.law, free, start=case.true, starts=1)
    # Of the samples at intervals of 0.1 s, only one after a change of the drive may be left out.
    left_out = result.objective.terms[0].noise["outliers"]
    assert np.all(np.diff(left_out) > 0.15)
    assert len(left_out) < len(run.drive.edges)
    (said,) = [w for w in result.warnings if "just after changes of its drive" in w]
    assert "intervals do not hold" in said


def test_each_sample_left_out_costs_the_largest_departure_of_noise(steps_fit):
    """Otherwise a law could win a comparison by leaving out samples."""
    (term,) = steps_fit.objective.terms
    n, values = term.run.time.size, steps_fit.values
    without = RunTerm(
        replace(term.run, wrong=(term.run.time[300], term.run.time[900])),
        term.law,
        term.fixed,
        term.options,
        nuisances=term.nuisances,
    )
    without.models = term.models
    without._prepare()
    before, after = term.residuals(values), without.residuals(values)
    assert after.log_scale - before.log_scale == pytest.approx(largest_departure(n) ** 2)
    assert without.profiled == term.profiled
    # Samples left out change neither the motion nor the number of the others.
    assert before.values @ before.values > after.values @ after.values
    np.testing.assert_allclose(
        without.fitted_friction(values), term.fitted_friction(values), atol=1e-4
    )


@pytest.mark.parametrize(("name", "rate"), [("steps", 0.7), ("holds", 0.7), ("loads", 10.0)])
def test_a_slip_event_of_one_sample_is_not_taken_for_a_spike(name, rate):
    """The event after a change of the velocity is over before the next sample."""
    case = replace(CASES[name], rate=rate)
    run = next(runs_of(case, 1, noise=lambda random, n, rate: np.zeros(n)))
    assert without_spikes(run).spikes == ()
    # A spike larger than the range of the friction is one.
    k = int(np.searchsorted(run.time, case.changes[0])) + 1
    spoiled = run.friction.copy()
    spoiled[k] -= 3 * np.ptp(spoiled)
    assert without_spikes(replace(run, friction=spoiled)).spikes == (run.time[k],)


def test_a_jump_of_the_gauge_is_fitted_and_named(steps_fit):
    (run,) = runs_of(CASE, 1)
    # Soon after the second step, where a jump shifts the parameters by up to 15 standard errors.
    moved = replace(run, friction=run.friction + 0.01 * (run.time > 90), origin=1000.0)
    result = fit(moved, "rice-ruina", FREE, start=TRUE, starts=1)
    (warning,) = (w for w in result.warnings if "jumps by itself" in w)
    # In the time of the recording, as the option that names jumps.
    assert "at 1090" in warning
    assert result.objective.terms[0].noise["jumps"] == pytest.approx([1090], abs=1)
    for name, truth in TRUE.items():
        assert abs(result.values[name] - truth) < 2.5 * result.parameters[name].se
        assert result.parameters[name].se < 1.3 * steps_fit.parameters[name].se
    assert not any("jumps" in w for w in steps_fit.warnings)


def test_a_motion_that_the_law_cannot_describe_is_named(steps_fit):
    """A lag of the gauge of ten samples, which nothing states."""
    (run,) = runs_of(CASE, 1)
    lagging = lfilter([0.1], [1.0, -0.9], run.friction, zi=[0.9 * run.friction[0]])[0]
    result = fit(replace(run, friction=lagging), "rice-ruina", FREE, start=TRUE, starts=1)
    assert any("just after changes of its drive" in w for w in result.warnings)
    assert not any("just after changes" in w for w in steps_fit.warnings)


def test_values_outside_those_of_contacts_are_named(steps_fit):
    run = steps_fit.objective.terms[0].run
    assert unusual_numbers(steps_fit, [run]) == []
    unusual = replace(steps_fit.parameters["D0"], value=0.006)
    changed = replace(steps_fit, parameters={**steps_fit.parameters, "D0": unusual})
    (warning,) = unusual_numbers(changed, [run])
    assert worded(warning).startswith("D0 of 0.006 m is outside")


def test_a_published_stiffness_has_its_unit_for_recordings_under_a_stress(tmp_path):
    """0.2 N/um is no 0.2 MPa/m."""
    (run,), file = runs_of(CASE, 1), tmp_path / "rig.toml"
    file.write_text(
        "title = 'rig'\n[numbers.K]\nvalue = 0.2\nuncertainty = 0.01\nunit = 'N/um'\n"
        "dimension = 'stiffness'\nkind = 'published'\nplace = 'II'\n"
    )
    with pytest.raises(InputError, match=r"prior\['K'\] must be in Pa/m or 1/m for run, got N/m"):
        fit(run, "rice-ruina", [*FREE, "K"], prior=materials.load(file))


def test_a_fixed_stiffness_that_the_recording_contradicts_is_named():
    (run,) = runs_of(CASE, 1)
    result = fit(run, "rice-ruina", FREE, fixed={"K": 2 * TRUE["K"]}, start=TRUE, starts=1)
    (warning,) = (w for w in result.warnings if "the fixed K" in w)
    assert "contradicted: run has" in warning
    assert "D0" in warning
    # Without an improvement of AICc nothing is contradicted.
    assert contradicted_stiffness(result, result, [run], 2 * TRUE["K"]) == []
    # It is among the fixed numbers, in the unit of the recording.
    assert fit_record(result)["fixed"]["K"] == {"value": 2 * TRUE["K"], "unit": "Pa/m"}
    assert f"<td>K</td><td>{2 * TRUE['K']:.6g}</td><td>Pa/m</td>" in provenance(result)
    assert "numbers.K" not in material_text(result)


def test_a_shared_stiffness_that_the_recordings_contradict_is_named(monkeypatch):
    (first,) = runs_of(CASE, 1)
    start = {**TRUE, "K": 1.3 * TRUE["K"]}
    monkeypatch.setattr(coverage, "STIFFNESS", 1.8 * coverage.STIFFNESS)
    (second,) = runs_of(CASE, 1, seed=1)
    pair = [first, replace(second, name="stiffer")]
    result = fit(pair, "rice-ruina", [*FREE, "K"], start=start, starts=1)
    assert contradicted_stiffness(result, result, pair) == []
    (warning,) = (w for w in result.warnings if "share" in w)
    for name, factor in (("run", 1.0), ("stiffer", 1.8)):
        low, high = (
            float(x) for x in re.search(rf"{name} has \S+ \((\S+) to (\S+),", warning).groups()
        )
        assert low < factor * TRUE["K"] < high
    assert "leave K out of the free parameters" in warning


def test_a_prior_that_agrees_with_the_recording_has_no_warning(steps_fit):
    (term,) = steps_fit.objective.terms
    prior = {"K": Prior(TRUE["K"], 0.1 * TRUE["K"], "published")}
    result = fit(term.run, "rice-ruina", FREE, prior=prior, start=TRUE, starts=1)
    assert not any("prior of K" in w for w in result.warnings)


@pytest.mark.parametrize(
    ("case", "stiffness", "seed"),
    population([("steps", 3e5, 0), ("holds", 1e6, 7), ("holds", 3e5, 5)], several=True),
)
def test_a_stiff_machine_hides_its_stiffness_only(monkeypatch, case, stiffness, seed):
    """The spring relaxes within 0.03 and 0.01 um of slip; samples are 0.3 to 1 um apart.

    The second case has a minimum at which a change of the velocity is one sampling interval late.
    In the third the jump of friction reaches a sample, which alone seems to say when the velocity
    changes, and the estimates of A and B are 7 and 17 standard errors off if that counts.
    """
    monkeypatch.setattr(coverage, "STIFFNESS", stiffness)
    runs = runs_of(
        CASES[case], seed + 1, noise=lambda random, n, rate: 2e-4 * random.normal(size=n)
    )
    result = fit(list(runs)[-1], "rice-ruina", FREE)
    for name in FREE:
        p = result.parameters[name]
        low, high = p.interval_95
        width = max(high - p.value, p.value - low)
        assert abs(p.value - TRUE[name]) < 2 * width
        assert width < 0.15 * p.value
    low, high = result.parameters["K"].interval_95
    assert low / 1.5 < stiffness * coverage.LOAD < 1.5 * high


def test_a_transient_longer_than_its_recording_leaves_B_and_D0_undetermined(monkeypatch):
    """The transient is a trend: any D0 with B in proportion, so that A - B has no sign."""
    monkeypatch.setitem(coverage.TRUTH, "D0", 60e-6)
    short = coverage.Case((1e-6, 1e-5), (5.0,), 8.0, 10.0)
    (run,) = runs_of(short, 1, noise=lambda random, n, rate: 2e-4 * random.normal(size=n))
    result = fit(run, "rice-ruina", FREE)
    assert {"B", "D0"} <= {*result.undetermined}
    assert not any("A - B" in sentence for sentence in fit_in_words(result))
    assert coverage.TRUTH["A"] == pytest.approx(result.values["A"], rel=0.1)


def test_the_report_has_the_rate_dependence_of_the_levels_next_to_that_of_the_law(steps_fit):
    """The levels of the steps agree with the true rate dependence within their uncertainty."""
    rates = steps_fit.objective.terms[0].run.level_rates
    assert len(rates) == len(CASE.changes)
    for value, uncertainty in rates:
        assert abs(value - (TRUE["A"] - TRUE["B"])) < 4 * uncertainty
    (sentence,) = (s for s in fit_in_words(steps_fit) if "d mu/d ln V" in s)
    assert f"its {len(rates)} steps" in sentence
    assert f"{level_change(rates).value:.4f}"[:6] in sentence


def test_steps_that_disagree_widen_their_mean():
    assert level_change([]) is None
    # By hand: weights 100 and 25; (0.2/0.1)^2 and (0.8/0.2)^2 for one degree of freedom.
    mean = level_change([(1.0, 0.1), (2.0, 0.2)])
    assert mean == pytest.approx((1.2, np.sqrt(20 / 125), 2))
    alike = level_change([(1.0, 0.1), (1.0, 0.2)])
    assert alike == pytest.approx((1.0, np.sqrt(1 / 125), 2))


def test_levels_under_a_changing_load_give_no_rate_dependence(steps_fit):
    run = steps_fit.objective.terms[0].run
    time, at = np.arange(0, 100.0, 0.1), [50.0]
    levels = np.where(time < 50, 0.6, 0.59) + 1e-4 * np.random.default_rng(1).normal(size=time.size)
    steady = level_rates(time, levels, np.full(time.size, 2.0), at, run.velocities[:2])
    assert len(steady) == 1
    assert level_rates(time, levels, 2.0 + (time > 50), at, run.velocities[:2]) == ()


@pytest.mark.parametrize(("excess", "known"), [(1.0, False), (20.0, True)])
def test_a_sign_is_reported_only_if_every_allowed_minimum_has_it(steps_fit, excess, known):
    mirrored = steps_fit.values | {"A": steps_fit.values["B"], "B": steps_fit.values["A"]}
    rivalled = replace(steps_fit, optima=(Optimum(steps_fit.chi2 + excess, mirrored),))
    (sentence,) = (s for s in fit_in_words(rivalled) if "A - B" in s)
    assert ("velocity weakening" in sentence) == known


def test_a_gain_with_a_prior_widens_the_intervals(steps_fit):
    run = steps_fit.objective.terms[0].run
    gain, sd = 1.05, 0.02
    amplified = replace(run, friction=gain * run.friction)
    # Started at the minimum of `steps_fit`, of two in the times of the steps.
    start = {name: steps_fit.values[name] for name in (*FREE, "K")}
    prior = {"gain": Prior(1.04, sd, "calibration")}
    wide = fit(amplified, "rice-ruina", FREE, prior=prior, start=start, starts=1)
    # The recording does not determine the gain, which stays at its prior.
    assert wide.parameters["gain"].value == pytest.approx(1.04, rel=1e-3)
    assert wide.parameters["gain"].se == pytest.approx(sd, rel=1e-2)
    assert wide.undetermined == ()
    for name in ("A", "B", "K"):
        p, q = wide.parameters[name], steps_fit.parameters[name]
        # A, B and K over the gain give the same friction, and relative variances add.
        assert p.value == pytest.approx(gain / 1.04 * q.value, rel=3e-3)
        assert (p.se / p.value) ** 2 == pytest.approx(
            (q.se / q.value) ** 2 + (sd / 1.04) ** 2, rel=2e-2
        )
        assert abs(p.value - TRUE[name]) < 4 * p.se
    assert wide.values["D0"] == pytest.approx(steps_fit.values["D0"], rel=3e-3)
    assert wide.parameters["D0"].se == pytest.approx(steps_fit.parameters["D0"].se, rel=2e-2)
    # With A, B and K known the recording contradicts another gain.
    priors = {n: Prior(wide.values[n], 1e-3 * wide.values[n], "") for n in ("A", "B", "K")}
    priors["gain"] = Prior(1.5, 0.01, "")
    known = (replace(u, prior=priors.get(u.name, u.prior)) for u in wide.objective.unknowns)
    objective = replace(wide.objective, unknowns=tuple(known))
    end = objective.minimise(objective.coordinates(wide.values))
    said = described_fit(objective, [end], profile=False).warnings
    assert any(w.startswith("the prior of gain, 1.5 +- 0.01, is contradicted") for w in said)


@pytest.mark.parametrize(
    ("free", "prior", "message"),
    [
        ([*FREE, "gain"], {}, "gain must have a prior, got none: A, B, mu0 and K scale with it"),
        (FREE, {"gain[other]": Prior(1.0, 0.02, "given")}, r"must name gain, got 'gain\[other\]'"),
    ],
)
def test_a_gain_without_a_prior_or_of_another_run_is_refused(steps_fit, free, prior, message):
    with pytest.raises(InputError, match=message):
        fit(steps_fit.objective.terms[0].run, "rice-ruina", free, prior=prior)


def test_a_gain_under_a_changing_load_requires_mu0():
    (run,) = runs_of(CASES["loads"], 1)
    prior = {"gain": Prior(1.0, 0.02, "calibration")}
    with pytest.raises(InputError, match="mu0 must be free or given with a gain under a load"):
        fit(run, "linker-dieterich", [*FREE, "alpha"], prior=prior)


@pytest.mark.parametrize("name", ["gap", "R"])
def test_parameters_of_an_air_layer_are_refused_with_a_recording(steps_fit, name):
    with pytest.raises(InputError, match=f"got '{name}' of an air layer: a layer has one share"):
        fit(steps_fit.objective.terms[0].run, "rice-ruina", [*FREE, name])


def test_given_jumps_and_spikes_replace_the_detected_ones():
    (run,) = runs_of(CASE, 1)
    moved = run.friction + 0.01 * (run.time >= 90)
    moved[300] += 0.1
    assert cleaned(replace(run, friction=moved)).jumps == (90.0,)
    whole = cleaned(replace(run, friction=moved, spikes=(), jumps=()))
    np.testing.assert_array_equal(whole.friction, moved)
    assert (whole.spikes, whole.jumps) == ((), ())
    trace = trace_of(run.time + 5.0, moved, np.interp(run.time, [0, 140], [0, 7e-4]))
    named = recorded_run(trace, steps=[45.0], velocities=[3e-6, 1e-5], spikes=[35.01], jumps=[95.0])
    assert named.spikes == pytest.approx((30.0,))
    assert named.jumps == pytest.approx((90.0,))
    # The user may name more spikes than the search would take for spikes.
    many = replace(run, spikes=tuple(run.time[1:-1:10]))
    assert with_wrong_samples(many, ()).doubts == run.doubts
    with pytest.raises(InputError, match=r"jumps must lie inside the recording, got 500 s"):
        recorded_run(trace, steps=[45.0], velocities=[3e-6, 1e-5], jumps=[500.0])


FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data"
BASALT = FOLDER / "velstep4_BRAVA_expb819_basalt.txt"


@pytest.mark.slow
@pytest.mark.skipif(not BASALT.is_file(), reason="the recordings are not next to the repository")
def test_a_published_step_on_basalt_is_fitted():
    run = recorded_run(BASALT, window=(11640, 11700))
    assert run.load_unit == "Pa"
    result = fit(run, "rice-ruina", ["A", "B", "D0"], starts=4)
    white = fit(run, "rice-ruina", ["A", "B", "D0"], starts=4, runs=RunOptions(order=0))
    (term,) = result.objective.terms
    assert result.converged
    assert term.noise["effective_samples"] < 0.6 * run.time.size
    # In a plot steady friction rises by less than 1e-3 from 3 to 10 um/s.
    assert abs(result.values["A"] - result.values["B"]) < 1e-3
    assert result.parameters["D0"].se > 1.5 * white.parameters["D0"].se


def test_an_undetermined_stiffness_is_undetermined_over_the_load_too(steps_fit):
    lines = replace(steps_fit, undetermined=("K",)).summary()[1]
    values = {line[0]: line[1] for line in lines}
    assert values["K"] == values["K/W0"] == "not determined"
    assert values["A"] != "not determined"
