"""The search for minima of chi-squared, on residuals in closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest

from asperity.inference.fitting import minima
from asperity.inference.fitting.description import described_fit
from asperity.inference.fitting.estimated_noise import with_noise
from asperity.inference.fitting.fit import with_estimated_errors
from asperity.inference.fitting.minima import extends, minima_of
from asperity.inference.fitting.profile_likelihood import Profile
from asperity.inference.levenberg_marquardt import minimised
from asperity.inference.objective import Minimum, Objective, Residuals
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.table import LockInTable
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import Prior, unknowns_of
from asperity.laws import get_law

LAW = get_law("rice-ruina")


class Formula(LockInTerm):
    """Residuals that are a function of ln D0, in place of those of orbits.

    `values` gives residuals and their derivatives; above `edge` only the robust method has orbits.
    """

    def __init__(self, values, edge=math.inf):
        self.values, self.edge, self.searching = values, edge, False

    name, observables, noise = "formula", ("mu1",), {"model": "none", "effective_samples": 1}

    @property
    def searches(self):
        return self.searching

    def coarser(self, *, partly=True):
        return self

    smoother = coarser

    def use_search(self, always):
        self.searching = always

    def thinned(self, rows, data=0):
        return None

    def chi2_of_many(self, values, *, near=False, least=1.0):
        residuals = [self.residuals(v) for v in values]
        return np.array([math.inf if r is None else np.sum(r.values**2) for r in residuals])

    def warnings(self, residuals, information, outliers=()):
        return []

    def instability(self, values):
        return []

    def reversal(self, values):
        return []

    def weighted(self, weights):
        return Weighted(self, weights)

    def residuals(self, values):
        x = math.log(values["D0"])
        if x > self.edge and not self.searching:
            return None
        r, slope = self.values(x)
        n = r.size
        return Residuals(
            r, (slope / values["D0"])[:, None], np.full(n, "mu1"), np.arange(n), log_scale=0.0
        )


class Weighted(Formula):
    """Residuals of another term, each multiplied by the weight of its row."""

    def __init__(self, term, weights):
        self.term, self.factors = term, weights

    def residuals(self, values):
        residuals = self.term.residuals(values)
        if residuals is None:
            return None
        w = self.factors[residuals.row]
        return residuals._replace(
            values=w * residuals.values, jacobian=w[:, None] * residuals.jacobian
        )


def objective_of(values, start, edge=math.inf):
    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={"D0": start}, priors={})
    return Objective((Formula(values, edge),), LAW, unknowns, {})


#: Minima of equal depth, in ln D0, and the slope of the residual there.
FIRST, SECOND, SLOPE = math.log(1e-6), math.log(4e-6), 8.0


def two_minima(x):
    """One residual that is zero twice, and 99 constant ones: chi-squared is 99 at its minima."""
    gap = SECOND - FIRST
    r, slope = np.ones(100), np.zeros(100)
    r[0] = SLOPE * (x - FIRST) * (x - SECOND) / gap
    slope[0] = SLOPE * (2 * x - FIRST - SECOND) / gap
    return r, slope


def test_a_minimum_that_is_not_reached_again_still_widens_intervals():
    objective = objective_of(two_minima, 1e-6, edge=(FIRST + SECOND) / 2)
    minima = [(np.array([x]), 99.0) for x in (FIRST, SECOND)]
    assert not np.isfinite(objective.residuals(minima[1][0])[1]).all()
    result = described_fit(objective, minima, profile=False)
    low, high = result.parameters["D0"].interval_95
    assert low < 1e-6
    assert high == pytest.approx(4e-6)


def test_an_interval_up_to_the_bound_of_the_search_is_open():
    """Chi-squared rises to 3.7, below the limit of 3.84, and the bound lowers the limit near it."""

    def plateau(x):
        r, slope = np.ones(100), np.zeros(100)
        height, rate = math.sqrt(3.7), 1.0
        r[0] = height * -math.expm1(-rate * (x - FIRST))
        slope[0] = height * rate * math.exp(-rate * (x - FIRST))
        return r, slope

    objective = objective_of(plateau, 1e-6)
    result = described_fit(objective, minima_of(objective, 0), profile=False)
    low, high = result.parameters["D0"].interval_95
    assert high == math.inf
    # There the residual is -1.96.
    assert math.log(low) - FIRST == pytest.approx(-math.log1p(1.96 / math.sqrt(3.7)), abs=0.01)


def test_an_estimate_far_from_its_bounds_is_not_at_a_bound_for_want_of_data():
    def blind(x):
        r, slope = np.ones(100), np.zeros(100)
        slope[0] = 1e-6
        r[0] = slope[0] * (x - FIRST)
        return r, slope

    result = described_fit(objective_of(blind, 1e-6), [(np.array([FIRST]), 99.0)], profile=False)
    assert result.undetermined == ("D0",)
    assert not result.parameters["D0"].at_bound
    assert not any("at its bound" in w for w in result.warnings)


def test_both_minima_are_found_and_intervals_span_them():
    objective = objective_of(two_minima, 5e-7)
    result = described_fit(objective, minima_of(objective, 0), profile=False)
    (other,) = result.optima
    pair = sorted([result.values["D0"], other.values["D0"]])
    np.testing.assert_allclose(np.log(pair), [FIRST, SECOND], atol=1e-6)
    low, high = result.parameters["D0"].interval_95
    # The standard error is 1/SLOPE at each minimum.
    assert math.log(low) == pytest.approx(FIRST - 1.96 / SLOPE, abs=0.02)
    assert math.log(high) == pytest.approx(SECOND + 1.96 / SLOPE, abs=0.02)
    assert any("another minimum" in w and "D0" in w for w in result.warnings)


@pytest.mark.parametrize("unstable", [FIRST, SECOND])
def test_a_minimum_with_a_stable_response_comes_before_an_equal_one_without(unstable, monkeypatch):
    """Also if chi-squared is lower by 4 where the response is unstable, but not by 16."""

    def instability(self, values):
        return ["unstable"] if abs(math.log(values["D0"]) - unstable) < 0.3 else []

    monkeypatch.setattr(Formula, "instability", instability)
    stable = FIRST + SECOND - unstable
    for rise, expected in ((0.0, stable), (4.0, stable), (16.0, unstable)):

        def values(x, rise=rise):
            r, slope = two_minima(x)
            # The square of a residual is lower by `rise` at the unstable minimum.
            well = rise * math.exp(-((x - unstable) ** 2) / 0.18)
            r[1] = math.sqrt(25.0 + rise - well)
            slope[1] = well * (x - unstable) / 0.09 / r[1]
            return r, slope

        objective = objective_of(values, 1.8e-6)
        result = described_fit(objective, minima_of(objective, 0), profile=False)
        assert math.log(result.values["D0"]) == pytest.approx(expected, abs=0.1)
        assert ("unstable" in result.warnings) == (expected == unstable)
        if expected == stable:
            assert not result.optima
        low, high = np.log(result.parameters["D0"].interval_68)
        assert low < expected < high
        assert not low < FIRST + SECOND - expected < high


def test_a_narrow_minimum_at_another_memory_length_is_found():
    """Random starts have lower chi-squared at the wide minimum, which describes the data too."""
    narrow = FIRST + math.log(10.0) + 0.1

    def values(x):
        r, slope = np.ones(100), np.zeros(100)
        rise = math.exp(4 * (x - FIRST - 1.3))
        product = SLOPE * (x - FIRST) * (x - narrow) / (narrow - FIRST)
        derivative = SLOPE * (2 * x - FIRST - narrow) / (narrow - FIRST)
        r[0] = product * (1 + rise)
        slope[0] = derivative * (1 + rise) + 4 * product * rise
        return r, slope

    objective = objective_of(values, 5e-7)
    result = described_fit(objective, minima_of(objective, 0), profile=False)
    (other,) = result.optima
    pair = sorted([result.values["D0"], other.values["D0"]])
    np.testing.assert_allclose(np.log(pair), [FIRST, narrow], atol=1e-6)
    low, high = np.log(result.parameters["D0"].interval_95)
    assert low < FIRST
    assert high > narrow


def one_minimum(x):
    r, slope = np.ones(100), np.zeros(100)
    r[0], slope[0] = SLOPE * (x - FIRST), SLOPE
    return r, slope


def test_a_minimum_beyond_the_fast_method_is_found():
    # At the edge chi-squared is 4 above its minimum of 99, where its probability is hardly lower.
    objective = objective_of(one_minimum, 3e-7, edge=FIRST - 2 / SLOPE)
    result = described_fit(objective, minima_of(objective, 0), profile=False)
    assert math.log(result.values["D0"]) == pytest.approx(FIRST, abs=1e-6)
    assert not result.optima


def test_a_profile_continues_where_the_fast_method_ends():
    objective = objective_of(one_minimum, 1e-6, edge=FIRST + 1 / SLOPE)
    u, chi2 = objective.minimise(np.array([FIRST]))
    covariance = np.array([[SLOPE**-2]])
    open_end = Profile(objective, 0, u, chi2, covariance, search=False).interval(0.95)
    assert open_end[1] == math.inf
    closed = Profile(objective, 0, u, chi2, covariance, search=True).interval(0.95)
    np.testing.assert_allclose(closed, FIRST + 1.96 / SLOPE * np.array([-1, 1]), atol=0.003)


class Ending(Formula):
    """Residuals without an orbit above `edge`, whatever the method."""

    def residuals(self, values):
        return None if math.log(values["D0"]) > self.edge else super().residuals(values)


@pytest.mark.parametrize(("slope", "profiled"), [(SLOPE, True), (12.0, False)])
def test_intervals_contain_an_estimate_at_the_end_of_the_orbits(slope, profiled):
    """Where the law has no orbit beyond the estimate, the parabola's minimum lies there too."""

    def values(x):
        r, slopes = np.ones(100), np.zeros(100)
        r[0], slopes[0] = slope * (x - FIRST), slope
        return r, slopes

    objective = objective_of(values, 3e-7)
    # Four standard errors before the minimum, beyond the reach of the intervals about it.
    end = FIRST - 4 / slope
    objective = replace(objective, terms=(Ending(values, end),))
    stopped = objective.minimise(np.array([math.log(3e-7)]))
    result = described_fit(objective, [stopped], profile=False)
    assert any("still falls where the law has no periodic orbit" in w for w in result.warnings)
    (p,) = result.parameters.values()
    assert math.log(p.value) == pytest.approx(end, abs=1e-3)
    assert p.interval_95[0] <= p.interval_68[0] < p.value <= p.interval_68[1] <= p.interval_95[1]
    # With the steep slope no profile is tried and the interval is the whole range.
    assert (p.interval_68 == (0.0, math.inf)) != profiled


def test_progress_counts_the_starts_that_are_minimised():
    calls = []
    minima_of(objective_of(one_minimum, 1e-6), 0, lambda done, total: calls.append((done, total)))
    total = calls[-1][1]
    assert calls == [(done, total) for done in range(total + 1)]


class TwoNoises(RunTerm):
    """A recording of two halves, each with noise of the size of its residuals.

    Residuals are of size 1 and 2 at FIRST, of size 10 and 1 at SECOND.
    """

    name, observables, profiled = "halves", ("friction",), 2

    def __init__(self, half=50):
        self.half, self.sizes = half, np.ones(2)

    def _raw(self, x):
        rate = 0.5 * math.pi / (SECOND - FIRST)
        share, slope = math.sin(rate * (x - FIRST)) ** 2, rate * math.sin(2 * rate * (x - FIRST))
        return np.array([1 + 9 * share, 2 - share]), np.array([9 * slope, -slope])

    def residuals(self, values):
        r, slope = (np.repeat(v / self.sizes, self.half) for v in self._raw(math.log(values["D0"])))
        scale = self.half * float(np.log(self.sizes).sum())
        names, rows = np.full(r.size, "friction"), np.arange(r.size)
        return Residuals(r, (slope / values["D0"])[:, None], names, rows, scale)

    def update_noise(self, values):
        self.sizes = self._raw(math.log(values["D0"]))[0]
        return True


def test_minima_of_recordings_are_compared_each_with_its_own_noise():
    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={"D0": 1e-6}, priors={})
    term = TwoNoises()
    objective = Objective((term,), LAW, unknowns, {})
    near = [(np.array([SECOND - 0.02]), 1.0), (np.array([FIRST + 0.02]), 2.0)]
    (best, chi2), (second, above) = with_noise(objective, near, objective)[0]
    (term,) = objective.terms
    # With the noise of SECOND, FIRST is a maximum of chi-squared, yet its likelihood is higher.
    np.testing.assert_allclose([best[0], second[0]], [FIRST, SECOND], atol=1e-3)
    assert above - chi2 == pytest.approx(2 * term.half * math.log(5), rel=1e-3)
    # The noise is that at the best minimum.
    np.testing.assert_allclose(term.sizes, [1, 2], atol=0.01)
    assert chi2 == pytest.approx(2 * term.half, rel=0.01)


def test_the_search_leaves_a_wrong_minimum_where_the_fast_method_ends():
    shallow, deep = math.log(1.1e-7), math.log(3e-6)

    def values(x):
        # chi-squared is 1e4 or more in the range of the fast method, and 99 at `deep`.
        r, slope = np.ones(100), np.zeros(100)
        gap = deep - shallow
        phase = math.pi * (x - shallow) / gap
        r[0] = 60 * (1 + math.cos(phase)) + 5 * (x - deep)
        slope[0] = -60 * math.sin(phase) * math.pi / gap + 5
        return r, slope

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={}, priors={})
    # The fast method reaches two of 64 starts between 1e-7 and 2e-5 m.
    edge = math.log(1e-7) + math.log(200) * 2 / 64
    objective = Objective((Formula(values, edge),), LAW, unknowns, {})
    u, chi2 = minima_of(objective, 0)[0]
    assert u[0] == pytest.approx(deep, abs=0.2)
    assert chi2 == pytest.approx(99, abs=0.01)


def test_a_start_near_zero_is_not_taken_for_the_scale():
    law = get_law("linker-dieterich")
    (alpha,) = unknowns_of(law, ["alpha"], largest_epsilon=0.5, start={"alpha": 1e-300}, priors={})
    low, high = (float(alpha.to_coordinate(v)) for v in alpha.start)
    assert 0 <= low < high < 1e6
    assert alpha.to_value(np.array(high)) == pytest.approx(alpha.start[1])


def test_a_narrow_minimum_next_to_a_wide_excluded_one_is_found():
    deep, size = FIRST - 0.75, 3.0

    def values(x):
        r, slope = np.ones(100), np.zeros(100)
        if abs(x - deep) < 0.3:
            # At the nearest of 64 starts chi-squared is higher than at all starts near FIRST.
            r[0], slope[0] = 1000 * (x - deep), 1000.0
        else:
            r[1:], r[0], slope[0] = size, 5 * (x - FIRST), 5.0
        return r, slope

    objective = objective_of(values, 1e-6)
    (u, chi2), *_ = minima_of(objective, 0)
    assert u[0] == pytest.approx(deep, abs=1e-5)
    assert chi2 == pytest.approx(99, abs=1e-6)
    # From the given start the wide minimum is reached.
    (begin,) = objective.coordinates({"D0": 1e-6})
    assert objective.minimise(np.array([begin])).u[0] == pytest.approx(FIRST, abs=1e-3)


class PartlySolved(Formula):
    """Below `border` the fast method solves half of the rows, which are described at `wrong`."""

    least = 1.0

    def __init__(self, values, border, wrong, unsolved):
        super().__init__(values)
        self.border, self.wrong, self.unsolved = border, wrong, unsolved

    def residuals(self, values):
        result, x = super().residuals(values), math.log(values["D0"])
        if x > self.border:
            return result
        if self.least == 1 and not self.searching:
            return None
        r, slope = np.ones(100), np.zeros(100)
        r[0], slope[0] = 5 * (x - self.wrong), 5 / values["D0"]
        if self.least == 1:
            # The other half of the rows contradicts the law.
            r[50:] = self.unsolved
        return result._replace(values=r, jacobian=slope[:, None])


@pytest.mark.parametrize("unsolved", [30.0, 1.13])
def test_a_minimum_that_unsolved_rows_contradict_does_not_end_the_search(unsolved):
    """With the second number chi-squared is 113 for all rows, which has a probability of 0.16."""
    wrong, border, deep = FIRST, FIRST + 0.5, FIRST + 2.0

    def values(x):
        r, slope = np.full(100, 3.0), np.zeros(100)
        if abs(x - deep) < 0.3:
            r[1:], r[0], slope[0] = 1.0, 100 * (x - deep), 100.0
        else:
            r[0], slope[0] = 5 * (x - FIRST), 5.0
        return r, slope

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={"D0": 1e-6}, priors={})
    objective = Objective((PartlySolved(values, border, wrong, unsolved),), LAW, unknowns, {})
    partial = objective.partial()
    end = partial.minimise(objective.coordinates({"D0": 1e-6}))
    assert end.u[0] == pytest.approx(wrong, abs=1e-3)
    assert end.chi2 == pytest.approx(99, abs=1e-6)
    u, chi2 = minima_of(objective, 0)[0]
    assert u[0] == pytest.approx(deep, abs=1e-5)
    assert chi2 == pytest.approx(99, abs=1e-6)
    assert not objective.searches


class Edge(Formula):
    """Residuals of ln D0 and ln A, among orbits of the robust method.

    If one of the two coordinates is unchanged, orbits exist only within `step` of the last value
    of the other: most steps of a minimisation then fail, as they do along an edge of the orbits.
    """

    def __init__(self, values, step):
        super().__init__(values)
        self.searching, self.step, self.last = True, step, (math.nan, math.nan)

    def residuals(self, values):
        x, y = math.log(values["D0"]), math.log(values["A"])
        change = abs(x - self.last[0]), abs(y - self.last[1])
        if min(change) == 0 and max(change) > self.step:
            return None
        self.last = x, y
        r, slopes = self.values(x, y)
        jacobian = slopes / np.array([values["A"], values["D0"]])
        names, rows = np.full(r.size, "mu1"), np.arange(r.size)
        return Residuals(r, jacobian, names, rows, log_scale=0.0)


@pytest.mark.parametrize(("step", "profile"), [(math.inf, False), (1e-5, False), (1e-5, True)])
def test_profiles_along_an_edge_are_given_up_with_a_warning(step, profile):
    """Residuals are nonlinear in ln D0, with which ln A is correlated."""

    def values(x, y):
        r, slopes = np.ones(100), np.zeros((100, 2))
        curved = math.expm1(2 * (x - FIRST))
        r[0], slopes[0, 1] = 2 * curved, 4 * (curved + 1)
        r[1], slopes[1] = 20 * (y + 5) - 2 * curved, (20, -4 * (curved + 1))
        return r, slopes

    unknowns = unknowns_of(LAW, ["A", "D0"], largest_epsilon=0.5, start={"D0": 1e-6}, priors={})
    objective = Objective((Edge(values, step),), LAW, unknowns, {})
    result = described_fit(objective, [(np.array([-5.0, FIRST]), 98.0)], profile=profile)
    warnings = [w for w in result.warnings if "hardly has periodic orbits" in w]
    low, high = result.parameters["D0"].interval_95
    # 20 (ln A + 5) is the sum of two normal residuals of unit variance.
    normal = 1.96 * math.sqrt(2) / 20 * np.array([-1, 1])
    of_A = np.log(result.parameters["A"].interval_95) + 5
    if step < 1 and not profile:
        assert (low, high) == (0.0, math.inf)
        assert "intervals of D0 are the whole range" in warnings[0]
        assert "intervals of A are of the normal approximation" in warnings[0]
        np.testing.assert_allclose(of_A, normal, rtol=1e-3)
        return
    assert not warnings
    assert math.isfinite(high)
    assert low > 0
    if not profile:
        # 2 (exp(2 d) - 1) is 1.96 at the upper end and -1.96 at the lower.
        ends = np.log([low, high]) - FIRST
        np.testing.assert_allclose(ends, np.log([0.02, 1.98]) / 2, atol=0.02)
        np.testing.assert_allclose(of_A, normal, rtol=0.02)


@pytest.mark.parametrize(
    ("size", "searched", "doubted"),
    [(1.15, True, True), (1.15, False, False), (1.0, True, False), (3.0, True, False)],
)
def test_a_doubtful_minimum_of_the_robust_method_has_a_warning(size, searched, doubted):
    # A size of 1.15 has p = 0.02; one of 3 is excluded, which has another warning.
    def values(x):
        r, slope = np.full(100, size), np.zeros(100)
        r[0], slope[0] = 5 * (x - FIRST), 5.0
        return r, slope

    objective = objective_of(values, 1e-6)
    objective.terms[0].searching = searched
    result = described_fit(objective, [objective.minimise(np.array([FIRST]))], profile=False)
    assert any("a better minimum may lie" in w for w in result.warnings) == doubted


def test_a_minimum_without_orbits_is_replaced_by_the_next_with_a_warning():
    # The fast method ends between the two minima.
    objective = objective_of(two_minima, 1e-6, edge=(FIRST + SECOND) / 2)
    beyond = np.array([SECOND]), 98.0
    result = described_fit(objective, [beyond, (np.array([FIRST]), 99.0)], profile=False)
    assert result.converged
    assert result.values["D0"] == pytest.approx(1e-6)
    assert "a lower minimum, of chi-squared 98," in result.warnings[0]
    assert not described_fit(objective, [beyond], profile=False).converged


class Rows(Formula):
    """`Formula` with one residual for each row of a table; counts the rows that are computed.

    The residual of row i is `values(x)[i]`; the fast method finds no orbit.
    """

    def __init__(self, values, count, kept=None, computed=None):
        super().__init__(values, edge=-math.inf)
        self.kept = np.arange(count) if kept is None else kept
        self.computed = [] if computed is None else computed
        points = {n: np.arange(1.0, 1 + self.kept.size) for n in ("V", "epsilon", "frequency")}
        column = {"mu1": np.ones(self.kept.size)}
        self.table = LockInTable("rows", points, column, column)

    thinned = LockInTerm.thinned

    def with_rows(self, kept, coarse=False):
        part = Rows(self.values, 0, self.kept[kept], self.computed)
        part.searching = True
        return part

    def residuals(self, values):
        if not self.searching:
            return None
        r, slope = (v[self.kept] for v in self.values(math.log(values["D0"])))
        self.computed.append(r.size)
        names, rows = np.full(r.size, "mu1"), np.arange(r.size)
        return Residuals(r, (slope / values["D0"])[:, None], names, rows, log_scale=0.0)


def test_a_search_on_few_rows_leads_to_the_minimum_of_all():
    rows = 128
    scatter = np.random.default_rng(1).normal(size=rows)
    phase = 0.4 * np.arange(rows)

    def values(x):
        # The residual of each row is a sine of x with another phase: several minima, one low.
        r = 30 * (np.sin(2 * (x - FIRST) + phase) - np.sin(phase)) + scatter
        return r, 60 * np.cos(2 * (x - FIRST) + phase)

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={}, priors={})
    term = Rows(values, rows)
    objective = Objective((term,), LAW, unknowns, {})
    u, chi2 = minima_of(objective, 0)[0]
    exact = objective.minimise(np.array([FIRST]))
    assert (u[0] - FIRST) % math.pi == pytest.approx((exact[0][0] - FIRST) % math.pi, abs=1e-7)
    assert chi2 == pytest.approx(exact[1], rel=1e-9)
    # All rows are computed at the end only.
    assert sum(n == rows for n in term.computed) < 0.2 * len(term.computed)


def test_larger_uncertainties_that_the_law_contradicts_too_lead_to_no_further_minimisation(
    monkeypatch,
):
    """Nor do they a second time to the same minimum."""
    rows = 32

    def values(x):
        return np.full(rows, 60.0) + 5 * (x - FIRST), np.full(rows, 5.0)

    def minimisations(share):
        """Numbers of minimisations with larger uncertainties, and from their minima."""
        calls = []

        def smoother(self):
            part = Rows(lambda x: [share * v for v in values(x)], 0, self.kept)
            part.searching = part.smooth = True
            return part

        def counted(objective, start, evaluations=60, **options):
            calls.append(hasattr(objective.terms[0], "smooth"))
            return rough_minimum(objective, start, evaluations, **options)

        monkeypatch.setattr(Rows, "smoother", smoother)
        monkeypatch.setattr(minima, "_rough_minimum", counted)
        priors = {"D0": Prior(1e-6, 1e-8, "measured")}
        unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={}, priors=priors)
        minima_of(Objective((Rows(values, rows),), LAW, unknowns, {}), 0)
        return calls.count(True), calls.count(False)

    rough_minimum = minima._rough_minimum
    far_off, near = minimisations(0.5), minimisations(1e-3)
    assert far_off[0] == near[0] == 6
    assert near[1] == far_off[1] + 1


def test_the_given_start_is_minimised_even_if_four_rows_are_far_off_there():
    rows, start = 32, math.log(7e-7)
    four = np.isin(np.arange(rows), np.linspace(0, rows - 1, 4).round())

    def values(x):
        if abs(x - start) < 0.05:
            # The residuals of four rows are larger than elsewhere, the sum of all is smaller.
            r, slope = np.where(four, 100.0, 0.0), np.zeros(rows)
            r[1], slope[1] = 5 * (x - start), 5.0
        else:
            r, slope = np.where(four, 10.0, 60.0), np.zeros(rows)
            r[1], slope[1] = 5 * (x - FIRST), 5.0
        return r, slope

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={"D0": 7e-7}, priors={})
    u, chi2 = minima_of(Objective((Rows(values, rows),), LAW, unknowns, {}), 0)[0]
    assert u[0] == pytest.approx(start, abs=1e-3)
    assert chi2 == pytest.approx(4 * 100.0**2)


def test_starts_lie_within_a_prior_of_a_negative_number():
    priors = {"alpha": Prior(-0.1, 0.02, "measured")}
    (alpha,) = unknowns_of(get_law("linker-dieterich"), ["alpha"], start={}, priors=priors)
    np.testing.assert_allclose(alpha.start, (-0.16, -0.04))
    assert alpha.middle == pytest.approx(-0.1)


class Estimated(Formula):
    """Residuals of which all but the first are smaller next to SECOND, by errors of epsilon."""

    measured_epsilon, estimated = True, False

    def estimate_error(self, values):
        self.estimated = True

    def residuals(self, values):
        result, away = super().residuals(values), abs(math.log(values["D0"]) - SECOND)
        size = np.where(result.row > 0, 0.9 if self.estimated and away < 0.5 else 1.0, 1.0)
        return result._replace(values=size * result.values)


def test_errors_of_epsilon_may_turn_the_order_of_minima_around():
    objective = replace(objective_of(two_minima, 1e-6), terms=(Estimated(two_minima),))
    before = [Minimum(np.array([x]), 99.0) for x in (FIRST, SECOND)]
    best, other = with_estimated_errors(objective, before)
    assert best.u[0] == pytest.approx(SECOND, abs=1e-6)
    assert (best.chi2, other.chi2) == pytest.approx((99 * 0.81, 99))


class NarrowRows(Rows):
    """Rows of which one, `lonely`, has an orbit near `FIRST` only."""

    lonely = 5

    def with_rows(self, kept, coarse=False):
        part = NarrowRows(self.values, 0, self.kept[kept], self.computed)
        part.searching = True
        return part

    def residuals(self, values):
        near = abs(math.log(values["D0"]) - FIRST) < 0.05
        if self.lonely in self.kept and not near:
            return None
        return super().residuals(values)


def test_fits_of_simpler_laws_are_starts():
    def values(x):
        # Every third row has its minimum at another D0.
        r = 30 * (x - FIRST) * np.ones(96)
        r[::3] = 30 * (x - SECOND)
        return r, np.full(96, 30.0)

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={}, priors={})

    def minima(**options):
        objective = Objective((NarrowRows(values, 96),), LAW, unknowns, {})
        return minima_of(objective, 0, **options)

    assert minima(drawn=8) == []
    known = {"D0": math.exp(FIRST + 0.02), "lambda": 1e-6}
    (u, chi2), *_ = minima(drawn=8, simpler=[known])
    assert abs(u[0] - FIRST) < 0.05
    assert chi2 <= np.sum(values(FIRST + 0.02)[0] ** 2)


@pytest.mark.parametrize(
    ("law", "special", "expected"),
    [
        ("elasto-plastic", "rice-ruina", True),
        ("linker-dieterich", "rice-ruina", True),
        ("nagata", "rice-ruina", True),
        ("two-state", "ruina-slip", True),
        ("rice-ruina", "elasto-plastic", False),
        ("elasto-plastic", "linker-dieterich", False),
        ("ruina-slip", "rice-ruina", False),
    ],
)
def test_which_laws_extend_which(law, special, expected):
    assert extends(get_law(law), get_law(special)) is expected


@pytest.mark.parametrize("steepness", [1e2, 1e4])
def test_a_curved_valley_is_followed_in_few_steps(steepness):
    """Residuals (y - exp x) steepness, x - 3 from x = -1: the minimum is (3, e^3)."""
    calls = 0

    def residuals(u):
        nonlocal calls
        calls += 1
        x, y = u
        r = np.array([steepness * (y - np.exp(x)), x - 3.0])
        return r, np.array([[-steepness * np.exp(x), steepness], [1.0, 0.0]])

    low, high = np.full(2, -100.0), np.full(2, 100.0)
    end = minimised(residuals, np.array([-1.0, np.exp(-1.0)]), low, high, 200)
    # Decreases below 1e-4, a hundredth of a standard error, end the minimisation.
    assert end == pytest.approx([3.0, np.exp(3.0)], abs=0.011 * np.exp(3.0))
    assert calls < 120  # 992, and more than 2000, by steps that are straight lines


def test_a_minimisation_stays_within_bounds_and_where_residuals_exist():
    def residuals(u):
        r = np.array([u[0] + 2.0, u[1] - 1.0])
        return (r if u[1] < 1.5 else np.array([np.nan])), np.eye(2)

    end = minimised(
        residuals, np.array([5.0, 0.0]), np.array([1.0, -9.0]), np.array([9.0, 9.0]), 50
    )
    np.testing.assert_allclose(end, [1.0, 1.0], atol=0.01)
