"""Time to read a recording, compared with plain readers: ``python -m benchmarks.readers``.

A plain reader gives the numbers; `asperity` gives them in SI and checks the recording. The numbers
are compared with the true ones.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.clock import pin_to_one_core, timed

_HEADER = (
    "| what | MB | s | MB/s | times the plain reader | worst error |\n|---|---|---|---|---|---|"
)
_RATE = 10_000
_BYTES_A_ROW = 38


class Row(NamedTuple):
    """Time and error of reading a file of `size` bytes."""

    what: str
    size: int
    seconds: float
    ratio: float
    error: float

    def markdown(self) -> str:
        """A line of the table."""
        megabytes = self.size / 1e6
        return (
            f"| {self.what} | {megabytes:,.3g} | {self.seconds:.3g} | "
            f"{megabytes / self.seconds:,.0f} | {self.ratio:.2f} | {self.error:.0e} |"
        )


def _recording(rows: int) -> dict[str, np.ndarray]:
    """Time, load, force and displacement with noise, rounded to the digits of the text."""
    rng = np.random.default_rng(0)
    time = np.arange(rows) / _RATE
    wave = np.cos(2 * np.pi * 120 * time)
    load = 7 + 1.7 * wave + 0.01 * rng.normal(size=rows)
    force = 2.8 + 0.02 * wave + 0.001 * rng.normal(size=rows)
    columns = {"time_s": time, "W_N": load, "F_N": force, "x_um": 10 * time}
    return {name: np.round(values, 6) for name, values in columns.items()}


def _pair(
    what: str,
    path: Path,
    truth: dict[str, np.ndarray],
    plain: Callable[[], Any],
    plain_name: str,
    repeats: int,
) -> Iterator[Row]:
    from asperity.recording import read

    size = path.stat().st_size
    base, _ = timed(plain, repeats)
    seconds, trace = timed(lambda: read(path), repeats)
    pairs = [
        (trace.time, truth["time_s"]),
        (trace.channel("W").values, truth["W_N"]),
        (trace.channel("F").values, truth["F_N"]),
        (trace.channel("displacement").values, truth["x_um"] * 1e-6),
    ]
    error = max(float(np.max(np.abs(got - true))) for got, true in pairs)
    yield Row(f"{plain_name}, {what}", size, base, 1.0, 0.0)
    yield Row(f"asperity, {what}", size, seconds, seconds / base, error)


def rows(megabytes: float, repeats: int, folder: Path) -> Iterator[Row]:
    """Rows of the table: text and HDF5 of one recording."""
    import h5py
    import pandas as pd

    truth = _recording(max(100, int(megabytes * 1e6 / _BYTES_A_ROW)))
    text = folder / "recording.csv"
    frame = pd.DataFrame(truth)
    frame.to_csv(text, index=False, float_format="%.6f")
    yield from _pair("CSV", text, truth, lambda: pd.read_csv(text), "pandas", repeats)
    binary = folder / "recording.h5"
    with h5py.File(binary, "w") as file:
        for name, values in truth.items():
            file[name] = values

    def plain() -> list[np.ndarray]:
        with h5py.File(binary) as file:
            return [file[name][()] for name in truth]

    yield from _pair("HDF5", binary, truth, plain, "h5py", repeats)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.readers", description=__doc__)
    parser.add_argument("--megabytes", type=float, default=100.0, help="size of the text")
    parser.add_argument(
        "--repeats", type=int, default=5, help="repetitions, of which the median is shown"
    )
    arguments = parser.parse_args()
    pin_to_one_core()
    with tempfile.TemporaryDirectory() as folder:
        print(_HEADER)
        for row in rows(arguments.megabytes, arguments.repeats, Path(folder)):
            print(row.markdown())


if __name__ == "__main__":
    main()
