"""Lines of the paper's figures with the numbers in force, and what the text states beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from keyword import iskeyword
from typing import Any

import numpy as np

from asperity.app.api.paper.numbers import ELEMENT, INSTANTS, LABELS, STEPS
from asperity.errors import InputError
from asperity.orbit import (
    Outcome,
    ResponseFunction,
    over_a_period,
    periodic_response,
    response_function,
)
from asperity.papers.bureau2000.numbers import (
    CURVES,
    FigureCurve,
    paper,
    printed,
    replaced_numbers,
    solve_curves,
    stated,
)
from asperity.papers.bureau2000.numbers.bands import variations
from asperity.papers.bureau2000.numbers.machine import EXT, slider, velocities, velocity_text
from asperity.papers.bureau2000.numbers.resonance import contact_resonance
from asperity.parameters import law_parameters


@cache
def printed_curves(name: str) -> list[dict[str, Any]]:
    """`lines_of` a figure as printed."""
    with replaced_numbers(printed(), STEPS):
        return lines_of(name)


def _followed(curve: FigureCurve) -> bool:
    """Whether a line follows the slider: inertia takes seconds, and bands are many lines."""
    ends = tuple(f", {end}" for end in variations())
    return not curve.inertia and not curve.name.endswith(ends)


def lines_of(name: str) -> list[dict[str, Any]]:
    """Lines of a figure at the numbers in force."""
    if name == ELEMENT:
        return [_element_period(V) for V in velocities()]
    curves = [curve for curve in CURVES[name]() if _followed(curve)]
    columns = _columns(name)
    found = [_fast_curve(curve) for curve in curves]
    for curve, values in zip(curves, found, strict=True):
        _fill_in(curve, values)
    return [
        {"name": curve.name.replace("um", "µm"), "values": {c: values[c] for c in columns}}
        for curve, values in zip(curves, found, strict=True)
    ]


def _columns(name: str) -> tuple[str, ...]:
    axes = layout(name)
    return (axes["x"]["column"], *(row["column"] for row in axes["rows"]))


def _element_period(V: float) -> dict[str, Any]:
    """What the element does over a period: stretch of the asperities, and rates over V."""
    response = periodic_response(
        slider(EXT), velocity=V, epsilon=stated().epsilon_eff, frequency=paper().frequency,
        waveform=INSTANTS,
    )  # fmt: skip
    period = over_a_period(response)
    stretch = 1e9 * paper()["lambda"].si * period.force / period.load
    values = {
        "phase": period.phase, "stretch": stretch, "slider_velocity": period.velocity,
        "plastic_velocity": period.plastic_velocity,
    }  # fmt: skip
    return {"name": velocity_text(V).replace("um", "µm"), "values": values}


def inertial_curves(name: str) -> list[FigureCurve]:
    """Curves with the mass of the slider, which take seconds."""
    return [curve for curve in CURVES[name]() if curve.inertia]


_inertial_as_printed: dict[tuple[str, str], dict[str, Any]] = {}


def printed_inertial_curve(
    figure: str, name: str, progress: Callable[[int, int], None]
) -> dict[str, Any]:
    """`inertial_curve` as printed; a worker computes it once."""
    key = figure, name
    if key not in _inertial_as_printed:
        with replaced_numbers(printed(), STEPS):
            _inertial_as_printed[key] = inertial_curve(figure, name, progress)
    return _inertial_as_printed[key]


def inertial_curve(figure: str, name: str, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Points of a curve with the mass of the slider, at the numbers in force."""
    curve = next(c for c in inertial_curves(figure) if c.name == name)
    _check_share(curve)
    rows = solve_curves([curve], progress=progress)
    return {
        "name": name.replace("um", "µm").replace("inertia", "with its mass"),
        "values": {c: rows[c].to_numpy(float) for c in _columns(figure)},
    }


def element_numbers() -> dict[str, float]:
    """Stiffnesses and frequencies of the element at the numbers in force, in SI."""
    own = paper()
    asperities = own.W0 / own["lambda"].si
    return {
        "asperities": asperities,
        "spring": own.K,
        "ratio": own.K / asperities,
        "resonance": contact_resonance(),
    }


def _fast_curve(curve: FigureCurve) -> dict[str, Any]:
    """Points of a line; NaN where the method that takes milliseconds finds none."""
    _check_share(curve)
    chosen = slider(curve.law, **curve.overrides)
    given = (
        curve.V,
        curve.applied,
        paper().frequency if curve.frequency is None else curve.frequency,
    )
    V, applied, frequency = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(x, float)) for x in given)
    )
    function = _function(curve.law)
    own = law_parameters(type(chosen.law))
    values = {
        **{name: getattr(chosen.law, _attribute(name)) for name in own},
        "K": chosen.K, "W0": chosen.W0, "M": chosen.M, "V": V, "frequency": frequency,
        "epsilon": curve.share * applied,
    }  # fmt: skip
    columns = {
        n: np.array(np.broadcast_to(np.asarray(values[n], float), V.shape))
        for n in function.parameters
    }
    response = function(columns)
    mean = np.asarray(response.mean_friction)
    first, second = np.abs(np.asarray(response.harmonics)).T
    solved = np.asarray(response.outcome) == Outcome.CONVERGED
    return {
        "V": V,
        "epsilon_applied": applied,
        "epsilon_eff": curve.share * applied,
        **{
            column: np.where(solved, quantity, np.nan)
            for column, quantity in (
                ("mean_friction", mean),
                ("delta_mu", mean - np.asarray(chosen.law.mu_ss(V))),
                ("mu1", first),
                ("mu2", second),
            )
        },
    }


def _attribute(name: str) -> str:
    return f"{name}_" if iskeyword(name) else name


def _fill_in(curve: FigureCurve, values: dict[str, Any]) -> None:
    """Solve for the points that the fast method leaves open."""
    left = np.isnan(values["mean_friction"])
    if not left.any():
        return
    part = replace(curve, V=values["V"][left], applied=values["epsilon_applied"][left])
    rows = solve_curves([part], methods=("fourier",))
    for column in ("mean_friction", "delta_mu", "mu1", "mu2"):
        values[column][left] = rows[column].to_numpy(float)


@cache
def _function(law: str) -> ResponseFunction:
    return response_function(law, harmonics=2, multipliers=False, search=False)


def _check_share(curve: FigureCurve) -> None:
    largest = float(curve.share * np.max(curve.applied))
    if not largest < 1:
        raise InputError(
            f"the amplitude on the contacts must be below 1, got {largest:.3g} for '{curve.name}'; "
            "the slider's mass and the contacts resonate: change M, lambda_z or the frequency"
        )


def layout(name: str) -> dict[str, Any]:
    """Axes of a figure: an abscissa and a row for each observable."""
    from asperity.papers.bureau2000.figures.observables import OBSERVABLES

    if name == ELEMENT:
        rows = ("stretch", "slider_velocity", "plastic_velocity")
        return {
            "x": {"column": "phase", "label": LABELS["phase"], "log": False},
            "rows": [{"column": c, "label": LABELS[c], "log": False} for c in rows],
        }
    observables = OBSERVABLES[name]
    x = observables[0].x
    return {
        "x": {"column": x, "label": LABELS[x], "log": x == "V"},
        "rows": [
            {"column": o.column, "label": LABELS[o.column], "log": name == "figure-08"}
            for o in observables
        ],
    }


def stated_marks(name: str) -> dict[str, list[dict[str, Any]]]:
    """What the text states at one amplitude, by observable; an interval has two ends."""
    seen = stated()
    if name in ("figure-03", ELEMENT):
        return {}
    borne = name in ("figure-08", "figure-09", "figure-11")
    at = seen.epsilon_eff if borne else seen.epsilon
    slow, fast = seen.drops
    marks: dict[str, list[dict[str, Any]]] = {
        "delta_mu": [
            {"x": at, "ends": [drop], "text": f"stated: 20 % of the friction coefficient at {V}"}
            for drop, V in ((slow, "1 µm/s"), (fast, "10 µm/s"))
        ],
        "mu1": [{"x": at, "ends": list(seen.mu1), "text": "stated: of order 10⁻³"}],
        "mu2": [{"x": at, "ends": list(seen.mu2), "text": "stated: 0.1 to 0.2 of μ₁"}],
    }
    return marks
