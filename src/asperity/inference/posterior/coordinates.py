"""Unbounded coordinates q of the free parameters, in which posteriors are sampled.

The coordinate u of a fit has bounds. With two of them, u = low + (high - low) / (1 + exp(-q));
with one, u = low + exp(q) or u = high - exp(-q); without, u = q. Densities are multiplied by du/dq.
All functions take NumPy and JAX arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

Float = NDArray[np.float64]

#: Kinds of coordinates.
_FREE, _ABOVE, _BELOW, _BETWEEN = 0, 1, 2, 3


class Coordinates(NamedTuple):
    """Bounds of the coordinates u and what they are turned into.

    Attributes
    ----------
    low, high : array, shape (n,)
        Bounds of u; 0 where there is none.
    kind : int array, shape (n,)
    """

    low: Any
    high: Any
    kind: Any

    @classmethod
    def of(cls, bounds: Sequence[tuple[float, float]]) -> Coordinates:
        """Coordinates with bounds (low, high), infinite where there is none."""
        low, high = np.array(bounds, float).reshape(-1, 2).T
        kind = np.isfinite(low) * _ABOVE + np.isfinite(high) * _BELOW
        low, high = (np.where(np.isfinite(end), end, 0.0) for end in (low, high))
        return cls(low, high, kind)

    @property
    def bounded_twice(self) -> NDArray[np.bool_]:
        """Which coordinates have bounds on both sides."""
        return np.asarray(self.kind == _BETWEEN)

    def to_q(self, u: Float) -> Float:
        """Unbounded coordinates of u; u must lie between the bounds."""
        with np.errstate(divide="ignore", invalid="ignore"):
            above, below = np.log(u - self.low), -np.log(self.high - u)
        return np.choose(self.kind, [u, above, below, above + below])

    def to_u(self, q: Any) -> Any:
        """Coordinates of the fit, for q of shape (..., n)."""
        share = 1 / (1 + jnp.exp(-q))
        return jnp.select(
            [self.kind == _ABOVE, self.kind == _BELOW, self.kind == _BETWEEN],
            [
                self.low + _exp(q),
                self.high - _exp(-q),
                self.low + (self.high - self.low) * share,
            ],
            q,
        )

    def log_slope(self, q: Any) -> Array:
        """ln(du/dq) of each coordinate."""
        between = jnp.log(jnp.maximum(self.high - self.low, 1e-300))
        between = between - jnp.logaddexp(0.0, q) - jnp.logaddexp(0.0, -q)
        return jnp.select(
            [self.kind == _ABOVE, self.kind == _BELOW, self.kind == _BETWEEN],
            [q, -q, between],
            jnp.zeros_like(q),
        )

    def inside(self, u: Float, sd: Float) -> Float:
        """The nearest coordinates that are off the bounds by a tenth of a standard deviation."""
        step = 0.1 * np.minimum(sd, np.where(self.kind == _BETWEEN, self.high - self.low, np.inf))
        low = np.where(np.isin(self.kind, (_ABOVE, _BETWEEN)), self.low + step, -np.inf)
        high = np.where(np.isin(self.kind, (_BELOW, _BETWEEN)), self.high - step, np.inf)
        return np.clip(u, low, high)


def _exp(q: Any) -> Array:
    """Exponential without overflow, for coordinates of which another kind is chosen."""
    return jnp.exp(jnp.clip(q, -700.0, 700.0))
