"""Checks of a user's law, for what the solvers assume of a law.

The laws of the package have the suite of identities, `asperity.laws.identities`, in its tests.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.errors import InputError, code_of_others, require
from asperity.laws.law import Law, State
from asperity.parameters import law_parameters
from asperity.parameters.arguments import shown

#: Velocities (m/s) at which a law is evaluated.
_SPEEDS = (1e-8, 1e-6, 1e-5, 1e-3)

#: Largest rate in steady sliding over that at twice the velocity; not zero, because a law may
#: compute its steady state by iteration.
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
    examples = {"name": '"my-law"', "source": '"kato2001"', "state_names": '("phi",)'}
    for attribute, example in examples.items():
        field, like = f"law.{attribute}", f"write it like {attribute} = {example}"
        given = hasattr(law, attribute)
        require(given, field, "be given", f"none in {where}", "add it to the class")
        value = getattr(law, attribute)
        right, rule = isinstance(value, str) and (value or attribute != "name"), "be a text"
        if attribute == "state_names":
            several, rule = isinstance(value, tuple | list), "be a tuple of names"
            right = several and all(isinstance(t, str) and t for t in value)
        require(right, field, rule, f"{shown(value)} in {where}", like)
    plain = not any(c.isspace() or c == ":" for c in law.name)
    rule, got = "be without blanks and colons", f"'{law.name}' in {where}"
    require(plain, "law.name", rule, got, "write it like 'my-law'")
    missing = ", ".join(sorted(getattr(law, "__abstractmethods__", ())))
    rule, got = "have all its equations", f"none for {missing} in {where}"
    require(not missing, "law", rule, got, "write them")
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
    _check_numbers(kind, *_probe(kind)(one))
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
        got = len(result) if isinstance(result, tuple | list) else "no tuple"
        rule = f"return a tuple with an array for each of the {states} state_names"
        require(got == states, name, rule, f"{got} from '{kind.name}'", _PAGE)
        for one_state in result:
            _require_shape(one_state, v.shape, name, kind)


def _require_shape(result: Any, shape: tuple[int, ...], name: str, kind: type[Law]) -> None:
    got = getattr(result, "shape", type(result).__name__)
    real = got == shape and jnp.issubdtype(result.dtype, jnp.floating)
    rule = "return real numbers of the shape of its arguments"
    require(real, name, rule, f"{got} for {shape} from '{kind.name}'", _PAGE)


#: Friction in steady sliding and at a higher velocity, and the rates of the states in steady
#: sliding and at twice the velocity.
_Values: TypeAlias = tuple[Array, Array, Array, Array]


@cache
def _probe(kind: type[Law]) -> Callable[[Law], tuple[_Values, _Values]]:
    """A compiled program: a law at all test velocities together, and at each alone."""

    def values(law: Law, v: Array, steady: State, one: Array) -> _Values:
        def rates(u: Array) -> Array:
            return jnp.stack([*law.state_rate(u, u, steady, one), one * 0])

        friction = law.friction(v, steady, one), law.friction(1.01 * v, steady, one)
        return *friction, rates(v), rates(2 * v)

    def probe(law: Law) -> tuple[_Values, _Values]:
        v, one = jnp.array(_SPEEDS), jnp.ones(len(_SPEEDS))
        at = (law, v, law.steady_state(v), one)
        return values(*at), jax.vmap(values, in_axes=(None, 0, 0, 0), out_axes=-1)(*at)

    return jax.jit(probe)


def _check_numbers(kind: type[Law], together: _Values, alone: _Values) -> None:
    """Raise `InputError` for a fault in the numbers of a law."""
    both, name = "law.friction and law.state_rate", f"'{kind.name}'"
    finite = np.isfinite(np.vstack([together[0], together[2]])).all(0)
    got = f"no finite number from 1e-8 to 1e-3 m/s of {name} with these parameters"
    require(finite.any(), both, "be finite in steady sliding", got, _PAGE)
    whole, single = ([np.asarray(a)[..., finite] for a in part] for part in (together, alone))
    # The rates in steady sliding are rounding errors.
    same = all(np.allclose(whole[i], single[i], rtol=1e-9, equal_nan=True) for i in (0, 1, 3))
    got = f"{name}, whose elements influence each other"
    require(same, both, "act on each element for itself", got, _PAGE)
    friction, quicker, rates, faster = whole
    rest, moving = np.abs(rates), np.abs(faster)
    if np.any(rest > _STEADY * np.where(np.isfinite(moving), moving, np.inf)):
        row, column = np.argwhere(~(rest <= _STEADY * moving))[0]
        rate = f"a rate of {kind.state_names[row]} of {rest[row, column]:.3g} 1/s"
        got = f"{rate} from {name} at {np.array(_SPEEDS)[finite][column]:g} m/s"
        rule = "be the states at which every rate vanishes"
        raise InputError("law.steady_state", rule, got, _PAGE)
    rising = not kind.rate_dependent or np.all(quicker >= friction - 1e-12 * np.abs(friction))
    rule = "not decrease with the velocity at constant state"
    require(rising, "law.friction", rule, f"{name}, where it does", _PAGE)
