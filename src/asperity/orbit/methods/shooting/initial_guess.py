"""Where shooting starts: the averaged limit of a slider that swings on its asperities.

While the joint sticks, spring force f and slider obey

    dv/dtheta = m (f - w g - d v),      dg/dtheta = s v - c (g - <g>),

g = F_i/W, m the mobility, d the damping, s the strain, c a mean relaxation by slip. Under
w = 1 + eps cos(theta) the harmonics of g = f G follow from a three-term recurrence, whose minimal
solution is a continued fraction. The averaged limit under the load 1/G, which asks the same
friction of the contacts, then gives f and the states of the law.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.loads import Excitation, Harmonic
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem
from asperity.theory.averaged import averaged_limit

#: Samples of the load for the averaged limit, and harmonics of G.
_NODES, _HARMONICS = 48, 12

#: G below this is beyond a resonance with the modulation itself, where the start means nothing.
_LEAST = 0.2


@jit_large
def averaged_start(problem: Problem) -> tuple[Array, Array]:
    """First states of shooting, (size, points), and the fastest relaxation by slip, per radian."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    theta = 2 * np.pi * np.arange(_NODES)[:, None] / _NODES
    points = jnp.ones(jax.tree.leaves(problem)[0].shape[-1])
    at = load.at(jnp.asarray(theta))
    w, velocity = at.w * points, jnp.zeros((_NODES, 1))
    softening = _softening(problem, points)
    if isinstance(load, Harmonic):
        swing, velocity_swing = _elastic_swing(problem, system.strain * softening, theta)
        usable = (swing > _LEAST).all(0)
        # Without inertia the joint carries z / (w + l): the load under which that is z G / (1 + l).
        ratio = quasi_static.compliance_ratio
        w = jnp.where(usable, (1 + ratio) / jnp.where(usable, swing, 1.0) - ratio, w)
        velocity = jnp.where(usable, velocity_swing, 0.0)
    centre = averaged_limit(quasi_static, at._replace(w=w), np.full(_NODES, 1 / _NODES)).centre
    Y = jnp.stack(centre)[:, None]
    force = quasi_static.force(Y, Excitation(points)) + 0 * w
    friction = quasi_static.friction(Y, Excitation(w))
    mechanical = force + system.damping, 1 + velocity * force, friction
    states = jnp.stack(jnp.broadcast_arrays(*mechanical, *quasi_static.law_state(Y)))
    # The states of the law follow the elastic motion, by a small amount.
    orders = np.arange(1, _NODES // 2)[:, None]
    integral = -2 / _NODES * (np.sin(orders * theta[:, 0]) / orders).sum(0)
    n = len(system.mechanical)
    law_states = states[n:, 0] + jnp.einsum("k,nkb->nb", integral, system.rates(states, at)[n:])
    relaxation = system.strain * softening * jnp.exp(system.log_slip(states, at)).max(0)
    return jnp.concatenate([states[:n, 0], law_states]), relaxation


def _softening(problem: Problem, points: Array) -> Array:
    """Change of ln(v_pl) with F_i/W in steady sliding, (points,)."""
    system = problem.system
    steady = jnp.broadcast_to(system.steady(), (system.size, len(points)))
    carried = jnp.zeros_like(steady).at[system.mechanical.index("friction")].set(1.0)
    return jax.jvp(lambda Y: system.log_slip(Y, Excitation(points)), (steady,), (carried,))[1]


def _elastic_swing(problem: Problem, relaxation: Array, theta: np.ndarray) -> tuple[Array, Array]:
    """G and the part of v/V that follows f, over f, at the phases `theta`, (nodes, points)."""
    system, half = problem.system, 0.5 * problem.load.epsilon
    ratios: list[Array] = []  # of a harmonic to the one before, highest first
    last = jnp.zeros_like(relaxation, dtype=complex)
    for n in range(_HARMONICS, 0, -1):
        inertia = (1j * n / system.mobility + system.damping) * (1j * n + relaxation)
        last = -half / (1 + inertia / system.strain + half * last)
        ratios.append(last)
    harmonic = 1 / (1 + 2 * half * last.real) + 0j
    swing, velocity = harmonic.real, 0.0
    for n, ratio in enumerate(reversed(ratios), 1):
        harmonic = harmonic * ratio
        wave = 2 * harmonic * np.exp(1j * n * theta)
        swing = swing + wave.real
        velocity = velocity + ((1j * n + relaxation) * wave).real
    return swing, velocity / system.strain
