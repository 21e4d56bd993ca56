"""Paper: the figures of a published paper with its numbers moved, and the ledger of its claims."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, partial
from keyword import iskeyword
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from asperity.app.api.operating_point import Name, Value
from asperity.app.endpoints import Answer, Job, Question
from asperity.app.preparation import Preparation
from asperity.errors import InputError, closest
from asperity.materials import Material
from asperity.orbit import (
    Outcome,
    ResponseFunction,
    over_a_period,
    periodic_response,
    response_function,
)
from asperity.papers import find_paper
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
from asperity.papers.ledger.ledger import altered
from asperity.parameters import law_parameters, obeying
from asperity.units import KINDS, from_si

_PAPER = "bureau2000"
#: Intervals of a curve that follows a slider, and instants of a period.
_STEPS, _INSTANTS = 25, 128
#: The figure without curves: the element of the elasto-plastic law, here with its motion.
_ELEMENT = "figure-10"

_ELASTIC = ("A", "B", "D0", "lambda", "mu0", "K", "W0", "frequency", "transmission")
_RIGID = ("A", "B", "D0", "mu0", "K", "W0", "frequency")
#: Numbers that a figure rests on, in the order of its sliders.
_NUMBERS: Mapping[str, tuple[str, ...]] = {
    "figure-02": _ELASTIC,
    "figure-03": _ELASTIC,
    "figure-04": _ELASTIC,
    "figure-05": (
        *("A", "B", "D0", "lambda", "mu0", "K", "W0", "M", "frequency_vacuum", "lambda_z"),
        *("collapse_divisor_200Hz", "P0", "h0", "R"),
    ),
    "figure-06": _RIGID,
    "figure-07": _RIGID,
    "figure-08": _RIGID,
    "figure-09": ("alpha", "alpha_low", *_RIGID),
    "figure-10": ("lambda", "K", "W0", "M", "A", "B", "D0", "mu0", "frequency"),
    "figure-11": _ELASTIC[:-1],
}
#: Numbers beside them on which the curves with the slider's mass rest.
_MASS = ("figure-02", "figure-04", "figure-11")
_TITLES = {
    "figure-02": "The mean friction falls when the load is modulated",
    "figure-03": "Modulation shifts the friction–velocity curve down",
    "figure-04": "A weakly anharmonic force response",
    "figure-05": "Air bears part of the modulation",
    "figure-06": "Rice–Ruina, before the air layer is accounted for",
    "figure-07": "How much of the modulation the contacts bear",
    "figure-08": "Rice–Ruina: the harmonics",
    "figure-09": "Linker–Dieterich ageing, two coefficients",
    "figure-10": "The interface: a spring in series with a frictional joint",
    "figure-11": "Elastic asperities: hardly any dependence on V, no saturation",
}
_LABELS = {
    "delta_mu": "Δμ̄",
    "mean_friction": "mean friction μ̄",
    "mu1": "μ₁",
    "mu2": "μ₂",
    "epsilon_applied": "modulation amplitude ε",
    "epsilon_eff": "effective amplitude ε_eff",
    "V": "pulling velocity V",
    "phase": "time over the period, 0 at the largest load",
    "stretch": "λF/W (nm)",
    "slider_velocity": "ẋ / V",
    "plastic_velocity": "plastic rate / V",
}
#: A share is moved between these; other numbers by this factor to both sides.
_SHARE, _FACTOR = (0.05, 1.0), 4.0
#: What is written into a field may differ from the printed number by this factor: farther away the
#: equations are so stiff that curves take minutes.
_BEYOND = 100.0

_preparation: Preparation | None = None


class MovedFigure(Question):
    """A figure of the paper, and the numbers that are moved.

    Attributes
    ----------
    figure : str
        A key of `CURVES`, or the element's.
    numbers : mapping of str to number or str
        SI, or texts with units, by the names of the paper's numbers; the others are as printed.
    """

    figure: Name
    numbers: Annotated[dict[Name, Value], Field(max_length=20, default_factory=dict)]


class Nothing(Question):
    """A request without fields."""


def use(preparation: Preparation) -> None:
    """Let programs be compiled before they are needed."""
    global _preparation
    _preparation = preparation


def preparations() -> dict[str, Callable[[], Any]]:
    """Programs of each figure."""
    return {_place(name): partial(_printed_curves, name) for name in _NUMBERS}


def _place(figure: str) -> str:
    return f"Figure {int(figure.removeprefix('figure-'))}"


def overview(asked: Nothing) -> dict[str, Any]:
    """Figures with their sliders, and the words of all claims; nothing is solved."""
    contents = find_paper(_PAPER).contents
    about = contents.paper
    return {
        "paper": {"title": about.title, "authors": about.authors, "journal": about.journal},
        "figures": [
            {
                "name": name,
                "place": _place(name),
                "title": _TITLES[name],
                "numbers": [_slider(n, about.parameters) for n in _numbers_of(name)],
                "inertia": name in CURVES and bool(_inertial(name)),
            }
            for name in _NUMBERS
        ],
        "claims": [
            {
                "id": c.id, "place": c.place, "section": _section(c.place),
                "statement": c.statement, "stated": c.stated, "kind": c.kind,
                "how": " ".join(c.how.split()), "why": " ".join(c.why.split()),
            }
            for c in contents.claim
        ],
    }  # fmt: skip


def _numbers_of(figure: str) -> tuple[str, ...]:
    own = _NUMBERS[figure]
    return (*own, "M") if figure in _MASS else own


def _section(place: str) -> str:
    """The section that a place such as "Section III.A.2; Fig. 7" names first."""
    found = re.search(r"Abstract|Appendix|Section [IVX]+(\.[A-Z])?", place)
    return found[0] if found else "Captions"


def _slider(name: str, meanings: Mapping[str, Any]) -> dict[str, Any]:
    number = printed()[name]
    symbol, meaning = meanings.get(name, (name, ""))
    low, high = number.si / _FACTOR, number.si * _FACTOR
    share = name == "transmission"
    if share:
        symbol, meaning = "ε_eff/ε", "share of the modulation on the contacts at 120 Hz"
        low, high = _SHARE
    return {
        "name": name,
        "kind": number.dimension,
        "label": symbol,
        "meaning": meaning or number.note or name,
        "slider": {"value": number.si, "low": low, "high": high, "log": not share},
        "origin": f"{number.kind}, {number.place}",
    }


def check(asked: MovedFigure) -> None:
    """Refuse what cannot be drawn, before a process is asked."""
    if asked.figure not in _NUMBERS:
        raise InputError(
            f"figure must be one of the paper's with curves, got '{asked.figure}'; "
            f"{closest(asked.figure, _NUMBERS)}"
        )
    _moved_numbers(asked)


def figure(asked: MovedFigure) -> dict[str, Any]:
    """Curves of a figure as printed and with the moved numbers, and what the text states."""
    check(asked)
    numbers = _moved_numbers(asked)
    answer: dict[str, Any] = {
        "numbers": {n: numbers[n].si for n in _numbers_of(asked.figure)},
        "python": _python(asked, numbers),
        "command": f"asperity reproduce {_PAPER} --out report",
    }
    if _preparation is not None and not _preparation.want(_place(asked.figure)):
        return {**answer, "preparing": _place(asked.figure)}
    before = _printed_curves(asked.figure)
    with replaced_numbers(numbers, _STEPS):
        after = _curves(asked.figure) if asked.numbers else before
        marks = _stated(asked.figure)
        if asked.figure == _ELEMENT:
            answer["element"] = _element()
    return {**answer, **_layout(asked.figure), "printed": before, "moved": after, "stated": marks}


def _element() -> dict[str, float]:
    """Stiffnesses and frequencies of the element at the numbers in force, in SI."""
    own = paper()
    asperities = own.W0 / own["lambda"].si
    return {
        "asperities": asperities,
        "spring": own.K,
        "ratio": own.K / asperities,
        "resonance": contact_resonance(),
    }


def _moved_numbers(asked: MovedFigure) -> Material:
    known = _numbers_of(asked.figure)
    changes = {}
    for name, value in asked.numbers.items():
        if name not in known:
            raise InputError(
                f"numbers must be those of the figure, got '{name}'; {closest(name, known)}"
            )
        number = printed()[name]
        si = float(obeying(value, name, number.dimension, "positive"))
        if name == "transmission" and not si <= 1:
            raise InputError(f"transmission must be at most 1, got {si:g}; lower it")
        if not number.si / _BEYOND <= si <= number.si * _BEYOND:
            raise InputError(
                f"{name} must be within a factor of {_BEYOND:g} of the printed {number}, got "
                f"{f'{si:.3g} {KINDS[number.dimension].si}'.strip()}; move it nearer"
            )
        changes[name] = float(from_si(si, number.unit, number.dimension))
    return altered(printed(), changes)


@cache
def _printed_curves(name: str) -> list[dict[str, Any]]:
    with replaced_numbers(printed(), _STEPS):
        return _curves(name)


def _followed(curve: FigureCurve) -> bool:
    """Whether a line follows the slider: inertia takes seconds, and bands are many lines."""
    ends = tuple(f", {end}" for end in variations())
    return not curve.inertia and not curve.name.endswith(ends)


def _curves(name: str) -> list[dict[str, Any]]:
    """Lines of a figure at the numbers in force."""
    if name == _ELEMENT:
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
    layout = _layout(name)
    return (layout["x"]["column"], *(row["column"] for row in layout["rows"]))


def _element_period(V: float) -> dict[str, Any]:
    """What the element does over a period: stretch of the asperities, and rates over V."""
    response = periodic_response(
        slider(EXT), velocity=V, epsilon=stated().epsilon_eff, frequency=paper().frequency,
        waveform=_INSTANTS,
    )  # fmt: skip
    period = over_a_period(response)
    stretch = 1e9 * paper()["lambda"].si * period.force / period.load
    values = {
        "phase": period.phase, "stretch": stretch, "slider_velocity": period.velocity,
        "plastic_velocity": period.plastic_velocity,
    }  # fmt: skip
    return {"name": velocity_text(V).replace("um", "µm"), "values": values}


def _inertial(name: str) -> list[FigureCurve]:
    return [curve for curve in CURVES[name]() if curve.inertia]


def inertia(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Curves with the mass of the slider, a message each: ``curve``, and ``printed`` beside it.

    These have no method that always takes milliseconds.
    """
    asked = MovedFigure.model_validate(argument)
    numbers = _moved_numbers(asked)
    names = [curve.name for curve in _inertial(asked.figure)] if asked.figure in CURVES else []
    for done, name in enumerate(names):

        def on_progress(points: int, total: int, done: int = done) -> None:
            report(progress=(done + points / total) / len(names))

        before = _printed_inertial_curve(asked.figure, name, on_progress)
        after = before
        if asked.numbers:
            with replaced_numbers(numbers, _STEPS):
                after = _inertial_curve(asked.figure, name, on_progress)
        report(curve=after, printed=before, progress=(done + 1) / len(names))
    return {}


_inertial_as_printed: dict[tuple[str, str], dict[str, Any]] = {}


def _printed_inertial_curve(
    figure: str, name: str, progress: Callable[[int, int], None]
) -> dict[str, Any]:
    key = figure, name
    if key not in _inertial_as_printed:
        with replaced_numbers(printed(), _STEPS):
            _inertial_as_printed[key] = _inertial_curve(figure, name, progress)
    return _inertial_as_printed[key]


def _inertial_curve(figure: str, name: str, progress: Callable[[int, int], None]) -> dict[str, Any]:
    curve = next(c for c in _inertial(figure) if c.name == name)
    _check_share(curve)
    rows = solve_curves([curve], progress=progress)
    return {
        "name": name.replace("um", "µm").replace("inertia", "with its mass"),
        "values": {c: rows[c].to_numpy(float) for c in _columns(figure)},
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


def _layout(name: str) -> dict[str, Any]:
    """Axes of a figure: an abscissa and a row for each observable."""
    from asperity.papers.bureau2000.figures.observables import OBSERVABLES

    if name == _ELEMENT:
        rows = ("stretch", "slider_velocity", "plastic_velocity")
        return {
            "x": {"column": "phase", "label": _LABELS["phase"], "log": False},
            "rows": [{"column": c, "label": _LABELS[c], "log": False} for c in rows],
        }
    observables = OBSERVABLES[name]
    x = observables[0].x
    return {
        "x": {"column": x, "label": _LABELS[x], "log": x == "V"},
        "rows": [
            {"column": o.column, "label": _LABELS[o.column], "log": name == "figure-08"}
            for o in observables
        ],
    }


def _stated(name: str) -> dict[str, list[dict[str, Any]]]:
    """What the text states at one amplitude, by observable; an interval has two ends."""
    seen = stated()
    if name in ("figure-03", _ELEMENT):
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


def _python(asked: MovedFigure, numbers: Material) -> str:
    changes = {name: numbers[name].value for name in asked.numbers}
    if asked.figure == _ELEMENT:
        return (
            "from asperity.papers.bureau2000.numbers import printed, replaced_numbers\n"
            "from asperity.papers.bureau2000.numbers.period import one_period\n"
            "from asperity.papers.ledger.ledger import altered\n\n"
            f"numbers = altered(printed(), {changes!r})\n"
            "with replaced_numbers(numbers):\n"
            f'    table = one_period("{EXT}", V=1e-6, epsilon={stated().epsilon_eff})\n'
            "print(table)\n"
        )
    names = "CURVES, printed, replaced_numbers, solve_curves"
    return (
        f"from asperity.papers.bureau2000.numbers import {names}\n"
        "from asperity.papers.ledger.ledger import altered\n\n"
        f"numbers = altered(printed(), {changes!r})\n"
        "with replaced_numbers(numbers):\n"
        f'    table = solve_curves(CURVES["{asked.figure}"]())\n'
        "print(table)\n"
    )


def ledger(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Compute all claims; the number of finished ones is reported."""
    return {"claims": _claims(report)}


_found: list[dict[str, Any]] = []


def _claims(report: Callable[..., None]) -> list[dict[str, Any]]:
    """Verdicts by claim; a worker computes them once."""
    if not _found:
        own = find_paper(_PAPER)

        def on_progress(done: int, total: int) -> None:
            report(finished=done, total=total)

        claims = own.ledger(progress=on_progress)
        fields = ("id", "computed", "rule", "verdict")
        _found.extend({f: getattr(c, f) for f in fields} for c in claims)
    return _found


ENDPOINTS = (
    Answer("paper", Nothing, overview),
    Answer("paper/figure", MovedFigure, figure),
    Job(
        "paper/inertia", MovedFigure, "asperity.app.api.paper:inertia", lane="search",
        check=check, seconds=120,
    ),
    Job("paper/ledger", Nothing, "asperity.app.api.paper:ledger", lane="paper", seconds=300),
)  # fmt: skip
