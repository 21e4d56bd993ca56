"""Recordings cut off by their sensor or converter: how many are named, and how many clean ones are.

    python -m benchmarks.clipped_recordings [--recordings 600] [--seed 0]

A recording has 60 to 300 periods of a modulated load, 4 to 64 samples a period, a whole number of
them in half of the recordings, and a friction of one to four harmonics or of narrow peaks. Noise
is 0 or 1e-5 to 0.03 of the height of a cycle, and is added before the signal is cut off, so that
cut samples are equal. Half of the recordings are rounded to steps of 1e-5 to 1/30 of the height.
One in four holds isolated samples at a wrong extreme value, which are no saturation. The load or
the force is cut off by up to 60 % of its height, or neither is.

A measured number is wrong if it is more than two half widths of its 95 % interval off. The table
has, by what the recording holds, the numbers of recordings, of findings "saturation", of verdicts
"ok", and of wrong numbers with that verdict.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import asperity as asp
from asperity.errors import InputError
from asperity.recording import Channel, Trace
from benchmarks.populations import log_uniform, seeds

Float = np.ndarray
W0 = 7.0
#: A harmonic is compared if it is at least this share of the height of a cycle.
_COMPARED = 0.01


@dataclass(frozen=True)
class Drawn:
    """A recording and what it holds; `harmonics` are mu1 and mu2 without the cutting."""

    trace: Trace
    kind: str
    harmonics: tuple[float, float]
    epsilon: float
    samples: float
    noise: float
    step: float
    cut: float

    @property
    def orders(self) -> int:
        """Harmonics below half the sampling rate, up to four."""
        return min(4, int((self.samples - 0.1) / 2))

    def __str__(self) -> str:
        return (
            f"{self.samples:.4g} samples a period, noise {self.noise:.2g}, step {self.step:.2g}, "
            f"{self.cut:.2g} cut off"
        )


def narrow(phase: Float, width: float) -> Float:
    """Peaks of unit height: a geometric series of harmonics."""
    r = np.exp(-width)
    return np.asarray((1 - r) ** 2 / (1 - 2 * r * np.cos(phase) + r**2))


def drawn(seed: int) -> Drawn:
    """A recording of the population."""
    random = np.random.default_rng([seed, 7])
    samples = log_uniform(random, 4, 64)
    if random.random() < 0.5:
        samples = float(round(samples))
    periods, frequency = random.integers(60, 300), log_uniform(random, 1, 200)
    count = int(periods * samples)
    time = np.arange(count) / (samples * frequency)
    start = random.choice([0.0, random.uniform(0, 2 * np.pi)])
    phase = start + 2 * np.pi * np.arange(count) / samples
    # Harmonics beyond half the sampling rate would be folded, with or without a level.
    orders = np.arange(1, min(4, int((samples - 0.1) / 2)) + 1)
    angles = random.choice([0.0, 1.0]) * random.uniform(0, 2 * np.pi, orders.size)
    sizes = random.uniform(0, 0.3, orders.size) ** (orders - 1)
    if samples > 20 and random.random() < 0.3:
        width = random.uniform(0.5, 1.5)
        turned = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
        spectrum = 2 * np.fft.rfft(narrow(turned, width)) / turned.size
        most = int((samples - 0.1) / 2)
        sizes, orders, angles = (
            np.abs(spectrum[1 : most + 1]),
            np.arange(1, most + 1),
            np.zeros(most),
        )
    shift = random.uniform(0, 2 * np.pi)
    grid = np.linspace(0, 2 * np.pi, 4096)

    def cycle(at: Float) -> Float:
        return sum(
            s * np.cos(n * (at - shift) + a) for s, n, a in zip(sizes, orders, angles, strict=True)
        ) + np.zeros_like(at)

    height = float(np.ptp(cycle(grid)))
    mu1 = log_uniform(random, 1e-3, 3e-2)
    epsilon = log_uniform(random, 0.03, 0.5)
    noise = random.choice([0.0, log_uniform(random, 1e-5, 0.03)])
    shapes = {"W": np.cos(phase) / 2, "F": cycle(phase) / height}
    kind = str(random.choice(["clean", "force", "load"], p=[0.5, 0.3, 0.2]))
    sentinels = random.random() < 0.25
    step = random.choice([0.0, log_uniform(random, 1e-5, 1 / 30)])
    cut = random.uniform(0.01, 0.6)
    channels = {}
    for name, shape in shapes.items():
        values = shape + noise * random.normal(size=count)
        if kind == {"W": "load", "F": "force"}[name]:
            side = random.choice([-1, 1])
            ends = side * cycle(grid) / height if name == "F" else side * np.cos(grid) / 2
            level = float(ends.max() - cut * np.ptp(ends))
            values = side * np.minimum(side * values, level)
            cut = float(np.mean(side * shape > level))
        if step:
            values = step * np.round(values / step)
        if sentinels and name == "F":
            at = random.choice(count, random.integers(3, 12), replace=False)
            values[at] = random.choice([-1, 1]) * random.uniform(1, 10)
        scale = 2 * epsilon * W0 if name == "W" else mu1 * height / sizes[0] * W0
        level = 1.0 * W0 if name == "W" else 0.5 * W0
        channels[name] = Channel(level + scale * values, "force", "N", name)
    mu2 = mu1 * sizes[1] / sizes[0] if sizes.size > 1 else 0.0
    holds = kind + (", sentinels" if sentinels else "")
    cut *= kind != "clean"
    planted = (mu1, mu2)
    return Drawn(Trace(time, channels), holds, planted, epsilon, samples, noise, step, cut)


def judged(seed: int) -> tuple[Drawn, bool, str, dict[str, float], list[str]]:
    """A recording, whether saturation is named, verdict, errors of wrong numbers, and doubts."""
    recording = drawn(seed)
    named = any(f.name == "saturation" for f in asp.recording.check(recording.trace))
    try:
        measurement = asp.measure(recording.trace, modulated=True, harmonics=recording.orders)
    except InputError as error:
        return recording, named, "refused", {}, [str(error)]
    reading, wrong = measurement.reading, {}
    planted = {"mu1": recording.harmonics[0], "mu2": recording.harmonics[1]}
    planted["epsilon"] = recording.epsilon
    for name, value in planted.items():
        if value < _COMPARED * recording.harmonics[0]:
            continue
        # Sums of a recording without noise round to 1e-12.
        off = abs(reading.observables()[name] - value) - 1e-12
        half = max(reading.half_width(name), 1e-9 * value)
        if off > 2 * half:
            wrong[name] = off / value
    doubts = [c.name for c in measurement.checks if c.verdict != "ok"]
    return recording, named, measurement.verdict, wrong, doubts


def main() -> None:
    """Print the table, and recordings that are wrong and ok."""
    recordings = seeds(__doc__, 600)
    rows = [judged(k) for k in recordings]
    print("| holds | recordings | saturation | ok | wrong and ok |\n" + "|---" * 5 + "|")
    for kind in sorted({row[0].kind for row in rows}):
        these = [row for row in rows if row[0].kind == kind]
        ok = [row for row in these if row[2] == "ok"]
        cells = len(these), sum(row[1] for row in these), len(ok), sum(bool(r[3]) for r in ok)
        print(f"| {kind} | " + " | ".join(map(str, cells)) + " |")
    for k, (recording, named, verdict, wrong, doubts) in zip(recordings, rows, strict=True):
        if wrong and verdict == "ok":
            sizes = {name: f"{value:.1%}" for name, value in wrong.items()}
            print(f"wrong and ok: seed {k}, {recording.kind}: {recording}: {sizes}")
        if named and recording.kind.startswith("clean"):
            print(f"clean and saturated: seed {k}, {recording.kind}: {recording}, {doubts}")


if __name__ == "__main__":
    main()
