"""A design checked by simulation: synthetic readings are fitted, and the estimates' spread counted.

Nothing is linear here but the start: each set of readings has noise of its own and is fitted by
least squares with periodic responses of the law.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from asperity.inference.comparison.scale import EXCLUDED
from asperity.inference.design.plan import Hypothesis
from asperity.inference.design.predictions import PointModel, refit, repeated
from asperity.inference.tables.table import OBSERVABLES, LockInTable
from asperity.inference.unknowns import Prior

Float = NDArray[np.float64]

#: Sets that are fitted together.
_BLOCK = 50


@dataclass(frozen=True)
class Simulated:
    """What came of fits to synthetic readings.

    Attributes
    ----------
    sets : int
        Fits that converged.
    failed : int
    spread : mapping of str to float
        Standard deviation of the estimates in SI: half the width that holds 68 % of them.
    uncertainty : mapping of str to float
        Standard error of that spread, by bootstrap.
    decided : float or None
        Share of the sets that exclude the rival.
    """

    sets: int
    failed: int
    spread: Mapping[str, float]
    uncertainty: Mapping[str, float]
    decided: float | None = None


def simulated(
    model: PointModel,
    expected: LockInTable,
    readings: Float,
    sets: int,
    seed: int,
    progress: Callable[[int, int, str], None],
    rival: tuple[PointModel, Mapping[str, float]] | None = None,
) -> Simulated:
    """Fit synthetic readings at the points of a design.

    Parameters
    ----------
    model : PointModel
        Of the true law at these points.
    expected : LockInTable
        Readings without noise there.
    readings : array, shape (points,)
        Number of readings of each point; they enter as their mean.
    sets : int
    seed : int
    progress : callable
    rival : (PointModel, mapping), optional
        Of a rival law, and the parameters at which it comes nearest to the expected readings.
    """
    hypothesis = centred(model.hypothesis)
    model = PointModel(model.plan, hypothesis, model.points, model.slow)
    noise = np.random.default_rng(seed)
    estimates, behind, failed = [], [], 0
    p, q = len(hypothesis.unknowns), sum(u.prior is not None for u in hypothesis.unknowns)
    for first in range(0, sets, _BLOCK):
        count = min(_BLOCK, sets - first)
        exact, many = repeated(expected, count), np.tile(readings, count)
        normal = noise.normal(size=(exact.rows, len(OBSERVABLES))) / np.sqrt(many)[:, None]
        data = exact.disturbed(exact.values, normal)
        result = refit(
            model,
            data,
            readings,
            np.tile(hypothesis.coordinates, (count, 1)),
            prior_noise=noise.normal(size=(count, q)),
            progress=partial(_sets_done, progress, first, sets),
        )
        good = result.converged
        if rival is not None:
            other, values = rival
            start = [float(u.to_coordinate(values[u.name])) for u in other.hypothesis.unknowns]
            theirs = refit(other, data, readings, np.tile(start, (count, 1)))
            good = good & theirs.converged
            n = float(readings.sum()) * len(expected.values)
            k = len(other.hypothesis.unknowns)
            penalty = _penalty(k, n) - _penalty(p, n)
            behind += list((theirs.chi2 - result.chi2 + penalty)[good])
        failed += int((~good).sum())
        estimates.append(result.coordinates[good])
        progress(first + count, sets, "synthetic sets")
    u = np.concatenate(estimates)
    spread, uncertainty = {}, {}
    for i, unknown in enumerate(hypothesis.unknowns):
        sample = np.asarray(unknown.to_value(u[:, i]))
        spread[unknown.name], uncertainty[unknown.name] = _spread(sample, noise)
    decided = None
    if rival is not None and behind:
        decided = float((np.array(behind) >= EXCLUDED).mean())
    return Simulated(len(u), failed, spread, uncertainty, decided)


def _sets_done(
    progress: Callable[[int, int, str], None], first: int, sets: int, done: int, _: int
) -> None:
    progress(first + done, sets, "synthetic sets")


def _penalty(k: int, n: float) -> float:
    return 2 * k + (2 * k * (k + 1) / (n - k - 1) if n > k + 1 else np.inf)


def _spread(x: Float, noise: np.random.Generator) -> tuple[float, float]:
    """Half the width of the central 68 %, which outliers do not inflate, and its standard error."""
    if x.size < 3:
        return float("nan"), float("nan")

    def half(sample: Float) -> Float:
        low, high = np.quantile(sample, [0.158655, 0.841345], axis=-1)
        return np.asarray((high - low) / 2)

    copies = noise.choice(x, size=(200, x.size))
    return float(half(x)), float(half(copies).std())


def centred(hypothesis: Hypothesis) -> Hypothesis:
    """The hypothesis with priors whose means are the expected values."""

    def at_value(prior: Prior | None, value: float) -> Prior | None:
        return None if prior is None else replace(prior, mean=value)

    unknowns = tuple(
        replace(u, prior=at_value(u.prior, hypothesis.values[u.name])) for u in hypothesis.unknowns
    )
    return replace(hypothesis, unknowns=unknowns)
