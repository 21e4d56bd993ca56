"""State of an unfinished run, saved with its finished blocks, from which it is resumed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np

from asperity.transients import Checkpoint


@dataclass
class RunProgress:
    """State of a run between two blocks.

    Attributes
    ----------
    lengths : dict of str to int
        Lengths of the growing dimensions in the file.
    time : float
        Time of the last row (s); NaN without one.
    checkpoint : Checkpoint or None
        Where the integration goes on.
    steady_segment : int
        Segment of the last event "steady", -1 without one.
    steps, rejected : int
        Steps of the integrator so far.
    unresolved_ringing : float
        Velocity (m/s) below which ringing has been left out; see `asperity.transient`.
    methods : list of str
        Methods of integration that have been used.
    stopped : str
        Why the motion ended before the programme; empty where it did not.
    finished : bool
        Whether nothing follows.
    """

    lengths: dict[str, int] = field(default_factory=dict)
    time: float = float("nan")
    checkpoint: Checkpoint | None = None
    steady_segment: int = -1
    steps: int = 0
    rejected: int = 0
    unresolved_ringing: float = 0.0
    methods: list[str] = field(default_factory=list)
    stopped: str = ""
    finished: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return JSON values; doubles are read back as they are."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        if self.checkpoint is not None:
            state = {f.name: getattr(self.checkpoint, f.name) for f in fields(self.checkpoint)}
            values["checkpoint"] = {
                n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in state.items()
            }
        return values

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Self:
        """Read what `to_json` has written.

        Raises
        ------
        TypeError, ValueError
            If the values are no progress.
        """
        progress = cls(**values)
        if progress.checkpoint is not None:
            state = dict(values["checkpoint"])
            progress.checkpoint = Checkpoint(**{**state, "states": np.array(state["states"])})
        return progress
