"""Whether one steady state was recorded.

Load and force that wander, oscillations that are no harmonics, a response that changes within the
window.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import fdtri

from asperity.arrays import Float
from asperity.lock_in.reading import PIECE, LockInReading
from asperity.lock_in.reference import SpectralLine, strongest_line
from asperity.measurement.levels_and_trends import block_means
from asperity.measurement.verdicts.verdict import LOCK_IN, Check, percent

#: Stick-slip of laboratory sliders is slower than this (Hz).
_STICK_SLIP = 20.0


#: Spectral lines on each side of the modulation that count as its sidebands.
_SIDEBANDS = 16
#: Sidebands are no noise if noise is as strong next to the line with a lower probability, and
#: lines that the noise at a harmonic is the mean of.
_CHANCE, _LINES = 1e-4, 20
#: Slow motion counts above this multiple of the variance that noise gives it.
_EXCESS = 3.0

#: Pieces of a window that are read separately, and fewest periods of a piece.
_PIECES, _FEWEST_PERIODS = 8, 3
#: Noise does not move chi-squared of the pieces beyond this multiple of its standard deviation.
_BEYOND = 6.0


def other_line(
    reading: LockInReading, time: Float, values: Float, channel: int
) -> SpectralLine | None:
    """The strongest line of a residual that is no harmonic of the modulation.

    Of the load, at any frequency; of the force, below the modulation or 20 Hz, where stick-slip is.

    Parameters
    ----------
    reading : LockInReading
    time, values : array, (n,)
        Times and channel of the window.
    channel : int
        0 for the load, 1 for the force.
    """
    f = reading.frequency
    piece, left = reading.residual_of_piece(time, values)
    span = float(time[piece][-1] - time[piece][0])
    # Stick-slip may be faster than a slow modulation.
    highest = max(0.9 * f, _STICK_SLIP) if channel else left.size / span / 2
    # Means over a third of a period keep what is slower.
    blocks = int(min(left.size, max(64, 3.3 * highest * span)))
    candidates = [_below(block_means(time[piece], blocks), block_means(left, blocks), highest)]
    if time.size > PIECE:
        count = reading.blocks.count
        slow = reading.residual[:-1, 0, channel].real / count[:-1]
        candidates.append(_below(reading.blocks.middle[:-1], slow, 0.9 * f))
    # Lines at harmonics above those that are fitted belong to the modulation.
    width = 2 / span
    lines = [
        line
        for line in candidates
        if line is not None
        and (
            line.frequency < 0.9 * f
            or abs(line.frequency / f - round(line.frequency / f)) * f > width
        )
    ]
    # The background of a constant force is zero.
    return max(lines, key=lambda line: line.amplitude / max(line.background, 1e-300), default=None)


def _below(time: Float, values: Float, highest: float) -> SpectralLine | None:
    """The strongest line between drift and a frequency; None where there is no room for one."""
    if time.size < 32 or (time[-1] - time[0]) * highest < 3 or not values.any():
        return None
    lowest = 2.5 / float(time[-1] - time[0])
    return strongest_line(time, values, between=(lowest, highest))


def leakage(reading: LockInReading) -> Check:
    """Whether the load is one line, as the reading takes it to be."""
    number, seen = _sidebands(reading, 0, abs(reading.epsilon))
    text = (
        f"sidebands of the load hold {percent(number)} of its amplitude; if much, it is no "
        "steady line of one frequency: choose a window in which it is"
    )
    return LOCK_IN.check("leakage", number, text, significant=seen)


def steady_response(reading: LockInReading) -> Check:
    """Whether mu1 and its phase are the same in all of the window."""
    number, seen = _sidebands(reading, 1, reading.phasor(1).amplitude)
    text = (
        f"sidebands of the force hold {percent(number)} of its first harmonic; mu1 changes within "
        "the window, or another line is next to it, if that is much"
    )
    return LOCK_IN.check("steady response", number, text, significant=seen)


def steady_load(reading: LockInReading, time: Float, load: Float) -> Check:
    """Whether the load's mean stays where it is."""
    slow, seen = _wander(reading, time, load)
    drift = float(reading.drift_range[0])
    number = max(drift, slow) / max(abs(reading.W0), 1e-300)
    motion = "drifts" if drift > slow else "wanders"
    if drift > slow:
        seen = drift > 10 * reading.uncertainty("W0")
    text = f"the mean load {motion} by {percent(number)} in the window, apart from its modulation"
    return LOCK_IN.check("steady load", number, text, significant=seen)


def _sidebands(reading: LockInReading, channel: int, amplitude: float) -> tuple[float, bool]:
    """Amplitude of the sidebands over that of a line, and whether they exceed noise farther off.

    The power of both sides of the modulation is added.
    """
    carrier = amplitude * abs(reading.W0) * reading.samples / 2
    blocks, basis = reading.blocks, reading.blocks.basis
    at = (blocks.middle - basis.centre) / (2 * basis.half_width)
    most = min(3 * _SIDEBANDS, int(reading.periods / 2), at.size // 4)
    offsets = np.arange(2, most + 1)
    if not offsets.size or not carrier:
        return 0.0, False
    angle = 2 * np.pi * np.concatenate([-offsets, offsets])[:, None] * at
    turned = (np.cos(angle) - 1j * np.sin(angle)) @ reading.residual[:, 1, channel]
    power = (np.abs(turned / carrier) ** 2).reshape(2, -1).sum(0)
    inside = offsets <= _SIDEBANDS
    near, far = power[inside], power[~inside]
    if not far.size:
        # The sidebands of few periods reach to the next harmonic. Noise is that at the last one.
        noise = float(reading.noise.spectra[-1, channel, channel].real)
        far = np.full(_LINES, 2 * noise * reading.samples / carrier**2)
    # Either side of a line has a real and an imaginary part.
    chance = float(fdtri(4 * near.size, 4 * far.size, 1 - _CHANCE))
    seen = near.mean() > max(3.0, chance) * max(far.mean(), 1e-300)
    return float(np.sqrt(near.sum())), bool(seen)


def _wander(reading: LockInReading, time: Float, load: Float) -> tuple[float, bool]:
    """Amplitude of slow motion of the load, and whether noise does not explain it."""
    white = float(reading.noise.spectra[1, 0, 0].real)
    count, sums = reading.blocks.count, reading.residual[:, 0, 0].real
    # Blocks are weighted by their samples: a short block at the end has little weight.
    series = [(sums / count, count)]
    at, left = reading.residual_of_piece(time, load)
    # Means over half a period keep slower motion; the modulation is not in the residual.
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


def shifting_response(reading: LockInReading, time: Float, force: Float) -> Check:
    """Whether mu1 and its phase shift within the window: range of the pieces over the mean.

    Parameters
    ----------
    reading : LockInReading
    time, force : array, (n,)
        Times and force of the window.
    """
    pieces = int(min(_PIECES, reading.periods // _FEWEST_PERIODS))
    if pieces < 3:
        sentence = "the window is too short to be read in pieces"
        return LOCK_IN.check("shifting response", 0.0, sentence)
    basis = replace(reading.blocks.basis, omega=2 * np.pi * reading.frequency, degree=1)
    responses = []
    for piece in np.array_split(np.arange(time.size), pieces):
        columns = basis.columns(time[piece])[: basis.linear]
        beta = np.linalg.lstsq(columns.T, force[piece])[0]
        responses.append(complex(beta[basis.drift], -beta[basis.drift + basis.harmonics]))
    phasors = np.array(responses)
    mean = phasors.mean()
    # The uncertainty by noise alone; that of the reading includes the extrapolation of a settling.
    # Each piece has two components, real and imaginary part.
    sigma = np.sqrt(2 * reading.noise.spectra[1, 1, 1].real * pieces / reading.samples)
    squares = float(np.sum(np.abs(phasors - mean) ** 2)) / max(sigma**2, 1e-300)
    freedom = 2 * (pieces - 1)
    seen = squares > freedom + _BEYOND * np.sqrt(2 * freedom)
    away = np.abs(phasors[:, None] - phasors[None, :])
    number = min(float(away.max() / max(abs(mean), 1e-300)), 1e300)
    text = (
        f"read in {pieces} pieces, the first harmonic of the force shifts by {100 * number:.2g} % "
        "within the window"
    )
    return LOCK_IN.check("shifting response", number, text, significant=bool(seen))
