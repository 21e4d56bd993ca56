"""The paper's slider, drive and amplitudes, every number from the material file.

`applied` amplitudes are the experiment's eps, `borne` ones the eps_eff that the contacts carry and
that the models receive.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.materials import Material, load
from asperity.slider import Slider
from asperity.units import format_si

Float = NDArray[np.float64]

RR, LD, EXT = "rice-ruina", "linker-dieterich", "elasto-plastic"

#: The strongest modulation of the experiments, at which the text quotes its own numbers.
STRONGEST = 0.5
#: Amplitudes of a curve: finer than a line is wide, and 0.05, 0.2, 0.35 and 0.5 among them.
_STEPS = 100


@cache
def paper() -> Material:
    """The paper's numbers."""
    return load("bureau2000")


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
    return np.linspace(0.0, largest, _STEPS + 1)


def borne_amplitudes() -> Float:
    """Amplitudes of the figures that are drawn against eps_eff: up to 0.3, as the text has it."""
    return np.linspace(0.0, paper().no_saturation_below, _STEPS + 1)


def fitted_transmission() -> float:
    """eps_eff/eps at 120 Hz as Fig. 7 states it, 1/2.1 (the text rounds it to 0.48)."""
    return 1 / paper().collapse_divisor_120Hz


def mu_ss(velocity: float) -> float:
    """Friction coefficient of unmodulated sliding; the same in all the laws used here."""
    return float(slider(RR).law.mu_ss(velocity))
