"""Description of a fit: intervals, parameters that the data do not determine, and warnings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri, ndtri, stdtrit

from asperity.arrays import Float
from asperity.errors import Argument, enumerated, named
from asperity.inference.fitting.intervals import LEVELS, Interval, bounded_interval
from asperity.inference.fitting.minima import FAR_OFF, RIVAL
from asperity.inference.fitting.outliers import LOWER, with_outliers
from asperity.inference.fitting.parabola import (
    UNDETERMINED,
    Parabola,
    inverse_information,
    parabola_of,
)
from asperity.inference.fitting.profile_likelihood import Profile, ProfileAtEdgeError
from asperity.inference.fitting.result import MISFIT, Estimate, Fit, Optimum
from asperity.inference.objective import Objective, Residuals, aicc_penalty
from asperity.inference.unknowns import Unknown
from asperity.units import quantity_text

#: Chi-squared is compared with its parabola at this many standard deviations. The normal
#: approximation is used if the rise lies between these two: intervals are then wrong by less than a
#: quarter.
_COMPARED_AT, _LOWEST_RISE, _HIGHEST_RISE = 2.0, 2.4, 6.8
#: From this correlation on, the interval of a parameter depends on that of the other.
_TOGETHER = 0.3
#: Coordinates with a smaller standard deviation (factors of e) are not compared with the parabola.
_PRECISE = 0.1
#: A profile that was not requested ends after this many searches without an orbit: an end of an
#: interval at the edge takes ten such searches (22 at most in 36 profiles), a valley along the edge
#: takes hundreds.
_MOST_UNSOLVED = 40
#: Minima closer than this, in standard errors of all parameters but nuisances, are the same answer.
_NEAR = 0.5
#: A fit with searched orbits is doubtful if the probability of chi-squared is lower.
_DOUBTFUL = 0.05
#: A warning is given if data and a prior differ by more standard deviations than this.
_CONTRADICTED = 3.0
#: An estimate closer to a bound than this share of its standard error is at the bound.
_AT_BOUND = 1e-3


def failed_fit(objective: Objective) -> Fit:
    """A fit without a solution: all its numbers are NaN, and its message says why."""
    nan = math.nan
    estimates = {
        u.name: Estimate(u.name, u.parameter.unit, nan, nan, (nan, nan), (nan, nan), False, u.prior)
        for u in objective.unknowns
    }
    message = "; ".join(dict.fromkeys(term.failure for term in objective.terms))
    return Fit(objective.law.name, False, message, estimates, objective)


def described_fit(
    objective: Objective,
    minima: Sequence[tuple[Float, float]],
    *,
    profile: bool,
    described: Callable[[int], None] | None = None,
) -> Fit:
    """The fit at the lowest of the minima.

    Parameters
    ----------
    objective : Objective
    minima : sequence of (array, float)
        Coordinates and chi-squared, best first.
    profile : bool
        Whether to compute intervals by profile likelihood.
    described : callable, optional
        Called with the number of parameters that have intervals so far.
    """
    # Minima that differ only in the order of exchangeable parameters are the same.
    minima = [(objective.ordered(u), value) for u, value in minima]
    at = parabola_of(objective, *minima[0])
    if at is None:
        # The minimum lies at the edge of the region with orbits, and was not reached again.
        if not minima[1:]:
            return failed_fit(objective)
        result = described_fit(objective, minima[1:], profile=profile, described=described)
        lost = (
            f"a lower minimum, of chi-squared {minima[0][1]:.4g}, lies where the law hardly has "
            "periodic orbits, and was not reached again: this is the next minimum; leave out the "
            "rows of the slowest modulation and compare"
        )
        return replace(result, sentences=(lost, *result.sentences))
    at, minima, outliers = with_outliers(objective, at, minima)
    # If the data contradict the law, a search for orbits would not improve the intervals.
    far_off = at.p_value < FAR_OFF and not profile
    bent = [] if profile or far_off else _not_parabolic(objective, at)
    if not objective.noise_is_known and (open_ended := _open_ended(objective, at, bent)):
        at = replace(at, undetermined=tuple(dict.fromkeys([*at.undetermined, *open_ended])))
        bent = [name for name in bent if name not in open_ended]
    rivals = _rivals(objective, minima, at.sd)
    odd = set() if far_off else {*bent, *at.undetermined}
    profiled = _profiled(objective, at.covariance, odd, everything=profile)
    estimates: dict[str, Estimate] = {}
    at_edge: list[str] = []
    for i, unknown in enumerate(objective.unknowns):
        along = None
        if i in profiled:
            searching = profile or unknown.name not in at.undetermined
            # All parameters share the same valley.
            most = math.inf if profile else -1 if at_edge else _MOST_UNSOLVED
            along = Profile(objective, i, at.u, at.chi2, at.covariance, search=searching, most=most)
        try:
            ends = _ends(objective, at, i, along)
        except ProfileAtEdgeError:
            at_edge.append(unknown.name)
            whole = unknown.name in odd
            ends = [unknown.bounds] * len(LEVELS) if whole else _ends(objective, at, i, None)
        if along is not None and along.lowest[1] < at.chi2 - LOWER:
            # The search has missed a minimum: describe the fit again from this minimum.
            missed = objective.minimise(along.lowest[0])
            if not objective.instability(missed.u) or objective.instability(at.u):
                minima = [missed, *minima]
                return described_fit(objective, minima, profile=profile, described=described)
        estimates[unknown.name] = _estimate(objective, at, i, ends, rivals)
        if described is not None:
            described(i + 1)
    of_profiles = [objective.names[i] for i in sorted(profiled)]
    warnings = _doubts(objective, at, at_edge, odd, bent, of_profiles)
    return _with_warnings(_fit_with(objective, at, estimates, rivals), outliers, warnings)


def _doubts(
    objective: Objective,
    at: Parabola,
    at_edge: Sequence[str],
    odd: set[str],
    bent: Sequence[str],
    of_profiles: Sequence[str],
) -> list[str]:
    """Sentences on priors, and on intervals that are not those of a parabola."""
    warnings = _contradicted(objective, at)
    if at.stopped:
        warnings.append(
            "chi-squared still falls where the law has no periodic orbit at some operating point: "
            "the estimate is the last before, and intervals are by profile likelihood or the whole "
            "range; leave those rows out or doubt the law"
        )
    if at_edge:
        warnings.append(_not_profiled(at_edge, odd))
    if bent:
        warnings.append(_no_parabola(bent, of_profiles, at_edge))
    return warnings


def _not_profiled(names: Sequence[str], odd: set[str]) -> str:
    """A sentence on intervals whose profile runs along the edge of the region with orbits."""
    whole = enumerated([named(n) for n in names if n in odd])
    normal = enumerated([named(n) for n in names if n not in odd])
    ends = [
        f"intervals of {whole} are the whole range" if whole else "",
        f"intervals of {normal} are of the normal approximation, and may be too short"
        if normal
        else "",
    ]
    return (
        f"{', '.join(e for e in ends if e)}: their profile likelihood runs where the law hardly "
        f"has periodic orbits, which takes minutes; ask for it ({Argument('profile')}), fix a "
        "parameter or give a prior"
    )


def _no_parabola(bent: Sequence[str], profiled: Sequence[str], at_edge: Sequence[str]) -> str:
    """A sentence on the parameters `bent`, in which chi-squared is no parabola."""
    also = [n for n in profiled if n not in (*bent, *at_edge)]
    return f"chi-squared is no parabola in {enumerated([named(n) for n in bent])}: " + (
        f"intervals of {enumerated([named(n) for n in (*bent, *also)])} are by profile likelihood"
        f"{' but for those named before' if at_edge else ''}; take the intervals, not the standard "
        "errors"
        if profiled
        else "intervals of the normal approximation are wrong there, and those by profile "
        f"likelihood ({Argument('profile')}) take several times as long as the fit"
    )


def _ends(
    objective: Objective, at: Parabola, i: int, along: Profile | None
) -> list[tuple[float, float]]:
    """Intervals of a coordinate, one for each level."""
    low, high = objective.unknowns[i].bounds
    ends = []
    for level in LEVELS:
        # Factor by which estimated noise widens an interval.
        wider = float(stdtrit(at.freedom[i], (1 + level) / 2) / ndtri((1 + level) / 2))
        wider *= float(at.se[i] / at.sd[i])
        if along is not None:
            ends.append(along.interval(level, wider))
        elif at.missing[i] or at.stopped:
            ends.append((low, high))
        else:
            sd = wider * float(at.sd[i])
            ends.append(_normal(objective.unknowns[i], at, i, sd, level))
    return ends


def _normal(unknown: Unknown, at: Parabola, i: int, sd: float, level: float) -> Interval:
    """An interval of the normal approximation, which contains the estimate."""
    u = float(at.u[i])
    begin, end = bounded_interval(float(at.unbounded[i]), sd, level, *unknown.bounds)
    begin, end = min(begin, u), max(end, u)
    if unknown.nuisance:
        return begin, end
    # An end outside the search range is open: the data do not bound such a side.
    low, high = unknown.bounds
    first, last = unknown.range_about(u, float(at.sd[i]))
    return low if -math.inf < begin < first else begin, high if math.inf > end > last else end


def _estimate(
    objective: Objective,
    at: Parabola,
    i: int,
    ends: Sequence[tuple[float, float]],
    rivals: Sequence[tuple[Float, float]],
) -> Estimate:
    """A parameter with its intervals, widened by other minima."""
    unknown = objective.unknowns[i]
    low, high = unknown.bounds
    above = [(v, value - at.chi2) for v, value in rivals]
    whole = [
        _widened_by_minima(objective, i, interval, above, level)
        for interval, level in zip(ends, LEVELS, strict=True)
    ]
    narrow, wide = ((unknown.end(a), unknown.end(b)) for a, b in whole)
    value = float(unknown.to_value(at.u[i]))
    # The whole range lies within a standard error that the data do not determine.
    width = min(max(float(at.sd[i]), 1e-12), UNDETERMINED)
    return Estimate(
        unknown.name,
        unknown.parameter.unit,
        value,
        math.inf if at.missing[i] else abs(unknown.slope(value)) * float(at.se[i]),
        narrow,
        wide,
        bool(min(at.u[i] - low, high - at.u[i]) < _AT_BOUND * width),
        unknown.prior,
    )


def _fit_with(
    objective: Objective,
    at: Parabola,
    estimates: Mapping[str, Estimate],
    rivals: Sequence[tuple[Float, float]],
) -> Fit:
    """The record of a fit, without its warnings."""
    pairs = zip(objective.terms, at.data, strict=True)
    deviance = -2 * sum(term.log_likelihood(d) for term, d in pairs)
    n, k = at.readings, at.fitted
    return Fit(
        law=objective.law.name,
        converged=True,
        message="converged",
        parameters=dict(estimates),
        correlation=at.total / np.outer(at.se, at.se),
        undetermined=tuple(
            name for name, e in estimates.items() if name in at.undetermined or not _bounded(e)
        ),
        chi2=at.judging,
        dof=at.dof,
        p_value=at.p_value,
        log_likelihood=-deviance / 2,
        aicc=deviance + aicc_penalty(k, n),
        bic=deviance + k * math.log(n),
        observables=_observables(at.data),
        residuals=at.data,
        optima=tuple(
            Optimum(at.judging + value - at.chi2, objective.named(v)) for v, value in rivals
        ),
        objective=objective,
    )


def _bounded(estimate: Estimate) -> bool:
    """Whether the 95 % interval of a parameter is bounded and contains its estimate."""
    low, high = estimate.interval_95
    return low <= estimate.value <= high and (low > 0 or low < 0 or math.isfinite(high))


def _profiled(
    objective: Objective, covariance: Float, odd: set[str], *, everything: bool
) -> set[int]:
    """Coordinates whose intervals are by profile likelihood.

    All coordinates on request. Otherwise those for which the normal approximation fails, and those
    correlated with them; but none with recordings, which would take several times as long as the
    fit.
    """
    if everything:
        return set(range(len(objective.unknowns)))
    if not objective.noise_is_known:
        return set()
    sd = np.sqrt(np.diag(covariance))
    correlated = np.abs(covariance / np.outer(sd, sd)) > _TOGETHER
    strange = [i for i, name in enumerate(objective.names) if name in odd]
    return {i for i in range(len(sd)) if i in strange or correlated[i, strange].any()}


def _contradicted(objective: Objective, at: Parabola) -> list[str]:
    """Sentences on priors that the data contradict.

    The residual of a prior at the maximum has the variance 1 - j C j^T, where j is its derivative
    and C the covariance of the coordinates.
    """
    values, slopes = objective.prior_residuals(at.u)
    with_prior = [(k, k.prior) for k in objective.unknowns if k.prior is not None]
    warnings = []
    for (unknown, prior), r, j in zip(with_prior, values, slopes, strict=True):
        apart = abs(r) / math.sqrt(max(1 - float(j @ at.covariance @ j), 1e-6))
        # A gain is a nuisance whose prior is the user's.
        if (unknown.logarithmic or not unknown.nuisance) and apart > _CONTRADICTED:
            warnings.append(
                f"the prior of {named(unknown.name)}, {prior.mean:.4g} +- {prior.sd:.2g} "
                f"{unknown.parameter.unit}".rstrip()
                + f", is contradicted by the data by {apart:.3g} standard deviations: one of them "
                "is wrong, and the other parameters follow it; fit without it and compare"
            )
    return warnings


def _observables(data: Sequence[Residuals]) -> dict[str, tuple[float, int]]:
    """Chi-squared and number of data of each observable, over all terms."""
    values = np.concatenate([d.values for d in data])
    names = np.concatenate([d.observable for d in data])
    return {
        str(name): (float(np.sum(values[names == name] ** 2)), int((names == name).sum()))
        for name in dict.fromkeys(names)
    }


def _not_parabolic(objective: Objective, at: Parabola) -> list[str]:
    """Parameters for which the normal approximation fails.

    Two standard deviations away in a coordinate, with the other coordinates following, chi-squared
    should rise by four.
    """
    low, high = objective.bounds
    sd = at.sd
    result = []
    for i, unknown in enumerate(objective.unknowns):
        widest = unknown.widest(float(at.u[i]))
        if unknown.nuisance or at.missing[i] or not _PRECISE < sd[i] <= widest:
            continue
        for sign in (-1, 1):
            point = at.u + sign * _COMPARED_AT * at.covariance[:, i] / sd[i]
            if (point <= low).any() or (point >= high).any():
                continue  # an interval next to a bound
            rise = objective.chi2(point) - at.chi2
            if rise > _HIGHEST_RISE:
                # A valley that bends may still have the right width.
                rise = _chi2_after_step(objective, point, i) - at.chi2
            if not _LOWEST_RISE <= rise <= _HIGHEST_RISE:
                result.append(unknown.name)
                break
    return result


def _open_ended(objective: Objective, at: Parabola, bent: Sequence[str]) -> list[str]:
    """Parameters in `bent` that the data do not bound on one side, and parameters that follow them.

    A transient longer than its recording is a trend, which many pairs of D0 and B explain. A
    parameter is unbounded if chi-squared, minimised at a value that differs by two factors of e,
    stays within the 95 % limit. Parameters that change as much along the way are unbounded too.
    """
    result = []
    best = objective.named(at.u)
    for name in bent:
        i = objective.names.index(name)
        for sign in (-1, 1):
            x = float(
                np.clip(at.u[i] + sign * _COMPARED_AT * UNDETERMINED, *objective.unknowns[i].bounds)
            )
            there = objective.minimise(at.u, {i: x}, tolerance=1e-4)
            if there.chi2 - at.chi2 < _COMPARED_AT**2:
                values = objective.named(there.u)
                # Those that differ by more than a factor of e, or in their sign.
                share = 1 - math.exp(-UNDETERMINED)
                pairs = [(k.name, values[k.name], best[k.name]) for k in objective.interest]
                changed = [n for n, a, b in pairs if abs(a - b) > share * max(abs(a), abs(b))]
                result += [name, *changed]
    return list(dict.fromkeys(result))


def _chi2_after_step(objective: Objective, u: Float, i: int) -> float:
    """Chi-squared after a Gauss-Newton step from u that keeps coordinate i."""
    r, J = objective.residuals(u)
    if not np.isfinite(r).all():
        return math.inf
    others = np.arange(u.size) != i
    step = np.zeros_like(u)
    step[others] = -np.linalg.lstsq(J[:, others], r, rcond=1e-10)[0]
    low, high = objective.bounds
    trial = np.clip(u + step, low + 1e-10, high - 1e-10)
    return min(objective.chi2(trial), float(r @ r))


def _rivals(
    objective: Objective, minima: Sequence[tuple[Float, float]], sd: Float
) -> list[tuple[Float, float]]:
    """Other minima that the data do not exclude and that differ in the parameters of interest."""
    of_interest = np.array([not k.nuisance for k in objective.unknowns])
    kept = [minima[0]]
    for u, chi2 in minima[1:]:
        if chi2 - minima[0][1] > RIVAL:
            continue
        # Minima that differ only in nuisances, such as the times of steps, are the same answer.
        away = [(np.abs(u - v)[of_interest] / sd[of_interest]).max(initial=0.0) for v, _ in kept]
        if min(away) >= _NEAR:
            kept.append((u, chi2))
    return kept[1:]


def _widened_by_minima(
    objective: Objective,
    i: int,
    interval: tuple[float, float],
    rivals: Sequence[tuple[Float, float]],
    level: float,
) -> tuple[float, float]:
    """An interval widened by other minima that stay below the threshold of chi-squared.

    Parameters
    ----------
    rivals : sequence of (array, float)
        Coordinates and rise of chi-squared above the lowest minimum.
    """
    low, high = interval
    threshold = float(chdtri(1, 1 - level))
    bounds = objective.unknowns[i].bounds
    for v, rise in rivals:
        if rise >= threshold:
            continue
        J = objective.residuals(v)[1]
        reach = 0.0
        # At the edge of the region with orbits a minimum may not be reached again.
        if np.isfinite(J).all():
            sd = math.sqrt(inverse_information(J.T @ J)[0][i, i])
            reach = sd * math.sqrt(threshold - rise)
        low, high = min(low, v[i] - reach), max(high, v[i] + reach)
    return max(low, min(interval[0], bounds[0])), min(high, max(interval[1], bounds[1]))


def _with_warnings(fit: Fit, outliers: tuple[int, ...], warnings: list[str]) -> Fit:
    """The fit with its outliers and warnings, added to those in `warnings`."""
    if fit.dof > 0 and fit.p_value < MISFIT:
        sums = fit.observables.items()
        worst, _ = max(sums, key=lambda pair: (pair[1][0] - pair[1][1]) / math.sqrt(2 * pair[1][1]))
        warnings.append(
            f"chi-squared {fit.chi2:.4g} for {fit.dof} degrees of freedom (p = "
            f"{fit.p_value:.2g}) says that the law or the uncertainties are wrong, most of all "
            f"for {worst}; intervals do not hold then"
        )
    if (
        fit.dof > 0
        and FAR_OFF < fit.p_value < _DOUBTFUL
        and any(term.searches for term in fit.objective.terms)
    ):
        warnings.append(
            f"orbits of this table are searched for, and with p = {fit.p_value:.2g} a better "
            "minimum may lie where the search, which is a short one, found none at some row: fit "
            "again from other start values, and without the slowest modulations"
        )
    if fit.dof > 5 and fit.p_value > 1 - MISFIT / 10:
        warnings.append(
            f"chi-squared {fit.chi2:.4g} for {fit.dof} degrees of freedom is too small: the "
            "uncertainties are too large, and so are the intervals"
        )
    u = fit.objective.coordinates(fit.values)
    slopes = [r.jacobian for r in fit.residuals] + [fit.objective.prior_residuals(u)[1]]
    information = np.sum([J.T @ J for J in slopes], axis=0)
    for term, residuals in zip(fit.objective.terms, fit.residuals, strict=True):
        warnings += term.warnings(residuals, information, outliers)
    if not fit.p_value < MISFIT:
        warnings += fit.objective.instability(u)
    for term in fit.objective.terms:
        warnings += term.reversal(fit.values)
    because = {name: _why_undetermined(fit, name) for name in fit.undetermined}
    warnings += because.values()
    for name, estimate in fit.parameters.items():
        if estimate.at_bound:
            warnings.append(
                f"{named(name)} is at its bound {quantity_text(estimate.value, estimate.unit)}"
            )
    for other in fit.optima:
        at = ", ".join(
            f"{named(n)} {quantity_text(other.values[n], p.unit)}"
            for n, p in fit.parameters.items()
        )
        warnings.append(
            f"another minimum of chi-squared lies {other.chi2 - fit.chi2:.3g} higher, at {at}: "
            "intervals hold both where the data allow both; measure at other operating points to "
            "tell them apart"
        )
    return replace(fit, sentences=tuple(warnings), because=because, outliers=outliers)


def _why_undetermined(fit: Fit, name: str) -> str:
    names = list(fit.parameters)
    i = names.index(name)
    partners = [
        named(other)
        for j, other in enumerate(names)
        if j != i and abs(fit.correlation[i, j]) > 0.98
    ]
    if partners:
        return (
            f"{named(name)} is not determined by these data together with "
            f"{enumerated(partners)}: they change the predictions in the same way; fix one of "
            "them, give a prior, or measure at points that distinguish them"
        )
    return (
        f"{named(name)} is not determined by these data; fix it or give a prior: the intervals "
        "of the other parameters hold only for values near the present one"
    )
