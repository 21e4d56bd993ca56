"""Programmes of load and drive: the steps of an experiment in order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax.typing import ArrayLike

from asperity.errors import require
from asperity.loads.programme.segment import ProgrammeSegment, load_of, pull_of
from asperity.loads.programme.steps import LoadAndVelocity, ProgrammeStep
from asperity.parameters.arguments import number, typed
from asperity.parameters.rules import obeying

#: Relative distance to a break point within which a time counts as the break point itself: sums of
#: durations and multiples of a sampling interval are not the same doubles.
BREAK = 1e-12


@dataclass(frozen=True, eq=False, init=False)
class Programme:
    """Steps that follow steady sliding under a load and at a velocity.

    Between its break points the programme is smooth; at them load and velocity may jump, and
    every integration stops and starts anew.

    Attributes
    ----------
    steps : tuple of ProgrammeStep
    level : LoadAndVelocity
        Load (N) and pulling velocity (m/s) before the first step.
    segments : tuple of ProgrammeSegment
        The steps as segments in time.
    starts : ndarray, shape (segments + 1,)
        Break points (s): beginning of every segment, and the end.
    last : LoadAndVelocity
        Load and velocity after the last step.
    """

    steps: tuple[ProgrammeStep, ...]
    level: LoadAndVelocity
    segments: tuple[ProgrammeSegment, ...]
    starts: np.ndarray
    last: LoadAndVelocity

    @typed
    def __init__(
        self,
        *steps: ProgrammeStep,
        load: float | str,
        velocity: float | str,
        name: str = "programme",
    ) -> None:
        """Convert steps to segments.

        Parameters
        ----------
        *steps : ProgrammeStep
            `Hold`, `Slide`, `StepLoad`, ... from `asperity.loads`.
        load : float or str
            Normal load (N) before the first step, positive.
        velocity : float or str
            Pulling velocity (m/s) before the first step; 0 for a slider at rest, which needs
            its initial states given.
        name : str
            Name of the programme in messages.

        Raises
        ------
        InputError
            If a value breaks its rule or the steps take no time.
        """
        level = LoadAndVelocity(
            number(load, f"{name}.load", "force", "positive"),
            number(velocity, f"{name}.velocity", "velocity"),
        )
        segments: list[ProgrammeSegment] = []
        reached = level
        for i, step in enumerate(steps):
            new, reached = step.lay_out(reached, f"{name}.steps[{i}]")
            segments.extend(new)
        got = "none with a duration" if steps else "none"
        advice = "add one, such as 10 s of sliding"
        require(segments, f"{name}.steps", "take time", got, advice)
        durations = [float(s.duration) for s in segments]
        # Frozen: attributes are set once, here.
        object.__setattr__(self, "steps", steps)
        object.__setattr__(self, "level", level)
        object.__setattr__(self, "segments", tuple(segments))
        object.__setattr__(self, "starts", np.concatenate([[0.0], np.cumsum(durations)]))
        object.__setattr__(self, "last", reached)

    def __repr__(self) -> str:
        steps = "".join(f"{step}, " for step in self.steps)
        return f"Programme({steps}load={self.level.load!r}, velocity={self.level.velocity!r})"

    @property
    def duration(self) -> float:
        """Length of the programme (s)."""
        return float(self.starts[-1])

    @property
    def fastest_pull(self) -> float:
        """Largest size of the pulling velocity (m/s), before the first step included."""
        return max(abs(self.level.velocity), *(s.fastest_pull for s in self.segments))

    def load(self, t: ArrayLike) -> np.ndarray:
        """W (N) at times `t` (s) of the programme; at a break point that after it."""
        return self._evaluate(t, load_of)

    def velocity(self, t: ArrayLike) -> np.ndarray:
        """Pulling velocity (m/s) at times `t` (s) of the programme; at a break point after it."""
        return self._evaluate(t, pull_of)

    def position(self, t: ArrayLike) -> np.ndarray:
        """Displacement of the far end of the spring since t = 0 (m) at times `t` (s)."""
        ways = [float(_position(s, s.duration)) for s in self.segments]
        return self._evaluate(t, _position, np.concatenate([[0.0], np.cumsum(ways)]))

    def _evaluate(
        self,
        t: ArrayLike,
        read: Callable[[ProgrammeSegment, Any], Any],
        before: np.ndarray | None = None,
    ) -> np.ndarray:
        times = np.asarray(obeying(t, "t", "time", "finite"))
        outside = times[(times < 0) | (times > self.duration * (1 + BREAK))]
        rule, advice = f"lie within the programme, 0 to {self.duration:g} s", "leave it out"
        require(not outside.size, "t", rule, f"{next(outside.flat, 0):g} s", advice)
        values = np.empty(times.shape)
        index = np.searchsorted(self.starts[1:-1] * (1 - BREAK), times, side="right")
        for k, segment in enumerate(self.segments):
            inside = index == k
            if inside.any():
                x = np.maximum(times[inside] - self.starts[k], 0.0)
                # Padded to a power of two: few programs for any number of times.
                padding = (0, (1 << int(x.size - 1).bit_length()) - x.size)
                part = np.asarray(read(segment, np.pad(x, padding, mode="edge")))[: x.size]
                values[inside] = part if before is None else before[k] + part
        return values


_position = jax.jit(lambda segment, t: segment.position(t))
