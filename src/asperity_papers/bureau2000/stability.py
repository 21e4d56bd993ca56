"""Figure 12, which is not in the paper: the leading Floquet multiplier against the amplitude."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.optimize import elementwise

import asperity as asp
from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import BORNE, FigureCurve, curve_figure, speed_curves
from asperity_papers.bureau2000.machine import (
    EXT,
    LD,
    RR,
    SPEEDS,
    Float,
    Machine,
    steady_multiplier,
)


def variants(machine: Machine) -> dict[str, tuple[str, dict[str, float]]]:
    """The laws compared: name, law and the parameters that replace the paper's."""
    p = machine.numbers
    return {
        "RR": (RR, {}),
        f"LD {p.alpha:g}": (LD, {"alpha": p.alpha}),
        f"LD {p.alpha_low:g}": (LD, {"alpha": p.alpha_low}),
        "EXT": (EXT, {}),
    }


def log_multiplier(machine: Machine, variant: str, V: Float, epsilon: Float) -> Float:
    """Real part of the logarithm of the leading multiplier; NaN where not solved."""
    law, overrides = variants(machine)[variant]
    response = asp.periodic_response(
        machine.slider(law, **overrides), velocity=V, epsilon=epsilon,
        frequency=machine.numbers.frequency,
    )  # fmt: skip
    return np.where(response.converged, response.log_multipliers[..., 0].real, np.nan)


def thresholds(machine: Machine, variant: str, V: Float, bracket: tuple[Float, Float]) -> Float:
    """Amplitude eps_eff at which modulation makes sliding stable, for each velocity.

    Parameters
    ----------
    machine : Machine
    variant : str
        A key of `variants`.
    V : array, shape (n,)
        Pulling velocities (m/s).
    bracket : (array, array), shape (n,)
        Amplitudes on either side.

    Returns
    -------
    array, shape (n,)
        NaN where the multiplier does not cross 1 between them.
    """
    root = elementwise.find_root(
        lambda epsilon, V: log_multiplier(machine, variant, V, epsilon), bracket, args=(V,)
    )
    return np.where(root.success, root.x, np.nan)


def floquet_curves(machine: Machine) -> list[FigureCurve]:
    """The laws of `variants` at both velocities."""
    eps = machine.borne_amplitudes()
    return [
        curve
        for name, (law, overrides) in variants(machine).items()
        for curve in speed_curves(machine, law, eps, case=name, overrides=overrides)
    ]


@curve_figure("figure-12", floquet_curves)
def floquet_figure(
    machine: Machine, read: FigureNumbers
) -> tuple[dict[str, float], dict[str, float]]:
    """Stability against eps_eff, by law and velocity, with the thresholds."""
    V, rigid = np.array(machine.velocities), machine.slider(RR)
    scalars = {"K_over_Kc": machine.stiffness_ratio}
    for speed in V:
        steady = steady_multiplier(rigid, speed, machine.numbers.frequency)
        scalars[f"steady {speed:.0e}"] = float(steady)
    for variant in variants(machine):
        low, high = np.array([_bracket(read.curve(f"{variant}, {name}")) for name in SPEEDS]).T
        crossed = thresholds(machine, variant, V, (low, high))
        for name, value in zip(SPEEDS, crossed, strict=True):
            scalars[f"threshold {variant}, {name}"] = float(value)
    start = read.data.drop_duplicates("curve")
    starts = zip(start["curve"], start["floquet_max"], strict=True)
    return scalars, {f"start {curve}": float(value) for curve, value in starts}


def _bracket(rows: pd.DataFrame) -> tuple[float, float]:
    """Neighbouring amplitudes between which the leading multiplier crosses 1."""
    unstable = (rows["floquet_max"] > 1).to_numpy()
    eps = rows[BORNE].to_numpy()
    (crossings,) = np.nonzero(unstable[:-1] & ~unstable[1:])
    if crossings.size == 0:
        return np.nan, np.nan
    return float(eps[crossings[0]]), float(eps[crossings[0] + 1])
