"""``asperity fit``: a friction law fitted to lock-in readings and recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.fit.data import RUN_OPTIONS, FitData, priors_of, run_options
from asperity.cli.fit.posterior import PosteriorOptions, posterior_options, posterior_text
from asperity.cli.measure.source import RecordingSource, source_options
from asperity.cli.options import json_option, law_named, law_option, material_named, settings_of
from asperity.errors import InputError
from asperity.outputs import require_folder

if TYPE_CHECKING:
    from asperity.inference import Fit, WindowedFit

_EPILOG = """\b
Examples:
  asperity fit readings.csv --law elasto-plastic --material bureau2000 \\
      --free lambda,eps_ratio,A,B
  asperity fit readings.csv --law elasto-plastic --material bureau2000 \\
      --free lambda,eps_ratio --fix "K=0.21 N/um" --prior bureau2000 --profile --json
  asperity fit readings.csv --law elasto-plastic --material bureau2000 \\
      --free lambda,eps_ratio --posterior --out posterior.nc
  asperity fit velocity_steps.csv --law rice-ruina --free A,B,D0,K --window 100:400

\b
Table: one operating point a row, in SI without units: V, epsilon (as applied),
frequency, other parameters that differ between rows, and observables
mean_friction, delta_mu, mu1, mu2, phase1, phase2 with the standard uncertainty
of each in NAME_err, covariances in NAME_NAME_cov. Tables and JSON by
'asperity measure' go in as they are; give the velocity by --fix "V=1 um/s".
Harmonics are compared as complex numbers where phases are given. eps_ratio is
the share of epsilon that the contacts carry.

\b
Holds: one slide-hold-slide test a row: hold_time, healing (static friction less
the level of sliding), V, K over the normal load (N/m with a column W0), and
healing_err, the standard uncertainty; without it one error for all holds is
estimated from what the law leaves. In SI, or with units in the heading: K (1/um).

\b
Recording: any file that 'asperity measure' reads, with friction (or force and
load) and the displacement or velocity of the load point. It is compared with the
motion through the whole of it; its stiffness K is free, its noise autoregressive.
More than 20,000 samples are compared as means over blocks (--fit-rate).
"""


def fit_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options that ``fit`` and ``compare`` share, gathered into `free` and `options`."""

    @wraps(command)
    def gathered(
        *,
        free: str | None,
        fixes: tuple[str, ...],
        starts: tuple[str, ...],
        material: str | None,
        prior: tuple[str, ...],
        profile: bool,
        inertia: bool,
        radiation_damping: bool,
        source: RecordingSource,
        window: str | None,
        steps: str | None,
        velocities: str | None,
        stiffness_from: str | None,
        trend: str,
        drift: bool,
        initial: str,
        gauge: str | None,
        gauge_order: int,
        fit_rate: str | None,
        **others: Any,
    ) -> Any:
        names = None if free is None else [n.strip() for n in free.split(",") if n.strip()]
        options = {
            "fixed": settings_of(fixes, "--fix"),
            "start": settings_of(starts, "--start"),
            "material": material_named(material),
            "prior": priors_of(prior, names),
            "profile": profile,
            "inertia": inertia,
            "radiation_damping": radiation_damping,
            "runs": run_options(
                trend=trend,
                drift=drift,
                initial=initial,
                gauge=gauge,
                gauge_order=gauge_order,
                fit_rate=fit_rate,
            ),
        }
        reading = FitData(source, window, steps, velocities, stiffness_from)
        return command(free=names, options=options, reading=reading, **others)

    result: Callable[..., Any] = source_options(gathered)
    for option in (
        click.argument("data", nargs=-1, required=True, type=Path),
        click.option(
            "--free",
            metavar="NAMES",
            help="Free parameters: a,b,c; by default all of the law that the data may show.",
        ),
        click.option(
            "--fix", "fixes", multiple=True, metavar="NAME=VALUE", help="Fix a parameter."
        ),
        click.option("--start", "starts", multiple=True, metavar="NAME=VALUE", help="Start value."),
        click.option("--material", metavar="NAME", help="Fixes what is given nowhere else."),
        click.option(
            "--prior",
            multiple=True,
            metavar="NAME|NAME=VALUE+-SD",
            help='Published uncertainties of a material, or "K=0.2+-0.01 N/um"; repeatable.',
        ),
        click.option("--profile", is_flag=True, help="Intervals by profile likelihood."),
        click.option("--inertia", is_flag=True, help="The mass of the slider counts."),
        click.option("--radiation-damping", is_flag=True, help="The damping eta counts."),
        *RUN_OPTIONS,
        json_option(),
    ):
        result = option(result)
    return result


@click.command(epilog=_EPILOG)
@law_option()
@click.option(
    "--windows",
    metavar="SPANS|auto",
    help="Fit a recording in several windows, like 100:400,120:380; their spread is reported.",
)
@fit_options
@posterior_options
@click.option("--report", type=Path, metavar="DIR", help="Folder for a page, a material and draws.")
def fit(
    data: tuple[Path, ...],
    law: str | None,
    free: list[str] | None,
    options: Mapping[str, Any],
    sampling: PosteriorOptions,
    reading: FitData,
    windows: str | None,
    report: Path | None,
    as_json: bool,
) -> int:
    """Fit a friction law to tables of lock-in readings and to recordings.

    Estimates with intervals, correlations, what the data cannot determine, and whether the law
    describes them.
    """
    from asperity import inference
    from asperity.cli.progress import bar
    from asperity.cli.report import to_json
    from asperity.inference.fitting.result import fit_record

    sampling.check()
    if report is not None:
        require_folder(report, "--report")
    options = {**options, "prior": reading.stiffness_prior(data, options, windows)}
    over = None
    if windows is not None:
        with bar("window", raising=False) as update:
            options["progress"] = update
            over = reading.fit_windows(data, windows, law_named(law), free, options)
        result = over.fits[0]
    else:
        read = reading.read(data, options["fixed"])
        with bar("step", raising=False) as update:
            result = inference.fit(read, law_named(law), free, progress=update, **options)
    posterior = sampling.sample(result)
    if report is not None and result.converged:
        from asperity.fit_report import write_report

        write_report(report, result, posterior)
    if as_json:
        more = {"posterior": posterior.record()} if posterior else {}
        more |= {"windows": over.record()} if over else {}
        click.echo(to_json({**fit_record(result), **more}))
    else:
        click.echo(fit_text(result))
        if over:
            click.echo(windows_text(over))
        if posterior:
            click.echo(posterior_text(posterior))
    return 0 if result.converged and (posterior is None or posterior.converged) else 1


def fit_text(result: Fit) -> str:
    """A fit as a person reads it."""
    from asperity.cli.report import aligned

    if not result.converged:
        return f"{result.law}: {result.message}"
    rows = [("", "estimate", "std. error", "95 % interval", "", "")]
    for name, p in {**result.parameters, **result.over_load}.items():
        notes = "at its bound" if p.at_bound else ""
        if name in result.undetermined:
            notes = "not determined by these data"
        elif p.prior is not None:
            notes = f"prior {p.prior.mean:.4g} +- {p.prior.sd:.2g} ({p.prior.source})"
        low, high = p.interval_95
        rows.append(
            (name, f"{p.value:.6g}", f"{p.se:.2g}", f"{low:.5g} to {high:.5g}", p.unit, notes)
        )
    names = list(result.parameters)
    matrix = [
        (n, *(f"{result.correlation[i, j]:+.2f}" for j in range(i)))
        for i, n in enumerate(names)
        if i
    ]
    fits = [
        (n, f"{chi2:.4g}", f"for {count} data") for n, (chi2, count) in result.observables.items()
    ]
    lines = [result.law, aligned(rows, "  ")]
    if matrix:
        width = len(names)
        filled = [tuple(row) + ("",) * (width - len(row)) for row in matrix]
        lines += ["correlations", aligned([("", *names[:-1]), *filled], "  ")]
    lines += [
        *(
            (
                f"chi-squared {result.chi2:.4g} for {result.dof} degrees of freedom, "
                f"p = {result.p_value:.3g}",
                aligned(fits, "  "),
            )
            if result.judged_by_chi2
            else ("the noise is estimated from what the law leaves: chi-squared judges nothing",)
        ),
        *_runs(result),
        f"log-likelihood {result.log_likelihood:.6g}, AICc {result.aicc:.6g}, BIC {result.bic:.6g}",
    ]
    return "\n".join([*lines, *(f"warning: {w}" for w in result.warnings)])


def windows_text(over: WindowedFit) -> str:
    """Estimates over several windows as a person reads them."""
    from asperity.cli.report import aligned

    spans = ", ".join(f"{a:.6g} to {b:.6g}" for a, b in over.windows)
    rows = [("", "estimate", "std. error", "of noise", "of the window", "95 % interval", "", "")]
    for name, p in over.parameters.items():
        low, high = p.interval_95
        rows.append(
            (
                name,
                f"{p.value:.6g}",
                f"{p.se:.2g}",
                f"{p.se_noise:.2g}",
                f"{p.se_window:.2g}",
                f"{low:.5g} to {high:.5g}",
                p.unit,
                "not determined by these data" if name in over.undetermined else "",
            )
        )
    lines = [f"over {len(over.windows)} windows ({spans} s)", aligned(rows, "  ")]
    first = set(over.fits[0].warnings)
    return "\n".join(
        [
            *lines,
            *(f"warning: {w}" for w in over.warnings if w.partition(" s: ")[2] not in first),
        ]
    )


def _runs(result: Fit) -> list[str]:
    """Noise of the recordings."""
    from asperity.inference.runs.term import RunTerm

    lines = []
    for term in result.objective.terms_of(RunTerm):
        noise = term.noise
        lines.append(
            f"{term.name}: noise {noise['model']}, {noise['effective_samples']:.4g} effective "
            f"of {noise['samples']} samples, whiteness p = {noise['whiteness_p']:.2g}"
        )
        if noise["averaged"]:
            lines.append(f"{term.name}: {noise['averaged']}")
    return lines


def checked_laws(text: str) -> list[str]:
    """Names of laws from ``all`` or a list of names and places.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    from asperity.laws import get_law, known_law, registered

    if text.strip() == "all":
        return [name for name, law in registered().items() if law.rate_dependent]
    names = [known_law(name.strip()) for name in text.split(",") if name.strip()]
    if not names:
        raise InputError(f"--laws must name laws, got '{text}'; write 'all' or a,b,c")
    for name in names:
        get_law(name)
    return names
