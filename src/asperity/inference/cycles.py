"""The averaged cycle of regular stick-slip, with the covariance of its cycles.

Cycles are aligned at the middle of the slip. The covariance of their mean is estimated from the
cycles, including variations along the track over several cycles (Newey and West, Econometrica 55,
703, 1987). Directions in which cycles differ by more than noise keep their variance; all others get
their mean variance, in units of the noise (Tipping and Bishop, J. R. Stat. Soc. B 61, 611, 1999).
In the likelihood the mean is compared with the limit cycle of the law with inertia.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from asperity.arrays import Float
from asperity.errors import Argument, InputError, require, symbol
from asperity.inference.objective import DataTerm, Residuals
from asperity.laws import Law
from asperity.measurement.stick_slip.measure import StickSlipMeasurement
from asperity.parameters.arguments import typed
from asperity.slider.parameters import slider_from
from asperity.transients.limit_cycle import CycleEnd, LimitCycle, limit_cycle

REGULAR = "regular stick-slip"
#: Smallest number of cycles.
_FEWEST = 12
#: Numbers of bins: in the stick, in each half of the slip, and after the slip.
_STICK, _SLIP, _AFTER = 12, 6, 3
#: The bins of the stick cover this share of the shortest stick; the last bins reach this many slip
#: durations beyond the middle of the slip.
_COVERED, _FOLLOWED = 0.9, 2.0
#: With fewer samples in a slip, its shape is not resolved.
_RESOLVED = 4.0


@dataclass(frozen=True, eq=False)
class AveragedCycle:
    """Mean of the cycles of a recording; forces are F/W0.

    Attributes
    ----------
    name : str
        Name of the recording in messages.
    edges : array, shape (bins + 1,)
        Edges of the bins: times (s) from the middle of the slip.
    values : array, shape (bins + 1,)
        Mean force in each bin, then the mean recurrence (s).
    whitening : array, shape (bins + 1, bins + 1)
        Matrix that gives the residuals unit covariance.
    log_scale : float
        Half the log determinant of the covariance of `values`.
    cycles : int
    step : float
        Sampling interval (s).
    V, W0 : float
        Velocity of the drive (m/s) and load (N).
    loading_slope : float
        Slope of F/W0 (1/s).
    slip_duration, stick_duration, drop : float
        Means over the events (s, s, F/W0).
    spread, noise_spread : float
        Standard deviation of the drops over their mean, and the part of it due to the noise of the
        gauge.
    """

    name: str
    edges: Float
    values: Float
    whitening: Float
    log_scale: float
    cycles: int
    step: float
    V: float
    W0: float
    loading_slope: float
    slip_duration: float
    stick_duration: float
    drop: float
    spread: float
    noise_spread: float

    @property
    def resolved(self) -> bool:
        """Whether the samples resolve the shape of the slip."""
        return self.slip_duration >= _RESOLVED * self.step


@typed
def averaged_cycle(measurement: StickSlipMeasurement, name: str = "recording") -> AveragedCycle:
    """Average the cycles of regular stick-slip.

    Parameters
    ----------
    measurement : StickSlipMeasurement
        A measurement with the velocity of the drive and the load.
    name : str

    Raises
    ------
    InputError
        If velocity or load are not known, or there are few regular cycles.
    """
    machine, events = measurement.machine, measurement.events
    for field, value, example in (
        ("V", machine.velocity, f"{Argument('fixed', 'V', '42 um/s')}"),
        (
            "W0",
            machine.load,
            f"{Argument('fixed', 'W0', '0.3 N')}, or for a force over the weight "
            f"{Argument('fixed', 'M', '30 g')}, the mass that has this weight",
        ),
    ):
        if value is None:
            rule = f"have {symbol(field)} for a fit of its cycles"
            raise InputError(name, rule, "none", f"give it, as {example}")
    regular = [r for r in measurement.regimes if r.kind == REGULAR]
    if not regular:
        raise InputError(
            f"{name} must be regular stick-slip for a fit of its cycles, got {measurement.kind}; "
            "an average of unlike cycles is no cycle of a law: fit a window in which they are "
            "alike"
        )
    longest = max(regular, key=lambda r: r.stop - r.first)
    kept = slice(longest.first, longest.stop)
    rule, got = f"have more than {_FEWEST} regular cycles", longest.stop - longest.first
    require(not longest.stop - longest.first <= _FEWEST, name, rule, got, "record for longer")
    time, force = measurement.time, measurement.friction
    step = float(time[-1] - time[0]) / (time.size - 1)
    onset, end, drop = (getattr(events, n)[kept] for n in ("onset", "end", "drop"))
    slip = float(np.median(end - onset))
    levels = (events.force_before + events.force_after)[kept] / 2
    middle, samples = _middles(time, force, (onset + end) / 2, levels, slip / 6)
    stick = float(np.min(middle[1:] - end[:-1]))
    after = min(_FOLLOWED * slip, float(np.min(onset[1:] - middle[:-1])))
    edges = _edges(_COVERED * stick, slip, after, step)
    middle = middle[(middle + edges[0] >= time[0]) & (middle + edges[-1] <= time[-1])]
    # The force is linear between its samples.
    integral = make_interp_spline(time, force, k=1).antiderivative()
    means = np.diff(integral(middle[1:, None] + edges), axis=1) / np.diff(edges)
    rows = np.column_stack([means, np.diff(middle)])
    noise = measurement.noise
    steepness = np.pi / 2 * float(np.mean(drop)) / slip
    scales = np.append(
        noise * np.sqrt(step / np.diff(edges)), noise / steepness * np.sqrt(2 / samples)
    )
    whitening, log_scale = _whitening(rows, scales)
    return AveragedCycle(
        name, edges, rows.mean(0), whitening, log_scale, len(rows), step,
        float(machine.velocity or np.nan), float(machine.load or np.nan),
        measurement.loading_slope, slip, float(np.median(events.stick_duration[kept][1:])),
        float(np.mean(drop)), float(np.std(drop) / np.mean(drop)),
        float(np.sqrt(np.mean(events.drop_uncertainty[kept] ** 2)) / np.mean(drop)),
    )  # fmt: skip


def _middles(
    time: Float, force: Float, about: Float, levels: Float, reach: float
) -> tuple[Float, int]:
    """Times at which lines through the middle of each slip cross its level, and their samples."""
    step = float(time[1] - time[0])
    result = about.copy()
    for n, (t, level) in enumerate(zip(about, levels, strict=True)):
        i, j = np.searchsorted(time, [t - reach, t + reach])
        if j - i < 3:
            i, j = np.searchsorted(time, t - step), np.searchsorted(time, t + step)
        slope, at = np.polyfit(time[i:j] - t, force[i:j], 1)
        # A line that does not fall has no crossing.
        result[n] += float(np.clip((level - at) / slope, -reach, reach)) if slope < 0 else 0.0
    return result, max(2, int(2 * reach / step))


def _edges(stick: float, slip: float, after: float, step: float) -> Float:
    """Edges of bins: long in the stick, short in the slip, at least one sample long."""
    nearest = min(max(slip, step), stick / 2)
    before = -np.geomspace(stick, nearest, _STICK + 1)
    count = int(min(2 * _SLIP, max(2, np.floor((nearest + min(slip, after)) / step))))
    inside = np.linspace(-nearest, min(slip, after), count + 1)
    beyond = (
        np.linspace(inside[-1], after, _AFTER + 1) if after > inside[-1] + step else inside[-1:]
    )
    edges = np.concatenate([before[:-1], inside, beyond[1:]])
    # A bin shorter than a sample is merged with the bin before.
    kept = [edges[0]]
    for edge in edges[1:]:
        if edge - kept[-1] > 0.999 * step:
            kept.append(edge)
    return np.array(kept)


def _whitening(rows: Float, scales: Float) -> tuple[Float, float]:
    """Whitening matrix of the mean of the rows, and half its log determinant."""
    n, size = rows.shape
    off = (rows - rows.mean(0)) / scales
    lags = round(n ** (1 / 3))
    covariance = off.T @ off / (n - 1)
    for lag in range(1, lags + 1):
        product = off[lag:].T @ off[:-lag] / (n - 1)
        covariance += (1 - lag / (lags + 1)) * (product + product.T)
    values, vectors = np.linalg.eigh(covariance)
    # Eigenvalues of white noise in a finite number of rows reach this limit (Marchenko and Pastur,
    # 1967); the weights above reduce the effective number of rows.
    edge = (1 + np.sqrt(size * (1 + 2 * lags / 3) / n)) ** 2
    excess = values > edge * max(1.0, float(np.median(values)))
    # The noise of the gauge is known: no direction scatters less.
    others = max(1.0, float(np.mean(values[~excess])))
    values = np.where(excess, values, others)
    whitening = np.sqrt(n) * (vectors / np.sqrt(values)) @ vectors.T / scales
    log_scale = float(np.log(scales).sum() + 0.5 * np.log(values / n).sum())
    return whitening, log_scale


CYCLE = "cycle"
#: Tolerated error of a step: the period is then good to 1e-7, recurrences are measured to 1e-5.
_RTOL = 1e-8
#: Times per bin, and in the slip of the model, at which the model is evaluated; rounds of the shift
#: in time.
_IN_BIN, _IN_SLIP, _ROUNDS = 8, 400, 8
#: The shift in time has converged if it changes by less than this share of a slip.
_NO_SHIFT = 1e-4
#: Cycles are irregular if the spread of the drops exceeds this multiple of the spread by noise.
_IRREGULAR = 2.0


class CycleTerm(DataTerm):
    """The averaged cycle of a recording as a `DataTerm` of an objective.

    The term itself fits a constant friction and a shift in time, because the level of the gauge and
    the time of alignment are less well known than the shape.

    Parameters
    ----------
    cycle : AveragedCycle
    law : type of Law
    fixed : mapping of str to float
        Parameters of law and machine that are not free, in SI.
    """

    observables = (CYCLE,)
    failure = (
        "no start has stick-slip that repeats itself; give start values nearer to those of the "
        "interface"
    )

    def __init__(self, cycle: AveragedCycle, law: type[Law], fixed: Mapping[str, Any]) -> None:
        self.cycle, self.law, self.name = cycle, law, cycle.name
        self._fixed = {n: float(v) for n, v in fixed.items() if np.ndim(v) == 0}
        widths = np.diff(cycle.edges)
        shares = (np.arange(_IN_BIN) + 0.5) / _IN_BIN
        self._times = (cycle.edges[:-1, None] + widths[:, None] * shares).ravel()
        self._near: LimitCycle | None = None

    @property
    def noise(self) -> Mapping[str, Any]:
        """Scatter of the cycles about their mean."""
        return {
            "model": "normal, with the covariance of the cycles",
            "effective_samples": len(self.cycle.values) - 2,
            "cycles": self.cycle.cycles,
            "spread_of_drops": self.cycle.spread,
            "spread_by_noise": self.cycle.noise_spread,
        }

    def limit_cycle(self, values: Mapping[str, float]) -> LimitCycle:
        """The cycle of the law at given parameters, computed from the last cycle as a start."""
        numbers = {**self._fixed, **values, "W0": self.cycle.W0}
        cycle = limit_cycle(
            slider_from(self.law, numbers), self.cycle.V, rtol=_RTOL, near=self._near
        )
        if cycle.end is CycleEnd.REPEATS:
            self._near = cycle
        return cycle

    def _aligned(self, cycle: LimitCycle) -> tuple[float, Float, Float]:
        """Align a cycle of the model with the data.

        Returns
        -------
        float
            Time of the middle of the model's slip at the best alignment (s from the peak).
        array, shape (bins + 1,)
            Whitened residuals.
        array, shape (bins + 1, bins - 1)
            Orthonormal basis of residuals that level and shift do not change.
        """
        data = self.cycle
        falling = np.linspace(0, cycle.slip_duration, _IN_SLIP)
        middle = float(np.interp(-(cycle.peak + cycle.lowest) / 2, -cycle.force(falling), falling))
        level = np.append(np.ones(len(data.values) - 1), 0.0)
        for _ in range(_ROUNDS):
            mean, slope = (self._means(a) for a in cycle.force_and_rate(self._instants(middle)))
            off = data.whitening @ (np.append(mean, cycle.period / cycle.slips) - data.values)
            columns = data.whitening @ np.column_stack([level, np.append(slope, 0.0)])
            change = np.linalg.lstsq(columns, -off, rcond=None)[0][1]
            change = float(np.clip(change, -data.slip_duration, data.slip_duration))
            if abs(change) < _NO_SHIFT * data.slip_duration:
                break
            middle += change
        return middle, off, np.linalg.qr(columns, mode="complete")[0][:, 2:]

    def _instants(self, middle: float) -> Float:
        """Times at which a cycle is evaluated: in the bins, and one sample before and after."""
        return (middle + self._times + self.cycle.step * np.array([[-1.0], [0.0], [1.0]])).ravel()

    def _means(self, values: Float) -> Float:
        """Means in the bins, shape (bins, ...), of values at `_instants`."""
        before, at, after = values.reshape(3, -1, _IN_BIN, *values.shape[1:]).mean(2)
        # Measured means are of lines between samples: this adds h^2/12 times the curvature.
        return np.asarray((before + 10 * at + after) / 12)

    def residuals(self, values: Mapping[str, float]) -> Residuals | None:
        """Residuals in standard uncertainties; None where the law has no cycle.

        The Jacobian neglects the change of level and shift with the parameters (Kaufman, BIT 15,
        49, 1975); the gradient of the sum of squares is exact.
        """
        cycle = self.limit_cycle(values)
        if cycle.end is not CycleEnd.REPEATS:
            return None
        middle, off, space = self._aligned(cycle)
        names = list(values)
        forces, period = cycle.derivatives(self._instants(middle), names)
        slopes = np.vstack([self._means(forces), period / cycle.slips])
        off = space.T @ off
        rows = np.arange(off.size)
        return Residuals(
            off, space.T @ self.cycle.whitening @ slopes, np.full(off.size, CYCLE), rows,
            self.cycle.log_scale,
        )  # fmt: skip

    def observed(self) -> Mapping[str, Float]:
        """Bins of the averaged cycle."""
        middles = (self.cycle.edges[1:] + self.cycle.edges[:-1]) / 2
        return {"time": middles, CYCLE: self.cycle.values[:-1]}

    def warnings(
        self, residuals: Residuals, information: Float, outliers: Sequence[int] = ()
    ) -> Sequence[str]:
        """A warning if cycles differ by more than the noise of the gauge."""
        cycle = self.cycle
        if cycle.spread <= _IRREGULAR * cycle.noise_spread:
            return ()
        return (
            f"{cycle.name}: its drops differ by {100 * cycle.spread:.2g} % where the noise of the "
            f"gauge explains {100 * cycle.noise_spread:.2g} %: the uncertainties are those of "
            "irregular cycles, whose mean is compared with a regular cycle",
        )
