"""The folder of a fit: report.html, fit.json, material.toml, and posterior.nc if it was sampled."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from asperity._version import __version__
from asperity.errors import InputError
from asperity.fit_report.bands import bands_of
from asperity.fit_report.page import document, figure, table
from asperity.fit_report.pictures import data_figure, residual_figure, run_figure
from asperity.inference import Fit, Posterior
from asperity.inference.fitting.result import fit_record
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.term import LockInTerm
from asperity.materials import cited_works
from asperity.outputs.written import written_folder
from asperity.parameters import law_parameters, point_parameters

RUN_CAPTION = (
    "Friction of the recording, thinned where it has many samples, and the motion of the law with "
    "offset and trend of the gauge; below, what is left."
)
#: Of a parameter whose numbers say nothing.
UNDETERMINED = "not determined by these data"


def write_report(folder: Path, found: Fit, posterior: Posterior | None = None) -> None:
    """Write everything that a fit says into a folder, completely or not at all.

    Parameters
    ----------
    folder : Path
    found : Fit
        Converged.
    posterior : Posterior, optional

    Raises
    ------
    InputError
        If the fit has not converged, or the folder cannot be written.
    """
    if not found.converged:
        raise InputError(
            f"fit must have converged for a report, got '{found.message}'; correct that first"
        )
    with written_folder(folder, "report") as staging:
        more = {"posterior": posterior.record()} if posterior else {}
        record = json.dumps({**fit_record(found), **more}, indent=2)
        (staging / "fit.json").write_text(record + "\n", encoding="utf-8")
        (staging / "material.toml").write_text(material_text(found), encoding="utf-8")
        (staging / "report.html").write_text(page(found, posterior), encoding="utf-8")
        if posterior is not None:
            posterior.to_netcdf(staging / "posterior.nc")


def material_text(found: Fit) -> str:
    """A material file of the law's numbers, K and W0: fitted ones with their standard errors."""
    known = point_parameters(found.objective.law)
    lines = [
        f"title = {json.dumps(f'{found.law} fitted to {found.objective.terms[0].name}')}",
        f"notes = {json.dumps('Written by asperity ' + __version__)}",
    ]
    for name in (*law_parameters(found.objective.law), "K", "W0", "M"):
        estimate = found.parameters.get(name)
        fixed = np.unique(found.objective.fixed.get(name, np.nan))
        if estimate is None and (fixed.size != 1 or not np.isfinite(fixed[0])):
            continue
        value = estimate.value if estimate else float(fixed[0])
        parameter = known[name]
        if estimate and estimate.unit != parameter.unit:
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


def page(found: Fit, posterior: Posterior | None) -> str:
    """The page as text, with its figures in it and nothing to fetch."""
    name = found.objective.terms[0].name
    sections = {
        "Verdict": _verdict(found, posterior),
        "Estimates": _estimates(found),
        **({"Posterior": _posterior(posterior)} if posterior else {}),
        "Correlations": _correlations(found),
        "Data and fit": _figures(found, posterior),
        "Data": data_tables(found),
        "Provenance": provenance(found),
    }
    return document(
        f"Fit of {found.law} to {name}", "A fit", f"{found.law} fitted to {name}", sections
    )


def _verdict(found: Fit, posterior: Posterior | None) -> str:
    good = found.dof <= 0 or found.p_value >= 0.01
    lines = [
        f"chi-squared {found.chi2:.4g} for {found.dof} degrees of freedom, p = "
        f"{found.p_value:.3g}: the law {'describes' if good else 'does not describe'} these data "
        "within their uncertainties."
    ]
    if not found.judged_by_chi2:
        lines = [
            "The noise of a recording is estimated from what the law leaves, so that chi-squared "
            f"does not judge the law; AICc {found.aicc:.6g} compares it with others."
        ]
    warnings = [*found.warnings, *(posterior.warnings if posterior else ())]
    listed = "".join(f"<li>{escape(w)}</li>" for w in warnings)
    observables = table(
        ("observable", "chi-squared", "data"),
        [(n, f"{c:.4g}", str(k)) for n, (c, k) in found.observables.items()],
    )
    return f"<p>{escape(lines[0])}</p>{observables}" + (f"<ul>{listed}</ul>" if listed else "")


def _estimates(found: Fit) -> str:
    rows = [
        (
            n,
            f"{p.value:.6g}",
            f"{p.se:.2g}",
            f"{p.interval_68[0]:.5g} to {p.interval_68[1]:.5g}",
            f"{p.interval_95[0]:.5g} to {p.interval_95[1]:.5g}",
            p.unit,
            UNDETERMINED if n in found.undetermined else "",
        )
        for n, p in {**found.parameters, **found.over_load}.items()
    ]
    return table(("", "estimate", "standard error", "68 %", "95 %", "unit", ""), rows)


def _posterior(found: Posterior) -> str:
    rows = [
        (
            n,
            f"{p.mean:.6g}",
            f"{p.sd:.2g}",
            f"{p.interval_95[0]:.5g} to {p.interval_95[1]:.5g}",
            f"{p.r_hat:.4f}",
            f"{p.ess_bulk:.0f}",
            f"{p.ess_tail:.0f}",
        )
        for n, p in found.parameters.items()
    ]
    head = ("", "mean", "standard deviation", "95 %", "R-hat", "ESS bulk", "ESS tail")
    return table(head, rows)


def _correlations(found: Fit) -> str:
    names = list(found.parameters)
    rows = [
        (n, *(f"{x:+.3f}" for x in row)) for n, row in zip(names, found.correlation, strict=True)
    ]
    return table(("", *names), rows)


def _figures(found: Fit, posterior: Posterior | None) -> str:
    parts = []
    source = "posterior" if posterior else "normal approximation"
    for term, residuals in found.parts(LockInTerm):
        parts += [
            figure(
                data_figure(term.table, bands_of(found, term, posterior)),
                "Readings with standard uncertainties; medians and 95 % bands of the "
                f"prediction by the {source}.",
            ),
            figure(residual_figure(residuals, term.table.row_names), "Residuals."),
        ]
    for run, _ in found.parts(RunTerm):
        drawn = run_figure(run.run, {found.law: run.fitted_friction(found.values)})
        parts.append(figure(drawn, RUN_CAPTION))
    return "\n".join(parts)


def data_tables(found: Fit) -> str:
    """The data of a fit: readings of a table, drive and noise of a recording."""
    parts = []
    for term in found.objective.terms_of(LockInTerm):
        read = term.table
        columns: dict[str, Any] = {**read.points}
        for name in read.values:
            columns |= {name: read.values[name], f"{name}_err": read.errors[name]}
        rows = [
            (str(read.row_names[i]), *(f"{c[i]:.6g}" for c in columns.values()))
            for i in range(read.rows)
        ]
        parts.append(table(("", *columns), rows))
    parts += [_recording(term) for term in found.objective.terms_of(RunTerm)]
    return "\n".join(parts)


def _recording(term: RunTerm) -> str:
    """Drive and noise of a recording."""
    run, noise = term.run, term.noise
    ends = np.array([0.0, *(run.drive.edges[k] for k in run.cuts), run.time[-1]])
    rows = [
        (f"{begin:.6g}", f"{end:.6g}", f"{1e6 * v:.6g}" if v else "hold")
        for begin, end, v in zip(ends[:-1], ends[1:], run.velocities, strict=True)
    ]
    said = (
        f"{run.name}: {noise['samples']} samples, of which {noise['effective_samples']:.4g} are "
        f"independent; noise {noise['model']}, whiteness p = {noise['whiteness_p']:.2g}."
        + (f" {noise['averaged']}." if noise["averaged"] else "")
    )
    return f"<p>{escape(said)}</p>" + table(("from (s)", "to (s)", "V (\u00b5m/s)"), rows)


def provenance(found: Fit) -> str:
    """What was fixed, when and by which program, and where the law is from."""
    fixed = [
        (n, f"{np.min(v):.6g}" + ("" if np.ptp(v) == 0 else f" to {np.max(v):.6g}"))
        for n, v in found.objective.fixed.items()
    ]
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    sources = "".join(
        f"<pre>{escape(work)}</pre>" for work in cited_works(found.objective.law.source).values()
    )
    names = ", ".join(term.name for term in found.objective.terms)
    return (
        f"<p>asperity {__version__}, {made}; data: {escape(names)}; numbers that were fixed, in "
        f"SI:</p>{table(('', 'value'), fixed)}<p>The law:</p>{sources}"
    )
