"""The folder of a fit or of a comparison: report.html, and the same as JSON and materials.

A page is one file, with nothing to fetch.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from asperity._version import __version__
from asperity.arrays import Float
from asperity.errors import InputError, naming, require, symbol
from asperity.fit_report.bands import Series, bands_of
from asperity.fit_report.pictures import data_figure, laws_figure, residual_figure, run_figure, svg
from asperity.inference import Fit, LockInTable, Posterior
from asperity.inference.comparison.compare import Comparison, comparison_record
from asperity.inference.fitting.result import fit_record
from asperity.inference.report import (
    comparison_report,
    estimates,
    fit_report,
    noise_in_words,
    posterior_sections,
)
from asperity.inference.runs.run import RecordedRun
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.term import LockInTerm
from asperity.laws.registry import symbols_of
from asperity.materials import cited_works
from asperity.outputs.atomic import written_folder
from asperity.outputs.sections import as_html, html_page, html_table
from asperity.parameters import NAMES, Names, law_parameters, point_parameters
from asperity.parameters.arguments import typed


def document(title: str, kicker: str, heading: str, sections: Mapping[str, str]) -> str:
    """A page as text.

    Parameters
    ----------
    title, kicker, heading : str
        Plain text.
    sections : mapping of str to str
        HTML by heading.
    """
    header = f'<p class="kicker">{escape(kicker)}</p><h1>{escape(heading)}</h1>'
    keyed = {name: (name.lower().replace(" ", "-"), html) for name, html in sections.items()}
    return html_page(title, header, keyed)


def figure(svg: str, caption: str, *, wide: bool = False) -> str:
    """A figure with its caption, a plain text, on its right or, for a wide figure, below."""
    shape = ' class="wide"' if wide else ""
    return f"<figure{shape}>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


RUN_CAPTION = (
    "Friction of the recording, thinned where it has many samples, and the motion of the law with "
    "offset and trend of the gauge; below, the residuals."
)


@typed
def write_report(
    folder: Path, fit: Fit, posterior: Posterior | None = None, names: Names = NAMES[0]
) -> None:
    """Write the report of a fit into a folder, completely or not at all.

    Parameters
    ----------
    folder : Path
    fit : Fit
        Converged.
    posterior : Posterior, optional
    names : {"friction", "geophysics"}
        Names of parameters on the page and in warnings. Numbers in files keep the names of
        friction.

    Raises
    ------
    InputError
        If the fit has not converged, or the folder cannot be written.
    """
    rule = "have converged for a report"
    require(fit.converged, "fit", rule, f"'{fit.message}'", "correct that first")
    symbols = symbols_of(names, fit.objective.law)
    with written_folder(folder, "report") as staging, naming(symbols=symbols):
        more = {"posterior": posterior.record()} if posterior else {}
        record = json.dumps({**fit_record(fit), **more}, indent=2)
        (staging / "fit.json").write_text(record + "\n", encoding="utf-8")
        (staging / "material.toml").write_text(material_text(fit), encoding="utf-8")
        (staging / "report.html").write_text(page(fit, posterior, names), encoding="utf-8")
        if posterior is not None:
            posterior.to_netcdf(staging / "posterior.nc")


def material_text(fit: Fit) -> str:
    """A material file of the law's numbers, K and W0: fitted ones with their standard errors."""
    known = point_parameters(fit.objective.law)
    lines = [
        f"title = {json.dumps(f'{fit.law} fitted to {fit.objective.terms[0].name}')}",
        f"notes = {json.dumps('Written by asperity ' + __version__)}",
    ]
    for name in (*law_parameters(fit.objective.law), "K", "W0", "M"):
        estimate = fit.parameters.get(name)
        fixed, unit = fit.fixed_numbers.get(name, (np.array([np.nan]), ""))
        if estimate is None and (fixed.size != 1 or not np.isfinite(fixed[0])):
            continue
        value = estimate.value if estimate else float(fixed[0])
        parameter = known[name]
        if (estimate.unit if estimate else unit) != parameter.unit:
            continue  # the stiffness of a recording under a stress, or over the load
        lines += [
            "",
            f"[numbers.{name}]",
            f"value = {value!r}",
            f'unit = "{parameter.unit}"',
            f'dimension = "{parameter.kind}"',
            f'kind = "{"fitted" if estimate else "assumed"}"',
            f'place = "{"fit" if estimate else "fixed in the fit"}"',
        ]
        if estimate and np.isfinite(estimate.se):
            lines.insert(-4, f"uncertainty = {estimate.se!r}")
    return "\n".join(lines) + "\n"


def page(fit: Fit, posterior: Posterior | None, names: Names) -> str:
    """The page as text, with embedded figures and without external resources."""
    name = fit.objective.terms[0].name
    sampled = as_html(posterior_sections(posterior)) if posterior else ""
    sections = {
        "Fit": as_html(fit_report(fit)),
        **({"Posterior": sampled} if sampled else {}),
        "Data and fit": _figures(fit, posterior, names),
        "Data": data_tables(fit),
        "Provenance": provenance(fit),
    }
    return document(f"Fit of {fit.law} to {name}", "A fit", f"{fit.law} fitted to {name}", sections)


def _figures(fit: Fit, posterior: Posterior | None, names: Names) -> str:
    parts = []
    source = "posterior" if posterior else "normal approximation"
    for term, residuals in fit.parts(LockInTerm):
        parts += [
            figure(
                svg(data_figure(term.table, bands_of(fit, term, posterior)), names),
                "Readings with standard uncertainties; medians and 95 % bands of the "
                f"prediction by the {source}.",
            ),
            figure(svg(residual_figure(residuals, term.table.row_names), names), "Residuals."),
        ]
    for run, _ in fit.parts(RunTerm):
        drawn = run_figure(run.run, {fit.law: run.fitted_friction(fit.values)})
        parts.append(figure(svg(drawn, names), RUN_CAPTION))
    return "\n".join(parts)


def data_tables(fit: Fit) -> str:
    """The data of a fit: readings of a table in SI, drive and noise of a recording."""
    parts = []
    known = point_parameters(fit.objective.law)

    def heading(name: str) -> str:
        unit = known[name].unit if name in known else "rad" * name.startswith("phase")
        return f"{symbol(name)} ({unit})" if unit else symbol(name)

    for term in fit.objective.terms_of(LockInTerm):
        read = term.table
        columns: dict[str, Any] = {**read.points}
        for name in read.values:
            columns |= {name: read.values[name], f"{name}_err": read.errors[name]}
        rows = [
            (str(read.row_names[i]), *(f"{c[i]:.6g}" for c in columns.values()))
            for i in range(read.rows)
        ]
        parts.append(html_table(("", *map(heading, columns)), rows))
    parts += [_recording(term) for term in fit.objective.terms_of(RunTerm)]
    return "\n".join(parts)


def _recording(term: RunTerm) -> str:
    """Drive and noise of a recording."""
    run = term.run
    ends = run.recorded_times([0.0, *(run.drive.edges[k] for k in run.cuts), run.time[-1]])
    rows = [
        (f"{begin:.6g}", f"{end:.6g}", f"{1e6 * v:.6g}" if v else "hold")
        for begin, end, v in zip(ends[:-1], ends[1:], run.velocities, strict=True)
    ]
    text = ". ".join([*noise_in_words(term), ""])
    return f"<p>{escape(text)}</p>" + html_table(("from (s)", "to (s)", "V (um/s)"), rows)


def provenance(fit: Fit) -> str:
    """Fixed parameters, date, version of the program, and source of the law."""
    fixed = [
        (symbol(n), f"{v[0]:.6g}" + ("" if v.size == 1 else f" to {v[-1]:.6g}"), unit)
        for n, (v, unit) in fit.fixed_numbers.items()
    ]
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    sources = "".join(
        f"<pre>{escape(work)}</pre>" for work in cited_works(fit.objective.law.source).values()
    )
    data = ", ".join(term.name for term in fit.objective.terms)
    return (
        f"<p>asperity {__version__}, {made}; data: {escape(data)}; numbers that were fixed, in "
        f"SI:</p>{html_table(('', 'value', ''), fixed)}<p>The law:</p>{sources}"
    )


#: Columns of panels that are legible in half the width of the page.
_MOST_NARROW = 2


@typed
def write_comparison(folder: Path, comparison: Comparison, names: Names = NAMES[0]) -> None:
    """Write the report of a comparison into a folder, completely or not at all.

    Parameters
    ----------
    folder : Path
    comparison : Comparison
        With one converged fit at least.
    names : {"friction", "geophysics"}
        Names of parameters on the page and in warnings. Numbers in files keep the names of
        friction.

    Raises
    ------
    InputError
        If no fit has converged, or the folder cannot be written.
    """
    fits = {name: j.fit for name, j in comparison.laws.items() if j.fit.converged}
    rule = "have a converged fit for a report"
    require(fits, "comparison", rule, "none", f"{comparison.verdict}")
    symbols = symbols_of(names, *(fit.objective.law for fit in fits.values()))
    with written_folder(folder, "report") as staging, naming(symbols=symbols):
        record = json.dumps(comparison_record(comparison), indent=2)
        page = comparison_page(comparison, fits, names)
        (staging / "comparison.json").write_text(record + "\n", encoding="utf-8")
        (staging / "report.html").write_text(page, encoding="utf-8")
        for name, fit in fits.items():
            (staging / f"{name}.toml").write_text(material_text(fit), encoding="utf-8")


def comparison_page(comparison: Comparison, fits: Mapping[str, Fit], names: Names) -> str:
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
        "Verdict": as_html(comparison_report(comparison, reasons=True)),
        "Data and laws": _figures_of_laws(fits, names),
        "Estimates": "".join(
            f"<h3>{escape(name)}</h3>{as_html([estimates(fit)])}" for name, fit in fits.items()
        ),
        "Data": data_tables(first),
        "Provenance": "".join(
            f"<h3>{escape(name)}</h3>{provenance(fit)}" for name, fit in fits.items()
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


def _figures_of_laws(fits: Mapping[str, Fit], names: Names) -> str:
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
