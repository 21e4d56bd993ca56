"""Fits and comparisons as sections of sentences and tables, for every kind of report."""

from __future__ import annotations

import math

import numpy as np

from asperity.errors import symbol, symbols, worded
from asperity.inference.comparison.compare import Comparison, laws_table
from asperity.inference.cycles import CycleTerm
from asperity.inference.fitting.result import (
    MISFIT,
    NOT_DETERMINED,
    Estimate,
    Fit,
    Shown,
    with_error,
)
from asperity.inference.fitting.windows import WindowedFit
from asperity.inference.holds import HoldTerm
from asperity.inference.posterior import Posterior
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.table import LockInTable
from asperity.inference.tables.term import LockInTerm
from asperity.outputs.sections import Section, two_digits
from asperity.units import quantity_text


def fit_report(fit: Fit) -> list[Section]:
    """Outcome in words, estimates, correlations, quality and warnings of a fit."""
    if not fit.converged:
        return [Section(f"{fit.law}: {fit.message}")]
    names = list(fit.parameters)
    correlations = tuple(
        (
            symbol(n),
            *(f"{fit.correlation[i, j]:+.2f}" if j < i else "" for j in range(len(names) - 1)),
        )
        for i, n in enumerate(names)
        if i
    )
    return [
        Section(fit.law, fit_in_words(fit)),
        estimates(fit),
        *(
            [Section("correlations", (), ("", *map(symbol, names[:-1])), correlations)]
            if correlations
            else []
        ),
        quality(fit),
        Section("", warnings=tuple(fit.warnings)),
    ]


def fit_in_words(fit: Fit) -> tuple[str, ...]:
    """Conclusions of a fit in sentences: A - B, mu0, and undetermined parameters."""
    if not fit.converged:
        return ()
    sentences = [f"These numbers are doubtful: {'; '.join(fit.doubts)}."] if fit.doubts else []
    difference = fit.rate_dependence
    if difference is not None:
        sentences.append(f"{symbol(difference.name)} = {difference.shown}: {difference.meaning}")
    if fit.level_change is not None:
        value, error, steps = fit.level_change
        which = "its step" if steps == 1 else f"its {steps} steps"
        sentences.append(
            f"steady friction alone, before and after {which}: d mu/d ln V = "
            f"{with_error(value, error)}, measured without a law"
        )
    values = {**fit.objective.fixed, **fit.values}
    mu0, V0 = (np.unique(values.get(name, math.nan)) for name in ("mu0", "V0"))
    # Fits of holds and of cycles take friction relative to a level: their mu0 is assumed.
    assumed = bool(fit.parts(HoldTerm)) or bool(fit.parts(CycleTerm))
    if mu0.size == V0.size == 1 and np.isfinite(mu0 + V0) and not assumed:
        sentences.append(f"mu0 = {mu0[0]:.4g} at V0 = {quantity_text(V0[0], 'm/s')}")
    if fit.undetermined:
        sentences.append(f"not determined by these data: {symbols(fit.undetermined)}")
    return tuple(sentences)


def estimates(fit: Fit) -> Section:
    """Estimates with standard errors and intervals, or "not determined"."""
    head = ("", "estimate", "std. error", "68 % interval", "95 % interval", "", "")
    rows = tuple(
        _estimate_row(symbol(name), p, name.removesuffix("/W0") in fit.undetermined)
        for name, p in {**fit.parameters, **fit.over_load}.items()
    )
    return Section("", (), head, rows)


def _estimate_row(name: str, p: Estimate, undetermined: bool) -> tuple[str, ...]:
    if undetermined:
        return name, NOT_DETERMINED, "", "", "", p.unit, "by these data"
    shown = Shown.of(p.value, p.se, p.unit)
    notes = "at its bound" if p.at_bound else ""
    if p.prior is not None:
        mean, sd, unit = p.prior.mean, p.prior.sd, p.prior.unit
        if unit in ("", p.unit):
            mean, sd, unit = mean * 10.0**-shown.power, sd * 10.0**-shown.power, shown.unit
        unit = f" {unit}" if unit else ""
        notes = f"prior {mean:.4g} +- {two_digits(sd)}{unit} ({p.prior.source})"
    intervals = (shown.interval(p.interval_68), shown.interval(p.interval_95))
    return name, shown.value, shown.error(p.se), *intervals, shown.unit, notes


def quality(fit: Fit) -> Section:
    """Whether the law describes the data, and the noise."""
    sentences = [
        "the noise is estimated from the residual, so that chi-squared does not judge the law; "
        "laws are compared by AICc (asperity compare)"
    ]
    rows: tuple[tuple[str, ...], ...] = ()
    if fit.judged_by_chi2:
        sentences = ["as many free parameters as data: nothing is left to judge the law by"]
        if fit.dof > 0:
            good = fit.p_value >= MISFIT
            sentences = [
                f"chi-squared {fit.chi2:.4g} for {fit.dof} degrees of freedom, p = "
                f"{fit.p_value:.3g}: the law {'describes' if good else 'does not describe'} these "
                f"data within their uncertainties (it does not below {MISFIT:g})"
            ]
        rows = tuple(
            (name, f"{chi2:.4g}", f"for {count} data")
            for name, (chi2, count) in fit.observables.items()
        )
    sentences += [s for term, _ in fit.parts(LockInTerm) if (s := _needed_bandwidth(term.table))]
    for term in fit.objective.terms_of(RunTerm):
        sentences += noise_in_words(term)
    sentences.append(
        f"log-likelihood {fit.log_likelihood:.6g}, AICc {fit.aicc:.6g}, BIC {fit.bic:.6g}"
    )
    return Section("", tuple(sentences), (), rows)


def noise_in_words(term: RunTerm) -> list[str]:
    """Sentences on the noise of a recording, and on the averaging of its samples."""
    noise = term.noise
    model = (
        f"noise {noise['model']}, {noise['effective_samples']:.4g} effective of "
        f"{noise['samples']} samples, whiteness p = {noise['whiteness_p']:.2g}"
    )
    return [f"{term.name}: {text}" for text in (model, noise["averaged"]) if text]


def _needed_bandwidth(table: LockInTable) -> str:
    """The bandwidth of the gauges that the uncertainties of phases need; empty without phases.

    A low-pass of first order with the corner frequency f_c shifts a phase at f by f/f_c.
    """
    corners = [
        (n * frequency / error, n * frequency, error)
        for n in (1, 2)
        for frequency, error in zip(
            table.points["frequency"], table.errors.get(f"phase{n}", ()), strict=False
        )
        if np.isfinite(error) and error > 0
    ]
    if not corners:
        return ""
    corner, frequency, error = max(corners)
    return (
        f"{table.name}: the phase at {quantity_text(frequency, 'Hz', 3)} has an uncertainty of "
        f"{error:.2g} rad by noise; a gauge or filter with a low-pass below "
        f"{quantity_text(corner, 'Hz', 3)} shifts it by more, and the uncertainties here do not "
        "include this"
    )


def windows_sections(over: WindowedFit) -> list[Section]:
    """Estimates over several windows."""
    spans = ", ".join(f"{a:.6g} to {b:.6g}" for a, b in over.windows)
    head = ("", "estimate", "std. error", "of noise", "of the window", "95 % interval", "", "")
    rows: list[tuple[str, ...]] = []
    for name, p in over.parameters.items():
        if name in over.undetermined:
            rows.append((symbol(name), NOT_DETERMINED, "", "", "", "", p.unit, "by these data"))
            continue
        shown = Shown.of(p.value, p.se, p.unit)
        errors = [shown.error(se) for se in (p.se, p.se_noise, p.se_window)]
        rows.append(
            (symbol(name), shown.value, *errors, shown.interval(p.interval_95), shown.unit, "")
        )
    title = f"over {len(over.windows)} windows ({spans} s)"
    return [Section(title, (), head, tuple(rows), over.new_warnings)]


def posterior_sections(posterior: Posterior) -> list[Section]:
    """Means, standard deviations and diagnostics of a posterior."""
    chains, draws = posterior.log_density.shape
    head = ("", "mean", "sd", "95 % interval", "", "R-hat", "ESS bulk", "ESS tail")
    rows = []
    for name, p in posterior.parameters.items():
        shown = Shown.of(p.mean, p.sd, p.unit)
        numbers = (shown.value, shown.error(p.sd), shown.interval(p.interval_95), shown.unit)
        rows.append(
            (symbol(name), *numbers, f"{p.r_hat:.4f}", f"{p.ess_bulk:.0f}", f"{p.ess_tail:.0f}")
        )
    diverging = int(posterior.diverging.sum())
    title = f"posterior, {chains} chains of {draws} draws, {diverging} diverging"
    return [Section(title, (), head, tuple(rows), tuple(posterior.warnings))]


def comparison_report(comparison: Comparison, *, reasons: bool = False) -> list[Section]:
    """The verdict, the table of the laws, and the warnings of each law.

    The table names parameters that are not determined; the warnings of a fit on them are left out.
    """
    head, rows = laws_table(comparison, reasons=reasons)
    warnings = {
        name: [worded(w) for w in j.fit.sentences if w not in j.fit.because.values()]
        for name, j in comparison.laws.items()
    }
    # A warning of every law is about the data, and is given once.
    first = next(iter(warnings.values()), [])
    of_data = [w for w in first if all(w in warned for warned in warnings.values())]
    of_laws = [f"{n}: {w}" for n, warned in warnings.items() for w in warned if w not in of_data]
    return [Section("", (comparison.verdict,), head, tuple(rows), (*of_data, *of_laws))]
