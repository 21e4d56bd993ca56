"""Checks of a user's law, for what the solvers assume of a law.

The laws of the package have the suite of identities, `asperity.laws.identities`, in its tests.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.errors import InputError, code_of_others
from asperity.laws.law import Law
from asperity.parameters import law_parameters
from asperity.parameters.arguments import shown

#: Velocities (m/s) at which a law is evaluated.
_SPEEDS = (1e-8, 1e-6, 1e-5, 1e-3)

#: Rates in steady sliding over those at twice the velocity: a law may solve for its steady state.
_STEADY = 1e-4

_PAGE = "see the page 'Write your own law'"


def checked_class(law: type[Law], where: str) -> type[Law]:
    """Check name, source, states and parameters of a law.

    Parameters
    ----------
    law : type of Law
    where : str
        Place of the law in messages.

    Raises
    ------
    InputError
        If one of them is missing or no text, or a name is in use.
    """
    for attribute, wanted in (("name", "a text"), ("source", "a text"), ("state_names", "names")):
        if not hasattr(law, attribute):
            raise InputError(
                f"law.{attribute} must be given, got none in {where}; add it to the class"
            )
        value = getattr(law, attribute)
        texts = value if isinstance(value, tuple | list) else ("",)
        names = attribute == "state_names"
        right = all(isinstance(t, str) for t in texts) if names else isinstance(value, str)
        if not right or (names and texts == ("",)) or (attribute == "name" and not value):
            example = '("phi",)' if names else '"my-law"' if attribute == "name" else '"kato2001"'
            raise InputError(
                f"law.{attribute} must be {'a tuple of ' if names else ''}{wanted}, got "
                f"{shown(value)} in {where}; write it like {attribute} = {example}"
            )
    if any(c.isspace() or c == ":" for c in law.name):
        raise InputError(
            f"law.name must be without blanks and colons, got '{law.name}' in {where}; write it "
            "like 'my-law'"
        )
    missing = sorted(getattr(law, "__abstractmethods__", ()))
    if missing:
        raise InputError(
            f"law must have all its equations, got none for {', '.join(missing)} in {where}; "
            "write them"
        )
    law_parameters(law)
    return law


def checked_law(law: Law) -> Law:
    """Check shapes and values of the methods of a law.

    Laws of the package are returned as they are, and those with traced parameters are checked for
    shapes only.

    Raises
    ------
    InputError
        If a method fails, returns another number of states or another shape, mixes the elements of
        an array, gives no finite number at any velocity, if the rates do not vanish in
        `steady_state`, or if friction falls with the velocity at constant state.
    """
    kind = type(law)
    if kind.__module__.startswith("asperity."):
        return law
    _check_shapes(kind, law)
    leaves = jax.tree.leaves(law)
    if any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):
        return law
    one = jax.tree.map(lambda a: jnp.asarray(np.ravel(np.asarray(a, float))[0]), law)
    fault = _fault(kind, _probe(kind)(one))
    if fault:
        raise InputError(f"{fault}; {_PAGE}")
    return law


def _check_shapes(kind: type[Law], law: Law) -> None:
    """Every method, traced on arrays, before any number is computed."""
    checked_class(kind, f"the class {kind.__name__}")
    one = jax.tree.map(lambda a: jnp.zeros(()), law)
    v = jnp.ones(len(_SPEEDS))
    state = tuple(v for _ in kind.state_names)
    count = len(kind.state_names)
    for method, arguments, states in (
        ("friction", (v, state, v), None),
        ("state_rate", (v, v, state, v), count),
        ("steady_state", (v,), count),
        ("log_velocity", (v, state, v), None),
        ("velocity", (v, state, v), None),
    ):
        if method.endswith("velocity") and not kind.rate_dependent:
            continue
        name = f"law.{method}"
        function: Callable[..., Any] = getattr(kind, method)
        with code_of_others(name, "work on arrays of jax.numpy", _PAGE, f"'{kind.name}'"):
            result = jax.eval_shape(function, one, *arguments)
        if states is None:
            _require_shape(result, v.shape, name, kind)
            continue
        if not isinstance(result, tuple | list) or len(result) != states:
            got = f"{len(result)}" if isinstance(result, tuple | list) else "no tuple"
            raise InputError(
                f"{name} must return a tuple with an array for each of the {states} state_names, "
                f"got {got} from '{kind.name}'; {_PAGE}"
            )
        for one_state in result:
            _require_shape(one_state, v.shape, name, kind)


def _require_shape(result: Any, shape: tuple[int, ...], name: str, kind: type[Law]) -> None:
    if getattr(result, "shape", None) != shape or not jnp.issubdtype(result.dtype, jnp.floating):
        got = getattr(result, "shape", type(result).__name__)
        raise InputError(
            f"{name} must return real numbers of the shape of its arguments, got {got} for "
            f"{shape} from '{kind.name}'; {_PAGE}"
        )


@cache
def _probe(kind: type[Law]) -> Callable[[Law], dict[str, Array]]:
    """A compiled program that evaluates all methods of a law at the test velocities."""

    def probe(law: Law) -> dict[str, Array]:
        v, one = jnp.array(_SPEEDS), jnp.ones(len(_SPEEDS))
        steady = law.steady_state(v)
        friction = law.friction(v, steady, one)
        rates = jnp.stack([*law.state_rate(v, v, steady, one), one * 0])
        faster = jnp.stack([*law.state_rate(2 * v, 2 * v, steady, one), one * 0])
        alone = jax.vmap(lambda *each: law.friction(each[0], each[1], each[2]))(v, steady, one)
        rate_alone = jax.vmap(lambda u, s, w: jnp.stack([*law.state_rate(u, u, s, w), w * 0]))(
            2 * v, steady, one
        )
        return {
            "friction": friction,
            "faster": law.friction(1.01 * v, steady, one),
            "alone": alone,
            "rates": rates,
            "faster_rates": faster,
            "rates_alone": rate_alone.T,
        }

    return jax.jit(probe)


def _fault(kind: type[Law], result: dict[str, Array]) -> str:
    """The fault in the numbers of a law; empty without a fault."""
    at = {name: np.asarray(values) for name, values in result.items()}
    finite = np.isfinite(at["friction"]) & np.isfinite(at["rates"]).all(0)
    if not finite.any():
        return (
            "law.friction and law.state_rate must be finite in steady sliding, got no finite "
            f"number from 1e-8 to 1e-3 m/s of '{kind.name}' with these parameters"
        )
    friction, alone = at["friction"][finite], at["alone"][finite]
    faster, rates_alone = at["faster_rates"][:, finite], at["rates_alone"][:, finite]
    same = np.allclose(friction, alone, rtol=1e-9, atol=1e-12)
    if not (same and np.allclose(faster, rates_alone, rtol=1e-9, equal_nan=True)):
        return (
            "law.friction and law.state_rate must act on each element for itself, got "
            f"'{kind.name}', whose elements influence each other"
        )
    rest = np.abs(at["rates"][:, finite])
    moving = np.abs(faster)
    if np.any(rest > _STEADY * np.where(np.isfinite(moving), moving, np.inf)):
        row, column = np.argwhere(~(rest <= _STEADY * moving))[0]
        return (
            "law.steady_state must be the states at which every rate vanishes, got a rate of "
            f"{kind.state_names[row]} of {rest[row, column]:.3g} 1/s from '{kind.name}' at "
            f"{np.array(_SPEEDS)[finite][column]:g} m/s"
        )
    quicker = at["faster"][finite]
    if kind.rate_dependent and np.any(quicker < friction - 1e-12 * np.abs(friction)):
        return (
            "law.friction must not decrease with the velocity at constant state, got "
            f"'{kind.name}', where it does"
        )
    return ""
