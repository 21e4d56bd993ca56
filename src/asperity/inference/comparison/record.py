"""A comparison of laws as plain numbers and texts, for JSON."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from asperity.inference.comparison.compare import Comparison
from asperity.inference.fitting.result import fit_record
from asperity.outputs.json import plain


def comparison_record(comparison: Comparison) -> dict[str, Any]:
    """Everything that a comparison says."""
    return {
        "laws": {
            name: {
                **fit_record(judged.fit),
                "excluded": judged.excluded,
                "why": judged.why,
                "standing": comparison.standing(name).word,
                "deciding": comparison.standing(name).number,
                "weight": plain(judged.weight),
                "evidence": judged.evidence and plain(asdict(judged.evidence)),
                "leave_one_run_out": judged.cross_validation
                and plain(asdict(judged.cross_validation)),
            }
            for name, judged in comparison.laws.items()
        },
        "left_out": list(comparison.left_out),
        "not_compared": dict(comparison.not_compared),
        "decided": comparison.decided,
        "best": comparison.best,
        "verdict": comparison.verdict,
    }


def laws_table(
    comparison: Comparison, *, reasons: bool = False
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Laws in the order of the comparison, as texts for people: columns' names and rows.

    What decides stands in it: chi-squared where uncertainties are given, the logarithm of the
    likelihood where the noise is estimated. With `reasons`, why a law is excluded.
    """
    fits = [j.fit for j in comparison.laws.values() if j.fit.converged]
    lowest = min((f.aicc for f in fits), default=0.0)
    # Where the noise is estimated from the same residuals, chi-squared judges nothing.
    by_chi2 = any(f.judged_by_chi2 for f in fits)
    numbers = ("chi-squared", "dof", "p") if by_chi2 else ("log-likelihood",)
    head = ("law", *numbers, "AICc - lowest", "weight", "ln evidence", "")
    nothing = ("",) * (len(head) - 2)
    rows = []
    for name, j in comparison.laws.items():
        f = j.fit
        if not f.converged:
            rows.append((name, *nothing, f.message))
            continue
        shown = (f"{f.chi2:.4g}", str(f.dof), f"{f.p_value:.2g}")
        evidence = f"{j.evidence.log:.2f}" if j.evidence else ""
        # Of excluded laws among searched orbits it is the normal approximation's.
        if j.evidence and math.isfinite(j.evidence.standard_error):
            evidence += f" +- {j.evidence.standard_error:.2g}"
        word, number = comparison.standing(name)
        notes = [f"{word}: {number}" if name != comparison.best else "lowest AICc"]
        notes += [j.why] if reasons and j.excluded else []
        if f.undetermined:
            notes.append(f"{', '.join(f.undetermined)} not determined")
        rows.append(
            (
                name,
                *(shown if by_chi2 else (f"{f.log_likelihood:.2f}",)),
                f"{f.aicc - lowest:.4g}",
                f"{j.weight:.2g}",
                evidence,
                "; ".join(notes),
            )
        )
    rows += [
        (name, *nothing, f"not compared: {why}") for name, why in comparison.not_compared.items()
    ]
    return head, rows
