"""Draws from the posterior of a fit by the No-U-Turn sampler, with one process for each chain.

Sampler and warm-up are blackjax's (Hoffman and Gelman, 2014; the windows of Stan), on the whitened
density. Every chain has a separate key: the draws do not depend on the number of processes.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, wait
from functools import partial
from importlib.util import find_spec
from typing import Annotated, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity._processes import available_cores, process_pool
from asperity.arrays import Float
from asperity.errors import InputError, require, symbol
from asperity.inference.fitting.result import Fit
from asperity.inference.posterior.density import Whitened
from asperity.inference.posterior.posterior import Posterior, Transitions, posterior_of
from asperity.outputs import Interrupted
from asperity.parameters.arguments import at_least, counted, typed

#: Logarithm of a density as a function of z and of arrays.
LogDensity = Callable[[Array, Any], Array]

#: Draws of the warm-up, and of each block; progress is reported after a block.
WARM_UP, BLOCK = 300, 50
#: Spread of the first positions, in standard deviations of the normal approximation.
_OVERDISPERSED = 2.0
#: Number of random positions that are tried until the law has a solution.
_TRIES = 100
#: Largest number of draws of all chains, including the warm-up: 320 MB for ten parameters.
_MOST_DRAWS = 4_000_000
#: Time (s) between two calls of `progress` while no block ends.
_REPORT_INTERVAL = 0.5

#: State of a chain as arrays: key data of the next block, position with density and gradient, step
#: size, and inverse mass matrix.
ChainState = tuple[Any, Any, Any, Any]


@typed
def sample_posterior(
    fit: Fit,
    *,
    chains: int = 4,
    draws: int = 1000,
    seed: Annotated[int, at_least(0)] = 0,
    jobs: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Posterior:
    """Sample the posterior of a fit by the No-U-Turn sampler.

    Parameters
    ----------
    fit : Fit
        A converged fit. Its priors are used; parameters without a prior are uniform as in
        `Coordinates`.
    chains, draws : int
        At least 2 chains, for R-hat, and 100 draws each after the warm-up; draws are rounded up
        to whole blocks of 50.
    seed : int
        The same seed gives the same draws, whatever `jobs`.
    jobs : int, optional
        Number of processes; by default one per chain, at most the number of cores.
    progress : callable, optional
        Called with the numbers of finished and of all draws, including the warm-up, after each
        block and twice a second; an exception in it ends the sampling.

    Returns
    -------
    Posterior

    Raises
    ------
    InputError
        If the extra ``bayes`` is not installed, the fit has not converged, or a number is too
        small.
    Interrupted
        On Ctrl-C.
    """
    require_bayes()
    advice = "a posterior is sampled from its maximum on"
    require(fit.converged, "fit", "have converged", f"'{fit.message}'", advice)
    require(
        fit.parameters,
        "posterior",
        "be of free parameters",
        "none",
        f"free one, such as {symbol('A')}",
    )
    require_sizes(chains, draws)
    whitened = Whitened.of(fit)
    density, data = whitened.compiled()
    blocks = -(-draws // BLOCK)
    kept: list[list[Transitions]] = [[] for _ in range(chains)]
    report = counted(progress, chains * (WARM_UP + blocks * BLOCK))
    try:
        report(0)
        # One thread per process: the order of sums depends on the number of threads.
        with process_pool(min(jobs or available_cores(), chains), "jobs") as pool:
            waiting = {
                pool.submit(
                    warmed_up, density, data, *_first_position(whitened, seed, chain)
                ): chain
                for chain in range(chains)
            }
            while waiting:
                finished = wait(waiting, timeout=_REPORT_INTERVAL, return_when=FIRST_COMPLETED).done
                drawn = 0
                for future in finished:
                    chain = waiting.pop(future)
                    state, transitions = future.result()
                    if transitions is not None:
                        kept[chain].append(transitions)
                    drawn += WARM_UP if transitions is None else BLOCK
                    if len(kept[chain]) < blocks:
                        waiting[pool.submit(next_block, density, data, state)] = chain
                report(drawn)
    except KeyboardInterrupt:
        raise Interrupted() from None
    return posterior_of(fit, whitened, kept, seed=seed)


@typed
def require_sizes(
    chains: Annotated[int, at_least(2)], draws: Annotated[int, at_least(100)]
) -> None:
    """Refuse too few chains and draws, and more draws than fit into memory.

    Raises
    ------
    InputError
    """
    each = WARM_UP + -(-draws // BLOCK) * BLOCK
    rule = f"be {_MOST_DRAWS} at most, those of the warm-up included"
    got = f"{chains} chains of {each}"
    require(not chains * each > _MOST_DRAWS, "chains times draws", rule, got, "ask for fewer")


def _first_position(whitened: Whitened, seed: int, chain: int) -> tuple[Any, Float]:
    """Key of a chain, and its first position, from a density wider than the posterior."""
    key = jax.random.fold_in(jax.random.key(seed), chain)
    rng = np.random.default_rng([seed, chain])
    spread = _OVERDISPERSED
    for _ in range(_TRIES):
        z = spread * rng.normal(size=whitened.mode.size)
        if np.isfinite(whitened.log_density(z)[0]):
            return np.asarray(jax.random.key_data(key)), z
        spread *= 0.9
    rule = f"have a first position for chain {chain + 1}"
    got = f"none in {_TRIES} draws about the estimate: the law has no solution there"
    raise InputError("posterior", rule, got, "fix parameters or give priors")


def warmed_up(log_density: LogDensity, data: Any, key: Any, z: Float) -> tuple[ChainState, None]:
    """State of a chain after the warm-up, whose draws are discarded.

    Parameters
    ----------
    log_density : callable
        The density; the same object is compiled once.
    data : pytree of arrays
    key : uint32 array
        Key data of the chain.
    z : array, shape (n,)
        First position.
    """
    return jax.tree.map(np.asarray, _warm_up(data, key, z, log_density=log_density)), None


def next_block(
    log_density: LogDensity, data: Any, state: ChainState
) -> tuple[ChainState, Transitions]:
    """The next `BLOCK` draws of a chain."""
    return jax.tree.map(np.asarray, _block(data, state, log_density=log_density))


@partial(jit_large, static_argnames=("log_density",))
def _warm_up(data: Any, key: Any, z: Any, *, log_density: LogDensity) -> ChainState:
    import blackjax

    adaptation = blackjax.window_adaptation(
        blackjax.nuts,
        finite_density(log_density, data),
        is_mass_matrix_diagonal=False,
        initial_step_size=0.8 * z.size**-0.25,
    )
    later, now = jax.random.split(jax.random.wrap_key_data(key))
    (state, result), _ = adaptation.run(now, z, WARM_UP)
    return jax.random.key_data(later), state, result["step_size"], result["inverse_mass_matrix"]


@partial(jit_large, static_argnames=("log_density",))
def _block(
    data: Any, state: ChainState, *, log_density: LogDensity
) -> tuple[ChainState, Transitions]:
    import blackjax

    kernel = blackjax.nuts.build_kernel()
    density = finite_density(log_density, data)
    *begin, step_size, metric = state

    def draw(carry: Any, _: None) -> tuple[Any, Transitions]:
        key, now = jax.random.split(jax.random.wrap_key_data(carry[0]))
        after, info = kernel(now, carry[1], density, step_size, metric)
        ends = info.trajectory_leftmost_state, info.trajectory_rightmost_state
        failed = jnp.logical_or(*(~jnp.isfinite(end.logdensity) for end in ends))
        return (jax.random.key_data(key), after), Transitions(
            after.position,
            after.logdensity,
            info.acceptance_rate,
            info.num_integration_steps,
            info.is_divergent,
            failed,
            info.energy,
        )

    end, transitions = jax.lax.scan(draw, tuple(begin), None, length=BLOCK)
    return (*end, step_size, metric), transitions


def finite_density(log_density: LogDensity, data: Any) -> Callable[[Array], Array]:
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


def require_bayes() -> None:
    """Refuse to sample without the packages of the extra ``bayes``.

    Raises
    ------
    InputError
        If a package is missing; the message names it.
    """
    missing = [name for name in ("blackjax", "arviz_stats", "arviz_base") if not find_spec(name)]
    rule, got = "have the extra 'bayes' installed", f"no {', '.join(missing)}"
    require(not missing, "posterior", rule, got, "install it by: pip install 'asperity[bayes]'")
