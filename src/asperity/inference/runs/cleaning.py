"""A recorded run without its defects, which are removed once, before the fit, and reported by it.

Spikes are replaced by the line between their neighbours, long recordings are averaged over blocks,
and the level after a jump of the gauge is a nuisance of the fit. Changes of the drive are known
here: friction itself changes quickly after them. Spikes that could be friction are left to the fit,
which knows the motion, and begins again without them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from asperity.inference.runs.blocks import reduced
from asperity.inference.runs.run import RecordedRun
from asperity.recording.defects.jumps import find_jumps
from asperity.recording.defects.sampling import gap_rows
from asperity.recording.defects.spikes import away_from_changes, spikes, without

#: Changes of the load are few if there are so many samples to each.
_FEW_CHANGES = 100
#: Share of samples, and one more, that may be spikes: noise with more of them is not normal.
_MOST_SPIKES = 0.01
#: Samples that a fit may leave out: each is a nuisance, and costs time at each step.
_MOST_WRONG = 50
#: Share of the segments next to a change of the drive, and samples about it, in which friction
#: changes too quickly to recognise a jump.
_NEAR_CHANGE, _SAMPLES_NEAR_CHANGE = 0.05, 20


def cleaned(run: RecordedRun, rate: Any = None) -> RecordedRun:
    """The run as it is compared with the motion, with its spikes and jumps.

    Parameters
    ----------
    run : RecordedRun
        As recorded; one that was cleaned stays as it is.
    rate : float, str or None
        As in `reduced`.
    """
    return with_jumps(reduced(without_spikes(run), rate))


def first_after_changes(run: RecordedRun) -> list[int]:
    """First samples after changes of the velocity, and of the load where they are few."""
    inner = run.drive.edges[1:-1]
    few = inner.size * _FEW_CHANGES <= run.time.size
    edges = inner if few else run.drive.edges[list(run.cuts)]
    return [int(k) for k in np.searchsorted(run.time, edges)]


def without_spikes(run: RecordedRun) -> RecordedRun:
    """The run with lines between the neighbours in place of spikes.

    Parameters
    ----------
    run : RecordedRun
        With the spikes that its user has named, or none yet.
    """
    if run.blocks is not None:
        return run
    if run.spikes is None:
        wrong = away_from_changes(run.friction, spikes(run.friction), first_after_changes(run))
        if wrong.size > 1 + _MOST_SPIKES * run.time.size:
            doubt = (
                f"{wrong.size} samples of friction stand out of their neighbours: the noise is not "
                "normal, and intervals may not hold"
            )
            return replace(run, spikes=(), doubts=(*run.doubts, doubt))
    else:
        wrong = np.searchsorted(run.time, run.spikes)
    if not wrong.size:
        return replace(run, spikes=()) if run.spikes is None else run
    return replace(
        run, friction=without(run.friction, wrong), spikes=tuple(run.time[wrong].tolist())
    )


def most_wrong(run: RecordedRun) -> int:
    """Samples besides the spikes that a fit may leave out."""
    return min(int(1 + _MOST_SPIKES * run.time.size) - len(run.spikes or ()), _MOST_WRONG)


def with_wrong_samples(run: RecordedRun, times: Sequence[float]) -> RecordedRun:
    """The run with samples that a fit cannot explain; without any where they are too many.

    Parameters
    ----------
    run : RecordedRun
    times : sequence of float
        Of the samples (s).
    """
    if len(times) <= most_wrong(run):
        return replace(run, wrong=tuple(times))
    doubt = (
        f"{len(times)} samples of friction or more are farther from the motion than noise reaches: "
        "the noise is not normal or the law is wrong, and intervals may not hold"
    )
    return replace(run, wrong=(), doubts=(*run.doubts, doubt))


def with_jumps(run: RecordedRun) -> RecordedRun:
    """The run with the times at which its level jumps by itself; as it is where they are known.

    None is looked for next to a change of the drive, where friction itself is quick, or to a gap.

    Parameters
    ----------
    run : RecordedRun
    """
    if run.jumps is not None:
        return run
    time, edges = run.time, run.drive.edges
    level = np.ones(time.size, bool)
    for before, at, after in zip(edges[:-2], edges[1:-1], edges[2:], strict=True):
        near = [at - _NEAR_CHANGE * (at - before), at + _NEAR_CHANGE * (after - at)]
        first, last = np.searchsorted(time, near)
        level[max(first - _SAMPLES_NEAR_CHANGE, 0) : last + _SAMPLES_NEAR_CHANGE] = False
    # A stretch ends where the drive changes, samples are missing, or the sampling rate changes.
    ends = np.flatnonzero(np.diff(level)) + 1
    bounds = {0, *ends, *gap_rows(time), *(a for a, _ in run.stretches), time.size}
    cuts = sorted(map(int, bounds))
    stretches = [(a, b) for a, b in pairwise(cuts) if level[a]]
    jumps = find_jumps(run.friction, stretches)
    return replace(run, jumps=tuple(sorted(float(time[jump.sample]) for jump in jumps)))
