"""Loops compiled to one kernel: which laws and loads allow it, and the motion is the same."""

import importlib
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

import asperity as asp
from asperity.loads import Follow, Modulate, Programme
from asperity.transients import transient
from asperity.transients.equations import SegmentEquations
from asperity.transients.inputs import checked_integration

COMMON = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
START = {"load": 7.0, "velocity": 1e-6}
MODULATED = Programme(Modulate(0.02, 0.2, "120 Hz"), **START)
one_kernel = importlib.import_module("asperity.transients.one_kernel")


class Sorting(asp.laws.RiceRuina):
    """Rice-Ruina friction by a detour that does not compile to one kernel."""

    name = "sorting"

    def log_velocity(self, friction: Any, state: tuple, w: Any) -> jnp.ndarray:
        log_velocity = super().log_velocity(friction, state, w)
        return jnp.sort(jnp.stack([log_velocity, log_velocity]), axis=0)[0]


def compiles_to_one(law: asp.laws.Law, programme: Programme, **options: Any) -> bool:
    slider = asp.Slider(law, spring=1e6, load=7.0, mass=1.6)
    motion = checked_integration(slider, programme, **options).motion
    return one_kernel._compiles_to_one(SegmentEquations(motion, programme.segments[0]))


@pytest.mark.parametrize("options", [{}, {"inertia": True}], ids=["quasi-static", "inertial"])
@pytest.mark.parametrize(
    "law",
    [
        asp.laws.RiceRuina(**COMMON),
        asp.laws.ElastoPlastic(**COMMON, lambda_=6e-7),
        asp.laws.Regularised(**COMMON),
        asp.laws.LinkerDieterich(**COMMON, alpha=0.2),
    ],
    ids=lambda law: law.name,
)
def test_laws_in_closed_form_are_compiled_to_one_kernel(law: asp.laws.Law, options: dict) -> None:
    assert compiles_to_one(law, MODULATED, **options)


def test_tables_loops_and_sorting_are_not_compiled_to_one_kernel() -> None:
    law = asp.laws.RiceRuina(**COMMON)
    t = np.linspace(0, 1, 5)
    assert not compiles_to_one(law, Programme(Follow(t, 7 + t), **START))
    assert not compiles_to_one(law, MODULATED, radiation_damping=1e4)  # Newton's method within
    assert not compiles_to_one(Sorting(**COMMON), MODULATED)


def test_a_law_that_is_not_one_kernel_gives_the_same_motion() -> None:
    forces = [
        transient(asp.Slider(law(**COMMON), spring=1e6, load=7.0), MODULATED, sampling=1e3).force
        for law in (asp.laws.RiceRuina, Sorting)
    ]
    np.testing.assert_allclose(*forces, rtol=1e-9)
