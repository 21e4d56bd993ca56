"""The motion of a slider under a programme of load and drive."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from asperity.loads import Programme
from asperity.outputs import require_memory
from asperity.parameters.arguments import instance
from asperity.slider import Slider
from asperity.slider.problem import checked_slider
from asperity.transients.blocks import integrate_blocks
from asperity.transients.inputs import MOST_STEPS
from asperity.transients.sampling import planned_rows
from asperity.transients.trajectory import Trajectory, row_bytes


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
    most_steps: float = MOST_STEPS,
    progress: Callable[[float, float], None] | None = None,
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
    most_steps : float
        Number of steps at which the integration stops, or as soon as it is clear that its steps
        are too short to reach the end with them.
    progress : callable, optional
        Called now and then with the time reached and the end of the programme (s).

    Returns
    -------
    Trajectory
        Up to the end of the programme, or to where `stopped` says why it ends before: contact
        lost, runaway without inertia, reversal of slip for a law that does not have it, too many
        steps.

    Raises
    ------
    InputError
        If a value breaks its rule.

    Notes
    -----
    Bureau et al. (2000), Eqs. (1), (2), (6), (8) and (26)-(29), in the states that the
    equations of motion use: a step of the load leaves them continuous and is exact.

    With inertia and elastic asperities the slider rings at sqrt(W0 / (lambda M)), and in a long
    hold never quite ceases to. Where that would take more than a million steps to the end of a
    segment, ringing below the velocity sqrt(lambda W0 / M) times the tolerated error of F_i/W is
    left out; `provenance` gives it as ``unresolved_ringing`` (m/s), 0 where all is resolved.
    """
    slider = checked_slider(slider)
    advice = "build one as asperity.loads.Programme(steps..., load=, velocity=)"
    programme = instance(programme, Programme, "programme", advice)
    rows = planned_rows(sampling, programme.duration)
    if rows is not None:
        # Twice: the blocks, and the trajectory that they are joined to.
        size = 2 * rows * row_bytes(len(slider.law.state_names))
        require_memory(
            size, "sampling", f"{rows:.6g} rows",
            "lower the rate, shorten the programme, or take it block by block with "
            "asperity.transients.integrate_blocks or asperity run",
        )  # fmt: skip
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
        most_steps=most_steps,
        progress=progress,
    )
    return Trajectory.joined(list(blocks))
