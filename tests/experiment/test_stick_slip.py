"""Limit cycles of stick-slip, against SciPy, closed forms, and where stick-slip ends."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.errors import InputError
from asperity.experiment import stick_slip_response
from asperity.laws import Amontons, RiceRuina, registered
from asperity.theory import overshooting_cycle
from references.holds_and_steps import STATE_RATES
from references.populations import draws, population

MU0, V0 = 0.6, 1e-6


#: LSODA takes a quarter of the time, and loses the motion in a few draws: states of 1e33.
LSODA = {"method": "LSODA", "rtol": 1e-10, "atol": 1e-11}
RADAU = {"method": "Radau", "rtol": 1e-8, "atol": 1e-9}


def of_scipy(name, A, B, D0, K, M, W0, V, cycles, options):
    """Period, peak, lowest, stick duration and peak velocity of the last of some cycles."""
    rate = STATE_RATES[name]

    def motion(_, Y):
        f, u, y = Y
        v = V * np.exp(u)
        friction = MU0 + A * np.log(v / V0) + B * y
        return [K / W0 * (V - v), W0 * (f - friction) / (M * v), rate(v, y, D0, V0)]

    def extremum(_, Y):
        return Y[1]

    slow = V / 100
    start = [MU0 + (A - B) * np.log(slow / V0), np.log(slow / V), -np.log(slow / V0)]
    end = cycles * 3 * 0.1 * W0 / (K * V) + cycles * 0.3
    run = solve_ivp(motion, (0, end), start, events=extremum, **options)
    assert run.success
    t, F = run.t_events[0], run.y_events[0][:, 0]
    tops = np.flatnonzero(F[1:-1] > F[2:]) + 1
    first, last = tops[-3], tops[-2]
    low = first + 1
    inside = (run.t > t[first]) & (run.t < t[last])
    fastest = V * np.exp(run.y[1][inside].max())
    return t[last] - t[first], F[last], F[low], t[last] - t[low], fastest, np.diff(F[tops[-4:]])


@pytest.mark.parametrize("name", population(list(STATE_RATES)))
@draws(1, 4)
def test_cycles_are_those_of_scipy(name, draws):
    draw = np.random.default_rng(len(name))
    options = LSODA if draws == 1 else RADAU
    for _ in range(draws):
        A, D0, W0 = draw.uniform(0.005, 0.02), 10 ** draw.uniform(-6.5, -5), draw.uniform(0.2, 20)
        B = A * draw.uniform(1.2, 1.8)
        K = (B - A) * W0 / D0 * 10 ** draw.uniform(-2, -0.7)
        V, M = 10 ** draw.uniform(-5, -3), 10 ** draw.uniform(-2, 0)
        slider = asp.Slider(
            registered()[name](mu0=MU0, A=A, B=B, D0=D0, V0=V0), spring=K, load=W0, mass=M
        )
        mine = stick_slip_response(slider, velocity=V)
        period, peak, low, stick, fastest, changes = of_scipy(
            name, A, B, D0, K, M, W0, V, 12, options
        )
        assert np.abs(changes).max() < 1e-6  # SciPy's motion repeats itself
        assert mine.slips == 1, mine.result
        assert mine.period == pytest.approx(period, rel=1e-5)
        assert mine.peak == pytest.approx(peak, abs=2e-6)
        assert mine.lowest == pytest.approx(low, abs=2e-6)
        assert mine.stick_duration == pytest.approx(stick, rel=1e-5)
        # At SciPy's steps the largest velocity is met closely only.
        assert mine.peak_velocity == pytest.approx(fastest, rel=5e-3)


def test_a_slip_over_a_short_memory_overshoots_and_its_drop_grows_logarithmically():
    """Slips of 3e-4 m over D0 = 1e-8 m are those of constant friction in `overshooting_cycle`."""
    A, B, K, M, W0 = 0.006, 0.009, 168.0, 0.0307, 0.301
    law = RiceRuina(mu0=0.8, A=A, B=B, D0=1e-8, V0=V0)
    V = np.array([1e-6, 1e-5, 1e-4])
    mine = stick_slip_response(asp.Slider(law, spring=K, load=W0, mass=M), velocity=V)
    exact = overshooting_cycle(mine.drop / 2, K=K, M=M, W0=W0, V=V)
    np.testing.assert_allclose(mine.peak_velocity, exact.peak_velocity, rtol=3e-3)
    np.testing.assert_allclose(mine.stick_duration[1:], exact.stick_duration[1:], rtol=0.02)
    np.testing.assert_allclose(mine.slip_duration[2], np.pi * np.sqrt(M / K), rtol=0.01)
    # The work over a slip v(x) = v_peak sin averages ln v to ln v_peak + ln 2 - 1.
    in_slip = law.mu_ss(mine.peak_velocity * 2 / np.e)
    np.testing.assert_allclose((mine.peak + mine.lowest) / 2, in_slip, atol=0.02 * mine.drop.min())
    # Strength grows by B for each e-fold of the age and falls by A for that of the velocity, from
    # D0/age at the onset of slip.
    growth = np.diff(mine.drop) / np.diff(np.log(mine.stick_duration))
    assert np.all((growth > 2 * (B - A)) & (growth < 2 * B))
    assert growth[0] == pytest.approx(growth[1], rel=0.1)


def test_stick_slip_ends_where_steady_sliding_becomes_stable():
    """Stiffness of the Hopf bifurcation (Ruina, 1983; Rice and Ruina, 1983, with inertia)."""
    A, B, D0, W0, M, V = 0.01, 0.015, 1e-6, 1.0, 0.03, 1e-5
    critical = (B - A) * W0 / D0 * (1 + M * V**2 / (A * W0 * D0))
    law = RiceRuina(mu0=0.5, A=A, B=B, D0=D0, V0=V0)
    share = np.array([0.5, 0.99, 0.9999, 1.0002, 1.05])
    mine = stick_slip_response(
        asp.Slider(law, spring=critical * share, load=W0, mass=M), velocity=V
    )
    assert list(mine.stable) == [False, False, False, True, True]
    assert list(mine.steady) == [False, False, False, False, True]
    # The bifurcation is subcritical: the drop jumps, and a cycle is there beyond it.
    assert list(mine.slips) == [1, 1, 1, 1, 0]
    assert np.all(np.diff(mine.drop[:4]) < 0)
    assert mine.drop[3] > 0.01
    assert np.isnan(mine.drop[4])
    assert "steady sliding" in mine.result[4]


def test_without_inertia_a_slip_runs_away():
    law = RiceRuina(mu0=0.5, A=0.01, B=0.015, D0=1e-6, V0=V0)
    mine = stick_slip_response(
        asp.Slider(law, spring=[[100.0], [6000.0]], load=1.0), velocity=["1 um/s", "10 um/s"],
        inertia=False,
    )  # fmt: skip
    assert mine.result.shape == (2, 2)
    assert all("ran away" in text for text in mine.result[0])
    assert mine.steady[1].all()
    data = mine.to_dataset()
    assert data["drop"].dims == ("K", "velocity")
    assert data.period.units == "s"


def test_bad_input_says_what_to_do():
    law = RiceRuina(mu0=0.5, A=0.01, B=0.015, D0=1e-6, V0=V0)
    slider = asp.Slider(law, spring=100.0, load=1.0)
    with pytest.raises(InputError, match=r"slider.mass must be positive, got 0 kg; give the mass"):
        stick_slip_response(slider, velocity=1e-6)
    with pytest.raises(InputError, match="velocity must be positive"):
        stick_slip_response(slider, velocity=-1e-6, inertia=False)
    rigid = asp.Slider(Amontons(mu0=0.5), spring=100.0, load=1.0, mass=1.0)
    with pytest.raises(InputError, match="law must depend on the velocity"):
        stick_slip_response(rigid, velocity=1e-6)
