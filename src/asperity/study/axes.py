"""The axes of a sweep: rows of numbers that belong together, listed or drawn.

`axis_record` reads an axis as a plan writes it; a `SweepAxis` has its rows.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import between, spaced
from asperity.errors import InputError, require
from asperity.laws import get_law, known_law
from asperity.parameters import Parameter, canonical_name, suggestion
from asperity.parameters.arguments import file_path, number, shown
from asperity.questions.sweep import AxisTable, Sweep

Column = NDArray[Any]

#: Names of the columns of texts; all other columns have numbers.
TEXTS = ("law", "data")

#: Rows of a block of random draws. Each block has its own seed, so that it can be drawn without the
#: blocks before it.
_BLOCK_ROWS = 4096

#: A Sobol sequence of b bits has 2^b points; SciPy cannot skip points of a sequence with more bits.
SOBOL_BITS = 30

#: Largest number of rows of a listed axis, which is kept in memory and in the record.
MOST_LISTED = 1_000_000


class SweepAxis:
    """One axis of a sweep: rows that are listed, or random or quasi-random draws.

    Parameters
    ----------
    name : str
    record : mapping
        From `axis_record`.

    Attributes
    ----------
    name : str
    names : tuple of str
        Names of the columns: parameters, ratios, ``law`` or ``data``.
    length : int
        Number of rows.
    """

    def __init__(self, name: str, record: Mapping[str, Any]) -> None:
        self.name, self._record = name, record
        self.names = columns_of(record)
        columns = record.get("columns", {})
        # None, where a row has no value, becomes NaN.
        self._listed = {n: np.array(v, object if n in TEXTS else float) for n, v in columns.items()}
        self.length = record["count"] if "over" in record else len(columns[self.names[0]])

    def rows(self, start: int, stop: int) -> dict[str, Column]:
        """The columns from row `start` to before `stop`: SI, NaN where a row has no value.

        A row is drawn without the rows before it.
        """
        if self._listed:
            return {name: values[start:stop] for name, values in self._listed.items()}
        # The normal distribution has no quantile at 0 and at 1.
        u = np.clip(self._uniform(start, stop), 2.0**-53, 1 - 2.0**-53)
        spreads = self._record["over"].items()
        return {name: _quantile(spread, u[:, i]) for i, (name, spread) in enumerate(spreads)}

    def _uniform(self, start: int, stop: int) -> Column:
        """Draws in the unit cube, shape (rows, columns)."""
        from scipy.stats import qmc

        dimensions, method, seed = len(self.names), self._record["draw"], self._record["seed"]
        if method == "random":
            first = start // _BLOCK_ROWS
            blocks = [
                np.random.default_rng([seed, block]).random((_BLOCK_ROWS, dimensions))
                for block in range(first, -(-stop // _BLOCK_ROWS))
            ]
            skip = start - first * _BLOCK_ROWS
            return np.concatenate(blocks)[skip : skip + stop - start]
        scramble = np.random.default_rng(seed)
        if method == "halton":
            sequence: Any = qmc.Halton(dimensions, rng=scramble)
            # A Halton point follows from its number; fast_forward would compute all points before.
            sequence.num_generated = start
        else:
            sequence = qmc.Sobol(dimensions, bits=SOBOL_BITS, rng=scramble)
            if start:
                sequence.fast_forward(start)
        with warnings.catch_warnings():
            # SciPy warns where the number of Sobol points is not a power of two.
            warnings.simplefilter("ignore", UserWarning)
            return np.asarray(sequence.random(stop - start))


def _quantile(spread: Mapping[str, Any], u: Column) -> Column:
    """The quantile `u`, 0 < u < 1, of a drawn number.

    Its ``kind`` is "linear" or "log", uniform between ``low`` and ``high`` in the number or in its
    logarithm, or "normal" with the mean ``low`` and the standard deviation ``high``.
    """
    from scipy.special import ndtri

    low, high = spread["low"], spread["high"]
    if spread["kind"] == "normal":
        return np.asarray(low + high * ndtri(u))
    return between(low, high, u, log=spread["kind"] == "log")


def columns_of(axis: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the columns of an axis, from the record of the axis."""
    return tuple(axis["columns"] if "columns" in axis else axis["over"])


def axis_record(
    name: str, table: AxisTable, known: Mapping[str, Parameter], plan: Sweep
) -> tuple[str, dict[str, Any]]:
    """Name of an axis, and the axis as JSON values in SI.

    Raises
    ------
    InputError
        If the axis has an unknown name or an invalid value.
    """
    if table.draw is not None:
        spreads = {
            _name(column, known): _spread(column, spread, known)
            for column, spread in (table.over or {}).items()
        }
        require(spreads, "over", "name what is drawn", "nothing", "add over.K = { ... }")
        holds = table.draw != "sobol" or not (table.count or 0) > 2**SOBOL_BITS
        rule = f"be at most 2^{SOBOL_BITS} of a Sobol sequence"
        require(holds, "count", rule, f"{table.count:,}", "draw 'halton' or 'random'")
        return name, {"draw": table.draw, "seed": plan.seed, "count": table.count, "over": spreads}
    if table.zip is not None:
        columns = {_name(n, known): _column(n, v, known, plan.folder) for n, v in table.zip.items()}
        lengths = {n: len(v) for n, v in columns.items()}
        if len(set(lengths.values())) != 1:
            got = ", ".join(f"{k} of {v}" for k, v in lengths.items()) or "nothing"
            raise InputError("zip", "have lists of one length", got, "make them equal")
        return name, _listed(columns)
    if table.cases is not None:
        return name, _listed(_cases(table.cases, known, plan.folder))
    column = _name(name, known)
    if table.values is not None:
        return column, _listed({column: _column(name, table.values, known, plan.folder)})
    grid = table.model_dump(by_alias=True, exclude_none=True)
    return column, _listed({column: _grid(name, grid, known)})


def _listed(columns: Mapping[str, list[Any]]) -> dict[str, Any]:
    _check_length(len(next(iter(columns.values()))))
    return {"columns": dict(columns)}


def _check_length(length: int) -> None:
    """Refuse an axis without rows, or with more than `MOST_LISTED`."""
    rule = f"have from 1 to {MOST_LISTED:,} rows"
    require(1 <= length <= MOST_LISTED, "axis", rule, f"{length:,}", "draw them, or split the axis")


def _name(name: str, known: Mapping[str, Parameter]) -> str:
    """The canonical name of a column."""
    if name in TEXTS:
        return name
    column = canonical_name(name, known)
    if column is None:
        advice = suggestion(name, {**known, "law": Parameter("law", "dimensionless", "finite")})
        raise InputError("axis", "be a parameter, a ratio or 'law'", shown(name), advice)
    return column


def _column(
    name: str, values: Sequence[Any], known: Mapping[str, Parameter], folder: Path
) -> list[Any]:
    """Values in SI; None where the plan has an empty text."""
    column = _name(name, known)
    if column == "law":
        return [law_name(value, folder) for value in values]
    if column in TEXTS:
        return [str(value) for value in values]
    return [None if value == "" else checked_value(known[column], value) for value in values]


def law_place(law: Any, folder: Path) -> str:
    """A law as a plan names it; a path relative to the plan's folder becomes absolute."""
    file, _, name = str(law).rpartition(":")
    if not file.endswith(".py"):
        return str(law)
    return f"{(folder / file_path(file, 'law')).resolve()}:{name}"


def law_name(law: Any, folder: Path) -> str:
    """The registered name of a law that a plan names."""
    place = law_place(law, folder)
    return known_law(place) if ":" in place else get_law(place).name


def checked_value(parameter: Parameter, value: Any) -> float:
    """One number of a plan in SI."""
    checked = parameter.check(value, parameter.name)
    require(not np.ndim(checked), parameter.name, "be one number", shown(value))
    return float(checked)


def _ends(
    name: str, table: Mapping[str, Any], known: Mapping[str, Parameter], *others: str
) -> tuple[float, float, str]:
    """Ends in SI and spacing of a grid or of a uniform distribution.

    Parameters
    ----------
    name : str
    table : mapping
        With ``from`` and ``to``, the fields `others`, and ``spacing`` if it is not linear.
    known : mapping of str to Parameter
    """
    column, fields = _name(name, known), {"from", "to", *others}
    rule, advice = "be listed", "write it like { values = ['...'] }"
    require(column not in TEXTS, name, rule, "a range", advice)
    holds = fields <= set(table) <= {*fields, "spacing"}
    rule = f"have {', '.join(sorted(fields))}"
    advice = "write it like { from = 0.01, to = 0.5, count = 20 }, or draw it with mean and std"
    require(holds, name, rule, ", ".join(sorted(table)) or "nothing", advice)
    low, high = (checked_value(known[column], table[end]) for end in ("from", "to"))
    spacing = table.get("spacing", "linear")
    rule = "be linear or log"
    require(spacing in ("linear", "log"), f"{name}.spacing", rule, shown(spacing), "choose one")
    rule, got = "have ends above zero to be logarithmic", f"{low:g} and {high:g}"
    require(spacing != "log" or low * high > 0, name, rule, got, "change them or the spacing")
    return low, high, spacing


def _grid(name: str, table: Mapping[str, Any], known: Mapping[str, Parameter]) -> list[float]:
    """Values at equal distances or ratios, with both ends."""
    low, high, spacing = _ends(name, table, known, "count")
    count = table["count"]
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_LISTED:
        raise InputError("count", f"be from 1 to {MOST_LISTED:,}", shown(count))
    rule, advice = "be at least 2 between two ends", "write { values = ['...'] } for one value"
    require(count > 1 or low == high, "count", rule, count, advice)
    rule = "have two different ends"
    require(count == 1 or low != high, name, rule, f"{low:g} for both", advice)
    parameter = known[_name(name, known)]
    values = parameter.check(spaced(low, high, count, log=spacing == "log"), parameter.name)
    return [float(value) for value in values]


def _spread(name: str, table: Mapping[str, Any], known: Mapping[str, Parameter]) -> dict[str, Any]:
    """Distribution of a drawn number, as for `_quantile`."""
    column = _name(name, known)
    whole = column not in TEXTS and known[column].rule in ("count", "switch")
    advice = "write it like { values = [0, 1] }"
    require(not whole, name, "be listed, as all whole numbers are", "a distribution", advice)
    if set(table) == {"mean", "std"} and column not in TEXTS:
        parameter = known[column]
        mean = checked_value(parameter, table["mean"])
        std = number(table["std"], f"{parameter.name}.std", parameter.kind, "positive")
        return {"low": mean, "high": std, "kind": "normal"}
    low, high, spacing = _ends(name, table, known)
    return {"low": low, "high": high, "kind": spacing}


def _cases(
    cases: Sequence[Mapping[str, Any]], known: Mapping[str, Parameter], folder: Path
) -> dict[str, Any]:
    """Columns of the rows of all cases; a case gives every combination of its lists."""
    names = dict.fromkeys(_name(name, known) for case in cases for name in case)
    for name in (name for name in TEXTS if name in names):
        # A case without a law would be solved with the law of another case.
        without = [str(i) for i, case in enumerate(cases, start=1) if name not in case]
        got = f"none in case {', '.join(without[:5])}"
        require(not without, "cases", f"all have '{name}' or none of them", got, "add it there")
    columns: dict[str, list[Any]] = {name: [] for name in names}
    length = 0
    for case in cases:
        lists = {}
        for name, value in case.items():
            if isinstance(value, Mapping):
                lists[_name(name, known)] = _grid(name, value, known)
            else:
                values = value if isinstance(value, list | tuple) else [value]
                lists[_name(name, known)] = _column(name, values, known, folder)
        length += math.prod(map(len, lists.values()))
        _check_length(length)
        for row in itertools.product(*lists.values()):
            point = dict(zip(lists, row, strict=True))
            for name in names:
                columns[name].append(point.get(name))
    require(columns, "cases", "have at least one case", "none", "write [{ law = '...' }]")
    return columns
