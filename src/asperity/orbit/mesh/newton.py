"""The robust method: collocation with Newton's method on the whole orbit.

On each interval the states are polynomials that obey the equations at four points: those of
Gauss-Legendre, or of Radau IIA where modes decay within an interval. Newton's step is condensed
interval by interval to a transfer map, the maps are tied into a cycle by `asperity.algebra.cyclic`,
and their product is the monodromy matrix. Stable or not makes no difference to it, and neither do
fast and slow directions.

The exponent of the slip rate changes by tens of units within a period, so the step is shortened
until no exponent and no logarithmic state changes by more than a few units.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.algebra.cyclic import solve_cyclic
from asperity.algebra.small_systems import (
    jacobian_columns,
    scaled_product,
    spectral_abscissa,
    spectral_radius,
)
from asperity.loads import Modulation
from asperity.orbit.mesh.condensation import (
    LinearisedEquations,
    condense,
    localise,
    transfer_maps,
)
from asperity.orbit.mesh.mesh import (
    Orbit,
    equidistributed,
    graded_mesh,
)
from asperity.orbit.mesh.scheme import STAGES, scheme_for
from asperity.orbit.newton_step import exponent_change
from asperity.orbit.observables import Observables
from asperity.slider import Motion, QuasiStatic
from asperity.theory.averaged import averaged_limit

#: Modulus of the logarithms of the multipliers below which the mean Jacobian gives them better
#: than the monodromy matrix does: its error is about their square, of the latter the round-off of 1
#: or, of two that are close to each other, the root of that.
_SMALL_EXPONENT = 1e-5


def averaged_orbit(
    system: QuasiStatic, load: Modulation, points: int, *, intervals: int, grading: float
) -> Orbit:
    """The averaged limit as a first guess."""
    orbit = steady_orbit(system, points, intervals=intervals, grading=grading)
    at = load.at(orbit.stage_phases)
    samples = jax.tree.map(lambda a: a.reshape(-1, points) if jnp.ndim(a) else a, at)
    weights = (jnp.asarray(orbit.scheme.b)[:, None, None] * orbit.widths).reshape(-1, points)
    averaged = averaged_limit(system, samples, weights[:, 0] / (2 * jnp.pi))
    return orbit.moved(centre=jnp.stack(averaged.centre))


def steady_orbit(system: Motion, points: int, *, intervals: int, grading: float) -> Orbit:
    """Steady sliding under constant load: the orbit at epsilon = 0."""
    n = system.size
    return Orbit(
        graded_mesh(intervals, points, grading),
        jnp.broadcast_to(system.steady(), (n, points)),
        jnp.zeros((n, intervals, points)),
        jnp.zeros((n, STAGES, intervals, points)),
        scheme_for(system),
    )


def _newton_step(
    system: Motion, load: Modulation, orbit: Orbit
) -> tuple[LinearisedEquations, Array, Array]:
    local = localise(system, load, orbit)
    response, constant = condense(local, orbit, local.rates - orbit.slopes)
    maps = transfer_maps(response, orbit)
    gap = jnp.roll(orbit.nodes, -1, axis=1) - orbit.nodes
    rise = orbit.widths * jnp.einsum("k,nkmb->nmb", orbit.scheme.b, orbit.slopes + constant)
    nodes = solve_cyclic(maps, rise - gap)
    slopes = jnp.einsum("nkcmb,cmb->nkmb", response, nodes) + constant
    return local, nodes, slopes


def swing_change(system: Motion, orbit: Orbit, stages: Array) -> Array:
    """Largest change of a force or velocity at the stages, relative to its swing, (points,)."""
    linear = jnp.array(system.linear)
    # Against round-off where there is hardly any swing: of a force, see its rate.
    swing = jnp.abs(orbit.nodes[linear]).max(1) + 1e-4 * jnp.minimum(system.kappa, 1.0)
    relative = jnp.abs(stages[linear] - stages[linear, :1, :1]).max((1, 2)) / swing
    return relative.max(0)


def newton_update(system: Motion, load: Modulation, orbit: Orbit) -> Orbit:
    """One undamped Newton step: at a converged orbit an identity with the orbit's derivative."""
    _, nodes, slopes = _newton_step(system, load, orbit)
    return orbit.moved(nodes=orbit.nodes + nodes, slopes=orbit.slopes + slopes)


class NewtonResult(NamedTuple):
    """Orbit, last change (inf where it was not finite) and number of steps."""

    orbit: Orbit
    error: Array
    steps: Array


def newton_orbit(
    system: Motion,
    load: Modulation,
    orbit: Orbit,
    *,
    tolerance: float,
    max_steps: int,
    largest_change: float,
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

    def body(carry: tuple) -> tuple:
        orbit, _, steps = carry
        local, nodes, slopes = _newton_step(system, load, orbit)
        stages = nodes[:, None] + orbit.widths * orbit.stage_sums(slopes)
        change = exponent_change(system, local.at, local.states, stages).max((0, 1))
        damping = jnp.minimum(1.0, largest_change / jnp.where(change > 0, change, 1.0))
        nodes = orbit.nodes + damping * nodes
        centre = orbit.centre + nodes[:, 0]
        nodes = nodes - nodes[:, :1]
        slopes = orbit.slopes + damping * slopes
        moved = orbit.moved(centre=centre, nodes=nodes, slopes=slopes)
        error = jnp.maximum(change, swing_change(system, moved, stages))
        return moved, jnp.where(jnp.isfinite(error), error, jnp.inf), steps + 1

    def unfinished(carry: tuple) -> Array:
        return (carry[2] < max_steps) & jnp.any(carry[1] > tolerance)

    start = (orbit, jnp.full(orbit.mesh.shape[1], jnp.inf), 0)
    return NewtonResult(*jax.lax.while_loop(unfinished, body, start))


def refined(system: Motion, load: Modulation, orbit: Orbit, intervals: int) -> Orbit:
    """The orbit on an equidistributed mesh of `intervals` intervals."""
    at = load.at(orbit.stage_phases)
    states = orbit.centre[:, None, None] + orbit.stage_deviations
    _, sensitivity = jacobian_columns(lambda Y: system.log_slip(Y, at)[None], states)
    scales = jnp.stack([jnp.abs(s[0]).mean(0) for s in sensitivity])
    for i in range(system.size):
        if i not in system.linear:
            # Logarithmic states matter on their own, not only through the slip they allow.
            scales = scales.at[i].set(jnp.maximum(scales[i], 1.0))
        else:
            # Slip does not feel every force and velocity: those count beside their own swing.
            swing = jnp.abs(orbit.nodes[i]).max(0) + 1e-4 * jnp.minimum(system.kappa, 1.0)
            scales = scales.at[i].set(jnp.where(scales[i] > 0, scales[i], 1 / swing))
    return equidistributed(orbit, scales, intervals)


def collocation_observables(
    system: Motion, load: Modulation, orbit: Orbit, *, harmonics: int, growth: bool = True
) -> Observables:
    """Observables of a converged orbit; `growth` may be left out as inf."""
    local = localise(system, load, orbit)
    weights = jnp.asarray(orbit.scheme.b)[:, None, None] * orbit.widths / (2 * jnp.pi)
    constant, rest = system.force_split(
        orbit.centre[:, None, None], orbit.stage_deviations, local.at
    )
    theta = orbit.stage_phases
    orders = jnp.arange(1, harmonics + 1)
    phasors = jax.lax.map(
        lambda k: 2 * (weights * rest * jnp.exp(-1j * k * theta)).sum((0, 1)), orders
    )
    mean = constant.reshape(-1) + (weights * rest).sum((0, 1))
    (response,) = condense(local, orbit)
    monodromy, log_scale = scaled_product(transfer_maps(response, orbit))
    trace = jnp.trace(local.jacobian)
    # Of two states it costs next to nothing.
    wanted = growth or system.size <= 2
    # Where rates are so small that the order in which they act does not matter, their mean.
    mean_jacobian = 2 * jnp.pi * (weights * local.jacobian).sum((2, 3))
    small = spectral_radius(mean_jacobian) < _SMALL_EXPONENT
    exponent = jnp.where(small, mean_jacobian, jnp.nan)
    abscissa = spectral_abscissa(local.jacobian) if wanted else jnp.full_like(trace, jnp.inf)
    return Observables(
        mean,
        phasors,
        monodromy,
        log_scale,
        2 * jnp.pi * (weights * trace).sum((0, 1)),
        exponent,
        2 * jnp.pi * (weights * abscissa).sum((0, 1)),
        orbit.start,
    )
