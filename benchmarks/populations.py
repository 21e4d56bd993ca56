"""Drawn recordings and tables: draws over decades, the seeds of a call, and intervals."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

import numpy as np


def log_uniform(
    random: np.random.Generator, low: float, high: float, size: int | None = None
) -> Any:
    """A number, or an array of `size` numbers, whose logarithm is uniform between two bounds."""
    values = np.exp(random.uniform(np.log(low), np.log(high), size))
    return float(values) if size is None else values


def seeds(description: str | None, recordings: int) -> range:
    """Seeds of a call with ``--recordings`` (by default so many) and ``--seed``."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("--recordings", type=int, default=recordings)
    parser.add_argument("--seed", type=int, default=0, help="of the first recording")
    chosen = parser.parse_args()
    return range(chosen.seed, chosen.seed + chosen.recordings)


def inside(parameters: Mapping[str, Any], truth: Mapping[str, float]) -> dict[str, list[bool]]:
    """Whether the 68 and the 95 % interval of each estimate contain the true value."""
    return {
        name: [bool(low <= value <= high) for low, high in (p.interval_68, p.interval_95)]
        for name, value in truth.items()
        for p in [parameters[name]]
    }


def print_wrong(seed: int, faults: Any, wrong: Mapping[str, Any] | list[Any]) -> None:
    """A line for a recording whose verdict is ok, and whose numbers `wrong` are not right."""
    print(f"wrong and ok: seed {seed}, {', '.join(faults) or 'clean'}: {wrong}")
