"""The record of a transient: times at which it is sampled, values, provenance."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from asperity.arrays import Float
from asperity.errors import InputError, require
from asperity.laws import LinkerDieterich, RiceRuina
from asperity.loads.programme.programme import BREAK
from asperity.parameters.arguments import number, typed
from asperity.parameters.parameter import Drawn, SummaryLine, count_text, number_line
from asperity.slider import Motion
from asperity.slider.parameters import equation_values, equations_as_text
from asperity.transients.events import Event, Termination
from asperity.transients.integration import Checkpoint, Integration
from asperity.units import to_si

if TYPE_CHECKING:
    import xarray


#: Rows that doubles can count.
_MOST_ROWS = 2.0**53


class SampleTimes:
    """Sampling times in rising order, consumed part by part.

    Parameters
    ----------
    rate : float, optional
        Multiples of 1/rate (s), the first at t = 0.
    times : array, optional
        Times (s) that the user chose. Without both, the steps of the integrator, which are short
        where the motion is fast.
    """

    def __init__(self, rate: float | None = None, times: Float | None = None) -> None:
        self._rate, self._times = rate or 0.0, times
        self._next, self._after = 0, -np.inf

    def take(self, end: float, most: int, steps: np.ndarray, closing: bool) -> np.ndarray:
        """The next times (s) before `end`, no more than `most`.

        Parameters
        ----------
        end : float
            Seconds of the programme.
        most : int
        steps : ndarray
            Beginnings of the integrator's steps up to `end`.
        closing : bool
            Whether the trajectory ends there; then `end` itself is included.
        """
        if not self._rate and self._times is None:
            times = np.append(steps, end) if closing else steps
            times = times[(times > self._after) & (times <= end)][:most]
            self._after = float(times[-1]) if times.size else self._after
            return times
        index = np.arange(self._next, min(self._count(end, closing), self._next + most))
        self._next += len(index)
        return index / self._rate if self._times is None else self._times[index]

    def skip(self, t: float) -> None:
        """Skip the times up to `t`, inclusive."""
        self._after = t
        if t >= 0:
            self._next = self._count(t, True)

    def _count(self, end: float, closing: bool) -> int:
        """Number of times before `end`; `end` itself is counted if the trajectory closes there."""
        # A time that coincides with a break point belongs to the segment after it.
        limit = end * (1 + BREAK if closing else 1 - BREAK)
        if self._times is not None:
            return int(np.searchsorted(self._times, limit, side="right" if closing else "left"))
        count = limit * self._rate
        return int(np.floor(count)) + 1 if closing else int(np.ceil(count))


def planned_rows(sampling: Any, duration: float) -> float | None:
    """Number of rows with this `sampling`; None for the steps of the integrator.

    Parameters
    ----------
    sampling, duration
        As for `sample_times`.
    """
    if sampling is None:
        return None
    if isinstance(sampling, str) or np.ndim(sampling) == 0:
        return to_si(sampling, "frequency", "sampling") * duration + 1
    return float(np.size(sampling))


def sample_times(sampling: Any, duration: float) -> SampleTimes:
    """Sampling times by the argument `sampling`.

    Parameters
    ----------
    sampling : None, float, str or array
        None for the integrator's steps, a rate (Hz) or rising times (s).
    duration : float
        Duration of the programme (s).

    Raises
    ------
    InputError
        If the rate is not positive, or the times do not rise or lie outside the programme.
    """
    if sampling is None:
        return SampleTimes()
    if isinstance(sampling, str) or np.ndim(sampling) == 0:
        rate = number(sampling, "sampling", "frequency", "positive")
        rule, got = f"give at most {_MOST_ROWS:g} rows", f"{rate:g} Hz for {duration:g} s"
        advice = "lower the rate or shorten the programme"
        require(rate * duration <= _MOST_ROWS, "sampling", rule, got, advice)
        return SampleTimes(rate=rate)
    times = np.asarray(to_si(sampling, "time", "sampling"), float)
    rising = times.ndim == 1 and bool(np.all(np.diff(times) >= 0))
    got = "an array that falls or has more than one axis"
    require(rising, "sampling", "be times in rising order", got, "sort them")
    if times.size and (times[0] < 0 or times[-1] > duration * (1 + BREAK)):
        rule = f"lie within the programme, 0 to {duration:g} s"
        got = f"{times[0]:g} to {times[-1]:g} s"
        raise InputError("sampling", rule, got, "leave the times outside out")
    return SampleTimes(times=times)


def provenance(integration: Integration) -> dict[str, Any]:
    """Version, law, parameters with units, programme, equations, tolerances and effort."""
    motion = integration.motion
    return {
        **equations_as_text(motion, equation_values(motion)),
        "programme": repr(integration.programme),
        "method": " and ".join(sorted(integration.methods)),
        "relative_tolerance": integration.tolerances.rtol,
        "absolute_tolerance": integration.tolerances.atol,
        "slip_velocity": integration.thresholds.slip,
        "unresolved_ringing": integration.unresolved,
        "steps": integration.steps,
        "rejected_steps": integration.rejected,
    }


def row_bytes(law_states: int) -> int:
    """Bytes of one row of a trajectory, in memory and in a file, at most.

    Seven channels, up to three mechanical states and those of the law, 8 bytes each.
    """
    return 8 * (7 + 3 + law_states)


_age = jax.jit(lambda law, state, w: law.age(state, w))


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Drawn):
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
        Reason why the trajectory ends before the programme; None if it does not.
    checkpoint : Checkpoint
        Its end, from which an integration can be resumed.
    motion : Motion
        Equation of motion, with the slider.
    provenance : dict
        Version, law, parameters with units, programme, equations and tolerances.
    """

    _drawn_by = "asperity.figures.trajectory:draw_trajectory"

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
    def age(self) -> Float | None:
        """Age Phi of the contacts (s), theta in geophysics; None for a law without such a state."""
        law = self.motion.slider.law
        ages = (RiceRuina.state_names, LinkerDieterich.state_names)
        if not isinstance(law, RiceRuina) or law.state_names[:1] not in ages:
            return None
        first = len(self.motion.mechanical)
        w = self.load / float(self.motion.slider.W0)
        return np.asarray(_age(law, tuple(self.states[:, first:].T), w))

    @property
    def stopped(self) -> str | None:
        """Reason why the trajectory ends before the programme; None if it does not."""
        return None if self.termination is None else str(self.termination)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the columns of `states`."""
        return (*self.motion.mechanical, *self.motion.slider.law.state_names)

    @typed
    def event_times(self, kind: str) -> Float:
        """Times (s) of the events of one kind."""
        return np.array([e.time for e in self.events if e.kind == kind])

    @classmethod
    @typed
    def joined(cls, blocks: Sequence[Trajectory]) -> Trajectory:
        """One trajectory from blocks that follow each other."""
        forces, motion = ("force", "load"), ("velocity", "slip_velocity", "displacement", "states")
        columns = {
            name: np.concatenate([getattr(b, name) for b in blocks])
            for name in ("time", *forces, *motion)
        }
        events = tuple(e for b in blocks for e in b.events)
        return dataclasses.replace(blocks[-1], **columns, events=events)

    def to_dataset(self) -> xarray.Dataset:
        """The trajectory as a labelled dataset over time, ready for NetCDF.

        Returns
        -------
        xarray.Dataset
            Every variable has `units` and `long_name`; attributes hold the provenance and why
            the trajectory stopped.
        """
        import xarray

        def channel(values: Float, units: str, name: str, role: str = "") -> tuple:
            # The motion as a recording, as an instrument would record it.
            recorded = {"recording_role": role} if role else {}
            return "time", values, {"units": units, "long_name": name, **recorded}

        about = {"long_name": "state of the equation of motion", "units": "1"}
        times, kinds = [e.time for e in self.events], [e.kind for e in self.events]
        far = self.displacement + self.force / float(self.motion.slider.K)
        end = "displacement of the far end of the spring"
        event = {"long_name": "instant and kind of what happens"}
        age = self.age
        aged = {} if age is None else {"age": channel(age, "s", "age of the contacts")}
        data = {
            **aged,
            "force": channel(self.force, "N", "spring force", "F"),
            "friction": channel(self.friction, "1", "spring force over normal load"),
            "load": channel(self.load, "N", "normal load", "W"),
            "velocity": channel(self.velocity, "m/s", "velocity of the slider"),
            "slip_velocity": channel(self.slip_velocity, "m/s", "plastic velocity"),
            "displacement": channel(self.displacement, "m", "displacement of the slider"),
            "load_point_displacement": channel(far, "m", end, "displacement"),
            "states": (("time", "state"), self.states, about),
            "event_time": ("event", np.array(times, float), event | {"units": "s"}),
            "event_kind": ("event", np.array(kinds, dtype=str), event | {"units": "1"}),
        }
        coords = {
            "time": channel(self.time, "s", "time", "time"),
            "state": ("state", list(self.state_names), {"long_name": "name of the state"}),
        }
        stopped = {"stopped": self.stopped or "end of the programme"}
        return xarray.Dataset(data, coords=coords, attrs={**self.provenance, **stopped})
