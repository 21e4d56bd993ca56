"""Transients in blocks, so that memory does not grow with their length."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from asperity._jax import spare_mappings
from asperity.loads import Programme
from asperity.slider import Slider
from asperity.transients.equations import motion_samples
from asperity.transients.events import Event
from asperity.transients.initial_state import first_checkpoint
from asperity.transients.inputs import checked_integration
from asperity.transients.integration import Checkpoint, Integration, SegmentPart
from asperity.transients.provenance import provenance
from asperity.transients.sampling import sample_times
from asperity.transients.trajectory import Trajectory

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
    progress: Callable[[float, float], None] | None = None,
    **options: Any,
) -> Iterator[Trajectory]:
    """Motion of a slider under a programme, block by block.

    After an interruption, by Ctrl-C or otherwise, the blocks already yielded stay valid, and
    `resume` continues from the `checkpoint` of the last one.

    Parameters
    ----------
    slider, programme, initial, sampling, progress, **options
        As in `transient`.
    rows : int
        Largest number of samples of a block.
    resume : Checkpoint, optional
        Of the last block of an earlier call with the same arguments.

    Yields
    ------
    Trajectory
        Samples and events since the last block.

    Raises
    ------
    InputError
        If a value breaks its rule; raised before the first block.
    """
    spare_mappings()
    integration = checked_integration(slider, programme, **options)
    times = sample_times(sampling, programme.duration)
    if resume is None:
        integration.checkpoint = first_checkpoint(integration.motion, programme, initial)
    else:
        integration.checkpoint = resume
        times.skip(resume.sampled)
    writer = _BlockWriter(integration, rows)
    report = progress or (lambda time, end: None)
    return _blocks(integration, times, writer, report)


def _blocks(
    integration: Integration, times: Any, writer: _BlockWriter, report: Callable
) -> Iterator[Trajectory]:
    last = len(integration.programme.segments) - 1
    for part in integration.segment_parts():
        writer.events += part.events
        over = part.termination is not None or (part.closes and part.checkpoint.segment == last)
        end = part.start + part.end
        steps = part.start + part.dense_output.begin
        while True:
            room = writer.room
            instants = times.take(end, room, steps, over)
            writer.write(part, instants)
            if len(instants) < room:
                break
            yield writer.block(None)
        writer.reached = part.checkpoint
        if over:
            yield writer.block(part)
        report(end, integration.programme.duration)


class _BlockWriter:
    """Collects samples until they fill a block."""

    def __init__(self, integration: Integration, rows: int) -> None:
        self._integration, self._rows = integration, rows
        motion = integration.motion
        self._scales = float(motion.slider.W0), float(motion.slider.K), float(motion.V)
        self.events: list[Event] = []
        self.reached = integration.checkpoint
        self._sampled = integration.checkpoint.sampled
        self._clear()

    def _clear(self) -> None:
        self._columns: list[list[np.ndarray]] = []
        self._count = 0

    @property
    def room(self) -> int:
        """Samples that the block can still take."""
        return self._rows - self._count

    def write(self, part: SegmentPart, times: np.ndarray) -> None:
        """Evaluate a segment part at `times` (s of the programme)."""
        none, over = len(part.dense_output.begin) == 0, part.termination
        # At a break point that takes the contact away there is no motion to evaluate.
        if len(times) == 0 or (none and over is not None and over.kind == "loss of contact"):
            return
        checkpoint, (W0, K, V) = part.checkpoint, self._scales
        t = np.clip(times - part.start, 0.0, part.end)
        # Where no step was accurate there is the state before it.
        Y = checkpoint.states[:, None] if none else part.dense_output.evaluate(t)
        now = motion_samples(part.system, t, Y)
        # Of a slider that runs away the velocity may leave the range of doubles.
        with np.errstate(over="ignore"):
            columns = [
                times,
                now.force * W0,
                now.load * W0,
                now.velocity * V,
                now.slip * V,
                Y[-1] * W0 / K,
                Y[:-1].T,
            ]
        self._columns.append(columns)
        self._count += len(t)
        # A block that ends within a segment part is resumed from its last sample.
        self.reached = Checkpoint(
            checkpoint.segment, float(t[-1]), Y[:, -1].copy(), ringless=checkpoint.ringless
        )
        self._sampled = float(times[-1])

    def block(self, last: SegmentPart | None) -> Trajectory:
        """Samples collected since the last block; empties the buffer."""
        integration = self._integration
        size = integration.motion.size
        none = [[np.empty(0)] * 6 + [np.empty((0, size))]]
        columns = [np.concatenate(c) for c in zip(*(self._columns or none), strict=True)]
        until = np.inf if last is not None else columns[0][-1]
        trajectory = Trajectory(
            *columns,
            events=tuple(e for e in self.events if e.time <= until),
            termination=None if last is None else last.termination,
            checkpoint=dataclasses.replace(self.reached, sampled=self._sampled),
            motion=integration.motion,
            provenance=provenance(integration),
        )
        self.events = [e for e in self.events if e.time > until]
        self._clear()
        return trajectory
