"""Data of ``asperity fit``: tables of readings and recordings, distinguished by their content."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.measure.command import span_of, times_of
from asperity.cli.measure.source import RecordingSource
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.inference import HealingTable, LockInTable, Prior, RecordedRun, WindowedFit

_PRIOR = re.compile(r"^(?P<value>.+?)\s*(?:\+-|±|\+/-)\s*(?P<sd>[-+.\deE]+)\s*(?P<unit>.*)$")

RUN_OPTIONS = (
    click.option("--window", metavar="START:END", help="Seconds of a recording to fit."),
    click.option(
        "--steps",
        metavar="TIMES|FILE",
        help="Times (s) at which the velocity of the drive changes.",
    ),
    click.option(
        "--velocities",
        metavar="VALUES",
        help='Velocities between --steps, like "1 um/s,10 um/s"; 0 in a hold.',
    ),
    click.option(
        "--stiffness-from",
        metavar="START:END",
        help="Seconds of unloading and reloading whose slope is the prior of K; outside --window.",
    ),
    click.option(
        "--trend",
        metavar="none|linear|quadratic",
        default="linear",
        show_default=True,
        help="Trend of the friction of a recording over slip.",
    ),
    click.option("--drift", is_flag=True, help="A drift of the friction over time besides."),
    click.option(
        "--initial",
        metavar="steady|free",
        default="steady",
        show_default=True,
        help="State at the beginning of a recording.",
    ),
    click.option("--gauge", metavar="HZ", help='Low-pass of the force gauge, like "50 Hz".'),
    click.option(
        "--gauge-order", type=click.IntRange(1, 8), default=1, show_default=True, help="Its order."
    ),
    click.option(
        "--fit-rate",
        metavar="HZ|full",
        help='Means a second that stand for the samples of a recording, like "100 Hz"; by default '
        "as many as it needs where it has more than 20,000 samples.",
    ),
)


@dataclass(frozen=True)
class FitData:
    """How the data of a fit are read, from the options.

    Attributes
    ----------
    source : RecordingSource
        Columns and units of recordings.
    window, steps, velocities, stiffness_from : str or None
        As the options of these names.
    """

    source: RecordingSource
    window: str | None
    steps: str | None
    velocities: str | None
    stiffness_from: str | None = None

    def stiffness_prior(
        self, paths: Sequence[Path], options: Mapping[str, Any], windows: str | None = None
    ) -> dict[str, Prior]:
        """Priors of the options, with that of K by the slope of a span.

        Raises
        ------
        InputError
            If K has a number already, there are several files, the span is fitted too, or it gives
            no slope.
        """
        from asperity import inference

        priors: dict[str, Prior] = dict(options["prior"])
        if self.stiffness_from is None:
            return priors
        label = "--stiffness-from"
        given = "--fix" if "K" in options["fixed"] else "--prior" if "K" in priors else None
        if given is not None:
            raise InputError(f"{label} must be the only number of K, got {given} K too; drop one")
        if len(paths) != 1 or is_table(paths[0]):
            raise InputError(
                f"{label} must go with one recording, got {len(paths)} files; give one recording"
            )
        if any(name.partition("[")[0] == "gain" for name in priors):
            raise InputError(
                f"{label} must be without a prior of gain, got both: the slope is measured by the "
                "same gauge, and scales with it; give the prior of K from another source"
            )
        low, high = span_of(self.stiffness_from, label)
        texts = [self.window] if windows is None else windows.split(",")
        for text in texts:
            whole = text is None or text.strip() == "auto"
            begin, end = (-math.inf, math.inf) if whole else span_of(str(text), "window")
            if low < end and begin < high:
                raise InputError(
                    f"{label} must lie outside what is fitted, got {low:g} to {high:g} s in "
                    f"{'the whole recording' if whole else f'{begin:g} to {end:g} s'}; give a "
                    "window without it: its samples would count twice"
                )
        result = inference.measured_stiffness(self.source.read(paths[0]), (low, high))
        return {**priors, "K": result.prior}

    def read(
        self, paths: Sequence[Path], fixed: Mapping[str, str]
    ) -> list[LockInTable | HealingTable | RecordedRun]:
        """Tables and recordings from files.

        Raises
        ------
        InputError
            If a file cannot be read, or options for one recording meet several.
        """
        from asperity import inference

        tables = [is_table(path) for path in paths]
        one_only = [n for n in ("steps", "velocities") if getattr(self, n) is not None]
        if one_only and tables.count(False) != 1:
            raise InputError(
                f"--{one_only[0]} must go with one recording, got {tables.count(False)}; cut the "
                "recordings beforehand"
            )
        at = {n: fixed[n] for n in ("V", "epsilon", "frequency") if n in fixed}
        held = {n: fixed[n] for n in ("V", "K", "W0") if n in fixed}
        result: list[LockInTable | HealingTable | RecordedRun] = []
        for path, table in zip(paths, tables, strict=True):
            if table and has_holds(path):
                result.append(inference.read_healing(path, held))
                continue
            if table:
                result.append(inference.read_table(path, at))
                continue
            result.append(
                inference.recorded_run(
                    self.source.read(path),
                    name=path.stem,
                    window=None if self.window is None else span_of(self.window, "--window"),
                    steps=None if self.steps is None else times_of(self.steps, "--steps"),
                    velocities=None if self.velocities is None else _speeds(self.velocities),
                )
            )
        return result

    def fit_windows(
        self,
        paths: Sequence[Path],
        windows: str,
        law: Any,
        free: Sequence[str] | None,
        options: Any,
    ) -> WindowedFit:
        """Fits of a recording in several windows.

        Raises
        ------
        InputError
            If there is more than one file, it is a table, or windows are given twice.
        """
        from asperity import inference

        if len(paths) != 1 or is_table(paths[0]):
            raise InputError(
                f"--windows must go with one recording, got {len(paths)} files; give one recording"
            )
        if self.window is not None:
            raise InputError(
                f"--windows must stand alone, got --window {self.window} besides; leave it out"
            )
        reading: dict[str, Any] = {"name": paths[0].stem}
        if self.steps is not None:
            reading["steps"] = times_of(self.steps, "--steps")
        if self.velocities is not None:
            reading["velocities"] = _speeds(self.velocities)
        automatic = windows.strip() == "auto"
        spans = None if automatic else [span_of(w, "--windows") for w in windows.split(",")]
        return inference.fit_windows(
            self.source.read(paths[0]), law, free, spans, reading=reading, **options
        )


def is_table(path: Path) -> bool:
    """Whether a file holds readings rather than a recording: it has a column of an observable."""
    from asperity.inference.tables.table import OBSERVABLES
    from asperity.outputs.targets import require_rereadable

    require_rereadable(path, "data")
    if path.suffix.lower() == ".json":
        return True
    cells = _heading(path)
    # The reader of tables says what is wrong with a file that cannot be opened.
    return cells is None or has_holds(path) or any(cell in OBSERVABLES for cell in cells)


def has_holds(path: Path) -> bool:
    """Whether a table is one of slide-hold-slide tests."""
    from asperity.inference.holds.table import HEALING

    return path.suffix.lower() != ".json" and HEALING in (_heading(path) or ())


def _heading(path: Path) -> list[str] | None:
    """Words of the first line that is no comment; None where the file cannot be opened."""
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            for line in file:
                if line.strip() and not line.lstrip().startswith("#"):
                    return re.split(r"[,;\t\s]+", line.strip())
    except OSError:
        return None
    return []


def run_options(
    *,
    trend: str,
    drift: bool,
    initial: str,
    gauge: str | None,
    gauge_order: int,
    fit_rate: str | None,
) -> Any:
    """How recordings are compared with the motion, from the options."""
    from asperity.inference import RunOptions
    from asperity.units import to_si

    trends = {"none": (), "linear": ("trend",), "quadratic": ("trend", "bend")}
    if trend not in trends:
        raise InputError(f"--trend must be none, linear or quadratic, got '{trend}'; choose one")
    if initial not in ("steady", "free"):
        raise InputError(f"--initial must be steady or free, got '{initial}'; choose one")
    corner = None
    if gauge is not None:
        corner = gauge_order, to_si(gauge, "frequency", "--gauge", require_unit=True)
        if not corner[1] > 0:
            raise InputError(f"--gauge must be positive, got '{gauge}'; give its corner frequency")
    linear = ("offset", *trends[trend], *(("drift",) if drift else ()))
    return RunOptions(linear=linear, initial=initial, gauge=corner, fit_rate=fit_rate)


def priors_of(texts: Sequence[str], free: Sequence[str] | None) -> dict[str, Prior]:
    """Priors of ``--prior``: materials, and NAME=VALUE+-DEVIATION UNIT.

    Raises
    ------
    InputError
        If a text is neither, or a name is given twice.
    """
    from asperity import materials
    from asperity.inference.runs.assembly import PARAMETER
    from asperity.inference.runs.reading import GAIN
    from asperity.inference.unknowns import Prior, material_priors
    from asperity.laws import registered
    from asperity.parameters import all_parameters

    result: dict[str, Prior] = {}
    known = {**all_parameters(registered().values()), GAIN: PARAMETER}
    for text in texts:
        name, equals, rest = (part.strip() for part in text.partition("="))
        if not equals:
            if free is None:
                raise InputError(
                    f"--prior {text} must go with --free, got no free parameters; name those that "
                    "the priors of the material are meant for"
                )
            result |= material_priors(materials.load(text), free)
            continue
        match = _PRIOR.match(rest)
        if match is None:
            raise InputError(
                f"--prior must be a material or NAME=VALUE+-DEVIATION UNIT, got '{text}'; write "
                'it like --prior "K=0.2+-0.01 N/um"'
            )
        plain = name.partition("[")[0]
        if plain not in known:
            raise InputError(f"--prior must name a parameter, got '{name}'; correct the name")
        scale, si = _unit_of(known[plain], match["unit"], f"--prior {name}")
        try:
            mean, sd = (float(match[part]) * scale for part in ("value", "sd"))
        except ValueError:
            raise InputError(
                f"--prior {name} must have numbers, got '{rest}'; write it like 0.2+-0.01 N/um"
            ) from None
        if not sd > 0:
            raise InputError(f"--prior {name} must have a positive deviation, got {sd:g}; give one")
        result[name] = Prior(mean, sd, "given", si)
    return result


def _unit_of(parameter: Any, unit: str, label: str) -> tuple[float, str]:
    """SI value and SI unit of a unit; K may be of a stress or of a pure number over a length."""
    from asperity.units import KINDS, to_si

    others = ["stress_per_length", "per_length"] if parameter.name == "K" else []
    for kind in others:
        try:
            return float(to_si(f"1 {unit}", kind, label)), KINDS[kind].si
        except InputError:
            continue
    return float(to_si(f"1 {unit}", parameter.kind, label)), KINDS[parameter.kind].si


def _speeds(text: str) -> list[float]:
    from asperity.units import to_si

    return [
        0.0 if part.strip() == "0" else float(to_si(part, "velocity", "--velocities"))
        for part in text.split(",")
    ]
