"""Where stick-slip ends, of cycles and campaigns whose threshold is known."""

import dataclasses

import numpy as np
import pytest

from asperity.measurement.stick_slip.events import SlipEvents
from asperity.measurement.stick_slip.threshold import linear_frequency, thresholds


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
