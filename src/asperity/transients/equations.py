"""The integrated equations: an equation of motion with its displacement, under one segment.

At a break point of the programme load or shear force may jump. The mechanical states are
continuous. A slider without mass on elastic asperities is not: the
force is shared anew between spring and asperities, and the slider moves at once by

    dx = -dF / K,

which changes the age as any slip does: the states of a law that depend on the slider's velocity
change by their derivative with respect to displacement times dx. This is the limit of ever
steeper ramps.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity._jax import jit_large
from asperity.arrays import batches
from asperity.loads import Excitation
from asperity.loads.programme.segment import ProgrammeSegment
from asperity.slider import Motion, QuasiStatic, ReversingInertial
from asperity.transients.dense_output import PARTS, StepChunk

#: Lower bound of the relative error of the displacement, above rounding.
_DIGITS = 1e-13

#: Numbers of instants in a call of a compiled program.
_BATCH_SIZES = (64, 1024, 4096)


class Tolerances(NamedTuple):
    """Tolerances of a step.

    Attributes
    ----------
    rtol : float
        Relative error; absolute for states that are logarithms.
    atol : float
        Absolute error of F/W0, v/V and F_i/W.
    """

    rtol: float
    atol: float


class SegmentEquations(eqx.Module):
    """Rates in time of Y = (*states of the motion, x K / W0), x the displacement of the slider.

    Parameters
    ----------
    motion : Motion
        With omega = 1 rad/s, so that its radians are seconds.
    segment : ProgrammeSegment
    ringing : array
        Error of v/V that is tolerated for each unit of error of F_i/W, where the slider's ringing
        on its asperities is left out (`asperity.transients.integration`); 0 where it is resolved.
    """

    motion: Motion
    segment: ProgrammeSegment
    ringing: ArrayLike = 0.0

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

    def scale(self, Y: Array, tolerances: Tolerances) -> Array:
        """Error of a step that counts as 1, shape (size + 1,).

        An error of a logarithm is a relative error already. The displacement, which grows without
        bound, keeps the error of the force as long as its digits allow it.
        """
        free = np.append(self.motion.logarithms, True)
        rtol, atol = tolerances
        scale = jnp.where(free, rtol, atol + rtol * jnp.abs(Y))
        scale = scale.at[-1].max(_DIGITS * jnp.abs(Y[-1]))
        names = self.motion.mechanical
        if "velocity" not in names:
            return scale
        v, friction = names.index("velocity"), names.index("friction")
        return scale.at[v].max(self.ringing * scale[friction])

    def first_length(self, t: Array, Y: Array) -> Array:
        """Length (s) of a first step over which no state changes by much more than a hundredth."""
        slope = jnp.abs(self.rates(self.at(t), Y))[:-1]
        relative = jnp.max(slope / jnp.maximum(jnp.abs(Y[:-1]), 1e-3))
        # No upper limit is needed: a step that is too long is rejected and shortened.
        return 0.01 / jnp.maximum(relative, 1e-30)


class MotionSamples(NamedTuple):
    """Forces and velocities that follow from the states; arrays of shape (n,).

    Attributes
    ----------
    force, load : array
        F/W0 and W/W0.
    velocity, slip : array
        Velocity of the slider and plastic velocity, over V.
    friction : array
        F_i/W.
    reversal_margin : array
        As from `Motion.reversal_margin`; of a law with backward slip F_i/W, which changes its sign
        with the slip.
    unsteadiness : array
        Distance from steady sliding: the larger of the relative deviation of the velocity and the
        largest change of a state while the drive moves by W0/K. NaN while the drive stands still.
    """

    force: np.ndarray
    load: np.ndarray
    velocity: np.ndarray
    slip: np.ndarray
    friction: np.ndarray
    reversal_margin: np.ndarray
    unsteadiness: np.ndarray


def _read(system: SegmentEquations, t: Array, Y: Array) -> Array:
    motion, at, states = system.motion, system.at(t), Y[:-1]
    velocity = motion.slider_velocity(states, at)
    friction = motion.friction(states, at)
    slip = velocity
    if motion.has_elastic_asperities:
        slip = motion.slip_velocity(friction, states, at)
    pull = jnp.where(at.pull != 0, at.pull, jnp.nan)
    change = jnp.abs(motion.rates(states, at) / (motion.kappa * pull)).max(0)
    unsteadiness = jnp.maximum(change, jnp.abs(velocity / pull - 1))
    force = motion.force(states, at)
    # One array: every output of a compiled program costs time.
    margin = friction if motion.signed else motion.reversal_margin(states, at)
    columns = MotionSamples(force, at.w, velocity, slip, friction, margin, unsteadiness)
    return jnp.stack([jnp.broadcast_to(a, t.shape) for a in columns])


_read_points = jit_large(_read)


def motion_samples(system: SegmentEquations, t: np.ndarray, Y: np.ndarray) -> MotionSamples:
    """Evaluate the states `Y`, shape (size + 1, n), at the times `t` of the segment, shape (n,)."""
    parts = [
        np.asarray(_read_points(system, t[index], Y[:, index]))[:, :kept]
        for index, kept in batches(len(t), _BATCH_SIZES)
    ]
    return MotionSamples(*np.concatenate(parts, axis=1))


def step_samples(system: SegmentEquations, chunk: StepChunk) -> MotionSamples:
    """Evaluate the steps of a chunk at `DenseOutput.refined`."""
    columns = np.asarray(_read_steps(system, chunk))
    inner, end = columns[:, : PARTS * int(chunk.taken)], columns[:, -1:]
    return MotionSamples(*np.concatenate([inner, end], axis=1))


@jit_large
def _read_steps(system: SegmentEquations, chunk: StepChunk) -> Array:
    """All steps with their padding, and the end of the last step."""
    shares = jnp.arange(PARTS) / PARTS
    t = chunk.begin[:, None] + chunk.length[:, None] * shares
    powers = jnp.moveaxis(chunk.coefficients, 0, -1)[..., None]
    Y = powers[-1]
    for coefficient in powers[-2::-1]:
        Y = Y * shares + coefficient
    Y = jnp.broadcast_to(Y, (Y.shape[0], *t.shape)).reshape(Y.shape[0], -1)
    t, Y = jnp.append(t.ravel(), chunk.t), jnp.concatenate([Y, chunk.Y[:, None]], axis=1)
    return _read(system, t, Y)


def states_across_break(
    before: SegmentEquations, t: float, after: SegmentEquations, Y: np.ndarray
) -> np.ndarray:
    """States at the beginning of a segment.

    Parameters
    ----------
    before, after : SegmentEquations
        The segment that ends, at its time `t` (s), and the one that begins.
    Y : array, shape (size + 1,)
        States at the end of the former.
    """
    return np.asarray(_between_segments(before, jnp.asarray(t), after, Y))


@jax.jit
def _between_segments(
    before: SegmentEquations, t: Array, after: SegmentEquations, Y: Array
) -> Array:
    return states_after_jump(before.motion, before.at(t), after.at(jnp.zeros(())), Y)


def states_after_jump(motion: Motion, before: Excitation, after: Excitation, Y: Array) -> Array:
    """States after a jump of the excitation."""
    if isinstance(motion, ReversingInertial):
        return Y.at[1].add(motion.friction_jump(Y, before, after))
    if not isinstance(motion, QuasiStatic):
        return Y
    states, law = Y[:-1], motion.slider.law
    jump = motion.force(states, before) - motion.force(states, after)  # x K / W0

    def state_rates(v: Array) -> tuple[Array, ...]:
        return tuple(law.state_rate(v, motion.V, motion.law_state(states), after.w))

    _, per_way = jax.jvp(state_rates, (motion.V,), (jnp.ones_like(motion.V),))
    displacement = jump * motion.slider.W0 / motion.slider.K
    changes = (*(0 * jump for _ in motion.mechanical), *(p * displacement for p in per_way), jump)
    return Y + jnp.stack(jnp.broadcast_arrays(*changes))
