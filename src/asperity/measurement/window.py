"""Where a recording is modulated, which part of it can be read, and which pauses give F(0)."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from asperity.arrays import Float, Index
from asperity.lock_in.normal_equations import BlockSums, even_step, merged, sums
from asperity.lock_in.reference import window_basis
from asperity.lock_in.settling import Settling, settling_of_mean
from asperity.measurement.levels_and_trends import neighbour_scatter

#: Usual number of periods in a block of the envelope, and fewest samples of a block.
_PERIODS, _SAMPLES = 4, 8
#: Largest number of blocks. If there would be fewer blocks than the second number, blocks are made
#: shorter, down to one period.
_MOST_BLOCKS, _FEW_BLOCKS = 1000, 64
#: A part is modulated if its amplitude exceeds this share of the largest amplitude.
_ON = 0.005
#: A stretch ends where the amplitude changes by more than this share.
_SAME = 0.02
#: An amplitude and a change of it count above this multiple of the envelope's scatter.
_SCATTERS = 6.0
#: Blocks are made longer until the scatter is below this share of the largest amplitude, as long as
#: this number of blocks is left.
_SMOOTH, _FEWEST = 0.015, 16
#: Harmonics that are fitted together with a settling, up to this share of the sampling rate.
_HARMONICS, _RESOLVED = 2, 0.45
#: A settling is over where it biases the mean by less than the first share of its uncertainty. A
#: part whose noise is `_NOISIER` times that of its later half is shortened by its first of `_STEPS`
#: pieces: the ratio of two noises of twelve degrees of freedom exceeds 7 once in 1,000 times.
_FORGOTTEN, _NOISIER, _STEPS = 0.1, 7.0, 16
#: The longest run without defects is read alone if it has at least this share of the stretch.
_WORTH = 0.5

#: The load of a pause may differ from that of the reading by this share, plus this multiple of the
#: uncertainty of a block; number of blocks of a pause.
_SAME_LOAD, _LOAD_SCATTERS = 0.02, 5.0
_BLOCKS = 100


class LoadInterval(NamedTuple):
    """A part of a recording.

    Attributes
    ----------
    first, stop : int
        Samples, as of a slice.
    amplitude : float
        Amplitude of the load's modulation; 0 where there is none.
    """

    first: int
    stop: int
    amplitude: float

    @property
    def modulated(self) -> bool:
        """Whether the load is modulated here."""
        return self.amplitude > 0


def stretches(time: Float, load: Float, frequency: float) -> list[LoadInterval]:
    """Modulated and unmodulated parts of a load, in their order.

    A block that holds the edge of a part belongs to no part.

    Parameters
    ----------
    time, load : array, (n,)
    frequency : float
        Hz, of the modulation.
    """
    amplitude, edges = envelope(time, load, frequency)
    largest, scatter = np.sort(amplitude)[-min(3, amplitude.size)], neighbour_scatter(amplitude)
    on = amplitude > max(_ON * largest, _SCATTERS * scatter)
    change = np.abs(np.diff(amplitude))
    changed = change > np.maximum(
        _SAME * np.maximum(amplitude[1:], amplitude[:-1]), _SCATTERS * scatter
    )
    cuts = np.flatnonzero((changed & on[1:] & on[:-1]) | (on[1:] != on[:-1])) + 1
    bounds = [0, *cuts.tolist(), amplitude.size]
    intervals = []
    for a, b in pairwise(bounds):
        first, stop = a + (a > 0), b - (b < amplitude.size)
        if b - a == 1 and not on[a]:
            # A short pause has a single block, with hardly any modulation.
            first, stop = a, b
        if stop - first < 1:
            continue
        height = float(np.median(amplitude[first:stop])) if on[a] else 0.0
        intervals.append(LoadInterval(int(edges[first]), int(edges[stop]), height))
    return intervals


def envelope(time: Float, load: Float, frequency: float) -> tuple[Float, Index]:
    """Amplitude of the load at a frequency, block by block.

    Returns
    -------
    (array (blocks,), int array (blocks + 1,))
        Amplitudes, and the samples where the blocks begin and end.
    """
    basis = window_basis(time, 2 * np.pi * frequency, 1, 1)
    periods = 2 * basis.half_width * frequency
    # Blocks of one period to four or more.
    wanted = max(periods / _PERIODS, min(periods, _FEW_BLOCKS, time.size / _SAMPLES))
    wanted = int(min(_MOST_BLOCKS, max(1, wanted)))
    step = even_step(time, basis.omega)
    blocks = merged(sums(basis, time, [load], blocks=wanted, step=step), wanted)
    while True:
        linear = basis.linear
        gram = blocks.gram[:, :linear, :linear]
        # The columns of a block next to a gap may be linearly dependent.
        inverse = np.linalg.pinv(gram, rcond=1e-12, hermitian=True)
        beta = inverse @ blocks.moments[:, :linear]
        amplitude = np.hypot(beta[:, 2, 0], beta[:, 3, 0])
        fewer = amplitude.size // 2
        if fewer < _FEWEST or neighbour_scatter(amplitude) < _SMOOTH * amplitude.max():
            break
        blocks = merged(blocks, fewer)
    edges = np.concatenate([[0], np.cumsum(blocks.count)]).astype(np.intp)
    return amplitude, edges


def settled(time: Float, force: Float, frequency: float, degree: int) -> int:
    """First sample of a part at which the settling from before the part no longer matters.

    The beginning is left out until the settling has fallen below the uncertainty of the mean, if at
    least half of the part is left. Otherwise only that beginning is left out in which a fit with
    one exponential has a larger residual than in the later half; the reading models the settling.

    Parameters
    ----------
    time, force : array, (n,)
    frequency : float
        Hz, of the modulation.
    degree : int
        Degree of the drift.
    """
    blocks = _blocks(time, force, frequency, degree)
    if blocks is None:
        return 0
    edges = np.concatenate([[0], np.cumsum(blocks.count)]).astype(np.intp)

    def settling_after(block: int) -> Settling | None:
        own = window_basis(time[edges[block] :], blocks.basis.omega, blocks.basis.harmonics, degree)
        return settling_of_mean(blocks.after(block, own))

    first, latest = 0, int(np.searchsorted(edges, time.size // 2))
    late = settling_after(latest)
    while first < latest:
        settling = settling_after(first)
        if settling is None or late is None:
            break
        stop = first
        if settling.noise > _NOISIER * late.noise:
            stop = min(first + blocks.count.size // _STEPS, latest)
        elif settling.present:
            begin, span = time[edges[first]], float(time[-1] - time[edges[first]])
            doubt = _FORGOTTEN * np.sqrt(settling.noise / (time.size - edges[first]))
            bias = abs(settling.amplitude) * settling.longest / span
            until = begin + settling.longest * np.log(max(bias / doubt, 1.0))
            forgotten = int(np.searchsorted(time[edges[:-1]], until))
            stop = forgotten if forgotten <= latest else first
        if stop == first:
            break
        first = stop
    return int(edges[first])


def settling_from(time: Float, force: Float, frequency: float, degree: int) -> Settling | None:
    """Settling of the mean of a force; None with too few samples for one.

    Parameters
    ----------
    time, force : array, (n,)
    frequency : float
        Hz, of a modulation or of none.
    degree : int
        Degree of the drift.
    """
    blocks = _blocks(time, force, frequency, degree)
    return None if blocks is None else settling_of_mean(blocks)


def _blocks(time: Float, force: Float, frequency: float, degree: int) -> BlockSums | None:
    """Sums of a force in blocks, for its settling; None with too few samples for one."""
    per_period = 1 / (frequency * float(np.median(np.diff(time[: 1 << 14]))))
    harmonics = int(min(_HARMONICS, _RESOLVED * per_period))
    if time.size < 64 or not harmonics:
        return None
    basis = window_basis(time, 2 * np.pi * frequency, harmonics, degree)
    step = even_step(time, basis.omega * harmonics)
    return sums(basis, time, [force], blocks=_MOST_BLOCKS, step=step)


def clean_run(first: int, stop: int, defects: Index) -> tuple[int, int]:
    """The longest run of samples between defects if it is long enough, otherwise the stretch.

    Parameters
    ----------
    first, stop : int
        The stretch.
    defects : int array
        Samples that are defective, or that follow a gap, in rising order.
    """
    inside = defects[(defects > first) & (defects < stop)]
    edges = np.concatenate([[first], inside, [stop]])
    longest = int(np.argmax(np.diff(edges)))
    if edges[longest + 1] - edges[longest] < _WORTH * (stop - first):
        return first, stop
    begin = int(edges[longest]) + (longest > 0)
    return begin, int(edges[longest + 1])


def whole_periods(time: Float, frequency: float) -> int:
    """Number of samples in the largest whole number of periods from the start, ends included."""
    span = float(time[-1] - time[0])
    step = span / (time.size - 1)
    whole = np.floor((span + step) * frequency * (1 + 1e-12)) / frequency
    return int(np.searchsorted(time, time[0] + whole - 0.5 * step, side="right"))


def under_the_same_load(
    load: Float, first: int, stop: int, mean_load: float, *, before: bool
) -> tuple[int, int]:
    """Samples of a pause next to the modulated stretch whose load is that of the reading.

    A loading ramp or an unloading is no part of F(0).

    Parameters
    ----------
    load : array, (n,)
        Load of the whole recording.
    first, stop : int
        The pause.
    mean_load : float
        Mean load of the reading.
    before : bool
        Whether the pause ends, or begins, at the modulated stretch.

    Returns
    -------
    (int, int)
        A slice; empty if the samples next to the stretch are under another load.
    """
    length = max(1, (stop - first) // _BLOCKS)
    whole = (stop - first) // length
    values = load[stop - whole * length : stop] if before else load[first : first + whole * length]
    blocks = values.reshape(whole, length)
    if before:
        blocks = blocks[::-1]
    means = blocks.mean(1)
    noise = float(np.median(blocks.std(1))) / np.sqrt(length)
    same = np.abs(means - mean_load) <= _SAME_LOAD * abs(mean_load) + _LOAD_SCATTERS * noise
    if same.all():
        return first, stop
    kept = int(np.argmin(same)) * length
    return (stop - kept, stop) if before else (first, first + kept)
