"""Pseudo-arclength continuation of the periodic response in any one parameter.

At a period doubling a branch of doubled period begins. Its orbits have two periods of the
modulation, and are computed as orbits of one period of a modulation that repeats twice, at half the
frequency. Where a multiplier of the simple orbit is -1, its eigenvector v changes sign from one
period to the next: the doubled orbits leave the simple branch in the direction (v, -v).

Source: R. Seydel, Practical Bifurcation and Stability Analysis, section 7.6.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from asperity.arrays import Float
from asperity.branches.bifurcations import (
    INTERVALS,
    BranchFollower,
    BranchOrbit,
    LocatedBifurcation,
    ParameterBranch,
    criterion,
)
from asperity.branches.branch import Bifurcation, Branch, BranchOrigin
from asperity.branches.parameters import (
    ContinuedParameter,
    fixed_parameters,
    line_through,
    moving_parameter,
    one_problem,
)
from asperity.errors import InputError, listed, require
from asperity.loads import Excitation, Modulation
from asperity.orbit.mesh.arclength import ContinuationPoint, ParameterLine, slip_units, weighted_row
from asperity.orbit.mesh.equations import condensed, transfer_maps
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import Change
from asperity.parameters.arguments import at_least, counted, typed
from asperity.slider import Slider
from asperity.slider.problem import Problem

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


def _followed(
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
    return Branch(
        name=moving.name,
        unit=moving.unit,
        parameter=values,
        mean_friction=np.array([s.mean_friction for s in orbits]),
        harmonics=np.stack([s.harmonics for s in orbits]),
        log_multipliers=np.stack([s.logs for s in orbits]),
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
    return _followed(BranchOrigin(follower, moving, problem), start, most_steps, progress)


#: Distances from the bifurcation at which a doubled orbit is tried (change of the log slip rate).
_DISTANCES = (0.05, 0.02, 0.1, 0.2)


class Repeated(Modulation):
    """Two periods of a modulation while theta rises from 0 to 2 pi.

    Parameters
    ----------
    load : Modulation
    """

    load: Modulation

    def at(self, theta: ArrayLike) -> Excitation:
        """Values and slopes at the phase `theta` (rad) of the double period."""
        once = self.load.at(2 * jnp.asarray(theta))
        return once._replace(w_slope=2 * once.w_slope, shear_slope=2 * once.shear_slope)

    @property
    def amplitude(self) -> ArrayLike:
        """As for the simple modulation."""
        return self.load.amplitude

    @property
    def formula(self) -> str:
        """As for the simple modulation."""
        return self.load.formula

    def scaled(self, share: ArrayLike) -> Repeated:
        """The modulation with `share` of its amplitude."""
        return Repeated(self.load.scaled(share))


@typed
def doubled_branch(
    branch: Branch,
    bifurcation: Bifurcation,
    *,
    most_steps: Annotated[int, at_least(1)] = 1000,
    progress: Callable[[int, int], None] | None = None,
) -> Branch:
    """Follow the branch of doubled period that leaves a branch at a period doubling.

    Parameters
    ----------
    branch : Branch
        Branch of simple period.
    bifurcation : Bifurcation
        A period doubling of the branch.
    most_steps : int
    progress : callable, optional
        Called after each step with the number of steps and `most_steps`.

    Returns
    -------
    Branch
        Its `periods` is 2, its harmonics c_n belong to n f / 2, and its multipliers to two periods.
        It starts next to the period doubling and is followed within the same span. A doubled branch
        leaves in two directions, but both have the same orbits, shifted by one period: one
        direction is followed.

    Raises
    ------
    InputError
        If the bifurcation is no period doubling, the branch has a doubled period already,
        or there is no doubled orbit next to it.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.24 N/um", load=pmma.W0)
    >>> at = {"velocity": "1 um/s", "frequency": "0.8 Hz"}
    >>> branch = asp.continuation(slider, parameter="epsilon", span=(0, 0.03), **at)
    >>> print(asp.doubled_branch(branch, branch.bifurcations[0]))
    """
    rule, got = "be a period doubling", f"a {bifurcation.kind}"
    require(bifurcation.kind == "period doubling", "bifurcation", rule, got, "choose another one")
    rule = "have the period of the modulation"
    advice = "follow further doublings in the multipliers of this branch"
    require(branch.periods == 1, "branch", rule, f"{branch.periods} periods", advice)
    follower = branch.origin.follower
    simple = follower.finer(bifurcation.critical.point, INTERVALS)
    twice = BranchFollower(_doubled_line(follower.line), 2 * follower.harmonics)
    start = None
    if simple is not None:
        point = _doubling_direction(follower.line, simple.point.orbit, simple.point.t)
        tried = (twice.step(point, distance)[0] for distance in _DISTANCES)
        start = next((doubled for doubled in tried if doubled is not None), None)
    if start is None:
        rule, got = "have a doubled orbit next to it", "none by Newton's method"
        raise InputError("bifurcation", rule, got, "continue in another parameter")
    origin = branch.origin._replace(follower=twice)
    return _followed(origin, start, most_steps, progress, periods=2)


def _doubled_line(line: ParameterLine) -> ParameterLine:
    def doubled(problem: Problem, factor: float) -> Problem:
        omega = problem.system.omega * factor
        system = eqx.tree_at(lambda q: q.omega, problem.system, omega)
        return Problem(system, Repeated(problem.load))

    # The growth is relative: the halved frequency grows by the same factor.
    return ParameterLine(
        doubled(line.origin, 0.5), doubled(line.added, 0.5), doubled(line.growth, 1.0)
    )


def _doubling_direction(line: ParameterLine, orbit: Orbit, t: Float) -> ContinuationPoint:
    """The simple orbit repeated twice, with the unit direction (v, -v)."""
    problem = line.at(t)
    equations = condensed(problem, orbit)
    maps = np.asarray(transfer_maps(equations.response, orbit.widths, orbit.scheme.b))
    units = slip_units(problem.system, equations.values)
    total = np.eye(len(maps))
    for i in range(maps.shape[2]):
        total = maps[:, :, i, 0] @ total
    multipliers, vectors = np.linalg.eig(total)
    vector = vectors[:, int(np.argmin(np.abs(multipliers + 1)))].real
    nodes = np.empty(orbit.nodes.shape)
    for i in range(maps.shape[2]):
        nodes[:, i, 0] = vector
        vector = maps[:, :, i, 0] @ vector
    slopes = 2 * np.einsum("nkcmb,cmb->nkmb", equations.response, nodes)
    mesh = np.concatenate([orbit.mesh / 2, np.pi + orbit.mesh[1:] / 2])
    twice = orbit._replace(
        mesh=mesh,
        nodes=np.concatenate([orbit.nodes, orbit.nodes], axis=1),
        slopes=2 * np.concatenate([orbit.slopes, orbit.slopes], axis=2),
    )
    nodes = np.concatenate([nodes, -nodes], axis=1)
    slopes = np.concatenate([slopes, -slopes], axis=2)
    size = np.sqrt((weighted_row(twice, nodes, units) * nodes).sum())
    return ContinuationPoint(twice, t, Change(nodes / size, slopes / size, np.zeros(1)), units)
