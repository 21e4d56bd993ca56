"""What an error of a fixed number does to the estimates of a fit, to first order."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.inference.fitting.result import Fit
from asperity.inference.tables.term import LockInTerm

Float = NDArray[np.float64]


def shift_of_estimates(
    fit: Fit, high: Mapping[str, float], low: Mapping[str, float]
) -> dict[str, float]:
    """First-order change of the estimates with fixed numbers, half of the way from low to high.

    Parameters
    ----------
    fit : Fit
        Of one table of lock-in readings.
    high, low : mapping of str to float
        Fixed numbers (SI) that differ from those of the fit, such as a stiffness one standard
        uncertainty above and below.

    Returns
    -------
    dict of str to float
        In SI, by the names of the free parameters; infinite where the model has no periodic
        response with the changed numbers.

    Raises
    ------
    InputError
        If the fit is of anything but one table of lock-in readings.
    """
    tables = fit.objective.terms_of(LockInTerm)
    if len(tables) != 1 or len(fit.objective.terms) != 1:
        raise InputError(
            f"fit must be of one table of lock-in readings, got {len(fit.objective.terms)} parts; "
            "fit the table alone"
        )
    (term,) = tables
    sides = []
    for change in (high, low):
        fixed = {**fit.objective.fixed, **change}
        changed = LockInTerm(term.table, fit.objective.law, fixed, **term.motion)
        residuals = changed.residuals(fit.values, search=True)
        if residuals is None:
            return dict.fromkeys(fit.values, math.inf)
        sides.append(residuals)
    jacobian = (sides[0].jacobian + sides[1].jacobian) / 2
    change_of_residuals = (sides[0].values - sides[1].values) / 2
    scale = np.sqrt((jacobian**2).sum(0))
    moved = np.linalg.lstsq(jacobian / scale, -change_of_residuals, rcond=None)[0] / scale
    return dict(zip(fit.values, map(float, moved), strict=True))
