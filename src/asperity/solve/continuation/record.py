"""What is gathered while a branch is walked along."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asperity.solve.continuation.bifurcation import Located, bifurcations_between, polished
from asperity.solve.continuation.branch import Bifurcation, Branch, Path
from asperity.solve.continuation.operating_point import held_parameters
from asperity.solve.continuation.parameters import Parameter
from asperity.solve.continuation.walk import Station, Walker, walk
from asperity.solve.kernels import Problem

#: Mesh for a branch of simple period; bifurcations are solved again on three times as many.
INTERVALS = 144

_RESULTS = {
    "end": "the branch reaches the end of the span, {value:.6g}{unit}",
    "start": "the branch returns to the start of the span, {value:.6g}{unit}",
    "steps": (
        "the branch was followed for {steps} steps, to {value:.6g}{unit}; "
        "allow more steps to follow it further"
    ),
    "stuck": (
        "the branch could not be followed beyond {value:.6g}{unit}, where "
        "no step along it is short enough for Newton's method"
    ),
}


class Record:
    """Stations and bifurcations gathered along a branch."""

    def __init__(
        self,
        walker: Walker,
        moving: Parameter,
        start: Station,
        told: Callable[[float], None],
        periods: int = 1,
    ) -> None:
        """Begin at `start`."""
        self.walker, self.moving, self.told, self.periods = walker, moving, told, periods
        self.stations = [start]
        self.found: list[tuple[Located, int]] = []

    def walk(self, most_steps: int) -> str:
        """Walk until the branch leaves the span; returns a key of the results."""
        why = walk(
            self.walker,
            self.stations[0],
            most_steps=most_steps,
            first_step=1e-3,
            ended=lambda station: not 0 <= station.t <= 1,
            met=self.met,
        )
        if why != "ended":
            return why
        return "end" if self.stations[-1].t >= 0.5 else "start"

    def met(self, here: Station, length: float, there: Station) -> None:
        """Keep a stretch of the branch, the last one cut at the end of the span."""
        if not 0 <= there.t <= 1:
            edge = 1.0 if there.t > 1 else 0.0
            there, length = self.walker.reaching(here, length, edge) or (there, length)
        at = len(self.stations) - 1
        self.found += [
            (found, at) for found in bifurcations_between(self.walker, here, length, there)
        ]
        self.stations.append(there)
        self.told(float(self.moving.value(there.t)))

    def branch(self, why: str, problem: Problem) -> Branch:
        """The record as the user reads it."""
        values = self.moving.value(np.array([s.t for s in self.stations]))
        unit = f" {self.moving.unit}" if self.moving.unit else ""
        steps = len(self.stations) - 1
        return Branch(
            name=self.moving.name,
            unit=self.moving.unit,
            parameter=values,
            mean_friction=np.array([s.mean_friction for s in self.stations]),
            harmonics=np.stack([s.harmonics for s in self.stations]),
            log_multipliers=np.stack([s.logs for s in self.stations]),
            periods=self.periods,
            bifurcations=tuple(self._bifurcation(found, at) for found, at in self.found),
            result=_RESULTS[why].format(value=values[-1], unit=unit, steps=steps),
            completed=why in ("end", "start"),
            motion=problem.system,
            fixed=held_parameters(problem, self.moving.name),
            path=Path(self.walker, self.moving, problem),
            last=self.stations[-1].point,
        )

    def _bifurcation(self, found: Located, at: int) -> Bifurcation:
        intervals = found.station.point.orbit.mesh.shape[0] - 1
        fine = polished(self.walker, found, 3 * intervals)
        station = fine or found.station
        value = float(self.moving.value(station.t))
        coarse = float(self.moving.value(found.station.t))
        omega = float(np.asarray(self.walker.line.at(np.array([station.t])).system.omega)[0])
        angle = abs(np.angle(np.exp(1j * station.logs[found.critical].imag)))
        fold = found.kind in ("fold", "branch point")
        return Bifurcation(
            kind=found.kind,
            value=value,
            error=abs(coarse - value) / abs(value) if fine else np.inf,
            mean_friction=station.mean_friction,
            log_multipliers=station.logs,
            frequency=0.0 if fold else angle / (2 * np.pi) * omega / (2 * np.pi),
            unstable_before=found.before,
            unstable_after=found.after,
            index=at,
            critical=station,
        )
