"""Transients against SciPy's integrators on the published equations, and against each other."""

import dataclasses
import itertools

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import DOP853, solve_ivp

import asperity as asp
from asperity.algebra.runge_kutta import dormand_prince_8
from asperity.errors import InputError
from asperity.laws import registered
from asperity.loads import (
    Follow,
    Hold,
    Modulate,
    Programme,
    RampLoad,
    RampVelocity,
    Slide,
    StepLoad,
)
from asperity.recording.readers import read
from asperity.transients import Trajectory, transient
from asperity.transients.inputs import first_checkpoint
from references.populations import population

START = {"load": "7 N", "velocity": "1 um/s"}
LAMBDA = 6.2e-7

#: Agreement with SciPy at 1e-11; default tolerance 1e-9, and elastic waves that add up errors.
CLOSE = 3e-8

MIXED = Programme(
    *(Slide("0.5 s"), StepLoad("9 N"), Slide("1 s"), Slide("1 s", "3 um/s"), Hold("2 s")),
    *(Slide("1 s"), RampVelocity("10 um/s", "1 s"), RampLoad("7 N", "1 s")),
    **START,
)


def mixed_phases(physical) -> list:
    level = physical.level
    return [
        *(level(0.5, 7, 1e-6), level(1, 9, 1e-6), level(1, 9, 3e-6), level(2, 9, 0.0)),
        level(1, 9, 3e-6),
        physical.Phase(1, lambda t: (9, 0.0), lambda t: 3e-6 + 7e-6 * t),
        physical.Phase(1, lambda t: (9 - 2 * t, -2.0), lambda t: 1e-5),
    ]


@pytest.mark.parametrize(
    ("law", "more", "method"),
    [
        ("elasto-plastic", {"lambda_": LAMBDA}, "DOP853"),
        ("linker-dieterich", {"alpha": 0.02}, "DOP853"),
        ("rice-ruina", {"M": 1.6}, "LSODA"),
        ("rice-ruina", {"eta": 1e3}, "DOP853"),
        ("elasto-plastic", {"lambda_": LAMBDA, "M": 1.6}, "DOP853"),
        ("elasto-plastic", {"lambda_": LAMBDA, "eta": 1e3}, "LSODA"),
    ],
)
def test_steps_holds_and_ramps_agree_with_scipy(physical, law, more, method) -> None:
    p = physical.Experiment(**more)
    phases, programme = mixed_phases(physical), MIXED
    if p.M and p.lambda_:  # resonance at 400 Hz: SciPy takes minutes for the whole of it
        programme = Programme(Slide("10 ms"), StepLoad("9 N"), Slide("0.3 s"), **START)
        phases = [physical.level(0.01, 7, 1e-6), physical.level(0.3, 9, 1e-6)]
    times = np.linspace(0, programme.duration, 201)
    motion = transient(p.slider, programme, sampling=times, **p.options)
    assert motion.motion.slider.law.name == law
    assert motion.stopped is None
    true = physical.integrate(p, p.steady(1e-6, 7.0), 7.0, phases, times, method)
    np.testing.assert_allclose(motion.force / p.W0, true.force / p.W0, rtol=0, atol=CLOSE)
    np.testing.assert_allclose(motion.displacement, true.x, rtol=0, atol=CLOSE * p.W0 / p.K)


def test_a_modulation_that_begins_suddenly_agrees_with_scipy(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    programme = Programme(Modulate("0.2 s", 0.24, "120 Hz"), **START)
    times = np.linspace(0, 0.2, 1001)
    motion = transient(p.slider, programme, sampling=times)
    swing = physical.swing(0.2, 7, 1e-6, 0.24, 120)
    true = physical.integrate(p, p.steady(1e-6, 7.0), 7.0, [swing], times)
    np.testing.assert_allclose(motion.force, true.force, rtol=0, atol=7e-9)
    np.testing.assert_allclose(
        motion.load, 7 * (1 + 0.24 * np.cos(240 * np.pi * times)), rtol=1e-12
    )
    # At t = 0 the load has just stepped up by eps: springs in series share the load anew.
    assert motion.displacement[0] == pytest.approx(true.x[0], rel=1e-12)
    assert motion.displacement[0] < 0


def test_a_recorded_load_agrees_with_scipy(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    t = np.linspace(0, 0.1, 9)
    W = 7 + np.sin(30 * t)
    motion = transient(p.slider, Programme(Follow(t, W), **START), sampling="200 Hz")
    from scipy.interpolate import PchipInterpolator

    cubics = [np.poly1d(c) for c in PchipInterpolator(t, W).c.T]
    phases = [
        physical.Phase(t[1], lambda s, w=w, dw=dw: (w(s), dw(s)), lambda s: 1e-6)
        for w, dw in zip(cubics, map(np.polyder, cubics), strict=True)
    ]
    true = physical.integrate(p, p.steady(1e-6, 7.0), 7.0, phases, motion.time)
    np.testing.assert_allclose(motion.force, true.force, rtol=0, atol=7e-8)


def test_the_error_follows_the_tolerance(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    times = np.linspace(0, MIXED.duration, 301)
    true = physical.integrate(p, p.steady(1e-6, 7.0), 7.0, mixed_phases(physical), times)
    errors, steps = [], []
    for rtol in (1e-5, 1e-7, 1e-9, 1e-11):
        motion = transient(p.slider, MIXED, sampling=times, rtol=rtol)
        errors.append(np.abs(motion.force - true.force).max() / 7)
        steps.append(motion.provenance["steps"])
    assert errors[-1] < 1e-10
    assert all(fine < coarse / 5 for coarse, fine in itertools.pairwise(errors))
    assert steps == sorted(steps)


def test_displacement_spring_and_drive_belong_together(physical) -> None:
    """x = integral of V - (F - F0)/K, though x is integrated separately."""
    p = physical.Experiment(lambda_=LAMBDA)
    motion = transient(p.slider, MIXED, sampling="100 Hz")
    x = MIXED.position(motion.time) - (motion.force - 3.5) / p.K
    np.testing.assert_allclose(motion.displacement, x, rtol=0, atol=1e-8 * p.W0 / p.K)
    assert np.ptp(x) > 1e-5


def test_a_load_step_is_the_limit_of_steep_ramps(physical) -> None:
    slider = physical.Experiment(lambda_=LAMBDA).slider
    step = Programme(StepLoad("8 N"), Slide("1 s"), **START)
    sharp = transient(slider, step, sampling=[0.5, 1.0])
    gaps = []
    for duration in (1e-3, 1e-4):
        ramp = Programme(RampLoad("8 N", duration), Slide("1 s"), **START)
        slow = transient(slider, ramp, sampling=[0.5 + duration / 2, 1.0 + duration / 2])
        gaps.append(np.abs(slow.force - sharp.force).max())
    assert gaps[0] < 1e-3
    assert gaps[1] < 0.2 * gaps[0]


def test_a_modulated_transient_ends_in_the_periodic_response(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    m = {"epsilon": 0.24, "frequency": 120.0}
    rate = 120 * 64
    programme = Programme(Modulate("30 s", 0.24, "120 Hz"), **START)
    times = 30 - np.arange(64, 0, -1) / rate
    motion = transient(p.slider, programme, sampling=times, rtol=1e-11)
    response = asp.periodic_response(p.slider, velocity=1e-6, **m)
    spectrum = np.fft.fft(motion.force / 7) / 64
    assert spectrum[0].real == pytest.approx(float(response.mean_friction), rel=1e-7)
    np.testing.assert_allclose(2 * spectrum[1:3], response.harmonics[:2], rtol=0, atol=1e-9)
    (steady,) = motion.event_times("steady")
    assert 0.4 < steady < 30  # some D0/V


#: What laws have beyond those of Rice and Ruina.
EXTRA = {
    "alpha": 0.02, "lambda": LAMBDA, "V1": 1e-8, "V2": 1e-4, "c": 1.0, "B2": 0.005, "D2": 1.5e-6,
    "L": 3e-7, "V_star": 1e-7,
}  # fmt: skip
COMMON = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}


RATE_DEPENDENT = sorted(
    name
    for name, law in registered().items()
    if law.__module__.startswith("asperity.") and law.rate_dependent
)
#: In every run: a law with several states, which the tests above leave out.
SUITE = ("two-state",)


@pytest.mark.parametrize(
    "name",
    population([*SUITE, *(n for n in RATE_DEPENDENT if n not in SUITE)], short=len(SUITE)),
)
def test_every_law_relaxes_to_steady_sliding_under_another_load(name) -> None:
    cls = registered()[name]
    values = COMMON | EXTRA
    law = cls(**{f.name: values[f.name.rstrip("_")] for f in dataclasses.fields(cls)})
    slider = asp.Slider(law, spring=1.5e6, load=7.0)
    programme = Programme(StepLoad("8 N"), Slide("8 s", "2 um/s"), **START)
    motion = transient(slider, programme, sampling=[0.0, 8.0], rtol=1e-7)
    assert motion.stopped is None
    again = transient(
        slider, Programme(Slide("1 s"), load="8 N", velocity="2 um/s"), sampling=[0.0], rtol=1e-7
    )
    assert motion.velocity[-1] == pytest.approx(2e-6, rel=1e-4)
    assert motion.force[-1] == pytest.approx(again.force[0], rel=1e-5)
    x = programme.position(8.0) - (motion.force[-1] - 7 * float(law.mu_ss(1e-6))) / 1.5e6
    assert motion.displacement[-1] == pytest.approx(x, rel=1e-6)
    np.testing.assert_allclose(motion.states[-1, 1:], again.states[0, 1:], rtol=1e-4, atol=1e-4)


def test_steady_sliding_under_a_load_far_from_that_of_the_slider_is_steady() -> None:
    law = asp.laws.Nagata(**(COMMON | {"A": 0.013, "B": 0.01}), c=2.0)
    motion = asp.slider.equation_of_motion(asp.Slider(law, spring=2e6, load=7.0), 1e-6, 1.0)
    first = first_checkpoint(
        motion, Programme(Slide("1 s"), load="42 N", velocity="1 um/s"), "steady"
    )
    # c F_i / (B W0) is 600: as many Newton steps of the logarithm of the age.
    np.testing.assert_allclose(first.states[0], 6 * 0.5, rtol=1e-12)
    np.testing.assert_allclose(first.states[1], 2 / 0.01 * 6 * 0.5, rtol=1e-12)


class Viscous(asp.laws.Law):
    """F/W = mu0 + A ln(v/V0)."""

    name, source, state_names = "viscous-of-tests", "none", ()
    mu0: float = asp.laws.parameter("law.mu0", "dimensionless")
    A: float = asp.laws.parameter("law.A", "dimensionless")
    V0: float = asp.laws.parameter("law.V0", "velocity")

    def friction(self, v, state, w):
        return self.mu0 + self.A * jnp.log(v / self.V0)

    def log_velocity(self, friction, state, w):
        return jnp.log(self.V0) + (friction - self.mu0) / self.A

    def state_rate(self, v, v_plastic, state, w):
        return ()

    def steady_state(self, v):
        return ()


def test_a_law_without_states_follows_the_drive_as_a_logistic_function() -> None:
    slider = asp.Slider(Viscous(mu0=0.5, A=0.02, V0=1e-6), spring=2e5, load=7.0)
    programme = Programme(StepLoad("8 N"), Slide("1 s", "3 um/s"), load="7 N", velocity="1 um/s")
    motion = transient(slider, programme, sampling="10 Hz", rtol=1e-8)
    # A W v'/v = K (V - v), from F = 7 N * 0.5 under 8 N.
    first = 1e-6 * np.exp((3.5 / 8 - 0.5) / 0.02)
    growth = np.exp(-2e5 * 3e-6 / (0.02 * 8) * motion.time)
    np.testing.assert_allclose(motion.velocity, 3e-6 / (1 + (3e-6 / first - 1) * growth), rtol=1e-6)


def test_reversal_of_the_drive_with_a_law_that_has_it() -> None:
    law = asp.laws.Regularised(**COMMON)
    slider = asp.Slider(law, spring=4e5, load=7.0)
    programme = Programme(Slide("1 s"), Slide("6 s", "-10 um/s"), **START)
    motion = transient(slider, programme, sampling="20 Hz")

    def rates(t: float, y: np.ndarray) -> list[float]:
        F, log_age = y
        strength = 0.5 + 0.026 * (log_age + np.log(1e-6 / 4e-7))
        v = 1e-6 * (np.exp((F / 7 - strength) / 0.013) - np.exp((-F / 7 - strength) / 0.013))
        return [4e5 * (-1e-5 - v), np.exp(-log_age) - abs(v) / 4e-7]

    start = [motion.force[20], np.log(0.4)]
    true = solve_ivp(rates, (0, 6), start, "LSODA", motion.time[20:] - 1, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(motion.force[20:], true.y[0], rtol=0, atol=7e-8)
    (reversal,) = motion.event_times("reversal")
    np.testing.assert_allclose(np.interp(reversal, motion.time, motion.force), 0, atol=0.05)
    assert motion.velocity[-1] < 0 < motion.velocity[0]
    forwards, backwards = motion.event_times("steady")
    assert forwards == 0 < reversal < backwards


def test_a_run_continues_from_the_states_of_another(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    whole = transient(p.slider, MIXED, sampling=[0.4, 0.5, 1.0, 1.5])
    rest = Programme(Slide("1 s"), load="9 N", velocity="1 um/s")
    again = transient(p.slider, rest, initial=whole.states[1], sampling=[0.0, 0.5, 1.0])
    np.testing.assert_allclose(again.force, whole.force[1:], rtol=1e-9)


def test_the_dataset_has_units_events_and_provenance(physical) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    motion = transient(p.slider, MIXED, sampling="10 Hz")
    assert isinstance(motion, Trajectory)
    data = motion.to_dataset()
    assert all({"units", "long_name"} <= set(v.attrs) for v in data.data_vars.values())
    np.testing.assert_array_equal(data["friction"], motion.force / motion.load)
    stretch = data["load_point_displacement"] - data["displacement"]
    np.testing.assert_allclose(stretch * p.slider.K, motion.force, rtol=1e-9)
    # Steady sliding at first, under the load of the programme's start: Phi = D0/V.
    np.testing.assert_allclose(data["age"][0], p.slider.law.D0 / motion.velocity[0], rtol=1e-9)
    assert data.sizes == {"time": 76, "state": 2, "event": len(motion.events)}
    assert data.attrs["stopped"] == "end of the programme"
    assert "lambda = 6.2e-07 m" in data.attrs["parameters"]
    assert data.attrs["relative_tolerance"] == 1e-9


@pytest.mark.parametrize(
    ("name", "times"),
    population([("perrin-rice-zheng", 2), ("rice-ruina", 1), ("ruina-slip", 1)], several=True),
)
def test_the_age_of_steady_sliding_is_that_of_the_law(name, times) -> None:
    law = asp.laws.get_law(name)(mu0=0.6, A=0.012, B=0.01, D0="1 um", V0="3 um/s")
    slider = asp.Slider(law, spring="1 N/um", load="7 N")
    motion = transient(slider, Programme(Slide("0.1 s"), **START))
    # dPhi/dt = 0 at v Phi = D0, and 2 D0 of Perrin, Rice and Zheng.
    np.testing.assert_allclose(motion.age, times * 1.0, rtol=1e-9)


def test_the_file_of_a_trajectory_is_read_as_a_recording(physical, tmp_path) -> None:
    p = physical.Experiment(lambda_=LAMBDA)
    steady = Programme(Slide("2 s"), load="7 N", velocity="3 um/s")
    transient(p.slider, steady, sampling="10 Hz").to_dataset().to_netcdf(
        tmp_path / "run.nc", engine="h5netcdf"
    )
    trace = read(tmp_path / "run.nc")
    assert set(trace.channels) == {"force", "load", "load_point_displacement"}
    drive = trace.channel("displacement").values
    # That of the drive, which the slider's motion is not.
    np.testing.assert_allclose(drive - drive[0], 3e-6 * trace.time, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rtol": 0.1}, "rtol must lie between"),
        ({"method": "euler"}, "must be one of auto, explicit, implicit"),
        ({"sampling": "0 Hz"}, "sampling must be positive"),
        ({"sampling": [0.0, 9.0]}, "sampling must lie within the programme"),
        ({"sampling": [0.2, 0.1]}, "rising order"),
        ({"initial": "rest"}, "initial must be 'steady'"),
        ({"initial": [0.5]}, r"initial must be 2 finite states \(elongation, log_age\)"),
        ({"radiation_damping": 0.0}, "radiation_damping must be positive"),
        ({"inertia": True}, "slider.mass must be positive"),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(physical, options, words) -> None:
    with pytest.raises(InputError, match=words):
        transient(physical.Experiment(lambda_=LAMBDA).slider, MIXED, **options)


def test_arguments_without_a_solution_are_refused(physical) -> None:
    rice = physical.Experiment().slider
    with pytest.raises(InputError, match=r"programme.velocity must be positive for a start"):
        transient(rice, Programme(Hold("1 s"), load=7.0, velocity=0.0))
    with pytest.raises(InputError, match="must be a single one"):
        transient(asp.Slider(rice.law, spring=[1e5, 2e5], load=7.0), MIXED)
    amontons = asp.Slider(asp.laws.Amontons(0.5), spring=1e5, load=7.0)
    with pytest.raises(InputError, match="must depend on velocity"):
        transient(amontons, MIXED)


def test_coefficients_of_order_8_are_those_of_scipy() -> None:
    table = dormand_prince_8()
    np.testing.assert_array_equal(table.A, np.vstack([DOP853.A[:12, :12], DOP853.B]))
    np.testing.assert_array_equal(table.C, np.append(DOP853.C[:12], 1.0))
    for ours, theirs in (
        (table.E5, DOP853.E5),
        (table.E3, DOP853.E3),
        (table.extra_A, DOP853.A_EXTRA),
        (table.extra_C, DOP853.C_EXTRA),
    ):
        np.testing.assert_array_equal(ours, theirs)
