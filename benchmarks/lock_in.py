"""Time and accuracy of the lock-in on ten minutes at 10 kHz: ``python -m benchmarks.lock_in``.

Two channels of six million samples with an even and with a jittering clock, on one core. For
comparison the same arrays are summed twice, and copied twice.
"""

from __future__ import annotations

import argparse
import cmath
from typing import TYPE_CHECKING

from benchmarks.clock import pin_to_one_core, timed

if TYPE_CHECKING:
    import numpy as np

W0, EPSILON, FREQUENCY, PHASE = 7.0, 0.24, 120.003, 0.4
HARMONICS = (2e-3 * cmath.exp(-1.5j), 3e-4 * cmath.exp(1j))
_HEADER = (
    "| clock | noise (N) | s | over summing twice | over copying twice | error of mu1 "
    "| uncertainty |"
)


def recording(time: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Load and force (N)."""
    import numpy as np

    rng = np.random.default_rng(0)
    phi = 2 * np.pi * FREQUENCY * time + PHASE
    load = W0 * (1 + EPSILON * np.cos(phi)) + noise * rng.standard_normal(time.size)
    force = W0 * (0.4 + sum((c * np.exp(1j * k * phi)).real for k, c in enumerate(HARMONICS, 1)))
    return load, force + noise * rng.standard_normal(time.size)


def row(name: str, time: np.ndarray, noise: float, repeats: int) -> str:
    """A line of the table."""
    from asperity.lock_in.demodulation import lock_in

    arrays = (time, *recording(time, noise))
    summed, _ = timed(lambda: [x.sum() for x in arrays + arrays], repeats)
    copied, _ = timed(lambda: [x.copy() for x in arrays + arrays], repeats)
    seconds, reading = timed(lambda: lock_in(*arrays), repeats)
    error = abs(reading.harmonics[0] - HARMONICS[0])
    numbers = (seconds / summed, seconds / copied)
    return (
        f"| {name} | {noise:g} | {seconds:.3f} | {numbers[0]:.1f} | {numbers[1]:.1f} | "
        f"{error:.1e} | {reading.uncertainty('mu1'):.1e} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lock_in", description=__doc__)
    parser.add_argument("--samples", type=int, default=6_000_000)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    # Before NumPy is imported, which counts the cores.
    pin_to_one_core()
    import numpy as np

    even = np.arange(arguments.samples) * 1e-4
    jitter = 1e-5 * np.random.default_rng(1).uniform(-1, 1, even.size)
    print(_HEADER)
    print("|" + "---|" * (_HEADER.count("|") - 1))
    for name, time in (("even", even), ("jittering", even + jitter)):
        for noise in (0.0, 5e-3):
            print(row(name, time, noise, arguments.repeats))


if __name__ == "__main__":
    main()
