"""Which parameters must be positive, for laws and sliders alike."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from asperity.errors import InputError

#: Other names may have any sign.
_POSITIVE = frozenset({"A", "D0", "K", "V0", "W0", "mu0"})
_NOT_NEGATIVE = frozenset({"B", "M", "lambda"})


def check_sign(name: str, value: Any, owner: str, unit: str = "") -> None:
    """Refuse a parameter whose sign makes no sense.

    Parameters
    ----------
    name : str
        The parameter as tables write it.
    value : float or array
        In SI; a JAX value under transformation is not looked at.
    owner : str
        What messages call the object that the parameter belongs to.
    unit : str
        SI unit, for the message.

    Raises
    ------
    InputError
        If the value, or an element of it, has the wrong sign.
    """
    jax = sys.modules.get("jax")
    if jax is not None and isinstance(value, jax.core.Tracer):
        return
    array = np.asarray(value)
    if name in _POSITIVE:
        wrong, rule = array <= 0, "be > 0"
    elif name in _NOT_NEGATIVE:
        wrong, rule = array < 0, "be >= 0"
    else:
        return
    if np.any(wrong):
        got = f"{array[wrong].flat[0]:g} {unit}".rstrip()
        raise InputError(f"{owner}.{name} must {rule}, got {got}; correct the sign or the value")
