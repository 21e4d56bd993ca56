"""The numbers behind a figure, what the text states beside them, and the words that go with it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import pandas as pd

from asperity.papers.bureau2000.numbers.curves import COLUMNS
from asperity.papers.bureau2000.numbers.machine import (
    STRONGEST,
    fitted_share,
    mu_ss,
    paper,
    velocities,
)


@dataclass(frozen=True)
class FigureNumbers:
    """Everything that a figure shows.

    Attributes
    ----------
    name : str
        Name of its files.
    place : str
        The paper's number for it, such as "Figure 2".
    title : str
    data : DataFrame
        One operating point, or one instant, a row.
    scalars : mapping of str to float
        Numbers read off the curves.
    caption : str
        What is drawn, what the text states, and what comes out.
    alt : str
        What someone who cannot see the figure needs to know.
    columns : mapping of str to str
        Unit and meaning of the columns of `data`.
    """

    name: str
    place: str
    title: str
    data: pd.DataFrame
    scalars: Mapping[str, float] = field(default_factory=dict)
    caption: str = ""
    alt: str = ""
    columns: Mapping[str, str] = field(default_factory=lambda: COLUMNS)

    def curve(self, name: str) -> pd.DataFrame:
        """The rows of one curve."""
        return self.data[self.data["curve"] == name]

    def last(self, curve: str, column: str) -> float:
        """The end of a curve, at its largest amplitude."""
        return float(self.curve(curve)[column].iloc[-1])

    def at(self, curve: str, column: str, epsilon_eff: float) -> float:
        """A quantity on a curve at an amplitude, linear between the curve's points."""
        rows = self.curve(curve)
        return float(np.interp(epsilon_eff, rows["epsilon_eff"], rows[column]))

    def described(self, *, scalars: Mapping[str, float], caption: str, alt: str) -> Self:
        """The same with the numbers read off the curves, the caption and the alternative text."""
        return replace(self, scalars=scalars, caption=_minus(caption), alt=_minus(alt))

    @property
    def failed(self) -> int:
        """Number of points that were not solved."""
        return int((~self.data["converged"].astype(bool)).sum()) if "converged" in self.data else 0


def _minus(text: str) -> str:
    """Negative numbers with the sign that printers use."""
    return re.sub(r"(?<=[ =])-(?=\d)", "−", text)


@dataclass(frozen=True)
class Stated:
    """What the text says about the measurements; nothing here is read off a figure.

    Attributes
    ----------
    epsilon : float
        Applied amplitude that the text quotes its numbers at, 0.5.
    relative_drop : float
        "A typical magnitude of this effect is a 20 % decrease" of the mean; no velocity is named.
    drops : (float, float)
        The same as a change of the mean, -20 % of the friction coefficient at 1 and at 10 um/s.
    onset : float
        Applied amplitude from which the drop exceeds the noise and is quasi-linear.
    mu1 : (float, float)
        "Of order 1e-3": half a decade to either side.
    ratio : (float, float)
        mu2/mu1.
    share : float
        eps_eff/eps at 120 Hz.
    collapse : float
        eps_eff in air over that in vacuum at 200 Hz (Fig. 5).
    """

    epsilon: float
    relative_drop: float
    drops: tuple[float, float]
    onset: float
    mu1: tuple[float, float]
    ratio: tuple[float, float]
    share: float
    collapse: float

    @property
    def epsilon_eff(self) -> float:
        """Amplitude that the contacts bear at `epsilon`."""
        return self.epsilon * self.share

    @property
    def mu2(self) -> tuple[float, float]:
        """What "of order 1e-3" and "0.1 to 0.2 of it" leave to mu2."""
        return self.mu1[0] * self.ratio[0], self.mu1[1] * self.ratio[1]


def stated() -> Stated:
    """The statements of section II and of the captions, as numbers."""
    p = paper()
    half_decade = 10**0.5
    low, high = p["mu2_over_mu1"].si_range or (0.0, 0.0)
    slow, fast = (-p.relative_drop * mu_ss(V) for V in velocities())
    return Stated(
        epsilon=STRONGEST,
        relative_drop=p.relative_drop,
        drops=(slow, fast),
        onset=p.epsilon_onset,
        mu1=(p.mu1_order / half_decade, p.mu1_order * half_decade),
        ratio=(low, high),
        share=fitted_share(),
        collapse=1 / p.collapse_divisor_200Hz,
    )
