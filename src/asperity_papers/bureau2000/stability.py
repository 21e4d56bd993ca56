"""Figure 12, which is not in the paper: the leading Floquet multiplier against the amplitude."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import BORNE, CurveFigure, curves_of_laws
from asperity_papers.bureau2000.machine import EXT, LD, RR, Machine


def variants(machine: Machine) -> dict[str, tuple[str, dict[str, float]]]:
    """The laws compared: name, law and the parameters that replace the paper's."""
    p = machine.numbers
    return {
        "RR": (RR, {}),
        f"LD {p.alpha:g}": (LD, {"alpha": p.alpha}),
        f"LD {p.alpha_low:g}": (LD, {"alpha": p.alpha_low}),
        "EXT": (EXT, {}),
    }


def _threshold(machine: Machine, read: FigureNumbers) -> dict[str, Any]:
    """Amplitude at which modulation makes sliding stable, by curve."""
    curves = read.data.groupby("curve", sort=False)
    return {"threshold": {curve: fall_below_one(rows) for curve, rows in curves}.__getitem__}


def fall_below_one(rows: pd.DataFrame) -> float:
    """The first amplitude eps_eff at which the leading multiplier falls below 1.

    Parameters
    ----------
    rows : DataFrame
        A curve.

    Returns
    -------
    float
        NaN where it does not fall below 1, or where a point next to the crossing was not solved.
        The logarithm of the multiplier is smooth: interpolated between a hundred points it is good
        to 1e-11.
    """
    with np.errstate(divide="ignore"):
        logs = np.log(rows["floquet_max"])
    known = np.isfinite(logs)
    if known.sum() < 2:
        return np.nan
    line = CubicSpline(rows[BORNE][known], logs[known])
    crossings = line.solve(0.0, extrapolate=False)
    falls = crossings[line(crossings, 1) < 0]
    if falls.size == 0 or np.interp(falls[0], rows[BORNE], known) < 1:
        return np.nan
    return float(falls[0])


#: Stability against eps_eff, by law and velocity, with the thresholds.
floquet_figure = CurveFigure(
    "figure-12", lambda machine: curves_of_laws(machine, variants(machine)), _threshold
)
