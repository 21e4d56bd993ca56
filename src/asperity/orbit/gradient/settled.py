"""Initial guesses from transients: the periodic state after a modulation of the load begins.

Where a modulation slower than the memory of the joint sets off slip events, orbits are pulses that
move along the period with every parameter: Newton's method from a smooth guess does not find them,
and continuation takes seconds. The motion itself settles on them in a few periods, if they are
stable, as all are that can be measured.
"""

from __future__ import annotations

from collections.abc import Mapping

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.loads import Modulate, Programme
from asperity.orbit.batches import Indices, put, take
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.mesh.mesh import Orbit, scheme_for
from asperity.slider.pointwise import excitation_at, values_at
from asperity.slider.problem import Problem
from asperity.transients.dense_output import DenseOutput
from asperity.transients.inputs import checked_integration, first_checkpoint

Float = NDArray[np.float64]

#: Number of periods of a transient, and the largest number of its steps.
_PERIODS, _MOST_STEPS = 6, 2000
#: Number of periods over which the modulation rises; after a sudden start the slider may run away.
_RISE = 2
#: Tolerance of a step; Newton's method corrects the remaining error.
_TOLERANCE = 1e-6
#: Largest change of a state over the last period of a transient that counts as periodic.
_SETTLED = 0.1


def settled_orbits(
    equations: ParametrisedProblem,
    parameters: Mapping[str, Float],
    problem: Problem,
    index: Indices,
    intervals: int,
    *,
    every: bool = False,
) -> tuple[Orbit, Indices]:
    """Initial guesses for Newton's method: the last period of transients from steady sliding.

    Parameters
    ----------
    equations : ParametrisedProblem
    parameters : mapping of str to array, shape (points,)
    problem : Problem
        Of these parameters.
    index : array of int
    intervals : int
        Of the mesh, finest where the integrator's steps were shortest.
    every : bool
        Whether to stop at the first motion that does not settle.

    Returns
    -------
    orbit : Orbit
        Of all points.
    index : array of int
        Points whose transient becomes periodic.
    """
    points, size = len(parameters["V"]), problem.system.size
    orbit = Orbit.empty(scheme_for(problem.system), size, intervals, points)
    if equations.coefficients is not None:
        return orbit, index[:0]
    rows = []
    for i in index:
        period = _last_period(equations, {n: float(v[i]) for n, v in parameters.items()})
        if period is not None:
            put(orbit, np.array([i]), _on_mesh(take(problem, np.array([i])), period, intervals))
            rows.append(i)
        elif every:
            break
    return orbit, np.array(rows, int)


def _last_period(equations: ParametrisedProblem, values: dict[str, float]) -> DenseOutput | None:
    """The last period of a transient, over the phase from its beginning; None if not periodic."""
    slider = jax.tree.map(float, equations.problem(values).system.slider)
    period = 1 / values["frequency"]
    programme = Programme(
        Modulate(
            (_RISE + _PERIODS) * period,
            values["epsilon"],
            values["frequency"],
            rise=_RISE * period,
        ),
        load=values["W0"],
        velocity=values["V"],
    )
    integration = checked_integration(
        slider,
        programme,
        inertia=equations.massive,
        radiation_damping=values.get("eta") or None,
        rtol=_TOLERANCE,
        method="implicit",
        most_steps=_MOST_STEPS,
    )
    if type(integration.motion) is not equations.motion:
        # The transient has other states, which allow slip to reverse.
        return None
    integration.checkpoint = first_checkpoint(integration.motion, programme, "steady")
    parts = []
    for part in integration.segment_parts():
        if part.termination is not None:
            return None
        if part.checkpoint.segment == len(programme.segments) - 1:
            parts.append(part.dense_output)
    whole = DenseOutput(
        np.concatenate([p.begin for p in parts]),
        np.concatenate([p.length for p in parts]),
        np.concatenate([p.coefficients[:, :-1] for p in parts], axis=-1),
    )
    start = (_PERIODS - 1) * period
    one, other = whole.evaluate(np.array([start, _PERIODS * period])).T
    if not np.abs(other - one).max() < _SETTLED:
        return None
    last = slice(int(np.searchsorted(whole.begin, start, side="right")) - 1, None)
    radian = 1 / (2 * np.pi * values["frequency"])
    return DenseOutput(
        (whole.begin[last] - start) / radian,
        whole.length[last] / radian,
        whole.coefficients[..., last],
    )


def _on_mesh(problem: Problem, period: DenseOutput, intervals: int) -> Orbit:
    """One orbit with as many intervals in each of the integrator's steps."""
    scheme = scheme_for(problem.system)
    begin = np.append(np.maximum(period.begin, 0.0), 2 * np.pi)
    places = np.linspace(0, len(begin) - 1, intervals + 1)
    mesh = np.interp(places, np.arange(len(begin)), begin)
    stages = mesh[:-1] + np.asarray(scheme.c)[:, None] * np.diff(mesh)
    nodes = period.evaluate(mesh[:-1])
    inner = period.evaluate(stages.ravel()).reshape(len(nodes), *stages.shape)
    at = excitation_at(problem.load, stages[..., None])
    values = values_at(problem.system, at, np.zeros_like(nodes[:, :1]), inner[..., None])
    return Orbit(
        mesh[:, None], nodes[:, :1], (nodes - nodes[:, :1])[..., None], values.rates, scheme
    )
