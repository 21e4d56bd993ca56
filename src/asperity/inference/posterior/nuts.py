"""The No-U-Turn sampler on a whitened density, in blocks that can be interrupted and resumed.

blackjax's kernel (Hoffman and Gelman, 2014; multinomial, iterative) in one compiled program, which
serves warm-up and sampling: step size, metric and position are its arguments. What a chain goes on
from is a `ChainState`, which has its own key: blocks of the same chain give the same draws
whenever they are computed.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity._jax import jit_large

Float = NDArray[np.float64]

#: Draws of a block, and blocks of the warm-up.
BLOCK, WARM_UP = 50, 6
#: Blocks of the warm-up after which the metric is set by the draws since the block before.
_METRIC_AFTER = (2, 5)
#: Mean acceptance of a trajectory that the warm-up aims for.
_TARGET = 0.8
#: Largest number of doublings of a trajectory.
_DOUBLINGS = 10
#: Constants of dual averaging (Hoffman and Gelman, 2014).
_T0, _GAMMA, _KAPPA = 10.0, 0.05, 0.75


class ChainState(NamedTuple):
    """Where a chain is, all as arrays.

    Attributes
    ----------
    key : uint32 array
        Data of the key of the next block.
    z, log_density, gradient : array
        Whitened position, of shape (n,), log density there and its gradient.
    log_step, log_step_mean, error : array, shape ()
        Of dual averaging: logarithm of the step size, its mean, mean shortfall of acceptance.
    centre : array, shape ()
        What dual averaging draws the logarithm of the step size to.
    count : array, shape ()
        Draws since dual averaging began.
    metric : array, shape (n, n)
        Inverse mass matrix.
    """

    key: Any
    z: Any
    log_density: Any
    gradient: Any
    log_step: Any
    log_step_mean: Any
    error: Any
    centre: Any
    count: Any
    metric: Any


class Transitions(NamedTuple):
    """What is kept of each draw of a block.

    Attributes
    ----------
    z : array, shape (draws, n)
    log_density : array, shape (draws,)
    acceptance : array, shape (draws,)
        Mean over the trajectory.
    steps : int array, shape (draws,)
        Evaluations of the gradient.
    diverging : bool array, shape (draws,)
        Whether the energy rose by more than 1000.
    failed : bool array, shape (draws,)
        Whether the trajectory ended where the density could not be computed.
    energy : array, shape (draws,)
    """

    z: Any
    log_density: Any
    acceptance: Any
    steps: Any
    diverging: Any
    failed: Any
    energy: Any


def first_state(seed: int, chain: int, z: Float, log_density: float, gradient: Float) -> ChainState:
    """State of a chain before its warm-up.

    Parameters
    ----------
    seed, chain : int
        Chains of the same seed draw independently.
    z, log_density, gradient
        As of `ChainState`.
    """
    key = jax.random.fold_in(jax.random.key(seed), chain)
    state = ChainState(
        key=np.asarray(jax.random.key_data(key)),
        z=np.asarray(z, float),
        log_density=np.asarray(log_density, float),
        gradient=np.asarray(gradient, float),
        log_step=np.zeros(()),
        log_step_mean=np.zeros(()),
        error=np.zeros(()),
        centre=np.zeros(()),
        count=np.zeros(()),
        metric=np.eye(len(z)),
    )
    return _restarted(state, float(np.log(0.8 * len(z) ** -0.25)))


def _restarted(state: ChainState, log_step: float) -> ChainState:
    """The state with dual averaging at its beginning."""
    zero = np.zeros(())
    return state._replace(
        log_step=np.asarray(log_step),
        log_step_mean=zero,
        error=zero,
        centre=np.asarray(log_step + np.log(2.0)),
        count=zero,
    )


def warmed_up(state: ChainState, draws: list[Float], block: int) -> tuple[ChainState, list[Float]]:
    """State after a block of the warm-up, and the draws that the metric is yet to be set by.

    Parameters
    ----------
    state : ChainState
    draws : list of array, shape (BLOCK, n)
        Of the warm-up since the metric was set.
    block : int
        Number of blocks of the warm-up that are done.
    """
    if block in _METRIC_AFTER:
        z = np.concatenate(draws[len(draws) // 2 :])
        count, n = z.shape
        sample = np.cov(z.T).reshape(n, n)
        # As Stan does: few draws are pulled towards the metric that the whitening stands for.
        weight = count / (count + 5.0 * n)
        metric = weight * sample + (1 - weight) * np.eye(n)
        state = _restarted(state._replace(metric=metric), float(state.log_step_mean))
        draws = []
    if block == WARM_UP:
        state = state._replace(log_step=state.log_step_mean)
    return state, draws


def run_block(
    log_density: Callable[[Array, Any], Array], data: Any, state: ChainState, *, adapting: bool
) -> tuple[ChainState, Transitions]:
    """The next `BLOCK` draws of a chain.

    Parameters
    ----------
    log_density : callable
        Of z and `data`; the same object for the same program.
    data : pytree of arrays
    state : ChainState
    adapting : bool
        Whether the step size follows the acceptance.
    """
    state, transitions = _block(data, state, jnp.asarray(adapting), log_density=log_density)
    return jax.tree.map(np.asarray, state), jax.tree.map(np.asarray, transitions)


@partial(jit_large, static_argnames=("log_density",))
def _block(
    data: Any,
    state: ChainState,
    adapting: Array,
    *,
    log_density: Callable[[Array, Any], Array],
) -> tuple[ChainState, Transitions]:
    from blackjax.mcmc import hmc, nuts

    kernel = nuts.build_kernel()
    density = finite_density(log_density, data)

    def draw(state: ChainState, _: None) -> tuple[ChainState, Transitions]:
        key, now = jax.random.split(jax.random.wrap_key_data(state.key))
        before = hmc.HMCState(state.z, state.log_density, state.gradient)
        after, info = kernel(
            now, before, density, jnp.exp(state.log_step), state.metric, _DOUBLINGS
        )
        ends = info.trajectory_leftmost_state, info.trajectory_rightmost_state
        failed = jnp.logical_or(*(~jnp.isfinite(end.logdensity) for end in ends))
        state = state._replace(
            key=jax.random.key_data(key),
            z=after.position,
            log_density=after.logdensity,
            gradient=after.logdensity_grad,
        )
        state = jax.tree.map(
            lambda new, old: jnp.where(adapting, new, old),
            _averaged(state, info.acceptance_rate),
            state,
        )
        return state, Transitions(
            after.position,
            after.logdensity,
            info.acceptance_rate,
            info.num_integration_steps,
            info.is_divergent,
            failed,
            info.energy,
        )

    return jax.lax.scan(draw, state, None, length=BLOCK)


def _averaged(state: ChainState, acceptance: Array) -> ChainState:
    """One step of dual averaging."""
    count = state.count + 1
    share = 1 / (count + _T0)
    error = (1 - share) * state.error + share * (_TARGET - acceptance)
    log_step = state.centre - jnp.sqrt(count) / _GAMMA * error
    weight = count**-_KAPPA
    mean = weight * log_step + (1 - weight) * state.log_step_mean
    return state._replace(count=count, error=error, log_step=log_step, log_step_mean=mean)


def finite_density(
    log_density: Callable[[Array, Any], Array], data: Any
) -> Callable[[Array], Array]:
    """The density as a function of z alone: minus infinity, with gradient 0, where it is NaN."""

    @jax.custom_vjp
    def density(z: Array) -> Array:
        return forward(z)[0]

    def forward(z: Array) -> tuple[Array, Array]:
        value, gradient = jax.value_and_grad(log_density)(z, data)
        good = jnp.isfinite(value) & jnp.isfinite(gradient).all()
        return jnp.where(good, value, -jnp.inf), jnp.where(good, gradient, 0.0)

    density.defvjp(forward, lambda gradient, change: (change * gradient,))
    return density
