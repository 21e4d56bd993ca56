"""Stiffness-based choice of the method."""

from __future__ import annotations

from types import ModuleType

from asperity.slider import Motion, RadiatingAsperities, ReversingInertial, StiffInertial
from asperity.transients import explicit, implicit
from asperity.transients.dense_output import STEPS, StepChunk

METHODS = ("auto", "explicit", "implicit")

#: Names of the methods in results.
NAMES = {explicit: "explicit", implicit: "implicit"}

#: Share of the steps of a chunk that must be doubtful before the other method is tried.
_MOST = 0.6

#: Cost of an implicit step in explicit ones.
_COST = 2.5


class MethodChoice:
    """The explicit or the implicit method, chosen by the last steps.

    Either method reports steps that the other might have taken more cheaply. When the explicit
    method is at its limit of stability, the implicit one is tried; unless its steps are longer by
    more than the ratio of the costs, the next trial waits for twice as long. Measured times play
    no part, so that the same input gives the same result.

    Parameters
    ----------
    motion : Motion
    method : str
        One of `METHODS`.
    """

    def __init__(self, motion: Motion, method: str) -> None:
        stiff = isinstance(motion, StiffInertial | ReversingInertial | RadiatingAsperities)
        self._free = method == "auto"
        self._implicit = stiff if self._free else method == "implicit"
        self._explicit_length = 0.0  # mean step before a trial; 0 where none is under way
        self._wait, self._waited = 1, 0

    @property
    def method(self) -> ModuleType:
        """The module whose `advance` takes the next steps."""
        return implicit if self._implicit else explicit

    def learn(self, chunk: StepChunk, many: bool) -> None:
        """Judge the method by the chunk of steps it has just taken.

        Parameters
        ----------
        chunk : StepChunk
        many : bool
            Whether the end is so many of these steps away that the explicit method is doubted in
            any case: near a steady state its limit of stability cannot be seen in the steps.
        """
        # A chunk that ends early, at a break point, has too few steps to judge.
        if not self._free or int(chunk.taken) < STEPS:
            return
        doubtful = int(chunk.doubtful) > _MOST * STEPS
        length = float(chunk.length.mean())
        if not self._implicit:
            self._waited += 1
            if (doubtful or many) and self._waited >= self._wait:
                self._implicit, self._explicit_length = True, length
        elif self._explicit_length and length < _COST * self._explicit_length:
            self._implicit, self._waited = False, 0
            self._wait *= 2
        else:
            self._explicit_length = 0.0
            if doubtful:
                self._implicit, self._waited, self._wait = False, 0, 1
