"""Figure 12, which is not in the paper: the leading Floquet multiplier against the amplitude."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import elementwise

import asperity as asp
from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import BORNE, CurveFigure, curves_of_laws
from asperity_papers.bureau2000.machine import EXT, LD, RR, SPEEDS, Float, Machine


def variants(machine: Machine) -> dict[str, tuple[str, dict[str, float]]]:
    """The laws compared: name, law and the parameters that replace the paper's."""
    p = machine.numbers
    return {
        "RR": (RR, {}),
        f"LD {p.alpha:g}": (LD, {"alpha": p.alpha}),
        f"LD {p.alpha_low:g}": (LD, {"alpha": p.alpha_low}),
        "EXT": (EXT, {}),
    }


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
        NaN where the multiplier does not cross 1 between the two amplitudes.
    """
    law, overrides = variants(machine)[variant]
    slider, frequency = machine.slider(law, **overrides), machine.numbers.frequency

    def log_multiplier(epsilon: Float, V: Float) -> Float:
        r = asp.periodic_response(slider, velocity=V, epsilon=epsilon, frequency=frequency)
        return np.where(r.converged, r.log_multipliers[..., 0].real, np.nan)

    root = elementwise.find_root(log_multiplier, bracket, args=(V,))
    return np.where(root.success, root.x, np.nan)


def _threshold(machine: Machine, read: FigureNumbers) -> dict[str, Any]:
    """Amplitude at which modulation makes sliding stable, by curve."""
    crossed: dict[str, float] = {}
    for variant in variants(machine):
        curves = [f"{variant}, {speed}" for speed in SPEEDS]
        low, high = np.array([_bracket(read.curve(curve)) for curve in curves]).T
        limits = thresholds(machine, variant, np.array(machine.velocities), (low, high))
        crossed |= dict(zip(curves, limits, strict=True))
    return {"threshold": crossed.__getitem__}


#: Stability against eps_eff, by law and velocity, with the thresholds.
floquet_figure = CurveFigure(
    "figure-12", lambda machine: curves_of_laws(machine, variants(machine)), _threshold
)


def _bracket(rows: pd.DataFrame) -> tuple[float, float]:
    """Neighbouring amplitudes between which the leading multiplier crosses 1."""
    unstable = (rows["floquet_max"] > 1).to_numpy()
    eps = rows[BORNE].to_numpy()
    (crossings,) = np.nonzero(unstable[:-1] & ~unstable[1:])
    if crossings.size == 0:
        return np.nan, np.nan
    return float(eps[crossings[0]]), float(eps[crossings[0] + 1])
