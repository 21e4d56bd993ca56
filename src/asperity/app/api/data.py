"""Data: recordings that the page sends, read and measured; fits; the virtual tribometer."""

from __future__ import annotations

import json
import math
import shlex
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from asperity.app.api.catalogue import known_materials
from asperity.app.api.operating_point import Name
from asperity.app.api.recordings import LARGEST_TABLE, Options, Source, Text, named
from asperity.app.endpoints import Answer, Job, Question, Upload
from asperity.app.uploads import LARGEST, Uploads
from asperity.errors import InputError, closest
from asperity.recording.roles import ROLES

#: Address space (bytes) and processor time (s) of a process that reads a recording.
_LIMITS = {"memory": 6 * 1024**3, "seconds": 240}


class Recording(Question):
    """A file that was sent, and how to read and to measure it."""

    recording: Name
    source: Source = Field(default_factory=lambda: Source.model_validate({}))
    options: Options = Field(default_factory=lambda: Options.model_validate({}))


class ProtocolText(Question):
    """A protocol as TOML."""

    text: Annotated[str, Field(max_length=50_000)]


class Table(Question):
    """A lock-in table as text."""

    name: Text
    text: Annotated[str, Field(max_length=LARGEST_TABLE)]


Cell = str | float | int | None


class Fitted(Question):
    """Data and laws of a fit, as the options of ``asperity fit`` and ``asperity compare``.

    Attributes
    ----------
    laws : list of str
        One is fitted, several are compared.
    tables : list of Table
    rows : list of dict
        What measuring has given, see `asperity.measurement.campaign`.
    """

    laws: Annotated[list[Name], Field(min_length=1, max_length=20)]
    free: Annotated[list[Name], Field(max_length=20)]
    tables: Annotated[list[Table], Field(max_length=10, default_factory=list)]
    rows: Annotated[
        list[Annotated[dict[Name, Cell], Field(max_length=200)]],
        Field(max_length=1000, default_factory=list),
    ]
    fixed: Annotated[dict[Name, Name], Field(max_length=30, default_factory=dict)]
    start: Annotated[dict[Name, Name], Field(max_length=30, default_factory=dict)]
    material: Name | None = None
    prior: Name | None = None
    profile: bool = False
    inertia: bool = False
    radiation_damping: bool = False


class Nothing(Question):
    """A request without fields."""


def overview(asked: Nothing) -> dict[str, Any]:
    """Roles of channels, protocols to begin with, and the largest file."""
    folder = Path(__file__).parents[1] / "protocols"
    return {
        "roles": {role: sorted(spec.kinds) for role, spec in ROLES.items()},
        "largest": LARGEST,
        "protocols": {
            path.stem: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.toml"))
        },
    }


# --- Recordings ----------------------------------------------------------------------------------


def _file(asked: Recording, uploads: Uploads) -> dict[str, Any]:
    upload = uploads.get(asked.recording)
    return {**asked.model_dump(), "path": str(upload.path), "name": upload.name}


# --- Fits ----------------------------------------------------------------------------------------


def _check_fit(asked: Fitted) -> None:
    from asperity.laws import get_law, registered

    for law in asked.laws:
        get_law(law) if law in registered() else _refuse_law(law, registered())
    for field in ("material", "prior"):
        chosen = getattr(asked, field)
        if chosen is not None and chosen not in known_materials():
            raise InputError(
                f"{field} must be one of the package's, got '{chosen}'; "
                f"{closest(chosen, known_materials())}"
            )
    if not asked.tables and not asked.rows:
        raise InputError(
            "data must hold readings, got none; measure a modulated recording or drop a table"
        )


def _refuse_law(law: str, known: Mapping[str, Any]) -> None:
    raise InputError(f"law must be a registered one, got '{law}'; {closest(law, known)}")


def fit(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Fit a law, or compare several; the number of minimisations is reported."""
    from asperity import inference
    from asperity.inference.record import comparison_record, fit_record
    from asperity.measurement.campaign import write_csv

    asked = Fitted.model_validate(argument)
    done = 0

    def on_progress(count: int) -> None:
        nonlocal done
        done += count
        report(minimisations=done)

    materials = known_materials()
    options: dict[str, Any] = {
        "fixed": asked.fixed,
        "start": asked.start,
        "material": materials.get(asked.material or ""),
        "prior": materials.get(asked.prior or ""),
        "profile": asked.profile,
        "inertia": asked.inertia,
        "radiation_damping": asked.radiation_damping,
        "progress": on_progress,
    }
    given: dict[str, Any] = {
        n: asked.fixed[n] for n in ("V", "epsilon", "frequency") if n in asked.fixed
    }
    report(minimisations=0)
    with tempfile.TemporaryDirectory(prefix="asperity-page-") as folder:
        names: dict[Path, str] = {}
        for k, table in enumerate(asked.tables):
            is_json = table.text.lstrip().startswith("{")
            path = Path(folder) / f"table-{k}.{'json' if is_json else 'csv'}"
            path.write_text(table.text, encoding="utf-8")
            names[path] = table.name
        if asked.rows:
            path = Path(folder) / "measured-rows.csv"
            write_csv(path, [_row(row) for row in asked.rows])
            names[path] = "the measured rows"
        tables = []
        for path, name in names.items():
            with named(path, name):
                tables.append(inference.read_table(path, given))
    if len(asked.laws) == 1:
        found = inference.fit(tables, asked.laws[0], asked.free, **options)
        record: dict[str, Any] = {"fit": fit_record(found), "residuals": _residuals(found)}
    else:
        compared = inference.compare(tables, asked.laws, asked.free, **options)
        best = compared.laws.get(compared.best)
        record = {
            "comparison": comparison_record(compared),
            "residuals": None if best is None else _residuals(best.fit),
        }
    text = json.dumps(record)
    for path, name in names.items():
        text = text.replace(path.name, json.dumps(name)[1:-1])
    return {**json.loads(text), "command": _fit_command(asked)}


def _row(row: Mapping[str, Cell]) -> dict[str, Any]:
    return {name: math.nan if value is None else value for name, value in row.items()}


def _residuals(found: Any) -> dict[str, list[Any]]:
    """Whitened residuals with the observable of each."""
    values = [x for r in found.residuals for x in r.values.tolist()]
    names = [str(n) for r in found.residuals for n in r.observable]
    return {"value": values, "observable": names}


def _fit_command(asked: Fitted) -> str:
    """The command; measured rows are those of a table that ``asperity measure`` writes."""
    files = [t.name for t in asked.tables] + ["campaign.csv"] * bool(asked.rows)
    one = len(asked.laws) == 1
    parts = [f"asperity {'fit' if one else 'compare'}", *map(shlex.quote, files)]
    parts.append(f"--law {asked.laws[0]}" if one else f"--laws {','.join(asked.laws)}")
    parts.append(f"--free {','.join(asked.free)}")
    parts += [f"--fix {shlex.quote(f'{n}={v}')}" for n, v in asked.fixed.items()]
    parts += [f"--start {shlex.quote(f'{n}={v}')}" for n, v in asked.start.items()]
    for option in ("material", "prior"):
        if getattr(asked, option):
            parts.append(f"--{option} {getattr(asked, option)}")
    switches = ("profile", "inertia", "radiation_damping")
    parts += [f"--{s.replace('_', '-')}" for s in switches if getattr(asked, s)]
    return " ".join(parts)


# --- The virtual tribometer ----------------------------------------------------------------------


def check_protocol(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Mistakes of a protocol with their lines, or what it comes to."""
    from asperity.app.api.protocols import checked

    report()
    protocol, mistakes = checked(argument["text"])
    if protocol is None:
        return {"mistakes": mistakes}
    return {
        "mistakes": [],
        "duration": protocol.programme.duration,
        "rows": protocol.rows,
        "steps": len(protocol.lines),
        "records": protocol.setup is not None,
    }


def _place_for_run(asked: ProtocolText, uploads: Uploads) -> dict[str, Any]:
    upload = uploads.begin("virtual recording.csv")
    return {"text": asked.text, "path": str(upload.path), "id": upload.key, "name": upload.name}


def run_protocol(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Run a protocol and record it; the recording becomes a file as if it had been sent."""
    from asperity.app.api.protocols import run

    found = run(argument["text"], Path(argument["path"]), report)
    return {**found, "id": argument["id"], "name": argument["name"]}


ENDPOINTS = (
    Answer("data", Nothing, overview),
    Upload("data/upload", LARGEST),
    Job(
        "data/measure", Recording, "asperity.app.api.recordings:measure", lane="recordings",
        limits=_LIMITS, seconds=400, argument=_file,
    ),
    Job(
        "data/fit", Fitted, "asperity.app.api.data:fit", lane="fits", check=_check_fit,
        seconds=1800, largest=4 * 1024**2,
    ),
    Job(
        "data/protocol", ProtocolText, "asperity.app.api.data:check_protocol", lane="protocols",
        seconds=90,
    ),
    Job(
        "data/run", ProtocolText, "asperity.app.api.data:run_protocol", lane="runs", seconds=600,
        argument=_place_for_run,
    ),
)  # fmt: skip
