"""Numbers of the figures on the mean friction: 2, 3, 5, 6 and 7."""

from __future__ import annotations

import numpy as np

from asperity.air import AirLayer, effective_modulation
from asperity.study.paper.curves import Curve, solve_curves
from asperity.study.paper.machine import (
    EXT,
    RR,
    applied_amplitudes,
    fitted_transmission,
    mu_ss,
    paper,
    velocities,
    velocity_text,
)
from asperity.study.paper.numbers import FigureNumbers, stated

#: Velocities per decade in figure 3.
_PER_DECADE = 12


def air_transmission(frequency: float, *, vacuum: bool = False) -> float:
    """eps_eff/eps of the appendix, with its layer of air or without."""
    p = paper()
    layer = None if vacuum else AirLayer(P0=p.P0, h0=p.h0, eta=p.eta_air, R=p.R)
    return float(effective_modulation(frequency, W0=p.W0, M=p.M, lambda_z=p.lambda_z, layer=layer))


def figure_2() -> FigureNumbers:
    """Change of the mean against eps at 120 Hz."""
    p, seen = paper(), stated()
    computed = air_transmission(p.frequency)
    curves = [
        Curve(velocity_text(V), EXT, V, applied_amplitudes(), fitted_transmission())
        for V in velocities()
    ]
    curves.append(Curve("air layer", EXT, velocities()[0], applied_amplitudes(), computed))
    data = solve_curves(curves)
    found = FigureNumbers(
        name="figure-02",
        place="Figure 2",
        title="The mean friction falls when the load is modulated",
        data=data,
    )
    slope, intercept, straightness = _straight_line(found, seen.onset)
    drops = [found.last(velocity_text(V), "delta_mu") for V in velocities()]
    relative = [100 * -d / mu_ss(V) for d, V in zip(drops, velocities(), strict=True)]
    return found.told(
        scalars={
            "drop_slow": drops[0],
            "drop_fast": drops[1],
            "relative_drop_slow": relative[0] / 100,
            "relative_drop_fast": relative[1] / 100,
            "slope": slope,
            "intercept": intercept,
            "departure_from_line": straightness,
            "transmission_air": computed,
        },
        caption=(
            f"Elasto-plastic law, ε_eff = ε/2.1. At ε = {seen.epsilon:g} the mean falls by "
            f"{relative[0]:.1f} % at 1 µm/s and {relative[1]:.1f} % at 10 µm/s; the text states "
            f"20 %. Above ε = {seen.onset:g} the curve at 1 µm/s stays within {straightness:.4f} "
            f"of a straight line that meets ε = 0 at Δμ̄ = {intercept:+.4f}, as stated not at 0. "
            f"Dotted: the same with the appendix' own ε_eff/ε = {computed:.2f}."
        ),
        alt=(
            "Change of the mean friction coefficient against the applied modulation amplitude from "
            f"0 to 0.5: nearly straight lines falling to {drops[0]:.3f} at 1 µm/s and "
            f"{drops[1]:.3f} at 10 µm/s; the stated 20 % at 0.5 lies on them."
        ),
    )


def _straight_line(found: FigureNumbers, onset: float) -> tuple[float, float, float]:
    """Slope, intercept and largest departure of the line through the slow curve above `onset`."""
    slow = found.curve(velocity_text(velocities()[0]))
    line = slow[slow["epsilon_applied"] >= onset]
    slope, intercept = np.polyfit(line["epsilon_applied"], line["delta_mu"], 1)
    departure = line["delta_mu"] - slope * line["epsilon_applied"] - intercept
    return float(slope), float(intercept), float(np.abs(departure).max())


def figure_3() -> FigureNumbers:
    """Mean against V for four amplitudes."""
    p = paper()
    low, high = p["V_range"].si_range or (np.nan, np.nan)
    V = np.geomspace(low, high, _PER_DECADE * round(np.log10(high / low)) + 1)
    amplitudes = p["epsilon_figure3"].si_values or ()
    data = solve_curves(
        Curve(f"eps = {eps:g}", EXT, V, eps, fitted_transmission()) for eps in amplitudes
    )
    found = FigureNumbers(
        name="figure-03",
        place="Figure 3",
        title="Modulation shifts the friction–velocity curve down",
        data=data,
    )
    slopes = {}
    for eps in amplitudes:
        rows = found.curve(f"eps = {eps:g}")
        slopes[eps] = float(np.polyfit(np.log(rows["V"]), rows["mean_friction"], 1)[0])
    still, strong = slopes[min(slopes)], slopes[max(slopes)]
    return found.told(
        scalars={f"slope_{eps:g}": slope for eps, slope in slopes.items()},
        caption=(
            "Elasto-plastic law, ε_eff = ε/2.1. The text states that modulation leaves the slope "
            f"∂μ̄/∂ln V as it is. In the model it goes from {still:.4f} at ε = 0 to {strong:.4f} "
            f"at ε = {max(slopes):g}: the drop is a constant share of the friction coefficient "
            "rather than a constant. The text says “within experimental accuracy”."
        ),
        alt=(
            "Mean friction coefficient against pulling velocity from 0.1 to 100 micrometres per "
            "second on a logarithmic axis, for modulation amplitudes 0, 0.2, 0.35 and 0.5: four "
            "straight falling lines, one below the other, nearly parallel."
        ),
    )


def figure_5() -> FigureNumbers:
    """Change of the mean in air and in vacuum, at 200 Hz."""
    p = paper()
    V, f, eps = p.V_vacuum, p.frequency_vacuum, applied_amplitudes()
    vacuum, air = air_transmission(f, vacuum=True), air_transmission(f)
    data = solve_curves(
        [
            Curve("1 mbar", EXT, V, eps, 1.0, f),
            Curve("1 atm", EXT, V, eps, 1 / p.collapse_divisor_200Hz, f),
            Curve("1 mbar, air layer", EXT, V, eps, vacuum, f),
            Curve("1 atm, air layer", EXT, V, eps, air, f),
        ]
    )
    found = FigureNumbers(
        name="figure-05",
        place="Figure 5",
        title="Air bears part of the modulation",
        data=data,
    )
    ends = {name: found.last(name, "delta_mu") for name in data["curve"].unique()}
    return found.told(
        scalars={
            "transmission_vacuum": vacuum,
            "transmission_air": air,
            "air_over_vacuum": air / vacuum,
            **{f"drop {name}": value for name, value in ends.items()},
        },
        caption=(
            "Elasto-plastic law at 200 Hz and 10 µm/s. Bold: what the text states, ε_eff = ε in "
            "vacuum and ε/2.5 in air, so that the curve in air plotted against ε/2.5 falls on that "
            "in vacuum. Thin: what the appendix' model of the layer gives from its own inputs, "
            f"ε_eff/ε = {vacuum:.2f} in vacuum (inertia) and {air:.2f} in air: a ratio of "
            f"{air / vacuum:.2f}, half of the stated 0.4, as the paper itself notes."
        ),
        alt=(
            "Change of the mean friction coefficient against modulation amplitude: at 1 millibar "
            f"it falls to {ends['1 mbar']:.2f} at amplitude 0.5, at 1 atmosphere only to "
            f"{ends['1 atm']:.2f}; rescaled by 2.5 the curve in air lies on that in vacuum."
        ),
    )


def figure_6() -> FigureNumbers:
    """Rice-Ruina: change of the mean against eps, all of the load borne by the contacts."""
    data = solve_curves(Curve(velocity_text(V), RR, V, applied_amplitudes()) for V in velocities())
    found = FigureNumbers(
        name="figure-06",
        place="Figure 6",
        title="Rice–Ruina, before the air layer is accounted for",
        data=data,
    )
    drops = [found.last(velocity_text(V), "delta_mu") for V in velocities()]
    relative = [100 * -d / mu_ss(V) for d, V in zip(drops, velocities(), strict=True)]
    return found.told(
        scalars={
            "drop_slow": drops[0],
            "drop_fast": drops[1],
            "relative_drop_slow": relative[0] / 100,
            "relative_drop_fast": relative[1] / 100,
        },
        caption=(
            "Rice–Ruina law with the whole modulation on the contacts. It predicts "
            f"{relative[0]:.0f} % at ε = 0.5 where the text states 20 %: the load that the "
            "contacts carry must be smaller. The text has a very weak dependence on V: Δμ̄ at the "
            f"two velocities differs by {100 * (drops[0] / drops[1] - 1):.1f} %, its share of μ̄ by "
            f"{relative[0] - relative[1]:.1f} percentage points."
        ),
        alt=(
            "Change of the mean friction coefficient against modulation amplitude by the "
            f"Rice-Ruina law: two close curves falling to {drops[0]:.3f} and {drops[1]:.3f} at "
            "amplitude 0.5, more than twice the stated drop."
        ),
    )


def figure_7() -> FigureNumbers:
    """Rice-Ruina at the slow velocity, and where the stated scaling puts the stated drop."""
    seen, slow = stated(), velocities()[0]
    data = solve_curves([Curve(velocity_text(slow), RR, slow, applied_amplitudes())])
    found = FigureNumbers(
        name="figure-07",
        place="Figure 7",
        title="How much of the modulation the contacts bear",
        data=data,
    )
    rows = found.curve(velocity_text(slow))
    there = float(np.interp(seen.epsilon_eff, rows["epsilon_eff"], rows["delta_mu"]))
    needed = float(np.interp(-seen.drop[0], -rows["delta_mu"], rows["epsilon_eff"]))
    return found.told(
        scalars={
            "drop_at_scaled": there,
            "epsilon_needed": needed,
            "divisor": seen.epsilon / needed,
        },
        caption=(
            f"Rice–Ruina law at 1 µm/s. At ε_eff = 0.5/2.1 it gives Δμ̄ = {there:.4f}, and the "
            f"stated 20 % is Δμ̄ = {seen.drop[0]:.3f}: dividing ε by 2.1 brings the one onto the "
            f"other. From that single statement the divisor would be {seen.epsilon / needed:.2f}; "
            "the paper fitted all of its points."
        ),
        alt=(
            "The Rice-Ruina curve of the mean friction against amplitude at 1 µm/s; an arrow moves "
            "the stated drop from amplitude 0.5 to 0.5 divided by 2.1, where it meets the curve."
        ),
    )
