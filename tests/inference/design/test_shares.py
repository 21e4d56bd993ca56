"""Optimal designs that are known in closed form, the textbook case, and whole readings."""

import numpy as np
import pytest
from scipy.optimize import linprog

from asperity.inference.design.rival import probability_of_deciding
from asperity.inference.design.shares import (
    Determinant,
    Misfit,
    even_grid,
    optimal_shares,
    times_fewer,
    whole_readings,
)

X = np.linspace(-1, 1, 41)


def polynomial(degree, interest=None, x=X):
    """Information of one reading of unit variance of a polynomial."""
    basis = x[:, None] ** np.arange(degree + 1)
    information = np.einsum("ip,iq->ipq", basis, basis)[None]
    size = degree + 1
    return Determinant(information, np.zeros((1, size, size)), interest or range(size))


def shares_at(points, shares, x=X):
    whole = np.zeros(x.size)
    for point, share in zip(points, shares, strict=True):
        whole[np.argmin(np.abs(x - point))] = share
    return whole


@pytest.mark.parametrize(
    ("degree", "interest", "points", "shares"),
    [
        (1, None, (-1, 1), (1 / 2, 1 / 2)),
        (2, None, (-1, 0, 1), (1 / 3, 1 / 3, 1 / 3)),
        # Kiefer (1961): the coefficient of the highest power, by the extrema of Chebyshev's T_k.
        (2, [2], (-1, 0, 1), (1 / 4, 1 / 2, 1 / 4)),
        (3, [3], (-1, -0.5, 0.5, 1), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
        (1, [1], (-1, 1), (1 / 2, 1 / 2)),
    ],
)
def test_shares_are_those_of_the_closed_form(degree, interest, points, shares):
    criterion = polynomial(degree, interest)
    optimum = optimal_shares(criterion, np.ones(X.size))
    np.testing.assert_allclose(optimum.shares, shares_at(points, shares), atol=0.01)
    assert optimum.efficiency >= 0.999


def test_the_bound_of_the_equivalence_theorem_holds_and_is_reached_at_the_optimum_only():
    criterion = polynomial(2)
    best = criterion.value(shares_at((-1, 0, 1), (1 / 3, 1 / 3, 1 / 3)))
    drawn = np.random.default_rng(0).dirichlet(np.full(X.size, 0.3), size=50)
    for shares in drawn:
        slope = criterion.gradient(shares)
        # Without a prior the mean derivative is the number of parameters.
        assert shares @ slope == pytest.approx(3, rel=1e-6)
        bound = criterion.least_efficiency(slope.max() - 3, criterion.value(shares))
        efficiency = np.exp((criterion.value(shares) - best) / 3)
        assert bound <= efficiency < 1


def test_derivatives_are_those_of_the_value():
    n = np.random.default_rng(1).uniform(0.5, 2, X.size)
    draws = np.concatenate([polynomial(2).information, 3 * polynomial(2).information])
    for criterion in (
        Determinant(draws, np.zeros((2, 3, 3)), [1]),
        textbook(X)[0],
    ):
        # Round-off of the sum of squares, 31, over the step is 1e-10; the derivative is 9e-4.
        step = 1e-4
        i = 7
        more, less = n.copy(), n.copy()
        more[i] += step
        less[i] -= step
        expected = (criterion.value(more) - criterion.value(less)) / (2 * step)
        assert criterion.gradient(n)[i] == pytest.approx(expected, rel=1e-6)
        one_more = n.copy()
        one_more[i] += 1
        assert criterion.exchanged(n)[i] == pytest.approx(criterion.value(one_more), rel=1e-9)


def test_cost_of_readings_moves_shares_to_the_dear_points():
    # Slope of a line: the variance c1/w1 + c2/w2 is smallest with shares as the roots of the costs.
    criterion = polynomial(1, [1], np.array([-1.0, 1.0]))
    cost = np.array([1.0, 9.0])
    optimum = optimal_shares(criterion, 1000 / cost)
    np.testing.assert_allclose(optimum.shares, [0.25, 0.75], atol=0.01)


def textbook(x):
    """Atkinson and Fedorov (1975): 4.5 - 1.5 exp x - 2 exp(-x) against a parabola on [-1, 1]."""
    truth = 4.5 - 1.5 * np.exp(x) - 2 * np.exp(-x)
    basis = x[:, None] ** np.arange(3)
    return Misfit(-truth[:, None], basis[:, None, :], np.zeros(0), np.zeros((0, 3))), truth, basis


def test_textbook_case_of_two_laws():
    x = np.linspace(-1, 1, 2001)
    criterion, truth, basis = textbook(x)
    optimum = optimal_shares(criterion, np.ones(x.size))
    support = np.flatnonzero(optimum.shares > 0.005)
    groups = np.split(support, np.flatnonzero(np.diff(support) > 20) + 1)
    shares = [optimum.shares[g].sum() for g in groups]
    centres = [optimum.shares[g] @ x[g] / optimum.shares[g].sum() for g in groups]
    np.testing.assert_allclose(centres, [-1, -0.669, 0.144, 0.957], atol=0.01)
    np.testing.assert_allclose(shares, [0.253, 0.428, 0.247, 0.072], atol=0.01)
    # The square of the best uniform approximation by a parabola, a linear programme.
    ones = np.ones((x.size, 1))
    best = linprog(
        [0, 0, 0, 1],
        A_ub=np.vstack([np.hstack([basis, -ones]), np.hstack([-basis, -ones])]),
        b_ub=np.concatenate([truth, -truth]),
        bounds=[(None, None)] * 3 + [(0, None)],
    )
    assert criterion.value(optimum.shares) == pytest.approx(best.fun**2, rel=2e-3)
    assert best.fun**2 == pytest.approx(1.087e-3, rel=1e-3)


def test_whole_readings_are_the_best_of_all():
    x = np.linspace(-1, 1, 5)
    criterion = polynomial(2, [2], x)
    for total in (4, 6, 7):
        shares = optimal_shares(criterion, np.full(5, float(total))).shares
        n = whole_readings(criterion, np.ones(5), total, shares)
        assert n.sum() == total
        every = np.array(list(np.ndindex(*[total + 1] * 5)))
        every = every[every.sum(1) == total]
        best = max(criterion.value(m.astype(float)) for m in every)
        assert criterion.value(n.astype(float)) == pytest.approx(best, rel=1e-9)


def test_whole_readings_keep_within_the_time():
    cost = np.linspace(1, 7, X.size)
    criterion = polynomial(2)
    shares = optimal_shares(criterion, 40 / cost).shares
    n = whole_readings(criterion, cost, 40, shares)
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
        assert 0 <= criterion.value(n) < 1e-9
        np.testing.assert_allclose(criterion.gradient(n), 0, atol=1e-9)
        np.testing.assert_allclose(criterion.exchanged(n), 0, atol=1e-9)


def test_a_criterion_of_singular_information_is_minus_infinity():
    """Readings that all have the derivatives (1, 1, 1) determine no parameter."""
    information = np.ones((1, 1, 3, 3))
    criterion = Determinant(information, np.zeros((1, 3, 3)), [0])
    assert criterion.value(np.array([1e12])) == -np.inf
    assert criterion.exchanged(np.array([1e12])) == -np.inf


@pytest.mark.parametrize(("readings", "probability"), [(4.0, 0.0), (5.0, 1.0)])
def test_a_rival_without_an_aicc_is_not_excluded(readings, probability):
    """Three parameters need five data; residuals of 1,000 exclude the rival then."""
    law, rival = np.ones((1, 1, 1)), np.zeros((1, 1, 3))
    misfit = Misfit(np.full((1, 1), 1e3), rival, np.zeros(0), np.zeros((0, 3)))
    assert probability_of_deciding(law, misfit, np.array([readings]), 0) == probability
