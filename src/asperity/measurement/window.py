"""Where a recording is modulated, and which part of that is fit to be read."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.basis import Basis
from asperity.lock_in.blocks import BlockSums, even_step, sums
from asperity.measurement.series import settled_from

Array = NDArray[np.float64]

#: Periods in a block of the envelope, and blocks of a whole recording at most.
_PERIODS = 4
_MOST_BLOCKS = 1000
#: A part is modulated above this share of the recording's largest amplitude.
_ON = 0.005
#: A change of amplitude beyond this share of it is another stretch.
_SAME = 0.1
#: Both must exceed the scatter of the envelope so many times, and blocks are made longer until the
#: scatter is this share of the largest amplitude, or few are left.
_SCATTERS = 6.0
_SMOOTH, _FEWEST = 0.015, 16
#: The longest clean run is read alone if it has this share of the stretch.
_WORTH = 0.5


class LoadInterval(NamedTuple):
    """A part of a recording.

    Attributes
    ----------
    first, stop : int
        Samples, as of a slice.
    amplitude : float
        Of the load's modulation; 0 where there is none.
    """

    first: int
    stop: int
    amplitude: float

    @property
    def modulated(self) -> bool:
        """Whether the load is modulated here."""
        return self.amplitude > 0


def stretches(time: Array, load: Array, frequency: float) -> list[LoadInterval]:
    """Modulated and unmodulated parts of a load, in their order.

    Blocks at the edge of a part, which hold some of both, belong to none.

    Parameters
    ----------
    time, load : array, (n,)
    frequency : float
        Hz, of the modulation.
    """
    amplitude, edges = envelope(time, load, frequency)
    largest, scatter = np.sort(amplitude)[-min(3, amplitude.size)], _scatter(amplitude)
    on = amplitude > max(_ON * largest, _SCATTERS * scatter)
    change = np.abs(np.diff(amplitude))
    changed = change > np.maximum(
        _SAME * np.maximum(amplitude[1:], amplitude[:-1]), _SCATTERS * scatter
    )
    cuts = np.flatnonzero((changed & on[1:] & on[:-1]) | (on[1:] != on[:-1])) + 1
    bounds = [0, *cuts.tolist(), amplitude.size]
    found = []
    for a, b in pairwise(bounds):
        first, stop = a + (a > 0), b - (b < amplitude.size)
        if stop - first < 1:
            continue
        height = float(np.median(amplitude[first:stop])) if on[a] else 0.0
        found.append(LoadInterval(int(edges[first]), int(edges[stop]), height))
    return found


def envelope(time: Array, load: Array, frequency: float) -> tuple[Array, NDArray[np.intp]]:
    """Amplitude of the load at a frequency, block by block.

    Returns
    -------
    (array (blocks,), int array (blocks + 1,))
        Amplitudes, and the samples where the blocks begin and end.
    """
    blocks = local(time, [load], frequency)
    while True:
        beta = _solved(blocks)
        amplitude = np.hypot(beta[:, 2, 0], beta[:, 3, 0])
        fewer = amplitude.size // 2
        if fewer < _FEWEST or _scatter(amplitude) < _SMOOTH * amplitude.max():
            break
        blocks = merged(blocks, fewer)
    edges = np.concatenate([[0], np.cumsum(blocks.count)]).astype(np.intp)
    return amplitude, edges


def _scatter(series: Array) -> float:
    """Standard deviation from neighbours, which steps hardly touch."""
    if series.size < 3:
        return 0.0
    return 1.4826 * float(np.median(np.abs(np.diff(series)))) / np.sqrt(2)


def local(time: Array, channels: list[Array], frequency: float) -> BlockSums:
    """Sums over short blocks of some periods each."""
    half = float(time[-1] - time[0]) / 2
    basis = Basis(2 * np.pi * frequency, 1, 1, float(time[0]) + half, half)
    wanted = int(min(_MOST_BLOCKS, max(1, 2 * half * frequency / _PERIODS)))
    step = even_step(time, basis.omega)
    return merged(sums(basis, time, channels, blocks=wanted, step=step), wanted)


def merged(blocks: BlockSums, wanted: int) -> BlockSums:
    """Neighbouring blocks added up, until there are about so many; a short rest joins the last."""
    together = -(-blocks.count.size // wanted)
    if together == 1 and blocks.count[-1] > 0.5 * blocks.count[0]:
        return blocks
    edges = np.arange(0, blocks.count.size, together)
    if edges.size > 1 and blocks.count[edges[-1] :].sum() < 0.5 * blocks.count[:together].sum():
        edges = edges[:-1]

    def added(values: Array) -> Array:
        return np.add.reduceat(values, edges, axis=0)

    count = added(blocks.count)
    middle = added(blocks.middle * blocks.count) / count
    return BlockSums(blocks.basis, added(blocks.gram), added(blocks.moments), count, middle)


def settled(time: Array, force: Array, frequency: float, degree: int) -> int:
    """First sample at which the force has forgotten how its modulation began."""
    blocks = local(time, [force], frequency)
    blocks = merged(blocks, 200)
    # A transient is smooth, so a level per block about the middle of the block is enough of it.
    beta = _solved(blocks)
    u = (blocks.middle - blocks.basis.centre) / blocks.basis.half_width
    cut = settled_from(beta[:, 0, 0] + beta[:, 1, 0] * u, degree)
    return int(blocks.count[:cut].sum())


def clean_run(first: int, stop: int, defects: NDArray[np.intp]) -> tuple[int, int]:
    """The longest run of samples between defects, if it is worth being read alone.

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


def whole_periods(time: Array, frequency: float) -> int:
    """Number of samples in the largest whole number of periods from the start, ends included."""
    span = float(time[-1] - time[0])
    step = span / (time.size - 1)
    whole = np.floor((span + step) * frequency * (1 + 1e-12)) / frequency
    return int(np.searchsorted(time, time[0] + whole - 0.5 * step, side="right"))


def _solved(blocks: BlockSums) -> Array:
    linear = blocks.basis.linear
    gram = blocks.gram[:, :linear, :linear]
    # A block whose samples lie in a gap's edge may not tell its columns apart.
    return np.linalg.pinv(gram, rcond=1e-12, hermitian=True) @ blocks.moments[:, :linear]
