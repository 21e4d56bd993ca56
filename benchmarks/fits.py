"""Fits and posteriors of one lock-in table, compared with other programs.

    python -m benchmarks.fits [--rows 60] [--draws 1000] [--without-scipy]

A table of mean, mu1 and mu2 by the elasto-plastic law with the parameters of Bureau et al. (2000),
computed by SciPy's integration of the published equations, with 1 % noise; free are A, B, D0,
lambda and eps_ratio, with a prior of D0. Besides asperity, the rows are:

- SciPy's `least_squares` with differences over that integration, started 10 % from the truth;
  asperity has no start;
- emcee and numpyro with the response of asperity, as with SciPy's integration they would take
  hours; they are left out if they are not installed.

"Off" is the largest distance from the parameters of asperity's fit, or from the means of its
posterior, in standard errors. The effective draws are the smaller number of bulk and tail. Times
are wall times, to be measured on an idle machine; those of samplers include compilation.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable, Iterable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

import asperity as asp
from asperity.inference import Fit, Prior, fit, sample_posterior, table_of
from benchmarks.cases import FREQUENCY, dimensionless
from benchmarks.scipy_shooting import solve_numbers

PAPER = asp.materials.load("bureau2000")
LAW = "elasto-plastic"
#: Free parameters and their true values in SI, and those that are fixed.
TRUTH = {"A": 0.013, "B": 0.026, "D0": 4e-7, "lambda": 6.2e-7, "eps_ratio": 0.5}
FIXED = {"mu0": 0.5, "V0": 1e-6, "K": 2e5, "W0": 7.0}
NOISE = 0.01
#: Far above D0 the likelihood is flat, so that samplers without bounds need a prior.
PRIOR = {"D0": Prior(mean=4e-7, sd=2e-7, source="benchmark")}
COLUMNS = ("mean_friction", "mu1", "mu2")


def integrated(inputs: dict[str, np.ndarray], free: dict[str, float]) -> np.ndarray:
    """Mean, mu1 and mu2 by integration, shape (3, rows)."""
    p = FIXED | free
    numbers = {n: p[n] for n in ("mu0", "A", "B", "D0", "V0")}
    law = asp.laws.ElastoPlastic(**numbers, lambda_=p["lambda"])
    epsilon = p["eps_ratio"] * inputs["epsilon"]
    answer = solve_numbers(dimensionless(law, p["K"] / p["W0"], inputs["V"], epsilon), 1e-9)
    return np.stack([answer.mean, answer.mu1, answer.mu2])


def measured(rows: int) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Inputs, readings and their errors, (3, rows)."""
    rng = np.random.default_rng(14)
    inputs = {
        "V": rng.choice([3e-7, 1e-6, 3e-6], rows),
        "epsilon": rng.uniform(0.05, 0.5, rows),
        "frequency": np.full(rows, FREQUENCY),
    }
    exact = integrated(inputs, TRUTH)
    errors = NOISE * exact
    return inputs, exact + errors * rng.normal(size=exact.shape), errors


def scipy_fit(inputs: dict, readings: np.ndarray, errors: np.ndarray) -> dict[str, float]:
    """Least squares in the logarithms, with forward differences."""

    def residuals(u: np.ndarray) -> np.ndarray:
        free = dict(zip(TRUTH, np.exp(u), strict=True))
        gaps = [(free[name] - prior.mean) / prior.sd for name, prior in PRIOR.items()]
        return np.concatenate([((integrated(inputs, free) - readings) / errors).ravel(), gaps])

    start = np.log(list(TRUTH.values())) + 0.1
    minimum = least_squares(residuals, start, diff_step=1e-5, method="lm")
    return dict(zip(TRUTH, np.exp(minimum.x), strict=True))


def log_density(inputs: dict, readings: np.ndarray, errors: np.ndarray) -> Callable[[Any], Any]:
    """Log density of the posterior in the logarithms of parameters, with asperity's response."""
    response = asp.response_function(LAW, search=False)

    def density(u: Any) -> Any:
        free = {name: jnp.exp(u[..., i]) for i, name in enumerate(TRUTH)}
        shape = (*u.shape[:-1], len(inputs["V"]))
        given = {name: free[name][..., None] for name in TRUTH if name != "eps_ratio"}
        given |= {"epsilon": free["eps_ratio"][..., None] * inputs["epsilon"]}
        given |= {"V": inputs["V"], "frequency": inputs["frequency"], "M": 0.0, **FIXED}
        flat = {n: jnp.broadcast_to(v, shape).reshape(-1) for n, v in given.items()}
        values = response(flat)
        model = jnp.stack([values.mean_friction, *jnp.abs(values.harmonics.T)])
        gap = (model.reshape(3, *shape) - readings.reshape(3, *(1,) * (u.ndim - 1), -1)) / (
            errors.reshape(3, *(1,) * (u.ndim - 1), -1)
        )
        total = -0.5 * (gap**2).sum((0, -1))
        for name, prior in PRIOR.items():
            # Flat in the logarithm, except for parameters with a prior, which is normal in them.
            total += jnp.log(free[name]) - 0.5 * ((free[name] - prior.mean) / prior.sd) ** 2
        return jnp.where(jnp.isfinite(total), total, -jnp.inf)

    return density


def emcee_draws(density: Callable, result: Fit, draws: int) -> np.ndarray:
    """Draws of 32 walkers around the fit, after half as many to warm up; (walkers, draws, n)."""
    emcee = importlib.import_module("emcee")
    rng = np.random.default_rng(1)
    centre = np.log([result.parameters[name].value for name in TRUTH])
    spread = [result.parameters[name].se / result.parameters[name].value for name in TRUTH]
    start = centre + 0.5 * np.array(spread) * rng.normal(size=(32, len(TRUTH)))
    compiled = jax.jit(density)
    sampler = emcee.EnsembleSampler(
        32, len(TRUTH), lambda u: np.asarray(compiled(u)), vectorize=True
    )
    sampler.run_mcmc(start, draws + draws // 2)
    return np.exp(np.moveaxis(sampler.get_chain(discard=draws // 2), 0, 1))


def numpyro_draws(density: Callable, result: Fit, draws: int) -> np.ndarray:
    """Draws of four chains from the fit, after half as many to warm up; (4, draws, n)."""
    infer = importlib.import_module("numpyro.infer")
    centre = np.log([result.parameters[name].value for name in TRUTH])
    sampler = infer.NUTS(potential_fn=lambda u: -density(u), dense_mass=True)
    chains = infer.MCMC(
        sampler,
        num_warmup=draws // 2,
        num_samples=draws,
        num_chains=4,
        chain_method="sequential",
        progress_bar=False,
    )
    chains.run(jax.random.PRNGKey(2), init_params=jnp.tile(centre, (4, 1)))
    return np.exp(np.asarray(chains.get_samples(group_by_chain=True)))


def asperity_draws(result: Fit, names: Iterable[str], draws: int, **options: Any) -> np.ndarray:
    """Draws of four chains by asperity; (4, draws, n)."""
    posterior = sample_posterior(result, chains=4, draws=draws, **options)
    return np.stack([posterior.draws[name] for name in names], axis=-1)


def effective(draws: np.ndarray) -> float:
    """Smallest effective sample size of bulk and tail over parameters; draws (chains, draws, n)."""
    ess = importlib.import_module("arviz_stats.base").array_stats.ess
    methods = {"bulk": {}, "tail": {"prob": (0.05, 0.95)}}
    return float(
        min(
            ess(column, chain_axis=0, draw_axis=1, method=method, **more)
            for column in np.moveaxis(draws, -1, 0)
            for method, more in methods.items()
        )
    )


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Wall time and result: chains of asperity run in other processes."""
    began = time.perf_counter()
    result = run()
    return time.perf_counter() - began, result


def off(values: dict[str, float], result: Fit) -> float:
    """Largest distance from the fit in standard errors."""
    return max(abs(values[n] - p.value) / p.se for n, p in result.parameters.items() if n in values)


def print_samplers(
    samplers: dict[str, Callable[[], np.ndarray]], result: Fit, names: Iterable[str]
) -> None:
    """Print a row of the table for each sampler, whose draws have the shape (chains, draws, n)."""
    reference = None
    for name, sample in samplers.items():
        try:
            seconds, draws = timed(sample)
        except ModuleNotFoundError as absent:
            print(f"| {name} | not installed: {absent.name} | | | |")
            continue
        means = draws.mean((0, 1))
        reference = means if reference is None else reference
        gap = max(
            abs(m - r) / result.parameters[n].se
            for n, m, r in zip(names, means, reference, strict=True)
        )
        count = effective(draws)
        print(
            f"| {name}, {draws.shape[0]} x {draws.shape[1]} | {seconds:.1f} | {gap:.2f} | "
            f"{count:.0f} | {count / seconds:.0f} |",
            flush=True,
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fits", description=__doc__)
    parser.add_argument("--rows", type=int, default=60)
    parser.add_argument("--draws", type=int, default=1000)
    parser.add_argument("--without-scipy", action="store_true")
    chosen = parser.parse_args()
    data = inputs, readings, errors = measured(chosen.rows)
    columns = dict(zip(COLUMNS, readings, strict=True))
    columns |= {f"{name}_err": e for name, e in zip(COLUMNS, errors, strict=True)}
    table = table_of(inputs | columns)
    print("| method | time (s) | off (standard errors) | effective draws | of a second |")
    print("|---|---|---|---|---|")

    def fitted() -> Fit:
        return fit(table, LAW, list(TRUTH), fixed=FIXED, prior=PRIOR)

    first, _ = timed(fitted)
    seconds, result = timed(fitted)
    print(f"| asperity fit (the first {first:.1f} s) | {seconds:.2f} | 0 | | |", flush=True)
    if not chosen.without_scipy:
        seconds, values = timed(lambda: scipy_fit(*data))
        name = "SciPy least_squares, differences"
        print(f"| {name} | {seconds:.0f} | {off(values, result):.0e} | | |", flush=True)
    density = log_density(*data)
    samplers: dict[str, Callable[[], np.ndarray]] = {
        "asperity posterior": lambda: asperity_draws(result, TRUTH, chosen.draws, jobs=1),
        "numpyro, same density": lambda: numpyro_draws(density, result, chosen.draws),
        "emcee, same density": lambda: emcee_draws(density, result, chosen.draws),
    }
    print_samplers(samplers, result, TRUTH)


if __name__ == "__main__":
    main()
