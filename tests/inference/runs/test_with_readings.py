"""Fits of a recording together with lock-in readings: one law, and a stiffness for each machine."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.coverage import CASES, TRUE, runs_of

from asperity.errors import InputError
from asperity.inference import Prior, fit, table_of
from asperity.inference.fitting.assembly import Given, objective_of
from asperity.inference.fitting.parabola import parabola_of
from asperity.inference.runs.term import RunTerm
from asperity.laws import RiceRuina, get_law
from asperity.orbit import periodic_response
from asperity.slider import Slider
from benchmarks import coverage

FREE = ["A", "B", "D0"]


@pytest.fixture(scope="module")
def steps_fit():
    return fit(next(runs_of(CASES["steps"], 1)), "rice-ruina", FREE, start=TRUE, starts=1)


def readings():
    """Exact lock-in readings of a slider with the law of the recordings on another spring."""
    V = np.repeat([1e-6, 3e-6, 1e-5], 4)
    epsilon = np.tile([0.05, 0.1, 0.15, 0.2], 3)
    law = RiceRuina(mu0=0.6, V0=1e-6, **{name: TRUE[name] for name in ("A", "B", "D0")})
    slider = Slider(law, spring=2e6, mass=0.0, load=1000.0)
    r = periodic_response(slider, velocity=V, epsilon=epsilon, frequency=120.0)
    assert r.converged.all()
    columns = {"V": V, "epsilon": epsilon, "frequency": np.full(12, 120.0), "K": np.full(12, 2e6)}
    columns |= {"mean_friction": r.mean_friction, "mean_friction_err": np.full(12, 1e-3)}
    return table_of(columns)


def test_readings_and_a_recording_are_fitted_together_each_with_its_stiffness(steps_fit):
    (term,) = steps_fit.objective.terms
    fixed = {"mu0": 0.6, "V0": 1e-6, "W0": 1000.0}
    start = {name: steps_fit.values[name] for name in FREE}
    result = fit([readings(), term.run], "rice-ruina", FREE, fixed=fixed, start=start, starts=1)
    assert result.converged
    assert result.parameters[f"K[{term.name}]"].unit == "Pa/m"
    for name in FREE:
        p = result.parameters[name]
        assert abs(p.value - TRUE[name]) < 4 * p.se
        assert p.se < steps_fit.parameters[name].se
    # A misfit of the readings is not hidden by the samples of the recording.
    table, run = result.objective.terms
    off = table.table.values["mean_friction"] + np.tile([2e-3, -2e-3], 6)
    other = table.with_table(replace(table.table, values={"mean_friction": off}))
    objective = replace(result.objective, terms=(other, run))
    at = parabola_of(objective, *objective.minimise(objective.coordinates(result.values)))
    assert 9 <= at.dof <= 12
    assert at.p_value < 1e-4


@pytest.mark.parametrize(("free", "fixed"), [([*FREE, "K"], {}), (FREE, {"K": 2e6})])
def test_a_stiffness_in_another_unit_than_the_readings_is_refused(steps_fit, free, fixed):
    (term,) = steps_fit.objective.terms
    fixed = {"mu0": 0.6, "V0": 1e-6, "W0": 1000.0, **fixed}
    with pytest.raises(InputError, match=r"K must be in Pa/m for .*, got that of a table in N/m"):
        fit([readings(), term.run], "rice-ruina", free, fixed=fixed)


def test_a_stiffness_shared_with_readings_may_be_given_over_the_load(steps_fit):
    (term,) = steps_fit.objective.terms
    run = replace(term.run, load_unit="N", W0=1000.0)
    result = fit(
        [readings(), run],
        "rice-ruina",
        [*FREE, "K"],
        fixed={"mu0": 0.6, "V0": 1e-6, "W0": 1000.0},
        prior={"K": Prior(coverage.STIFFNESS, 0.001 * coverage.STIFFNESS, "unloading", "1/m")},
        start={
            "K": f"{1e-6 * coverage.STIFFNESS} 1/um",
            **{name: steps_fit.values[name] for name in FREE},
        },
        starts=1,
    )
    K = result.parameters["K"]
    assert K.unit == "N/m"
    assert K.value == pytest.approx(1000.0 * coverage.STIFFNESS, rel=0.01)
    assert result.over_load["K/W0"].value == pytest.approx(1e-6 * coverage.STIFFNESS, rel=0.01)
    of_table = replace(result.objective, fixed=result.objective.fixed | {"W0": 2000.0})
    assert replace(result, objective=of_table).over_load == {}


def test_a_shared_stiffness_over_different_loads_is_refused(steps_fit):
    """It was that over the load of the first recording, or of the table."""
    run = replace(steps_fit.objective.terms[0].run, load_unit="N", W0=500.0)
    other = replace(run, name="other", W0=1000.0, friction=run.friction[::-1].copy())
    prior, fixed = {"K": Prior(2e3, 20.0, "", "1/m")}, {"mu0": 0.6, "V0": 1e-6, "W0": 1000.0}
    for data, more in (([run, other], {}), ([readings(), run], {"fixed": fixed})):
        with pytest.raises(InputError, match="K over the load must come with one W0"):
            fit(data, "rice-ruina", [*FREE, "K"], prior=prior, **more)


def test_numbers_in_columns_of_a_table_are_those_of_the_recordings_too(steps_fit):
    run = replace(steps_fit.objective.terms[0].run, load_unit="N", W0=1000.0)
    table, motion = readings(), {"inertia": True, "radiation_damping": False}
    law, given = get_law("rice-ruina"), Given({"mu0": 0.6, "W0": 1000.0}, None, None, None)
    for mass in (np.full(12, 0.3), np.linspace(0.3, 0.4, 12)):
        points = table.points | {"V0": np.full(12, 2e-6), "M": mass}
        data = [replace(table, points=points), run]
        if np.ptp(mass):
            with pytest.raises(InputError, match="M must have one value in a fit with recordings"):
                objective_of(law, data, FREE, given, motion=motion)
        else:
            (term,) = objective_of(law, data, FREE, given, motion=motion).terms_of(RunTerm)
            assert (term.fixed["V0"], term.fixed["M"]) == (2e-6, 0.3)


def test_a_free_load_of_a_table_is_not_that_of_a_recording(steps_fit):
    """The stiffness of the recording is over its measured load."""
    run = replace(steps_fit.objective.terms[0].run, load_unit="N", W0=1000.0)
    given = Given({"mu0": 0.6, "V0": 1e-6}, None, None, {"W0": 7.0})
    free = [*FREE, "W0"]
    objective = objective_of(get_law("rice-ruina"), [readings(), run], free, given)
    (term,) = objective.terms_of(RunTerm)
    known = steps_fit.values
    values = {k.name: known.get(k.name.partition("[")[0], k.middle) for k in objective.unknowns}
    values[f"K[{run.name}]"] *= 1000.0 / steps_fit.objective.terms[0].run.W0
    one, other = term.chi2_of_many([values, values | {"W0": 14.0}])
    assert math.isfinite(one)
    assert one == other


def test_a_summary_has_the_sign_of_A_less_B_and_chi_squared_only_of_given_noise(steps_fit):
    lines = {line.name: line for line in steps_fit.summary()[1]}
    assert lines["A - B"].meaning == "velocity weakening"
    value, _, error = lines["A - B"].value.partition(" +- ")
    assert float(value) == pytest.approx(TRUE["A"] - TRUE["B"], abs=4 * float(error))
    assert not {"chi2", "p_value"} & lines.keys()
    fixed = {"mu0": 0.6, "V0": 1e-6, "W0": 1000.0, "D0": TRUE["D0"]}
    table = fit(readings(), "rice-ruina", ["A", "B"], fixed=fixed)
    assert {"A - B", "chi2", "p_value"} <= {line.name for line in table.summary()[1]}
