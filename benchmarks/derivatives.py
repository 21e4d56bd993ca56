"""Derivatives of every law with and without damping and inertia, compared with differences.

    python -m benchmarks.derivatives --method fast
    python -m benchmarks.derivatives --method robust --law rice-ruina --law elasto-plastic

Each law and equation of motion is differentiated at four points by all parameters: mean, two
harmonics, and with the robust method the multipliers. "fast" solves within the compiled program.
"robust" uses the search: for multipliers with inertia or damping, and under slow modulation without
them. Differences are Richardson's extrapolation of central ones over 0.2 % and 0.1 %.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import asperity as asp
from asperity.laws import get_law, law_parameters, registered
from asperity.orbit import Outcome, ResponseFunction, ResponseValues

#: Parameters of all laws, of the machine, and four drives.
LAW = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6, "lambda": 7e-7, "alpha": 0.2}
LAW |= {"c": 0.5, "B2": 0.005, "D2": 1.5e-6, "V1": 1e-8, "V2": 1e-4, "L": 1e-8, "V_star": 1e-7}
MACHINE = {"K": 2e5, "W0": 7.0, "M": 1.6, "eta": 500.0}
DRIVE = {"V": np.array([1e-6, 3e-6, 2e-6, 1e-6]), "epsilon": np.array([0.03, 0.05, 0.08, 0.01])}
FREQUENCY = {"fast": 120.0, "robust": 0.3}
MOTIONS: dict[str, dict[str, bool]] = {
    "quasi-static": {},
    "damped": {"radiation_damping": True},
    "inertial": {"inertia": True},
}
STEP = 2e-3


def columns(values: ResponseValues) -> np.ndarray:
    """All outputs as real columns, (points, columns)."""
    waves = np.concatenate([values.harmonics, values.log_multipliers], axis=-1)
    return np.column_stack([values.mean_friction, waves.real, waves.imag])


def worst_difference(model: ResponseFunction, parameters: dict[str, Any]) -> tuple[int, float]:
    """Number of converged points, and the largest error of a derivative by a logarithm.

    Errors are relative to the largest derivative of the same output at the same point.
    """
    values, jacobian = model.value_and_jacobian(parameters)
    names = [n for n in model.parameters if n not in model.equations.optional]
    exact = {n: columns(jacobian[n]) * np.reshape(parameters[n], (-1, 1)) for n in names}
    converged = np.asarray(values.outcome) == Outcome.CONVERGED
    largest = np.max([np.abs(c) for c in exact.values()], axis=0)
    scale = np.where(largest > 1e-12, largest, 1.0)

    def by_differences(name: str) -> np.ndarray:
        near = [
            columns(model(parameters | {name: parameters[name] * (1 + STEP * share)}))
            for share in (1.0, -1.0, 0.5, -0.5)
        ]
        return (4 * (near[2] - near[3]) / STEP - (near[0] - near[1]) / (2 * STEP)) / 3

    errors = [np.abs(exact[n] - by_differences(n)) / scale for n in names]
    worst = np.max([e[converged].max(initial=0.0) for e in errors])
    return int(converged.sum()), float(worst)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.derivatives", description=__doc__)
    laws = sorted(name for name, law in registered().items() if law.rate_dependent)
    parser.add_argument("--law", choices=laws, action="append")
    parser.add_argument("--motion", choices=MOTIONS, action="append")
    parser.add_argument("--method", choices=FREQUENCY, default="fast")
    arguments = parser.parse_args()
    fast = arguments.method == "fast"
    print("| law | equation of motion | converged, of 4 | largest error | processor time (s) |")
    print("|---|---|---|---|---|")
    for law in arguments.law or laws:
        for motion in arguments.motion or MOTIONS:
            begun = time.process_time()
            model = asp.response_function(
                law, multipliers=not fast, search=not fast, **MOTIONS[motion]
            )
            numbers = {name: LAW[name] for name in law_parameters(get_law(law))}
            frequency = FREQUENCY[arguments.method] if motion == "quasi-static" else 120.0
            parameters = numbers | MACHINE | DRIVE | {"frequency": frequency}
            given = {n: v for n, v in parameters.items() if n in model.parameters}
            converged, error = worst_difference(model, given)
            seconds = time.process_time() - begun
            print(f"| {law} | {motion} | {converged} | {error:.1e} | {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
