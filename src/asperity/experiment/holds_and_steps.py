"""Holds and velocity steps of many simulated sliders at once.

Static friction, healing and its rate, relaxation and slip in the hold, the extremum after a step,
and the return to steady sliding. The extremum is located as a root, not among samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.arrays import Bool, Float, batches
from asperity.errors import InputError, require
from asperity.experiment.labelled import Labelled, measured, shaped
from asperity.laws import Law
from asperity.parameters import obeying
from asperity.parameters.arguments import typed
from asperity.slider import QuasiStatic, Slider
from asperity.slider.problem import flatten, require_even_track
from asperity.theory.linear_stability import steady_growth
from asperity.transients.constant_drive import End
from asperity.transients.holds_and_steps import (
    SETTLED,
    HoldResponse,
    SettlingDistance,
    hold,
    settle,
    step,
)

#: Velocity (m/s), and ratio to the drive's, that a slider without inertia reaches by runaway only.
_RUNAWAY, _RUNAWAY_RATIO = 1.0, 1e3
#: Longest hold (s); the square of a longer time might overflow.
_LONGEST = 1e20
#: Numbers of points in a call of the compiled program.
_SHAPES = (64, 1024)
_WITHIN = f"to within {100 * SETTLED:g} % of steady sliding"
#: Step of the finite difference in ln(hold time); its error is that of an integration step.
_STEP = 0.02

_SENTENCES = {
    End.STEADY: "comes back to steady sliding",
    End.RUNAWAY: (
        "accelerates without bound after the extremum: steady sliding is stable, but the "
        "disturbance is too large for this spring and law; take a stiffer spring, or "
        "inertia in asperity.transient"
    ),
    End.TOO_MANY_STEPS: "was not solved: no step was accurate, or more steps than allowed",
    End.CROSSING: "was followed to the extremum only",
}
_RINGING = "did not settle within the steps that are allowed; the extremum is as it should be"
_UNSTABLE = (
    "accelerates without bound after the extremum: the spring is softer than the critical "
    "stiffness; take a stiffer spring, or inertia in asperity.transient"
)


@dataclass(frozen=True, repr=False, kw_only=True)
class _Memory(Labelled):
    """Outcomes of tests of the memory of friction."""

    distance: Float = measured("m", "displacement of the drive to the extremum")
    slip: Float = measured("m", "slip to the extremum")
    settling_distance: Float = measured("m", f"displacement of the drive {_WITHIN}")
    settling_slip: Float = measured("m", f"slip {_WITHIN}")
    stable: Bool = measured("1", "whether steady sliding is stable")
    result: NDArray[np.object_]
    slider: Slider
    velocity: Float = measured("m/s", "velocity of the drive", drive=True)

    def outcomes(self) -> str:
        """Number of points, and number of those that do not settle."""
        texts = self.result.ravel()
        first = texts == _SENTENCES[End.CROSSING]
        lost = int(np.sum((texts != _SENTENCES[End.STEADY]) & ~first))
        points = f"{texts.size} points" + (", followed to the extremum only" if first.any() else "")
        return points + (f", {lost} of which do not settle" if lost else "")


@dataclass(frozen=True, repr=False, kw_only=True)
class Holds(_Memory):
    """Slide-hold-slide tests: static friction, healing and relaxation; arrays of one shape.

    Attributes
    ----------
    hold_time, velocity : array
        s; of the drive before and after the hold (m/s).
    level, minimum, maximum : array
        F/W0 in steady sliding, at the end of the hold, and static friction, at the maximum after
        it. Where friction rises to its steady value without a maximum (`has_maximum`), static
        friction is that value.
    healing : array
        maximum - level, known as Delta mu_s.
    healing_rate : array
        Its derivative with respect to log10(hold time): per decade.
    relaxation : array
        level - minimum, positive.
    hold_slip : array
        Slip in the hold (m).
    end_velocity : array
        Plastic velocity at the end of the hold (m/s).
    velocity_at_maximum : array
        m/s; that of the drive.
    states, states_at_maximum : array, shape (..., size)
        States of the quasi-static motion: spring force (with that of the asperities), then the
        law's.
    distance, slip : array
        Displacement of the drive and of the slider from the end of the hold to the maximum (m).
    settling_distance, settling_slip : array
        The same to where the force stays within 5 % of the healing from its steady value; NaN where
        the motion does not reach it or `settling` is False.
    stable : bool array
        Whether steady sliding is stable: K above the critical stiffness.
    has_maximum : bool array
    result : str array
        Sentence on the motion after the maximum.
    slider : Slider
    """

    shown = ("healing", "healing_rate", "relaxation", "hold_slip", "settling_slip")

    hold_time: Float = measured("s", "duration of the hold", drive=True)
    level: Float = measured("1", "F/W0 of steady sliding")
    minimum: Float = measured("1", "F/W0 at the end of the hold")
    maximum: Float = measured("1", "static friction: F/W0 at the maximum after the hold")
    healing: Float = measured("1", "static friction less the level of sliding")
    healing_rate: Float = measured("1", "healing per decade of hold time")
    relaxation: Float = measured("1", "fall of F/W0 in the hold")
    hold_slip: Float = measured("m", "slip in the hold")
    end_velocity: Float = measured("m/s", "plastic velocity at the end of the hold")
    velocity_at_maximum: Float
    states: Float
    states_at_maximum: Float
    has_maximum: Bool


@dataclass(frozen=True, repr=False, kw_only=True)
class VelocityStepResponse(_Memory):
    """Steps of the drive's velocity from steady sliding; arrays of one shape.

    Attributes
    ----------
    velocity_before, velocity : array
        m/s.
    before, extremum, after : array
        F/W0 in steady sliding before, at the first extremum after the step, and in steady sliding
        at the new velocity. Where there is no extremum (`has_extremum`), it is `after`.
    direct : array
        extremum - before: A ln(V/V_before) of a stiff spring.
    evolution : array
        extremum - after: B ln(V/V_before) of a stiff spring.
    distance, slip : array
        Displacement of the drive and of the slider from the step to the extremum (m).
    settling_distance, settling_slip : array
        The same to where the force stays within 5 % of `evolution` from its steady value; NaN where
        the force does not reach that value.
    states_at_extremum : array, shape (..., size)
    stable, has_extremum : bool array
    result : str array
    slider : Slider
        As for `Holds`.
    """

    shown = ("direct", "evolution", "settling_slip")

    velocity_before: Float = measured("m/s", "velocity of the drive before the step", drive=True)
    before: Float = measured("1", "F/W0 of steady sliding before the step")
    extremum: Float = measured("1", "F/W0 at the first extremum after the step")
    after: Float = measured("1", "F/W0 of steady sliding after the step")
    direct: Float = measured("1", "extremum less F/W0 before the step")
    evolution: Float = measured("1", "extremum less F/W0 in steady sliding after the step")
    states_at_extremum: Float
    has_extremum: Bool


@typed
def hold_response(
    slider: Slider | Law,
    *,
    hold_time: ArrayLike | str,
    velocity: ArrayLike | str,
    stiffness: ArrayLike | str | None = None,
    settling: bool = True,
) -> Holds:
    """Slide steadily, hold the drive, and slide again, for any law and any stiffness.

    Parameters
    ----------
    slider : Slider or Law
        A law alone takes `stiffness`. Its parameters may be arrays, which broadcast with the
        other arguments.
    hold_time : array or str
        Seconds, positive.
    velocity : array or str
        Velocity of the drive before and after the hold (m/s), positive.
    stiffness : array or str, optional
        K/W0 (1/m), of a law alone: ``"0.002 1/um"``.
    settling : bool
        Whether to follow the motion beyond the maximum, to steady sliding or runaway.

    Returns
    -------
    Holds

    Raises
    ------
    InputError
        If a value breaks its rule, or the law does not depend on velocity.

    Notes
    -----
    Inertia is left out. Marone (1998), Eqs. (1)-(6), for the laws there. Integrated at a relative
    1e-11 a step; `maximum` is accurate to about 1e-10.
    """
    slider = _slider(slider, stiffness)
    time = obeying(hold_time, "hold_response.hold_time", "time", "positive")
    longest, rule = float(np.max(time, initial=0.0)), f"be at most {_LONGEST:g} s"
    advice = "asperity.theory.holds_and_steps has the limits of long holds"
    require(longest <= _LONGEST, "hold_response.hold_time", rule, f"{longest:g} s", advice)
    V = obeying(velocity, "hold_response.velocity", "velocity", "positive")
    (flat, V, time), shape = flatten((slider, V, time), "hold_response")

    def run(slider: Slider, V: jax.Array, time: jax.Array) -> tuple:
        response, extremum = hold(slider, V, time)
        after = _settled(slider, V, extremum) if settling else None
        # The derivative by differences of order 4 in ln(hold time).
        moved = (hold(slider, V, time * np.exp(n * _STEP))[0] for n in (-2, -1, 1, 2))
        others = [np.asarray(there.maximum) for there in moved]
        slope = (others[0] - 8 * others[1] + 8 * others[2] - others[3]) / (12 * _STEP)
        return response, after, np.log(10) * slope

    response, after, rate = _in_batches(run, flat, V, time)
    assert isinstance(response, HoldResponse)
    crossing = response.end == End.CROSSING
    names = ("level", "minimum", "maximum", "hold_slip", "states", "states_at_maximum")
    columns = {
        **{name: getattr(response, name) for name in names},
        "hold_time": time,
        "velocity_at_maximum": np.where(crossing, response.velocity_at_maximum * V, np.nan),
        "healing": response.maximum - response.level,
        "healing_rate": rate,
        "relaxation": response.level - response.minimum,
        "end_velocity": response.velocity * V,
        "has_maximum": crossing,
        **_common(response, after, flat, V),
    }
    return Holds(slider=slider, **{name: shaped(a, shape) for name, a in columns.items()})


@typed
def step_response(
    slider: Slider | Law,
    *,
    velocity_before: ArrayLike | str,
    velocity: ArrayLike | str,
    stiffness: ArrayLike | str | None = None,
    settling: bool = True,
) -> VelocityStepResponse:
    """Slide steadily and step the drive's velocity, for any law and any stiffness.

    Parameters
    ----------
    slider, stiffness, settling
        As in `hold_response`.
    velocity_before, velocity : array or str
        Velocities of the drive (m/s), positive and different.

    Returns
    -------
    VelocityStepResponse

    Raises
    ------
    InputError
        If a value breaks its rule, or the law does not depend on velocity.
    """
    slider = _slider(slider, stiffness)
    first = obeying(velocity_before, "step_response.velocity_before", "velocity", "positive")
    V = obeying(velocity, "step_response.velocity", "velocity", "positive")
    (flat, first, V), shape = flatten((slider, first, V), "step_response")
    if np.any(first == V):
        got, advice = f"{V[first == V][0]:g} m/s for both", "leave such points out"
        raise InputError("step_response.velocity", "differ from the one before", got, advice)

    def run(slider: Slider, V: jax.Array, first: jax.Array) -> tuple:
        response, extremum = step(slider, first, V)
        return response, _settled(slider, V, extremum) if settling else None

    response, after = _in_batches(run, flat, V, first)
    crossing = response.end == End.CROSSING
    over = np.where(response.end == End.STEADY, response.after, response.extremum)
    columns = {
        **{n: getattr(response, n) for n in ("before", "after", "states_at_extremum")},
        "velocity_before": first,
        "extremum": over,
        "direct": over - response.before,
        "evolution": over - response.after,
        "has_extremum": crossing,
        **_common(response, after, flat, V),
    }
    return VelocityStepResponse(
        slider=slider, **{name: shaped(a, shape) for name, a in columns.items()}
    )


def _slider(slider: Slider | Law, stiffness: Any) -> Slider:
    if isinstance(slider, Law):
        advice = "give K/W0, as stiffness='0.01 1/um', or a Slider"
        given = stiffness is not None
        require(given, "stiffness", "be given with a law alone", "none", advice)
        K = obeying(stiffness, "stiffness", "per_length", "positive")
        slider = Slider(slider, spring=K, load=1.0)
    elif stiffness is not None:
        advice = "the slider has a spring and a load"
        raise InputError("stiffness", "be left out with a slider", "both", advice)
    law, advice = slider.law, "it has no memory to test"
    require(law.rate_dependent, "law", "depend on the velocity", law.name, advice)
    require_even_track(law, "a hold or a velocity step")
    return slider


def _settled(slider: Slider, V: jax.Array, extremum: Any) -> SettlingDistance:
    runaway = jnp.log(jnp.maximum(_RUNAWAY / V, _RUNAWAY_RATIO))
    return settle(slider, V, extremum, runaway)


def _in_batches(run: Any, slider: Slider, V: Float, *other: Float) -> Any:
    """Run many points in calls of a few fixed sizes, so that few programs are compiled."""
    parts = []
    for index, kept in batches(len(V), _SHAPES):
        arguments = jax.tree.map(lambda a, at=index: jnp.asarray(a[at]), (slider, V, *other))
        parts.append(jax.tree.map(lambda a, n=kept: np.asarray(a)[:n], run(*arguments)))
    return jax.tree.map(lambda *a: np.concatenate(a), *parts)


def _common(
    response: Any, after: SettlingDistance | None, slider: Slider, V: Float
) -> dict[str, Any]:
    """Columns of both tests: displacement to the extremum, stability, and the motion after it."""
    run = lambda slider, V: steady_growth(QuasiStatic(slider, V, 1.0))  # noqa: E731
    stable = np.asarray(_in_batches(run, slider, V) < 0)
    none = np.full(len(V), np.nan)
    crossing = response.end == End.CROSSING
    ends = response.end if after is None else after.end
    texts = np.array([_SENTENCES[End(int(e))] for e in ends], dtype=object)
    texts[(ends == End.RUNAWAY) & ~stable] = _UNSTABLE
    texts[(ends == End.TOO_MANY_STEPS) & crossing] = _RINGING
    return {
        "velocity": V,
        "distance": np.where(crossing, response.distance, np.nan),
        "slip": np.where(crossing, response.slip, np.nan),
        "settling_distance": none if after is None else after.distance,
        "settling_slip": none if after is None else after.slip,
        "stable": stable,
        "result": texts,
    }
