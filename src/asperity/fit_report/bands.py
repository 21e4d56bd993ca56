"""Predictions of a fitted law between the measured amplitudes, with bands of the parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from asperity.arrays import Bool, Float
from asperity.inference import Fit, LockInTable, Posterior
from asperity.inference.tables.term import LockInTerm
from asperity.orbit import Outcome
from asperity.parameters import MACHINE
from asperity.units import format_si

#: Number of amplitudes of a curve, and of parameter sets of a band.
_AMPLITUDES, _SETS = 24, 100


class Band(NamedTuple):
    """Quantiles of a predicted quantity against the applied amplitude.

    Attributes
    ----------
    epsilon : array, shape (n,)
    low, middle, high : array, shape (n,)
        2.5, 50 and 97.5 %; NaN where fewer than half of the sets have a periodic orbit.
    """

    epsilon: Float
    low: Float
    middle: Float
    high: Float


class Series(NamedTuple):
    """Rows of a table that differ only in amplitude, and the predictions between them.

    Attributes
    ----------
    label : str
        Operating numbers that differ from those of other series, at least the velocity.
    rows : bool array, shape (rows of the table,)
    bands : dict of str to Band
        Bands of mean_friction, delta_mu, mu1 and mu2.
    """

    label: str
    rows: Bool
    bands: dict[str, Band]


def bands_of(fit: Fit, term: LockInTerm, posterior: Posterior | None) -> list[Series]:
    """Bands of mean_friction, delta_mu, mu1 and mu2 for each series of a table, slowest first.

    Parameters
    ----------
    fit : Fit
    term : LockInTerm
    posterior : Posterior or None
        Without one, parameters are drawn from the normal approximation.
    """
    values = _drawn(fit, posterior, np.random.default_rng(0))
    # One set if the law has no free parameters.
    count = max(map(len, values.values()), default=1)
    table = term.table
    series = []
    # A column that one of several tables lacks is complete among the fixed numbers.
    settings = {n: term.fixed[n] for n in table.points if n in term.fixed}
    for label, rows in _series(settings):
        row = int(np.flatnonzero(rows)[0])
        top = table.points["epsilon"][rows].max()
        epsilon = np.linspace(top / _AMPLITUDES, top, _AMPLITUDES)
        fixed = {n: np.full(_AMPLITUDES, v[row]) for n, v in term.fixed.items()}
        points = {n: np.full(_AMPLITUDES, v[row]) for n, v in table.points.items()}
        curve = LockInTable("curve", points | {"epsilon": epsilon}, {}, {})
        along = LockInTerm(curve, term.law, fixed | {"epsilon": epsilon}, **term.motion)
        if term.searches:
            along.use_search(True)
            along.predicted(fit.values)
        free = {n: np.repeat(v, _AMPLITUDES) for n, v in values.items()}
        predicted, outcome = along.predicted_at_many(free, count, near=term.searches)
        good = outcome == Outcome.CONVERGED
        quantities = {
            "mean_friction": predicted.mean_friction,
            "delta_mu": predicted.mean_friction - predicted.mu_ss,
            "mu1": np.abs(predicted.harmonics[:, 0]),
            "mu2": np.abs(predicted.harmonics[:, 1]),
        }
        bands = {
            name: _band(epsilon, np.where(good, q, np.nan).reshape(count, _AMPLITUDES))
            for name, q in quantities.items()
        }
        series.append(Series(label, rows, bands))
    return series


def _series(settings: Mapping[str, Float]) -> list[tuple[str, Bool]]:
    """Labels and rows of series, by everything but the amplitude.

    Rows whose labels are the same are one series: a measured load or frequency differs from row to
    row by its noise.
    """
    names = [n for n in dict.fromkeys(("V", "frequency", *settings)) if n != "epsilon"]
    texts = {n: [_label(n, v) for v in settings[n]] for n in names}
    names = [n for n in names if n == "V" or len(set(texts[n])) > 1]
    labels = np.array([", ".join(row) for row in zip(*(texts[n] for n in names), strict=True)])
    order = np.lexsort([settings[n] for n in reversed(names)])
    return [(str(label), labels == label) for label in dict.fromkeys(labels[order])]


def _label(name: str, value: float) -> str:
    if name == "V":
        return f"{value * 1e6:.3g} µm/s"
    if name == "frequency":
        return f"{value:.3g} Hz"
    text = format_si(value, MACHINE[name].kind, 3) if name in MACHINE else f"{value:.3g}"
    return f"{name} = {text}"


def _band(epsilon: Float, values: Float) -> Band:
    few = np.isfinite(values).mean(0) < 0.5
    filled = np.where(few, 0.0, values)
    low, middle, high = np.where(few, np.nan, np.nanquantile(filled, [0.025, 0.5, 0.975], axis=0))
    return Band(epsilon, low, middle, high)


def _drawn(fit: Fit, posterior: Posterior | None, random: np.random.Generator) -> dict[str, Float]:
    """Sets of parameters by name, each of shape (sets,)."""
    if posterior is not None:
        chains, draws = posterior.log_density.shape
        chosen = random.choice(chains * draws, min(_SETS, chains * draws), replace=False)
        return {n: d.reshape(-1)[chosen] for n, d in posterior.draws.items()}
    unknowns = fit.objective.unknowns
    u = fit.objective.coordinates(fit.values)
    covariance = fit.correlation * np.outer(fit.coordinate_errors, fit.coordinate_errors)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = np.clip(u + random.normal(size=(_SETS, u.size)) @ root.T, *fit.objective.bounds)
    return {k.name: np.asarray(k.to_value(drawn[:, i])) for i, k in enumerate(unknowns)}
