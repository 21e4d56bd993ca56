"""Simulated recordings of the paper's protocol, and the points that are read off them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from asperity.experiment import (
    AmplitudePoint,
    AmplitudeSeries,
    amplitude_motion,
    channel_gain,
)
from asperity.experiment.motion import FORCE, LOAD
from asperity.measurement.verdicts.verdict import worst
from asperity.papers.bureau2000.numbers.machine import Float, paper, velocities
from asperity.papers.bureau2000.virtual.apparatus import exciter, slider, tribometer

#: Quantities of a point; each has a value, two measures of its scatter, and the model's value.
QUANTITIES = {
    "mean_friction": "mean of F/W0",
    "static_friction": "F/W0 without modulation, before and after",
    "delta_mu": "mean_friction less static_friction",
    "mu1": "amplitude of the first harmonic of F/W0",
    "mu2": "amplitude of the second harmonic of F/W0",
}

#: Columns of the table of points, with unit and meaning.
POINT_COLUMNS = {
    "series": "name of the series",
    "V": "m/s; pulling velocity",
    "frequency": "Hz; of the load modulation",
    "epsilon_set": "1; commanded relative amplitude of the load",
    "epsilon": "1; the same as measured",
    "epsilon_eff": "1; amplitude that the contacts bear, which is not measured",
    "seeds": "of the runs: of their noise and of their drift",
    "window": "s; mean length of what the lock-in has read",
    "verdict": "gravest verdict of the readings",
    **{
        f"{name}{suffix}": f"1; {text.format(meaning)}"
        for name, meaning in QUANTITIES.items()
        for suffix, text in {
            "": "{}, mean over the runs",
            "_stated": "standard uncertainty that a reading states for itself, rms over the runs",
            "_scatter": "standard deviation over the runs",
            "_uncertainty": "the larger of the two, drawn 1.96-fold",
            "_model": "of the periodic orbit at epsilon_eff; no reading",
        }.items()
    },
}

#: Commanded amplitudes; the last three are those of Fig. 3.
AMPLITUDES = (0.05, 0.1, 0.2, 0.35, 0.5)
#: Ends of the velocities of Fig. 3 (m/s). The paper goes down to a tenth of the lower one, where
#: each memory length takes four seconds.
VELOCITIES = (1e-6, 1e-4)

#: Points by the name of the series, a row for each amplitude; all of `POINT_COLUMNS` but the model.
SimulatedPoints: TypeAlias = Mapping[str, pd.DataFrame]

#: Half a 95 % interval, in standard uncertainties.
NORMAL = 1.96

#: Runs of a point, as many as the paper has averaged over in its Fig. 6.
_SEEDS = 10
#: Sliding without and with modulation (m), and never for less than so long (s): transients take
#: two memory lengths and more.
_SLIDING, _MODULATED = (15e-6, 2.0), (16e-6, 2.0)
#: Integration error of a step: a hundredth of the noise of any reading.
_RTOL = 1e-6
#: Samples of the motion for one of the recorder's, 29 a period: recorded amplitudes are then right
#: to 1e-4 at f and 2e-3 at 2f, a tenth of the bars.
_FINER = 5


@dataclass(frozen=True)
class Series:
    """One run of the protocol.

    Attributes
    ----------
    name : str
    velocity, frequency : float
        m/s, Hz.
    epsilons : tuple of float
        Commanded, in their order.
    number : int
        Of the series; run r has the seed 10 number + r.
    vacuum : bool
    """

    name: str
    velocity: float
    frequency: float
    epsilons: tuple[float, ...]
    number: int
    vacuum: bool = False

    @property
    def seeds(self) -> list[int]:
        """Of its runs."""
        return [_SEEDS * self.number + run for run in range(int(paper().runs_averaged))]

    @property
    def sliding(self) -> float:
        """Seconds without modulation before, between and after."""
        return max(_SLIDING[0] / self.velocity, _SLIDING[1])

    @property
    def modulated(self) -> float:
        """Seconds of modulation at each amplitude."""
        return max(_MODULATED[0] / self.velocity, _MODULATED[1])

    @property
    def transfer(self) -> complex:
        """Borne over applied modulation, as the machine has it."""
        return exciter(self.frequency, vacuum=self.vacuum).transfer


def experiment() -> SimulatedPoints:
    """All series, simulated, recorded and read."""
    return {series.name: _points(series) for series in all_series()}


def _points(series: Series) -> pd.DataFrame:
    """Simulate a series, record it once for each seed, and read the recordings."""
    V, f = series.velocity, series.frequency
    motion = amplitude_motion(
        slider(), exciter(f, vacuum=series.vacuum), series.epsilons,
        rate=_FINER * tribometer(f).recorder.rate, velocity=V,
        sliding=series.sliding,
        modulated=series.modulated, rtol=_RTOL,
    )  # fmt: skip
    runs = [motion.recorded(tribometer(f, seed), seed=seed) for seed in series.seeds]
    read = _readings(runs, f)
    rows: dict[str, Any] = {
        "series": series.name,
        "V": V,
        "frequency": f,
        "epsilon_set": series.epsilons,
        "epsilon": read["measured_epsilon"].mean(0),
        "epsilon_eff": abs(series.transfer) * np.array(series.epsilons),
        "seeds": " ".join(map(str, series.seeds)),
        "window": read["window"].mean(0),
        "verdict": [_gravest(same) for same in zip(*(run.points for run in runs), strict=True)],
    }
    for name in QUANTITIES:
        stated = np.sqrt(np.mean(np.square(read[f"{name}_uncertainty"]), 0))
        scatter = read[name].std(0, ddof=1)
        rows[name] = abs(_phasor(read, name).mean(0)) if name[-1] in "12" else read[name].mean(0)
        rows[f"{name}_stated"], rows[f"{name}_scatter"] = stated, scatter
        rows[f"{name}_uncertainty"] = np.maximum(stated, scatter)
    return pd.DataFrame(rows)


def _readings(runs: list[AmplitudeSeries], frequency: float) -> dict[str, Float]:
    """Name to values of shape (runs, amplitudes), corrected for the gain of the channels."""
    tables = [run.to_dataset() for run in runs]
    read = {str(n): np.array([t[n].values for t in tables]) for n in tables[0].data_vars}
    machine = tribometer(frequency)
    read["measured_epsilon"] /= abs(channel_gain(machine, LOAD, frequency))
    for n in (1, 2):
        gain = abs(channel_gain(machine, FORCE, n * frequency))
        read[f"mu{n}"] /= gain
        read[f"mu{n}_uncertainty"] /= gain
    # The drop's uncertainty is that of the mean and that of F(0) together.
    both, mean = read["delta_mu_uncertainty"], read["mean_friction_uncertainty"]
    read["static_friction_uncertainty"] = np.sqrt(np.maximum(both**2 - mean**2, 0))
    found = [[point.measurement.reading for point in run.points] for run in runs]
    read["window"] = np.array([[r.end - r.start for r in row] for row in found])
    return read


def _phasor(read: dict[str, Float], name: str) -> np.ndarray:
    """Complex amplitudes: their mean is not raised by noise as that of their moduli is."""
    return read[name] * np.exp(1j * read[f"phase{name[-1]}"])


def _gravest(same: tuple[AmplitudePoint, ...]) -> str:
    return worst([check for point in same for check in point.measurement.checks])


def all_series() -> tuple[Series, ...]:
    """The two velocities of Figs. 2 and 4, more of them for Fig. 3, and the pair of Fig. 5."""
    p, (slow, fast) = paper(), velocities()
    low, high = VELOCITIES
    others = [V for V in np.geomspace(low, high, 5) if not np.isclose([slow, fast], V).any()]
    few = AMPLITUDES[-3:]
    return (
        *(_series(V, AMPLITUDES, 1 + i) for i, V in enumerate((slow, fast))),
        *(_series(V, few, 3 + i) for i, V in enumerate(others)),
        Series("1 mbar", p.V_vacuum, p.frequency_vacuum, AMPLITUDES, 8, vacuum=True),
        Series("1 atm", p.V_vacuum, p.frequency_vacuum, AMPLITUDES[1:], 9),
    )


def _series(velocity: float, epsilons: tuple[float, ...], number: int) -> Series:
    """In air, at the frequency of most of the paper's data."""
    return Series(series_name(velocity), velocity, paper().frequency, epsilons, number)


def series_name(velocity: float) -> str:
    """A series by its velocity, such as ``"10 um/s"``."""
    return f"{1e6 * velocity:.3g} um/s"
