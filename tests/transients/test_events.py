"""Events and terminations of a motion: located and named, without samples after the end."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.loads import Modulate, Programme, RampLoad, Slide, StepLoad
from asperity.transients import transient

START = {"load": "7 N", "velocity": "1 um/s"}
LAMBDA = 6.2e-7


def finite(motion) -> bool:
    columns = (motion.force, motion.velocity, motion.displacement, motion.states)
    return all(np.isfinite(c).all() for c in columns)


def test_stick_slip_with_inertia_agrees_with_scipy(physical) -> None:
    """Period and range of the force, over cycles of slip at a thousand times the drive."""
    p = physical.Experiment(K=1e5, M=1.6)
    start, V = p.steady(1e-5, 7.0), 1.1e-5

    def crossing(t, y, *_):
        return y[3] - np.log(1e-4)

    crossing.direction = 1
    phase = physical.level(14.0, 7.0, V)
    with np.errstate(over="ignore", invalid="ignore"):  # of steps that are then refused
        true = solve_ivp(
            p.rates, (0, 14), start, "LSODA", rtol=1e-10, atol=[1e-16, 1e-11, 1e-16, 1e-10],
            events=crossing, args=(phase.load, phase.pull),
        )  # fmt: skip
    programme = Programme(Slide("14 s", V), load="7 N", velocity="10 um/s")
    motion = transient(p.slider, programme, inertia=True, slip_velocity=1e-4)
    starts, ends = motion.event_times("slip start"), motion.event_times("slip end")
    expected = true.t_events[0]
    assert len(expected) >= 6
    np.testing.assert_allclose(np.diff(starts)[2:], np.diff(expected)[2:], rtol=1e-6)
    assert len(starts) - len(ends) in (0, 1)
    assert np.all(ends > starts[: len(ends)])
    np.testing.assert_allclose(np.interp(starts, motion.time, motion.velocity), 1e-4, rtol=1e-2)
    late_true, late = true.t > 6, motion.time > 6
    force = p.K * true.y[0][late_true]
    assert motion.force[late].max() == pytest.approx(force.max(), rel=1e-5)
    assert motion.force[late].min() == pytest.approx(force.min(), rel=1e-5)


def test_a_hundred_cycles_with_radiation_damping_repeat_themselves(physical) -> None:
    p = physical.Experiment(K=1e5, eta=1e3, lambda_=LAMBDA)
    programme = Programme(Slide("90 s", "11 um/s"), load="7 N", velocity="10 um/s")
    coarse, fine = (
        transient(p.slider, programme, radiation_damping=p.eta, slip_velocity=1e-4, rtol=r)
        for r in (1e-8, 1e-10)
    )
    periods = [np.diff(r.event_times("slip start"))[10:] for r in (coarse, fine)]
    assert len(periods[0]) > 100
    np.testing.assert_allclose(periods[1], periods[1].mean(), rtol=1e-6)
    assert periods[0].mean() == pytest.approx(periods[1].mean(), rel=1e-6)


def test_a_runaway_without_inertia_is_named(physical) -> None:
    p = physical.Experiment(K=1e5, lambda_=LAMBDA)
    programme = Programme(Slide("1 s"), Slide("60 s", "1.1 um/s"), **START)
    motion = transient(p.slider, programme, sampling="1 kHz")
    assert motion.termination.kind == "runaway"
    assert "switch inertia on" in motion.stopped
    assert finite(motion)
    assert motion.time[-1] <= motion.termination.time == motion.events[-1].time

    def fast(t, y, *_):  # a slip of a millionth of a second before the singularity
        soft = p.lambda_ * p.K / 7.0
        v = p._velocities(p.K * y[0], 7.0, 0.0, 1.1e-6, y[1], [])[0]
        return (v * (1 + soft) - soft * 1.1e-6) - 1.0

    fast.terminal = True
    phase = physical.level(60.0, 7.0, 1.1e-6)
    true = solve_ivp(
        p.rates, (0, 60), p.steady(1e-6, 7.0), "DOP853", rtol=1e-11, atol=1e-18, events=fast,
        args=(phase.load, phase.pull),
    )  # fmt: skip
    assert motion.termination.time - 1 == pytest.approx(true.t_events[0][0], rel=1e-6)
    assert motion.force.min() > p.K * true.y[0, -1] - 1e-3


@pytest.mark.parametrize(
    ("step", "time"),
    [
        (RampLoad("-1 N", "1 s"), 1.875),
        # 1 + 1.2 cos = 0
        (Modulate("0.5 s", 1.2, "10 Hz"), 1 + np.arccos(-1 / 1.2) / (20 * np.pi)),
    ],
)
def test_loss_of_contact_is_named(physical, step, time) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    motion = transient(p.slider, Programme(Slide("1 s"), step, Slide("1 s"), **START))
    assert motion.termination.kind == "loss of contact"
    assert motion.termination.time == pytest.approx(time, rel=1e-9)
    assert "contact was lost" in motion.stopped
    assert finite(motion)
    assert np.all(motion.load > 0)
    assert motion.load[-1] < 1e-4


def test_a_step_to_no_load_loses_contact_at_once(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    programme = Programme(Slide("1 s"), StepLoad("1 uN"), Slide("1 s"), **START)
    motion = transient(p.slider, programme)
    assert (motion.termination.kind, motion.termination.time) == ("loss of contact", 1.0)
    assert np.all(motion.load > 0)


def test_reversal_is_named_where_the_law_has_none(physical) -> None:
    """It is where a law that is odd in the force would slip backwards at 1e-10 of the drive."""
    p = physical.Experiment(lambda_=LAMBDA)
    programme = Programme(Slide("1 s"), Slide("10 s", "-10 um/s"), **START)
    motion = transient(p.slider, programme)
    assert motion.termination.kind == "reversal"
    assert "regularised" in motion.stopped
    # Stuck by then, the spring and the asperities are two springs in series.
    series = 1 / (1 / p.K + LAMBDA / 7.0)
    assert motion.termination.time > 1 + 3.5 / series / 1e-5 - 0.1
    law = p.slider.law
    strength = law.mu0 + law.B * motion.states[-1, -1]
    backwards = law.V0 / 1e-6 * np.exp((-motion.force[-1] / 7.0 - strength) / law.A)
    assert backwards == pytest.approx(1e-10, rel=1e-4)
    assert finite(motion)


def test_steady_sliding_is_an_event(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    programme = Programme(Slide("2 s"), Slide("30 s", "3 um/s"), **START)
    motion = transient(p.slider, programme, steady_tolerance=1e-4, sampling="100 Hz")
    first, second = motion.event_times("steady")
    assert first == 0
    assert 2.1 < second < 30
    after = motion.time > second
    np.testing.assert_allclose(motion.velocity[after], 3e-6, rtol=1.1e-4)
    shortly_before = (motion.time > 2) & (motion.time < second - 0.5)
    assert np.abs(motion.velocity[shortly_before] / 3e-6 - 1).max() > 1e-3


def test_a_load_step_starts_a_slip_at_the_break_point(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    programme = Programme(Slide("1 s"), StepLoad("6 N"), Slide("1 s"), **START)
    motion = transient(p.slider, programme, slip_velocity="10 um/s")
    assert motion.event_times("slip start")[0] == 1.0
    (end,) = motion.event_times("slip end")
    assert 1 < end < 1.1


def test_a_termination_within_the_spacing_of_doubles_has_a_time() -> None:
    """Where the slip stops, steps of 1e-14 s after half an hour leave the time as it is."""
    numbers = {"mu0": 0.5234064758672259, "A": 0.012765437614392503, "B": 0.029093959364609512}
    law = asp.laws.RuinaSlip(**numbers, D0=1.2248716169534373e-06, V0=1e-6)
    slider = asp.Slider(
        law, spring=228485.93356503046, load=110.44730884517166, mass=3.0388421937153685
    )
    programme = Programme(Slide("1 h"), load=110.44730884517166, velocity=1.2762571719160836e-08)
    initial = np.array([0.70741249, -6.90775528, 11.26899375])
    motion = transient(slider, programme, inertia=True, initial=initial)
    assert motion.termination is not None
    assert finite(motion)
    assert 1000 < motion.time[-1] <= motion.termination.time < 2000


def test_a_small_negative_force_does_not_end_a_run() -> None:
    """A slider that swings on its asperities; SciPy with slip that is odd in the force."""
    A, B, D0, V, mu0, length, frequency = 0.013, 0.026, 4e-7, 1e-6, 0.5, 7e-7, 120.0
    law = asp.laws.ElastoPlastic(mu0=mu0, A=A, B=B, D0=D0, V0=V, lambda_=length)
    slider = asp.Slider(law, spring=2e5, mass=1.6, load=7.0)
    programme = Programme(Modulate(8 / frequency, 0.5, frequency), load=7.0, velocity=V)
    motion = transient(slider, programme, inertia=True)
    assert motion.stopped is None

    def rates(t, y):
        force, v, friction, phi = y
        slip = 2 * V * np.sinh(friction / A) * np.exp(-(mu0 + B * phi) / A)
        net = force - (1 + 0.5 * np.cos(2 * np.pi * frequency * t)) * friction
        ageing = V / D0 * np.exp(-phi) - v / D0
        return [2e5 * (V - v) / 7.0, 7.0 * net / 1.6, (v - slip) / length, ageing]

    start = motion.states[0] * np.array([1.0, V, 1.0, 1.0])
    run = solve_ivp(
        rates, (0, motion.time[-1]), start, "LSODA", motion.time, rtol=1e-11, atol=1e-13
    )
    assert run.y[2].min() < -0.02
    np.testing.assert_allclose(motion.force / 7.0, run.y[0], atol=1e-7)
