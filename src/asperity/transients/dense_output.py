"""The solution between two instants, as polynomials in time, one a step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jax import Array
from jax.typing import ArrayLike

#: Steps of a call of a compiled program.
STEPS = 2048

#: Events are detected at the ends of this many equal parts of every step.
PARTS = 4

#: Status of a compiled program: more steps to take, or no accurate step.
GOING_ON, UNDERFLOW = 0, 1


class Interval(NamedTuple):
    """Where steps begin, and how far they go.

    Attributes
    ----------
    t, end : array
        Times of the segment (s).
    Y : array, shape (size + 1,)
        States at `t`.
    length : array
        Length of the first step to try (s); 0 for a guess.
    longest : array
        Length that no step may exceed (s).
    """

    t: ArrayLike
    Y: ArrayLike
    length: ArrayLike
    end: ArrayLike
    longest: ArrayLike


class StepChunk(NamedTuple):
    """Steps as a compiled program returns them.

    Attributes
    ----------
    begin, length : array, shape (STEPS,)
        Beginning of each accepted step and its length (s).
    coefficients : array, shape (STEPS, degree + 1, size)
        Coefficients of rising powers of (time - begin) / length.
    taken : int
        Number of accepted steps; rows beyond are not used.
    t, Y : array
        Time (s) and states at the end of the last of them.
    next_length : array
        Proposal for the next step (s).
    rejected : int
        Number of rejected steps.
    status : int
        GOING_ON, or UNDERFLOW where no step however short was accurate.
    doubtful : int
        Steps of the explicit method at its limit of stability, or of the implicit method that an
        explicit one could have made.
    """

    begin: Array
    length: Array
    coefficients: Array
    taken: Array
    t: Array
    Y: Array
    next_length: Array
    rejected: Array
    status: Array
    doubtful: Array


class DenseOutput(NamedTuple):
    """Accepted steps in order, as in `StepChunk` without its unused rows.

    Attributes
    ----------
    begin, length : array, shape (steps,)
    coefficients : array, shape (degree + 1, size, steps)
        Steps last, so that many instants are evaluated along memory.
    """

    begin: np.ndarray
    length: np.ndarray
    coefficients: np.ndarray

    @classmethod
    def of(cls, chunk: StepChunk) -> DenseOutput:
        """The steps of a chunk."""
        begin, length, coefficients = (np.asarray(a)[: int(chunk.taken)] for a in chunk[:3])
        return cls(begin, length, np.ascontiguousarray(np.moveaxis(coefficients, 0, -1)))

    @classmethod
    def joined(cls, parts: list[DenseOutput]) -> DenseOutput:
        """Parts in order as one."""
        return cls(*(np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True)))

    @property
    def end(self) -> float:
        """End of the last step (s)."""
        return float(self.begin[-1] + self.length[-1])

    @property
    def last_states(self) -> np.ndarray:
        """States at the end of the last step, shape (size,)."""
        return np.asarray(self.coefficients[..., -1].sum(0))

    def evaluate(self, t: np.ndarray) -> np.ndarray:
        """States at the times `t` within the steps, shape (size, n)."""
        i = np.clip(np.searchsorted(self.begin, t, side="right") - 1, 0, len(self.begin) - 1)
        # A step may be shorter than the spacing of the numbers `t`.
        share = np.clip((t - self.begin[i]) / self.length[i], 0.0, 1.0)
        value = self.coefficients[-1].take(i, axis=1)
        for coefficient in self.coefficients[-2::-1]:
            value = value * share + coefficient.take(i, axis=1)
        return value

    def refined(self) -> np.ndarray:
        """Times that divide every step in `PARTS`, with the end, shape (PARTS count + 1,)."""
        shares = np.arange(PARTS) / PARTS
        inner = (self.begin[:, None] + self.length[:, None] * shares).ravel()
        return np.append(inner, self.end)
