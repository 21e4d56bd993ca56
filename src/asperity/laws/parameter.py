"""Declaration of a law's parameters: kind of quantity and the rule its values obey."""

from __future__ import annotations

from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from asperity.errors import InputError
from asperity.units import KINDS, to_si

_RULES = {"positive": np.greater, "not negative": np.greater_equal, "finite": None}


def parameter(name: str, kind: str, rule: str = "positive") -> Any:
    """Declare a field of an `eqx.Module`: texts become SI, values that break the rule are refused.

    Parameters
    ----------
    name : str
        What messages call it, as ``law.D0``.
    kind : str
        Kind of quantity, a key of `asperity.units.KINDS`.
    rule : {"positive", "not negative", "finite"}

    Returns
    -------
    dataclass field
        Its values are float64 arrays; its metadata hold the SI unit.
    """
    converter = partial(checked, name=name, kind=kind, rule=rule)
    return eqx.field(converter=converter, metadata={"unit": KINDS[kind].si})


def checked(value: Any, *, name: str, kind: str, rule: str) -> Any:
    """Convert `value` to SI and hold it against `rule`.

    Raises
    ------
    InputError
        Naming the field, the rule, the first offending value and its unit.
    """
    if isinstance(value, jax.core.Tracer):
        return value
    array = np.asarray(to_si(value, kind, name), dtype=float)
    compare = _RULES[rule]
    if compare is not None:
        bad = array[~compare(array, 0.0)]
        if bad.size:
            unit = KINDS[kind].si
            raise InputError(
                f"{name} must be {rule}, got {bad.flat[0]:g}{' ' + unit if unit else ''}; "
                f"give a value {'above' if rule == 'positive' else 'of at least'} zero"
            )
    return jnp.asarray(array)
