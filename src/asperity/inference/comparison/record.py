"""A comparison of laws as plain numbers and texts, for JSON."""

from __future__ import annotations

from typing import Any

from asperity.inference.comparison.compare import Comparison
from asperity.inference.comparison.cross_validation import CrossValidation
from asperity.inference.comparison.evidence import Evidence
from asperity.inference.fitting.record import fit_record
from asperity.outputs.json import plain


def comparison_record(found: Comparison) -> dict[str, Any]:
    """Everything that a comparison says."""
    return {
        "laws": {
            name: {
                **fit_record(judged.fit),
                "excluded": judged.excluded,
                "why": judged.why,
                "weight": plain(judged.weight),
                "evidence": _evidence(judged.evidence),
                "leave_one_run_out": _cross_validation(judged.cross_validation),
            }
            for name, judged in found.laws.items()
        },
        "left_out": list(found.left_out),
        "not_compared": dict(found.not_compared),
        "decided": found.decided,
        "best": found.best,
        "verdict": found.verdict,
    }


def _evidence(found: Evidence | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "log": plain(found.log),
        "standard_error": plain(found.standard_error),
        "effective_samples": plain(found.effective_samples),
        "laplace": plain(found.laplace),
        "failed": found.failed,
        "prior": found.prior,
    }


def _cross_validation(found: CrossValidation | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "log_density": plain(found.log_density),
        "runs": {name: plain(value) for name, value in found.runs.items()},
        "message": found.message,
    }
