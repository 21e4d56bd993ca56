"""A fit of a law to data, and a comparison of laws on the same data."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    StrictBool,
    StrictFloat,
    StrictInt,
    WrapValidator,
    model_validator,
)

from asperity.errors import Argument, InputError, require
from asperity.questions.record import (
    WHOLE,
    Given,
    Names,
    Question,
    Record,
    Span,
    Times,
    parts_of,
    quantity,
    shown,
)
from asperity.questions.recording import Source, Velocities


class Data(Record):
    """A file of data: a table of lock-in readings, or a recording.

    Attributes
    ----------
    file : Path
    name : str
        Name of the data in messages; by default that of the file.
    source : Source
        How a recording is read.
    window : (float, float), optional
        Seconds of a recording that are fitted, like 100:400.
    steps : tuple of float, optional
        Times (s) at which the velocity of the drive changes.
    velocities : tuple of float, optional
        Between the steps (m/s), 0 in a hold.
    """

    file: Path
    name: str = ""
    source: Source = Field(default_factory=Source)
    window: Span | None = None
    steps: Times | None = None
    velocities: Velocities | None = None


class NormalPrior(Record):
    """A normal prior, also as a text such as ``"0.2+-0.01 N/um"``.

    Attributes
    ----------
    mean, std : float or str
        In SI, or texts with units.
    """

    mean: StrictFloat | str
    std: StrictFloat | str

    @model_validator(mode="before")
    @classmethod
    def _of_text(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        match = _PLUS_MINUS.match(value)
        if match is None:
            rule = "be VALUE+-DEVIATION UNIT"
            raise InputError("", rule, f"'{value}'", "write it like 0.2+-0.01 N/um")
        mean, std, unit = match.groups()
        advice = "write the deviation like the value, as in 0.6+-0.03"
        require("%" not in unit, "", "be without per cent", f"'{value}'", advice)
        return {"mean": f"{mean} {unit}".strip(), "std": f"{std} {unit}".strip()}


_PLUS_MINUS = re.compile(r"^\s*(.+?)\s*(?:\+-|±|\+/-)\s*([-+.\deE]+)\s*(.*?)\s*$")


def _priors(value: Any) -> Any:
    """Priors by parameter; a material is a key whose value is None."""
    if value is None or isinstance(value, Mapping):
        return value or {}
    texts = (value,) if isinstance(value, str) else value
    if not isinstance(texts, list | tuple) or not all(isinstance(text, str) for text in texts):
        rule = "be materials or priors by name"
        raise InputError("", rule, shown(value), "write it like {K = '0.2+-0.01 N/um'}")
    parts = [text.partition("=") for text in texts]
    names = [name.strip() for name, *_ in parts]
    twice = next((name for name in names if names.count(name) > 1), None)
    require(twice is None, "", "be given once each", f"'{twice}' twice", "leave one out")
    return {name.strip(): prior.strip() if equals else None for name, equals, prior in parts}


#: Priors by the names of parameters; the name of a material, with None, stands for its published
#: uncertainties. Also texts: ``("bureau2000", "K=0.2+-0.01 N/um")``.
Priors = Annotated[dict[str, NormalPrior | None], BeforeValidator(_priors)]


class Estimation(Record):
    """The parameters that are estimated, and how.

    Attributes
    ----------
    free : tuple of str, optional
        Free parameters, also as a text like "A,B,D0"; by default all that the data may determine.
    prior : dict of str to NormalPrior
    profile : bool
        Intervals by profile likelihood.
    starts, seed : int
        Number of random starts in addition to the first one, and their seed.
    """

    free: Names | None = None
    prior: Priors = Field(default_factory=dict)
    profile: StrictBool = False
    starts: Annotated[StrictInt, Field(ge=0, le=10_000), WHOLE] = 64
    seed: Annotated[StrictInt, Field(ge=0), WHOLE] = 0


class FitOptions(Estimation):
    """How data are compared with a law.

    Attributes
    ----------
    fixed, start : dict of str to float or str
        Numbers in SI, or texts with units.
    material : str, optional
        Material whose numbers apply where no other number is given.
    inertia : bool
        Include the inertia of the slider.
    radiation_damping : bool
        Include the radiation damping eta.
    trend : {"none", "linear", "quadratic"}
        Trend of the friction of a recording over slip.
    drift : bool
        Add a linear drift of the friction over time.
    initial : {"steady", "free"}
        State at the beginning of a recording.
    gauge : float or str, optional
        Corner frequency of the low-pass of the force gauge, like "50 Hz".
    gauge_order : int
        Order of the low-pass of the force gauge.
    fit_rate : float or str, optional
        Number of means per second that replace the samples of a recording, like "100 Hz", or
        "full" for all samples; by default chosen if there are more than 20,000 samples.
    stiffness_from : (float, float), optional
        Seconds of unloading and reloading of the one recording, outside the window, whose slope is
        the prior of K.
    """

    fixed: dict[str, Given] = Field(default_factory=dict)
    start: dict[str, Given] = Field(default_factory=dict)
    material: str | None = None
    inertia: StrictBool = False
    radiation_damping: StrictBool = False
    trend: Literal["none", "linear", "quadratic"] = "linear"
    drift: StrictBool = False
    initial: Literal["steady", "free"] = "steady"
    gauge: quantity("frequency", "positive") | None = None  # type: ignore[valid-type]
    gauge_order: Annotated[StrictInt, Field(ge=1, le=8), WHOLE] = 1
    fit_rate: float | str | None = None
    stiffness_from: Span | None = None

    @model_validator(mode="after")
    def _order_of_a_gauge(self) -> FitOptions:
        # Without a corner frequency there is no low-pass.
        same = self.gauge_order == FitOptions.model_fields["gauge_order"].default
        rule = f"go with {Argument('gauge')}"
        advice = "give its corner frequency, of a recording, or leave it out"
        require(same or self.gauge is not None, "gauge_order", rule, self.gauge_order, advice)
        return self


class _OfData(Question, FitOptions):
    """Common fields of a fit and a comparison.

    Attributes
    ----------
    data : tuple of Data
        All in one likelihood.
    """

    subject = "fit"

    data: tuple[Data, ...]

    @model_validator(mode="after")
    def _some_data(self) -> _OfData:
        rule = "hold readings or a recording"
        require(self.data, "data", rule, "none", "give a table or a recording")
        return self


def _auto_or_listed(value: Any, spans: Callable[[Any], Any]) -> Any:
    return value if value == "auto" else spans(parts_of(value))


class Fit(_OfData):
    """A law fitted to data.

    Attributes
    ----------
    law : str, optional
        Registered, or a place such as ``file.py:Name``; by default that of the kind of data.
    windows : "auto" or tuple of (float, float), optional
        Several windows of the one recording, like 100:400,120:380; their spread is reported.
    """

    law: str | None = None
    windows: Annotated[tuple[Span, ...], WrapValidator(_auto_or_listed)] | None = None

    @model_validator(mode="after")
    def _one_recording(self) -> Fit:
        if self.windows is not None and (self.data[0].window is not None or len(self.data) > 1):
            several = len(self.data) > 1
            rule = "go with one recording" if several else "stand alone"
            got = f"{len(self.data)} files" if several else "a window too"
            advice = "give one recording" if several else "leave the window out"
            raise InputError("windows", rule, got, advice)
        return self


class Comparison(_OfData):
    """Laws fitted to the same data.

    Attributes
    ----------
    laws : tuple of str
        Two or more, also as a text with commas; "all" are all that depend on the velocity.
    """

    laws: Names
