"""Periodic responses, with their stability."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from asperity.laws import get_law
from asperity.operating_point import motions, respond, without_contact, without_mass
from asperity.orbit import PeriodicResponse
from asperity.orbit.outcome import Outcome
from asperity.parameters import OUTPUTS
from asperity.sweep.plan.axis import columns_of
from asperity.sweep.plan.points import Points
from asperity.sweep.solve.kind import Findings, Index, SolveKind, laws_of
from asperity.sweep.solve.outcome import SweepOutcome

#: Outputs with one number a point.
_NAMES = (
    *("mean_friction", "delta_mu", "mu_ss", "mu1", "mu2", "phase1", "phase2"),
    *("log_multiplier", "floquet_max", "mode_frequency", "growth_rate", "stable"),
)

#: Points of a chunk: at least a call of the fast method, at most half a second.
_FEWEST, _MOST = 960, 19_200
#: Points that series may take in the first stage: some seconds.
_FEW = 1200
#: Chunks that a small plan is cut into, so that several workers have something to do.
_SHARES = 8
#: Times that a point takes longer where the mass counts.
_INERTIAL = 16


class PeriodicSolve(SolveKind):
    """`asperity.periodic_response` at every point: the fast method first, all methods then.

    Series belong to the first stage where it leaves few points: what follows has fixed costs, which
    the points of a whole chunk share better than those of many batches.
    """

    name = "periodic"
    outputs = tuple(OUTPUTS[name] for name in _NAMES)
    defaults = (
        *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"),
        *("log_multiplier", "mode_frequency", "stable"),
    )
    #: Methods of the two stages, and of the first one for what the fast method leaves.
    quick: ClassVar[tuple[str, ...]] = ("fourier",)
    smooth: ClassVar[tuple[str, ...]] = ("series",)
    thorough: ClassVar[tuple[str, ...]] = ("series", "collocation")

    def chunk_points(self, points: int, record: Mapping[str, Any]) -> int:
        """As in `SolveKind`."""
        inertial = record["numbers"].get("inertia", 0) or any(
            "inertia" in columns_of(axis) for axis in record["axes"].values()
        )
        most = _MOST // _INERTIAL if inertial else _MOST
        return max(min(_FEWEST, most), min(most, points // _SHARES))

    def first(self, points: Points, record: Mapping[str, Any]) -> Findings:
        """As in `SolveKind`."""
        found = _solve(points, record["outputs"], {"methods": self.quick}, leave=True)
        left = found.left
        most = _FEW // _INERTIAL if np.any(points.values.get("inertia", np.zeros(1)) > 0) else _FEW
        if 0 < len(left) <= most:
            options = {"methods": self.smooth}
            found.put(left, _solve(points.take(left), record["outputs"], options, leave=True))
        return found

    def second(self, points: Points, record: Mapping[str, Any]) -> Findings:
        """As in `SolveKind`."""
        return _solve(points, record["outputs"], {"methods": self.thorough}, leave=False)


def _solve(points: Points, outputs: list[str], options: dict[str, Any], *, leave: bool) -> Findings:
    """Responses, each group with one equation of motion on its own.

    Points that these methods do not solve are left NOT_COMPUTED where `leave`.
    """
    found = Findings.empty(outputs, len(points))
    for law, rows in laws_of(points):
        values = points.take(rows).of_law(law)
        sound = solvable(law, values, rows, found)
        values = {n: v[sound] for n, v in values.items()}
        for group in motions(values) if len(sound) else []:
            some = {n: v[group] for n, v in values.items()}
            response = respond(get_law(law), some, workers=1, **options)
            part = findings_of(response, outputs)
            if leave:
                # Points out of range are not searched for: that is their answer.
                unsolved = ~np.isin(part.outcome, (Outcome.CONVERGED, Outcome.OUT_OF_RANGE))
                part.fail(np.flatnonzero(unsolved), SweepOutcome.NOT_COMPUTED)
            found.put(rows[sound[group]], part)
    return found


def solvable(law: str, values: dict[str, np.ndarray], rows: Index, found: Findings) -> Index:
    """Which of the points `rows` can be solved; the others get their outcome in `found`."""
    from asperity.parameters import RULES, point_parameters

    wrong = without_mass(values)
    for name, parameter in point_parameters(get_law(law)).items():
        with np.errstate(invalid="ignore"):
            holds = RULES[parameter.rule].holds(values[name])
        wrong = wrong | ~(np.isfinite(values[name]) & holds)
    if not get_law(law).rate_dependent:
        wrong = wrong | (values["inertia"] > 0) | (values["eta"] > 0)
    found.fail(rows[wrong], Outcome.INVALID)
    sound = np.flatnonzero(~wrong)
    reasons = without_contact({n: v[sound] for n, v in values.items()}) if len(sound) else []
    lost = np.array([bool(reason) for reason in reasons], dtype=bool)
    found.fail(rows[sound[lost]], SweepOutcome.CONTACT_LOST)
    return sound[~lost]


def findings_of(response: PeriodicResponse, outputs: list[str]) -> Findings:
    """What is kept of a response."""
    converged = response.converged
    numbers = {}
    for name in outputs:
        if name == "log_multiplier":
            logs = response.log_multipliers
            value = logs[..., 0].real if logs.shape[-1] else np.full(len(logs), -np.inf)
        else:
            value = np.asarray(getattr(response, name), dtype=float)
        numbers[name] = np.where(converged, value, np.nan)
    detail = np.where(converged, 0.0, response.detail)
    return Findings(numbers, response.outcome.astype(np.int16), detail)
