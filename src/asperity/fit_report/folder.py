"""The folder of a fit: report.html, fit.json, material.toml, and posterior.nc if it was sampled."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from asperity._version import __version__
from asperity.errors import InputError
from asperity.fit_report.bands import bands_of
from asperity.fit_report.pictures import data_figure, residual_figure
from asperity.inference import Fit, Posterior
from asperity.inference.forward import LockInTerm
from asperity.inference.record import fit_record
from asperity.materials import citation
from asperity.outputs.folder import written_folder
from asperity.parameters import law_parameters, point_parameters


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
    with written_folder(folder) as staging:
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
    style = files("asperity.papers.report").joinpath("page.css").read_text(encoding="utf-8")
    name = found.objective.terms[0].name
    sections = {
        "Verdict": _verdict(found, posterior),
        "Estimates": _estimates(found),
        **({"Posterior": _posterior(posterior)} if posterior else {}),
        "Correlations": _correlations(found),
        "Data and fit": _figures(found, posterior),
        "Data": _data(found),
        "Provenance": _provenance(found),
    }
    body = "\n".join(
        f'<section aria-label="{title}"><h2>{title}</h2>\n{content}\n</section>'
        for title, content in sections.items()
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>Fit of {escape(found.law)} to {escape(name)}</title>\n<style>\n{style}\n"
        "table{border-collapse:collapse;display:block;overflow-x:auto}"
        "td,th{padding:.15rem .7rem;text-align:right;white-space:nowrap}"
        "td:first-child,th:first-child{text-align:left}svg{max-width:100%;height:auto;background:#fff}</style>\n"
        f'</head>\n<body>\n<header><p class="kicker">A fit</p><h1>{escape(found.law)} fitted to '
        f"{escape(name)}</h1></header>\n<main>\n{body}\n</main>\n"
        f"<footer>Written by asperity {__version__}.</footer>\n</body>\n</html>\n"
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def cells(row: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(c)}</{tag}>" for c in row) + "</tr>"

    return f"<table>{cells(head, 'th')}{''.join(cells(row, 'td') for row in rows)}</table>"


def _verdict(found: Fit, posterior: Posterior | None) -> str:
    good = found.dof <= 0 or found.p_value >= 0.01
    lines = [
        f"chi-squared {found.chi2:.4g} for {found.dof} degrees of freedom, p = "
        f"{found.p_value:.3g}: the law {'describes' if good else 'does not describe'} these data "
        "within their uncertainties."
    ]
    warnings = [*found.warnings, *(posterior.warnings if posterior else ())]
    listed = "".join(f"<li>{escape(w)}</li>" for w in warnings)
    observables = _table(
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
        )
        for n, p in found.parameters.items()
    ]
    return _table(("", "estimate", "standard error", "68 %", "95 %", "unit"), rows)


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
    return _table(head, rows)


def _correlations(found: Fit) -> str:
    names = list(found.parameters)
    rows = [
        (n, *(f"{x:+.3f}" for x in row)) for n, row in zip(names, found.correlation, strict=True)
    ]
    return _table(("", *names), rows)


def _figures(found: Fit, posterior: Posterior | None) -> str:
    parts = []
    for term, residuals in zip(found.objective.terms, found.residuals, strict=True):
        if isinstance(term, LockInTerm):
            source = "posterior" if posterior else "normal approximation"
            figure = data_figure(term.table, bands_of(found, term, posterior))
            parts.append(
                f"<figure>{figure}<figcaption>Readings with standard uncertainties; medians and 95 "
                f"% bands of the prediction by the {source}.</figcaption></figure>"
            )
            figure = residual_figure(residuals, term.table.row_names)
            parts.append(f"<figure>{figure}<figcaption>Residuals.</figcaption></figure>")
    return "\n".join(parts)


def _data(found: Fit) -> str:
    parts = []
    for term in found.objective.terms:
        if isinstance(term, LockInTerm):
            table = term.table
            columns: dict[str, Any] = {**table.points}
            for name in table.values:
                columns |= {name: table.values[name], f"{name}_err": table.errors[name]}
            rows = [
                (str(table.row_names[i]), *(f"{c[i]:.6g}" for c in columns.values()))
                for i in range(table.rows)
            ]
            parts.append(_table(("", *columns), rows))
    return "\n".join(parts)


def _provenance(found: Fit) -> str:
    fixed = [
        (n, f"{np.min(v):.6g}" + ("" if np.ptp(v) == 0 else f" to {np.max(v):.6g}"))
        for n, v in found.objective.fixed.items()
    ]
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    sources = "".join(
        f"<pre>{escape(citation(key.strip()))}</pre>"
        for key in found.objective.law.source.split(",")
        if key.strip()
    )
    names = ", ".join(term.name for term in found.objective.terms)
    return (
        f"<p>asperity {__version__}, {made}; data: {escape(names)}; numbers that were fixed, in "
        f"SI:</p>{_table(('', 'value'), fixed)}<p>The law:</p>{sources}"
    )
