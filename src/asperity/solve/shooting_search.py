"""The search by shooting: Newton's method on few steps, and the same orbit on twice as many.

1. Newton's method from the averaged limit, on a coarse division of the period.
2. The orbit on finer divisions, each with twice the steps of the one before, until mean, harmonics
   and multipliers of two of them agree: the error of a method of order 8 falls by 2^8.

The determinant of the monodromy matrix is held against Liouville's formula, a quadrature that
knows nothing of the derivatives that were integrated. What does not settle is left to collocation.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.slider import Inertial
from asperity.solve.batch import Indices, run_chunks, take
from asperity.solve.floquet import from_logs, log_multipliers
from asperity.solve.found import Float, Found, Options, store
from asperity.solve.kernels import Problem, Reading
from asperity.solve.outcome import Outcome
from asperity.solve.shooting import (
    Pass,
    Steps,
    chord_step,
    newton_pass,
    period_steps,
    shot_waveform,
)
from asperity.solve.shooting_start import averaged_start


class _Ladder(NamedTuple):
    """Divisions of the period for points whose relaxation by slip is not too fast for them."""

    fastest: float  # per radian
    coarse: int  # steps that Newton's method starts on
    divisions: tuple[int, ...]  # steps that the orbit is then taken to
    grading: float  # of the steps towards the pulse of slip


_LADDERS = (
    _Ladder(2.0, 16, (24, 48, 96), 0.0),
    _Ladder(5.0, 16, (28, 56, 112), 0.2),
    _Ladder(40.0, 24, (40, 80, 160), 0.3),
)

#: Points in a call, where there are many and where few are left; no powers of two, at which
#: arrays share cache lines.
_CHUNK, _FEW = 240, 24
#: Points whose orbits are kept in memory at a time.
_BLOCK = 100 * _CHUNK

#: Newton steps on the coarse division, the largest change of an exponent in one, and the change
#: below which its square is small enough to go on.
_NEWTON_STEPS, _LARGEST_CHANGE, _NEAR = 12, 3.0, 2e-2
#: Chord steps on a finer division, which shrink a change by a hundred and more, and the change
#: below which there need be no further one.
_CHORDS, _NEARLY_CLOSED = 4, 1e-5
#: Change that Newton's step may still ask for: where two divisions are compared, and on the finer.
_CLOSED, _ACCEPTED = 1e-6, 1e-9
#: Agreement of two divisions, relative; the finer one is then good to 2e-6 / 2^8.
_AGREEMENT = 2e-6
#: Agreement of the determinant with Liouville's formula, a check of the finer division alone.
_LIOUVILLE = 1e-8

#: Multipliers smaller than this, or than this share of the largest, are compared absolutely.
_VANISHING, _DROWNED = 1e-6, 1e-7


def is_shootable(problem: Problem) -> bool:
    """Whether shooting knows these equations: elastic asperities take the stiffness away."""
    return isinstance(problem.system, Inertial)


def shooting_stages(problem: Problem, found: Found, index: Indices, options: Options) -> Indices:
    """Solve what shooting can of the points `index`; returns the points that it leaves."""
    for start in range(0, len(index), _BLOCK):
        _solve_block(problem, found, index[start : start + _BLOCK], options)
    return index[found.outcome[index] != Outcome.CONVERGED]


def _solve_block(problem: Problem, found: Found, block: Indices, options: Options) -> None:
    part, rows = take(problem, block), np.arange(len(block))
    start, pace = np.empty((problem.system.size, len(block))), np.empty(len(block))
    for some, (states, relaxation) in run_chunks(averaged_start, part, rows, _chunk(rows)):
        start[:, some], pace[some] = states, relaxation
    # Points of like difficulty belong together.
    rows = np.argsort(pace, kind="stable")
    for ladder in _LADDERS:
        chosen = rows[pace[rows] <= ladder.fastest]
        if len(chosen):
            climb = _Climb(part, found, block, options, ladder, start.copy())
            climb.run(chosen)
        rows = rows[found.outcome[block[rows]] != Outcome.CONVERGED]


class _Climb:
    """One ladder for the points of a block; arrays have the points along the last axis."""

    def __init__(
        self,
        problem: Problem,
        found: Found,
        block: Indices,
        options: Options,
        ladder: _Ladder,
        start: Float,
    ) -> None:
        size, points = start.shape
        self.problem, self.found, self.block = problem, found, block
        self.options, self.ladder = options, ladder
        self.start = start
        self.inverse = np.zeros((size, size, points))  # of 1 less the monodromy matrix
        # Of the division before, NaN where it did not close the orbit.
        self.mean_friction = np.full(points, np.nan)
        self.harmonics = np.zeros((options.harmonics, points), dtype=complex)
        self.polynomial = np.zeros((size + 1, points))

    def run(self, rows: Indices) -> None:
        """Take the orbits of `rows` from the coarse division to the first two that agree."""
        rows = self._near_orbits(rows)
        for count in self.ladder.divisions:
            rows, unsettled = self._closed(rows, count), []
            for some, reached in self._passes(rows, count):
                settled = self._settle(some, reached, count)
                good = ~settled & np.isfinite(reached.step).all(0)
                self.start[:, some[good]] += reached.step[:, good]
                unsettled.append(some[good])
            rows = _joined(unsettled)

    def _steps(self, count: int) -> Steps:
        return period_steps(count, self.ladder.grading, self.options.harmonics)

    def _passes(self, rows: Indices, count: int) -> Iterator[tuple[Indices, Pass]]:
        """Passes over `rows` on `count` steps; the inverse is kept for chord steps."""
        solve = partial(newton_pass, steps=self._steps(count))
        for some, reached in run_chunks(solve, (self.problem, self.start), rows, _chunk(rows)):
            self.inverse[..., some] = reached.inverse
            yield some, reached

    def _near_orbits(self, rows: Indices) -> Indices:
        """Newton's method on the coarse division; returns the rows that it brings near an orbit."""
        near = []
        for _ in range(_NEWTON_STEPS):
            far = []
            for some, reached in self._passes(rows, self.ladder.coarse):
                leap = reached.leap
                good = np.isfinite(leap) & np.isfinite(reached.step).all(0)
                damping = np.minimum(1.0, _LARGEST_CHANGE / np.maximum(leap[good], 1e-300))
                self.start[:, some[good]] += damping * reached.step[:, good]
                near.append(some[good & (leap < _NEAR)])
                far.append(some[good & (leap >= _NEAR)])
            rows = _joined(far)
        return _joined(near)

    def _closed(self, rows: Indices, count: int) -> Indices:
        """Chord steps on a finer division; returns the rows whose orbits they close."""
        solve, closed = partial(chord_step, steps=self._steps(count)), []
        for _ in range(_CHORDS):
            far = []
            inputs = (self.problem, self.start, self.inverse)
            for some, (start, change) in run_chunks(solve, inputs, rows, _chunk(rows)):
                good = np.isfinite(change)
                self.start[:, some[good]] = start[:, good]
                closed.append(some[change < _NEARLY_CLOSED])
                far.append(some[good & (change >= _NEARLY_CLOSED)])
            rows = _joined(far)
        return _joined(closed)

    def _settle(self, some: Indices, reached: Pass, count: int) -> NDArray[np.bool_]:
        """Hold a pass against the division before and write what settles; returns which do."""
        gap = _gap(self.mean_friction[some], self.harmonics[:, some], reached)
        settled = (reached.change <= _ACCEPTED) & (gap <= _AGREEMENT)
        settled &= _liouville_gap(reached) <= _LIOUVILLE
        agreed = np.flatnonzero(settled)
        kept = take(reached, agreed)
        logs = log_multipliers(kept.monodromy, np.zeros(len(agreed)), kept.log_determinant)
        before = self.polynomial[:, some[agreed]]
        multiplier_gap = _multiplier_gap(before, kept.polynomial, from_logs(logs))
        settled[agreed] = multiplier_gap <= _AGREEMENT
        closed = reached.change <= _CLOSED
        self.mean_friction[some] = np.where(closed, reached.mean_friction, np.nan)
        self.harmonics[:, some] = reached.harmonics
        self.polynomial[:, some] = reached.polynomial
        if settled.any():
            logs = logs[:, settled[agreed]]
            self._store(some[settled], take(reached, settled), logs, count)
        return settled

    def _store(
        self, rows: Indices, reached: Pass, logs: NDArray[np.complex128], count: int
    ) -> None:
        start, zero = self.start[:, rows], np.zeros(len(rows))
        reading = Reading(
            reached.mean_friction,
            reached.harmonics,
            reached.monodromy,
            zero,
            reached.log_determinant,
            zero,
            start,
            self._waveform(rows, count),
        )
        store(self.found, self.block[rows], reading, logs)
        self.found.iterations[self.block[rows]] = count
        self.options.progress(len(rows))

    def _waveform(self, rows: Indices, count: int) -> Float:
        phases = self.options.phases
        waveform = np.zeros((2, phases, self.start.shape[1]))
        if phases:
            solve = partial(
                shot_waveform,
                steps=self._steps(count),
                count=count,
                grading=self.ladder.grading,
                phases=phases,
            )
            for some, samples in run_chunks(solve, (self.problem, self.start), rows, _chunk(rows)):
                waveform[..., some] = samples
        return waveform[..., rows]


def _chunk(rows: Indices) -> int:
    return _CHUNK if len(rows) > 3 * _FEW else _FEW


def _joined(parts: list[Indices]) -> Indices:
    """Rows in order, so that points of like difficulty stay together."""
    return np.sort(np.concatenate([np.empty(0, dtype=int), *parts]))


def _gap(mean_friction: Float, harmonics: NDArray[np.complex128], reached: Pass) -> Float:
    """Relative change of mean and harmonics; inf where there is nothing to compare with."""
    with np.errstate(all="ignore"):
        mean = np.abs(mean_friction / reached.mean_friction - 1)
        scale = np.abs(reached.harmonics)
        # Beyond the second they count beside the first.
        scale[2:] = scale[0]
        gap = np.maximum(mean, (np.abs(harmonics - reached.harmonics) / scale).max(0))
    return np.where(np.isfinite(gap), gap, np.inf)


def _liouville_gap(reached: Pass) -> Float:
    """Relative difference of the determinant from that by Liouville's formula."""
    determinant = (-1) ** len(reached.monodromy) * reached.polynomial[-1]
    with np.errstate(all="ignore"):
        gap = np.abs(determinant * np.exp(-reached.log_determinant) - 1)
    return np.where(np.isfinite(gap), gap, np.inf)


def _multiplier_gap(before: Float, now: Float, multipliers: NDArray[np.complex128]) -> Float:
    """Relative change of the multipliers, from that of the characteristic polynomial.

    To first order a root m moves by the change of the polynomial at m over its slope there.
    """
    with np.errstate(all="ignore"):
        change = np.zeros_like(multipliers)
        for coefficient in now - before:
            change = change * multipliers + coefficient
        apart = multipliers[:, None] - multipliers[None]
        apart[np.diag_indices(len(multipliers))] = 1.0
        size = np.abs(multipliers)
        floor = np.maximum(_VANISHING, _DROWNED * size.max(0))
        gap = np.abs(change / apart.prod(1)) / np.maximum(size, floor)
        gap = gap.max(0)
    return np.where(np.isfinite(gap), gap, np.inf)
