"""Response and derivatives at orbits of the search, inside and outside of compiled programs."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.orbit.batches import mesh_chunk, run_chunks
from asperity.orbit.floquet import sorted_logs
from asperity.orbit.gradient.known import MeshOrbits
from asperity.orbit.gradient.mesh_derivatives import orbit_derivatives
from asperity.orbit.gradient.parametrised import (
    Parameters,
    ParametrisedProblem,
    Program,
    ResponseValues,
)
from asperity.orbit.gradient.search import search_orbits
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.outcome import Outcome
from asperity.slider.problem import Problem

Float = NDArray[np.float64]

#: Time after which an idle process of the search ends (s); to start one takes seconds.
_IDLE = 600


def sorted_multipliers(orbits: MeshOrbits) -> NDArray[np.complex128]:
    """Logarithms of the multipliers as differentiable responses sort them, (states, points)."""
    logs = orbits.log_multipliers
    return np.asarray(sorted_logs(logs)) if len(logs) > 2 else logs


def values_of(orbits: MeshOrbits, *, multipliers: bool) -> ResponseValues:
    """Response of converged orbits, NumPy arrays."""
    points = len(orbits.mean_friction)
    logs = sorted_multipliers(orbits) if multipliers else np.zeros((0, points), complex)
    outcome = np.full(points, int(Outcome.CONVERGED))
    return ResponseValues(orbits.mean_friction, orbits.harmonics.T, logs.T, outcome)


def derivatives_of(
    equations: ParametrisedProblem,
    parameters: dict[str, Float],
    orbits: MeshOrbits,
    *,
    multipliers: bool,
    names: Collection[str] | None = None,
) -> Float:
    """`orbit_derivatives` at the points of `parameters`, in chunks of a fixed size."""
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    logs = sorted_multipliers(orbits) if multipliers else None
    everyone = np.arange(len(orbits.mean_friction))
    count = len(orbits.harmonics)

    def table(problem: Problem, orbit: Orbit, logs: Any) -> Float:
        return np.moveaxis(orbit_derivatives(equations, problem, orbit, count, logs, names), 1, -1)

    inputs, chunk = (problem, orbits.orbit, logs), mesh_chunk(problem.system.size)
    parts = [part for _, part in run_chunks(table, inputs, everyone, chunk)]
    return np.moveaxis(np.concatenate(parts, axis=-1), -1, 1)


def searched_values(parameters: Parameters, wanted: Array, program: Program) -> ResponseValues:
    """Response of the orbits of the search within a program, with first derivatives.

    Second derivatives are NaN. Points that are not wanted have `Outcome.NO_ORBIT`.
    """
    columns, outcome = _columns(program, parameters, wanted)
    states = program.states if program.multipliers else 0
    cuts = np.cumsum([1, program.harmonics, program.harmonics, states])
    mean, *pairs = jnp.split(columns, cuts, axis=1)
    harmonics, logs = pairs[0] + 1j * pairs[1], pairs[2] + 1j * pairs[3]
    return ResponseValues(mean[:, 0], harmonics, logs, outcome)


def _count(program: Program) -> int:
    return 1 + 2 * program.harmonics + 2 * program.states * program.multipliers


def _called(
    program: Program, parameters: Any, wanted: Array, *, derivatives: bool
) -> tuple[Array, Array, Array]:
    """`_response` in another process, if any point is wanted."""
    (points,), names = wanted.shape, program.equations.names
    count = _count(program)
    shapes = (
        jax.ShapeDtypeStruct((points, count), np.dtype(float)),
        jax.ShapeDtypeStruct((points,), np.dtype(np.int64)),
        jax.ShapeDtypeStruct((len(names) * derivatives, points, count), np.dtype(float)),
    )

    def call(parameters: Any, wanted: Any) -> Any:
        values = {n: np.asarray(v) for n, v in parameters.items()}
        return _in_another_process(_response, program, values, np.asarray(wanted), derivatives)

    def search(parameters: Any) -> Any:
        return jax.pure_callback(call, shapes, parameters, wanted, vmap_method="sequential")

    def nothing(parameters: Any) -> Any:
        columns, outcome, table = (jnp.zeros(s.shape, s.dtype) for s in shapes)
        return columns, outcome + int(Outcome.NO_ORBIT), table

    return jax.lax.cond(wanted.any(), search, nothing, parameters)


def _in_another_process(function: Any, *arguments: Any) -> Any:
    """The result of a function that a compiled program waits for.

    A program of XLA for the CPU that calls another program may deadlock. The search therefore runs
    in a separate process, which starts at its first use.
    """
    from loky import get_reusable_executor

    executor = get_reusable_executor(max_workers=1, timeout=_IDLE)
    return executor.submit(function, *arguments).result()


def _response(
    program: Program, parameters: dict[str, Float], wanted: NDArray[np.bool_], derivatives: bool
) -> tuple[Float, NDArray[np.int64], Float]:
    """Real columns (points, count) of the response, the outcome, and derivatives of the columns.

    The derivatives are of shape (parameters, points, count), without parameters if not requested.
    """
    equations, points, count = program.equations, len(wanted), _count(program)
    orbits = search_orbits(equations, program.harmonics, parameters, wanted)
    columns = np.zeros((points, count))
    table = np.zeros((len(equations.names) * derivatives, points, count))
    for index, part in orbits.parts:
        values = values_of(part, multipliers=program.multipliers)
        parts = [a for z in values[1:3] for a in (z.real, z.imag)]
        columns[index] = np.hstack([values.mean_friction[:, None], *parts])
        if derivatives:
            here = {n: v[index] for n, v in parameters.items()}
            table[:, index] = derivatives_of(equations, here, part, multipliers=program.multipliers)
    return columns, np.asarray(orbits.outcome), table


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _columns(program: Program, parameters: Parameters, wanted: Array) -> tuple[Array, Array]:
    """Real columns (points, count) of the response, and the outcome."""
    return _called(program, parameters, wanted, derivatives=False)[:2]


@_columns.defjvp
def _columns_rule(program: Program, primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    parameters, wanted = primals
    fixed = jax.lax.stop_gradient(parameters)
    columns, outcome, table = _called(program, fixed, wanted, derivatives=True)
    # Second derivatives are unknown for both.
    point = sum(parameters.values())
    columns, table = _unknown(columns, point), _unknown(table, point)
    names = program.equations.names
    change = sum(table[k] * tangents[0][n][:, None] for k, n in enumerate(names))
    return (columns, outcome), (change, np.zeros(outcome.shape, jax.dtypes.float0))


@jax.custom_jvp
def _unknown(values: Array, point: Array) -> Array:
    """`values` with NaN derivatives where the derivatives of `point`, (points,), are not zero."""
    return values


@_unknown.defjvp
def _unknown_rule(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    values, point = primals
    lost = jnp.where(tangents[1] != 0, jnp.nan, 0.0)
    return _unknown(values, point), lost[:, None] * jnp.ones_like(values)
