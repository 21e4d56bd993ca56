"""Closed forms of steps, holds and stick-slip, against integrations that do not use them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import lambertw

from asperity.errors import InputError
from asperity.laws import registered
from asperity.theory import healing_drop, overshooting_cycle
from asperity.theory.holds_and_steps import ageing_long_hold, healing_rate_limit, state_after_step
from references.holds_and_steps import STATE_RATES, Interface

A, B, D0, V0 = 0.008, 0.009, 3e-6, 1e-6
NUMBERS = {"mu0": 0.6, "A": A, "B": B, "D0": D0, "V0": V0}
LAWS = tuple(STATE_RATES)


def law(name, **changes):
    return registered()[name](**(NUMBERS | changes))


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("ratio", [0.01, 0.5, 10.0, 1e4])
def test_the_state_after_a_step_is_the_integrated_one(name, ratio):
    V = ratio * V0

    def rate(u, y):
        return STATE_RATES[name](V, y, D0, V0) / V

    slip = D0 * np.array([0.01, 0.3, 1.0, 5.0])
    options = {"rtol": 1e-12, "atol": 1e-13, "first_step": 1e-6 * slip[0] / max(ratio, 1)}
    done = solve_ivp(rate, (0, slip[-1]), [0.0], "DOP853", t_eval=slip, **options)
    expected = done.y[0] + np.log(ratio)
    got = state_after_step(law(name), ratio, slip)
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-11)


def test_the_slip_laws_state_is_odd_in_the_step():
    up, down = (state_after_step(law("ruina-slip"), r, 2e-6) for r in (10.0, 0.1))
    assert float(up + down) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("k", [2e3, 7.4e4])
def test_healing_after_a_long_hold_is_the_integrated_one(k):
    """The next order makes the error several times smaller, and it falls with the hold time."""
    times = np.array([1e4, 1e7])
    interface = Interface("rice-ruina", A, B, D0, k)
    exact = np.array([interface.hold(V0, t)[2] for t in times])
    closed = ageing_long_hold(law("rice-ruina"), velocity=V0, hold_time=times, stiffness=k)
    left = np.abs(exact - closed.leading)
    over = np.abs(exact - closed.healing)
    assert (over < left / 2).all()
    assert over[1] < over[0] / 2
    assert over[1] < 1e-4 * exact[1] * (10 if k < 1e4 else 1)


def test_the_reload_slip_has_no_gap_at_equal_lengths():
    """k D0 = B is a removable point of the closed form."""
    k = B / D0 * np.array([1 - 1e-5, 1, 1 + 1e-5])
    at = ageing_long_hold(law("rice-ruina"), velocity=V0, hold_time=1e5, stiffness=k)
    assert np.ptp(np.asarray(at.healing)) < 1e-6


def test_the_healing_rate_tends_to_its_limit():
    """Slopes of long holds by SciPy: at the limit, near it, and far from it, as the table says."""

    def rate(name, time, k=2e3, **changes):
        numbers = {"A": A, "B": B, "D0": D0} | changes
        interface = Interface(name, k=k, **numbers)
        (_, _, low, *_), (_, _, high, *_) = (interface.hold(V0, t) for t in (time, 10 * time))
        return (high - low) / float(healing_rate_limit(law(name, **changes)))

    assert rate("rice-ruina", 1e11) == pytest.approx(1, abs=3e-3)
    assert rate("perrin-rice-zheng", 1e9) == pytest.approx(1, abs=5e-3)
    slopes = [rate("ruina-slip", t) for t in (1e5, 1e8, 1e11)]
    assert slopes[0] < slopes[1] < slopes[2] < 1
    assert slopes[2] > 0.85
    # Strengthening: all contacts age alike in the end.
    assert rate("ruina-slip", 1e11, k=5e2, A=0.012) == pytest.approx(1, abs=0.1)


def test_laws_without_a_closed_form_are_refused():
    with pytest.raises(InputError, match="rice-ruina, ruina-slip or perrin"):
        healing_rate_limit(law("regularised"))
    with pytest.raises(InputError, match="ageing law"):
        ageing_long_hold(law("ruina-slip"), velocity=V0, hold_time=10, stiffness=1e4)
    with pytest.raises(InputError, match=r"above law\.A / 2"):
        healing_rate_limit(law("perrin-rice-zheng", A=0.03))


def test_closed_forms_have_derivatives():
    def healing(b):
        held = ageing_long_hold(law("rice-ruina", B=b), velocity=V0, hold_time=1e4, stiffness=2e3)
        return held.healing

    step = 1e-6
    slope = (healing(B + step) - healing(B - step)) / (2 * step)
    assert float(jax.grad(healing)(jnp.asarray(B))) == pytest.approx(float(slope), rel=1e-6)


K, M, W0 = 168.0, 0.0307, 0.301


@pytest.mark.parametrize("V", [1e-6, 42e-6, 1e-3, 2e-2])
def test_a_slip_is_the_integrated_one(V) -> None:
    strength, dynamic = 0.02, 0.3
    start = (dynamic + strength) * W0

    def motion(t, y):
        x, v = y
        return [v, (start + K * (V * t - x) - dynamic * W0) / M]

    def rests(t, y):
        return y[1] if t > 0 else 1.0

    rests.terminal, rests.direction = True, -1
    # The slider leaves from rest at the limit: its velocity grows from zero.
    run = solve_ivp(motion, (0, 1), [0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-16,
                    events=rests, max_step=1e-3)  # fmt: skip
    end, x = run.t[-1], run.y[0, -1]
    cycle = overshooting_cycle(strength, K=K, M=M, W0=W0, V=V)
    assert cycle.slip_duration == pytest.approx(end, rel=1e-8)
    assert cycle.drop * W0 == pytest.approx(K * (x - V * end), rel=1e-8)
    assert cycle.slip == pytest.approx(V * cycle.stick_duration + V * end, rel=1e-12)
    assert cycle.slip == pytest.approx(x, rel=1e-8)
    assert cycle.peak_velocity == pytest.approx(run.y[1].max(), rel=1e-3)


def test_a_slip_lasts_for_half_a_period_of_a_slow_drive_and_a_whole_one_of_a_fast_drive() -> None:
    half = np.pi * np.sqrt(M / K)
    slow, fast = overshooting_cycle(0.02, K=K, M=M, W0=W0, V=[1e-9, 1e3]).slip_duration
    assert slow == pytest.approx(half, rel=1e-4)
    assert fast == pytest.approx(2 * half, rel=1e-4)


def test_drops_are_those_of_lamberts_function() -> None:
    V = np.geomspace(1e-7, 1e-4, 7)
    drop = healing_drop(0.05, 0.004, 1.0, K=K, W0=W0, V=V)
    c = 0.05 / 0.004 + np.log(2 * 0.004 * W0 / (K * V))
    assert drop == pytest.approx(-2 * 0.004 * lambertw(-np.exp(-c), -1).real, rel=1e-12)
    rest = drop * W0 / (K * V)
    # Logarithmic growth with the time of rest, exactly.
    slopes = np.diff(drop) / np.diff(np.log(rest))
    assert slopes == pytest.approx(np.full(6, 2 * 0.004), rel=1e-10)


def test_no_cycle_where_the_strength_is_not_there_in_time() -> None:
    assert np.isnan(healing_drop(0.05, 0.02, 1.0, K=K, W0=W0, V=1.0))
    with pytest.raises(InputError, match="must be positive"):
        overshooting_cycle(0.02, K=K, M=M, W0=W0, V=0.0)
