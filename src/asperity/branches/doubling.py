"""Branch switching at a period doubling, and continuation of the branch of doubled period.

An orbit of two periods of the modulation is an orbit of one period of a modulation repeated twice
in it, at half the frequency. Where a multiplier of the simple orbit is -1 its eigenvector v changes
sign from one period to the next: (v, -v) is the direction in which the doubled orbits leave.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, section 7.6.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from numpy.typing import NDArray

from asperity.branches.branch import Bifurcation, Branch
from asperity.branches.continuation import INTERVALS, BranchRecorder
from asperity.branches.steps import BranchFollower, BranchOrbit
from asperity.errors import InputError, require
from asperity.loads import Excitation, Modulation
from asperity.orbit.mesh.arclength import (
    ContinuationPoint,
    ParameterLine,
    slip_units,
    weighted_row,
)
from asperity.orbit.mesh.equations import condensed, transfer_maps
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import Change
from asperity.parameters.arguments import at_least, counted, typed
from asperity.slider.problem import Problem

#: Distances from the bifurcation at which a doubled orbit is searched (exponent of the slip rate).
_DISTANCES = (0.05, 0.02, 0.1, 0.2)


class Repeated(Modulation):
    """A modulation run through twice while theta runs from 0 to 2 pi.

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
        Of simple period.
    bifurcation : Bifurcation
        A period doubling of the branch.
    most_steps : int
    progress : callable, optional
        Called after each step with the number of steps and `most_steps`.

    Returns
    -------
    Branch
        With `periods` 2: its harmonics c_n belong to n f / 2, its multipliers to two periods. It
        starts next to the period doubling and is followed within the same span. The two halves of a
        doubled branch are one orbit, begun a period later: one of them is followed.

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
    follower, moving, problem = branch.origin
    simple = follower.finer(bifurcation.critical.point, INTERVALS)
    twice = BranchFollower(_doubled_line(follower.line), 2 * follower.harmonics)
    start = None if simple is None else _doubled_orbit_near(follower, twice, simple)
    if start is None:
        rule, got = "have a doubled orbit next to it", "none by Newton's method"
        raise InputError("bifurcation", rule, got, "continue in another parameter")
    recorder = BranchRecorder(twice, moving, start, counted(progress, most_steps), periods=2)
    return recorder.branch(recorder.follow_branch(most_steps), problem)


def _doubled_line(line: ParameterLine) -> ParameterLine:
    def doubled(problem: Problem, factor: float) -> Problem:
        omega = problem.system.omega * factor
        system = eqx.tree_at(lambda q: q.omega, problem.system, omega)
        return Problem(system, Repeated(problem.load))

    # Rates of growth are relative: half the frequency grows by the same factor.
    return ParameterLine(
        doubled(line.origin, 0.5), doubled(line.added, 0.5), doubled(line.growth, 1.0)
    )


def _doubled_orbit_near(
    follower: BranchFollower, twice: BranchFollower, simple: BranchOrbit
) -> BranchOrbit | None:
    """A doubled orbit near the critical simple one."""
    point = simple.point
    start = _alternating(follower.line, point.orbit, point.t)
    for distance in _DISTANCES:
        branch_orbit, _ = twice.step(start, distance)
        if branch_orbit is not None:
            return branch_orbit
    return None


def _alternating(line: ParameterLine, orbit: Orbit, t: NDArray[np.float64]) -> ContinuationPoint:
    """The simple orbit twice, and the unit direction (v, -v), which changes sign in between."""
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
