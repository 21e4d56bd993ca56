"""The posterior density of a fit, as a compiled program needs it.

The sampler walks in z, where the posterior is near a normal density of unit covariance about zero:
q = mode + root @ z, with the unbounded coordinates q of `asperity.inference.posterior.coordinates`
and a root of the covariance that the curvature at the mode stands for (Laplace).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.inference.objective import DataTerm, Objective
from asperity.inference.posterior.coordinates import Coordinates
from asperity.inference.posterior.prior_density import PriorDensity
from asperity.inference.posterior.recordings import RunLikelihood, likelihood_of_run
from asperity.inference.posterior.tables import LockInLikelihood, likelihood_of_table
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.term import LockInTerm

Float = NDArray[np.float64]

#: Steps to the mode, and the decrease of the log density at which it counts as reached.
_STEPS, _REACHED = 60, 1e-4
#: Damping of the first step, and the promised gain below which a step that gains nothing ends the
#: way: that is round-off, or the accuracy of orbits.
_FIRST_DAMPING, _NOISE = 1e-3, 1e-3
#: Standard deviations of q are looked for between these.
_NARROWEST, _WIDEST = 1e-9, 3.0


class DensityData(NamedTuple):
    """Arrays that the density depends on; programs are compiled for their shapes.

    Attributes
    ----------
    mode, root : array, shapes (n,) and (n, n)
    coordinates : Coordinates
    logarithmic : bool array, shape (n,)
        Where the coordinate u is the logarithm of the parameter.
    scale, prior_mean, prior_precision : array, shape (n,)
    terms : tuple
        Of each set of data, as its likelihood reads them.
    """

    mode: Any
    root: Any
    coordinates: Coordinates
    logarithmic: Any
    scale: Any
    prior_mean: Any
    prior_precision: Any
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
    likelihoods: tuple[LockInLikelihood | RunLikelihood, ...]

    def __call__(self, z: Array, data: DensityData) -> Array:
        """Log density at z, of shape (n,)."""
        q = data.mode + data.root @ z
        u = data.coordinates.to_u(q)
        x = jnp.where(data.logarithmic, jnp.exp(u), u * data.scale)
        prior = -0.5 * ((x - data.prior_mean) * data.prior_precision) ** 2
        volume = jnp.where((data.prior_precision > 0) & data.logarithmic, u, 0.0)
        total = jnp.sum(prior + volume + data.coordinates.log_slope(q))
        values = dict(zip(self.names, x, strict=True))
        for likelihood, own in zip(self.likelihoods, data.terms, strict=True):
            total = total + likelihood(values, own)
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
        plain = cls(objective, prior, coordinates, start, np.eye(len(u)))
        mode, information = plain._climbed(start)
        return cls(objective, prior, coordinates, mode, _root(information))

    def u_of(self, z: Float) -> Float:
        """Coordinates of the fit at whitened ones, shapes (..., n)."""
        return np.asarray(self.coordinates.to_u(self.mode + z @ self.root.T))

    def log_density(self, z: Float) -> tuple[float, Float]:
        """Log density and its gradient, by the solver of the fit."""
        value, gradient, _ = self._evaluated(self.mode + self.root @ z)
        return value, self.root.T @ gradient

    def _evaluated(self, q: Float) -> tuple[float, Float, Float]:
        """Log density of q, its gradient, and the information matrix."""
        u = np.asarray(self.coordinates.to_u(q))
        r, jacobian = self.objective.residuals(u)
        if not np.isfinite(r).all():
            return -np.inf, np.zeros_like(q), np.eye(q.size)
        slope = np.exp(np.asarray(self.coordinates.log_slope(q)))
        volume, along = self.objective.log_volume(u)
        step = 1e-6
        up, down = (np.asarray(self.coordinates.log_slope(q + s)) for s in (step, -step))
        middle = np.asarray(self.coordinates.log_slope(q))
        value = -0.5 * float(r @ r) + volume + float(middle.sum())
        J = jacobian * slope
        gradient = -J.T @ r + along * slope + (up - down) / (2 * step)
        share = 1 / (1 + np.exp(-q))
        curvature = np.where(self.coordinates.bounded_twice, 2 * share * (1 - share), 0.0)
        return value, gradient, J.T @ J + np.diag(curvature)

    def _climbed(self, q: Float) -> tuple[Float, Float]:
        """The mode reached from q by damped Gauss-Newton steps, and the information there."""
        value, gradient, information = self._evaluated(q)
        damping = _FIRST_DAMPING
        for _ in range(_STEPS):
            lifted = information + damping * np.diag(np.diag(information) + 1e-12)
            step = np.linalg.solve(lifted, gradient)
            gain = 0.5 * float(step @ gradient)
            if damping <= _FIRST_DAMPING and gain < _REACHED:
                break
            longest = np.abs(step).max()
            step *= min(1.0, 2.0 / longest) if longest else 1.0
            trial = self._evaluated(q + step)
            if trial[0] > value:
                gain = trial[0] - value
                q, (value, gradient, information), damping = q + step, trial, damping / 10
                if gain < _REACHED:
                    break
            else:
                damping *= 10
                if damping > 1e8 or gain < _NOISE:
                    break
        return q, information

    def compiled(self) -> tuple[PosteriorDensity, DensityData]:
        """The density as a compiled program evaluates it, and its data."""
        parts = [_compiled(term, self.objective.names) for term in self.objective.terms]
        unknowns = self.objective.unknowns
        data = DensityData(
            self.mode,
            self.root,
            self.coordinates,
            np.array([k.logarithmic for k in unknowns]),
            np.array([k.scale for k in unknowns]),
            self.prior.mean,
            self.prior.precision,
            tuple(arrays for _, arrays in parts),
        )
        return PosteriorDensity(self.objective.names, tuple(own for own, _ in parts)), data


def _compiled(term: DataTerm, names: tuple[str, ...]) -> tuple[Any, Any]:
    """The likelihood of a set of data for a compiled program, and its arrays."""
    if isinstance(term, RunTerm):
        return likelihood_of_run(term, names)
    assert isinstance(term, LockInTerm)  # there is no third kind
    return likelihood_of_table(term)


def _root(information: Float) -> Float:
    """Root of the inverse of an information matrix, with standard deviations within limits."""
    scale = np.sqrt(np.maximum(np.diag(information), _WIDEST**-2))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    sd = np.clip(1 / np.sqrt(np.maximum(values, 1e-30)), _NARROWEST, _WIDEST / np.min(1 / scale))
    root = (vectors * sd) / scale[:, None]
    # No direction moves a coordinate farther than its widest.
    longest = np.sqrt((root**2).sum(0))
    return np.asarray(root * np.minimum(1.0, _WIDEST / longest))
