"""Smooth orbits of stiff equations: Fourier series, solved directly.

Under slow modulation the orbit is nearly a sequence of steady states. Its harmonics fall
exponentially, however fast perturbations of it grow or decay, so that a few dozen nodes, on which
both are far from resolved, give it to round-off. Collocation on a mesh that begins to resolve them
does worse: where sliding is unstable for part of the period, and a perturbation grows by e^40
there, the mesh inherits that sensitivity.

A series counts where one with more nodes, solved anew, agrees with it. It then solves equations
that differ by round-off from those asked for.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.solve.adiabatic import adiabatic_states, even_phases
from asperity.solve.batch import Indices, put, take
from asperity.solve.kernels import Problem
from asperity.solve.linear import jacobian_columns
from asperity.solve.mesh import Orbit
from asperity.solve.scheme import Scheme, scheme_for

Float = NDArray[np.float64]

#: Nodes of the series that are held against each other, one after the other; odd, so that every
#: harmonic has its sine.
NODES = (31, 47, 95, 191)
#: Intervals of the mesh that the series are handed on with: between its nodes polynomials follow
#: the highest harmonic worth having to round-off.
INTERVALS = 216

_CHUNK = 64
#: Newton's steps from sequences of steady states, and from the series on fewer nodes.
_FIRST_STEPS, _NEXT_STEPS = 14, 4
#: Largest change of an exponent in one step.
_LARGEST_CHANGE = 1.5
#: A Newton change below this was the last that mattered: the next one is its square.
_CONVERGED = 1e-9
#: Steps after which a point is given up whose last change was larger.
_PATIENCE, _FAR = 7, 0.5
#: Largest change of a state from one series to the next at which the latter is exact: errors fall
#: exponentially with the nodes.
_AGREED = 1e-10
#: The same, as expected of the longest series, from which it is worth a try.
_HOPEFUL = 1e-8


class Smooth(NamedTuple):
    """Orbits of some points.

    Attributes
    ----------
    orbit : Orbit
        On `INTERVALS` even intervals.
    found : bool array, shape (points,)
        Which of them are smooth enough.
    """

    orbit: Orbit
    found: NDArray[np.bool_]


def smooth_orbits(problem: Problem, points: int) -> Smooth:
    """Orbits of all points of `problem` (NumPy arrays)."""
    scheme, size = scheme_for(problem.system), problem.system.size
    result = Smooth(Orbit.empty(scheme, size, INTERVALS, points), np.zeros(points, bool))
    for start in range(0, points, _CHUNK):
        rows = np.arange(start, min(start + _CHUNK, points))
        # One shape, one compilation; but what fills up the last chunk is not solved.
        filled = np.concatenate([rows, np.full(_CHUNK - len(rows), rows[-1])])
        harmonics, found = _solve(take(problem, filled), len(rows))
        put(result, rows, Smooth(_on_even_mesh(harmonics, scheme), found))
    return result


def _solve(problem: Problem, points: int) -> tuple[NDArray[np.complex128], NDArray[np.bool_]]:
    """Harmonics (size, count, points) of the first `points`, and which of them are exact."""
    Y = np.array(adiabatic_states(problem, nodes=NODES[0]))
    at, exact = np.arange(points), np.zeros(points, bool)
    harmonics = np.zeros((len(Y), NODES[-1] // 2 + 1, points), complex)
    at = _newton(problem, Y, at, _FIRST_STEPS)
    error = _last_harmonics(Y)
    for before, nodes in pairwise(NODES):
        # Errors fall by equal factors for equal numbers of nodes.
        at = at[error[at] ** (NODES[-2] / before) < _HOPEFUL]
        guess = _resampled(Y, nodes)
        Y = guess.copy()
        at = _newton(problem, Y, at, _NEXT_STEPS)
        gap = np.abs(Y - guess).max((0, 1))
        error = gap ** (nodes / before)
        agreed = gap[at] < _AGREED
        kept, at = at[agreed], at[~agreed]
        exact[kept] = True
        harmonics[:, : nodes // 2 + 1, kept] = np.fft.rfft(Y[..., kept], axis=1) / nodes
        if not len(at):
            break
    return harmonics, exact


@jax.jit
def _linearised(problem: Problem, Y: Array) -> tuple[Array, Array, Array]:
    """Rates (size, nodes, points), their Jacobian (row, column, ...), and how slip feels Y."""
    system, load = problem
    at = load.at(even_phases(Y.shape[1]) * jnp.ones(Y.shape[2]))
    rates, columns = jacobian_columns(lambda y: system.rates(y, at), Y)
    _, felt = jacobian_columns(lambda y: system.log_slip(y, at)[None], Y)
    return rates, jnp.stack(columns, axis=1), jnp.concatenate(felt)


def _newton(problem: Problem, Y: Float, at: Indices, most_steps: int) -> Indices:
    """Improve the points `at` of the states in place; returns those that converged."""
    derivative = _derivative(Y.shape[1])
    logarithmic = [i for i in range(len(Y)) if i not in problem.system.linear]
    done = []
    for count in range(1, most_steps + 1):
        if not len(at):
            break
        rates, jacobian, felt = (np.asarray(a) for a in _linearised(problem, Y))
        finite = np.isfinite(rates).all((0, 1)) & np.isfinite(jacobian).all((0, 1, 2))
        at = at[finite[at]]
        jacobian, felt = jacobian[..., at], felt[..., at]
        gap = rates[..., at] - np.einsum("kl,nlb->nkb", derivative, Y[..., at])
        try:
            step = _solved(jacobian, derivative, gap)
        except np.linalg.LinAlgError:
            break
        exponents = np.concatenate([(felt * step).sum(0)[None], step[logarithmic]])
        change = np.abs(exponents).max((0, 1))
        usable = np.isfinite(change)
        at, step, change = at[usable], step[..., usable], change[usable]
        Y[..., at] += step * np.minimum(1.0, _LARGEST_CHANGE / np.maximum(change, 1e-300))
        done.append(at[change < _CONVERGED])
        at = at[(change >= _CONVERGED) & ((count < _PATIENCE) | (change < _FAR))]
    return np.sort(np.concatenate(done)) if done else at[:0]


def _solved(jacobian: Float, derivative: Float, gap: Float) -> Float:
    """Solve (d/dtheta - jacobian) step = gap, all nodes at once."""
    size, nodes, points = gap.shape
    matrix = np.zeros((points, size, nodes, size, nodes))
    here = np.arange(nodes)
    for i in range(size):
        matrix[:, i, :, i] = derivative
        for j in range(size):
            matrix[:, i, here, j, here] -= jacobian[i, j].T
    # Rates differ by many orders of magnitude.
    largest = np.abs(matrix).max((3, 4))
    matrix /= largest[..., None, None]
    right = np.moveaxis(gap, -1, 0) / largest
    rank = size * nodes
    flat = np.linalg.solve(matrix.reshape(points, rank, rank), right.reshape(points, rank, 1))
    return np.moveaxis(flat.reshape(points, size, nodes), 0, -1)


@cache
def _derivative(nodes: int) -> Float:
    """Derivative at the nodes of the trigonometric polynomial through them."""
    apart = np.arange(nodes)[:, None] - np.arange(nodes)
    sine = np.sin(np.pi * apart / nodes)
    return np.where(apart == 0, 0.0, 0.5 * (-1.0) ** apart / np.where(apart == 0, 1.0, sine))


def _last_harmonics(Y: Float) -> Float:
    """Size of the last harmonics, about the error of the series."""
    with np.errstate(invalid="ignore"):
        harmonics = np.abs(np.fft.rfft(Y, axis=1)) / Y.shape[1]
        return np.nan_to_num(harmonics[:, -3:].max((0, 1)), nan=1.0, posinf=1.0)


def _resampled(Y: Float, nodes: int) -> Float:
    """The same trigonometric polynomials at more nodes."""
    harmonics = np.fft.rfft(Y, axis=1) / Y.shape[1]
    return np.fft.irfft(harmonics * nodes, n=nodes, axis=1)


def _on_even_mesh(harmonics: NDArray[np.complex128], scheme: Scheme) -> Orbit:
    """Series as the piecewise polynomials that the other methods know."""
    mesh = np.linspace(0, 2 * np.pi, INTERVALS + 1)
    order = np.arange(1, harmonics.shape[1])
    weights = 2 * harmonics[:, 1:]
    # Less their value at theta = 0, which keeps small orbits exact.
    nodes = np.expm1(1j * order * mesh[:-1, None])
    stages = mesh[:-1] + np.asarray(scheme.c)[:, None] * np.diff(mesh)
    slopes = 1j * order * np.exp(1j * order * stages[..., None])
    return Orbit(
        np.broadcast_to(mesh[:, None], (INTERVALS + 1, harmonics.shape[2])),
        harmonics[:, 0].real + weights.sum(1).real,
        np.einsum("mk,nkb->nmb", nodes, weights).real,
        np.einsum("smk,nkb->nsmb", slopes, weights).real,
        scheme,
    )
