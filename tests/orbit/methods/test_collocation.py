"""Collocation: order of convergence, the linear algebra under it, and its meshes.

Small systems are called within `jax.jit`: operations outside are programs of their own, compiled
one by one. Cases of one kind have one shape, and so one program.
"""

import jax
import numpy as np
import pytest

import asperity as asp
from asperity.algebra import cyclic, small_systems
from asperity.laws import ElastoPlastic, RiceRuina, get_law
from asperity.loads import Harmonic, modulated
from asperity.orbit.mesh import equations
from asperity.orbit.mesh.equations import read_orbit
from asperity.orbit.mesh.mesh import (
    GAUSS,
    STAGES,
    Orbit,
    equidistributed,
    evaluate,
    graded_mesh,
    split,
)
from asperity.orbit.mesh.newton import ACCEPTED, Plane, solve, solve_in_plane
from asperity.slider import QuasiStatic, Slider
from asperity.slider.problem import Problem, checked_problem, flatten
from asperity.theory.limits import adiabatic_growth

#: Round-off times the condition of a random small matrix.
EXACT = 1e-11
#: Points and right-hand sides of the small systems.
POINTS, COLUMNS = 50, 4

product = jax.jit(small_systems.product)
solve_columns = jax.jit(small_systems.solve_columns)
spectral_abscissa = jax.jit(small_systems.spectral_abscissa)
spectral_radius = jax.jit(small_systems.spectral_radius)


solve_cyclic = jax.jit(cyclic.solve_cyclic)
solve_bordered = jax.jit(cyclic.solve_bordered)


@jax.jit
def solve_columns_and_points(matrix, right):
    return small_systems.solve_columns(matrix, right), small_systems.solve_points(
        matrix, right[:, 0]
    )


def normal(*shape, seed=7):
    return np.random.default_rng(seed).normal(size=shape)


def matrices(n, complex_=False, seed=7):
    real = normal(n, n, POINTS, seed=seed)
    return real + 1j * normal(n, n, POINTS, seed=seed + 1) if complex_ else real


def repeated(matrix):
    """One matrix at all points."""
    matrix = np.asarray(matrix, float)
    return np.broadcast_to(matrix[..., None], (*matrix.shape, POINTS))


def each(a):
    """Points first, as NumPy's linear algebra has it."""
    return np.moveaxis(np.asarray(a), -1, 0)


@pytest.mark.parametrize("complex_", [False, True])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_solve_columns_agrees_with_lapack(n, complex_):
    matrix, right = matrices(n, complex_=complex_), normal(n, COLUMNS, POINTS, seed=9)
    solution, one = map(each, solve_columns_and_points(matrix, right))
    np.testing.assert_allclose(solution, np.linalg.solve(each(matrix), each(right)), rtol=1e-9)
    np.testing.assert_allclose(one, solution[:, :, 0], rtol=EXACT)


def test_solve_columns_handles_a_zero_pivot():
    matrix = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 3.0]])
    solution, _ = solve_columns_and_points(repeated(matrix), repeated(np.eye(3, COLUMNS)))
    np.testing.assert_allclose(each(solution)[0, :, :3], np.linalg.inv(matrix), atol=EXACT)


def test_a_singular_matrix_gives_no_finite_solution():
    for solution in solve_columns_and_points(
        repeated([[1.0, 2.0], [2.0, 4.0]]), repeated(np.ones((2, COLUMNS)))
    ):
        assert not np.isfinite(solution).any()


def test_a_determinant_that_overflows_gives_no_finite_solution():
    """Entries over an infinite determinant would be zero, and a Newton step that moves nothing."""
    for solution in solve_columns_and_points(
        repeated([[1e200, 1.0], [1.0, 1e200]]), repeated(np.ones((2, COLUMNS)))
    ):
        assert not np.isfinite(solution).any()


@pytest.mark.parametrize("n", [1, 2, 3])
def test_product_is_the_matrix_product(n):
    a, b = matrices(n), matrices(n, seed=8)
    np.testing.assert_allclose(each(product(a, b)), each(a) @ each(b), atol=EXACT)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_spectral_radius_is_the_largest_modulus_of_the_eigenvalues(n):
    matrix = matrices(n)
    values = np.linalg.eigvals(each(matrix))
    np.testing.assert_allclose(spectral_radius(matrix), np.abs(values).max(1), rtol=3e-3)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_spectral_abscissa_is_the_largest_real_part_of_the_eigenvalues(n):
    # Similar to random matrices by scales that differ by many orders of magnitude, as those of
    # force, velocity and friction do.
    random = matrices(n)
    scale = 10.0 ** np.random.default_rng(5).uniform(-4, 4, (n, random.shape[2]))
    for matrix in (random, random * scale[:, None] / scale):
        expected = np.linalg.eigvals(each(matrix))
        error = np.abs(spectral_abscissa(matrix) - expected.real.max(1))
        assert (error < 1e-12 * np.abs(expected).max(1)).all()


def test_steady_sliding_on_asperities_is_stable_with_inertia():
    # Far above Kc the slider swings on its asperities at some 1e5 per radian of 1 mHz, and every
    # disturbance decays: nothing grows.
    law = get_law("elasto-plastic")(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6, lambda_=7e-7)
    slider = Slider(law, spring=np.full(1, 2e6), load=7.0, mass=1.6)
    flat, _ = flatten(
        checked_problem(slider, velocity=1e-6, epsilon=0.01, frequency=1e-3, inertia=True)
    )
    assert adiabatic_growth(flat)[0] == 0


def dense_cyclic(maps, right):
    """The periodic recurrence d_{i+1} - T_i d_i = r_i as one matrix."""
    n, _, count, points = maps.shape
    solution = np.zeros_like(right)
    for p in range(points):
        matrix = np.zeros((count, n, count, n))
        for i in range(count):
            matrix[i, :, (i + 1) % count] += np.eye(n)
            matrix[i, :, i] -= maps[:, :, i, p]
        flat = matrix.reshape(count * n, -1)
        solution[..., p] = np.linalg.solve(flat, right[..., p].T.ravel()).reshape(count, n).T
    return solution


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("count", [1, 2, 17])
def test_solve_cyclic_agrees_with_a_dense_solution(n, count):
    maps = normal(n, n, count, 6) + np.eye(n)[:, :, None, None]
    sides = normal(n, 2, count, 6, seed=8)
    solution = solve_cyclic(maps, sides)
    for k in range(2):
        expected = dense_cyclic(maps, sides[:, k])
        np.testing.assert_allclose(solution[:, k], expected, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_both_equations_of_a_bordered_system_hold(n):
    """Both equations hold, with one more unknown that the periodic recurrence alone leaves open."""
    maps = normal(n, n, 17, 6) + np.eye(n)[:, :, None, None]
    right, column, row = (normal(n, 17, 6, seed=seed) for seed in (8, 9, 10))
    corner, value = normal(2, 6, seed=11)
    d, p = map(np.asarray, solve_bordered(maps, right, cyclic.Border(column, row, corner, value)))
    after = np.roll(d, -1, axis=1) - np.einsum("ijmb,jmb->imb", maps, d)
    np.testing.assert_allclose(after, right + p * column, atol=1e-9 * np.abs(d).max())
    np.testing.assert_allclose((row * d).sum((0, 1)) + corner * p, value, atol=1e-9)


def test_solve_cyclic_where_one_direction_grows_and_another_decays():
    # 1e3 and 1e-3 an interval: the product of the maps is 1e120 and 1e-120, far beyond doubles.
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)[:, None] + np.array([0.0, 1.0])
    c, s = np.cos(turn), np.sin(turn)
    basis = np.array([[c, -s], [s, c]])
    stretch = np.diag([1e3, 1e-3])
    after = np.roll(basis, -1, axis=2)
    maps = np.einsum("ijmp,jk,lkmp->ilmp", after, stretch, basis)
    right = normal(2, 40, 2)
    solution = np.asarray(solve_cyclic(maps, right[:, None]))[:, 0]
    np.testing.assert_allclose(solution, dense_cyclic(maps, right), rtol=1e-9, atol=1e-12)
    assert np.abs(solution).max() < 100


#: Irregular on purpose. On a mesh that is a smooth map of an even one, quadratures of periodic
#: functions, hence mean, harmonics and multipliers, converge faster than any power.
COARSE = np.cumsum([0.0, 0.9, 1.4, 0.6, 1.1, 1.3, 0.7]) / 6.0 * 2 * np.pi


#: Parts that each interval of `COARSE` is cut into.
PARTS = 24


def split_mesh(parts):
    """Each interval of `COARSE` in so many parts, and the rest of `PARTS` without width.

    An interval without width changes nothing; with them all meshes share one program.
    """
    corners = np.repeat(np.arange((len(COARSE) - 1) * parts) / parts, PARTS // parts)
    return np.interp([*corners, len(COARSE) - 1], np.arange(len(COARSE)), COARSE)[
        :, None
    ] * np.ones(2)


def on_mesh(problem, mesh):
    """Mean, c1, c2, trace of the monodromy matrix and log of its determinant."""
    orbit = Orbit.empty(GAUSS, 2, len(mesh) - 1, 2)._replace(mesh=mesh)
    orbit = orbit._replace(centre=np.asarray(problem.system.steady()))
    result = solve(problem, orbit, 30)
    assert (result.error < ACCEPTED).all()
    read = read_orbit(problem, result.orbit, 2)
    trace = np.trace(read.monodromy) * np.exp(read.log_scale)
    return np.stack([read.mean_friction, *read.harmonics, trace, read.log_determinant])


def test_the_error_falls_with_the_order_of_the_method():
    # Gauss-Legendre collocation with s stages is of order 2s at the nodes, and so are quadratures.
    law = RiceRuina(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6)
    pair = np.ones(2)
    slider = jax.tree.map(lambda a: a * pair, Slider(law, spring=2e5, load=7.0))
    system = QuasiStatic(slider, np.array([1e-5, 2e-5]), 2 * np.pi * 120.0 * pair)
    problem = Problem(jax.tree.map(np.asarray, system), Harmonic(0.1 * pair))
    exact, *others = (np.asarray(on_mesh(problem, split_mesh(parts))) for parts in (PARTS, 4, 8))
    coarse, fine = (np.abs(other - exact) for other in others)
    # Next terms of the error: (h/radius of convergence)^2 of the leading one.
    np.testing.assert_allclose(np.log2(coarse / fine), 2 * STAGES, atol=0.5)


def polynomial_orbit(mesh, power):
    """Orbit whose two states are theta^power and 2 - theta, not periodic."""
    bare = Orbit(mesh, np.zeros((2, mesh.shape[1])), None, None, GAUSS)
    theta = bare.stage_phases
    nodes = np.stack([mesh[:-1] ** power, -mesh[:-1]])
    slopes = np.stack([power * theta ** (power - 1), -np.ones_like(theta)])
    return bare._replace(nodes=nodes, slopes=slopes)


THETA = np.sort(np.random.default_rng(7).uniform(0, 2 * np.pi, (40, 3)), axis=0)


def values(orbit):
    return evaluate(orbit, THETA)


@pytest.mark.parametrize("power", [1, 2, 4])
def test_evaluate_reproduces_polynomials_up_to_the_number_of_stages(power):
    mesh = graded_mesh(9, 3, 0.5)
    states, slopes = values(polynomial_orbit(mesh, power))
    np.testing.assert_allclose(states[0], THETA**power, rtol=EXACT, atol=EXACT)
    np.testing.assert_allclose(states[1], -THETA, atol=EXACT)
    np.testing.assert_allclose(slopes[0], power * THETA ** (power - 1), rtol=EXACT)


def test_one_power_more_is_no_longer_exact():
    mesh = graded_mesh(9, 3, 0.5)
    states, _ = values(polynomial_orbit(mesh, STAGES + 1))
    assert np.abs(states[0] - THETA ** (STAGES + 1)).max() > 1e-6


def test_stage_deviations_are_the_states_at_the_stages():
    orbit = polynomial_orbit(graded_mesh(9, 3, 0.5), 4)
    deviations, phases = orbit.stage_deviations, orbit.stage_phases
    np.testing.assert_allclose(deviations[0], phases**4, rtol=EXACT, atol=EXACT)
    assert phases.shape == (STAGES, 9, 3)
    np.testing.assert_allclose(phases[:, 0, 0], GAUSS.c * widths(orbit)[0, 0])


def widths(orbit):
    return np.diff(np.asarray(orbit.mesh), axis=0)


def test_split_cuts_every_interval_and_keeps_the_orbit():
    orbit = polynomial_orbit(graded_mesh(9, 3, 0.5), 4)
    finer = split(orbit, 3)
    np.testing.assert_allclose(widths(finer), np.repeat(widths(orbit), 3, axis=0) / 3, rtol=EXACT)
    for before, after in zip(values(orbit), values(finer), strict=True):
        np.testing.assert_allclose(after, before, rtol=EXACT, atol=EXACT)


def peaked_orbit(intervals):
    """A state that rises within 0.1 rad of theta = 4."""
    mesh = graded_mesh(intervals, 3, 0.0)
    bare = Orbit(mesh, np.zeros((1, 3)), None, None, GAUSS)
    nodes = np.arctan((mesh[:-1] - 4) / 0.1)[None]
    slopes = (0.1 / ((bare.stage_phases - 4) ** 2 + 0.01))[None]
    return bare._replace(nodes=nodes, slopes=slopes)


def test_equidistributed_keeps_a_polynomial_orbit():
    orbit = polynomial_orbit(graded_mesh(9, 3, 0.5), 4)
    for intervals in (9, 20):
        moved = equidistributed(orbit, np.ones((2, 9, 3)), intervals)
        ends = np.asarray(moved.mesh)[[0, -1]]
        np.testing.assert_array_equal(ends, [[0.0] * 3, [2 * np.pi] * 3])
        assert (widths(moved) > 0).all()
        for before, after in zip(values(orbit), values(moved), strict=True):
            np.testing.assert_allclose(after, before, rtol=EXACT, atol=EXACT)


def test_equidistributed_puts_intervals_where_the_orbit_is_steep():
    orbit = peaked_orbit(200)
    mesh = np.asarray(equidistributed(orbit, np.ones((1, 200, 3)), 60).mesh)[:, 0]
    inside = np.histogram(mesh, bins=[3.5, 4.5])[0][0]
    # Spread evenly there would be 60 / (2 pi), ten.
    assert inside > 20
    narrow = np.diff(mesh)[np.searchsorted(mesh, 4.0)]
    assert narrow < 0.2 * np.diff(mesh).max()


def test_scales_choose_the_state_that_matters():
    orbit = peaked_orbit(200)
    slopes = np.concatenate([orbit.slopes, orbit.slopes[:, ::-1, ::-1]])
    nodes = np.zeros((2, 200, 3))  # only slopes are used
    both = Orbit(orbit.mesh, np.zeros((2, 3)), nodes, slopes, GAUSS)
    for weights, at in (([1.0, 0.0], 4.0), ([0.0, 1.0], 2 * np.pi - 4.0)):
        scales = np.asarray(weights)[:, None, None] * np.ones((2, 200, 3))
        mesh = np.asarray(equidistributed(both, scales, 60).mesh)[:, 0]
        finest = mesh[np.argmin(np.diff(mesh))]
        assert finest == pytest.approx(at, abs=0.15)


def test_condensation_is_that_of_each_interval(monkeypatch):
    """Against the stage equations solved as one dense system, whether in blocks or at once."""
    n, intervals, sides = 3, 60, 2
    jacobian = 0.3 * normal(n, n, STAGES, intervals)
    right = normal(n, STAGES, sides, intervals, seed=8)
    widths = np.random.default_rng(9).uniform(0.2, 0.8, intervals)
    entries = STAGES * n * ((STAGES + 1) * n + sides)
    blocks = {}
    for name, at_a_time in (("whole", intervals), ("blocks", 20)):
        monkeypatch.setattr(equations, "_CACHED", at_a_time * entries)
        # A new function each time: the size of the blocks is a constant of the program.
        condense = jax.jit(lambda *inputs: equations.condense(*inputs))
        blocks[name] = jax.tree.map(np.asarray, condense(jacobian, right, widths, GAUSS.a))
    for m in (0, 27, 59):
        J, h = np.moveaxis(jacobian[..., m], 2, 0), widths[m]
        # Slopes k_j = J_j (y + h sum_l a_jl k_l) + r_j, ordered by stage and state.
        matrix = np.eye(STAGES * n) - h * np.einsum("jl,jnc->jnlc", GAUSS.a, J).reshape(
            STAGES * n, -1
        )
        sides_here = np.swapaxes(right[..., m], 0, 1).reshape(STAGES * n, -1)
        known = np.hstack([J.reshape(STAGES * n, n), sides_here])
        exact = np.linalg.solve(matrix, known).reshape(STAGES, n, -1)
        for response, constant in blocks.values():
            solution = np.concatenate([response[..., m], constant[..., m]], axis=2)
            np.testing.assert_allclose(np.swapaxes(solution, 0, 1), exact, rtol=1e-10, atol=1e-12)


def test_newton_keeps_to_the_plane_of_its_guess():
    """Along a line of parameters: <row, dX> + corner dt = 0, and the equations at the new t."""
    law = RiceRuina(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6)
    slider = jax.tree.map(lambda a: np.asarray(a) * np.ones(2), Slider(law, spring=2e5, load=7.0))
    system = QuasiStatic(slider, np.array([1e-5, 2e-5]), 2 * np.pi * 120.0 * np.ones(2))

    def line(t):
        return Problem(system, Harmonic(0.1 + 0.05 * t)), Problem(
            jax.tree.map(np.zeros_like, system), Harmonic(np.full(2, 0.05))
        )

    mesh = graded_mesh(PARTS, 2, 0.3)
    bare = Orbit.empty(GAUSS, 2, PARTS, 2)._replace(mesh=mesh)
    start = solve(line(np.zeros(2))[0], bare._replace(centre=np.asarray(system.steady())), 30).orbit
    row = normal(2, PARTS, 2)
    result = solve_in_plane(line, start, np.full(2, 0.1), Plane(row, np.ones(2)), max_steps=20)
    assert (result.error < ACCEPTED).all()
    moved = result.orbit.nodes + result.orbit.centre[:, None] - start.nodes - start.centre[:, None]
    distance = (row * moved).sum((0, 1)) + result.t - 0.1
    np.testing.assert_allclose(distance, 0.0, atol=1e-10)
    again = solve(line(result.t)[0], result.orbit, 3)
    np.testing.assert_allclose(again.orbit.nodes, result.orbit.nodes, atol=1e-10)


SLIDER = asp.Slider(
    ElastoPlastic(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6, lambda_=7e-7), spring=2e5, load=7.0
)
#: One batch, and so one program a method: all three and even; a load that is not; a pull alone.
LOADS = modulated(
    epsilon=0.1,
    load={2: ([0.03, 0.03, 0.0], [0.0, 0.5, 0.0])},
    tilt=np.radians([5.0, 0.0, 0.0]),
    pull=[0.2, 0.0, 0.2],
    pull_phase=[0.0, 0.0, 1.0],
)


def test_fourier_and_collocation_agree_for_loads_with_shear_and_pull():
    fast, robust = (
        asp.periodic_response(
            SLIDER,
            velocity=[[1e-6], [1e-5]],
            modulation=LOADS,
            frequency=120.0,
            methods=(method,),
            waveform=16,
        )
        for method in ("fourier", "collocation")
    )
    assert fast.converged.shape == (2, 3)
    assert fast.converged.all()
    assert robust.converged.all()
    np.testing.assert_allclose(fast.mean_friction, robust.mean_friction, rtol=1e-9)
    np.testing.assert_allclose(fast.harmonics[..., :2], robust.harmonics[..., :2], rtol=1e-8)
    np.testing.assert_allclose(fast.multipliers, robust.multipliers, rtol=1e-8)
    np.testing.assert_allclose(fast.waveform, robust.waveform, atol=1e-5)


def test_a_point_without_progress_is_abandoned_and_others_converge():
    # The load of the second point is not a number: no change is smaller than the one before.
    law = RiceRuina(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6)
    pair = np.ones(2)
    slider = jax.tree.map(lambda a: a * pair, Slider(law, spring=2e5, load=7.0))
    system = QuasiStatic(slider, 1e-5 * pair, 2 * np.pi * 120.0 * pair)
    problem = Problem(jax.tree.map(np.asarray, system), Harmonic(np.array([0.1, np.nan])))
    mesh = graded_mesh(72, 2, 0.5)
    orbit = Orbit.empty(GAUSS, 2, 72, 2)._replace(mesh=mesh)
    orbit = orbit._replace(centre=np.asarray(problem.system.steady()))
    result = solve(problem, orbit, 30, patience=3)
    assert result.error[0] < ACCEPTED
    assert not result.error[1] < ACCEPTED
    assert result.steps[1] == 3
    without = solve(problem, orbit, 30)
    np.testing.assert_array_equal(result.orbit.nodes[..., 0], without.orbit.nodes[..., 0])
    assert without.steps[1] == 30
