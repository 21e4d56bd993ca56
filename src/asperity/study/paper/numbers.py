"""The numbers behind a figure, what the text states beside them, and what the reader is told."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import pandas as pd

from asperity.study.paper.machine import STRONGEST, mu_ss, paper, velocities


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
        See `asperity.study.paper.curves.COLUMNS`.
    scalars : mapping of str to float
        Numbers read off the curves.
    caption : str
        What is drawn, what the text states, and what comes out.
    alt : str
        What someone who cannot see the figure needs to know.
    """

    name: str
    place: str
    title: str
    data: pd.DataFrame
    scalars: Mapping[str, float] = field(default_factory=dict)
    caption: str = ""
    alt: str = ""

    def curve(self, name: str) -> pd.DataFrame:
        """The rows of one curve."""
        return self.data[self.data["curve"] == name]

    def last(self, curve: str, column: str) -> float:
        """The end of a curve, at its largest amplitude."""
        return float(self.curve(curve)[column].iloc[-1])

    def told(self, *, scalars: Mapping[str, float], caption: str, alt: str) -> Self:
        """The same with what was read off the curves."""
        return replace(self, scalars=scalars, caption=_minus(caption), alt=_minus(alt))

    @property
    def failed(self) -> int:
        """Number of points that were not solved."""
        return int((~self.data["converged"].astype(bool)).sum())


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
    drop : (float, float)
        Change of the mean there, 20 % of the friction coefficient at 10 and at 1 um/s.
    onset : float
        Applied amplitude from which the drop exceeds the noise and is quasi-linear.
    mu1 : (float, float)
        "Of order 1e-3": half a decade to either side.
    ratio : (float, float)
        mu2/mu1.
    divisor, divisor_vacuum : float
        eps/eps_eff at 120 Hz (Fig. 7) and between air and vacuum at 200 Hz (Fig. 5).
    """

    epsilon: float
    drop: tuple[float, float]
    onset: float
    mu1: tuple[float, float]
    ratio: tuple[float, float]
    divisor: float
    divisor_vacuum: float

    @property
    def epsilon_eff(self) -> float:
        """What the contacts bear at `epsilon`, by Fig. 7."""
        return self.epsilon / self.divisor


def stated() -> Stated:
    """The statements of section II and of the captions, as numbers."""
    p = paper()
    slow, fast = velocities()
    half_decade = 10**0.5
    low, high = p["mu2_over_mu1"].si_range or (0.0, 0.0)
    return Stated(
        epsilon=STRONGEST,
        drop=(-p.relative_drop * mu_ss(slow), -p.relative_drop * mu_ss(fast)),
        onset=p.epsilon_onset,
        mu1=(p.mu1_order / half_decade, p.mu1_order * half_decade),
        ratio=(low, high),
        divisor=p.collapse_divisor_120Hz,
        divisor_vacuum=p.collapse_divisor_200Hz,
    )
