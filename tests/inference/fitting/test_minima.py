"""Minima of residuals in closed form: several, in narrow valleys, beyond the fast method."""

import math
from dataclasses import replace

import numpy as np
import pytest

from asperity.inference.fitting.description import described_fit
from asperity.inference.fitting.estimated_noise import with_noise
from asperity.inference.fitting.intervals import Profile
from asperity.inference.fitting.minima import extends, minima_of
from asperity.inference.levenberg_marquardt import minimised
from asperity.inference.objective import Objective, Residuals
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.table import LockInTable
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import unknowns_of
from asperity.laws import get_law

LAW = get_law("rice-ruina")


class Formula(LockInTerm):
    """Residuals that are a function of ln D0, where a method finds them.

    `values` gives residuals and their derivatives; only the slow method goes beyond `edge`.
    """

    def __init__(self, values, edge=math.inf):
        self.values, self.edge, self.searching = values, edge, False

    name, observables, noise = "formula", ("mu1",), {"model": "none", "effective_samples": 1}

    @property
    def searches(self):
        return self.searching

    def coarser(self):
        return self

    def use_search(self, always):
        self.searching = always

    def thinned(self, rows, data=0):
        return None

    def chi2_of_many(self, values, *, near=False, least=1.0):
        found = [self.residuals(v) for v in values]
        return np.array([math.inf if r is None else np.sum(r.values**2) for r in found])

    def warnings(self, residuals, information, outliers=()):
        return []

    def weighted(self, weights):
        return Weighted(self, weights)

    def residuals(self, values, *, search=None):
        x = math.log(values["D0"])
        if x > self.edge and not self.searching:
            return None
        r, slope = self.values(x)
        n = r.size
        return Residuals(
            r, (slope / values["D0"])[:, None], np.full(n, "mu1"), np.arange(n), log_scale=0.0
        )


class Weighted(Formula):
    """Those of another term, each multiplied by the weight of its row."""

    def __init__(self, term, weights):
        self.term, self.factors = term, weights

    def residuals(self, values, *, search=None):
        found = self.term.residuals(values, search=search)
        if found is None:
            return None
        w = self.factors[found.row]
        return found._replace(values=w * found.values, jacobian=w[:, None] * found.jacobian)


def objective_of(values, start, edge=math.inf):
    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={"D0": start}, priors={})
    return Objective((Formula(values, edge),), LAW, unknowns, {})


#: Minima of equal depth, in ln D0, and the slope of the residual there.
FIRST, SECOND, SLOPE = math.log(1e-6), math.log(4e-6), 8.0


def two_minima(x):
    """A residual that is zero twice, and 99 that say nothing, of chi-squared 99."""
    gap = SECOND - FIRST
    r, slope = np.ones(100), np.zeros(100)
    r[0] = SLOPE * (x - FIRST) * (x - SECOND) / gap
    slope[0] = SLOPE * (2 * x - FIRST - SECOND) / gap
    return r, slope


def test_both_minima_are_found_and_intervals_hold_both():
    objective = objective_of(two_minima, 5e-7)
    found = described_fit(objective, minima_of(objective, 0), profile=False)
    (other,) = found.optima
    pair = sorted([found.values["D0"], other.values["D0"]])
    np.testing.assert_allclose(np.log(pair), [FIRST, SECOND], atol=1e-6)
    low, high = found.parameters["D0"].interval_95
    # Standard errors of 1/SLOPE about either.
    assert math.log(low) == pytest.approx(FIRST - 1.96 / SLOPE, abs=0.02)
    assert math.log(high) == pytest.approx(SECOND + 1.96 / SLOPE, abs=0.02)
    assert any("another minimum" in w and "D0" in w for w in found.warnings)


def test_a_narrow_minimum_at_another_memory_length_is_found():
    """No drawn start is as good there as those at the wide minimum, which describes the data."""
    narrow = FIRST + math.log(10.0) + 0.1

    def values(x):
        r, slope = np.ones(100), np.zeros(100)
        rise = math.exp(4 * (x - FIRST - 1.3))
        both = SLOPE * (x - FIRST) * (x - narrow) / (narrow - FIRST)
        along = SLOPE * (2 * x - FIRST - narrow) / (narrow - FIRST)
        r[0] = both * (1 + rise)
        slope[0] = along * (1 + rise) + 4 * both * rise
        return r, slope

    objective = objective_of(values, 5e-7)
    found = described_fit(objective, minima_of(objective, 0), profile=False)
    (other,) = found.optima
    pair = sorted([found.values["D0"], other.values["D0"]])
    np.testing.assert_allclose(np.log(pair), [FIRST, narrow], atol=1e-6)
    low, high = np.log(found.parameters["D0"].interval_95)
    assert low < FIRST
    assert high > narrow


def one_minimum(x):
    r, slope = np.ones(100), np.zeros(100)
    r[0], slope[0] = SLOPE * (x - FIRST), SLOPE
    return r, slope


def test_a_minimum_beyond_the_fast_method_is_found():
    # At the edge chi-squared is 4 above its minimum of 99: nothing that shows in its probability.
    objective = objective_of(one_minimum, 3e-7, edge=FIRST - 2 / SLOPE)
    found = described_fit(objective, minima_of(objective, 0), profile=False)
    assert math.log(found.values["D0"]) == pytest.approx(FIRST, abs=1e-6)
    assert not found.optima


def test_a_profile_goes_on_where_the_fast_method_ends():
    objective = objective_of(one_minimum, 1e-6, edge=FIRST + 1 / SLOPE)
    u, chi2 = objective.minimise(np.array([FIRST]))
    covariance = np.array([[SLOPE**-2]])
    open_end = Profile(objective, 0, u, chi2, covariance, search=False).interval(0.95)
    assert open_end[1] == math.inf
    closed = Profile(objective, 0, u, chi2, covariance, search=True).interval(0.95)
    np.testing.assert_allclose(closed, FIRST + 1.96 / SLOPE * np.array([-1, 1]), atol=0.003)


class Ending(Formula):
    """Residuals that no method finds beyond the edge."""

    def residuals(self, values, *, search=None):
        return None if math.log(values["D0"]) > self.edge else super().residuals(values)


@pytest.mark.parametrize(("slope", "profiled"), [(SLOPE, True), (12.0, False)])
def test_no_interval_leaves_its_estimate_out_where_chi_squared_ends(slope, profiled):
    """Where the law has no orbit beyond the estimate, the parabola's minimum lies there too."""

    def values(x):
        r, slopes = np.ones(100), np.zeros(100)
        r[0], slopes[0] = slope * (x - FIRST), slope
        return r, slopes

    objective = objective_of(values, 3e-7)
    # Four standard errors before the minimum, whose intervals would not reach back to the end.
    end = FIRST - 4 / slope
    objective = replace(objective, terms=(Ending(values, end),))
    stopped = objective.minimise(np.array([math.log(3e-7)]))
    found = described_fit(objective, [stopped], profile=False)
    assert any("still falls where the law has no periodic orbit" in w for w in found.warnings)
    (p,) = found.parameters.values()
    assert math.log(p.value) == pytest.approx(end, abs=1e-3)
    assert p.interval_95[0] <= p.interval_68[0] < p.value <= p.interval_68[1] <= p.interval_95[1]
    # Too precise to be tried, it has the whole range; a profile stays where there are orbits.
    assert (p.interval_68 == (0.0, math.inf)) != profiled


def test_progress_counts_the_starts_that_are_followed():
    calls = []
    minima_of(objective_of(one_minimum, 1e-6), 0, lambda done, total: calls.append((done, total)))
    total = calls[-1][1]
    assert calls == [(done, total) for done in range(total + 1)]


class TwoNoises(RunTerm):
    """A recording of two halves, each with a noise of the size that its residual shows.

    Residuals are of size 1 and 2 at FIRST, of size 10 and 1 at SECOND.
    """

    name, observables, profiled = "halves", ("friction",), 2

    def __init__(self, half=50):
        self.half, self.sizes = half, np.ones(2)

    def _raw(self, x):
        rate = 0.5 * math.pi / (SECOND - FIRST)
        share, slope = math.sin(rate * (x - FIRST)) ** 2, rate * math.sin(2 * rate * (x - FIRST))
        return np.array([1 + 9 * share, 2 - share]), np.array([9 * slope, -slope])

    def residuals(self, values, *, search=None):
        r, slope = (np.repeat(v / self.sizes, self.half) for v in self._raw(math.log(values["D0"])))
        scale = self.half * float(np.log(self.sizes).sum())
        names, rows = np.full(r.size, "friction"), np.arange(r.size)
        return Residuals(r, (slope / values["D0"])[:, None], names, rows, scale)

    def update_noise(self, values):
        self.sizes = self._raw(math.log(values["D0"]))[0]
        return True


def test_minima_of_recordings_are_compared_with_the_noise_of_each():
    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={"D0": 1e-6}, priors={})
    term = TwoNoises()
    objective = Objective((term,), LAW, unknowns, {})
    near = [(np.array([SECOND - 0.02]), 1.0), (np.array([FIRST + 0.02]), 2.0)]
    (best, chi2), (other, above) = with_noise(objective, near, objective)[0]
    (term,) = objective.terms
    # Under the noise of SECOND, FIRST is a maximum of chi-squared; its likelihood is the higher.
    np.testing.assert_allclose([best[0], other[0]], [FIRST, SECOND], atol=1e-3)
    assert above - chi2 == pytest.approx(2 * term.half * math.log(5), rel=1e-3)
    # The noise is that of the best.
    np.testing.assert_allclose(term.sizes, [1, 2], atol=0.01)
    assert chi2 == pytest.approx(2 * term.half, rel=0.01)


def test_a_wrong_minimum_that_few_starts_of_the_fast_method_reach_is_left():
    shallow, deep = math.log(1.1e-7), math.log(3e-6)

    def values(x):
        # chi-squared of 1e4 and more in the fast method's range, of 99 at `deep`.
        r, slope = np.ones(100), np.zeros(100)
        gap = deep - shallow
        phase = math.pi * (x - shallow) / gap
        r[0] = 60 * (1 + math.cos(phase)) + 5 * (x - deep)
        slope[0] = -60 * math.sin(phase) * math.pi / gap + 5
        return r, slope

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={}, priors={})
    # Two of 64 starts between 1e-7 and 2e-5 m.
    edge = math.log(1e-7) + math.log(200) * 2 / 64
    objective = Objective((Formula(values, edge),), LAW, unknowns, {})
    u, chi2 = minima_of(objective, 0)[0]
    assert u[0] == pytest.approx(deep, abs=0.2)
    assert chi2 == pytest.approx(99, abs=0.01)


def test_a_start_that_is_as_good_as_zero_is_no_scale():
    law = get_law("linker-dieterich")
    (alpha,) = unknowns_of(law, ["alpha"], largest_epsilon=0.5, start={"alpha": 1e-300}, priors={})
    low, high = (float(alpha.to_coordinate(v)) for v in alpha.start)
    assert 0 <= low < high < 1e6
    assert alpha.to_value(np.array(high)) == pytest.approx(alpha.start[1])


def test_a_narrow_minimum_next_to_a_wide_one_that_is_far_off_is_found():
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
    (u, chi2), *others = minima_of(objective, 0)
    assert u[0] == pytest.approx(deep, abs=1e-5)
    assert chi2 == pytest.approx(99, abs=1e-6)
    # It is this search that finds it.
    assert min(u[0] for u, _ in others) == pytest.approx(FIRST, abs=1e-3)


class Edge(Formula):
    """Residuals of ln D0 and ln A, among searched orbits.

    Where one of the two stays, they exist only within `step` of the other's last value: as along
    the edge of the orbits, a minimisation tries steps without a solution again and again.
    """

    def __init__(self, values, step):
        super().__init__(values)
        self.searching, self.step, self.last = True, step, (math.nan, math.nan)

    def residuals(self, values, *, search=None):
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
def test_profiles_along_an_edge_are_given_up_and_said_to_be(step, profile):
    """ln D0 is bent, and ln A goes with it."""

    def values(x, y):
        r, slopes = np.ones(100), np.zeros((100, 2))
        bent = math.expm1(2 * (x - FIRST))
        r[0], slopes[0, 1] = 2 * bent, 4 * (bent + 1)
        r[1], slopes[1] = 20 * (y + 5) - 2 * bent, (20, -4 * (bent + 1))
        return r, slopes

    unknowns = unknowns_of(LAW, ["A", "D0"], largest_epsilon=0.5, start={"D0": 1e-6}, priors={})
    objective = Objective((Edge(values, step),), LAW, unknowns, {})
    found = described_fit(objective, [(np.array([-5.0, FIRST]), 98.0)], profile=profile)
    said = [w for w in found.warnings if "hardly has periodic orbits" in w]
    low, high = found.parameters["D0"].interval_95
    # 20 (ln A + 5) is the sum of two normal residuals of unit variance.
    normal = 1.96 * math.sqrt(2) / 20 * np.array([-1, 1])
    of_A = np.log(found.parameters["A"].interval_95) + 5
    if step < 1 and not profile:
        assert (low, high) == (0.0, math.inf)
        assert "intervals of D0 are the whole range" in said[0]
        assert "intervals of A are of the normal approximation" in said[0]
        np.testing.assert_allclose(of_A, normal, rtol=1e-3)
        return
    assert not said
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
def test_a_doubtful_minimum_among_searched_orbits_is_said_to_be_one(size, searched, doubted):
    # 1.15 has p = 0.02; 3 is excluded, which another warning says.
    def values(x):
        r, slope = np.full(100, size), np.zeros(100)
        r[0], slope[0] = 5 * (x - FIRST), 5.0
        return r, slope

    objective = objective_of(values, 1e-6)
    objective.terms[0].searching = searched
    found = described_fit(objective, [objective.minimise(np.array([FIRST]))], profile=False)
    assert any("a better minimum may lie" in w for w in found.warnings) == doubted


def test_a_minimum_without_orbits_gives_way_to_the_next_and_says_so():
    # The fast method ends between the two.
    objective = objective_of(two_minima, 1e-6, edge=(FIRST + SECOND) / 2)
    beyond = np.array([SECOND]), 98.0
    found = described_fit(objective, [beyond, (np.array([FIRST]), 99.0)], profile=False)
    assert found.converged
    assert found.values["D0"] == pytest.approx(1e-6)
    assert "a lower minimum, of chi-squared 98," in found.warnings[0]
    assert not described_fit(objective, [beyond], profile=False).converged


class Rows(Formula):
    """As `Formula` with a residual for each row of a table; counts the rows that are computed.

    The residual of row i is `values(x)[i]`; no orbit is found by the fast method.
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

    def residuals(self, values, *, search=None):
        if not self.searching:
            return None
        r, slope = (v[self.kept] for v in self.values(math.log(values["D0"])))
        self.computed.append(r.size)
        names, rows = np.full(r.size, "mu1"), np.arange(r.size)
        return Residuals(r, (slope / values["D0"])[:, None], names, rows, log_scale=0.0)


def test_few_rows_lead_to_the_minimum_of_all():
    rows = 128
    scatter = np.random.default_rng(1).normal(size=rows)
    phase = 0.4 * np.arange(rows)

    def values(x):
        # Every row sees x through a sine of its own phase: several minima, one of them low.
        r = 30 * (np.sin(2 * (x - FIRST) + phase) - np.sin(phase)) + scatter
        return r, 60 * np.cos(2 * (x - FIRST) + phase)

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={}, priors={})
    term = Rows(values, rows)
    objective = Objective((term,), LAW, unknowns, {})
    u, chi2 = minima_of(objective, 0)[0]
    exact = objective.minimise(np.array([FIRST]))
    assert (u[0] - FIRST) % math.pi == pytest.approx((exact[0][0] - FIRST) % math.pi, abs=1e-7)
    assert chi2 == pytest.approx(exact[1], rel=1e-9)
    # All rows at the end alone.
    assert sum(n == rows for n in term.computed) < 0.2 * len(term.computed)


def test_the_given_start_is_followed_whatever_four_rows_say_of_it():
    rows, given = 32, math.log(7e-7)
    four = np.isin(np.arange(rows), np.linspace(0, rows - 1, 4).round())

    def values(x):
        if abs(x - given) < 0.05:
            # Four rows are farther off than anywhere else, all rows together nearer.
            r, slope = np.where(four, 100.0, 0.0), np.zeros(rows)
            r[1], slope[1] = 5 * (x - given), 5.0
        else:
            r, slope = np.where(four, 10.0, 60.0), np.zeros(rows)
            r[1], slope[1] = 5 * (x - FIRST), 5.0
        return r, slope

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={"D0": 7e-7}, priors={})
    u, chi2 = minima_of(Objective((Rows(values, rows),), LAW, unknowns, {}), 0)[0]
    assert u[0] == pytest.approx(given, abs=1e-3)
    assert chi2 == pytest.approx(4 * 100.0**2)


class NarrowRows(Rows):
    """Rows of which one has an orbit near `FIRST` alone, and few rows lead away from there."""

    lonely = 5

    def search_wholly(self, values):
        """No method finds more of them."""

    def with_rows(self, kept, coarse=False):
        part = NarrowRows(self.values, 0, self.kept[kept], self.computed)
        part.searching = True
        return part

    def residuals(self, values, *, search=None):
        near = abs(math.log(values["D0"]) - FIRST) < 0.05
        if self.lonely in self.kept and not near:
            return None
        return super().residuals(values, search=search)


def test_fits_of_special_cases_are_starts():
    def values(x):
        # Rows that are multiples of 3 alone would like another D0.
        r = 30 * (x - FIRST) * np.ones(96)
        r[::3] = 30 * (x - SECOND)
        return r, np.full(96, 30.0)

    unknowns = unknowns_of(LAW, ["D0"], largest_epsilon=0.5, start={}, priors={})

    def found(**options):
        objective = Objective((NarrowRows(values, 96),), LAW, unknowns, {})
        return minima_of(objective, 0, **options)

    assert found(drawn=8) == []
    known = {"D0": math.exp(FIRST + 0.02), "lambda": 1e-6}
    (u, chi2), *_ = found(drawn=8, simpler=[known])
    assert abs(u[0] - FIRST) < 0.05
    assert chi2 <= np.sum(values(FIRST + 0.02)[0] ** 2)


@pytest.mark.parametrize(
    ("law", "other", "whether"),
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
def test_laws_that_extend_others(law, other, whether):
    assert extends(get_law(law), get_law(other)) is whether


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
    # A decrease of 1e-4 is none: a hundredth of a standard error.
    assert end == pytest.approx([3.0, np.exp(3.0)], abs=0.011 * np.exp(3.0))
    assert calls < 120  # straight steps alone: 992, and more than 2000


def test_bounds_and_places_without_residuals_are_kept_off():
    def residuals(u):
        r = np.array([u[0] + 2.0, u[1] - 1.0])
        return (r if u[1] < 1.5 else np.array([np.nan])), np.eye(2)

    end = minimised(
        residuals, np.array([5.0, 0.0]), np.array([1.0, -9.0]), np.array([9.0, 9.0]), 50
    )
    np.testing.assert_allclose(end, [1.0, 1.0], atol=0.01)
