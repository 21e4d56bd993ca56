"""Search for the minima of an objective: evaluate random starts, minimise from the best ones.

The starts are a Latin hypercube over the ranges of the unknowns. For tables, least squares first
uses the rows that the fast method solves, at least half of them; these minima are continued with
all rows, and with searched orbits where the fast method has none. If the fast method solves hardly
any start, as under slow modulation, orbits are searched for from the beginning, which takes
milliseconds a row: the first minimisations then use few rows of the table on a coarse mesh.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from operator import attrgetter

import numpy as np
from scipy.special import chdtrc

from asperity.arrays import Float
from asperity.inference.fitting.result import MISFIT
from asperity.inference.objective import Minimum, Objective
from asperity.laws import Law
from asperity.parameters import law_parameters
from asperity.parameters.arguments import counted

#: Called with the number of finished minimisations and of all minimisations.
Progress = Callable[[int, int], None]
#: Random starts from which chi-squared is minimised, in addition to the given start.
_MINIMISED = 3
#: Minima that differ by less in every coordinate are the same; the second number is for the coarse
#: objective.
_SAME, _SAME_COARSE = 1e-3, 0.02
#: If the fast method has a solution at a smaller share of the starts, orbits are searched for from
#: the beginning, and the second number is that of the starts: the fast method fails if the
#: modulation is slower than sliding over the memory length, and would lead to wrong minima only.
_RARE, _WITH_SEARCH = 1 / 16, 32
#: Largest numbers of further starts for a table that no minimum describes: with the fast method,
#: and with searched orbits. A start of the 600 fast tables leads to the minimum in 3 of 4 cases, in
#: the worst table in 1 of 12.
_FURTHER, _FURTHER_WITH_SEARCH = 32, 6
#: Rows with which starts are compared.
_SCREENED_ROWS = 8
#: Rows of the coarse objective (one chunk of the search for orbits), and the smallest number of
#: data for each free parameter in them.
_ROWS, _DATA_EACH = 24, 3
#: Tolerance of a minimum of the coarse objective, or of a law that is far off; largest number of
#: its evaluations, and the number after which the best minimisations are chosen.
_COARSE_TOLERANCE, _EVALUATIONS, _FIRST_EVALUATIONS = 1e-3, 60, 12
#: A law is far off if the probability of chi-squared is lower: its exact minimum and intervals
#: change no verdict.
FAR_OFF = 1e-12
#: The slower method is used if chi-squared can decrease by more: a tenth of a standard error, or
#: this share of chi-squared for a law that is far off.
GAIN, _LARGE_GAIN = 0.01, 0.1
#: Other minima this close in chi-squared are reported: 3 standard deviations.
RIVAL = 9.0
#: Minimisations within this of the lowest chi-squared are continued to their end.
_CONTINUED = 50.0
#: Other minima are searched at these multiples of a memory length. Minima with lengths closer than
#: the next factor are the same. A start is hopeless at the last multiple of the limit of
#: chi-squared.
_OTHER_LENGTHS, _SAME_LENGTH, _HOPELESS = (0.1, 1 / 3, 3.0, 10.0), 1.5, 1e2
#: Parameters by which a law extends another law: with a value of zero they have no influence.
_EXTENSIONS = ("lambda", "alpha", "c", "B2", "D2")
#: Coordinate of such a parameter that is nearly zero.
_NEARLY_ZERO = 1e-4


def minima_of(
    objective: Objective,
    seed: int,
    progress: Progress | None = None,
    *,
    drawn: int = 64,
    simpler: Sequence[Mapping[str, float]] = (),
    further: bool = True,
) -> list[Minimum]:
    """Minima from the given start and from the best of many random starts, best first.

    Parameters
    ----------
    objective : Objective
    seed : int
        Seed of the random starts.
    progress : callable, optional
        Called with the number of finished minimisations and of all minimisations.
    drawn : int
        Number of random starts.
    simpler : sequence of mapping of str to float
        Values, in SI, of fits of special cases of the law. They are starts too, because a law never
        describes data worse than its special cases.
    further : bool
        Whether further starts are tried while no minimum describes a table.
    """
    if not objective.unknowns:
        return _without_free_parameters(objective)
    special = _of_special_cases(objective, simpler)
    drawn_starts = _latin_hypercube(objective, seed, drawn)
    chi2 = objective.chi2_of_many(np.array(drawn_starts))
    minima: list[Minimum] = []
    if not objective.has_table:
        starts = [*special, *_best(objective, drawn_starts, chi2)]
        minima = _minimised_from(objective, starts, progress)
    elif np.isfinite(chi2).sum() >= chi2.size * _RARE:
        minima = _by_solved_rows(objective, drawn_starts, special, progress, further)
    if not minima:
        objective.use_search(True)
        minima = _by_few_rows(objective, drawn_starts, special, progress, further)
    return _readable(objective, _with_other_lengths(objective, minima))


def _by_solved_rows(
    objective: Objective,
    drawn: list[Float],
    known: list[Float],
    progress: Progress | None,
    further: bool,
) -> list[Minimum]:
    """Minima of all rows, started at minima of the rows that the fast method solves, best first.

    While no minimum describes the table, further starts are tried: chi-squared at a start says
    little about the minimum that is reached from there. Orbits are searched for if the fast method
    has no solution for some row: as soon as a minimum describes the other rows, or in the end.
    """
    partial = objective.partial()
    chi2 = partial.chi2_of_many(np.array(drawn))
    starts = [*known, *_best(partial, drawn, chi2)]
    ends = _minimised_from(partial, starts, progress, _COARSE_TOLERANCE, _EVALUATIONS)
    minima = _on_all_rows(objective, ends)
    if not _describes(objective, minima) and _describes(partial, ends):
        beyond = _with_searched_orbits(objective, ends, minima)
        if _describes(objective, beyond, ends):
            return beyond
        objective.use_search(False)
    for start in _further(objective, drawn, chi2, starts)[: _FURTHER * further]:
        if _describes(objective, minima, ends):
            break
        new = _rough_minimum(partial, start)
        if math.isfinite(new.chi2) and _is_new(new, ends):
            ends = best_first([*ends, new])
            minima = best_first([*minima, *_on_all_rows(objective, [new])])
    minima = distinct(minima)
    far_off = bool(ends) and _far_off(partial, ends[0])
    lower = bool(minima) and not far_off and ends[0].chi2 < minima[0].chi2 - GAIN
    if ends and (not minima or lower or _stopped_at_edge(objective, minima[0])):
        return _with_searched_orbits(objective, ends, minima, far_off=far_off)
    return minima


def _with_searched_orbits(
    objective: Objective,
    ends: list[Minimum],
    minima: list[Minimum],
    *,
    far_off: bool = False,
) -> list[Minimum]:
    """Minima of all rows with searched orbits from the ends; the given minima if none is lower.

    The objective goes on searching for orbits if a minimum is lower.
    """
    objective.use_search(True)
    beyond = _on_all_rows(objective, ends, far_off=far_off)
    if beyond and (not minima or beyond[0].chi2 < minima[0].chi2 - GAIN):
        return beyond
    objective.use_search(False)
    return minima


def _further(
    objective: Objective, drawn: list[Float], chi2: Float, starts: Sequence[Float]
) -> list[Float]:
    """Starts with a solution that are not among those tried, best first; only for known noise."""
    if not objective.noise_is_known:
        return []
    taken = {u.tobytes() for u in starts}
    order = (drawn[i] for i in np.argsort(chi2) if math.isfinite(chi2[i]))
    return [u for u in order if u.tobytes() not in taken]


def _rough_minima_by_smoother(objective: Objective, starts: Sequence[Float]) -> Iterator[Minimum]:
    """Rough minima from starts, after those with larger uncertainties.

    Larger uncertainties make chi-squared lower everywhere. A minimum at which the law is far off
    even with them leads to none that describes the data, and one that repeats another leads to the
    same.
    """
    smoother, before = objective.smoother(), list[Minimum]()
    for start in starts:
        between = _rough_minimum(smoother, start, _EVALUATIONS // 2, negligible=1.0)
        if not math.isfinite(between.chi2) or not _is_new(between, before):
            continue
        before.append(between)
        if not _far_off(smoother, between):
            yield _rough_minimum(objective, between.u)


def _describes(
    objective: Objective, minima: Sequence[Minimum], partly: Sequence[Minimum] = ()
) -> bool:
    """Whether the law describes the data at the first minimum.

    Rows without a solution are left out of the minima in `partly`, and may contradict these. Then
    chi-squared of all rows is higher.
    """
    highest = partly[0].chi2 + RIVAL if partly else math.inf
    return bool(minima) and minima[0].chi2 <= highest and _p_value(objective, minima[0]) >= MISFIT


def _latin_hypercube(objective: Objective, seed: int, drawn: int) -> list[Float]:
    """The given start and random starts; every third start is a special case of the law.

    A law may contain another law as a special case: the elasto-plastic law with lambda = 0 is
    Rice-Ruina. The minimum of some data lies at the special case, that of others far from it.
    """
    unknowns = objective.unknowns
    middle = np.array([float(u.to_coordinate(u.middle)) for u in unknowns])
    low = np.array([u.to_coordinate(u.start[0]) for u in unknowns])
    high = np.array([u.to_coordinate(u.start[1]) for u in unknowns])
    # A Sobol sequence would load all of scipy.stats.
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
    """Coordinates of extending parameters: at zero they leave a special case of the law."""
    names = [None if u.logarithmic else u.name for u in objective.unknowns]
    return [i for i, name in enumerate(names) if name in _EXTENSIONS]


def _best(objective: Objective, starts: list[Float], chi2: Float) -> list[Float]:
    """Starts with a solution: the given start, the best others, the best of each special case."""
    order = dict.fromkeys([0, *np.argsort(chi2).tolist()])
    solved = [starts[i] for i in order if math.isfinite(chi2[i])]
    best, others = solved[: _MINIMISED + 1], solved[_MINIMISED + 1 :]
    for i in _extensions(objective):
        if all(u[i] != _NEARLY_ZERO for u in best):
            best += [u for u in others if u[i] == _NEARLY_ZERO][:1]
    return best


def _minimised_from(
    objective: Objective,
    starts: Sequence[Float],
    progress: Progress | None,
    tolerance: float | None = None,
    evaluations: int = 100,
) -> list[Minimum]:
    """Minima reached from the starts, best first."""
    advance = counted(progress, len(starts))
    advance(0)
    minima = []
    for start in starts:
        minima.append(objective.minimise(start, tolerance=tolerance, evaluations=evaluations))
        advance(1)
    return best_first(minima)


def _rough_minimum(
    objective: Objective,
    start: Float,
    evaluations: int = _EVALUATIONS,
    negligible: float = 0.0,
) -> Minimum:
    """The minimum reached from a start, to the coarse tolerance or a negligible decrease."""
    return objective.minimise(
        start, tolerance=_COARSE_TOLERANCE, evaluations=evaluations, negligible=negligible
    )


def _by_few_rows(
    objective: Objective,
    drawn: list[Float],
    known: list[Float],
    progress: Progress | None,
    further: bool,
) -> list[Minimum]:
    """Minima of all rows, started at minima of the coarse objective, best first.

    No minimum is higher than chi-squared at the `known` starts.
    """
    drawn = drawn[:_WITH_SEARCH]
    coarse = _coarse(objective) or objective
    screened = coarse.thinned(_SCREENED_ROWS) or coarse
    chi2 = screened.chi2_of_many(np.array(drawn))
    starts = [*known, *_best(objective, drawn, chi2)]
    roughly = _roughly_minimised(coarse, starts, progress)
    further &= not _describes(coarse, roughly)
    others = _further(objective, drawn, chi2, starts)[: _FURTHER_WITH_SEARCH * further]
    for new in _rough_minima_by_smoother(coarse, others):
        roughly = best_first([*roughly, new])
        if _describes(coarse, roughly):
            break
    # A law that is far off for few rows does not describe all of them.
    far_off = bool(roughly) and _far_off(coarse, roughly[0])
    minima = _on_all_rows(objective, roughly, far_off=far_off)
    lowest = minima[0].chi2 if minima else math.inf
    again = [u for u in known if objective.chi2(u) < lowest]
    if minima or (again and far_off):
        return best_first([*minima, *map(objective.minimise, again)])
    # Another row may have no orbit at a coarse minimum, or no orbit that the coarse search reaches.
    if far_off:
        in_order = (drawn[i] for i in np.argsort(chi2))
        solved = (u for u in in_order if math.isfinite(objective.chi2(u)))
        ends = [_minimised_near(objective, u, [], far_off=True) for u in islice(solved, 1)]
    else:
        chi2 = objective.chi2_of_many(np.array(drawn))
        ends = _roughly_minimised(objective, [*again, *_best(objective, drawn, chi2)], None)
    return best_first(
        end if _far_off(objective, end) else objective.minimise(end.u) for end in ends
    )


def _roughly_minimised(
    objective: Objective, starts: Sequence[Float], progress: Progress | None
) -> list[Minimum]:
    """Minima to a coarse tolerance, best first: few evaluations choose those that are continued."""
    ends = _minimised_from(objective, starts, progress, _COARSE_TOLERANCE, _FIRST_EVALUATIONS)
    # In 83 fits, none of 50 minimisations so far above one that describes the data ended lower.
    highest = ends[0].chi2 + _CONTINUED if _describes(objective, ends) else math.inf
    apart = [end.u for end in distinct(ends, _SAME_COARSE)[:_MINIMISED] if end.chi2 < highest]
    return _minimised_from(objective, apart, None, _COARSE_TOLERANCE, _EVALUATIONS)


def _coarse(objective: Objective) -> Objective | None:
    """The objective with a few rows of its table; None for other data."""
    return objective.thinned(_ROWS, _DATA_EACH * len(objective.unknowns))


def _on_all_rows(
    objective: Objective, ends: list[Minimum], *, far_off: bool = False
) -> list[Minimum]:
    """Minima of all rows from those of some rows that may be as good as the best.

    Of a law that is far off for some rows, one minimum is enough.
    """
    ends = distinct(ends, _SAME_COARSE)
    highest = ends[0].chi2 + (0.0 if far_off else _CONTINUED) if ends else 0.0
    minima: list[Minimum] = []
    before: list[Minimum] = []
    coarser = objective.coarser()
    for end in ends:
        if minima and end.chi2 > highest:
            break
        near = _rough_minimum(coarser, end.u)
        if not _is_new(near, before):
            continue
        before.append(near)
        far = _far_off(coarser, near)
        minima.append(_minimised_near(objective, near.u, minima, far_off=far))
    return distinct(best_first(minima))


def _with_other_lengths(objective: Objective, minima: list[Minimum]) -> list[Minimum]:
    """Minima, including those at other memory lengths, for tables that agree with the law.

    If sliding over D0 takes far longer than a period, or far less, the evolution of friction shows
    in the readings as a phase only. Values of D0 that differ by a factor of ten may then describe
    the readings equally well, with other A and B, and intervals must include them.
    """
    if not objective.has_table or not minima or _far_off(objective, minima[0]):
        return minima
    best = minima[0].u
    coarse = (_coarse(objective) if objective.searches else None) or objective
    if not math.isfinite(coarse.chi2(best)):
        coarse = objective
    highest = coarse.chi2(best) + _CONTINUED
    others: list[Minimum] = []
    for i, unknown in enumerate(objective.unknowns):
        if not unknown.logarithmic or unknown.nuisance or unknown.parameter.kind != "length":
            continue
        ends = []
        for factor in _OTHER_LENGTHS:
            x = float(np.clip(best[i] + math.log(factor), *unknown.bounds))
            there = coarse.minimise(
                best, {i: x}, tolerance=_COARSE_TOLERANCE, evaluations=_FIRST_EVALUATIONS
            )
            if there.chi2 < _HOPELESS * highest:
                ends.append(_rough_minimum(coarse, there.u))
        for side in (-1, 1):
            apart = [
                end
                for end in ends
                if end.chi2 < highest and side * (end.u[i] - best[i]) > math.log(_SAME_LENGTH)
            ]
            if apart:
                u = best_first(apart)[0].u
                others.append(_minimised_near(objective, u, [*minima, *others]))
    return best_first([*minima, *others])


def _readable(objective: Objective, minima: list[Minimum]) -> list[Minimum]:
    """Minima without those at which some response is unstable, if the data allow others."""
    allowed = [m.chi2 <= minima[0].chi2 + RIVAL for m in minima]
    if sum(allowed) < 2 or not objective.has_table or _far_off(objective, minima[0]):
        return minima
    stable = [
        near and not objective.instability(m.u) for m, near in zip(minima, allowed, strict=True)
    ]
    kept = [m for m, near, good in zip(minima, allowed, stable, strict=True) if good or not near]
    return kept if any(stable) else minima


def _minimised_near(
    objective: Objective, u: Float, minima: Sequence[Minimum], *, far_off: bool = False
) -> Minimum:
    """The minimum reached from u, precise only if it may be one of those that a fit reports."""
    if minima or far_off:
        near = _rough_minimum(objective, u, _FIRST_EVALUATIONS if far_off else _EVALUATIONS)
        lowest = min((m.chi2 for m in minima), default=math.inf)
        repeats = near.chi2 > lowest and any(_apart(near, m) < _SAME_COARSE for m in minima)
        if far_off or repeats or near.chi2 > lowest + RIVAL:
            return near
        u = near.u
    return objective.minimise(u)


def _p_value(objective: Objective, minimum: Minimum) -> float:
    """Probability that chi-squared is as large or larger by chance."""
    if not math.isfinite(minimum.chi2):
        return 0.0
    r, _ = objective.residuals(minimum.u)
    return float(chdtrc(max(r.size - minimum.u.size, 1), minimum.chi2))


def _without_free_parameters(objective: Objective) -> list[Minimum]:
    """The single point of an objective without free parameters, if the law has a solution."""
    nowhere = np.zeros(0)
    chi2 = objective.chi2(nowhere)
    if not math.isfinite(chi2):
        objective.use_search(True)
        chi2 = objective.chi2(nowhere)
    return [Minimum(nowhere, chi2)] if math.isfinite(chi2) else []


def best_first(minima: Iterable[Minimum]) -> list[Minimum]:
    """Minima with a solution, in the order of chi-squared."""
    return sorted((m for m in minima if math.isfinite(m.chi2)), key=attrgetter("chi2"))


def distinct(minima: list[Minimum], same: float = _SAME) -> list[Minimum]:
    """Minima without those that repeat an earlier one."""
    kept: list[Minimum] = []
    for minimum in minima:
        if _is_new(minimum, kept, same):
            kept.append(minimum)
    return kept


def _is_new(minimum: Minimum, kept: Sequence[Minimum], same: float = _SAME_COARSE) -> bool:
    """Whether a minimum repeats none of others."""
    return all(_apart(minimum, other) > same for other in kept)


def _apart(one: Minimum, other: Minimum) -> float:
    return float(np.abs(one.u - other.u).max())


def _stopped_at_edge(objective: Objective, end: Minimum) -> bool:
    """Whether chi-squared still falls at the point at which a minimisation has stopped.

    This happens if the fast method has no solution beyond this point. The minimum would be wrong,
    and a law that describes the data would be excluded.
    """
    if not objective.has_table or not math.isfinite(end.chi2):
        return False
    least = _LARGE_GAIN * end.chi2 if _far_off(objective, end) else GAIN
    return objective.expected_decrease(end.u) > least


def _far_off(objective: Objective, minimum: Minimum) -> bool:
    """Whether the law is far from describing the data at a minimum."""
    return _p_value(objective, minimum) < FAR_OFF


def _of_special_cases(objective: Objective, simpler: Sequence[Mapping[str, float]]) -> list[Float]:
    """Coordinates of fits of special cases: extending parameters are nearly zero."""
    result = []
    for values in simpler:
        u = []
        for unknown in objective.unknowns:
            value = values.get(unknown.name, unknown.middle)
            extending = unknown.name in _EXTENSIONS and unknown.name not in values
            extending &= not unknown.logarithmic  # D2 has no effect if B2 = 0
            near = _NEARLY_ZERO if extending else unknown.to_coordinate(value)
            u.append(float(np.clip(near, *unknown.bounds)))
        result.append(np.array(u))
    return result


def extends(law: type[Law], other: type[Law]) -> bool:
    """Whether a law has the parameters of another law and extending parameters, which may be 0."""
    names, others = set(law_parameters(law)), set(law_parameters(other))
    return others < names and names - others <= set(_EXTENSIONS)
