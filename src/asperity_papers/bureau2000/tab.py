"""The paper's figures on the browser page, where its numbers can be moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from asperity import InputError
from asperity.ledger import TabFigure, altered
from asperity.materials import Material
from asperity_papers.bureau2000.curves import WORDS, FigureCurve, solve_curves, variations
from asperity_papers.bureau2000.figures import CURVES
from asperity_papers.bureau2000.machine import EXT, PAPER, STRONGEST, Machine
from asperity_papers.bureau2000.motion import one_period

#: Intervals of a curve that follows a slider, and instants of a period.
_STEPS, _INSTANTS = 25, 128
#: The figure without curves: the element of the elasto-plastic law, here with its motion.
ELEMENT = "figure-10"


# --- Lines of a figure ---------------------------------------------------------------------------


def _lines(figure: str, numbers: Material) -> list[dict[str, Any]]:
    """Lines of a figure; those with inertia take seconds, and bands are many lines."""
    machine = Machine(numbers, _STEPS)
    ends = tuple(f", {end}" for end in variations(machine))
    curves = [c for c in CURVES[figure](machine) if not (c.inertia or c.name.endswith(ends))]
    return [_line(figure, machine, curve) for curve in curves]


def _inertial_line(figure: str, numbers: Material, name: str, progress: Any) -> dict[str, Any]:
    """A line with the mass of the slider, which takes seconds."""
    machine = Machine(numbers, _STEPS)
    (curve,) = (c for c in CURVES[figure](machine) if c.inertia and c.name == name)
    return _line(figure, machine, curve, progress=progress)


def _line(figure: str, machine: Machine, curve: FigureCurve, **options: Any) -> dict[str, Any]:
    largest = float(curve.share * np.max(curve.applied))
    if not largest < 1:
        got = f"{largest:.3g} for '{curve.name}'"
        advice = "the slider's mass and the contacts resonate: change M, lambda_z or the frequency"
        raise InputError("the amplitude on the contacts", "be below 1", got, advice)
    rows = solve_curves(machine, [curve], **options)
    columns = (FIGURES[figure].x, *FIGURES[figure].rows)
    failed = rows["result"][~rows["converged"].astype(bool)]
    return {
        "name": curve.name.replace("um", "µm").replace("inertia", "with its mass"),
        "values": {name: rows[name].to_numpy(float) for name in columns},
        "lost": f"{len(failed)} of {len(rows)} points: {failed.iloc[0]}" if len(failed) else "",
    }


# --- What the text states, and the element of figure 10 ------------------------------------------


def _marks(figure: str, numbers: Material) -> Mapping[str, Sequence[dict[str, Any]]]:
    """Statements of the text at one amplitude, by observable; an interval has two ends."""
    machine = Machine(numbers, _STEPS)
    seen = machine.stated()
    at = machine.strongest if FIGURES[figure].x == "epsilon_eff" else STRONGEST
    return {
        "delta_mu": [
            {"x": at, "ends": [drop], "text": f"stated: 20 % of the friction coefficient at {V}"}
            for drop, V in zip(seen["drop"], ("1 µm/s", "10 µm/s"), strict=True)
        ],
        "mu1": [{"x": at, "ends": list(seen["mu1"]), "text": "stated: of order 10⁻³"}],
        "mu2": [{"x": at, "ends": list(seen["mu2"]), "text": "stated: 0.1 to 0.2 of μ₁"}],
    }


def _element_lines(numbers: Material) -> list[dict[str, Any]]:
    """Motion of the element over a period: stretch of the asperities, and rates over V."""
    machine, lines = Machine(numbers, _STEPS), []
    for name, V in zip(("1 µm/s", "10 µm/s"), machine.velocities, strict=True):
        period = one_period(machine, EXT, V, machine.strongest, samples=_INSTANTS)
        stretch = 1e9 * machine.numbers["lambda"].si * period["force"] / period["load"]
        columns = {
            "phase": period["phase"], "stretch": stretch, "slider_velocity": period["velocity"],
            "plastic_velocity": period["plastic_velocity"],
        }  # fmt: skip
        lines.append({"name": name, "values": {n: x.to_numpy() for n, x in columns.items()}})
    return lines


def _element_numbers(numbers: Material) -> Mapping[str, Any]:
    """Stiffnesses and frequencies of the element, in SI."""
    asperities = numbers.W0 / numbers["lambda"].si
    return {
        "element": {
            "asperities": asperities,
            "spring": numbers.K,
            "ratio": numbers.K / asperities,
            "resonance": Machine(numbers).contact_resonance,
        }
    }


# --- The same in Python --------------------------------------------------------------------------

_PYTHON = """\
from asperity.ledger import altered
{imports}
from asperity_papers.bureau2000.machine import PAPER, Machine

machine = Machine(altered(PAPER.numbers, {changes!r}))
print({call})
"""


def _python(figure: str, changes: Mapping[str, float]) -> str:
    return _PYTHON.format(
        imports="from asperity_papers.bureau2000.figures import NUMBERS",
        changes=dict(changes),
        call=f'NUMBERS["{figure}"](machine).data',
    )


def _element_python(changes: Mapping[str, float]) -> str:
    epsilon = Machine(altered(PAPER.numbers, changes)).strongest
    return _PYTHON.format(
        imports="from asperity_papers.bureau2000.motion import one_period",
        changes=dict(changes),
        call=f'one_period(machine, "{EXT}", V=1e-6, epsilon={epsilon})',
    )


def _figure(name: str) -> TabFigure:
    observables = WORDS.figures[name].observables
    x, rows = next(iter(observables.values()))[1].x, list(observables)
    return TabFigure(
        x=x,
        rows=rows,
        lines=partial(_lines, name),
        python=partial(_python, name),
        logarithmic=("V", *(rows if name == "figure-08" else ())),
        # Those of figure 3 are slopes.
        marks=(lambda _: {}) if x == "V" else partial(_marks, name),
        slow=tuple(curve.name for curve in CURVES[name](Machine()) if curve.inertia),
        slow_line=partial(_inertial_line, name),
    )


#: The figures that the page can move.
FIGURES: dict[str, TabFigure] = {name: _figure(name) for name in CURVES}
FIGURES[ELEMENT] = TabFigure(
    x="phase",
    rows=("stretch", "slider_velocity", "plastic_velocity"),
    lines=_element_lines,
    python=_element_python,
    extras=_element_numbers,
)
