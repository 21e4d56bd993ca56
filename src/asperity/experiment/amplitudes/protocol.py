"""The motion of the amplitude protocol, which can be recorded as often as wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.experiment.amplitudes.readings import AmplitudePoint, AmplitudeSeries
from asperity.experiment.exciter import Exciter
from asperity.experiment.motion import FORCE, LOAD, signals
from asperity.loads import Programme, ProgrammeStep, Slide
from asperity.measurement.measure import measure
from asperity.slider import Slider
from asperity.tribometer.tribometer import Tribometer
from asperity.units import to_si

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AmplitudeMotion:
    """Motion of a slider through the amplitude protocol.

    Attributes
    ----------
    time : array, shape (n,)
        Evenly spaced (s).
    force : array, shape (n,)
        Of the spring (N).
    load : array, shape (n,)
        As applied (N), air layer included.
    epsilons : tuple of float
        Commanded.
    velocity, sliding, modulated : float
        Of the drive (m/s); seconds without and with modulation.
    exciter : Exciter
    provenance : mapping
        Of the integration.
    """

    time: Array
    force: Array
    load: Array
    epsilons: tuple[float, ...]
    velocity: float
    sliding: float
    modulated: float
    exciter: Exciter
    provenance: Mapping[str, Any]

    def recorded(
        self, tribometer: Tribometer, *, seed: int = 0, harmonics: int = 2
    ) -> AmplitudeSeries:
        """Record the motion, and read the recording as one of a laboratory.

        Parameters
        ----------
        tribometer : Tribometer
            With the channels ``"shear force"`` and ``"normal force"``; the latter measures the
            load as applied, not the part of it that an air layer bears.
        seed : int
            Of the tribometer's noise: another seed, another recording.
        harmonics : int
            To read.
        """
        trace = tribometer.record(
            self.time, {FORCE: self.force, LOAD: self.load}, seed=seed, provenance=self.provenance
        )
        frequency = self.exciter.frequency
        points = []
        for i, epsilon in enumerate(self.epsilons):
            begin = i * (self.sliding + self.modulated)
            end = begin + 2 * self.sliding + self.modulated
            part = trace.slice(begin, end)
            found = measure(part, load=LOAD, force=FORCE, frequency=frequency, harmonics=harmonics)
            points.append(AmplitudePoint(epsilon, begin, end, found))
        return AmplitudeSeries(
            trace, tuple(points), self.velocity, frequency, self.exciter.transfer
        )


def amplitude_motion(
    slider: Slider,
    exciter: Exciter,
    epsilons: Sequence[float],
    *,
    rate: float,
    velocity: float | str,
    sliding: float | str = "2 s",
    modulated: float | str = "4 s",
    rise: float | str = "0.1 s",
    **options: Any,
) -> AmplitudeMotion:
    """Integrate the protocol; parameters as `amplitude_series` describes them.

    Parameters
    ----------
    rate : float
        Samples of the motion per second (Hz), as `motion_rate` has it for a tribometer.

    Raises
    ------
    InputError
        If a value breaks its rule, or the motion ends before the protocol does.
    """
    speed = to_si(velocity, "velocity", "amplitude_series.velocity")
    off, on, slow = (
        to_si(value, "time", f"amplitude_series.{name}")
        for name, value in (("sliding", sliding), ("modulated", modulated), ("rise", rise))
    )
    applied: list[ProgrammeStep] = [Slide(off)]
    borne: list[ProgrammeStep] = [Slide(off)]
    for epsilon in epsilons:
        outer, inner = exciter.steps(epsilon, on, slow)
        applied += [outer, Slide(off)]
        borne += [inner, Slide(off)]
    W0 = np.asarray(slider.W0).item()
    borne_load = Programme(*borne, load=W0, velocity=speed)
    applied_load = Programme(*applied, load=W0, velocity=speed)
    columns, last = signals(slider, borne_load, rate, ("force",), **options)
    if last.stopped is not None:
        raise InputError(
            f"amplitude_series.slider must slide to the end of the protocol, got a motion that "
            f"ended: {last.stopped}"
        )
    time = columns["time"]
    return AmplitudeMotion(
        time, columns["force"], applied_load.load(time), tuple(map(float, epsilons)),
        speed, off, on, exciter, last.provenance,
    )  # fmt: skip
