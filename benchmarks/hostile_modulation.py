"""Recordings of a modulated load with the faults of laboratories: wrong numbers with verdict ok.

    python -m benchmarks.hostile_modulation [--recordings 500] [--seed 0]

A recording has 25 to 1,500 periods of 0.5 to 200 Hz, 12 to 200 samples a period, an amplitude of 1
to 60 % of the load, noise in both channels, drawn over decades, and up to three of the faults of
`FAULTS`. Measured numbers are compared with the planted ones, in standard uncertainties; harmonics
that drift are compared with their mean over the window. A clean recording has no fault.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

import asperity as asp
from asperity.errors import InputError
from asperity.recording import Channel, Trace
from benchmarks.populations import log_uniform, print_wrong, seeds

Float = np.ndarray
#: A number is wrong if it is more than this many standard uncertainties off. Student's t exceeds
#: this once in 1,400 numbers with 12 degrees of freedom (a mean), in 17,000 with 40 (a harmonic).
WRONG = 4.5
W0 = 7.0
MOST_SAMPLES = 200_000


@dataclass
class Recording:
    """Planted numbers, and the signals that are added to the load and the force.

    Times are from the beginning of the modulation; `share` is the time over its length. Load and
    force are over W0. The modulation is multiplied by `swell` and its phase shifted by `turn`; the
    response of friction is also multiplied by `change`. `without` names numbers not to compare.
    """

    random: np.random.Generator
    faults: tuple[str, ...]
    frequency: float
    periods: float
    samples: float
    epsilon: float
    mean: float
    drop: float
    harmonics: tuple[complex, complex]
    noise: tuple[float, float]
    decay: float
    time: Float = field(init=False)
    kept: Float = field(init=False)
    load: Float = field(init=False)
    force: Float = field(init=False)
    turn: Float = field(init=False)
    swell: Float = field(init=False)
    change: Float = field(init=False)
    without: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        r, length = self.random, self.length
        before, after = (0.0, 0.0) if "no pauses" in self.faults else r.uniform(0.15, 0.6, 2)
        count = int((before + 1 + after) * length * self.rate)
        self.time = np.arange(count) / self.rate - before * length
        self.kept = np.ones(count, bool)
        self.turn = np.zeros(count)
        self.swell = ((self.share >= 0) & (self.share <= 1)).astype(float)
        self.change = np.ones(count)
        self.load, self.force = np.zeros((2, count))

    @property
    def rate(self) -> float:
        """Samples per second."""
        return self.frequency * self.samples

    @property
    def length(self) -> float:
        """Duration of the modulation (s)."""
        return self.periods / self.frequency

    @property
    def share(self) -> Float:
        """Time over the length of the modulation."""
        return self.time / self.length

    def noise_of(self, low: float, high: float) -> Float:
        """White noise of a standard deviation between two bounds."""
        return log_uniform(self.random, low, high) * self.random.normal(size=self.time.size)

    def some(self, least: float, most: float) -> slice:
        """A random part of the recording of a share between two bounds."""
        first = int(self.random.uniform(0.1, 0.8) * self.time.size)
        return slice(first, first + 3 + int(self.random.uniform(least, most) * self.time.size))

    def arrays(self) -> tuple[Float, Float, Float]:
        """Time (s), load and force (N), with the faults."""
        r, u, (mu1, mu2) = self.random, self.share, self.harmonics
        for name in MOTIONS:
            if name in self.faults:
                MOTIONS[name](self)
        phi = 2 * np.pi * self.frequency * self.time + r.uniform(0, 6.28) + self.turn
        wave = np.cos(phi) + r.uniform(0, 2e-3) * np.cos(2 * phi + r.uniform(0, 6.28))
        self.load += 1 + self.epsilon * self.swell * wave
        response = mu1 * np.exp(1j * phi) + mu2 * np.exp(2j * phi)
        since = np.clip(np.stack([self.time, self.time - self.length]), 0, None) / self.decay
        settled = np.where(u <= 1, -np.expm1(-since[0]), np.exp(-since[1]))
        level = self.mean - self.drop * np.where(u < 0, 0.0, settled)
        self.force += level + self.swell * self.change * response.real
        self.load += self.noise[0] * r.normal(size=u.size)
        self.force += self.noise[1] * r.normal(size=u.size)
        for name in RECORDERS:
            if name in self.faults:
                RECORDERS[name](self)
        kept = self.kept
        start = float(self.time[0])
        return self.time[kept] - start, W0 * self.load[kept], W0 * self.force[kept]

    def planted(self, start: float, end: float) -> dict[str, complex]:
        """Numbers that a measurement of a window (s from the first sample) should give."""
        inside = (self.time - self.time[0] >= start) & (self.time - self.time[0] <= end)
        swell = self.swell[inside].mean()
        response = (self.swell * self.change)[inside].mean()
        numbers: dict[str, complex] = {
            "epsilon": self.epsilon * swell,
            "frequency": self.frequency,
            "mean_friction": self.mean - self.drop,
            "delta_mu": -self.drop,
            "mu1": self.harmonics[0] * response,
            "mu2": self.harmonics[1] * response,
        }
        return {name: value for name, value in numbers.items() if name not in self.without}


LEVEL = {"mean_friction", "delta_mu"}


def _mains(x: Recording) -> None:
    line = x.random.choice([50.0, 60.0]) * (1 + 1e-4 * x.random.normal())
    for k in range(1, 5):
        if k * line < x.rate / 2:
            size = abs(x.harmonics[0]) * log_uniform(x.random, 0.02, 3) / k
            phases = 2 * np.pi * k * line * x.time + x.random.uniform(0, 6.28, 2)[:, None]
            x.force += size * np.cos(phases[0] + 0.3 * np.sin(2 * np.pi * x.time / 30))
            x.load += x.random.random() * size * np.cos(phases[1])


def _drift(x: Recording) -> None:
    x.force += x.random.normal() * 0.03 * (x.share - 0.5)
    x.force += x.random.normal() * 0.02 * (x.share - 0.5) ** 2
    x.without |= LEVEL


def _walk(x: Recording) -> None:
    x.force += np.cumsum(x.noise_of(1e-4, 2e-2)) / np.sqrt(x.time.size)
    x.without |= LEVEL


def _load_drifts(x: Recording) -> None:
    size = x.random.choice([-1, 1]) * log_uniform(x.random, 0.01, 0.4)
    x.swell *= 1 + size * (x.share - 0.5)


def _chirp(x: Recording) -> None:
    size = x.random.choice([-1, 1]) * log_uniform(x.random, 1e-4, 2e-2)
    x.turn += np.pi * size * x.periods * (x.share - 0.5) ** 2
    x.without |= {"frequency"}


def _wander(x: Recording) -> None:
    slow = log_uniform(x.random, 1 / x.length, x.frequency / 5)
    x.turn += log_uniform(x.random, 0.01, 1.0) * np.sin(2 * np.pi * slow * x.time)
    x.without |= {"frequency"}


def _ramp(x: Recording) -> None:
    width = x.random.uniform(0.01, 0.15)
    x.swell *= np.clip(np.minimum(x.share, 1 - x.share) / width, 0, 1)


def _shift(x: Recording) -> None:
    size = x.random.choice([-1, 1]) * log_uniform(x.random, 0.02, 0.5)
    x.change *= 1 + size * (x.share - 0.5)


def _stick_slip(x: Recording) -> None:
    size = abs(x.harmonics[0]) * log_uniform(x.random, 0.1, 10)
    turns = x.time * x.frequency * log_uniform(x.random, 0.01, 3) + x.random.random()
    x.force += size * (turns % 1 - 0.5)
    x.without |= LEVEL


def _second(x: Recording) -> None:
    f = x.frequency * x.random.uniform(0.3, 3.3)
    size = x.epsilon * log_uniform(x.random, 0.01, 0.7)
    x.load += x.swell * size * np.cos(2 * np.pi * f * x.time + 1)


def _settles(x: Recording) -> None:
    x.decay = log_uniform(x.random, 1e-3, 0.4) * x.length


def _jitter(x: Recording) -> None:
    x.time = x.time + x.random.uniform(0.01, 0.15) * x.random.normal(size=x.time.size) / x.rate


def _rounded(x: Recording) -> None:
    step = 10 ** np.floor(np.log10(1 / x.rate))
    x.time = np.round(x.time / step) * step
    x.without |= {"frequency"}


def _lost(x: Recording) -> None:
    for _ in range(x.random.integers(1, 6)):
        first = int(x.random.uniform(0, 0.9) * x.time.size)
        x.kept[first : first + int(log_uniform(x.random, 1, 0.05 * x.time.size + 2))] = False


def _spikes(x: Recording) -> None:
    for values, size in ((x.force, abs(x.harmonics[0])), (x.load, x.epsilon)):
        for at in x.random.choice(x.time.size, x.random.integers(1, 20), replace=False):
            values[at] += size * x.random.choice([-1, 1]) * log_uniform(x.random, 2, 200)


def _clipped(x: Recording) -> None:
    if x.random.random() < 0.5:
        np.minimum(x.load, 1 + x.epsilon * x.random.uniform(0.5, 0.99), out=x.load)
    else:
        np.minimum(x.force, np.quantile(x.force, x.random.uniform(0.9, 0.999)), out=x.force)


def _held(x: Recording) -> None:
    values, count = x.force if x.random.random() < 0.5 else x.load, x.random.integers(2, 9)
    values[:] = np.repeat(values[::count], count)[: values.size]


def _coarse(x: Recording) -> None:
    for values in (x.load, x.force):
        step = 2.0 ** -x.random.integers(8, 15)
        values[:] = step * np.round(values / step)


def _load_noise(x: Recording) -> None:
    x.load += lfilter([np.sqrt(1 - 0.99**2)], [1, -0.99], x.noise_of(1e-3, 3e-2))


def _common(x: Recording) -> None:
    noise = x.noise_of(1e-4, 3e-3)
    x.load += noise
    x.force += x.mean * noise


def _burst(x: Recording) -> None:
    x.force[x.some(0.002, 0.05)] += x.noise_of(0.3, 30)[0] * abs(x.harmonics[0])


def _missing(x: Recording) -> None:
    x.force[x.some(0.001, 0.1)] = np.nan


#: Faults of the motion and of the recorder, in the order in which they act.
MOTIONS: dict[str, Callable[[Recording], None]] = {
    "mains": _mains,
    "drift": _drift,
    "random walk": _walk,
    "amplitude drifts": _load_drifts,
    "chirp": _chirp,
    "phase wanders": _wander,
    "ramp": _ramp,
    "response shifts": _shift,
    "stick-slip": _stick_slip,
    "second modulation": _second,
    "slow settling": _settles,
}
RECORDERS: dict[str, Callable[[Recording], None]] = {
    "load noise": _load_noise,
    "common noise": _common,
    "burst": _burst,
    "jitter": _jitter,
    "rounded times": _rounded,
    "spikes": _spikes,
    "clipped": _clipped,
    "held samples": _held,
    "coarse steps": _coarse,
    "missing values": _missing,
    "lost samples": _lost,
}
FAULTS = ("no pauses", *MOTIONS, *RECORDERS)


def drawn(seed: int) -> Recording:
    """A recording with up to three faults."""
    r = np.random.default_rng(seed)
    periods, samples = log_uniform(r, 25, 1500), log_uniform(r, 12, 200)
    samples = max(min(samples, MOST_SAMPLES / periods), 11.3)
    epsilon, mean = log_uniform(r, 0.01, 0.6), r.uniform(0.3, 0.8)
    frequency, mu1 = log_uniform(r, 0.5, 200), log_uniform(r, 3e-4, 3e-2)
    first, second = np.exp(1j * r.uniform(-np.pi, np.pi, 2))
    return Recording(
        r,
        tuple(str(name) for name in r.choice(FAULTS, r.integers(0, 4), replace=False)),
        frequency,
        periods,
        samples,
        epsilon,
        mean,
        epsilon * mean * r.uniform(0, 0.3),
        (mu1 * first, mu1 * r.uniform(0.02, 0.5) * second),
        (log_uniform(r, 1e-4, 1e-2), log_uniform(r, 1e-5, 2e-3)),
        periods / frequency * log_uniform(r, 1e-3, 0.02),
    )


def judged(seed: int) -> dict:
    """Verdict of a recording, and errors of measured numbers in standard uncertainties."""
    recording = drawn(seed)
    row = {"seed": seed, "faults": recording.faults, "verdict": "refused", "errors": {}}
    time, load, force = recording.arrays()
    channels = {"W": Channel(load, "force", "N", "W"), "F": Channel(force, "force", "N", "F")}
    try:
        measurement = asp.measure(Trace(time, channels), modulated=True)
    except InputError:
        return row
    reading = measurement.reading
    errors = {}
    for name, value in recording.planted(reading.start, reading.end).items():
        if name in ("mu1", "mu2"):
            phasor = reading.phasor(int(name[2]))
            errors[name] = (phasor.amplitude - abs(value)) / phasor.amplitude_uncertainty
            # The phase of a small amplitude has no normal error.
            if phasor.amplitude > 6 * phasor.amplitude_uncertainty:
                difference = np.angle(phasor.value / value)
                errors[f"phase{name[2]}"] = difference / phasor.phase_uncertainty
        elif name == "delta_mu":
            errors[name] = (measurement.delta_mu - value) / measurement.delta_mu_uncertainty
        else:
            measured = reading.observables()[name]
            errors[name] = (measured - value) / reading.uncertainty(name)
    named = [check.name for check in measurement.checks if check.verdict != "ok"]
    finite = {name: round(float(z), 1) for name, z in errors.items() if np.isfinite(z)}
    return row | {"verdict": measurement.verdict, "named": named, "errors": finite}


def main() -> None:
    """Print the number of recordings of each verdict, and those that are wrong and ok."""
    rows = [judged(k) for k in seeds(__doc__, 500)]
    counts = {
        v: sum(row["verdict"] == v for row in rows) for v in ("ok", "suspicious", "bad", "refused")
    }
    print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    for row in rows:
        wrong = {name: z for name, z in row["errors"].items() if abs(z) > WRONG}
        if row["verdict"] == "ok" and wrong:
            print_wrong(row["seed"], row["faults"], wrong)
    for row in rows:
        if not row["faults"] and row["verdict"] != "ok":
            print(
                f"clean and {row['verdict']}: seed {row['seed']}: {', '.join(row.get('named', []))}"
            )
    errors = np.abs([z for row in rows if row["verdict"] == "ok" for z in row["errors"].values()])
    print(f"{np.mean(errors > 2):.1%} of {errors.size} numbers that are ok are off by more than 2")


if __name__ == "__main__":
    main()
