"""Slide-hold-slide and velocity-step series, as steps of a programme and as recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from asperity.errors import require
from asperity.experiment.recorded_motion import recorded_motion
from asperity.loads import Hold, ProgrammeStep, Slide
from asperity.loads.programme.segment import ProgrammeSegment
from asperity.loads.programme.steps import Given, LaidOut, LoadAndVelocity
from asperity.parameters.arguments import at_least, typed
from asperity.recording.trace import Trace
from asperity.slider import Slider
from asperity.tribometer.tribometer import Tribometer
from asperity.units import to_si


@dataclass(frozen=True)
class SlideHoldSlide(ProgrammeStep):
    """Slide, then hold and slide again for each hold time.

    Attributes
    ----------
    holds : sequence of float or str
        Hold times (s), in the order of the experiment.
    sliding : float or str
        Duration of sliding before, between and after the holds (s).
    """

    holds: Sequence[Given]
    sliding: Given

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """The segments of all holds."""
        advice = "give some, like 10 s, 100 s"
        require(len(self.holds), f"{name}.holds", "contain a time", "none", advice)
        steps: list[ProgrammeStep] = [Slide(self.sliding)]
        for hold in self.holds:
            steps += [Hold(hold), Slide(self.sliding)]
        return _laid_out(steps, level, name)


@dataclass(frozen=True)
class VelocitySteps(ProgrammeStep):
    """Slide at each velocity in order, over the same load-point displacement.

    Attributes
    ----------
    velocities : sequence of float or str
        Pulling velocities (m/s), in the order of the experiment.
    slip : float or str
        Load-point displacement at each velocity (m).
    """

    velocities: Sequence[Given]
    slip: Given

    def lay_out(self, level: LoadAndVelocity, name: str) -> LaidOut:
        """One segment for each velocity."""
        slip = to_si(self.slip, "length", f"{name}.slip")
        speeds = [to_si(v, "velocity", f"{name}.velocities") for v in self.velocities]
        moving = speeds and min([*speeds, slip]) > 0
        got = f"{len(speeds)} velocities and {slip:g} m"
        rule, advice = "have positive velocities and slip", "hold with 'hold 10 s'"
        require(moving, name, rule, got, advice)
        return _laid_out([Slide(slip / v, velocity=v) for v in speeds], level, name)


def _laid_out(steps: Sequence[ProgrammeStep], level: LoadAndVelocity, name: str) -> LaidOut:
    segments: list[ProgrammeSegment] = []
    for step in steps:
        more, level = step.lay_out(level, name)
        segments += more
    return segments, level


@typed
def slide_hold_slide(
    slider: Slider,
    tribometer: Tribometer,
    holds: Sequence[float | str],
    *,
    velocity: float | str,
    sliding: float | str = "10 s",
    seed: Annotated[int, at_least(0)] = 0,
    **options: Any,
) -> Trace:
    """Record a slide-hold-slide series on a simulated slider.

    Parameters
    ----------
    slider : Slider
    tribometer : Tribometer
        With any of the channels ``"shear force"``, ``"normal force"``, ``"displacement"`` of the
        slider and ``"drive position"``, the load-point displacement.
    holds : sequence of float or str
        Hold times (s).
    velocity : float or str
        Velocity of the drive in sliding (m/s).
    sliding : float or str
        Duration of sliding before, between and after the holds (s).
    seed : int
        Seed of the tribometer's noise.
    **options
        Options of `asperity.transients.transient`.

    Raises
    ------
    InputError
        If a value breaks its rule, or the motion ends before the series does.
    """
    series = [SlideHoldSlide(tuple(holds), sliding)]
    speed = to_si(velocity, "velocity", "slide_hold_slide.velocity")
    rule = "slide_hold_slide.slider must slide to the end of the series"
    return recorded_motion(slider, tribometer, series, speed, rule, seed=seed, options=options)


@typed
def velocity_steps(
    slider: Slider,
    tribometer: Tribometer,
    velocities: Sequence[float | str],
    *,
    slip: float | str,
    seed: Annotated[int, at_least(0)] = 0,
    **options: Any,
) -> Trace:
    """Record a series of velocity steps at equal slip on a simulated slider.

    Parameters
    ----------
    slider, tribometer, seed, **options
        As in `slide_hold_slide`.
    velocities : sequence of float or str
        Velocities of the drive (m/s); the series begins with steady sliding at the first.
    slip : float or str
        Load-point displacement at each velocity (m).

    Raises
    ------
    InputError
        If a value breaks its rule, or the motion ends before the series does.
    """
    series = [VelocitySteps(tuple(velocities), slip)]
    first = velocities[0] if len(velocities) else 0.0
    speed = to_si(first, "velocity", "velocity_steps.velocity")
    rule = "velocity_steps.slider must slide to the end of the series"
    return recorded_motion(slider, tribometer, series, speed, rule, seed=seed, options=options)
