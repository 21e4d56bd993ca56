"""The record of a transient."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from asperity.parameters.display import Displayed, SummaryLine, count_text, number_line
from asperity.slider import Motion
from asperity.transients.events import Event
from asperity.transients.integration import Checkpoint
from asperity.transients.termination import Termination

if TYPE_CHECKING:
    import xarray

Float = NDArray[np.float64]


def row_bytes(law_states: int) -> int:
    """Bytes of one row of a trajectory, in memory and in a file, at most.

    Six channels, up to three mechanical states and those of the law, 8 bytes each.
    """
    return 8 * (6 + 3 + law_states)


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Displayed):
    """Motion of a slider under a programme, or a block of it.

    Attributes
    ----------
    time : array, shape (n,)
        Seconds. At a break point of the programme: after it.
    force : array, shape (n,)
        Spring force F (N).
    load : array, shape (n,)
        Normal load W (N).
    velocity : array, shape (n,)
        Velocity of the slider dx/dt (m/s).
    slip_velocity : array, shape (n,)
        Plastic velocity (m/s), which is `velocity` without elastic asperities.
    displacement : array, shape (n,)
        Displacement x of the slider (m) since just before the first step, integrated along with
        the states and not derived from the force.
    states : array, shape (n, size)
        States of the equation of motion, `motion.mechanical` and then those of the law.
    events : tuple of Event
        In the order of time.
    termination : Termination or None
        Why the trajectory ends before the programme; None where it does not.
    checkpoint : Checkpoint
        Its end, from which an integration can be resumed.
    motion : Motion
        Equation of motion, with the slider.
    provenance : dict
        Version, law, parameters with units, programme, equations and tolerances.
    """

    time: Float
    force: Float
    load: Float
    velocity: Float
    slip_velocity: Float
    displacement: Float
    states: Float
    events: tuple[Event, ...]
    termination: Termination | None
    checkpoint: Checkpoint
    motion: Motion
    provenance: dict[str, Any]

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Law, equation of motion, and what happens."""
        law = self.motion.slider.law.name
        title = f"Trajectory, {law}, {self.motion.name}, {count_text(len(self.time), 'row')}"
        lines = [
            number_line("time", self.time, "s"),
            number_line("load", self.load, "N"),
            number_line("force", self.force, "N"),
            number_line("velocity", self.velocity, "m/s"),
            SummaryLine("events", str(len(self.events))),
        ]
        return title, [*lines, *([SummaryLine("stopped", self.stopped)] if self.stopped else [])]

    @property
    def friction(self) -> Float:
        """F/W, spring force over instantaneous normal load."""
        return self.force / self.load

    @property
    def stopped(self) -> str | None:
        """Why the trajectory ends before the programme, in a sentence; None where it does not."""
        return None if self.termination is None else str(self.termination)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the columns of `states`."""
        return (*self.motion.mechanical, *self.motion.slider.law.state_names)

    def event_times(self, kind: str) -> Float:
        """Times (s) of the events of one kind."""
        return np.array([e.time for e in self.events if e.kind == kind])

    @classmethod
    def joined(cls, blocks: Sequence[Trajectory]) -> Trajectory:
        """One trajectory from blocks that follow each other."""
        columns = {
            name: np.concatenate([getattr(b, name) for b in blocks])
            for name in ("time", "force", "load", "velocity", "slip_velocity", "displacement")
        }
        return dataclasses.replace(
            blocks[-1],
            **columns,
            states=np.concatenate([b.states for b in blocks]),
            events=tuple(e for b in blocks for e in b.events),
        )

    def to_dataset(self) -> xarray.Dataset:
        """The trajectory as a labelled dataset over time, ready for NetCDF.

        Returns
        -------
        xarray.Dataset
            Every variable has `units` and `long_name`; attributes hold the provenance and why
            the trajectory stopped.
        """
        import xarray

        def channel(values: Float, units: str, name: str) -> tuple:
            return "time", values, {"units": units, "long_name": name}

        about = {"long_name": "state of the equation of motion", "units": "1"}
        data = {
            "force": channel(self.force, "N", "spring force"),
            "friction": channel(self.friction, "1", "spring force over normal load"),
            "load": channel(self.load, "N", "normal load"),
            "velocity": channel(self.velocity, "m/s", "velocity of the slider"),
            "slip_velocity": channel(self.slip_velocity, "m/s", "plastic velocity"),
            "displacement": channel(self.displacement, "m", "displacement of the slider"),
            "states": (("time", "state"), self.states, about),
            "event_time": (
                "event",
                np.array([e.time for e in self.events], float),
                {"units": "s", "long_name": "time of the event"},
            ),
            "event_kind": (
                "event",
                np.array([e.kind for e in self.events], dtype=str),
                {"units": "1", "long_name": "kind of the event"},
            ),
        }
        coords = {
            "time": ("time", self.time, {"units": "s", "long_name": "time"}),
            "state": ("state", list(self.state_names), {"long_name": "name of the state"}),
        }
        stopped = {"stopped": self.stopped or "end of the programme"}
        return xarray.Dataset(data, coords=coords, attrs={**self.provenance, **stopped})
