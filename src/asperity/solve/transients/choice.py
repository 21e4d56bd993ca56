"""Which method suits the equations where the march has come to."""

from __future__ import annotations

from types import ModuleType

from asperity.slider import Motion, RadiatingAsperities, ReversingInertial, StiffInertial
from asperity.solve.transients import explicit, implicit
from asperity.solve.transients.pieces import STEPS, Chunk

METHODS = ("auto", "explicit", "implicit")

#: Share of the steps of a chunk that must be stiff, or mild, for the method to be doubted.
_MOST = 0.6

#: What an implicit step costs in explicit ones.
_COST = 2.5


class Choice:
    """The explicit or the implicit method, by what the last steps have shown.

    Either method reports steps that the other might have taken more cheaply. An explicit method
    at its limit of stability gives way for a trial; what the trial gains in length must be worth
    its cost, or the next one waits for twice as long. Times of the clock play no part, so that
    the same question has the same answer.

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
        """The module whose `advance` is to take the next steps."""
        return implicit if self._implicit else explicit

    @property
    def name(self) -> str:
        """What results call the method."""
        return "implicit" if self._implicit else "explicit"

    def learn(self, chunk: Chunk) -> None:
        """Judge the method by the steps it has just taken."""
        # What ends early, at break points, shows little.
        if not self._free or int(chunk.taken) < STEPS:
            return
        doubtful = int(chunk.doubtful) > _MOST * STEPS
        length = float(chunk.length.mean())
        if not self._implicit:
            self._waited += 1
            if doubtful and self._waited >= self._wait:
                self._implicit, self._explicit_length = True, length
        elif self._explicit_length and length < _COST * self._explicit_length:
            self._implicit, self._waited = False, 0
            self._wait *= 2
        else:
            self._explicit_length = 0.0
            if doubtful:
                self._implicit, self._waited, self._wait = False, 0, 1
