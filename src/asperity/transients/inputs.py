"""Checks the arguments of a transient and converts them to SI."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from asperity.errors import InputError
from asperity.loads import Programme
from asperity.parameters.arguments import instance, number, one_of, switch
from asperity.slider import Slider, equation_of_motion, reversing
from asperity.slider.problem import checked_slider
from asperity.transients.events import EventThresholds
from asperity.transients.integration import Checkpoint, Integration, Tolerances
from asperity.transients.method_choice import METHODS

#: A slider slips when it is so many times faster than the fastest drive.
_SLIPS = 30.0

#: Without inertia: a velocity, and a multiple of the fastest drive, that only a runaway reaches.
_RUNAWAY, _RUNAWAY_RATIO = 1.0, 1e3

#: Steps that an integration may take: half an hour to a few hours of work.
MOST_STEPS = 200_000_000


def checked_integration(
    slider: Slider,
    programme: Programme,
    *,
    inertia: bool = False,
    radiation_damping: float | str | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    slip_velocity: float | str | None = None,
    runaway_velocity: float | str | None = None,
    steady_tolerance: float = 1e-4,
    method: str = "auto",
    most_steps: float = MOST_STEPS,
) -> Integration:
    """An integration at its beginning; parameters as in `transient`.

    Raises
    ------
    InputError
        If a value breaks its rule.
    """
    checked_slider(slider)
    advice = "build one as asperity.loads.Programme(steps..., load=, velocity=)"
    programme = instance(programme, Programme, "programme", advice)
    inertia = switch(inertia, "inertia")
    eta = None
    if radiation_damping is not None:
        eta = _positive(radiation_damping, "damping", "radiation_damping")
    rtol = _positive(rtol, "dimensionless", "rtol")
    if not 1e-13 <= rtol <= 1e-2:
        raise InputError(
            f"rtol must lie between 1e-13 and 0.01, got {rtol:g}; give one such as 1e-8"
        )
    atol = rtol / 100 if atol is None else _positive(atol, "dimensionless", "atol")
    method = one_of(method, METHODS, "method")
    if not slider.law.rate_dependent:
        raise InputError(
            f"law must depend on velocity for a transient, got '{slider.law.name}', whose force "
            "follows the load without dynamics; take a rate-and-state law"
        )
    scalar = jax.tree.map(_scalar, slider)
    fastest = programme.fastest_pull
    V = abs(programme.level.velocity) or fastest or 1e-6
    motion = equation_of_motion(
        scalar, jnp.asarray(V), jnp.asarray(1.0), inertia=inertia,
        eta=None if eta is None else jnp.asarray(eta),
    )  # fmt: skip
    motion = reversing(motion)
    fastest = fastest or V
    slips, runs = _SLIPS * fastest, max(_RUNAWAY, _RUNAWAY_RATIO * fastest)
    if slip_velocity is not None:
        slips = _positive(slip_velocity, "velocity", "slip_velocity")
    if runaway_velocity is not None:
        runs = _positive(runaway_velocity, "velocity", "runaway_velocity")
    most_steps = _positive(most_steps, "dimensionless", "most_steps")
    steady = _positive(steady_tolerance, "dimensionless", "steady_tolerance")
    nowhere = Checkpoint(0, 0.0, np.empty(0))
    return Integration(
        motion,
        programme,
        nowhere,
        Tolerances(rtol, atol),
        EventThresholds(slips, runs, steady),
        method,
        most_steps,
    )


def _scalar(value: Any) -> jnp.ndarray:
    if np.size(value) != 1:
        raise InputError(
            f"slider must be a single one for a transient, got parameters of shape "
            f"{np.shape(value)}; call it once for each"
        )
    number = jnp.asarray(value, float)
    return number if number.ndim == 0 else number.reshape(())


def _positive(value: Any, kind: str, name: str) -> float:
    return number(value, name, kind, "positive")
