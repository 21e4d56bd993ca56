"""The differentiable response: derivatives against differences, outcomes, one program for all."""

import os
from threading import Thread

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

from asperity import (
    Slider,
    periodic_response,
    perturbation_response,
    response_function,
    sensitivities,
)
from asperity._processes import in_kept_process
from asperity.errors import InputError
from asperity.laws import (
    ElastoPlastic,
    RiceRuina,
    get_law,
    law_parameters,
    parameter,
    registered,
)
from asperity.loads import modulated
from asperity.orbit import Outcome
from asperity.orbit.derivatives import (
    mesh_orbits,
    mesh_search as search_module,
    response_function as response_module,
)
from asperity.orbit.derivatives.mesh_search import SearchedOrbits, search_orbits
from asperity.orbit.derivatives.parametrised import ParametrisedProblem
from asperity.slider import QuasiStatic
from references.populations import population

#: Richardson's extrapolation of central differences over 0.2 % and 0.1 %, relative to the
#: largest derivative by the logarithm of a parameter: what it leaves is of the fourth order.
DIFFERENCES = 1e-7
STEP = 2e-3
#: Of integrals over a period by SciPy at 1e-12, absolute.
INTEGRATED = 1e-13
#: Agreement of two computations of one derivative.
ROUND_OFF = 1e-9
#: Of the response, as `periodic_response` has it.
PROMISED = 1e-8

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
BASE |= {"lambda": 7e-7, "alpha": 0.2, "c": 0.5, "B2": 0.005, "D2": 1.5e-6}
BASE |= {"V1": 1e-8, "V2": 1e-4, "L": 1e-8, "V_star": 1e-7}
MACHINE = {"K": 2e5, "W0": 7.0, "M": 1.6, "frequency": 120.0}
#: V and epsilon of fast modulation; four points, as many as programs are compiled for at least.
FAST = {"V": np.array([1e-6, 3e-6, 2e-6, 1e-6]), "epsilon": np.array([0.03, 0.05, 0.08, 0.01])}
#: Laws for each way to the multipliers: of two states, with and without asperities, and of more.
WITH_MULTIPLIERS = ("elasto-plastic", "two-state", "rice-ruina")
RATE_DEPENDENT = sorted(name for name, law in registered().items() if law.rate_dependent)


def point(law, **drive):
    own = {name: BASE[name] for name in law_parameters(get_law(law))}
    return own | MACHINE | FAST | drive


def columns(values):
    """All outputs as real columns, (points, columns)."""
    complex_ones = np.concatenate([values.harmonics, values.log_multipliers], axis=-1)
    return np.column_stack([values.mean_friction, complex_ones.real, complex_ones.imag])


def force(values):
    """Mean and harmonics alone."""
    return columns(values._replace(log_multipliers=values.log_multipliers[..., :0]))


def differences(model, parameters, name, columns=columns):
    """Derivative by the logarithm of a parameter, (points, columns).

    From the program that has the derivatives, so that none is compiled for values alone.
    """
    shares = (1.0, -1.0, 0.5, -0.5)
    moved = [parameters | {name: parameters[name] * (1 + STEP * share)} for share in shares]
    at = [columns(model.value_and_jacobian(numbers)[0]) for numbers in moved]
    coarse, fine = (at[0] - at[1]) / (2 * STEP), (at[2] - at[3]) / STEP
    return (4 * fine - coarse) / 3


def worst_difference(model, parameters, names=None, columns=columns):
    values, jacobian = model.value_and_jacobian(parameters)
    assert (values.outcome == Outcome.CONVERGED).all()
    names = names or [n for n in model.parameters if n != "M"]
    computed = {n: columns(jacobian[n]) * np.reshape(parameters[n], (-1, 1)) for n in names}
    expected = {n: differences(model, parameters, n, columns) for n in names}
    largest = np.max([np.abs(c) for c in computed.values()], axis=0)
    # Parts of a logarithm that cannot change, as the argument of a real multiplier, change by 0.
    scale = np.where(largest > 1e-12, largest, 1.0)
    return max((np.abs(computed[n] - expected[n]) / scale).max() for n in names)


def fast_model(law):
    return response_function(law, multipliers=law in WITH_MULTIPLIERS, search=False)


@pytest.mark.parametrize(
    "law",
    population(
        [*WITH_MULTIPLIERS, *(n for n in RATE_DEPENDENT if n not in WITH_MULTIPLIERS)], short=2
    ),
)
def test_derivatives_of_every_law_agree_with_differences(law):
    assert worst_difference(fast_model(law), point(law)) < DIFFERENCES


#: Laws as variants of the reference's equations, where they are none of their own.
VARIANTS = {
    "elasto-plastic-age": {"ageing": "plastic"},
    "ruina-slip": {"ageing": "slip"},
    "strength-area": {"product": True},
}


@pytest.mark.parametrize(
    "law",
    population(["elasto-plastic", *(n for n in RATE_DEPENDENT if n != "elasto-plastic")]),
)
def test_derivatives_of_every_law_agree_with_integrations_of_its_equations(reference, law):
    draw = np.random.default_rng(RATE_DEPENDENT.index(law))
    parameters = {n: v * draw.uniform(0.8, 1.25) for n, v in point(law).items()}
    values, jacobian = fast_model(law).value_and_jacobian(parameters)
    names = [n for n in jacobian if n not in ("M", "epsilon")]
    kind = reference.printed.get(law, reference.Printed)
    # From steady sliding the reference's Newton method finds orbits of weak modulation.
    for i in (0, 3):
        assert values.outcome[i] == Outcome.CONVERGED
        at = {n: float(np.broadcast_to(v, 4)[i]) for n, v in parameters.items()}
        own = {n + "_" * (n == "lambda"): at[n] for n in names}
        p = kind(**own, **VARIANTS.get(law, {}))
        expected = reference.derivatives(p, at["epsilon"], tuple(own))
        by = [(at[n], jacobian[n]) for n in (*names, "epsilon")]
        computed = [x * np.array([d.mean_friction[i], *d.harmonics[i]]) for x, d in by]
        error = np.abs(np.transpose(computed) - expected).max(1)
        assert (error < DIFFERENCES * np.abs(expected).max(1) + INTEGRATED).all()


@pytest.mark.parametrize("law", population(["elasto-plastic", "rice-ruina"]))
def test_derivatives_at_steady_sliding(law):
    """Without modulation: the steady state in closed form, and the linear response."""
    V = np.logspace(-7, -5, 4)
    own = {n + "_" * (n == "lambda"): BASE[n] for n in law_parameters(get_law(law))}
    slider = Slider(get_law(law)(**own), spring=MACHINE["K"], load=MACHINE["W0"])
    values, jacobian = fast_model(law).value_and_jacobian(point(law, V=V, epsilon=0.0))
    assert (values.outcome == Outcome.CONVERGED).all()
    logarithm = np.log(V / BASE["V0"])
    steady = BASE["mu0"] + (BASE["A"] - BASE["B"]) * logarithm
    np.testing.assert_allclose(values.mean_friction, steady, rtol=1e-12)
    for name, expected in (("mu0", 1.0), ("A", logarithm), ("B", -logarithm), ("epsilon", 0.0)):
        np.testing.assert_allclose(jacobian[name].mean_friction, expected, atol=1e-10)
    linear = perturbation_response(slider, velocity=V, frequency=MACHINE["frequency"])
    first = jacobian["epsilon"].harmonics[:, 0]
    np.testing.assert_allclose(first, linear.transfer, rtol=1e-8)


def test_derivatives_at_steady_sliding_where_the_fast_method_contracts_slowly_or_not():
    own = {n: BASE[n] for n in law_parameters(RiceRuina)}
    # Rates from 0.6 to 0.9 per radian, and 9.
    frequency = np.array([0.2, 2.0, 2.4, 3.0])
    given = own | MACHINE | {"K": 1e6, "V": 2e-6, "frequency": frequency, "epsilon": 0.0}
    values, jacobian = response_function("rice-ruina", harmonics=1).value_and_jacobian(given)
    assert (values.outcome == Outcome.CONVERGED).all()
    np.testing.assert_allclose(values.harmonics, 0.0, atol=1e-30)
    for name, expected in (("mu0", 1.0), ("A", np.log(2)), ("B", -np.log(2)), ("epsilon", 0.0)):
        np.testing.assert_allclose(jacobian[name].mean_friction, expected, atol=1e-9)
    slider = Slider(RiceRuina(**own), spring=1e6, load=MACHINE["W0"])
    linear = perturbation_response(slider, velocity=2e-6, frequency=frequency)
    np.testing.assert_allclose(jacobian["epsilon"].harmonics[:, 0], linear.transfer, rtol=1e-8)
    # The modulus of a harmonic has no derivative where the harmonic vanishes.
    drive = {"velocity": 2e-6, "epsilon": 0.0, "frequency": frequency}
    assert np.isnan(sensitivities(slider, **drive).mu1[:, -1]).all()


class TestElastoPlastic:
    """Of one law, so that all of these share their programs."""

    model = fast_model("elasto-plastic")
    parameters = point("elasto-plastic")

    plain = response_function("elasto-plastic", harmonics=1, search=False)

    def arrays(self):
        return {n: v * np.ones(4) for n, v in self.parameters.items()}

    def test_values_are_those_of_periodic_response(self):
        law = ElastoPlastic(
            **{f"{n}_" if n == "lambda" else n: BASE[n] for n in law_parameters(ElastoPlastic)}
        )
        expected = periodic_response(
            Slider(law, spring=2e5, load=7.0),
            velocity=FAST["V"],
            epsilon=FAST["epsilon"],
            frequency=120.0,
        )
        values = self.model(self.parameters)
        np.testing.assert_allclose(values.mean_friction, expected.mean_friction, rtol=PROMISED)
        np.testing.assert_allclose(values.harmonics, expected.harmonics[:, :2], rtol=PROMISED)
        gap = np.abs(values.log_multipliers - expected.log_multipliers)
        assert gap.max() < PROMISED

    def test_values_with_and_without_derivatives(self):
        """`differences` has the values of the program with derivatives, users those of both."""
        alone = self.model(self.parameters)
        beside, _ = self.model.value_and_jacobian(self.parameters)
        np.testing.assert_allclose(force(alone), force(beside), rtol=1e-12, atol=1e-14)
        gap = np.abs(alone.log_multipliers - beside.log_multipliers)
        assert gap.max() < ROUND_OFF

    def test_forward_and_reverse_mode_agree(self):
        parameters = self.arrays()
        random = np.random.default_rng(11)
        tangents = {n: v * random.normal(size=4) for n, v in parameters.items()}
        weights = random.normal(size=(2, 4, 1))
        cotangent = weights[0] + 1j * weights[1]

        @jax.jit
        def both_ways(parameters, tangents, cotangent):
            def harmonics(p):
                return self.plain(p).harmonics

            _, push = jax.linearize(harmonics, parameters)
            return push(tangents), jax.linear_transpose(push, parameters)(cotangent)[0]

        moved, gradient = both_ways(parameters, tangents, cotangent)
        # JAX pulls back without complex conjugation.
        along = sum((np.asarray(gradient[n]) * tangents[n]).sum() for n in parameters)
        assert along == pytest.approx((cotangent * np.asarray(moved)).sum().real, rel=ROUND_OFF)

    def test_second_derivatives_agree_with_differences(self):
        @jax.jit
        def along(epsilon, direction):
            """Gradient of the sum of the means, and its change along a direction."""

            def mean(e):
                return self.plain(self.arrays() | {"epsilon": e}).mean_friction.sum()

            return jax.jvp(jax.grad(mean), (epsilon,), (direction,))

        epsilon, direction = FAST["epsilon"], np.ones(4)
        hessian = np.array([along(epsilon, unit)[1] for unit in np.eye(4)])
        assert np.abs(hessian - np.diag(np.diag(hessian))).max() == 0
        up, down, half_up, half_down = (
            np.asarray(along(epsilon * (1 + STEP * share), direction)[0])
            for share in (1.0, -1.0, 0.5, -0.5)
        )
        coarse, fine = (up - down) / (2 * STEP), (half_up - half_down) / STEP
        expected = (4 * fine - coarse) / (3 * epsilon)
        np.testing.assert_allclose(np.diag(hessian), expected, rtol=1e-7)

    def test_other_values_of_parameters_compile_nothing(self):
        self.model(self.parameters)
        self.model.value_and_jacobian(self.parameters)
        count = 0

        def listen(event, *_, **__):
            nonlocal count
            count += event.endswith("backend_compile_duration")

        jax.monitoring.register_event_duration_secs_listener(listen)
        try:
            for scale in (0.9, 1.1):
                moved = {n: scale * np.asarray(v) for n, v in self.parameters.items()}
                self.model(moved)
                self.model.value_and_jacobian(moved)
        finally:
            jax.monitoring.unregister_event_duration_listener(listen)
        assert count == 0

    def test_padded_calls_give_the_same_values(self):
        wide = response_function("elasto-plastic", least_points=5)
        assert [wide.compiled_points(n) for n in (1, 8, 9)] == [8, 8, 16]
        few = {n: v[:3] if np.ndim(v) else v for n, v in self.parameters.items()}
        expected, padded = self.model(few), wide(few)
        np.testing.assert_allclose(force(padded), force(expected), rtol=ROUND_OFF)
        assert padded.mean_friction.shape == (3,)

    def test_a_point_without_an_orbit_is_nan_and_does_not_affect_others(self):
        # Slow modulation, which the fast method leaves to the search.
        moved = self.parameters | {"frequency": np.array([120.0, 0.01, 120.0, 120.0])}
        values, jacobian = self.model.value_and_jacobian(moved)
        assert list(values.outcome == Outcome.CONVERGED) == [True, False, True, True]
        for numbers in (values, *jacobian.values()):
            assert np.isnan(numbers.mean_friction[1])
            assert np.isnan(numbers.harmonics[1]).all()
            assert np.isfinite(np.delete(numbers.mean_friction, 1)).all()
            assert np.isfinite(np.delete(numbers.harmonics, 1, axis=0)).all()

    def test_a_traced_value_that_breaks_its_rule_is_invalid(self):
        moved = self.arrays() | {"A": np.array([0.013, -0.013, 0.013, 0.013])}
        outcome = jax.jit(lambda p: self.plain(p).outcome)(moved)
        good, invalid = Outcome.CONVERGED, Outcome.INVALID
        assert np.asarray(outcome).tolist() == [good, invalid, good, good]

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"mu": 0.5}, "parameters must have known names, got 'mu'; did you mean 'mu0'"),
            ({"K": np.ones(2)}, r"arrays of one shape \(points,\), got K \(2,\)"),
            ({"K": np.ones((3, 1))}, r"arrays of one shape \(points,\)"),
            ({"A": -1.0}, r"parameters\['A'\] must be positive, got -1"),
            ({"epsilon": 1.0}, r"parameters\['epsilon'\] must be at least 0 and below 1"),
        ],
    )
    def test_bad_input_is_refused(self, change, message):
        with pytest.raises(InputError, match=message):
            self.model(self.parameters | change)

    def test_missing_parameters_are_named(self):
        given = {n: v for n, v in self.parameters.items() if n not in ("K", "epsilon")}
        with pytest.raises(InputError, match="got none for K, epsilon"):
            self.model(given)

    def test_unknown_names_of_derivatives_are_refused(self):
        with pytest.raises(InputError, match="names must have known names, got 'lamda'; did you"):
            self.model.value_and_jacobian(self.parameters, names=["A", "lamda"])

    def test_parameters_without_axes_give_values_without_axes(self):
        values = self.model(self.parameters | {"V": 1e-6, "epsilon": 0.24})
        assert values.mean_friction.shape == ()
        assert values.harmonics.shape == (2,)


class _TwoSpeeds(RiceRuina):
    """F/W = mu0 + A ln(v/V1)/ln(V2/V1) + B phi, which V1 = V2 leaves undefined."""

    name = "two-speeds"
    V1: float = parameter("law.V1", "velocity")
    V2: float = parameter("law.V2", "velocity")

    def friction(self, v, state, w):
        share = jnp.log(v / self.V1) / jnp.log(self.V2 / self.V1)
        return self.mu0 + self.A * share + self.B * state[0]


class _InMicrometres(RiceRuina):
    name = "in-micrometres"
    D0: float = eqx.field(converter=lambda length: jnp.asarray(length) * 1e-6)


class _InCelsius(RiceRuina):
    name = "in-celsius"
    A: float = eqx.field(converter=lambda temperature: 4e-5 * (jnp.asarray(temperature) + 273.15))


class _Squared(RiceRuina):
    name = "squared"
    D0: float = eqx.field(converter=lambda root: jnp.asarray(root) ** 2)


def test_a_problem_has_the_numbers_of_a_users_law():
    machine = {**MACHINE, "V": 1e-6, "epsilon": 0.05}
    for law, own in (
        (_TwoSpeeds, {"V1": 1e-6, "V2": 1e-5}),
        (_InMicrometres, {"D0": 0.4}),
    ):
        given = {n: BASE[n] for n in law_parameters(RiceRuina)} | machine | own
        equations = ParametrisedProblem(law, QuasiStatic)
        problem = equations.problem(given)
        assert equations.values(problem) == pytest.approx(given, rel=1e-15)
        np.testing.assert_allclose(problem.system.slider.law.D0, 4e-7, rtol=1e-15)
        assert problem.system.omega == pytest.approx(2 * np.pi * 120.0, rel=1e-15)


@pytest.mark.parametrize(("law", "name"), [(_InCelsius, "A"), (_Squared, "D0")])
def test_a_law_whose_field_is_no_multiple_of_its_parameter_is_refused(law, name):
    with pytest.raises(InputError, match=f"another function of {name} in a field of '{law.name}'"):
        response_function(law)(point("rice-ruina"))


def test_law_without_dynamics_is_refused():
    with pytest.raises(InputError, match="law must depend on the velocity, got amontons"):
        response_function("amontons")


#: Parameters that differ in how they enter the equations; mass or damping comes with them.
NAMES = ["A", "D0", "K", "V", "epsilon"]


#: `DAMPED` and the orbits of the search below have rigid asperities in every run.
@pytest.mark.parametrize("law", population(["elasto-plastic", "rice-ruina"]))
class TestInertiaAndDamping:
    """Both at once, so that one program has both; by the fast method."""

    def model(self, law):
        return response_function(law, inertia=True, radiation_damping=True, search=False)

    def test_derivatives(self, law):
        parameters = point(law, eta=2e4)
        assert worst_difference(self.model(law), parameters, [*NAMES, "M", "eta"]) < DIFFERENCES

    def test_values_are_those_of_periodic_response(self, law):
        # Damping and harmonics for which other tests have the methods compiled.
        eta, elastic = 500.0, law == "elasto-plastic"
        values, _ = self.model(law).value_and_jacobian(point(law, eta=eta))
        own = {n + "_" * (n == "lambda"): BASE[n] for n in law_parameters(get_law(law))}
        expected = periodic_response(
            Slider(get_law(law)(**own), spring=2e5, load=7.0, mass=1.6),
            velocity=FAST["V"],
            epsilon=FAST["epsilon"],
            frequency=120.0,
            inertia=True,
            radiation_damping=eta,
            harmonics=8 if elastic else 2,
        )
        np.testing.assert_allclose(values.mean_friction, expected.mean_friction, rtol=PROMISED)
        np.testing.assert_allclose(values.harmonics, expected.harmonics[:, :2], rtol=PROMISED)


#: Damping without inertia, on stiff asperities.
DAMPED = response_function("rice-ruina", radiation_damping=True, search=False)


def test_derivatives_with_damping_alone_agree_with_differences():
    assert worst_difference(DAMPED, point("rice-ruina", eta=2e4), [*NAMES, "eta"]) < DIFFERENCES


def test_damping_against_independent_integration():
    # Without asperities and inertia: eta v takes part of the force, Rice (1993).
    numbers = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
    K, W0, V, frequency, epsilon, eta = 2e5, 7.0, 2e-6, 120.0, 0.1, 1e5

    def rates(theta, state):
        force, phi = state
        w = 1 + epsilon * np.cos(theta)

        def excess(q):
            strength = numbers["mu0"] + numbers["A"] * (q + np.log(V / numbers["V0"]))
            age = numbers["B"] * (phi - np.log(V / numbers["V0"]))
            return w * (strength + age) + eta * V / W0 * np.exp(q) - force

        v = np.exp(brentq(excess, -200.0, 20.0, xtol=1e-15, rtol=1e-15))
        omega = 2 * np.pi * frequency
        return [V * K / (omega * W0) * (1 - v), V / (omega * numbers["D0"]) * (np.exp(-phi) - v)]

    def period(start, samples=None):
        return solve_ivp(rates, (0, 2 * np.pi), start, "DOP853", samples, rtol=1e-12, atol=1e-14)

    def gap(start):
        return period(start).y[:, -1] - start

    steady = numbers["mu0"] + (numbers["A"] - numbers["B"]) * np.log(V / numbers["V0"])
    start = fsolve(gap, [steady + eta * V / W0 - 0.02, 0.1], xtol=1e-13)
    samples = period(start, 2 * np.pi * np.arange(256) / 256).y[0]
    spectrum = np.fft.rfft(samples) / 256
    values, _ = DAMPED.value_and_jacobian(
        numbers | {"K": K, "W0": W0, "V": V, "frequency": frequency, "epsilon": epsilon, "eta": eta}
    )
    assert values.mean_friction == pytest.approx(spectrum[0].real, rel=1e-9)
    assert values.harmonics == pytest.approx(2 * spectrum[1:3], rel=1e-7)


def test_load_that_is_neither_harmonic_nor_even():
    load = modulated(epsilon=0.1, load={2: (0.04, 0.7)}, tilt="5 deg", pull=0.2)
    law = "elasto-plastic"
    model = response_function(law, modulation=load, search=False)
    parameters = {n: v for n, v in point(law).items() if n != "epsilon"}
    coefficients = [n for n in model.parameters if n.startswith(("load", "shear", "pull"))]
    given = {n: v for n, v in zip(coefficients, values_of(load), strict=True) if v}
    assert len(given) == 7
    assert worst_difference(model, parameters | given, [*NAMES[:-1], *given]) < DIFFERENCES
    own = {n + "_" * (n == "lambda"): BASE[n] for n in law_parameters(ElastoPlastic)}
    expected = periodic_response(
        Slider(ElastoPlastic(**own), spring=2e5, load=7.0),
        velocity=FAST["V"],
        modulation=load,
        frequency=120.0,
        methods=("collocation",),
    )
    values, _ = model.value_and_jacobian(parameters)
    np.testing.assert_allclose(values.mean_friction, expected.mean_friction, rtol=PROMISED)
    np.testing.assert_allclose(values.harmonics, expected.harmonics[:, :2], rtol=PROMISED)


def values_of(load):
    """Coefficients in the order of their names."""
    return [v for series in (load.load, load.shear, load.pull) for pair in series for v in pair]


#: As `DIFFERENCES`, of orbits that are solved to some 1e-10, over a step of 1e-3.
SEARCHED = 1e-6


def test_derivatives_at_orbits_of_the_search():
    # Asked for multipliers too, which with inertia or damping the search alone gives.
    model = response_function("rice-ruina", inertia=True, radiation_damping=True, multipliers=True)
    parameters, names = point("rice-ruina", eta=500.0), ["A", "K", "eta", "M"]
    values, jacobian = model.value_and_jacobian(parameters)
    assert (values.outcome == Outcome.CONVERGED).all()
    # In one call: at each of the four points another parameter is moved.
    moved = {n: np.repeat(np.broadcast_to(v, 4), 4) for n, v in parameters.items()}
    for row, name in enumerate(names):
        moved[name][4 * row : 4 * row + 4] *= 1 + STEP * np.array([1.0, -1.0, 0.5, -0.5])
    at = force(model(moved)).reshape(4, 4, -1)
    coarse, fine = (at[:, 0] - at[:, 1]) / (2 * STEP), (at[:, 2] - at[:, 3]) / STEP
    computed = np.stack([force(jacobian[n]) * np.reshape(parameters[n], (-1, 1)) for n in names])
    own = computed[np.arange(4), np.arange(4)]
    error = np.abs(own - (4 * fine - coarse) / 3)
    assert (error < SEARCHED * np.abs(computed).max(0)).all()


def test_searches_of_programs_share_a_process():
    """Compiled programs call the search in threads of their own, which end after the call."""
    processes = []
    for _ in range(2):
        call = Thread(target=lambda: processes.append(in_kept_process(os.getpid)))
        call.start()
        call.join()
    assert processes[0] == processes[1] != os.getpid()


def test_points_that_fill_up_a_program_are_not_searched_for(monkeypatch):
    searched = []

    def search(equations, harmonics, parameters, wanted):
        searched.append(wanted.tolist())
        outcome = np.where(wanted, int(Outcome.FOLDED), int(Outcome.NO_ORBIT))
        return SearchedOrbits(outcome, [])

    monkeypatch.setattr(mesh_orbits, "search_orbits", search)
    program = response_function("rice-ruina")._program
    parameters = {n: np.full(4, BASE.get(n, 1.0)) for n in program.equations.names}
    parameters["V"] = np.array([3e-6, 1e-6, 2e-6, 2e-6])
    wanted = np.array([True, False, True, True])
    _, outcome, _ = mesh_orbits._response(program, parameters, wanted, True)
    assert searched == [[True, False, True, False]]
    assert (outcome == np.where(wanted, Outcome.FOLDED, Outcome.NO_ORBIT)).all()


@pytest.mark.long
def test_second_derivatives_at_orbits_of_the_search_are_nan():
    # Slow modulation, where the fast method does not converge, and a series does: the first
    # derivative is that outside of programs, and nobody takes a second one for an answer. A point
    # of the fast method beside them keeps its second derivatives.
    model = response_function("rice-ruina", harmonics=1)
    own = {n: BASE[n] for n in law_parameters(RiceRuina)} | MACHINE
    slow = np.array([True, True, False, True])
    own |= {"V": 1e-6, "frequency": np.where(slow, 0.1, 120.0), "epsilon": 0.2, "K": 1e6}

    @jax.jit
    def along(logs):
        """Gradient of the sum of the means, and its change along all ones."""

        def mean(logs):
            return model(own | {"A": own["A"] * jnp.exp(logs)}).mean_friction.sum()

        values, changes = jax.jvp(jax.value_and_grad(mean), (logs,), (jnp.ones(4),))
        return values[1], *changes

    gradient, of_sum, second = map(np.asarray, along(np.zeros(4)))
    _, jacobian = model.value_and_jacobian(own)
    np.testing.assert_allclose(gradient, own["A"] * jacobian["A"].mean_friction, rtol=1e-12)
    assert np.isnan(of_sum)
    assert (np.isnan(second) == slow).all()


def test_each_orbit_of_the_search_is_differentiated_on_a_mesh_that_resolves_it(monkeypatch):
    # Slow modulation from faint to sharp: some orbits need more than the coarser mesh.
    own = {n: BASE[n] for n in law_parameters(RiceRuina)} | MACHINE
    drive = {"V": 1e-6, "frequency": 0.4, "epsilon": np.array([0.01, 0.05, 0.2, 0.6])}
    parameters = own | drive | {"K": 1e6}
    searched = []

    def search(*arguments, **options):
        orbits = search_orbits(*arguments, **options)
        searched.extend(orbits.parts)
        return orbits

    monkeypatch.setattr(response_module, "search_orbits", search)
    monkeypatch.setattr(search_module, "MESHES", (16, 48))
    model = response_function("rice-ruina", harmonics=1)
    values, jacobian = model.value_and_jacobian(parameters)
    assert (values.outcome == Outcome.CONVERGED).all()
    assert {len(part.orbit.mesh) - 1 for _, part in searched} == {16, 48}
    assert np.sort(np.concatenate([index for index, _ in searched])).tolist() == [0, 1, 2, 3]
    # Only ratios count: of K to W0, of V and V0 to the frequency.
    by_logarithm = {n: columns(jacobian[n]) * np.reshape(parameters[n], (-1, 1)) for n in jacobian}
    for group in (("K", "W0"), ("V", "V0", "frequency")):
        total = sum(by_logarithm[n] for n in group)
        largest = np.max([np.abs(by_logarithm[n]) for n in group], axis=0)
        assert (np.abs(total) < SEARCHED * largest).all()
