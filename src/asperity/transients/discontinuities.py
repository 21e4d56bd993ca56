"""States across a break point of the programme, where load or shear force may jump.

The mechanical states are continuous. A slider without mass on elastic asperities is not: the
force is shared anew between spring and asperities, and the slider moves at once by

    dx = -dF / K,

which changes the age as any slip does: the states of a law that depend on the slider's velocity
change by their derivative with respect to displacement times dx. This is the limit of ever
steeper ramps.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.loads import Excitation
from asperity.slider import Motion, QuasiStatic, ReversingInertial
from asperity.transients.equations import SegmentEquations


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

    def state_rates(v: Array) -> Array:
        rates = law.state_rate(v, motion.V, motion.law_state(states), after.w)
        return jnp.stack(jnp.broadcast_arrays(*rates))

    _, per_way = jax.jvp(state_rates, (motion.V,), (jnp.ones_like(motion.V),))
    way = jump * motion.slider.W0 / motion.slider.K
    jumps = jnp.concatenate([jnp.zeros(len(motion.mechanical)), per_way * way, jump[None]])
    return Y + jumps
