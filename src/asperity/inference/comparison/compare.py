"""Comparison of laws: those that the data exclude, and measurements that would exclude others."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.special import chdtrc

from asperity.errors import InputError, enumerated, named, require, symbol, symbols, worded
from asperity.inference.comparison.evidence import (
    DISFAVOURED,
    EXCLUDED,
    FACTOR,
    IMPOSSIBLE,
    CrossValidation,
    Evidence,
    evidence_of,
    leave_one_run_out,
    support,
)
from asperity.inference.fitting.assembly import Data, listed_data
from asperity.inference.fitting.fit import fit
from asperity.inference.fitting.inputs import free_by_default
from asperity.inference.fitting.minima import FAR_OFF, GAIN, extends
from asperity.inference.fitting.plausibility import stiffness_that_describes
from asperity.inference.fitting.result import Fit, fit_record
from asperity.inference.holds import HealingTable, joined_holds
from asperity.inference.runs.assembly import RunOptions
from asperity.inference.tables.residuals import DESCRIBED, residuals_of, weights_of
from asperity.inference.tables.table import LockInTable, joined
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import UnfittableLawError, material_priors
from asperity.laws import get_law, registered
from asperity.materials import Material
from asperity.orbit import Outcome
from asperity.outputs.json import plain
from asperity.parameters import law_parameters
from asperity.parameters.arguments import typed
from asperity.parameters.parameter import Drawn, SummaryLine

#: Called with the number of finished laws; fractions are the finished part of the next law.
Report = Callable[[float], None]
#: Steps of progress for the fit of a law, and for its evidence.
_STEPS = 100
#: Random starts of a fit that is repeated without outliers.
_STARTS_WITHOUT_OUTLIERS = 16
#: Factors of amplitude, velocity and frequency at which the predictions of two laws are compared.
_FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
#: Largest amplitude on the contacts for that comparison.
_LARGEST_EPSILON = 0.95


@dataclass(frozen=True)
class Judged:
    """A fitted law and whether the data exclude it.

    Attributes
    ----------
    fit : Fit
    excluded : bool
    why : str
    weight : float
        Akaike weight among the laws compared.
    evidence : Evidence or None
        None if not requested, or if the fit did not converge.
    cross_validation : CrossValidation or None
        The same.
    """

    fit: Fit
    excluded: bool
    why: str
    weight: float
    evidence: Evidence | None = None
    cross_validation: CrossValidation | None = None


class Standing(NamedTuple):
    """The result for a law relative to the best law.

    Attributes
    ----------
    word : {"excluded", "disfavoured", "cannot tell", "no fit"}
    number : str
        The deciding number, with its thresholds.
    """

    word: Literal["excluded", "disfavoured", "cannot tell", "no fit"]
    number: str


@dataclass(frozen=True, repr=False)
class Comparison(Drawn):
    """Laws fitted to the same data.

    Attributes
    ----------
    laws : mapping of str to Judged
        Fitted laws in order of rising AICc.
    decided : bool
        Whether exactly one law is not excluded, and describes the data.
    best : str
        Law with the lowest AICc; empty if no fit converged.
    judgement : str
        The verdict before `asperity.errors.worded`.
    left_out : tuple of str
        Rows that the verdict leaves out: no law describes them together with the other rows.
    not_compared : mapping of str to str
        Laws that could not be fitted, with the reasons.
    """

    _drawn_by = "asperity.fit_report.folder:draw_comparison"

    laws: Mapping[str, Judged]
    decided: bool
    best: str
    judgement: str
    left_out: tuple[str, ...] = ()
    not_compared: Mapping[str, str] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """Which laws the data exclude, and why, in sentences."""
        return worded(self.judgement)

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """The verdict, and the standing of each law."""
        lines = [SummaryLine("verdict", self.verdict)]
        for name in self.laws:
            word, number = self.standing(name)
            lines.append(SummaryLine(name, "lowest AICc" if name == self.best else word, number))
        return "Comparison of laws", lines

    def standing(self, name: str) -> Standing:
        """The result for a law relative to the best law, and the deciding number."""
        judged, best = self.laws[name], self.laws.get(self.best)
        result = judged.fit
        if best is None or not result.converged:
            return Standing("no fit", "")
        behind = result.aicc - best.fit.aicc
        by_aicc = (
            f"AICc {behind:.3g} above the lowest (from {DISFAVOURED:g} disfavoured, from "
            f"{EXCLUDED:g} excluded)"
        )
        if judged.excluded:
            if result.judged_by_chi2 and result.p_value < IMPOSSIBLE and behind < EXCLUDED:
                by_chi2 = f"p = {result.p_value:.2g} (excluded below {IMPOSSIBLE:g})"
                return Standing("excluded", by_chi2)
            return Standing("excluded", by_aicc)
        if behind >= DISFAVOURED:
            return Standing("disfavoured", by_aicc)
        lost = _evidence_lost(best, judged)
        if lost >= math.log(FACTOR):
            factor = f"{math.exp(min(lost, 700.0)):.2g} (from {FACTOR:g} disfavoured)"
            return Standing("disfavoured", f"evidence lower by a factor of {factor}")
        return Standing("cannot tell", by_aicc)


def _evidence_lost(best: Judged, other: Judged) -> float:
    """Logarithm of the ratio of the evidences of two laws; NaN if not reliable."""
    a, b = best.evidence, other.evidence
    return a.log - b.log if a and b and a.reliable and b.reliable else math.nan


@typed
def compare(
    data: Data | Iterable[Data],
    laws: Sequence[str],
    free: Sequence[str] | None = None,
    *,
    evidence: bool = True,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> Comparison:
    """Fit several laws to the same data, and determine which of them the data exclude.

    Parameters
    ----------
    data : LockInTable, RecordedRun or Trace, or several
    laws : sequence of str
    free : sequence of str, optional
        Free parameters; each law takes those that it has. A law that has none of them is compared
        with its fixed numbers. The default is that of `fit` for each law.
    evidence : bool
        Whether to compute evidence and leave-one-run-out cross-validation too.
    progress : callable, optional
        Called with the work done so far and all work: a hundred for the fit of each law, and a
        hundred for its evidence and cross-validation.
    **options
        As in `fit`.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        As `fit`; if fewer than two laws are given, or no law has one of the free parameters; if
        fewer than two laws can be fitted, and have two data more than free parameters.

    Notes
    -----
    The rule was fixed beforehand. A law is excluded in two cases. (1) Its chi-squared has a
    probability below 0.001, while another law has a higher probability and an AICc that is lower
    by 4 or more. (2) Its AICc exceeds the lowest AICc by 10 or more. For recordings, whose noise is
    estimated from the residuals, only case 2 applies.

    If no law describes the data, the uncertainties may be too small: for case 2, chi-squared is
    then divided by the chi-squared per degree of freedom of the best law. The verdict also names
    the simplest law that would describe a table with another stiffness than the given one. If a
    few rows alone keep every law from describing the data, they are left out, and named.
    """
    rule = "be two or more"
    require(len(set(laws)) >= 2, "laws", rule, ", ".join(laws) or "none", "name those to compare")
    laws = tuple(dict.fromkeys(laws))
    _require_parameters_of(laws, free or ())
    several = listed_data(data, options.get("runs") or RunOptions())
    law_fits = _LawFits.of(laws, several, free, options)
    parts = 2 if evidence else 1

    def report(done: float) -> None:
        if progress is not None:
            progress(round(_STEPS * done), _STEPS * len(laws) * parts)

    fits = law_fits.best(several, report)
    if len(fits) < 2:
        rule, reasons = "be two or more that can be fitted to these data", law_fits.not_compared
        raise InputError("laws", rule, len(fits), "; ".join(reasons.values()))
    result = judge(fits)
    outliers = _common_outliers(fits)
    if outliers:
        tables = [d for d in several if isinstance(d, LockInTable)]
        holds = [d for d in several if isinstance(d, HealingTable)]
        table = joined(tables)[0] if tables else joined_holds(holds)
        out = np.isin(np.arange(table.rows), outliers)
        rest = judge(law_fits.best([table.without(out)], lambda _: None, fits))
        result = _without(result, rest, table.row_names[out].tolist())
    doubt, stretches = _support(result)
    not_compared = law_fits.not_compared
    # The table has the reason for each law.
    lacking = (
        f" Not compared: {enumerated(list(not_compared))}, because a number is neither free nor "
        "given, or because there are too few data."
    ) * bool(not_compared)
    judgement = doubt + result.judgement + stretches + _with_free_stiffness(result) + lacking
    result = replace(result, not_compared=not_compared, judgement=judgement)
    return _with_evidence(result, lambda done: report(len(laws) + done)) if evidence else result


def _require_parameters_of(laws: Sequence[str], free: Sequence[str]) -> None:
    """Refuse free parameters that only other laws have; the fit checks all other names."""
    of_any_law = {p for law in registered() for p in _parameters(law)}
    of_these = {p for law in laws for p in _parameters(law)}
    nobodys = [p for p in free if p in of_any_law - of_these]
    if nobodys:
        rule = "be parameters of the laws that are compared"
        got = f"'{symbol(nobodys[0])}', which none of {', '.join(laws)} has"
        raise InputError("free", rule, got, "leave it out, or add a law with it")


@dataclass
class _LawFits:
    """Fits of several laws, each with those free parameters and numbers that it has.

    Attributes
    ----------
    free : dict of str to list of str
        Free parameters of each law.
    of_others : dict of str to set of str
        For each law, the parameters that only others of these laws have.
    numbers : dict of str to dict
        The arguments "fixed", "start" and "prior" of `fit`.
    options : dict
        Its other arguments.
    not_compared : dict of str to str
        Laws that could not be fitted, with the reasons.
    """

    free: dict[str, list[str]]
    of_others: dict[str, set[str]]
    numbers: dict[str, Mapping[str, Any]]
    options: dict[str, Any]
    not_compared: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        laws: Sequence[str],
        data: Sequence[Any],
        free: Sequence[str] | None,
        options: Mapping[str, Any],
    ) -> _LawFits:
        """From the arguments of `compare`."""
        of_these = {p for law in laws for p in _parameters(law)}
        of_others = {law: of_these - set(_parameters(law)) for law in laws}
        fixed, material = options.get("fixed"), options.get("material")
        free_by_law = {
            name: (
                free_by_default(get_law(name), data, fixed, material)
                if free is None
                else [p for p in free if p not in of_others[name]]
            )
            for name in laws
        }
        others = dict(options)
        # An empty mapping means the same as None.
        numbers = {key: others.pop(key, None) or {} for key in ("fixed", "start", "prior")}
        if isinstance(numbers["prior"], Material):
            every = list(dict.fromkeys(n for names in free_by_law.values() for n in names))
            numbers["prior"] = material_priors(numbers["prior"], every)
        return cls(free_by_law, of_others, numbers, others)

    def best(
        self, data: Sequence[Any], report: Report, before: Mapping[str, Fit] | None = None
    ) -> dict[str, Fit]:
        """Fits of the laws, or of those in `before`, from where these begin."""
        fits = self._fitted(data, report, before)
        # A law is searched for further minima by itself if no law that extends it has a fit.
        converged = [name for name, f in fits.items() if f.converged]
        tried = self.free if before is None else before
        alone = {
            n: f
            for n, f in fits.items()
            if self._extended(n, tried) and not self._extended(n, converged)
        }
        if missed := alone | _better_at_extension(fits):
            fits |= self._fitted(data, lambda _: None, missed)
        return fits

    def _fitted(
        self, data: Sequence[Any], report: Report, before: Mapping[str, Fit] | None
    ) -> dict[str, Fit]:
        done: dict[str, Fit] = {}
        # Special cases are fitted before the laws that contain them, whose fits start there.
        names = sorted(self.free, key=lambda name: len(_parameters(name)))
        names = [name for name in names if before is None or name in before]
        for k, name in enumerate(names):
            arguments: dict[str, Any] = {
                key: {n: value for n, value in values.items() if n not in self.of_others[name]}
                for key, values in self.numbers.items()
            }
            if before and before[name].converged:
                # Nearly the same data, or the lower minimum of a law that extends this one.
                arguments["start"] = {n: before[name].values[n] for n in self.free[name]}
                far_off = before[name].law != name and before[name].p_value < FAR_OFF
                most = 0 if far_off else _STARTS_WITHOUT_OUTLIERS
                arguments["starts"] = min(most, self.options.get("starts", most))
            internal: dict[str, Any] = {
                "bare": True,
                "simpler": list(done.values()),
                # The search of a law that extends this one finds its minima too, see `best`.
                "further": not self._extended(name, names[k + 1 :]),
                "check_stiffness": False,
                "progress": lambda part, total, k=k: report(k + part / total),
            }
            try:
                result = fit(data, name, self.free[name], **internal, **self.options | arguments)
                _require_aicc(result)
                done[name] = result
            except UnfittableLawError as error:
                self.not_compared[name] = str(error)
            report(k + 1)
        return done

    def _extended(self, law: str, others: Iterable[str]) -> bool:
        """Whether one of the other laws extends a law by free parameters that may be zero."""
        chosen, own = get_law(law), set(_parameters(law))
        for name in others:
            # A parameter with a prior cannot take any value, such as that of a special case.
            may_be_zero = set(self.free[name]) - set(self.numbers["prior"])
            if extends(get_law(name), chosen) and set(_parameters(name)) - own <= may_be_zero:
                return True
        return False


def _require_aicc(fit: Fit) -> None:
    """Refuse a fit with too few data for its AICc, by which laws are compared.

    Raises
    ------
    UnfittableLawError
    """
    if math.isinf(fit.aicc):
        count = sum(residuals.values.size for residuals in fit.residuals)
        rule, got = "have more data for its AICc", f"{count} for {symbols(fit.parameters)}"
        advice = "give two data more than free parameters"
        raise UnfittableLawError(fit.law, rule, got, advice)


def _better_at_extension(fits: Mapping[str, Fit]) -> dict[str, Fit]:
    """Laws that describe a table better near the minimum of a law that extends them.

    The result has the fit of the extending law, with the values there, by the name of the law. If
    the extension is needed, the law describes the table worse there. A law that would describe it
    better if chi-squared were linear has its own fit, unless it would be far off.
    """
    missed = {}
    for name, result in fits.items():
        objective = result.objective
        for other in fits.values():
            if not (result.converged and other.converged and objective.has_table):
                continue
            extended = extends(other.objective.law, objective.law)
            extended &= set(objective.names) <= set(other.values)
            if not extended or other.chi2 > result.chi2 - GAIN:
                continue
            special, expected = _without_extension(other, objective.names)
            tried = result.values, other.values, special
            here, *there = (objective.chi2(objective.coordinates(values)) for values in tried)
            k = int(np.argmin(there))
            if there[k] < here - GAIN:
                values = tried[1 + k]
                moved = {n: replace(p, value=values[n]) for n, p in other.parameters.items()}
                missed[name] = replace(other, parameters=moved)
            elif expected < here - GAIN and not _far_off(expected, other):
                missed.setdefault(name, result)
    return missed


def _far_off(chi2: float, fit: Fit) -> bool:
    """Whether chi-squared is far off, with uncertainties so large that a fit describes the data."""
    dof = max(fit.dof, 1)
    return float(chdtrc(dof, chi2 / max(fit.chi2 / dof, 1.0))) < FAR_OFF


def _without_extension(fit: Fit, names: Collection[str]) -> tuple[dict[str, float], float]:
    """Values at which linearised chi-squared is least with extending parameters of zero, and it.

    `names` are the other parameters. If these are correlated with the extending ones, their
    estimates describe nothing by themselves, even where the latter differ from zero by noise only.
    """
    objective = fit.objective
    u = objective.coordinates(fit.values)
    _, J = objective.residuals(u)
    inside = np.array([k.name in names for k in objective.unknowns])
    # Without the coefficient of a state its memory length has no influence.
    zero = ~inside & ~np.array([k.logarithmic for k in objective.unknowns])
    change = np.where(zero, -u, 0.0)
    change[inside] = np.linalg.lstsq(J[:, inside], -J @ change)[0]
    low, high = np.transpose([k.bounds for k in objective.unknowns])
    values = objective.named(np.clip(u + change, low, high))
    return values, fit.chi2 + float(np.sum((J @ change) ** 2))


def _support(comparison: Comparison) -> tuple[str, str]:
    """Sentences on doubts and deciding stretches of the verdict on the best disfavoured law."""
    for judged in comparison.laws.values():
        best = comparison.laws[comparison.best].fit if comparison.best else judged.fit
        if judged.fit.converged and judged.fit.aicc - best.aicc >= DISFAVOURED:
            return support(best, judged.fit)
    return "", ""


def _with_free_stiffness(comparison: Comparison) -> str:
    """A sentence on a law that describes the data with a free stiffness, if no law does so else."""
    fits = [j.fit for j in comparison.laws.values() if j.fit.converged]
    if any(f.dof <= 0 or f.p_value >= IMPOSSIBLE for f in fits):
        return ""
    # The law with the fewest parameters: laws that extend it describe the data too.
    for f in sorted(fits, key=lambda f: len(f.parameters)):
        sentence = stiffness_that_describes(f)
        if sentence:
            return f" {sentence[0].upper()}{sentence[1:]}."
    return ""


def _common_outliers(fits: Mapping[str, Fit]) -> list[int]:
    """The smallest set of rows without which a law describes the data."""
    lists = [list(f.outliers) for f in fits.values() if f.converged and len(f.residuals) == 1]
    if not lists or any(
        f.converged and (f.dof <= 0 or f.p_value >= DESCRIBED) for f in fits.values()
    ):
        return []
    return min((rows for rows in lists if rows), key=len, default=[])


def _without(whole: Comparison, rest: Comparison, rows: Sequence[str]) -> Comparison:
    """The comparison without outliers; its verdict says what the outliers change."""

    def excluded(comparison: Comparison) -> list[str]:
        return sorted(name for name, j in comparison.laws.items() if j.excluded)

    which = "the same laws" if excluded(whole) == excluded(rest) else "other laws"
    outliers = (
        f"No law describes {enumerated(rows)} together with the other rows; check that "
        f"measurement. With it, {which} are excluded. Without it: "
    )
    return replace(rest, judgement=outliers + rest.judgement, left_out=tuple(rows))


def _with_evidence(comparison: Comparison, report: Report) -> Comparison:
    """The comparison with evidence and cross-validation of every law.

    Searched orbits and motions through recordings take minutes. For these, a law that is excluded
    or far from the data gets only the normal approximation of the evidence.
    """
    judged = {}
    for k, (name, j) in enumerate(comparison.laws.items(), 1):
        terms = j.fit.objective.terms
        slow = any(term.searches or term.profiled for term in terms)
        far_off = j.fit.judged_by_chi2 and j.fit.p_value < FAR_OFF
        if j.fit.converged and slow and (j.excluded or far_off):
            j = replace(j, evidence=evidence_of(j.fit, samples=0))
        elif j.fit.converged:
            j = replace(j, evidence=evidence_of(j.fit), cross_validation=leave_one_run_out(j.fit))
        judged[name] = j
        report(k)
    return replace(
        comparison,
        laws=judged,
        judgement=comparison.judgement + _second_opinion(judged, comparison.best),
    )


def _second_opinion(judged: Mapping[str, Judged], best: str) -> str:
    """Sentences on evidence and cross-validation of the laws that are not excluded."""
    sentences = ""
    left = [n for n, j in judged.items() if not j.excluded and j.evidence and n != best]
    for name in left if best in judged else ():
        apart = _evidence_lost(judged[best], judged[name])
        if not math.isnan(apart):
            ahead, behind = (best, name) if apart >= 0 else (name, best)
            factor = math.exp(min(abs(apart), 700.0))
            tells = (
                f"disfavours {behind} against" if factor >= FACTOR else f"cannot tell {behind} from"
            )
            sentences += (
                f" The evidence {tells} {ahead}: a factor of {factor:.2g}, of which {FACTOR:g} "
                "decides, with the priors stated."
            )
        first, second = judged[best].cross_validation, judged[name].cross_validation
        if first and second and math.isfinite(first.log_density + second.log_density):
            gain, error = first.difference(second)
            sentences += (
                f" Runs that were left out are predicted by {best} better than by {name} by "
                f"{gain:.2g} +- {error:.2g} in the log density."
            )
    return sentences


def judge(fits: Mapping[str, Fit]) -> Comparison:
    """Apply the rule of `compare` to fits of several laws."""
    done = {name: f for name, f in fits.items() if f.converged}
    if not done:
        return Comparison(
            {name: Judged(f, False, f.message, math.nan) for name, f in fits.items()},
            False,
            "",
            "These data were not described by any law: no fit converged.",
        )
    best = min(done, key=lambda name: done[name].aicc)
    describes = any(f.dof <= 0 or f.p_value >= IMPOSSIBLE for f in done.values())
    top = done[best]
    inflation = 1.0 if describes else max(1.0, top.chi2 / max(top.dof, 1))
    total = sum(math.exp(-(f.aicc - top.aicc) / 2) for f in done.values())
    judged = {}
    for name in sorted(fits, key=lambda n: fits[n].aicc if n in done else math.inf):
        result = fits[name]
        if name not in done:
            judged[name] = Judged(result, False, result.message, math.nan)
            continue
        weight = math.exp(-(result.aicc - top.aicc) / 2) / total
        judged[name] = Judged(result, *_excluded(result, top, describes, inflation), weight)
    left = [name for name, j in judged.items() if name in done and not j.excluded]
    decided = describes and len(left) == 1 and len(done) == len(fits)
    return Comparison(judged, decided, best, _verdict(judged, left, best, describes))


def _parameters(law: str) -> Collection[str]:
    return law_parameters(get_law(law))


def _excluded(result: Fit, best: Fit, describes: bool, inflation: float) -> tuple[bool, str]:
    if result is best:
        return False, ""
    behind = result.aicc - best.aicc
    if not result.judged_by_chi2:
        if behind < EXCLUDED:
            return False, ""
        return True, (
            f"its AICc is {behind:.4g} above that of {best.law}, its log-likelihood "
            f"{best.log_likelihood - result.log_likelihood:.4g} lower"
        )
    worst = max(
        result.observables,
        key=lambda n: result.observables[n][0] - best.observables.get(n, (0.0, 0))[0],
    )
    (chi2, n), rival = result.observables[worst], best.observables.get(worst, (0.0, 0))[0]
    where = (
        f"the worst observable is {worst} with chi-squared {chi2:.4g} for {n} data, where "
        f"{best.law} has {rival:.4g}"
    )
    misfit = result.dof > 0 and result.p_value < IMPOSSIBLE
    if misfit and describes and behind >= DISFAVOURED:
        return True, (
            f"chi-squared {result.chi2:.4g} for {result.dof} degrees of freedom has a probability "
            f"of {result.p_value:.2g}; {where}"
        )
    deviance = 2 * (best.log_likelihood - result.log_likelihood)
    fair = behind - deviance + deviance / inflation
    if fair >= EXCLUDED:
        even = (
            f", and {fair:.4g} above it if all uncertainties are {math.sqrt(inflation):.3g} times "
            "as large"
            if inflation > 1
            else ""
        )
        return True, f"its AICc is {behind:.4g} above that of {best.law}{even}; {where}"
    return False, ""


def _verdict(judged: Mapping[str, Judged], left: Sequence[str], best: str, describes: bool) -> str:
    out = [name for name, j in judged.items() if j.excluded]
    unknown = [name for name, j in judged.items() if not j.fit.converged]
    parts = []
    if not describes:
        f = judged[best].fit
        factor = math.sqrt(f.chi2 / max(f.dof, 1))
        parts.append(
            f"No law describes these data within their uncertainties: the best, {best}, has "
            f"chi-squared {f.chi2:.4g} for {f.dof} degrees of freedom; either all laws are wrong "
            f"or the uncertainties are too small by a factor of about {factor:.3g}; with that "
            + (f"the data exclude {enumerated(out)}" if out else "the data exclude no law")
        )
    elif len(left) == 1 and not unknown:
        parts.append(f"These data favour {left[0]} and exclude {enumerated(out)}")
    else:
        lowest = min(judged[name].fit.aicc for name in left)
        behind = {name: judged[name].fit.aicc - lowest for name in left}
        near = [name for name in left if behind[name] < DISFAVOURED]
        far = [f"{name} (AICc {behind[name]:.3g} above)" for name in left if name not in near]
        words = [
            f"exclude {enumerated(out)}" if out else "",
            f"disfavour {enumerated(far)}" if far else "",
            f"cannot tell {enumerated(near)} apart" if len(near) > 1 else f"prefer {near[0]}",
        ]
        parts.append(f"These data {enumerated([word for word in words if word])}")
    parts += [f"{name}: {judged[name].why}" for name in out if judged[name].fit.judged_by_chi2]
    by_likelihood = [name for name in out if not judged[name].fit.judged_by_chi2]
    if by_likelihood:
        nearest = by_likelihood[0]
        which = (
            f"{nearest}, the nearest of them, has an AICc"
            if by_likelihood[1:]
            else f"the AICc of {nearest} is"
        )
        gap = judged[nearest].fit.aicc - judged[best].fit.aicc
        parts.append(f"{which} {gap:.3g} above that of {best}, and {EXCLUDED:g} excludes")
    if unknown:
        parts.append(f"{enumerated(unknown)} cannot be judged: no fit converged")
    if describes and len(left) > 1:
        parts.append(what_would_tell(judged[left[0]].fit, judged[left[1]].fit))
    return "; ".join(p for p in parts if p) + "."


def what_would_tell(first: Fit, second: Fit) -> str:
    """A sentence on the operating point at which the predictions of two fitted laws differ most.

    The points are those of the data, with velocity, amplitude and frequency changed by factors up
    to 4. Differences are in units of the median uncertainty of each observable.
    """
    terms = first.objective.terms_of(LockInTerm)
    if not terms:
        return ""
    table, motion = terms[0].table, terms[0].motion
    largest = float(table.points["epsilon"].max())
    # Free or fixed.
    ratio = max(float({**f.objective.fixed, **f.values}["eps_ratio"]) for f in (first, second))
    typical = {n: np.full(table.rows, np.nanmedian(e)) for n, e in table.errors.items()}
    farthest, sentence = 0.0, ""
    for name, factor in itertools.product(("V", "epsilon", "frequency"), _FACTORS):
        if name == "epsilon" and largest * factor * ratio >= _LARGEST_EPSILON:
            continue
        points = {**table.points, name: table.points[name] * factor}
        trial = LockInTable(table.name, points, table.values, typical)
        weights, residuals = weights_of(trial), []
        for f in (first, second):
            constants = {**f.objective.fixed, name: points[name]}
            term = LockInTerm(trial, f.objective.law, constants, **motion)
            prediction, _, outcome = term.predicted(f.values)
            if (outcome == Outcome.CONVERGED).all():
                residuals.append(residuals_of(weights, prediction, {}))
        if len(residuals) < 2:
            continue
        a, b = residuals
        apart = np.abs(a.values - b.values)
        j = int(np.argmax(apart))
        if apart[j] > farthest:
            farthest, row = float(apart[j]), a.row[j]
            sentence = (
                "what would tell them apart best among points near the measured ones: "
                f"{a.observable[j]} at {named('V')} = {points['V'][row]:.3g} m/s, "
                f"eps = {points['epsilon'][row]:.3g}, f = {points['frequency'][row]:.4g} Hz, "
                f"where they differ by {farthest:.2g} of its standard uncertainties"
            )
    return sentence


def comparison_record(comparison: Comparison) -> dict[str, Any]:
    """The comparison as plain numbers and texts, for JSON."""
    return {
        "laws": {
            name: {
                **fit_record(judged.fit),
                "excluded": judged.excluded,
                "why": judged.why,
                "standing": comparison.standing(name).word,
                "deciding": comparison.standing(name).number,
                "weight": plain(judged.weight),
                "evidence": judged.evidence and plain(asdict(judged.evidence)),
                "leave_one_run_out": judged.cross_validation
                and plain(asdict(judged.cross_validation)),
            }
            for name, judged in comparison.laws.items()
        },
        "left_out": list(comparison.left_out),
        "not_compared": dict(comparison.not_compared),
        "decided": comparison.decided,
        "best": comparison.best,
        "verdict": comparison.verdict,
    }


def laws_table(
    comparison: Comparison, *, reasons: bool = False
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Table of the laws in the order of the comparison: names of the columns, and rows of text.

    The table has the deciding numbers: chi-squared if uncertainties are given, the logarithm of the
    likelihood if the noise is estimated. With `reasons`, it says why a law is excluded.
    """
    fits = [j.fit for j in comparison.laws.values() if j.fit.converged]
    lowest = min((f.aicc for f in fits), default=0.0)
    # If the noise is estimated from the same residuals, chi-squared cannot judge a law.
    by_chi2 = any(f.judged_by_chi2 for f in fits)
    numbers = ("chi-squared", "dof", "p") if by_chi2 else ("log-likelihood",)
    head = ("law", *numbers, "AICc - lowest", "weight", "ln evidence", "")
    nothing = ("",) * (len(head) - 2)
    rows = []
    for name, j in comparison.laws.items():
        f = j.fit
        if not f.converged:
            rows.append((name, *nothing, f.message))
            continue
        shown = (f"{f.chi2:.4g}", str(f.dof), f"{f.p_value:.2g}")
        evidence = f"{j.evidence.log:.2f}" if j.evidence else ""
        # For excluded laws with searched orbits this is the normal approximation.
        if j.evidence and math.isfinite(j.evidence.standard_error):
            evidence += f" +- {j.evidence.standard_error:.2g}"
        word, number = comparison.standing(name)
        notes = [f"{word}: {number}" if name != comparison.best else "lowest AICc"]
        notes += [j.why] if reasons and j.excluded else []
        if f.undetermined:
            notes.append(f"{symbols(f.undetermined)} not determined")
        rows.append(
            (
                name,
                *(shown if by_chi2 else (f"{f.log_likelihood:.2f}",)),
                f"{f.aicc - lowest:.4g}",
                f"{j.weight:.2g}",
                evidence,
                "; ".join(notes),
            )
        )
    rows += [
        (name, *nothing, f"not compared: {why}") for name, why in comparison.not_compared.items()
    ]
    return head, rows
