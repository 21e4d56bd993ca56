"""Free parameters of a fit: their coordinates, bounds, priors and ranges of start values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.errors import Argument, InputError, require, symbol, symbols
from asperity.laws import Law, registered
from asperity.materials import Material, Number
from asperity.parameters import Parameter, all_parameters, point_parameters, suggestion
from asperity.parameters.arguments import number, typed
from asperity.units import KINDS

#: Share of the applied modulation that the contacts carry; only fits have this parameter.
EPS_RATIO = Parameter(
    "eps_ratio",
    "dimensionless",
    "positive",
    "share of the modulation that the contacts carry, eps_eff/eps",
    r"\varepsilon_{\rm eff}/\varepsilon",
    "load",
    default=1.0,
    label="eps_ratio",
)

#: Default ranges of start values in SI: those of contacts of rock, polymers and metals (Marone,
#: 1998; Baumberger and Caroli, 2006; c: Nagata et al., 2012), widened.
_USUAL = {
    "mu0": (0.2, 1.0),
    "A": (0.003, 0.05),
    "B": (0.003, 0.06),
    "D0": (1e-7, 2e-5),
    "lambda": (1e-7, 5e-6),
    "alpha": (0.01, 0.5),
    "c": (0.1, 10.0),
    "B2": (0.001, 0.02),
    "D2": (1e-7, 1e-4),
    "eps_ratio": (0.2, 1.0),
}
#: A positive parameter is searched within this factor of its range of starts.
_FARTHEST = 1e6
#: Factor by which a logarithmic range exceeds the usual values; factor of the highest usual value
#: for the end of other ranges.
_LOGARITHMIC, _LINEAR = 10.0, 3.0
#: The range includes at least this many standard deviations about an estimate.
_REACH = 10.0
#: Parameters that cannot be free: a change of V0 is equivalent to changes of other parameters.
REFERENCES = ("V0",)


class UnfittableLawError(InputError):
    """A law for which numbers or samples are missing; a comparison leaves it out."""


@typed
@dataclass(frozen=True)
class Prior:
    """A normal prior of a parameter, cut off by the parameter's rule.

    Attributes
    ----------
    mean, sd : float
        Mean and standard deviation in SI.
    source : str
    unit : str
        SI unit of mean and sd if it differs from that of the parameter, else empty: the prior of a
        stiffness may be given over the load, in 1/m.
    """

    mean: float
    sd: float
    source: str
    unit: str = ""

    def __post_init__(self) -> None:
        number(self.mean, "prior.mean", "dimensionless")
        number(self.sd, "prior.sd", "dimensionless", "positive")


@dataclass(frozen=True)
class Unknown:
    """A free parameter and its coordinate u: ln x where x is positive, x/scale otherwise.

    Attributes
    ----------
    parameter : Parameter
    logarithmic : bool
    scale : float
        Scale of a coordinate that is no logarithm.
    lower, upper : float
        Bounds of x, in SI.
    start : (float, float)
        Range of random starts.
    given : float or None
        Start value from the user or a material.
    prior : Prior or None
    nuisance : bool
        Whether the parameter belongs to one data set, and not to the law or the machine.
    """

    parameter: Parameter
    logarithmic: bool
    scale: float
    lower: float
    upper: float
    start: tuple[float, float]
    given: float | None
    prior: Prior | None
    nuisance: bool = False

    @property
    def middle(self) -> float:
        """Start value: the given one, or the middle of the range."""
        if self.given is not None:
            return self.given
        low, high = self.start
        return math.sqrt(low * high) if low > 0 else (low + high) / 2

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self.parameter.name

    def to_coordinate(self, x: Any) -> Any:
        """Coordinate of a value."""
        return np.log(x) if self.logarithmic else np.asarray(x) / self.scale

    def to_value(self, u: Any) -> Any:
        """Value at a coordinate."""
        return np.exp(u) if self.logarithmic else np.asarray(u) * self.scale

    def slope(self, x: float) -> float:
        """dx/du."""
        return x if self.logarithmic else self.scale

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the coordinate; for a logarithm, a factor of a million from the starts."""
        if self.logarithmic:
            low, high = self.start[0] / _FARTHEST, min(self.start[1] * _FARTHEST, self.upper)
            return math.log(low), math.log(high)
        return self.lower / self.scale, self.upper / self.scale

    def widest(self, u: float) -> float:
        """Largest standard deviation of a coordinate that data determine, at an estimate u.

        A factor of e for a logarithm; for others the usual value, and the estimate itself.
        """
        return 1.0 if self.logarithmic else max(1.0, abs(u))

    def range_about(self, u: float, sd: float) -> tuple[float, float]:
        """Range of the coordinate for posteriors and evidence, about an estimate with its error.

        With a prior, the range is ten standard deviations of the prior. Otherwise it is a tenth of
        the lowest to ten times the highest usual value for a logarithmic coordinate, and zero to
        three times the highest usual value for others. It includes ten standard deviations about
        an estimate that is determined.
        """
        low, high = self.bounds
        if self.prior is not None:
            first, last = (self.prior.mean + s * _REACH * self.prior.sd for s in (-1, 1))
            usual = first / self.scale, last / self.scale
            if self.logarithmic:
                usual = low, math.log(last)
        elif self.logarithmic:
            usual = math.log(self.start[0] / _LOGARITHMIC), math.log(self.start[1] * _LOGARITHMIC)
        else:
            top = _LINEAR * abs(self.start[1]) / self.scale
            usual = (max(low, -top), top)
        reach = _REACH * min(sd, self.widest(u))
        return max(low, min(usual[0], u - reach)), min(high, max(usual[1], u + reach))

    def end(self, u: float) -> float:
        """Value at the end of an interval; 0 or infinite if the end lies beyond the bounds."""
        low, high = self.bounds
        if self.logarithmic and u <= low + _FARTHEST**-1:
            return 0.0
        if self.logarithmic and u >= high - _FARTHEST**-1 and not math.isfinite(self.upper):
            return math.inf
        return float(self.to_value(u)) if math.isfinite(u) else u


def require_fittable(law: type[Law], free: Sequence[str]) -> None:
    """Refuse free parameters that are unknown, occur twice or cannot be free.

    Raises
    ------
    InputError
        If a name is not allowed; the message lists the names that can be free.
    """
    known = {**point_parameters(law), "eps_ratio": EPS_RATIO}
    others = (*REFERENCES, "epsilon", "inertia")
    fittable = {n: p for n, p in known.items() if p.place != "drive" and n not in others}
    for name in free:
        if name in REFERENCES:
            rule, got = "be parameters that data can determine", f"'{symbol(name)}'"
            advice = "free mu0 instead, which has the same effect"
            raise InputError("free", rule, got, advice)
        if name not in fittable:
            rule = f"be parameters of {law.name}"
            raise InputError("free", rule, f"'{symbol(name)}'", suggestion(name, fittable))
        if list(free).count(name) > 1:
            raise InputError(
                "free", "name each parameter once", f"'{symbol(name)}' twice", "drop one"
            )


def unknowns_of(
    law: type[Law],
    free: Sequence[str],
    *,
    largest_epsilon: float = 0.0,
    start: Mapping[str, float],
    priors: Mapping[str, Prior],
    usual: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[Unknown, ...]:
    """The free parameters of a fit.

    Parameters
    ----------
    law : type of Law
    free : sequence of str
    largest_epsilon : float
        Largest epsilon of the data; its product with eps_ratio stays below 1.
    start : mapping of str to float
        Start values.
    priors : mapping of str to Prior
    usual : mapping of str to (float, float), optional
        Ranges of start values from the data; they take precedence over the default ranges.
    """
    known = {**point_parameters(law), "eps_ratio": EPS_RATIO}
    ranges = {**_USUAL, **(usual or {})}
    return tuple(
        unknown_of(
            known[n],
            start.get(n),
            priors.get(n),
            ranges.get(n),
            upper=0.999 / largest_epsilon if n == "eps_ratio" and largest_epsilon > 0 else math.inf,
        )
        for n in free
    )


def unknown_of(
    parameter: Parameter,
    given: float | None,
    prior: Prior | None,
    usual: tuple[float, float] | None,
    *,
    upper: float = math.inf,
    nuisance: bool = False,
) -> Unknown:
    """A free parameter with its coordinate, bounds and range of starts.

    Raises
    ------
    InputError
        If the parameter has no range of starts, or its prior contradicts its rule or its unit.
    """
    name = parameter.name
    positive = parameter.rule == "positive"
    if prior is not None and positive and prior.mean <= 0:
        rule = "have a positive mean"
        raise InputError(Argument("prior", name), rule, f"{prior.mean:g}", "correct it")
    if prior is not None and prior.unit not in ("", parameter.unit):
        rule = f"be in {parameter.unit or 'no unit'}, as all numbers of a prior are SI"
        raise InputError(Argument("prior", name), rule, prior.unit, "convert it")
    middle = given if given else prior.mean if prior else None
    ranges = [] if usual is None else [usual]
    if middle:
        ranges.append((min(middle / 3, middle * 3), max(middle / 3, middle * 3)))
    if not ranges:
        raise UnfittableLawError(
            Argument("start", name),
            "say where to look for a free parameter without a usual range",
            "none",
            f"give a value, or use {Argument('fixed', name)}",
        )
    low, high = min(a for a, _ in ranges), max(b for _, b in ranges)
    if prior:
        low, high = max(low, prior.mean - 3 * prior.sd), min(high, prior.mean + 3 * prior.sd)
        low = max(low, prior.mean / 10) if prior.mean > 0 else low
    high = min(high, upper)
    # A start may be nearly zero, or too small, which is no scale.
    typical = math.sqrt(usual[0] * usual[1]) if usual and usual[0] > 0 else 0.0
    scale = 1.0 if positive else max(abs(middle or 0.0), typical)
    lower = 0.0 if parameter.rule in ("positive", "not negative") else -math.inf
    return Unknown(parameter, positive, scale, lower, upper, (low, high), given, prior, nuisance)


def require_free_names(
    unknowns: Sequence[Unknown], start: Mapping[str, Any] | None, priors: Mapping[str, Any]
) -> None:
    """Refuse starts and priors of parameters that are not free, and of unknown names or runs.

    A gain may have a prior, but no start. Delays and initial states have neither from the user.

    Raises
    ------
    InputError
    """
    interest = [unknown for unknown in unknowns if not unknown.nuisance]
    with_prior = [unknown for unknown in unknowns if unknown.logarithmic or not unknown.nuisance]
    for label, names, some in (("start", start or {}, interest), ("prior", priors, with_prior)):
        known = {unknown.name: unknown.parameter for unknown in some}
        # Names without a run stand for the parameter of each run.
        shared = {name.partition("[")[0] for name in known}
        for name in names:
            rule = f"be of free parameters ({symbols(known)})"
            if name not in known and name not in shared:
                advice = f"free it, correct the name, or leave the {label} out"
                advice = suggestion(name, known, advice)
                raise InputError(label, rule, f"'{symbol(name)}'", advice)


def material_values(material: Material | None, names: Iterable[str]) -> dict[str, float]:
    """Published values of a material, by name in SI."""
    return {n: number.si for n, number in published_numbers(material, names).items()}


def published_numbers(material: Material | None, names: Iterable[str]) -> dict[str, Number]:
    """Numbers of a material that have a value and are the kind of quantity of the parameter."""
    kinds = {n: p.kind for n, p in all_parameters(registered().values()).items()}
    numbers = {n: material[n] for n in names if n in material} if material is not None else {}
    return {
        n: number
        for n, number in numbers.items()
        if number.value is not None and number.dimension == kinds.get(n, number.dimension)
    }


def material_priors(material: Material, names: Sequence[str]) -> dict[str, Prior]:
    """Normal priors from the published uncertainties of a material.

    Raises
    ------
    InputError
        If the material has no number with an uncertainty for any of the names.
    """
    priors = {}
    for name, published in published_numbers(material, names).items():
        if published.uncertainty:
            sd, unit = float(published.si_uncertainty or 0), KINDS[published.dimension].si
            priors[name] = Prior(published.si, sd, material.name, unit)
    got, advice = f"'{material.name}', which has none for {symbols(names)}", "leave the prior out"
    require(priors, "prior", "be a material with uncertainties of free parameters", got, advice)
    return priors
