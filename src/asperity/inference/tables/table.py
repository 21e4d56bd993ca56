"""Tables of lock-in readings: observables with uncertainties at each operating point.

A table is a text file with one operating point in each row, as ``asperity measure`` writes it for
many recordings, or the JSON that ``asperity measure --json`` prints for one recording.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr

from asperity.arrays import Bool, Float, Index
from asperity.errors import Argument, InputError, require
from asperity.laws import registered
from asperity.outputs.json import parsed_json
from asperity.outputs.targets import require_rereadable
from asperity.parameters import MODULATION, all_parameters, canonical_name
from asperity.parameters.arguments import shown as shown_value, typed
from asperity.parameters.columns import cell_number, headings, readable, sheet
from asperity.parameters.toml_file import file_content
from asperity.units import to_radians, to_si

#: Observables of a row, in the order of residuals. Convention: F/W0 = mean_friction + sum of
#: mu_n cos(n w t + phase_n), delta_mu = mean_friction - mu_ss(V).
OBSERVABLES = ("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2")
#: Columns of a table of responses that say nothing about the measurement.
_OF_RESPONSES = ("floquet_max", "stable", "converged", "result", "law")
#: The two observables, in the order above, of each column of covariances.
_PAIRS = {
    f"{a}_{b}_cov": pair for pair in combinations(OBSERVABLES, 2) for a, b in (pair, pair[::-1])
}
_OPERATING = ("V", "epsilon", "frequency")
#: Fields of a table that hold columns by name.
_COLUMNS = ("points", "values", "errors", "covariances")
#: Columns of the standard uncertainty of epsilon.
_OF_EPSILON = ("epsilon_err", "epsilon_uncertainty")
#: Columns of texts: the run of a row (the first of these columns that exists); the kind of a row of
#: a campaign and the reason without a reading; the unit of the loads.
_RUN, _KIND, _REASON, _UNIT = ("run", "file"), "kind", "reason", "unit"
_TEXTS = (*_RUN, _KIND, _REASON, _UNIT)
#: Smallest allowed eigenvalue of the correlations of a row.
_SMALLEST_EIGENVALUE = 1e-9
#: Smallest standard uncertainty of a reading; the largest is 1 over this.
_SMALLEST_ERROR = 1e-15
#: Larger friction values are in per cent or not divided by the load.
_LARGEST_FRICTION = 10.0
#: mean_friction and delta_mu have the same errors if their agreement has a lower probability.
_SAME_NOISE = 1e-4


@typed
@dataclass(frozen=True, eq=False)
class LockInTable:
    """Observables with standard uncertainties, one operating point in each row.

    Attributes
    ----------
    name : str
        Name of the table in messages.
    points : mapping of str to array, shape (rows,)
        Parameters of the rows by name, in SI: at least V, epsilon and frequency. `epsilon` is
        the amplitude that was applied; contacts carry ``eps_ratio`` of it.
    values : mapping of str to array, shape (rows,)
        Observables by name; NaN if a row does not report an observable.
    errors : mapping of str to array, shape (rows,)
        Standard uncertainties of the observables (phases in rad), and of `epsilon` if it was
        measured.
    covariances : mapping of (str, str) to array, shape (rows,)
        Covariances of pairs of observables of a row, in SI and rad; NaN where unknown.
    run : array of str, shape (rows,)
        Run of each row: its file, or the entry of a column `run`.
    remarks : tuple of str
        Sentences on the reading of the table, for reports.
    row_names : array of str, shape (rows,)
        Names of the rows in messages, such as "row 3" of the file.
    """

    name: str
    points: Mapping[str, Float]
    values: Mapping[str, Float]
    errors: Mapping[str, Float]
    covariances: Mapping[tuple[str, str], Float] = field(default_factory=dict)
    run: NDArray[np.str_] = field(default_factory=lambda: np.array([], dtype=str))
    remarks: tuple[str, ...] = ()
    row_names: NDArray[np.str_] = field(default_factory=lambda: np.array([], dtype=str))

    def __post_init__(self) -> None:
        for name in _OPERATING:
            rule, got = f"have {name} of each row", "none"
            require(name in self.points, "points", rule, got, "give it in SI")
        if self.run.size == 0:
            object.__setattr__(self, "run", np.full(self.rows, self.name))
        if self.row_names.size == 0:
            names = np.array([f"row {i}" for i in range(1, self.rows + 1)])
            object.__setattr__(self, "row_names", names)

    @property
    def rows(self) -> int:
        """Number of operating points."""
        return len(self.points["V"])

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables of the table."""
        return tuple(self.values)

    def correlations(self) -> Float:
        """Correlations of the observables of each row, shape (rows, n, n), n = len(OBSERVABLES)."""
        size = len(OBSERVABLES)
        result = np.broadcast_to(np.eye(size), (self.rows, size, size)).copy()
        for (first, second), column in self.covariances.items():
            if first not in self.values or second not in self.values:
                continue
            i, j = OBSERVABLES.index(first), OBSERVABLES.index(second)
            both = np.isfinite(self.values[first]) & np.isfinite(self.values[second])
            errors = np.where(both, self.errors[first] * self.errors[second], 1.0)
            value = np.where(both, np.nan_to_num(column) / errors, 0.0)
            result[:, i, j] = result[:, j, i] = value
        return result

    @typed
    def without(self, rows: Bool) -> LockInTable:
        """The table without some of its rows."""
        kept: dict[str, Any] = {
            field: {name: column[~rows] for name, column in getattr(self, field).items()}
            for field in _COLUMNS
        }
        return replace(self, **kept, run=self.run[~rows], row_names=self.row_names[~rows])

    @typed
    def disturbed(self, exact: Mapping[str, Float], normal: Float) -> LockInTable:
        """The table with simulated readings: exact readings plus errors.

        Errors of a harmonic with a phase are added in the complex plane. The uncertainty across the
        phasor is that of this table, at any simulated amplitude.

        Parameters
        ----------
        exact : mapping of str to array, shape (rows,)
            Observables without noise.
        normal : array, shape (rows, len(OBSERVABLES))
            Errors in units of the uncertainties.
        """
        values = {n: np.where(np.isfinite(self.values[n]), exact[n], np.nan) for n in self.values}
        errors, units = dict(self.errors), dict(zip(OBSERVABLES, normal.T, strict=True))
        for name in ("mean_friction", "delta_mu"):
            if name in values:
                values[name] = values[name] + errors[name] * units[name]
        for amplitude, phase in (("mu1", "phase1"), ("mu2", "phase2")):
            if amplitude not in values:
                continue
            # Relative to the exact phase.
            phasor = values[amplitude] + errors[amplitude] * units[amplitude] + 0j
            if phase in values:
                across = self.values[amplitude] * errors[phase]
                both = np.isfinite(values[phase])
                phasor = phasor + 1j * np.where(both, across * units[phase], 0.0)
                values[phase] = values[phase] + np.angle(phasor)
                errors[phase] = np.where(both, across / np.maximum(np.abs(phasor), 1e-300), np.nan)
            values[amplitude] = np.abs(phasor)
        scale = {n: errors[n] / self.errors[n] for n in values}
        covariances = {(a, b): c * scale[a] * scale[b] for (a, b), c in self.covariances.items()}
        return replace(self, values=values, errors=errors, covariances=covariances)


@typed
def read_table(
    path: str | Path, given: Mapping[str, Any] | None = None, *, name: str = ""
) -> LockInTable:
    """Read a table from a text file.

    Parameters
    ----------
    path : str or Path
        CSV with ``,``, ``;`` or tab. Columns: V (m/s), epsilon, frequency (Hz), any other parameter
        of an operating point, in SI or in the unit in its heading, as ``V (um/s)``, and observables
        with their standard uncertainties in
        ``<name>_err`` or ``<name>_uncertainty``. Cells of observables may be empty. Covariances
        of observables of a row are in ``<name>_<name>_cov``. A column ``run`` or ``file`` says
        which rows were measured together. Or the JSON of ``asperity measure --json``.
    given : mapping, optional
        V, epsilon and frequency of all rows, in SI or as texts with units, where the table has
        no such column.
    name : str
        Name of the table in messages; by default that of the file.

    Raises
    ------
    InputError
        If the file cannot be read, a column or cell is wrong, an uncertainty is missing, zero or
        negative, or a row occurs twice.
    """
    path = Path(path)
    shown = name or path.name
    require_rereadable(path, "data")
    with readable(path, "data", "file"):
        content = file_content(path)
        if path.suffix.lower() == ".json":
            text = content.decode("utf-8-sig")
            return table_of(_completed(_row_of_reading(shown, text), given), name=shown)
    csv = sheet(path, lambda n: _is_read(n) and n not in _TEXTS, content=content)
    cells = list(csv.rows())
    texts, units = _columns(shown, csv.heading, cells)
    blank = np.full(len(cells), "")
    kind, failed = texts.get(_KIND, blank), texts.get(_REASON, blank) != ""
    # A row of a campaign without modulation is a reading too.
    level = (kind == "level") & np.isin(texts.get("epsilon", blank), ("0", "0.0"))
    kept = ~failed & (np.isin(kind, ("", "amplitude")) | level)
    remarks = []
    if any(heading.strip() == "eps_ratio" for heading in csv.heading):
        remarks.append(f"the column eps_ratio of {shown} is not read: fix or free eps_ratio")
    if not kept.any():
        raise InputError(
            f"{shown} must have lock-in readings, got none: every row is another kind of "
            "measurement or has a reason why it could not be measured; fit the recordings "
            "themselves, or measure modulated ones"
        )
    if not kept.all():
        remarks.append(
            f"{int((~kept).sum())} rows of {shown} are no lock-in readings and are left out, the "
            f"first of them row {np.argmin(kept) + 1}"
        )
    texts = {n: column[kept] for n, column in texts.items()}
    names = [f"row {i + 1}" for i in np.flatnonzero(kept)]
    columns: dict[str, Any] = {
        n: _numbers(shown, n, column, names) for n, column in texts.items() if n not in _TEXTS
    }
    for n, unit in units.items():
        if n in columns:
            columns[n] = columns[n] * _unit_in_si(shown, n, unit)
    if _UNIT in texts and "W0" in columns and "W0" not in units:
        columns["W0"] = _loads_in_si(shown, columns["W0"], texts[_UNIT].tolist())
    run = next((texts[n].tolist() for n in _RUN if n in texts), None)
    columns = _completed(columns, given)
    return table_of(columns, name=shown, run=run, remarks=remarks, row_names=names)


def _columns(
    shown: str, header: Sequence[str], rows: Sequence[Sequence[str]]
) -> tuple[dict[str, NDArray[np.str_]], dict[str, str]]:
    """Columns by name, as stripped texts, and the units in their headings."""
    rule = "have a header and rows"
    require(rows, shown, rule, "no rows", "give one operating point a row")
    for number, row in enumerate(rows, start=1):
        rule, got = f"have {len(header)} cells in each row", f"{len(row)} in row {number}"
        require(len(row) == len(header), shown, rule, got, "correct the separators")
    cells = np.char.strip(np.array(rows, dtype=str).T)
    columns = headings(header, shown, _is_read)
    return (
        {name: cells[place] for name, (place, _) in columns.items()},
        {name: unit for name, (_, unit) in columns.items() if unit},
    )


def _is_read(name: str) -> bool:
    """Whether the reader knows a column; other columns are ignored."""
    known = canonical_name(name, _known()) or _observable_of(name) or name.endswith("_cov")
    return name in (*_TEXTS, *_OF_EPSILON) or (bool(known) and name not in _OF_RESPONSES)


def _unit_in_si(shown: str, name: str, unit: str) -> float:
    """The SI value of the unit in the heading of a column."""
    known, label = _known(), f"{shown}.{name}"
    if (parameter := canonical_name(name, known)) is not None:
        return known[parameter].unit_in_si(unit, label)
    one = f"1 {unit}"
    phase = (_observable_of(name) or "").startswith("phase")
    return float(to_radians(one, label) if phase else to_si(one, "dimensionless", label))


def _loads_in_si(table: str, loads: Float, units: Sequence[str]) -> Float:
    """W0 of a campaign in N, from loads in the unit of the channels."""
    return np.array(
        [
            to_si(f"{load!r} {unit}", "force", f"{table}.W0") if unit else load
            for load, unit in zip(loads.tolist(), units, strict=True)
        ]
    )


def _completed(columns: dict[str, Any], given: Mapping[str, Any] | None) -> dict[str, Any]:
    """Columns, completed by numbers that hold for all rows."""
    known = _known()
    have = {canonical_name(name, known) for name in columns}
    more = {n: known[n].check(v) for n, v in (given or {}).items() if n not in have}
    return columns | more


def _row_of_reading(shown: str, text: str) -> dict[str, Any]:
    """Columns of one reading, from the JSON of ``asperity measure``."""
    wrong = InputError(
        f"{shown} must be what 'asperity measure --json' prints for a modulated recording, got "
        "something else; give that or a CSV file"
    )
    try:
        record = parsed_json(text, shown)
        modulated = record["mode"] == "modulated"
        errors, unit = record["uncertainties"], record["unit"]
        columns = {name: float(record[name]) for name in ("epsilon", "frequency", "W0")}
        observed = [n for n in OBSERVABLES if record.get(n) is not None]
        columns["epsilon_err"] = float(errors["epsilon"])
        columns |= {n: float(record[n]) for n in observed}
        columns |= {f"{n}_err": float(errors[n]) for n in observed}
        joint = record.get("observable_covariance", {"names": [], "matrix": []})
        for i, first in enumerate(joint["names"]):
            for j, second in enumerate(joint["names"][:i]):
                columns[f"{second}_{first}_cov"] = float(joint["matrix"][i][j])
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError):
        raise wrong from None
    if not modulated:
        raise wrong
    columns["W0"] = float(_loads_in_si(shown, np.array([columns["W0"]]), [unit])[0])
    return columns


def _numbers(shown: str, name: str, cells: NDArray[np.str_], row_names: Sequence[str]) -> Float:
    """Numbers of a column; NaN in empty cells."""
    values = np.full(cells.size, math.nan)
    for row, cell in enumerate(cells.tolist()):
        try:
            values[row] = cell_number(cell) if cell else math.nan
        except ValueError:
            rule = f"have numbers without unit in column {name}"
            got = f"{shown_value(cell)} in {row_names[row]}"
            advice = "write it with a decimal point, and the unit into the heading"
            raise InputError(shown, rule, got, advice) from None
    return values


@typed
def table_of(
    columns: Mapping[str, Any],
    *,
    name: str = "data",
    run: Sequence[str] | None = None,
    remarks: Sequence[str] = (),
    row_names: Sequence[str] | None = None,
) -> LockInTable:
    """A table from columns in memory.

    Parameters
    ----------
    columns : mapping of str to array, shape (rows,), or number
        As the columns of `read_table`; numbers hold for all rows.
    name : str
        What messages call the table.
    run : sequence of str, shape (rows,), optional
        Run of each row; by default one run.
    remarks : sequence of str
        Sentences on the reading of the table so far.
    row_names : sequence of str, shape (rows,), optional
        Names of the rows in messages; by default "row 1" and so on.

    Raises
    ------
    InputError
        As `read_table`.
    """
    arrays = {}
    for key in (key for key in columns if key not in _OF_RESPONSES):
        try:
            arrays[key] = np.atleast_1d(np.asarray(columns[key], dtype=float))
        except (TypeError, ValueError):
            rule, advice = "be numbers in SI", "convert it, as asperity.units.to_si does"
            raise InputError(f"{name}.{key}", rule, shown_value(columns[key]), advice) from None
    rows = max((a.size for a in arrays.values()), default=0)
    if row_names is None:
        row_names = [f"row {i}" for i in range(1, rows + 1)]
    _fill_frequency(arrays)
    arrays = {key: in_all_rows(a, rows, f"{name}.{key}") for key, a in arrays.items()}
    points, observed, covariances, of_epsilon = _by_role(name, arrays, row_names)
    missing = [p for p in _OPERATING if p not in points]
    if missing:
        raise InputError(
            f"{name} must have the columns {', '.join(_OPERATING)}, got none for "
            f"{', '.join(missing)}; add them in SI, or use {Argument('fixed', missing[0])} where "
            "all rows have the same"
        )
    values, errors = _observables(name, observed, row_names)
    holds = run is None or len(run) == rows
    require(holds, "run", f"have {rows} names", len(run or ()), "give the run of each row")
    runs = np.full(rows, name) if run is None else np.array([str(r) or name for r in run])
    errors |= of_epsilon
    table = LockInTable(
        name, points, values, errors, covariances, runs, tuple(remarks), np.array(row_names)
    )
    _refuse_copies(table, table, "{0} must have each reading once, got {2} equal to {1}")
    _refuse_impossible(table)
    return _without_copies(table)


def _by_role(
    table: str, arrays: Mapping[str, Float], row_names: Sequence[str]
) -> tuple[dict[str, Float], dict[str, Float], dict[tuple[str, str], Float], dict[str, Float]]:
    """Operating points, observables with errors, covariances, and the error of epsilon."""
    known = _known()
    points: dict[str, Float] = {}
    observed: dict[str, Float] = {}
    covariances: dict[tuple[str, str], Float] = {}
    of_epsilon: dict[str, Float] = {}
    for key, column in arrays.items():
        parameter = canonical_name(key, known)
        if parameter in MODULATION:
            # An empty cell means 0: a harmonic load.
            rule = "be 0, since fits are to a harmonic load"
            zero = np.nan_to_num(column) == 0
            _require(row_names, zero, table, key, column, rule, "leave those rows out")
        elif parameter is not None:
            _require_one_column(table, parameter, key, parameter in points)
            finite, rule = np.isfinite(column), "be a finite number"
            advice = "fill the cell in or leave the row out"
            _require(row_names, finite, table, parameter, column, rule, advice)
            points[parameter] = np.asarray(known[parameter].check(column, f"{table}.{parameter}"))
        elif key in _PAIRS:
            pair = " and ".join(_PAIRS[key])
            _require_one_column(table, f"the covariance of {pair}", key, _PAIRS[key] in covariances)
            covariances[_PAIRS[key]] = column
        elif key.endswith("_cov") and key.startswith(OBSERVABLES):
            raise InputError(
                f"{table}.{key} must name two observables as <name>_<name>_cov, of "
                f"{', '.join(OBSERVABLES)}; correct the name: it would be left out"
            )
        elif key in _OF_EPSILON:
            _require_one_column(table, "epsilon_err", key, "epsilon" in of_epsilon)
            # Without a column or cell, epsilon is exact.
            spread = np.nan_to_num(column)
            good = np.isfinite(spread) & (spread >= 0)
            rule = "be finite and not negative"
            _require(row_names, good, table, key, column, rule, "correct it")
            of_epsilon["epsilon"] = spread
        elif (plain := _observable_of(key)) is not None:
            _require_one_column(table, plain, key, plain in observed)
            observed[plain] = column
    return points, observed, covariances, of_epsilon


def _require_one_column(table: str, quantity: str, key: str, known: bool) -> None:
    """Refuse a second column of a quantity."""
    rule, got = f"have one column for {quantity}", f"'{key}' as a second one"
    require(not known, table, rule, got, "remove one of them")


def in_all_rows(column: Float, rows: int, label: str) -> Float:
    """A column with a value in each row, from one value or from so many.

    Raises
    ------
    InputError
        If it has another shape.
    """
    if column.ndim != 1 or column.size not in (1, rows):
        rule, got = f"have one value or {rows}", f"an array of shape {column.shape}"
        raise InputError(label, rule, got, "give columns of one length")
    return np.broadcast_to(column, (rows,)).copy()


def _fill_frequency(arrays: dict[str, Float]) -> None:
    """Set a frequency in rows without modulation, which has no influence."""
    names = {canonical_name(key, _known()): key for key in arrays}
    epsilon = arrays.get(names.get("epsilon", ""), np.empty(0))
    if np.any(epsilon == 0):
        key = names.get("frequency", "frequency")
        frequency = arrays.get(key, np.full(epsilon.size, np.nan))
        if frequency.size == epsilon.size:
            arrays[key] = np.where((epsilon == 0) & np.isnan(frequency), 1.0, frequency)


def _observable_of(column: str) -> str | None:
    """The name of a column of observables, with ``_uncertainty`` as ``_err``; else None."""
    stem = column.removesuffix("_err").removesuffix("_uncertainty")
    if stem not in OBSERVABLES:
        return None
    return stem if stem == column else f"{stem}_err"


def _known() -> Mapping[str, Any]:
    return all_parameters(registered().values())


def _require(
    row_names: Sequence[str],
    good: Bool,
    table: str,
    column: str,
    values: Float,
    rule: str,
    advice: str,
) -> None:
    """Refuse a column with the first row that breaks a rule."""
    if not good.all():
        row = int(np.argmin(good))
        raise InputError(f"{table}.{column}", rule, f"{values[row]:g} in {row_names[row]}", advice)


def _observables(
    table: str, observed: Mapping[str, Float], row_names: Sequence[str]
) -> tuple[dict[str, Float], dict[str, Float]]:
    values = {n: observed[n] for n in OBSERVABLES if n in observed}
    if not values:
        raise InputError(
            f"{table} must report at least one of {', '.join(OBSERVABLES)}, got none; name the "
            "columns so"
        )
    errors = {}
    for name, column in values.items():
        _require_possible(table, name, column, row_names)
        if f"{name}_err" not in observed:
            raise InputError(
                f"{table} must have the standard uncertainty of {name}, got no column {name}_err; "
                "add it: a fit without it cannot say how sure it is"
            )
        error, absent = observed[f"{name}_err"], ~np.isfinite(column)
        advice = "give the standard uncertainty"
        good = absent | (np.isfinite(error) & (error > 0))
        _require(
            row_names, good, table, f"{name}_err", error, "be a finite positive number", advice
        )
        # Values are of order 1: no uncertainty lies below the spacing of doubles, or as far above
        # 1.
        good = absent | ((error >= _SMALLEST_ERROR) & (error <= 1 / _SMALLEST_ERROR))
        rule = f"be from {_SMALLEST_ERROR:g} to {1 / _SMALLEST_ERROR:g}"
        _require(row_names, good, table, f"{name}_err", error, rule, advice)
        errors[name] = error
    for phase, amplitude in (("phase1", "mu1"), ("phase2", "mu2")):
        if phase not in values:
            continue
        absent = ~np.isfinite(values.get(amplitude, np.full_like(values[phase], math.nan)))
        alone = np.isfinite(values[phase]) & absent
        if amplitude not in values or alone.any():
            got = f"an empty cell in {row_names[int(np.argmax(alone))]}"
            raise InputError(
                f"{table} must have {amplitude} where it has {phase}, got "
                f"{got if amplitude in values else 'no such column'}; a phase weighs as much as "
                "its amplitude"
            )
    return values, errors


def _require_possible(table: str, name: str, column: Float, row_names: Sequence[str]) -> None:
    """Refuse infinite values, wrong signs, and phases or forces in other units."""
    size = np.abs(column)
    rules = [(np.isinf(column), "be finite", "leave the cell empty")]
    if name == "mean_friction":
        rules.append((column <= 0, "be positive", "reverse the sign of the force"))
    if name in ("mu1", "mu2"):
        advice = f"put the sign into phase{name[-1]}"
        rules.append((column < 0, "be an amplitude, at least 0", advice))
    if name in ("phase1", "phase2"):
        rules.append((size > 2 * math.pi, "be in rad, from -2 pi to 2 pi", "convert degrees"))
    else:
        limit = f"be a force over W0, below {_LARGEST_FRICTION:g}"
        rules.append((size >= _LARGEST_FRICTION, limit, "divide by the load, or convert per cent"))
    for bad, rule, advice in rules:
        _require(row_names, ~bad, table, name, column, rule, advice)


def _refuse_impossible(table: LockInTable) -> None:
    """Refuse covariances of missing observables, and impossible covariances."""
    if not table.covariances:
        return
    for pair in table.covariances:
        absent = [n for n in pair if n not in table.values]
        if absent:
            rule, got = f"report both observables of {'_'.join(pair)}_cov", f"no column {absent[0]}"
            raise InputError(table.name, rule, got, "add it or remove the covariance")
    correlation = table.correlations()
    smallest = np.linalg.eigvalsh(correlation)[:, 0]
    bad = np.flatnonzero(smallest < _SMALLEST_EIGENVALUE)
    if bad.size:
        row = int(bad[0])
        upper = np.triu(np.abs(correlation[row]), 1)
        i, j = np.unravel_index(int(np.argmax(upper)), upper.shape)
        raise InputError(
            f"{table.name} must have a positive definite covariance of the observables of a row, "
            f"got one of {table.row_names[row]} that is not, with a correlation of "
            f"{correlation[row, i, j]:.4g} between {OBSERVABLES[i]} and {OBSERVABLES[j]}; check "
            "the covariances against the squares of the uncertainties"
        )


def _without_copies(table: LockInTable) -> LockInTable:
    """The table without readings of delta_mu that only repeat mean_friction.

    Their difference is mu_ss(V). If both have independent errors, it scatters about a smooth
    function of ln V; if one was computed from the other, it does not scatter.
    """
    if not {"mean_friction", "delta_mu"} <= set(table.values):
        return table
    if ("mean_friction", "delta_mu") in table.covariances:
        return table
    steady = table.values["mean_friction"] - table.values["delta_mu"]
    both = np.isfinite(steady)
    x = np.log(table.points["V"][both])
    degree = min(2, np.unique(x).size - 1)
    dof = int(both.sum()) - degree - 1
    if dof < 1:
        return table
    uncertainty = np.hypot(table.errors["mean_friction"][both], table.errors["delta_mu"][both])
    smooth = np.polyval(
        np.polyfit(x - x.mean(), steady[both], degree, w=1 / uncertainty), x - x.mean()
    )
    if chdtr(dof, float(np.sum(((steady[both] - smooth) / uncertainty) ** 2))) > _SAME_NOISE:
        return table
    kept = np.where(both, np.nan, table.values["delta_mu"])
    values = {**table.values, "delta_mu": kept}
    if not np.isfinite(kept).any():
        del values["delta_mu"]
    remark = (
        f"mean_friction and delta_mu of {table.name} differ by a smooth mu_ss(V) without scatter: "
        "they are one measurement; delta_mu is left out in rows that have both"
    )
    return replace(table, values=values, remarks=(*table.remarks, remark))


def _refuse_copies(first: LockInTable, second: LockInTable, sentence: str) -> None:
    """Refuse a reading that occurs twice: all columns that both rows have are equal.

    One row may have further columns, such as the load or another observable. `sentence` has places
    for the name of the second table and those of the two rows.
    """
    inputs = [n for n in first.points if n in second.points]
    observed = [n for n in first.values if n in second.values]
    if not observed:
        return
    values, readings = (np.column_stack([t.values[n] for n in observed]) for t in (first, second))
    points, others = (zip(*(t.points[n] for n in inputs), strict=True) for t in (first, second))
    places: dict[tuple[float, ...], list[int]] = {}
    for row, point in enumerate(points):
        places.setdefault(point, []).append(row)
    for row, point in enumerate(others):
        at = [i for i in places.get(point, []) if first is not second or i < row]
        both = np.isfinite(values[at]) & np.isfinite(readings[row])
        equal = both.any(1) & ((values[at] == readings[row]) | ~both).all(1)
        if equal.any():
            one, other = first.row_names[at[int(np.argmax(equal))]], second.row_names[row]
            raise InputError(
                f"{sentence.format(second.name, one, other)}; remove the copy: it would count twice"
            )


def joined(tables: Iterable[LockInTable]) -> tuple[LockInTable, Index]:
    """Several tables as one, and the number of the table of each row.

    A parameter that a table lacks is NaN in its rows; the caller must fix its value.

    Raises
    ------
    InputError
        If two tables contain the same reading.
    """
    tables = list(tables)
    for j, second in enumerate(tables):
        for i, first in enumerate(tables[:j]):
            _refuse_copies(
                first,
                second,
                "data must hold each reading once, got {2} of {0} "
                f"(table {j + 1}) equal to {{1}} of {first.name} (table {i + 1})",
            )
    of_table = np.concatenate([np.full(t.rows, i) for i, t in enumerate(tables)])
    if len(tables) == 1:
        return tables[0], of_table
    names = [t.name for t in tables]
    names = [n if names.count(n) == 1 else f"{n} (table {i})" for i, n in enumerate(names, 1)]

    def named(field: str) -> NDArray[np.str_]:
        """Names of rows or runs, which differ between tables."""
        pairs = zip(names, tables, strict=True)
        return np.array(
            [
                name if n == t.name else f"{n} of {name}"
                for name, t in pairs
                for n in getattr(t, field)
            ]
        )

    def stacked(field: str) -> dict[Any, Float]:
        names = dict.fromkeys(n for t in tables for n in getattr(t, field))
        return {
            n: np.concatenate([getattr(t, field).get(n, np.full(t.rows, np.nan)) for t in tables])
            for n in names
        }

    columns: dict[str, Any] = {field: stacked(field) for field in _COLUMNS}
    whole = LockInTable(
        " and ".join(t.name for t in tables),
        **columns,
        run=named("run"),
        remarks=tuple(r for t in tables for r in t.remarks),
        row_names=named("row_names"),
    )
    return whole, of_table
