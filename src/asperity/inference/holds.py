"""A table of slide-hold-slide tests: healing (static friction less sliding friction) of each hold.

In the likelihood holds and reloads are integrated, with exact derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.arrays import Bool, Float
from asperity.errors import Argument, InputError, require
from asperity.inference.objective import DataTerm, Residuals, log_density
from asperity.inference.tables.residuals import leverages
from asperity.inference.tables.table import in_all_rows
from asperity.inference.tables.term import outlier_sentence
from asperity.laws import Law
from asperity.parameters import law_parameters, obeying
from asperity.parameters.arguments import typed
from asperity.parameters.columns import read_headed_columns
from asperity.slider.parameters import slider_from
from asperity.transients.holds_and_steps import hold

#: The column that identifies a table of holds.
HEALING = "healing"
_KINDS = {
    "hold_time": ("time", "positive"),
    HEALING: ("dimensionless", "finite"),
    "healing_err": ("dimensionless", "positive"),
    "V": ("velocity", "positive"),
    "K": ("per_length", "positive"),
    "W0": ("force", "positive"),
}
#: The other name of the errors, as in lock-in tables.
_UNCERTAINTY = "healing_uncertainty"
_REQUIRED = ("hold_time", HEALING, "V", "K")
#: Fields of a table that always have a value in each row.
_COLUMNS = (*_REQUIRED, "row_names")


@dataclass(frozen=True, eq=False)
class HealingTable:
    """Healing of an interface, one row for each hold; arrays of shape (rows,), in SI.

    Attributes
    ----------
    name : str
        Name of the table in messages.
    hold_time : array
        Hold times (s).
    healing : array
        Static friction less the sliding friction before the hold.
    errors : array or None
        Standard uncertainties of `healing`. If None, one uncertainty for all rows is estimated from
        the residuals.
    V : array
        Velocity of the drive before and after the hold (m/s).
    K : array
        Stiffness of the spring over the normal load (1/m).
    row_names : array of str, shape (rows,)
        Names of the rows in messages, such as "row 3 of" the table; by default counted from 1.
    """

    name: str
    hold_time: Float
    healing: Float
    errors: Float | None
    V: Float
    K: Float
    row_names: NDArray[np.str_] = field(default_factory=lambda: np.array([], dtype=str))

    def __post_init__(self) -> None:
        if self.row_names.size == 0:
            names = np.array([f"row {i} of {self.name}" for i in range(1, self.rows + 1)])
            object.__setattr__(self, "row_names", names)

    @property
    def rows(self) -> int:
        """Number of holds."""
        return self.healing.size

    def without(self, rows: Bool) -> HealingTable:
        """The table without some of its rows."""
        names = [*_COLUMNS, *(["errors"] if self.errors is not None else [])]
        return replace(self, **{n: getattr(self, n)[~rows] for n in names})


@typed
def read_healing(
    path: str | Path, given: Mapping[str, Any] | None = None, *, name: str = ""
) -> HealingTable:
    """Read a CSV of holds.

    Parameters
    ----------
    path : str or Path
        Columns ``hold_time``, ``healing``, ``V`` and ``K``, in SI or with the unit after the name,
        as ``K (1/um)``; ``healing_err`` or ``healing_uncertainty``, the standard uncertainty, if it
        is known. K is over the normal load, or in N/m if there is a column ``W0``. Lines that begin
        with ``#``, and other columns, are skipped.
    given : mapping of str to number or str, optional
        Values of V, K and W0 if they are the same in all rows.
    name : str
        Name of the table in messages; by default that of the file.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, or a cell breaks its rule.
    """
    path = Path(path)
    columns = read_headed_columns(path, {*_KINDS, _UNCERTAINTY}, row="a hold")
    for number in given or {}:
        field, got = Argument("fixed", number), "a column of the data too"
        advice = "leave it out, or remove the column"
        require(number not in columns, field, "be given once", got, advice)
    return healing_table({**(given or {}), **columns}, name=name or path.name)


@typed
def healing_table(columns: Mapping[str, Any], *, name: str = "holds") -> HealingTable:
    """A table of holds from columns in memory.

    Parameters
    ----------
    columns : mapping of str to array, shape (rows,), number or text
        As in `read_healing`; numbers are SI and hold for all rows, texts carry their unit.
    name : str
        What messages call the table.

    Raises
    ------
    InputError
        If a column is missing, has another length, or breaks its rule.
    """
    if _UNCERTAINTY in columns:
        rule, got = "have one column of errors", f"healing_err and {_UNCERTAINTY}"
        require("healing_err" not in columns, name, rule, got, "remove one of them")
        columns = {"healing_err" if n == _UNCERTAINTY else n: v for n, v in columns.items()}
    missing = [n for n in _REQUIRED if n not in columns]
    if missing:
        raise InputError(
            f"{name} must have the columns {', '.join(_REQUIRED)}, got none for "
            f"{', '.join(missing)}; add them, or fix V and K where they are the same in all rows"
        )
    with_load = "W0" in columns
    arrays = {}
    for column, values in columns.items():
        if column not in _KINDS:
            continue
        kind, rule = _KINDS[column]
        kind = "stiffness" if column == "K" and with_load else kind
        checked = obeying(values, f"{name}.{column}", kind, rule)
        arrays[column] = np.atleast_1d(np.asarray(checked, float))
    rows = max(a.size for a in arrays.values())
    arrays = {n: in_all_rows(array, rows, f"{name}.{n}") for n, array in arrays.items()}
    K = arrays["K"] / arrays["W0"] if with_load else arrays["K"]
    return HealingTable(
        name, arrays["hold_time"], arrays[HEALING], arrays.get("healing_err"), arrays["V"], K
    )


def joined_holds(tables: Iterable[HealingTable]) -> HealingTable:
    """Join several tables into one.

    Raises
    ------
    InputError
        If some have errors and others have none.
    """
    tables = list(tables)
    known = [t.errors is not None for t in tables]
    if any(known) != all(known):
        rule = "be given for all tables of holds or for none"
        advice = "one error is estimated for all rows that have none"
        raise InputError("healing_err", rule, f"it for {sum(known)} of {len(known)}", advice)
    names = [*_COLUMNS, *(["errors"] if all(known) else [])]
    columns: dict[str, Any] = {n: np.concatenate([getattr(t, n) for t in tables]) for n in names}
    return HealingTable(", ".join(t.name for t in tables), **{"errors": None, **columns})


#: Largest number of equal rows that are named.
_NAMED = 5


@typed
def equal_rows(columns: Sequence[Float], names: Sequence[str]) -> list[str]:
    """Sentences on the rows of a table that are equal to earlier ones in all columns.

    Parameters
    ----------
    columns : sequence of array, shape (rows,)
    names : sequence of str, shape (rows,)
        Names of the rows.
    """
    table = np.column_stack(columns)
    _, first, which = np.unique(table, axis=0, return_index=True, return_inverse=True)
    copies = np.flatnonzero(first[which.ravel()] != np.arange(len(table)))
    sentences = [
        f"{names[row]} is equal to {names[first[which.ravel()[row]]]}: "
        "remove it if it is a copy, which counts twice"
        for row in copies[:_NAMED]
    ]
    if len(copies) > _NAMED:
        sentences.append(f"{len(copies) - _NAMED} more rows are equal to earlier ones")
    return sentences


#: Tables are padded to a multiple of this many holds.
_ROWS = 32


class HoldTerm(DataTerm):
    """A table of holds as a `DataTerm` of an objective.

    If the table has no errors, one `error` for all rows is used: at first a guess, which changes
    the estimates only if there are priors, and then the standard deviation of the residuals.

    Parameters
    ----------
    table : HealingTable
    law : type of Law
    fixed : mapping of str to float
        Parameters of the law that are not free, in SI.
    """

    observables = (HEALING,)
    failure = (
        "no start has a solution at every hold; give start values nearer to those of the interface"
    )

    def __init__(self, table: HealingTable, law: type[Law], fixed: Mapping[str, Any]) -> None:
        self.table, self.law, self.name = table, law, table.name
        self._fixed = {n: float(v) for n, v in fixed.items() if n in law_parameters(law)}
        self.error = 0.1 * float(np.ptp(table.healing)) or 1e-3
        self._smallest = 1e-12 * self.error
        self._freedom = math.inf

    @property
    def profiled(self) -> int:
        """1 if the error is estimated, else 0."""
        return int(self.table.errors is None)

    @property
    def sigma(self) -> Float:
        """Standard uncertainty of each row."""
        errors = self.table.errors
        return np.full(self.table.rows, self.error) if errors is None else errors

    @property
    def noise(self) -> Mapping[str, Any]:
        """Independent normal errors, as given or estimated."""
        rows = {"effective_samples": self.table.rows}
        if not self.profiled:
            return {"model": "independent, normal, as given", **rows}
        model = "independent, normal, one error for all holds, estimated from the residuals"
        return {"model": model, **rows, "error": self.error}

    def scatter(self, residuals: Residuals, information: Float) -> float:
        """The error by the residuals at an estimate.

        Parameters
        ----------
        residuals : Residuals
        information : array, shape (coordinates, coordinates)
            Information matrix of table and priors: a parameter that its prior determines leaves
            the residuals as a fixed one does.
        """
        fitted = leverages(residuals.jacobian, information).sum()
        self._freedom = self.table.rows - float(fitted)
        factor = math.sqrt(float(np.sum(residuals.values**2)) / self._freedom)
        return max(factor * self.error, self._smallest)

    def residuals(self, values: Mapping[str, float]) -> Residuals | None:
        """Residuals in standard uncertainties; None where a hold has no solution."""
        names = tuple(n for n in values if n in law_parameters(self.law))
        table, rows = self.table, self.table.rows
        at = np.minimum(np.arange(-(-rows // _ROWS) * _ROWS), rows - 1)
        known = self._fixed | {n: values[n] for n in names}
        given = {n: jnp.full(at.shape, v) for n, v in known.items()}
        drive = (jnp.asarray(x[at]) for x in (table.K, table.V, table.hold_time))
        predicted, slopes = (np.asarray(a) for a in _with_slopes(self.law, names, given, *drive))
        columns = np.zeros((rows, len(values)))
        columns[:, [n in names for n in values]] = slopes.T[:rows]
        sigma = self.sigma
        whitened = (predicted[:rows] - table.healing) / sigma
        if not (np.isfinite(whitened).all() and np.isfinite(columns).all()):
            return None
        return Residuals(
            whitened,
            columns / sigma[:, None],
            np.full(rows, HEALING),
            np.arange(rows),
            float(np.log(sigma).sum()),
        )

    def uncertainty_of_noise(
        self, values: Mapping[str, float], slopes: Float, covariance: Float
    ) -> tuple[Float, Float]:
        """As in `DataTerm`: that of the table scales with the square of an estimated error."""
        residuals = self.residuals(values)
        assert residuals is not None  # there is a solution at the estimate
        along = (residuals.jacobian * slopes) @ covariance
        return np.zeros_like(covariance), 2 / self._freedom * np.sum(along**2, axis=0) ** 2

    def log_likelihood(self, residuals: Residuals) -> float:
        """As in `DataTerm`: with the error of the largest likelihood, of all rows.

        The likelihoods of AICc and BIC are maxima. The error of the intervals is larger, by the
        number of parameters that were fitted to the same rows.
        """
        if not self.profiled:
            return log_density(residuals)
        values, n = residuals.values, self.table.rows
        factor = max(math.sqrt(float(values @ values) / n), 1e-12)
        log_scale = residuals.log_scale + n * math.log(factor)
        return log_density(residuals._replace(values=values / factor, log_scale=log_scale))

    def observed(self) -> Mapping[str, Float]:
        """Holds and healing."""
        t = self.table
        return {"hold_time": t.hold_time, "V": t.V, "K": t.K, HEALING: t.healing}

    def warnings(
        self, residuals: Residuals, information: Float, outliers: Sequence[int] = ()
    ) -> Sequence[str]:
        """Sentences on equal rows, and on outliers or an estimated error."""
        table = self.table
        columns = (table.hold_time, table.healing, table.V, table.K)
        sentences = equal_rows(columns, table.row_names.tolist())
        if not self.profiled:
            return [*sentences, *outlier_sentence(table.row_names[list(outliers)])]
        return [
            *sentences,
            f"{self.name} has no healing_err: one standard uncertainty for all holds, "
            f"{self.error:.3g}, is estimated from the residuals, and chi-squared judges nothing",
        ]


@partial(jax.jit, static_argnums=(0, 1))
def _with_slopes(
    law: type[Law],
    names: tuple[str, ...],
    given: dict[str, Array],
    K: Array,
    V: Array,
    hold_time: Array,
) -> tuple[Array, Array]:
    """Healing, and its derivatives with respect to the named parameters, shape (names, points)."""

    def of(values: dict[str, Array]) -> Array:
        slider = slider_from(law, {**given, **values, "K": K, "W0": jnp.ones_like(K)})
        reloading, _ = hold(slider, V, hold_time)
        return reloading.maximum - reloading.level

    def along(shares: Array) -> Array:
        change = {n: jnp.broadcast_to(s, K.shape) for n, s in zip(names, shares, strict=True)}
        return jax.jvp(of, ({n: given[n] for n in names},), (change,))[1]

    return of({}), jax.vmap(along)(jnp.eye(len(names)))
