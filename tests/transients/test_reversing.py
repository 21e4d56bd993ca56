"""Inertia on rigid asperities through rest and reversal, against SciPy with v as a state."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.loads import Hold, Programme, Slide, StepLoad
from asperity.transients import transient

A, B, D0, V0, K, M, W, V = 0.013, 0.01, 4e-7, 1e-6, 4e5, 1.6, 7.0, 1e-5
START = {"load": W, "velocity": V}


def slider(mu0: float) -> asp.Slider:
    law = asp.laws.Regularised(mu0=mu0, A=A, B=B, D0=D0, V0=V0)
    return asp.Slider(law, spring=K, load=W, mass=M)


def scipy_force(mu0: float, phases: list[tuple], eta: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and forces of phases (duration, load, pulling velocity), 40 samples each."""

    def friction(v: float, phi: float) -> float:
        return A * np.arcsinh(v / (2 * V0) * np.exp((mu0 + B * phi) / A))

    def rates(t: float, y: np.ndarray, load: float, pull: float) -> list[float]:
        F, v, phi = y
        force = F - load * friction(v, phi) - eta * v
        return [K * (pull - v), force / M, V0 / D0 * np.exp(-phi) - abs(v) / D0]

    phi = -np.log(V / V0)
    y, start, times, forces = np.array([W * friction(V, phi) + eta * V, V, phi]), 0.0, [], []
    for duration, load, pull in phases:
        t = np.linspace(0, duration, 41)
        run = solve_ivp(
            rates, (0, duration), y, "Radau", t, args=(load, pull), rtol=1e-9,
            atol=[1e-10, 1e-15, 1e-10],
        )  # fmt: skip
        assert run.success
        times.append(start + t[:-1])
        forces.append(run.y[0, :-1])
        y, start = run.y[:, -1], start + duration
    return np.concatenate(times), np.concatenate(forces)


def test_a_hold_at_rest_agrees_with_scipy() -> None:
    times, force = scipy_force(0.5, [(0.2, W, V), (2.0, W, 0.0), (0.5, W, V)])
    programme = Programme(Slide(0.2, V), Hold(2.0), Slide(0.5, V), **START)
    motion = transient(slider(0.5), programme, sampling=times, inertia=True)
    assert motion.termination is None
    np.testing.assert_allclose(motion.force, force, rtol=0, atol=1e-8 * W)
    held = (times > 1.0) & (times < 2.2)
    assert np.all(np.abs(motion.velocity[held]) < 2e-2 * V)


@pytest.mark.parametrize("eta", [None, 2e3])
def test_reversals_and_a_step_of_the_load_agree_with_scipy(eta: float | None) -> None:
    # So little friction that SciPy's v can pass through rest.
    phases = [(0.1, W, V), (0.6, W, -V), (0.3, 9.0, -V), (0.6, 9.0, V)]
    times, force = scipy_force(0.1, phases, eta or 0.0)
    programme = Programme(
        Slide(0.1, V), Slide(0.6, -V), StepLoad(9.0), Slide(0.3, -V), Slide(0.6, V), **START
    )
    motion = transient(
        slider(0.1), programme, sampling=times, inertia=True, radiation_damping=eta
    )  # fmt: skip
    assert motion.termination is None
    np.testing.assert_allclose(motion.force, force, rtol=0, atol=1e-7 * W)
    assert len(motion.event_times("reversal")) == 2


def test_friction_of_the_paper_reversed_is_friction_mirrored() -> None:
    # SciPy cannot follow v ~ 1e-22 m/s; steady sliding backwards has a closed form.
    programme = Programme(Slide(0.5, V), Slide(4.0, -V), **START)
    motion = transient(slider(0.5), programme, inertia=True)
    steady = W * A * np.arcsinh(V / (2 * V0) * np.exp((0.5 - B * np.log(V / V0)) / A))
    assert motion.termination is None
    assert motion.force[0] == pytest.approx(steady, rel=1e-9)
    assert motion.force[-1] == pytest.approx(-steady, rel=1e-6)
    assert motion.velocity[-1] == pytest.approx(-V, rel=1e-4)
    # Until slip sets in backwards, the spring unloads at K V.
    (reversal,) = motion.event_times("reversal")
    assert reversal == pytest.approx(0.5 + steady / (K * V), rel=0.02)


def test_a_slider_at_rest_sticks_until_the_spring_is_loaded() -> None:
    # Stuck, the spring takes up all of the drive.
    programme = Programme(Slide(1.5, V), load=W, velocity=0.0)
    motion = transient(
        slider(0.5), programme, initial=[0.0, 0.0, 0.0], inertia=True, sampling=100.0
    )
    early = motion.time < 0.5
    np.testing.assert_allclose(motion.force[early], K * V * motion.time[early], rtol=0, atol=1e-9)
    assert np.all(np.abs(motion.velocity[early]) < 1e-12)
    assert motion.velocity[-1] == pytest.approx(V, rel=0.05)


def test_a_law_with_a_jump_at_rest_ends_the_run_with_advice() -> None:
    law = asp.laws.CutOff(mu0=0.5, A=A, B=B, D0=D0, V0=V0, V1=1e-8, V2=1e-2)
    programme = Programme(Slide(0.2, V), Slide(3.0, -V), **START)
    motion = transient(
        asp.Slider(law, spring=K, load=W, mass=M), programme, inertia=True
    )  # fmt: skip
    assert motion.termination.kind == "rest"
    assert "'regularised'" in motion.stopped
