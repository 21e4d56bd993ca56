"""The result of a fit: estimates with intervals, quality and warnings, and its JSON record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from asperity._version import __version__
from asperity.arrays import Float
from asperity.errors import worded
from asperity.inference.fitting.intervals import Interval
from asperity.inference.objective import Objective, Residuals
from asperity.inference.runs.assembly import ONE_LOAD
from asperity.inference.runs.rate_dependence import LevelChange, level_change
from asperity.inference.runs.term import RunTerm
from asperity.inference.unknowns import EPS_RATIO, Prior
from asperity.outputs.json import plain
from asperity.outputs.sections import rounded, two_digits
from asperity.parameters import law_parameters, point_parameters
from asperity.parameters.parameter import Drawn, SummaryLine
from asperity.units import display_unit

T = TypeVar("T")

#: Text in place of an estimate that the data do not determine.
NOT_DETERMINED = "not determined"
#: p-value of chi-squared below which the law or the uncertainties are wrong.
MISFIT = 0.01
#: Standard errors from which the sign of A - B is known.
_KNOWN_SIGN = 2.0


class Warned:
    """A result whose warnings have the names of parameters in use where they are read.

    Attributes
    ----------
    sentences : tuple of str
        The warnings before `asperity.errors.worded`.
    """

    sentences: tuple[str, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings, a sentence each."""
        return tuple(map(worded, self.sentences))


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter in SI.

    Attributes
    ----------
    name, unit : str
    value, se : float
        Estimate and standard error of the normal approximation at the maximum.
    interval_68, interval_95 : (float, float)
        By the normal approximation in the coordinate of the fit, which is the logarithm of a
        positive parameter, or by profile likelihood if requested. Ends that data do not bound are
        0 or infinite.
    at_bound : bool
    prior : Prior or None
    """

    name: str
    unit: str
    value: float
    se: float
    interval_68: Interval
    interval_95: Interval
    at_bound: bool
    prior: Prior | None


class Shown(NamedTuple):
    """An estimate as text: in a readable unit, with as many digits as its error allows.

    Attributes
    ----------
    value, unit : str
        Text of the value, and its unit.
    power : int
        The unit is 10^power times the SI unit.
    number, se : float
        Value and standard error, in that unit.
    """

    value: str
    unit: str
    power: int
    number: float
    se: float

    @classmethod
    def of(cls, value: float, se: float, unit: str) -> Shown:
        """The text of a value and standard error in SI; the larger of the two sets the unit."""
        shown, power = display_unit(max(abs(value), se) if math.isfinite(se) else value, unit)
        scale = 10.0**-power
        return cls(rounded(value * scale, se * scale)[0], shown, power, value * scale, se * scale)

    def error(self, se: float) -> str:
        """A standard error in SI as text."""
        return two_digits(se * 10.0**-self.power)

    def interval(self, ends: Interval) -> str:
        """An interval in SI as text; "not determined" if the data bound neither side."""
        low, high = ends
        if not (math.isfinite(high) or (math.isfinite(low) and low > 0)):
            return NOT_DETERMINED
        # The far end of a skew interval has fewer significant digits.
        low_text, high_text = (
            rounded(end, max(self.se, abs(end - self.number) / 4))[0]
            for end in (low * 10.0**-self.power, high * 10.0**-self.power)
        )
        if not math.isfinite(high):
            return f"above {low_text}"
        return f"{low_text} to {high_text}" if math.isfinite(low) else f"below {high_text}"


@dataclass(frozen=True)
class Optimum:
    """Another minimum of chi-squared."""

    chi2: float
    values: Mapping[str, float]


class RateDependence(NamedTuple):
    """A - B of a fit, the slope d mu_ss/d ln V; A - B - B2 of a law with two states.

    Attributes
    ----------
    value, error : float
        The slope and its standard error, from the errors of its parts and their correlation.
    meaning : str
        Velocity weakening or strengthening, or that the sign is not determined.
    name : str
        "A - B" or "A - B - B2".
    """

    value: float
    error: float
    meaning: str
    name: str = "A - B"

    @property
    def shown(self) -> str:
        """Value and error as text."""
        return with_error(self.value, self.error)


def with_error(value: float, error: float) -> str:
    """Value and error as text, rounded to two digits of the error."""
    places = max(0, 1 - math.floor(math.log10(error))) if error else 6
    return f"{value:.{places}f} +- {error:.{places}f}"


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Warned, Drawn):
    """A law fitted to data.

    Attributes
    ----------
    law : str
    converged : bool
    message : str
        "converged", or the reason why not; without convergence all numbers are NaN.
    parameters : mapping of str to Estimate
    objective : Objective
        Data, law and free parameters: the function that was minimised.
    correlation : array, shape (n, n)
        Correlation of the coordinates of the fit, in the order of `parameters`; empty if not
        converged.
    undetermined : tuple of str
        Parameters that these data do not determine: their standard error exceeds a factor of e.
    chi2 : float
        Chi-squared of the data with given uncertainties and of priors; of all data if all noise is
        estimated.
    dof : int
    p_value : float
        Probability of a larger chi-squared if law and uncertainties are right.
    log_likelihood, aicc, bic : float
    observables : mapping of str to (float, int)
        Chi-squared and number of data of each observable.
    residuals : tuple of Residuals
        Residuals of each term of the objective at the maximum, without priors; the Jacobian is the
        derivative with respect to the coordinates of the fit.
    optima : tuple of Optimum
        Other minima that the data do not exclude.
    sentences : tuple of str
        As in `Warned`, which has the warnings.
    because : mapping of str to str
        The one of `sentences` that says why a parameter is not determined, by its name.
    outliers : tuple of int
        Rows of the table (from 0) that the law does not describe, while it describes all others; at
        most a tenth of the rows, or two if there are eight or more.
    """

    _drawn_by = "asperity.fit_report.pictures:draw_fit"

    law: str
    converged: bool
    message: str
    parameters: Mapping[str, Estimate]
    objective: Objective
    correlation: Float = field(default_factory=lambda: np.full((0, 0), math.nan))
    undetermined: tuple[str, ...] = ()
    chi2: float = math.nan
    dof: int = 0
    p_value: float = math.nan
    log_likelihood: float = math.nan
    aicc: float = math.nan
    bic: float = math.nan
    observables: Mapping[str, tuple[float, int]] = field(default_factory=dict)
    residuals: tuple[Residuals, ...] = ()
    optima: tuple[Optimum, ...] = ()
    sentences: tuple[str, ...] = ()
    because: Mapping[str, str] = field(default_factory=dict)
    outliers: tuple[int, ...] = ()

    def parts(self, kind: type[T]) -> list[tuple[T, Residuals]]:
        """All terms of one kind, tables or recordings, each with its residuals."""
        pairs = zip(self.objective.terms, self.residuals, strict=True)
        return [(term, residuals) for term, residuals in pairs if isinstance(term, kind)]

    @property
    def level_change(self) -> LevelChange | None:
        """Slope d mu/d ln V of the steady friction of the recordings, measured without a law."""
        runs = [term.run for term in self.objective.terms_of(RunTerm)]
        return level_change([rate for run in runs for rate in run.level_rates])

    @property
    def rate_dependence(self) -> RateDependence | None:
        """A - B; None where the law has no A and B, or one of them is not determined.

        A second state adds its coefficient, B2. None too if one of them is fixed to several values,
        one for each row of a table.
        """
        signs = {"A": 1.0, "B": -1.0}
        if "B2" in law_parameters(self.objective.law):
            signs["B2"] = -1.0

        def slope(values: Mapping[str, float]) -> float:
            return sum(sign * values[n] for n, sign in signs.items())

        fixed = {n: np.unique(self.objective.fixed.get(n, ())) for n in signs}
        known = {n: float(v[0]) for n, v in fixed.items() if v.size == 1} | self.values
        free = [i for i, name in enumerate(self.parameters) if name in signs]
        if not free or not signs.keys() <= known.keys() - {*self.undetermined}:
            return None
        value = slope(known)
        errors = np.array([signs[n] * p.se for n, p in self.parameters.items() if n in signs])
        variance = float(errors @ self.correlation[np.ix_(free, free)] @ errors)
        if not math.isfinite(variance):
            return None
        error = math.sqrt(max(variance, 0.0))
        # Another minimum that the data allow may have the opposite sign.
        near = [o.values for o in self.optima if o.chi2 - self.chi2 < _KNOWN_SIGN**2]
        others = [{**known, **values} for values in near]
        known_sign = abs(value) > _KNOWN_SIGN * error and all(
            value * slope(other) > 0 for other in others
        )
        kind = "velocity weakening" if value < 0 else "velocity strengthening"
        meaning = kind if known_sign else "its sign is not determined"
        return RateDependence(value, error, meaning, " - ".join(signs))

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why the estimates are doubtful."""
        doubts = [doubt for term in self.objective.terms_of(RunTerm) for doubt in term.doubts]
        if self.judged_by_chi2 and self.dof > 0 and self.p_value < MISFIT:
            doubts.append(
                "the law does not describe the data within their uncertainties "
                f"(p = {self.p_value:.2g})"
            )
        return tuple(doubts)

    @property
    def judged_by_chi2(self) -> bool:
        """Whether chi-squared judges the law.

        It does not if all noise is estimated from the residuals, as with recordings: then laws are
        compared by the likelihood, which includes the noise.
        """
        return any(term.profiled == 0 for term in self.objective.terms)

    @property
    def over_load(self) -> dict[str, Estimate]:
        """Stiffness over load (1/um, as rock laboratories state it), by name: K/W0 or K[run]/W0.

        Stiffnesses of several loads are left out.
        """
        loads: dict[str, list[float]] = {}
        for term in self.objective.terms_of(RunTerm):
            name = next((n for n in (f"K[{term.name}]", "K") if n in self.parameters), "")
            loads.setdefault(name, []).append(term.run.W0 if term.run.load_unit else math.nan)
        # Those of a table, which recordings may share their K with.
        loads.setdefault("K" if "K" in self.parameters else "", []).extend(
            np.unique(self.objective.fixed.get("W0", ()))
        )
        result = {}
        for name, several in loads.items():
            if not (name and several) or not np.ptp(several) <= ONE_LOAD * several[0]:
                continue
            p, load = self.parameters[name], 1e6 * float(np.mean(several))
            result[f"{name}/W0"] = replace(
                p,
                name=f"{name}/W0",
                unit="1/um",
                value=p.value / load,
                se=p.se / load,
                interval_68=(p.interval_68[0] / load, p.interval_68[1] / load),
                interval_95=(p.interval_95[0] / load, p.interval_95[1] / load),
                prior=None,
            )
        return result

    @property
    def fixed_numbers(self) -> dict[str, tuple[Float, str]]:
        """Values of the fixed parameters, each once and rising, and their unit; in SI, by name.

        The fixed stiffness of a recording is K or K[run], as among `parameters`.
        """
        known = {**point_parameters(self.objective.law), EPS_RATIO.name: EPS_RATIO}
        result = {n: (np.unique(v), known[n].unit) for n, v in self.objective.fixed.items()}
        several = len(self.objective.terms) > 1
        for term in self.objective.terms_of(RunTerm):
            if "K" in term.fixed:
                name = f"K[{term.name}]" if several else "K"
                result[name] = np.array([term.fixed["K"]]), term.run.stiffness_unit
        return result

    @property
    def coordinate_errors(self) -> Float:
        """Standard errors of the coordinates of the fit, shape (n,), at most `Unknown.widest`.

        The normal approximation fails farther away.
        """
        pairs = zip(self.parameters.values(), self.objective.unknowns, strict=True)
        return np.array(
            [
                min(abs(p.se / k.slope(p.value)), k.widest(float(k.to_coordinate(p.value))))
                for p, k in pairs
            ]
        )

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name, in SI."""
        return {name: p.value for name, p in self.parameters.items()}

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Law and outcome, estimates with their 95 % intervals, quality and warnings."""
        title = f"Fit of {self.law}"
        if not self.converged:
            return title, [SummaryLine("result", self.message)]
        lines = [SummaryLine("doubtful", "; ".join(self.doubts))] if self.doubts else []
        if self.rate_dependence is not None:
            difference = self.rate_dependence
            lines.append(SummaryLine(difference.name, difference.shown, difference.meaning))
        for name, p in {**self.parameters, **self.over_load}.items():
            if name.removesuffix("/W0") in self.undetermined:
                lines.append(SummaryLine(name, NOT_DETERMINED, "by these data"))
                continue
            shown = Shown.of(p.value, p.se, p.unit)
            bound = ", at its bound" if p.at_bound else ""
            lines.append(
                SummaryLine(
                    name,
                    f"{shown.value} {shown.unit}".rstrip(),
                    f"95 %: {shown.interval(p.interval_95)}{bound}",
                )
            )
        if self.judged_by_chi2:
            lines += [
                SummaryLine("chi2", f"{self.chi2:.6g}", f"{self.dof} degrees of freedom"),
                SummaryLine("p_value", f"{self.p_value:.3g}", "probability of a larger chi2"),
            ]
        return title, lines + [SummaryLine("warning", text) for text in self.warnings]


def fit_record(fit: Fit) -> dict[str, Any]:
    """The result of a fit for JSON; infinite and undefined numbers are None."""
    names = ("law", "converged", "message", "undetermined", "warnings")
    numbers = ("chi2", "dof", "p_value", "log_likelihood", "aicc", "bic")
    record = {name: getattr(fit, name) for name in (*names, *numbers)} | {
        "parameters": {
            name: {**_estimate(p), "determined": name not in fit.undetermined}
            for name, p in fit.parameters.items()
        },
        "over_load": {name: _estimate(p) for name, p in fit.over_load.items()},
        # A number that differs between the rows of a table is None.
        "fixed": {
            name: {"value": v[0] if v.size == 1 else None, "unit": unit}
            for name, (v, unit) in fit.fixed_numbers.items()
        },
        "correlation": {"names": list(fit.parameters), "matrix": fit.correlation.tolist()},
        "observables": {
            name: {"chi2": chi2, "n": n} for name, (chi2, n) in fit.observables.items()
        },
        "noise": _noise(fit),
        "level_change": None if fit.level_change is None else fit.level_change._asdict(),
        "optima": [vars(other) for other in fit.optima],
        "data": " and ".join(term.name for term in fit.objective.terms),
        "asperity_version": __version__,
    }
    result: dict[str, Any] = plain(record)
    return result


def _estimate(result: Estimate) -> dict[str, Any]:
    record = {name: value for name, value in vars(result).items() if name != "name"}
    prior = result.prior and {n: getattr(result.prior, n) for n in ("mean", "sd", "source")}
    return {**record, "prior": prior}


def _noise(fit: Fit) -> dict[str, Any]:
    """Noise of all data, and of each term if there are several."""
    parts = {term.name: dict(term.noise) for term in fit.objective.terms}
    if len(parts) == 1:
        return next(iter(parts.values()))
    models = list(dict.fromkeys(part["model"] for part in parts.values()))
    return {
        "model": "; ".join(models),
        "effective_samples": sum(part["effective_samples"] for part in parts.values()),
        "data": parts,
    }
