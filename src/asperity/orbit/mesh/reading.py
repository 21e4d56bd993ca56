"""Observables of orbits on meshes: mean, harmonics, multipliers and waveforms."""

from __future__ import annotations

import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.algebra.small_systems import scaled_product, spectral_abscissa, spectral_radius
from asperity.orbit.mesh.equations import CondensedEquations, collocated, condensed, transfer_maps
from asperity.orbit.mesh.mesh import Orbit, split
from asperity.orbit.observables import Observables
from asperity.slider.pointwise import PointValues
from asperity.slider.problem import Problem

Float = NDArray[np.float64]

#: Modulus of the logarithms of the multipliers below which the mean Jacobian gives them better
#: than the monodromy matrix does: its error is about their square, of the latter the round-off of 1
#: or, of two that are close to each other, the root of that.
_SMALL_EXPONENT = 1e-5
#: Where the largest eigenvalue of the Jacobian integrates to less than this, all multipliers vanish
#: as doubles, and those of the transfer maps of a stiff method are not used.
VANISHING_GROWTH = -200.0


def orbit_observables(
    values: PointValues, response: Array, orbit: Orbit, harmonics: int
) -> Observables:
    """Observables of a converged orbit, without its growth.

    Parameters
    ----------
    values : PointValues
        At the collocation points.
    response : array, shape (n, STAGES, n, intervals, points)
        As in `CondensedEquations`.
    orbit : Orbit
    harmonics : int
    """
    weights = quadrature(orbit) / (2 * np.pi)
    mean = values.force_mean[0, 0] + (weights * values.force_rest).sum((0, 1))
    turn = np.exp(-1j * orbit.stage_phases)
    turns = np.cumprod(np.broadcast_to(turn, (harmonics, *turn.shape)), axis=0)
    phasors = 2 * (turns * (weights * values.force_rest)).sum((1, 2))
    maps = transfer_maps(response, orbit.widths, orbit.scheme.b)
    monodromy, log_scale = scaled_product(maps)
    trace = sum(values.jacobian[i, i] for i in range(len(orbit.centre)))
    # Where rates are so small that the order in which they act does not matter, their mean.
    mean_jacobian = 2 * np.pi * (weights * values.jacobian).sum((2, 3))
    small = spectral_radius(mean_jacobian) < _SMALL_EXPONENT
    return Observables(
        mean,
        phasors,
        monodromy,
        log_scale,
        2 * np.pi * (weights * trace).sum((0, 1)),
        np.where(small, mean_jacobian, np.nan),
        np.full(mean.shape, np.inf),
        orbit.start,
    )


def read_orbit(
    problem: Problem,
    orbit: Orbit,
    harmonics: int,
    equations: CondensedEquations | None = None,
) -> Observables:
    """Observables of a converged orbit, NumPy arrays.

    Parameters
    ----------
    problem : Problem
    orbit : Orbit
    harmonics : int
    equations : CondensedEquations, optional
        Of the orbit, where they are known.
    """
    with np.errstate(all="ignore"):
        if equations is None:
            equations = condensed(problem, orbit)
        observed = orbit_observables(equations.values, equations.response, orbit, harmonics)
        # The largest eigenvalue is at least the mean of all: elsewhere it need not be known.
        vanishing = observed.log_determinant < VANISHING_GROWTH * len(orbit.centre)
        growth = np.full(vanishing.shape, np.inf)
        for k in np.flatnonzero(vanishing):
            rate = spectral_abscissa(equations.values.jacobian[..., k])
            growth[k] = (quadrature(orbit)[..., k] * rate).sum()
    return observed._replace(growth=growth)


def quadrature(orbit: Orbit) -> Array:
    """Weights of the collocation points in an integral over the period."""
    return orbit.scheme.b[:, None, None] * orbit.widths


def split_observables(problem: Problem, orbit: Orbit, parts: int) -> Observables:
    """Multipliers by transfer maps over parts of the intervals, for stiff but smooth orbits."""
    return read_orbit(problem, split(orbit, parts), 1)


def piece_map(problem: Problem, piece: Orbit, parts: int) -> tuple[Float, Float]:
    """Transfer map (n, n, points) over a piece of an orbit, and the logarithm of its scale.

    From maps over the parts that each interval of the piece is cut into.
    """
    fine = split(piece, parts)
    equations = condensed(problem, fine)
    return scaled_product(transfer_maps(equations.response, fine.widths, fine.scheme.b))


def growth_within(problem: Problem, orbit: Orbit) -> Float:
    """Integral of the growth rate of disturbances over the part of the period where they grow.

    From the eigenvalues of the Jacobian along the orbit: what it is where the orbit changes slowly.
    """
    rate = spectral_abscissa(collocated(problem, orbit).jacobian)
    return (quadrature(orbit) * np.maximum(rate, 0.0)).sum((0, 1))
