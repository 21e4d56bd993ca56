"""Pseudo-arclength continuation of the periodic response in any one parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jax.typing import ArrayLike

from asperity.errors import InputError
from asperity.loads import Modulation
from asperity.slider import Slider
from asperity.solve.continuation.branch import Branch
from asperity.solve.continuation.operating_point import one_problem, start_of, starting_orbit
from asperity.solve.continuation.parameters import Parameter, line_through, moving_parameter
from asperity.solve.continuation.record import INTERVALS, Record
from asperity.solve.continuation.walk import Walker


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
    progress: Callable[[float], None] | None = None,
) -> Branch:
    """Follow the periodic response along one parameter, through folds.

    Parameters
    ----------
    slider : Slider
        Numbers, no arrays.
    parameter : str
        "epsilon", "frequency", "velocity", "K", "W0", "M", "radiation_damping", or a parameter of
        the law, such as "alpha" or "lambda".
    span : pair of float or str
        Where the branch starts, and where it ends if it gets there. Positive parameters whose ends
        differ by more than a factor of 2 are walked by equal factors.
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
        Called with each value of the parameter reached.

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
    `asperity.solve.continuation.arclength`.
    """
    if harmonics < 2:
        raise InputError(f"harmonics must be at least 2, got {harmonics}; ask for 2 or more")
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
    walker = Walker(line_through(problem, (moving,), (0.0,), (1.0,)), harmonics)
    orbit = starting_orbit(walker.line.at(np.zeros(1)))
    start = None if orbit is None else walker.begin(orbit, 0.0, INTERVALS)
    if start is None:
        raise _no_orbit(moving)
    told = progress or (lambda _: None)
    record = Record(walker, moving, start, told)
    return record.branch(record.walk(most_steps), problem)


def _no_orbit(moving: Parameter) -> InputError:
    unit = f" {moving.unit}" if moving.unit else ""
    return InputError(
        f"span must start where there is a periodic orbit, found none at {moving.name} = "
        f"{moving.start:g}{unit}; start elsewhere, such as at a small epsilon"
    )
