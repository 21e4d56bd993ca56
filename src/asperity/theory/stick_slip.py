"""Stick-slip in closed form: overshooting slider, and stress drops that grow with the stick time.

A slider of mass M under the load W0 rests until the spring force K (V t - x) reaches mu_s W0, and
slips at the constant friction mu_d W0 until it rests again. With omega = sqrt(K/M) and
strength = mu_s - mu_d the spring force during a slip is

    F/W0 - mu_d = strength cos(omega t) + K V/(W0 omega) sin(omega t),

and the slider rests when its velocity V - F'/K is zero again: at F/W0 = mu_d - strength for every
V. Strength that grows with the time of rest t as strength_1 + B ln(t/t_1) makes the drop grow with
the logarithm of the recurrence. Heslot, Baumberger, Perrin, Caroli and Caroli, Phys. Rev. E 49,
4973 (1994), measure both regimes; the formulas are derived here.

Everything is SI, element-wise in arrays that broadcast.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from asperity.arrays import Float
from asperity.parameters.rules import obeying

#: Newton's steps; they converge from above in five.
_STEPS = 40


class StickSlipCycle(NamedTuple):
    """A cycle of stick-slip.

    Attributes
    ----------
    drop : array
        Fall of F/W0 in a slip.
    stick_duration, slip_duration, period : array
        Seconds.
    slip : array
        Displacement of the slider (m): V period.
    peak_velocity : array
        Largest velocity of the slider (m/s).
    """

    drop: Float
    stick_duration: Float
    slip_duration: Float
    period: Float
    slip: Float
    peak_velocity: Float


def overshooting_cycle(
    strength: ArrayLike, *, K: ArrayLike, M: ArrayLike, W0: ArrayLike, V: ArrayLike
) -> StickSlipCycle:
    """Cycle of a slider of constant static and dynamic friction.

    Parameters
    ----------
    strength : array
        mu_s - mu_d, positive.
    K : array
        Stiffness of the spring (N/m).
    M : array
        Mass of the slider (kg).
    W0 : array
        Normal load (N).
    V : array
        Velocity of the spring's far end (m/s).

    Raises
    ------
    InputError
        If a value is not positive.

    Notes
    -----
    The drop is 2 strength at every velocity. A slip lasts for 2 (pi - arctan(strength W0 omega /
    (K V)))/omega: half a period of sqrt(K/M) for a slow drive, a whole one for a fast drive.
    """
    strength = obeying(strength, "cycle.strength", "dimensionless", "positive")
    K, M, W0, V = _machine(K=K, M=M, W0=W0, V=V)
    omega = np.sqrt(K / M)
    slow = strength * W0 * omega / (K * V)
    slip_duration = 2 * (np.pi - np.arctan(slow)) / omega
    drop = 2 * strength
    stick_duration = drop * W0 / (K * V)
    period = stick_duration + slip_duration
    peak = V + np.sqrt(V**2 + (strength * W0) ** 2 / (K * M))
    return StickSlipCycle(*np.broadcast_arrays(
        drop, stick_duration, slip_duration, period, V * period, peak
    ))  # fmt: skip


def healing_drop(
    strength: ArrayLike,
    B: ArrayLike,
    time: ArrayLike,
    *,
    K: ArrayLike,
    W0: ArrayLike,
    V: ArrayLike,
    overshoot: ArrayLike = 2.0,
) -> Float:
    """Drop of F/W0 of a cycle whose strength grows with the logarithm of the time of rest.

    Parameters
    ----------
    strength : array
        mu_s - mu_d after the time of rest `time`, positive.
    B : array
        Growth of mu_s for each e-fold of the time of rest, positive.
    time : array
        Seconds.
    K, W0, V : array
        As in `overshooting_cycle`.
    overshoot : array
        Drop over mu_s - mu_d: 2 with inertia, 1 for a slip that ends at mu_d.

    Returns
    -------
    array
        NaN where the slider cannot stick: the strength at the shortest time of rest that the spring
        allows is not positive.

    Raises
    ------
    InputError
        If a value is not positive.

    Notes
    -----
    The spring loads the drop D in the time of rest t = D W0/(K V), so that D = overshoot (strength
    + B ln(t/time)): with u = D/(overshoot B) and c = strength/B + ln(overshoot B W0/(K V time)),
    u - ln u = c, of which the root above 1 is stable. Along it dD/d ln t = overshoot B exactly, and
    dD/d ln V = -overshoot B u/(u - 1).
    """
    strength = obeying(strength, "cycle.strength", "dimensionless", "positive")
    B = obeying(B, "cycle.B", "dimensionless", "positive")
    time = obeying(time, "cycle.time", "time", "positive")
    overshoot = obeying(overshoot, "cycle.overshoot", "dimensionless", "positive")
    K, W0, V = _machine(K=K, W0=W0, V=V)
    c = strength / B + np.log(overshoot * B * W0 / (K * V * time))
    c = np.where(c >= 1, c, np.nan)
    # u - ln u is convex: from above Newton's steps go down to the root.
    u = c + np.log(c) + 1.0
    for _ in range(_STEPS):
        excess = u - np.log(u) - c
        slope = 1 - 1 / u
        u = u - np.divide(excess, slope, out=np.zeros_like(u), where=slope > 0)
    return np.asarray(overshoot * B * u)


def _machine(**numbers: Any) -> list[Float]:
    kinds = {"K": "stiffness", "M": "mass", "W0": "force", "V": "velocity"}
    return [
        obeying(value, f"cycle.{name}", kinds[name], "positive") for name, value in numbers.items()
    ]
