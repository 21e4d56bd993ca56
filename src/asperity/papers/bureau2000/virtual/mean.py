"""Figures 2 and 3 of the virtual experiment: the mean friction at 120 Hz."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from asperity.papers.bureau2000.numbers.curves import FigureCurve, solve_curves
from asperity.papers.bureau2000.numbers.machine import EXT, Float, applied_amplitudes, paper
from asperity.papers.bureau2000.virtual.apparatus import state_coefficient
from asperity.papers.bureau2000.virtual.numbers import (
    Read,
    RecoveredQuantity,
    VirtualNumbers,
    ratio,
    scalars,
    with_model,
)
from asperity.papers.bureau2000.virtual.recordings import (
    NORMAL,
    POINT_COLUMNS,
    Series,
    SimulatedPoints,
    all_series,
)

#: Velocities per decade of the lines of Figure 3, as in the model's own.
_PER_DECADE = 12


def lines_over_amplitude(series: tuple[Series, ...]) -> pd.DataFrame:
    """The model's lines of some series, with the machine's parameters."""
    return solve_curves(
        FigureCurve(
            one.name, EXT, one.velocity, applied_amplitudes(), abs(one.transfer), one.frequency,
            overrides={"B": state_coefficient()},
        )
        for one in series
    )  # fmt: skip


def virtual_2(readings: SimulatedPoints) -> VirtualNumbers:
    """Change of the mean against eps, at two velocities."""
    slow, fast = pair = all_series()[:2]
    lines = lines_over_amplitude(pair)
    points = with_model(pd.concat([readings[one.name] for one in pair]), lines)
    numbers = VirtualNumbers(
        "virtual-02", "Figure 2, simulated", "The mean falls, as read off simulated recordings",
        lines, points=points, series=pair,
    )  # fmt: skip
    drops = [numbers.last_point(one.name, "delta_mu") for one in pair]
    still = [numbers.last_point(one.name, "static_friction") for one in pair]
    shares = [ratio(drop, F0) for drop, F0 in zip(drops, still, strict=True)]
    weak = numbers.of(slow.name).iloc[0]
    recovered = (
        *(
            RecoveredQuantity(
                f"Share of the mean that ε = 0.5 takes, {one.name}", -value, sigma,
                -true_value, "20 %",
            )
            for one, (value, sigma, true_value) in zip(pair, shares, strict=True)
        ),
        RecoveredQuantity(
            f"Drop at {fast.name} over that at {slow.name}", *ratio(drops[1], drops[0]),
            "1, within accuracy",
        ),
    )  # fmt: skip
    return replace(numbers, recovered=recovered).described(
        scalars=scalars(recovered),
        caption=(
            f"SIMULATED. At ε = 0.5 the readings have a drop of {-100 * shares[0][0]:.2f} ± "
            f"{100 * NORMAL * shares[0][1]:.2f} % at 1 µm/s and {-100 * shares[1][0]:.2f} ± "
            f"{100 * NORMAL * shares[1][1]:.2f} % at 10 µm/s (95 %); the text states 20 %, "
            "whatever the velocity. At ε = 0.05, where the text finds the drop just above its "
            f"noise, it is {weak['delta_mu']:.4f} ± {NORMAL * weak['delta_mu_uncertainty']:.4f} "
            "here. Lines: the elasto-plastic law with the same parameters."
        ),
        alt=(
            "Simulated: change of the mean friction coefficient against the applied modulation "
            "amplitude, open circles for 1 and full circles for 10 micrometres per second, with "
            f"error bars; both fall to about {drops[0][0]:.2f} at amplitude 0.5 and lie on the "
            "model's lines."
        ),
    )


def virtual_3(readings: SimulatedPoints) -> VirtualNumbers:
    """Mean against V for four amplitudes."""
    at_120_hz = (one for one in all_series() if one.frequency == paper().frequency)
    series = tuple(sorted(at_120_hz, key=lambda one: one.velocity))
    amplitudes = paper()["epsilon_figure3"].si_values or ()
    lines = _lines_over_velocity(amplitudes, abs(series[0].transfer))
    tables = [
        rows
        for one in series
        for rows in (_still(readings[one.name]), _among(readings[one.name], amplitudes))
    ]
    points = with_model(pd.concat(tables, ignore_index=True), lines)
    numbers = VirtualNumbers(
        "virtual-03", "Figure 3, simulated", "Friction against velocity, as read", lines,
        points=points, series=series,
    )  # fmt: skip
    slopes = {e: _slope(points[points["epsilon_set"] == e]) for e in amplitudes}
    still, strong = slopes[min(slopes)], slopes[max(slopes)]
    change = strong[0] - still[0], float(np.hypot(strong[1], still[1])), strong[2] - still[2]
    recovered = (
        RecoveredQuantity("Slope of the mean over ln V at ε = 0", *still, "A − B"),
        RecoveredQuantity("Change of the slope by ε = 0.5", *change, "0, within accuracy"),
    )
    return replace(numbers, recovered=recovered).described(
        scalars=scalars(recovered) | {f"slope_{e:g}": slope[0] for e, slope in slopes.items()},
        caption=(
            "SIMULATED, at 1 to 100 µm/s of the paper’s 0.1 to 100. Points at ε = 0: all F(0) of "
            f"the protocol. The slope is {still[0]:.4f} at ε = 0, A − B of the machine, and "
            f"changes by {change[0]:+.4f} ± {NORMAL * change[1]:.4f} (95 %) at ε = 0.5: the model "
            f"has {change[2]:+.4f}, the text finds no change “within experimental accuracy”. "
            "Below: readings less the model, moved apart sideways."
        ),
        alt=(
            "Simulated: mean friction coefficient against pulling velocity from 1 to 100 "
            "micrometres per second on a logarithmic axis, for modulation amplitudes 0, 0.2, 0.35 "
            "and 0.5: four rows of symbols that fall slowly, one below the other and nearly "
            "parallel, on the model's lines."
        ),
    )


def _lines_over_velocity(amplitudes: tuple[float, ...], transmission: float) -> pd.DataFrame:
    low, high = paper()["V_range"].si_range or (np.nan, np.nan)
    V: Float = np.geomspace(low, high, _PER_DECADE * round(np.log10(high / low)) + 1)
    overrides = {"B": state_coefficient()}
    return solve_curves(
        FigureCurve(f"eps = {e:g}", EXT, V, e, transmission, overrides=overrides)
        for e in amplitudes
    )


def _still(rows: pd.DataFrame) -> pd.DataFrame:
    """One point of eps = 0: the mean of all F(0) of a series, and how they differ."""
    F0 = rows["static_friction"]
    stated, scatter = float(np.sqrt(np.mean(rows["static_friction_stated"] ** 2))), F0.std()
    one = dict.fromkeys(POINT_COLUMNS, np.nan) | {
        name: rows[name].iloc[0] for name in ("series", "V", "frequency", "seeds")
    }
    for name in ("epsilon_set", "epsilon", "epsilon_eff"):
        one[name] = 0.0
    for name in ("mean_friction", "static_friction"):
        one |= {name: F0.mean(), f"{name}_stated": stated, f"{name}_scatter": scatter}
        one[f"{name}_uncertainty"] = max(stated, scatter)
    return pd.DataFrame([one])[list(rows.columns)]


def _among(rows: pd.DataFrame, amplitudes: tuple[float, ...]) -> pd.DataFrame:
    return rows[rows["epsilon_set"].isin(amplitudes)]


def _slope(rows: pd.DataFrame) -> Read:
    """Slope over ln V of the readings, its uncertainty, and the same of the model.

    All velocities count alike, so that what is fitted does not depend on the noise.
    """
    x = np.log(rows["V"].to_numpy())
    share = (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    value, sigma, model = (
        rows[f"mean_friction{name}"].to_numpy() for name in ("", "_uncertainty", "_model")
    )
    return float(share @ value), float(np.sqrt(share**2 @ sigma**2)), float(share @ model)
