"""Stick-slip of a simulated slider: period, drop, durations and velocities, for many points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.arrays import Bool, Float
from asperity.errors import require
from asperity.experiment.labelled import Labelled, measured, shaped
from asperity.parameters import MACHINE, obeying
from asperity.parameters.arguments import number, typed
from asperity.parameters.parameter import Drawn
from asperity.slider import Slider, equation_of_motion
from asperity.slider.problem import flatten, require_even_track
from asperity.theory.linear_stability import steady_growth
from asperity.transients.limit_cycle import CycleEnd, LimitCycle, limit_cycle


@dataclass(frozen=True, repr=False, kw_only=True)
class StickSlip(Labelled, Drawn):
    """Limit cycles under a drive of constant velocity; arrays of one shape.

    Numbers are NaN where no cycle repeats itself; `result` says why.

    Attributes
    ----------
    velocity : array
        Velocity of the drive (m/s).
    period, stick_duration, slip_duration : array
        Seconds. In a slip the force falls from its peak to its lowest value: the slider is faster
        than the drive. Sums over the slips of a period.
    drop, peak, lowest : array
        F/W0; the drop is the peak less the lowest.
    peak_velocity : array
        Largest velocity of the slider (m/s).
    slips : int array
        In a period; 0 where no cycle repeats itself.
    steady : bool array
        Whether the motion ends in steady sliding.
    stable : bool array
        Whether steady sliding is stable against small disturbances. Where it is, and there is
        stick-slip all the same, the beginning of the motion decides.
    result : str array
        Sentence on how the motion ends: stick-slip, steady sliding, or why neither.
    slider : Slider
    cycle : LimitCycle or None
        Cycle of a single point: the force at any time of a period.
    """

    shown = ("period", "drop", "slip_duration", "peak_velocity")
    _drawn_by = "asperity.figures.response:draw_stick_slip_response"

    velocity: Float = measured("m/s", "velocity of the drive", drive=True)
    period: Float = measured("s", "period of stick-slip")
    drop: Float = measured("1", "largest less smallest F/W0")
    peak: Float = measured("1", "largest F/W0")
    lowest: Float = measured("1", "smallest F/W0")
    stick_duration: Float = measured("s", "time of a period in which the force rises")
    slip_duration: Float = measured("s", "time of a period in which the force falls")
    peak_velocity: Float = measured("m/s", "largest velocity of the slider")
    slips: NDArray[np.int_] = measured("1", "slips in a period; 0 without stick-slip")
    steady: Bool = measured("1", "whether the motion comes to steady sliding")
    stable: Bool = measured("1", "whether steady sliding is stable")
    result: NDArray[np.object_]
    slider: Slider
    cycle: LimitCycle | None = None

    def outcomes(self) -> str:
        """Number of points, and number of those with stick-slip."""
        return f"{self.slips.size} points, {int(np.sum(self.slips > 0))} with stick-slip"


@typed
def stick_slip_response(
    slider: Slider,
    *,
    velocity: ArrayLike | str,
    spring: ArrayLike | str | None = None,
    inertia: bool = True,
    radiation_damping: float | str | None = None,
    rtol: float = 1e-9,
) -> StickSlip:
    """Long-term motion of a slider pulled at a constant velocity: stick-slip or steady sliding.

    Parameters
    ----------
    slider : Slider
        Its parameters may be arrays, which broadcast with the velocity.
    velocity : array or str
        Velocity of the drive (m/s), positive.
    spring : array or str, optional
        Stiffness (N/m) in the place of that of the slider.
    inertia : bool
        Whether the mass of the slider counts. Without it a slip of most laws runs away, and there
        is no cycle; `result` says so.
    radiation_damping : float or str, optional
        eta (N s/m), positive.
    rtol : float
        Tolerated error of a step, as in `asperity.transient`.

    Returns
    -------
    StickSlip

    Raises
    ------
    InputError
        If a value breaks its rule, or the law does not depend on velocity or varies along a track.

    Notes
    -----
    The motion begins after sliding at a thousandth of the velocity, so that of a cycle and stable
    steady sliding the cycle is reached. Near its end Newton's method closes the cycle, of up to
    eight slips, which is taken where all its multipliers lie within the unit circle; `drop`, `peak`
    and `period` are accurate to about 1e-8 relatively. One point after the other takes some
    hundredths of a second each: steps of stiff motions differ too much to be taken together.
    """
    law = slider.law
    advice = "asperity.theory has the cycle of constant static and dynamic friction"
    require(law.rate_dependent, "law", "depend on the velocity", law.name, advice)
    require_even_track(law, "a limit cycle")
    V = obeying(velocity, "stick_slip_response.velocity", "velocity", "positive")
    if spring is not None:
        stiffness: Any = spring
        slider = Slider(law, spring=stiffness, load=slider.W0, mass=slider.M)
    eta = None
    if radiation_damping is not None:
        eta = number(radiation_damping, MACHINE["eta"].label, "damping", "positive")
    (flat, V), shape = flatten((slider, V), "stick_slip_response")
    motion = equation_of_motion(flat, V, np.ones(len(V)), inertia=inertia, eta=eta)
    cycles = [
        limit_cycle(
            jax.tree.map(lambda a, i=i: a[i], flat), float(v), inertia=inertia,
            radiation_damping=eta, rtol=rtol,
        )
        for i, v in enumerate(V)
    ]  # fmt: skip

    def of(name: str, kind: Any = float) -> Any:
        return np.array([getattr(cycle, name) for cycle in cycles], kind)

    numbers = ("period", "drop", "peak", "lowest", "stick_duration", "slip_duration")
    columns = {
        "velocity": V,
        **{name: of(name) for name in (*numbers, "peak_velocity")},
        "slips": of("slips", int),
        "steady": of("end", object) == CycleEnd.STEADY,
        "stable": np.asarray(steady_growth(motion)) < 0,
        "result": of("result", object),
    }
    shown = {name: shaped(a, shape) for name, a in columns.items()}
    return StickSlip(slider=slider, cycle=cycles[0] if len(cycles) == 1 else None, **shown)
