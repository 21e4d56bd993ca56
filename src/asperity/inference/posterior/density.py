"""The posterior density of a fit, as a compiled program needs it.

The sampler walks in z, where the posterior is near a normal density of unit covariance about zero:
q = mode + root @ z, with unbounded coordinates q and a root of the covariance that the curvature at
the mode stands for (Laplace).

The coordinate u of a fit has bounds. With two of them, u = low + (high - low) / (1 + exp(-q));
with one, u = low + exp(q) or u = high - exp(-q); without, u = q. Densities are multiplied by du/dq.

The prior is a proper density of u. A parameter with a prior has that normal density, cut off where
its rule says. Without, its coordinate is uniform over a range: a tenth of the lowest to ten times
the highest usual value of a positive parameter, whose coordinate is the logarithm; zero to three
times the highest usual value of others. The range is widened where the data want a value beyond it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import ndtr

from asperity.inference.objective import Likelihood, Objective
from asperity.inference.unknowns import Unknown

Float = NDArray[np.float64]

#: Kinds of coordinates.
_FREE, _ABOVE, _BELOW, _BETWEEN = 0, 1, 2, 3
#: The mode is reached where the gradient of the log density is smaller, by standard deviations: a
#: step gains half its square, near what the accuracy of orbits and motions leaves. Steps at most.
_REACHED, _STEPS = 0.05, 20
#: Standard deviations of q are looked for between these.
_NARROWEST, _WIDEST = 1e-9, 3.0


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


class PriorArrays(NamedTuple):
    """Numbers of a prior.

    Attributes
    ----------
    logarithmic : bool array, shape (n,)
        Where the coordinate u is the logarithm of the parameter.
    scale : array, shape (n,)
        Of the others.
    mean, precision : array, shape (n,)
        Of normal priors, in SI; 0 where there is none.
    """

    logarithmic: Any
    scale: Any
    mean: Any
    precision: Any

    def values(self, u: Any) -> Array:
        """Parameters in SI at coordinates of shape (..., n)."""
        return jnp.where(self.logarithmic, jnp.exp(u), u * self.scale)

    def log_density(self, u: Any) -> Array:
        """Logarithm of the density of u but for a constant, shape (..., n) to (...)."""
        normal = -0.5 * ((self.values(u) - self.mean) * self.precision) ** 2
        volume = jnp.where((self.precision > 0) & self.logarithmic, u, 0.0)
        return jnp.sum(normal + volume, axis=-1)


@dataclass(frozen=True, eq=False)
class PriorDensity:
    """Normalised prior density of the coordinates.

    Attributes
    ----------
    unknowns : tuple of Unknown
    low, high : array, shape (n,)
        Range of the coordinates.
    mean, precision : array, shape (n,)
        Of the normal priors, in SI; 0 where there is none.
    log_norm : float
        Logarithm of the normalising factor.
    """

    unknowns: tuple[Unknown, ...]
    low: Float
    high: Float
    mean: Float
    precision: Float
    log_norm: float

    @classmethod
    def about(cls, unknowns: Sequence[Unknown], u: Float, sd: Float) -> PriorDensity:
        """The prior, with ranges that reach an estimate u with standard deviations sd."""
        low, high = np.array(
            [k.range_about(x, s) for k, x, s in zip(unknowns, u, sd, strict=True)]
        ).T
        mean = np.array([k.prior.mean if k.prior else 0.0 for k in unknowns])
        sds = np.array([k.prior.sd if k.prior else math.inf for k in unknowns])
        log_norm = 0.0
        for k, a, b in zip(unknowns, low, high, strict=True):
            if k.prior is None:
                log_norm -= math.log(b - a)
            else:
                z = (np.array(k.to_value(np.array([a, b]))) - k.prior.mean) / k.prior.sd
                log_norm -= math.log(ndtr(z[1]) - ndtr(z[0]))
                log_norm -= math.log(k.prior.sd * math.sqrt(2 * math.pi))
                log_norm += 0.0 if k.logarithmic else math.log(k.scale)
        return cls(tuple(unknowns), low, high, mean, 1 / sds, log_norm)

    @property
    def arrays(self) -> PriorArrays:
        """What a compiled program needs of it."""
        return PriorArrays(
            np.array([k.logarithmic for k in self.unknowns]),
            np.array([k.scale for k in self.unknowns]),
            self.mean,
            self.precision,
        )

    def log_density(self, u: Float) -> Float:
        """Logarithm of the density at u, shape (..., n) to (...); minus infinity out of range."""
        outside = ((u < self.low) | (u > self.high)).any(-1)
        density = np.asarray(self.arrays.log_density(u)) + self.log_norm
        return np.where(outside, -np.inf, density)

    def record(self) -> dict[str, dict[str, float | str]]:
        """Each prior in SI, for JSON."""
        result: dict[str, dict[str, float | str]] = {}
        for i, k in enumerate(self.unknowns):
            if k.prior is not None:
                result[k.name] = {
                    "kind": "normal",
                    "mean": k.prior.mean,
                    "sd": k.prior.sd,
                    "source": k.prior.source,
                }
            else:
                result[k.name] = {
                    "kind": "uniform in the logarithm" if k.logarithmic else "uniform",
                    "low": float(k.to_value(self.low[i])),
                    "high": float(k.to_value(self.high[i])),
                }
        return result


class DensityData(NamedTuple):
    """Arrays that the density depends on; programs are compiled for their shapes.

    Attributes
    ----------
    mode, root : array, shapes (n,) and (n, n)
    coordinates : Coordinates
    prior : PriorArrays
    terms : tuple
        Of each set of data, as its likelihood reads them.
    """

    mode: Any
    root: Any
    coordinates: Coordinates
    prior: PriorArrays
    terms: tuple[Any, ...]


@dataclass(frozen=True)
class PosteriorDensity:
    """Logarithm of the posterior density of z, but for a constant.

    Attributes
    ----------
    names : tuple of str
        Free parameters.
    likelihoods : tuple
        Of each set of data: functions of the parameters by name and of its arrays.
    """

    names: tuple[str, ...]
    likelihoods: tuple[Likelihood, ...]

    def __call__(self, z: Array, data: DensityData) -> Array:
        """Log density at z, of shape (n,)."""
        q = data.mode + data.root @ z
        u = data.coordinates.to_u(q)
        total = data.prior.log_density(u) + jnp.sum(data.coordinates.log_slope(q))
        values = dict(zip(self.names, data.prior.values(u), strict=True))
        for likelihood, arrays in zip(self.likelihoods, data.terms, strict=True):
            total = total + likelihood(values, arrays)
        return total


@dataclass(frozen=True, eq=False)
class Whitened:
    """A posterior in its whitened coordinates.

    Attributes
    ----------
    objective : Objective
    prior : PriorDensity
    coordinates : Coordinates
    mode, root : array
        As of `DensityData`.
    """

    objective: Objective
    prior: PriorDensity
    coordinates: Coordinates
    mode: Float
    root: Float

    @classmethod
    def at(cls, objective: Objective, prior: PriorDensity, u: Float, sd: Float) -> Whitened:
        """The posterior whitened at the mode that is reached from u."""
        coordinates = Coordinates.of(list(zip(prior.low, prior.high, strict=True)))
        start = coordinates.to_q(coordinates.inside(u, sd))
        near = cls(objective, prior, coordinates, start, np.eye(len(u)))
        near = near._rooted(start)
        climbed = minimize(
            lambda z: -near.log_density(z)[0],
            np.zeros(len(u)),
            jac=lambda z: -near.log_density(z)[1],
            hess=near._curvature,
            method="trust-exact",
            options={"gtol": _REACHED, "maxiter": _STEPS},
        )
        return near._rooted(start + near.root @ climbed.x)

    def _rooted(self, q: Float) -> Whitened:
        """The same about another point, with the root of the covariance there."""
        return replace(self, mode=q, root=_root(self._evaluated(q)[2]))

    def u_of(self, z: Float) -> Float:
        """Coordinates of the fit at whitened ones, shapes (..., n)."""
        return np.asarray(self.coordinates.to_u(self.mode + z @ self.root.T))

    def log_density(self, z: Float) -> tuple[float, Float]:
        """Log density and its gradient, by the solver of the fit."""
        value, gradient, _ = self._evaluated(self.mode + self.root @ z)
        return value, self.root.T @ gradient

    def _curvature(self, z: Float) -> Float:
        """Of minus the log density, as Gauss and Newton have it."""
        information = self._evaluated(self.mode + self.root @ z)[2]
        return np.asarray(self.root.T @ information @ self.root)

    def _evaluated(self, q: Float) -> tuple[float, Float, Float]:
        """Log density of q, its gradient, and the information matrix."""
        u = np.asarray(self.coordinates.to_u(q))
        r, jacobian = self.objective.residuals(u)
        if not np.isfinite(r).all():
            return -np.inf, np.zeros_like(q), np.eye(q.size)
        log_slope = np.asarray(self.coordinates.log_slope(q))
        slope, share = np.exp(log_slope), 1 / (1 + np.exp(-q))
        # Derivatives of the logarithm of the slope, first and second.
        one, nothing = np.ones_like(q), np.zeros_like(q)
        bend = np.choose(self.coordinates.kind, [nothing, one, -one, 1 - 2 * share])
        curvature = np.where(self.coordinates.bounded_twice, 2 * share * (1 - share), 0.0)
        # Priors are densities of the parameter itself: that of its logarithm has a volume.
        volume = np.where((self.prior.precision > 0) & self.prior.arrays.logarithmic, 1.0, 0.0)
        J = jacobian * slope
        value = -0.5 * float(r @ r) + float(volume @ u + log_slope.sum())
        return value, -J.T @ r + volume * slope + bend, J.T @ J + np.diag(curvature)

    def compiled(self) -> tuple[PosteriorDensity, DensityData]:
        """The density as a compiled program evaluates it, and its data."""
        parts = [term.likelihood(self.objective.names) for term in self.objective.terms]
        data = DensityData(
            self.mode,
            self.root,
            self.coordinates,
            self.prior.arrays,
            tuple(arrays for _, arrays in parts),
        )
        return PosteriorDensity(self.objective.names, tuple(own for own, _ in parts)), data


def _root(information: Float) -> Float:
    """Root of the inverse of an information matrix, with standard deviations within limits."""
    scale = np.sqrt(np.maximum(np.diag(information), _WIDEST**-2))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    sd = np.clip(1 / np.sqrt(np.maximum(values, 1e-30)), _NARROWEST, _WIDEST / np.min(1 / scale))
    root = (vectors * sd) / scale[:, None]
    # No direction moves a coordinate farther than its widest.
    longest = np.sqrt((root**2).sum(0))
    return np.asarray(root * np.minimum(1.0, _WIDEST / longest))
