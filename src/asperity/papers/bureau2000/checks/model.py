"""The paper's slider and air layer at one set of its numbers, and the responses that claims share.

A statement that names no amplitude is tested at eps = 0.5, the strongest modulation of the
experiments, where the text quotes its own numbers. Amplitudes called `applied` are eps; the models
receive eps_eff = 0.48 eps, the paper's fit at 120 Hz.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from asperity.air import AirLayer, effective_modulation
from asperity.materials import Material
from asperity.orbit import PeriodicResponse, periodic_response
from asperity.papers.bureau2000.integration import (
    IntegratedOrbit,
    IntegratedPoint,
    periodic_orbit,
)
from asperity.slider import Slider
from asperity.theory.closed_forms import SmallModulation

Float = NDArray[np.float64]
Pair = tuple[float, float]
Found = TypeVar("Found")

#: Applied amplitudes of every curve; 0.625 is eps_eff = 0.3.
APPLIED = (0.005, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.625)
STRONGEST = 0.5
#: Amplitudes at which a statement about the harmonics is judged: from where the drop of the mean
#: emerges from the noise to the strongest.
READ = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5)
RR, LD, EXT = "rice-ruina", "linker-dieterich", "elasto-plastic"


class Model:
    """What the laws and the air layer predict at one set of the paper's numbers.

    Parameters
    ----------
    numbers : Material
        The paper's numbers, central or altered within their uncertainties.
    """

    def __init__(self, numbers: Material) -> None:
        self.numbers = numbers
        self._solved: dict[Hashable, Any] = {}

    def _once(self, key: Hashable, solve: Callable[[], Found]) -> Found:
        """The result of `solve`, computed at the first call with this key."""
        if key not in self._solved:
            self._solved[key] = solve()
        found: Found = self._solved[key]
        return found

    @property
    def velocities(self) -> Pair:
        """The two velocities of the figures (m/s), slow and fast."""
        slow, fast = self.numbers["V_data"].si_values or (np.nan, np.nan)
        return slow, fast

    @property
    def strongest(self) -> float:
        """eps_eff at eps = 0.5."""
        return self.numbers.transmission * STRONGEST

    def slider(self, law: str, **overrides: Any) -> Slider:
        """The paper's slider with a law of its parameters, some replaced."""
        p = self.numbers
        return Slider(p.law(law, **overrides), spring=p.K, load=p.W0, mass=p.M)

    def curve(self, law: str, **overrides: float) -> PeriodicResponse:
        """Response at the two velocities (axis 0) and at `APPLIED` (axis 1), 120 Hz."""
        V, applied = np.array(self.velocities)[:, None], np.array(APPLIED)[None]
        return self._once(
            ("curve", law, *sorted(overrides.items())),
            lambda: self.response(law, V, applied, **overrides),
        )

    def response(
        self,
        law: str,
        velocity: Any,
        applied: Any,
        frequency: float | None = None,
        **overrides: Any,
    ) -> PeriodicResponse:
        """Quasi-static response of the paper's slider at eps_eff = 0.48 times `applied`."""
        p = self.numbers
        return periodic_response(
            self.slider(law, **overrides),
            velocity=velocity,
            epsilon=p.transmission * np.asarray(applied),
            frequency=p.frequency if frequency is None else frequency,
        )

    def outputs(self, law: str, **overrides: float) -> Outputs:
        """Quasi-static response of a law at eps = 0.5."""
        r = self.curve(law, **overrides)
        return Outputs(at(r.mu_ss), at(r.delta_mu), at(r.mu1), at(r.mu2))

    def inertial_outputs(self) -> Outputs:
        """Response of the elasto-plastic law at eps = 0.5 with the slider's inertia."""
        return self._once("inertial", self._inertial_outputs)

    def _inertial_outputs(self) -> Outputs:
        p = self.numbers
        r = periodic_response(
            self.slider(EXT),
            velocity=np.array(self.velocities),
            epsilon=self.strongest,
            frequency=p.frequency,
            inertia=True,
        )
        pairs = ((float(a[0]), float(a[1])) for a in (r.mu_ss, r.delta_mu, r.mu1, r.mu2))
        return Outputs(*pairs)

    def ageless_changes(self, law: str) -> dict[str, float]:
        """Relative changes of drop, mu1 and mu2 when friction no longer feels the age.

        At eps = 0.5 and the fast velocity, with mu0 set so that the steady friction stays what it
        was.
        """
        p, fast = self.numbers, self.velocities[1]
        mu_fast = float(self.slider(law).law.mu_ss(fast))
        full = self.response(law, fast, [STRONGEST])
        without = self.response(
            law, fast, [STRONGEST], B=0.0, mu0=mu_fast - p.A * float(np.log(fast / p.V0))
        )
        return {
            "drop": float((without.delta_mu / full.delta_mu)[0]) - 1,
            "mu1": float((without.mu1 / full.mu1)[0]) - 1,
            "mu2": float((without.mu2 / full.mu2)[0]) - 1,
        }

    def velocity_exponent(self, values: Float, applied: float = STRONGEST) -> float:
        """Logarithmic slope d ln y / d ln V between the two velocities, at one amplitude."""
        slow, fast = at(np.abs(values), applied)
        low, high = self.velocities
        return float(np.log(fast / slow) / np.log(high / low))

    def small_modulation(self, V: float, **overrides: float) -> SmallModulation:
        """What the closed forms take, at the paper's numbers; rigid asperities, no inertia."""
        return SmallModulation(**self._point(V, **overrides))

    def operating_point(self, V: float, **overrides: float) -> IntegratedPoint:
        """What the reference integration takes, at the paper's numbers; rigid, no inertia."""
        numbers = {k: v for k, v in self._point(V, **overrides).items() if k != "omega"}
        return IntegratedPoint(**numbers, frequency=self.numbers.frequency)

    def orbit(self, point: IntegratedPoint, epsilon: float, drop: float = 0.0) -> IntegratedOrbit:
        """A periodic orbit of the reference integration, integrated once."""
        return self._once((point, epsilon, drop), lambda: periodic_orbit(point, epsilon, drop))

    def _point(self, V: float, **overrides: float) -> dict[str, Any]:
        p = self.numbers
        own: dict[str, Any] = {"A": p.A, "B": p.B, "D0": p.D0, "K": p.K, "W0": p.W0}
        own |= {"V": V, "omega": 2 * np.pi * p.frequency}
        own |= overrides
        own.setdefault("mu", p.mu0 - (own["B"] - own["A"]) * float(np.log(V / p.V0)))
        return own

    def borne(self, frequency: float, layer: AirLayer | None) -> float:
        """eps_eff/eps of the paper's slider with or without an air layer."""
        p = self.numbers
        return float(
            effective_modulation(frequency, W0=p.W0, M=p.M, lambda_z=p.lambda_z, layer=layer)
        )

    def air_layer(self, **overrides: Any) -> AirLayer:
        """The air layer of the appendix; its radius is the stated 3.9 cm."""
        p = self.numbers
        return AirLayer(**({"P0": p.P0, "h0": p.h0, "eta": p.eta_air, "R": p.R} | overrides))

    @property
    def nominal_radius(self) -> float:
        """Radius (m) of the disc of the stated area, 49 cm^2."""
        return float(np.sqrt(self.numbers.Sigma0 / np.pi))


@dataclass(frozen=True)
class Outputs:
    """A model's response at eps = 0.5, each at the slow and the fast velocity."""

    mu_ss: Pair
    delta_mu: Pair
    mu1: Pair
    mu2: Pair

    @property
    def relative_drop(self) -> Pair:
        """Drop of the mean over the friction coefficient without modulation."""
        return -self.delta_mu[0] / self.mu_ss[0], -self.delta_mu[1] / self.mu_ss[1]

    @property
    def drop_over_mu1(self) -> Pair:
        """Drop of the mean over the first harmonic."""
        return -self.delta_mu[0] / self.mu1[0], -self.delta_mu[1] / self.mu1[1]

    @property
    def mu2_over_mu1(self) -> Pair:
        """Second over first harmonic."""
        return self.mu2[0] / self.mu1[0], self.mu2[1] / self.mu1[1]


def at(values: Float, applied: float = STRONGEST) -> Pair:
    """Entries of a curve at one applied amplitude, for the slow and the fast velocity."""
    slow, fast = values[:, APPLIED.index(applied)]
    return float(slow), float(fast)


def relative(values: Pair) -> float:
    """Relative change from the slow to the fast velocity."""
    slow, fast = values
    return fast / slow - 1


def amplitude_slopes(values: Float) -> Float:
    """Logarithmic slopes d ln y / d ln eps between neighbouring amplitudes, (2, n - 1)."""
    return np.diff(np.log(np.abs(values))) / np.diff(np.log(APPLIED))


def percent(value: float) -> str:
    """A share as text, two significant digits."""
    return f"{100 * value:.2g} %"


def both(values: Pair, digits: int = 3) -> str:
    """Numbers at 1 and 10 um/s as text."""
    return f"{values[0]:.{digits}g} and {values[1]:.{digits}g} at 1 and 10 um/s"


def with_value(numbers: Material, name: str, value: float) -> Material:
    """The paper's numbers with one of them replaced (SI)."""
    number = numbers[name].model_copy(
        update={"value": value, "unit": numbers[name].si_unit, "uncertainty": None}
    )
    return numbers.model_copy(update={"numbers": {**numbers.numbers, name: number}})
