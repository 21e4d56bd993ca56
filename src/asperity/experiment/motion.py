"""Signals of a simulated motion, sampled finely enough for the tribometer, and their recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import InputError
from asperity.loads import Programme
from asperity.recording.trace import Trace
from asperity.slider import Slider
from asperity.transients import Trajectory, integrate_blocks
from asperity.tribometer.tribometer import Tribometer

#: Channels that a tribometer may have of a simulated slider; the drive is the load point.
FORCE, LOAD, DISPLACEMENT, DRIVE = "shear force", "normal force", "displacement", "drive position"

#: Smallest number of samples of the motion for each sample of the recorder; with half as many,
#: amplitudes would be 4e-5 too small.
_FINER = 8


def motion_rate(tribometer: Tribometer) -> float:
    """Sampling rate (Hz) of a motion for a tribometer, a multiple of the recorder's rate."""
    recorder = float(tribometer.recorder.rate)
    fastest = max(float(sensor.bandwidth) for sensor in tribometer.sensors.values())
    return recorder * max(_FINER, int(np.ceil(4 * fastest / recorder)))


def signals(
    slider: Slider, programme: Programme, rate: float, names: tuple[str, ...], **options: Any
) -> tuple[dict[str, Float], Trajectory]:
    """Time and selected columns of a transient.

    Parameters
    ----------
    slider, programme
    rate : float
        Hz.
    names : tuple of str
        Attributes of `Trajectory`.
    **options
        Options of `asperity.transients.transient`.

    Returns
    -------
    (dict of str to array, Trajectory)
        The columns with ``time``, and the last block, which has the reason of the end.
    """
    kept: dict[str, list[Float]] = {name: [] for name in ("time", *names)}
    for block in integrate_blocks(slider, programme, sampling=rate, **options):
        for name, parts in kept.items():
            parts.append(getattr(block, name))
    return {name: np.concatenate(parts) for name, parts in kept.items()}, block


def recorded_motion(
    slider: Slider,
    tribometer: Tribometer,
    programme: Programme,
    rule: str,
    *,
    seed: int,
    options: Mapping[str, Any],
) -> Trace:
    """Integrate a programme to its end, and record the channels of the tribometer.

    Parameters
    ----------
    slider, tribometer, programme
    rule : str
        Beginning of the message where the motion ends early: field and rule.
    seed : int
        Seed of the tribometer's noise.
    options : mapping
        Options of `asperity.transients.transient`.

    Raises
    ------
    InputError
        If the motion ends before the programme does.
    """
    wanted = ("force", "load", "displacement")
    columns, last = signals(slider, programme, motion_rate(tribometer), wanted, **options)
    if last.stopped is not None:
        raise InputError(f"{rule}, got a motion that ended: {last.stopped}")
    offered = {
        FORCE: columns["force"],
        LOAD: columns["load"],
        DISPLACEMENT: columns["displacement"],
        DRIVE: programme.position(columns["time"]),
    }
    taken = {name: offered[name] for name in tribometer.sensors if name in offered}
    return tribometer.record(columns["time"], taken, seed=seed, provenance=last.provenance)
