"""Orbits of stiff equations, and under weak modulation: Fourier series, solved directly.

Under slow modulation the orbit is nearly a sequence of steady states. Its harmonics fall
exponentially, independent of the growth and decay of perturbations. A few dozen nodes, which do not
resolve perturbations, therefore give the orbit to round-off. A mesh that begins to resolve the
perturbations is less accurate: where sliding is unstable for part of the period, and a perturbation
grows by e^40, the solution on the mesh is as sensitive.

Under weak modulation, of any period, the response is nearly linear and its harmonics fall as powers
of the amplitude: near a resonance, where the fast method does not contract, a series takes a
fraction of the time of a mesh.

A series is accepted if the solution of a series with more nodes agrees with it.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np

from asperity.algebra.runge_kutta import CollocationScheme
from asperity.arrays import Bool, Complex, Float, Index
from asperity.orbit.batches import FEW, mesh_chunk, put, run_chunks, take
from asperity.orbit.mesh.mesh import Orbit, scheme_for
from asperity.orbit.methods.collocation import accept
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.orbit.steady_sliding import steady_sliding, unmodulated
from asperity.slider.pointwise import excitation_at, values_at
from asperity.slider.problem import Problem
from asperity.theory.limits import adiabatic_growth, adiabatic_states, even_phases

#: Numbers of nodes of successive series, which are compared with each other; odd, so that every
#: harmonic has its sine.
NODES = (31, 47, 95, 191)
#: Intervals of the mesh on which the series are represented: on each a polynomial follows the
#: highest relevant harmonic to round-off.
INTERVALS = 216

#: Rate per radian of a disturbance of steady sliding from which modulation counts as slow.
_SLOW = 1.0
#: Range of the slip exponent's half swing in which modulation counts as weak.
_WEAK = (1e-3, 0.5)
#: Smallest first and second harmonic of F/W0 under weak modulation. A series stores complete
#: states, with a round-off of some 3e-16, more than 1e-10 of smaller harmonics; a mesh stores
#: deviations from the mean.
_LEAST_HARMONIC = 3e-6
#: Newton's steps from sequences of steady states, and from the series on fewer nodes.
_FIRST_STEPS, _NEXT_STEPS = 14, 4
#: Largest change of an exponent in one step.
_LARGEST_CHANGE = 1.5
#: Newton change after which the method ends: the next change is about its square.
_CONVERGED = 1e-9
#: Number of steps after which a point with a large last change is abandoned.
_PATIENCE, _FAR = 7, 0.5
#: Largest change of a state from one series to the next at which the second series is exact:
#: errors fall exponentially with the number of nodes.
_AGREED = 1e-10
#: Largest share of round-off in the first harmonic: the accuracy of mu1 that is promised.
_DIGITS = 1e-8
#: Limit of the extrapolated error of the longest series, below which that series is tried.
_HOPEFUL = 1e-8


class FourierSeries(Method):
    """Fourier series solved directly, for slow or weak modulation."""

    name = "series"
    choice = "series"

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; only points under slow or weak modulation are tried."""
        solution = Solution.unsolved(problem, options)
        rate, sharpness, _ = steady_sliding(problem)
        slow, weak = rate >= _SLOW, (sharpness >= _WEAK[0]) & (sharpness <= _WEAK[1])
        smooth = np.flatnonzero(slow | weak)
        orbit, rows = series_orbits(problem, smooth)
        if len(rows):
            part = take(problem, rows)
            attempt = Solution.unsolved(part, options)
            accept(part, attempt, take(orbit, rows), options)
            exact = slow[rows] | (np.abs(attempt.harmonics[:2]) > _LEAST_HARMONIC).all(0)
            options.progress(int(attempt.converged[exact].sum()))
            solution.merge(rows[exact], take(attempt, np.flatnonzero(exact)))
        return solution


def follows_steady_sliding(problem: Problem, index: Index) -> Index:
    """The points of `index` at which a slider follows a modulation slower than its relaxation.

    Steady sliding is stable at all phases there. At other points the slider may leave the orbit of
    a series for slip events, and only a transient shows which orbit it reaches.
    """
    slow = index[steady_sliding(take(problem, index))[0] >= _SLOW] if len(index) else index
    growths = run_chunks(adiabatic_growth, (problem,), slow, FEW)
    return np.concatenate([slow[:0], *(part[growth == 0] for part, growth in growths)])


def series_orbits(
    problem: Problem,
    index: Index,
    intervals: int = INTERVALS,
    numbers: tuple[int, ...] = NODES,
) -> tuple[Orbit, Index]:
    """Orbits of the points `index` of a problem (NumPy arrays) on even intervals.

    Also returned are the points that a series of one of the `numbers` of nodes resolves. At other
    points the orbit is the last series, an initial guess.
    """
    system, resolved = problem.system, [index[:0]]
    scheme = scheme_for(system)
    orbit = Orbit.empty(scheme, system.size, intervals, len(system.V))

    def solve(part: Problem) -> tuple[Orbit, Bool]:
        harmonics, exact = _solve(part, numbers)
        return _on_even_mesh(harmonics, scheme, intervals), exact

    for rows, (some, exact) in run_chunks(solve, (problem,), index, mesh_chunk(system.size)):
        put(orbit, rows, some)
        resolved.append(rows[exact])
    return orbit, np.concatenate(resolved)


def _solve(problem: Problem, numbers: tuple[int, ...]) -> tuple[Complex, Bool]:
    """Harmonics (size, count, points), and which points are exact."""
    Y = np.array(adiabatic_states(problem, nodes=numbers[0]))
    points = Y.shape[2]
    at, exact = np.arange(points), np.zeros(points, bool)
    harmonics = np.zeros((len(Y), numbers[-1] // 2 + 1, points), complex)
    at = _newton(problem, Y, at, _FIRST_STEPS)
    error = _last_harmonics(Y)
    for before, nodes in pairwise(numbers):
        # Errors fall by equal factors for equal numbers of nodes.
        at = at[error[at] ** (NODES[-2] / before) < _HOPEFUL]
        guess = _resampled(Y, nodes)
        Y = guess.copy()
        at = _newton(problem, Y, at, _NEXT_STEPS)
        gap = np.abs(Y - guess).max((0, 1))
        error = gap ** (nodes / before)
        harmonics[:, : nodes // 2 + 1, ~exact] = np.fft.rfft(Y[..., ~exact], axis=1) / nodes
        agreed = gap[at] < _AGREED
        ended, at = at[agreed], at[~agreed]
        exact[ended] = _above_round_off(problem, Y, ended)
        if not len(at):
            break
    return harmonics, exact


def _above_round_off(problem: Problem, Y: Float, at: Index) -> Bool:
    """Whether round-off changes the first harmonic of the first state by less than `_DIGITS`.

    A Newton step from the solution, resampled to other nodes, has the size of round-off. Heavy
    sliders may move less than round-off. Without modulation there is no harmonic to resolve.
    """
    again = _resampled(Y, Y.shape[1] + 2)
    _newton(problem, again, at, 1)
    before, now = (np.fft.rfft(y[0][:, at], axis=0, norm="forward")[1] for y in (Y, again))
    steady = unmodulated(problem.load, Y.shape[2])
    return np.asarray((np.abs(now - before) <= _DIGITS * np.abs(before)) | steady[at])


def _newton(problem: Problem, Y: Float, at: Index, most_steps: int) -> Index:
    """Improve the points `at` of the states in place; returns those that converged."""
    derivative = _derivative(Y.shape[1])
    system = problem.system
    excitation = excitation_at(problem.load, even_phases(Y.shape[1]) * np.ones(Y.shape[2]))
    done = []
    for count in range(1, most_steps + 1):
        if not len(at):
            break
        values = values_at(system, excitation, np.zeros_like(Y[:, 0]), Y)
        rates, jacobian = values.rates, values.jacobian
        finite = np.isfinite(rates).all((0, 1)) & np.isfinite(jacobian).all((0, 1, 2))
        at = at[np.asarray(finite)[at]]
        gap = rates[..., at] - np.einsum("kl,nlb->nkb", derivative, Y[..., at], optimize=True)
        try:
            step = _solved(jacobian[..., at], derivative, gap)
        except np.linalg.LinAlgError:
            break
        with np.errstate(all="ignore"):
            exponent = (values.slip_gradient[..., at] * step).sum(0)
            change = np.abs([exponent, *step[system.logarithms]]).max((0, 1))
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
    difference = np.arange(nodes)[:, None] - np.arange(nodes)
    sine = np.sin(np.pi * difference / nodes)
    return np.where(
        difference == 0, 0.0, 0.5 * (-1.0) ** difference / np.where(difference == 0, 1.0, sine)
    )


def _last_harmonics(Y: Float) -> Float:
    """Size of the last harmonics, an estimate of the error of the series."""
    with np.errstate(invalid="ignore"):
        harmonics = np.abs(np.fft.rfft(Y, axis=1)) / Y.shape[1]
        return np.nan_to_num(harmonics[:, -3:].max((0, 1)), nan=1.0, posinf=1.0)


def _resampled(Y: Float, nodes: int) -> Float:
    """The same trigonometric polynomials at more nodes."""
    harmonics = np.fft.rfft(Y, axis=1) / Y.shape[1]
    return np.fft.irfft(harmonics * nodes, n=nodes, axis=1)


def _on_even_mesh(harmonics: Complex, scheme: CollocationScheme, intervals: int) -> Orbit:
    """Series as the piecewise polynomials of collocation."""
    mesh = np.linspace(0, 2 * np.pi, intervals + 1)
    order = np.arange(1, harmonics.shape[1])
    weights = 2 * harmonics[:, 1:]
    # Less their value at theta = 0, which keeps small orbits exact.
    nodes = np.expm1(1j * order * mesh[:-1, None])
    stages = mesh[:-1] + np.asarray(scheme.c)[:, None] * np.diff(mesh)
    slopes = 1j * order * np.exp(1j * order * stages[..., None])
    return Orbit(
        np.broadcast_to(mesh[:, None], (intervals + 1, harmonics.shape[2])),
        harmonics[:, 0].real + weights.sum(1).real,
        np.einsum("mk,nkb->nmb", nodes, weights, optimize=True).real,
        np.einsum("smk,nkb->nsmb", slopes, weights, optimize=True).real,
        scheme,
    )
