"""Steps as an experimenter says them: ``modulate 24 % at 120 Hz for 20 s``.

A line is one of the forms below. Words in braces are quantities with their units; what stands in
square brackets may be left out.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.experiment.recipes import SlideHoldSlide, VelocitySteps
from asperity.loads import Hold, Modulate, ProgrammeStep, RampLoad, RampVelocity, Slide, StepLoad
from asperity.protocol.recorded import follow
from asperity.units import to_si

#: What each quantity of a form measures.
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


@dataclass(frozen=True)
class StepForm:
    """One way to write a step.

    Attributes
    ----------
    pattern : str
        Words, ``{quantity}`` and ``[optional parts]``.
    example : str
    build : callable
        The step, from the quantities by name and the folder of the file.
    """

    pattern: str
    example: str
    build: Callable[[Mapping[str, Any], Path], ProgrammeStep]

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


def _step_load(parts: Mapping[str, Any], folder: Path) -> ProgrammeStep:
    return StepLoad(parts["load"])


def _list(text: str) -> tuple[str, ...]:
    """Quantities with commas between them, each with its unit."""
    return tuple(part.strip() for part in text.split(","))


def _modulate(parts: Mapping[str, Any], folder: Path) -> ProgrammeStep:
    return Modulate(**parts)


#: Every form that a step can take.
FORMS = (
    StepForm("hold[for] {duration}", "hold 10 s", lambda parts, folder: Hold(**parts)),
    StepForm(
        "slide[at {velocity}] for {duration}",
        "slide at 10 um/s for 60 s",
        lambda parts, folder: Slide(**parts),
    ),
    StepForm(
        "modulate {epsilon} at {frequency} for {duration}[rising in {rise}][falling in {fall}]",
        "modulate 24 % at 120 Hz for 20 s",
        _modulate,
    ),
    StepForm("step load to {load}", "step load to 9 N", _step_load),
    StepForm(
        "ramp load to {load} in {duration}",
        "ramp load to 9 N in 5 s",
        lambda parts, folder: RampLoad(parts["load"], parts["duration"]),
    ),
    StepForm(
        "ramp velocity to {velocity} in {duration}",
        "ramp velocity to 100 um/s in 5 s",
        lambda parts, folder: RampVelocity(parts["velocity"], parts["duration"]),
    ),
    StepForm(
        "slide-hold-slide for {holds} sliding {sliding}",
        "slide-hold-slide for 1 s, 10 s, 100 s sliding 20 s",
        lambda parts, folder: SlideHoldSlide(_list(parts["holds"]), parts["sliding"]),
    ),
    StepForm(
        "velocity steps {velocities} over {slip}",
        "velocity steps 1 um/s, 10 um/s, 1 um/s over 100 um",
        lambda parts, folder: VelocitySteps(_list(parts["velocities"]), parts["slip"]),
    ),
    StepForm(
        "follow {channels} from {file}",
        "follow load from recording.csv",
        lambda parts, folder: follow(parts["channels"], parts["file"], folder),
    ),
)

REPEAT = re.compile(r"repeat (?P<times>\S+)(?: times)?:(?P<steps>.*)", re.IGNORECASE)
REPEAT_EXAMPLE = "repeat 3 times: hold 10 s; slide for 60 s"


def parse_step(text: str, name: str, folder: Path) -> ProgrammeStep:
    """One line of a protocol as a step.

    Parameters
    ----------
    text : str
    name : str
        What messages call it, such as ``"steps[3]"``.
    folder : Path
        Where files that the line names lie.

    Raises
    ------
    InputError
        If the line is no step, or one of its quantities is not what it has to be.
    """
    line = " ".join(text.split())
    forms = _meant(line, name)
    for form in forms:
        match = form.expression.fullmatch(line)
        if match is not None:
            parts = {key: value for key, value in match.groupdict().items() if value is not None}
            return form.build(_quantities(parts, name, line, form.example), folder)
    examples = " or ".join(f"'{form.example}'" for form in forms)
    raise InputError(f"{name} must be a whole step, got '{line}'; write it like {examples}")


def _meant(line: str, name: str) -> list[StepForm]:
    """The forms that begin as the line does."""
    words = line.lower().split()
    for length in (1, 2):
        forms = [form for form in FORMS if form.verb == " ".join(words[:length])]
        if forms:
            return forms
    verbs = sorted({verb for form in FORMS for verb in (form.verb, form.verb.split()[0])})
    # `ramp` alone names two forms, neither of which is meant more than the other.
    if words and words[0] in verbs:
        return [form for form in FORMS if form.verb.split()[0] == words[0]]
    verbs = [*verbs, "repeat"]
    tried = (" ".join(words[:2]), words[0] if words else "")
    near = [m for said in tried for m in get_close_matches(said, verbs, n=1, cutoff=0.6)]
    examples = [form.example for form in FORMS if near and form.verb.startswith(near[0])]
    if near == ["repeat"]:
        examples = [REPEAT_EXAMPLE]
    shown = "' or '".join(examples or [form.example for form in FORMS])
    raise InputError(
        f"{name} must be a step, got '{line}'; "
        + (f"did you mean something like '{shown}'?" if near else f"write it like '{shown}'")
    )


def _quantities(
    parts: Mapping[str, str], name: str, line: str, example: str
) -> dict[str, float | str]:
    """Values in SI; what is no quantity stays a text."""
    found: dict[str, float | str] = {}
    for key, text in parts.items():
        if key not in _KINDS:
            found[key] = text
            continue
        try:
            found[key] = to_si(text, _KINDS[key], f"{name}.{key}", require_unit=True)
        except InputError as error:
            raise InputError(f"{error}, as in '{example}' (in '{line}')") from None
    return found
