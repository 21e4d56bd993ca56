"""Meshes for collocation: graded start, equidistribution of the error, evaluation between nodes.

A mesh is an array (intervals + 1, points) that rises from 0 to 2 pi for each operating point.

The collocation method of an equation of motion is chosen here too: Gauss or Radau points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jax import Array

from asperity.algebra.runge_kutta import CollocationScheme, gauss_legendre, radau_iia
from asperity.arrays import Float
from asperity.slider import Motion, RadiatingAsperities, StiffInertial

#: Collocation points in an interval.
STAGES = 4

GAUSS = gauss_legendre(STAGES)
RADAU = radau_iia(STAGES)


def scheme_for(system: Motion) -> CollocationScheme:
    """The method for an equation of motion: Radau IIA where modes decay within an interval."""
    return RADAU if isinstance(system, StiffInertial | RadiatingAsperities) else GAUSS


#: Share of the intervals that is spread evenly, independent of the error estimate.
_EVEN_SHARE = 0.3


class Orbit(NamedTuple):
    """A piecewise polynomial orbit of every operating point, with a mesh that suits it.

    Attributes
    ----------
    mesh : array, shape (intervals + 1, points)
    centre : array, shape (size, points)
        States at theta = 0.
    nodes : array, shape (size, intervals, points)
        States at the mesh points less `centre`, so that a small orbit keeps its relative accuracy.
    slopes : array, shape (size, STAGES, intervals, points)
        Derivatives at the collocation points.
    scheme : CollocationScheme
    """

    mesh: Array
    centre: Array
    nodes: Array
    slopes: Array
    scheme: CollocationScheme

    @classmethod
    def empty(cls, scheme: CollocationScheme, size: int, intervals: int, points: int) -> Orbit:
        """An orbit of NumPy arrays without values."""
        return cls(
            np.zeros((intervals + 1, points)),
            np.zeros((size, points)),
            np.zeros((size, intervals, points)),
            np.zeros((size, STAGES, intervals, points)),
            scheme,
        )

    @property
    def start(self) -> Array:
        """States at theta = 0, shape (size, points)."""
        return self.centre

    def states(self, theta: np.ndarray) -> Float:
        """States at the phases `theta`, a column: shape (size, phases, points)."""
        apart, _ = evaluate(self, theta * np.ones(self.centre.shape[1]))
        return self.centre[:, None] + apart

    @property
    def widths(self) -> Array:
        """Interval widths, shape (intervals, points)."""
        return self.mesh[1:] - self.mesh[:-1]

    @property
    def stage_phases(self) -> Array:
        """Phases of the collocation points, shape (STAGES, intervals, points)."""
        return self.mesh[:-1] + self.scheme.c[:, None, None] * self.widths

    def stage_sums(self, slopes: Array) -> Array:
        """a_jk slopes_k: increments of the states at the stages per unit width."""
        return np.einsum("jk,nkmb->njmb", self.scheme.a, slopes)

    @property
    def stage_deviations(self) -> Array:
        """States at the collocation points less `centre`, shape as `slopes`."""
        return self.nodes[:, None] + self.widths * self.stage_sums(self.slopes)

    @property
    def stage_states(self) -> Array:
        """States at the collocation points, shape as `slopes`."""
        return self.centre[:, None, None] + self.stage_deviations


#: Newton steps for Kepler's equation; quadratic convergence needs fewer for a grading below 0.9.
_KEPLER_STEPS = 60


def eccentric_phase(theta: Float, grading: float) -> Float:
    """Tau with tau + g sin(tau) = theta (Kepler's equation), 0 <= g < 1, by Newton's method."""
    tau = np.array(theta, float)
    for _ in range(_KEPLER_STEPS):
        tau = tau - (tau + grading * np.sin(tau) - theta) / (1 + grading * np.cos(tau))
    return tau


def graded_mesh(intervals: int, points: int, grading: float) -> Float:
    """Mesh theta = tau + g sin(tau), finest at the weakest contact theta = pi."""
    tau = np.linspace(0.0, 2 * np.pi, intervals + 1)[:, None]
    return (tau + grading * np.sin(tau)) * np.ones(points)


def evaluate(orbit: Orbit, theta: Float) -> tuple[Float, Float]:
    """States less `centre`, and slopes, at the phases `theta` of shape (count, points)."""
    columns = zip(np.transpose(orbit.mesh), np.transpose(theta), strict=True)
    index = np.stack([np.searchsorted(mesh, at, side="right") - 1 for mesh, at in columns], axis=1)
    index = np.clip(index, 0, len(orbit.mesh) - 2)
    points = np.arange(index.shape[1])
    width = orbit.widths[index, points]
    x = (theta - orbit.mesh[index, points]) / width
    coefficients = np.einsum("kj,njmb->knmb", orbit.scheme.monomials, orbit.slopes)
    slopes = rise = 0.0
    # By Horner's rule, the highest power first.
    for k in reversed(range(len(coefficients))):
        here = coefficients[k][:, index, points]
        slopes = here + x * slopes
        rise = here / (k + 1) + x * rise
    return orbit.nodes[:, index, points] + width * x * rise, slopes


def on_mesh(orbit: Orbit, mesh: Float) -> Orbit:
    """The same orbit represented on another mesh."""
    bare = orbit._replace(mesh=mesh)
    phases = np.concatenate([mesh[None, :-1], bare.stage_phases])
    states, slopes = evaluate(orbit, phases.reshape(-1, phases.shape[-1]))
    count, size = len(mesh) - 1, states.shape[0]
    stages = slopes[:, count:].reshape(size, -1, count, phases.shape[-1])
    return bare._replace(nodes=states[:, :count], slopes=stages)


def split(orbit: Orbit, parts: int) -> Orbit:
    """Every interval divided into `parts` equal intervals."""
    fraction = np.arange(parts)[:, None] / parts
    inner = orbit.mesh[:-1, None] + fraction * orbit.widths[:, None]
    inner = inner.reshape(-1, orbit.mesh.shape[1])
    return on_mesh(orbit, np.concatenate([inner, orbit.mesh[-1:]]))


def equidistributed(orbit: Orbit, scales: Float, intervals: int) -> Orbit:
    """The orbit on a mesh that spreads the collocation error evenly.

    Parameters
    ----------
    orbit : Orbit
    scales : array, shape (size, intervals, points)
        Weight of each state's error.
    intervals : int
        Intervals of the new mesh.
    """
    widths = orbit.widths
    top = np.einsum("k,nkmb->nmb", orbit.scheme.top, orbit.slopes)
    local = (np.abs(top) * widths * scales).max(0)
    density = (local + 1e-14) ** (1 / (STAGES + 1)) / widths
    density = density / (density * widths).sum(0)
    density = (1 - _EVEN_SHARE) * density + _EVEN_SHARE / (2 * np.pi)
    return on_mesh(orbit, spread(orbit.mesh, density, intervals, smoothings=2))


def spread(mesh: Float, density: Float, intervals: int, *, smoothings: int) -> Float:
    """A mesh of `intervals` that lie as densely as a density on the intervals of another one.

    Parameters
    ----------
    mesh : array, shape (count + 1, points)
    density : array, shape (count, points)
    intervals : int
    smoothings : int
        Times that the density is averaged over neighbours: their widths then differ by a small
        factor only.
    """
    for _ in range(smoothings):
        density = (np.roll(density, 1, 0) + 2 * density + np.roll(density, -1, 0)) / 4
    mass = np.cumsum(density * np.diff(mesh, axis=0), axis=0)
    mass = np.concatenate([np.zeros_like(mass[:1]), mass]) / mass[-1]
    share = np.linspace(0.0, 1.0, intervals + 1)
    columns = zip(mass.T, mesh.T, strict=True)
    new = np.stack([np.interp(share, m, theta) for m, theta in columns], axis=1)
    new[0], new[-1] = 0.0, 2 * np.pi
    return new
