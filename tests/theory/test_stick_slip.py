"""Closed forms of stick-slip against the integrated motion and against Lambert's function."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import lambertw

from asperity.errors import InputError
from asperity.theory import healing_drop, overshooting_cycle

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
