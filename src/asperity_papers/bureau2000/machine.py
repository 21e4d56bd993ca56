"""The paper's slider, drive and air layer at one set of its numbers, and their responses.

Amplitudes called `applied` are the experiment's eps, `borne` ones the eps_eff that the contacts
carry and that the models receive: 0.48 eps at 120 Hz, the paper's fit. A statement that names no
amplitude is about eps = 0.5, the strongest modulation, where the text quotes its own numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from asperity import Slider, periodic_response
from asperity.air import (
    AirLayer,
    NormalContact,
    bessel_ratio,
    effective_modulation,
    mindlin_length_ratio,
)
from asperity.ledger import Paper
from asperity.materials import Material
from asperity.orbit import PeriodicResponse
from asperity.parameters import typed
from asperity.theory import SmallModulation, ageing_response
from asperity_papers.bureau2000.integration import (
    IntegratedOrbit,
    IntegratedPoint,
    periodic_orbit,
)

PAPER = Paper("bureau2000", "asperity_papers.bureau2000")

Float = NDArray[np.float64]
#: What a check returns, by name.
Numbers = dict[str, float]
Mixed = dict[str, float | str]
Pair = tuple[float, float]
Result = TypeVar("Result")


class Law(NamedTuple):
    """A law of the claims.

    Attributes
    ----------
    name : str
    overrides : mapping of str to float
        Parameters that replace the paper's.
    inertia : bool
        Whether the mass of the slider counts; only at the strongest modulation then.
    strongest : bool
        Whether it is evaluated at the strongest modulation, whatever amplitude is asked for.
    """

    name: str
    overrides: Mapping[str, float] = MappingProxyType({})
    inertia: bool = False
    strongest: bool = False


RR, LD, EXT = "rice-ruina", "linker-dieterich", "elasto-plastic"
#: The elasto-plastic law with the plastic velocity in the age law too; the paper has the slider's.
EXT_AGE = "elasto-plastic-age"

#: Names of the two velocities, of curves and of the numbers of claims.
SLOW, FAST = "1 um/s", "10 um/s"
SPEEDS = (SLOW, FAST)
STRONGEST = 0.5
#: Applied amplitudes at which claims are judged; 0.625 is eps_eff = 0.3.
APPLIED = (0.005, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.625)


@typed
class Machine:
    """Predictions of the laws and the air layer at one set of the paper's numbers.

    Parameters
    ----------
    numbers : Material, optional
        The paper's numbers, as printed or altered.
    steps : int
        Intervals of a curve between its smallest and its largest amplitude: by default finer than
        a line is wide, and 0.05, 0.2, 0.35 and 0.5 among them.
    """

    def __init__(self, numbers: Material | None = None, steps: int = 100) -> None:
        self.numbers = PAPER.numbers if numbers is None else numbers
        self.steps = steps
        self._solved: dict[Hashable, Any] = {}

    def _once(self, key: Hashable, solve: Callable[[], Result]) -> Result:
        """The result of `solve`, computed at the first call with this key."""
        if key not in self._solved:
            self._solved[key] = solve()
        result: Result = self._solved[key]
        return result

    @property
    def velocities(self) -> Pair:
        """The two velocities of the figures (m/s), slow and fast."""
        slow, fast = self.numbers["V_data"].si_values or (np.nan, np.nan)
        return slow, fast

    @property
    def speeds(self) -> tuple[tuple[str, float], ...]:
        """The names of the two velocities, and their values (m/s)."""
        return tuple(zip(SPEEDS, self.velocities, strict=True))

    def range_of(self, name: str) -> Pair:
        """Both ends of a printed range (SI)."""
        return self.numbers[name].si_range or (np.nan, np.nan)

    def ends_of(self, name: str) -> Pair:
        """A printed number less and plus its uncertainty (SI)."""
        number = self.numbers[name]
        spread = number.si_uncertainty or 0.0
        return number.si - spread, number.si + spread

    # --- The slider ------------------------------------------------------------------------------

    def slider(self, law: str, **overrides: Any) -> Slider:
        """The paper's slider with one of the laws, some of its parameters replaced."""
        p = self.numbers
        return Slider(p.law(law, **overrides), spring=p.K, load=p.W0, mass=p.M)

    def mu_ss(self, velocity: float) -> float:
        """Friction coefficient of unmodulated sliding; the same in all the laws used here."""
        return float(self.slider(RR).law.mu_ss(velocity))

    @property
    def contact_resonance(self) -> float:
        """Frequency (Hz) at which the mass oscillates on the asperities' shear stiffness."""
        p = self.numbers
        return float(np.sqrt(p.W0 / (p.lambda_ * p.M)) / (2 * np.pi))

    # --- The drive -------------------------------------------------------------------------------

    def applied_amplitudes(self) -> Float:
        """Amplitudes of a curve, from steady sliding to the strongest modulation."""
        return np.linspace(0.0, STRONGEST, self.steps + 1)

    def borne_amplitudes(self) -> Float:
        """Amplitudes of the figures drawn against eps_eff: up to 0.3, as in the text."""
        return np.linspace(0.0, self.numbers.no_saturation_below, self.steps + 1)

    @property
    def share(self) -> float:
        """eps_eff/eps at 120 Hz: 0.48, the text's fit (III.A.2), in all figures.

        The caption of Fig. 7 writes the same fit as eps/2.1.
        """
        return float(self.numbers.transmission)

    @property
    def strongest(self) -> float:
        """eps_eff at eps = 0.5."""
        return self.numbers.transmission * STRONGEST

    def air_layer(self, **overrides: Any) -> AirLayer:
        """The air layer of the appendix; its radius is the stated 3.9 cm."""
        p = self.numbers
        return AirLayer(**({"P0": p.P0, "h0": p.h0, "eta": p.eta_air, "R": p.R} | overrides))

    def borne(
        self, frequency: float, layer: AirLayer | None, lambda_z: float | None = None
    ) -> float:
        """eps_eff/eps with or without an air layer: without, inertia and contacts alone."""
        p = self.numbers
        length = p.lambda_z if lambda_z is None else lambda_z
        return float(effective_modulation(frequency, W0=p.W0, M=p.M, lambda_z=length, layer=layer))

    def elastic_slope(self, velocity: float) -> float:
        """D mu1/d eps of the velocity-independent plateau, mu l/(1 + l) with l = lambda K/W0."""
        slider = self.slider(EXT)
        ratio = float(np.asarray(slider.law.elastic_length) * slider.K / slider.W0)
        return float(slider.law.mu_ss(velocity)) * ratio / (1 + ratio)

    @property
    def nominal_radius(self) -> float:
        """Radius (m) of the disc of the stated area, 49 cm^2."""
        return float(np.sqrt(self.numbers.Sigma0 / np.pi))

    # --- Responses -------------------------------------------------------------------------------

    def response(
        self,
        law: str,
        velocity: Any,
        applied: Any,
        frequency: float | None = None,
        *,
        inertia: bool = False,
        **overrides: Any,
    ) -> PeriodicResponse:
        """Response at eps_eff = 0.48 times `applied`."""
        p = self.numbers
        return periodic_response(
            self.slider(law, **overrides),
            velocity=velocity,
            epsilon=p.transmission * np.asarray(applied),
            frequency=p.frequency if frequency is None else frequency,
            inertia=inertia,
        )

    def curve(self, law: str, **overrides: Any) -> PeriodicResponse:
        """Response at the two velocities (axis 0) and at `APPLIED` (axis 1), 120 Hz."""
        V, applied = np.array(self.velocities)[:, None], np.array(APPLIED)[None]
        return self._once(
            ("curve", law, *sorted(overrides.items())),
            lambda: self.response(law, V, applied, **overrides),
        )

    @cached_property
    def with_inertia(self) -> PeriodicResponse:
        """Response of the elasto-plastic law at eps = 0.5 with the slider's inertia."""
        return self.response(EXT, np.array(self.velocities), STRONGEST, inertia=True)

    def transfer(
        self, V: float, omega: float, lambda_: float = 0.0, alpha: float = 0.0, M: float = 0.0
    ) -> complex:
        """First harmonic over the amplitude of a small modulation, at omega (rad/s)."""
        point = self.small_modulation(V, omega=omega, lambda_=lambda_, alpha=alpha, M=M)
        return complex(ageing_response(point).transfer)

    @cached_property
    def terms(self) -> dict[str, Any]:
        """Names for formulas of claims.toml.

        Observables take a law, ``slow`` or ``fast``, and an applied amplitude, eps = 0.5 by
        default; ``exponent`` and the slopes take an observable first. ``borne`` takes a frequency
        and an air layer: that of the appendix, one of the nominal area, one under a disc of some
        radius, rarefied air, or the vacuum.
        """
        p, (low, high) = self.numbers, self.velocities

        def observable(name: str) -> Callable[..., float]:
            def value(law: Law, speed: int, applied: float = STRONGEST) -> float:
                if law.inertia:
                    return float(getattr(self.with_inertia, name)[speed])
                response = self.curve(law.name, **law.overrides)
                return at(getattr(response, name), STRONGEST if law.strongest else applied)[speed]

            return value

        def exponent(quantity: Any, law: Law, applied: float = STRONGEST) -> float:
            """Logarithmic slope d ln y / d ln V between the two velocities."""
            fast, slow = quantity(law, 1, applied), quantity(law, 0, applied)
            return float(np.log(abs(fast / slow)) / np.log(high / low))

        def curve(quantity: Any, law: Law, speed: int) -> Float:
            return np.array([quantity(law, speed, applied) for applied in APPLIED])

        def slopes(*line: Any) -> Float:
            """Logarithmic slopes d ln y / d ln eps between neighbouring amplitudes."""
            return np.diff(np.log(np.abs(curve(*line)))) / np.diff(np.log(APPLIED))

        def ageless(law: str) -> Law:
            """Without the state term, mu0 such that the steady friction at 10 um/s is the same."""
            mu0 = float(self.slider(law).law.mu_ss(high)) - p.A * float(np.log(high / p.V0))
            return Law(law, {"B": 0.0, "mu0": mu0})

        contact = NormalContact(W0=p.W0, lambda_z=p.lambda_z)
        observables = {n: observable(n) for n in ("mu_ss", "delta_mu", "mu1", "mu2")}
        return {
            "slow": 0,
            "fast": 1,
            "RR": Law(RR),
            "LD": Law(LD),
            "EXT": Law(EXT),
            "EXT_measured": Law(EXT, {"lambda_": p.lambda_quasi_static}),
            "LD_low": Law(LD, {"alpha": p.alpha_low}),
            "AMONTONS": Law("amontons"),
            "PRODUCT": Law("strength-area"),
            "RR_ageless": ageless(RR),
            "EXT_ageless": ageless(EXT),
            "EXT_inertia": Law(EXT, inertia=True),
            "vacuum": None,
            **observables,
            "drop": lambda *point: -observables["delta_mu"](*point),
            "exponent": exponent,
            "last_slope": lambda *line: slopes(*line)[-1],
            "slopes": slopes,
            "curve": curve,
            "steps": np.diff,
            "transfer": self.transfer,
            "mu": self.mu_ss,
            "strongest": self.strongest,
            "elastic_slope": self.elastic_slope,
            "borne": self.borne,
            "stiffness": lambda layer: layer.stiffness,
            "disc": lambda radius: self.air_layer(R=radius),
            "air": self.air_layer(),
            "nominal": self.air_layer(R=self.nominal_radius),
            "rarefied": self.air_layer(
                P0=p.P_vacuum, R=self.nominal_radius, temperature=p.gas_temperature
            ),
            "mean_free_path": lambda layer: layer.mean_free_path,
            "squeeze": lambda layer, f: complex(layer.gamma(2 * np.pi * f) * layer.R),
            "bessel": lambda z: complex(bessel_ratio(z)),
            "mindlin": mindlin_length_ratio,
            "load": contact.load,
            "closure": contact.closure,
        }

    # --- Closed forms and the reference integration ----------------------------------------------

    def small_modulation(self, V: float, **overrides: float) -> SmallModulation:
        """Arguments of the closed forms; rigid asperities, no inertia."""
        omega = 2 * np.pi * self.numbers.frequency
        return SmallModulation(**{"omega": omega} | self._point(V, **overrides))

    def operating_point(self, V: float, **overrides: float) -> IntegratedPoint:
        """Arguments of the reference integration; rigid asperities, no inertia."""
        return IntegratedPoint(**self._point(V, **overrides), frequency=self.numbers.frequency)

    def orbit(self, point: IntegratedPoint, epsilon: float, drop: float = 0.0) -> IntegratedOrbit:
        """A periodic orbit of the reference integration, integrated once."""
        return self._once((point, epsilon, drop), lambda: periodic_orbit(point, epsilon, drop))

    def _point(self, V: float, **overrides: float) -> dict[str, Any]:
        p = self.numbers
        point: dict[str, Any] = {n: p[n].si for n in ("A", "B", "D0", "K", "W0")}
        point |= {"V": V} | overrides
        point.setdefault("mu", p.mu0 - (point["B"] - point["A"]) * float(np.log(V / p.V0)))
        return point

    # --- What the text states --------------------------------------------------------------------

    def stated(self) -> dict[str, Pair]:
        """Two numbers of each quantity as the text states them; none is read off a figure.

        drop: "a typical magnitude of this effect is a 20 % decrease" of the mean; no velocity is
        named: -20 % of the friction coefficient at 1 and at 10 um/s. mu1: "of order 1e-3", half a
        decade to either side. ratio: mu2/mu1. mu2: the products of both.
        """
        p = self.numbers
        slow, fast = (-p.relative_drop * self.mu_ss(V) for V in self.velocities)
        low, high = p.mu1_order / 10**0.5, p.mu1_order * 10**0.5
        ratio = self.range_of("mu2_over_mu1")
        mu2 = low * ratio[0], high * ratio[1]
        return {"drop": (slow, fast), "mu1": (low, high), "mu2": mu2, "ratio": ratio}


def at(values: Float, applied: float = STRONGEST) -> Pair:
    """Entries of a curve at one applied amplitude, for the slow and the fast velocity."""
    slow, fast = values[:, APPLIED.index(applied)]
    return float(slow), float(fast)


def by_speed(values: Any, prefix: str = "") -> dict[str, float]:
    """Numbers at the two velocities by their names, with a prefix such as ``"mu1, "``."""
    return {f"{prefix}{name}": float(x) for name, x in zip(SPEEDS, values, strict=True)}
