"""The branch of doubled period that begins at a period doubling.

The orbits of the branch have two periods of the modulation, and are computed as orbits of one
period of a modulation that repeats twice, at half the frequency. Where a multiplier of the simple
orbit is -1, its eigenvector v changes sign from one period to the next: the doubled orbits leave
the simple branch in the direction (v, -v).

Source: R. Seydel, Practical Bifurcation and Stability Analysis, section 7.6.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from asperity.arrays import Float
from asperity.branches.branch import Bifurcation, Branch
from asperity.branches.continuation import followed_branch
from asperity.branches.follower import INTERVALS, BranchFollower
from asperity.errors import InputError, require
from asperity.loads import Excitation, Modulation
from asperity.orbit.mesh.arclength import ContinuationPoint, ParameterLine, slip_units, weighted_row
from asperity.orbit.mesh.equations import condensed, transfer_maps
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import Change
from asperity.parameters.arguments import at_least, typed
from asperity.slider.problem import Problem

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
    return followed_branch(origin, start, most_steps, progress, periods=2)


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
