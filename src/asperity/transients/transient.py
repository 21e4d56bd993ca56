"""The motion of a slider under a programme of load and drive.

A transient may come in blocks, so that memory does not grow with its length.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

import numpy as np

from asperity._jax import spare_mappings
from asperity.loads import Programme
from asperity.outputs import require_memory
from asperity.parameters.arguments import at_least, typed
from asperity.slider import Slider
from asperity.transients.equations import motion_samples
from asperity.transients.events import Event
from asperity.transients.inputs import MOST_STEPS, checked_integration, first_checkpoint
from asperity.transients.integration import Checkpoint, Integration, SegmentPart
from asperity.transients.trajectory import (
    SampleTimes,
    Trajectory,
    planned_rows,
    provenance,
    row_bytes,
    sample_times,
)

#: Rows of a block: some ten megabytes.
ROWS = 100_000


@typed
def integrate_blocks(
    slider: Slider,
    programme: Programme,
    *,
    rows: Annotated[int, at_least(1)] = ROWS,
    initial: Any = "steady",
    sampling: Any = None,
    resume: Checkpoint | None = None,
    progress: Callable[[float, float], None] | None = None,
    **options: Any,
) -> Iterator[Trajectory]:
    """Motion of a slider under a programme, block by block.

    After an interruption, by Ctrl-C or otherwise, the blocks already yielded stay valid, and
    `resume` continues from the `checkpoint` of the last block.

    Parameters
    ----------
    slider, programme, initial, sampling, progress, **options
        As in `transient`.
    rows : int
        Largest number of samples in a block.
    resume : Checkpoint, optional
        Checkpoint of the last block of an earlier call with the same arguments.

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
    return _blocks(integration, times, rows, progress)


def _blocks(
    integration: Integration, times: SampleTimes, rows: int, progress: Callable | None
) -> Iterator[Trajectory]:
    writer = _BlockWriter(integration, rows)
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
        if progress is not None:
            progress(end, integration.programme.duration)


class _BlockWriter:
    """Collects samples until they fill a block."""

    def __init__(self, integration: Integration, rows: int) -> None:
        self._integration, self._rows, self.room = integration, rows, rows
        motion = integration.motion
        self._scales = float(motion.slider.W0), float(motion.slider.K), float(motion.V)
        self.events: list[Event] = []
        self.reached = integration.checkpoint
        self._sampled = integration.checkpoint.sampled
        # Before the first sample, no row of each column.
        self._none = [np.empty(0)] * 6 + [np.empty((0, motion.size))]
        self._columns = [self._none]

    def write(self, part: SegmentPart, times: np.ndarray) -> None:
        """Evaluate a segment part at `times` (s of the programme)."""
        none, over = len(part.dense_output.begin) == 0, part.termination
        # At a break point with a loss of contact there is no motion.
        if len(times) == 0 or (none and over is not None and over.kind == "loss of contact"):
            return
        checkpoint, (W0, K, V) = part.checkpoint, self._scales
        t = np.clip(times - part.start, 0.0, part.end)
        # Without an accurate step the state before the step is evaluated.
        Y = checkpoint.states[:, None] if none else part.dense_output.evaluate(t)
        now = motion_samples(part.system, t, Y)
        # The velocity of a slider that runs away may overflow.
        with np.errstate(over="ignore"):
            speeds = now.velocity * V, now.slip * V
        forces, place = (now.force * W0, now.load * W0), Y[-1] * W0 / K
        self._columns.append([times, *forces, *speeds, place, Y[:-1].T])
        self.room -= len(t)
        # A block that ends within a segment part is resumed from its last sample.
        self._sampled = float(times[-1])
        later = any(e.kind == "steady" and e.time > self._sampled for e in part.events)
        self.reached = dataclasses.replace(
            checkpoint, t=float(t[-1]), states=Y[:, -1].copy(), length=0.0,
            steady=checkpoint.steady and not later,
        )  # fmt: skip

    def block(self, last: SegmentPart | None) -> Trajectory:
        """Samples collected since the last block; empties the buffer."""
        integration = self._integration
        columns = [np.concatenate(c) for c in zip(*self._columns, strict=True)]
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
        self._columns, self.room = [self._none], self._rows
        return trajectory


@typed
def transient(
    slider: Slider,
    programme: Programme,
    *,
    initial: Any = "steady",
    sampling: Any = None,
    inertia: bool = False,
    radiation_damping: float | str | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    slip_velocity: float | str | None = None,
    runaway_velocity: float | str | None = None,
    steady_tolerance: float = 1e-4,
    method: Literal["auto", "explicit", "implicit"] = "auto",
    most_steps: float = MOST_STEPS,
    progress: Callable[[float, float], None] | None = None,
) -> Trajectory:
    """Integrate the equation of motion in time.

    Parameters
    ----------
    slider : Slider
        With one number for each parameter.
    programme : Programme
        Steps of load and drive, from `asperity.loads`.
    initial : "steady" or array, shape (size,)
        Steady sliding under the load and velocity before the first step, or states of the
        equation of motion at t = 0, such as the last row of another trajectory's `states`. A step
        of the load with which the programme begins changes the former, not the latter.
    sampling : float, str or array, optional
        Rate (Hz) or times (s) at which to write; by default the steps of the integrator, which
        are short where the states change fast. The solution is a polynomial on every step: a
        higher rate takes little time and does not change the solution.
    inertia : bool
        Whether the mass of the slider counts.
    radiation_damping : float or str, optional
        eta (N s/m), positive.
    rtol, atol : float
        Tolerated error of a step: relative for velocities and forces, absolute for the states
        that are logarithms; `atol` is of F/W0, v/V and F_i/W, a hundredth of `rtol` by
        default. V is the velocity before the first step.
    slip_velocity : float or str, optional
        Velocity (m/s) above which the slider slips; by default 30 times the fastest drive.
    runaway_velocity : float or str, optional
        Velocity (m/s) to which a slider without inertia can only run away; by default 1 m/s, or
        1000 times the fastest drive if that is more.
    steady_tolerance : float
        Deviation from steady sliding, or from a response that repeats itself with the modulation,
        below which it counts as reached.
    method : {"auto", "explicit", "implicit"}
        "auto" takes the method that suits the equations, and changes to the other where they
        become stiff or are no longer stiff.
    most_steps : float
        Largest number of steps. The integration stops as soon as its steps are foreseeably too
        short to reach the end with this number.
    progress : callable, optional
        Called now and then with the time reached and the end of the programme (s).

    Returns
    -------
    Trajectory
        Up to the end of the programme, or to an earlier end with its reason in `stopped`: contact
        lost, runaway without inertia, reversal of slip for a law that does not have it, too many
        steps.

    Raises
    ------
    InputError
        If a value breaks its rule.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.5 N/um", load=pmma.W0)
    >>> steps = asp.loads.Hold("10 s"), asp.loads.Slide("2 s", velocity="10 um/s")
    >>> programme = asp.loads.Programme(*steps, load=pmma.W0, velocity="1 um/s")
    >>> asp.transient(slider, programme).plot()

    Notes
    -----
    Bureau et al. (2000), Eqs. (1), (2), (6), (8) and (26)-(29), in the states that the
    equations of motion use: a step of the load leaves them continuous and is exact.

    With inertia and elastic asperities the slider rings at sqrt(W0 / (lambda M)), and in a long
    hold the ringing never ends. Where steps that resolve it would need more than a million to the
    end of a segment, ringing below the velocity sqrt(lambda W0 / M) times the tolerated error of
    F_i/W is left out; `provenance` gives this velocity as ``unresolved_ringing`` (m/s), 0 where all
    ringing is resolved.
    """
    arguments = dict(locals())
    rows = planned_rows(sampling, programme.duration)
    if rows is not None:
        # The factor 2: the blocks, and the joined trajectory.
        size = 2 * rows * row_bytes(len(slider.law.state_names))
        require_memory(
            size, "sampling", f"{rows:.6g} rows",
            "lower the rate, shorten the programme, or take it block by block with "
            "asperity.transients.integrate_blocks or asperity run",
        )  # fmt: skip
    return Trajectory.joined(list(integrate_blocks(**arguments)))
