"""Identities that every registered law obeys, and mistakes planted in laws, which they detect."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from asperity.laws import (
    CutOff,
    ElastoPlastic,
    Law,
    LinkerDieterich,
    Nagata,
    PerrinRiceZheng,
    PrakashClifton,
    Regularised,
    RiceRuina,
    StrengthArea,
    TwoState,
    get_law,
    identities,
    registered,
    registry,
)
from asperity.laws.identities import EXACT, check_law, sample
from asperity.loads import Excitation
from asperity.slider import QuasiStatic, Slider
from asperity.theory.perturbation import perturb

RATE_AND_STATE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 3e-6}

#: Exponents of (length, time, force) in the parameters that have a unit.
LENGTH, VELOCITY = (1, 0, 0), (1, -1, 0)
DIMENSIONS = dict.fromkeys(("D0", "D2", "L", "lambda_"), LENGTH)
DIMENSIONS |= dict.fromkeys(("V0", "V1", "V2", "V_star"), VELOCITY)

Parameters = Mapping[str, float]


class Limit(NamedTuple):
    """The law that another one becomes for `exact` parameters, and nearly becomes for `near` ones.

    states: turns a state of motion (Y, w) into one at which the two laws agree.
    """

    law: str
    exact: Parameters
    near: Parameters
    states: Callable[[jax.Array, jax.Array], jax.Array] = lambda Y, w: Y


def vanishing(law: str, **parameters: float) -> tuple[Limit, ...]:
    """The limit of a law when these parameters, given with a typical size, vanish."""
    near = {name: 1e-12 * value for name, value in parameters.items()}
    return (Limit(law, dict.fromkeys(parameters, 0.0), near),)


@dataclasses.dataclass(frozen=True)
class Example:
    """Parameters of a law, and what follows from its published equations.

    slope: d mu_ss / d ln v. limits: laws that it becomes. load_step: F/W after W, equal to w, is
    multiplied by a factor at constant v and continuous state, where F/W was f. age_velocity: the
    velocity on which the rates of the states depend. memoryless: parameters with which friction
    does not depend on the age; rate: friction with these.
    """

    parameters: Parameters
    slope: Callable[[Parameters, float], float] = lambda p, v: p["A"] - p["B"]
    limits: tuple[Limit, ...] = ()
    load_step: Callable[[Parameters, jax.Array, jax.Array, float], jax.Array] = (
        lambda p, f, w, factor: f
    )
    age_velocity: str | None = "slider"
    memoryless: Parameters = dataclasses.field(default_factory=lambda: {"B": 1e-200})
    rate: Callable[[Parameters, jax.Array, tuple[jax.Array, ...], jax.Array], jax.Array] = (
        lambda p, v, state, w: p["mu0"] + p["A"] * np.log(v / p["V0"])
    )
    invertible: bool = True

    def law(self, kind: type[Law], **changes: float) -> Law:
        return kind(**{**self.parameters, **changes})


def product_slope(p: Mapping[str, float], v: float) -> float:
    """Derivative of mu0 (1 + eta L)(1 - m L), L = ln(v/V0): Eqs. (4) and (5) at Phi = D0/v."""
    eta, m, log = p["A"] / p["mu0"], p["B"] / p["mu0"], np.log(v / p["V0"])
    return p["mu0"] * (eta * (1 - m * log) - m * (1 + eta * log))


def regularised_slope(p: Parameters, v: float) -> float:
    """Derivative of A asinh(x), x = v/(2 V0) exp((mu0 - B ln(v/V0))/A)."""
    x = v / (2 * p["V0"]) * np.exp((p["mu0"] - p["B"] * np.log(v / p["V0"])) / p["A"])
    return (p["A"] - p["B"]) / np.sqrt(1 + x**-2)


EXAMPLES = {
    "amontons": Example({"mu0": 0.5}, slope=lambda p, v: 0.0, age_velocity=None, invertible=False),
    "rice-ruina": Example(RATE_AND_STATE),
    "linker-dieterich": Example(
        {**RATE_AND_STATE, "alpha": 0.2},
        limits=vanishing("rice-ruina", alpha=0.2),
        load_step=lambda p, f, w, factor: f - p["alpha"] * np.log(factor),
        memoryless={"B": 1e-200, "alpha": 0.0},
    ),
    "elasto-plastic": Example(
        {**RATE_AND_STATE, "lambda_": 7e-7}, limits=vanishing("rice-ruina", lambda_=7e-7)
    ),
    "elasto-plastic-age": Example(
        {**RATE_AND_STATE, "lambda_": 7e-7},
        limits=vanishing("rice-ruina", lambda_=7e-7),
        age_velocity="plastic",
    ),
    "strength-area": Example(RATE_AND_STATE, slope=product_slope),
    # The laws differ by exp(-2 F/(A W)), 1e-30 here.
    "regularised": Example(RATE_AND_STATE, slope=regularised_slope, limits=vanishing("rice-ruina")),
    "cut-off": Example(
        {**RATE_AND_STATE, "V1": 1e-8, "V2": 1e-4},
        slope=lambda p, v: p["A"] * v / (v + p["V1"]) - p["B"] * p["V2"] / (v + p["V2"]),
        limits=(
            Limit("rice-ruina", {"V1": 0.0, "V2": 1e30}, {"V1": 1e-20, "V2": 1e8}),
            Limit("rice-ruina", {"V1": 1e-30, "V2": 1e30}, {"V1": 1e-20, "V2": 1e30}),
        ),
        memoryless={"B": 1e-200, "V1": 1e-5},
        rate=lambda p, v, state, w: p["mu0"] + p["A"] * np.log((v + p["V1"]) / (p["V0"] + p["V1"])),
    ),
    "ruina-slip": Example(RATE_AND_STATE, age_velocity="plastic"),
    "perrin-rice-zheng": Example(RATE_AND_STATE),
    # Values measured by the authors.
    "nagata": Example(
        {**RATE_AND_STATE, "A": 0.051, "B": 0.0565, "c": 2.0},
        limits=vanishing("rice-ruina", c=2.0),
        load_step=lambda p, f, w, factor: f * (1 + p["c"] * w) / (1 + p["c"] * w * factor),
        age_velocity="plastic",
        memoryless={"B": 1e-200, "c": 0.0},
    ),
    "two-state": Example(
        {**RATE_AND_STATE, "B2": -0.008, "D2": 5e-6},
        slope=lambda p, v: p["A"] - p["B"] - p["B2"],
        limits=vanishing("ruina-slip", B2=0.008),
        age_velocity="plastic",
        memoryless={"B": 1e-200, "B2": 0.0},
    ),
    "prakash-clifton": Example(
        {**RATE_AND_STATE, "L": 3e-7, "V_star": 1e-7},
        limits=(
            # The effective load is the applied one.
            Limit("rice-ruina", {}, {}, lambda Y, w: Y.at[-1].set(jnp.log(w))),
        ),
        load_step=lambda p, f, w, factor: f / factor,
        rate=lambda p, v, state, w: (
            (p["mu0"] + p["A"] * np.log(v / p["V0"])) * np.exp(state[1]) / w
        ),
    ),
}

ALL = sorted(EXAMPLES)
INVERTIBLE = [name for name in ALL if EXAMPLES[name].invertible]

SPEEDS = jnp.array(identities.SPEEDS)


def quasi_static(law: Law) -> QuasiStatic:
    return QuasiStatic(Slider(law, spring=2e5, load=7.0), V=SPEEDS, omega=2 * jnp.pi * 120.0)


def motion(system: QuasiStatic, seed: int = 0) -> tuple[jax.Array, Excitation]:
    """States and excitation away from steady sliding."""
    rng = np.random.default_rng(seed)
    Y = system.steady() * (1 + 0.01 * rng.normal(size=(system.size, *SPEEDS.shape)))
    w, slope = rng.uniform(0.95, 1.05, SPEEDS.shape), rng.uniform(-0.1, 0.1, SPEEDS.shape)
    return Y, Excitation(jnp.asarray(w), jnp.asarray(slope))


# The identities. Each raises AssertionError if a law violates it.


def check_steady_state(law: Law, example: Example) -> None:
    """Steady sliding is a zero of the rates, at every velocity."""
    identities.steady_sliding(law)


def check_slope(law: Law, example: Example) -> None:
    """mu_ss = mu0 at V0, with the published dependence on velocity."""
    identities.slope_of_steady_friction(law, lambda v: example.slope(example.parameters, v))
    reference = example.parameters.get("V0", 1e-6)
    np.testing.assert_allclose(law.mu_ss(reference), example.parameters["mu0"], rtol=EXACT)


def check_inverse(law: Law, example: Example) -> None:
    """log_velocity inverts friction, and agrees with Newton's method on the friction itself."""
    identities.inverse(law)


def check_load_step(law: Law, example: Example) -> None:
    """F/W after a step of the load at constant velocity and continuous state."""
    identities.step_of_load(law, lambda f, w, k: example.load_step(example.parameters, f, w, k))


def check_age_velocity(law: Law, example: Example) -> None:
    """The rates of the states depend on the velocity that the law names, and on no other."""
    v, state, w = sample(law)
    rates = law.state_rate(v, v, state, w)
    for rate, by_v, by_plastic in zip(
        rates,
        law.state_rate(2 * v, v, state, w),
        law.state_rate(v, 2 * v, state, w),
        strict=True,
    ):
        idle, driven = (
            (by_plastic, by_v) if example.age_velocity == "slider" else (by_v, by_plastic)
        )
        np.testing.assert_array_equal(idle, rate)
        assert np.all(driven != rate)


def check_limits(law: Law, example: Example) -> None:
    """At limits of its parameters a law continuously becomes the law that it extends."""
    for limit in example.limits:
        kind = get_law(limit.law)
        names = [f.name for f in dataclasses.fields(kind)]
        simple = quasi_static(kind(**{name: example.parameters[name] for name in names}))
        for changes, rtol in ((limit.exact, EXACT), (limit.near, 1e-6)):
            system = quasi_static(example.law(type(law), **changes))
            Y, at = motion(system)
            Y = limit.states(Y, at.w)
            rates, expected = system.rates(Y, at), simple.rates(Y[: simple.size], at)
            np.testing.assert_allclose(rates[: simple.size], expected, rtol=rtol)


def check_no_memory(law: Law, example: Example) -> None:
    """B -> 0: friction does not depend on the age and keeps the direct effect."""
    p = {**example.parameters, **example.memoryless}
    v, state, w = sample(law)
    friction = type(law)(**p).friction(v, state, w)
    np.testing.assert_allclose(friction, example.rate(p, v, state, w), rtol=EXACT)


def check_units(law: Law, example: Example) -> None:
    """The dimensionless motion does not depend on the units of length, time and force."""
    units = (1e6, 60.0, 1e-3)

    def convert(value, dimensions: tuple[int, int, int]):
        return value * np.prod([u**d for u, d in zip(units, dimensions, strict=True)])

    scaled = {k: convert(v, DIMENSIONS.get(k, (0, 0, 0))) for k, v in example.parameters.items()}
    system = quasi_static(law)
    converted = QuasiStatic(
        Slider(type(law)(**scaled), spring=convert(2e5, (-1, 0, 1)), load=convert(7.0, (0, 0, 1))),
        V=convert(SPEEDS, (1, -1, 0)),
        omega=convert(system.omega, (0, -1, 0)),
    )
    state = motion(system)
    np.testing.assert_allclose(converted.steady(), system.steady(), rtol=EXACT)
    np.testing.assert_allclose(converted.force(*state), system.force(*state), rtol=EXACT)
    if example.invertible:
        # Exponents of some tens multiply round-off.
        np.testing.assert_allclose(converted.rates(*state), system.rates(*state), rtol=1e-9)
    expected, response = perturb(system), perturb(converted)
    np.testing.assert_allclose(response.transfer, expected.transfer, rtol=1e-9)
    np.testing.assert_allclose(response.mean_curvature, expected.mean_curvature, rtol=1e-9)


def check_kinematics(system: QuasiStatic) -> None:
    """Spring and asperities in series: v = V - (dF/dt)/K, v_plastic = v - lambda d(F/W)/dt."""
    law, omega = system.slider.law, system.omega
    Y, at = motion(system)
    rates = system.rates(Y, at)

    def along(function):
        return jax.jvp(lambda Y, w: function(Y, Excitation(w)), (Y, at.w), (rates, at.w_slope))[1]

    v = system.V * (1 - along(system.force) / system.kappa)
    strain_rate = law.elastic_length * omega * along(lambda Y, at: system.force(Y, at) / at.w)
    plastic = v - strain_rate
    # V less the rates of stretching cancels to about 1e-3 of V.
    np.testing.assert_allclose(
        plastic / system.V, jnp.exp(system.log_slip(Y, at)), rtol=1e-9, atol=1e-10
    )
    expected = [r / omega for r in law.state_rate(v, plastic, tuple(Y[1:]), at.w)]
    scale = np.abs(np.asarray(rates[1:])).max(0, initial=0)
    np.testing.assert_allclose(rates[1:] / scale, np.stack(expected) / scale, rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ALL)
def test_every_law_obeys_the_identities(name):
    """`check_law` with the published slope and step of the load."""
    example = EXAMPLES[name]
    law = example.law(get_law(name))
    checked = check_law(
        law,
        slope=lambda v: example.slope(example.parameters, v),
        load_step=lambda f, w, k: example.load_step(example.parameters, f, w, k),
    )
    assert {"steady sliding", "element-wise", "derivatives", "units", "slope"} <= set(checked)
    assert ("inverse" in checked) == example.invertible
    assert ("exchange" in checked) == bool(law.exchangeable)
    check_slope(law, example)


@pytest.mark.parametrize("name", INVERTIBLE)
@pytest.mark.parametrize("check", [check_age_velocity, check_no_memory, check_limits])
def test_every_rate_dependent_law_has_its_age_velocity_memory_and_limits(check, name):
    check(EXAMPLES[name].law(get_law(name)), EXAMPLES[name])


@pytest.mark.parametrize("name", ["amontons", "elasto-plastic", "two-state"])
def test_the_motion_does_not_depend_on_the_units(name):
    check_units(EXAMPLES[name].law(get_law(name)), EXAMPLES[name])


def test_slider_and_plastic_velocity_obey_the_kinematics():
    check_kinematics(quasi_static(EXAMPLES["elasto-plastic"].law(ElastoPlastic)))


def test_amontons_friction_is_constant():
    v, state, w = sample(law := get_law("amontons")(mu0=0.5))
    np.testing.assert_array_equal(law.friction(v, state, w), np.full(SPEEDS.shape, 0.5))


def without_example(laws: Mapping[str, type[Law]]) -> set[str]:
    """Laws of the package for which the suite has no parameters."""
    return {name for name, law in laws.items() if law.__module__.startswith("asperity.")} - set(
        EXAMPLES
    )


def test_every_registered_law_has_an_example():
    assert without_example(registered()) == set()
    assert set(EXAMPLES) <= set(registered())


def test_a_law_without_an_example_is_detected(monkeypatch):
    monkeypatch.setattr(registry, "_LAWS", dict(registry._LAWS))

    class Forgotten(RiceRuina):
        name = "forgotten"

    Forgotten.__module__ = "asperity.laws.forgotten"
    registry.register(Forgotten)
    assert without_example(registered()) == {"forgotten"}


# Planted mistakes, each with the identity that must detect it.


class ProductTermDropped(StrengthArea):
    friction = RiceRuina.friction


class AlphaNotOverB(LinkerDieterich):
    def log_age(self, state, w):
        return state[0] - self.alpha * jnp.log(w)


class LoadRateForgotten(LinkerDieterich):
    def log_age(self, state, w):
        return state[0]


class AgeOnTheWrongVelocity(ElastoPlastic):
    def state_rate(self, v, v_plastic, state, w):
        return (self.ageing(v_plastic, state, w),)


class StrengtheningSign(RiceRuina):
    def friction(self, v, state, w):
        return self.mu0 + self.A * jnp.log(v / self.V0) - self.B * self.log_age(state, w)


class AgeUpsideDown(RiceRuina):
    def steady_state(self, v):
        return (jnp.log(v / self.V0),)


class InverseOfAnotherLaw(RiceRuina):
    def log_velocity(self, friction, state, w):
        return jnp.log(self.V0) + (friction - self.mu0) / self.A - self.log_age(state, w)


class NumberWithHiddenUnit(RiceRuina):
    def ageing(self, v, state, w):
        return (v * jnp.exp(-self.log_age(state, w) - jnp.log(v / self.V0)) - v) / 4e-7


class LimitMissed(ElastoPlastic):
    @property
    def elastic_length(self):
        return self.lambda_ + 1e-8


class WrongDerivative(RiceRuina):
    def friction(self, v, state, w):
        value = super().friction(v, state, w)
        return value + 0.1 * (state[0] - jax.lax.stop_gradient(state[0]))


class AgeRemembered(RiceRuina):
    def log_age(self, state, w):
        return state[0] * (1 + self.A / self.B)


class NoHalf(Regularised):
    def friction(self, v, state, w):
        return super().friction(2 * v, state, w)


class CutOffNotInTheReference(CutOff):
    def friction(self, v, state, w):
        return super().friction(v, state, w) + self.A * jnp.log(1 + self.V1 / self.V0)


class HalfTheAge(PerrinRiceZheng):
    def steady_state(self, v):
        return (-jnp.log(2 * v / self.V0),)


class StressRateForgotten(Nagata):
    friction = RiceRuina.friction
    log_velocity = RiceRuina.log_velocity


class SecondStateForgotten(TwoState):
    log_velocity = RiceRuina.log_velocity


class LoadFollowedAtOnce(PrakashClifton):
    friction = RiceRuina.friction
    log_velocity = RiceRuina.log_velocity


@pytest.mark.parametrize(
    ("mistake", "name", "check"),
    [
        (ProductTermDropped, "strength-area", check_slope),
        (AlphaNotOverB, "linker-dieterich", check_load_step),
        (LoadRateForgotten, "linker-dieterich", check_load_step),
        (AgeOnTheWrongVelocity, "elasto-plastic", check_age_velocity),
        (StrengtheningSign, "rice-ruina", check_slope),
        (NumberWithHiddenUnit, "rice-ruina", check_units),
        (LimitMissed, "elasto-plastic", check_limits),
        (AgeRemembered, "rice-ruina", check_no_memory),
        (NoHalf, "regularised", check_slope),
        (CutOffNotInTheReference, "cut-off", check_slope),
        (HalfTheAge, "perrin-rice-zheng", check_steady_state),
        (StressRateForgotten, "nagata", check_load_step),
        (SecondStateForgotten, "two-state", check_inverse),
        (LoadFollowedAtOnce, "prakash-clifton", check_load_step),
    ],
)
def test_a_planted_mistake_is_detected(mistake, name, check):
    with pytest.raises(AssertionError):
        check(EXAMPLES[name].law(mistake), EXAMPLES[name])


class OneOfTheArray(RiceRuina):
    def friction(self, v, state, w):
        return super().friction(v, state, w) + 1e-6 * jnp.mean(state[0])


class Unfinished(RiceRuina):
    def state_rate(self, v, v_plastic, state, w):
        raise NotImplementedError("still to be written")


@pytest.mark.parametrize(
    ("mistake", "broken"),
    [
        (InverseOfAnotherLaw, {"inverse"}),
        (NumberWithHiddenUnit, {"units"}),
        (AgeUpsideDown, {"steady sliding"}),
        (WrongDerivative, {"derivatives"}),
        (OneOfTheArray, {"element-wise", "inverse"}),
        (Unfinished, {"steady sliding", "element-wise", "derivatives", "units"}),
    ],
)
def test_one_call_names_every_broken_identity(mistake, broken):
    with pytest.raises(identities.BrokenIdentityError, match="breaks") as raised:
        check_law(mistake(**RATE_AND_STATE))
    assert broken <= set(raised.value.broken)


class LoadRateDropped(QuasiStatic):
    def rates(self, Y, at):
        return super().rates(Y, at._replace(w_slope=0.0))


class CompliancesSwapped(QuasiStatic):
    def force(self, Y, at):
        return Y[0] / (1 + self.compliance_ratio)


@pytest.mark.parametrize("mistake", [LoadRateDropped, CompliancesSwapped])
def test_a_planted_mistake_in_the_kinematics_is_detected(mistake):
    correct = quasi_static(EXAMPLES["elasto-plastic"].law(ElastoPlastic))
    wrong = mistake(correct.slider, correct.V, correct.omega)
    assert isinstance(wrong, eqx.Module)
    with pytest.raises(AssertionError):
        check_kinematics(wrong)


class SecondLengthIgnored(TwoState):
    def state_rate(self, v, v_plastic, state, w):
        return (self.approach(v_plastic, state[0], self.D0),) * 2


def test_parameters_that_are_not_exchangeable_are_detected():
    identities.exchange(EXAMPLES["two-state"].law(TwoState))
    with pytest.raises(AssertionError, match="D2, B2 is another law"):
        identities.exchange(EXAMPLES["two-state"].law(SecondLengthIgnored))
