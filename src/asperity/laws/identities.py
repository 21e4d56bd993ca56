"""Identities that every friction law obeys, checked on one law by one call.

    from asperity.laws.identities import check_law

    check_law(MyLaw(mu0=0.5, A=0.013, B=0.026, D0="0.4 um", V0="1 um/s"))

The checks need only the law: steady sliding is a zero of the rates, with friction mu_ss;
`log_velocity` inverts `friction`; derivatives agree with finite differences; every method acts
element by element on arrays; and a change of the units of length, time and force changes nothing.
Published properties of the law (the slope of mu_ss, the response to a step of the load) can be
added to the checks.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.test_util import check_grads

from asperity.laws.law import Law
from asperity.parameters import law_parameters
from asperity.parameters.arguments import typed
from asperity.units import KINDS
from asperity.units.scale import base_units

#: Round-off, including the cancellation of terms about 1e3 times larger than the result.
EXACT = 1e-12

#: Velocities (m/s) at which the identities are checked.
SPEEDS = (1e-9, 1e-6, 2e-5, 1e-3)

#: Units of length, time and force that the unit check changes to, in SI.
_LENGTH, _TIME, _FORCE = 1e6, 60.0, 1e-3
_UNITS = {"meter": _LENGTH, "second": _TIME, "kilogram": _FORCE * _TIME**2 / _LENGTH}

#: Slope d mu_ss / d ln v at a velocity (m/s).
Slope = Callable[[float], float]

#: F/W after the load has jumped by a factor at constant velocity and continuous states, from F/W
#: before, W/W0 before and the factor.
LoadStep = Callable[[Array, Array, float], Array]


class BrokenIdentityError(AssertionError):
    """A law breaks some identities; the message has a paragraph for each.

    Attributes
    ----------
    broken : dict of str to str
        Deviation of each broken identity, by its name.
    """

    def __init__(self, law: Law, broken: dict[str, str]) -> None:
        self.broken = broken
        result = "\n\n".join(f"{name}: {message.strip()}" for name, message in broken.items())
        super().__init__(f"{type(law).name} breaks {', '.join(broken)}\n\n{result}")


@typed
def check_law(
    law: Law, *, slope: Slope | None = None, load_step: LoadStep | None = None
) -> tuple[str, ...]:
    """Check a law with its parameters against all identities.

    Parameters
    ----------
    law : Law
    slope : callable, optional
        The published d mu_ss / d ln v as a function of the velocity (m/s).
    load_step : callable, optional
        The published F/W after a step of the load, a function of F/W and W/W0 before the step and
        of the factor of the load. Linker and Dieterich: ``lambda f, w, k: f - alpha * log(k)``.

    Returns
    -------
    tuple of str
        Names of the identities, all of which the law obeys.

    Raises
    ------
    BrokenIdentityError
        If the law breaks an identity; the message names all broken identities.
    """
    checks: dict[str, Callable[[], None]] = {
        "steady sliding": lambda: steady_sliding(law),
        "element-wise": lambda: element_wise(law),
        "derivatives": lambda: derivatives(law),
        "units": lambda: units(law),
    }
    if law.rate_dependent:
        checks["inverse"] = lambda: inverse(law)
    if law.exchangeable:
        checks["exchange"] = lambda: exchange(law)
    if slope is not None:
        checks["slope"] = lambda: slope_of_steady_friction(law, slope)
    if load_step is not None:
        checks["load step"] = lambda: step_of_load(law, load_step)
    broken: dict[str, str] = {}
    for name, check in checks.items():
        try:
            check()
        except AssertionError as error:
            broken[name] = str(error)
        except Exception as error:  # a user's code may raise anything
            broken[name] = f"{type(error).__name__}: {error}"
    if broken:
        raise BrokenIdentityError(law, broken)
    return tuple(checks)


def sample(law: Law, seed: int = 0) -> tuple[Array, tuple[Array, ...], Array]:
    """Velocities (m/s), states near steady sliding, and loads W/W0, each of shape (4,)."""
    rng = np.random.default_rng(seed)
    speeds = jnp.array(SPEEDS)
    v = speeds * rng.uniform(0.5, 2.0, speeds.shape)
    state = tuple(s + rng.normal(0, 0.5, speeds.shape) for s in law.steady_state(v))
    return v, state, jnp.asarray(rng.uniform(0.3, 1.7, speeds.shape))


def steady_sliding(law: Law) -> None:
    """`steady_state` is a zero of the rates at every velocity, with friction mu_ss."""
    speeds = jnp.array(SPEEDS)
    one = jnp.ones_like(speeds)
    steady = law.steady_state(speeds)
    assert len(steady) == len(law.state_names), (
        f"steady_state has {len(steady)} states, state_names {len(law.state_names)}"
    )
    rates = law.state_rate(speeds, speeds, steady, one)
    faster = law.state_rate(2 * speeds, 2 * speeds, steady, one)
    for name, rest, moving in zip(law.state_names, rates, faster, strict=True):
        assert np.all(np.abs(rest) <= EXACT * np.abs(moving)), (
            f"the rate of {name} in steady sliding is {rest}, and {moving} at twice the velocity"
        )
    np.testing.assert_allclose(law.friction(speeds, steady, one), law.mu_ss(speeds), rtol=EXACT)


def inverse(law: Law) -> None:
    """`log_velocity` inverts `friction`, and agrees with the general Newton's method."""
    v, state, w = sample(law)
    friction = law.friction(v, state, w)
    for result in (law.log_velocity(friction, state, w), Law.log_velocity(law, friction, state, w)):
        np.testing.assert_allclose(result, jnp.log(v), rtol=0, atol=1e-11)
    np.testing.assert_allclose(law.velocity(friction, state, w), v, rtol=1e-11)


def element_wise(law: Law) -> None:
    """The result of an array holds the results of its elements."""
    v, state, w = sample(law)
    friction, rates = law.friction(v, state, w), law.state_rate(v, v, state, w)
    for i in range(len(SPEEDS)):
        one = (v[i], tuple(s[i] for s in state), w[i])
        np.testing.assert_allclose(friction[i], law.friction(*one), rtol=EXACT)
        alone = law.state_rate(one[0], one[0], *one[1:])
        for rate, single in zip(rates, alone, strict=True):
            np.testing.assert_allclose(rate[i], single, rtol=EXACT)


def derivatives(law: Law) -> None:
    """First and second derivatives with respect to every argument against finite differences."""
    v, state, w = (jax.tree.map(lambda x: x[1], part) for part in sample(law))
    names = [f.name for f in dataclasses.fields(law)]
    middle = law.friction(v, state, w)

    def changed(logs: dict[str, Array]) -> Law:
        """The law with its parameters multiplied by e^log: relative steps."""
        return type(law)(**{n: getattr(law, n) * jnp.exp(logs[n]) for n in names})

    def friction(logs: Any, log_v: Array, state: Any, w: Array) -> Array:
        return changed(logs).friction(jnp.exp(log_v), state, w)

    def rates(logs: Any, log_v: Array, state: Any, w: Array) -> Any:
        return changed(logs).state_rate(jnp.exp(log_v), jnp.exp(log_v), state, w)

    def inverses(logs: Any, force: Array, state: Any, w: Array) -> Any:
        other, at = changed(logs), (middle + 0.01 * force, state, w)
        return other.log_velocity(*at), jnp.log(other.velocity(*at))

    unchanged = dict.fromkeys(names, 0.0)
    options = {"order": 2, "modes": ["fwd", "rev"], "rtol": 1e-5, "atol": 1e-6, "eps": 1e-4}
    check_grads(friction, (unchanged, jnp.log(v), state, w), **options)
    if law.state_names:
        check_grads(rates, (unchanged, jnp.log(v), state, w), **options)
    if law.rate_dependent:
        check_grads(inverses, (unchanged, 0.0, state, w), **options | {"eps": 1e-5})


def units(law: Law) -> None:
    """The same law in other units of length, time and force has the same friction and states.

    Parameters are converted by their declared kinds. The check fails if an equation contains a
    number with a hidden unit.
    """

    def converted(value: Any, kind: str) -> Any:
        _, dimension = base_units(KINDS[kind].si)
        return value * np.prod([_UNITS.get(name, 1.0) ** n for name, n in dimension])

    other = type(law)(
        **{
            f.name: converted(getattr(law, f.name), f.metadata["parameter"].kind)
            for f in dataclasses.fields(law)
        }
    )
    v, state, w = sample(law)
    faster = converted(v, "velocity")
    steady = law.steady_state(v), other.steady_state(faster)
    for here, there in zip(*steady, strict=True):
        np.testing.assert_allclose(there, here, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(
        other.friction(faster, state, w), law.friction(v, state, w), rtol=1e-9
    )
    np.testing.assert_allclose(
        other.elastic_length, converted(jnp.asarray(law.elastic_length), "length"), rtol=EXACT
    )
    # Exponents of some tens multiply round-off.
    for here, there in zip(
        law.state_rate(v, 1.5 * v, state, w),
        other.state_rate(faster, 1.5 * faster, state, w),
        strict=True,
    ):
        np.testing.assert_allclose(there, converted(here, "frequency"), rtol=1e-9)


def exchange(law: Law) -> None:
    """Exchanging declared exchangeable parameters changes nothing but the order of the states."""
    # One of the two may have to be positive while the other may have either sign.
    values = {f.name: jnp.abs(jnp.asarray(getattr(law, f.name))) for f in dataclasses.fields(law)}
    law = type(law)(**values)
    v, state, w = sample(law)
    friction, rates = law.friction(v, state, w), law.state_rate(v, 1.5 * v, state, w)
    fields = {n: p.path.rsplit(".", 1)[-1] for n, p in law_parameters(type(law)).items()}
    unknown = {n for names in law.exchangeable for n in names} - set(fields)
    assert not unknown, f"exchangeable names {', '.join(sorted(unknown))}, which are no parameters"
    for first, second in itertools.combinations(law.exchangeable, 2):
        pairs = [(fields[a], fields[b]) for a, b in zip(first, second, strict=True)]
        other = type(law)(
            **values | {a: values[b] for a, b in pairs} | {b: values[a] for a, b in pairs}
        )
        for order in itertools.permutations(range(len(state))):
            moved = tuple(state[i] for i in order)
            changed = other.state_rate(v, 1.5 * v, moved, w)
            here = (other.friction(v, moved, w), *changed)
            if all(
                np.allclose(a, b, rtol=1e-9)
                for a, b in zip(here, (friction, *(rates[i] for i in order)), strict=True)
            ):
                break
        else:
            raise AssertionError(
                f"{', '.join(first)} exchanged with {', '.join(second)} is another law in every "
                "order of the states"
            )


def slope_of_steady_friction(law: Law, slope: Slope) -> None:
    """The derivative of mu_ss with respect to ln v agrees with the publication."""
    for v in SPEEDS:
        result = jax.grad(lambda log_v: law.mu_ss(jnp.exp(log_v)))(jnp.log(v))
        np.testing.assert_allclose(result, slope(v), rtol=1e-10, atol=EXACT)


def step_of_load(law: Law, load_step: LoadStep, factor: float = 1.3) -> None:
    """F/W after a step of the load at constant velocity and continuous states."""
    v, state, w = sample(law)
    before, after = law.friction(v, state, w), law.friction(v, state, factor * w)
    np.testing.assert_allclose(after, load_step(before, w, factor), rtol=1e-11)
