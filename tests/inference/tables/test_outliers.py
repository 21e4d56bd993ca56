"""How far readings are off, beside what other data of the same fit know."""

import numpy as np

from asperity.inference.objective import Residuals
from asperity.inference.tables.residuals import outlying_rows, standardised


def residuals_of(values, jacobian):
    n = values.size
    return Residuals(values, jacobian, np.full(n, "mu1"), np.arange(n), 0.0)


def test_readings_beside_other_data_are_as_far_off_as_in_the_fit_of_all():
    random = np.random.default_rng(3)
    # The readings see two of four coordinates, and one of these in a single reading.
    mine = np.zeros((12, 4))
    mine[:, 0] = random.normal(size=12)
    mine[4, 1] = 5.0
    others = random.normal(size=(30, 4)) * [1.0, 3.0, 1e-3, 1e3]
    values = random.normal(size=42)
    values[4] = 9.0
    together = np.vstack([mine, others])
    left = values - together @ np.linalg.lstsq(together, values, rcond=None)[0]
    hat = together @ np.linalg.pinv(together)
    expected = (left / np.sqrt(1 - np.diag(hat)))[:12]
    own = residuals_of(left[:12], mine)
    np.testing.assert_allclose(standardised(own, together.T @ together), expected, rtol=1e-6)


def test_coordinates_of_other_data_do_not_count_against_the_readings():
    random = np.random.default_rng(4)
    # Steep, so that the outlier hardly moves the coordinate.
    seen = np.full((8, 1), 100.0)
    values = random.normal(size=8)
    values[2] = 30.0
    values -= values.mean()
    alone = outlying_rows(residuals_of(values, seen))
    assert alone == [2]
    beside = np.hstack([seen, np.zeros((8, 20))])
    assert outlying_rows(residuals_of(values, beside)) == alone
