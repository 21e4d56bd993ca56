"""Parsing of lines such as ``modulate 24 % at 120 Hz for 20 s`` to steps of a programme.

A line has one of the forms below. Words in braces are quantities with their units; parts in square
brackets are optional.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError, printable, require, require_known
from asperity.experiment.programmes import SlideHoldSlide, VelocitySteps
from asperity.loads import (
    Follow,
    Hold,
    Modulate,
    ProgrammeStep,
    RampLoad,
    RampVelocity,
    Slide,
    StepLoad,
)
from asperity.loads.programme.steps import LoadAndVelocity
from asperity.parameters.arguments import shown
from asperity.recording import read
from asperity.recording.defects.sampling import even_times
from asperity.units import to_si

#: Quantities that a recording can prescribe: the role and the kind of the channel.
_CHANNELS = {"load": ("W", "force"), "velocity": ("velocity", "velocity")}

#: Findings that make a recording unusable: interpolation would hide the defect.
_UNUSABLE = frozenset({"gap", "truncated", "malformed row", "repeated time", "backward time"})

#: Kind of each quantity of a form.
_KINDS = {
    "duration": "time",
    "rise": "time",
    "fall": "time",
    "velocity": "velocity",
    "load": "force",
    "epsilon": "dimensionless",
    "sliding": "time",
    "slip": "length",
    "frequency": "frequency",
}

#: Lists of quantities of a form; the step converts them to SI.
_LISTS = ("holds", "velocities")

#: Largest number of steps with repetitions; a misprint must not fill the memory.
MOST = 100_000
#: Characters of a line in a message.
_SHOWN = 200


def _quoted(line: str) -> str:
    """A line in a message."""
    return f"'{printable(line, _SHOWN)}'"


def follow(channels: str, file: Path) -> Follow:
    """The step that follows channels of a recording.

    Parameters
    ----------
    channels : str
        ``load``, ``velocity``, or both joined by ``and``.
    file : Path
        Any recording that `asperity.recording.read` reads.

    Raises
    ------
    InputError
        If the recording cannot be read, lacks a channel or its unit, or is not whole.
    """
    names = [name.strip().lower() for name in channels.split(" and ")]
    for name in names:
        require_known(name, _CHANNELS, "channels", "name what is followed")
    advice = "save it as CSV with a heading such as 'time (s),load (N),velocity (um/s)'"
    try:
        trace = read(file)
        followed = {name: trace.channel(_CHANNELS[name][0]) for name in names}
    except InputError as error:
        # The advice of `read` names its arguments, which a step does not have.
        known = InputError("file", error.rule, error.got, advice) if error.rule else error
        raise (known if file.exists() else error.about("file")) from None
    for finding in trace.findings:
        rule = f"take a recording without '{finding.name}'"
        got = f"'{file.name}': {finding.sentence} Cut it to a part without this defect"
        require(finding.name not in _UNUSABLE, "file", rule, got)
    # `read` takes a time without a unit for seconds, with a warning that a protocol does not show.
    assumed = [f.where for f in trace.findings if f.name == "unknown unit"]
    assumed = [name for name in assumed if name not in trace.channels]
    rule, got = "state the unit of its time", f"none of '{', '.join(assumed)}' in '{file.name}'"
    require(not assumed, "file", rule, got, "write it into the heading, as in 'time (s)'")
    values: dict[str, np.ndarray] = {}
    for name, channel in followed.items():
        rule = f"take the {name} from a channel of its unit"
        got = f"'{channel.recorded_name}' in '{channel.recorded_unit}' of '{file.name}'"
        advice = "write the unit into its heading, as in 'load (N)' or 'velocity (um/s)'"
        require(channel.kind == _CHANNELS[name][1], "file", rule, got, advice)
        values[name] = channel.values
    finite = np.isfinite(trace.time)
    for column in values.values():
        finite &= np.isfinite(column)
    if not finite.all():
        row = int(np.argmin(finite))
        rule, got = "have a number in every row", f"none in row {row} of '{file.name}'"
        raise InputError("file", rule, got, "cut or fill the recording first")
    return Follow(even_times(trace.time), values.get("load"), values.get("velocity"))


@dataclass(frozen=True)
class StepForm:
    """A form of a step.

    Attributes
    ----------
    pattern : str
        Words, ``{quantity}`` and ``[optional parts]``.
    example : str
    build : callable
        The step, from keyword arguments with the names of the quantities.
    """

    pattern: str
    example: str
    build: Callable[..., ProgrammeStep]

    @cached_property
    def verb(self) -> str:
        """The words before the first quantity that tell the forms apart."""
        head = re.split(r"[{\[]", self.pattern)[0].split()
        return " ".join(head[: 2 if head[0] in ("step", "ramp") else 1])

    @cached_property
    def expression(self) -> re.Pattern[str]:
        """The pattern as a regular expression over text with single blanks."""
        optional = re.sub(r"\s*\[(.*?)\]", r"(?:,? \1)?", self.pattern)
        named = re.sub(r"\{(\w+)\}", r"(?P<\1>\\S.*?)", optional)
        return re.compile(named, re.IGNORECASE)


#: All forms of steps.
FORMS = (
    StepForm("hold[for] {duration}", "hold 10 s", Hold),
    StepForm("slide[at {velocity}] for {duration}", "slide at 10 um/s for 60 s", Slide),
    StepForm(
        "modulate {epsilon} at {frequency} for {duration}[rising in {rise}][falling in {fall}]",
        "modulate 24 % at 120 Hz for 20 s",
        Modulate,
    ),
    StepForm("step load to {load}", "step load to 9 N", lambda load: StepLoad(load)),
    StepForm(
        "ramp load to {load} in {duration}",
        "ramp load to 9 N in 5 s",
        lambda load, duration: RampLoad(load, duration),
    ),
    StepForm(
        "ramp velocity to {velocity} in {duration}",
        "ramp velocity to 100 um/s in 5 s",
        lambda velocity, duration: RampVelocity(velocity, duration),
    ),
    StepForm(
        "slide-hold-slide for {holds} sliding {sliding}",
        "slide-hold-slide for 1 s, 10 s, 100 s sliding 20 s",
        SlideHoldSlide,
    ),
    StepForm(
        "velocity steps {velocities} over {slip}",
        "velocity steps 1 um/s, 10 um/s, 1 um/s over 100 um",
        VelocitySteps,
    ),
    StepForm("follow {channels} from {file}", "follow load from recording.csv", follow),
)

REPEAT = re.compile(r"repeat (?P<times>\S+)(?: times)?:(?P<steps>.*)", re.IGNORECASE)
REPEAT_EXAMPLE = "repeat 3 times: hold 10 s; slide for 60 s"


def parse_step(text: str, name: str, folder: Path) -> ProgrammeStep:
    """A line of a protocol as a step.

    Parameters
    ----------
    text : str
    name : str
        Name in messages, such as ``"steps[3]"``.
    folder : Path
        Folder of files that the line names.

    Raises
    ------
    InputError
        If the line has no known form, or an invalid quantity.
    """
    line = " ".join(text.split())
    forms = _meant(line, name)
    for form in forms:
        match = form.expression.fullmatch(line)
        if match is not None:
            parts = {key: value for key, value in match.groupdict().items() if value is not None}
            arguments = _arguments(parts, name, line, form.example, folder)
            try:
                return form.build(**arguments)
            except InputError as error:
                known = error.field.name in arguments
                raise (error.about(f"{name}.{error.field}") if known else error) from None
    examples = " or ".join(f"'{form.example}'" for form in forms)
    raise InputError(name, "be a complete step", _quoted(line), f"write it like {examples}")


def _meant(line: str, name: str) -> list[StepForm]:
    """The forms that begin with the same words as the line."""
    words = line.lower().split()
    for length in (1, 2):
        forms = [form for form in FORMS if form.verb == " ".join(words[:length])]
        if forms:
            return forms
    verbs = sorted({verb for form in FORMS for verb in (form.verb, form.verb.split()[0])})
    # "ramp" begins two forms; "step velocity" may mean any form with a velocity.
    if words and words[0] in verbs:
        named = f"{{{words[1]}}}" if len(words) > 1 else "{}"
        return [f for f in FORMS if f.verb.split()[0] == words[0] or named in f.pattern]
    verbs = [*verbs, "repeat"]
    tried = (" ".join(words[:2]), words[0] if words else "")
    matches = (get_close_matches(text, verbs, n=1, cutoff=0.6) for text in tried)
    near = next(filter(None, matches), [""])[0]
    like = {form.example: form.verb for form in FORMS} | {REPEAT_EXAMPLE: "repeat"}
    examples = [example for example, verb in like.items() if near and verb.startswith(near)]
    listed = "' or '".join(examples or [form.example for form in FORMS])
    advice = f"did you mean something like '{listed}'?" if near else f"write it like '{listed}'"
    raise InputError(name, "be a step", _quoted(line), advice)


def _arguments(
    parts: Mapping[str, str], name: str, line: str, example: str, folder: Path
) -> dict[str, Any]:
    """Arguments of a step: quantities in SI, lists of texts with units, channels, or a file."""
    arguments: dict[str, Any] = {}
    for key, text in parts.items():
        if key in _KINDS:
            try:
                arguments[key] = to_si(text, _KINDS[key], f"{name}.{key}")
            except InputError as error:
                raise error.noting(f", as in '{example}' (in {_quoted(line)})") from None
        elif key in _LISTS:
            arguments[key] = tuple(part.strip() for part in text.split(","))
        else:
            arguments[key] = folder / text.strip("\"'") if key == "file" else text
    return arguments


@dataclass(frozen=True)
class PlannedStep:
    """A step, its position counted from 1, such as ``"step 3.2"``, and its line."""

    place: str
    text: str
    step: ProgrammeStep


def plan(
    steps: Sequence[Any], folder: Path, prefix: str = "step "
) -> tuple[list[PlannedStep], list[InputError]]:
    """All steps in order, with repetitions expanded, and their mistakes.

    Parameters
    ----------
    steps : sequence of str, ProgrammeStep, or object with ``repeat`` and ``steps``
    folder : Path
        Folder of files that lines name.
    prefix : str
        Beginning of the position of a step.
    """
    planned: list[PlannedStep] = []
    mistakes: list[InputError] = []
    for number, step in enumerate(steps, start=1):
        try:
            block, wrong = _planned(step, f"{prefix}{number}", folder)
        except InputError as error:
            block, wrong = [], [error]
        planned += block
        mistakes += wrong
    return planned, mistakes


def check_levels(planned: Sequence[PlannedStep], level: LoadAndVelocity) -> Iterator[InputError]:
    """Mistakes in the values of the steps, each at the load and velocity before it."""
    reported: set[str] = set()
    for one in planned:
        try:
            _, level = one.step.lay_out(level, one.place)
            if isinstance(one.step, StepLoad) and not level.load > 0:
                advice = "give a load above zero, without which there is no contact"
                raise InputError(f"{one.place}.load", "be positive", f"{level.load:g} N", advice)
        except InputError as error:
            if one.place not in reported:
                reported.add(one.place)
                yield error.noting(f" (in {_quoted(one.text)})")


def _planned(step: Any, place: str, folder: Path) -> tuple[list[PlannedStep], list[InputError]]:
    """The steps that one entry of a protocol stands for, and their mistakes."""
    if isinstance(step, ProgrammeStep):
        return [PlannedStep(place, repr(step), step)], []
    if isinstance(step, str):
        line = " ".join(step.split())
        if line.lower().split(" ")[0] != "repeat":
            return [PlannedStep(place, line, parse_step(line, place, folder))], []
        times, inner = _repetition(line, place)
    else:
        times, inner = step.repeat, step.steps
    block, mistakes = plan(inner, folder, f"{place}.")
    if times * len(block) > MOST:
        rule, got = f"come to at most {MOST} steps", f"{shown(times)} times {len(block)}"
        return [], [*mistakes, InputError(place, rule, got, "repeat it less often")]
    # If all steps inside are wrong, `times` may exceed the length of any list.
    return block * min(times, MOST), mistakes


def _repetition(line: str, place: str) -> tuple[int, list[str]]:
    """Number of repetitions of a line, and the lines that it repeats."""
    match = REPEAT.fullmatch(line)
    # Python refuses integers of more than 4300 digits; a thousand digits exceed `MOST` already.
    times = int(match["times"][:1000]) if match and match["times"].isdecimal() else 0
    if match is None or times < 1:
        rule = "say how often what is repeated"
        raise InputError(place, rule, _quoted(line), f"write it like '{REPEAT_EXAMPLE}'")
    inner = [part.strip() for part in match["steps"].split(";")]
    if any(part.lower().startswith("repeat") for part in inner):
        rule = "not repeat within a line that repeats"
        table = "{ repeat = 3, steps = ['hold 10 s', 'slide for 60 s'] }"
        raise InputError(
            place, rule, _quoted(line), f"write the outer one as a table, like {table}"
        )
    # A line may end in a semicolon.
    return times, [part for i, part in enumerate(inner) if part or i == 0]
