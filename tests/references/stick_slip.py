"""Stick-slip recordings of known truth: straight loading, half-cosine drops, noise and impulses."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from asperity.recording import Channel, Trace

RATE = 2000.0


@dataclass(frozen=True)
class Saw:
    """A recording and what it is made of.

    Attributes
    ----------
    force : array, (n,)
        F/W, sampled at `RATE`.
    onset, end : array, (k,)
        Times (s) of each slip.
    drop : array, (k,)
    loading_slope : float
        1/s.
    """

    force: np.ndarray
    onset: np.ndarray
    end: np.ndarray
    drop: np.ndarray
    loading_slope: float

    @property
    def time(self):
        return np.arange(self.force.size) / RATE

    def trace(self):
        return Trace(self.time, {"mu": Channel(self.force, "dimensionless", "", "mu", "1")})


def saw(
    seed,
    events=100,
    *,
    cycle=1000,
    slip=20,
    drop=0.1,
    spread=0.0,
    small=0.0,
    small_size=0.2,
    noise=0.05,
    correlation=0.0,
    impulses=0.004,
    wave=0.0,
    ringing=0.0,
    creep=0.0,
):
    """A recording with `events` slips.

    Parameters
    ----------
    cycle, slip : int
        Samples of the stick that loads by `drop`, and of a slip.
    spread : float
        Relative standard deviation of the drops.
    small, small_size : float
        Share of the events that are small, and their size over `drop`.
    noise : float
        Standard deviation over `drop`; an AR(1) process of coefficient `correlation`.
    impulses : float
        Share of the samples that have one, of 0.6 `drop` standard deviation.
    wave : float
        Amplitude over `drop` of a slow wave of friction along the track, 20 cycles long.
    ringing : float
        Amplitude over the drop of the gauge's oscillation after a slip.
    creep : float
        Share of the drop by which the force lags before the onset, over a tenth of the stick.
    """
    rng = np.random.default_rng(seed)
    slope = drop / cycle
    parts = [0.3 + slope * np.arange(cycle // 2)]
    level, at = parts[0][-1], cycle // 2
    onset, drops = [], []
    for _ in range(events):
        size = max(drop * (1 + spread * rng.standard_normal()), 0.25 * drop)
        if small and rng.random() < small:
            size = small_size * drop
        u = np.arange(1, slip + 1) / slip
        parts.append(level - size * (1 - np.cos(np.pi * u)) / 2)
        onset.append(at - 1)
        drops.append(size)
        level -= size
        stick = max(int(size / slope * (1 + 0.3 * spread * rng.standard_normal())), 8)
        j = np.arange(1, stick + 1)
        loading = level + slope * j
        loading -= creep * size * np.exp((j - stick) / (0.1 * stick))
        ring = 0.0
        if ringing:
            # Six samples long; it has died out after a hundred.
            ring = -ringing * size * np.exp(-j / 20) * np.sin(2 * np.pi * j / 6)
        parts.append(loading + ring)
        level = loading[-1]
        at += slip + stick
    clean = np.concatenate(parts)
    clean = clean + wave * drop * np.sin(2 * np.pi * np.arange(clean.size) / (20.3 * cycle))
    white = rng.standard_normal(clean.size)
    if correlation:
        white = lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)
    force = clean + noise * drop * white
    hit = rng.random(clean.size) < impulses
    force = force + 0.6 * drop * rng.standard_normal(clean.size) * hit
    onset = np.array(onset)
    return Saw(force, onset / RATE, (onset + slip) / RATE, np.array(drops), slope * RATE)


def matched(saw_, events, tolerance=0.02):
    """Indices of true events and of those read that belong together, by their middles."""
    true = (saw_.onset + saw_.end) / 2
    read = (events.onset + events.end) / 2
    if not read.size:
        return np.empty(0, int), np.empty(0, int)
    nearest = np.abs(read[:, None] - true).argmin(0)
    close = np.abs(read[nearest] - true) < tolerance
    return np.flatnonzero(close), nearest[close]
