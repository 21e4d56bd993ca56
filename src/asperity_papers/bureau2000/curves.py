"""Curves of a figure as rows of a table, one operating point a row."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from asperity import periodic_response
from asperity.ledger import FigureNumbers, figure_words
from asperity.parameters import typed
from asperity_papers.bureau2000.machine import (
    EXT,
    FAST,
    PAPER,
    SLOW,
    Float,
    Machine,
)

#: Words and pictures of figures and sections.
WORDS = figure_words(PAPER.package)

_SOLVED = (
    "mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2", "floquet_max", "stable",
    "converged", "result",
)  # fmt: skip
APPLIED, BORNE = "epsilon_applied", "epsilon_eff"


@typed
@dataclass(frozen=True)
class FigureCurve:
    """One line of a figure.

    Attributes
    ----------
    name : str
    law : str
    V : float or array
        Pulling velocity (m/s).
    applied : float or array
        Applied amplitude eps.
    share : float
        eps_eff/eps.
    frequency : float or array
        In Hz; None is the 120 Hz of nearly all figures.
    overrides : mapping of str to float or array
        Parameters of the law that replace the paper's.
    inertia : bool
        Whether the mass counts.
    damping : float
        Damping of a damper between slider and track (N s/m); 0 for none.

    All arrays broadcast against each other.
    """

    name: str
    law: str
    V: float | Float
    applied: float | Float
    share: float = 1.0
    frequency: float | Float | None = None
    overrides: Mapping[str, float | Float] = field(default_factory=dict)
    inertia: bool = False
    damping: float = 0.0


def solve_curves(machine: Machine, curves: Iterable[FigureCurve], **options: Any) -> pd.DataFrame:
    """Solve all points of all curves.

    Parameters
    ----------
    machine : Machine
    curves : iterable of FigureCurve
    **options
        As in `asperity.periodic_response`.

    Returns
    -------
    DataFrame
        With the columns ``column`` of figures.toml. A point that failed has ``converged`` False,
        NaN, and the reason in ``result``.
    """
    return pd.concat([_solve(machine, curve, options) for curve in curves], ignore_index=True)


def _solve(machine: Machine, curve: FigureCurve, options: Mapping[str, Any]) -> pd.DataFrame:
    f = machine.numbers.frequency if curve.frequency is None else curve.frequency
    varied = {name: x for name, x in curve.overrides.items() if np.ndim(x)}
    inputs = (curve.V, curve.applied, f, *varied.values())
    V, applied, frequency, *arrays = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(x, float)) for x in inputs)
    )
    overrides = {**curve.overrides, **dict(zip(varied, arrays, strict=True))}
    slider = machine.slider(curve.law, **overrides)
    law: Any = slider.law
    response = periodic_response(
        slider,
        velocity=V,
        epsilon=curve.share * applied,
        frequency=frequency,
        inertia=curve.inertia,
        radiation_damping=curve.damping or None,
        **options,
    )
    solved = {name: getattr(response, name) for name in _SOLVED}
    # Steady sliding: zeros but for round-off, and no phases.
    still = (applied == 0) & response.converged
    exact = {**dict.fromkeys(("delta_mu", "mu1", "mu2"), 0.0), "phase1": np.nan, "phase2": np.nan}
    solved |= {name: np.where(still, x, solved[name]) for name, x in exact.items()}
    return pd.DataFrame(
        {
            "curve": curve.name,
            "law": curve.law,
            "alpha": float(getattr(law, "alpha", np.nan)),
            "lambda": np.asarray(law.elastic_length, float),
            "inertia": curve.inertia,
            "damping": curve.damping,
            "V": V,
            "frequency": frequency,
            "epsilon_applied": applied,
            "epsilon_eff": curve.share * applied,
            **solved,
        }
    )


def speed_curves(
    machine: Machine, law: str, applied: Float, share: float = 1.0, case: str = "", **others: Any
) -> list[FigureCurve]:
    """A curve at each of the two velocities; names are "`case`, 1 um/s" or "1 um/s" alone."""
    return [
        FigureCurve(f"{case}, {name}" if case else name, law, V, applied, share, **others)
        for name, V in machine.speeds
    ]


def curves_of_laws(
    machine: Machine, laws: Mapping[str, tuple[str, Mapping[str, float]]]
) -> list[FigureCurve]:
    """Laws with parameters that replace the paper's against eps_eff, at both velocities."""
    eps = machine.borne_amplitudes()
    return [
        curve
        for name, (law, overrides) in laws.items()
        for curve in speed_curves(machine, law, eps, case=name, overrides=overrides)
    ]


def elastic_curves(machine: Machine, applied: Float, share: float = 1.0) -> list[FigureCurve]:
    """The elasto-plastic law at both velocities, with the mass, and at the ends of `variations`."""
    still = speed_curves(machine, EXT, applied, share)
    moved = [replace(curve, name=f"{curve.name}, inertia", inertia=True) for curve in still]
    # Named "1 um/s, A low" etc.
    ends = [
        replace(still[0], name=f"{SLOW}, {end}", overrides=overrides)
        for end, overrides in variations(machine).items()
    ]
    return [*still, *moved, *ends]


@dataclass(frozen=True)
class CurveFigure:
    """A figure made of curves; figures.toml has the formulas of what is read off them.

    Attributes
    ----------
    name : str
    curves : function
        The curves, from the machine.
    terms : function
        Further names for the formulas, from the machine and the solved curves.
    """

    name: str
    curves: Callable[[Machine], list[FigureCurve]]
    terms: Callable[[Machine, FigureNumbers], dict[str, Any]] = lambda machine, read: {}

    def __call__(self, machine: Machine) -> FigureNumbers:
        """Solve the curves, and read the numbers off them."""
        data = solve_curves(machine, self.curves(machine))
        terms = self.terms(machine, FigureNumbers(self.name, data))
        return figure_numbers(machine, self.name, data, terms=terms)


def figure_numbers(
    machine: Machine,
    name: str,
    data: pd.DataFrame,
    scalars: Mapping[str, float] | None = None,
    *,
    points: pd.DataFrame | None = None,
    terms: Mapping[str, Any] | None = None,
) -> FigureNumbers:
    """A figure with the numbers of its formulas, further ones, and what the text states."""
    stated = {
        "share": machine.share,
        "epsilon_eff at 0.5": machine.strongest,
        "collapse": 1 / machine.numbers.collapse_divisor_200Hz,
        "onset": machine.numbers.epsilon_onset,
    }
    for quantity, pair in machine.stated().items():
        stated[f"stated {quantity} 1"], stated[f"stated {quantity} 2"] = pair
    known = {**machine.terms, **_terms(machine, FigureNumbers(name, data)), **(terms or {})}
    formulas, further = WORDS.figures[name].values(machine.numbers, known)
    return FigureNumbers(name, data, dict(scalars or {}) | formulas, stated | further, points)


def _terms(machine: Machine, read: FigureNumbers) -> dict[str, Any]:
    """Names for formulas of figures.toml: quantities at a curve's end or at eps = 0.5."""

    def column(curve: str, name: str) -> Float:
        return read.curve(curve)[name].to_numpy()

    return {
        "slow": SLOW,
        "fast": FAST,
        **{name: name for name in read.data.columns if name not in machine.numbers.numbers},
        "nth": lambda curve, name, n: column(curve, name)[int(n)],
        "last": read.last,
        "least": lambda curve, name: column(curve, name).min(),
        "largest": lambda curve, name: column(curve, name).max(),
        "mean": lambda curve, name: read.curve(curve)[name].mean(),
        "at": lambda curve, name: read.at(curve, name, machine.strongest, BORNE),
        # The amplitude at which a falling quantity has a value.
        "amplitude": lambda curve, name, value: np.interp(
            -value, -column(curve, name), column(curve, BORNE)
        ),
        "along": lambda curve, name, x, value: read.at(curve, name, value, x),
        "along_log": lambda curve, name, x, value: np.interp(
            np.log(value), np.log(column(curve, x)), column(curve, name)
        ),
        "slope_in_log": lambda curve, name, x: np.polyfit(
            np.log(column(curve, x)), column(curve, name), 1
        )[0],
        "late_over_early": lambda curve, name: late_over_early_slope(read, curve, name),
        "degrees": np.degrees,
    }


def late_over_early_slope(numbers: FigureNumbers, curve: str, column: str) -> float:
    """Slope of a curve in its last tenth over its mean slope; small where it saturates."""
    rows = numbers.curve(curve)
    x, y = rows[BORNE].to_numpy(), rows[column].to_numpy()
    tenth = len(x) // 10
    return float((y[-1] - y[-1 - tenth]) / (x[-1] - x[-1 - tenth]) / (y[-1] / x[-1]))


# --- How far the published uncertainties of A, B and lambda move a curve --------------------------


def variations(machine: Machine) -> dict[str, dict[str, float]]:
    """Ends of each parameter's uncertainty: "A low", "A high", ... to what replaces the paper's.

    A is moved at constant B - A, because that difference is measured by itself, as the slope of
    the friction coefficient over ln V; B and lambda are moved alone. lambda is moved over 0.62 +-
    0.15 um, the result of the quasi-static test; the fitted 0.7 um lie within.
    """
    p = machine.numbers
    ends: dict[str, dict[str, float]] = {}
    for k, word in enumerate(("low", "high")):
        A = machine.ends_of("A")[k]
        ends[f"A {word}"] = {"A": A, "B": A + p["B"].si - p["A"].si}
        ends[f"B {word}"] = {"B": machine.ends_of("B")[k]}
        ends[f"lambda {word}"] = {"lambda_": machine.ends_of("lambda_quasi_static")[k]}
    return ends
