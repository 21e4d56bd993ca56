"""Operating points of a plan at which the slider slides steadily, and why the others are left out.

A reading needs a periodic response that is found and stable: an unstable one drifts into stick-slip
and is never measured.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from asperity.inference.design.plan import DesignPlan, Hypothesis
from asperity.inference.tables.term import on_contacts
from asperity.orbit import Outcome, periodic_response, response_function
from asperity.parameters.parameter import RULES
from asperity.slider.named import slider_from

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]
Progress = Callable[[int, int, str], None]

#: Points per call of the slow search: between two calls progress is reported.
_BLOCK = 32
#: Why a point is no candidate although its response was found.
UNSTABLE = "its periodic response is unstable: stick-slip"
_CUT = (":", ";", " epsilon = ")


@dataclass(frozen=True, eq=False)
class Candidates:
    """Operating points that a design may use.

    Attributes
    ----------
    points : mapping of str to array, shape (n,)
        V, epsilon (as applied), frequency, and other axes of the plan, in SI.
    index : int array, shape (n,)
        Number of each among all combinations of the plan.
    slow : bool array, shape (n,)
        Points that the fast method does not solve.
    total : int
        Number of combinations.
    left_out : mapping of str to int
        Reasons, each with its number of combinations.
    draws : tuple of mapping of str to float
        Values of the free parameters over which the design is averaged; the expected ones alone
        if there are no draws.
    usable : bool array, shape (draws, n)
        Whether each point slides steadily with the values of each draw.
    """

    points: Mapping[str, Float]
    index: NDArray[np.intp]
    slow: Bool
    total: int
    left_out: Mapping[str, int]
    draws: tuple[Mapping[str, float], ...]
    usable: Bool

    @property
    def size(self) -> int:
        """Number of candidates."""
        return self.index.size


def candidates_of(plan: DesignPlan, progress: Progress) -> Candidates:
    """Solve all combinations of a plan and keep those that slide steadily.

    Parameters
    ----------
    plan : DesignPlan
    progress : callable
        Called with points solved, points in all, and what they are.
    """
    points = plan.candidates()
    rows = len(points["V"])
    reasons, slow = _reasons(plan, plan.truth, points, plan.truth.values, progress)
    for i in np.flatnonzero(points["epsilon"] == 0):
        # Without modulation there are no harmonics; the mean says mu_ss(V) all the same.
        reasons[i] = reasons[i] or ("" if _only_mean(plan) else "its load is not modulated")
    kept = np.array([not r for r in reasons])
    left_out = Counter(r for r in reasons if r)
    draws = drawn_values(plan)
    usable = np.ones((max(len(draws), 1), rows), bool)
    where = np.flatnonzero(kept)
    for k, values in enumerate(draws):
        label = f"draw {k + 1} of {len(draws)}"
        some = {n: v[where] for n, v in points.items()}
        result, also_slow = _reasons(
            plan, plan.truth, some, values, partial(_relabelled, progress, label)
        )
        usable[k, where] = [not r for r in result]
        slow[where] |= also_slow
    risky = kept & (usable.mean(0) < plan.usable_share)
    if risky.any():
        reason = f"unusable in more than {1 - plan.usable_share:.0%} of the draws"
        left_out[reason] = int(risky.sum())
        kept &= ~risky
    index = np.flatnonzero(kept)
    return Candidates(
        {n: v[index] for n, v in points.items()},
        index,
        slow[index],
        rows,
        dict(left_out.most_common()),
        draws or (plan.truth.values,),
        usable[:, index],
    )


def _relabelled(progress: Progress, label: str, done: int, total: int, _: str) -> None:
    progress(done, total, label)


def _only_mean(plan: DesignPlan) -> bool:
    return all(n in ("mean_friction", "delta_mu") for n in plan.noise)


def drawn_values(plan: DesignPlan) -> tuple[dict[str, float], ...]:
    """Values of the free parameters, normal about the expected ones, by a Sobol sequence.

    Values that break the rule of their parameter are replaced by the next of the sequence.
    """
    names = [n for n in plan.truth.names if n in plan.uncertainty]
    if not plan.draws:
        return ()
    rules = {u.name: RULES[u.parameter.rule] for u in plan.truth.unknowns}
    # Slow to load, and wanted only here.
    from scipy.stats.qmc import Sobol

    sequence = Sobol(len(names), seed=plan.seed)
    result: list[dict[str, float]] = []
    while len(result) < plan.draws:
        for row in ndtri(sequence.random(max(8, 1 << (plan.draws - 1).bit_length()))):
            drawn = {
                n: plan.truth.values[n] + plan.uncertainty[n] * float(z)
                for n, z in zip(names, row, strict=True)
            }
            if all(bool(rules[n].holds(x)) for n, x in drawn.items()):
                result.append({**plan.truth.values, **drawn})
    return tuple(result[: plan.draws])


def _reasons(
    plan: DesignPlan,
    hypothesis: Hypothesis,
    points: Mapping[str, Float],
    values: Mapping[str, float],
    progress: Progress,
) -> tuple[list[str], Bool]:
    """Why each point has no stable response, empty if it has one; and which need the search."""
    given = on_contacts({**hypothesis.fixed, **points, **values})
    rows = len(points["V"])
    reasons = [""] * rows
    inertial = plan.inertia or plan.radiation_damping
    slow = np.ones(rows, bool)
    beyond = np.broadcast_to(given["epsilon"], (rows,)) >= 1
    for i in np.flatnonzero(beyond):
        reasons[i] = "contact would be lost"
    given["epsilon"] = np.where(beyond, 0.5, given["epsilon"])
    if not inertial:
        quick = response_function(hypothesis.law, multipliers=True, search=False)
        result = quick({n: given[n] for n in quick.parameters})
        slow = np.asarray(result.outcome) != Outcome.CONVERGED
        growing = np.asarray(result.log_multipliers).real.max(-1) >= 0
        for i in np.flatnonzero(~slow & growing & ~beyond):
            reasons[i] = UNSTABLE
    left = np.flatnonzero(slow & ~beyond)
    progress(rows - left.size, rows, "points")
    for start in range(0, left.size, _BLOCK):
        block = left[start : start + _BLOCK]
        some = {n: v[block] if np.ndim(v) else v for n, v in given.items()}
        response = periodic_response(
            slider_from(hypothesis.law, some),
            velocity=some["V"],
            epsilon=some["epsilon"],
            frequency=some["frequency"],
            inertia=plan.inertia,
            radiation_damping=some["eta"] if plan.radiation_damping else None,
            harmonics=2,
        )
        converged, stable = (
            np.broadcast_to(a, block.shape) for a in (response.converged, response.stable)
        )
        texts = np.broadcast_to(response.result, block.shape)
        for i, ok, steady, text in zip(block, converged, stable, texts, strict=True):
            reasons[i] = _short(str(text)) if not ok else "" if steady else UNSTABLE
        progress(rows - left.size + min(start + _BLOCK, left.size), rows, "points")
    return reasons, slow


def _short(reason: str) -> str:
    """A reason without the numbers of its point, so that like ones are counted together."""
    for mark in _CUT:
        reason = reason.partition(mark)[0]
    return "no response was found: " + reason.removesuffix(" at").removesuffix(" before")


def without_rows(result: Candidates, keep: Bool, reason: str) -> Candidates:
    """The candidates without some of them, which are counted under a reason."""
    if keep.all():
        return result
    return replace(
        result,
        points={n: v[keep] for n, v in result.points.items()},
        index=result.index[keep],
        slow=result.slow[keep],
        usable=result.usable[:, keep],
        left_out={**result.left_out, reason: int((~keep).sum())},
    )
