"""Records for people and programs: strict JSON, and aligned columns of text."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from asperity.solve import PeriodicResponse
    from asperity.study.operating_point import Sourced


def to_json(record: Mapping[str, Any]) -> str:
    """JSON as its standard has it: a number that is not finite becomes null."""
    return json.dumps(_plain(record), allow_nan=False, indent=2, ensure_ascii=False)


def aligned(rows: Iterable[Sequence[str]], indent: str = "") -> str:
    """Rows of text in columns, two blanks apart."""
    table = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return "\n".join(
        (indent + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True))).rstrip()
        for row in table
    )


def response_record(
    response: PeriodicResponse, numbers: Mapping[str, Sourced], units: Mapping[str, str]
) -> dict[str, Any]:
    """Everything about the response at one point.

    Parameters
    ----------
    response : PeriodicResponse
        Of a single point.
    numbers : mapping of str to Sourced
        What was asked, by name.
    units : mapping of str to str
        SI unit of each number.
    """
    scalars = ("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2")
    converged = bool(response.converged)

    def shown(value: float) -> float | None:
        return float(value) if converged else None

    return {
        **{name: shown(getattr(response, name)) for name in scalars},
        "harmonics": [[shown(c.real), shown(c.imag)] for c in response.harmonics],
        "floquet": [[shown(m.real), shown(m.imag)] for m in response.multipliers],
        "log_floquet": [[shown(m.real), shown(m.imag)] for m in response.log_multipliers],
        "stable": bool(response.stable),
        "mode": str(response.mode[()]),
        "mode_frequency": shown(float(response.mode_frequency)),
        "growth_rate": shown(float(response.growth_rate)),
        "converged": converged,
        "result": str(response.result[()]),
        "provenance": _provenance(response, numbers, units),
    }


def _provenance(
    response: PeriodicResponse, numbers: Mapping[str, Sourced], units: Mapping[str, str]
) -> dict[str, Any]:
    from asperity.materials import citation

    told = response.provenance
    return {
        "version": told.pop("asperity_version"),
        **told,
        "parameters": {
            name: {"value": number.value, "unit": units[name], "from": number.origin}
            for name, number in numbers.items()
        },
        "citation": {key.strip(): citation(key.strip()) for key in told["source"].split(",")},
    }


def _plain(value: Any) -> Any:
    """A tree of what JSON knows, None for numbers that are not finite."""
    if isinstance(value, Mapping):
        return {key: _plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
