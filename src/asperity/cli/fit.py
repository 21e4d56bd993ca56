"""``asperity fit`` and ``asperity compare``: laws fitted to lock-in readings and recordings."""

from __future__ import annotations

from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import (
    Command,
    Count,
    Decorator,
    field_option,
    law_options,
    option,
    output_options,
    parameter_name,
    settings_of,
    stacked,
    switch,
)
from asperity.cli.recording import source_options, times_option, velocities_option
from asperity.cli.report import Output, say
from asperity.cli.words import fields_as_options
from asperity.errors import InputError, require
from asperity.outputs import require_folder

if TYPE_CHECKING:
    from asperity.inference import Fit as FitResult
    from asperity.inference.posterior import Posterior

_EPILOG = """\b
Examples:
  asperity fit velocity_steps.csv
  asperity fit velocity_steps.csv --law rice-ruina --free A,B,D0,K --window 100:400
  asperity fit readings.csv --law elasto-plastic --material bureau2000 \\
      --free lambda,eps_ratio,A,B
  asperity fit readings.csv --law elasto-plastic --material bureau2000 \\
      --free lambda,eps_ratio --fix "K=0.21 N/um" --prior bureau2000 --profile --json
  asperity fit readings.csv --law elasto-plastic --material bureau2000 \\
      --free lambda,eps_ratio --posterior --out posterior.nc

\b
Table: one operating point a row, in SI or with units in the heading, as
"V (um/s)": V, epsilon (as applied), frequency, other parameters that differ
between rows, and observables mean_friction, delta_mu, mu1, mu2, phase1, phase2
with the standard uncertainty of each in NAME_err, covariances in NAME_NAME_cov.
Tables and JSON by 'asperity measure' go in as they are; give the velocity by
--fix "V=1 um/s". Harmonics are compared as complex numbers where phases are
given. eps_ratio is the share of epsilon that the contacts carry.

\b
Holds: one slide-hold-slide test a row: hold_time, healing (static friction less
the level of sliding), V, K over the normal load (N/m with a column W0), and
healing_err or healing_uncertainty, the standard uncertainty; without it an error
common to all holds is estimated from the residuals. In SI, or with units in the heading: K (1/um).

\b
Recording: any file that 'asperity measure' reads, with friction (or force and
load) and the displacement or velocity of the load point. One computed motion is
compared with the whole recording; the stiffness K is free, the noise is
autoregressive. More than 20,000 samples are compared as means over blocks
(--fit-rate).
"""

#: Options of the sampling, with their defaults.
_SAMPLING = {"chains": 4, "draws": 1000, "seed": 0}
#: Options that are fields of the question, with their metavar as for `field_option`.
_FIELDS = {
    "free": "NAMES",
    "material": "NAME",
    "windows": "SPANS|auto",
    "stiffness_from": "START:END",
    "trend": "",
    "drift": None,
    "initial": "",
    "gauge": "HZ",
    "gauge_order": "N",
    "fit_rate": "HZ|full",
    "profile": None,
    "inertia": None,
    "radiation_damping": None,
}


def _field(name: str) -> Any:
    return field_option("asperity.questions.fit:Fit", name, _FIELDS[name])


#: Options of data and estimation: the most used ones, then the others.
_FIRST = (
    field_option("asperity.questions.fit:Data", "window", "START:END"),
    _field("free"),
    option("--fix fixed", "NAME=VALUE", 'Fix a number, like "D0=5 um"; repeatable.', multiple=True),
    option("--start", "NAME=VALUE", "Start value of a free parameter; repeatable.", multiple=True),
    _field("material"),
    option(
        "--prior",
        "NAME|NAME=VALUE+-SD",
        'Published uncertainties of a material, or "K=0.2+-0.01 N/um"; repeatable.',
        multiple=True,
    ),
)
_THEN = (
    times_option(
        "--steps", "Times (s) at which the velocity of the drive changes, where no channel has it."
    ),
    velocities_option,
    *(_field(n) for n in ("stiffness_from", "trend", "drift", "initial", "gauge", "gauge_order")),
    *(_field(name) for name in ("fit_rate", "profile", "inertia", "radiation_damping")),
)


def _question_options(*further: Decorator) -> Decorator:
    """Options of data and estimation; the command gets `fields` of its question.

    Parameters
    ----------
    *further : click options
        Options of this command alone.
    """

    def with_options(command: Command) -> Command:
        @wraps(command)
        def gathered(
            *,
            data: tuple[Path, ...],
            source: Any,
            fixed: tuple[str, ...],
            start: tuple[str, ...],
            prior: tuple[str, ...],
            report: Path | None,
            output: Output,
            **others: Any,
        ) -> Any:
            from asperity.questions.options import FIT_OPTIONS

            with fields_as_options(FIT_OPTIONS):
                of_run = {name: others.pop(name) for name in ("window", "steps", "velocities")}
                fields = {
                    "data": [{"file": path, "source": source, **of_run} for path in data],
                    "fixed": settings_of(fixed, "--fix"),
                    "start": settings_of(start, "--start"),
                    "prior": [
                        f"{parameter_name(name.strip())}{equals}{value}" if equals else name
                        for name, equals, value in (text.partition("=") for text in prior)
                    ],
                    **{n: v for n in _FIELDS if (v := others.pop(n, None)) is not None},
                }
                if "free" in fields:
                    fields["free"] = ",".join(map(parameter_name, fields["free"].split(",")))
                if report is not None:
                    require_folder(report, "--report")
                output.require_picture(*data)
                return command(fields=fields, report=report, output=output, **others)

        first = (
            click.argument("data", nargs=-1, required=True, type=Path),
            law_options,
            option(
                "--report",
                "DIR",
                "Folder for a page with pictures, the numbers, and a material.",
                Path,
            ),
            output_options(plot=True),
            *_FIRST,
        )
        return stacked(*first, source_options, *_THEN, *further)(gathered)

    return with_options


@click.command(epilog=_EPILOG, short_help="Fit a law to recordings, readings or holds.")
@_question_options(
    _field("windows"),
    switch("--posterior", "Sample the posterior (extra 'bayes')."),
    *(
        option(f"--{name}", "N", text, Count(0), default=_SAMPLING[name], show_default=True)
        for name, text in (
            ("chains", "Chains."),
            ("draws", "Draws of each chain."),
            ("seed", "Seed of the draws."),
        )
    ),
    option("--out", "NC", "Where the draws go, for ArviZ.", Path),
)
def fit(
    laws: tuple[str, ...],
    fields: dict[str, Any],
    posterior: bool,
    out: Path | None,
    report: Path | None,
    output: Output,
    **sampling: int,
) -> int:
    """Fit a friction law to recordings, to tables of readings, or to holds.

    Estimates with intervals, correlations, what the data cannot determine, and whether the law
    describes the data.
    """
    from asperity.cli.progress import bar
    from asperity.inference import WindowedFit
    from asperity.inference.answers import answer_fit
    from asperity.inference.fitting.result import fit_record
    from asperity.inference.report import fit_report, posterior_sections, windows_sections
    from asperity.questions.fit import Fit

    one, advice = len(laws) < 2 and "all" not in laws, "compare several: asperity compare"
    require(one, "--law", "be one law for a fit", ",".join(laws), advice)
    _check_sampling(posterior, sampling, out)
    question = Fit(law=laws[0] if laws else None, **fields)
    with bar("window" if question.windows else "step", "fit", raising=False) as update:
        answer = answer_fit(question, progress=update)
    over = answer if isinstance(answer, WindowedFit) else None
    result: FitResult = answer.fits[0] if isinstance(answer, WindowedFit) else answer
    sampled = _sampled(result, sampling, out) if posterior and result.converged else None
    if report is not None and result.converged:
        from asperity.fit_report import write_report

        write_report(report, result, sampled, output.names)
    more = {"posterior": sampled.record()} if sampled else {}
    more |= {"windows": over.record()} if over else {}
    output.answer(
        lambda: {**fit_record(result), **more},
        lambda: [
            *fit_report(result),
            *(windows_sections(over) if over else []),
            *(posterior_sections(sampled) if sampled else []),
        ],
        result.law,
    )
    if not result.converged:
        _say_missing(result.message, report=report, figure=output.plot, posterior=out)
        return 1
    if report is not None:
        _say_written(report)
    output.draw(result.plot)
    return 0 if sampled is None or sampled.converged else 1


def _say_written(report: Path) -> None:
    files = ", ".join(sorted(p.name for p in report.iterdir() if p.name != "report.html"))
    say(f"the report is {report / 'report.html'}, with {files}")


def _say_missing(why: str, **paths: Path | None) -> None:
    """Say which of the files that were asked for are not written."""
    say(*(f"there is no {what} {path}: {why}" for what, path in paths.items() if path is not None))


def _check_sampling(posterior: bool, sampling: dict[str, int], out: Path | None) -> None:
    """Refuse impossible sampling options before anything is computed."""
    if not posterior:
        require(out is None, "--out", "come with --posterior", "it alone", "add --posterior")
        for name, usual in _SAMPLING.items():
            got, rule = sampling[name], "come with --posterior"
            require(got == usual, f"--{name}", rule, f"{got} alone", "add --posterior")
        return
    from asperity.inference.posterior import require_bayes
    from asperity.inference.posterior.sampling import require_sizes
    from asperity.outputs import output_file, require_netcdf

    require_sizes(sampling["chains"], sampling["draws"])
    require_bayes()
    if out is not None:
        require_netcdf(out, "--out", "posterior.nc")
        output_file(out, "--out", example="posterior.nc")


def _sampled(fit: FitResult, sampling: dict[str, int], out: Path | None) -> Posterior:
    """Sample with a progress bar, and write the draws."""
    from asperity.cli.progress import bar
    from asperity.inference.posterior import sample_posterior
    from asperity.outputs import written_file

    with bar("draw", "posterior") as update:
        posterior = sample_posterior(fit, **sampling, progress=update)
    if out is not None:
        with written_file(out, "--out") as path:
            posterior.to_netcdf(path)
    return posterior


_EPILOG_OF_COMPARE = """\b
Examples:
  asperity compare velocity_steps.csv
  asperity compare readings.csv --law rice-ruina --law linker-dieterich --law elasto-plastic \\
      --material bureau2000 --free lambda,alpha,eps_ratio,A,B

\b
For each law those free parameters count that it has. A law is excluded if
chi-squared has a probability below 0.001 and that of another law has not, or
if its AICc exceeds the lowest by 10 or more.
"""


@click.command(epilog=_EPILOG_OF_COMPARE, short_help="Say which laws the data exclude.")
@_question_options(click.option("--windows", hidden=True, metavar="SPANS"))
def compare(
    laws: tuple[str, ...],
    fields: dict[str, Any],
    report: Path | None,
    output: Output,
) -> int:
    """Fit several laws to the same data and say which of them the data exclude."""
    from asperity.cli.progress import bar
    from asperity.inference.answers import answer_comparison
    from asperity.inference.comparison.compare import comparison_record
    from asperity.inference.report import comparison_report
    from asperity.questions.fit import Comparison

    if fields.pop("windows", None) is not None:
        got = (
            "it with compare: windows of one recording overlap, and their evidence does not add up"
        )
        advice = "compare with --window START:END, one at a time"
        raise InputError("--windows", "go with asperity fit", got, advice)
    fields["laws"] = laws or ("all",)
    question = Comparison(**fields)
    with bar("%", raising=False) as update:

        def progress(done: int, total: int) -> None:
            # A hundred for the fit of each law, then a hundred for its evidence.
            law, laws = done // 100, total // 200
            part = "fit" if law < laws else "evidence"
            label = f"{part} of law {min(law % laws + 1, laws)} of {laws}"
            update(round(100 * done / total), 100, label)

        comparison = answer_comparison(question, progress=progress)
    output.answer(
        lambda: comparison_record(comparison),
        lambda: comparison_report(comparison),
        comparison.best,
    )
    if not comparison.best:
        _say_missing("no fit converged", report=report, figure=output.plot)
        return 1
    if report is not None:
        from asperity.fit_report import write_comparison

        write_comparison(report, comparison, output.names)
        _say_written(report)
    output.draw(comparison.plot)
    return 0 if all(j.fit.converged for j in comparison.laws.values()) else 1
