"""Interpolants of recorded load and velocity."""

from __future__ import annotations

from typing import Any

import numpy as np

from asperity.errors import InputError, closest
from asperity.loads.programme.recorded import PiecewiseCubic
from asperity.units import to_si

_FIELDS = {"force": "load", "velocity": "velocity"}


def interpolated(
    time: np.ndarray, given: Any, level: float, kind: str, interpolant: str, name: str
) -> tuple[PiecewiseCubic, np.ndarray]:
    """Cubics through the samples over the time since the first, with values that bound them.

    Parameters
    ----------
    time : array, shape (n,)
        Seconds.
    given : array, shape (n,), or None
        Samples; None for the constant `level`.
    level : float
        SI.
    kind : {"force", "velocity"}
    interpolant : {"pchip", "spline"}
    name : str
        What messages call the step.

    Raises
    ------
    InputError
        If times do not rise, lengths differ, a sample is not finite or the interpolant is unknown.
    """
    _check_time(time, name)
    span = np.array([0.0, time[-1] - time[0]])
    if given is None:
        return PiecewiseCubic.of(span, np.array([[0.0], [0.0], [0.0], [level]])), np.array([level])
    field = f"{name}.{_FIELDS[kind]}"
    values = np.asarray(to_si(given, kind, field), float)
    if values.shape != time.shape:
        raise InputError(
            f"{field} must be as long as time, got {values.shape} for {time.shape}; "
            "give one sample for each time"
        )
    pieces = _pieces(interpolant, name)(time - time[0], values)
    # Splines overshoot: bounds from between the samples too.
    between = pieces(np.concatenate([pieces.x, 0.5 * (pieces.x[1:] + pieces.x[:-1])]))
    return PiecewiseCubic.of(pieces.x, pieces.c), np.append(between, values[-1])


def _pieces(interpolant: str, name: str) -> Any:
    # SciPy's interpolation takes long to load, and few programmes need it.
    from scipy.interpolate import CubicSpline, PchipInterpolator

    known = {"pchip": PchipInterpolator, "spline": CubicSpline}
    if interpolant not in known:
        raise InputError(
            f"{name}.interpolant must be known, got '{interpolant}'; {closest(interpolant, known)}"
        )
    return known[interpolant]


def _check_time(time: np.ndarray, name: str) -> None:
    if time.ndim != 1 or time.size < 2:
        raise InputError(
            f"{name}.time must have two samples or more, got shape {time.shape}; "
            "give the time of every sample"
        )
    fall = np.flatnonzero(np.diff(time) <= 0)
    if fall.size:
        i = int(fall[0])
        raise InputError(
            f"{name}.time must rise, got {time[i]:.10g} s and then {time[i + 1]:.10g} s at "
            f"sample {i + 1}; remove repeated and backward time stamps first"
        )
