"""The paper's figures on the browser page, where its numbers can be moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from keyword import iskeyword
from typing import Any

import numpy as np

from asperity import InputError, response_function
from asperity.ledger import TabFigure, altered
from asperity.materials import Material
from asperity.orbit import Outcome
from asperity.parameters import law_parameters
from asperity_papers.bureau2000.curves import (
    WORDS,
    FigureCurve,
    operating_points,
    solve_curves,
    variations,
)
from asperity_papers.bureau2000.figures import CURVES
from asperity_papers.bureau2000.machine import EXT, STRONGEST, Machine, printed
from asperity_papers.bureau2000.motion import one_period

#: Intervals of a curve that follows a slider, and instants of a period.
_STEPS, _INSTANTS = 25, 128
#: The figure without curves: the element of the elasto-plastic law, here with its motion.
ELEMENT = "figure-10"
_SOLVED = ("mean_friction", "delta_mu", "mu1", "mu2")


def _machine(numbers: Material) -> Machine:
    return Machine(numbers, _STEPS)


# --- Lines that take milliseconds ----------------------------------------------------------------


def _lines(figure: str, numbers: Material) -> list[dict[str, Any]]:
    """Lines of a figure; those with inertia take seconds, and bands are many lines."""
    machine = _machine(numbers)
    ends = tuple(f", {end}" for end in variations(machine))
    curves = [c for c in CURVES[figure](machine) if not (c.inertia or c.name.endswith(ends))]
    lines = [(curve.name.replace("um", "µm"), _fast_curve(machine, curve)) for curve in curves]
    return [{"name": n, "values": {c: v[c] for c in _columns(figure)}} for n, v in lines]


def _columns(figure: str) -> tuple[str, ...]:
    return (FIGURES[figure].x, *FIGURES[figure].rows)


def _fast_curve(machine: Machine, curve: FigureCurve) -> dict[str, Any]:
    """Points of a line, most of them by the method that takes milliseconds."""
    _check_share(curve)
    slider, V, applied, frequency = operating_points(machine, curve)
    function, law = _function(curve.law), slider.law
    values = {
        **{n: getattr(law, f"{n}_" if iskeyword(n) else n) for n in law_parameters(type(law))},
        "K": slider.K, "W0": slider.W0, "M": slider.M, "V": V, "frequency": frequency,
        "epsilon": curve.share * applied,
    }  # fmt: skip
    response = function({n: values[n] for n in function.parameters})
    mean = np.asarray(response.mean_friction)
    first, second = np.abs(np.asarray(response.harmonics)).T
    solved = np.asarray(response.outcome) == Outcome.CONVERGED
    columns = (mean, mean - np.asarray(law.mu_ss(V)), first, second)
    solution = dict(zip(_SOLVED, map(np.array, columns), strict=True))
    if not solved.all():
        part = replace(curve, V=V[~solved], applied=applied[~solved])
        rows = solve_curves(machine, [part], methods=("fourier",))
        for column, x in solution.items():
            x[~solved] = rows[column].to_numpy(float)
    return {
        "V": V, "epsilon_applied": applied, "epsilon_eff": curve.share * applied, **solution
    }  # fmt: skip


_function = cache(partial(response_function, harmonics=2, multipliers=False, search=False))


def _check_share(curve: FigureCurve) -> None:
    largest = float(curve.share * np.max(curve.applied))
    if not largest < 1:
        got = f"{largest:.3g} for '{curve.name}'"
        advice = "the slider's mass and the contacts resonate: change M, lambda_z or the frequency"
        raise InputError("the amplitude on the contacts", "be below 1", got, advice)


# --- Lines with the mass of the slider, which take seconds ----------------------------------------


def _inertial_curves(figure: str, machine: Machine) -> dict[str, FigureCurve]:
    return {curve.name: curve for curve in CURVES[figure](machine) if curve.inertia}


def _inertial_line(figure: str, numbers: Material, name: str, progress: Any) -> dict[str, Any]:
    machine = _machine(numbers)
    curve = _inertial_curves(figure, machine)[name]
    _check_share(curve)
    rows = solve_curves(machine, [curve], progress=progress)
    return {
        "name": name.replace("um", "µm").replace("inertia", "with its mass"),
        "values": {c: rows[c].to_numpy(float) for c in _columns(figure)},
    }


# --- What the text states, and the element of figure 10 ------------------------------------------


def _marks(figure: str, numbers: Material) -> Mapping[str, Sequence[dict[str, Any]]]:
    """Statements of the text at one amplitude, by observable; an interval has two ends."""
    machine = _machine(numbers)
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
    machine, lines = _machine(numbers), []
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
from asperity_papers.bureau2000.machine import Machine, printed

machine = Machine(altered(printed(), {changes!r}))
print({call})
"""


def _python(figure: str, changes: Mapping[str, float]) -> str:
    return _PYTHON.format(
        imports="from asperity_papers.bureau2000.figures import NUMBERS",
        changes=dict(changes),
        call=f'NUMBERS["{figure}"](machine).data',
    )


def _element_python(changes: Mapping[str, float]) -> str:
    epsilon = Machine(altered(printed(), changes)).strongest
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
        slow=tuple(_inertial_curves(name, Machine())),
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
