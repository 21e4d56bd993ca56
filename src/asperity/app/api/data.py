"""The Data tab: uploaded recordings, and the motion of a law with numbers that the user moves.

Fits are in `fits`, the virtual tribometer in `protocols`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from asperity.app.api import fits
from asperity.app.api.recordings import LIMITS, Source
from asperity.app.endpoints import Answer, Job, Question, Upload
from asperity.app.uploads import LARGEST, Uploads
from asperity.app.words import ROLES
from asperity.arrays import Float
from asperity.errors import Argument, InputError, require
from asperity.laws import get_law
from asperity.loads import Hold, Programme, Slide
from asperity.parameters import NAMES, Names, known_name, law_parameters
from asperity.questions.recording import Measurement
from asperity.slider.parameters import slider_from
from asperity.transients import transient

#: Tolerance, and largest number of steps, of a curve that follows a slider.
_RTOL, _MOST_STEPS = 1e-5, 20_000
#: Points of the curve.
_MOST = 800

_Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]


class Driven(Question):
    """A law, its numbers, and the velocity of the drive over time.

    Attributes
    ----------
    law : str
    numbers : dict of str to float
        Numbers of the law, with K over the load (1/m) as ``K/W0``; SI.
    segments : list of (float, float)
        Durations (s) and pulling velocities (m/s), 0 in a hold; the first is steady sliding.
    """

    law: Annotated[str, Field(max_length=60)]
    numbers: Annotated[dict[str, _Number], Field(max_length=40)]
    segments: Annotated[list[tuple[_Number, _Number]], Field(min_length=1, max_length=200)]


def model(question: Driven) -> dict[str, Any]:
    """Friction F/W over time (s); ``stopped`` is the reason if the motion ends early.

    Raises
    ------
    InputError
        If a number or a segment breaks its rule.
    """
    law = get_law(question.law)
    velocity = question.segments[0][1]
    rule = "begin with sliding"
    require(velocity > 0, "segments", rule, f"{velocity:g} m/s", "cut the recording")
    numbers = dict(question.numbers)
    stiffness = numbers.pop("K/W0", None)
    if stiffness is None:
        raise InputError("numbers", "have K/W0", "none", "give the stiffness over the load in 1/m")
    for name in numbers:
        known_name(name, law_parameters(law), Argument("numbers", name))
    steps: list[Any] = [
        Slide(duration=length, velocity=v) if v > 0 else Hold(duration=length)
        for length, v in question.segments
    ]
    # Friction does not depend on the load, which is 1 N.
    slider = slider_from(law, {**numbers, "K": stiffness, "W0": 1.0})
    programme = Programme(*steps, load=1.0, velocity=velocity)
    times = _times(np.array([length for length, _ in question.segments]))
    motion = transient(slider, programme, sampling=times, rtol=_RTOL, most_steps=_MOST_STEPS)
    stopped = "" if motion.termination is None else str(motion.termination)
    return {"time": motion.time, "friction": motion.force / motion.load, "stopped": stopped}


def _times(lengths: Float) -> Float:
    """Times (s) of the curve: dense after each change."""
    points = max(_MOST // lengths.size, 8)
    share = np.append(0.0, np.geomspace(1e-4, 1.0, points))
    begins = np.append(0.0, np.cumsum(lengths)[:-1])
    times = np.unique((begins[:, None] + share * lengths[:, None]).ravel())
    return times[times <= lengths.sum()]


class Recording(Question):
    """An uploaded file, how to read and to measure it, and the names in its sentences."""

    recording: str
    source: Source = Field(default_factory=Source)
    options: Measurement = Field(default_factory=Measurement)
    names: Names = NAMES[0]


class ProtocolText(Question):
    """A protocol as TOML."""

    text: Annotated[str, Field(max_length=50_000)]


class Nothing(Question):
    """A request without fields."""


def overview(question: Nothing) -> dict[str, Any]:
    """Words for the roles of channels, example protocols, and the largest size of a file."""
    folder = Path(__file__).parents[1] / "protocols"
    return {
        "roles": ROLES,
        "largest": LARGEST,
        "protocols": {
            path.stem: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.toml"))
        },
    }


def _file(question: Recording, uploads: Uploads) -> dict[str, Any]:
    upload = uploads.get(question.recording)
    return {**question.model_dump(mode="json"), "path": str(upload.path), "name": upload.name}


def _place_for_run(question: ProtocolText, uploads: Uploads) -> dict[str, Any]:
    upload = uploads.begin("virtual recording.csv")
    return {"text": question.text, "path": str(upload.path), "id": upload.key, "name": upload.name}


ENDPOINTS = (
    Answer("data", Nothing, overview),
    Answer("data/model", Driven, model),
    Upload("data/upload", LARGEST),
    Job(
        "data/measure", Recording, "asperity.app.api.recordings:measure", lane="recordings",
        limits=LIMITS, seconds=400, argument=_file,
    ),
    Job(
        "data/fit", fits.Fitted, "asperity.app.api.fits:fit", lane="fits", check=fits.check,
        seconds=1800, largest=4 * 1024**2, argument=fits.with_files,
    ),
    Job(
        "data/protocol", ProtocolText, "asperity.app.api.protocols:check", lane="protocols",
        seconds=90,
    ),
    Job(
        "data/run", ProtocolText, "asperity.app.api.protocols:run", lane="runs", seconds=600,
        argument=_place_for_run,
    ),
)  # fmt: skip
