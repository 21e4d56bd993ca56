"""Healing from stick-slip, and where it ends, of cycles whose healing and threshold are known."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from asperity import Slider, laws
from asperity.experiment import stick_slip_response
from asperity.measurement.stick_slip.campaign import StickSlipCampaign
from asperity.measurement.stick_slip.events import SlipEvents
from asperity.measurement.stick_slip.healing import of_campaign
from asperity.measurement.stick_slip.threshold import linear_frequency, thresholds
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


def cycles(drop, period) -> SlipEvents:
    """Events of these drops and recurrences; nothing else of them counts."""
    fields = {f.name: np.zeros(drop.size) for f in dataclasses.fields(SlipEvents)}
    fields |= {"force_before": drop, "onset": np.cumsum(np.nan_to_num(period))}
    return SlipEvents(**fields | {"timing_uncertainty": 1e-3 * np.ones(drop.size)})


@pytest.mark.parametrize("sign", [1, -1])
def test_growing_and_dying_cycles_give_the_period_of_vanishing_ones(sign) -> None:
    drop = (0.002 * 1.4 ** np.arange(7))[::sign]
    squares = (drop[1:] ** 2 + drop[:-1] ** 2) / 2
    frequency, error = linear_frequency(cycles(drop, np.r_[np.nan, 2 + 800 * squares]), 0.1)
    assert frequency == pytest.approx(0.5, rel=1e-9)
    assert 0 < error < 0.01


def test_the_shortest_cycles_of_irregular_slip_are_no_small_oscillations() -> None:
    rng = np.random.default_rng(0)
    # Recurrence is drop over loading slope: the smaller the drop, the shorter.
    trains = 0.1 * np.exp(0.35 * rng.standard_normal((300, 60)))
    read = [linear_frequency(cycles(drop, np.r_[np.nan, drop[1:]]), np.inf)[0] for drop in trains]
    assert np.isfinite(read).sum() <= 3
    # Where the loading is known, it says that the slider rests in these cycles.
    known = [linear_frequency(cycles(drop, np.r_[np.nan, drop[1:]]), 1.0)[0] for drop in trains]
    assert not np.isfinite(known).any()
    # Nor do cycles of one size say what smaller ones would do.
    assert np.isnan(linear_frequency(cycles(np.full(20, 0.1), np.full(20, 0.3)), np.inf)[0])


def row(stiffness, regime, **more):
    regular = {"drop": 0.0, "recurrence": 0.0, "recurrence_uncertainty": 1e-3}
    return {"V": 1e-5, "K": stiffness, "W0": 1.0, "regime": regime, **regular, **more}


def test_the_period_at_the_threshold_is_that_of_regular_cycles_without_drop() -> None:
    # Drops grow with the root of the distance from 1000 1/m (a supercritical Hopf bifurcation).
    rows = [row(1100.0, "steady sliding")]
    for stiffness in (700.0, 800.0, 900.0):
        square = 1e-4 * (1 - stiffness / 1000)
        period = (3 + 5000 * square) / np.sqrt(stiffness / 1000)
        rows.append(row(stiffness, "regular stick-slip", drop=np.sqrt(square), recurrence=period))
    (end,) = thresholds(rows)
    assert not end.reason
    assert (end.sticks_at, end.slides_at, end.K_over_W0) == (900.0, 1100.0, 1000.0)
    assert abs(end.frequency - 1 / 3) < end.frequency_err < 0.1 / 3


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        ([row(1.0, "steady sliding"), row(2.0, "steady sliding")], "shows stick-slip"),
        ([row(1.0, "regular stick-slip")], "shows steady sliding"),
        ([row(1.0, "regular stick-slip"), row(3.0, "steady sliding")], "only known to lie"),
        ([row(1.0, "regular stick-slip"), row(1.2, "dying stick-slip")], "shows steady sliding"),
        ([row(1.0, "irregular stick-slip"), row(1.2, "steady sliding")], "no cycles near"),
        # Cycles with sticks: K V/W0 is 1e-5 1/s.
        (
            [
                row(0.9, "regular stick-slip", drop=4e-5, recurrence=5.0),
                row(1.0, "regular stick-slip", drop=3e-5, recurrence=4.0),
                row(1.2, "steady sliding"),
            ],
            "no cycles near",
        ),
    ],
)
def test_what_is_not_bracketed_cannot_be_told(rows, reason) -> None:
    (end,) = thresholds(rows)
    assert reason in end.reason
