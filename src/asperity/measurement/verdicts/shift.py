"""Whether the first harmonic is one number in the window, seen in pieces of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.reading import LockInReading
from asperity.measurement.verdicts.verdict import Check, judged

Array = NDArray[np.float64]

#: Where suspicious and bad begin.
LIMITS = (0.07, 0.4)

_PIECES, _FEWEST_PERIODS = 8, 3
#: Chi-squared of the pieces beyond its mean, in standard deviations, that noise does not reach.
_BEYOND = 6.0


def shifting_response(reading: LockInReading, time: Array, force: Array) -> Check:
    """Whether mu1 and its phase shift within the window: range of the pieces over the mean.

    Parameters
    ----------
    reading : LockInReading
    time, force : array, (n,)
        Of the window.
    """
    pieces = int(min(_PIECES, reading.periods // _FEWEST_PERIODS))
    if pieces < 3:
        sentence = "the window is too short to be read in pieces"
        return judged("shifting response", 0.0, LIMITS, sentence)
    omega = 2 * np.pi * reading.frequency
    orders = range(1, reading.harmonics.size + 1)
    middle = (reading.start + reading.end) / 2
    found = []
    for piece in np.array_split(np.arange(time.size), pieces):
        t = time[piece]
        u = (t - t[0]) / (t[-1] - t[0]) - 0.5
        columns = [np.ones_like(t), u]
        for n in orders:
            angle = n * omega * (t - middle)
            columns += [np.cos(angle), np.sin(angle)]
        beta = np.linalg.lstsq(np.stack(columns, axis=1), force[piece])[0]
        found.append(complex(beta[2], -beta[3]))
    phasors = np.array(found)
    mean = phasors.mean()
    # Of noise alone: the uncertainty of a harmonic that settles is that of what it settles to.
    # Amplitude over a piece has half the variance of a complex phasor: two components a piece.
    sigma = np.sqrt(2 * reading.noise.spectra[1, 1, 1].real * pieces / reading.samples)
    squares = float(np.sum(np.abs(phasors - mean) ** 2)) / max(sigma**2, 1e-300)
    freedom = 2 * (pieces - 1)
    seen = squares > freedom + _BEYOND * np.sqrt(2 * freedom)
    away = np.abs(phasors[:, None] - phasors[None, :])
    number = float(away.max() / max(abs(mean), 1e-300))
    return judged(
        "shifting response",
        min(number, 1e300),
        LIMITS,
        f"read in {pieces} pieces, the first harmonic of the force shifts by {100 * number:.2g} % "
        "within the window",
        significant=bool(seen),
    )
