"""The paper's protocol: modulate, read, switch off, measure F(0) again, next amplitude.

Bureau et al. (2000), Sec. II: the slider slides steadily; for each amplitude the modulation is
switched on, the mean force and its harmonics are read, and after switching off the unmodulated
force is measured again, so that a slow drift of the interface shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from asperity.experiment.amplitudes.protocol import amplitude_motion
from asperity.experiment.amplitudes.readings import AmplitudePoint, AmplitudeSeries
from asperity.experiment.exciter import Exciter
from asperity.experiment.motion import motion_rate
from asperity.slider import Slider
from asperity.tribometer.tribometer import Tribometer

__all__ = ["AmplitudePoint", "AmplitudeSeries", "amplitude_series"]


def amplitude_series(
    slider: Slider,
    tribometer: Tribometer,
    exciter: Exciter,
    epsilons: Sequence[float],
    *,
    velocity: float | str,
    sliding: float | str = "2 s",
    modulated: float | str = "4 s",
    rise: float | str = "0.1 s",
    harmonics: int = 2,
    seed: int = 0,
    **options: Any,
) -> AmplitudeSeries:
    """Run the protocol on a simulated slider, and read the recording as one of a laboratory.

    Parameters
    ----------
    slider : Slider
        That slides steadily without modulation: K above its critical value, or with inertia.
    tribometer : Tribometer
        With the channels ``"shear force"`` and ``"normal force"``; the latter measures the load
        as applied, not the part of it that an air layer bears.
    exciter : Exciter
    epsilons : sequence of float
        Commanded amplitudes, in the order of the experiment.
    velocity : float or str
        Pulling velocity (m/s).
    sliding, modulated, rise : float or str
        Seconds of sliding before, between and after, of modulation, and of its coming and going.
    harmonics : int
        To read.
    seed : int
        Of the tribometer's noise.
    **options
        Of `asperity.transients.transient`, such as ``inertia=True``.

    Raises
    ------
    InputError
        If a value breaks its rule, or the motion ends before the protocol does.
    """
    motion = amplitude_motion(
        slider, exciter, epsilons, rate=motion_rate(tribometer), velocity=velocity,
        sliding=sliding, modulated=modulated, rise=rise, **options,
    )  # fmt: skip
    return motion.recorded(tribometer, seed=seed, harmonics=harmonics)
