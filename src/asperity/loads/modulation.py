"""Excitation of the slider at an instant, and modulations over a period.

A modulation is harmonic, has Fourier coefficients, or is made from amplitudes and phases or from a
sampled period.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, Self, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.arrays import Float
from asperity.errors import InputError, require
from asperity.parameters.arguments import at_least, shown, typed
from asperity.parameters.rules import obeying
from asperity.units import to_radians, to_si


class Excitation(NamedTuple):
    """Values and slopes at a phase theta = omega t; slopes are derivatives with respect to theta.

    Constant quantities keep their default, a number that compiled programs fold away.

    Attributes
    ----------
    w, w_slope : array
        Normal load W/W0 and its slope.
    shear, shear_slope : array
        Force on the slider along the pulling direction in addition to the spring's, over W0, and
        its slope, such as from an exciter at an angle.
    pull : array
        Velocity of the far end of the spring over its mean V.
    """

    w: Array
    w_slope: ArrayLike = 0.0
    shear: ArrayLike = 0.0
    shear_slope: ArrayLike = 0.0
    pull: ArrayLike = 1.0


class Modulation(eqx.Module):
    """One period of an excitation; its arrays carry the operating points along the last axis."""

    @abstractmethod
    def at(self, theta: ArrayLike) -> Excitation:
        """Values and slopes at the phase `theta` (rad)."""

    @property
    @abstractmethod
    def amplitude(self) -> ArrayLike:
        """Amplitude of the first harmonic of W/W0."""

    @abstractmethod
    def scaled(self, share: ArrayLike) -> Self:
        """The modulation with `share` of its amplitude: 0 is steady sliding."""

    @property
    @abstractmethod
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""


class Harmonic(Modulation):
    """One period of w(theta) = 1 + eps cos(theta), theta = omega t.

    Parameters
    ----------
    epsilon : array
        Relative amplitude, 0 <= eps < 1 (contact is never lost). Where an air
        layer bears part of the modulation this is the part that the contacts carry.
    """

    epsilon: ArrayLike

    def at(self, theta: ArrayLike) -> Excitation:
        """Load and slope at the phase `theta` (rad)."""
        return Excitation(
            w=jnp.asarray(1 + self.epsilon * jnp.cos(theta)), w_slope=-self.epsilon * jnp.sin(theta)
        )

    @property
    def amplitude(self) -> ArrayLike:
        """Relative amplitude epsilon."""
        return self.epsilon

    @property
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""
        return "w(t) = 1 + eps cos(w t)"

    def scaled(self, share: ArrayLike) -> Harmonic:
        """The modulation with `share` of its amplitude: 0 is steady sliding."""
        return Harmonic(self.epsilon * share)


#: Pairs (a_k, b_k) for k = 1, 2, ...; arrays over the operating points.
Series: TypeAlias = tuple[tuple[ArrayLike, ArrayLike], ...]


@typed
class Periodic(Modulation):
    """One period of an excitation given by Fourier coefficients.

    w(theta) = 1 + sum a_k cos k theta + b_k sin k theta with theta = omega t, and the same, without
    the 1, for the shear force over W0, and with it for the pulling velocity over V.

    Parameters
    ----------
    load, shear, pull : tuple of pairs
        (a_k, b_k) for k = 1, 2, ...; empty where nothing is modulated. The load must stay
        positive; `modulated` and `sampled` check it.
    """

    load: Series = ()
    shear: Series = ()
    pull: Series = ()

    def at(self, theta: ArrayLike) -> Excitation:
        """Values and slopes at the phase `theta` (rad)."""
        w, w_slope = fourier_sum(self.load, theta)
        shear, shear_slope = fourier_sum(self.shear, theta)
        pull, _ = fourier_sum(self.pull, theta)
        return Excitation(1 + w, w_slope, shear, shear_slope, 1 + pull)

    @property
    def amplitude(self) -> ArrayLike:
        """Amplitude of the first harmonic of the load; 0 where the load is constant."""
        return jnp.hypot(*self.load[0]) if self.load else 0.0

    @property
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""
        parts = {"w(t)": ("1", self.load), "shear/W0": ("", self.shear), "V(t)/V": ("1", self.pull)}
        modulated = (
            f"{name} = {_written(mean, series)}" for name, (mean, series) in parts.items() if series
        )
        return ", ".join(modulated) or "w(t) = 1"

    def scaled(self, share: ArrayLike) -> Periodic:
        """The modulation with `share` of its amplitude: 0 is steady sliding."""
        parts = (self.load, self.shear, self.pull)
        return Periodic(*(tuple((share * a, share * b) for a, b in s) for s in parts))


@jax.jit
def fourier_sum(series: Series, theta: ArrayLike) -> tuple[Array, Array]:
    """Sum of the terms of a series at the phases `theta` (rad), and its slope."""
    parts = [part for pair in series for part in pair]
    none = jnp.zeros(jnp.broadcast_shapes(jnp.shape(theta), *map(jnp.shape, parts)))
    if not series:
        return none, none
    a, b = (jnp.stack(jnp.broadcast_arrays(*some)) for some in (parts[::2], parts[1::2]))

    def with_term(sums: tuple[Array, Array], term: tuple[Array, ...]) -> tuple[Any, None]:
        (value, slope), (k, a, b) = sums, term
        cos, sin = jnp.cos(k * theta), jnp.sin(k * theta)
        return (value + (a * cos + b * sin), slope + k * (b * cos - a * sin)), None

    terms = (jnp.arange(1, len(series) + 1), a, b)
    return jax.lax.scan(with_term, (none, none), terms, unroll=_UNROLLED)[0]


def _written(mean: str, series: Series) -> str:
    terms = [mean] if mean else []
    for k, pair in enumerate(series, start=1):
        for value, function in zip(pair, ("cos", "sin"), strict=True):
            low, high = float(np.min(value)), float(np.max(value))
            if low == high == 0:
                continue
            number = f"({low!r})" if low == high else f"({low!r} to {high!r})"
            terms.append(f"{number} {function}({k} w t)")
    return " + ".join(terms) or "0"


#: Numbers of phases, over the period and over that of the highest harmonic, at which the load is
#: checked to be positive: a dip has the width of the highest harmonic's period.
_PHASES, _PHASES_OF_HARMONIC = 720, 16

#: Terms of a series that are compiled one by one, so that XLA fuses them with what they are used
#: in. More terms are the passes of a loop: the time to compile does not grow with their number.
_UNROLLED = 8

#: Fourier coefficients of a sampled period below this share of the largest are left out.
_NEGLIGIBLE = 1e-13

#: Largest mean of a shear force, over its largest sample.
_MEAN = 1e-6


@typed
def modulated(
    epsilon: ArrayLike | str = 0.0,
    *,
    load: Mapping[int, Any] | None = None,
    pull: ArrayLike | str = 0.0,
    pull_phase: ArrayLike | str = 0.0,
    tilt: ArrayLike | str = 0.0,
) -> Periodic:
    """Modulation of load, shear force and pulling velocity from amplitudes and phases.

        W/W0 = 1 + eps cos wt + sum over n of e_n cos(n wt + p_n)
        V(t) = V [1 + pull cos(wt + pull_phase)]

    Parameters
    ----------
    epsilon : array or str
        Relative amplitude of the load at the modulation frequency, its phase being zero.
    load : mapping of int to pair, optional
        Further harmonics of the load: n -> (e_n, p_n), phases in rad or texts like ``"30 deg"``.
    pull : array or str
        Amplitude of the pulling velocity over its mean (dimensionless).
    pull_phase : array or str
        Phase of the pulling velocity against the load (rad).
    tilt : array or str
        Angle between the direction in which the modulated force acts and the interface's normal
        (rad, in (-pi/2, pi/2)), positive where a growing load also pushes the slider along
        the pulling direction. The shear force on the slider is then tan(tilt) times the modulated
        part of the load.

    Returns
    -------
    Periodic

    Raises
    ------
    InputError
        If the load would vanish within the period, or a value breaks its rule.
    """
    series = _load_series(epsilon, load)
    speed = _pair(to_si(pull, "dimensionless", "pull"), to_radians(pull_phase, "pull_phase"))
    gain = np.tan(obeying(to_radians(tilt, "tilt"), "tilt", "dimensionless", "below a right angle"))
    shear = tuple((gain * a, gain * b) for a, b in series) if np.any(gain) else ()
    require_contact_within_period(series)
    swing = (speed,) if any(np.any(part) for part in speed) else ()
    return Periodic(series, shear, swing)


def lowest_load(
    epsilon: ArrayLike | str = 0.0, load: Mapping[int, tuple[Any, Any]] | None = None
) -> Float:
    """Lowest W/W0 over the period at each point; a lower bound of it where that is positive.

    Parameters
    ----------
    epsilon, load
        As for `modulated`, of shape (points,).
    """
    return np.ravel(_lowest_load(_load_series(epsilon, load)))


def no_contact(lowest: float) -> str:
    """The sentence for a load whose lowest W/W0 is not positive."""
    return (
        f"load must stay positive over the period, so that contact is never lost, got a "
        f"lowest W/W0 of {lowest:.4g}; lower the amplitudes"
    )


@typed
def sampled(
    load: ArrayLike | None = None,
    *,
    velocity: ArrayLike | None = None,
    shear: ArrayLike | None = None,
    harmonics: Annotated[int, at_least(1)] | None = None,
) -> Periodic:
    """Modulation from evenly spaced samples of one period, the first at theta = 0.

    Between the samples the signal is their trigonometric interpolation, as exact as the samples
    are for a signal with harmonics below half their number only.

    The phases of a response count from the first sample: for phases against the load begin where
    the first harmonic of the load is largest.

    Parameters
    ----------
    load : array, shape (samples,), optional
        W at each sample, in any unit: only its ratio to its mean counts, and W0 is the load of the
        slider. The `epsilon` of a response is the amplitude of the first harmonic over the mean,
        not half the distance between the largest and the smallest sample. Without any variation
        the load is constant.
    velocity : array, shape (samples,), optional
        Pulling velocity in any unit: only its ratio to its mean counts, and V is the argument of
        the response.
    shear : array, shape (samples,), optional
        Force on the slider along the pulling direction, in addition to the spring's, over W0, of
        mean zero.
    harmonics : int, optional
        Harmonics to keep, all by default.

    Raises
    ------
    InputError
        If samples are missing or not finite, the mean of load or velocity is not positive, that of
        the shear force is not zero, or the load vanishes.
    """
    given = {"load": load, "velocity": velocity, "shear": shear}
    if all(values is None for values in given.values()):
        raise InputError("load, velocity or shear", "be given", "none", "give samples of one")
    series = {name: _series_of(name, values, harmonics) for name, values in given.items()}
    require_contact_within_period(series["load"])
    return Periodic(series["load"], series["shear"], series["velocity"])


def _load_series(epsilon: ArrayLike | str, load: Mapping[int, tuple[Any, Any]] | None) -> Series:
    """Fourier coefficients of the load."""
    terms = {1: (to_si(epsilon, "dimensionless", "epsilon"), 0.0)}
    for n, term in (load or {}).items():
        rule = "have harmonics from 2 on"
        require(n >= 2, "load", rule, n, "give the first one as epsilon")
        try:
            amplitude, phase = term
        except (TypeError, ValueError):
            rule = "be a pair of amplitude and phase"
            advice = f"write it like load={{{n}: (0.1, 0.0)}}"
            raise InputError(f"load[{n}]", rule, shown(term), advice) from None
        size = to_si(amplitude, "dimensionless", f"load[{n}]")
        terms[int(n)] = (size, to_radians(phase, f"load[{n}]"))
    return tuple(_pair(*terms.get(n, (0.0, 0.0))) for n in range(1, max(terms) + 1))


def _pair(amplitude: ArrayLike, phase: ArrayLike) -> tuple[ArrayLike, ArrayLike]:
    """Coefficients of cos and sin of amplitude cos(n theta + phase)."""
    size = np.asarray(amplitude, float)
    return size * np.cos(phase), -size * np.sin(phase)


def _series_of(name: str, values: ArrayLike | None, harmonics: int | None) -> Series:
    if values is None:
        return ()
    samples = np.asarray(to_si(values, "dimensionless", name), float)
    holds = samples.ndim == 1 and len(samples) >= 3 and np.isfinite(samples).all()
    rule, got = "be at least 3 finite samples of one period", f"an array of shape {samples.shape}"
    require(holds, name, rule, got, "give evenly spaced samples without the end point")
    spectrum = np.fft.rfft(samples) / len(samples)
    if len(samples) % 2 == 0:
        # Half of it is of the negative frequency; of the sine, which is zero at the samples, none.
        spectrum[-1] /= 2
    mean = scale = spectrum[0].real
    if name == "shear":
        scale, rule = 1.0, "have a mean of zero"
        advice = "subtract it: a constant force only shifts that of the spring"
        require(abs(mean) <= _MEAN * np.abs(samples).max(), name, rule, f"{mean:g}", advice)
    else:
        rule, advice = "have a positive mean", "give it in the sense of sliding"
        require(mean > 0, name, rule, f"{mean:g}", advice)
    top = len(samples) // 2
    kept = spectrum[1 : min(top, harmonics or top) + 1] / scale
    size = np.abs(kept).max(initial=0.0)
    kept = kept[: np.flatnonzero(np.abs(kept) > _NEGLIGIBLE * size).max(initial=-1) + 1]
    return tuple((2 * c.real, -2 * c.imag) for c in kept)


def require_contact_within_period(series: Series) -> None:
    """Raise `InputError` where the load does not stay positive over the period."""
    lowest = float(np.min(_lowest_load(series), initial=np.inf))
    if not lowest > 0:
        raise InputError(no_contact(lowest))


def _lowest_load(series: Series) -> Float:
    """Lowest W/W0 over the period at each point, a few points at a time.

    Where the amplitudes together are below 1 it is their bound 1 - sum e_n instead.
    """
    pairs = [np.broadcast_arrays(a, b) for a, b in series]
    shape = np.broadcast_shapes(*(np.shape(a) for a, _ in pairs))
    flat = [[np.broadcast_to(part, shape).ravel() for part in pair] for pair in pairs]
    lowest = 1 - sum((np.hypot(a, b) for a, b in flat), np.zeros(int(np.prod(shape))))
    doubtful = np.flatnonzero(~(lowest > 0))
    count = max(_PHASES, _PHASES_OF_HARMONIC * len(flat))
    phases = 2 * np.pi * np.arange(count)[:, None] / count
    at_once = max(1, 4096 * _PHASES // count)
    for start in range(0, len(doubtful), at_once):
        part = doubtful[start : start + at_once]
        w = sum(
            a[part] * np.cos(k * phases) + b[part] * np.sin(k * phases)
            for k, (a, b) in enumerate(flat, start=1)
        )
        lowest[part] = 1 + np.min(w, axis=0)
    return lowest.reshape(shape)
