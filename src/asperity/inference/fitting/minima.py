"""Search for the minima of an objective: screen a quasi-random draw, follow the best, compare.

The starts are a Latin hypercube over the ranges of the unknowns. The best of them are followed by
least squares. Where orbits are searched for, which takes milliseconds a row, both are done with few
rows of the table on a coarse mesh, and what is as good as the best goes on with all rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter

import numpy as np
from scipy.special import chdtrc

from asperity.arrays import Float
from asperity.inference.objective import Minimum, Objective
from asperity.laws import Law
from asperity.parameters import law_parameters
from asperity.parameters.arguments import counted

#: What minima are ordered by.
_CHI2 = attrgetter("chi2")
#: Drawn starts that are minimised in addition to the given one.
_FOLLOWED = 3
#: Minima nearer than this in every coordinate are one, and those of the coarse objective.
_SAME, _SAME_COARSE = 1e-3, 0.02
#: Share of starts below which orbits are searched for at once: the fast method does not reach a
#: modulation slower than sliding over the memory length, and would see only wrong minima; starts
#: that are evaluated then.
_RARE, _WITH_SEARCH = 1 / 16, 32
#: Rows on which starts are compared.
_SCREENED_ROWS = 8
#: Rows of the coarse objective, which are one chunk of the search for orbits, and data for each
#: free parameter that they hold at least.
_ROWS, _DATA_EACH = 24, 3
#: Relative change of the coordinates that ends the way to a minimum of the coarse objective, or of
#: a law that is far off; its evaluations, and those after which the best ways are chosen.
_NEARBY, _EVALUATIONS, _FIRST_EVALUATIONS = 1e-3, 60, 12
#: Probability of chi-squared below which a law is far off: its exact minimum and intervals change
#: no verdict.
FAR_OFF = 1e-12
#: Probability of chi-squared below which a fit among searched orbits is doubtful.
DOUBTFUL = 0.05
#: Decrease of chi-squared that is worth the slower method: a tenth of a standard error, or this
#: share of the chi-squared of a law that is far off.
GAIN, _LARGE_GAIN = 0.01, 0.1
#: Minima within this of the lowest chi-squared are followed to their end.
_WORTH = 50.0
#: Factors of a memory length at which other minima are looked for, the factor between two lengths
#: below which they are one minimum, and how many times the limit of chi-squared is hopeless there.
_OTHER_LENGTHS, _SAME_LENGTH, _HOPELESS = (0.1, 1 / 3, 3.0, 10.0), 1.5, 1e2
#: Parameters that laws extend others by: without them they are another law.
_EXTENSIONS = ("lambda", "alpha", "c", "B2", "D2")
#: Their coordinate there.
_NEARLY_ZERO = 1e-4


def minima_of(
    objective: Objective,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    *,
    drawn: int = 64,
    simpler: Sequence[Mapping[str, float]] = (),
) -> list[Minimum]:
    """Minima from the given start and from the best of many drawn ones, best first.

    Parameters
    ----------
    objective : Objective
    seed : int
        Of the drawn starts.
    progress : callable, optional
        Called with the number of starts that were followed, and of all to be followed.
    drawn : int
    simpler : sequence of mapping of str to float
        Values, in SI, of fits of special cases of the law. A law never describes data worse than
        its special cases: no minimum is higher than these starts.
    """
    if not objective.unknowns:
        return _as_it_stands(objective)
    special = _of_special_cases(objective, simpler)
    drawn_starts = _latin_hypercube(objective, seed, drawn)
    chi2 = objective.chi2_of_many(np.array(drawn_starts))
    if np.isfinite(chi2).sum() < (chi2.size * _RARE if objective.has_table else 1):
        objective.use_search(True)
        minima = _by_few_rows(objective, drawn_starts, special, progress)
        return _with_other_lengths(objective, minima)
    starts = [*special, *_best(objective, drawn_starts, chi2)]
    minima = _followed(objective, starts, progress)
    if minima and _blocked(objective, minima[0]):
        ends = [end.u for end in distinct(minima)[: _FOLLOWED + 1]]
        objective.use_search(True)
        beyond = _by_few_rows(objective, drawn_starts, ends, None)
        if beyond and beyond[0].chi2 < minima[0].chi2 - GAIN:
            minima = beyond
        else:
            objective.use_search(False)
    return _with_other_lengths(objective, minima)


def _latin_hypercube(objective: Objective, seed: int, drawn: int) -> list[Float]:
    """The given start, and drawn ones: every third is one of a special case of the law.

    Laws have others as special cases, elasto-plastic Rice-Ruina for lambda = 0: data of the special
    case have their minimum there, and others away from it.
    """
    unknowns = objective.unknowns
    middle = np.array([float(u.to_coordinate(u.middle)) for u in unknowns])
    low = np.array([u.to_coordinate(u.start[0]) for u in unknowns])
    high = np.array([u.to_coordinate(u.start[1]) for u in unknowns])
    # (Sobol's sequence would load the whole of scipy.stats for it.)
    generator = np.random.default_rng(seed)
    strata = generator.permuted(np.tile(np.arange(drawn), (len(unknowns), 1)), axis=1)
    shares = (strata + generator.random(strata.shape)).T / max(drawn, 1)
    starts = [middle, *(low + (high - low) * shares)]
    extensions = _extensions(objective)
    for k in range(len(starts) // 2) if extensions else ():
        special = starts[3 * k + 1].copy()
        special[extensions[k % len(extensions)]] = _NEARLY_ZERO
        starts.insert(3 * k + 2, special)
    return starts


def _extensions(objective: Objective) -> list[int]:
    """Coordinates that extend the law, and leave a special case of it where they are zero."""
    names = [None if u.logarithmic else u.name for u in objective.unknowns]
    return [i for i, name in enumerate(names) if name in _EXTENSIONS]


def _best(objective: Objective, starts: list[Float], chi2: Float) -> list[Float]:
    """Starts with a solution: the given one, the best others, and the best of each special case."""
    order = dict.fromkeys([0, *np.argsort(chi2).tolist()])
    solved = [starts[i] for i in order if math.isfinite(chi2[i])]
    best, others = solved[: _FOLLOWED + 1], solved[_FOLLOWED + 1 :]
    for i in _extensions(objective):
        if all(u[i] != _NEARLY_ZERO for u in best):
            best += [u for u in others if u[i] == _NEARLY_ZERO][:1]
    return best


def _followed(
    objective: Objective,
    starts: Sequence[Float],
    progress: Callable[[int, int], None] | None,
    *,
    tolerance: float | None = None,
    evaluations: int = 100,
) -> list[Minimum]:
    """Minima that are reached from the starts, best first."""
    advance = counted(progress, len(starts))
    advance(0)
    minima = []
    for start in starts:
        minima.append(objective.minimise(start, tolerance=tolerance, evaluations=evaluations))
        advance(1)
    return sorted((m for m in minima if math.isfinite(m.chi2)), key=_CHI2)


def _by_few_rows(
    objective: Objective,
    drawn: list[Float],
    known: list[Float],
    progress: Callable[[int, int], None] | None,
) -> list[Minimum]:
    """Minima of the coarse objective, and from there those of all rows, best first.

    None is higher than chi-squared at the `known` starts.
    """
    drawn = drawn[:_WITH_SEARCH]
    coarse = _coarse(objective) or objective
    screened = coarse.thinned(_SCREENED_ROWS) or coarse
    chi2 = screened.chi2_of_many(np.array(drawn))
    starts = [*known, *_best(objective, drawn, chi2)]
    ends = _followed(coarse, starts, progress, tolerance=_NEARBY, evaluations=_FIRST_EVALUATIONS)
    apart = [end.u for end in distinct(ends, _SAME_COARSE)[:_FOLLOWED]]
    ends = _followed(coarse, apart, None, tolerance=_NEARBY, evaluations=_EVALUATIONS)
    minima = _on_all_rows(objective, ends)
    lowest = minima[0].chi2 if minima else math.inf
    again = [u for u in known if objective.chi2(u) < lowest]
    if not minima:
        # Another row may have no orbit there, or none that the coarse search reaches.
        again += _best(objective, drawn, objective.chi2_of_many(np.array(drawn)))
    return sorted([*minima, *map(objective.minimise, again)], key=_CHI2)


def _coarse(objective: Objective) -> Objective | None:
    """The objective of a few rows of its table; None for other data."""
    return objective.thinned(_ROWS, _DATA_EACH * len(objective.unknowns))


def _on_all_rows(objective: Objective, ends: list[Minimum]) -> list[Minimum]:
    """Minima of all rows from those of the coarse objective that may be as good as the best."""
    ends = distinct(ends, _SAME_COARSE)
    minima: list[Minimum] = []
    coarser = objective.coarser()
    for end in ends:
        if minima and end.chi2 > ends[0].chi2 + _WORTH:
            break
        near = coarser.minimise(end.u, tolerance=_NEARBY, evaluations=_EVALUATIONS)
        tolerance = _NEARBY if _far_off(coarser, near) else None
        if not math.isfinite(objective.chi2(near.u)):
            # Motions do not settle on orbits that are hardly stable; branches lead to them.
            objective.search_wholly(near.u)
        minima.append(objective.minimise(near.u, tolerance=tolerance))
    return distinct(sorted((m for m in minima if math.isfinite(m.chi2)), key=_CHI2))


def _with_other_lengths(objective: Objective, minima: list[Minimum]) -> list[Minimum]:
    """Minima with those at other memory lengths, of tables that the law does not contradict.

    Where sliding over D0 takes far longer than a period, or far less, the evolution of friction
    leaves little but a phase in the readings: values of D0 that differ by a factor of ten, with
    other A and B, may describe them equally well. Intervals that do not know of it are too short.
    """
    if not objective.has_table or not minima or _far_off(objective, minima[0]):
        return minima
    best = minima[0].u
    coarse = (_coarse(objective) if objective.searches else None) or objective
    if not math.isfinite(coarse.chi2(best)):
        coarse = objective
    highest = coarse.chi2(best) + _WORTH
    others = []
    for i, unknown in enumerate(objective.unknowns):
        if not unknown.logarithmic or unknown.nuisance or unknown.parameter.kind != "length":
            continue
        ends = []
        for factor in _OTHER_LENGTHS:
            x = float(np.clip(best[i] + math.log(factor), *unknown.bounds))
            there = coarse.minimise(best, {i: x}, tolerance=_NEARBY, evaluations=_FIRST_EVALUATIONS)
            if there.chi2 < _HOPELESS * highest:
                ends.append(coarse.minimise(there.u, tolerance=_NEARBY, evaluations=_EVALUATIONS))
        for side in (-1, 1):
            apart = [
                end
                for end in ends
                if end.chi2 < highest and side * (end.u[i] - best[i]) > math.log(_SAME_LENGTH)
            ]
            if apart:
                u = min(apart, key=_CHI2).u
                others.append(objective.minimise(u, evaluations=_EVALUATIONS))
    return sorted([*minima, *others], key=_CHI2)


def _p_value(objective: Objective, minimum: Minimum) -> float:
    """Probability that chi-squared is as large or larger by chance."""
    if not math.isfinite(minimum.chi2):
        return 0.0
    r, _ = objective.residuals(minimum.u)
    return float(chdtrc(max(r.size - minimum.u.size, 1), minimum.chi2))


def _as_it_stands(objective: Objective) -> list[Minimum]:
    """The one point of an objective without free parameters, if the law has a solution there."""
    nowhere = np.zeros(0)
    chi2 = objective.chi2(nowhere)
    if not math.isfinite(chi2):
        objective.use_search(True)
        chi2 = objective.chi2(nowhere)
    return [Minimum(nowhere, chi2)] if math.isfinite(chi2) else []


def distinct(minima: list[Minimum], same: float = _SAME) -> list[Minimum]:
    """Minima without those that repeat an earlier one."""
    kept: list[Minimum] = []
    for minimum in minima:
        if all(np.abs(minimum.u - other.u).max() > same for other in kept):
            kept.append(minimum)
    return kept


def _blocked(objective: Objective, end: Minimum) -> bool:
    """Whether chi-squared still falls where a minimisation has stopped.

    It does where the fast method has no solution farther on: the minimum would be wrong, and a law
    that describes the data would be excluded.
    """
    if not objective.has_table or not math.isfinite(end.chi2):
        return False
    least = _LARGE_GAIN * end.chi2 if _far_off(objective, end) else GAIN
    return objective.expected_decrease(end.u) > least


def _far_off(objective: Objective, minimum: Minimum) -> bool:
    """Whether the law does not describe the data there."""
    return _p_value(objective, minimum) < FAR_OFF


def _of_special_cases(objective: Objective, simpler: Sequence[Mapping[str, float]]) -> list[Float]:
    """Coordinates of special cases of the law, where a parameter that extends it nearly is zero."""
    result = []
    for values in simpler:
        u = []
        for unknown in objective.unknowns:
            value = values.get(unknown.name, unknown.middle)
            extending = unknown.name in _EXTENSIONS and unknown.name not in values
            extending &= not unknown.logarithmic  # such as D2, which B2 = 0 leaves without effect
            near = _NEARLY_ZERO if extending else unknown.to_coordinate(value)
            u.append(float(np.clip(near, *unknown.bounds)))
        result.append(np.array(u))
    return result


def extends(law: type[Law], other: type[Law]) -> bool:
    """Whether a law has the parameters of another and some that extend it, which may be zero."""
    own, others = set(law_parameters(law)), set(law_parameters(other))
    return others < own and own - others <= set(_EXTENSIONS)
