"""From the lines of a protocol to the steps of a programme, each with its place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.loads import ProgrammeStep, StepLoad
from asperity.loads.programme.steps import LoadAndVelocity
from asperity.parameters.arguments import shown
from asperity.protocol.grammar import REPEAT, REPEAT_EXAMPLE, parse_step

#: Steps that a protocol may have with all repetitions: a misprint must not fill the memory.
MOST = 100_000


@dataclass(frozen=True)
class PlannedStep:
    """A step, its place counted from 1 such as ``"step 3.2"``, and the line it was written as."""

    place: str
    text: str
    step: ProgrammeStep


def plan(steps: Sequence[Any], folder: Path) -> tuple[list[PlannedStep], list[str]]:
    """All steps in their order, repetitions written out, and the mistakes in them.

    Parameters
    ----------
    steps : sequence of str, ProgrammeStep, or object with ``repeat`` and ``steps``
    folder : Path
        Where files that lines name lie.
    """
    mistakes: list[str] = []
    return _planned(steps, "step ", folder, mistakes), mistakes


def check_levels(planned: Sequence[PlannedStep], level: LoadAndVelocity) -> Iterator[str]:
    """Mistakes in the values of the steps, each at the load and velocity before it."""
    reported: set[str] = set()
    for one in planned:
        try:
            _, level = one.step.lay_out(level, one.place)
            if isinstance(one.step, StepLoad) and not level.load > 0:
                raise InputError(
                    f"{one.place}.load must be positive, got {level.load:g} N; give a load above "
                    "zero, without which there is no contact"
                )
        except InputError as error:
            if one.place not in reported:
                reported.add(one.place)
                yield f"{error} (in '{one.text}')"


def _planned(
    steps: Sequence[Any], prefix: str, folder: Path, mistakes: list[str]
) -> list[PlannedStep]:
    found: list[PlannedStep] = []
    for number, given in enumerate(steps, start=1):
        place = f"{prefix}{number}"
        try:
            found += _one(given, place, folder, mistakes)
        except InputError as error:
            mistakes.append(str(error))
    return found


def _one(given: Any, place: str, folder: Path, mistakes: list[str]) -> list[PlannedStep]:
    if isinstance(given, ProgrammeStep):
        return [PlannedStep(place, repr(given), given)]
    if isinstance(given, str):
        line = " ".join(given.split())
        if line.lower().split(" ")[0] != "repeat":
            return [PlannedStep(place, line, parse_step(line, place, folder))]
        times, inner = _repetition(line, place)
    else:
        times, inner = given.repeat, given.steps
    block = _planned(inner, f"{place}.", folder, mistakes)
    if times * len(block) > MOST:
        raise InputError(
            f"{place} must come to at most {MOST} steps, got {shown(times)} times {len(block)}; "
            "repeat it less often"
        )
    return block * times


def _repetition(line: str, place: str) -> tuple[int, list[str]]:
    match = REPEAT.fullmatch(line)
    inner = [part.strip() for part in match["steps"].split(";")] if match else []
    if match is None or not match["times"].isdecimal() or _count(match["times"]) < 1:
        raise InputError(
            f"{place} must say how often what is repeated, got '{line}'; write it like "
            f"'{REPEAT_EXAMPLE}'"
        )
    if any(part.lower().startswith("repeat") for part in inner):
        raise InputError(
            f"{place} must not repeat within a line that repeats, got '{line}'; write the outer "
            "one as a table, like { repeat = 3, steps = ['hold 10 s', 'slide for 60 s'] }"
        )
    # A line may end in a semicolon.
    return _count(match["times"]), [part for i, part in enumerate(inner) if part or i == 0]


def _count(digits: str) -> int:
    """The number, or one beyond `MOST` of digits that are too many to be read."""
    return int(digits) if len(digits) < 1000 else 10**1000
