"""Stiffness of a machine from a stretch of time in which the contact sticks.

During unloading, reloading or first loading the slider does not slide: the force follows the load
point along a line of slope K. Near the onset of sliding the line bends.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from asperity.arrays import Float
from asperity.errors import InputError, require
from asperity.inference.runs.recorded_drive import recorded_load
from asperity.inference.runs.run import STIFFNESS
from asperity.inference.unknowns import Prior
from asperity.measurement.sliding.change_points import displacement_noise
from asperity.measurement.sliding.signals import sliding_signals
from asperity.parameters.arguments import rising, typed
from asperity.recording import Trace
from asperity.recording.defects.autoregression import fitted
from asperity.recording.defects.sampling import even_times
from asperity.recording.readers import read
from asperity.units import KINDS

#: Smallest number of samples of a line; longer spans are averaged to the second number.
_FEWEST, _MOST = 32, 2000
#: Rounds between the line and its noise.
_ROUNDS = 3
#: A slope is significant if it differs from zero by this many standard errors.
_SEEN = 5.0
#: Smallest change of the friction over the span, over the friction of the recording: a trend of
#: sliding friction over slip is a line too.
_CHANGES = 0.05
#: The force is no line if its slope changes by this many standard errors and by this share of the
#: slope, or by the larger share at any noise: part of a bend is mistaken for noise.
_BENT, _BENT_SHARE, _BENT_AT_ANY_NOISE = 2.6, 0.05, 0.25
#: A column has no information if the other columns leave a smaller share of it.
_INDEPENDENT_SHARE = 0.05
#: Smallest spread of the displacement in standard deviations of its noise.
_MOVES = 5.0


@dataclass(frozen=True)
class MeasuredStiffness:
    """Slope of the friction force over the displacement of the load point, in a span of time.

    Attributes
    ----------
    over_load, over_load_se : float
        K over the mean load of the span, and its standard uncertainty (1/m).
    value, se : float
        K in `unit` and its standard uncertainty; over the load if no load is recorded.
    unit : str
        "N/m", "Pa/m" or "1/m".
    span : (float, float)
        First and last time (s).
    samples : int
    bend, bend_se : float
        Change of the slope from one end to the other, over the slope, and its standard uncertainty.
    """

    over_load: float
    over_load_se: float
    value: float
    se: float
    unit: str
    span: tuple[float, float]
    samples: int
    bend: float
    bend_se: float

    @property
    def prior(self) -> Prior:
        """Prior of K for a fit of a window without the span."""
        low, high = self.span
        source = f"slope of the force from {low:g} to {high:g} s"
        return Prior(self.value, self.se, source, self.unit)


@typed
def measured_stiffness(
    recording: Trace | str | os.PathLike[str],
    span: tuple[float, float],
    *,
    load: str = "W",
    force: str = "F",
) -> MeasuredStiffness:
    """Stiffness from a span in which the contact sticks: unloading, reloading or first loading.

    Parameters
    ----------
    recording : Trace or path
        Result of `asperity.read`, or a file that it reads without further arguments.
    span : (float, float)
        First and last time (s).
    load, force : str
        Channels, by name or role.

    Returns
    -------
    MeasuredStiffness

    Raises
    ------
    InputError
        If the load point does not move in the span, if the force does not rise with it, or if the
        slope varies over the span: then the contact slides.

    Notes
    -----
    The line is fitted by least squares, which is efficient for a slope under stationary noise
    (Grenander and Rosenblatt, 1957). Its uncertainty is that under an autoregression fitted to the
    residual. Noise of the displacement lowers the slope by the ratio of its variance to that of the
    displacement: the slope is corrected for this, and the correction is added to the uncertainty.
    The bend, or its uncertainty, is added too: the slope without creep lies between that of the
    line and that of the steeper end, half a bend away.

    A contact that creeps with the drive at a constant rate looks like a softer machine, and so do
    elastic asperities: the measured compliance is 1/K + lambda/W, machine and contact in series.
    """
    trace = recording if isinstance(recording, Trace) else read(recording)
    stretch = _in_span(trace, span, load, force)
    (low, high), (time, x, F) = span, stretch.columns.T
    q = max(1, time.size // _MOST)
    t, moved, F = stretch.columns[: time.size // q * q].reshape(-1, q, 3).mean(axis=1).T
    noise, spread = displacement_noise(time, x) / math.sqrt(q), float(moved.std())
    rule = "have a load point that moves"
    got = f"{spread:.3g} m from {low:g} to {high:g} s with noise of {noise:.2g} m"
    require(spread > _MOVES * noise, "span", rule, got, "give a stretch of unloading or reloading")
    half = float(np.ptp(moved)) / 2
    u = (moved - moved.mean()) / half
    (_, slope), covariance = _least_squares(np.stack([np.ones_like(u), u], axis=1), F)
    outside = stretch.pulled_outside
    slope *= np.sign(outside if abs(outside) > 2 * half else slope)
    se = math.sqrt(covariance[1, 1])
    usual = max(stretch.usual_force, 1e-300)
    if slope < _SEEN * se or 2 * slope / usual < _CHANGES:
        raise InputError(
            "span",
            "have a force that rises with the load point's displacement",
            f"a change by {2 * slope / usual:.2g} of the friction "
            f"({2 * se / usual:.1g} standard error) from {low:g} to {high:g} s",
            "give a stretch of unloading or reloading",
        )
    bend, bend_se = _bend(u, t, F, slope, low, high)
    # Ratio of the true to the attenuated slope: noise of the displacement is not in the force.
    attenuation = (noise / spread) ** 2
    bending = max(abs(bend), bend_se) / (2 * math.sqrt(3))
    K = float(slope / half / (1 - attenuation))
    error = K * math.hypot(se / slope, attenuation, bending)
    return MeasuredStiffness(
        over_load=K / stretch.mean_load,
        over_load_se=error / stretch.mean_load,
        value=K,
        se=error,
        unit=KINDS[STIFFNESS[stretch.unit]].si,
        span=(float(time[0]), float(time[-1])),
        samples=time.size,
        bend=bend,
        bend_se=bend_se,
    )


class _Stretch(NamedTuple):
    """A recording in a span of time.

    Attributes
    ----------
    columns : array, shape (samples, 3)
        Time, displacement of the load point and friction force, F/W without a recorded load.
    mean_load, unit : float, str
        Mean load and its unit; 1 and empty without a recorded load.
    usual_force : float
        Median of F/W in the recording times the mean load.
    pulled_outside : float
        Displacement in the recording outside of the span, whose sign is the pulling direction.
    """

    columns: Float
    mean_load: float
    unit: str
    usual_force: float
    pulled_outside: float


def _in_span(trace: Trace, span: tuple[float, float], load: str, force: str) -> _Stretch:
    trace = replace(trace, time=even_times(trace.time))
    low, high = span
    rising(span, "span", "give its two times")
    signals = sliding_signals(trace, load, force, None)
    if signals.displacement is None:
        rule = "have the displacement of the load point"
        raise InputError("recording", rule, f"none: {signals.no_motion}", "name a channel")
    here = (signals.time >= low) & (signals.time <= high)
    time, x = signals.time[here], signals.displacement[here]
    rule, got = f"hold at least {_FEWEST} samples", f"{time.size} from {low:g} to {high:g} s"
    require(time.size >= _FEWEST, "span", rule, got, "give a longer one")
    known = recorded_load(trace, load, time, "span", "give another one")
    weight = np.ones(time.size) if known is None else np.interp(time, *known)
    outside = ~(here[1:] & here[:-1])
    return _Stretch(
        np.stack([time, x, signals.friction[here] * weight], axis=1),
        float(weight.mean()),
        "" if known is None else signals.load_unit,
        float(np.median(np.abs(signals.friction))) * float(weight.mean()),
        float(np.diff(signals.displacement)[outside].sum()),
    )


def _bend(
    u: Float, t: Float, F: Float, slope: float, low: float, high: float
) -> tuple[float, float]:
    """Relative change of the slope over the span, and its standard error.

    Raises
    ------
    InputError
        If the force is no line over the displacement, or a different line on the way back.
    """
    square = np.stack([np.ones_like(u), u, u * u], axis=1)
    coefficients, covariance = _least_squares(square, F)
    bend, bend_se = 4 * coefficients[2] / slope, 4 * math.sqrt(covariance[2, 2]) / slope
    rule = "have one slope of the force over the displacement"
    _require_straight(bend, bend_se, rule, "one that changes by {:.1%}", low, high)
    clock = 2 * (t - t[0]) / (t[-1] - t[0]) - 1
    unexplained = clock - square @ np.linalg.lstsq(square, clock, rcond=None)[0]
    if unexplained.std() > _INDEPENDENT_SHARE * clock.std():
        coefficients, covariance = _least_squares(np.column_stack([square, unexplained]), F)
        scale = float(np.ptp(unexplained)) / (2 * slope)
        apart, apart_se = scale * coefficients[3], scale * math.sqrt(covariance[3, 3])
        rule = "have one line of the force on the ways back and forth"
        _require_straight(
            apart, apart_se, rule, "lines that are {:.1%} of the force apart", low, high
        )
    return float(bend), float(bend_se)


def _require_straight(bend: float, se: float, rule: str, got: str, low: float, high: float) -> None:
    """Refuse a departure of the force from a line that is significant, or large at any noise."""
    straight = abs(bend) <= min(max(_BENT * se, _BENT_SHARE), _BENT_AT_ANY_NOISE)
    got = f"{got.format(abs(bend))} ({se:.1%} standard error) from {low:g} to {high:g} s"
    got += ": the contact slides in a part of it"
    require(straight, "span", rule, got, "give a shorter span")


def _least_squares(columns: Float, y: Float) -> tuple[Float, Float]:
    """Coefficients of columns, and their covariance under autoregressive noise."""
    inverse = np.linalg.pinv(columns)
    coefficients = inverse @ y
    left = y - columns @ coefficients
    size = max(float(left.std()), 1e-12 * float(np.abs(y).max()))
    left = left / size
    covariance = np.zeros((columns.shape[1],) * 2)
    for _ in range(_ROUNDS):
        values, vectors = np.linalg.eigh(covariance)
        root = columns @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        model = fitted([left], parameters=columns.shape[1], uncertain=[root.T])
        transform = np.fft.fft(inverse, 8 * y.size, axis=1)
        power = model.spectrum(np.asarray(np.fft.fftfreq(8 * y.size), np.float64))
        covariance = ((transform * power) @ transform.conj().T).real / (8 * y.size)
    return coefficients, covariance * size**2
