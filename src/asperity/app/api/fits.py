"""Fits and comparisons of laws on measured data, with profiles and posteriors."""

from __future__ import annotations

import base64
import io
import math
import shlex
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, StrictBool, StrictInt

from asperity.app.api.catalogue import package_material
from asperity.app.api.recordings import LARGEST_TABLE, LIMITS, Source
from asperity.app.endpoints import Question
from asperity.app.uploads import Uploads
from asperity.app.words import in_labels
from asperity.app.worker import limited
from asperity.arrays import Float
from asperity.errors import naming, require
from asperity.operating_point import known_parameters
from asperity.outputs.sections import records
from asperity.parameters import Names, canonical_name
from asperity.questions.fit import FitOptions
from asperity.questions.options import FIT_OPTIONS, as_options, source_options
from asperity.questions.record import WHOLE, Span, Times
from asperity.questions.recording import Velocities
from asperity.recording.extremes import thinned
from asperity.recording.readers.from_file import read_source
from asperity.units import to_si

#: Blocks of a curve that is shown.
_BLOCKS = 700
#: Largest number of transients that are shown enlarged, smallest number of samples of a transient,
#: and the share of its largest deviation from the final line below which a transient has settled.
_MOST_TRANSIENTS, _FEWEST, _SETTLED = 6, 8, 0.05


class Table(Question):
    """A lock-in table as text."""

    name: str
    text: Annotated[str, Field(max_length=LARGEST_TABLE)]


class Run(Question):
    """A recording for a fit of its whole motion, with fields of `asperity.questions.fit.Data`.

    Attributes
    ----------
    recording : str
        Key of an uploaded file.
    source : Source
    window, steps, velocities
        As in `asperity.questions.fit.Data`.
    """

    recording: str
    source: Source = Field(default_factory=Source)
    window: Span | None = None
    steps: Times | None = None
    velocities: Velocities | None = None


Cell = str | float | int | None


class Fitted(Question, FitOptions):
    """Data and laws of a fit, with the fields of ``asperity fit`` and ``asperity compare``.

    Attributes
    ----------
    laws : list of str
        A single law is fitted, several are compared.
    tables : list of Table
    rows : list of dict
        Rows of a measurement, see `asperity.measurement.campaign`.
    runs : list of Run
    posterior, chains, draws
        Whether to sample the posterior of the one law, and how.
    report : bool
        Whether to write the folder of the fit or of the comparison.
    names : {"friction", "geophysics"}
        Names of the parameters in sentences and tables.
    """

    laws: Annotated[tuple[str, ...], Field(min_length=1, max_length=20)]
    tables: Annotated[tuple[Table, ...], Field(max_length=10)] = ()
    rows: Annotated[tuple[dict[str, Cell], ...], Field(max_length=1000)] = ()
    runs: Annotated[tuple[Run, ...], Field(max_length=10)] = ()
    posterior: StrictBool = False
    chains: Annotated[StrictInt, Field(ge=2, le=8), WHOLE] = 4
    draws: Annotated[StrictInt, Field(ge=100, le=10_000), WHOLE] = 1000
    report: StrictBool = False
    names: Names = "friction"

    @property
    def sampling(self) -> dict[str, int]:
        """Settings of the posterior."""
        return {"chains": self.chains, "draws": self.draws, "seed": self.seed}


def check(question: Fitted) -> None:
    """Raise `InputError` for what cannot be fitted, before a process is started."""
    from asperity.laws import get_law

    for law in question.laws:
        get_law(law)
    published = [name for name, prior in question.prior.items() if prior is None]
    for field, chosen in (("material", question.material), *(("prior", p) for p in published)):
        if chosen is not None:
            package_material(chosen, field)
    some, advice = question.tables or question.rows or question.runs, "drop a recording or a table"
    require(some, "data", "hold readings or a recording", "none", advice)
    if question.posterior:
        from asperity.inference.posterior import require_bayes

        count, advice = len(question.laws), "fit the laws one by one"
        require(count == 1, "posterior", "be that of one law", count, advice)
        require_bayes()


def with_files(question: Fitted, uploads: Uploads) -> dict[str, Any]:
    """The fields of a question, and path and name of each recording."""
    files = [uploads.get(run.recording) for run in question.runs]
    places = [{"path": str(file.path), "name": file.name} for file in files]
    return {"question": question.model_dump(mode="json"), "files": places}


def fit(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Fit a law, or compare several laws; messages report the share of the work that is done.

    The result has ``fit`` or ``comparison``, and ``sections`` with its sentences and tables. A
    comparison also has ``laws``, the sections of each law. The pictures ``bands``, ``residuals``
    and ``runs`` are those of the fit or of the best law. If requested, there are ``posterior``, and
    ``report``, the folder as a ZIP file in base64.
    """
    from asperity.laws.registry import symbols_of

    question = Fitted(**argument["question"])
    with naming(in_labels, symbols_of(question.names)):
        return _fit(question, argument["files"], report)


def _fit(
    question: Fitted, files: Sequence[Mapping[str, str]], report: Callable[..., None]
) -> dict[str, Any]:
    from asperity.inference import sample_posterior
    from asperity.inference.answers import answer_comparison, answer_fit
    from asperity.inference.comparison.compare import comparison_record
    from asperity.inference.fitting.result import fit_record
    from asperity.inference.report import comparison_report, fit_report, posterior_sections
    from asperity.questions import fit as questions

    def on_progress(done: int, total: int) -> None:
        report(share=done / total)

    report(share=0.0)
    options = {name: getattr(question, name) for name in FitOptions.model_fields}
    record: dict[str, Any]
    with tempfile.TemporaryDirectory(prefix="asperity-page-") as folder, ExitStack() as named:
        data = options["data"] = _data(question, files, Path(folder))
        named.enter_context(naming(files={Path(one["file"]): one["name"] for one in data}))
        if len(question.laws) == 1:
            one = questions.Fit(**{**options, "law": question.laws[0]})
            whole: Any = answer_fit(one, read=_read, progress=on_progress)
            best = whole
            record = {"fit": fit_record(whole), "sections": records(fit_report(whole))}
        else:
            several = questions.Comparison(**{**options, "laws": question.laws})
            whole = answer_comparison(several, read=_read, progress=on_progress)
            judged = whole.laws.get(whole.best)
            best = None if judged is None else judged.fit
            record = {
                "comparison": comparison_record(whole),
                "sections": records(comparison_report(whole)),
                "laws": {name: records(fit_report(j.fit)) for name, j in whole.laws.items()},
            }
    pictures: list[dict[str, Any]] = []
    posterior = None
    if best is not None and best.converged:
        if question.posterior:
            posterior = sample_posterior(
                best,
                **question.sampling,
                progress=lambda done, total: report(draws=done, of=total),
            )
            record["posterior"] = {**posterior.record(), "histograms": _histograms(posterior)}
            record["sections"] += records(posterior_sections(posterior))
        report(stage="figures")
        record["bands"] = _bands(best, posterior)
        record["residuals"] = _residuals(best)
        pictures = _run_pictures(best)
        if question.report:
            report(stage="report")
            record["report"] = _report(whole, posterior, question.names)
    return {**record, "runs": pictures, **_texts(question, [file["name"] for file in files])}


def _data(
    question: Fitted, files: Sequence[Mapping[str, str]], folder: Path
) -> list[dict[str, Any]]:
    """Files of a fit: tables, written from the texts in the question, and recordings."""
    from asperity.measurement.campaign import write_csv

    data: list[dict[str, Any]] = []
    for k, table in enumerate(question.tables):
        is_json = table.text.lstrip().startswith("{")
        path = folder / f"sent-table-{k}.{'json' if is_json else 'csv'}"
        path.write_text(table.text, encoding="utf-8")
        data.append({"file": path, "name": table.name})
    if question.rows:
        path = folder / "sent-rows.csv"
        rows = [{n: math.nan if v is None else v for n, v in row.items()} for row in question.rows]
        write_csv(path, rows)
        data.append({"file": path, "name": "the measured rows"})
    for run, file in zip(question.runs, files, strict=True):
        fields = run.model_dump(exclude={"recording"}, exclude_none=True)
        data.append({**fields, "file": file["path"], "name": file["name"]})
    return data


def _read(data: Any) -> Any:
    """A recording for a fit; files are read within the limits of all readers of the page."""
    with limited(LIMITS):
        return read_source(data.file, data.source)


def _histograms(posterior: Any) -> dict[str, dict[str, list[float]]]:
    """Density of the draws of each parameter, in SI: middles of bins and heights."""
    shown = {}
    for name, draws in posterior.draws.items():
        heights, edges = np.histogram(draws, bins=40, density=True)
        shown[name] = {"x": (edges[1:] + edges[:-1]) / 2, "y": heights}
    return shown


def _bands(result: Any, posterior: Any) -> list[dict[str, Any]]:
    """Readings of each table, and the predictions of the law between them."""
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


def _report(result: Any, posterior: Any, names: Names) -> str:
    """The folder of ``asperity fit --report`` or ``compare --report`` as a ZIP file in base64."""
    from asperity import fit_report, inference

    packed = io.BytesIO()
    with tempfile.TemporaryDirectory(prefix="asperity-page-") as folder:
        target = Path(folder) / "report"
        if isinstance(result, inference.Comparison):
            fit_report.write_comparison(target, result, names)
        else:
            fit_report.write_report(target, result, posterior, names)
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(target.iterdir()):
                archive.write(path, f"report/{path.name}")
    return base64.b64encode(packed.getvalue()).decode()


def _residuals(result: Any) -> dict[str, list[Any]]:
    """Readings less the law in standard uncertainties, whitened, with the observable of each."""
    from asperity.inference.tables.term import LockInTerm

    parts = [residuals for _, residuals in result.parts(LockInTerm)]
    values = [-x for r in parts for x in r.values.tolist()]
    names = [str(n) for r in parts for n in r.observable]
    return {"value": values, "observable": names}


def _run_pictures(result: Any) -> list[dict[str, Any]]:
    """Friction of each recording, as recorded and as fitted, whole and after each change."""
    from asperity.inference.runs.term import RunTerm

    pictures = []
    for term in result.objective.terms_of(RunTerm):
        fitted = term.fitted_friction(result.values)
        run = term.run
        time, recorded = run.recorded_times(run.time), run.friction
        curves = {"recorded": recorded, "fitted": fitted, "difference": recorded - fitted}
        shown = {name: thinned(time, values, _BLOCKS) for name, values in curves.items()}
        transients = []
        edges = np.append(run.drive.edges[list(run.cuts)], np.inf)
        for begin, end in pairwise(edges[: _MOST_TRANSIENTS + 1]):
            near = _around(run.time, fitted, begin, end)
            transients.append(
                {
                    "time": begin + run.origin,
                    "recorded": thinned(time[near], recorded[near], _BLOCKS),
                    "fitted": thinned(time[near], fitted[near], _BLOCKS),
                }
            )
        pictures.append({"name": term.name, **shown, "transients": transients})
    return pictures


def _around(time: Float, fitted: Float, begin: float, end: float) -> slice:
    """Samples around a change of the drive until the fitted friction is steady again."""
    a, b = np.searchsorted(time, (begin, end))
    after = fitted[a:b]
    if after.size < _FEWEST:
        return slice(max(a - _FEWEST, 0), b)
    last = slice(2 * after.size // 3, None)
    line = np.polynomial.Polynomial.fit(time[a:b][last], after[last], 1)
    far = np.abs(after - line(time[a:b]))
    settled = max(int(np.flatnonzero(far > _SETTLED * far.max())[-1]) + 1, _FEWEST)
    length = 1.3 * (time[a + settled - 1] - time[a])
    return slice(*np.searchsorted(time, (begin - length / 3, min(begin + length, end))))


#: File name, in the command for copying, of the rows that were measured on the page.
_ROWS = "campaign.csv"


def _texts(question: Fitted, recordings: list[str]) -> dict[str, str]:
    """The same fit as Python and as a command."""
    chosen = question.model_dump(include={*FitOptions.model_fields}, exclude_defaults=True)
    tables = [table.name for table in question.tables] + [_ROWS] * bool(question.rows)
    return {
        "python": _python(question, chosen, tables, recordings),
        "command": _command(question, chosen, tables + recordings),
    }


def _python(
    question: Fitted, chosen: Mapping[str, Any], tables: list[str], recordings: list[str]
) -> str:
    one = len(question.laws) == 1
    kind, answer = ("Fit", "answer_fit") if one else ("Comparison", "answer_comparison")
    data: list[dict[str, Any]] = [{"file": name} for name in tables]
    for name, run in zip(recordings, question.runs, strict=True):
        data.append({"file": name, **run.model_dump(exclude={"recording"}, exclude_defaults=True)})
    laws = {"law": question.laws[0]} if one else {"laws": question.laws}
    fields = {**laws, "data": data, **chosen}
    lines = [
        "from math import inf",
        "",
        "from asperity.inference import sample_posterior",
        f"from asperity.inference.answers import {answer}",
        f"from asperity.questions.fit import {kind}",
        "",
        f"question = {kind}(",
        *(f"    {name}={value!r}," for name, value in fields.items()),
        ")",
        f"result = {answer}(question)",
        "print(result)",
    ]
    if question.posterior:
        sizes = ", ".join(f"{name}={value}" for name, value in question.sampling.items())
        lines.append(f"print(sample_posterior(result, {sizes}))")
    return "\n".join(lines) + "\n"


def _with_units(question: Fitted, chosen: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Fixed numbers, start values and priors as texts, which carry their units in a command."""
    known = known_parameters(question.laws[0])

    def text(name: str, value: Any) -> Any:
        parameter = known.get(canonical_name(name, known) or "")
        if parameter is None or type(value) not in (int, float):
            return value
        return f"{value!r} {parameter.unit}".rstrip()

    def prior(name: str, given: Mapping[str, Any] | None) -> dict[str, Any] | None:
        if given is None:  # of a material
            return None
        texts = {end: str(text(name, value)) for end, value in given.items()}
        if len({value.partition(" ")[2] for value in texts.values()}) == 1:
            return texts
        # The option has one unit for both.
        kind = known[canonical_name(name, known) or name].kind
        return {end: text(name, to_si(value, kind, name)) for end, value in given.items()}

    words = {"fixed": text, "start": text, "prior": prior}
    return {
        field: {name: of(name, value) for name, value in chosen[field].items()}
        for field, of in words.items()
        if field in chosen
    }


def _command(question: Fitted, chosen: Mapping[str, Any], files: list[str]) -> str:
    readings = [run.model_dump(exclude={"recording"}) for run in question.runs]
    if any(reading != readings[0] for reading in readings):
        return "# no command reads these recordings with different options: copy as Python"
    one = len(question.laws) == 1
    parts = [f"asperity {'fit' if one else 'compare'}", *map(shlex.quote, files)]
    parts += [f"--law {law}" for law in question.laws]
    chosen = {**chosen, **_with_units(question, chosen)}
    for run in question.runs[:1]:
        parts += source_options(run.source)
        chosen = {**chosen, **run.model_dump(include={"window", "steps", "velocities"})}
    parts += as_options(chosen, FIT_OPTIONS)
    if question.posterior:
        parts.append("--posterior")
        usual = {name: Fitted.model_fields[name].default for name in question.sampling}
        parts += [f"--{n} {v}" for n, v in question.sampling.items() if v != usual[n]]
    if question.report:
        parts.append("--report report")
    return " ".join(parts)
