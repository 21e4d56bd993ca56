"""The equations that are marched: an equation of motion, its displacement, and a segment."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.loads import Excitation
from asperity.loads.programme_segments import Segment
from asperity.slider import Motion, QuasiStatic
from asperity.solve.transients.pieces import PARTS, Chunk

#: Instants that one call of a compiled program reads: as many as there are, or a few more.
ROOMS = (64, 1024, 4096)


class System(eqx.Module):
    """Rates in time of Y = (*states of the motion, x K / W0), x the displacement of the slider.

    Parameters
    ----------
    motion : Motion
        With omega = 1 rad/s, so that its radians are seconds.
    segment : Segment
    """

    motion: Motion
    segment: Segment

    def at(self, t: Array) -> Excitation:
        """Excitation at the time `t` (s) of the segment."""
        return self.segment.at(t, self.motion.slider.W0, self.motion.V)

    def motion_rates(self, at: Excitation, Y: Array) -> tuple[Array, Array]:
        """Rates of the motion's states, and of x K / W0; no rate depends on x."""
        motion = self.motion
        rates = motion.rates(Y, at)
        if isinstance(motion, QuasiStatic):
            x_rate = motion.kappa * motion.slider_velocity(Y, at)
        else:
            # The first state is the spring force: dF/dt = K (V p - v).
            x_rate = motion.kappa * at.pull - rates[0]
        return rates, x_rate

    def rates(self, at: Excitation, Y: Array) -> Array:
        """dY/dt (1/s), same shape as Y, (size + 1, ...)."""
        rates, x_rate = self.motion_rates(at, Y[:-1])
        return jnp.concatenate([rates, jnp.broadcast_to(x_rate, rates.shape[1:])[None]])

    def scale(self, Y: Array, rtol: Array, atol: Array) -> Array:
        """Error of a step that counts as 1, shape (size + 1,).

        An error of a logarithm is a relative error already. The displacement, which grows without
        bound, keeps the error of the force.
        """
        free = np.ones(self.motion.size + 1, bool)
        free[list(self.motion.linear)] = False
        return jnp.where(free, rtol, atol + rtol * jnp.abs(Y))

    def first_length(self, t: Array, Y: Array) -> Array:
        """A step (s) over which no state changes by much more than a hundredth of itself."""
        slope = jnp.abs(self.rates(self.at(t), Y))[:-1]
        relative = jnp.max(slope / jnp.maximum(jnp.abs(Y[:-1]), 1e-3))
        # Too long a step is made again, shorter: the limit comes from elsewhere.
        return 0.01 / jnp.maximum(relative, 1e-30)


class Reading(NamedTuple):
    """What is read off the states; arrays of shape (n,).

    Attributes
    ----------
    force, load : array
        F/W0 and W/W0.
    velocity, slip : array
        Velocity of the slider and plastic velocity, over V.
    friction : array
        F_i/W.
    unrest : array
        How far steady sliding is: relative, the largest deviation of the velocity and change of a
        state while the drive goes on by W0/K. NaN while nothing pulls.
    """

    force: np.ndarray
    load: np.ndarray
    velocity: np.ndarray
    slip: np.ndarray
    friction: np.ndarray
    unrest: np.ndarray


def _read(system: System, t: Array, Y: Array) -> Array:
    motion, at, states = system.motion, system.at(t), Y[:-1]
    law = motion.slider.law
    velocity = motion.slider_velocity(states, at)
    if isinstance(motion, QuasiStatic):
        friction = motion.friction(states, at)
    elif "friction" in motion.mechanical:
        friction = states[motion.mechanical.index("friction")]
    else:
        friction = law.friction(motion.V * velocity, motion.law_state(states), at.w)
    elastic = isinstance(motion, QuasiStatic) or "friction" in motion.mechanical
    slip = motion.slip_velocity(friction, states, at) if elastic else velocity
    speed = jnp.where(at.pull > 0, at.pull, jnp.nan)
    change = jnp.abs(motion.rates(states, at)).max(0) / (motion.kappa * speed)
    unrest = jnp.maximum(change, jnp.abs(velocity / speed - 1))
    force = motion.force(states, at)
    # In one array: each that leaves a compiled program costs time of its own.
    columns = Reading(force, at.w, velocity, slip, friction, unrest)
    return jnp.stack([jnp.broadcast_to(a, t.shape) for a in columns])


_read_points = jax.jit(_read)


def read(system: System, t: np.ndarray, Y: np.ndarray) -> Reading:
    """Read the states `Y`, shape (size + 1, n), at the times `t` of the segment, shape (n,)."""
    parts = []
    most = next((room for room in ROOMS if len(t) <= room), ROOMS[-1])
    for i in range(0, max(len(t), 1), most):
        # The last instant again, where there are none left: one program for any number.
        part = np.minimum(np.arange(i, i + most), len(t) - 1)
        parts.append(np.asarray(_read_points(system, t[part], Y[:, part]))[:, : len(t) - i])
    return Reading(*np.concatenate(parts, axis=1))


def read_steps(system: System, chunk: Chunk) -> Reading:
    """Read the steps of a chunk at `Pieces.refined`."""
    inner, end = jax.device_get(_read_steps(system, chunk))
    return Reading(*np.concatenate([inner[:, : PARTS * int(chunk.taken)], end], axis=1))


@jax.jit
def _read_steps(system: System, chunk: Chunk) -> tuple[Array, Array]:
    shares = jnp.arange(PARTS) / PARTS
    t = chunk.begin[:, None] + chunk.length[:, None] * shares
    powers = jnp.moveaxis(chunk.coefficients, 0, -1)[..., None]
    Y = powers[-1]
    for coefficient in powers[-2::-1]:
        Y = Y * shares + coefficient
    Y = jnp.broadcast_to(Y, (Y.shape[0], *t.shape)).reshape(Y.shape[0], -1)
    return _read(system, t.ravel(), Y), _read(system, chunk.t[None], chunk.Y[:, None])
