"""Signals of a simulated motion, sampled finely enough for the tribometer, and their recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import InputError
from asperity.loads import Programme, ProgrammeStep
from asperity.recording.trace import Trace
from asperity.slider import Slider
from asperity.transients import integrate_blocks
from asperity.tribometer.tribometer import Tribometer

#: Channels that a tribometer may record of a simulated slider; the drive is the load point.
FORCE, LOAD, DISPLACEMENT, DRIVE = "shear force", "normal force", "displacement", "drive position"

#: Smallest number of samples of the motion for each sample of the recorder; with half as many,
#: amplitudes would be 4e-5 too small.
_FINER = 8


def motion_rate(tribometer: Tribometer) -> float:
    """Sampling rate (Hz) of a motion for a tribometer, a multiple of the recorder's rate."""
    recorder = float(tribometer.recorder.rate)
    sensors = tribometer.sensors.values()
    # A resonance, which most gauges do not have, needs two samples a period.
    fastest = max(max(4 * float(s.bandwidth), 2 * float(s.resonance)) for s in sensors)
    return recorder * max(_FINER, int(np.ceil(fastest / recorder)))


def signals(
    slider: Slider,
    programme: Programme,
    rate: float,
    names: tuple[str, ...],
    rule: str,
    options: Mapping[str, Any],
) -> tuple[dict[str, Float], Mapping[str, Any]]:
    """Time and selected columns of a transient, and its provenance.

    Parameters
    ----------
    slider, programme
    rate : float
        Hz.
    names : tuple of str
        Attributes of `Trajectory`.
    rule : str
        Beginning of the message if the motion ends early: field and rule.
    options : mapping
        Options of `asperity.transients.transient`.

    Raises
    ------
    InputError
        If the motion ends before the programme does.
    """
    kept: dict[str, list[Float]] = {name: [] for name in ("time", *names)}
    for block in integrate_blocks(slider, programme, sampling=rate, **options):
        for name, parts in kept.items():
            parts.append(getattr(block, name))
    if block.stopped is not None:
        raise InputError(f"{rule}, got a motion that ended: {block.stopped}")
    return {name: np.concatenate(parts) for name, parts in kept.items()}, block.provenance


def recorded_motion(
    slider: Slider,
    tribometer: Tribometer,
    steps: Sequence[ProgrammeStep],
    velocity: float,
    rule: str,
    *,
    seed: int,
    options: Mapping[str, Any],
) -> Trace:
    """Integrate steps of an experiment to their end, and record the channels of the tribometer.

    Parameters
    ----------
    slider, tribometer
    steps : sequence of ProgrammeStep
        From steady sliding under the load of the slider.
    velocity : float
        Pulling velocity before the first step (m/s).
    rule, options
        As of `signals`, which refuses a motion that ends early.
    seed : int
        Of the tribometer's noise.
    """
    programme = Programme(*steps, load=np.asarray(slider.W0).item(), velocity=velocity)
    wanted = ("force", "load", "displacement")
    rate = motion_rate(tribometer)
    columns, provenance = signals(slider, programme, rate, wanted, rule, options)
    offered = {
        FORCE: columns["force"],
        LOAD: columns["load"],
        DISPLACEMENT: columns["displacement"],
        DRIVE: programme.position(columns["time"]),
    }
    taken = {name: offered[name] for name in tribometer.sensors if name in offered}
    return tribometer.record(columns["time"], taken, seed=seed, provenance=provenance)
