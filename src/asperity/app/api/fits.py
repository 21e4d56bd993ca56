"""Fits and comparisons of laws to what was measured, with profiles and posteriors."""

from __future__ import annotations

import base64
import html
import io
import json
import math
import shlex
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from asperity.app.api.catalogue import known_materials
from asperity.app.api.operating_point import Name
from asperity.app.api.recordings import (
    LARGEST_TABLE,
    LIMITS,
    Seconds,
    Source,
    Text,
    named,
    read_source,
    source_options,
)
from asperity.app.decimation import extremes
from asperity.app.endpoints import Question
from asperity.app.jobs.worker import limited
from asperity.app.uploads import Uploads
from asperity.errors import InputError, closest
from asperity.outputs.json import to_json
from asperity.units import to_si

#: Blocks of a curve that is shown.
_BLOCKS = 700


class Table(Question):
    """A lock-in table as text."""

    name: Text
    text: Annotated[str, Field(max_length=LARGEST_TABLE)]


class Run(Question):
    """A recording that is fitted as a whole; the fields are those of `inference.recorded_run`.

    Attributes
    ----------
    recording : str
        A file that was sent.
    source : Source
    window, steps : list of float or None
        In seconds.
    velocities : list of str or None
        Of the segments between `steps`, with units, 0 in a hold.
    """

    recording: Name
    source: Source = Field(default_factory=lambda: Source.model_validate({}))
    window: Annotated[list[Seconds], Field(min_length=2, max_length=2)] | None = None
    steps: Annotated[list[Seconds], Field(max_length=200)] | None = None
    velocities: Annotated[list[Name], Field(max_length=201)] | None = None


Cell = str | float | int | None


class Fitted(Question):
    """Data and laws of a fit, as the options of ``asperity fit`` and ``asperity compare``.

    Attributes
    ----------
    laws : list of str
        One is fitted, several are compared.
    tables : list of Table
    rows : list of dict
        What measuring has given, see `asperity.measurement.campaign`.
    runs : list of Run
    trend, drift, initial, gauge, gauge_order, fit_rate
        How recordings are compared with the motion.
    posterior, chains, draws, seed
        Whether to sample the posterior of the one law, and how.
    report : bool
        Whether to write the folder of the fit or of the comparison.
    """

    laws: Annotated[list[Name], Field(min_length=1, max_length=20)]
    free: Annotated[list[Name], Field(max_length=20)]
    tables: Annotated[list[Table], Field(max_length=10, default_factory=list)]
    rows: Annotated[
        list[Annotated[dict[Name, Cell], Field(max_length=200)]],
        Field(max_length=1000, default_factory=list),
    ]
    runs: Annotated[list[Run], Field(max_length=10, default_factory=list)]
    trend: Literal["none", "linear", "quadratic"] = "linear"
    drift: bool = False
    initial: Literal["steady", "free"] = "steady"
    gauge: Name | None = None
    gauge_order: Annotated[int, Field(ge=1, le=8)] = 1
    fit_rate: Name | None = None
    fixed: Annotated[dict[Name, Name], Field(max_length=30, default_factory=dict)]
    start: Annotated[dict[Name, Name], Field(max_length=30, default_factory=dict)]
    material: Name | None = None
    prior: Name | None = None
    profile: bool = False
    inertia: bool = False
    radiation_damping: bool = False
    posterior: bool = False
    chains: Annotated[int, Field(ge=2, le=8)] = 4
    draws: Annotated[int, Field(ge=100, le=10_000)] = 1000
    seed: Annotated[int, Field(ge=0, le=2**31)] = 0
    report: bool = False


def check(question: Fitted) -> None:
    """Refuse what cannot be fitted, before a process is asked."""
    from asperity.laws import get_law, registered

    for law in question.laws:
        get_law(law) if law in registered() else _refuse_law(law, registered())
    for field in ("material", "prior"):
        chosen = getattr(question, field)
        if chosen is not None and chosen not in known_materials():
            raise InputError(
                f"{field} must be one of the package's, got '{chosen}'; "
                f"{closest(chosen, known_materials())}"
            )
    if not question.tables and not question.rows and not question.runs:
        raise InputError(
            "data must hold readings or a recording, got none; drop a recording or a table"
        )
    if question.posterior:
        from asperity.inference.posterior import require_bayes

        if len(question.laws) > 1:
            raise InputError(
                f"posterior must be that of one law, got {len(question.laws)}; "
                "fit the laws one by one"
            )
        require_bayes()


def with_files(question: Fitted, uploads: Uploads) -> dict[str, Any]:
    """The fields, with the place and the name of each recording."""
    files = [uploads.get(run.recording) for run in question.runs]
    places = [{"path": str(file.path), "name": file.name} for file in files]
    return {"asked": question.model_dump(), "files": places}


def _refuse_law(law: str, known: Mapping[str, Any]) -> None:
    raise InputError(f"law must be a registered one, got '{law}'; {closest(law, known)}")


def fit(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Fit a law, or compare several; the share of the work that is done is reported.

    The result has ``fit`` or ``comparison``; of the fit or the best one the pictures ``bands``,
    ``residuals`` and ``runs``; and, where they were asked for, ``posterior`` and ``report``, the
    folder as a ZIP file in base64.
    """
    from asperity import inference
    from asperity.inference.comparison.record import comparison_record
    from asperity.inference.fitting.result import fit_record

    question = Fitted.model_validate(argument["asked"])
    files = argument["files"]

    def on_progress(done: int, total: int) -> None:
        report(share=done / total)

    materials = known_materials()
    options: dict[str, Any] = {
        "fixed": question.fixed,
        "start": question.start,
        "material": materials.get(question.material or ""),
        "prior": materials.get(question.prior or ""),
        "profile": question.profile,
        "inertia": question.inertia,
        "radiation_damping": question.radiation_damping,
        "runs": _run_options(question),
        "progress": on_progress,
    }
    report(share=0.0)
    with tempfile.TemporaryDirectory(prefix="asperity-page-") as folder:
        tables, names = _tables(question, Path(folder))
    runs = [_run(run, file) for run, file in zip(question.runs, files, strict=True)]
    best: inference.Fit | None
    if len(question.laws) == 1:
        best = inference.fit([*tables, *runs], question.laws[0], question.free, **options)
        whole: Any = best
        record: dict[str, Any] = {"fit": fit_record(best)}
    else:
        whole = compared = inference.compare(
            [*tables, *runs], question.laws, question.free, **options
        )
        judged = compared.laws.get(compared.best)
        best = None if judged is None else judged.fit
        record = {"comparison": comparison_record(compared)}
    pictures: list[dict[str, Any]] = []
    posterior = None
    if best is not None and best.converged:
        if question.posterior:
            posterior = _sampled(best, question, report)
            record["posterior"] = {**posterior.record(), "histograms": _histograms(posterior)}
        report(stage="figures")
        record["bands"] = _bands(best, posterior)
        record["residuals"] = _residuals(best)
        pictures = _run_pictures(best)
        if question.report:
            report(stage="report")
            record["report"] = _report(whole, names, posterior)
    text = to_json(record)
    for name, shown in names.items():
        text = text.replace(name, json.dumps(shown)[1:-1])
    command = _fit_command(question, [file["name"] for file in files])
    return {**json.loads(text), "runs": pictures, "command": command}


def _tables(question: Fitted, folder: Path) -> tuple[list[Any], dict[str, str]]:
    """Tables from the texts that were sent, and what people call each file of the folder."""
    from asperity import inference
    from asperity.measurement.campaign import write_csv

    given: dict[str, Any] = {
        n: question.fixed[n] for n in ("V", "epsilon", "frequency") if n in question.fixed
    }
    names: dict[Path, str] = {}
    for k, table in enumerate(question.tables):
        is_json = table.text.lstrip().startswith("{")
        path = folder / f"sent-table-{k}.{'json' if is_json else 'csv'}"
        path.write_text(table.text, encoding="utf-8")
        names[path] = table.name
    if question.rows:
        path = folder / "sent-rows.csv"
        write_csv(path, [_row(row) for row in question.rows])
        names[path] = "the measured rows"
    tables = []
    for path, name in names.items():
        with named(path, name):
            tables.append(inference.read_table(path, given))
    return tables, {path.name: name for path, name in names.items()}


def _run(run: Run, file: Mapping[str, str]) -> Any:
    """A recording for a fit; files are read within the limits of all readers of the page."""
    from asperity import inference

    path, name = Path(file["path"]), file["name"]
    velocities = None
    if run.velocities is not None:
        velocities = [
            0.0 if v.strip() == "0" else float(to_si(v, "velocity", "velocities"))
            for v in run.velocities
        ]
    with named(path, name):
        with limited(LIMITS):
            trace = read_source(path, run.source.model_dump())
        return inference.recorded_run(
            trace,
            name=Path(name).stem,
            window=None if run.window is None else (run.window[0], run.window[1]),
            steps=run.steps,
            velocities=velocities,
        )


def _run_options(question: Fitted) -> Any:
    from asperity.inference import RunOptions

    trends = {"none": (), "linear": ("trend",), "quadratic": ("trend", "bend")}
    gauge = None
    if question.gauge:
        corner = float(to_si(question.gauge, "frequency", "gauge", require_unit=True))
        if not corner > 0:
            raise InputError(f"gauge must be positive, got '{question.gauge}'; give its low-pass")
        gauge = question.gauge_order, corner
    linear = ("offset", *trends[question.trend], *(("drift",) if question.drift else ()))
    rate = question.fit_rate or None
    return RunOptions(linear=linear, initial=question.initial, gauge=gauge, fit_rate=rate)


def _sampled(result: Any, question: Fitted, report: Callable[..., None]) -> Any:
    """The posterior; finished draws are reported, and the sampler asks twice a second to go on."""
    from asperity.inference import sample_posterior

    return sample_posterior(
        result,
        chains=question.chains,
        draws=question.draws,
        seed=question.seed,
        progress=lambda done, total: report(draws=done, of=total),
    )


def _histograms(posterior: Any) -> dict[str, dict[str, list[float]]]:
    """Density of the draws of each parameter, in SI: middles of bins and heights."""
    shown = {}
    for name, draws in posterior.draws.items():
        heights, edges = np.histogram(draws, bins=40, density=True)
        shown[name] = {"x": (edges[1:] + edges[:-1]) / 2, "y": heights}
    return shown


def _bands(result: Any, posterior: Any) -> list[dict[str, Any]]:
    """Readings of each table, and what the law predicts between them."""
    from asperity.fit_report.bands import bands_of
    from asperity.inference.tables.term import LockInTerm

    pictures = []
    for term in result.objective.terms_of(LockInTerm):
        table = term.table
        predicted = bands_of(result, term, posterior)
        rows = []
        for name in table.values:
            if name not in predicted[0].bands:
                continue
            series = []
            for label, at, bands in predicted:
                series.append(
                    {
                        "label": label,
                        **bands[name]._asdict(),
                        "at": table.points["epsilon"][at],
                        "value": table.values[name][at],
                        "error": table.errors[name][at],
                    }
                )
            rows.append({"name": name, "series": series})
        if rows:
            pictures.append({"rows": rows})
    return pictures


def _report(result: Any, names: Mapping[str, str], posterior: Any = None) -> str:
    """The folder of a fit or a comparison, as ``--report`` writes it: a ZIP file in base64."""
    from asperity import fit_report, inference

    one = not isinstance(result, inference.Comparison)
    packed = io.BytesIO()
    with tempfile.TemporaryDirectory(prefix="asperity-page-") as folder:
        target = Path(folder) / "report"
        if one:
            fit_report.write_report(target, result, posterior)
        else:
            fit_report.write_comparison(target, result)
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(target.iterdir()):
                if path.suffix == ".nc":
                    archive.write(path, f"report/{path.name}")
                    continue
                text = path.read_text(encoding="utf-8")
                for name, shown in names.items():
                    text = text.replace(name, _escaped(shown, path.suffix))
                archive.writestr(f"report/{path.name}", text)
    return base64.b64encode(packed.getvalue()).decode()


def _escaped(text: str, suffix: str) -> str:
    """A name that a sender chose, fit for a page or for the texts of JSON and TOML."""
    return html.escape(text) if suffix == ".html" else json.dumps(text)[1:-1]


def _row(row: Mapping[str, Cell]) -> dict[str, Any]:
    return {name: math.nan if value is None else value for name, value in row.items()}


def _residuals(result: Any) -> dict[str, list[Any]]:
    """Whitened residuals of the readings, with the observable of each."""
    from asperity.inference.tables.term import LockInTerm

    parts = [residuals for _, residuals in result.parts(LockInTerm)]
    values = [x for r in parts for x in r.values.tolist()]
    names = [str(n) for r in parts for n in r.observable]
    return {"value": values, "observable": names}


def _run_pictures(result: Any) -> list[dict[str, Any]]:
    """Friction of each recording, as recorded and as fitted."""
    from asperity.inference.runs.term import RunTerm

    pictures = []
    for term in result.objective.terms_of(RunTerm):
        fitted = term.fitted_friction(result.values)
        time, recorded = term.run.time, term.run.friction
        curves = {"recorded": recorded, "fitted": fitted, "difference": recorded - fitted}
        shown = {name: extremes(time, values, _BLOCKS) for name, values in curves.items()}
        pictures.append({"name": term.name, **shown})
    return pictures


def _fit_command(question: Fitted, recordings: list[str]) -> str:
    """The command; measured rows are those of a table that ``asperity measure`` writes."""
    files = [t.name for t in question.tables] + ["campaign.csv"] * bool(question.rows) + recordings
    one = len(question.laws) == 1
    parts = [f"asperity {'fit' if one else 'compare'}", *map(shlex.quote, files)]
    parts.append(f"--law {question.laws[0]}" if one else f"--laws {','.join(question.laws)}")
    parts.append(f"--free {','.join(question.free)}")
    parts += [f"--fix {shlex.quote(f'{n}={v}')}" for n, v in question.fixed.items()]
    parts += [f"--start {shlex.quote(f'{n}={v}')}" for n, v in question.start.items()]
    for option in ("material", "prior"):
        if getattr(question, option):
            parts.append(f"--{option} {getattr(question, option)}")
    switches = ("profile", "inertia", "radiation_damping")
    parts += [f"--{s.replace('_', '-')}" for s in switches if getattr(question, s)]
    if question.runs:
        parts += _run_arguments(question)
    if question.posterior:
        parts.append("--posterior")
        defaults = {n: Fitted.model_fields[n].default for n in ("chains", "draws", "seed")}
        parts += [
            f"--{n} {getattr(question, n)}"
            for n, d in defaults.items()
            if d != getattr(question, n)
        ]
    if question.report:
        parts.append("--report report")
    return " ".join(parts)


def _run_arguments(question: Fitted) -> list[str]:
    """Options on recordings; those that each may have of its own are the first one's."""
    run = question.runs[0]
    parts = source_options(run.source.model_dump())
    if run.window is not None:
        parts.append(f"--window {run.window[0]:g}:{run.window[1]:g}")
    if run.steps is not None:
        parts.append("--steps " + ",".join(f"{t:g}" for t in run.steps))
    if run.velocities is not None:
        parts.append(f"--velocities {shlex.quote(','.join(run.velocities))}")
    if question.trend != "linear":
        parts.append(f"--trend {question.trend}")
    parts += ["--drift"] * question.drift
    if question.initial != "steady":
        parts.append(f"--initial {question.initial}")
    if question.gauge:
        parts.append(f"--gauge {shlex.quote(question.gauge)} --gauge-order {question.gauge_order}")
    if question.fit_rate:
        parts.append(f"--fit-rate {shlex.quote(question.fit_rate)}")
    return parts
