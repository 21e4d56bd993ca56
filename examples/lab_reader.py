"""A reader for the file format of a laboratory, which asperity uses without being changed.

The recorder writes a line ``GAUGEBOX 1``, a line with the sampling rate, and a line for each
channel with its name, unit and gain; then 16-bit counts, channel after channel in each row. With

    [project.entry-points."asperity.readers"]
    gaugebox = "lab_reader"

in the ``pyproject.toml`` of the package that contains this module, `asperity.read` and
``asperity measure`` read such files like all others.
"""

from pathlib import Path

import numpy as np

import asperity as asp
from asperity.recording.readers import RawColumn, RawRecording

MARK = b"GAUGEBOX 1\n"


def is_format(path: Path) -> bool:
    """Whether a file is of this format, decided by its content and not by its name."""
    with path.open("rb") as file:
        return file.read(len(MARK)) == MARK


def read(path: Path) -> RawRecording:
    """Columns of a file, as recorded."""
    head, _, body = path.read_bytes().partition(b"\nDATA\n")
    lines = head.decode("utf-8").splitlines()
    rate = float(lines[1].removeprefix("rate "))
    channels = [line.split(";") for line in lines[2:]]
    rows = len(body) // (2 * len(channels))
    counts = np.frombuffer(body, "<i2", rows * len(channels)).reshape(rows, -1)
    columns = [
        RawColumn(name, counts[:, i] * float(gain), unit)
        for i, (name, unit, gain) in enumerate(channels)
    ]
    # The clock is that of the recorder: no column of times.
    return RawRecording(columns, step=1 / rate, provenance={"format": "gaugebox"})


def write_example(path: Path) -> None:
    """Ten seconds of a load that is modulated at 20 Hz, and of the friction force."""
    time = np.arange(10_000) / 1000
    phi = 2 * np.pi * 20.1 * time
    load = 7 * (1 + 0.2 * np.cos(phi))
    force = 2.8 - 0.05 * np.cos(phi - 1)
    noise = np.random.default_rng(0).standard_normal((2, time.size))
    counts = np.stack([load / 1e-3 + noise[0], force / 2e-4 + noise[1]], axis=1)
    head = b"rate 1000\nload cell;N;1e-3\nshear gauge;N;2e-4\nDATA\n"
    path.write_bytes(MARK + head + np.rint(counts).astype("<i2").tobytes())


def main() -> None:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        path = Path(folder) / "run1.gbx"
        write_example(path)
        print("recognised:", is_format(path))
        print("columns:", ", ".join(f"{c.label} ({c.unit})" for c in read(path).columns))
        try:
            print(asp.recording.read(path, format="gaugebox"))
        except asp.InputError as error:
            print("not installed:", error)


if __name__ == "__main__":
    main()
