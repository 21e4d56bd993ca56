"""The folder of a comparison: report.html, comparison.json, and a material of each law."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from pathlib import Path

from matplotlib.figure import Figure

from asperity.errors import InputError, require
from asperity.fit_report.bands import Series, bands_of
from asperity.fit_report.folder import (
    RUN_CAPTION,
    data_tables,
    document,
    figure,
    material_text,
    provenance,
    worded_html,
)
from asperity.fit_report.pictures import Float, laws_figure, run_figure, svg
from asperity.inference import Fit, LockInTable
from asperity.inference.comparison.compare import Comparison
from asperity.inference.comparison.record import comparison_record
from asperity.inference.report import comparison_report, estimates
from asperity.inference.runs.run import RecordedRun
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.term import LockInTerm
from asperity.outputs.written import written_folder
from asperity.parameters import NAMES, Names

#: Columns of panels that are legible in half the width of the page.
_MOST_NARROW = 2


def write_comparison(folder: Path, comparison: Comparison, names: Names = NAMES[0]) -> None:
    """Write the report of a comparison into a folder, completely or not at all.

    Parameters
    ----------
    folder : Path
    comparison : Comparison
        With one converged fit at least.
    names : {"friction", "geophysics"}
        Of the page; files keep the names of friction.

    Raises
    ------
    InputError
        If no fit has converged, or the folder cannot be written.
    """
    fits = {name: j.fit for name, j in comparison.laws.items() if j.fit.converged}
    rule = "have a converged fit for a report"
    require(fits, "comparison", rule, "none", f"{comparison.verdict}")
    with written_folder(folder, "report") as staging:
        record = json.dumps(comparison_record(comparison), indent=2)
        (staging / "comparison.json").write_text(record + "\n", encoding="utf-8")
        (staging / "report.html").write_text(page(comparison, fits, names), encoding="utf-8")
        for name, fit in fits.items():
            (staging / f"{name}.toml").write_text(material_text(fit), encoding="utf-8")


def page(comparison: Comparison, fits: Mapping[str, Fit], names: Names) -> str:
    """The page as text, with embedded figures and without external resources.

    Parameters
    ----------
    comparison : Comparison
    fits : mapping of str to Fit
        The converged fits.
    names : {"friction", "geophysics"}
    """
    first = next(iter(fits.values()))
    data = " and ".join(term.name for term in first.objective.terms)
    sections = {
        "Verdict": worded_html(comparison_report(comparison, reasons=True), first, names),
        "Data and laws": _figures(fits, names),
        "Estimates": "".join(
            f"<h3>{escape(name)}</h3>{worded_html([estimates(fit)], fit, names)}"
            for name, fit in fits.items()
        ),
        "Data": data_tables(first),
        "Provenance": "".join(
            f"<h3>{escape(name)}</h3>{provenance(fit, names)}" for name, fit in fits.items()
        ),
    }
    return document(f"Laws compared on {data}", "A comparison", f"Laws on {data}", sections)


def draw_comparison(comparison: Comparison) -> Figure:
    """The first recording with the motion of each law, or the first table with bands of each.

    Parameters
    ----------
    comparison : Comparison

    Raises
    ------
    InputError
        If no fit has converged, or the data are of another kind.
    """
    fits = {name: j.fit for name, j in comparison.laws.items() if j.fit.converged}
    for fit in fits.values():
        if fit.objective.terms_of(RunTerm):
            return run_figure(*_motions(fits, 0))
        if fit.objective.terms_of(LockInTerm):
            return laws_figure(*_predictions(fits, 0))
    rule = "have laws compared on a recording or a table of readings"
    got = "another kind of data or no fit"
    raise InputError("plot", rule, got, "plot the residuals of the fits yourself")


def _predictions(fits: Mapping[str, Fit], i: int) -> tuple[LockInTable, dict[str, list[Series]]]:
    """The table of a number, which is the same for all laws, and bands of each."""
    terms = {name: fit.objective.terms_of(LockInTerm)[i] for name, fit in fits.items()}
    table = next(iter(terms.values())).table
    return table, {name: bands_of(fit, terms[name], None) for name, fit in fits.items()}


def _motions(fits: Mapping[str, Fit], i: int) -> tuple[RecordedRun, dict[str, Float]]:
    """The recording of a number, which is the same for all laws, and the motion of each."""
    terms = {name: fit.objective.terms_of(RunTerm)[i] for name, fit in fits.items()}
    run = next(iter(terms.values())).run
    return run, {name: terms[name].fitted_friction(fit.values) for name, fit in fits.items()}


def _figures(fits: Mapping[str, Fit], names: Names) -> str:
    first = next(iter(fits.values()))
    parts = []
    for i in range(len(first.objective.terms_of(LockInTerm))):
        table, predicted = _predictions(fits, i)
        caption = (
            "Readings with standard uncertainties; medians and 95 % bands of the prediction of "
            "each law, by the normal approximation."
        )
        many = len(next(iter(predicted.values()))) > _MOST_NARROW
        parts.append(figure(svg(laws_figure(table, predicted), names), caption, wide=many))
    for i in range(len(first.objective.terms_of(RunTerm))):
        parts.append(figure(svg(run_figure(*_motions(fits, i)), names), RUN_CAPTION))
    return "\n".join(parts)
