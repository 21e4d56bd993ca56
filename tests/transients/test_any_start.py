"""Starts from any states: solved, ended with a reason, or refused in a sentence."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.laws import registered
from asperity.loads import Hold, Modulate, Programme, Slide
from asperity.operating_point import numbers_for, sourced_numbers
from asperity.slider.parameters import slider_from
from asperity.transients import step_size
from asperity.transients.dense_output import Interval
from asperity.transients.events import _SENTENCES
from references.populations import population

#: Numbers of laws that the material does not have.
OTHERS = {
    "cut-off": {"V1": "1 um/s", "V2": "100 um/s"},
    "nagata": {"c": 2.0},
    "two-state": {"B2": 0.005, "D2": "4 um"},
    "prakash-clifton": {"L": "1 um", "V_star": "1 um/s"},
}
LAWS = [name for name, law in registered().items() if law.rate_dependent]
#: In every run: elastic asperities, and rest and reversal.
SUITE = ("elasto-plastic", "regularised")
HOLD = Programme(Hold("1 s"), load=7.0, velocity="1 um/s")


def slider_of(law):
    point = {"V": 1e-6, "epsilon": 0.1, "frequency": 10.0, **OTHERS.get(law, {})}
    material = asp.materials.load("bureau2000")
    numbers = numbers_for(law, sourced_numbers(point, material, "test", law))
    return slider_from(registered()[law], {name: n.value for name, n in numbers.items()})


def starts(size, count, seed, steady):
    """States of any sign and size, the others those of steady sliding."""
    draw = np.random.default_rng(seed)
    for _ in range(count):
        powers = draw.uniform(-1, draw.choice([0.5, 1.5, 3, 6, 300]), size)
        states = 10.0**powers * draw.choice([-1, 1], size)
        yield np.where(draw.random(size) < 0.6, states, steady)


def assert_ended(slider, programme, **options):
    refused = None
    try:
        motion = asp.transient(slider, programme, **options)
    except asp.InputError as error:
        refused = str(error)
    if refused is not None:
        assert refused.startswith("initial must ")
        assert "; " in refused
        return
    assert len(motion.time) > 0
    assert motion.time[0] == 0
    if motion.termination is None:
        assert motion.time[-1] == programme.duration
    else:
        assert motion.termination.kind in _SENTENCES
        assert motion.events[-1].kind == motion.termination.kind
    assert "Trajectory" in repr(motion)
    assert motion.to_dataset().sizes["time"] == len(motion.time)


@pytest.mark.parametrize(
    "law", population([*SUITE, *(name for name in LAWS if name not in SUITE)], short=len(SUITE))
)
def test_any_start_ends_with_numbers_or_a_reason(law):
    slider = slider_of(law)
    steady = asp.transient(slider, HOLD).states[0]
    for states in starts(len(steady), 8, LAWS.index(law), steady):
        assert_ended(slider, HOLD, initial=states, most_steps=2e4)


@pytest.mark.parametrize(
    ("law", "options"),
    population(
        [
            ("elasto-plastic", {"inertia": True}),
            ("rice-ruina", {"radiation_damping": 1e3}),
            ("regularised", {"inertia": True}),
        ],
        several=True,
    ),
)
def test_any_start_with_inertia_or_damping_ends_with_numbers_or_a_reason(law, options):
    slider = slider_of(law)
    steady = asp.transient(slider, HOLD, **options).states[0]
    for states in starts(len(steady), 6, 7, steady):
        assert_ended(slider, HOLD, initial=states, most_steps=2e4, **options)


@pytest.mark.parametrize(
    "states", [[1e300, -1e300], [1e3, -1e3], [1e6, 0.0], [0.4, -1e300], [1e308, 1e308]]
)
def test_states_beyond_the_exponential_are_refused(states):
    with pytest.raises(asp.InputError, match=r"rates are numbers, got .*; begin nearer to steady"):
        asp.transient(slider_of("rice-ruina"), HOLD, initial=states)


def test_a_force_at_which_the_law_is_not_defined_is_refused():
    for law in ("rice-ruina", "elasto-plastic", "ruina-slip"):
        with pytest.raises(asp.InputError, match="take a law that is, such as 'regularised'"):
            asp.transient(slider_of(law), HOLD, initial=[-0.4, 0.0])
    pushed_back = asp.transient(slider_of("regularised"), HOLD, initial=[-0.4, 0.0])
    assert pushed_back.stopped is None


@pytest.mark.parametrize("seed", range(4))
def test_far_from_steady_sliding_the_motion_is_that_of_scipy(seed):
    """Old and young interfaces, stuck and released, without inertia."""
    draw = np.random.default_rng(seed)
    slider = slider_of("rice-ruina")
    law, K, W0 = slider.law, float(slider.K), float(slider.W0)
    mu0, A, B, D0, V0 = (float(getattr(law, n)) for n in ("mu0", "A", "B", "D0", "V0"))
    # The slip begins slower than V0 by a factor of up to e^30, or faster by e^3.
    log_age = draw.uniform(-10, 40)
    force = mu0 + B * log_age + A * draw.choice([draw.uniform(-30, 0), draw.uniform(0, 3)])
    force = max(force, 0.0)
    programme = Programme(Slide("0.05 s", "1 um/s"), load=W0, velocity="1 um/s")
    motion = asp.transient(
        slider, programme, initial=[force, log_age], sampling=np.linspace(0, 0.05, 6)
    )

    def rates(t, y):
        v = V0 * np.exp((y[0] - mu0 - B * y[1]) / A)
        return [K / W0 * (1e-6 - v), (V0 * np.exp(-y[1]) - v) / D0]

    exact = solve_ivp(
        rates, (0, 0.05), [force, log_age], "Radau", motion.time, rtol=1e-10, atol=1e-12
    )
    assert motion.stopped is None
    assert motion.force / W0 == pytest.approx(exact.y[0], rel=1e-7)
    assert motion.states[:, 1] == pytest.approx(exact.y[1], rel=1e-6, abs=1e-7)


def test_compiled_steps_return_after_a_limited_number_of_trials(monkeypatch):
    """A trial that is never accurate, and one whose length is no number."""
    import jax
    import jax.numpy as jnp

    parts = {"segment": HOLD.segments[0], "motion": None, "first_length": lambda *_: jnp.ones(())}
    system = type("", (), parts)()

    def attempts(error, factor):
        def attempt(t, Y, h, memory):
            return step_size.TrialStep(
                Y, jnp.asarray(error), jnp.asarray(factor), memory, False, (Y,)
            )

        zero, one = jnp.zeros(()), jnp.ones(())
        limits = 0.999999, 6.0

        def run(h):
            interval = Interval(zero, jnp.zeros(2), h, one, one)
            return step_size.run_steps(system, interval, attempt, zero, limits)

        return jax.jit(run)

    # Shortened by a tenth only, it takes longer than a chunk to vanish.
    slow = attempts(2.0, 1.0)(jnp.asarray(1e308))
    assert int(slow.taken) == 0
    assert int(slow.rejected) <= step_size._TRIALS
    for lost in (attempts(jnp.nan, jnp.nan)(jnp.nan), attempts(jnp.nan, 1.0)(jnp.asarray(jnp.nan))):
        assert int(lost.status) == step_size.UNDERFLOW


@pytest.mark.parametrize(
    ("epsilon", "frequency", "duration", "rise"),
    [(5e128, 3e142, 0.018, 0.0037), (167.0, 912.0, 8e18, 1.7e18), (841.0, 24.0, 1e111, 3e110)],
)
def test_contact_that_is_lost_in_a_rise_of_any_length_is_reported(
    epsilon, frequency, duration, rise
):
    modulate = Modulate(duration, epsilon, frequency, rise=rise)
    programme = Programme(modulate, load=7.0, velocity="1 um/s")
    motion = asp.transient(slider_of("rice-ruina"), programme, most_steps=1e4)
    assert motion.termination.kind in ("loss of contact", "too many steps", "runaway")
