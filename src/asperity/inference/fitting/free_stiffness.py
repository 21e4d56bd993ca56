"""A table that a law does not describe at the given stiffness, fitted again with it free.

Readings by a lock-in see the stiffness to a few per cent and better: a wrong one makes every law
fail, or has a wrong law take its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from asperity.inference.fitting.description import described_fit
from asperity.inference.fitting.minima import minima_of
from asperity.inference.fitting.result import Fit
from asperity.inference.tables.term import Forward, LockInTerm
from asperity.inference.unknowns import unknowns_of

#: A law does not describe the data below the first probability of chi-squared, and does with the
#: stiffness free from the second one on.
_FAILS, _DESCRIBES = 1e-3, 0.01


def stiffness_that_describes(found: Fit, progress: Callable[[int, int], None] | None = None) -> str:
    """A sentence on the stiffness with which the law describes a table after all, or nothing.

    Parameters
    ----------
    found : Fit
        Converged, to one table; nothing is said of one that describes it, or has K free.
    progress : callable, optional
        Called with the number of minimisations done, and of all.
    """
    freed = _freed(found, progress)
    if freed is None or not freed.converged or freed.dof <= 0 or freed.p_value < _DESCRIBES:
        return ""
    estimate, given = freed.parameters["K"], float(np.ravel(found.objective.fixed["K"])[0])
    low, high = estimate.interval_95
    if low <= given <= high:
        return ""
    numbers = ", ".join(f"{n} {freed.values[n]:.4g}" for n in ("A", "B", "D0") if n in freed.values)
    return (
        f"with K free, {found.law} describes these data (p = {freed.p_value:.2g}) at a K of "
        f"{estimate.value:.4g} N/m ({low:.4g} to {high:.4g}, 95 %), {estimate.value / given:.3g} "
        f"times the given {given:.4g} N/m"
        + (f", with {numbers}" if numbers else "")
        + ": either the given stiffness is wrong or the law; measure the stiffness, or give it a "
        "prior"
    )


def _freed(found: Fit, progress: Callable[[int, int], None] | None) -> Fit | None:
    """The fit with K free; None where that is not asked for."""
    objective = found.objective
    given = np.unique(objective.fixed.get("K", ()))
    tables = objective.terms_of(LockInTerm)
    if not (tables and len(objective.terms) == 1 and given.size == 1 and found.converged):
        return None
    if found.dof <= 0 or found.p_value >= _FAILS:
        return None
    (term,) = tables
    before = term.forward
    fixed = {n: v for n, v in objective.fixed.items() if n != "K"}
    forward = Forward(
        objective.law,
        term.table,
        fixed,
        inertia=before.inertia,
        radiation_damping=before.radiation_damping,
    )
    largest = float(term.table.points["epsilon"].max())
    start = {"K": float(given[0])}
    (own,) = unknowns_of(objective.law, ["K"], largest_epsilon=largest, start=start, priors={})
    freed = replace(
        objective,
        terms=(LockInTerm(term.table, forward),),
        unknowns=(*objective.unknowns, own),
        fixed=fixed,
    )
    # Special cases and drawn starts as in any fit, and the estimate with the given stiffness.
    minima = minima_of(freed, 0, progress, simpler=[{**found.values, **start}])
    return described_fit(freed, minima, profile=False) if minima else None
