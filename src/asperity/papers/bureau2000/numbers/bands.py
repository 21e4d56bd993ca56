"""How far the published uncertainties of A, B and lambda move a curve.

A is moved at constant B - A, because that difference is measured by itself, as the slope of the
friction coefficient over ln V; B and lambda are moved alone. lambda is moved over 0.62 +- 0.15 um,
what the quasi-static test gives, the fitted 0.7 um lying within.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from asperity.papers.bureau2000.numbers.curves import FigureCurve
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers
from asperity.papers.bureau2000.numbers.machine import EXT, Float, paper

#: Groups of parameters that are drawn as one band.
RATE_AND_STATE, LENGTH = ("A", "B"), ("lambda",)


def variations() -> dict[str, dict[str, float]]:
    """Ends of each parameter's uncertainty: "A low", "A high", ... to what replaces the paper's."""
    p = paper()
    A, B, length = (p[name] for name in ("A", "B", "lambda_quasi_static"))
    ends = {}
    for word, sign in (("low", -1.0), ("high", 1.0)):
        moved_A = A.si + sign * (A.si_uncertainty or 0.0)
        ends[f"A {word}"] = {"A": moved_A, "B": moved_A + B.si - A.si}
        ends[f"B {word}"] = {"B": B.si + sign * (B.si_uncertainty or 0.0)}
        ends[f"lambda {word}"] = {"lambda_": length.si + sign * (length.si_uncertainty or 0.0)}
    return ends


def band_curves(name: str, V: float, applied: Float, share: float = 1.0) -> list[FigureCurve]:
    """Curves of the elasto-plastic law at the ends of `variations`, named "`name`, A low" etc."""
    return [
        FigureCurve(f"{name}, {end}", EXT, V, applied, share, overrides=overrides)
        for end, overrides in variations().items()
    ]


def band(
    numbers: FigureNumbers, name: str, column: str, parameters: Iterable[str]
) -> tuple[Float, Float]:
    """Lowest and highest value at each amplitude, the central curve `name` among them.

    Parameters
    ----------
    numbers : FigureNumbers
        Solved with `band_curves`.
    name, column : str
    parameters : iterable of str
        Of "A", "B", "lambda".

    Returns
    -------
    (array, array), shape (points,)
    """
    names = [name, *(f"{name}, {one} {end}" for one in parameters for end in ("low", "high"))]
    values = np.array([numbers.curve(one)[column].to_numpy(float) for one in names])
    return values.min(axis=0), values.max(axis=0)


def band_ends(
    numbers: FigureNumbers, name: str, column: str, epsilon_eff: float
) -> dict[str, float]:
    """Value at one amplitude for each end of `variations`."""
    return {end: numbers.at(f"{name}, {end}", column, epsilon_eff) for end in variations()}
