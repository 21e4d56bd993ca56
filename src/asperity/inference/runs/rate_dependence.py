"""Rate dependence of a recorded run from its steady friction, without a law.

A fit of a law uses the whole motion with its transients. The levels before and after each velocity
step, as `asperity.measure` reads them, are another estimate of d mu/d ln V from the same samples.
Reports show both; no test decides between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from asperity.arrays import Float
from asperity.errors import InputError
from asperity.measurement.levels_and_trends import weighted_mean
from asperity.measurement.sliding.measure import measure_sliding
from asperity.questions.recording import Measurement as Question
from asperity.recording.trace import Channel, Trace

#: d mu/d ln V of a velocity step, and its standard uncertainty.
LevelRate = tuple[float, float]


class LevelChange(NamedTuple):
    """Change of steady friction over ln V.

    Attributes
    ----------
    value, uncertainty : float
        Weighted mean of the steps, and its standard uncertainty by those of the steps or by their
        scatter, whichever is larger.
    steps : int
    """

    value: float
    uncertainty: float
    steps: int


def level_change(rates: Sequence[LevelRate]) -> LevelChange | None:
    """Weighted mean over the steps; None without steps."""
    if not rates:
        return None
    values, errors = np.array(rates).T
    return LevelChange(*weighted_mean(values, errors), values.size)


def level_rates(
    time: Float, friction: Float, load: Float, steps: Sequence[float], velocities: Sequence[float]
) -> tuple[LevelRate, ...]:
    """Rates of all velocity steps with measurable levels; empty if the load varies.

    Parameters
    ----------
    time, friction, load : array, shape (n,)
        Time (s), F/W, and the load in any unit.
    steps : sequence of float
        Times (s) at which the pulling velocity changes.
    velocities : sequence of float
        Pulling velocities between the steps (m/s), 0 in a hold.
    """
    channels = {"mu": Channel(friction, "dimensionless"), "load": Channel(load, "dimensionless")}
    trace = Trace(time, channels, roles={"friction": "mu", "W": "load"})
    try:
        measured = measure_sliding(
            trace, Question(steps=tuple(steps), velocities=tuple(velocities))
        )
    except InputError:
        # The levels are an addition to the fit: a step without levels is no error.
        return ()
    if any(check.name == "load" and check.verdict != "ok" for check in measured.checks):
        return ()
    return tuple(
        (step.rate_dependence, step.rate_uncertainty)
        for step in measured.steps
        if step.rate_uncertainty > 0
    )
