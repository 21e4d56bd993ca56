"""The reference of the lock-in: the modulation frequency, fitted to the load.

An error of 1e-4 of the frequency is 0.38 rad after 10 s at 60 Hz, so the frequency is a parameter
of the least-squares fit and not a setting. The fit starts from the strongest line of a spectrum, in
a window so short that the frequency of this line is accurate enough. It is repeated in windows four
times as long each, up to the whole recording.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.fft import prev_fast_len

from asperity.arrays import Float
from asperity.errors import Argument, ConstantLoadError, InputError, require
from asperity.lock_in.normal_equations import Basis, BlockSums, even_step, inverted, sums

#: Samples of the spectrum in which the line is searched.
_SPECTRUM = 1 << 16
#: Fewest periods of the first window of the fit.
_FIRST_PERIODS = 8.0
#: Largest last step, as phase (rad) at the ends of the window. Its square is the remaining error
#: after that step, which `asperity.lock_in.demodulation.read` makes for the whole window.
CONVERGED, MOST_STEPS = 1e-4, 12


class SpectralLine(NamedTuple):
    """The strongest line of a spectrum: frequency (Hz), amplitude, and its background there."""

    frequency: float
    amplitude: float
    background: float


def strongest_line(
    time: Float, values: Float, *, between: tuple[float, float] | None = None
) -> SpectralLine:
    """The strongest line of the spectrum of a signal.

    Its background is the median amplitude of the spectrum between half and twice its
    frequency.

    Parameters
    ----------
    time, values : array, (n,)
        Even or not; gaps are bridged by straight lines for this search only.
    between : (float, float), optional
        Range of the search (Hz), widened to two lines of the spectrum.

    Raises
    ------
    InputError
        If the recording is too short to hold the frequency.
    """
    step, thinned = _evenly(time, values, _SPECTRUM)
    got = "values that are not"
    advice = "leave out their samples, as asperity.measure does"
    require(np.isfinite([step, thinned.sum()]).all(), "lock_in.load", "be finite", got, advice)
    spectra = [_spectrum(step, thinned)]
    if time.size > _SPECTRUM:
        # Averages over several samples hide fast lines: these are searched in a part.
        at = (time.size - _SPECTRUM) // 2
        piece = slice(at, at + _SPECTRUM)
        spectra.append(spectrum(time[piece], values[piece]))
    lines = [_top(*spectrum, between) for spectrum in spectra]
    present = [line for line in lines if line is not None]
    if not present:
        where = "" if between is None else f" about {sum(between) / 2:.6g} Hz"
        rule = "lie within what the recording resolves"
        got = f"{time.size} samples in {time[-1] - time[0]:.6g} s{where}"
        advice = "give another frequency or a longer window"
        raise InputError("lock_in.frequency", rule, got, advice)
    return max(present, key=lambda line: line.amplitude)


def spectrum(time: Float, values: Float) -> tuple[Float, Float]:
    """Frequencies (Hz) and amplitudes of a signal without mean and slope, in a Hann window.

    Parameters
    ----------
    time, values : array, (n,)
        As in `strongest_line`; means over blocks of a longer signal.
    """
    return _spectrum(*_evenly(time, values, _SPECTRUM))


def require_modulated(line: SpectralLine, load: Float) -> None:
    """Refuse a load that is constant; noise alone is not refused.

    Raises
    ------
    ConstantLoadError
        If the line is rounding error.
    """
    if not line.amplitude > 1e-13 * abs(float(load[0])):
        raise ConstantLoadError(
            "lock_in.load",
            "be modulated",
            f"a constant of {float(load[0]):.6g}",
            f"name another column, or choose {Argument('modulated', value='False')}",
        )


def around(frequency: float | None) -> tuple[float, float] | None:
    """Range of the search for an approximately known frequency: 5 % to either side."""
    return None if frequency is None else (0.95 * frequency, 1.05 * frequency)


def fit_frequency(
    time: Float,
    load: Float,
    start: float,
    *,
    harmonics: int,
    degree: int,
    step: float | None,
    share: float = 1.0,
) -> float:
    """Frequency (Hz) by nonlinear least squares on a load.

    Parameters
    ----------
    time, load : array, (n,)
    start : float
        Hz, accurate to a fraction of a cycle over a few periods.
    harmonics : int
        Fitted together with the fundamental, so that they do not bias it.
    degree : int
        Degree of the drift.
    step : float, optional
        Sampling interval (s) of an even clock.
    share : float
        Fraction of the load that is used, its middle part.
    """
    omega = 2 * np.pi * start
    most = int(share * time.size)
    periods = start * float(time[-1] - time[0])
    # An error of half a cycle over the first window, with a factor of safety.
    size = int(min(1.0, max(_FIRST_PERIODS / periods, 1 / 64)) * time.size)
    while True:
        at = (time.size - size) // 2
        t, x = time[at : at + size], load[at : at + size]
        for _ in range(MOST_STEPS):
            basis = window_basis(t, omega, harmonics, degree)
            change = frequency_step(sums(basis, t, [x], step=step))
            omega += change
            if abs(change) * basis.half_width < CONVERGED:
                break
        if size >= most:
            return omega / (2 * np.pi)
        size = min(4 * size, most)


def frequency_direction(basis: Basis, beta: Float) -> Float:
    """Derivative of a fit with respect to omega, as coefficients on the basis.

    Parameters
    ----------
    basis : Basis
    beta : array, (linear,)
        Coefficients of the drift and of the harmonics.

    Returns
    -------
    array, (size,)
    """
    n = basis.harmonics
    k = np.arange(1, n + 1) * basis.half_width
    cosine, sine = beta[basis.drift :][:n], beta[basis.drift :][n:]
    direction = np.zeros(basis.size)
    direction[basis.linear :][:n] = k * sine
    direction[basis.linear :][n:] = -k * cosine
    return direction


def window_basis(time: Float, omega: float, harmonics: int, degree: int) -> Basis:
    """The basis of a window, its time counted from the middle."""
    half = float(time[-1] - time[0]) / 2
    return Basis(omega, harmonics, degree, float(time[0]) + half, half)


def load_columns(basis: Basis, load: Float, refine: bool) -> Float:
    """Columns of the fit of the load, the frequency last; (size, linear + refine)."""
    selected = np.eye(basis.size)[:, : basis.linear + refine]
    if refine:
        selected[:, basis.linear] = frequency_direction(basis, load)
    return selected


def frequency_step(blocks: BlockSums) -> float:
    """Gauss-Newton step of omega (rad/s) from the sums of the load, their first channel."""
    basis, linear = blocks.basis, blocks.basis.linear
    gram, moments = blocks.totals()
    beta = inverted(gram[:linear, :linear]) @ moments[:linear, 0]
    columns = load_columns(basis, beta, True)
    change = (inverted(columns.T @ gram @ columns) @ (columns.T @ moments[:, 0]))[linear]
    # Beyond a radian at the ends the linearisation is not valid.
    return float(np.clip(change, -1 / basis.half_width, 1 / basis.half_width))


def _evenly(time: Float, values: Float, most: int) -> tuple[float, Float]:
    """Step and values on an even grid of at most `most` points; block means if it is coarser."""
    together = -(-time.size // most)
    if together > 1:
        whole = time.size // together * together
        # The time of the sample in the middle is accurate enough for the search.
        time = time[together // 2 : whole : together]
        values = values[:whole].reshape(-1, together).mean(1)
    span = float(time[-1] - time[0])
    if even_step(time, np.pi * time.size / span) is None:
        grid = np.linspace(time[0], time[-1], min(4 * time.size, most))
        values = np.interp(grid, time, values)
    return span / (values.size - 1), values


def _spectrum(step: float, values: Float) -> tuple[Float, Float]:
    """Frequencies and amplitudes of lines, without mean and slope, in a Hann window."""
    # Lengths with large prime factors cost many times as much.
    values = values[: prev_fast_len(values.size, real=True)]
    u = np.linspace(-1, 1, values.size)
    level = values - values.mean()
    level = level - u * (3 * np.mean(u * level))
    hann = np.cos(np.pi / 2 * u) ** 2
    amplitude = np.abs(np.fft.rfft(level * hann)) * (2 / hann.sum())
    frequency = np.asarray(np.fft.rfftfreq(values.size, step), dtype=np.float64)
    return frequency, amplitude


def _top(
    frequency: Float, amplitude: Float, between: tuple[float, float] | None
) -> SpectralLine | None:
    allowed = np.ones(amplitude.size, dtype=bool)
    allowed[:2] = allowed[-1:] = False
    if between is not None:
        middle, half = sum(between) / 2, (between[1] - between[0]) / 2
        allowed &= np.abs(frequency - middle) <= max(half, 2 * frequency[1])
    if not allowed.any():
        return None
    at = int(np.argmax(np.where(allowed, amplitude, -1.0)))
    left, top, right = np.log(np.maximum(amplitude[at - 1 : at + 2], 1e-300))
    bend = left - 2 * top + right
    # A line at the edge of the allowed range may have a higher neighbour outside.
    offset = float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)) if bend < 0 else 0.0
    neighbours = amplitude[max(1, at // 2) : 2 * at + 2]
    return SpectralLine(
        float(frequency[1] * (at + offset)), float(amplitude[at]), float(np.median(neighbours))
    )
