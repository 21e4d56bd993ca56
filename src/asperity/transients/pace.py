"""Whether steps of the present length reach the end of a segment, and what to do if not.

A slider on elastic asperities rings at sqrt(W0 / (lambda M)). In a hold the slip that damps the
ringing becomes slower and slower, so that a trace of it is left for ever, and steps that resolve it
never become longer. Where such steps are too many, the velocity of the slider is integrated with
the error that corresponds to the tolerated error of the force on the asperities,

    |dv| = sqrt(lambda W0 / M) |d(F_i/W)|,

the velocity with which the slider rings while F_i/W swings by its tolerated error. The implicit
method then takes steps longer than a period and damps the ringing that is left. All other states
keep their tolerances.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.slider import Inertial, Motion
from asperity.transients.dense_output import StepChunk
from asperity.transients.termination import Termination

#: Steps still to come above which it is tried to leave the ringing out: some ten seconds of work.
_MANY_STEPS = 1_000_000

#: How much longer steps have to become for that.
_GAIN = 50.0

#: StepChunks of steps in a row that must foretell too many steps before the integration gives up.
_HOPELESS_CHUNKS = 20


def ringing_velocity(motion: Motion) -> float:
    """Velocity (over V) at which the slider rings while F_i/W swings by 1; 0 without ringing."""
    if not isinstance(motion, Inertial):
        return 0.0
    return float(np.sqrt(motion.mobility / motion.strain))


@dataclass
class Pace:
    """Judges the steps of one segment by their number.

    Parameters
    ----------
    rings : bool
        Whether the equations have a ringing that can be left out.
    most_steps : float
        Steps that an integration may take.
    """

    rings: bool
    most_steps: float
    _tried: bool = False
    _hopeless: int = 0

    def enter(self) -> None:
        """Begin a segment, whose break point may make the slider ring anew."""
        self._tried, self._hopeless = False, 0

    def many(self, chunk: StepChunk, t: float, end: float) -> bool:
        """Whether steps such as those of a chunk that begins at `t` are too many to wait for."""
        return _steps_left(chunk, t, end) >= _MANY_STEPS

    def worth_trying(self, chunk: StepChunk, t: float, end: float) -> bool:
        """Whether to try steps without ringing instead of a chunk, once in a segment.

        Parameters
        ----------
        chunk : StepChunk
            Steps that resolve the ringing.
        t, end : float
            Where they begin, and the end of the segment (s).
        """
        if not self.rings or self._tried or not self.many(chunk, t, end):
            return False
        self._tried = True
        return True

    def gained(self, chunk: StepChunk, trial: StepChunk, t: float) -> bool:
        """Whether the steps of a trial that begins at `t`, as the chunk does, are longer enough."""
        return _length(trial, t) > _GAIN * _length(chunk, t)

    def out_of_reach(
        self, chunk: StepChunk, t: float, end: float, start: float, steps: int
    ) -> Termination | None:
        """The termination, if the end of the segment is too many steps away.

        Parameters
        ----------
        chunk : StepChunk
            The last steps, which begin at `t` (s).
        end, start : float
            End of the segment, and its beginning in the programme (s).
        steps : int
            Steps taken so far.
        """
        left = _steps_left(chunk, t, end)
        self._hopeless = self._hopeless + 1 if steps + left > self.most_steps else 0
        if left and (steps >= self.most_steps or self._hopeless >= _HOPELESS_CHUNKS):
            detail = f"its steps of {_length(chunk, t):.3g} s would take {left:.3g} more"
            return Termination("too many steps", start + float(chunk.t), detail)
        return None


def _length(chunk: StepChunk, t: float) -> float:
    """Mean length of the steps of a chunk that begins at `t` (s)."""
    return (float(chunk.t) - t) / max(int(chunk.taken), 1)


def _steps_left(chunk: StepChunk, t: float, end: float) -> float:
    """Steps of that length from the end of the chunk to `end`."""
    left = end - float(chunk.t)
    if left <= 0 or not chunk.taken:
        return 0.0
    length = _length(chunk, t)
    # Steps below the spacing of doubles do not move the time.
    return left / length if length > 0 else math.inf
