"""A recording of known numbers that tests write in each format, and functions that write files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

ROWS = 400


class Planted(NamedTuple):
    """Time, load and force in SI units."""

    time: np.ndarray
    W: np.ndarray
    F: np.ndarray


@pytest.fixture(scope="session")
def planted() -> Planted:
    """0.4 s at 1 kHz of a modulated load and force, which a text of six decimals holds exactly."""
    time = np.arange(ROWS) / 1000
    load = 7 + 1.7 * np.cos(2 * np.pi * 37 * time)
    force = 2.8 + 0.02 * np.cos(2 * np.pi * 37 * time + 1) + 0.1 * time
    return Planted(time, np.round(load, 6), np.round(force, 6))


@pytest.fixture
def cut(tmp_path: Path) -> Callable[[Path, float], Path]:
    """Function that copies the first part of a file."""

    def cut_file(path: Path, part: float) -> Path:
        whole = path.read_bytes()
        target = tmp_path / f"cut_{path.name}"
        target.write_bytes(whole[: int(len(whole) * part)])
        return target

    return cut_file


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    """Function that writes a file of text or bytes."""

    def write(content: str | bytes, name: str = "recording.txt", encoding: str = "utf-8") -> Path:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
        return path

    return write
