"""A recording whose every number is known, to be written in each format and read again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

ROWS = 400


class Planted(NamedTuple):
    """Truth in SI."""

    time: np.ndarray
    W: np.ndarray
    F: np.ndarray


@pytest.fixture(scope="session")
def planted() -> Planted:
    """0.4 s at 1 kHz of a load with a strong and a force with a weak modulation, in steps of 1e-6.

    Rounded, so that a text of six decimals holds it exactly.
    """
    time = np.arange(ROWS) / 1000
    load = 7 + 1.7 * np.cos(2 * np.pi * 37 * time)
    force = 2.8 + 0.02 * np.cos(2 * np.pi * 37 * time + 1) + 0.1 * time
    return Planted(time, np.round(load, 6), np.round(force, 6))


@pytest.fixture
def cut(tmp_path: Path) -> Callable[[Path, float], Path]:
    """A file of which only a part is left."""

    def cut_file(path: Path, part: float) -> Path:
        whole = path.read_bytes()
        target = tmp_path / f"cut_{path.name}"
        target.write_bytes(whole[: int(len(whole) * part)])
        return target

    return cut_file
