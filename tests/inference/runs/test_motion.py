"""Motion over a whole recording and its derivatives, compared with SciPy."""

import numpy as np
import pytest
from benchmarks.coverage import integrated

from asperity.algebra.runge_kutta import rodas_5p
from asperity.inference.runs.drive import Drive
from asperity.inference.runs.gauge import reading_at
from asperity.inference.runs.likelihood import recorded_friction, run_equations
from asperity.laws import get_law
from references.compilation import compiled_programs
from references.populations import population

VALUES = {"mu0": 0.6, "A": 0.009, "B": 0.0105, "D0": 6.5e-6, "V0": 3e-6, "K": 4e3, "W0": 1.0}
#: A step up, a hold, and sliding again under a load that ramps up by 20 %.
EDGES = np.array([0.0, 20.0, 30.0, 45.0, 70.0])
PULL = np.array([1.0, 10 / 3, 0.0, 10 / 3])
LOAD_SLOPE = np.array([0.0, 0.0, 0.0, 0.2 / 25])
TIMES = np.linspace(0.0, 70.0, 281)
FREE = ("A", "B", "D0", "K", "alpha", "shift_1", "start_force", "start_state_0")
MOTION = run_equations(get_law("linker-dieterich"), 3e-6)
AT = {**VALUES, "alpha": 0.2, "shift_1": 0.03, "start_force": 0.002, "start_state_0": -0.3}


#: The spring relaxes within A W/K = 0.03 um of slip, a seventh to a twentieth of the slip between
#: two samples.
STIFF = {**AT, "K": 3e5}


def by_scipy(values, times=TIMES):
    """F/W of the Linker-Dieterich law from the printed equations."""
    edges = EDGES.copy()
    edges[1] += values["shift_1"]
    return integrated(
        {**values, "k": values["K"]}, edges, 3e-6 * PULL, times,
        load=lambda t: 1 + LOAD_SLOPE[3] * np.maximum(t - EDGES[3], 0.0),
        start=(values["start_force"], values["start_state_0"]),
    )  # fmt: skip


@pytest.fixture(scope="module", params=[AT, STIFF], ids=["soft", "stiff"])
def computed(request):
    drive = Drive(EDGES, PULL, np.ones(4), LOAD_SLOPE)
    computed = recorded_friction(MOTION, request.param, FREE, drive, reading_at(TIMES))
    return request.param, *computed


def test_friction_agrees_with_scipy(computed):
    # The relative local error is 1e-7, in steps that change the states by some 0.1.
    np.testing.assert_allclose(computed[1], by_scipy(computed[0]), atol=2e-7)


@pytest.mark.parametrize("name", FREE)
def test_derivatives_agree_with_scipy(computed, name):
    values = computed[0]
    size = {"K": 1e-3 * values["K"], "D0": 1e-8, "shift_1": 1e-2}.get(name, 1e-4)
    more, less = ({**values, name: values[name] + sign * size} for sign in (1, -1))
    expected = (by_scipy(more) - by_scipy(less)) / (2 * size)
    derivative = computed[2][:, FREE.index(name)]
    # Differences of second order; a shift of the step crosses the samples next to it.
    away_from_step = np.abs(TIMES - 20.03) > 0.2 if name == "shift_1" else np.ones(TIMES.size, bool)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(
        derivative[away_from_step], expected[away_from_step], atol=1e-3 * scale
    )


def test_recordings_of_any_length_share_the_compiled_motion():
    drive = Drive(EDGES, PULL, np.ones(4), LOAD_SLOPE)
    few = recorded_friction(MOTION, AT, FREE, drive, reading_at(TIMES))
    times = np.linspace(0.0, 70.0, 20 * 280 + 1)
    with compiled_programs() as compiled:
        many = recorded_friction(MOTION, AT, FREE, drive, reading_at(times))
    assert any("_read" in name for name in compiled), compiled
    assert not any("integrated" in name for name in compiled), compiled
    for a, b in zip(many, few, strict=True):
        np.testing.assert_allclose(a[::20], b, rtol=1e-9, atol=1e-12)


def test_means_over_blocks_agree_with_scipy():
    drive = Drive(EDGES, PULL, np.ones(4), LOAD_SLOPE)
    # Blocks of 0.6 s with a gap; each change of the drive is inside a block.
    edges = np.linspace(0.0, 69.0, 116)
    blocks = np.stack([edges[:-1], edges[1:]], axis=1)[np.arange(115) != 60]
    means, slopes = recorded_friction(MOTION, AT, FREE, drive, reading_at(blocks))
    times = (blocks[:, :1] + 0.6 * (np.arange(50) + 0.5) / 50).ravel()
    expected = by_scipy(AT, times).reshape(-1, 50).mean(axis=1)
    # Error of the midpoint rule over 12 ms where the slope jumps by 0.04 per second.
    np.testing.assert_allclose(means, expected, atol=5e-6)
    # Blocks around the step and the beginning of the hold.
    some = slice(31, 51)
    at = times.reshape(-1, 50)[some].ravel()
    points = recorded_friction(MOTION, AT, FREE, drive, reading_at(at))[1]
    points = points.reshape(20, 50, -1).mean(axis=1)
    for name, mean, point in zip(FREE, slopes[some].T, points.T, strict=True):
        # The derivative by the time of the step jumps within a fiftieth of a block.
        np.testing.assert_allclose(mean, point, atol=1e-2 * np.abs(point).max(), err_msg=name)


def test_the_coefficients_are_of_order_5_and_damp_stiff_modes():
    """Equations with closed solutions, integrated in stages as written in the table's docstring."""
    table = rodas_5p()

    def step(f, J, by_time, t, y, h):
        inverse, u = np.linalg.inv(np.eye(y.size) / (table.gamma * h) - J(t, y)), []
        for k in range(8):
            state = y + sum((a * v for a, v in zip(table.A[k], u, strict=False)), 0 * y)
            right = f(t + table.nodes[k] * h, state) + h * table.by_time[k] * by_time(t, y)
            u.append(
                inverse
                @ (right + sum((c * v for c, v in zip(table.C[k], u, strict=False)), 0 * y) / h)
            )
        new = state + u[-1]
        d = table.dense @ np.array(u)
        return new, u[-1], y + 0.5 * (new - y + 0.5 * (d[0] + 0.5 * (d[1] + 0.5 * d[2])))

    # y1' = -2 t y1^2, y1 = 1/(1 + t^2), and y2' = y1 y2 cos t / (...): y2 = exp(sin t) by its rate.
    def f(t, y):
        return np.array([-2 * t * y[0] ** 2, y[1] * np.cos(t) + y[0] - 1 / (1 + t**2)])

    def J(t, y):
        return np.array([[-4 * t * y[0], 0.0], [1.0, np.cos(t)]])

    def by_time(t, y):
        return np.array([-2 * y[0] ** 2, -y[1] * np.sin(t) + 2 * t / (1 + t**2) ** 2])

    def solution(t):
        return np.array([1 / (1 + t**2), np.exp(np.sin(t))])

    sizes = np.array([0.2, 0.1, 0.05, 0.025])
    errors = []
    for h in sizes:
        y, worst, middle = solution(0.3), 0.0, 0.0
        for k in range(round(1.2 / h)):
            y, estimate, half = step(f, J, by_time, 0.3 + k * h, y, h)
            worst = max(worst, np.abs(estimate).max())
            middle = max(middle, np.abs(half - solution(0.3 + (k + 0.5) * h)).max())
        errors.append([np.abs(y - solution(1.5)).max(), worst, middle])
    orders = np.log2(np.array(errors[:-1]) / errors[1:])[-1]
    # The solution is of order 5. The estimated error and the error of the dense output are local
    # errors, of one step, of a method of order 4.
    assert orders[0] > 4.7
    assert orders[1] > 4.7
    assert orders[2] > 4.7
    linear = step(
        lambda t, y: -1e9 * y,
        lambda t, y: np.array([[-1e9]]),
        lambda t, y: 0 * y,
        0.0,
        np.ones(1),
        1.0,
    )
    assert abs(linear[0][0]) < 1e-6


def test_a_load_of_hundreds_of_straight_lines_is_integrated():
    """Some 8 steps follow the evolution of friction after each change of the load."""
    pieces = 300
    edges = np.linspace(0.0, 300.0, pieces + 1)
    load = 1 + 0.01 * np.random.default_rng(1).normal(size=pieces + 1)
    load[0] = 1.0
    drive = Drive(edges, np.ones(pieces), load[:-1], np.diff(load) / np.diff(edges))
    times = np.linspace(0.0, 300.0, 900)
    values = {**VALUES, "alpha": 0.2, "K": 1e5}
    friction, _ = recorded_friction(MOTION, values, (), drive, reading_at(times))
    expected = integrated(
        {**values, "k": values["K"]}, edges, np.full(pieces, 3e-6), times,
        load=lambda t: np.interp(t, edges, load),
    )  # fmt: skip
    np.testing.assert_allclose(friction, expected, atol=2e-6)


def test_a_motion_that_runs_away_has_no_result():
    drive = Drive(EDGES, PULL, np.ones(4), np.zeros(4))
    # A twentieth of the critical stiffness (B - A)/D0.
    assert recorded_friction(MOTION, {**AT, "K": 12.0}, FREE, drive, reading_at(TIMES)) is None


def test_a_free_radiation_damping_adds_to_the_friction():
    """Steady friction rises by eta V/W; the derivative agrees with differences."""
    motion = run_equations(get_law("rice-ruina"), 3e-6, radiation_damping=True)
    drive, reading = Drive(EDGES, PULL, np.ones(4), np.zeros(4)), reading_at(TIMES)
    middle, more, less = (
        recorded_friction(motion, {**VALUES, "eta": eta}, ("eta",), drive, reading)
        for eta in (2e3, 2.002e3, 1.998e3)
    )
    np.testing.assert_allclose(middle[0][0], VALUES["mu0"] + 2e3 * 3e-6, rtol=1e-9)
    slope, expected = middle[1][:, 0], (more[0] - less[0]) / 4.0
    np.testing.assert_allclose(slope, expected, atol=1e-3 * np.abs(expected).max())


@pytest.mark.parametrize("name", population(["regularised", "linker-dieterich", "rice-ruina"]))
def test_rounding_errors_of_derivatives_of_steady_sliding_do_not_grow(name):
    """The integrator takes stable steps in steady sliding of any length, where F/W is mu_ss."""
    for seed in range(6):
        random = np.random.default_rng(seed)
        V, A = 10 ** random.uniform(-6, -5), random.uniform(0.006, 0.012)
        # At V0 = V the states are exact, so that the error of the motion does not limit a step.
        V0 = V if seed % 2 else 1.3e-6
        values = {"mu0": 0.6, "V0": V0, "A": A, "B": 0.0105, "D0": 6.5e-6, "alpha": 0.2}
        values |= {"K": random.uniform(2e3, 2e4), "W0": 1.0}
        # Multiples of A W / (K V), the relaxation time of a slider on a spring.
        length = random.uniform(50, 400) * A / (values["K"] * V)
        edges = length * np.array([0.0, 1.0, 1.2])
        drive = Drive(edges, np.array([1.0, 3.0]), np.ones(2), np.zeros(2))
        times = np.linspace(0, edges[-1], 300)
        motion = run_equations(get_law(name), V)
        free = ("A", "B", "D0", "K")
        _, slopes = recorded_friction(motion, values, free, drive, reading_at(times))
        steady = times < length
        slope = np.log(V / values["V0"])
        expected = np.broadcast_to([slope, -slope, 0.0, 0.0], slopes[steady].shape)
        scale = [A, values["B"], values["D0"], values["K"]]
        np.testing.assert_allclose(slopes[steady] * scale, expected * scale, atol=2e-6)
