"""The paper's operating points and the curves that several claims share, each computed once.

A statement that names no amplitude is tested at eps = 0.5, the strongest modulation of the
experiments, where the text quotes its own numbers. Amplitudes called `applied` are eps; the models
receive eps_eff = 0.48 eps, the paper's fit at 120 Hz.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.air import AirLayer, effective_modulation
from asperity.materials import Material, load
from asperity.slider import Slider
from asperity.solve import PeriodicResponse, periodic_response
from asperity.solve.closed_forms import SmallModulation
from asperity.study.claims.integration import Experiment

Float = NDArray[np.float64]

#: Applied amplitudes of every curve; 0.625 is eps_eff = 0.3.
APPLIED = (0.005, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.625)
STRONGEST = 0.5
RR, LD, EXT = "rice-ruina", "linker-dieterich", "elasto-plastic"


@cache
def paper() -> Material:
    """The paper's numbers."""
    return load("bureau2000")


def velocities() -> tuple[float, float]:
    """The two velocities of the figures (m/s)."""
    slow, fast = paper()["V_data"].si_values or (np.nan, np.nan)
    return slow, fast


def slider(law: str, **overrides: Any) -> Slider:
    """The paper's slider with a law of its parameters, some replaced."""
    p = paper()
    return Slider(p.law(law, **overrides), spring=p.K, load=p.W0, mass=p.M)


@cache
def curve(law: str, **overrides: float) -> PeriodicResponse:
    """Response at the two velocities (axis 0) and at `APPLIED` (axis 1), 120 Hz."""
    return response(law, np.array(velocities())[:, None], np.array(APPLIED)[None], **overrides)


def response(
    law: str, velocity: Any, applied: Any, frequency: float | None = None, **overrides: Any
) -> PeriodicResponse:
    """Quasi-static response of the paper's slider at eps_eff = 0.48 times `applied`."""
    p = paper()
    return periodic_response(
        slider(law, **overrides),
        velocity=velocity,
        epsilon=p.transmission * np.asarray(applied),
        frequency=p.frequency if frequency is None else frequency,
    )


def at(values: Float, applied: float = STRONGEST) -> tuple[float, float]:
    """Entries of a curve at one applied amplitude, for the slow and the fast velocity."""
    slow, fast = values[:, APPLIED.index(applied)]
    return float(slow), float(fast)


def relative(values: tuple[float, float]) -> float:
    """Relative change from the slow to the fast velocity."""
    slow, fast = values
    return fast / slow - 1


def velocity_exponent(values: Float, applied: float = STRONGEST) -> float:
    """Logarithmic slope d ln y / d ln V between the two velocities, at one amplitude."""
    slow, fast = at(np.abs(values), applied)
    low, high = velocities()
    return float(np.log(fast / slow) / np.log(high / low))


def amplitude_slopes(values: Float) -> Float:
    """Logarithmic slopes d ln y / d ln eps between neighbouring amplitudes, (2, n - 1)."""
    return np.diff(np.log(np.abs(values))) / np.diff(np.log(APPLIED))


def ageless_changes(law: str) -> dict[str, float]:
    """Relative changes of drop, mu1 and mu2 when friction no longer feels the age.

    At eps = 0.5 and the fast velocity, with mu0 set so that the steady friction stays what it was.
    """
    p, fast = paper(), velocities()[1]
    mu_fast = float(slider(law).law.mu_ss(fast))
    full = response(law, fast, [STRONGEST])
    without = response(
        law, fast, [STRONGEST], B=0.0, mu0=mu_fast - p.A * float(np.log(fast / p.V0))
    )
    return {
        "drop": float((without.delta_mu / full.delta_mu)[0]) - 1,
        "mu1": float((without.mu1 / full.mu1)[0]) - 1,
        "mu2": float((without.mu2 / full.mu2)[0]) - 1,
    }


def small_modulation(V: float, **overrides: float) -> SmallModulation:
    """What the closed forms take, at the paper's numbers; rigid asperities, no inertia."""
    return SmallModulation(**_numbers(V, **overrides))


def experiment(V: float, **overrides: float) -> Experiment:
    """What the reference integration takes, at the paper's numbers; rigid, no inertia."""
    numbers = _numbers(V, **overrides)
    return Experiment(**{k: v for k, v in numbers.items() if k != "omega"}, frequency=frequency())


def _numbers(V: float, **overrides: float) -> dict[str, Any]:
    p = paper()
    own: dict[str, Any] = {"A": p.A, "B": p.B, "D0": p.D0, "K": p.K, "W0": p.W0}
    own |= {"V": V, "omega": 2 * np.pi * p.frequency}
    own |= overrides
    own.setdefault("mu", p.mu0 - (own["B"] - own["A"]) * float(np.log(V / p.V0)))
    return own


def frequency() -> float:
    """The modulation frequency of the figures (Hz)."""
    return paper().frequency


def borne(frequency: float, layer: AirLayer | None) -> float:
    """eps_eff/eps of the paper's slider with or without an air layer."""
    p = paper()
    return float(effective_modulation(frequency, W0=p.W0, M=p.M, lambda_z=p.lambda_z, layer=layer))


def air_layer(**overrides: Any) -> AirLayer:
    """The air layer of the appendix; its radius is the stated 3.9 cm."""
    p = paper()
    return AirLayer(**({"P0": p.P0, "h0": p.h0, "eta": p.eta_air, "R": p.R} | overrides))


def nominal_radius() -> float:
    """Radius (m) of the disc of the stated area, 49 cm^2."""
    return float(np.sqrt(paper().Sigma0 / np.pi))


def percent(value: float) -> str:
    """A share as text, two significant digits."""
    return f"{100 * value:.2g} %"


def both(values: tuple[float, float], digits: int = 3) -> str:
    """Numbers at 1 and 10 um/s as text."""
    return f"{values[0]:.{digits}g} and {values[1]:.{digits}g} at 1 and 10 um/s"
