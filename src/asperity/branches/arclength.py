"""Pseudo-arclength continuation of the periodic response in any one parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jax.typing import ArrayLike

from asperity.branches.branch import Branch
from asperity.branches.operating_point import one_problem, start_of, starting_orbit
from asperity.branches.parameters import ContinuedParameter, line_through, moving_parameter
from asperity.branches.recorder import INTERVALS, BranchRecorder
from asperity.branches.steps import BranchFollower
from asperity.errors import InputError
from asperity.loads import Modulation
from asperity.parameters.arguments import counted, function, whole_number
from asperity.slider import Slider
from asperity.slider.problem import checked_slider


def continuation(
    slider: Slider,
    *,
    parameter: str,
    span: tuple[Any, Any],
    velocity: ArrayLike | str | None = None,
    epsilon: ArrayLike | str | None = None,
    frequency: ArrayLike | str | None = None,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
    harmonics: int = 8,
    most_steps: int = 1000,
    progress: Callable[[int, int], None] | None = None,
) -> Branch:
    """Follow the periodic response along one parameter, through folds.

    Parameters
    ----------
    slider : Slider
        Numbers, no arrays.
    parameter : str
        "epsilon", "frequency", "V", "K", "W0", "M", "eta", or a parameter of the law, such as
        "alpha" or "lambda"; as in `asperity.parameters`.
    span : pair of float or str
        Where the branch starts, and where it ends if it gets there. Positive parameters whose ends
        differ by more than a factor of 2 are continued by equal factors.
    velocity : float or str
        Pulling velocity V (m/s). This, epsilon and frequency may be left out where they are the
        parameter; what the slider or these say of the parameter gives way to `span`.
    epsilon : float or str
        Relative amplitude of the load.
    frequency : float or str
        Modulation frequency (Hz).
    modulation : Modulation, optional
        In place of `epsilon`.
    inertia : bool
    radiation_damping : float or str, optional
        eta (N s/m).
    harmonics : int
        Number of harmonics of the force, at least 2.
    most_steps : int
        Steps after which the branch is left where it is.
    progress : callable, optional
        Called after each step with the number of steps and `most_steps`.

    Returns
    -------
    Branch
        With `result` saying why it ends. Bifurcations are located to 1e-8 relative; what was
        reached on two meshes is in their `error`.

    Raises
    ------
    InputError
        If a value breaks its rule, the parameter does not exist, the slider has arrays, or no
        periodic orbit is found at the start of the span.

    Notes
    -----
    Collocation with the arclength condition of Keller (1977), see
    `asperity.orbit.methods.branch_following.arclength`.
    """
    harmonics = whole_number(harmonics, "harmonics", least=2)
    most_steps = whole_number(most_steps, "most_steps", least=1)
    progress = function(progress, "progress")
    checked_slider(slider)
    problem = one_problem(
        slider,
        start_of(slider, parameter, span),
        velocity=velocity,
        epsilon=epsilon,
        frequency=frequency,
        modulation=modulation,
        inertia=inertia,
        radiation_damping=radiation_damping,
    )
    moving = moving_parameter(problem, parameter, span)
    follower = BranchFollower(line_through(problem, (moving,), (0.0,), (1.0,)), harmonics)
    orbit = starting_orbit(follower.line.at(np.zeros(1)), INTERVALS)
    start = None if orbit is None else follower.begin(orbit, 0.0, INTERVALS)
    if start is None:
        raise _no_orbit(moving)
    recorder = BranchRecorder(follower, moving, start, counted(progress, most_steps))
    return recorder.branch(recorder.follow_branch(most_steps), problem)


def _no_orbit(moving: ContinuedParameter) -> InputError:
    unit = f" {moving.unit}" if moving.unit else ""
    return InputError(
        f"span must start where there is a periodic orbit, found none at {moving.name} = "
        f"{moving.start:g}{unit}; start elsewhere, such as at a small epsilon"
    )
