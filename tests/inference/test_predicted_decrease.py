"""The predicted decrease of a sum of squares that is quadratic, by its exact minimum."""

import numpy as np
import pytest

from asperity.inference.levenberg_marquardt import predicted_decrease


@pytest.mark.parametrize("influence", [1.0, 1e-9, 1e-200])
def test_a_coordinate_of_small_influence_counts_unless_a_bound_stops_it(influence):
    generator = np.random.default_rng(0)
    r, J = generator.normal(size=12), generator.normal(size=(12, 3))
    J[:, 2] *= influence
    low, high, u = np.full(3, -50.0), np.full(3, 50.0), np.zeros(3)

    def decrease(slopes):
        return r @ r - np.linalg.lstsq(slopes / np.abs(slopes).max(axis=0), r)[1][0]

    assert predicted_decrease(r, J, u, low, high) == pytest.approx(decrease(J), rel=1e-9)
    (low if J[:, 2] @ r > 0 else high)[2] = 0.0
    stopped = predicted_decrease(r, J, u, low, high)
    assert stopped == pytest.approx(decrease(J[:, :2]), rel=1e-9)
    J[:, 2] = 0
    assert predicted_decrease(r, J, u, low, high) == pytest.approx(stopped, rel=1e-12)


def test_dependent_coordinates_decrease_no_more_than_one_of_them():
    generator = np.random.default_rng(1)
    r, J = generator.normal(size=40), generator.normal(size=(40, 3))
    # Parameters that change the predictions in the same way, to the accuracy of orbits.
    J[:, 2] = 3 * J[:, 0] + 1e-11 * generator.normal(size=40)
    low, high, u = np.full(3, -50.0), np.full(3, 50.0), np.zeros(3)
    alone = predicted_decrease(r, J[:, :2], u[:2], low[:2], high[:2])
    assert predicted_decrease(r, J, u, low, high) == pytest.approx(alone, rel=1e-6)
