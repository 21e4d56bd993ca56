"""Derivatives of the response against finite differences and the limit of small modulation."""

import dataclasses

import numpy as np
import pytest

from asperity import Slider, periodic_response, perturbation_response, sensitivities
from asperity.errors import InputError
from asperity.laws import CutOff, ElastoPlastic, law_parameters

pytestmark = pytest.mark.slow

#: Of a derivative, relative to its largest term. Differences over 0.4 % and 0.2 %, extrapolated,
#: leave the fifth order, about (0.004 mu/A)^4; responses good to 1e-12 leave 1e-12/0.004.
DIFFERENCES = 2e-6

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
MACHINE = {"K": 2e5, "W0": 7.0, "M": 1.6}
#: A law with asperities: derivatives of every law, and multipliers of two states without
#: asperities, are in `test_response_function`.
LAWS = {"elasto-plastic": (ElastoPlastic, BASE | {"lambda_": 7e-7})}
#: V, frequency, epsilon: a complex pair of multipliers, and a real one.
DRIVES = {"elasto-plastic": [(1e-6, 120.0, 0.24), (1e-5, 120.0, 0.5)]}
#: A negative one, at an orbit that only the search finds. The derivatives of an orbit of the search
#: by two parameters are in `test_response_function`.
SEARCHED = (1e-6, 0.4, 0.24)
SCALARS = ("mean_friction", "mu1", "mu2", "phase1", "phase2")
STEP = 4e-3


def slider(name, numbers):
    kind = LAWS[name][0]
    law = kind(**{f.name: numbers[f.name] for f in dataclasses.fields(kind)})
    return Slider(law, spring=numbers["K"], load=numbers["W0"], mass=numbers["M"])


def numbers_of(name, drive):
    V, frequency, epsilon = drive
    return LAWS[name][1] | MACHINE | {"V": V, "frequency": frequency, "epsilon": epsilon}


def respond(name, numbers):
    return periodic_response(
        slider(name, numbers),
        velocity=numbers["V"],
        epsilon=numbers["epsilon"],
        frequency=numbers["frequency"],
        methods=("collocation",),
    )


def outputs(response):
    """All outputs, (points, outputs)."""
    scalars = [getattr(response, name) for name in SCALARS]
    return np.concatenate([np.stack(scalars, -1), response.log_multipliers], axis=-1)


def differences(name, drive):
    """Richardson's extrapolation of central differences, (parameters, outputs)."""
    numbers = numbers_of(name, drive)
    shifts = STEP * np.array([1.0, -1.0, 0.5, -0.5])
    count = len(numbers) * len(shifts)
    table = {key: np.full(count, value) for key, value in numbers.items()}
    for i, key in enumerate(table):
        table[key][4 * i : 4 * i + 4] *= 1 + shifts
    response = respond(name, table)
    assert response.converged.all()
    values = outputs(response).reshape(len(numbers), 4, -1)
    # Phases and arguments are continuous, not confined to (-pi, pi].
    step = np.stack([values[:, 0] - values[:, 1], 2 * (values[:, 2] - values[:, 3])])
    imaginary = np.angle(np.exp(1j * step.imag / [[[1]], [[2]]])) * [[[1]], [[2]]]
    slope = (step.real + 1j * imaginary) / (2 * STEP)
    return (4 * slope[1] - slope[0]) / 3 / np.array(list(numbers.values()))[:, None]


@pytest.fixture(scope="module", params=LAWS)
def case(request):
    """Sensitivities at all drives of a law, and its name."""
    return request.param, sensitivities_at(request.param, DRIVES[request.param])


def sensitivities_at(name, drives):
    numbers = numbers_of(name, np.transpose(drives))
    return sensitivities(
        slider(name, numbers),
        velocity=numbers["V"],
        epsilon=numbers["epsilon"],
        frequency=numbers["frequency"],
    )


def test_derivatives_have_the_names_and_shapes_of_the_parameters(case):
    name, result = case
    expected = (*law_parameters(LAWS[name][0]), "K", "W0", "M", "V", "frequency", "epsilon")
    assert result.parameters == expected
    assert result.converged.all()
    count = len(DRIVES[name])
    assert result.mu1.shape == (count, len(expected))
    assert result.log_multipliers.shape == (count, 2, len(expected))


def test_every_derivative_agrees_with_differences(case):
    name, result = case
    for row, drive in enumerate(DRIVES[name]):
        check_differences(name, drive, result, row)


@pytest.mark.long
def test_every_derivative_at_an_orbit_of_the_search_agrees_with_differences():
    name = "elasto-plastic"
    check_differences(name, SEARCHED, sensitivities_at(name, [SEARCHED]), 0)


def check_differences(name, drive, result, row):
    numbers, expected = numbers_of(name, drive), differences(name, drive)
    scalars = np.stack([getattr(result, output)[row] for output in SCALARS], axis=1)
    computed = np.concatenate([scalars, result.log_multipliers[row].T], axis=1)
    order = [result.parameters.index(key.rstrip("_")) for key in numbers]
    # Per unit relative change of the parameter, so that all of them compare.
    size = np.array(list(numbers.values()))[:, None]
    error = np.abs(computed[order] - expected) * size
    largest = np.abs(expected * size).max(axis=0)
    worst = error / largest
    assert worst.max() < DIFFERENCES, dict(zip(numbers, worst.max(1), strict=True))


def test_a_point_without_an_orbit_has_no_derivatives():
    numbers = numbers_of("elasto-plastic", DRIVES["elasto-plastic"][0])
    machine = slider("elasto-plastic", numbers)
    result = sensitivities(machine, velocity=1e-6, epsilon=[0.24, 0.9995], frequency=120.0)
    assert list(result.converged) == [True, False]
    for output in (*SCALARS, "log_multipliers"):
        assert np.isfinite(getattr(result, output)[0]).all()
        assert np.isnan(getattr(result, output)[1]).all()


def test_derivatives_to_the_mass_vanish_without_inertia(case):
    _, result = case
    at = result.parameters.index("M")
    for output in (*SCALARS, "log_multipliers"):
        assert not getattr(result, output)[..., at].any()


def test_derivatives_obey_scaling_of_length_time_and_force(case):
    # F/W0 has no unit: lengths, times and forces may be scaled without any effect.
    name, result = case
    numbers = numbers_of(name, np.transpose(DRIVES[name]))
    numbers["lambda"] = LAWS[name][1].get("lambda_")
    length = {"D0": 1, "V0": 1, "V": 1, "lambda": 1, "K": -1}
    time = {"V0": -1, "V": -1, "frequency": -1}
    force = {"K": 1, "W0": 1}
    for powers in (length, time, force):
        for output in ("mean_friction", "mu1", "phase2"):
            slopes = getattr(result, output)
            terms = np.array(
                [
                    slopes[:, result.parameters.index(key)] * numbers[key] * power
                    for key, power in powers.items()
                    if key in result.parameters
                ]
            )
            assert (np.abs(terms.sum(0)) < 1e-9 * np.abs(terms).max(0)).all()


def test_derivatives_at_small_modulation_are_those_of_perturbation_theory(case):
    name, _ = case
    epsilon = 1e-4
    numbers = numbers_of(name, (1e-5, 120.0, epsilon))
    drive = {"velocity": numbers["V"], "frequency": numbers["frequency"]}
    result = sensitivities(slider(name, numbers), epsilon=epsilon, **drive)
    limit = perturbation_response(slider(name, numbers), **drive)
    at = result.parameters.index("epsilon")
    mean = 2 * epsilon * np.asarray(limit.mean_curvature)
    first, second = (np.abs(np.asarray(c)) for c in (limit.transfer, limit.second_harmonic))
    # Next terms: (eps mu/A)^2 = 1.5e-5.
    np.testing.assert_allclose(result.mean_friction[at], mean, rtol=1e-4)
    np.testing.assert_allclose(result.mu1[at], first, rtol=1e-4)
    np.testing.assert_allclose(result.mu2[at], 2 * epsilon * second, rtol=1e-4)
    # mu_ss = mu0 - (B - A) ln(V/V0), closed form
    by_name = dict(zip(result.parameters, result.mean_friction, strict=True))
    assert by_name["mu0"] == pytest.approx(1, rel=1e-6)
    assert by_name["B"] == pytest.approx(-np.log(10), rel=1e-6)
    assert by_name["V0"] == pytest.approx((0.026 - 0.013) / 1e-6, rel=1e-5)


def test_one_point_has_no_axes(case):
    name, several = case
    numbers = numbers_of(name, DRIVES[name][0])
    one = sensitivities(
        slider(name, numbers),
        velocity="1 um/s",
        epsilon=0.24,
        frequency="120 Hz",
    )
    assert one.converged.shape == ()
    assert one.mu1.shape == (len(one.parameters),)
    size = np.array([numbers.get(key, 0) for key in one.parameters])
    terms = several.mu1[0] * size
    np.testing.assert_allclose(one.mu1 * size, terms, rtol=0, atol=1e-8 * np.abs(terms).max())


def test_bad_input_is_refused(case):
    name, _ = case
    chosen = slider(name, numbers_of(name, DRIVES[name][0]))
    with pytest.raises(InputError, match="epsilon must be at least 0 and below 1"):
        sensitivities(chosen, velocity=1e-6, epsilon=1.0, frequency=120.0)


@pytest.mark.long  # compiles equations of another law
def test_multipliers_of_an_orbit_that_sticks_have_no_derivatives():
    """The Jacobian jumps at instants that move with the parameters."""
    law = CutOff(**(BASE | {"V1": 6e-8, "V2": 1.5e-6}))
    point = {"velocity": 6e-8, "frequency": 7.0, "epsilon": 0.75}
    machine = Slider(law, spring=MACHINE["K"], load=MACHINE["W0"])
    response = periodic_response(machine, **point, waveform=64)
    sticks = np.isneginf(response.waveform[1])
    assert sticks.any()
    assert not sticks.all()
    result = sensitivities(machine, **point)
    assert result.converged
    counts = np.array(result.parameters) != "M"
    assert np.isnan(result.log_multipliers[:, counts]).all()
    # Mean and harmonics depend on the Jacobian alone.
    step = 1e-3
    moved = point | {"epsilon": point["epsilon"] * (1 + step * np.array([1.0, -1.0, 0.5, -0.5]))}
    mean = periodic_response(machine, **moved).mean_friction
    coarse, fine = (mean[0] - mean[1]) / (2 * step), (mean[2] - mean[3]) / step
    expected = (4 * fine - coarse) / 3 / point["epsilon"]
    at = result.parameters.index("epsilon")
    assert result.mean_friction[at] == pytest.approx(expected, rel=DIFFERENCES)


@pytest.mark.long  # compiles equations of rigid asperities
def test_rigid_asperities_with_damping_say_nothing_of_lambda():
    """Their equations are not those of the limit lambda = 0, where the mean has a slope."""
    rigid = slider("elasto-plastic", BASE | MACHINE | {"lambda_": 0.0})
    drive = {"velocity": 1e-6, "frequency": 120.0, "epsilon": 0.24}
    damped = sensitivities(rigid, **drive, radiation_damping=10.0)
    unknown = np.array(damped.parameters) == "lambda"
    assert np.isnan(damped.mean_friction[unknown]).all()
    assert np.isfinite(damped.mean_friction[~unknown]).all()
