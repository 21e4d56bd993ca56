"""Coverage of the intervals of fits to lock-in tables, compared with the usual least squares.

    python -m benchmarks.table_coverage [--sets 200] [--posterior 40]

Synthetic tables of two velocities and eight amplitudes each, from the elasto-plastic law with the
numbers of Bureau et al. (2000), with normal noise in the mean and in both parts of each harmonic.
Five parameters are free. A row of the result has the share of intervals that contain the truth,
over all parameters, and the lowest share of a parameter.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import norm

import asperity as asp
from asperity.inference import fit, sample_posterior, table_of
from asperity.inference.fitting.description import described_fit

TRUTH = {"A": 0.013, "B": 0.026, "D0": 4e-7, "lambda": 7e-7, "eps_ratio": 0.48}
V = np.repeat([1e-6, 1e-5], 8)
EPSILON = np.tile(np.linspace(0.05, 0.5, 8), 2)
FREQUENCY = 120.0
MEAN, HARMONIC = 1e-3, 2e-5
#: Correlation of the real part of the first harmonic with the mean, in the second case.
SHARED = 0.8
LEVELS = (math.erf(1 / math.sqrt(2)), 0.95)


def exact_response(material):
    slider = asp.Slider(material.law("elasto-plastic"), spring=material.K, load=material.W0)
    response = asp.periodic_response(
        slider, velocity=V, epsilon=TRUTH["eps_ratio"] * EPSILON, frequency=FREQUENCY
    )
    return (
        response.delta_mu,
        response.mu1 * np.exp(1j * response.phase1),
        response.mu2 * np.exp(1j * response.phase2),
    )


def noisy_table(exact, rng, shared, *, correlated):
    """A table; with `correlated`, it has the covariance of the mean and the first harmonic."""
    drop, *harmonics = exact
    common = rng.normal(size=V.size)
    columns = {"V": V, "epsilon": EPSILON, "frequency": FREQUENCY}
    columns |= {"delta_mu": drop + MEAN * common, "delta_mu_err": MEAN}
    for n, c in enumerate(harmonics, 1):
        noise = rng.normal(size=(2, V.size))
        if n == 1:
            noise[0] = shared * common + math.sqrt(1 - shared**2) * noise[0]
        c = c + HARMONIC * (noise[0] + 1j * noise[1])
        columns |= {f"mu{n}": np.abs(c), f"mu{n}_err": HARMONIC}
        columns |= {f"phase{n}": np.angle(c), f"phase{n}_err": HARMONIC / np.abs(c)}
        if n == 1 and correlated:
            along = np.cos(np.angle(c)) * shared * MEAN * HARMONIC
            across = -np.sin(np.angle(c)) * shared * MEAN * HARMONIC / np.abs(c)
            columns |= {"delta_mu_mu1_cov": along, "delta_mu_phase1_cov": across}
    return table_of(columns)


def by_fit(objective):
    """Intervals of the normal approximation at the minimum next to the truth."""
    u = objective.coordinates(TRUTH)
    result = described_fit(objective, [objective.minimise(u)], profile=False)
    return {n: (p.interval_68, p.interval_95) for n, p in result.parameters.items()}


def by_moduli(objective):
    """Least squares of moduli with equal weights in each column and white noise of unknown size.

    The covariance is scaled by the residuals, and intervals are symmetric in the parameter.
    """
    (term,) = objective.terms
    table = term.table
    size = {n: float(np.median(table.errors[n])) for n in ("delta_mu", "mu1", "mu2")}

    def residuals(x):
        predicted, _, _ = term.predicted(dict(zip(TRUTH, x * list(TRUTH.values()), strict=True)))
        parts = {"delta_mu": predicted.mean_friction - predicted.mu_ss}
        parts |= {f"mu{n}": np.abs(predicted.harmonics[:, n - 1]) for n in (1, 2)}
        return np.concatenate([(parts[n] - table.values[n]) / size[n] for n in parts])

    minimum = least_squares(residuals, np.ones(len(TRUTH)), bounds=(1e-2, 1e2), max_nfev=60)
    variance = 2 * minimum.cost / (minimum.fun.size - len(TRUTH))
    sd = np.sqrt(np.diag(np.linalg.pinv(minimum.jac.T @ minimum.jac)) * variance)
    return {
        n: tuple(
            (t * (x - norm.isf((1 - q) / 2) * s), t * (x + norm.isf((1 - q) / 2) * s))
            for q in LEVELS
        )
        for (n, t), x, s in zip(TRUTH.items(), minimum.x, sd, strict=True)
    }


def by_posterior(table, material):
    result = fit(table, "elasto-plastic", list(TRUTH), material=material)
    posterior = sample_posterior(result, chains=2, draws=500)
    return {n: (p.interval_68, p.interval_95) for n, p in posterior.parameters.items()}


def coverage(name, intervals_of, tables):
    if not tables:
        return
    inside, began = [], time.perf_counter()
    for table in tables:
        intervals = intervals_of(table)
        inside.append([[low <= TRUTH[n] <= high for low, high in intervals[n]] for n in TRUTH])
    shares = np.mean(inside, axis=0)
    whole, lowest = 100 * shares.mean(0), 100 * shares.min(0)
    spread = [100 * math.sqrt(q * (1 - q) / len(inside)) for q in LEVELS]
    print(
        f"| {name} | {len(inside)} | {whole[0]:.1f} ({lowest[0]:.1f}) | "
        f"{whole[1]:.1f} ({lowest[1]:.1f}) | {spread[0]:.1f}, {spread[1]:.1f} | "
        f"{(time.perf_counter() - began) / len(inside):.2f} |",
        flush=True,
    )
    for n, share in zip(TRUTH, 100 * shares, strict=True):
        print(f"<!-- {n}: {share[0]:.1f}, {share[1]:.1f} -->", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--posterior", type=int, default=40)
    chosen = parser.parse_args()
    material = asp.materials.load("bureau2000")
    exact = exact_response(material)
    kinds = {
        "independent errors": (0.0, False),
        "correlated, covariance given": (SHARED, True),
        "correlated, covariance ignored": (SHARED, False),
    }
    print("| data, method | sets | 68.3 % | 95 % | Monte Carlo | s a set |")
    print("|---|---|---|---|---|---|")
    for name, (shared, correlated) in kinds.items():
        tables = [
            noisy_table(exact, np.random.default_rng(seed), shared, correlated=correlated)
            for seed in range(chosen.sets)
        ]
        coverage(f"{name}: fit", lambda t: by_fit(fit_problem(t, material)), tables)
        if not correlated and not shared:
            squares = f"{name}: least squares of moduli"
            coverage(squares, lambda t: by_moduli(fit_problem(t, material)), tables)
            few = tables[: chosen.posterior]
            coverage(f"{name}: posterior", lambda t: by_posterior(t, material), few)


def fit_problem(table, material):
    """The objective of a fit, without its search for minima."""
    from asperity.inference.fitting.inputs import fixed_values
    from asperity.inference.objective import Objective
    from asperity.inference.tables.term import LockInTerm
    from asperity.inference.unknowns import unknowns_of
    from asperity.laws import get_law

    law = get_law("elasto-plastic")
    unknowns = unknowns_of(law, list(TRUTH), largest_epsilon=0.5, start=TRUTH, priors={})
    fixed = fixed_values(law, table, list(TRUTH), None, material)
    return Objective((LockInTerm(table, law, fixed),), law, unknowns, fixed)


if __name__ == "__main__":
    main()
