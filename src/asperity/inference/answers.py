"""Answers to questions: read the files of data, fit a law or compare several laws."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from asperity import materials
from asperity.errors import Argument, InputError, require, symbol
from asperity.inference.comparison.compare import Comparison, compare as compare_loaded
from asperity.inference.cycles import AveragedCycle, averaged_cycle
from asperity.inference.fitting.fit import fit as fit_loaded
from asperity.inference.fitting.inputs import priors_of
from asperity.inference.fitting.result import Fit
from asperity.inference.fitting.windows import WindowedFit, fit_windows
from asperity.inference.holds import HEALING, HealingTable, read_healing
from asperity.inference.runs.assembly import Linear, RunOptions
from asperity.inference.runs.run import RecordedRun, recorded_run, run_name
from asperity.inference.runs.unloading import measured_stiffness
from asperity.inference.tables.table import OBSERVABLES, LockInTable, read_table
from asperity.inference.unknowns import Prior
from asperity.laws import Law, get_law, known_law, registered
from asperity.measurement.conditions import MACHINE_FIELDS
from asperity.measurement.from_file import reads_cycles
from asperity.measurement.measure import modulation_of
from asperity.measurement.stick_slip.measure import measure_stick_slip
from asperity.outputs.targets import require_rereadable
from asperity.parameters.arguments import FilePath, of_type, shown, typed
from asperity.parameters.columns import marked_encoding
from asperity.questions import fit as questions
from asperity.questions.record import Question
from asperity.questions.recording import Measurement as Measured
from asperity.recording import Trace
from asperity.recording.readers.from_file import read_source

Progress = Callable[[int, int], None]
#: Reads the file of a recording.
Reader = Callable[[questions.Data], Trace]

#: Linear nuisances of a recording, by the trend of friction in the question.
_TRENDS: Mapping[str, tuple[Linear, ...]] = {
    "none": (),
    "linear": ("trend",),
    "quadratic": ("trend", "bend"),
}


#: Data of any kind, ready for a fit.
AnyData = LockInTable | HealingTable | AveragedCycle | RecordedRun
#: Data of a fit, or a recording or file from which they are read.
Data = AnyData | Trace | FilePath


def default_law(data: Sequence[AnyData]) -> str:
    """The law that is fitted by default: Rice-Ruina for recordings, elasto-plastic for tables.

    Only a law with elastic asperities has the phases that a modulated load causes; a recording of
    velocity steps does not show this elasticity.
    """
    tables = any(isinstance(d, LockInTable) for d in data)
    return "elasto-plastic" if tables else "rice-ruina"


def is_table(data: questions.Data) -> bool:
    """Whether a file is a table of readings or of holds, and no recording."""
    return _kind(data.file) != "recording"


def _kind(path: Path) -> Literal["readings", "holds", "recording"]:
    """What a file is, by its ending and its heading."""
    require_rereadable(path, "data")
    if path.suffix.lower() == ".json":
        return "readings"
    cells = _heading(path)
    # If a file cannot be opened, the reader of tables raises the error.
    if cells is None:
        return "readings"
    if HEALING in cells:
        return "holds"
    # A table written by `measure` has no observable if no file could be measured.
    observed = {"kind", "reason"} <= {*cells} or any(cell in OBSERVABLES for cell in cells)
    return "readings" if observed else "recording"


def _heading(path: Path) -> list[str] | None:
    """Words of the first line that is no comment; None if the file cannot be opened."""
    try:
        with path.open("rb") as mark:
            encoding = marked_encoding(mark.read(2))
        with path.open(encoding=encoding, errors="replace") as file:
            for line in file:
                if line.strip() and not line.lstrip().startswith("#"):
                    # Some programs write all headings in quotation marks.
                    return re.split(r'[,;\s"]+', line)
    except OSError:
        return None
    return []


def _read_trace(data: questions.Data) -> Trace:
    return read_source(data.file, data.source)


def read_data(
    question: questions.Fit | questions.Comparison, read: Reader = _read_trace
) -> list[AnyData]:
    """Tables and recordings of a question.

    Parameters
    ----------
    question : Fit or Comparison
    read : callable
        Reads the file of a recording.

    Raises
    ------
    InputError
        If a file cannot be read, or an argument for a single recording is given with several.
    """
    kinds = [_kind(data.file) for data in question.data]
    recordings = kinds.count("recording")
    # Arguments of recordings, such as velocities, need a recording.
    for name in ("steps", "velocities"):
        if any(getattr(d, name) is not None for d in question.data) and recordings != 1:
            got = f"{recordings} of them" if recordings else "a table"
            raise InputError(name, "go with one recording", got, "leave it out")
    if not recordings:
        _refuse_options_of_runs(question, "a recording", "a table")
    at: dict[str, Any] = {
        n: question.fixed[n] for n in ("V", "epsilon", "frequency") if n in question.fixed
    }
    held: dict[str, Any] = {n: question.fixed[n] for n in ("V", "K", "W0") if n in question.fixed}
    result: list[AnyData] = []
    for data, kind in zip(question.data, kinds, strict=True):
        table = kind != "recording"
        rule, advice = "go with a recording", "leave it out, or cut the rows of the table"
        require(not table or data.window is None, "window", rule, "a table", advice)
        # One source may be that of a recording next to a table.
        given = {} if recordings else data.source.model_dump(exclude_defaults=True)
        for name, value in given.items():
            keyed = isinstance(value, Mapping)
            field = Argument(name, next(iter(value))) if keyed else f"read.{name}"
            raise InputError(field, rule, "a table", "leave it out, or correct the table")
        if kind == "holds":
            result.append(read_healing(data.file, held, name=data.name))
        elif kind == "readings":
            result.append(read_table(data.file, at, name=data.name))
        else:
            trace, reading = _recording(data, read), _run_arguments(data)
            cycle = None
            if data.steps is None and data.velocities is None:
                cycle = _stick_slip(trace, reading["name"], question.fixed, data.window)
            result.append(cycle or recorded_run(trace, window=data.window, **reading))
    if any(isinstance(d, AveragedCycle) for d in result):
        _refuse_options_of_runs(question, "velocity steps and holds", "the cycles of stick-slip")
    return result


def _refuse_options_of_runs(
    question: questions.Fit | questions.Comparison, needed: str, data: str
) -> None:
    """Refuse options of recorded runs for other data: nothing would apply a gauge or a trend."""
    for name in ("trend", "drift", "initial", "gauge", "gauge_order", "fit_rate"):
        value = getattr(question, name)
        same = value == type(question).model_fields[name].default
        # Those that are numbers are frequencies.
        got = (
            f"{value:g} Hz" if isinstance(value, float) else "it" if value is True else shown(value)
        )
        require(same, name, f"go with {needed}", f"{got} with {data}", "leave it out")


def _recording(data: questions.Data, read: Reader) -> Trace:
    """The recording in a file; a file without a time is perhaps a table with other headings."""
    try:
        return read(data)
    except InputError as error:
        if error.field == Argument("columns", "time"):
            raise error.noting(
                f"; in a table of readings name one of the columns {', '.join(OBSERVABLES)}, "
                f"in a table of holds {HEALING}"
            ) from None
        raise


def _stick_slip(
    trace: Trace,
    name: str,
    fixed: Mapping[str, Any],
    window: tuple[float, float] | None = None,
) -> AveragedCycle | None:
    """The averaged cycle of a recording of stick-slip; None for any other recording."""
    drive = trace.has("displacement") or trace.has("velocity")
    if not drive and (hertz := modulation_of(trace)) is not None:
        raise InputError(
            name,
            "be a recording of velocity steps, holds or stick-slip, or a table of readings",
            f"a load that is modulated at {hertz:.4g} Hz",
            "read its harmonics first, as asperity measure FILE --out readings.csv does, and fit "
            "that table",
        )
    machine = {field: fixed[n] for n, field in MACHINE_FIELDS.items() if n in fixed}
    try:
        try:
            question = Measured(window=window, **machine)
        except InputError:
            # The reader of runs takes K over the load.
            machine.pop("stiffness", None)
            question = Measured(window=window, **machine)
        measurement = measure_stick_slip(trace, question)
    except InputError:
        # The reader of runs checks the numbers again.
        return None
    if not reads_cycles(trace, question, measurement):
        return None
    if "K" in fixed and question.stiffness is None:
        raise InputError(
            f"{symbol('K')} must be in N/m for a fit of the cycles of {name}, got '{fixed['K']}'; "
            f"multiply it by the load, as {Argument('fixed', 'K', '300 N/m')}, with "
            f"{Argument('fixed', 'W0', '0.3 N')}; of a force over the weight the load is that of "
            f"the mass, as {Argument('fixed', 'M', '30 g')}"
        )
    return averaged_cycle(measurement, name)


def _run_arguments(data: questions.Data) -> dict[str, Any]:
    """Arguments with which a trace becomes a run, without the window."""
    return {
        "name": Path(data.name or data.file).stem,
        "steps": data.steps,
        "velocities": data.velocities,
    }


def _options(
    question: questions.Fit | questions.Comparison, read: Reader, progress: Progress | None
) -> dict[str, Any]:
    """Keyword arguments that fits and comparisons share."""
    priors = priors_of(question.prior, question.free)
    if question.stiffness_from is not None:
        priors |= {"K": _prior_of_unloading(question, priors, read)}
    drift: tuple[Linear, ...] = ("drift",) if question.drift else ()
    runs = RunOptions(
        linear=("offset", *_TRENDS[question.trend], *drift),
        initial=question.initial,
        gauge=None if question.gauge is None else (question.gauge_order, question.gauge),
        fit_rate=question.fit_rate,
    )
    same = ("fixed", "start", "profile", "inertia", "radiation_damping", "starts", "seed")
    return {
        **{name: getattr(question, name) for name in same},
        "material": None if question.material is None else materials.load(question.material),
        "prior": priors,
        "runs": runs,
        "progress": progress,
    }


def _prior_of_unloading(
    question: questions.Fit | questions.Comparison, priors: Mapping[str, Any], read: Reader
) -> Any:
    """The prior of K from the slope of the force during unloading and reloading."""
    label = "stiffness_from"
    other = "fixed" if "K" in question.fixed else "prior" if "K" in priors else None
    if other is not None:
        rule = f"be the only number of {symbol('K')}"
        raise InputError(label, rule, f"{Argument(other, 'K')} too", "drop one")
    rule, advice = "go with one recording", "give one recording"
    require(len(question.data) == 1, label, rule, f"{len(question.data)} files", advice)
    require(not is_table(question.data[0]), label, rule, "a table", advice)
    rule, advice = (
        "be without a prior of gain",
        f"give the prior of {symbol('K')} from another source",
    )
    got = "both: the slope is measured by the same gauge, and scales with it"
    require(not any(name.partition("[")[0] == "gain" for name in priors), label, rule, got, advice)
    assert question.stiffness_from is not None  # by the caller
    (data,) = question.data
    low, high = question.stiffness_from
    windows: Any = getattr(question, "windows", None)
    spans = [data.window] if windows in (None, "auto") else windows
    for span in spans:
        begin, end = span or (-math.inf, math.inf)
        if low < end and begin < high:
            where = "the whole recording" if span is None else f"{begin:g} to {end:g} s"
            rule = "lie outside what is fitted"
            advice = "give a window without it: its samples would count twice"
            raise InputError(label, rule, f"{low:g} to {high:g} s in {where}", advice)
    return measured_stiffness(read(data), (low, high)).prior


def answer_fit(
    question: questions.Fit, *, read: Reader = _read_trace, progress: Progress | None = None
) -> Fit | WindowedFit:
    """The fit that a question asks for.

    Parameters
    ----------
    question : Fit
    read : callable
        Reads the file of a recording.
    progress : callable, optional
        Called with the work done so far and all work.

    Returns
    -------
    Fit or WindowedFit
        A `WindowedFit` if the question has several windows.

    Raises
    ------
    InputError
        As in `asperity.inference.fit`, or if a file cannot be read.
    """
    options = _options(question, read, progress)
    law = None if question.law is None else known_law(question.law)
    windows: Any = question.windows
    if windows is None:
        data = read_data(question, read)
        return fit_loaded(data, law or default_law(data), question.free, **options)
    (recording,) = question.data
    rule = "go with one recording"
    require(not is_table(recording), "windows", rule, "a table", "give one recording")
    return fit_windows(
        read(recording),
        law or default_law(()),
        question.free,
        None if windows == "auto" else windows,
        reading={n: v for n, v in _run_arguments(recording).items() if v is not None},
        **options,
    )


def answer_comparison(
    question: questions.Comparison, *, read: Reader = _read_trace, progress: Progress | None = None
) -> Comparison:
    """The comparison that a question asks for; parameters as of `answer_fit`."""
    options = _options(question, read, progress)
    laws = compared_laws(question.laws)
    return compare_loaded(read_data(question, read), laws, question.free, **options)


def _loaded(data: Data | Sequence[Data], fixed: Mapping[str, Any] | None) -> list[Any]:
    """Data of a fit; files and recordings are read or converted."""
    several = data if isinstance(data, list | tuple) else [data]
    fixed = of_type(fixed, Mapping[str, Any] | None, "fixed")
    loaded: list[Any] = []
    for one in several:
        if isinstance(one, str | os.PathLike):
            file = questions.Data(file=Path(one))
            question = questions.Fit(data=(file,), fixed=dict(fixed or {}))
            loaded += read_data(question)
        elif isinstance(one, Trace):
            loaded.append(_stick_slip(one, run_name(one), fixed or {}) or one)
        else:
            loaded.append(one)
    return loaded


class _Priors(Question, questions.Estimation):
    """Priors as they are written."""


def _by_names(free: Sequence[str] | None, options: dict[str, Any]) -> dict[str, Any]:
    """Options of a fit, with materials and priors that are written as on the command line."""
    if isinstance(options.get("material"), str):
        options["material"] = materials.load(options["material"])
    prior = options.get("prior")
    if isinstance(prior, str | list | tuple | Mapping):
        ready, texts = {}, prior
        if isinstance(prior, Mapping):
            ready = {name: p for name, p in prior.items() if isinstance(p, Prior)}
            texts = {name: p for name, p in prior.items() if name not in ready}
        question = _Priors(prior=texts)  # type: ignore[arg-type]
        options["prior"] = priors_of(question.prior, free) | ready
    return options


@typed
def fit(
    data: Data | Sequence[Data],
    law: str | type[Law] | None = None,
    free: Sequence[str] | None = None,
    **options: Any,
) -> Fit:
    """Fit a law to files or to data in memory, as ``asperity fit`` does.

    Parameters
    ----------
    data : path, Trace, RecordedRun, LockInTable or HealingTable, or a list of them
        A file may be a table of readings, a table of holds, or a recording. For a recording of
        stick-slip the averaged cycle is fitted, with the velocity of the drive in ``fixed``.
    law : str or type of Law, optional
        By default ``rice-ruina`` for recordings and holds, ``elasto-plastic`` for readings.
    free : sequence of str, optional
        Free parameters; by default all that the data may determine.
    **options
        Options of `asperity.inference.fit`, such as ``fixed={"D0": "5 um"}``, ``start``,
        ``inertia`` and ``profile``. A ``material`` may be a name, and a ``prior`` may be written as
        on the command line: ``"bureau2000"``, ``["K=0.2+-0.01 N/um"]``.

    Raises
    ------
    InputError
        As in `asperity.inference.fit`, or if a file cannot be read.

    Examples
    --------
    >>> import asperity as asp
    >>> steps = asp.samples.velocity_steps(seed=1)
    >>> print(asp.fit(steps, "rice-ruina"))
    >>> print(asp.fit(steps, free=["A", "B"], fixed={"D0": "5 um"}))
    """
    options = _by_names(free, options)
    loaded = _loaded(data, options.get("fixed"))
    law = default_law(loaded) if law is None else law
    return fit_loaded(loaded, law, free, **options)


@typed
def compare(
    data: Data | Sequence[Data],
    laws: str | Sequence[str] = "all",
    free: Sequence[str] | None = None,
    **options: Any,
) -> Comparison:
    """Compare laws on files or on data in memory, as ``asperity compare`` does.

    Parameters
    ----------
    data : path, Trace, RecordedRun, LockInTable or HealingTable, or a list of them
    laws : sequence of str or "all"
        "all" means all laws that depend on the velocity.
    free : sequence of str, optional
        Free parameters of all laws.
    **options
        Options of `asperity.inference.compare`; materials and priors as in `fit`.

    Raises
    ------
    InputError
        As in `asperity.inference.compare`, or if a file cannot be read.

    Examples
    --------
    >>> import asperity as asp
    >>> steps = asp.samples.velocity_steps()
    >>> print(asp.compare(steps, ["rice-ruina", "ruina-slip"]))
    """
    listed = laws.split(",") if isinstance(laws, str) else laws
    names = compared_laws([law.strip() for law in listed])
    options = _by_names(free, options)
    return compare_loaded(_loaded(data, options.get("fixed")), names, free, **options)


def compared_laws(names: Sequence[str]) -> list[str]:
    """Names of laws; "all" stands for all laws that depend on the velocity.

    Raises
    ------
    InputError
        If a name is unknown, or the list is empty.
    """
    if "all" in names:
        return [name for name, law in registered().items() if law.rate_dependent]
    require(names, "laws", "name laws", "none", "write 'all' or a,b,c")
    known = [known_law(name) for name in names]
    for name in known:
        get_law(name)
    return known
