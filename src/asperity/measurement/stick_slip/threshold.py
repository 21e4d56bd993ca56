"""Where stick-slip ends: the stiffness over the load at which a campaign passes to steady sliding.

At each velocity the threshold lies between the stiffest machine that sticks and slips and the
softest that slides steadily. The frequency there is that of oscillations whose drops vanish:

    T = T0 + c drop^2,       T0 proportional to 1/sqrt(K)

near the threshold, where the cycles are those of the linear equation of motion (Bureau et al.,
2000, Eqs. 18 and 19: omega^2 = K V^2 / (A W0 D0)). T0 comes from cycles that grow out of steady
sliding or die away to it, or, if no recording has such cycles, from regular cycles at several
stiffnesses. Cycles with sticks are not used: their force rises at K V/W0, that of a sine at
pi drop/T.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from asperity.arrays import Float
from asperity.measurement.levels_and_trends import weighted_line, weighted_mean
from asperity.measurement.stick_slip.events import SlipEvents

#: Growing or dying cycles are fitted together if their periods exceed those of the smallest cycles
#: by less than this factor, and if their drops range over at least the second factor.
_LONGER, _RANGE = 1.25, 1.3
#: A cycle is small if the largest slope of a sine of its drop and period is below this multiple of
#: K V/W0. In simulated recordings growing cycles at 1.2, 1.5 and 2 times K V/W0 have periods up to
#: 5, 14 and 27 % longer than vanishing cycles; cycles with sticks are at 2.6 to 3, and have periods
#: 3 to 6 times as long.
_SLOPE = 2.0
#: Fewest small cycles, and factor by which drops must grow or die to exclude chance.
_FEWEST, _GROWTH = 3, 3.0
#: Velocities with a smaller relative difference count as one.
_SAME_VELOCITY = 0.02
#: Largest ratio of the two ends of a bracket, and largest ratio of a stiffness to the threshold for
#: which its cycles show the frequency at the threshold.
_WIDEST, _NEAR = 2.0, 1.6
#: Largest share by which a period is extrapolated.
_FARTHEST = 0.4

#: Final regimes of the motion below the threshold.
_STICKING = "regular", "irregular", "growing", "oscillation"


@dataclass(frozen=True)
class Threshold:
    """The end of stick-slip at one velocity, in SI.

    Attributes
    ----------
    V : float
        m/s.
    K_over_W0, K_over_W0_err : float
        Threshold (1/m) and its standard uncertainty: the bracket's middle, and its width over
        sqrt(12). Velocities that have one bracket in common, as the machine had the same springs,
        have one error in common: n of them have sqrt(n) times the uncertainty, so that their mean
        is no surer than each. NaN where there is no bracket.
    frequency, frequency_err : float
        Frequency of vanishing oscillations at the threshold (Hz); NaN where it is not known.
    sticks_at, slides_at : float
        The bracket: largest K/W0 with stick-slip and smallest with steady sliding (1/m); NaN where
        there is none.
    reason : str
        Reason without a result; empty with a result.
    """

    V: float
    K_over_W0: float
    K_over_W0_err: float
    frequency: float
    frequency_err: float
    sticks_at: float
    slides_at: float
    reason: str


#: Columns as `asperity recipe` takes them, and the bracket.
COLUMNS = tuple(field.name for field in fields(Threshold) if field.name != "reason")


def linear_frequency(events: SlipEvents, loading: float) -> tuple[float, float]:
    """Frequency (Hz) of cycles as their drops vanish, with its standard uncertainty.

    Parameters
    ----------
    events : SlipEvents
    loading : float
        K V/W0 (1/s); NaN if it is not known.

    Returns
    -------
    (float, float)
        NaN where no drops of cycles without sticks grow or die away, or `loading` is not known.
    """
    drop, period = events.drop, events.recurrence
    best = (np.nan, np.nan)
    if drop.size <= _FEWEST:
        return best
    change, cycles = np.diff(drop) > 0, np.arange(1, drop.size)
    # The beginning, as long as drops grow, and the end, since they only die away.
    for run in (cycles[np.cumprod(change) > 0], cycles[np.cumprod(~change[::-1])[::-1] > 0]):
        if run.size < _FEWEST or np.ptp(np.log(drop[run[0] - 1 : run[-1] + 1])) < np.log(_GROWTH):
            continue
        square = (drop[run] ** 2 + drop[run - 1] ** 2) / 2
        small = np.pi * np.sqrt(square) < _SLOPE * loading * period[run]
        if small.sum() < _FEWEST:
            continue
        run, square = run[small], square[small]
        order = run[np.argsort(square)]
        smallest = np.median(period[order[:_FEWEST]])
        near = order[period[order] < _LONGER * smallest]
        if near.size < _FEWEST:
            continue
        x = (drop[near] ** 2 + drop[near - 1] ** 2) / 2
        if x.max() < _RANGE**2 * x.min():
            continue
        uncertainty = np.hypot(events.timing_uncertainty[near], events.timing_uncertainty[near - 1])
        value, error = _without_drop(x, period[near], uncertainty)
        if not np.isfinite(best[1]) or error / value < best[1] / best[0]:
            best = value, error
    return 1 / best[0], best[1] / best[0] ** 2


def _without_drop(square: Float, period: Float, uncertainty: Float) -> tuple[float, float]:
    """Period at no drop, by a weighted line, and its standard uncertainty.

    Half of what the line adds to the period of the smallest drop counts as uncertain.
    """
    share = square / square.max()
    line = weighted_line(share, period, np.maximum(uncertainty, 1e-12 * period))
    error = np.sqrt(line.covariance[0, 0] * max(line.excess, 1.0))
    return float(line.beta[0]), float(np.hypot(error, line.beta[1] * share.min() / 2))


def thresholds(rows: Sequence[Mapping[str, Any]]) -> list[Threshold]:
    """The end of stick-slip at each velocity of a campaign.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of the campaign's table: ``V``, ``K``, ``W0``, ``regime``, ``linear_frequency`` and its
        uncertainty, ``drop``, ``recurrence`` and their uncertainties. Rows without V, K, W0 or a
        regime are left out.

    Returns
    -------
    list of Threshold
        In rising velocity; where a threshold is not known, its `reason` says why.
    """
    table = [row for row in rows if all(row.get(n) for n in ("V", "K", "W0", "regime"))]
    table.sort(key=lambda row: row["V"])
    groups: list[list[Mapping[str, Any]]] = []
    for row in table:
        if groups and row["V"] <= groups[-1][0]["V"] * (1 + _SAME_VELOCITY):
            groups[-1].append(row)
        else:
            groups.append([row])
    ends = [_threshold(group) for group in groups]
    brackets = [(end.sticks_at, end.slides_at) for end in ends]
    return [
        replace(end, K_over_W0_err=end.K_over_W0_err * np.sqrt(brackets.count(bracket)))
        for end, bracket in zip(ends, brackets, strict=True)
    ]


def _threshold(group: list[Mapping[str, Any]]) -> Threshold:
    V = float(np.mean([row["V"] for row in group]))
    # The last regime of a recording counts.
    last = [(row["regime"].rpartition(", then ")[2], row["K"] / row["W0"]) for row in group]
    sticking = [stiffness for kind, stiffness in last if kind.startswith(_STICKING)]
    sliding = [stiffness for kind, stiffness in last if kind == "steady sliding"]
    low, high = max(sticking, default=np.nan), min(sliding, default=np.nan)
    reason = ""
    if not sticking or not sliding:
        missing = "stick-slip" if not sticking else "steady sliding"
        reason = f"no recording at {V:.4g} m/s shows {missing}"
    elif max(low, high) > _WIDEST * min(low, high):
        reason = f"at {V:.4g} m/s K/W0 is only known to lie between {low:.4g} and {high:.4g} 1/m"
    if reason:
        none = float("nan")
        return Threshold(V, none, none, none, none, low, high, reason)
    centre, uncertainty = (low + high) / 2, abs(high - low) / np.sqrt(12.0)
    frequency, error = _frequency(group, centre)
    if not np.isfinite(frequency):
        reason = f"at {V:.4g} m/s no cycles near the threshold are small enough for its frequency"
    return Threshold(V, centre, uncertainty, frequency, error, low, high, reason)


def _frequency(group: list[Mapping[str, Any]], centre: float) -> tuple[float, float]:
    """Frequency (Hz) at the threshold, and its standard uncertainty."""
    values, uncertainties, squares, periods, errors = [], [], [], [], []
    for row in group:
        ratio = row["K"] / row["W0"] / centre
        if not 1 / _NEAR < ratio < _NEAR:
            continue
        root = np.sqrt(ratio)
        frequency, error = (row.get(f"linear_frequency{s}") for s in ("", "_uncertainty"))
        if frequency is not None and np.isfinite(frequency):
            values.append(frequency / root)
            # Half of the step to the threshold counts as uncertain.
            uncertainties.append(np.hypot(error / root, values[-1] * abs(root - 1) / 2))
        elif (
            row["regime"] == "regular stick-slip"
            and np.pi * row["drop"] < _SLOPE * row["K"] / row["W0"] * row["V"] * row["recurrence"]
        ):
            squares.append(row["drop"] ** 2)
            periods.append(row["recurrence"] * root)
            errors.append(row["recurrence_uncertainty"])
    if values:
        return weighted_mean(np.array(values), np.array(uncertainties))
    if len(squares) < 2:
        return np.nan, np.nan
    period, uncertainty = _without_drop(*(np.array(a) for a in (squares, periods, errors)))
    if period < (1 - _FARTHEST) * min(periods):
        return np.nan, np.nan
    return 1 / period, uncertainty / period**2


def write_thresholds(path: Path, table: Sequence[Threshold]) -> None:
    """Write thresholds as `asperity recipe` takes them; velocities without one are comments.

    Parameters
    ----------
    path : Path
        CSV in SI without units.
    table : sequence of Threshold
    """
    known = [one for one in table if not one.reason]
    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.writelines(f"# cannot tell: {one.reason}\n" for one in table if one.reason)
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([f"{getattr(one, name):.8g}" for name in COLUMNS] for one in known)
