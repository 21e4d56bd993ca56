"""Removal of defects of a recorded run before the fit, which reports them.

Spikes are replaced by the line between their neighbours, long recordings are averaged over blocks,
and the level after a jump of the gauge is a nuisance parameter of the fit. Samples after changes of
the drive, where friction changes quickly, are not touched: spikes among them are found by the fit,
which knows the motion, and which is repeated without them.
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

#: Changes of the load are few if there are at least this many samples for each.
_FEW_CHANGES = 100
#: Largest share of spikes among the samples (plus one spike): with more, the noise is not normal.
_MOST_SPIKES = 0.01
#: Largest number of samples that a fit leaves out: each is a nuisance, which takes time.
_MOST_WRONG = 50
#: No jump is searched within this share of a segment, and within this many samples, from a change
#: of the drive: friction changes too quickly there.
_NEAR_CHANGE, _SAMPLES_NEAR_CHANGE = 0.05, 20


def cleaned(run: RecordedRun, rate: Any = None) -> RecordedRun:
    """The run for comparison with the motion: without spikes, averaged if long, with its jumps.

    Parameters
    ----------
    run : RecordedRun
        The recording; a cleaned run is returned unchanged.
    rate : float, str or None
        As in `reduced`.
    """
    return with_jumps(reduced(without_spikes(run), rate))


def first_after_changes(run: RecordedRun) -> list[int]:
    """First samples after changes of the velocity, and of the load if these are few."""
    inner = run.drive.edges[1:-1]
    few = inner.size * _FEW_CHANGES <= run.time.size
    edges = inner if few else run.drive.edges[list(run.cuts)]
    return [int(k) for k in np.searchsorted(run.time, edges)]


def without_spikes(run: RecordedRun) -> RecordedRun:
    """The run with spikes replaced by the lines between their neighbours.

    Parameters
    ----------
    run : RecordedRun
        A run with spikes that the user has named, or without known spikes.
    """
    if run.blocks is not None:
        return run
    if run.spikes is None:
        wrong = away_from_changes(run.friction, spikes(run.friction), first_after_changes(run))
        if wrong.size > 1 + _MOST_SPIKES * run.time.size:
            doubt = (
                f"{wrong.size} samples of friction stand out of their neighbours: the noise is not "
                "normal, and intervals may be wrong"
            )
            return replace(run, spikes=(), doubts=(*run.doubts, doubt))
    else:
        wrong = np.searchsorted(run.time, run.spikes)
    return replace(
        run, friction=without(run.friction, wrong), spikes=tuple(run.time[wrong].tolist())
    )


def most_wrong(run: RecordedRun) -> int:
    """Largest number of samples, in addition to the spikes, or of means, that a fit leaves out."""
    # The means of a long recording are taken without its spikes.
    spikes = len(run.spikes or ()) if run.blocks is None else 0
    return min(max(int(1 + _MOST_SPIKES * run.time.size) - spikes, 0), _MOST_WRONG)


def with_wrong_samples(run: RecordedRun, times: Sequence[float]) -> RecordedRun:
    """The run with wrong samples, which a fit cannot explain; without any if there are too many.

    Parameters
    ----------
    run : RecordedRun
    times : sequence of float
        Times of the samples (s).
    """
    if len(times) <= most_wrong(run):
        return replace(run, wrong=tuple(times))
    doubt = (
        f"{len(times)} samples of friction or more are farther from the motion than noise reaches: "
        "the noise is not normal or the law is wrong, and intervals may not hold"
    )
    return replace(run, wrong=(), doubts=(*run.doubts, doubt))


def with_jumps(run: RecordedRun) -> RecordedRun:
    """The run with the times of jumps of its level; unchanged if the jumps are known already.

    No jump is searched near gaps, and near changes of the drive, where friction changes quickly.

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
    return replace(run, jumps=tuple(sorted(float(run.begins[jump.sample]) for jump in jumps)))
