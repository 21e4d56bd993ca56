"""Pseudo-arclength continuation of the periodic response in any one parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any

import numpy as np
from jax.typing import ArrayLike
from numpy.typing import NDArray

from asperity.algebra.predictor_corrector import STEPS, Attempt, Curves, StepControl, follow
from asperity.arrays import Float, Index
from asperity.branches.bifurcations import LocatedBifurcation, bifurcations_between, criterion
from asperity.branches.branch import Bifurcation, Branch, BranchOrigin
from asperity.branches.follower import BranchFollower, BranchOrbit
from asperity.branches.parameters import (
    ContinuedParameter,
    fixed_parameters,
    line_through,
    moving_parameter,
    one_problem,
)
from asperity.errors import InputError, listed
from asperity.loads import Modulation
from asperity.parameters.arguments import at_least, counted, typed
from asperity.slider import Slider

#: First step, and longest step, as shares of the span.
_FIRST, _LARGEST_PART = 1e-3, 0.04


class ParameterBranch(Curves):
    """A branch along a line of parameters, followed until it leaves the span.

    Parameters
    ----------
    follower : BranchFollower
    start : BranchOrbit
    most_steps : int
    report : callable, optional
        Called with 1 after each step.

    Attributes
    ----------
    orbits : list of BranchOrbit
    bifurcations : list of (LocatedBifurcation, int)
        Those within the span, each with the index of the orbit before it.
    missed : list of float
        Values of t after which stability changes at a bifurcation that is not located.
    last_length : float
        Length of the last step.
    """

    control = StepControl(
        shortest=1e-7,
        longest=0.25,  # in units of the exponent of the slip rate and of the whole span together
        growth=1.5,
        easy=4,
        hard=6,
        sharpest_turn=0.7,
        farthest=np.inf,
        most_failures=20,
    )

    def __init__(
        self,
        follower: BranchFollower,
        start: BranchOrbit,
        most_steps: int,
        report: Callable[[int], None] = lambda _: None,
    ) -> None:
        self.follower, self.most_steps, self.report = follower, most_steps, report
        self.orbits, self.last_length = [start], 0.0
        self.bifurcations: list[tuple[LocatedBifurcation, int]] = []
        self.missed: list[float] = []

    def follow(self) -> str:
        """Follow the branch; why it ends: "end", "start", "steps" or "stuck"."""
        (why,) = follow(self, np.array([_FIRST]))
        return why

    def aimed(self, length: Float, failures: NDArray[np.int_]) -> Float:
        """No longer than a part of the span."""
        return np.minimum(length, _LARGEST_PART / np.maximum(abs(self.orbits[-1].direction), 1e-12))

    def attempts(
        self, rows: Index, length: Float, failures: NDArray[np.int_]
    ) -> Iterator[tuple[Index, Attempt]]:
        """One step of the arclength."""
        following, step = self.follower.step(self.orbits[-1].point, float(length[0]))
        iterations, turn = float(step.iterations[0]), float(step.turn[0])
        yield rows, Attempt.of_one(following, float(length[0]), iterations=iterations, turn=turn)

    def accept(self, rows: Index, chosen: Index, attempt: Attempt) -> list[str]:
        """Keep the new orbit and the bifurcations before it; the branch ends outside the span."""
        here, there, self.last_length = self.orbits[-1], attempt.next, float(attempt.length[0])
        for located in bifurcations_between(self.follower, here, self.last_length, there):
            if located is None:
                self.missed.append(here.t)
            elif 0 <= located.branch_orbit.t <= 1:
                self.bifurcations.append((located, len(self.orbits) - 1))
        self.orbits.append(there)
        self.report(1)
        if not 0 <= there.t <= 1:
            return ["end" if there.t >= 0.5 else "start"]
        return [STEPS if len(self.orbits) > self.most_steps else ""]

    def cut(self) -> None:
        """Replace a last orbit outside the span by that at the end of the span."""
        last = self.orbits[-1]
        if not 0 <= last.t <= 1:
            edge = 1.0 if last.t > 1 else 0.0
            step = self.last_length, last
            reached = self.follower.crossing(self.orbits[-2], lambda orbit: orbit.t - edge, step)
            self.orbits[-1] = reached or last


_RESULTS = {
    "end": "the branch reaches the end of the span, {value:.6g}{unit}",
    "start": "the branch returns to the start of the span, {value:.6g}{unit}",
    "steps": (
        "the branch was followed for {steps} steps, to {value:.6g}{unit}; "
        "allow more steps to follow it further"
    ),
    "stuck": (
        "the branch could not be followed beyond {value:.6g}{unit}, where "
        "no step along it is short enough for Newton's method to find an orbit with its multipliers"
    ),
}


def followed_branch(
    origin: BranchOrigin,
    start: BranchOrbit,
    most_steps: int,
    progress: Callable[[int, int], None] | None,
    periods: int = 1,
) -> Branch:
    """Follow a branch until it leaves the span."""
    follower, moving, problem = origin
    followed = ParameterBranch(follower, start, most_steps, counted(progress, most_steps))
    why = followed.follow()
    followed.cut()
    orbits = followed.orbits
    values = moving.value(np.array([s.t for s in orbits]))
    unit = f" {moving.unit}" if moving.unit else ""
    result = _RESULTS[why].format(value=values[-1], unit=unit, steps=len(orbits) - 1)
    if followed.missed:
        near = listed(f"{value:.6g}{unit}" for value in moving.value(np.array(followed.missed)))
        result += f"; a bifurcation was not located after {near}"
    reverses = np.array([s.reversal_margin < 0 for s in orbits])
    if reverses.any():
        first = values[reverses][0]
        result += (
            f"; from {first:.6g}{unit} on slip would reverse for part of the period, and this law "
            "slips forwards only"
        )
    return Branch(
        name=moving.name,
        unit=moving.unit,
        parameter=values,
        mean_friction=np.array([s.mean_friction for s in orbits]),
        harmonics=np.stack([s.harmonics for s in orbits]),
        log_multipliers=np.stack([s.logs for s in orbits]),
        reverses=reverses,
        periods=periods,
        bifurcations=tuple(
            _bifurcation(follower, moving, located, at) for located, at in followed.bifurcations
        ),
        result=result,
        completed=why in ("end", "start"),
        motion=problem.system,
        fixed=fixed_parameters(problem, moving.name),
        origin=origin,
        last=orbits[-1].point,
    )


def _bifurcation(
    follower: BranchFollower, moving: ContinuedParameter, located: LocatedBifurcation, at: int
) -> Bifurcation:
    """The bifurcation after the orbit `at`, located again on a finer mesh."""
    coarse, kind = located.branch_orbit, located.kind
    refined = follower.finer(coarse.point, 3 * (coarse.point.orbit.mesh.shape[0] - 1))
    fine = refined and follower.crossing(refined, criterion(kind, located.critical))
    orbit = fine or coarse
    value, before = float(moving.value(orbit.t)), float(moving.value(coarse.t))
    fold = kind in ("fold", "branch point")
    return Bifurcation(
        kind=kind,
        value=value,
        error=abs(before - value) / abs(value) if fine else np.inf,
        mean_friction=orbit.mean_friction,
        log_multipliers=orbit.logs,
        frequency=0.0 if fold else orbit.mode_frequency(located.critical),
        unstable_before=located.before,
        unstable_after=located.after,
        index=at,
        critical=orbit,
    )


@typed
def continuation(
    slider: Slider,
    *,
    parameter: str,
    span: tuple[Any, Any],
    velocity: ArrayLike | str | None = None,
    epsilon: ArrayLike | str | None = None,
    frequency: ArrayLike | str | None = None,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
    harmonics: Annotated[int, at_least(2)] = 8,
    most_steps: Annotated[int, at_least(1)] = 1000,
    progress: Callable[[int, int], None] | None = None,
) -> Branch:
    """Follow the periodic response along one parameter, through folds.

    Parameters
    ----------
    slider : Slider
        Numbers, no arrays.
    parameter : str
        "epsilon", "frequency", "V", "K", "W0", "M", "eta", or a parameter of the law, such as
        "alpha" or "lambda"; names as in `asperity.parameters`.
    span : pair of float or str
        Values at which the branch starts and ends. A positive parameter whose ends differ by more
        than a factor of 2 is continued by equal factors.
    velocity : float or str
        Pulling velocity V (m/s). The velocity, epsilon or frequency may be left out if it is the
        continued parameter: `span` replaces the parameter's value in slider and arguments.
    epsilon : float or str
        Relative amplitude of the load.
    frequency : float or str
        Modulation frequency (Hz).
    modulation : Modulation, optional
        In place of `epsilon`.
    inertia : bool
    radiation_damping : float or str, optional
        eta (N s/m).
    harmonics : int
        Number of harmonics of the force, at least 2.
    most_steps : int
        Largest number of steps.
    progress : callable, optional
        Called after each step with the number of steps and `most_steps`.

    Returns
    -------
    Branch
        Its `result` says why the branch ends. Bifurcations are located to 1e-8 relative; their
        `error` is the difference between two meshes.

    Raises
    ------
    InputError
        If a value breaks its rule, the parameter does not exist, the slider has arrays, or no
        periodic orbit exists at the start of the span.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.2 N/um", load=pmma.W0)
    >>> at = {"velocity": "1 um/s", "frequency": "2 Hz"}
    >>> branch = asp.continuation(slider, parameter="epsilon", span=(0, 0.2), **at)
    >>> branch.result

    Notes
    -----
    Collocation with the arclength condition of Keller (1977), see
    `asperity.orbit.mesh.arclength`.
    """
    problem = one_problem(locals(), {parameter: span})
    moving = moving_parameter(problem, parameter, span)
    follower = BranchFollower(line_through(problem, (moving,), (0.0,), (1.0,)), harmonics)
    start = follower.begin()
    if start is None:
        got = f"none at {moving.name} = {moving.start:g} {moving.unit}".rstrip()
        advice = "start elsewhere, such as at a small epsilon"
        raise InputError("span", "start where there is a periodic orbit", got, advice)
    return followed_branch(BranchOrigin(follower, moving, problem), start, most_steps, progress)
