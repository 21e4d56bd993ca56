"""The robust method: Gauss-Legendre collocation with Newton's method on the whole orbit.

On each interval the states are polynomials that obey the equations at four Gauss points. Newton's
step is condensed interval by interval to a transfer map, the maps are tied into a cycle by
`asperity.solve.cyclic`, and their product is the monodromy matrix. Stable or not makes no
difference to it, and neither do fast and slow directions.

The exponent of the slip rate changes by tens of units within a period, so the step is shortened
until no exponent and no logarithmic state changes by more than a few units.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.solve.averaged import averaged_states
from asperity.solve.cyclic import solve_cyclic
from asperity.solve.linear import jacobian_columns
from asperity.solve.mesh import (
    GAUSS_A,
    GAUSS_B,
    STAGES,
    Orbit,
    equidistributed,
    graded_mesh,
    stage_sums,
)


def averaged_orbit(system, load, points: int, *, intervals: int, grading: float) -> Orbit:
    """The averaged limit as a first guess."""
    orbit = steady_orbit(system, points, intervals=intervals, grading=grading)
    w = load.load(orbit.stage_phases).reshape(-1, points)
    weights = (jnp.asarray(GAUSS_B)[:, None, None] * orbit.widths).reshape(-1, points)
    return orbit._replace(centre=averaged_states(system, w, weights / (2 * jnp.pi)))


def steady_orbit(system, points: int, *, intervals: int, grading: float) -> Orbit:
    """Steady sliding under constant load: the orbit at epsilon = 0."""
    n = system.size
    return Orbit(
        graded_mesh(intervals, points, grading),
        jnp.broadcast_to(system.steady(), (n, points)),
        jnp.zeros((n, intervals, points)),
        jnp.zeros((n, STAGES, intervals, points)),
    )


class _Local(NamedTuple):
    """The equations at the collocation points."""

    w: Array
    states: Array
    rates: Array
    jacobian: Array  # (row, column, STAGES, intervals, points)


def _localise(system, load, orbit: Orbit) -> _Local:
    theta = orbit.stage_phases
    w, w_slope = load.load(theta), load.slope(theta)
    states = orbit.centre[:, None, None] + orbit.stage_deviations
    rates, columns = jacobian_columns(lambda Y: system.rates(Y, w, w_slope), states)
    return _Local(w, states, rates, jnp.stack(columns, axis=1))


def _condense(local: _Local, orbit: Orbit) -> tuple[Array, Array]:
    """Slopes at the stages as a linear function of the state at the left node.

    Returns the matrix (n, STAGES, n, intervals, points) and the constant part
    (n, STAGES, intervals, points) of the change of the slopes.
    """
    n, stages, intervals, points = local.rates.shape
    m = n * stages
    per_stage = jnp.transpose(local.jacobian, (0, 2, 1, 3, 4))  # (row, stage, column, ...)
    coupling = per_stage[:, :, :, None] * GAUSS_A[None, :, None, :, None, None]
    matrix = jnp.eye(m).reshape(n, stages, n, stages)[..., None, None] - orbit.widths * coupling
    right = jnp.concatenate([per_stage, (local.rates - orbit.slopes)[:, :, None]], axis=2)
    matrix = matrix.reshape(m, m, intervals, points).transpose(2, 3, 0, 1)
    right = right.reshape(m, n + 1, intervals, points).transpose(2, 3, 0, 1)
    solution = jnp.linalg.solve(matrix, right).transpose(2, 3, 0, 1)
    solution = solution.reshape(n, stages, n + 1, intervals, points)
    return solution[:, :, :n], solution[:, :, n]


def _transfer_maps(response: Array, widths: Array) -> Array:
    identity = jnp.eye(response.shape[0])[:, :, None, None]
    return identity + widths * jnp.einsum("k,nkcmb->ncmb", GAUSS_B, response)


def _newton_step(system, load, orbit: Orbit) -> tuple[_Local, Array, Array]:
    local = _localise(system, load, orbit)
    response, constant = _condense(local, orbit)
    maps = _transfer_maps(response, orbit.widths)
    gap = jnp.roll(orbit.nodes, -1, axis=1) - orbit.nodes
    rise = orbit.widths * jnp.einsum("k,nkmb->nmb", GAUSS_B, orbit.slopes + constant)
    nodes = solve_cyclic(maps, rise - gap)
    slopes = jnp.einsum("nkcmb,cmb->nkmb", response, nodes) + constant
    return local, nodes, slopes


class NewtonResult(NamedTuple):
    """Orbit, last change (inf where it was not finite) and number of steps."""

    orbit: Orbit
    error: Array
    steps: Array


def newton_orbit(
    system, load, orbit: Orbit, *, tolerance: float, max_steps: int, largest_change: float
) -> NewtonResult:
    """Newton's method from the guess `orbit`.

    Parameters
    ----------
    system, load
        Parameters of shape (points,).
    orbit : Orbit
    tolerance : float
        On the last change: of the slip exponent and the logarithmic states absolutely, of the
        force relative to its own swing. Convergence is quadratic, so the error is
        about the square of that.
    max_steps : int
    largest_change : float
        Bound on the change of an exponent or logarithmic state in one step.
    """

    def body(carry) -> tuple:
        orbit, _, steps = carry
        local, nodes, slopes = _newton_step(system, load, orbit)
        stages = nodes[:, None] + orbit.widths * stage_sums(slopes)
        _, exponent = jax.jvp(lambda Y: system.log_slip(Y, local.w), (local.states,), (stages,))
        change = jnp.maximum(
            jnp.abs(exponent).max((0, 1)), jnp.abs(stages[1:]).max((0, 1, 2), initial=0.0)
        )
        damping = jnp.minimum(1.0, largest_change / jnp.where(change > 0, change, 1.0))
        nodes = orbit.nodes + damping * nodes
        centre = orbit.centre + nodes[:, 0]
        nodes = nodes - nodes[:, :1]
        moved = Orbit(orbit.mesh, centre, nodes, orbit.slopes + damping * slopes)
        swing = jnp.abs(moved.nodes[0]).max(0)
        relative = jnp.abs(stages[0] - stages[0, :1, :1]).max((0, 1)) / (swing + 1e-300)
        error = jnp.maximum(change, jnp.where(swing > 0, relative, 0.0))
        return moved, jnp.where(jnp.isfinite(error), error, jnp.inf), steps + 1

    def unfinished(carry) -> Array:
        return (carry[2] < max_steps) & jnp.any(carry[1] > tolerance)

    start = (orbit, jnp.full(orbit.mesh.shape[1], jnp.inf), 0)
    return NewtonResult(*jax.lax.while_loop(unfinished, body, start))


def refined(system, load, orbit: Orbit, intervals: int) -> Orbit:
    """The orbit on an equidistributed mesh of `intervals` intervals."""
    w = load.load(orbit.stage_phases)
    states = orbit.centre[:, None, None] + orbit.stage_deviations
    _, sensitivity = jacobian_columns(lambda Y: system.log_slip(Y, w)[None], states)
    scales = jnp.stack([jnp.abs(s[0]).mean(0) for s in sensitivity])
    # Logarithmic states matter on their own, not only through the slip they allow.
    scales = scales.at[1:].set(jnp.maximum(scales[1:], 1.0))
    return equidistributed(orbit, scales, intervals)


class CollocationResponse(NamedTuple):
    """What is read off an orbit; F/W0 = mean + sum Re(c_n e^{i n theta}).

    `monodromy` times exp(`log_scale`) is the monodromy matrix; `log_determinant` is the
    integral of the trace of the Jacobian (Liouville), free of cancellation; `growth` is
    the integral of the largest real part of the eigenvalues of the Jacobian.
    """

    mean_friction: Array
    harmonics: Array
    monodromy: Array
    log_scale: Array
    log_determinant: Array
    growth: Array


def collocation_response(system, load, orbit: Orbit, *, harmonics: int) -> CollocationResponse:
    """Mean, harmonics and monodromy of a converged orbit."""
    local = _localise(system, load, orbit)
    weights = jnp.asarray(GAUSS_B)[:, None, None] * orbit.widths / (2 * jnp.pi)
    constant, rest = system.force_split(
        orbit.centre[:, None, None], orbit.stage_deviations, local.w
    )
    theta = orbit.stage_phases
    phasors = [
        2 * (weights * rest * jnp.exp(-1j * k * theta)).sum((0, 1)) for k in range(1, harmonics + 1)
    ]
    mean = constant.reshape(-1) + (weights * rest).sum((0, 1))
    response, _ = _condense(local, orbit)
    monodromy, log_scale = _scaled_product(_transfer_maps(response, orbit.widths))
    trace = jnp.trace(local.jacobian)
    return CollocationResponse(
        mean,
        jnp.stack(phasors),
        monodromy,
        log_scale,
        2 * jnp.pi * (weights * trace).sum((0, 1)),
        2 * jnp.pi * (weights * _largest_growth(local.jacobian)).sum((0, 1)),
    )


def _scaled_product(maps: Array) -> tuple[Array, Array]:
    """Product of the maps around the cycle, kept near unit size, and the log of its scale."""
    n, _, _, points = maps.shape

    def multiply(carry, T: Array) -> tuple:
        product, log_scale = carry
        product = jnp.einsum("ijb,jkb->ikb", T, product)
        size = jnp.abs(product).max((0, 1))
        size = jnp.where(size > 0, size, 1.0)
        return (product / size, log_scale + jnp.log(size)), None

    identity = jnp.broadcast_to(jnp.eye(n)[:, :, None], (n, n, points))
    start = (identity, jnp.zeros(points))
    return jax.lax.scan(multiply, start, jnp.moveaxis(maps, 2, 0))[0]


def _largest_growth(jacobian: Array) -> Array:
    """Largest real part of the eigenvalues of (n, n, ...) Jacobians."""
    if jacobian.shape[0] == 1:
        return jacobian[0, 0]
    if jacobian.shape[0] == 2:
        (a, b), (c, d) = jacobian
        square = 0.25 * (a - d) ** 2 + b * c
        return 0.5 * (a + d) + jnp.sqrt(jnp.maximum(square, 0.0))
    eigenvalues = jnp.linalg.eigvals(jnp.moveaxis(jacobian, (0, 1), (-2, -1)))
    return eigenvalues.real.max(-1)
