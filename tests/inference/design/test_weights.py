"""Optimal designs that are known in closed form, the textbook case, and whole readings."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.special import ndtr

from asperity.inference.design.criteria import Determinant, Misfit
from asperity.inference.design.rival import probability_of_deciding
from asperity.inference.design.weights import (
    even_grid,
    optimal_weights,
    times_fewer,
    whole_readings,
)

X = np.linspace(-1, 1, 41)
NO_PRIOR = np.zeros((0, 9))


def polynomial(degree, interest=None, x=X):
    """Readings of unit variance of a polynomial."""
    basis = x[:, None] ** np.arange(degree + 1)
    size = degree + 1
    return Determinant(basis[None, :, None], NO_PRIOR[:, :size], interest or range(size))


def weights_at(points, weights, x=X):
    whole = np.zeros(x.size)
    for point, weight in zip(points, weights, strict=True):
        whole[np.argmin(np.abs(x - point))] = weight
    return whole


@pytest.mark.parametrize(
    ("degree", "interest", "points", "weights"),
    [
        (1, None, (-1, 1), (1 / 2, 1 / 2)),
        (2, None, (-1, 0, 1), (1 / 3, 1 / 3, 1 / 3)),
        # Kiefer (1961): the coefficient of the highest power, by the extrema of Chebyshev's T_k.
        (2, [2], (-1, 0, 1), (1 / 4, 1 / 2, 1 / 4)),
        (3, [3], (-1, -0.5, 0.5, 1), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
        (1, [1], (-1, 1), (1 / 2, 1 / 2)),
    ],
)
def test_weights_are_those_of_the_closed_form(degree, interest, points, weights):
    criterion = polynomial(degree, interest)
    optimum, efficiency = optimal_weights(criterion, np.ones(X.size))
    np.testing.assert_allclose(optimum, weights_at(points, weights), atol=0.01)
    assert efficiency >= 0.999


def test_the_bound_of_the_equivalence_theorem_holds_and_is_reached_at_the_optimum_only():
    criterion = polynomial(2)
    best = criterion.value(weights_at((-1, 0, 1), (1 / 3, 1 / 3, 1 / 3)))
    drawn = np.random.default_rng(0).dirichlet(np.full(X.size, 0.3), size=50)
    for weights in drawn:
        slope = criterion.gradient(weights)
        # Without a prior the mean derivative is the number of parameters.
        assert weights @ slope == pytest.approx(3, rel=1e-6)
        efficiency = np.exp((criterion.value(weights) - best) / 3)
        assert criterion.least_efficiency(weights, slope) <= efficiency < 1


def drawn(seed, *, misfit=False):
    """A criterion of 60 candidates with three observables and five parameters of all sizes."""
    random = np.random.default_rng(seed)
    jacobian = random.normal(size=(4, 60, 3, 5)) * 10 ** random.uniform(-2, 2, 5)
    prior = np.diag(10 ** random.uniform(-1, 3, 5))[:2]
    if misfit:
        residual = 300 * random.normal(size=(60, 3))
        return Misfit(residual, jacobian[0], random.normal(size=2), prior)
    return Determinant(jacobian, prior, [3, 1])


@pytest.mark.parametrize("misfit", [False, True])
def test_derivatives_are_those_of_the_value(misfit):
    criterion, random = drawn(1, misfit=misfit), np.random.default_rng(1)
    n, change = random.uniform(0.5, 2, 60), random.normal(size=60)
    at = np.arange(60)

    def along(step):
        return criterion.value(n + step * change)

    step = 1e-3
    slope = (along(step) - along(-step)) / (2 * step)
    assert criterion.gradient(n) @ change == pytest.approx(slope, rel=1e-4)
    curvature = (along(step) - 2 * along(0) + along(-step)) / step**2
    matrix, target = criterion.second_order(n, at)
    assert np.sum((matrix @ change) ** 2) == pytest.approx(-curvature, rel=1e-4)
    np.testing.assert_allclose((target - matrix @ n) @ matrix, criterion.gradient(n), rtol=1e-9)
    one_more = n + (at == 7)
    assert criterion.exchanged(n)[7] == pytest.approx(criterion.value(one_more), rel=1e-9)


@pytest.mark.parametrize("misfit", [False, True])
def test_weights_reach_the_efficiency_of_the_bound(misfit):
    """A large chi-squared, and priors that are stronger than the readings."""
    for seed in range(10):
        criterion = drawn(seed, misfit=misfit)
        weights, efficiency = optimal_weights(criterion, np.full(60, 20.0))
        assert efficiency >= 0.999
        slope = 20 * criterion.gradient(20 * weights)
        assert criterion.least_efficiency(weights, slope) >= 0.999
        assert weights.sum() == pytest.approx(1)


def test_cost_of_readings_moves_weight_to_the_dear_points():
    # Slope of a line: c1/w1 + c2/w2, its variance, is smallest with weights as roots of the costs.
    criterion = polynomial(1, [1], np.array([-1.0, 1.0]))
    cost = np.array([1.0, 9.0])
    weights, _ = optimal_weights(criterion, 1000 / cost)
    np.testing.assert_allclose(weights, [0.25, 0.75], atol=0.01)


def textbook(x):
    """Atkinson and Fedorov (1975): 4.5 - 1.5 exp x - 2 exp(-x) against a parabola on [-1, 1]."""
    truth = 4.5 - 1.5 * np.exp(x) - 2 * np.exp(-x)
    basis = x[:, None] ** np.arange(3)
    return Misfit(-truth[:, None], basis[:, None, :], np.zeros(0), NO_PRIOR[:, :3]), truth, basis


def test_textbook_case_of_two_laws():
    x = np.linspace(-1, 1, 2001)
    criterion, truth, basis = textbook(x)
    optimum, _ = optimal_weights(criterion, np.ones(x.size))
    support = np.flatnonzero(optimum > 0.005)
    groups = np.split(support, np.flatnonzero(np.diff(support) > 20) + 1)
    weights = [optimum[g].sum() for g in groups]
    centres = [optimum[g] @ x[g] / optimum[g].sum() for g in groups]
    np.testing.assert_allclose(centres, [-1, -0.669, 0.144, 0.957], atol=0.01)
    np.testing.assert_allclose(weights, [0.253, 0.428, 0.247, 0.072], atol=0.01)
    # The square of the best uniform approximation by a parabola, a linear programme.
    ones = np.ones((x.size, 1))
    best = linprog(
        [0, 0, 0, 1],
        A_ub=np.vstack([np.hstack([basis, -ones]), np.hstack([-basis, -ones])]),
        b_ub=np.concatenate([truth, -truth]),
        bounds=[(None, None)] * 3 + [(0, None)],
    )
    assert np.exp(criterion.value(optimum)) == pytest.approx(best.fun**2, rel=2e-3)
    assert best.fun**2 == pytest.approx(1.087e-3, rel=1e-3)


def test_whole_readings_are_the_best_of_all():
    x = np.linspace(-1, 1, 5)
    criterion = polynomial(2, [2], x)
    for total in (4, 6, 7):
        weights, _ = optimal_weights(criterion, np.full(5, float(total)))
        n = whole_readings(criterion, np.ones(5), total, weights)
        assert n.sum() == total
        every = np.array(list(np.ndindex(*[total + 1] * 5)))
        every = every[every.sum(1) == total]
        best = max(criterion.value(m.astype(float)) for m in every)
        assert criterion.value(n.astype(float)) == pytest.approx(best, rel=1e-9)


def test_whole_readings_keep_within_the_time():
    cost = np.linspace(1, 7, X.size)
    criterion = polynomial(2)
    weights, _ = optimal_weights(criterion, 40 / cost)
    n = whole_readings(criterion, cost, 40, weights)
    assert 40 - cost.min() < n @ cost <= 40


def test_even_grid_of_a_line_needs_nine_fifths_of_the_readings():
    x = np.linspace(-1, 1, 7)
    criterion = polynomial(1, [1], x)
    cost = np.ones(7)
    grid = even_grid((7,), np.arange(7), cost, 4)
    np.testing.assert_array_equal(x[grid.rows], [-1, *x[[2, 4]], 1])
    design = np.array([2.0, 0, 0, 0, 0, 0, 2.0])
    # Mean square of -1, -1/3, 1/3, 1 is 5/9.
    assert times_fewer(criterion, grid.readings(cost, 4), criterion.value(design)) == pytest.approx(
        9 / 5, rel=1e-5
    )


@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_a_rival_that_gives_the_same_readings_has_no_misfit(shift):
    """Its residuals are zero, or vanish when its parameters are fitted."""
    jacobian = np.random.default_rng(0).normal(size=(9, 2, 2))
    residual = jacobian @ np.full(2, shift)
    criterion = Misfit(residual, jacobian, np.zeros(0), np.zeros((0, 2)))
    for n in (np.ones(9), np.eye(9)[0]):
        assert np.exp(criterion.value(n)) < 1e-9
        assert np.exp(criterion.exchanged(n)).max() < 1e-9
    weights, _ = optimal_weights(criterion, np.full(9, 10.0))
    assert weights.sum() == pytest.approx(1)


def test_readings_that_do_not_determine_a_parameter_have_a_finite_criterion():
    """Readings that all have the derivatives (1, 1, 1), and no readings at all."""
    criterion = Determinant(np.ones((1, 1, 1, 3)), NO_PRIOR[:, :3], [0])
    for n in (np.array([1e12]), np.zeros(1)):
        # The variance is that of the ridge alone.
        assert -30 < criterion.value(n) < -20
        assert np.isfinite(criterion.exchanged(n)).all()


@pytest.mark.parametrize(("readings", "probability"), [(4.0, 0.0), (5.0, 1.0)])
def test_a_rival_without_an_aicc_is_not_excluded(readings, probability):
    """Three parameters need five data; residuals of 1,000 exclude the rival then."""
    law = Misfit(np.zeros((1, 1)), np.ones((1, 1, 1)), np.zeros(0), NO_PRIOR[:, :1])
    rival = Misfit(np.full((1, 1), 1e3), np.zeros((1, 1, 3)), np.zeros(0), NO_PRIOR[:, :3])
    assert probability_of_deciding(law, rival, np.array([readings]), 0) == probability


def test_priors_count_in_the_probability_of_deciding_as_in_a_fit():
    """Nine readings of a constant: the rival fixes it to a third of 4 standard errors less.

    A parameter with a tight prior is a fixed number: the difference of chi-squared is 16 - 8 z.
    """

    def constant(value, jacobian, prior):
        misfit = np.full((9, 1), value)
        jacobian, prior = np.full((9, 1, 1), jacobian), np.full((1, 1), prior)
        return Misfit(misfit, jacobian, np.zeros(1), prior)

    law, n = constant(0.0, 1.0, 1e6), np.ones(9)
    # Without a prior the parameter of the rival, which has no influence, counts 2 + 4/7 in AICc.
    for prior, penalty in ((1e6, 0.0), (0.0, 2 + 4 / 7)):
        probability = probability_of_deciding(law, constant(4 / 3, 0.0, prior), n, 0, [True])
        expected = ndtr((16 + penalty - 10) / 8)
        assert probability == pytest.approx(expected, abs=0.01)
    assert probability_of_deciding(law, law, n, 0, [True]) == 0
