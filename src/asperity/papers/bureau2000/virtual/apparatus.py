"""The simulated machine: the paper's slider, exciter and air layer, and sensors of our choice.

Where the paper gives a number it is taken. It does not give the noise of its gauges; and at its
central values sliding is unsteady without modulation, with which its protocol begins.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from asperity.air import AirLayer, patch_radius
from asperity.experiment import Exciter
from asperity.experiment.motion import FORCE, LOAD
from asperity.papers.bureau2000.numbers.machine import EXT, fitted_share, paper
from asperity.papers.bureau2000.numbers.machine import slider as paper_slider
from asperity.slider import Slider
from asperity.tribometer.sensors import LoadCell, SpringGauge
from asperity.tribometer.tribometer import Recorder, Tribometer

#: B lies this much of its stated uncertainty below its central value, where K/Kc = 1.6 instead of
#: 0.88. The response hardly depends on B: of fast modulation not at all.
_BELOW = 0.6

#: Of the eddy-current gauge: noise (m), and rms of the drift (m/s) that runs differ by.
GAUGE_NOISE, GAUGE_DRIFT = 10e-9, 0.2e-9
#: Of the load cell (N), and the bandwidth of both (Hz).
CELL_NOISE, BANDWIDTH = 5e-3, 1000.0

#: Samples and cut-off of the recorder, over the frequency of the modulation. 35 samples in six
#: periods: no harmonic below the 33rd is aliased onto the first or the second.
_RATE, _CUT_OFF = 35 / 6, 2.5


def state_coefficient() -> float:
    """B of the simulated interface, within its stated uncertainty."""
    number = paper()["B"]
    return number.si - _BELOW * (number.si_uncertainty or 0.0)


def slider() -> Slider:
    """The elasto-plastic slider, which slides steadily without modulation."""
    return paper_slider(EXT, B=state_coefficient())


def exciter(frequency: float, *, vacuum: bool = False) -> Exciter:
    """The exciter at a frequency (Hz), on the air under a patch as the appendix proposes.

    The appendix' full disc gives half of the measured shares at both frequencies, a patch both.
    """
    p = paper()
    layer = None if vacuum else replace(_layer(), R=radius())
    return Exciter.through_air(frequency, slider(), p.lambda_z, layer)


@cache
def radius() -> float:
    """Radius (m) of the patch that gives the share of all figures, 0.48 at 120 Hz: 2.51 cm."""
    p = paper()
    (R,) = patch_radius(
        fitted_share(), p.frequency, W0=p.W0, M=p.M, lambda_z=p.lambda_z, layer=_layer()
    ).solutions
    return R


def _layer() -> AirLayer:
    p = paper()
    return AirLayer(P0=p.P0, h0=p.h0, eta=p.eta_air, R=p.R)


def tribometer(frequency: float, seed: int | None = None) -> Tribometer:
    """Gauge, load cell and recorder for a modulation at a frequency (Hz).

    Parameters
    ----------
    frequency : float
    seed : int, optional
        Of a run, which draws its drift of the gauge; None is one without drift.
    """
    drift = 0.0
    if seed is not None:
        # A stream of its own, beside that of the noise.
        drift = GAUGE_DRIFT * np.random.default_rng([seed, 1]).standard_normal()
    sensors = {
        FORCE: SpringGauge(
            stiffness=paper().K, bandwidth=BANDWIDTH, noise=GAUGE_NOISE, drift=float(drift)
        ),
        LOAD: LoadCell(bandwidth=BANDWIDTH, noise=CELL_NOISE),
    }
    recorder = Recorder(rate=_RATE * frequency, cut_off=_CUT_OFF * frequency)
    return Tribometer(sensors=sensors, recorder=recorder)


def description(frequency: float) -> list[str]:
    """Lines that say what is simulated."""
    p, machine = paper(), tribometer(frequency)
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
