"""Response of the orbits of the search with its derivatives, for traced and other programs."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.orbit.batches import mesh_chunk, take
from asperity.orbit.gradient.mesh_derivatives import orbit_derivatives
from asperity.orbit.gradient.multipliers import sorted_logs
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.gradient.program import Parameters, Program, ResponseValues
from asperity.orbit.gradient.search.mesh_orbits import MeshOrbits, SearchedOrbits
from asperity.orbit.gradient.search.search import search_orbits
from asperity.orbit.outcome import Outcome

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
) -> Float:
    """`orbit_derivatives` at the points of `parameters`, in chunks of a fixed size."""
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    points, chunk = len(orbits.mean_friction), mesh_chunk(problem.system.size)
    logs = sorted_multipliers(orbits) if multipliers else None
    tables = []
    for start in range(0, points, chunk):
        part = np.minimum(np.arange(start, start + chunk), points - 1)
        table = orbit_derivatives(
            equations,
            take(problem, part),
            take(orbits.orbit, part),
            len(orbits.harmonics),
            None if logs is None else logs[:, part],
        )
        tables.append(table[:, : points - start])
    return np.concatenate(tables, axis=1)


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


def _called(function: Any, shapes: Any, program: Program, parameters: Any, wanted: Array) -> Any:
    """A function of NumPy arrays, called in another process if any point is wanted."""

    def call(parameters: Any, wanted: Any) -> Any:
        values = {n: np.asarray(v) for n, v in parameters.items()}
        return _in_another_process(function, program, values, np.asarray(wanted))

    def search(parameters: Any) -> Any:
        return jax.pure_callback(call, shapes, parameters, wanted, vmap_method="sequential")

    def nothing(parameters: Any) -> Any:
        def empty(s: Any) -> Array:
            none = int(Outcome.NO_ORBIT) if s.dtype == np.int64 else 0.0
            return jnp.full(s.shape, none, s.dtype)

        return jax.tree.map(empty, shapes)

    return jax.lax.cond(wanted.any(), search, nothing, parameters)


def _in_another_process(function: Any, *arguments: Any) -> Any:
    """The result of a function that a compiled program waits for.

    XLA's programs for the CPU may wait for each other for ever where one calls another, so that
    the search has a process of its own, which is started at its first use.
    """
    from loky import get_reusable_executor

    executor = get_reusable_executor(max_workers=1, timeout=_IDLE)
    return executor.submit(function, *arguments).result()


def _searched(
    program: Program, parameters: dict[str, Float], wanted: NDArray[np.bool_]
) -> SearchedOrbits:
    return search_orbits(program.equations, program.harmonics, parameters, wanted)


def _response(
    program: Program, parameters: dict[str, Float], wanted: NDArray[np.bool_]
) -> tuple[Float, NDArray[np.int64]]:
    orbits = _searched(program, parameters, wanted)
    columns = np.zeros((len(wanted), _count(program)))
    for index, part in orbits.parts:
        values = values_of(part, multipliers=program.multipliers)
        columns[index] = np.hstack(
            [values.mean_friction[:, None], *_parts(values.harmonics, values.log_multipliers)]
        )
    return columns, np.asarray(orbits.outcome)


def _parts(*columns: NDArray[np.complex128]) -> list[Float]:
    return [part for a in columns for part in (a.real, a.imag)]


def _table(program: Program, parameters: dict[str, Float], wanted: NDArray[np.bool_]) -> Float:
    orbits = _searched(program, parameters, wanted)
    names = program.equations.names
    table = np.zeros((len(names), len(wanted), _count(program)))
    for index, part in orbits.parts:
        own = {n: v[index] for n, v in parameters.items()}
        table[:, index] = derivatives_of(
            program.equations, own, part, multipliers=program.multipliers
        )
    return table


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _columns(program: Program, parameters: Parameters, wanted: Array) -> tuple[Array, Array]:
    """Real columns (points, count) of the response, and the outcome."""
    (points,) = wanted.shape
    shapes = (
        jax.ShapeDtypeStruct((points, _count(program)), np.dtype(float)),
        jax.ShapeDtypeStruct((points,), np.dtype(np.int64)),
    )
    return _called(_response, shapes, program, parameters, wanted)


@_columns.defjvp
def _columns_rule(program: Program, primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    parameters, wanted = primals
    columns, outcome = _columns(program, parameters, wanted)
    names = program.equations.names
    shape = (len(names), *columns.shape)
    fixed = jax.lax.stop_gradient(parameters)
    shapes = jax.ShapeDtypeStruct(shape, np.dtype(float))
    table = _called(_table, shapes, program, fixed, wanted)
    table = _unknown(table, sum(parameters.values()))
    change = sum(table[k] * tangents[0][n][:, None] for k, n in enumerate(names))
    return (columns, outcome), (change, np.zeros(outcome.shape, jax.dtypes.float0))


@jax.custom_jvp
def _unknown(values: Array, point: Array) -> Array:
    """Values whose derivatives are NaN where those of `point`, (points,), are not zero."""
    return values


@_unknown.defjvp
def _unknown_rule(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    values, point = primals
    lost = jnp.where(tangents[1] != 0, jnp.nan, 0.0)
    return _unknown(values, point), lost[:, None] * jnp.ones_like(values)
