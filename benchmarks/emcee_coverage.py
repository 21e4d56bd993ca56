"""Coverage of emcee's posterior under white noise, over the recordings of `benchmarks.coverage`.

    python -m benchmarks.emcee_coverage [--sets 100] [--steps 300]

Published programs sample this posterior: that of asperity with white noise of the size of the
residuals, here by 32 walkers that start at its mode. The shares of central 68 and 95 % intervals
that contain the truth are printed for velocity steps, which `benchmarks.coverage` fits too.
"""

from __future__ import annotations

import argparse

import jax
import numpy as np

from asperity.inference import RunOptions, fit
from asperity.inference.posterior.density import Whitened
from benchmarks.coverage import CASES, TRUE, runs_of

WALKERS = 32
#: Shares of the draws below the ends of central intervals of 68 and 95 %.
ENDS = [0.158655, 0.841345, 0.025, 0.975]


def main() -> None:
    """Print the shares."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.emcee_coverage")
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--steps", type=int, default=300)
    chosen = parser.parse_args()
    try:
        import emcee
    except ModuleNotFoundError as absent:
        raise SystemExit(f"not installed: {absent.name}") from None
    inside = {name: np.zeros(2) for name in TRUE}
    program = jax.jit(lambda density, z, data: density(z, data), static_argnums=0)
    for k, run in enumerate(runs_of(CASES["steps"], chosen.sets)):
        options = RunOptions(order=0)
        result = fit(run, "rice-ruina", ["A", "B", "D0"], start=TRUE, starts=4, runs=options)
        whitened = Whitened.of(result)
        density, data = whitened.compiled()
        random = np.random.default_rng(k)
        sampler = emcee.EnsembleSampler(
            WALKERS,
            len(result.values),
            lambda z, density=density, data=data: float(
                np.nan_to_num(program(density, z, data), nan=-np.inf)
            ),
        )
        # The whitened posterior has unit variance about its mode.
        sampler.run_mcmc(random.normal(size=(WALKERS, len(result.values))), chosen.steps)
        u = whitened.u_of(sampler.get_chain(discard=chosen.steps // 3, flat=True))
        for i, unknown in enumerate(result.objective.unknowns):
            if unknown.name in TRUE:
                low, high, lowest, highest = np.quantile(unknown.to_value(u[:, i]), ENDS)
                truth = TRUE[unknown.name]
                inside[unknown.name] += [low <= truth <= high, lowest <= truth <= highest]
    for name, counts in inside.items():
        print(f"{name:3} 68 %: {100 * counts[0] / chosen.sets:5.1f}", end="  ")
        print(f"95 %: {100 * counts[1] / chosen.sets:5.1f}")


if __name__ == "__main__":
    main()
