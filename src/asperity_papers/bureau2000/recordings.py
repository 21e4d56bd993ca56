"""The simulated machine, the recordings of the paper's protocol, and the points read off them.

The machine has the paper's slider, exciter and air layer at the paper's numbers. Two things differ:
the paper does not give the noise of its sensors, which is our choice; and B is a little smaller,
because at the paper's central values sliding without modulation, with which the protocol begins, is
unsteady.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from asperity import Slider
from asperity.air import patch_radius
from asperity.experiment import (
    FORCE,
    LOAD,
    AmplitudeSeries,
    Exciter,
    amplitude_motion,
    channel_gain,
)
from asperity.parameters import typed
from asperity.tribometer import LoadCell, Recorder, SpringGauge, Tribometer
from asperity_papers.bureau2000.machine import EXT, Float, Machine

#: The paper's machine at its printed numbers.
PRINTED = Machine()

# --- The machine ----------------------------------------------------------------------------------

#: B lies this much of its stated uncertainty below its central value, where K/Kc = 1.6 instead of
#: 0.88. The response hardly depends on B; that to fast modulation not at all.
_BELOW = 0.6

#: Eddy-current gauge: noise (m), and rms (m/s) of the drift, which differs between runs.
GAUGE_NOISE, GAUGE_DRIFT = 10e-9, 0.2e-9
#: Noise of the load cell (N), and bandwidth of gauge and load cell (Hz).
CELL_NOISE, BANDWIDTH = 5e-3, 1000.0

#: Samples and cut-off of the recorder, over the frequency of the modulation. 35 samples in six
#: periods: no harmonic below the 33rd is aliased onto the first or the second.
_RATE, _CUT_OFF = 35 / 6, 2.5


def state_coefficient() -> float:
    """B of the simulated interface, within its stated uncertainty."""
    number = PRINTED.numbers["B"]
    return number.si - _BELOW * (number.si_uncertainty or 0.0)


def slider() -> Slider:
    """The elasto-plastic slider, which slides steadily without modulation."""
    return PRINTED.slider(EXT, B=state_coefficient())


@typed
def exciter(frequency: float, *, vacuum: bool = False) -> Exciter:
    """The exciter at a frequency (Hz), on the air under a patch as the appendix proposes.

    The full disc of the appendix gives half of the measured shares at both frequencies; a patch
    gives both of them.
    """
    layer = None if vacuum else PRINTED.air_layer(R=radius())
    return Exciter.through_air(frequency, slider(), PRINTED.numbers.lambda_z, layer)


@cache
def radius() -> float:
    """Radius (m) of the patch that gives the share of all figures, 0.48 at 120 Hz: 2.51 cm."""
    p = PRINTED.numbers
    (R,) = patch_radius(
        PRINTED.share, p.frequency, W0=p.W0, M=p.M, lambda_z=p.lambda_z, layer=PRINTED.air_layer()
    ).solutions
    return R


@typed
def tribometer(frequency: float, seed: int | None = None) -> Tribometer:
    """Gauge, load cell and recorder for a modulation at a frequency (Hz).

    Parameters
    ----------
    frequency : float
    seed : int, optional
        Seed of a run, which draws its drift of the gauge; None is one without drift.
    """
    drift = 0.0
    if seed is not None:
        # Another stream than that of the noise.
        drift = GAUGE_DRIFT * np.random.default_rng([seed, 1]).standard_normal()
    sensors = {
        FORCE: SpringGauge(
            stiffness=PRINTED.numbers.K, bandwidth=BANDWIDTH, noise=GAUGE_NOISE, drift=float(drift)
        ),
        LOAD: LoadCell(bandwidth=BANDWIDTH, noise=CELL_NOISE),
    }
    recorder = Recorder(rate=_RATE * frequency, cut_off=_CUT_OFF * frequency)
    return Tribometer(sensors=sensors, recorder=recorder)


@typed
def description(frequency: float) -> list[str]:
    """Lines that say what is simulated."""
    p, machine = PRINTED.numbers, tribometer(frequency)
    return [
        f"law {EXT}, material bureau2000 but B = {state_coefficient():g} (stated "
        f"{p['B']}): K > Kc, so that sliding without modulation is steady; no inertia",
        f"air layer of the appendix under a patch of R = {100 * radius():.2f} cm (the appendix "
        f"proposes {p['patch_radius']}): borne over applied modulation "
        f"{abs(exciter(frequency).transfer):.4f} at {frequency:g} Hz",
        f"gauge: first-order, {BANDWIDTH:g} Hz, noise {1e9 * GAUGE_NOISE:g} nm, drift "
        f"{1e9 * GAUGE_DRIFT:g} nm/s rms, drawn for each run; load cell: first-order, "
        f"{BANDWIDTH:g} Hz, noise {1e3 * CELL_NOISE:g} mN (our choice: the text gives neither)",
        f"recorder: {machine.recorder.rate:.6g} Hz, fourth-order low-pass at "
        f"{machine.recorder.cut_off:g} Hz; amplitudes are corrected for the known gain of both",
    ]


# --- The protocol, and what is read ---------------------------------------------------------------

#: Quantities of a point; each has a value, two measures of its scatter, and the model's value.
QUANTITIES = ("mean_friction", "static_friction", "delta_mu", "mu1", "mu2")

#: Commanded amplitudes; the last three are those of Fig. 3.
AMPLITUDES = (0.05, 0.1, 0.2, 0.35, 0.5)
#: Ends of the velocities of Fig. 3 (m/s). The paper goes down to a tenth of the lower one, where
#: each memory length takes four seconds.
VELOCITIES = (1e-6, 1e-4)

#: Points by the name of the series, a row for each amplitude; all columns but the model's.
SimulatedPoints: TypeAlias = Mapping[str, pd.DataFrame]

#: Verdicts from the best to the worst.
_GRAVITY = ("ok", "suspicious", "bad")
#: Runs of a point, as many as the paper has averaged over in its Fig. 6.
_SEEDS = 10
#: Distance (m) and shortest time (s) of sliding without and with modulation: transients take two
#: memory lengths and more.
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
        Number of the series; run r has the seed 10 number + r.
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
        """Seeds of the runs."""
        return [_SEEDS * self.number + run for run in range(int(PRINTED.numbers.runs_averaged))]

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
        """Borne over applied modulation in the machine."""
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
        "verdict": [
            max((str(p.measurement.verdict) for p in same), key=_GRAVITY.index)
            for same in zip(*(run.points for run in runs), strict=True)
        ],
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
    readings = [[point.measurement.reading for point in run.points] for run in runs]
    read["window"] = np.array([[r.end - r.start for r in row] for row in readings])
    return read


def _phasor(read: dict[str, Float], name: str) -> np.ndarray:
    """Complex amplitudes: their mean is not raised by noise as that of their moduli is."""
    return read[name] * np.exp(1j * read[f"phase{name[-1]}"])


def all_series() -> tuple[Series, ...]:
    """The two velocities of Figs. 2 and 4, more of them for Fig. 3, and the pair of Fig. 5."""
    p, (slow, fast) = PRINTED.numbers, PRINTED.velocities
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
    """A series in air, at the frequency of most of the paper's data, named after its velocity."""
    name = f"{1e6 * velocity:.3g} um/s"
    return Series(name, velocity, PRINTED.numbers.frequency, epsilons, number)


#: One thread each for XLA and for NumPy's linear algebra: the other core is taken.
_ONE_THREAD = {"NPROC": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


@contextmanager
def experiment_in_background() -> Iterator[Callable[[], SimulatedPoints]]:
    """Start `experiment` in another process, and yield a function that waits for its points.

    On a single core, that function computes them. The numbers are the same on any machine. If the
    block is left early, by Ctrl-C or an error, the process is ended.
    """
    from loky import ProcessPoolExecutor, cpu_count

    if cpu_count() < 2:
        yield experiment
        return
    executor = ProcessPoolExecutor(max_workers=1, env=_ONE_THREAD)
    try:
        yield executor.submit(experiment).result
    finally:
        executor.shutdown(wait=False, kill_workers=True)
