"""Transients, of which a sweep keeps named numbers."""

from __future__ import annotations

import hashlib
import string
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError, closest, require
from asperity.laws import Law, get_law
from asperity.loads import Follow, Programme
from asperity.parameters import (
    DRIVE,
    EXPERIMENT,
    MODULATION,
    Output,
    all_parameters,
    canonical_name,
)
from asperity.parameters.arguments import number, one_of
from asperity.protocol.steps import plan as planned_steps
from asperity.questions.sweep import NumberTable, Sweep, TransientTable
from asperity.slider.parameters import slider_from
from asperity.study.points import RATIOS, Answers, Points, SweepOutcome
from asperity.study.responses import solvable
from asperity.study.solve.kind import SolveKind
from asperity.transients import Trajectory, transient

#: Channels of a trajectory and their units.
CHANNELS = {
    "friction": "1",
    "force": "N",
    "load": "N",
    "velocity": "m/s",
    "slip_velocity": "m/s",
    "displacement": "m",
}
#: Statistics of a channel by name.
TAKEN: dict[str, Callable[[np.ndarray], float]] = {
    "mean": lambda x: float(np.mean(x)),
    "min": lambda x: float(np.min(x)),
    "max": lambda x: float(np.max(x)),
    "range": lambda x: float(np.ptp(x)),
    "std": lambda x: float(np.std(x)),
    "first": lambda x: float(x[0]),
    "last": lambda x: float(x[-1]),
}


class TransientSolve(SolveKind):
    """`asperity.transient` at every point, from steady sliding at V under W0."""

    name = "transient"
    # A load programme need not have a modulation.
    supplies = ("epsilon", "frequency")

    def settings(self, plan: Sweep) -> dict[str, Any]:
        """As in `SolveKind`."""
        table = plan.transient
        assert table is not None  # a plan has the settings of its solve
        advice = "write it like numbers.peak = { of = 'friction', take = 'max' }"
        require(table.numbers, "transient.numbers", "have at least one number", "none", advice)
        if plan.outputs is not None:
            rule = "be left out where solve is 'transient'"
            raise InputError("outputs", rule, len(plan.outputs), "transient.numbers names them")
        numbers = {name: _number(name, entry) for name, entry in table.numbers.items()}
        _require_drive_in_steps(plan, table)
        followed = _followed(_checked_steps(plan, table))
        return {
            "steps": list(table.steps),
            **({"followed": followed} if followed else {}),
            "sampling": number(table.sampling, "transient.sampling", "frequency", "positive"),
            "rtol": table.rtol,
            "most_steps": table.most_steps,
            "numbers": numbers,
        }

    def known_outputs(self, laws: Sequence[str], settings: Mapping[str, Any]) -> dict[str, Output]:
        """The numbers that the plan names."""
        return {
            name: Output(name, CHANNELS[entry["of"]], f"{entry['take']} of {entry['of']}")
            for name, entry in settings["numbers"].items()
        }

    def solve_law(self, law: type[Law], points: Points, record: Mapping[str, Any]) -> Answers:
        """As in `SolveKind`."""
        answers = Answers.empty(record["outputs"], len(points))
        values = points.of_law(law.name)
        for name, absent in (("epsilon", 0.0), ("frequency", 1.0)):  # without a modulation
            values[name] = np.where(np.isnan(values[name]), absent, values[name])
        settings = record["settings"]
        for k in solvable(law, values, answers):
            point = {n: float(v[k]) for n, v in values.items()}
            named = {n: float(v[k]) for n, v in points.values.items()} | point
            steps = _planned(settings["steps"], named, Path(record["folder"]))
            same = _followed(steps) == settings.get("followed", [])
            rule, advice = "not change while a sweep runs", "restore it, or choose another store"
            require(same, "a recording that is followed", rule, "other samples", advice)
            trajectory = transient(
                slider_from(law, point),
                Programme(*steps, load=point["W0"], velocity=point["V"]),
                sampling=settings["sampling"],
                inertia=bool(point["inertia"]),
                radiation_damping=point["eta"] if point["eta"] > 0 else None,
                rtol=settings["rtol"],
                most_steps=settings["most_steps"],
            )
            if trajectory.termination is not None:
                answers.fail(k, SweepOutcome.STOPPED, trajectory.termination.time)
                continue
            numbers = {n: _statistic(trajectory, e) for n, e in settings["numbers"].items()}
            if None in numbers.values():
                answers.fail(k, SweepOutcome.NO_SAMPLES, trajectory.time[-1])
                continue
            for name, value in numbers.items():
                answers.numbers[name][k] = value
            answers.outcome[k] = SweepOutcome.CONVERGED
        return answers


def _statistic(trajectory: Trajectory, entry: Mapping[str, Any]) -> float | None:
    """A number of a trajectory; None if no sample lies in the time interval of the entry."""
    channel = np.asarray(getattr(trajectory, entry["of"]))
    inside = np.ones(len(channel), dtype=bool)
    if entry["from"] is not None:
        inside &= trajectory.time >= entry["from"]
    if entry["to"] is not None:
        inside &= trajectory.time <= entry["to"]
    return TAKEN[entry["take"]](channel[inside]) if inside.any() else None


def _planned(lines: Iterable[str], values: Mapping[str, float], folder: Path) -> list[Any]:
    """Steps of a protocol's lines, with values in SI in place of the names in braces."""
    known = all_parameters([])
    texts = {n: f"{v!r} {known[n].unit if n in known else ''}".strip() for n, v in values.items()}
    steps, mistakes = planned_steps([line.format_map(texts) for line in lines], folder)
    if mistakes:
        raise InputError("; ".join(map(str, mistakes)))
    return [planned.step for planned in steps]


def _followed(steps: Iterable[Any]) -> list[str]:
    """SHA-256 of the samples of each recording that the steps follow."""
    followed = [(s.time, s.load, s.velocity) for s in steps if isinstance(s, Follow)]
    samples = [[np.asarray(column, float).tobytes() for column in f] for f in followed]
    return [hashlib.sha256(b"|".join(columns)).hexdigest() for columns in samples]


def _number(name: str, entry: NumberTable) -> dict[str, Any]:
    """A checked entry of ``transient.numbers`` as JSON values."""
    place = f"transient.numbers.{name}"
    one_of(entry.of, CHANNELS, f"{place}.of")
    one_of(entry.take, TAKEN, f"{place}.take")
    rule = "have a name of letters, digits and underscores"
    require(name.isidentifier(), place, rule, f"'{name}'", "rename it")
    times = {
        side: None if value is None else number(value, f"{place}.{side}", "time", "not negative")
        for side, value in (("from", entry.from_), ("to", entry.to))
    }
    first, last = times["from"] or 0.0, times["to"]
    rule, got = "have a 'from' before its 'to'", f"{first:g} s and {last or 0.0:g} s"
    require(last is None or first <= last, place, rule, got, "exchange them")
    return {"of": entry.of, "take": entry.take, **times}


def _require_drive_in_steps(plan: Sweep, table: TransientTable) -> None:
    """Refuse a modulation that no step uses: only steps move the load and the pull."""
    used = {name for line in table.steps for _, name, *_ in string.Formatter().parse(line)}
    given = {n: f"parameters.{n}" for n, value in plan.parameters.items() if value}
    given |= {name: f"axes.{name}" for name in plan.single_columns}
    drive = {n: DRIVE[n] for n in ("epsilon", "frequency")}
    ratios = {n: ratio.parameter for n, ratio in RATIOS.items() if ratio.target in drive}
    for written, place in given.items():
        name = canonical_name(written, {**drive, **ratios, **MODULATION})
        if name is not None and name in RATIOS:
            name = RATIOS[name].target
        rule, advice = "stand in a step", "write it into one, in braces, or leave it out"
        require(name is None or name in used, place, rule, f"no '{{{name}}}'", advice)


def _checked_steps(plan: Sweep, table: TransientTable) -> list[Any]:
    """The steps with a number in place of each name in braces, after a check of the names."""
    known = {**all_parameters([get_law(plan.law)] if plan.law else []), **EXPERIMENT}
    for line in table.steps:
        for _, name, *_ in string.Formatter().parse(line):
            if name is not None and name not in known:
                rule = "name parameters in braces"
                raise InputError("transient.steps", rule, f"'{{{name}}}'", closest(name, known))
    return _planned(table.steps, dict.fromkeys(known, 0.5), plan.folder)
