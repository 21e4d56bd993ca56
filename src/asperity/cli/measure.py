"""``asperity measure``: friction in a recording, with uncertainties and verdicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity._processes import available_cores, process_count
from asperity.cli.options import (
    Count,
    field_option,
    law_option,
    material_option,
    option,
    output_options,
    point_of,
    set_option,
    settings_of,
    switch,
)
from asperity.cli.recording import source_options, times_option, velocities_option
from asperity.cli.report import Output, say
from asperity.cli.words import POINT_OPTIONS, fields_as_options, in_options
from asperity.errors import InputError, naming, require, symbol, symbols

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from asperity.measurement.stick_slip.campaign import StickSlipCampaign
    from asperity.questions.recording import Measurement as Question, Source


Rows = list[dict[str, Any]]
#: Adds the cycles of a law to a campaign.
Cycles = Callable[["StickSlipCampaign"], "StickSlipCampaign"]

#: The record that the options fill.
_QUESTION = "asperity.questions.recording:Measurement"
#: Velocities of a curve of a law.
_POINTS = 13


@dataclass(frozen=True)
class FileRows:
    """Measures one file of a campaign; it can be sent to another process.

    Attributes
    ----------
    source : Source
    question : Question
    conditions : dict of Path to dict
        Fields of the question that are those of one file.
    """

    source: Source
    question: Question
    conditions: dict[Path, dict[str, Any]] = field(default_factory=dict)

    def __call__(self, path: Path) -> Rows:
        """Rows of a file; a single row with the reason if it cannot be measured."""
        from asperity.measurement.campaign import failed_row
        from asperity.measurement.conditions import MACHINE_FIELDS
        from asperity.measurement.from_file import measured_parts
        from asperity.measurement.report import measured_rows
        from asperity.recording.readers.from_file import read_source

        with naming(in_options):
            try:
                question = self.question_of(path)
                result = measured_parts(read_source(path, self.source), question)
                known = {n: getattr(question, f) for n, f in MACHINE_FIELDS.items()}
                known = {name: value for name, value in known.items() if value is not None}
                return [{**known, **row} for row in measured_rows(path, result)]
            except InputError as error:
                return [failed_row(path, 1, str(error))]
            except Exception as error:  # a damaged file must not stop the campaign
                reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
                return [failed_row(path, 1, f"the recording could not be measured ({reason})")]

    def question_of(self, path: Path) -> Question:
        """The question with the conditions of a file."""
        return self.question.model_copy(update=self.conditions.get(path))

    def inputs(self) -> dict[str, Any]:
        """Everything except the files that rows depend on, as JSON values.

        The contents of a reduction file are included: a changed file prevents a resumption.

        Raises
        ------
        InputError
            If the reduction file cannot be read.
        """
        source = self.source.model_dump(mode="json")
        if self.source.recipe is not None:
            from asperity.questions.recording import ReadingRecipe

            source["recipe"] = ReadingRecipe.from_file(self.source.recipe).model_dump()
        options = self.question.model_dump(mode="json")
        conditions = {str(path): fields for path, fields in self.conditions.items()}
        return {"source": source, "options": options, "conditions": conditions}


_EPILOG = """\b
Examples:
  asperity measure recording.csv
  asperity measure recording.csv --load Fn --force Ft --unit Fn=N --unit Ft=N \\
      --frequency "120 Hz" --window 10:60 --json --plot recording.png
  asperity measure velocity_step.txt --no-modulation --plot steps.png
  asperity measure amplitudes.csv --amplitudes
  asperity measure stick_slip.mat --set "K=168 N/m" --set "V=42 um/s" \\
      --set "M=30.7 g" --events events.csv --plot events.png
  asperity measure day1/*.csv --out campaign.csv
  asperity measure run_*.csv --stick-slip --set "W0=7 N" --out campaign.csv \\
      --conditions "run_k{K N/m}_v{V um/s}" --thresholds bifurcation.csv
  asperity measure run_*.csv --stick-slip --set "W0=7 N" --set "M=1 kg" \\
      --conditions "run_k{K N/m}_v{V um/s}" --out campaign.csv --plot campaign.png \\
      --law rice-ruina --material bureau2000

\b
Convention: W/W0 = 1 + epsilon cos phi, phi from the measured load,
F/W0 = mean_friction + sum of mu_n cos(n phi + phase_n).

\b
Exit code 0: measured; 1: measured, but a check says bad, or rows of a table have a reason
in place of numbers; 2: bad input.
"""


@click.command(epilog=_EPILOG, short_help="Friction in recordings: steps, holds, slips, harmonics.")
@click.argument("recordings", type=Path, nargs=-1, required=True)
@output_options(plot=True)
@field_option(_QUESTION, "window", "START:END")
@times_option(
    "--steps",
    "Times of the velocity steps in seconds, like 12.5,60, or a file of them, one a line.",
)
@velocities_option
@times_option(
    "--holds",
    "Holds as START:END in seconds, like 100:110,200:300, or a file of them, one a line.",
)
@source_options
@field_option(_QUESTION, "frequency", "VALUE", "-f")
@field_option(_QUESTION, "exact_frequency")
@field_option(_QUESTION, "harmonics", "N")
@field_option(_QUESTION, "whole_periods")
@field_option(_QUESTION, "detrend", "")
@switch("--amplitudes", "Read every modulated stretch, and print them as a table.")
@switch(
    "--no-modulation modulated",
    "Velocity steps and holds; by default, those of a recording whose load is constant.",
    value=False,
)
@switch(
    "--stick-slip",
    "Slip events; by default, those of a recording that is stick-slip and not modulated.",
    value=True,
)
@set_option(
    '--set "K=168 N/m" --set "V=42 um/s"',
    "K, V, M or W0 of the machine, for slip events; with --law its parameters too",
)
@option("--events", "CSV|NC|JSON", "Where the catalogue of slip events goes.", Path)
@option(
    "--out",
    "CSV|NC",
    "Measure all recordings into one table: a row for each amplitude, step and hold.",
    Path,
)
@option(
    "--conditions",
    "CSV|PATTERN",
    "K, V, M or W0 of each file: a table with a column file, or a pattern of the files' names "
    'like "run_k{K N/m}_v{V um/s}".',
)
@switch("--resume", "Continue an interrupted table.")
@option("--jobs", "N", "Processes of a table; as many as cores if not given.", Count(1))
@option(
    "--thresholds",
    "CSV",
    "With --out and --stick-slip: where stick-slip ends, K/W0 against V, for asperity recipe.",
    Path,
)
@law_option("With --out, --stick-slip and --plot: the law whose cycles are drawn with the drops.")
@material_option()
def measure(
    recordings: tuple[Path, ...],
    source: Source,
    settings: tuple[str, ...],
    law: str | None,
    material: str | None,
    conditions: str | None,
    events: Path | None,
    amplitudes: bool,
    out: Path | None,
    thresholds: Path | None,
    resume: bool,
    jobs: int | None,
    output: Output,
    **fields: Any,
) -> int:
    """Friction in a recording: velocity steps, holds, slip events, or response to a modulated load.

    The kind of the recording is recognised from its load and velocity. RECORDINGS are files of a
    laboratory: CSV or other text, HDF5, NetCDF, MATLAB, TDMS or LOOK. With --out, several
    recordings are measured into one table.
    """
    from asperity.questions.recording import Measurement as Question

    if fields["frequency"] == "auto":
        fields["frequency"] = None
    given = settings_of(settings)
    known = {name: value for name, value in fields.items() if value is not None}
    question = Question(**known, **_machine(given, law is None))
    plot, count, one = output.plot, len(recordings), "leave one out"
    stick_slip, listed = question.stick_slip, question.steps or question.holds
    drawn = not (law or material) or (out and plot and stick_slip)
    rule, advice = (
        "go with --out, --stick-slip and --plot",
        "add what is missing: they draw a campaign",
    )
    require(drawn, "--law and --material", rule, "them without", advice)
    apart = not (stick_slip and amplitudes)
    require(apart, "--stick-slip", "go without --amplitudes", "both", one)
    several = not out or not ((plot and not stick_slip) or events or listed)
    options, rule = "--plot, --events, --steps and --holds", "go with one recording without --out"
    advice = "measure that recording by itself, or draw a campaign of --stick-slip"
    require(several, options, rule, "both", advice)
    rule, advice = "be given with several recordings", "name the table, like --out campaign.csv"
    require(out or count == 1, "--out", rule, f"{count} without", advice)
    table, options = out or not (resume or jobs or thresholds), "--resume, --jobs and --thresholds"
    require(table, options, "go with --out", "no table", "name it or leave them out")
    alone = not amplitudes or fields["modulated"] is None
    require(alone, "--amplitudes", "go without --no-modulation", "both", one)
    alone = not amplitudes or not (events or listed)
    rule = "go without --events, --steps and --holds"
    require(alone, "--amplitudes", rule, "both", one)
    alone, advice = not amplitudes or bool(out) or not (given or conditions), "leave them out"
    rule = "go without --set and --conditions, or with --out"
    require(alone, "--amplitudes", rule, "numbers of the machine", advice)
    rows_of = _file_rows(recordings, source, question, conditions)
    output.require_picture(*recordings)
    if out is not None:
        cycles = _cycles(law, material, given, conditions)
        return _campaign(recordings, rows_of, out, thresholds, cycles, resume, jobs, output)
    question = rows_of.question_of(recordings[0])
    if amplitudes:
        return _amplitudes(recordings[0], source, question, output)
    return _one(recordings[0], source, question, events, output)


def _amplitudes(recording: Path, source: Source, question: Question, output: Output) -> int:
    from asperity.measurement.campaign import modulated_rows
    from asperity.measurement.measure import measure_amplitudes
    from asperity.measurement.report import amplitude_sections
    from asperity.recording.readers.from_file import read_source

    rows = modulated_rows(recording, measure_amplitudes(read_source(recording, source), question))
    output.answer(
        lambda: {"recording": str(recording), "amplitudes": rows},
        lambda: amplitude_sections(rows, recording.name),
    )

    def draw() -> Figure:
        from asperity.figures.recording import draw_amplitudes

        return draw_amplitudes(rows)

    output.draw(draw)
    return int(any(row["reason"] or row["verdict"] == "bad" for row in rows))


def _one(
    recording: Path, source: Source, question: Question, events: Path | None, output: Output
) -> int:
    from asperity._version import __version__
    from asperity.cli.progress import waiting
    from asperity.measurement.from_file import answer_measurement
    from asperity.measurement.report import measured_record, measured_sections
    from asperity.measurement.stick_slip import catalogue
    from asperity.outputs import output_files
    from asperity.recording.readers.from_file import read_source

    if events is not None:
        catalogue.check_catalogue(events)
        output_files({"--events": events}, inputs={"recording": recording})
    result: Any
    with waiting(f"reading and measuring {recording.name}"):
        trace = read_source(recording, source)
        result, why = answer_measurement(trace, question)
    modulated = sum(part.modulated for part in getattr(result, "stretches", ()))
    say(
        why,
        modulated > 1
        and result.chosen_by == "program"
        and f"1 of {modulated} modulated stretches is read; --amplitudes reads each",
    )
    if events is not None:
        slips, advice = result.mode == "stick-slip", "leave it out, or add --stick-slip"
        require(slips, "--events", "go with a stick-slip recording", "another", advice)
        catalogue.write_catalogue(result, events)
    about = {"recording": str(recording), "version": __version__, **trace.provenance}
    output.answer(
        lambda: {**measured_record(result), "provenance": about},
        lambda: measured_sections(result, recording.name, output.names),
    )
    output.draw(result.plot)
    bad = [check for check in result.checks if check.verdict == "bad"]
    say(*(f"{check.name} is bad: {check.sentence}" for check in bad))
    return int(bool(bad))


def _file_rows(
    recordings: tuple[Path, ...], source: Source, question: Question, conditions: str | None
) -> FileRows:
    """The function that measures each file; its arguments are checked before files are read."""
    from asperity.measurement.conditions import MACHINE_FIELDS, conditions_of

    if conditions is None:
        return FileRows(source, question)
    rows_of = FileRows(source, question, conditions_of(recordings, conditions))
    for path, fields in rows_of.conditions.items():
        for name, about in MACHINE_FIELDS.items():
            once = about not in fields or not getattr(question, about)
            got = "it by --set and by --conditions"
            require(once, name, "be given once", got, "leave one out")
        try:
            rows_of.question_of(path)
        except InputError as error:
            raise error.noting(f" (--conditions, '{path.name}')") from None
    return rows_of


def _cycles(
    law: str | None, material: str | None, given: dict[str, str], conditions: str | None
) -> Cycles:
    """The function that adds cycles of the law to a campaign; its numbers are checked at once."""
    if law is None and material is None:
        return lambda campaign: campaign
    from asperity.laws import get_law
    from asperity.operating_point import point_numbers
    from asperity.parameters import point_parameters

    with fields_as_options(POINT_OPTIONS):
        require(law, "law", "be given", "a material alone", "name the law of the cycles")
        chosen = get_law(str(law))
        among = {n: p for n, p in point_parameters(chosen).items() if p.place == "law" or n == "M"}
        needed = ("M",) if conditions is None else ()
        point = point_of(law, material, given)
        numbers = point_numbers(point, "command line", among, needed)
    values = {name: number.value for name, number in numbers.items()}

    def added(campaign: StickSlipCampaign) -> StickSlipCampaign:
        import numpy as np

        from asperity.experiment import stick_slip_response
        from asperity.slider.parameters import slider_from

        machines = {
            k: (series.K, series.W0, series.mass(values.get("M", np.nan)))
            for k, series in enumerate(campaign.series)
        }
        modelled = [k for k, machine in machines.items() if np.isfinite(machine).all()]
        V = np.array([v for series in campaign.series for v in series.column("V")])
        V = V[np.isfinite(V)]
        if not modelled or not V.size:
            say(
                "no curve of the law: K, W0, M and V must be known; give them by --set or "
                "--conditions"
            )
            return campaign
        columns = np.array([machines[k] for k in modelled]).T[:, :, None]
        machine = dict(zip(("K", "W0", "M"), columns, strict=True))
        # The curves extend a little beyond the recordings.
        speeds = np.geomspace(V.min() / 1.2, V.max() * 1.2, _POINTS)
        model = stick_slip_response(slider_from(chosen, {**values, **machine}), velocity=speeds)
        return replace(campaign, model=model, modelled=tuple(modelled))

    return added


def _campaign(
    recordings: tuple[Path, ...],
    rows_of: FileRows,
    out: Path,
    thresholds: Path | None,
    with_cycles: Cycles,
    resume: bool,
    jobs: int | None,
    output: Output,
) -> int:
    from asperity.cli.progress import bar
    from asperity.measurement.campaign import run_campaign
    from asperity.measurement.report import healing_section
    from asperity.measurement.stick_slip.campaign import StickSlipCampaign
    from asperity.outputs import output_files
    from asperity.outputs.sections import Section
    from asperity.parameters.parameter import count_text

    question = rows_of.question
    advice = "add it: the end of stick-slip needs the recordings of steady sliding too"
    holding = thresholds is None or question.stick_slip
    require(holding, "--thresholds", "go with --stick-slip", "it without", advice)
    if thresholds is not None or output.plot is not None:
        output_files(
            {"--thresholds": thresholds, "--plot": output.plot, "--out": out},
            inputs={f"recording '{f}'": f for f in recordings},
        )
    with bar("file", "measurements") as update:
        done = run_campaign(
            recordings,
            rows_of,
            out,
            inputs=rows_of.inputs(),
            resume=resume,
            jobs=available_cores() if jobs is None else process_count(jobs, "--jobs"),
            progress=update,
        )
    campaign = StickSlipCampaign.of(done.table)
    healing = {"healing": campaign.healing_record()} if campaign.series else {}
    counts = {"files": done.files, "rows": done.rows, "failed": done.failed, "out": str(out)}
    made = f"{count_text(done.rows, 'row')} of {count_text(done.files, 'file')} in {out}"
    output.answer(
        lambda: {**counts, **healing},
        lambda: [
            Section("", (made,)),
            *([healing_section(campaign)] if campaign.series else []),
        ],
    )
    output.draw(lambda: with_cycles(campaign).plot())
    unknown = [] if thresholds is None else _ends_of_stick_slip(done.table, thresholds)
    say(
        *(f"cannot tell where stick-slip ends: {reason}" for reason in unknown),
        done.sliding
        and question.modulated is None
        and not question.stick_slip
        and f"{done.sliding} of {done.files} files have a constant load: their velocity steps and "
        "holds are in the table, as with --no-modulation",
        done.failed
        and f"{done.failed} of {done.rows} rows have no numbers; the column 'reason' of {out} "
        "says why",
    )
    return int(done.failed > 0 or bool(unknown))


def _ends_of_stick_slip(table: list[dict[str, Any]], out: Path) -> list[str]:
    """Write where stick-slip ends for each machine; why it is unknown for some."""
    from asperity.measurement.stick_slip.threshold import thresholds, write_thresholds
    from asperity.outputs import written_file

    ends = thresholds(table)
    with written_file(out, "--thresholds") as file:
        write_thresholds(file, ends)
    if not ends:
        return ["no row has a regime, K, V and W0; give them by --set or --conditions"]
    return [end.reason for end in ends if end.reason]


def _machine(given: dict[str, str], strict: bool) -> dict[str, Any]:
    """Numbers of the machine from ``--set``, by the fields of the question."""
    from asperity.measurement.conditions import MACHINE_FIELDS

    rule, like = f"name one of {symbols(MACHINE_FIELDS)}", f'like --set "{symbol("K")}=168 N/m"'
    for name in given if strict else ():
        require(name in MACHINE_FIELDS, "--set", rule, f"'{symbol(name)}'", f"write it {like}")
    return {MACHINE_FIELDS[name]: given[name] for name in given if name in MACHINE_FIELDS}
