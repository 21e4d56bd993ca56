"""Meshes for collocation: graded start, equidistribution of the error, evaluation between nodes.

A mesh is an array (intervals + 1, points) that rises from 0 to 2 pi for each operating point.
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.runge_kutta import CollocationScheme
from asperity.orbit.mesh.scheme import STAGES

#: Share of a mesh that is spread evenly whatever the error estimate says.
_EVEN_SHARE = 0.3


class Orbit(eqx.Module):
    """A piecewise polynomial `PeriodicOrbit` of every operating point.

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
    scheme: CollocationScheme = eqx.field(static=True)

    @classmethod
    def empty(cls, scheme: CollocationScheme, size: int, intervals: int, points: int) -> Orbit:
        """NumPy arrays to be filled in."""
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

    def states(self, theta: np.ndarray) -> Array:
        """States at the phases `theta`, a column: shape (size, phases, points)."""
        apart, _ = evaluate(self, theta * jnp.ones(self.centre.shape[1]))
        return self.centre[:, None] + apart

    def piece(self, start: int, stop: int) -> Orbit:
        """Its intervals from `start` to before `stop`."""
        return dataclasses.replace(
            self,
            mesh=self.mesh[start : stop + 1],
            nodes=self.nodes[:, start:stop],
            slopes=self.slopes[:, :, start:stop],
        )

    def moved(self, **parts: Array) -> Orbit:
        """The same with other arrays."""
        return dataclasses.replace(self, **parts)

    @property
    def widths(self) -> Array:
        """Interval widths, shape (intervals, points)."""
        return jnp.diff(self.mesh, axis=0)

    @property
    def stage_phases(self) -> Array:
        """Phases of the collocation points, shape (STAGES, intervals, points)."""
        return self.mesh[:-1] + jnp.asarray(self.scheme.c)[:, None, None] * self.widths

    def stage_sums(self, slopes: Array) -> Array:
        """a_jk slopes_k: increments of the states at the stages per unit width."""
        return jnp.einsum("jk,nkmb->njmb", self.scheme.a, slopes)

    @property
    def stage_deviations(self) -> Array:
        """States at the collocation points less `centre`, shape as `slopes`."""
        return self.nodes[:, None] + self.widths * self.stage_sums(self.slopes)


def graded_mesh(intervals: int, points: int, grading: float) -> Array:
    """Mesh theta = tau + g sin(tau), finest at the weakest contact theta = pi."""
    tau = jnp.linspace(0.0, 2 * jnp.pi, intervals + 1)[:, None]
    return (tau + grading * jnp.sin(tau)) * jnp.ones(points)


def evaluate(orbit: Orbit, theta: Array) -> tuple[Array, Array]:
    """States less `centre`, and slopes, at the phases `theta` of shape (count, points)."""
    intervals = orbit.mesh.shape[0] - 1

    def find(mesh: Array, at: Array) -> Array:
        return jnp.searchsorted(mesh, at, side="right") - 1

    index = jnp.clip(jax.vmap(find, (1, 1), 1)(orbit.mesh, theta), 0, intervals - 1)

    coefficients = jnp.einsum("kj,njmb->nkmb", orbit.scheme.monomials, orbit.slopes)
    size, degree = coefficients.shape[:2]
    # All in one gather: each is a program of its own to compile.
    numbers = jnp.concatenate(
        [
            orbit.mesh[None, :-1],
            orbit.widths[None],
            orbit.nodes,
            coefficients.reshape(-1, *orbit.widths.shape),
        ]
    )
    start, width, *picked = jnp.take_along_axis(numbers, index[None], 1)
    x = (theta - start) / width
    states, slopes = [], []
    for n, node in enumerate(picked[:size]):
        own = picked[size + n * degree : size + (n + 1) * degree]
        slopes.append(sum(c * x**k for k, c in enumerate(own)))
        rise = sum(c * x ** (k + 1) / (k + 1) for k, c in enumerate(own))
        states.append(node + width * rise)
    return jnp.stack(states), jnp.stack(slopes)


def on_mesh(orbit: Orbit, mesh: Array) -> Orbit:
    """The same orbit represented on another mesh."""
    bare = orbit.moved(mesh=mesh)
    phases = jnp.concatenate([mesh[None, :-1], bare.stage_phases])
    states, slopes = evaluate(orbit, phases.reshape(-1, phases.shape[-1]))
    count, size = len(mesh) - 1, states.shape[0]
    stages = slopes[:, count:].reshape(size, -1, count, phases.shape[-1])
    return bare.moved(nodes=states[:, :count], slopes=stages)


def split(orbit: Orbit, parts: int) -> Orbit:
    """Every interval cut into `parts` equal ones."""
    fraction = jnp.arange(parts)[:, None] / parts
    inner = orbit.mesh[:-1, None] + fraction * orbit.widths[:, None]
    inner = inner.reshape(-1, orbit.mesh.shape[1])
    return on_mesh(orbit, jnp.concatenate([inner, orbit.mesh[-1:]]))


def resampled(orbit: Orbit, intervals: int) -> Orbit:
    """The same on `intervals` intervals that lie as densely where its own do."""
    place = np.linspace(0.0, len(orbit.mesh) - 1, intervals + 1)
    left = np.minimum(place.astype(int), len(orbit.mesh) - 2)
    share = (place - left)[:, None]
    return on_mesh(orbit, (1 - share) * orbit.mesh[left] + share * orbit.mesh[left + 1])


def equidistributed(orbit: Orbit, scales: Array, intervals: int) -> Orbit:
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
    top = jnp.einsum("k,nkmb->nmb", orbit.scheme.top, orbit.slopes)
    local = (jnp.abs(top) * widths * scales).max(0)
    density = (local + 1e-14) ** (1 / (STAGES + 1)) / widths
    density = density / (density * widths).sum(0)
    density = (1 - _EVEN_SHARE) * density + _EVEN_SHARE / (2 * jnp.pi)
    for _ in range(2):  # neighbouring intervals may differ by a small factor only
        density = (jnp.roll(density, 1, 0) + 2 * density + jnp.roll(density, -1, 0)) / 4
    mass = jnp.cumsum(density * widths, axis=0)
    mass = jnp.concatenate([jnp.zeros_like(mass[:1]), mass]) / mass[-1]
    share = jnp.linspace(0.0, 1.0, intervals + 1)
    mesh = jax.vmap(lambda m, t: jnp.interp(share, m, t), (1, 1), 1)(mass, orbit.mesh)
    return on_mesh(orbit, mesh.at[0].set(0.0).at[-1].set(2 * jnp.pi))
