"""Orbits and bifurcations recorded while a branch is followed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asperity.branches.bifurcation import LocatedBifurcation, bifurcations_between, polished
from asperity.branches.branch import Bifurcation, Branch, BranchOrigin
from asperity.branches.operating_point import held_parameters
from asperity.branches.parameters import ContinuedParameter
from asperity.branches.steps import BranchFollower, BranchOrbit, follow_branch
from asperity.slider.problem import Problem

#: Mesh for a branch of simple period; bifurcations are solved again on three times as many.
INTERVALS = 216

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


class BranchRecorder:
    """Stations and bifurcations gathered along a branch."""

    def __init__(
        self,
        follower: BranchFollower,
        moving: ContinuedParameter,
        start: BranchOrbit,
        report: Callable[[int], None],
        periods: int = 1,
    ) -> None:
        """Begin at `start`."""
        self.follower, self.moving, self.report, self.periods = follower, moving, report, periods
        self.branch_orbits = [start]
        self.found: list[tuple[LocatedBifurcation, int]] = []

    def follow_branch(self, most_steps: int) -> str:
        """Walk until the branch leaves the span; returns a key of the results."""
        why = follow_branch(
            self.follower,
            self.branch_orbits[0],
            most_steps=most_steps,
            first_step=1e-3,
            ended=lambda branch_orbit: not 0 <= branch_orbit.t <= 1,
            visit=self.visit,
        )
        if why != "ended":
            return why
        return "end" if self.branch_orbits[-1].t >= 0.5 else "start"

    def visit(self, here: BranchOrbit, length: float, there: BranchOrbit) -> None:
        """Record a step of the branch, the last one cut at the end of the span."""
        if not 0 <= there.t <= 1:
            edge = 1.0 if there.t > 1 else 0.0
            there, length = self.follower.reaching(here, length, edge) or (there, length)
        at = len(self.branch_orbits) - 1
        self.found += [
            (found, at) for found in bifurcations_between(self.follower, here, length, there)
        ]
        self.branch_orbits.append(there)
        self.report(1)

    def branch(self, why: str, problem: Problem) -> Branch:
        """The recorder as the user reads it."""
        values = self.moving.value(np.array([s.t for s in self.branch_orbits]))
        unit = f" {self.moving.unit}" if self.moving.unit else ""
        steps = len(self.branch_orbits) - 1
        return Branch(
            name=self.moving.name,
            unit=self.moving.unit,
            parameter=values,
            mean_friction=np.array([s.mean_friction for s in self.branch_orbits]),
            harmonics=np.stack([s.harmonics for s in self.branch_orbits]),
            log_multipliers=np.stack([s.logs for s in self.branch_orbits]),
            periods=self.periods,
            bifurcations=tuple(self._bifurcation(found, at) for found, at in self.found),
            result=_RESULTS[why].format(value=values[-1], unit=unit, steps=steps),
            completed=why in ("end", "start"),
            motion=problem.system,
            fixed=held_parameters(problem, self.moving.name),
            origin=BranchOrigin(self.follower, self.moving, problem),
            last=self.branch_orbits[-1].point,
        )

    def _bifurcation(self, found: LocatedBifurcation, at: int) -> Bifurcation:
        intervals = found.branch_orbit.point.orbit.mesh.shape[0] - 1
        fine = polished(self.follower, found, 3 * intervals)
        branch_orbit = fine or found.branch_orbit
        value = float(self.moving.value(branch_orbit.t))
        coarse = float(self.moving.value(found.branch_orbit.t))
        omega = float(np.asarray(self.follower.line.at(np.array([branch_orbit.t])).system.omega)[0])
        angle = abs(np.angle(np.exp(1j * branch_orbit.logs[found.critical].imag)))
        fold = found.kind in ("fold", "branch point")
        return Bifurcation(
            kind=found.kind,
            value=value,
            error=abs(coarse - value) / abs(value) if fine else np.inf,
            mean_friction=branch_orbit.mean_friction,
            log_multipliers=branch_orbit.logs,
            frequency=0.0 if fold else angle / (2 * np.pi) * omega / (2 * np.pi),
            unstable_before=found.before,
            unstable_after=found.after,
            index=at,
            critical=branch_orbit,
        )
