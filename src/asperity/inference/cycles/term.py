"""The averaged cycle in the likelihood: the limit cycle of the law with inertia."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.inference.cycles.cycle import AveragedCycle
from asperity.inference.objective import DataTerm, Residuals
from asperity.laws import Law
from asperity.slider.named import slider_from
from asperity.transients.limit_cycle import CycleEnd, LimitCycle, limit_cycle

Float = NDArray[np.float64]

CYCLE = "cycle"
#: Tolerated error of a step: the period is then good to 1e-7, recurrences are measured to 1e-5.
_RTOL = 1e-8
#: Instants in a bin, and in the slip of the model; rounds of the shift in time.
_IN_BIN, _IN_SLIP, _ROUNDS = 8, 400, 8
#: Share of a slip by which a last change of the shift is none.
_NO_SHIFT = 1e-4
#: Spread of the drops over that of the noise from which cycles differ by themselves.
_IRREGULAR = 2.0


class CycleTerm(DataTerm):
    """The averaged cycle of a recording as a `DataTerm` of an objective.

    A constant friction and a shift in time are fitted within: neither the level of the gauge nor
    the instant that the events are laid over each other by is known as well as the shape is.

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
        """The cycle of the law at values of its parameters, begun at the last one."""
        numbers = {**self._fixed, **values, "W0": self.cycle.W0}
        cycle = limit_cycle(
            slider_from(self.law, numbers), self.cycle.V, rtol=_RTOL, near=self._near
        )
        if cycle.end is CycleEnd.REPEATS:
            self._near = cycle
        return cycle

    def _laid_over(self, cycle: LimitCycle) -> tuple[float, Float, Float]:
        """The middle of the model's slip where it fits best, residuals there, and their space.

        Returns
        -------
        float
            Seconds from the peak.
        array, shape (bins + 1,)
            Whitened.
        array, shape (bins + 1, bins - 1)
            Orthonormal columns without level and shift.
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
        """Times at which a cycle is evaluated: in the bins, and a sample before and after."""
        return (middle + self._times + self.cycle.step * np.array([[-1.0], [0.0], [1.0]])).ravel()

    def _means(self, values: Float) -> Float:
        """Means in the bins, shape (bins, ...), of values at `_instants`."""
        before, at, after = values.reshape(3, -1, _IN_BIN, *values.shape[1:]).mean(2)
        # Samples are joined by straight lines: h^2/12 of the curvature is added.
        return np.asarray((before + 10 * at + after) / 12)

    def residuals(
        self, values: Mapping[str, float], *, search: bool | None = None
    ) -> Residuals | None:
        """Residuals in standard uncertainties; None where the law has no cycle.

        The Jacobian leaves out that level and shift follow (Kaufman, BIT 15, 49, 1975): the
        gradient of the sum of squares is exact.
        """
        cycle = self.limit_cycle(values)
        if cycle.end is not CycleEnd.REPEATS:
            return None
        middle, off, space = self._laid_over(cycle)
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
        """Whether cycles differ by more than the noise of the gauge."""
        cycle = self.cycle
        if cycle.spread <= _IRREGULAR * cycle.noise_spread:
            return ()
        return (
            f"{cycle.name}: its drops differ by {100 * cycle.spread:.2g} % where the noise of the "
            f"gauge explains {100 * cycle.noise_spread:.2g} %: the uncertainties are those of "
            "irregular cycles, whose mean is compared with a regular cycle",
        )
