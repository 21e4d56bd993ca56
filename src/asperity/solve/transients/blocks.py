"""Transients in blocks, so that memory does not grow with their length."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from asperity._jax import spare_mappings
from asperity.loads import Programme
from asperity.slider import Slider
from asperity.solve.transients.equations import read
from asperity.solve.transients.events import Event
from asperity.solve.transients.march import Checkpoint, March, Stretch
from asperity.solve.transients.provenance import provenance
from asperity.solve.transients.question import march_of
from asperity.solve.transients.sampling import sampler
from asperity.solve.transients.start import first_checkpoint
from asperity.solve.transients.trajectory import Trajectory

#: Rows of a block: some ten megabytes.
ROWS = 100_000


def integrate_blocks(
    slider: Slider,
    programme: Programme,
    *,
    rows: int = ROWS,
    initial: Any = "steady",
    sampling: Any = None,
    resume: Checkpoint | None = None,
    progress: Callable[[float], None] | None = None,
    **options: Any,
) -> Iterator[Trajectory]:
    """Motion of a slider under a programme, block by block.

    Interrupted, by Ctrl-C or otherwise, the blocks handed out stay what they are, and the last
    one's `checkpoint` is where `resume` goes on.

    Parameters
    ----------
    slider, programme, initial, sampling, progress, **options
        As in `transient`.
    rows : int
        Samples of a block, at most.
    resume : Checkpoint, optional
        Where an earlier call with the same arguments has come to.

    Yields
    ------
    Trajectory
        Of the samples since the last block, with the events since then.

    Raises
    ------
    InputError
        If a value breaks its rule; before the first block.
    """
    spare_mappings()
    march = march_of(slider, programme, **options)
    times = sampler(sampling, programme.duration)
    if resume is None:
        march.checkpoint = first_checkpoint(march.motion, programme, initial)
    else:
        march.checkpoint = resume
        times.skip(resume.sampled)
    writer = _Writer(march, rows)
    report = progress or (lambda _: None)
    return _blocks(march, times, writer, report)


def _blocks(march: March, times: Any, writer: _Writer, report: Callable) -> Iterator[Trajectory]:
    last = len(march.programme.segments) - 1
    for stretch in march.stretches():
        writer.events += stretch.events
        over = stretch.stop is not None or (stretch.closes and stretch.checkpoint.segment == last)
        end = stretch.start + stretch.end
        steps = stretch.start + stretch.pieces.begin
        while True:
            room = writer.room
            part = times.take(end, room, steps, over)
            writer.write(stretch, part)
            if len(part) < room:
                break
            yield writer.block(None)
        writer.reached = stretch.checkpoint
        if over:
            yield writer.block(stretch)
        report(end)


class _Writer:
    """Collects samples until they fill a block."""

    def __init__(self, march: March, rows: int) -> None:
        self._march, self._rows = march, rows
        motion = march.motion
        self._scales = float(motion.slider.W0), float(motion.slider.K), float(motion.V)
        self.events: list[Event] = []
        self.reached = march.checkpoint
        self._sampled = march.checkpoint.sampled
        self._clear()

    def _clear(self) -> None:
        self._columns: list[list[np.ndarray]] = []
        self._count = 0

    @property
    def room(self) -> int:
        """Samples that the block can still take."""
        return self._rows - self._count

    def write(self, stretch: Stretch, times: np.ndarray) -> None:
        """Read the samples at `times` (s of the programme) off a stretch."""
        # Contact lost at a break point itself leaves nothing to read.
        if len(times) == 0 or len(stretch.pieces.begin) == 0:
            return
        checkpoint, (W0, K, V) = stretch.checkpoint, self._scales
        t = np.clip(times - stretch.start, 0.0, stretch.end)
        Y = stretch.pieces.evaluate(t)
        now = read(stretch.system, t, Y)
        self._columns.append(
            [
                times,
                now.force * W0,
                now.load * W0,
                now.velocity * V,
                now.slip * V,
                Y[-1] * W0 / K,
                Y[:-1].T,
            ]
        )
        self._count += len(t)
        # Where a block ends in the midst of a stretch, it goes on from its last sample.
        self.reached = Checkpoint(checkpoint.segment, float(t[-1]), Y[:, -1].copy())
        self._sampled = float(times[-1])

    def block(self, last: Stretch | None) -> Trajectory:
        """What has been collected, and begin anew."""
        march = self._march
        size = march.motion.size
        none = [[np.empty(0)] * 6 + [np.empty((0, size))]]
        columns = [np.concatenate(c) for c in zip(*(self._columns or none), strict=True)]
        until = np.inf if last is not None else columns[0][-1]
        trajectory = Trajectory(
            *columns,
            events=tuple(e for e in self.events if e.time <= until),
            stop=None if last is None else last.stop,
            checkpoint=dataclasses.replace(self.reached, sampled=self._sampled),
            motion=march.motion,
            provenance=provenance(march),
        )
        self.events = [e for e in self.events if e.time > until]
        self._clear()
        return trajectory
