"""Recordings without modulation: segments of steady sliding, their levels and their steps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.instrument.measure_segments import Segment, segments_of
from asperity.instrument.measure_series import Level, level
from asperity.instrument.quality import Check, Verdict, judged, worst
from asperity.instrument.quality_checks import findings
from asperity.instrument.reference import strongest_line

if TYPE_CHECKING:
    from asperity.instrument.trace import Trace

Array = NDArray[np.float64]

#: Where suspicious and bad begin.
LIMITS = {
    "load": (0.005, 0.02),
    "drift": (0.01, 0.05),
    "oscillation": (0.002, 0.02),
    "modulation": (0.005, 0.02),
}
_LINE = 8.0


@dataclass(frozen=True)
class Step:
    """Change of the steady friction from one segment to the next.

    Attributes
    ----------
    change, uncertainty : float
        Of the friction coefficient.
    peak : float
        Extreme of friction after the step, in the direction of the velocity's change, less the
        steady level before it; NaN where no velocity is known.
    rate_dependence, rate_uncertainty : float
        change/ln(V2/V1), which is A - B of a rate-and-state law; NaN where no velocity is known.
    """

    change: float
    uncertainty: float
    peak: float
    rate_dependence: float
    rate_uncertainty: float


@dataclass(frozen=True, eq=False)
class StaticMeasurement:
    """What a recording without modulation says.

    Attributes
    ----------
    friction : Level
        Mean of F/W over the window.
    load : Level or None
        Mean load, in its unit; None if it is not in the recording.
    load_unit : str
        SI.
    segments : tuple of Segment
    steps : tuple of Step
        One less than segments.
    rates : tuple of (float, float)
        Sampling rates (Hz), each with the share of the samples that has it.
    time, values : array, (n,)
        Friction over time, as used.
    velocity_from : str
        The channel that velocities come from; empty if there is none.
    checks : tuple of Check
    """

    friction: Level
    load: Level | None
    load_unit: str
    segments: tuple[Segment, ...]
    steps: tuple[Step, ...]
    rates: tuple[tuple[float, float], ...]
    time: Array
    values: Array
    velocity_from: str
    checks: tuple[Check, ...]

    @property
    def verdict(self) -> Verdict:
        """The gravest of all."""
        return worst(self.checks)


def measure_static(
    trace: Trace,
    *,
    load: str = "W",
    force: str = "F",
    window: tuple[float, float] | None = None,
) -> StaticMeasurement:
    """Friction, its levels and its steps in a recording without modulation.

    Friction is F/W where both are recorded, and otherwise the recorded friction coefficient.
    Segments are told apart by the velocity, or by the slope of the displacement.

    Parameters
    ----------
    trace : Trace
    load, force : str
        Channels, by name or role.
    window : (float, float), optional
        First and last time (s).

    Returns
    -------
    StaticMeasurement

    Raises
    ------
    InputError
        If neither force and load nor friction is recorded, or the window holds too little.
    """
    if window is not None:
        _check_window(window, trace)
        start, end = (edge if np.isfinite(edge) else None for edge in window)
        trace = trace.slice(start, None if end is None else np.nextafter(end, np.inf))
    friction, weight, unit = _friction(trace, load, force)
    motion, name, is_velocity = _motion(trace)
    use = np.isfinite(trace.time) & np.isfinite(friction)
    use &= trace.time > np.concatenate(
        [[-np.inf], np.maximum.accumulate(np.nan_to_num(trace.time, nan=-np.inf))[:-1]]
    )
    if motion is not None:
        use &= np.isfinite(motion)
    if use.sum() < 32:
        raise InputError(
            f"measure.trace must hold at least 32 usable samples, got {int(use.sum())}; give a "
            "longer recording or window"
        )
    time, friction = trace.time[use], friction[use]
    parts = segments_of(
        time, friction, None if motion is None else motion[use], is_velocity=is_velocity
    )
    borne = None if weight is None else weight[use & np.isfinite(weight)]
    checks = _checks(time, friction, borne, parts)
    checks += findings(list(trace.findings), len(trace), float(time[-1] - time[0]))
    return StaticMeasurement(
        friction=level(time, friction),
        load=None if borne is None else level(trace.time[use][: borne.size], borne),
        load_unit=unit,
        segments=tuple(parts),
        steps=tuple(_step(a, b) for a, b in pairwise(parts)),
        rates=_rates(time),
        time=time,
        values=friction,
        velocity_from=name,
        checks=tuple(checks),
    )


def _check_window(window: tuple[float, float], trace: Trace) -> None:
    if not window[0] < window[1]:
        raise InputError(
            f"measure.window must end after it begins, got {window[0]:g} s to {window[1]:g} s; the "
            f"recording runs from {trace.time[0]:.10g} s to {trace.time[-1]:.10g} s"
        )


def _friction(trace: Trace, load: str, force: str) -> tuple[Array, Array | None, str]:
    """Friction, load and the load's unit."""
    weight, unit = None, ""
    try:
        W = trace.channel(load)
        weight, unit = W.values, W.unit
    except InputError as missing:
        if load != "W":
            raise
        no_load = missing
    try:
        F = trace.channel(force)
    except InputError as missing:
        if force != "F":
            raise
        try:
            return trace.channel("friction").values, weight, unit
        except InputError:
            raise missing from None
    if F.kind == "dimensionless":
        return F.values, weight, unit
    if weight is None:
        raise no_load
    if trace.channel(load).kind != F.kind:
        raise InputError(
            f"measure.force must have the dimension of the load, got '{F.unit}' for '{force}' and "
            f"'{unit}' for '{load}'; name the units when reading"
        )
    # What comes out as no number is left out by who asks.
    with np.errstate(invalid="ignore", over="ignore"):
        return F.values / np.where(weight == 0, np.nan, weight), weight, unit


def _motion(trace: Trace) -> tuple[Array | None, str, bool]:
    """Velocity if it is recorded, or displacement."""
    for role in ("velocity", "displacement"):
        try:
            channel = trace.channel(role)
        except InputError:
            continue
        return channel.values, channel.recorded_name or role, role == "velocity"
    return None, "", False


def _step(a: Segment, b: Segment) -> Step:
    change = b.steady.value - a.steady.value
    doubt = float(np.hypot(a.steady.uncertainty, b.steady.uncertainty))
    ratio = b.velocity / a.velocity if a.velocity else np.nan
    lever = float(np.log(ratio)) if ratio > 0 else np.nan
    extreme = b.highest if lever > 0 else b.lowest
    peak = extreme - a.steady.value if np.isfinite(lever) else np.nan
    return Step(change, doubt, peak, change / lever, doubt / abs(lever))


def _rates(time: Array) -> tuple[tuple[float, float], ...]:
    """Sampling rates in use, commonest first."""
    steps = np.diff(time)
    # Two figures tell rates apart, and jitter not.
    digit = 10.0 ** (np.floor(np.log10(steps) + 1e-9) - 1)
    values, counts = np.unique(np.rint(steps / digit) * digit, return_counts=True)
    order = np.argsort(-counts)[:5]
    return tuple((float(1 / values[i]), float(counts[i] / steps.size)) for i in order)


def _checks(
    time: Array, friction: Array, weight: Array | None, parts: list[Segment]
) -> list[Check]:
    checks = []
    if weight is not None:
        spread = float(weight.std() / abs(weight.mean())) if weight.mean() else np.inf
        checks.append(
            judged(
                "load",
                spread,
                LIMITS["load"],
                f"the load's standard deviation is {100 * spread:.2g} % of its mean",
            )
        )
    drift = max((abs(p.slope * (p.end - p.steady.start)) for p in parts), default=0.0)
    share = drift / max(abs(float(friction.mean())), 1e-300)
    checks.append(
        judged(
            "drift",
            share,
            LIMITS["drift"],
            f"within its steady parts friction drifts by up to {100 * share:.2g} % of its mean",
        )
    )
    longest = max(parts, key=lambda part: part.end - part.steady.start)
    inside = (time >= longest.steady.start) & (time <= longest.end)
    line = strongest_line(time[inside], friction[inside])
    share = line.amplitude / max(abs(float(friction.mean())), 1e-300)
    checks.append(
        judged(
            "oscillation",
            share,
            LIMITS["oscillation"],
            f"the strongest line of steady friction, at {line.frequency:.4g} Hz, is "
            f"{100 * share:.2g} % of the mean",
            significant=line.amplitude > _LINE * line.background,
        )
    )
    return checks
