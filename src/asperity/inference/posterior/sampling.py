"""Draws from the posterior of a fit: chains in processes of their own, block by block.

Every finished block of a chain is kept with the state that the next one goes on from. An
interrupted run goes on there and gives the same draws as one that was not interrupted, whatever
the number of processes.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.inference.fitting.result import Fit
from asperity.inference.posterior.density import DensityData, Whitened
from asperity.inference.posterior.nuts import (
    BLOCK,
    WARM_UP,
    ChainState,
    Transitions,
    first_state,
    run_block,
    warmed_up,
)
from asperity.inference.posterior.posterior import Posterior, posterior_of
from asperity.inference.posterior.prior_density import PriorDensity
from asperity.orbit.search import available_cores
from asperity.outputs import Interrupted, UnfinishedText

Float = NDArray[np.float64]

#: Spread of the first positions, in standard deviations of the normal approximation.
_OVERDISPERSED = 2.0
#: Tries for a first position at which the law has a solution.
_TRIES = 100
#: Most draws of all chains, warm-up included: of ten parameters they take 320 MB.
_MOST_DRAWS = 4_000_000
#: Time (s) between two calls of `progress` while no block ends.
_ASK = 0.5
#: One thread for XLA and for linear algebra in each process.
_ONE_THREAD = {"NPROC": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def sample_posterior(
    found: Fit,
    *,
    chains: int = 4,
    draws: int = 1000,
    seed: int = 0,
    jobs: int | None = None,
    unfinished: Path | None = None,
    resume: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Posterior:
    """Sample the posterior of a fit by the No-U-Turn sampler.

    Parameters
    ----------
    found : Fit
        Converged. Its priors hold; parameters without one are uniform as `PriorDensity` says.
    chains, draws : int
        At least 2 chains, for R-hat, and 100 draws each after the warm-up; draws are rounded up
        to whole blocks of 50.
    seed : int
        The same seed gives the same draws, whatever `jobs` and interruptions.
    jobs : int, optional
        Processes; by default one a chain, at most the cores of this machine.
    unfinished : Path, optional
        Finished blocks are kept beside this file until all are done.
    resume : bool
        Go on with what an interrupted run has kept there.
    progress : callable, optional
        Called with finished and all draws, those of the warm-up included, at each block and twice
        a second; an exception of it ends the sampling.

    Returns
    -------
    Posterior

    Raises
    ------
    InputError
        If the extra ``bayes`` is not installed, the fit has not converged, a number is too small,
        or what is to be resumed belongs to another run.
    Interrupted
        On Ctrl-C.
    """
    require_bayes()
    if not found.converged:
        raise InputError(
            f"fit must have converged, got '{found.message}'; a posterior is sampled from its "
            "maximum on"
        )
    if not found.parameters:
        raise InputError("posterior must be of free parameters, got none; free one, such as A")
    require_sizes(chains, draws)
    whitened = whitened_posterior(found)
    blocks = WARM_UP + -(-draws // BLOCK)
    report = progress or (lambda done, total: None)
    density, data = whitened.compiled()
    store = _Store(unfinished, _inputs(found, whitened, data, chains, draws, seed), resume)
    # The same to the last digit as where an interrupted run began.
    whitened = store.whitening(whitened)
    data = data._replace(mode=whitened.mode, root=whitened.root)
    runs = [_Chain(whitened, seed, chain, store.blocks(chain)) for chain in range(chains)]
    done = sum(len(run.kept) for run in runs)
    report(done * BLOCK, chains * blocks * BLOCK)
    jobs = min(jobs or available_cores(), chains)
    try:
        with _submitting(jobs) as submit:

            def go_on(run: _Chain) -> Future:
                return submit(run_block, density, data, run.state, adapting=run.warming)

            waiting = {go_on(run): run for run in runs if len(run.kept) < blocks}
            while waiting:
                finished = wait(waiting, timeout=_ASK, return_when=FIRST_COMPLETED).done
                if not finished:
                    report(done * BLOCK, chains * blocks * BLOCK)
                for future in finished:
                    run = waiting.pop(future)
                    state, transitions = future.result()
                    run.take(state, transitions)
                    store.add(run.number, run.state, transitions)
                    done += 1
                    report(done * BLOCK, chains * blocks * BLOCK)
                    if len(run.kept) < blocks:
                        waiting[go_on(run)] = run
    except KeyboardInterrupt:
        kept = f"{done * BLOCK} of {chains * blocks * BLOCK} draws" if done and unfinished else ""
        raise Interrupted(kept) from None
    posterior = posterior_of(found, whitened, [r.kept[WARM_UP:] for r in runs], seed=seed)
    store.discard()
    return posterior


def require_sizes(chains: int, draws: int) -> None:
    """Refuse too few chains and draws, and more than can be computed and kept.

    Raises
    ------
    InputError
    """
    for name, value, least in (("chains", chains, 2), ("draws", draws, 100)):
        if value < least:
            raise InputError(f"{name} must be at least {least}, got {value}; ask for more")
    blocks = WARM_UP + -(-draws // BLOCK)
    if chains * blocks * BLOCK > _MOST_DRAWS:
        raise InputError(
            f"chains times draws must be {_MOST_DRAWS} at most, those of the warm-up included, "
            f"got {chains} chains of {blocks * BLOCK}; ask for fewer"
        )


def whitened_posterior(found: Fit) -> Whitened:
    """The posterior of a fit, whitened at its mode."""
    objective = found.objective
    u = objective.coordinates(found.values)
    sd = np.array(
        [
            min(abs(p.se / k.slope(p.value)) if np.isfinite(p.se) and p.value else 1.0, 1.0)
            for k, p in zip(objective.unknowns, found.parameters.values(), strict=True)
        ]
    )
    prior = PriorDensity.about(objective.unknowns, u, sd)
    return Whitened.at(objective, prior, u, sd)


class _Chain:
    """A chain with its finished blocks."""

    def __init__(
        self,
        whitened: Whitened,
        seed: int,
        number: int,
        kept: list[tuple[ChainState, Transitions]],
    ) -> None:
        self.number = number
        self.kept: list[Transitions] = []
        self._draws: list[Float] = []
        self.state = kept[-1][0] if kept else _overdispersed(whitened, seed, number)
        for _, transitions in kept:
            self.kept.append(transitions)
            if len(self.kept) <= WARM_UP:
                self._draws.append(transitions.z)
                # The kept states already have the metric; this brings the list of draws along.
                self._draws = warmed_up(self.state, self._draws, len(self.kept))[1]

    @property
    def warming(self) -> bool:
        """Whether the next block belongs to the warm-up."""
        return len(self.kept) < WARM_UP

    def take(self, state: ChainState, transitions: Transitions) -> None:
        """Add a block."""
        warming = self.warming
        self.kept.append(transitions)
        if warming:
            self._draws.append(transitions.z)
            state, self._draws = warmed_up(state, self._draws, len(self.kept))
        self.state = state


def _overdispersed(whitened: Whitened, seed: int, chain: int) -> ChainState:
    """First state of a chain, drawn wider than the posterior."""
    rng = np.random.default_rng([seed, chain])
    spread = _OVERDISPERSED
    for _ in range(_TRIES):
        z = spread * rng.normal(size=whitened.mode.size)
        value, gradient = whitened.log_density(z)
        if np.isfinite(value):
            return first_state(seed, chain, z, value, gradient)
        spread *= 0.9
    raise InputError(
        f"posterior must have a first position for chain {chain + 1}, got none in {_TRIES} draws "
        "about the estimate: the law has no solution there; fix parameters or give priors"
    )


class _Store:
    """Finished blocks of all chains, as lines of JSON; in memory only without a file."""

    def __init__(self, path: Path | None, inputs: dict[str, Any], resume: bool) -> None:
        self._file = None if path is None else UnfinishedText(path, inputs)
        self._blocks: dict[int, list[tuple[ChainState, Transitions]]] = {}
        self._whitening: dict[str, Float] = {}
        if self._file is None:
            return
        self._file.start(resume)
        for line in self._file.text().splitlines():
            record = json.loads(line)
            if "mode" in record:
                self._whitening = {n: np.array(v) for n, v in record.items()}
                continue
            state = ChainState(**{n: _array(v) for n, v in record["state"].items()})
            kept = Transitions(**{n: _array(v) for n, v in record["transitions"].items()})
            self._blocks.setdefault(record["chain"], []).append((state, kept))

    def whitening(self, whitened: Whitened) -> Whitened:
        """The whitening that finished blocks have, or this one where there are none."""
        if self._whitening:
            return replace(whitened, mode=self._whitening["mode"], root=self._whitening["root"])
        if self._file is not None:
            record = {"mode": whitened.mode.tolist(), "root": whitened.root.tolist()}
            self._file.append(json.dumps(record) + "\n", 0)
        return whitened

    def blocks(self, chain: int) -> list[tuple[ChainState, Transitions]]:
        return self._blocks.get(chain, [])

    def add(self, chain: int, state: ChainState, transitions: Transitions) -> None:
        if self._file is not None:
            record = {"chain": chain, "state": _plain(state), "transitions": _plain(transitions)}
            self._file.append(json.dumps(record) + "\n", 1)

    def discard(self) -> None:
        if self._file is not None:
            self._file.discard()


def _plain(parts: ChainState | Transitions) -> dict[str, Any]:
    return {
        name: {"dtype": str(np.asarray(a).dtype), "values": np.asarray(a).tolist()}
        for name, a in parts._asdict().items()
    }


def _array(record: dict[str, Any]) -> Any:
    return np.array(record["values"], dtype=record["dtype"])


def _inputs(
    found: Fit, whitened: Whitened, data: DensityData, chains: int, draws: int, seed: int
) -> dict[str, Any]:
    """What the draws depend on, as a record of an unfinished run."""
    digest = hashlib.sha256()
    for array in jax.tree.leaves(data.terms):
        # A recording's noise is estimated anew, and the same but for the last digits.
        digest.update(np.asarray(array, np.float32).tobytes())
    return {
        "law": found.law,
        "prior": whitened.prior.record(),
        "data": digest.hexdigest(),
        "chains": chains,
        "draws": draws,
        "seed": seed,
    }


@contextmanager
def _submitting(jobs: int) -> Iterator[Callable[..., Future]]:
    """Submit work to processes with one thread each: the order of sums depends on threads."""
    from loky import ProcessPoolExecutor

    executor = ProcessPoolExecutor(max_workers=jobs, env=_ONE_THREAD)
    finished = False
    try:
        yield executor.submit
        finished = True
    finally:
        executor.shutdown(wait=finished, kill_workers=not finished)


def require_bayes() -> None:
    """Refuse to go on without the packages that sample and diagnose.

    Raises
    ------
    InputError
        Naming what is missing.
    """
    missing = [name for name in ("blackjax", "arviz_stats", "arviz_base") if not find_spec(name)]
    if missing:
        raise InputError(
            f"posterior must have the extra 'bayes' installed, got no {', '.join(missing)}; "
            "install it by: pip install 'asperity[bayes]'"
        )
