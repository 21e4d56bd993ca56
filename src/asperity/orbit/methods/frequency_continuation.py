"""Continuation in frequency, from a modulation so fast that the averaged limit holds."""

from __future__ import annotations

import equinox as eqx
import numpy as np

from asperity._jax import jit_large
from asperity.arrays import Float, Index
from asperity.orbit.batches import mesh_chunk, put, run_chunks, take
from asperity.orbit.mesh.arclength import ParameterLine, still
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import remeshed
from asperity.orbit.methods.amplitude_continuation import followed_branches
from asperity.orbit.methods.collocation import orbits_from_averaged_limit, refined_where_resolved
from asperity.orbit.outcome import WITHOUT_ORBIT
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.orbit.steady_sliding import perturbation_rate
from asperity.slider.problem import Problem

#: Rate per radian of a perturbation at which the averaged limit is close enough to start from.
_FAST_MODULATION = 0.02
#: Intervals of the moving mesh, and most steps along a path.
_INTERVALS, _MOST_STEPS = 216, 250

_rate = jit_large(perturbation_rate)


class FrequencyContinuation(Method):
    """Orbits of branches that are not connected with steady sliding."""

    name = "continuation in frequency"
    choice = "collocation"

    def candidates(self, solution: Solution) -> Index:
        """Points whose branch from steady sliding has no orbit at the requested amplitude."""
        return np.flatnonzero(np.isin(solution.outcome, WITHOUT_ORBIT))

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; an orbit that is not resolved may not exist, and is not reported."""
        faster = _faster(problem)
        omega = problem.system.omega * faster
        origin = eqx.tree_at(lambda q: q.system.omega, problem, omega)
        orbit, rows = orbits_from_averaged_limit(origin, np.arange(len(faster)))
        if not len(rows):
            return Solution.unsolved(problem, options)
        part, origin, orbit = take((problem, origin, orbit), rows)
        growth = eqx.tree_at(lambda q: q.system.omega, still(part), -np.log(faster[rows]))
        line = ParameterLine(origin, still(part), growth)
        branches = followed_branches(line, remeshed(origin, orbit, _INTERVALS), _MOST_STEPS)
        reached = Orbit.empty(orbit.scheme, problem.system.size, _INTERVALS, len(faster))
        put(reached, rows, branches.pair.point.orbit)
        return refined_where_resolved(problem, options, reached, rows[branches.arrived])


def _faster(problem: Problem) -> Float:
    """Frequency at which the averaged limit holds over that of each point, (points,)."""
    rate = np.zeros(problem.system.V.shape[-1])
    chunk = mesh_chunk(problem.system.size)
    for part, value in run_chunks(_rate, (problem,), np.arange(len(rate)), chunk):
        rate[part] = value
    return np.maximum(rate / _FAST_MODULATION, 1.0)
