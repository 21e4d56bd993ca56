"""A table of slide-hold-slide tests: static friction above the level of sliding, hold by hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.parameters import obeying
from asperity.parameters.columns import read_headed_columns
from asperity.units import to_si

Float = NDArray[np.float64]

#: The column that tells such a table from others.
HEALING = "healing"
_KINDS = {
    "hold_time": ("time", "positive"),
    HEALING: ("dimensionless", "finite"),
    "healing_err": ("dimensionless", "positive"),
    "V": ("velocity", "positive"),
    "K": ("per_length", "positive"),
    "W0": ("force", "positive"),
}
_REQUIRED = ("hold_time", HEALING, "V", "K")


@dataclass(frozen=True, eq=False)
class HealingTable:
    """Healing of an interface, one hold a row; arrays of shape (rows,), in SI.

    Attributes
    ----------
    name : str
        What messages call the table.
    hold_time : array
        Seconds.
    healing : array
        Static friction less the level of sliding before the hold.
    errors : array or None
        Standard uncertainties of `healing`; None if they are to be estimated from what the law
        leaves, one for all rows.
    V : array
        Velocity of the drive before and after the hold (m/s).
    K : array
        Stiffness of the spring over the normal load (1/m).
    """

    name: str
    hold_time: Float
    healing: Float
    errors: Float | None
    V: Float
    K: Float

    @property
    def rows(self) -> int:
        """Number of holds."""
        return self.healing.size


def read_healing(path: str | Path, given: Mapping[str, Any] | None = None) -> HealingTable:
    """Read a CSV of holds.

    Parameters
    ----------
    path : str or Path
        Columns ``hold_time``, ``healing``, ``V`` and ``K``, in SI or with the unit after the name,
        as ``K (1/um)``; ``healing_err``, the standard uncertainty, if it is known. K is over the
        normal load, or N/m where there is a column ``W0``. Lines that begin with ``#`` are skipped,
        and other columns.
    given : mapping of str to number or str, optional
        Of V, K and W0 where they are the same in all rows.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, or a cell breaks its rule.
    """
    path = Path(path)
    columns = read_headed_columns(path, _KINDS, row="a hold")
    return healing_table({**(given or {}), **columns}, name=path.name)


def healing_table(columns: Mapping[str, Any], *, name: str = "holds") -> HealingTable:
    """A table of holds from columns in memory.

    Parameters
    ----------
    columns : mapping of str to array, shape (rows,), number or text
        As of `read_healing`; numbers are SI and hold for all rows, texts carry their unit.
    name : str
        What messages call the table.

    Raises
    ------
    InputError
        If a column is missing, has another length, or breaks its rule.
    """
    missing = [n for n in _REQUIRED if n not in columns]
    if missing:
        raise InputError(
            f"{name} must have the columns {', '.join(_REQUIRED)}, got none for "
            f"{', '.join(missing)}; add them, or fix V and K where they are the same in all rows"
        )
    with_load = "W0" in columns
    found = {}
    for column, values in columns.items():
        if column not in _KINDS:
            continue
        kind, rule = _KINDS[column]
        kind = "stiffness" if column == "K" and with_load else kind
        label = f"{name}.{column}"
        texts = isinstance(values, list | tuple) and any(isinstance(v, str) for v in values)
        plain = [to_si(v, kind, label) for v in values] if texts else values
        found[column] = np.atleast_1d(np.asarray(obeying(plain, label, kind, rule), float))
    rows = max(a.size for a in found.values())
    for column, array in found.items():
        if array.ndim != 1 or array.size not in (1, rows):
            raise InputError(
                f"{name}.{column} must have one value or {rows}, got an array of shape "
                f"{array.shape}; give columns of one length"
            )
        found[column] = np.broadcast_to(array, (rows,)).copy()
    K = found["K"] / found["W0"] if with_load else found["K"]
    return HealingTable(
        name, found["hold_time"], found[HEALING], found.get("healing_err"), found["V"], K
    )


def joined_holds(tables: Iterable[HealingTable]) -> HealingTable:
    """Several tables as one.

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
    if len(tables) == 1:
        return tables[0]

    def stacked(field: str) -> Float:
        return np.concatenate([getattr(t, field) for t in tables])

    errors = stacked("errors") if all(known) else None
    name = ", ".join(t.name for t in tables)
    return HealingTable(
        name, stacked("hold_time"), stacked("healing"), errors, stacked("V"), stacked("K")
    )
