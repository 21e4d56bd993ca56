"""Healing from stick-slip, of cycles whose friction grows with the logarithm of the stick time."""

import numpy as np

from asperity.measurement.stick_slip.healing import of_campaign
from asperity.theory import healing_drop


def test_recordings_at_several_velocities_tell_the_growth_of_the_drop() -> None:
    K, W0, B = 168.0, 0.301, 0.004
    V = np.geomspace(1e-6, 1e-3, 7)
    drop = healing_drop(0.05, B, 1.0, K=K, W0=W0, V=V)
    rest = drop * W0 / (K * V)
    noisy = drop + 1e-3 * np.random.default_rng(0).standard_normal(V.size)
    result = of_campaign(rest, noisy, np.full(V.size, 1e-4))
    assert not result.reason
    assert result.interval_95[0] < 2 * B < result.interval_95[1]
    # The scatter of the recordings counts, which is ten times what they state.
    assert result.drop_uncertainty > 4e-4 / (np.std(np.log(rest)) * np.sqrt(V.size))
    assert "e-folds" in of_campaign(rest[:3] ** 0.01, drop[:3], np.full(3, 1e-4)).reason
    assert "too few" in of_campaign(rest[:2], drop[:2], np.full(2, 1e-4)).reason
