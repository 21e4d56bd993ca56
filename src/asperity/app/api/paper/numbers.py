"""Figures of the paper: the numbers that each rests on, their sliders, and what they may be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from asperity.app.api.operating_point import Name, Value
from asperity.app.endpoints import Question
from asperity.errors import InputError, closest
from asperity.materials import Material
from asperity.papers.bureau2000.numbers import printed
from asperity.papers.ledger.ledger import altered
from asperity.parameters import obeying
from asperity.units import KINDS, from_si

PAPER = "bureau2000"
#: Intervals of a curve that follows a slider, and instants of a period.
STEPS, INSTANTS = 25, 128
#: The figure without curves: the element of the elasto-plastic law, here with its motion.
ELEMENT = "figure-10"

_ELASTIC = ("A", "B", "D0", "lambda", "mu0", "K", "W0", "frequency", "transmission")
_RIGID = ("A", "B", "D0", "mu0", "K", "W0", "frequency")
#: Numbers that a figure rests on, in the order of its sliders.
NUMBERS: Mapping[str, tuple[str, ...]] = {
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
MASS = ("figure-02", "figure-04", "figure-11")
TITLES = {
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
LABELS = {
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


def place_of(figure: str) -> str:
    """What people call a figure."""
    return f"Figure {int(figure.removeprefix('figure-'))}"


def numbers_of(figure: str) -> tuple[str, ...]:
    """Numbers that a figure rests on."""
    own = NUMBERS[figure]
    return (*own, "M") if figure in MASS else own


def slider_of(name: str, meanings: Mapping[str, Any]) -> dict[str, Any]:
    """What the page shows of a number: symbol, meaning, slider and where it is printed."""
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
    if asked.figure not in NUMBERS:
        raise InputError(
            f"figure must be one of the paper's with curves, got '{asked.figure}'; "
            f"{closest(asked.figure, NUMBERS)}"
        )
    moved_numbers(asked)


def moved_numbers(asked: MovedFigure) -> Material:
    """The paper's numbers with those that are moved."""
    known = numbers_of(asked.figure)
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
