"""Segments of a load and drive programme between break points, as input of compiled programs.

Every number of a segment is an array, never part of the program's structure: two protocols made of
the same kinds of segment run the same compiled program. Times are counted from the beginning of the
segment, so that phases keep their digits in long programmes.

Formulas describe levels, ramps, and harmonic and other periodic modulations.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity._jax import configure
from asperity.loads.modulation import Excitation, Modulation, Periodic, Series, fourier_sum

configure()  # double precision, before any segment makes an array

#: Type of a number of a segment: an array of shape ().
Scalar: TypeAlias = Any


def number(default: float) -> Any:
    """Declare an optional number of a segment."""
    # Arrays, not Python numbers: each Python number would need another compiled program.
    return eqx.field(converter=jnp.asarray, default=default)


class ProgrammeSegment(eqx.Module):
    """Load, shear force and pulling velocity over a length of time.

    Attributes
    ----------
    duration : array, shape ()
        Seconds, positive.
    """

    duration: eqx.AbstractVar[Scalar]

    @abstractmethod
    def at(self, t: ArrayLike, W0: ArrayLike, V: ArrayLike) -> Excitation:
        """Values over `W0` (N) and `V` (m/s); slopes are derivatives with respect to time.

        The shear force acts along the pulling direction, in addition to the spring's.
        """

    @abstractmethod
    def position(self, t: ArrayLike) -> Array:
        """Displacement of the far end of the spring since the beginning of the segment (m)."""

    @property
    @abstractmethod
    def lowest_load(self) -> float:
        """A lower bound of W (N), exact where it is positive or nearly so."""

    def surely_above(self, load: float) -> float:
        """A time (s) up to which W is larger than `load` (N) for certain."""
        return 0.0

    @property
    @abstractmethod
    def fastest_pull(self) -> float:
        """An upper bound of the size of the pulling velocity (m/s)."""

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Longest step (s) that misses no change of the programme."""

    def next_kink(self, t: ArrayLike) -> ArrayLike:
        """The next time (s) after `t` at which a step should end."""
        return jnp.inf

    @property
    def period(self) -> float | None:
        """Period of the modulation (s); None without one."""
        return None

    @property
    def constant(self) -> bool:
        """Whether load and pulling velocity are constant."""
        return False


#: W (N) and the pulling velocity (m/s) of a segment at times (s), each by one program.
load_of = jax.jit(lambda segment, t: segment.at(t, 1.0, 1.0).w)
pull_of = jax.jit(lambda segment, t: segment.at(t, 1.0, 1.0).pull)


def _smooth_rise(x: Any) -> Any:
    """From 0 at x = 0 to 1 at x = 1, where first and second derivative vanish."""
    return x**3 * (10 - 15 * x + 6 * x**2)


class HarmonicSegment(ProgrammeSegment):
    """Load and velocity that rise or fall linearly, with a harmonic modulation on top.

        W = (W1 + dW t) (1 + eps(t) cos psi),     psi = 2 pi f t + phase,
        V = (V1 + dV t) (1 + eps_v cos psi),      S = ratio (W - W1 - dW t).

    eps(t) goes smoothly, with two continuous derivatives, from eps1 to eps2 within `rise`.

    Parameters
    ----------
    duration : array
        Seconds.
    load1, load_rate : array
        W1 (N) and dW (N/s).
    pull1, pull_rate : array
        V1 (m/s) and dV (m/s^2).
    epsilon1, epsilon2, rise : array
        Relative amplitudes and the time (s) from one to the other; 0 is sudden.
    frequency, phase : array
        f (Hz) and the phase (rad) at the beginning of the segment.
    epsilon_v : array
        Relative amplitude of the pulling velocity.
    shear_ratio : array
        Shear force per modulated normal force, of an exciter at an angle.
    """

    duration: Scalar = eqx.field(converter=jnp.asarray)
    load1: Scalar = eqx.field(converter=jnp.asarray)
    pull1: Scalar = eqx.field(converter=jnp.asarray)
    load_rate: Scalar = number(0.0)
    pull_rate: Scalar = number(0.0)
    epsilon1: Scalar = number(0.0)
    epsilon2: Scalar = number(0.0)
    rise: Scalar = number(0.0)
    frequency: Scalar = number(0.0)
    phase: Scalar = number(0.0)
    epsilon_v: Scalar = number(0.0)
    shear_ratio: Scalar = number(0.0)

    def _turn(self, t: ArrayLike) -> tuple[Array, Array]:
        """Cosine and sine of psi."""
        angle = 2 * jnp.pi * self.frequency * jnp.asarray(t)
        cos, sin = jnp.cos(self.phase), jnp.sin(self.phase)
        rotation = jnp.stack([cos, -sin, sin, cos]).reshape(2, 2, *[1] * angle.ndim)
        # XLA computes a sum over an axis once, but a cosine again for every number that depends on
        # it; this would double the time of a step.
        turned = (rotation * jnp.stack([jnp.cos(angle), jnp.sin(angle)])).sum(axis=1)
        return turned[0], turned[1]

    def at(self, t: ArrayLike, W0: ArrayLike, V: ArrayLike) -> Excitation:
        """As in `ProgrammeSegment`; one cosine and one sine serve all values."""
        cos, sin = self._turn(t)
        slow = self.rise > 0
        x = jnp.where(slow, jnp.clip(t / jnp.where(slow, self.rise, 1.0), 0.0, 1.0), 1.0)
        change = self.epsilon2 - self.epsilon1
        epsilon = self.epsilon1 + change * _smooth_rise(x)
        growth = 30 * (x * (1 - x)) ** 2 * change / jnp.where(slow, self.rise, 1.0)
        level = self.load1 + self.load_rate * t
        part = level * epsilon * cos
        turning = 2 * jnp.pi * self.frequency * sin
        rate = self.load_rate * epsilon * cos + level * (growth * cos - epsilon * turning)
        pull = (self.pull1 + self.pull_rate * t) * (1 + self.epsilon_v * cos)
        return Excitation(
            (level + part) / W0,
            (self.load_rate + rate) / W0,
            self.shear_ratio * part / W0,
            self.shear_ratio * rate / W0,
            pull / V,
        )

    def position(self, t: ArrayLike) -> Array:
        """Integral of V, in closed form."""
        smooth = self.pull1 * t + 0.5 * self.pull_rate * t**2
        turns = self.frequency > 0
        omega = 2 * jnp.pi * jnp.where(turns, self.frequency, 1.0)
        cos, sin = self._turn(t)
        cos0, sin0 = self._turn(0.0)
        swing = self.pull1 * (sin - sin0) / omega
        swing = swing + self.pull_rate * (t * sin / omega + (cos - cos0) / omega**2)
        return smooth + self.epsilon_v * jnp.where(turns, swing, smooth * cos0)

    @property
    def lowest_load(self) -> float:
        """The smaller level of beginning and end, less the larger amplitude."""
        begin, rate = float(self.load1), float(self.load_rate)
        epsilon = max(abs(float(self.epsilon1)), abs(float(self.epsilon2)))
        return min(begin, begin + rate * float(self.duration)) * (1 - epsilon)

    def surely_above(self, load: float) -> float:
        """Time until a growing amplitude may reach `load`, for a constant level."""
        begin, end, rise = float(self.epsilon1), float(self.epsilon2), float(self.rise)
        level, duration = float(self.load1), float(self.duration)
        if float(self.load_rate) != 0 or rise <= 0 or abs(end) <= abs(begin) or begin * end < 0:
            return 0.0
        low, high = 0.0, min(rise, duration) / rise
        while low < (x := 0.5 * (low + high)) < high:  # until doubles are exhausted
            epsilon = begin + (end - begin) * _smooth_rise(x)
            above = level * (1 - abs(epsilon)) > load
            low, high = (x, high) if above else (low, x)
        low *= rise
        return low if level * (1 - abs(begin)) > load else 0.0

    @property
    def fastest_pull(self) -> float:
        """The larger velocity of beginning and end, with the modulation."""
        begin, rate = float(self.pull1), float(self.pull_rate)
        fastest = max(abs(begin), abs(begin + rate * float(self.duration)))
        return fastest * (1 + abs(float(self.epsilon_v)))

    @property
    def longest_step(self) -> float:
        """A tenth of a period, or an eighth of a ramp."""
        if self._swings:
            return 0.1 / float(self.frequency)
        duration = float(self.duration)
        return duration if self.constant else duration / 8

    @property
    def _swings(self) -> bool:
        amplitudes = (self.epsilon1, self.epsilon2, self.epsilon_v)
        return float(self.frequency) > 0 and any(float(a) != 0 for a in amplitudes)

    @property
    def _level(self) -> bool:
        """Whether load, velocity and amplitude are constant."""
        fixed = float(self.epsilon1) == float(self.epsilon2) or float(self.rise) == 0
        return fixed and float(self.load_rate) == 0 and float(self.pull_rate) == 0

    @property
    def period(self) -> float | None:
        """1/f of a steady modulation."""
        return 1 / float(self.frequency) if self._swings and self._level else None

    @property
    def constant(self) -> bool:
        """Neither ramp nor modulation."""
        return self._level and not self._swings


#: Instants of a period of a modulation at which it is evaluated.
_INSTANTS = 4096


def _dominant(values: ArrayLike) -> int:
    """Number of harmonics with half of the variance of a period: many for a narrow pulse."""
    period = np.round(np.asarray(values) * np.ones(_INSTANTS), 12)  # a constant without rounding
    power = np.cumsum(np.abs(np.fft.rfft(period)[1:]) ** 2)
    return int(np.searchsorted(power, power[-1] / 2)) + 1


class PeriodicSegment(ProgrammeSegment):
    """A periodic modulation of any form about constant levels.

    Parameters
    ----------
    duration : array
        Seconds.
    modulation : Modulation
        Over its means, such as `Periodic`.
    frequency : array
        Hz.
    load1, pull1 : array
        Mean load (N) and mean pulling velocity (m/s).
    pull_series : Series
        Fourier coefficients of the pulling velocity of the modulation.
    """

    duration: Scalar = eqx.field(converter=jnp.asarray)
    modulation: Modulation
    frequency: Scalar = eqx.field(converter=jnp.asarray)
    load1: Scalar = eqx.field(converter=jnp.asarray)
    pull1: Scalar = eqx.field(converter=jnp.asarray)
    pull_series: Series

    @property
    def _omega(self) -> Array:
        return 2 * jnp.pi * self.frequency

    def at(self, t: ArrayLike, W0: ArrayLike, V: ArrayLike) -> Excitation:
        """As in `ProgrammeSegment`."""
        at, level = self.modulation.at(self._omega * t), self.load1
        return Excitation(
            level * at.w / W0,
            level * at.w_slope * self._omega / W0,
            level * at.shear / W0,
            level * at.shear_slope * self._omega / W0,
            self.pull1 * at.pull * jnp.ones_like(t) / V,
        )

    def position(self, t: ArrayLike) -> Array:
        """Integral of V, term by term."""
        integral = tuple((-b / k, a / k) for k, (a, b) in enumerate(self.pull_series, start=1))
        swing = fourier_sum(integral, self._omega * t)[0] - fourier_sum(integral, 0.0)[0]
        return self.pull1 * (jnp.asarray(t) + swing / self._omega)

    def _over_a_period(self) -> np.ndarray:
        return np.arange(_INSTANTS) / _INSTANTS / float(self.frequency)

    @property
    def lowest_load(self) -> float:
        """The lowest load at the instants of a period."""
        return float(np.min(load_of(self, self._over_a_period())))

    @property
    def fastest_pull(self) -> float:
        """The fastest pull at the instants of a period."""
        return float(np.max(np.abs(pull_of(self, self._over_a_period()))))

    @property
    def longest_step(self) -> float:
        """A tenth of the period of the highest harmonic, of a user's load of its dominant ones."""
        modulation = self.modulation
        if isinstance(modulation, Periodic):
            highest = max(map(len, (modulation.load, modulation.shear, modulation.pull)))
        else:
            at = modulation.at(2 * np.pi * np.arange(_INSTANTS) / _INSTANTS)
            highest = max(_dominant(part) for part in (at.w, at.shear, at.pull))
        return 0.1 / float(self.frequency) / max(1, highest)

    @property
    def period(self) -> float | None:
        """1/f."""
        return 1 / float(self.frequency)
