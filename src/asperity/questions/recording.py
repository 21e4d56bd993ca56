"""Questions about a recording: how its file is read, and which quantities are measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, StrictBool, StrictInt, model_validator

from asperity.errors import Argument, require
from asperity.questions.record import WHOLE, Question, Span, Times, parts_of, quantity, shown

Column = str | int


def _hold(value: Any) -> Any:
    """A velocity; zero, the velocity in a hold, needs no unit."""
    return 0.0 if isinstance(value, str) and value.strip() == "0" else value


#: Velocity of the drive between two steps (m/s), 0 in a hold.
Pulling = Annotated[quantity("velocity", "not negative"), BeforeValidator(_hold)]  # type: ignore[valid-type]
#: Velocities between steps, one more than there are steps; a text has commas between them.
Velocities = Annotated[tuple[Pulling, ...], BeforeValidator(parts_of)]  # type: ignore[valid-type]


class ReadingRecipe(Question):
    """How recordings are read: arguments of `asperity.read`, as a reduction file has them.

    Attributes
    ----------
    title : str
    columns : dict of str to str or int
        Columns by role.
    units : dict of str to str
        Units by column.
    channels : dict of str to str
        Expressions of derived channels, in their order.
    rate : float or str, optional
        Samples per second, like "10 kHz", in place of times.
    group : str, optional
        Group in an HDF5, MATLAB or TDMS file with several groups.
    delimiter : str, optional
        Delimiter of a text: a character, tab or blank.
    decimal : str, optional
        Decimal mark of a text: . or ,
    format : str, optional
        Format of the file, or name of a reader.
    """

    subject = "recipe"
    prefix = "recipe."

    title: str = ""
    columns: dict[str, Column] = Field(default_factory=dict)
    units: dict[str, str] = Field(default_factory=dict)
    channels: dict[str, str] = Field(default_factory=dict)
    rate: float | str | None = None
    group: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    format: str | None = None


class Source(ReadingRecipe):
    """How one recording is read.

    Attributes
    ----------
    recipe : Path, optional
        Reduction file, whose columns, units and channels apply where no others are given.
    area : str or float, optional
        Area that turns stresses into forces, like "25 cm^2".
    """

    subject = "read"
    prefix = "read."

    recipe: Path | None = None
    area: float | str | None = None

    @property
    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of `asperity.read`, without those that have their default."""
        named = self.model_dump(exclude={"title", "area"})
        return {name: value for name, value in named.items() if value not in (None, {})}


def _closed(spans: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Holds in their order, each with a begin and an end."""
    for start, end in spans:
        rule, got = "have a start and an end", f"{start:g} to {end:g} s"
        require(math.isfinite(start) and math.isfinite(end), "", rule, got, "write both")
    ordered = sorted(spans)
    for (first, end), (start, last) in pairwise(ordered):
        got = f"{first:g} to {end:g} s and {start:g} to {last:g} s"
        require(end <= start, "", "not overlap", got, "leave one out or cut it")
    return tuple(ordered)


#: Fields about the reading of a modulated load; ``detrend`` also applies to steps and holds.
OF_MODULATION = ("frequency", "exact_frequency", "harmonics", "whole_periods", "detrend")
#: Numbers of the machine, which are used for slip events only.
OF_SLIPS = ("stiffness", "velocity", "mass", "normal_load")


class Measurement(Question):
    """A measurement of a recording.

    Attributes
    ----------
    modulated : bool, optional
        Whether the load is modulated. By default it is not if it is constant or if steps or holds
        are given; velocity steps and holds are then measured.
    load, force : str
        Channels, by name or role.
    frequency : float or str, optional
        Frequency near which the modulation is searched, like "120 Hz", and which is fitted; by
        default the whole spectrum is searched.
    exact_frequency : bool
        Take the frequency as it is, not fitted.
    harmonics : int
        Number of harmonics that are fitted.
    window : (float, float), optional
        Seconds to read, like 10:60; by default chosen by the program.
    whole_periods : bool
        Cut the window to whole periods.
    detrend : {"none", "linear", "quadratic"}
        Drift that is fitted together with the harmonics.
    steps : tuple of float, optional
        Times (s) of the velocity steps of a recording without modulation.
    velocities : tuple of float, optional
        Velocities between the steps (m/s), like "1 um/s,10 um/s", 0 in a hold; measured by default.
    holds : tuple of (float, float), optional
        Begin and end (s) of its holds.
    stick_slip : bool, optional
        Whether slip events are measured; by default if there are some and no modulation.
    stiffness, velocity, mass, normal_load : float or str, optional
        K (N/m), V (m/s), M (kg) and W0 (N) of the machine, for slip events.
    """

    subject = "measure"
    prefix = "measure."

    modulated: StrictBool | None = None
    load: str = "W"
    force: str = "F"
    frequency: quantity("frequency", "positive") | None = None  # type: ignore[valid-type]
    exact_frequency: StrictBool = False
    harmonics: Annotated[StrictInt, Field(ge=1, le=64), WHOLE] = 4
    window: Span | None = None
    whole_periods: StrictBool = False
    detrend: Literal["none", "linear", "quadratic"] = "linear"
    steps: Times | None = None
    velocities: Velocities | None = None
    holds: Annotated[tuple[Span, ...], AfterValidator(_closed)] | None = None
    stick_slip: StrictBool | None = None
    stiffness: quantity("stiffness", "positive") | None = None  # type: ignore[valid-type]
    velocity: quantity("velocity", "positive") | None = None  # type: ignore[valid-type]
    mass: quantity("mass", "positive") | None = None  # type: ignore[valid-type]
    normal_load: quantity("force", "positive") | None = None  # type: ignore[valid-type]

    @model_validator(mode="before")
    @classmethod
    def _without_modulation(cls, fields: Any) -> Any:
        """Set `modulated` to False if steps or holds are given."""
        given = isinstance(fields, Mapping) and (fields.get("steps") or fields.get("holds"))
        if given and fields.get("modulated") is None:
            return {**fields, "modulated": False}
        return fields

    @model_validator(mode="after")
    def _consistent(self) -> Measurement:
        frequency = Argument("measure.frequency")
        given = self.frequency is not None or not self.exact_frequency
        rule, advice = f"go with {frequency}", "give the frequency or leave it out"
        require(given, "measure.exact_frequency", rule, "none", advice)
        steady = not self.modulated or not (self.steps or self.holds)
        rule = f"go with {Argument('modulated', value='False')}"
        got, advice = "them of a modulated recording", "leave one of them out"
        require(steady, "measure.steps and holds", rule, got, advice)
        inside = [
            f"{step:g} s in {start:g} to {end:g} s"
            for start, end in self.holds or ()
            for step in self.steps or ()
            if start < step < end
        ]
        rule = f"lie outside {Argument('measure.holds')}"
        require(not inside, "measure.steps", rule, ", ".join(inside), advice)
        if self.velocities is not None:
            got = f"{len(self.velocities)} for {len(self.steps or ())}"
            rule, counted = "be one more than the steps", len(self.steps or ()) + 1
            given = self.steps is not None and len(self.velocities) == counted
            require(given, "measure.velocities", rule, got, "give both")
            steps = self.steps or ()
            rule, got = "rise where velocities are given", ", ".join(f"{t:g}" for t in steps)
            require(steps == tuple(sorted(steps)), "measure.steps", rule, got, "sort both")
            rule, got = f"go without {Argument('measure.holds')}", "both"
            advice = "write 0 as the velocity of a hold"
            require(self.holds is None, "measure.velocities", rule, got, advice)
        # Steps or holds imply that there is no modulation.
        named = next((n for n in ("steps", "holds") if getattr(self, n)), "modulated")
        kind = Argument(f"measure.{named}")
        alone = self.modulated is None or not self.stick_slip
        require(alone, "measure.stick_slip", f"go without {kind}", "both", "leave one out")
        if self.modulated is False or self.stick_slip:
            if named == "modulated":
                kind = Argument("modulated", value="False")
            for name in OF_MODULATION[: None if self.stick_slip else -1]:
                got, field = getattr(self, name), type(self).model_fields[name]
                other = Argument("measure.stick_slip") if self.stick_slip else kind
                rule = f"go without {other}"
                require(got == field.default, f"measure.{name}", rule, shown(got), "leave one out")
        return self
