"""The stability diagram: critical stiffness against amplitude and against frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from asperity.papers.bureau2000.numbers import paper
from asperity.papers.bureau2000.numbers.machine import slider
from asperity.study.map import Axis, response_map
from asperity.study.threshold import natural_scales, stiffness_threshold

if TYPE_CHECKING:
    import xarray

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """A model of the slider.

    Attributes
    ----------
    law : str
    inertia : bool
    """

    law: str
    inertia: bool = False

    @property
    def name(self) -> str:
        """What tables call it."""
        return f"{self.law}, inertia" if self.inertia else self.law


#: Rigid and elastic asperities, without and with the slider's mass.
CASES = (
    Case("rice-ruina"),
    Case("elasto-plastic"),
    Case("rice-ruina", inertia=True),
    Case("elasto-plastic", inertia=True),
)


def stabilisation_diagram(
    amplitudes: Float,
    frequencies: Float,
    *,
    cases: tuple[Case, ...] = CASES,
    levels: tuple[float, ...] = (0.05, 0.1, 0.2),
    velocity: float = 1e-6,
    scan: int = 24,
) -> pd.DataFrame:
    """Critical stiffness of the modulated slider, in two cuts.

    Parameters
    ----------
    amplitudes : array, shape (n,)
        Amplitudes on the contacts at the paper's 120 Hz, cut "amplitude", for all cases.
    frequencies : array, shape (m,)
        Frequencies (Hz) of cut "frequency", for the elasto-plastic law at all `levels`.
    cases : tuple of Case
    levels : tuple of float
        Amplitudes on the contacts.
    velocity : float
        Pulling velocity (m/s).
    scan : int
        See `stiffness_threshold`.

    Returns
    -------
    DataFrame
        Columns ``cut, case, epsilon, frequency, ratio, kind, mode_frequency, result``.
    """
    rows = []

    def add(cut: str, case: Case, epsilon: Float, frequency: Float) -> None:
        found = stiffness_threshold(
            slider(case.law), epsilon=epsilon, frequency=frequency, velocity=velocity,
            inertia=case.inertia, scan=scan,
        )  # fmt: skip
        eps, f = np.broadcast_arrays(epsilon, frequency)
        columns = {"cut": cut, "case": case.name, "epsilon": eps, "frequency": f}
        results = {n: getattr(found, n) for n in ("ratio", "kind", "mode_frequency", "result")}
        rows.append(pd.DataFrame(columns | results))

    for case in cases:
        add("amplitude", case, amplitudes, np.array(paper().frequency))
    for level in levels:
        add("frequency", Case("elasto-plastic"), np.array(level), frequencies)
    return pd.concat(rows, ignore_index=True)


def resonance_map(
    frequencies: Axis,
    amplitudes: Axis,
    *,
    stiffness: float = 2.0,
    velocity: float = 1e-6,
    inertia: bool = True,
) -> xarray.Dataset:
    """Response over frequency and amplitude, of a slider that is stable without modulation.

    With inertia, elastic asperities resonate at sqrt(W0/(lambda M))/2 pi = 400 Hz; a modulation at
    about twice that frequency excites them whatever the spring.

    Parameters
    ----------
    frequencies, amplitudes : Axis
        Of ``frequency`` and ``epsilon``.
    stiffness : float
        K over K_c.
    velocity : float
        Pulling velocity (m/s).
    inertia : bool
        Whether the mass counts.
    """
    Kc, _ = natural_scales(slider("elasto-plastic"), velocity)
    p = paper()
    numbers = {name: p[name].si for name in ("mu0", "A", "B", "D0", "V0", "lambda", "W0", "M")}
    numbers |= {"K": stiffness * Kc, "V": velocity, "inertia": float(inertia)}
    return response_map("elasto-plastic", numbers, x=frequencies, y=amplitudes)
