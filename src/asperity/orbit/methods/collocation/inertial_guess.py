"""A quasi-static orbit as the first guess of an orbit with inertia or radiation damping."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.orbit.mesh.mesh import Orbit, evaluate
from asperity.orbit.mesh.scheme import scheme_for
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem


@jit_large
def _converted(problem: Problem, states: Array, slopes: Array, theta: Array) -> tuple[Array, Array]:
    """States of the problem from quasi-static ones, (size, ..., points), and their slopes."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)

    def convert(Y: Array, theta: Array) -> Array:
        at = load.at(theta)
        mechanical = system.mechanical_states(
            quasi_static.friction(Y, at),
            quasi_static.slider_velocity(Y, at),
            quasi_static.log_slip(Y, at),
            at,
        )
        return jnp.stack([*mechanical, *quasi_static.law_state(Y)])

    return jax.jvp(convert, (states, theta), (slopes, jnp.ones_like(theta)))


def inertial_guess(problem: Problem, orbit: Orbit) -> Orbit:
    """A quasi-static orbit as a first guess of another equation of motion, NumPy arrays."""
    theta = np.concatenate([orbit.mesh[None, :-1], orbit.stage_phases])
    inside, slopes = evaluate(orbit, theta.reshape(-1, theta.shape[-1]))
    shape = (len(inside), *theta.shape)
    sliding = orbit.centre[:, None, None] + inside.reshape(shape)
    converted = _converted(problem, sliding, slopes.reshape(shape), theta)
    states, slopes = (np.asarray(a) for a in converted)
    nodes = states[:, 0]
    return Orbit(
        orbit.mesh,
        nodes[:, 0],
        nodes - nodes[:, :1],
        slopes[:, 1:],
        scheme_for(problem.system),
    )
