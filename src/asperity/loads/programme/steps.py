"""The steps of a programme: hold, slide, steps and ramps, modulation, recorded signals."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from asperity.errors import require
from asperity.loads.consistency import checked_modulation
from asperity.loads.modulation import Modulation, Periodic, Series, sampled
from asperity.loads.programme.recorded import RecordedSegment, interpolated
from asperity.loads.programme.segment import HarmonicSegment, PeriodicSegment, ProgrammeSegment
from asperity.parameters.arguments import number, typed
from asperity.units import to_radians, to_si

#: Samples of the pulling velocity over a period of a user's modulation.
_SAMPLES = 1024

#: A number in SI, or a text with its unit.
Given: TypeAlias = float | str


class LoadAndVelocity(NamedTuple):
    """Load (N) and pulling velocity (m/s) before or after a step."""

    load: float
    velocity: float


#: Segments of a step, and the load and velocity after the step.
LaidOut: TypeAlias = tuple[list[ProgrammeSegment], LoadAndVelocity]


class ProgrammeStep(ABC):
    """A step of a programme."""

    @abstractmethod
    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """Segments of the step, and the load and velocity after the step.

        Raises
        ------
        InputError
            If a value of the step, which messages call `name`, breaks its rule.
        """


@dataclass(frozen=True)
class Hold(ProgrammeStep):
    """Stop the drive for `duration`; afterwards it continues at the velocity before."""

    duration: Given

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """One segment at rest."""
        return [HarmonicSegment(_duration(self.duration, name), level.load, 0.0)], level


@dataclass(frozen=True)
class Slide(ProgrammeStep):
    """Pull for `duration` at `velocity`, by default at the velocity before."""

    duration: Given
    velocity: Given | None = None

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """One segment."""
        level = level._replace(velocity=_velocity(self.velocity, level, name))
        return [HarmonicSegment(_duration(self.duration, name), level.load, level.velocity)], level


@dataclass(frozen=True)
class StepLoad(ProgrammeStep):
    """Change the load to `to` at once."""

    to: Given

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """No segment: a break point. Friction is defined under a positive load only."""
        return [], level._replace(load=number(self.to, f"{name}.to", "force", "positive"))


@dataclass(frozen=True)
class RampLoad(ProgrammeStep):
    """Change the load to `to` at a constant rate within `duration`."""

    to: Given
    duration: Given

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """One segment."""
        to, duration = number(self.to, f"{name}.to", "force"), _duration(self.duration, name)
        rate = (to - level.load) / duration
        segment = HarmonicSegment(duration, level.load, level.velocity, load_rate=rate)
        return [segment], level._replace(load=to)


@dataclass(frozen=True)
class RampVelocity(ProgrammeStep):
    """Change the pulling velocity to `to` at a constant rate within `duration`."""

    to: Given
    duration: Given

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """One segment."""
        to, duration = number(self.to, f"{name}.to", "velocity"), _duration(self.duration, name)
        rate = (to - level.velocity) / duration
        segment = HarmonicSegment(duration, level.load, level.velocity, pull_rate=rate)
        return [segment], level._replace(velocity=to)


@dataclass(frozen=True)
class Modulate(ProgrammeStep):
    """Modulate the load, W = W1 (1 + eps cos(2 pi f t + phase)), for `duration`.

    Parameters
    ----------
    duration : float or str
        Seconds, `rise` and `fall` included.
    epsilon : float or str
        Relative amplitude. From 1 on contact is lost.
    frequency : float or str
        Hz.
    rise, fall : float or str
        Time (s) over which the amplitude rises and falls smoothly; 0 for a sudden change.
    phase : float or str
        Phase at the beginning (rad); at 0 a sudden beginning is a step of the load by eps.
    velocity : float or str, optional
        Pulling velocity (m/s) from now on; as before by default.
    epsilon_v : float or str
        Relative amplitude of the pulling velocity, in phase with the load, without rise or fall.
    shear_ratio : float
        Shear force per modulated normal force, of an exciter at an angle.
    """

    duration: Given
    epsilon: Given
    frequency: Given
    rise: Given = 0.0
    fall: Given = 0.0
    phase: Given = 0.0
    velocity: Given | None = None
    epsilon_v: Given = 0.0
    shear_ratio: float = 0.0

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """Up to three segments: rise, modulation, fall."""
        whole = _duration(self.duration, name)
        rise = number(self.rise, f"{name}.rise", "time", "not negative")
        fall = number(self.fall, f"{name}.fall", "time", "not negative")
        rule = f"be at least rise and fall together, {rise + fall:g} s"
        advice = "lengthen it or shorten them"
        require(not rise + fall > whole, f"{name}.duration", rule, f"{whole:g} s", advice)
        epsilon = number(self.epsilon, f"{name}.epsilon", "dimensionless", "not negative")
        frequency = number(self.frequency, f"{name}.frequency", "frequency", "positive")
        level = level._replace(velocity=_velocity(self.velocity, level, name))
        common: dict[str, Any] = {
            "load1": level.load,
            "pull1": level.velocity,
            "frequency": frequency,
            "epsilon_v": number(self.epsilon_v, f"{name}.epsilon_v", "dimensionless"),
            "shear_ratio": number(self.shear_ratio, f"{name}.shear_ratio", "dimensionless"),
        }
        segments: list[ProgrammeSegment] = []
        begin = 0.0
        for duration, first, last, change in (
            (rise, 0.0, epsilon, rise),
            (whole - rise - fall, epsilon, epsilon, 0.0),
            (fall, epsilon, 0.0, fall),
        ):
            if duration > 0:
                turns = (frequency * begin) % 1.0
                radians = to_radians(self.phase, f"{name}.phase")
                phase = number(radians, f"{name}.phase", "dimensionless") + 2 * np.pi * turns
                segments.append(
                    HarmonicSegment(
                        duration,
                        epsilon1=first,
                        epsilon2=last,
                        rise=change,
                        phase=phase,
                        **common,
                    )
                )
            begin += duration
        return segments, level


@typed
@dataclass(frozen=True)
class CyclicLoading(ProgrammeStep):
    """A periodic modulation of any form, relative to the present load and velocity.

    Parameters
    ----------
    duration : float or str
        Seconds.
    modulation : Modulation
        Such as `Periodic`, of load, shear force and pulling velocity.
    frequency : float or str
        Hz.
    """

    duration: Given
    modulation: Modulation
    frequency: Given

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """One segment."""
        frequency = number(self.frequency, f"{name}.frequency", "frequency", "positive")
        duration = _duration(self.duration, name)
        modulation = checked_modulation(self.modulation, f"{name}.modulation")
        pull = _pull_series(modulation)
        segment = PeriodicSegment(duration, modulation, frequency, *level, pull)
        return [segment], level


def _pull_series(modulation: Modulation) -> Series:
    """Fourier coefficients of a modulation's pulling velocity: its own, or those of its samples."""
    if isinstance(modulation, Periodic):
        return modulation.pull
    theta = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    return sampled(velocity=np.asarray(modulation.at(theta).pull) * np.ones(_SAMPLES)).pull


@dataclass(frozen=True, eq=False)
class Follow(ProgrammeStep):
    """Follow a recording from its first sample to its last.

    Parameters
    ----------
    time : array, shape (n,)
        Seconds, rising; the first sample is the beginning of the step.
    load : array, shape (n,), optional
        W (N); as before by default.
    velocity : array, shape (n,), optional
        V (m/s); as before by default.
    interpolant : {"pchip", "spline"}
        Piecewise cubic through all samples, from which both W and dW/dt follow. "pchip" never
        overshoots; "spline" has a continuous second derivative, so that steps of the integrator
        may be longer than the time between samples.
    """

    time: ArrayLike
    load: ArrayLike | None = None
    velocity: ArrayLike | None = None
    interpolant: str = "pchip"

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """One segment."""
        time = np.asarray(to_si(self.time, "time", f"{name}.time"), float)
        load, W = interpolated(time, self.load, level.load, "force", self.interpolant, name)
        pull, V = interpolated(
            time, self.velocity, level.velocity, "velocity", self.interpolant, name
        )
        segment = RecordedSegment(
            time[-1] - time[0],
            load,
            pull,
            spacing=np.median(np.diff(time)),
            smooth=self.interpolant == "spline",
            lowest=W.min(),
            fastest=np.abs(V).max(),
        )
        return [segment], LoadAndVelocity(float(W[-1]), float(V[-1]))


def _velocity(velocity: Given | None, level: LoadAndVelocity, name: str) -> float:
    return level.velocity if velocity is None else number(velocity, f"{name}.velocity", "velocity")


def _duration(duration: Given, name: str) -> float:
    return number(duration, f"{name}.duration", "time", "positive")
