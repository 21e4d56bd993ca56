"""The paper's slider, drive and amplitudes, every number from the material file.

`applied` amplitudes are the experiment's eps, `borne` ones the eps_eff that the contacts carry and
that the models receive.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.air import AirLayer, effective_modulation
from asperity.materials import Material, load
from asperity.slider import Slider
from asperity.units import format_si

Float = NDArray[np.float64]

RR, LD, EXT = "rice-ruina", "linker-dieterich", "elasto-plastic"
#: The elasto-plastic law with the plastic velocity in the age law too, which the paper does not.
EXT_AGE = "elasto-plastic-age"

#: The strongest modulation of the experiments, at which the text quotes its own numbers.
STRONGEST = 0.5
#: Amplitudes of a curve: finer than a line is wide, and 0.05, 0.2, 0.35 and 0.5 among them.
_STEPS = 100


class _Replaced(NamedTuple):
    """Numbers in place of the printed ones, and intervals of a curve."""

    numbers: Material
    steps: int


_replaced: ContextVar[_Replaced | None] = ContextVar("replaced", default=None)


def paper() -> Material:
    """The paper's numbers, or those that `replaced_numbers` puts in their place."""
    replaced = _replaced.get()
    return printed() if replaced is None else replaced.numbers


@cache
def printed() -> Material:
    """The paper's numbers as printed."""
    return load("bureau2000")


@contextmanager
def replaced_numbers(numbers: Material, steps: int = _STEPS) -> Iterator[None]:
    """Let figures be computed with other numbers, for this thread.

    Parameters
    ----------
    numbers : Material
        From `asperity.papers.ledger.ledger.altered`.
    steps : int
        Intervals of a curve between its smallest and largest amplitude.
    """
    token = _replaced.set(_Replaced(numbers, steps))
    try:
        yield
    finally:
        _replaced.reset(token)


def _steps() -> int:
    replaced = _replaced.get()
    return _STEPS if replaced is None else replaced.steps


def slider(law: str, **overrides: Any) -> Slider:
    """The paper's slider with one of the laws, some of its parameters replaced."""
    p = paper()
    return Slider(p.law(law, **overrides), spring=p.K, load=p.W0, mass=p.M)


def velocities() -> tuple[float, float]:
    """The two velocities of the figures (m/s), slow and fast."""
    slow, fast = paper()["V_data"].si_values or (np.nan, np.nan)
    return slow, fast


def velocity_text(velocity: float) -> str:
    """A velocity as the paper writes it, such as ``"10 um/s"``."""
    return format_si(velocity, "velocity")


def applied_amplitudes(largest: float = STRONGEST) -> Float:
    """Amplitudes of a curve, from steady sliding to `largest`."""
    return np.linspace(0.0, largest, _steps() + 1)


def borne_amplitudes() -> Float:
    """Amplitudes of the figures that are drawn against eps_eff: up to 0.3, as the text has it."""
    return np.linspace(0.0, paper().no_saturation_below, _steps() + 1)


def fitted_share() -> float:
    """eps_eff/eps at 120 Hz: 0.48, the text's fit (III.A.2), in all figures.

    The caption of Fig. 7 writes the same fit as eps/2.1.
    """
    return float(paper().transmission)


def layer_share(frequency: float, *, vacuum: bool = False, R: float | None = None) -> float:
    """eps_eff/eps of the appendix' model.

    Parameters
    ----------
    frequency : float
        In Hz.
    vacuum : bool
        Without the layer of air: inertia and the contacts' stiffness only.
    R : float, optional
        Radius of the layer (m); the appendix' full disc by default.
    """
    p = paper()
    layer = None if vacuum else AirLayer(P0=p.P0, h0=p.h0, eta=p.eta_air, R=p.R if R is None else R)
    return float(effective_modulation(frequency, W0=p.W0, M=p.M, lambda_z=p.lambda_z, layer=layer))


def vacuum_shares() -> tuple[float, float]:
    """eps_eff/eps at 200 Hz, in vacuum and in air.

    In vacuum by the appendix, 1/|1 - (omega/omega_0)^2|; in air the same over 2.5, the factor by
    which the paper's data collapse.
    """
    vacuum = layer_share(paper().frequency_vacuum, vacuum=True)
    return vacuum, vacuum / paper().collapse_divisor_200Hz


def mu_ss(velocity: float) -> float:
    """Friction coefficient of unmodulated sliding; the same in all the laws used here."""
    return float(slider(RR).law.mu_ss(velocity))
