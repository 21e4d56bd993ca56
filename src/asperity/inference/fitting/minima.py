"""Search for the minima of an objective from a given start and from drawn ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from asperity.inference.objective import Minimum, Objective
from asperity.laws import Law
from asperity.parameters import law_parameters
from asperity.parameters.arguments import counted

Float = NDArray[np.float64]

#: What minima are ordered by.
_CHI2 = attrgetter("chi2")
#: The best of the drawn starts that are followed to their minimum.
_FOLLOWED = 3
#: Minima nearer than this in every coordinate are one.
_SAME = 1e-3

#: Share of starts below which orbits are searched for at once: the fast method does not reach a
#: modulation slower than sliding over the memory length, and would see only wrong minima; starts
#: that are evaluated then.
_RARE, _WITH_SEARCH = 1 / 16, 32
#: So many of them are followed while no minimum describes the data.
_FOLLOWED_FAR_OFF = 10
#: Rows of a table on which minima are looked for first where orbits are searched for, which takes
#: ten milliseconds a row; data for each free parameter that they must hold.
_FEW_ROWS, _DATA_EACH = 16, 3
#: Relative change of the coordinates that ends the way to a minimum there.
_NEARBY = 1e-3
#: Rows on which starts are tried first, and most starts that are tried on all; evaluations after
#: which a way is compared with the others; how many times the lowest chi-squared is hopeless then.
_ROWS_FIRST, _TRIED, _SOME_WAY, _HOPELESS = 4, 6, 10, 1e2
#: Evaluations after which a law that does not describe the data is given up.
_LONG_WAY = 30
#: Share that chi-squared must fall to on each part of the way beyond the fast method.
_WORTHWHILE = 0.3
#: Share of the rows that must have an orbit for a start to be tried.
_LEAST = 0.5
#: Ends there are one minimum if they differ by less in every coordinate, and are followed on all
#: rows if their chi-squared is not more than so many times the lowest.
_SAME_FEW, _AS_GOOD_FEW = 0.02, 3.0
#: Minima on all rows within this of the lowest chi-squared are followed to their end.
_WORTH = 50.0
#: Minimisations that have stopped short and go on with the slower method.
_SEARCHED = 2
#: Decrease of chi-squared that is worth that method: a tenth of a standard error.
_GAIN = 0.01
#: Probability of chi-squared below which a law is far off, so that its exact minimum and intervals
#: change no verdict; and the share of chi-squared whose decrease is worth the slower method there.
FAR_OFF, _LARGE_GAIN = 1e-12, 0.1
#: Probability of chi-squared below which a better minimum is looked for beside the best; changes
#: of a logarithm, and of others as a share of their range of starts, that lead there; searches.
DOUBTFUL, _BESIDE, _SHARE_BESIDE, _ROUNDS_BESIDE = 0.05, math.log(2.0), 0.2, 3
#: Factors of a memory length at which other minima are looked for, and the factor between two
#: lengths below which they are one minimum.
_OTHER_LENGTHS, _SAME_LENGTH = (0.1, 1 / 3, 3.0, 10.0), 1.5
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
        Values, in SI, that fits of special cases of the law have found. A law never describes data
        worse than its special cases: no minimum is higher than these starts.
    """
    if not objective.unknowns:
        return _as_it_stands(objective)
    begun = _beginnings(objective, seed, drawn, simpler)
    advance = counted(progress, len(begun.followed))
    advance(0)
    if begun.few is not None:
        result = _followed_on_few_rows(objective, begun, begun.few, advance)
    else:
        result = _followed(objective, begun, advance)
    if not begun.searched:
        result = _beyond_the_fast_method(objective, result)
    return _with_other_lengths(objective, _with_those_beside(objective, result))


class _Beginnings(NamedTuple):
    """Where minimisations begin.

    Attributes
    ----------
    starts : list of array
        Those at which the law has a solution: the middle if it is one, then best first.
    special : list of array
        Minima of special cases of the law.
    followed : list of array
        Of these and of starts, what is followed in any case.
    searched : bool
        Whether orbits are searched for from the first start on.
    few : Objective or None
        Of few rows, on which starts are followed first; None for the straight way.
    """

    starts: list[Float]
    special: list[Float]
    followed: list[Float]
    searched: bool
    few: Objective | None


def _beginnings(
    objective: Objective, seed: int, drawn: int, simpler: Sequence[Mapping[str, float]]
) -> _Beginnings:
    unknowns = objective.unknowns
    middle = np.array([float(u.to_coordinate(u.middle)) for u in unknowns])
    low = np.array([u.to_coordinate(u.start[0]) for u in unknowns])
    high = np.array([u.to_coordinate(u.start[1]) for u in unknowns])
    # A Latin hypercube. (Sobol's sequence would load the whole of scipy.stats for it.)
    generator = np.random.default_rng(seed)
    strata = generator.permuted(np.tile(np.arange(drawn), (len(unknowns), 1)), axis=1)
    shares = (strata + generator.random(strata.shape)).T / max(drawn, 1)
    candidates = [middle, *(low + (high - low) * shares)]
    chi2 = objective.chi2_of_many(np.array(candidates))
    at = np.flatnonzero(np.isfinite(chi2))
    searched = at.size < (_RARE * chi2.size if objective.has_table else 1)
    few: Objective | None = None
    if searched:
        objective.use_search(True)
        few = _few_rows(objective)
        if few is None and objective.has_table and len(objective.terms) == 1:
            few = objective
        candidates = [
            candidates[i] for i in dict.fromkeys([*range(min(_WITH_SEARCH, chi2.size)), *at])
        ]
        chi2 = _chi2_of_many(few or objective, candidates)
    order = [i for i in np.argsort(chi2) if math.isfinite(chi2[i])]
    starts = [candidates[i] for i in dict.fromkeys([*(i for i in order if i == 0), *order])]
    special = [
        u
        for u in _of_special_cases(objective, simpler)
        if math.isfinite((few or objective).chi2(u))
    ]
    followed = [
        *special,
        *starts[: _FOLLOWED + 1],
        *_special_cases(few or objective, starts),
    ]
    return _Beginnings(starts, special, followed, searched, few)


def _followed(
    objective: Objective, begun: _Beginnings, advance: Callable[[int], None]
) -> list[Minimum]:
    """Minima at the ends of the ways from the starts, best first."""
    result = []
    for start in begun.followed:
        result.append(objective.minimise(start))
        advance(1)
    for start in begun.starts[_FOLLOWED + 1 : _FOLLOWED_FAR_OFF] if begun.searched else ():
        if result and not _far_off(objective, min(result, key=_CHI2)):
            break
        result.append(objective.minimise(start))
    return sorted(result, key=_CHI2)


def _followed_on_few_rows(
    objective: Objective, begun: _Beginnings, few: Objective, advance: Callable[[int], None]
) -> list[Minimum]:
    """Minima that are looked for on few rows, and from there on all, best first."""
    ends = _ends_on_few_rows(few, begun.followed, begun.starts, advance)
    result = _of_all_rows(objective, few, ends)
    for u in begun.special:
        if objective.chi2(u) < min((end.chi2 for end in result), default=math.inf):
            result.append(objective.minimise(u))
    if not result:
        # Another row may have no orbit at any of the ends.
        starts = [u for u in begun.starts if math.isfinite(objective.chi2(u))]
        result = [objective.minimise(u) for u in starts[: _FOLLOWED + 1]]
    return sorted(result, key=_CHI2)


def _some_way(objective: Objective, u: Float, kept: Mapping[int, float] | None = None) -> Minimum:
    """Where a minimisation from u is after few evaluations, to be compared with others."""
    return objective.minimise(u, kept, tolerance=_NEARBY, evaluations=_SOME_WAY)


def _near_minimum(objective: Objective, u: Float) -> Minimum:
    """Near the minimum that is reached from u, if the law describes the data there."""
    return objective.minimise(u, tolerance=_NEARBY, evaluations=_LONG_WAY)


def _beyond_the_fast_method(objective: Objective, result: list[Minimum]) -> list[Minimum]:
    """Minima that the fast method has kept from their end, followed on with the slower one."""
    if not result or not _blocked(objective, result[0]):
        return result
    objective.use_search(True)
    stopped = distinct(result)
    beyond = [_onwards(objective, end) for end in stopped[:_SEARCHED]]
    if min(end.chi2 for end in beyond) > result[0].chi2 - _GAIN:
        objective.use_search(False)
        return result
    # The others are minima, or only where the fast method ends.
    others = [end for end in stopped[_SEARCHED:] if not _blocked(objective, end)]
    return sorted([*beyond, *others], key=_CHI2)


def _onwards(objective: Objective, end: Minimum) -> Minimum:
    """From where the fast method ended, by way of few rows where the law is far off."""
    if not _far_off(objective, end):
        return objective.minimise(end.u)
    few = _few_rows(objective)
    if few is not None:
        u = _near_minimum(few, end.u).u
        end = min(end, Minimum(u, objective.chi2(u)), key=_CHI2)
    while _far_off(objective, end):
        before, end = end, _some_way(objective, end.u)
        if end.chi2 > _WORTHWHILE * before.chi2:
            return end
    return objective.minimise(end.u)


def _with_those_beside(objective: Objective, result: list[Minimum]) -> list[Minimum]:
    """Minima with those that lie beside the best one where that is doubtful, of tables.

    Under slow modulation, where slip events may come early or late in the period, parameters that
    are wrong by a factor describe most of the data: minima hide each other from drawn starts.
    """
    if not objective.has_table:
        return result
    for _ in range(_ROUNDS_BESIDE):
        if not result or _p_value(objective, result[0]) > DOUBTFUL:
            break
        best = result[0]
        beside = []
        for i, unknown in enumerate(objective.unknowns):
            low, high = (float(unknown.to_coordinate(v)) for v in unknown.start)
            step = _BESIDE if unknown.logarithmic else _SHARE_BESIDE * (high - low)
            for change in (-step, step):
                u = best.u.copy()
                u[i] = float(np.clip(u[i] + change, *unknown.bounds))
                beside.append(u)
        enough = best.chi2 - _GAIN
        if _far_off(objective, best):
            # Most likely the law is wrong, and no minimum will do.
            chi2 = _chi2_of_many(objective, beside)
            beside = [beside[i] for i in np.argsort(chi2)[:_FOLLOWED] if math.isfinite(chi2[i])]
            enough = _WORTHWHILE * best.chi2
        end = min((_some_way(objective, u) for u in beside), key=_CHI2, default=best)
        if end.chi2 > enough:
            break
        result = [objective.minimise(end.u), *result]
    return result


def _with_other_lengths(objective: Objective, result: list[Minimum]) -> list[Minimum]:
    """Minima with those at other memory lengths, of tables that the law does not contradict.

    Where sliding over D0 takes far longer than a period, or far less, the evolution of friction
    leaves little but a phase in the readings: values of D0 that differ by a factor of ten, with
    other A and B, may describe them equally well. Intervals that do not know of it are too short.
    """
    if not objective.has_table or not result or _far_off(objective, result[0]):
        return result
    best = result[0].u
    # Where orbits are searched for, few rows show where minima are.
    rough = (_few_rows(objective) if objective.searches else None) or objective
    highest = rough.chi2(best) + _WORTH
    others = []
    for i, unknown in enumerate(objective.unknowns):
        if not unknown.logarithmic or unknown.nuisance or unknown.parameter.kind != "length":
            continue
        ends = []
        for factor in _OTHER_LENGTHS:
            x = float(np.clip(best[i] + math.log(factor), *unknown.bounds))
            held = _some_way(rough, best, {i: x})
            if math.isfinite(held.chi2) and not _hopeless(held, result[0]):
                ends.append(_near_minimum(rough, held.u))
        # Their valleys may be flat and long: the end of the best on each side will do.
        for side in (-1, 1):
            apart = [
                end
                for end in ends
                if end.chi2 < highest and side * (end.u[i] - best[i]) > math.log(_SAME_LENGTH)
            ]
            if apart:
                u = min(apart, key=_CHI2).u
                others.append(objective.minimise(u, evaluations=_LONG_WAY))
    return sorted([*result, *others], key=_CHI2)


def _p_value(objective: Objective, minimum: Minimum) -> float:
    """Probability that chi-squared is as large or larger by chance."""
    if not math.isfinite(minimum.chi2):
        return 0.0
    r, _ = objective.residuals(minimum.u)
    return float(chdtrc(max(r.size - minimum.u.size, 1), minimum.chi2))


def _few_rows(objective: Objective) -> Objective | None:
    """The objective of a few rows of its table, spread over it; None for other data, or few rows.

    What a law predicts at them places the minimum well enough to begin there with all rows.
    """
    return objective.thinned(_FEW_ROWS, _DATA_EACH * len(objective.unknowns))


def _chi2_of_many(objective: Objective, candidates: Sequence[Float]) -> Float:
    """chi-squared of many starts, of a table on few rows first; infinite without a solution."""
    u = np.array(candidates)
    few = objective.thinned(_ROWS_FIRST)
    if few is None:
        return objective.chi2_of_many(u, least=_LEAST)
    # Most starts far from the data have no orbit at some row, which takes longest to find out.
    first = few.chi2_of_many(u, least=_LEAST)
    # The first is the given start, which is tried whatever few rows say of it.
    left = np.array(list(dict.fromkeys([0, *np.argsort(first)[:_TRIED]])))
    left = left[np.isfinite(first[left])]
    result = np.full(len(u), math.inf)
    if left.size:
        result[left] = objective.chi2_of_many(u[left], least=_LEAST)
    return result


def _ends_on_few_rows(
    few: Objective,
    followed: list[Float],
    starts: list[Float],
    advance: Callable[[int], None],
) -> list[Minimum]:
    """Minima on few rows, which are where the whole table is begun with.

    Each start is followed some way, until two have come to one minimum that describes the data;
    while none does, more starts are tried. Ways that are hopeless beside a minimum are left there.
    """
    ways: list[Minimum] = []
    for k, start in enumerate(followed, 1):
        ways.append(_some_way(few, start))
        advance(1)
        if _twice(few, ways):
            advance(len(followed) - k)
            break
    for start in starts[_FOLLOWED + 1 : _FOLLOWED_FAR_OFF]:
        if not all(_far_off(few, way) for way in ways):
            break
        ways.append(_some_way(few, start))
    ends: list[Minimum] = []
    for way in distinct(sorted(ways, key=_CHI2), _SAME_FEW)[: _FOLLOWED + 1]:
        if math.isfinite(way.chi2) and not (ends and _hopeless(way, min(ends, key=_CHI2))):
            ends.append(_near_minimum(few, way.u))
    return ends


def _twice(objective: Objective, ways: list[Minimum]) -> bool:
    """Whether two ways have come to the lowest minimum so far, and the law describes the data."""
    best = min(ways, key=_CHI2)
    same = sum(np.abs(way.u - best.u).max() < _SAME_FEW for way in ways)
    return same > 1 and _p_value(objective, best) > DOUBTFUL


def _hopeless(way: Minimum, best: Minimum) -> bool:
    """Whether a way is so far above a minimum that it leads to no better one."""
    return way.chi2 > _HOPELESS * (best.chi2 + _FEW_ROWS)


def _of_all_rows(objective: Objective, few: Objective, ends: list[Minimum]) -> list[Minimum]:
    """Minima on all rows from the ends on few: the best, and those that may be as good."""
    ends = distinct(sorted((end for end in ends if math.isfinite(end.chi2)), key=_CHI2), _SAME_FEW)
    if not ends:
        return []
    largest = _AS_GOOD_FEW * (ends[0].chi2 + len(objective.unknowns) + _FEW_ROWS)
    near = [end for end in ends if end.chi2 <= largest][:_FOLLOWED]
    if few is not objective:
        on_all = [end.u for end in near if math.isfinite(objective.chi2(end.u))]
        near = [_near_minimum(objective, u) for u in on_all]
    near.sort(key=_CHI2)
    if not near or _far_off(objective, near[0]):
        return near
    return [
        objective.minimise(end.u) if end.chi2 < near[0].chi2 + _WORTH else end
        for end in distinct(near, _SAME_FEW)
    ]


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

    It does where the fast method has no solution farther on. Without this question the fit would
    report a wrong minimum, with a law that describes the data as its victim.
    """
    if not objective.has_table or not math.isfinite(end.chi2):
        return False
    least = _LARGE_GAIN * end.chi2 if _far_off(objective, end) else _GAIN
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


def _special_cases(objective: Objective, starts: list[Float]) -> list[Float]:
    """Starts at which a parameter that may be zero nearly is, best first of each.

    Laws have others as special cases, elasto-plastic Rice-Ruina for lambda = 0: data of the special
    case have their minimum there, and others away from it.
    """
    result = []
    for i, unknown in enumerate(objective.unknowns):
        if unknown.logarithmic or unknown.name not in _EXTENSIONS:
            continue
        trials = []
        for start in starts[: _FOLLOWED + 1]:
            trials.append(start.copy())
            trials[-1][i] = _NEARLY_ZERO
        if not trials:
            continue
        chi2 = _chi2_of_many(objective, trials)
        for at in np.argsort(chi2):
            if math.isfinite(chi2[at]) and math.isfinite(objective.chi2(trials[at])):
                result.append(trials[at])
                break
    return result
