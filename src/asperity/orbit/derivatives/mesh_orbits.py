"""Derivatives of orbits on meshes by the implicit function theorem, for any law.

With D the collocation equations of an orbit Y for parameters p, D(p, Y) = 0, the derivative of the
orbit is -D_Y^-1 D_p: the linear equations of a Newton step, for all parameters at once.
`asperity.slider.pointwise` evaluates the law.

The derivative of a multiplier m is sum_i w_i (dT_i) v_i / (w_i T_i v_i), where the right
eigenvector v and the left eigenvector w of the monodromy matrix T_M ... T_1 are carried along the
transfer maps T_i. It needs a Jacobian that is continuous along the orbit.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity._processes import in_kept_process
from asperity.algebra.cyclic import solve_cyclic
from asperity.algebra.small_systems import scaled_product
from asperity.arrays import Bool, Complex, Float
from asperity.orbit.batches import mesh_chunk, run_chunks
from asperity.orbit.derivatives.mesh_search import MeshOrbits, SearchedOrbits, search_orbits
from asperity.orbit.derivatives.parametrised import (
    Parameters,
    ParametrisedProblem,
    Program,
    ResponseValues,
    only_where,
)
from asperity.orbit.mesh.equations import (
    collocated,
    condensed_jacobian,
    fourier_coefficients,
    quadrature,
    transfer_maps,
)
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.outcome import Outcome
from asperity.slider.pointwise import PointValues, curvature_along, slopes_along
from asperity.slider.problem import Problem

#: Number of right-hand sides that are solved together; shorter sets are padded.
_SIDES = 8
#: Largest relative difference of multipliers on the mesh from the known multipliers.
_MULTIPLIER_GAP = 1e-5


def orbit_derivatives(
    equations: ParametrisedProblem,
    problem: Problem,
    orbit: Orbit,
    harmonics: int,
    logs: Complex | None = None,
    names: Collection[str] | None = None,
) -> Float:
    """Derivatives of mean, harmonics and multipliers by the parameters.

    Parameters
    ----------
    equations : ParametrisedProblem
    problem : Problem
        NumPy arrays (points,).
    orbit : Orbit
        Converged orbits.
    harmonics : int
    logs : complex array, shape (size, points), optional
        Logarithms of the multipliers, to add their derivatives, which are NaN where the mesh does
        not resolve the multipliers, and where the interface sticks.
    names : collection of str, optional
        Parameters with derivatives; all by default. Derivatives by other parameters are zero.

    Returns
    -------
    array, shape (parameters, points, columns)
        Columns are the mean, then the real and the imaginary parts of the harmonics, then those of
        the logarithms of the multipliers.
    """
    with np.errstate(all="ignore"):
        given, points = equations.influential(names), len(problem.system.V)
        outputs = 1 + 2 * harmonics + (0 if logs is None else 2 * len(logs))
        table = np.zeros((len(equations.names), points, outputs))
        if not given:
            return table
        directions = equations.directions(given, points)
        values = collocated(problem, orbit)
        sides, forces, gradient = _slopes(problem, orbit, directions)
        response, constant = _condensed(values.jacobian, sides, orbit)
        changes = _orbit_changes(orbit, response, constant)
        forces = forces + np.einsum("nkmb,dnkmb->dkmb", gradient, changes)
        mean, phasors = fourier_coefficients(forces, orbit, harmonics)
        columns = [np.moveaxis(np.stack([mean, *phasors.real, *phasors.imag]), 0, -1)]
        if logs is not None:
            linearised = values.jacobian, response
            moved = _multiplier_columns(problem, orbit, linearised, directions, changes, logs)
            columns.append(np.where(_sticks(values)[:, None], np.nan, moved))
        part = np.concatenate(columns, axis=-1)
    table[[name in given for name in equations.names]] = part
    return table


def _slopes(problem: Problem, orbit: Orbit, directions: Problem) -> tuple[Float, Float, Float]:
    """Derivatives of rates and of F/W0 by the parameters, and of F/W0 by each state.

    Shapes are (size, STAGES, directions, ...), (directions, STAGES, ...) and (size, STAGES, ...).
    """
    count, parts = len(directions.system.V), []
    for start in range(0, count, _SIDES):
        some = np.minimum(np.arange(start, start + _SIDES), count - 1)
        part = jax.tree.map(lambda a, some=some: a[some], directions)
        parts.append(slopes_along(problem, part, orbit.stage_phases, orbit.stage_states))
    rates, forces = (np.concatenate([p[i] for p in parts])[:count] for i in range(2))
    return np.moveaxis(rates, 0, 2), forces, parts[0][2]


@jit_large
def _solved(
    response: Array, constant: Array, widths: Array, coefficients: tuple[Array, Array]
) -> Array:
    """Changes of the states at the collocation points, (sides, size, STAGES, ...)."""
    a, b = coefficients
    gain = widths * jnp.einsum("k,nksmb->nsmb", b, constant)
    nodes = solve_cyclic(transfer_maps(response, widths, b), gain)
    bent = jnp.einsum("nkcmb,csmb->nksmb", response, nodes) + constant
    return jnp.moveaxis(nodes[:, None] + widths * jnp.einsum("jk,nksmb->njsmb", a, bent), 2, 0)


def _orbit_changes(orbit: Orbit, response: Float, constant: Float) -> Float:
    """Changes of the states at the collocation points, (directions, size, STAGES, ...)."""
    coefficients = np.asarray(orbit.scheme.a), np.asarray(orbit.scheme.b)
    parts = [_solved(response, part, orbit.widths, coefficients) for part in _sets(constant)]
    return np.concatenate(parts)[: constant.shape[2]]


def _sets(sides: Float) -> list[Float]:
    """Right-hand sides, (size, STAGES, sides, ...), as many as are solved together.

    The last set is filled up with zeros.
    """
    filling = [(0, 0)] * sides.ndim
    filling[2] = 0, -sides.shape[2] % _SIDES
    return np.split(np.pad(sides, filling), -(-sides.shape[2] // _SIDES), axis=2)


def _condensed(jacobian: Float, sides: Float, orbit: Orbit) -> tuple[Float, Float]:
    """`condensed_jacobian` of any number of right-hand sides, by one compiled program."""
    parts = [condensed_jacobian(jacobian, part, orbit) for part in _sets(sides)]
    constant = np.concatenate([constant for _, constant in parts], axis=2)
    return parts[0][0], constant[:, :, : sides.shape[2]]


def _multiplier_columns(
    problem: Problem,
    orbit: Orbit,
    linearised: tuple[Float, Float],
    directions: Problem,
    changes: Float,
    logs: Complex,
) -> Float:
    """Changes of the logarithms of the multipliers, (directions, points, parts).

    The real parts come first, then the imaginary ones. `linearised` are the Jacobian and the
    response of the slopes to a change at the left node.
    """
    (jacobian, response), (size, points) = linearised, logs.shape
    # Two multipliers: the smaller is lost in the round-off of the larger; Liouville's sum gives it.
    pair = size == 2
    theta, states = orbit.stage_phases, orbit.stage_states
    maps = transfer_maps(response, orbit.widths, orbit.scheme.b)
    right, left, gap = _eigenvectors(maps, logs)

    def along(k: int, vector: Float) -> Float:
        direction = jax.tree.map(lambda a: a[k], directions)
        return curvature_along(problem, direction, theta, states, changes[k], vector)

    result = np.zeros((len(changes), size, points), complex)
    for j in range(size - pair):
        v, w = right[:, j], left[:, j]
        bent = np.einsum("nkcmb,cmb->nkmb", response, v)
        inner = v[:, None] + orbit.widths * orbit.stage_sums(bent)
        sides = [along(k, part) for k in range(len(changes)) for part in (inner.real, inner.imag)]
        _, constant = _condensed(jacobian, np.stack(sides, axis=2), orbit)
        moved = orbit.widths * np.einsum("k,nkcmb->cnmb", orbit.scheme.b, constant)
        moved = moved[0::2] + 1j * moved[1::2]
        after = np.einsum("ncmb,cmb->nmb", maps, v)
        share = (w * moved).sum(1) / (w * after).sum(0)
        result[:, j] = share.sum(1)
    if pair:
        units = np.broadcast_to(np.eye(size)[..., None, None, None], (size, *states.shape))
        trace = sum(
            np.stack([along(k, units[i])[i] for k in range(len(changes))]) for i in range(size)
        )
        whole = (quadrature(orbit) * trace).sum((1, 2))
        # A complex pair shares the sum equally.
        turning = (logs[0].imag != 0) & (np.abs(logs[0].imag) != np.pi)
        result[:, 0].real[:] = np.where(turning, whole / 2, result[:, 0].real)
        result[:, 1] = whole - result[:, 0]
        gap[1] = gap[0]
    result = np.where(gap < _MULTIPLIER_GAP, result, np.nan)
    both = np.concatenate([result.real, result.imag], axis=1)
    return np.moveaxis(both, 1, 2)


def _sticks(values: PointValues) -> Bool:
    """Whether the interface sticks for a part of the period, shape (points,).

    The Jacobian jumps where it begins and ends to stick. These instants move with the parameters,
    which changes the multipliers, and which no derivative of the Jacobian contains. Mean and
    harmonics depend on the Jacobian alone.
    """
    return np.isneginf(values.log_slip).any((0, 1))


def _eigenvectors(maps: Float, logs: Complex) -> tuple[Complex, Complex, Float]:
    """Eigenvectors that belong to `logs`, carried along the maps.

    Returns
    -------
    right : complex array, shape (size, size, intervals, points)
        [component, multiplier] at the left node of each interval, to any scale.
    left : complex array
        The same at the right node.
    gap : array, shape (size, points)
        Relative difference of the multipliers of the maps from the known ones.
    """
    size, _, intervals, points = maps.shape
    whole, log_scale = scaled_product(maps)
    finite = np.asarray(np.isfinite(whole).all((0, 1)))
    matrix = np.moveaxis(np.where(finite, whole, np.eye(size)[..., None]), -1, 0)
    multipliers, vectors = np.linalg.eig(matrix.astype(complex))
    mesh_logs = np.where(finite[:, None], np.log(multipliers) + log_scale[:, None], np.nan)
    distance = np.abs(np.expm1(mesh_logs[:, None] - logs.T[:, :, None]))  # (points, known, mesh)
    nearest = np.argmin(np.nan_to_num(distance, nan=np.inf), axis=2)
    gap = np.take_along_axis(distance, nearest[..., None], 2)[..., 0].T
    v = np.take_along_axis(vectors, nearest[:, None], 2).transpose(1, 2, 0)
    w = np.take_along_axis(np.linalg.inv(vectors), nearest[..., None], 1).transpose(2, 1, 0)
    right, left = np.empty((2, size, size, intervals, points), complex)
    for i in range(intervals):
        right[:, :, i] = v
        v = np.einsum("nmb,mjb->njb", maps[:, :, i], v)
        v = v / np.abs(v).max(0)
    for i in reversed(range(intervals)):
        left[:, :, i] = w
        w = np.einsum("nmb,njb->mjb", maps[:, :, i], w)
        w = w / np.abs(w).max(0)
    return right, left, gap


def values_of(orbits: MeshOrbits, *, multipliers: bool) -> ResponseValues:
    """Response of converged orbits, NumPy arrays."""
    points, logs = orbits.numbers.shape[1], orbits.log_multipliers
    if logs is None or not multipliers:
        logs = np.zeros((0, points), complex)
    outcome = np.full(points, int(Outcome.CONVERGED))
    return ResponseValues(orbits.numbers[0].real, orbits.numbers[1:].T, logs.T, outcome)


def add_derivatives(
    table: Float,
    program: Program,
    parameters: Mapping[str, Any],
    orbits: SearchedOrbits,
    names: Collection[str] | None = None,
) -> None:
    """Write `orbit_derivatives` at the orbits of the search into a table of all points.

    The table has the shape (parameters, points, columns).
    """
    equations, harmonics = program.equations, program.harmonics

    def derivatives(problem: Problem, orbit: Orbit, logs: Any) -> Float:
        part = orbit_derivatives(equations, problem, orbit, harmonics, logs, names)
        return np.moveaxis(part, 1, -1)

    for index, on_mesh in orbits.parts:
        numbers = {n: np.asarray(v)[index] for n, v in parameters.items()}
        problem = equations.problem(numbers)
        logs = on_mesh.log_multipliers if program.multipliers else None
        inputs, chunk = (problem, on_mesh.orbit, logs), mesh_chunk(problem.system.size)
        for rows, part in run_chunks(derivatives, inputs, np.arange(len(index)), chunk):
            table[:, index[rows]] = np.moveaxis(part, -1, 1)


def searched_values(parameters: Parameters, wanted: Array, program: Program) -> ResponseValues:
    """Response of the orbits of the search within a program, with first derivatives.

    Second derivatives are NaN. Points that are not wanted have `Outcome.NO_ORBIT`.
    """
    columns, outcome = _columns(program, parameters, wanted)
    return ResponseValues.of_columns(columns, outcome, program.harmonics)


def _searched_response(
    program: Program, parameters: Any, wanted: Array, *, derivatives: bool
) -> tuple[Array, Array, Array]:
    """`_response` as a compiled program calls it, if any point is wanted."""
    (points,), names = wanted.shape, program.equations.names
    count = program.columns
    shapes = (
        jax.ShapeDtypeStruct((points, count), np.dtype(float)),
        jax.ShapeDtypeStruct((points,), np.dtype(np.int64)),
        jax.ShapeDtypeStruct((len(names) * derivatives, points, count), np.dtype(float)),
    )

    def call(parameters: Any, wanted: Any) -> Any:
        values = {n: np.asarray(v) for n, v in parameters.items()}
        # A program of XLA for the CPU that calls another program may deadlock: the search runs in a
        # separate process, which starts at its first use.
        return in_kept_process(_response, program, values, np.asarray(wanted), derivatives)

    def search(parameters: Any) -> Any:
        return jax.pure_callback(call, shapes, parameters, wanted, vmap_method="sequential")

    def nothing(parameters: Any) -> Any:
        columns, outcome, table = (jnp.zeros(s.shape, s.dtype) for s in shapes)
        return columns, outcome + int(Outcome.NO_ORBIT), table

    return jax.lax.cond(wanted.any(), search, nothing, parameters)


def _response(
    program: Program, parameters: dict[str, Float], wanted: Bool, derivatives: bool
) -> tuple[Float, NDArray[np.int64], Float]:
    """Real columns (points, count) of the response, the outcome, and derivatives of the columns.

    The derivatives are of shape (parameters, points, count), without parameters if not requested.
    """
    equations, points, count = program.equations, len(wanted), program.columns
    # The points that fill up a program equal its last point: each point is searched for once.
    index, each = np.flatnonzero(wanted), np.arange(points)
    rows = np.stack(list(parameters.values()))[:, index]
    _, first, of_first = np.unique(rows, axis=1, return_index=True, return_inverse=True)
    each[index] = index[first[of_first]]
    once = wanted & (each == np.arange(points))
    orbits = search_orbits(equations, program.harmonics, parameters, once)
    columns = np.zeros((points, count))
    table = np.zeros((len(equations.names) * derivatives, points, count))
    for index, part in orbits.parts:
        columns[index] = values_of(part, multipliers=program.multipliers).columns
    if derivatives:
        add_derivatives(table, program, parameters, orbits)
    return columns[each], np.asarray(orbits.outcome)[each], table[:, each]


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _columns(program: Program, parameters: Parameters, wanted: Array) -> tuple[Array, Array]:
    """Real columns (points, count) of the response, and the outcome."""
    return _searched_response(program, parameters, wanted, derivatives=False)[:2]


@_columns.defjvp
def _columns_rule(program: Program, primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    parameters, wanted = primals
    fixed = jax.lax.stop_gradient(parameters)
    columns, outcome, table = _searched_response(program, fixed, wanted, derivatives=True)
    # Second derivatives are unknown for both at the points of the search.
    point = sum(only_where(wanted, parameters).values())
    columns, table = _without_derivatives(columns, point), _without_derivatives(table, point)
    names = program.equations.names
    change = sum(table[k] * tangents[0][n][:, None] for k, n in enumerate(names))
    return (columns, outcome), (change, np.zeros(outcome.shape, jax.dtypes.float0))


@jax.custom_jvp
def _without_derivatives(values: Array, point: Array) -> Array:
    """`values` with NaN derivatives where the derivatives of `point`, (points,), are not zero."""
    return values


@_without_derivatives.defjvp
def _without_derivatives_rule(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    values, point = primals
    change = jnp.where(tangents[1] != 0, jnp.nan, 0.0)
    return _without_derivatives(values, point), change[:, None] * jnp.ones_like(values)
