"""A recording of ten minutes at 10 kHz is read, averaged over blocks and fitted.

``python -m benchmarks.long_recording [--seconds 600] [--rate 10000] [--full] [--sets N]``

The motion is computed by SciPy (`benchmarks.coverage`): velocity steps, two holds and load steps.
The noise of the gauge is white, a resonance at 300 Hz (an autoregression of order 2), wanders over
0.5 and 8 s, and has the mains with a harmonic, whose frequency wanders too. With ``--full`` the
same recording is also fitted at its full rate. With ``--sets N`` the intervals of N recordings of
six seconds are counted instead, with faster steps and a third of the noise.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time as clock
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from asperity import read
from asperity.inference import RecordedRun, RunOptions, fit, recorded_run
from benchmarks.clock import pin_to_one_core
from benchmarks.coverage import (
    LOAD,
    Case,
    covered,
    friction,
    print_shares,
    trace_of,
    wander,
)

FREE = ["A", "B", "D0", "alpha"]
#: Standard deviations over friction: white, resonance, wandering over 0.5 and 8 s, mains.
WHITE, RESONANCE, QUICK, SLOW, MAINS = 1e-3, 1e-3, 3e-4, 3e-4, 2e-3


def programme(seconds: float, rate: float) -> Case:
    """Velocity steps, holds and load steps, in shares of the duration."""
    at = np.array([0.15, 0.3, 0.4, 0.45, 0.6, 0.7]) * seconds
    velocities = (3e-6, 1e-5, 3e-6, 0.0, 1e-5, 0.0, 1e-5)
    up, down = 0.8 * seconds, 0.9 * seconds
    loads = ((up, 1.0), (up + 0.01, 1.1), (down, 1.1), (down + 0.01, 1.0))
    return Case(velocities, tuple(at.tolist()), seconds, rate, loads)


def noise(random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """Noise of a gauge at a high rate."""
    n, step = time.size, time[1] - time[0]
    radius, turn = np.exp(-2 * np.pi * 20 * step), np.cos(2 * np.pi * 300 * step)
    ringing = lfilter([1.0], [1.0, -2 * radius * turn, radius**2], random.normal(size=n))

    phase = 2 * np.pi * (50.01 * time + 0.2 * np.sin(2 * np.pi * time / 97.0))
    mains = np.sqrt(2) * (np.cos(phase) + 0.3 * np.cos(3 * phase + 1.0))
    result = WHITE * random.normal(size=n) + RESONANCE * ringing / ringing.std() + MAINS * mains
    for size, tau in ((QUICK, 0.5), (SLOW, 8.0)):
        result += size * wander(random.normal(size=n), random.normal(), tau / step)
    return result


def columns(case: Case, seed: int = 0) -> dict[str, np.ndarray]:
    """Time (s), normal stress (MPa), shear stress (MPa) and displacement (um) of a recording."""
    random = np.random.default_rng(seed)
    time = np.arange(round(case.end * case.rate)) / case.rate
    mu = friction(case, time) + noise(random, time)
    load = 1e-6 * LOAD * case.load(time)
    return {
        "time_s": time,
        "normal_stress_MPa": load * (1 + 2e-4 * random.normal(size=time.size)),
        "friction": mu,
        "displacement_um": 1e6 * case.slip(time) + 0.02 * random.normal(size=time.size),
    }


def written(path: Path, table: dict[str, np.ndarray]) -> None:
    """Write a text file with 8 significant digits."""
    values = np.stack(list(table.values()), axis=1)
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(table) + "\n")
        for part in np.array_split(values, max(1, len(values) // 100_000)):
            np.savetxt(file, part, fmt="%.8g", delimiter=",")


#: Six seconds, in which the slip is that of minutes at usual velocities.
SHORT = Case((3e-5, 1e-4, 3e-5, 0.0, 1e-4), (1.2, 2.4, 3.6, 4.2), 6.0, 1e4)


def short_runs(case: Case, sets: int) -> Iterator[RecordedRun]:
    """Recordings of one motion with different noise."""
    time = np.arange(round(case.end * case.rate)) / case.rate
    clean = friction(case, time)
    for seed in range(sets):
        random = np.random.default_rng([7, seed])
        mu = clean + 0.3 * noise(random, time)
        displacement = case.slip(time) + 2e-8 * random.normal(size=time.size)
        trace = trace_of(time, mu, displacement, np.full(time.size, LOAD))
        yield recorded_run(trace, name="run")


def main() -> None:
    """Print times, memory and estimates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rate", type=float, default=1e4)
    parser.add_argument("--file", type=Path, help="use this file; written if it is missing")
    parser.add_argument("--full", action="store_true", help="also fit at the full rate")
    parser.add_argument(
        "--sets", type=int, help="number of short recordings whose intervals are counted"
    )
    arguments = parser.parse_args()
    if arguments.sets:
        print_shares("short", covered(short_runs(SHORT, arguments.sets), SHORT, starts=1))
        return
    case = programme(arguments.seconds, arguments.rate)
    with tempfile.TemporaryDirectory() as folder:
        path = arguments.file or Path(folder) / "long.csv"
        if not path.exists():
            written(path, columns(case))
        pin_to_one_core()
        begun = clock.perf_counter()
        trace = read(path)
        read_at = clock.perf_counter() - begun
        run = recorded_run(trace)
        drive_at = clock.perf_counter() - begun
        print(
            f"{run.time.size} samples: read in {read_at:.1f} s, drive detected by {drive_at:.1f} s"
        )
        for rate in (None, "full") if arguments.full else (None,):
            begun = clock.perf_counter()
            result = fit(run, case.law, FREE, runs=RunOptions(fit_rate=rate))
            seconds = clock.perf_counter() - begun
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
            print(f"rate {rate or 'by the data'}: fit in {seconds:.1f} s, {peak:.2f} GB at most")
            print(result.objective.terms[0].noise)
            for name, truth in case.true.items():
                p = result.parameters[name]
                error = (p.value - truth) / p.se
                print(f"  {name:6} {p.value:.5g} +- {p.se:.2g} {p.unit}, {error:+.1f} s.e. off")
            print(*result.warnings, sep="\n")


if __name__ == "__main__":
    main()
