"""Curves of a figure as rows of a table, one operating point a row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from asperity.orbit import PeriodicResponse, periodic_response
from asperity.papers.bureau2000.numbers.machine import Float, paper, slider
from asperity.papers.bureau2000.numbers.steady import floquet_max
from asperity.slider import Slider

#: Columns of every table, with their units and meaning; "1" is a pure number.
COLUMNS: Mapping[str, str] = {
    "curve": "name of the curve",
    "law": "friction law",
    "alpha": "1; Linker-Dieterich coefficient",
    "lambda": "m; shear elastic length",
    "inertia": "whether the mass of the slider counts",
    "damping": "N s/m; force per velocity of a damper between slider and track",
    "V": "m/s; pulling velocity",
    "frequency": "Hz; of the load modulation",
    "epsilon_applied": "1; relative amplitude of the load",
    "epsilon_eff": "1; part of it that the contacts bear, which the model receives",
    "mean_friction": "1; mean of F/W0",
    "delta_mu": "1; its change by the modulation",
    "mu1": "1; amplitude of the first harmonic of F/W0",
    "mu2": "1; amplitude of the second harmonic of F/W0",
    "phase1": "rad; phase of the first harmonic against the load",
    "phase2": "rad; phase of the second harmonic against the load",
    "floquet_max": "1; largest modulus of the Floquet multipliers of one period",
    "stable": "whether sliding is stable",
    "converged": "whether the point was solved",
}


@dataclass(frozen=True)
class FigureCurve:
    """One line of a figure.

    Attributes
    ----------
    name : str
    law : str
    V : float or array
        Pulling velocity (m/s).
    applied : float or array
        Applied amplitude eps.
    share : float
        eps_eff/eps.
    frequency : float or array
        In Hz; None is the 120 Hz of nearly all figures.
    overrides : mapping of str to float or array
        Parameters of the law that replace the paper's.
    inertia : bool
        Whether the mass counts.
    damping : float
        Of a damper between slider and track (N s/m); 0 for none.

    All arrays broadcast against each other.
    """

    name: str
    law: str
    V: float | Float
    applied: float | Float
    share: float = 1.0
    frequency: float | Float | None = None
    overrides: Mapping[str, float | Float] = field(default_factory=dict)
    inertia: bool = False
    damping: float = 0.0


def solve_curves(curves: Iterable[FigureCurve], **options: Any) -> pd.DataFrame:
    """Solve all points of all curves.

    Parameters
    ----------
    curves : iterable of FigureCurve
    **options
        As of `asperity.orbit.periodic_response`.

    Returns
    -------
    DataFrame
        With the columns of `COLUMNS`. A point that failed has ``converged`` False and NaN.
    """
    return pd.concat([_solve(curve, options) for curve in curves], ignore_index=True)


def _solve(curve: FigureCurve, options: Mapping[str, Any]) -> pd.DataFrame:
    f = paper().frequency if curve.frequency is None else curve.frequency
    varied: dict[str, Float] = {
        name: np.asarray(x, float) for name, x in curve.overrides.items() if np.ndim(x)
    }
    given = [curve.V, curve.applied, f, *varied.values()]
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(x, float)) for x in given))
    V, applied, frequency = arrays[:3]
    varied = dict(zip(varied, arrays[3:], strict=True))

    def at(rows: np.ndarray) -> Slider:
        """The slider at some of the operating points."""
        return slider(
            curve.law, **{**curve.overrides, **{name: x[rows] for name, x in varied.items()}}
        )

    still = applied == 0
    chosen = at(np.full(V.shape, True))
    rows = pd.DataFrame(
        {
            "curve": curve.name,
            "law": curve.law,
            "alpha": getattr(chosen.law, "alpha", np.nan),
            "lambda": np.asarray(chosen.law.elastic_length, float),
            "inertia": curve.inertia,
            "damping": curve.damping,
            "V": V,
            "frequency": frequency,
            "epsilon_applied": applied,
            "epsilon_eff": curve.share * applied,
        }
    )
    rows["alpha"] = rows["alpha"].astype(float)
    rows["mean_friction"] = np.asarray(chosen.law.mu_ss(V))
    for name in ("delta_mu", "mu1", "mu2"):
        rows[name] = 0.0
    rows[["phase1", "phase2"]] = np.nan
    rows["floquet_max"] = np.nan
    # Steady sliding is known in closed form, without inertia; an orbit of zero amplitude has no
    # relative accuracy.
    if still.any() and not curve.inertia:
        rows.loc[still, "floquet_max"] = floquet_max(at(still), V[still], frequency[still])
    rows["stable"] = rows["floquet_max"] < 1
    rows["converged"] = True
    response = periodic_response(
        at(~still),
        velocity=V[~still],
        epsilon=curve.share * applied[~still],
        frequency=frequency[~still],
        inertia=curve.inertia,
        radiation_damping=curve.damping or None,
        **options,
    )
    return _with_response(rows, ~still, response)


def _with_response(
    rows: pd.DataFrame, where: np.ndarray, response: PeriodicResponse
) -> pd.DataFrame:
    names = (
        "mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2", "floquet_max", "stable",
        "converged",
    )  # fmt: skip
    for name in names:
        rows.loc[where, name] = getattr(response, name)
    return rows
