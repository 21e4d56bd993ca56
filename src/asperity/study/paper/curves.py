"""Curves of a figure as rows of a table, one operating point a row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from asperity.solve import PeriodicResponse, periodic_response
from asperity.study.paper.machine import Float, paper, slider
from asperity.study.paper.steady import floquet_max

#: Columns of every table, with their units and meaning; "1" is a pure number.
COLUMNS: Mapping[str, str] = {
    "curve": "name of the curve",
    "law": "friction law",
    "alpha": "1; Linker-Dieterich coefficient",
    "lambda": "m; shear elastic length",
    "V": "m/s; pulling velocity",
    "frequency": "Hz; of the load modulation",
    "epsilon_applied": "1; relative amplitude of the load",
    "epsilon_eff": "1; part of it that the contacts bear, which the model receives",
    "mean_friction": "1; mean of F/W0",
    "delta_mu": "1; its change by the modulation",
    "mu1": "1; amplitude of the first harmonic of F/W0",
    "mu2": "1; amplitude of the second harmonic of F/W0",
    "floquet_max": "1; largest modulus of the Floquet multipliers of one period",
    "stable": "whether sliding is stable",
    "converged": "whether the point was solved",
}


@dataclass(frozen=True)
class Curve:
    """One line of a figure.

    Attributes
    ----------
    name : str
    law : str
    V : float or array
        Pulling velocity (m/s).
    applied : float or array
        Applied amplitude eps.
    transmission : float
        eps_eff/eps.
    frequency : float
        In Hz; None is the 120 Hz of nearly all figures.
    overrides : mapping
        Parameters of the law that replace the paper's.
    """

    name: str
    law: str
    V: float | Float
    applied: float | Float
    transmission: float = 1.0
    frequency: float | None = None
    overrides: Mapping[str, float] = field(default_factory=dict)


def solve_curves(curves: Iterable[Curve]) -> pd.DataFrame:
    """Solve all points of all curves.

    Returns
    -------
    DataFrame
        With the columns of `COLUMNS`. A point that failed has ``converged`` False and NaN.
    """
    return pd.concat([_solve(curve) for curve in curves], ignore_index=True)


def _solve(curve: Curve) -> pd.DataFrame:
    chosen = slider(curve.law, **curve.overrides)
    f = paper().frequency if curve.frequency is None else curve.frequency
    V, applied = np.broadcast_arrays(
        np.asarray(curve.V, float), np.atleast_1d(np.asarray(curve.applied, float))
    )
    # Steady sliding is known in closed form; an orbit of zero amplitude has no relative accuracy.
    still = applied == 0
    response = periodic_response(
        chosen,
        velocity=V[~still],
        epsilon=curve.transmission * applied[~still],
        frequency=f,
    )
    rows = pd.DataFrame(
        {
            "curve": curve.name,
            "law": curve.law,
            "alpha": getattr(chosen.law, "alpha", np.nan),
            "lambda": float(np.asarray(chosen.law.elastic_length)),
            "V": V,
            "frequency": f,
            "epsilon_applied": applied,
            "epsilon_eff": curve.transmission * applied,
        }
    )
    rows["alpha"] = rows["alpha"].astype(float)
    rows["mean_friction"] = np.asarray(chosen.law.mu_ss(V))
    for name in ("delta_mu", "mu1", "mu2"):
        rows[name] = 0.0
    rows["floquet_max"] = floquet_max(chosen, V, f)
    rows["stable"] = rows["floquet_max"] < 1
    rows["converged"] = True
    return _with_response(rows, ~still, response)


def _with_response(
    rows: pd.DataFrame, where: np.ndarray, response: PeriodicResponse
) -> pd.DataFrame:
    names = ("mean_friction", "delta_mu", "mu1", "mu2", "floquet_max", "stable", "converged")
    for name in names:
        rows.loc[where, name] = getattr(response, name)
    return rows
