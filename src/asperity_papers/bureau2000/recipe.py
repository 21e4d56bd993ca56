"""The paper's way from measurements to numbers, step by step, on data of the same kind.

1. A - B is the slope of the mean friction with ln V, without modulation (section III).
2. At the bifurcation between steady sliding and stick-slip, K/W0 = (B - A)/D0 and
   omega = sqrt((B - A)/A) V/D0 (Eqs. 16 and 17): with step 1 these give A, B and D0.
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
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2 as chi_squared

from asperity import InputError
from asperity.inference import (
    LockInTable,
    bounded_interval,
    fit,
    shift_of_estimates,
)
from asperity.ledger import RecipeNumber, RecipeResult, read_columns
from asperity_papers.bureau2000.machine import PAPER, printed

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


#: Name in the paper's file of numbers, and of its uncertainty where that is another one.
_PUBLISHED = {
    "mu0": ("mu0", ""),
    "A": ("A", ""),
    "B": ("B", ""),
    "D0": ("D0", ""),
    "eps_ratio": ("transmission", ""),
    "lambda": ("lambda", "lambda_quasi_static"),
    "alpha": ("alpha_low", ""),
}


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
        K and W0 where they are no columns, in SI or as texts with units; those of the paper if
        they are neither. V0 is 1 um/s.
    progress : callable, optional
        Called with steps done, all steps, and a label.

    Returns
    -------
    RecipeResult

    Raises
    ------
    InputError
        If rows for step 1 are missing, or friction does not weaken with velocity.
    """
    report = progress or (lambda done, total, label: None)
    material = printed()
    constants = {"V0": material["V0"].si, **dict(fixed or {})}
    steady, drop, first = _rows(readings)
    warnings: list[str] = []
    report(0, 4, "steady sliding and bifurcation")
    base = _steady_and_threshold(steady, thresholds, float(material["V0"].si), warnings)
    steps = _SingleFits(base, constants, warnings)
    numbers: list[RecipeNumber] = [*_numbers_of(base)]
    result = partial(RecipeResult, PAPER.name, data=(readings.name, thresholds.name))
    if drop is None:
        warnings.append("no rows have epsilon above 0 and delta_mu: steps 3 to 5 are left out")
        return result({n.name: n for n in numbers}, tuple(warnings))
    report(1, 4, "eps_ratio from the drop")
    ratio = steps.fitted(3, drop, "rice-ruina", "eps_ratio", {}, "the drop, by Rice-Ruina")
    numbers.append(ratio.number)
    later = {"eps_ratio": (ratio.number.value, ratio)}
    report(2, 4, "lambda from mu1")
    if first is None:
        warnings.append("no rows have epsilon above 0 and mu1: step 4 is left out")
    else:
        how = "mu1, elasto-plastic law"
        numbers.append(steps.fitted(4, first, "elasto-plastic", "lambda", later, how).number)
    report(3, 4, "alpha from the drop")
    at_ratio = steps.fitted(
        5, drop, "linker-dieterich", "alpha", later, "the drop, at that eps_ratio", same=True
    )
    numbers.append(_limited(at_ratio.number))
    free = steps.fitted(
        5, drop, "linker-dieterich", "alpha", {}, "the drop, eps_ratio free", ("eps_ratio",)
    )
    numbers.append(replace(_limited(free.number), name="alpha, eps_ratio free"))
    report(4, 4, "alpha from the drop")
    return result({n.name: n for n in numbers}, tuple(warnings))


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
        raise InputError(f"{readings.name}", rule, "none", "measure steady sliding")
    if np.unique(steady.points["V"]).size < 2:
        rule = "have rows with epsilon = 0 at two velocities or more"
        raise InputError(f"{readings.name}", rule, "one", "the slope with ln V needs them")
    return steady, part("delta_mu", modulated), part("mu1", modulated)


@dataclass(frozen=True, eq=False)
class _SteadyStateNumbers:
    """mu0, A, B and D0, with the covariance of mu0, ln(B - A), ln A and ln D0."""

    coordinates: Float
    covariance: Float

    def values(self, coordinates: Float) -> dict[str, float]:
        mu0, weakening, a, d = coordinates
        A = math.exp(a)
        return {"mu0": float(mu0), "A": A, "B": A + math.exp(weakening), "D0": math.exp(d)}


# What leaves the range of doubles is refused at the end.
@np.errstate(all="ignore")
def _steady_and_threshold(
    steady: LockInTable, thresholds: Thresholds, V0: float, warnings: list[str]
) -> _SteadyStateNumbers:
    """Steps 1 and 2 as one weighted least squares: what is measured twice is averaged."""
    log_v = np.log(steady.points["V"] / V0)
    mean, error = steady.values["mean_friction"], steady.errors["mean_friction"]
    omega, omega_err = 2 * math.pi * thresholds.frequency, 2 * math.pi * thresholds.frequency_err

    def residuals(u: Float) -> Float:
        mu0, weakening, a, d = u
        line = mu0 - math.exp(weakening) * log_v
        stiffness = math.exp(weakening - d)
        critical = math.exp((weakening - a) / 2 - d) * thresholds.V
        return np.concatenate(
            [
                (line - mean) / error,
                (stiffness - thresholds.K_over_W0) / thresholds.K_over_W0_err,
                (critical - omega) / omega_err,
            ]
        )

    try:
        start = _start_of_least_squares(steady, log_v, thresholds)
        solved = least_squares(residuals, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
        covariance = np.linalg.inv(solved.jac.T @ solved.jac)
        base = _SteadyStateNumbers(solved.x, covariance)
        numbers = _numbers_of(base)
        finite = all(math.isfinite(n.value) and 0 < n.se < math.inf for n in numbers)
    except InputError:
        raise
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        finite = False
    if not finite:
        rule = "have bifurcations from which A, B and D0 follow"
        got = "numbers with which that cannot be computed"
        raise InputError(f"{thresholds.name}", rule, got, "correct the cells, which are in SI")
    dof = solved.fun.size - 4
    if dof > 0 and chi_squared.sf(float(solved.fun @ solved.fun), dof) < _MISFIT:
        warnings.append(
            f"steady sliding and bifurcations do not agree within their uncertainties: "
            f"chi-squared {solved.fun @ solved.fun:.3g} for {dof} degrees of freedom"
        )
    return base


def _start_of_least_squares(steady: LockInTable, log_v: Float, thresholds: Thresholds) -> Float:
    """Closed-form estimates of mu0, ln(B - A), ln A and ln D0."""
    mean, error = steady.values["mean_friction"], steady.errors["mean_friction"]
    slope, level = np.polyfit(log_v, mean, 1, w=1 / error)
    if slope >= 0:
        rule, got = "have friction that weakens with velocity", f"a slope of {slope:.3g} with ln V"
        raise InputError(f"{steady.name}", rule, got, "without weakening there is no bifurcation")
    k = float(np.average(thresholds.K_over_W0, weights=thresholds.K_over_W0_err**-2))
    omega = 2 * math.pi * thresholds.frequency
    contrast = float(np.median(omega / thresholds.V)) * -slope / k
    return np.array(
        [
            level,
            math.log(-slope),
            math.log(-slope / contrast**2),
            math.log(-slope / k),
        ]
    )


#: Step of each number of steady sliding and bifurcation, and what it is read from.
_HOW = {
    "mu0": (1, "mean friction at V0"),
    "B - A": (1, "slope of the mean friction with ln V"),
    "A": (2, "critical frequency, K/W0 and B - A at the bifurcation"),
    "B": (2, "A and the slope"),
    "D0": (2, "K/W0 at the bifurcation and the slope"),
}


def _numbers_of(base: _SteadyStateNumbers) -> tuple[RecipeNumber, ...]:
    """mu0, B - A, A, B and D0 with their standard errors, to first order."""
    values = base.values(base.coordinates)
    values["B - A"] = weakening = math.exp(base.coordinates[1])
    gradient = {
        "mu0": [1.0, 0, 0, 0],
        "A": [0, 0, values["A"], 0],
        "B": [0, weakening, values["A"], 0],
        "D0": [0, 0, 0, values["D0"]],
        "B - A": [0, weakening, 0, 0],
    }
    numbers = []
    for name, how in _HOW.items():
        row = np.array(gradient[name])
        se = float(np.sqrt(row @ base.covariance @ row))
        numbers.append(_with_published(name, values[name], se, se, *how))
    return tuple(numbers)


@dataclass(frozen=True, eq=False)
class _FittedNumber:
    """A fitted number, and how it moves with what was fixed.

    Attributes
    ----------
    number : RecipeNumber
    shifts : array, shape (m,)
        By one standard deviation of each independent source of error.
    """

    number: RecipeNumber
    shifts: Float


@dataclass(frozen=True, eq=False)
class _SingleFits:
    """Fits of one parameter with the numbers of earlier steps fixed."""

    base: _SteadyStateNumbers
    constants: Mapping[str, Any]
    warnings: list[str]

    def fitted(
        self,
        step: int,
        table: LockInTable,
        law: str,
        name: str,
        earlier: Mapping[str, tuple[float, _FittedNumber]],
        how: str,
        others: Sequence[str] = (),
        *,
        same: bool = False,
    ) -> _FittedNumber:
        """The fit of a parameter, with others free too if they are named.

        With `same` the earlier steps use the same readings: their noise is that of this step and
        is not counted again.
        """
        known = self.base.values(self.base.coordinates)
        fixed = {**self.constants, **known, **{n: v for n, (v, _) in earlier.items()}}
        material = printed()
        free = [name, *others]
        start = {n: v for n, v in {"alpha": material["alpha_low"].si}.items() if n in free}
        if "eps_ratio" in free:
            start["eps_ratio"] = material["transmission"].si
        result = fit(table, law, free, fixed=fixed, material=material, start=start)
        if not result.converged:
            rule = "have periodic responses with the numbers of the earlier steps"
            got = f"none that fits {name}"
            raise InputError(f"{table.name}", rule, got, "check the thresholds and K and W0")
        self.warnings.extend(f"step {step}: {w}" for w in result.warnings)
        estimate = result.parameters[name]

        def shift(high: Mapping[str, float], low: Mapping[str, float]) -> float:
            return shift_of_estimates(result, high, low)[name]

        shifts = np.array([shift(*ends) for ends in self._moved()])
        more = []
        for other, (value, source) in earlier.items():
            # To first order, from a change of 1 %.
            slope = shift({other: value * 1.01}, {other: value * 0.99})
            shifts = shifts + slope / (0.01 * value) * source.shifts[: shifts.size]
            more.append(0.0 if same else slope / (0.01 * value) * source.number.se_own)
        shifts = np.array([*shifts, *more])
        se = float(np.sqrt(estimate.se**2 + np.sum(shifts**2)))
        return _FittedNumber(
            _with_published(name, estimate.value, se, estimate.se, step, how), shifts
        )

    def _moved(self) -> list[tuple[dict[str, float], ...]]:
        """mu0, A, B and D0 one standard deviation up and down each principal axis."""
        values, vectors = np.linalg.eigh(self.base.covariance)
        along = vectors * np.sqrt(np.maximum(values, 0.0))
        return [
            tuple(self.base.values(self.base.coordinates + sign * along[:, j]) for sign in (1, -1))
            for j in range(along.shape[1])
        ]


def _with_published(
    name: str, value: float, se: float, se_alone: float, step: int, how: str
) -> RecipeNumber:
    """A number with the paper's."""
    unit = "m" if name in ("D0", "lambda") else ""
    fitted = RecipeNumber(name, unit, value, se, se_alone, step, how, None, None, "")
    if name not in _PUBLISHED:
        return fitted
    key, uncertain = _PUBLISHED[name]
    number, spread = printed()[key], printed()[uncertain or key].si_uncertainty
    return replace(
        fitted,
        published=float(number.si),
        published_uncertainty=None if spread is None else float(spread),
        published_place=number.place,
    )
