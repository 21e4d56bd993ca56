"""Motion in time of an operating point: the steady response, or stick-slip if that is unstable.

The equation of motion is integrated from steady sliding at a lower velocity, block by block, and
each block is reported: the page draws it while the next one is computed.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from pydantic import StrictFloat

from asperity.app.api.operating_point import OperatingPoint, epsilon_on_contacts
from asperity.app.endpoints import Job
from asperity.arrays import Float
from asperity.errors import require
from asperity.laws import get_law
from asperity.loads import Modulate, Programme, Slide
from asperity.recording.extremes import thinned
from asperity.slider.parameters import slider_from
from asperity.transients import Trajectory, integrate_blocks

#: Velocity before the motion over V; the step to V disturbs steady sliding.
_BEFORE = 0.7
#: Periods of the load over which the modulation begins.
_RISE = 3.0
#: Drop of F/W0 and number of cycles of stick-slip from which the computed time follows.
_DROP, _CYCLES = 0.15, 12.0
#: Cycles after which the computation stops, and e-folds of growth or decay that are computed.
_ENOUGH, _FOLDS = 6, 6.0
#: Periods of the load that are shown where sliding is stable.
_FEWEST_PERIODS, _MOST_PERIODS = 6.0, 120.0
#: Rows of a block, elapsed time (s) after which no further block is computed, and tolerance.
_ROWS, _PATIENCE, _RTOL = 4000, 15.0, 1e-6
#: Points of the curves, and of the cycle that the drawing repeats.
_BLOCKS, _FRAMES = 700, 300
#: Mean velocity over V in a slip and in a stick.
_SLIPPING, _STICKING = 3.0, 0.3


class Motion(OperatingPoint):
    """An operating point, and its stability from the Explore tab.

    Attributes
    ----------
    growth_rate : float, optional
        Growth rate of the slowest mode (1/s).
    """

    growth_rate: StrictFloat | None = None


class Cycles(NamedTuple):
    """Stick-slip in a motion, with its last whole cycle: the first cycles still grow.

    Attributes
    ----------
    onsets : array, (k,)
        Times (s) at which slips begin.
    period : float
        Time (s) from the second last slip to the last slip.
    slip : float
        Displacement (m) of the second last slip, which is complete.
    drop : float
        Range of F/W0 between these two slips.
    """

    onsets: Float
    period: float
    slip: float
    drop: float


def motion(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Integrate the motion; each message has ``curves`` and the outcome up to the time reached.

    Raises
    ------
    InputError
        If the law follows the load without dynamics.
    """
    question = Motion(**argument)
    law, values = get_law(question.law), question.values()
    rule = "have dynamics"
    require(law.rate_dependent, "law", rule, f"'{question.law}'", "its force follows the load")
    epsilon = epsilon_on_contacts(question, values)
    unstable = question.growth_rate is not None and question.growth_rate > 0
    duration = _duration(values, epsilon, question.growth_rate)
    # Only the mass bounds the velocity of a slip, including the slip after the start.
    inertia = values.get("M", 0.0) > 0
    slider = slider_from(law, values)
    V, f = values["V"], values["frequency"]
    drive: Any = Slide(duration=duration, velocity=V)
    if epsilon > 0:
        rise = min(_RISE / f, duration / 4)
        drive = Modulate(duration=duration, epsilon=epsilon, frequency=f, velocity=V, rise=rise)
    damping = values.get("eta", 0.0)
    blocks = integrate_blocks(
        slider,
        Programme(drive, load=values["W0"], velocity=_BEFORE * V),
        rows=_ROWS,
        inertia=inertia,
        radiation_damping=damping if damping > 0 else None,
        rtol=_RTOL,
        progress=lambda done, total: report(),
    )
    # Longer than a period of the modulation and of the slider on its spring.
    natural = 2 * np.pi * np.sqrt(values.get("M", 0.0) / values["K"])
    window = max(min(1 / f if epsilon > 0 else np.inf, duration / _CYCLES / 20), natural)
    begin, parts = clock.monotonic(), []
    record: dict[str, Any] = {}
    for block in blocks:
        parts.append(block)
        whole = Trajectory.joined(parts)
        cycles = stick_slip(whole, V, window) if unstable else None
        record = _record(whole, values, inertia, cycles)
        if block.termination is not None:
            record["stopped"] = str(block.termination)
        report(**record)
        if cycles is not None and cycles.onsets.size > _ENOUGH:
            break
        if clock.monotonic() - begin > _PATIENCE:
            break
    return record


def _duration(values: Mapping[str, float], epsilon: float, rate: float | None) -> float:
    """Largest time (s) that is computed."""
    if rate is not None and rate > 0:
        cycle = _DROP * values["W0"] / (values["K"] * values["V"])
        return float(_CYCLES * cycle + _FOLDS / rate)
    way = 10 * values["D0"] / values["V"] if "D0" in values else 1.0
    settling = _FOLDS / -rate if rate else way
    if epsilon == 0:
        return float(settling)
    period = 1 / values["frequency"]
    return float(np.clip(settling, _FEWEST_PERIODS * period, _MOST_PERIODS * period))


def stick_slip(whole: Any, velocity: float, window: float) -> Cycles | None:
    """Cycles of stick-slip in a motion; None where the slider never sticks and slips again.

    Parameters
    ----------
    whole : Trajectory
        A trajectory, or an object with its columns.
    velocity : float
        V (m/s).
    window : float
        Time (s) over which velocities are averaged: a modulated load makes the slider stop and go
        within a period, which is no stick-slip.
    """
    time = whole.time
    count = int((time[-1] - time[0]) / window)
    if count < 3:
        return None
    edges = time[0] + window * np.arange(count + 1)
    place = np.interp(edges, time, whole.displacement)
    mean = np.diff(place) / (window * velocity)
    # A slip begins where the mean velocity is high for the first time since a stick.
    state = np.where(mean > _SLIPPING, 1, np.where(mean < _STICKING, -1, 0))
    known = np.flatnonzero(state)
    turns = known[1:][np.diff(state[known]) == 2]
    if turns.size < 2:
        return None
    sticks = np.append(np.flatnonzero(state == -1), count)
    stops = sticks[np.searchsorted(sticks, turns)]
    first, last = np.searchsorted(time, edges[turns[-2:]])
    return Cycles(
        edges[turns],
        float(edges[turns[-1]] - edges[turns[-2]]),
        float(place[stops[-2]] - place[turns[-2]]),
        float(np.ptp(whole.force[first:last]) / np.median(whole.load)),
    )


def _record(
    whole: Trajectory, values: Mapping[str, float], inertia: bool, cycles: Cycles | None
) -> dict[str, Any]:
    """Curves of the motion so far, and its stick-slip if there is any."""
    time, W0, V = whole.time, values["W0"], values["V"]
    curves = {
        "force": thinned(time, whole.force / W0, _BLOCKS),
        "displacement": thinned(time, whole.displacement, _BLOCKS),
        "velocity": thinned(time, whole.velocity, _BLOCKS),
    }
    record: dict[str, Any] = {"curves": curves, "reached": time[-1], "inertia": inertia, "V": V}
    if cycles is None:
        return record
    # The last whole cycle, which the drawing repeats, relative to the motion at V.
    grid = np.linspace(cycles.onsets[-2], cycles.onsets[-1], _FRAMES)
    behind = np.interp(grid, time, whole.displacement) - V * grid
    frames = {
        "duration": grid[-1] - grid[0],
        "travel": V * (grid[-1] - grid[0]),
        "place": behind - behind.mean(),
        "force": np.interp(grid, time, whole.force) / W0,
    }
    named = {name: getattr(cycles, name) for name in ("period", "slip", "drop")}
    return {**record, "stick_slip": {**named, "cycles": cycles.onsets.size}, "frames": frames}


ENDPOINTS = (
    Job("explore/motion", Motion, "asperity.app.api.motion:motion", lane="motion", seconds=180),
)
