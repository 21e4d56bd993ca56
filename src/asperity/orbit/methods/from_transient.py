"""Orbits on which the motion settles: the last period of a transient from steady sliding.

Where a modulation slower than the memory of the joint sets off slip events, orbits are pulses whose
phase changes with every parameter, and a slider with inertia has resonances. Newton's method from
a smooth guess does not find such an orbit, and following a branch takes seconds to a minute. A
transient comes close to a stable orbit in a few periods, and every orbit that can be measured is
stable.
"""

from __future__ import annotations

import jax
import numpy as np

from asperity.arrays import Index
from asperity.loads import Harmonic, Modulate, Programme
from asperity.orbit.batches import put, take
from asperity.orbit.mesh.mesh import Orbit, scheme_for
from asperity.orbit.mesh.newton import FIRST_MESH
from asperity.orbit.methods.collocation import refined_where_resolved
from asperity.orbit.outcome import WITHOUT_ORBIT
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.slider import Inertial
from asperity.slider.inertial import StiffInertial
from asperity.slider.problem import Problem
from asperity.transients.dense_output import DenseOutput
from asperity.transients.events import Termination
from asperity.transients.inputs import checked_integration, first_checkpoint

#: Number of periods of a transient, and the largest number of its steps. After 6 periods a
#: transient with a multiplier of -0.8 is still too far from the orbit; more than 12 find no others.
_PERIODS, _MOST_STEPS = 12, 4000
#: Number of periods over which the modulation rises; after a sudden start the slider may run away.
_RISE = 2
#: Tolerance of a step; Newton's method corrects the remaining error.
_TOLERANCE = 1e-6
#: Largest distance of a state from its orbit at the end of a transient that counts as periodic.
_SETTLED = 0.05


class SettledMotion(Method):
    """Newton's method from the last period of a transient that becomes periodic."""

    name = "transient"
    choice = "collocation"

    def suits(self, problem: Problem) -> bool:
        """Under a harmonic load, which is what a programme can modulate."""
        return isinstance(problem.load, Harmonic)

    def candidates(self, solution: Solution) -> Index:
        """Points without an orbit."""
        return np.flatnonzero(np.isin(solution.outcome, WITHOUT_ORBIT))

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; an orbit that is not resolved is left to other methods."""
        points = np.arange(problem.system.V.shape[-1])
        return refined_where_resolved(problem, options, *settled_orbits(problem, points))


def settled_orbits(problem: Problem, index: Index, *, every: bool = False) -> tuple[Orbit, Index]:
    """Initial guesses for Newton's method: the last period of transients from steady sliding.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    index : array of int
    every : bool
        Whether to stop at the first transient that does not become periodic.

    Returns
    -------
    orbit : Orbit
        Orbits of all points, on meshes that are finest where the integrator's steps were shortest.
    index : array of int
        Points whose transient becomes periodic.
    """
    system = problem.system
    orbit = Orbit.empty(scheme_for(system), system.size, FIRST_MESH, len(system.V))
    if not isinstance(problem.load, Harmonic):
        return orbit, index[:0]
    rows = []
    for i in index:
        point = take(problem, np.array([i]))
        period = _last_period(jax.tree.map(lambda a: a.item(), point))
        if period is not None:
            put(orbit, np.array([i]), _on_mesh(point, period))
            rows.append(i)
        elif every:
            break
    return orbit, np.array(rows, int)


def _last_period(point: Problem) -> DenseOutput | None:
    """The last period of a transient, over the phase from its beginning; None if not periodic."""
    system, load = point
    radian = 1 / system.omega
    period = 2 * np.pi * radian
    programme = Programme(
        Modulate((_RISE + _PERIODS) * period, load.epsilon, 1 / period, rise=_RISE * period),
        load=system.slider.W0,
        velocity=system.V,
    )
    integration = checked_integration(
        system.slider,
        programme,
        inertia=isinstance(system, Inertial | StiffInertial),
        radiation_damping=getattr(system, "eta", 0.0) or None,
        rtol=_TOLERANCE,
        method="implicit",
        most_steps=_MOST_STEPS,
    )
    if type(integration.motion) is not type(system):
        # The transient has other states, which allow slip to reverse.
        return None
    integration.checkpoint = first_checkpoint(integration.motion, programme, "steady")
    run = integration.last_segment()
    if isinstance(run, Termination):
        return None
    whole = run[1]
    start = (_PERIODS - 1) * period
    # The last component is the displacement, which is no state of the equations.
    ends = whole.evaluate(period * np.arange(_PERIODS - 2, _PERIODS + 1))[:-1]
    before, change = np.diff(ends).T
    # If the change goes on by the same ratio in every period, this is the distance that is left to
    # the orbit. Changes of less than a thousandth may be errors of the integrator.
    ratio = before @ change / (before @ before + _TOLERANCE)
    if not np.abs(change * ratio).max() < _SETTLED * (1 - ratio):
        return None
    last = slice(int(np.searchsorted(whole.begin, start, side="right")) - 1, None)
    return DenseOutput(
        (whole.begin[last] - start) / radian,
        whole.length[last] / radian,
        whole.coefficients[:, :-1, last],
    )


def _on_mesh(problem: Problem, period: DenseOutput) -> Orbit:
    """One orbit with as many intervals in each of the integrator's steps."""
    scheme = scheme_for(problem.system)
    begin = np.append(np.maximum(period.begin, 0.0), 2 * np.pi)
    places = np.linspace(0, len(begin) - 1, FIRST_MESH + 1)
    mesh = np.interp(places, np.arange(len(begin)), begin)
    stages = mesh[:-1] + np.asarray(scheme.c)[:, None] * np.diff(mesh)
    nodes = period.evaluate(mesh[:-1])
    inner = period.evaluate(stages.ravel()).reshape(len(nodes), *stages.shape)
    # Slopes with which the states at the collocation points are those of the transient; the rates
    # of a stiff equation at these states have large errors.
    slopes = np.einsum("jk,nkm->njm", np.linalg.inv(scheme.a), inner - nodes[:, None])
    slopes /= np.diff(mesh)
    return Orbit(
        mesh[:, None], nodes[:, :1], (nodes - nodes[:, :1])[..., None], slopes[..., None], scheme
    )
