"""Is it one state that was recorded? Load and force that wander, a response that changes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.reading import LockInReading
from asperity.measurement.series import block_means
from asperity.measurement.verdicts.oscillation import left_of_piece
from asperity.measurement.verdicts.verdict import Check, judged

Array = NDArray[np.float64]

#: Where suspicious and bad begin.
LIMITS: dict[str, tuple[float, float]] = {
    "leakage": (0.01, 0.1),
    "steady response": (0.05, 0.5),
    "steady load": (0.01, 0.05),
    "steady force": (0.002, 0.02),
}

#: Spectral lines on each side of a line of its own that belong to it if it is not steady.
_SIDEBANDS = 16
#: Slow motion of so many times the variance that noise gives it is no noise.
_EXCESS = 3.0


def leakage(reading: LockInReading) -> Check:
    """Whether the load is one line, as the reading takes it to be."""
    carrier = abs(reading.epsilon * reading.W0) * reading.samples / 2
    number, beyond = _sidebands(reading, 0, carrier)
    return judged(
        "leakage",
        number,
        LIMITS["leakage"],
        f"sidebands of the load hold {_percent(number)} of its amplitude; if much, it is no "
        "steady line of one frequency: choose a window in which it is",
        significant=beyond > 3.0,
    )


def steady_response(reading: LockInReading) -> Check:
    """Whether mu1 and its phase are the same in all of the window."""
    carrier = reading.phasor(1).amplitude * abs(reading.W0) * reading.samples / 2
    number, beyond = _sidebands(reading, 1, carrier)
    return judged(
        "steady response",
        number,
        LIMITS["steady response"],
        f"sidebands of the force hold {_percent(number)} of its first harmonic; mu1 changes within "
        "the window, or another line is next to it, if that is much",
        significant=3.0 < beyond < np.inf,
    )


def steady_load(reading: LockInReading, time: Array, load: Array) -> Check:
    """Whether the load's mean stays where it is."""
    slow, seen = _wander(reading, time, load, 0)
    drift = float(reading.drift[0].sum())
    number = max(abs(drift), slow) / max(abs(reading.W0), 1e-300)
    motion = "drifts" if abs(drift) > slow else "wanders"
    significant = seen if slow >= abs(drift) else abs(drift) > 10 * reading.uncertainty("W0")
    return judged(
        "steady load",
        number,
        LIMITS["steady load"],
        f"the mean load {motion} by {_percent(number)} in the window, apart from its modulation",
        significant=significant,
    )


def steady_force(reading: LockInReading, time: Array, force: Array) -> Check:
    """Whether the force is steady apart from drift and harmonics, be it stick-slip or not."""
    slow, seen = _wander(reading, time, force, 1)
    number = slow / max(abs(reading.mean_force), 1e-300)
    return judged(
        "steady force",
        number,
        LIMITS["steady force"],
        f"slower than the modulation, the force wanders by {_percent(number)} of its mean about "
        "the fitted drift",
        significant=seen,
    )


def _sidebands(reading: LockInReading, channel: int, carrier: float) -> tuple[float, float]:
    """Share of a line's amplitude that is beside it; and its power there over that farther off."""
    blocks, basis = reading.blocks, reading.blocks.basis
    at = (blocks.middle - basis.centre) / (2 * basis.half_width)
    most = min(3 * _SIDEBANDS, int(reading.periods / 2), at.size // 4)
    offsets = np.arange(2, most + 1)
    if not offsets.size or not carrier:
        return 0.0, np.inf
    angle = 2 * np.pi * np.concatenate([-offsets, offsets])[:, None] * at
    turned = (np.cos(angle) - 1j * np.sin(angle)) @ reading.residual[:, 1, channel]
    power = (np.abs(turned / carrier) ** 2).reshape(2, -1).sum(0)
    near = offsets <= _SIDEBANDS
    number = float(np.sqrt(power[near].sum()))
    if near.all():
        return number, np.inf
    return number, float(power[near].mean() / max(float(power[~near].mean()), 1e-300))


def _wander(reading: LockInReading, time: Array, values: Array, channel: int) -> tuple[float, bool]:
    """Amplitude of what is slower than the modulation, and whether noise does not explain it."""
    white = float(reading.noise.spectra[1, channel, channel].real)
    count, sums = reading.blocks.count, reading.residual[:, 0, channel].real
    # Each block with its samples: a short one at the end says little.
    series = [(sums / count, count)]
    at, left = left_of_piece(reading, time, values)
    # Half a period keeps what is slower, and of the modulation nothing is left to keep.
    span = float(time[at][-1] - time[at][0])
    blocks = int(min(left.size, max(8, 2 * reading.frequency * span)))
    means = block_means(left, blocks)
    series.append((means, np.full(means.size, left.size / means.size)))
    worst, seen = 0.0, False
    for means, samples in series:
        whole = float(samples.sum())
        noise, power = white * means.size / whole, float(samples @ means**2) / whole
        if power > _EXCESS * noise and power - noise > worst**2 / 2:
            worst, seen = float(np.sqrt(2 * (power - noise))), True
    return worst, seen


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"
