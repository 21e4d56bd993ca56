"""Orbits from the search and their response, within a compiled program."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.orbit.gradient.collocation import (
    CollocationEquations,
    condensed_jacobian,
    unknowns_of,
    values_on,
)
from asperity.orbit.gradient.implicit import implicit_solution
from asperity.orbit.gradient.multipliers import log_multipliers, sorted_logs
from asperity.orbit.gradient.program import Parameters, Program, ResponseValues, only_where
from asperity.orbit.gradient.search.mesh_orbits import MeshOrbits, mesh_orbit_shapes
from asperity.orbit.gradient.search.search import TRACED_MESH, search_in_another_process
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.reading import orbit_observables
from asperity.orbit.mesh.scheme import scheme_for
from asperity.orbit.outcome import Outcome

#: Largest difference of multipliers on the mesh from those of the search, relative.
_MULTIPLIER_GAP = 1e-5

#: Points that are differentiated together on collocation meshes.
_CHUNK = 4


def mesh_orbits(program: Program, parameters: Parameters, wanted: Array) -> MeshOrbits:
    """Orbits by the search, which a compiled program calls if any point is wanted."""
    equations = program.equations
    (points,) = wanted.shape
    shapes = mesh_orbit_shapes(program.states, points, program.harmonics, TRACED_MESH)

    def search(parameters: Any, wanted: Any) -> MeshOrbits:
        values = {n: np.asarray(v) for n, v in parameters.items()}
        return search_in_another_process(equations, program.harmonics, values, np.asarray(wanted))

    def call(parameters: Parameters) -> MeshOrbits:
        return jax.pure_callback(search, shapes, parameters, wanted, vmap_method="sequential")

    def steady(parameters: Parameters) -> MeshOrbits:
        empty = MeshOrbits(*(jnp.zeros(s.shape, s.dtype) for s in shapes))
        states = equations.problem(parameters).system.steady()
        mesh = jnp.linspace(0, 2 * jnp.pi, len(empty.mesh))[:, None] * jnp.ones(points)
        outcome = jnp.full(points, int(Outcome.NO_ORBIT))
        return empty._replace(mesh=mesh, centre=states + empty.centre, outcome=outcome)

    return jax.lax.cond(wanted.any(), call, steady, parameters)


def found_values(orbits: MeshOrbits, program: Program) -> ResponseValues:
    """Values of orbits of the search, without derivatives: NumPy arrays."""
    logs = np.zeros((0, len(orbits.outcome)), complex)
    if program.multipliers:
        logs = np.asarray(orbits.log_multipliers)
        if len(logs) > 2:
            logs = np.asarray(sorted_logs(logs))
    return ResponseValues(orbits.mean_friction, orbits.harmonics.T, logs.T, orbits.outcome)


def mesh_values(parameters: Parameters, meshed: MeshOrbits, program: Program) -> ResponseValues:
    """Values of the search, with the derivatives of the orbits on their meshes."""
    meshed = jax.lax.stop_gradient(meshed)
    converged = meshed.outcome == Outcome.CONVERGED
    parameters = only_where(converged, parameters)
    # Points with an orbit first: chunks without one take no time.
    order = jnp.argsort(~converged, stable=True)
    back = jnp.argsort(order)

    def solve(inputs: tuple[Parameters, MeshOrbits]) -> ResponseValues:
        return mesh_chunk_values(inputs[0], inputs[1], program)

    def skip(inputs: tuple) -> ResponseValues:
        shapes = jax.eval_shape(solve, inputs)
        return jax.tree.map(lambda s: jnp.zeros(s.shape, s.dtype), shapes)

    def one(inputs: tuple) -> ResponseValues:
        return jax.lax.cond((inputs[1].outcome == Outcome.CONVERGED).any(), solve, skip, inputs)

    ordered = jax.tree.map(lambda a: a[..., order], (parameters, meshed))
    values = jax.lax.map(one, in_chunks(ordered))
    values = jax.tree.map(lambda a: a.reshape(len(order), *a.shape[2:])[back], values)
    return values._replace(outcome=jnp.where(converged, values.outcome, meshed.outcome))


def in_chunks(tree: Any) -> Any:
    """Arrays with the points along the last axis, cut into chunks along a new first axis."""

    def cut(a: Array) -> Array:
        chunks = a.shape[-1] // min(_CHUNK, a.shape[-1])
        return jnp.moveaxis(a.reshape(*a.shape[:-1], chunks, -1), -2, 0)

    return jax.tree.map(cut, tree)


def mesh_chunk_values(
    parameters: Parameters, meshed: MeshOrbits, program: Program
) -> ResponseValues:
    """Values of the search at some points, with the derivatives of the orbits on their meshes."""
    problem = program.equations.problem(parameters)
    found = Orbit(*meshed[:4], scheme_for(problem.system))
    equations = CollocationEquations()
    unknowns = implicit_solution(equations, (problem, found), unknowns_of(found))
    orbit = equations.orbit((problem, found), unknowns)
    local = values_on(problem, orbit)
    none = jnp.zeros((*orbit.slopes.shape[:2], 0, *orbit.widths.shape))
    maps, _ = condensed_jacobian(local.jacobian, none, orbit)
    response = orbit_observables(local, maps, orbit, program.harmonics)
    logs = jnp.zeros((0, *response.mean_friction.shape), dtype=complex)
    if program.multipliers:
        logs = log_multipliers(response.monodromy, response.log_scale, response.log_determinant)
    exact_logs = meshed.log_multipliers[: len(logs)]
    if len(logs) > 2:
        exact_logs = sorted_logs(exact_logs)
    # No derivative of multipliers that this mesh does not resolve.
    gap = jnp.abs(jnp.expm1(jax.lax.stop_gradient(logs) - exact_logs))
    logs = jnp.where(gap < _MULTIPLIER_GAP, 1.0, jnp.nan) * logs
    exact = meshed.mean_friction, meshed.harmonics, exact_logs
    on_mesh = response.mean_friction, response.harmonics, logs
    values = [e + (a - jax.lax.stop_gradient(a)) for e, a in zip(exact, on_mesh, strict=True)]
    mean, harmonics, log_values = (a.T for a in values)
    return ResponseValues(mean, harmonics, log_values, meshed.outcome)
