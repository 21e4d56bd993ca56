"""Chi-squared about a minimum."""

from dataclasses import replace

import numpy as np
from benchmarks.coverage import CASES, TRUE, runs_of

from asperity.inference import fit
from asperity.inference.fitting.parabola import nowhere_negative, parabola_of


def test_what_noise_adds_is_not_negative_by_rounding():
    """Of parameters of 1e5 and 1 standard deviations, the first two all but the same."""
    covariance = np.array([[1e10, 0.9999e10, 0.0], [0.9999e10, 1e10, 0.0], [0.0, 0.0, 1.0]])
    added = np.array([[-2e7, 1e7, 10.0], [1e7, 3e8, 0.0], [10.0, 0.0, 0.02]])
    found = nowhere_negative(added, covariance)
    scaled = found / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert np.linalg.eigvalsh(scaled).min() > -1e-12
    assert (np.diag(covariance + found) >= np.diag(covariance)).all()
    np.testing.assert_allclose(found[1:, 1:], added[1:, 1:], rtol=0.02, atol=0.1)


def test_what_noise_adds_stays_where_it_is_no_rounding():
    root = np.random.default_rng(0).normal(size=(4, 4)) * [1e-3, 1.0, 1e4, 1.0]
    added = root.T @ root
    np.testing.assert_allclose(nowhere_negative(added, 20 * added), added, rtol=1e-10)


def test_others_do_not_follow_a_delay_beyond_its_bound():
    """Where the pieces of the drive leave a delay no room, estimates are those at its bound."""
    (run,) = runs_of(CASES["steps"], 1)
    objective = fit(run, "rice-ruina", ["A", "B", "D0"], start=TRUE, starts=1).objective
    at = objective.names.index("step_time_1")
    u, _ = objective.minimise(objective.coordinates({**TRUE, "step_time_1": 0, "step_time_2": 0}))
    free = parabola_of(objective, u, objective.chi2(u))
    unknowns = list(objective.unknowns)
    # Three standard deviations off.
    bound = float(unknowns[at].to_value(u[at] + 3 * free.sd[at]))
    unknowns[at] = replace(unknowns[at], lower=bound, upper=1.05 * bound)
    narrow = replace(objective, unknowns=tuple(unknowns))
    u, chi2 = narrow.minimise(u)
    held = parabola_of(narrow, u, chi2)
    assert chi2 > free.chi2 + 8
    others = np.arange(u.size) != at
    off = (held.unbounded - u)[others] / held.sd[others]
    assert np.abs(off).max() < 0.05
