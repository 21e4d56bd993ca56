"""Data: recordings that the page sends; fits, in `fits`; the virtual tribometer, in `protocols`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from asperity.app.api import fits
from asperity.app.api.recordings import LIMITS, Source
from asperity.app.endpoints import Answer, Job, Question, Upload
from asperity.app.uploads import LARGEST, Uploads
from asperity.parameters import NAMES, Names
from asperity.questions.recording import Measurement
from asperity.recording.roles import ROLES


class Recording(Question):
    """A file that was sent, how to read and to measure it, and the names in its sentences."""

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
    """Roles of channels, example protocols, and the largest size of a file."""
    folder = Path(__file__).parents[1] / "protocols"
    return {
        "roles": {role: sorted(spec.kinds) for role, spec in ROLES.items()},
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
