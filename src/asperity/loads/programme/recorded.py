"""Segments that follow a recording: load and its rate from one interpolant."""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.errors import InputError, require
from asperity.loads.modulation import Excitation
from asperity.loads.programme.segment import ProgrammeSegment, Scalar
from asperity.parameters.arguments import one_of
from asperity.units import to_si

_FIELDS = {"force": "load", "velocity": "velocity"}


class PiecewiseCubic(eqx.Module):
    """Cubic pieces between knots, padded to a power of two.

    Parameters
    ----------
    knots : array, shape (pieces,)
        Where each piece begins (s); inf where padded.
    coefficients : array, shape (4, pieces)
        Coefficients of falling powers of the time since the knot.
    integral : array, shape (pieces,)
        Integral up to the knot.
    """

    knots: Array
    coefficients: Array
    integral: Array

    @classmethod
    def of(cls, knots: np.ndarray, coefficients: np.ndarray) -> PiecewiseCubic:
        """From `knots` with the last end, shape (pieces + 1,), and coefficients."""
        pieces = coefficients.shape[1]
        room = 2 ** max(4, math.ceil(math.log2(pieces)))
        powers = np.array([4, 3, 2, 1])[:, None]
        parts = (coefficients / powers * np.diff(knots) ** powers).sum(0)
        integral = np.concatenate([[0.0], np.cumsum(parts)[:-1]])
        padding = (0, room - pieces)
        return cls(
            jnp.asarray(np.pad(knots[:-1], padding, constant_values=np.inf)),
            jnp.asarray(np.pad(coefficients, ((0, 0), padding))),
            jnp.asarray(np.pad(integral, padding)),
        )

    def _piece(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        i = jnp.clip(jnp.searchsorted(self.knots, t, side="right") - 1, 0)
        return t - self.knots[i], self.coefficients[:, i], self.integral[i]

    def following(self, t: ArrayLike) -> Array:
        """The next knot; inf behind the last."""
        i = jnp.searchsorted(self.knots, t, side="right")
        return jnp.where(i < self.knots.size, self.knots[i], jnp.inf)

    def value(self, t: ArrayLike) -> tuple[Array, Array]:
        """Value and slope."""
        x, (a, b, c, d), _ = self._piece(t)
        return ((a * x + b) * x + c) * x + d, (3 * a * x + 2 * b) * x + c

    def primitive(self, t: ArrayLike) -> Array:
        """Integral from the first knot."""
        x, (a, b, c, d), before = self._piece(t)
        return before + (((a / 4 * x + b / 3) * x + c / 2) * x + d) * x


class RecordedSegment(ProgrammeSegment):
    """Load and pulling velocity as they were recorded.

    Parameters
    ----------
    duration : array
        Seconds.
    load_curve, pull_curve : PiecewiseCubic
        W (N) and V (m/s) over the time of the segment.
    spacing : array
        Time between samples (s).
    smooth : array
        Whether second derivatives are continuous; where not, steps end at the samples.
    lowest, fastest : array
        Bounds of the load (N) and of the velocity (m/s).
    """

    duration: Scalar = eqx.field(converter=jnp.asarray)
    load_curve: PiecewiseCubic
    pull_curve: PiecewiseCubic
    spacing: Scalar = eqx.field(converter=jnp.asarray)
    smooth: Scalar = eqx.field(converter=jnp.asarray)
    lowest: Scalar = eqx.field(converter=jnp.asarray)
    fastest: Scalar = eqx.field(converter=jnp.asarray)

    def at(self, t: ArrayLike, W0: ArrayLike, V: ArrayLike) -> Excitation:
        """As in `ProgrammeSegment`; W and dW/dt are of one interpolant."""
        (W, W_rate), (pull, _) = self.load_curve.value(t), self.pull_curve.value(t)
        return Excitation(W / W0, W_rate / W0, pull=pull / V)

    def position(self, t: ArrayLike) -> Array:
        """Integral of the interpolant."""
        return self.pull_curve.primitive(t)

    def next_kink(self, t: ArrayLike) -> Array:
        """The next sample, if the interpolant is not smooth there."""
        following = jnp.minimum(self.load_curve.following(t), self.pull_curve.following(t))
        return jnp.where(self.smooth, jnp.inf, following)

    @property
    def lowest_load(self) -> float:
        """Of the pieces."""
        return float(self.lowest)

    @property
    def fastest_pull(self) -> float:
        """Of the pieces."""
        return float(self.fastest)

    @property
    def longest_step(self) -> float:
        """Four samples."""
        return 4 * float(self.spacing)


def interpolated(
    time: np.ndarray, recorded: Any, level: float, kind: str, interpolant: str, name: str
) -> tuple[PiecewiseCubic, np.ndarray]:
    """Cubics through the samples over the time since the first sample, and bounds of their values.

    Parameters
    ----------
    time : array, shape (n,)
        Seconds.
    recorded : array, shape (n,), or None
        Samples; None for the constant `level`.
    level : float
        SI.
    kind : {"force", "velocity"}
    interpolant : {"pchip", "spline"}
    name : str
        Name of the step in messages.

    Raises
    ------
    InputError
        If times do not rise, lengths differ, a sample is not finite or the interpolant is unknown.
    """
    _check_time(time, name)
    span = np.array([0.0, time[-1] - time[0]])
    if recorded is None:
        return PiecewiseCubic.of(span, np.array([[0.0], [0.0], [0.0], [level]])), np.array([level])
    field = f"{name}.{_FIELDS[kind]}"
    values = np.asarray(to_si(recorded, kind, field), float)
    rule, got = "be as long as time", f"{values.shape} for {time.shape}"
    require(values.shape == time.shape, field, rule, got, "give one sample for each time")
    pieces = _pieces(interpolant, name)(time - time[0], values)
    # Splines overshoot, so the bounds include extrema between samples.
    extrema = pieces.derivative().roots(extrapolate=False)
    bounds = pieces(extrema[np.isfinite(extrema)])
    return PiecewiseCubic.of(pieces.x, pieces.c), np.concatenate([bounds, values])


def _pieces(interpolant: str, name: str) -> Any:
    # SciPy's interpolation takes long to load, and few programmes need it.
    from scipy.interpolate import CubicSpline, PchipInterpolator

    known = {"pchip": PchipInterpolator, "spline": CubicSpline}
    return known[one_of(interpolant, known, f"{name}.interpolant")]


def _check_time(time: np.ndarray, name: str) -> None:
    holds, rule = time.ndim == 1 and not time.size < 2, "have two samples or more"
    require(holds, f"{name}.time", rule, f"shape {time.shape}", "give the time of every sample")
    fall = np.flatnonzero(np.diff(time) <= 0)
    if fall.size:
        i = int(fall[0])
        got = f"{time[i]:.10g} s and then {time[i + 1]:.10g} s at sample {i + 1}"
        advice = "remove repeated and backward time stamps first"
        raise InputError(f"{name}.time", "rise", got, advice)
