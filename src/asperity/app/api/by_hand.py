"""A law's friction over the drive of a recording, with numbers that are moved by hand."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from asperity.app.endpoints import Answer, Question
from asperity.errors import InputError, require
from asperity.laws import get_law
from asperity.loads import Hold, Programme, Slide
from asperity.slider.named import slider_from
from asperity.transients import transient

#: Tolerance, and steps after which numbers are refused: a curve that follows a slider.
_RTOL, _MOST_STEPS = 1e-5, 20_000
#: Points of the curve.
_MOST = 800

Array = NDArray[np.float64]
_Number = Annotated[float, Field(allow_inf_nan=False)]


class Driven(Question):
    """A law, its numbers, and how the slider is pulled.

    Attributes
    ----------
    law : str
    numbers : dict of str to float
        Of the law, with K over the load (1/m) as ``K/W0``; SI.
    segments : list of (float, float)
        Durations (s) and pulling velocities (m/s), 0 in a hold; the first one is steady sliding.
    """

    law: Annotated[str, Field(max_length=60)]
    numbers: Annotated[dict[str, _Number], Field(max_length=40)]
    segments: Annotated[list[tuple[_Number, _Number]], Field(min_length=1, max_length=200)]


def model(question: Driven) -> dict[str, Any]:
    """Friction F/W over time (s) from the beginning; ``stopped`` says why it ends before its end.

    Raises
    ------
    InputError
        If a number or a segment breaks its rule.
    """
    law = get_law(question.law)
    velocity = question.segments[0][1]
    rule = "begin with sliding"
    require(velocity > 0, "segments", rule, f"{velocity:g} m/s", "cut the recording")
    numbers = dict(question.numbers)
    stiffness = numbers.pop("K/W0", None)
    if stiffness is None:
        raise InputError("numbers", "have K/W0", "none", "give the stiffness over the load in 1/m")
    steps: list[Any] = [
        Slide(duration=length, velocity=v) if v > 0 else Hold(duration=length)
        for length, v in question.segments
    ]
    # Of a load of 1 N; friction is that of any.
    slider = slider_from(law, {**numbers, "K": stiffness, "W0": 1.0})
    programme = Programme(*steps, load=1.0, velocity=velocity)
    times = _times(np.array([length for length, _ in question.segments]))
    motion = transient(slider, programme, sampling=times, rtol=_RTOL, most_steps=_MOST_STEPS)
    stopped = "" if motion.termination is None else str(motion.termination)
    return {"time": motion.time, "friction": motion.force / motion.load, "stopped": stopped}


def _times(lengths: Array) -> Array:
    """Times (s) of the curve: dense after each change."""
    points = max(_MOST // lengths.size, 8)
    share = np.append(0.0, np.geomspace(1e-4, 1.0, points))
    begins = np.append(0.0, np.cumsum(lengths)[:-1])
    times = np.unique((begins[:, None] + share * lengths[:, None]).ravel())
    return times[times <= lengths.sum()]


ENDPOINTS = (Answer("data/model", Driven, model),)
