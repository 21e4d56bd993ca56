"""The paper's way from measurements to numbers, step by step, on data of the same kind.

1. A - B is the slope of the mean friction with ln V, without modulation (section III).
2. At the bifurcation between steady sliding and stick-slip, K/W0 = (B - A)/D0 and
   omega = sqrt((B - A)/A) V/D0 (Eqs. 18 and 19): with step 1 these give A, B and D0.
3. eps_ratio = eps_eff/eps makes the drop of the mean that of the Rice-Ruina law (III.A.2).
4. lambda makes mu1 that of the elasto-plastic law, at that eps_ratio (III.C).
5. The drop bounds alpha of the Linker-Dieterich law, at that eps_ratio (III.B).

Each step keeps the numbers of the earlier ones fixed, as the paper does. Their uncertainties are
propagated to first order, which the paper does not do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2 as chi_squared

from asperity import InputError
from asperity.inference import (
    LockInTable,
    bounded_interval,
    equal_rows,
    fit,
    shift_of_estimates,
)
from asperity.ledger import RecipeNumber, RecipeResult, read_columns
from asperity.parameters import obeying
from asperity_papers.bureau2000.machine import PAPER

Float = NDArray[np.float64]

#: Columns of a table of bifurcations, with the kind of quantity of each.
THRESHOLD_COLUMNS = {
    "V": "velocity",
    **dict.fromkeys(("K_over_W0", "K_over_W0_err"), "per_length"),
    **dict.fromkeys(("frequency", "frequency_err"), "frequency"),
}
#: Below this probability the measurements contradict the formulas that they are read with.
_MISFIT = 0.01
_LEVEL = 0.95


@dataclass(frozen=True, eq=False)
class Thresholds:
    """Bifurcations between steady sliding and stick-slip, one a row, in SI.

    Attributes
    ----------
    name : str
        Name of the table in messages.
    V : array, shape (rows,)
        Pulling velocity (m/s).
    K_over_W0, K_over_W0_err : array, shape (rows,)
        Stiffness over mean load at which sliding becomes unsteady (1/m), and its standard
        uncertainty.
    frequency, frequency_err : array, shape (rows,)
        Frequency of the first oscillations (Hz), not rad/s, and its standard uncertainty.
    """

    name: str
    V: Float
    K_over_W0: Float
    K_over_W0_err: Float
    frequency: Float
    frequency_err: Float

    def __post_init__(self) -> None:
        for column in THRESHOLD_COLUMNS:
            values = np.atleast_1d(np.asarray(getattr(self, column), float))
            object.__setattr__(self, column, values)
            for row in np.flatnonzero(~((values > 0) & (values < np.inf))):
                got = f"{values[row]:g} in row {row + 1}"
                raise InputError(f"{self.name}.{column}", "be positive", got, "correct the cell")


def read_thresholds(path: str | Path) -> Thresholds:
    """Read a table of bifurcations.

    Parameters
    ----------
    path : str or Path
        CSV in SI, or with units in its heading; columns `THRESHOLD_COLUMNS`.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, or a cell is no positive number.
    """
    columns = read_columns(Path(path), THRESHOLD_COLUMNS, "a bifurcation", label="thresholds")
    return Thresholds(Path(path).name, **columns)


#: Names in the paper's file of numbers: of the published value, and of its uncertainty.
_PUBLISHED = {
    **{name: (name, name) for name in ("mu0", "A", "B", "D0")},
    "eps_ratio": ("transmission", "transmission"),
    "lambda": ("lambda", "lambda_quasi_static"),
    "alpha": ("alpha_low", "alpha_low"),
}


#: Numbers that the user may fix; the others are those that the procedure finds.
_FIXED = ("K", "W0", "V0", "V", "epsilon", "frequency")


def paper_procedure(
    readings: LockInTable,
    thresholds: Thresholds,
    *,
    fixed: Mapping[str, Any] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> RecipeResult:
    """A, B, D0, eps_ratio, lambda and a bound on alpha as Bureau et al. (2000) find them.

    Parameters
    ----------
    readings : LockInTable
        Rows with epsilon = 0 and mean_friction, at two velocities or more, for step 1; rows with
        epsilon > 0 and delta_mu for steps 3 and 5, and mu1 for step 4. A step without rows is left
        out, and a warning says so.
    thresholds : Thresholds
        For step 2.
    fixed : mapping, optional
        K and W0 if they are not columns, in SI or as texts with units; by default those of the
        paper. V0, at which mu0 is read, is 1 um/s by default.
    progress : callable, optional
        Called with steps done, all steps, and a label.

    Returns
    -------
    RecipeResult

    Raises
    ------
    InputError
        If rows for step 1 are missing, friction does not weaken with velocity, or `fixed` has
        another number.
    """
    for name in fixed or {}:
        if name not in _FIXED:
            rule, advice = f"name one of {', '.join(_FIXED)}", "leave it out: the steps find it"
            raise InputError("fixed", rule, f"'{name}'", advice)
    report = progress or (lambda done, total, label: None)
    steady, drop, first = _rows(readings)
    rows = [f"row {i + 1} of {thresholds.name}" for i in range(thresholds.V.size)]
    warnings = equal_rows([getattr(thresholds, name) for name in THRESHOLD_COLUMNS], rows)
    report(0, 4, "steady sliding and bifurcation")
    constants = {"V0": PAPER.numbers["V0"].si, **dict(fixed or {})}
    V0 = float(obeying(constants["V0"], "V0", "velocity", "positive"))
    base = _steady_and_threshold(steady, thresholds, V0, warnings)
    numbers = _numbers_of(base)
    if PAPER.numbers["V0"].si != V0:
        # The paper has no friction coefficient at that velocity.
        numbers[0] = replace(
            numbers[0], published=None, published_uncertainty=None, published_place=""
        )
    if drop is None:
        warnings.append("no rows have epsilon above 0 and delta_mu: steps 3 to 5 are left out")
    else:
        fitted = partial(_fitted, base, constants, warnings)
        report(1, 4, "eps_ratio from the drop")
        ratio = fitted(3, drop, "rice-ruina", "eps_ratio", "the drop, by Rice-Ruina")
        numbers.append(ratio.number)
        report(2, 4, "lambda from mu1")
        if first is None:
            warnings.append("no rows have epsilon above 0 and mu1: step 4 is left out")
        else:
            how = "mu1, elasto-plastic law"
            numbers.append(fitted(4, first, "elasto-plastic", "lambda", how, ratio).number)
        report(3, 4, "alpha from the drop")
        bounded = partial(fitted, 5, drop, "linker-dieterich", "alpha")
        at_ratio = bounded("the drop, at that eps_ratio", ratio, same_readings=True)
        free = bounded("the drop, eps_ratio free", others=("eps_ratio",))
        numbers.append(_limited(at_ratio.number))
        numbers.append(replace(_limited(free.number), name="alpha, eps_ratio free"))
        report(4, 4, "alpha from the drop")
    names = readings.name, thresholds.name
    return RecipeResult(PAPER.name, {n.name: n for n in numbers}, tuple(warnings), names)


def _limited(number: RecipeNumber) -> RecipeNumber:
    """With the upper end of the 95 % interval of a number that is not negative."""
    limit = bounded_interval(number.value, number.se, _LEVEL, 0.0, math.inf)[1]
    return replace(number, upper_limit_95=limit)


def _rows(
    readings: LockInTable,
) -> tuple[LockInTable, LockInTable | None, LockInTable | None]:
    """Rows of steady sliding, of the drop and of mu1, each with its observable alone."""
    modulated = readings.points["epsilon"] > 0

    def part(name: str, wanted: NDArray[np.bool_]) -> LockInTable | None:
        keep = wanted & np.isfinite(readings.values.get(name, np.nan))
        if not keep.any():
            return None
        values, errors = ({name: a[name]} for a in (readings.values, readings.errors))
        return LockInTable(readings.name, readings.points, values, errors).without(~keep)

    steady = part("mean_friction", ~modulated)
    if steady is None:
        rule = "have rows with epsilon = 0 and mean_friction"
        raise InputError(readings.name, rule, "none", "measure steady sliding")
    if np.unique(steady.points["V"]).size < 2:
        rule = "have rows with epsilon = 0 at two velocities or more"
        raise InputError(readings.name, rule, "one", "the slope with ln V needs them")
    return steady, part("delta_mu", modulated), part("mu1", modulated)


@dataclass(frozen=True, eq=False)
class _SteadyStateNumbers:
    """mu0, ln(B - A), ln A and ln D0, and their covariance."""

    coordinates: Float
    covariance: Float

    def values(self, shift: Float | float = 0.0) -> dict[str, float]:
        """The parameters at coordinates that are moved by `shift`."""
        mu0, weakening, a, d = self.coordinates + shift
        A = math.exp(a)
        return {"mu0": float(mu0), "A": A, "B": A + math.exp(weakening), "D0": math.exp(d)}

    def moved(self) -> list[tuple[dict[str, float], dict[str, float]]]:
        """The parameters one standard deviation up and down each principal axis."""
        variances, axes = np.linalg.eigh(self.covariance)
        shifts = (axes * np.sqrt(np.maximum(variances, 0.0))).T
        return [(self.values(shift), self.values(-shift)) for shift in shifts]


# Numbers beyond the range of doubles are refused at the end.
@np.errstate(all="ignore")
def _steady_and_threshold(
    steady: LockInTable, thresholds: Thresholds, V0: float, warnings: list[str]
) -> _SteadyStateNumbers:
    """Steps 1 and 2 as one weighted least squares: what is measured twice is averaged."""
    log_v = np.log(steady.points["V"] / V0)
    turn = 2 * math.pi
    measured, errors = (
        np.concatenate(parts)
        for parts in (
            (steady.values["mean_friction"], thresholds.K_over_W0, turn * thresholds.frequency),
            (
                steady.errors["mean_friction"],
                thresholds.K_over_W0_err,
                turn * thresholds.frequency_err,
            ),
        )
    )

    def residuals(u: Float) -> Float:
        mu0, weakening, a, d = u
        line = mu0 - math.exp(weakening) * log_v
        stiffness = np.full(thresholds.V.shape, math.exp(weakening - d))
        critical = math.exp((weakening - a) / 2 - d) * thresholds.V
        return np.asarray((np.concatenate([line, stiffness, critical]) - measured) / errors)

    try:
        start = _start_of_least_squares(steady, log_v, thresholds)
        solved = least_squares(residuals, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
        base = _SteadyStateNumbers(solved.x, np.linalg.inv(solved.jac.T @ solved.jac))
        finite = all(math.isfinite(n.value) and 0 < n.se < math.inf for n in _numbers_of(base))
    except InputError:
        raise
    except (ArithmeticError, ValueError):
        finite = False
    if not finite:
        rule = "have bifurcations from which A, B and D0 follow"
        got = "numbers with which that cannot be computed"
        raise InputError(thresholds.name, rule, got, "correct the cells, which are in SI")
    dof, chi2 = solved.fun.size - 4, float(solved.fun @ solved.fun)
    if dof > 0 and chi_squared.sf(chi2, dof) < _MISFIT:
        warnings.append(
            f"steady sliding and bifurcations do not agree within their uncertainties: "
            f"chi-squared {chi2:.3g} for {dof} degrees of freedom"
        )
    return base


def _start_of_least_squares(steady: LockInTable, log_v: Float, thresholds: Thresholds) -> Float:
    """Closed-form estimates of mu0, ln(B - A), ln A and ln D0."""
    mean, error = steady.values["mean_friction"], steady.errors["mean_friction"]
    slope, level = np.polyfit(log_v, mean, 1, w=1 / error)
    if slope >= 0:
        rule, got = "have friction that weakens with velocity", f"a slope of {slope:.3g} with ln V"
        raise InputError(steady.name, rule, got, "without weakening there is no bifurcation")
    k = float(np.average(thresholds.K_over_W0, weights=thresholds.K_over_W0_err**-2))
    omega = 2 * math.pi * thresholds.frequency
    contrast = float(np.median(omega / thresholds.V)) * -slope / k
    return np.array([level, *map(math.log, (-slope, -slope / contrast**2, -slope / k))])


def _numbers_of(base: _SteadyStateNumbers) -> list[RecipeNumber]:
    """mu0, B - A, A, B and D0 with their standard errors, to first order."""
    mu0, A, B, D0 = base.values().values()
    weakening = math.exp(base.coordinates[1])
    numbers = []
    for name, value, gradient, step, how in (
        ("mu0", mu0, (1, 0, 0, 0), 1, "mean friction at V0"),
        ("B - A", weakening, (0, weakening, 0, 0), 1, "slope of the mean friction with ln V"),
        ("A", A, (0, 0, A, 0), 2, "critical frequency, K/W0 and B - A at the bifurcation"),
        ("B", B, (0, weakening, A, 0), 2, "A and the slope"),
        ("D0", D0, (0, 0, 0, D0), 2, "K/W0 at the bifurcation and the slope"),
    ):
        se = float(np.sqrt(gradient @ base.covariance @ gradient))
        numbers.append(_with_published(name, value, se, se, step, how))
    return numbers


class _FittedNumber(NamedTuple):
    """A fitted number, and its shifts by one standard deviation of each source of error."""

    number: RecipeNumber
    shifts: Float


def _fitted(
    base: _SteadyStateNumbers,
    constants: Mapping[str, Any],
    warnings: list[str],
    step: int,
    table: LockInTable,
    law: str,
    name: str,
    how: str,
    ratio: _FittedNumber | None = None,
    *,
    others: Sequence[str] = (),
    same_readings: bool = False,
) -> _FittedNumber:
    """The fit of a parameter, with the numbers of earlier steps fixed and `others` free too.

    With `same_readings`, step 3 had found `ratio` from the readings of this step: their noise is
    not counted again.
    """
    fixed, material = {**constants, **base.values()}, PAPER.numbers
    if ratio is not None:
        fixed["eps_ratio"] = ratio.number.value
    free = [name, *others]
    starts = {"alpha": material["alpha_low"].si, "eps_ratio": material["transmission"].si}
    start = {n: starts[n] for n in free if n in starts}
    result = fit(table, law, free, fixed=fixed, material=material, start=start)
    if not result.converged:
        rule = "have periodic responses with the numbers of the earlier steps"
        got = f"none that fits {name}"
        raise InputError(table.name, rule, got, "check the thresholds and K and W0")
    warnings.extend(f"step {step}: {w}" for w in result.warnings)
    estimate = result.parameters[name]
    shifts = np.array([shift_of_estimates(result, *ends)[name] for ends in base.moved()])
    if ratio is not None:
        # To first order, from a change of 1 %.
        value, change = ratio.number.value, 0.01 * ratio.number.value
        ends = {"eps_ratio": value + change}, {"eps_ratio": value - change}
        slope = shift_of_estimates(result, *ends)[name] / change
        shifts = shifts + slope * ratio.shifts
        if not same_readings:
            shifts = np.append(shifts, slope * ratio.number.se_own)
    se = float(np.sqrt(estimate.se**2 + np.sum(shifts**2)))
    return _FittedNumber(_with_published(name, estimate.value, se, estimate.se, step, how), shifts)


def _with_published(
    name: str, value: float, se: float, se_alone: float, step: int, how: str
) -> RecipeNumber:
    """A number with the paper's."""
    unit = "m" if name in ("D0", "lambda") else ""
    key, uncertain = _PUBLISHED.get(name, ("", ""))
    number = PAPER.numbers[key] if key else None
    spread = PAPER.numbers[uncertain].si_uncertainty if uncertain else None
    published, place = (number.si, number.place) if number else (None, "")
    return RecipeNumber(name, unit, value, se, se_alone, step, how, published, spread, place)
