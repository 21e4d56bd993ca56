"""The motion of a slider under a programme of load and drive."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from asperity.loads import Programme
from asperity.slider import Slider
from asperity.solve.transients.blocks import integrate_blocks
from asperity.solve.transients.trajectory import Trajectory


def transient(
    slider: Slider,
    programme: Programme,
    *,
    initial: Any = "steady",
    sampling: Any = None,
    inertia: bool = False,
    radiation_damping: float | str | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    slip_velocity: float | str | None = None,
    runaway_velocity: float | str | None = None,
    steady_tolerance: float = 1e-4,
    method: str = "auto",
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Integrate the equation of motion in time.

    Parameters
    ----------
    slider : Slider
        With one number for each parameter.
    programme : Programme
        Steps of load and drive, from `asperity.loads`.
    initial : "steady" or array, shape (size,)
        Steady sliding under the load and velocity before the first step, or states of the
        equation of motion, such as the last row of another trajectory's `states`.
    sampling : float, str or array, optional
        Rate (Hz) or times (s) at which to write; by default the integrator's own steps, which
        are short where much happens. The solution is a polynomial on every step, so that the
        rate costs next to nothing and does not change it.
    inertia : bool
        Whether the mass of the slider counts.
    radiation_damping : float or str, optional
        eta (N s/m), positive.
    rtol, atol : float
        Tolerated error of a step: relative for velocities and forces, absolute for the states
        that are logarithms; `atol` is of F/W0, v/V and F_i/W, a hundredth of `rtol` by
        default. V is the velocity before the first step.
    slip_velocity : float or str, optional
        Velocity (m/s) above which the slider slips; by default 30 times the fastest drive.
    runaway_velocity : float or str, optional
        Velocity (m/s) to which a slider without inertia can only run away; by default 1 m/s, or
        1000 times the fastest drive if that is more.
    steady_tolerance : float
        Deviation from steady sliding, or from a response that repeats itself with the modulation,
        below which it counts as reached.
    method : {"auto", "explicit", "implicit"}
        "auto" takes whichever suits the equations and changes it on the way where they turn
        stiff, or cease to be.
    progress : callable, optional
        Called now and then with the time reached (s).

    Returns
    -------
    Trajectory
        Up to the end of the programme, or to where `stopped` says why it ends before: contact
        lost, runaway without inertia, reversal of slip for a law that does not have it.

    Raises
    ------
    InputError
        If a value breaks its rule.

    Notes
    -----
    Bureau et al. (2000), Eqs. (1), (2), (6), (8) and (26)-(29), in the states that the
    equations of motion use: a step of the load leaves them continuous and is exact.
    """
    blocks = integrate_blocks(
        slider,
        programme,
        initial=initial,
        sampling=sampling,
        inertia=inertia,
        radiation_damping=radiation_damping,
        rtol=rtol,
        atol=atol,
        slip_velocity=slip_velocity,
        runaway_velocity=runaway_velocity,
        steady_tolerance=steady_tolerance,
        method=method,
        progress=progress,
    )
    return Trajectory.joined(list(blocks))
