"""A fit as plain numbers and texts, for JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from asperity._version import __version__
from asperity.inference.fitting.result import Estimate, Fit
from asperity.inference.unknowns import EPS_RATIO
from asperity.outputs.json import plain
from asperity.parameters import point_parameters


def fit_record(found: Fit) -> dict[str, Any]:
    """Everything that a fit says; infinite and undefined numbers are None."""
    return {
        "law": found.law,
        "converged": found.converged,
        "message": found.message,
        "parameters": {
            name: {**_estimate(p), "determined": name not in found.undetermined}
            for name, p in found.parameters.items()
        },
        "over_load": {name: _estimate(p) for name, p in found.over_load.items()},
        "fixed": _fixed(found),
        "correlation": {
            "names": list(found.parameters),
            "matrix": [[plain(x) for x in row] for row in found.correlation.tolist()],
        },
        "undetermined": list(found.undetermined),
        "chi2": plain(found.chi2),
        "dof": found.dof,
        "p_value": plain(found.p_value),
        "log_likelihood": plain(found.log_likelihood),
        "aicc": plain(found.aicc),
        "bic": plain(found.bic),
        "observables": {
            name: {"chi2": chi2, "n": n} for name, (chi2, n) in found.observables.items()
        },
        "noise": _noise(found),
        "optima": [{"chi2": o.chi2, "values": dict(o.values)} for o in found.optima],
        "warnings": list(found.warnings),
        "data": " and ".join(term.name for term in found.objective.terms),
        "asperity_version": __version__,
    }


def _estimate(found: Estimate) -> dict[str, Any]:
    prior = found.prior
    return {
        "value": plain(found.value),
        "unit": found.unit,
        "se": plain(found.se),
        "interval_68": [plain(x) for x in found.interval_68],
        "interval_95": [plain(x) for x in found.interval_95],
        "at_bound": found.at_bound,
        "prior": None
        if prior is None
        else {"mean": prior.mean, "sd": prior.sd, "source": prior.source},
    }


def _fixed(found: Fit) -> dict[str, Any]:
    """Numbers that were not fitted; None for those that each row of a table has its own of."""
    known = {**point_parameters(found.objective.law), EPS_RATIO.name: EPS_RATIO}
    several = {n: np.unique(v) for n, v in found.objective.fixed.items()}
    return {
        name: {"value": plain(v[0]) if v.size == 1 else None, "unit": known[name].unit}
        for name, v in several.items()
    }


def _noise(found: Fit) -> dict[str, Any]:
    """Noise of the data together, and of each set of data where there are several."""
    parts = {term.name: dict(term.noise) for term in found.objective.terms}
    if len(parts) == 1:
        return next(iter(parts.values()))
    models = list(dict.fromkeys(part["model"] for part in parts.values()))
    return {
        "model": "; ".join(models),
        "effective_samples": sum(part["effective_samples"] for part in parts.values()),
        "data": parts,
    }
