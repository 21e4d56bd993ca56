"""Fit, posterior and comparison of one recording of 10,000 samples, compared with other programs.

    python -m benchmarks.recording_fits [--samples 10000] [--draws 1000] [--without-peers]

Two velocity steps by SciPy, with noise of the coverage benchmark; free are A, B, D0, K and the
times of the two steps. Besides asperity, the rows are:

- SciPy's `least_squares` with differences over SciPy's integration and the noise of asperity's fit,
  started 10 % from the truth; asperity has no start;
- emcee with the density of asperity; left out if it is not installed.

"Off" and the effective draws are those of `benchmarks.fits`; times of samplers include compilation,
as there. asperity's chains run in one process for each core.
"""

from __future__ import annotations

import argparse
import importlib
from dataclasses import replace

import jax
import numpy as np
from scipy.optimize import least_squares

from asperity.inference import Fit, compare, fit
from asperity.inference.posterior.density import Whitened
from benchmarks.coverage import CASES, LOAD, STIFFNESS, TRUTH, integrated, runs_of
from benchmarks.fits import asperity_draws, off, print_samplers, timed

FREE = ("A", "B", "D0", "K")
LAWS = ("rice-ruina", "ruina-slip", "perrin-rice-zheng", "nagata")


def recorded(result: Fit, values: dict[str, float]) -> np.ndarray:
    """Friction of the ageing law at the samples of a fit, by SciPy."""
    (term,) = result.objective.terms
    run = term.run
    numbers = {**term.fixed, **values, "alpha": 0.0, "k": values["K"] / run.W0}
    changes = [
        run.drive.edges[edge] + values[f"step_time_{k}"] for k, edge in enumerate(run.cuts, 1)
    ]
    edges = [0.0, *changes, run.time[-1]]
    return integrated(numbers, edges, run.velocities, run.time, tolerance=1e-10)


def scipy_fit(result: Fit) -> dict[str, float]:
    """Least squares with the noise and the priors of asperity's fit, by forward differences."""
    (term,) = result.objective.terms
    (model,) = term.models
    sizes = {n: TRUTH.get(n, STIFFNESS * LOAD) for n in FREE}
    unknowns = {k.name: k for k in result.objective.unknowns}
    times = [n for n in result.values if n not in FREE]

    def named(u: np.ndarray) -> dict[str, float]:
        logs = {n: s * np.exp(x) for (n, s), x in zip(sizes.items(), u, strict=False)}
        return logs | {n: unknowns[n].scale * x for n, x in zip(times, u[len(FREE) :], strict=True)}

    def residuals(u: np.ndarray) -> np.ndarray:
        values = named(u)
        white = model.whiten((recorded(result, values) - term.run.friction)[:, None])[:, 0]
        white -= term.basis @ (term.basis.T @ white)
        priors = [(values[n] - unknowns[n].prior.mean) / unknowns[n].prior.sd for n in times]
        return np.concatenate([white, priors])

    start = np.concatenate([np.full(len(FREE), 0.1), np.zeros(len(times))])
    return named(least_squares(residuals, start, diff_step=1e-5, x_scale="jac").x)


def emcee_draws(result: Fit, draws: int) -> np.ndarray:
    """Draws of 32 walkers about the fit in its whitened coordinates; (walkers, draws, n)."""
    emcee = importlib.import_module("emcee")
    whitened = Whitened.of(result)
    density, data = whitened.compiled()
    compiled = jax.jit(lambda z: density(z, data))
    rng = np.random.default_rng(1)
    n = len(result.values)
    sampler = emcee.EnsembleSampler(32, n, lambda z: float(np.nan_to_num(compiled(z), nan=-np.inf)))
    sampler.run_mcmc(0.5 * rng.normal(size=(32, n)), draws + draws // 2)
    u = whitened.u_of(np.moveaxis(sampler.get_chain(discard=draws // 2), 0, 1))
    values = [k.to_value(u[..., i]) for i, k in enumerate(result.objective.unknowns)]
    return np.stack([values[list(result.values).index(n)] for n in FREE], axis=-1)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recording_fits")
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--draws", type=int, default=1000)
    parser.add_argument("--without-peers", action="store_true")
    chosen = parser.parse_args()
    case = replace(CASES["steps"], rate=chosen.samples / CASES["steps"].end)
    runs = list(runs_of(case, 2))
    print("| method | time (s) | off (standard errors) | effective draws | of a second |")
    print("|---|---|---|---|---|")
    for k, run in enumerate(runs):
        first, _ = timed(lambda run=run: fit(run, "rice-ruina", FREE))
        seconds, result = timed(lambda run=run: fit(run, "rice-ruina", FREE))
        print(
            f"| asperity fit, noise {k + 1} (the first {first:.1f} s) | {seconds:.2f} | 0 | | |",
            flush=True,
        )
    free = [*FREE, "c"]
    seconds, comparison = timed(lambda: compare(runs[-1], LAWS, free))
    name = f"asperity compare, four laws, best {comparison.best}"
    print(f"| {name} | {seconds:.0f} | | | |", flush=True)
    samplers = {"asperity posterior": lambda: asperity_draws(result, FREE, chosen.draws)}
    if not chosen.without_peers:
        seconds, values = timed(lambda: scipy_fit(result))
        name = "SciPy least_squares, differences"
        print(f"| {name} | {seconds:.0f} | {off(values, result):.0e} | | |", flush=True)
        samplers["emcee, same density"] = lambda: emcee_draws(result, chosen.draws)
    print_samplers(samplers, result, FREE)


if __name__ == "__main__":
    main()
