"""A quasi-static orbit as the first guess of an orbit with inertia or radiation damping."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from asperity.loads import Modulation
from asperity.orbit.mesh.mesh import Orbit, evaluate
from asperity.orbit.mesh.scheme import scheme_for
from asperity.slider import Motion, QuasiStatic


def inertial_guess(
    quasi_static: QuasiStatic, system: Motion, load: Modulation, orbit: Orbit
) -> Orbit:
    """A quasi-static orbit as a first guess of another equation of motion."""

    def convert(Y: Array, theta: Array) -> Array:
        at = load.at(theta)
        mechanical = system.mechanical_states(
            quasi_static.friction(Y, at),
            quasi_static.slider_velocity(Y, at),
            quasi_static.log_slip(Y, at),
            at,
        )
        return jnp.stack([*mechanical, *quasi_static.law_state(Y)])

    nodes = convert(orbit.centre[:, None] + orbit.nodes, orbit.mesh[:-1])
    bare = Orbit(orbit.mesh, nodes[:, 0], nodes - nodes[:, :1], orbit.slopes, scheme_for(system))
    theta = bare.stage_phases
    inside, slopes = evaluate(orbit, theta.reshape(-1, theta.shape[-1]))
    states = (orbit.centre[:, None] + inside).reshape(-1, *theta.shape)
    slopes = slopes.reshape(states.shape)
    _, slopes = jax.jvp(convert, (states, theta), (slopes, jnp.ones_like(theta)))
    return bare.moved(slopes=slopes)
