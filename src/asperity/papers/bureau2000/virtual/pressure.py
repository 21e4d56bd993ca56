"""Figure 5 of the virtual experiment: air against vacuum at 200 Hz."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from asperity.papers.bureau2000.numbers.machine import Float, paper
from asperity.papers.bureau2000.virtual.mean import lines_over_amplitude
from asperity.papers.bureau2000.virtual.numbers import (
    RecoveredQuantity,
    VirtualNumbers,
    scalars,
    with_model,
)
from asperity.papers.bureau2000.virtual.recordings import NORMAL, SimulatedPoints, all_series

VACUUM, AIR = "1 mbar", "1 atm"


def virtual_5(readings: SimulatedPoints) -> VirtualNumbers:
    """Change of the mean in air and in vacuum, and the factor that makes them one curve."""
    pair = tuple(s for s in all_series() if s.frequency == paper().frequency_vacuum)
    vacuum, air = pair
    lines = lines_over_amplitude(pair)
    points = with_model(pd.concat([readings[one.name] for one in pair]), lines)
    numbers = VirtualNumbers(
        "virtual-05", "Figure 5, simulated", "Air against vacuum, and the factor between them",
        lines, points=points, series=pair,
    )  # fmt: skip
    factor, sigma = collapse(numbers.of(VACUUM), numbers.of(AIR))
    true_value = abs(air.transfer) / abs(vacuum.transfer)
    stated = 1 / paper().collapse_divisor_200Hz
    recovered = (
        RecoveredQuantity(
            "Factor on ε that makes air and vacuum collapse", factor, sigma, true_value, f"{stated}"
        ),
    )
    return replace(numbers, recovered=recovered).described(
        scalars=scalars(recovered),
        caption=(
            "SIMULATED. The air layer over the patch of 2.5 cm that the appendix proposes leaves "
            f"{abs(air.transfer):.3f} of ε to the contacts at 200 Hz, a vacuum "
            f"{abs(vacuum.transfer):.3f}; the readings know neither. The one factor on ε that "
            f"makes the two series one curve is {factor:.4f} ± {NORMAL * sigma:.4f} (95 %), where "
            f"the machine has {true_value:.4f}; the paper divides by 2.5. Bars in vacuum at ε = "
            "0.5: how far F(0) had come back when it was read again."
        ),
        alt=(
            "Simulated: change of the mean friction coefficient against modulation amplitude, open "
            "circles at 1 millibar falling to about "
            f"{numbers.of(VACUUM)['delta_mu'].iloc[-1]:.2f} at amplitude 0.5, open triangles at 1 "
            f"atmosphere to {numbers.of(AIR)['delta_mu'].iloc[-1]:.2f}; full triangles, the same "
            "against the scaled amplitude, lie among the circles."
        ),
    )


def collapse(vacuum: pd.DataFrame, air: pd.DataFrame) -> tuple[float, float]:
    """The factor on eps that brings the drops in air onto those in vacuum.

    Parameters
    ----------
    vacuum, air : DataFrame
        Points.

    Returns
    -------
    (float, float)
        The factor and its standard uncertainty.

    Notes
    -----
    Both series are fitted by one curve, a (sqrt(1 + (b u)^2) - 1) + c u^2 with u = eps in vacuum
    and u = factor eps in air. On the periodic orbits themselves it gives the factor to 1e-4.
    """
    from scipy.optimize import curve_fit

    scaled = np.repeat([False, True], [len(vacuum), len(air)])

    def drop(epsilon: Float, factor: float, a: float, b: float, c: float) -> Float:
        u = np.where(scaled, factor * epsilon, epsilon)
        return a * (np.sqrt(1 + (b * u) ** 2) - 1) + c * u**2

    epsilon, value, sigma = (
        np.concatenate([rows[name].to_numpy() for rows in (vacuum, air)])
        for name in ("epsilon", "delta_mu", "delta_mu_uncertainty")
    )
    start = (0.5, -0.05, 10.0, 0.0)
    best, covariance = curve_fit(drop, epsilon, value, start, sigma=sigma, absolute_sigma=True)
    return float(best[0]), float(np.sqrt(covariance[0, 0]))
