"""The posterior density of a fit, in coordinates and in a form for a compiled program.

The sampler works in z, in which the posterior is nearly normal with unit covariance about zero:
q = mode + root @ z, with unbounded coordinates q and a root of the covariance from the curvature at
the mode (Laplace).

The coordinate u of a fit lies in a range, u = low + (high - low) / (1 + exp(-q)). Densities are
multiplied by du/dq.

The prior is a proper density of u. A normal prior of a parameter is cut off by the parameter's
rule. Without a prior, the coordinate is uniform over a range: for a positive parameter, whose
coordinate is the logarithm, a tenth of the lowest to ten times the highest usual value; for others,
zero to three times the highest usual value. The range is widened if the estimate lies beyond it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.optimize import minimize
from scipy.special import ndtr

from asperity.arrays import Float
from asperity.inference.fitting.result import Fit
from asperity.inference.objective import CompiledResiduals, Objective
from asperity.inference.unknowns import Unknown

#: The mode is reached if the gradient of the log density per standard deviation is smaller: a
#: further step would gain half its square, which is near the accuracy of orbits and motions. The
#: second number is the largest number of steps.
_REACHED, _STEPS = 0.05, 20
#: Largest standard deviation of q.
_WIDEST = 3.0


class Coordinates(NamedTuple):
    """Ranges and normal priors of the coordinates u; arrays of shape (n,).

    Attributes
    ----------
    low, high : array
        Range of u.
    logarithmic : bool array
        Whether u is the logarithm of the parameter.
    scale : array
        Ratio of the parameter to u if u is no logarithm.
    mean, precision : array
        Mean and precision of normal priors of the parameter, in SI; 0 without a prior.
    log_norm : float
        Logarithm of the normalisation of the prior.
    """

    low: Any
    high: Any
    logarithmic: Any
    scale: Any
    mean: Any
    precision: Any
    log_norm: float = 0.0

    @classmethod
    def about(cls, unknowns: Sequence[Unknown], u: Float, sd: Float) -> Coordinates:
        """Coordinates of free parameters, with ranges that include an estimate with its errors."""
        ranges = [k.range_about(x, s) for k, x, s in zip(unknowns, u, sd, strict=True)]
        log_norm = 0.0
        for k, (a, b) in zip(unknowns, ranges, strict=True):
            if k.prior is None:
                log_norm -= math.log(b - a)
            else:
                z = (np.array(k.to_value(np.array([a, b]))) - k.prior.mean) / k.prior.sd
                log_norm -= math.log(ndtr(z[1]) - ndtr(z[0]))
                log_norm -= math.log(k.prior.sd * math.sqrt(2 * math.pi))
                log_norm += 0.0 if k.logarithmic else math.log(k.scale)
        low, high = np.array(ranges).reshape(-1, 2).T
        return cls(
            low,
            high,
            np.array([k.logarithmic for k in unknowns]),
            np.array([k.scale for k in unknowns]),
            np.array([k.prior.mean if k.prior else 0.0 for k in unknowns]),
            np.array([1 / k.prior.sd if k.prior else 0.0 for k in unknowns]),
            log_norm,
        )

    def to_q(self, u: Float) -> Float:
        """Unbounded coordinates of u, which must lie within the range."""
        return np.asarray(np.log(u - self.low) - np.log(self.high - u))

    # Outside of programs each of these is one, not one for each operation.
    @jax.jit
    def to_u(self, q: Any) -> Any:
        """Coordinates of the fit, for q of shape (..., n)."""
        return self.low + (self.high - self.low) / (1 + jnp.exp(-q))

    @jax.jit
    def log_slope(self, q: Any) -> Array:
        """ln(du/dq) of each coordinate."""
        return jnp.log(self.high - self.low) - jnp.logaddexp(0.0, q) - jnp.logaddexp(0.0, -q)

    def values(self, u: Any) -> Array:
        """Parameters in SI, for u of shape (..., n)."""
        return jnp.where(self.logarithmic, jnp.exp(u), u * self.scale)

    @property
    def volumes(self) -> Any:
        """1 for a normal prior of exp(u), whose density in u has a factor exp(u); else 0."""
        return (self.precision > 0) & self.logarithmic

    @jax.jit
    def log_prior(self, u: Any) -> Array:
        """Logarithm of the prior density of u, up to a constant, shape (..., n) to (...)."""
        normal = -0.5 * ((self.values(u) - self.mean) * self.precision) ** 2
        return jnp.sum(normal + jnp.where(self.volumes, u, 0.0), axis=-1)

    def log_density(self, u: Float) -> Float:
        """Logarithm of the prior density of u; minus infinity out of range."""
        outside = ((u < self.low) | (u > self.high)).any(-1)
        return np.where(outside, -np.inf, np.asarray(self.log_prior(u)) + self.log_norm)


#: Arrays of the density, for whose shapes programs are compiled: mode and root, shapes (n,) and
#: (n, n), coordinates, and the arrays of each data term.
DensityData: TypeAlias = tuple[Any, Any, Coordinates, tuple[Any, ...]]


@dataclass(frozen=True)
class PosteriorDensity:
    """Logarithm of the posterior density of z, up to a constant.

    Attributes
    ----------
    names : tuple of str
        Free parameters.
    residuals : tuple
        For each data term, a function of the parameters by name and of its arrays.
    """

    names: tuple[str, ...]
    residuals: tuple[CompiledResiduals, ...]

    def __call__(self, z: Array, data: DensityData) -> Array:
        """Log density at z, of shape (n,)."""
        mode, root, coordinates, terms = data
        q = mode + root @ z
        u = coordinates.to_u(q)
        total = coordinates.log_prior(u) + jnp.sum(coordinates.log_slope(q))
        values = dict(zip(self.names, coordinates.values(u), strict=True))
        for residuals, arrays in zip(self.residuals, terms, strict=True):
            total = total - 0.5 * jnp.sum(residuals(values, arrays) ** 2)
        return total


@dataclass(frozen=True, eq=False)
class Whitened:
    """A posterior in its whitened coordinates.

    Attributes
    ----------
    objective : Objective
    coordinates : Coordinates
    mode, root : array, shapes (n,) and (n, n)
        q = mode + root @ z.
    """

    objective: Objective
    coordinates: Coordinates
    mode: Float
    root: Float

    @classmethod
    def of(cls, fit: Fit) -> Whitened:
        """The posterior of a fit, whitened at its mode."""
        objective = fit.objective
        u = objective.coordinates(fit.values)
        sd = fit.coordinate_errors
        coordinates = Coordinates.about(objective.unknowns, u, sd)
        low, high, *_ = coordinates
        # At least a tenth of a standard deviation away from the bounds.
        step = 0.1 * np.minimum(sd, high - low)
        start = coordinates.to_q(np.clip(u, low + step, high - step))
        near = cls(objective, coordinates, start, np.eye(len(u)))._whitened_about(start)
        climbed = minimize(
            lambda z: -near.log_density(z)[0],
            np.zeros(len(u)),
            jac=lambda z: -near.log_density(z)[1],
            hess=near._curvature,
            method="trust-exact",
            options={"gtol": _REACHED, "maxiter": _STEPS},
        )
        return near._whitened_about(start + near.root @ climbed.x)

    def _whitened_about(self, q: Float) -> Whitened:
        """The posterior whitened about another point, with the root of its covariance there."""
        return replace(self, mode=q, root=_root(self._evaluated(q)[2]))

    def u_of(self, z: Float) -> Float:
        """Coordinates of the fit for whitened coordinates, shapes (..., n)."""
        return np.asarray(self.coordinates.to_u(self.mode + z @ self.root.T))

    def log_density(self, z: Float) -> tuple[float, Float]:
        """Log density and its gradient, by the solver of the fit."""
        value, gradient, _ = self._evaluated(self.mode + self.root @ z)
        return value, self.root.T @ gradient

    def _curvature(self, z: Float) -> Float:
        """Curvature of minus the log density, by the Gauss-Newton approximation."""
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
        # First and second derivatives of the logarithm of the slope.
        bend, curvature = 1 - 2 * share, 2 * share * (1 - share)
        volume = self.coordinates.volumes.astype(float)
        J = jacobian * slope
        value = -0.5 * float(r @ r) + float(volume @ u + log_slope.sum())
        return value, -J.T @ r + volume * slope + bend, J.T @ J + np.diag(curvature)

    def prior_record(self) -> dict[str, dict[str, float | str]]:
        """Prior of each parameter in SI, for JSON."""
        result: dict[str, dict[str, float | str]] = {}
        low, high, *_ = self.coordinates
        for k, *ends in zip(self.objective.unknowns, low, high, strict=True):
            if k.prior is not None:
                known: dict[str, Any] = {n: getattr(k.prior, n) for n in ("mean", "sd", "source")}
                result[k.name] = {"kind": "normal", **known}
            else:
                kind = "uniform in the logarithm" if k.logarithmic else "uniform"
                a, b = (float(k.to_value(end)) for end in ends)
                result[k.name] = {"kind": kind, "low": a, "high": b}
        return result

    def compiled(self) -> tuple[PosteriorDensity, DensityData]:
        """The density as a compiled program evaluates it, and its data."""
        parts = [term.compiled(self.objective.names) for term in self.objective.terms]
        residuals, arrays = zip(*parts, strict=True)
        data = (self.mode, self.root, self.coordinates, arrays)
        return PosteriorDensity(self.objective.names, residuals), data


def _root(information: Float) -> Float:
    """Root of the inverse of an information matrix, with limited standard deviations."""
    scale = np.sqrt(np.maximum(np.diag(information), _WIDEST**-2))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    root = vectors / np.sqrt(np.maximum(values, 1e-30)) / scale[:, None]
    # No direction moves a coordinate by more than the largest standard deviation.
    longest = np.sqrt((root**2).sum(0))
    return np.asarray(root * np.minimum(1.0, _WIDEST / longest))
