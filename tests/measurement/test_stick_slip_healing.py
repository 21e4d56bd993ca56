"""Healing from stick-slip, of cycles whose friction grows with the logarithm of the stick time."""

from dataclasses import replace

import numpy as np
import pytest

from asperity import Slider, laws
from asperity.experiment import stick_slip_response
from asperity.measurement.stick_slip.campaign import StickSlipCampaign
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


def _row(V, K, W0, stick, drop, **others):
    row = {"regime": "regular stick-slip", "checks": "sampling: bad", "V": V, "K": K, "W0": W0}
    row |= {"stick_duration": stick, "drop": drop, "drop_uncertainty": 1e-4, "force_before": 0.5}
    return row | {"recurrence": stick, "recurrence_uncertainty": 0.0} | others


def test_each_machine_of_a_campaign_tells_the_healing_of_a_law() -> None:
    W0, M, V = 5.0, 10.0, np.geomspace(1e-6, 3e-5, 3)
    law = laws.RiceRuina(mu0=0.4, V0=1e-6, A=0.015, B=0.027, D0=0.5e-6)
    slider = Slider(law, spring=np.array([[12e3], [36e3]]), load=W0, mass=M)
    cycles = stick_slip_response(slider, velocity=V)
    rows = [
        _row(V[j], K, W0, cycles.stick_duration[i, j], cycles.drop[i, j], M=M)
        for j in range(V.size)
        for i, K in enumerate((12e3, 36e3))
    ]
    left_out = [
        _row(V[0], 12e3, W0, 1.0, 9.0, checks="drift: bad"),
        _row(V[0], 36e3, W0, 1.0, 9.0, regime="growing stick-slip"),
        _row(V[0], 156e3, W0, None, None, regime="steady sliding"),
        {"regime": None, "reason": "not measured"},
    ]
    campaign = StickSlipCampaign.of(rows + left_out)
    assert [one.K for one in campaign.series] == [12e3, 36e3, 156e3]
    for one in campaign.series[:2]:
        healing = one.healing()
        assert not healing.reason
        assert healing.recordings == V.size
        # 2 (B - A): age and velocity at the onset follow that of the drive, and slips overshoot.
        assert healing.drop_per_efold == pytest.approx(0.024, rel=0.15)
        (low, high), condition = one.b_minus_a(healing)
        assert low < 0.012 < high
        # M V^2/W0 = 10 (3e-5)^2/5
        assert "A D0 above 1.8e-09 m" in condition
        heavy = StickSlipCampaign.of([row | {"M": 1e8} for row in one.rows]).series[0]
        (low, _), condition = heavy.b_minus_a(healing)
        assert np.isnan(low)
        assert "inertia counts" in condition
        unknown = StickSlipCampaign.of([row | {"M": None} for row in one.rows]).series[0]
        assert "M is not known" in unknown.b_minus_a(healing)[1]
    assert "0 recordings are too few" in campaign.series[2].healing().reason
    figure = replace(campaign, model=cycles, modelled=(0, 1)).plot()
    drops, times = figure.axes
    for axis, curves in ((drops, cycles.drop), (times, cycles.period)):
        lines = [
            line for line in axis.lines if line.get_linestyle() == "-" and line.get_xdata().size
        ]
        assert [line.get_ydata().tolist() for line in lines] == curves.tolist()
