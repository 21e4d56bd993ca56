"""The quasi-static loading-unloading test that measures the shear elastic length lambda.

Below the threshold of sliding the asperities deform and hardly slip: a shear force F displaces the
slider by F lambda/W, and the far end of the spring by F (lambda/W + 1/K). Bureau et al. (2000),
Sec. IV, after Berthoud and Baumberger (1998).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument, InputError, require
from asperity.experiment.recorded_motion import DISPLACEMENT, FORCE, LOAD, recorded_motion
from asperity.loads import Slide
from asperity.measurement.samples import require_one_dimension
from asperity.parameters.arguments import at_least, number, typed
from asperity.recording.trace import Trace
from asperity.slider import Slider
from asperity.tribometer.tribometer import Tribometer
from asperity.units import to_si

#: Share of each branch that is left out at both ends, because filters smooth the turning points.
_TRIM = 0.1

#: A turning point counts if the force then changes back by this share of its range.
_TURN = 0.3


@dataclass(frozen=True, eq=False)
class ElasticLength:
    """Result of a loading-unloading test.

    Attributes
    ----------
    lambda_, uncertainty : float
        Shear elastic length (m), and its standard uncertainty from the scatter of the cycles.
    cycles : array, shape (n,)
        lambda of each pair of a loading and an unloading (m), in which a steady drift of the
        gauge cancels.
    stiffness : float
        Mean slope dF/dx (N/m).
    """

    lambda_: float
    uncertainty: float
    cycles: Float
    stiffness: float


@typed
def loading_recording(
    slider: Slider,
    tribometer: Tribometer,
    *,
    velocity: float | str,
    low: float = 0.2,
    high: float = 0.6,
    cycles: int = 6,
    seed: Annotated[int, at_least(0)] = 0,
    **options: Any,
) -> Trace:
    """Record the test on a simulated slider, from steady sliding.

    Parameters
    ----------
    slider : Slider
        With a law of elastic asperities.
    tribometer : Tribometer
        With the channels ``"shear force"`` and ``"normal force"``, and ``"displacement"`` of the
        slider or ``"drive position"`` or both.
    velocity : float or str
        Velocity of the drive (m/s), to and fro.
    low, high : float
        Turning points of the force, over that of steady sliding.
    cycles : int
        Pairs of loading and unloading.
    seed : int
        Seed of the tribometer's noise.
    **options
        Options of `asperity.transients.transient`.

    Raises
    ------
    InputError
        If a value breaks its rule, or the motion ends before the test does.
    """
    speed = number(velocity, "loading_recording.velocity", "velocity", "positive")
    rule, got = "lie between 0 and 1 and rise", f"{low:g} and {high:g}"
    advice = "stay below the threshold of sliding, as 0.2 and 0.6 do"
    require(0 < low < high < 1, "loading_recording.low and high", rule, got, advice)
    field, advice = "loading_recording.cycles", "their scatter is the uncertainty"
    require(cycles >= 2, field, "be at least 2", cycles, advice)
    W0 = np.asarray(slider.W0).item()
    stroke = float(slider.law.mu_ss(speed)) * W0 / np.asarray(slider.K).item() / speed
    back, there = (1 - low) * stroke, (high - low) * stroke
    rounds = [Slide(there, velocity=speed), Slide(there, velocity=-speed)] * cycles
    steps = [Slide(back, velocity=-speed), *rounds]
    rule = "loading_recording.slider must stay below the threshold"
    return recorded_motion(slider, tribometer, steps, speed, rule, seed=seed, options=options)


@typed
def elastic_length(
    trace: Trace,
    *,
    displacement: str = DISPLACEMENT,
    force: str = FORCE,
    load: str = LOAD,
    spring: float | str | None = None,
) -> ElasticLength:
    """Shear elastic length from a recording of loading and unloading.

    Parameters
    ----------
    trace : Trace
        Simulated or read from a file.
    displacement, force, load : str
        Channels: of the slider's displacement, or of the drive's if `spring` is given.
    spring : float or str, optional
        Spring stiffness (N/m) between drive and slider, in series with the asperities.

    Returns
    -------
    ElasticLength

    Raises
    ------
    InputError
        If there are fewer than two pairs of loading and unloading, one of force and load is a
        stress, or `spring` is given and both are, or the displacement is no length.

    Notes
    -----
    Each branch between two turning points is fitted by x = a + F dx/dF; the first one, which comes
    from sliding, is left out.
    """
    from scipy.signal import find_peaks

    shear, moved, normal = (trace.channel(name) for name in (force, displacement, load))
    try:
        require_one_dimension(normal, shear, load, force)
    except InputError as error:
        raise error.about("elastic_length.force") from None
    rule, got = "be a length", f"'{displacement}' in '{moved.recorded_unit}'"
    advice = f"name its unit when reading, like {Argument('units', displacement, 'um')}"
    require(moved.kind == "length", "elastic_length.displacement", rule, got, advice)
    F, x, W = shear.values, moved.values, normal.values
    K = None if spring is None else to_si(spring, "stiffness", "elastic_length.spring")
    rule, area = "go with a force", Argument("read.area", value="25 cm^2")
    forces = K is None or shear.kind == "force"
    require(forces, "elastic_length.spring", rule, f"'{force}' in {shear.unit or '1'}",
            f"give the area that makes the stress a force, like {area}")  # fmt: skip
    reach = _TURN * float(np.ptp(F))
    turns = np.sort(np.concatenate([find_peaks(f, prominence=reach)[0] for f in (F, -F)]))
    branches = list(pairwise([*turns, F.size - 1]))
    slopes, loads = [], []
    for a, b in branches[: 2 * (len(branches) // 2)]:
        rim = max(int(_TRIM * (b - a)), 1)
        cut = slice(a + rim, b - rim)
        slopes.append(np.polynomial.Polynomial.fit(F[cut], x[cut], 1).convert().coef[1])
        loads.append(abs(np.mean(W[cut])))
    # The signs of force, displacement and load are conventions of the recorder.
    compliance = np.array(slopes) * np.sign(np.sum(slopes))
    lengths = np.array(loads) * (compliance - (0.0 if K is None else 1 / K))
    pairs = np.reshape(lengths, (-1, 2)).mean(1)
    rule = "hold two cycles of loading and unloading at least"
    advice = "record more, or choose the channel of the shear force"
    require(pairs.size >= 2, "elastic_length.trace", rule, pairs.size, advice)
    uncertainty = float(np.std(pairs, ddof=1) / np.sqrt(pairs.size))
    return ElasticLength(float(pairs.mean()), uncertainty, pairs, float(1 / np.mean(compliance)))
