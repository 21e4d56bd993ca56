"""Blocks: the numbers of one run, a bounded size, resuming; and very long programmes."""

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from asperity.errors import InputError
from asperity.loads import Hold, Modulate, Programme, RampLoad, RampVelocity, Slide, StepLoad
from asperity.transients import Trajectory, integrate_blocks, transient

PROGRAMME = Programme(
    *(Slide("0.2 s"), Modulate("0.3 s", 0.2, "40 Hz", rise="0.1 s"), StepLoad("8 N")),
    Slide("0.5 s"),
    load="7 N",
    velocity="1 um/s",
)
INTEGRATED = ("time", "displacement", "states")
#: Columns that follow from the states, with the relative rounding of two programs that read them,
#: one for the rows of a block and one for those of the whole: the compiler orders their sums as it
#: likes. A velocity is the exponential of a friction over A, 80 times as sensitive.
READ = {"force": 1e-15, "load": 1e-15, "velocity": 1e-13, "slip_velocity": 1e-13}
SAMPLINGS = {"rate": "1 kHz", "times": np.linspace(0, 1, 777) ** 2, "steps": None}


@pytest.fixture(scope="module")
def slider(physical):
    return physical.Experiment(lambda_=6.2e-7).slider


@pytest.mark.parametrize("sampling", SAMPLINGS.values(), ids=SAMPLINGS)
def test_blocks_are_the_whole_in_pieces(slider, sampling) -> None:
    whole = transient(slider, PROGRAMME, sampling=sampling)
    blocks = list(integrate_blocks(slider, PROGRAMME, sampling=sampling, rows=64))
    assert len(blocks) > 3
    assert {len(b.time) for b in blocks[:-1]} == {64}
    joined = Trajectory.joined(blocks)
    for name in INTEGRATED:
        np.testing.assert_array_equal(getattr(joined, name), getattr(whole, name))
    for name, rtol in READ.items():
        np.testing.assert_allclose(getattr(joined, name), getattr(whole, name), rtol=rtol)
    assert joined.events == whole.events
    assert [b.termination for b in blocks] == [None] * len(blocks)
    assert whole.time[0] == 0
    assert whole.time[-1] == 1.0
    assert np.all(np.diff(whole.time) > 0)


def test_samples_lie_at_the_requested_times(slider) -> None:
    motion = transient(slider, PROGRAMME, sampling="1 kHz")
    np.testing.assert_array_equal(motion.time, np.arange(1001) / 1000)
    np.testing.assert_allclose(motion.load, PROGRAMME.load(motion.time), rtol=1e-13)
    times = np.array([0.0, 0.123, 0.5, 1.0])
    np.testing.assert_array_equal(transient(slider, PROGRAMME, sampling=times).time, times)


def test_an_interrupted_run_is_resumed_from_its_checkpoint(slider) -> None:
    whole = transient(slider, PROGRAMME, sampling="1 kHz")
    reported = []

    def interrupt(t: float, end: float) -> None:
        reported.append(t)
        if t > 0.3:
            raise KeyboardInterrupt

    kept = []
    blocks = integrate_blocks(slider, PROGRAMME, sampling="1 kHz", rows=50, progress=interrupt)
    with pytest.raises(KeyboardInterrupt):
        kept.extend(blocks)  # what was handed out before is there
    assert sum(len(b.time) for b in kept) >= 200
    rest = integrate_blocks(
        slider, PROGRAMME, sampling="1 kHz", rows=50, resume=kept[-1].checkpoint
    )
    joined = Trajectory.joined([*kept, *rest])
    np.testing.assert_array_equal(joined.time, whole.time)
    np.testing.assert_allclose(joined.force, whole.force, rtol=1e-8)
    np.testing.assert_allclose(joined.displacement, whole.displacement, rtol=0, atol=1e-13)
    kinds = [e.kind for e in joined.events if e.kind.startswith("slip")]
    assert kinds == [e.kind for e in whole.events if e.kind.startswith("slip")]
    assert reported == sorted(reported)


def test_a_segment_becomes_steady_once_however_often_it_is_resumed(slider) -> None:
    steps = Slide("0.1 s"), Modulate("8 s", 0.05, "40 Hz")
    programme = Programme(*steps, load="7 N", velocity="1 um/s")
    whole = transient(slider, programme, sampling="200 Hz").event_times("steady")
    # Memory fades with D0/V = 0.4 s: eight of these are needed for a deviation of 1e-4.
    assert whole[1] > 2
    times: list[float] = []
    checkpoint = None
    while True:
        blocks = integrate_blocks(slider, programme, sampling="200 Hz", rows=400, resume=checkpoint)
        block = next(blocks, None)
        if block is None:
            break
        checkpoint = block.checkpoint
        times += block.event_times("steady").tolist()
    assert len(times) == len(whole) == 2
    # A modulated segment is compared once a period, here 25 ms, and anew after a resumption.
    np.testing.assert_allclose(times, whole, atol=0.06)


def test_a_long_run_starts_at_once_and_holds_one_block(slider) -> None:
    """Ten minutes at 10 kHz are six million rows: only the requested rows are computed."""
    programme = Programme(
        Slide("300 s"), Modulate("300 s", 0.2, "120 Hz"), load="7 N", velocity="1 um/s"
    )
    blocks = integrate_blocks(slider, programme, sampling="10 kHz", rows=20_000)
    first = list(itertools.islice(blocks, 3))
    assert [len(b.time) for b in first] == [20_000] * 3
    np.testing.assert_array_equal(first[2].time, np.arange(40_000, 60_000) / 10_000)


V, W0 = 1e-5, 7.0
AGES = 1e15


@pytest.fixture(scope="module")
def ringing(physical):
    """A slider that rings on its asperities at 420 Hz."""
    return physical.Experiment(M=1.6, lambda_=6.2e-7)


def after_a_long_hold(experiment, times: np.ndarray) -> np.ndarray:
    """States by SciPy: the ringing is resolved until it is weak, then damped by long steps."""
    known = (lambda t: (W0, 0.0), lambda t: 0.0)
    start = experiment.steady(V, W0)
    first = solve_ivp(
        experiment.rates, (0, 0.3), start, "DOP853", args=known, rtol=1e-11,
        atol=[1e-18, 1e-13, 1e-18, 1e-18, 1e-18],
    )  # fmt: skip
    rest = solve_ivp(
        experiment.rates, (0.3, times[-1]), first.y[:, -1], "Radau", t_eval=times, args=known,
        rtol=1e-10, atol=[1e-17, 1e-10, 1e-17, 1e-13, 1e-17],
    )  # fmt: skip
    assert rest.success, rest.message
    return rest.y


def test_a_hold_of_four_months_on_elastic_asperities(ringing) -> None:
    times = np.array([1.0, 1e2, 1e4, 1e6, 1e7])
    programme = Programme(Hold(1e7), load=W0, velocity=V)
    motion = transient(ringing.slider, programme, sampling=times, inertia=True)
    expected = after_a_long_hold(ringing, times)
    np.testing.assert_allclose(motion.force, ringing.K * expected[0], rtol=1e-10)
    np.testing.assert_allclose(motion.displacement, expected[2], rtol=0, atol=1e-16)
    log_age = motion.states[:, 3] + np.log(ringing.D0 / ringing.V0)
    np.testing.assert_allclose(log_age, expected[1], rtol=0, atol=1e-9)
    # The ringing itself makes 4e9 periods.
    assert motion.provenance["steps"] < 20_000
    # sqrt(lambda W0 / M) of the tolerated error of F_i/W, in m/s.
    friction = motion.force[-1] / W0
    error = 1e-11 + 1e-9 * friction
    assert motion.provenance["unresolved_ringing"] == pytest.approx(
        np.sqrt(6.2e-7 * W0 / 1.6) * error, rel=0.1
    )


def test_a_hold_resumed_without_its_ringing(ringing) -> None:
    programme = Programme(Hold(1e7), load=W0, velocity=V)
    options = {"sampling": np.geomspace(1, 1e7, 40), "inertia": True}
    whole = transient(ringing.slider, programme, **options)
    first = next(iter(integrate_blocks(ringing.slider, programme, rows=15, **options)))
    rest = integrate_blocks(ringing.slider, programme, rows=15, resume=first.checkpoint, **options)
    joined = Trajectory.joined([first, *rest])
    np.testing.assert_array_equal(joined.time, whole.time)
    np.testing.assert_allclose(joined.force, whole.force, rtol=1e-9)


def test_a_short_motion_resolves_its_ringing(ringing) -> None:
    programme = Programme(Slide(0.2), Hold(0.5), load=W0, velocity=V)
    motion = transient(ringing.slider, programme, sampling=[0.0], inertia=True)
    assert motion.provenance["unresolved_ringing"] == 0


@pytest.mark.parametrize("mass", [0.0, 1.6])
@pytest.mark.parametrize(
    ("step", "load", "velocity"),
    [
        (Slide(AGES), W0, V),
        (RampLoad(8.4, AGES), 8.4, V),
        (RampVelocity(1e-4, AGES), W0, 1e-4),
    ],
    ids=["slide", "ramp of the load", "ramp of the velocity"],
)
def test_thirty_million_years_of_slow_changes_are_steady_sliding(
    physical, mass, step, load, velocity
) -> None:
    """So slow that it is steady sliding at every instant."""
    experiment = physical.Experiment(M=mass, lambda_=6.2e-7)
    programme = Programme(step, load=W0, velocity=V)
    motion = transient(experiment.slider, programme, sampling=[0.0, AGES], inertia=mass > 0)
    assert motion.termination is None
    expected = experiment.K * experiment.steady(velocity, load)[0]
    assert motion.force[-1] == pytest.approx(expected, rel=1e-9)
    way = 0.5 * (V + velocity) * AGES
    assert motion.displacement[-1] == pytest.approx(way, rel=1e-9)


def test_a_tiny_mass_is_like_no_mass(physical) -> None:
    """Steps far beyond the limit of stability are refused however small their estimated error."""
    programme = Programme(Slide(1.0), Hold(10.0), load=W0, velocity=V)
    times = np.linspace(1.1, 11, 10)
    forces = [
        transient(
            physical.Experiment(M=mass, lambda_=6.2e-7).slider, programme, sampling=times,
            inertia=mass > 0,
        ).force
        for mass in (0.0, 1e-12)
    ]  # fmt: skip
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-7)


def test_an_end_that_needs_too_many_steps_terminates_the_run(ringing) -> None:
    programme = Programme(Modulate(AGES, 0.2, 120.0), load=W0, velocity=V)
    motion = transient(ringing.slider, programme, sampling=[0.0, 1.0], inertia=True)
    assert motion.termination.kind == "too many steps"
    assert 0 < motion.termination.time < AGES
    assert "more to the end" in motion.stopped
    assert motion.time[-1] <= motion.termination.time


@pytest.mark.parametrize("rise", [0.0, 0.9 * AGES], ids=["grazing", "rising"])
def test_the_search_for_loss_of_contact_is_short_in_a_long_step(ringing, rise) -> None:
    """A modulation by 100 % grazes zero between the instants of any search."""
    epsilon, phase = (1.5, 0.0) if rise else (1.0, 0.3)
    programme = Programme(
        Slide(0.1), Modulate(AGES, epsilon, 120.0, rise=rise, phase=phase), load=W0, velocity=V
    )
    motion = transient(ringing.slider, programme, sampling=[0.0], inertia=True)
    assert motion.termination.kind in ("too many steps", "loss of contact", "reversal")


def test_more_rows_than_memory_holds_are_refused_at_once(ringing) -> None:
    programme = Programme(Slide(1.0), load=W0, velocity=V)
    for rate in 10.0 ** np.random.default_rng(3).uniform(12, 308, 20):
        with pytest.raises(InputError, match="sampling must fit into the free space"):
            transient(ringing.slider, programme, sampling=float(rate))


def test_the_largest_number_of_steps_is_obeyed(ringing) -> None:
    programme = Programme(Slide(0.2), Modulate(2.0, 0.2, 120.0), load=W0, velocity=V)
    options = {"sampling": [0.0], "inertia": True}
    whole = transient(ringing.slider, programme, **options)
    assert whole.termination is None
    few = transient(ringing.slider, programme, **options, most_steps=3000)
    assert few.termination.kind == "too many steps"
    assert 3000 <= few.provenance["steps"] < whole.provenance["steps"]
    many = transient(ringing.slider, programme, **options, most_steps=whole.provenance["steps"])
    assert many.termination is None
