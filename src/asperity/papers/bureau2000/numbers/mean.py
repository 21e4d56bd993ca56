"""Numbers of the figures on the mean friction: 2, 3, 5, 6 and 7."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.numbers.bands import band_curves, band_ends
from asperity.papers.bureau2000.numbers.curves import FigureCurve, solve_curves
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers, stated
from asperity.papers.bureau2000.numbers.machine import (
    EXT,
    RR,
    applied_amplitudes,
    fitted_share,
    layer_share,
    mu_ss,
    paper,
    vacuum_shares,
    velocities,
    velocity_text,
)

#: Velocities per decade in figure 3.
_PER_DECADE = 12


def inertial_name(name: str) -> str:
    """Name of the curve that counts the mass, beside the curve `name`."""
    return f"{name}, inertia"


def percent_drops(found: FigureNumbers, suffix: str = "") -> tuple[float, ...]:
    """Drop at the largest amplitude in percent of the friction coefficient, slow and fast."""
    return tuple(
        -100 * found.last(velocity_text(V) + suffix, "delta_mu") / mu_ss(V) for V in velocities()
    )


def curves_2() -> list[FigureCurve]:
    """Both velocities, with the mass and at the ends of the uncertainties; the computed layer."""
    eps, share, slow = applied_amplitudes(), fitted_share(), velocities()[0]
    return [
        *(FigureCurve(velocity_text(V), EXT, V, eps, share) for V in velocities()),
        *(
            FigureCurve(inertial_name(velocity_text(V)), EXT, V, eps, share, inertia=True)
            for V in velocities()
        ),
        *band_curves(velocity_text(slow), slow, eps, share),
        FigureCurve("air layer", EXT, slow, eps, layer_share(paper().frequency)),
    ]


def figure_2() -> FigureNumbers:
    """Change of the mean against eps at 120 Hz."""
    seen, share, computed = stated(), fitted_share(), layer_share(paper().frequency)
    slow = velocities()[0]
    names = [velocity_text(V) for V in velocities()]
    found = FigureNumbers(
        name="figure-02",
        place="Figure 2",
        title="The mean friction falls when the load is modulated",
        data=solve_curves(curves_2()),
    )
    slope, intercept, straightness = _straight_line(found, seen.onset)
    drops = [found.last(name, "delta_mu") for name in names]
    relative, inertial = percent_drops(found), percent_drops(found, ", inertia")
    ends = band_ends(found, names[0], "delta_mu", seen.epsilon_eff)
    by_A = [-100 * ends[f"A {end}"] / mu_ss(slow) for end in ("low", "high")]
    return found.described(
        scalars={
            "drop_slow": drops[0],
            "drop_fast": drops[1],
            "relative_drop_slow": relative[0] / 100,
            "relative_drop_fast": relative[1] / 100,
            "relative_drop_inertia_slow": inertial[0] / 100,
            "relative_drop_inertia_fast": inertial[1] / 100,
            **{f"drop {end}": value for end, value in ends.items()},
            "slope": slope,
            "intercept": intercept,
            "departure_from_line": straightness,
            "transmission_air": computed,
        },
        caption=(
            f"Elasto-plastic law, ε_eff = {share:g} ε. At ε = {seen.epsilon:g} the mean falls by "
            f"{relative[0]:.1f} % at 1 µm/s and {relative[1]:.1f} % at 10 µm/s. The text states a "
            "“typical magnitude” of 20 % and names no velocity: the ochre marks are 20 % of the "
            "friction coefficient at 1 µm/s (lower) and at 10 µm/s (upper). Above ε = "
            f"{seen.onset:g} the curve at 1 µm/s stays within {straightness:.4f} of a straight "
            f"line that meets ε = 0 at Δμ̄ = {intercept:+.4f}, as stated not at 0. Band: A, B and λ "
            f"within their published uncertainties, at 1 µm/s (A at constant B − A: {by_A[0]:.1f} "
            f"to {by_A[1]:.1f} %). Dark: with the mass of the slider, {inertial[0]:.1f} and "
            f"{inertial[1]:.1f} %. Dotted: the appendix' own ε_eff/ε = {computed:.2f}."
        ),
        alt=(
            "Change of the mean friction coefficient against the applied modulation amplitude from "
            f"0 to 0.5: nearly straight lines falling to {drops[0]:.3f} at 1 µm/s and "
            f"{drops[1]:.3f} at 10 µm/s; the stated 20 % at 0.5 lies on them. With inertia the "
            f"lines fall further, by {inertial[0]:.0f} and {inertial[1]:.0f} %."
        ),
    )


def _straight_line(found: FigureNumbers, onset: float) -> tuple[float, float, float]:
    """Slope, intercept and largest departure of the line through the slow curve above `onset`."""
    slow = found.curve(velocity_text(velocities()[0]))
    line = slow[slow["epsilon_applied"] >= onset]
    slope, intercept = np.polyfit(line["epsilon_applied"], line["delta_mu"], 1)
    departure = line["delta_mu"] - slope * line["epsilon_applied"] - intercept
    return float(slope), float(intercept), float(np.abs(departure).max())


def curves_3() -> list[FigureCurve]:
    """One for each amplitude of the figure."""
    p, share = paper(), fitted_share()
    low, high = p["V_range"].si_range or (np.nan, np.nan)
    V = np.geomspace(low, high, _PER_DECADE * round(np.log10(high / low)) + 1)
    amplitudes = p["epsilon_figure3"].si_values or ()
    return [FigureCurve(f"eps = {eps:g}", EXT, V, eps, share) for eps in amplitudes]


def figure_3() -> FigureNumbers:
    """Mean against V for four amplitudes."""
    amplitudes = paper()["epsilon_figure3"].si_values or ()
    share = fitted_share()
    data = solve_curves(curves_3())
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
    return found.described(
        scalars={f"slope_{eps:g}": slope for eps, slope in slopes.items()},
        caption=(
            f"Elasto-plastic law, ε_eff = {share:g} ε; each line is named. The text states that "
            "modulation leaves the slope ∂μ̄/∂ln V as it is (ochre: the slope at ε = 0, drawn "
            f"through the strongest modulation at 1 µm/s). In the model it goes from {still:.4f} "
            f"at ε = 0 to {strong:.4f} at ε = {max(slopes):g}: the drop is a constant share of the "
            "friction coefficient rather than a constant. The text says “within experimental "
            "accuracy”."
        ),
        alt=(
            "Mean friction coefficient against pulling velocity from 0.1 to 100 micrometres per "
            "second on a logarithmic axis, for modulation amplitudes 0, 0.2, 0.35 and 0.5: four "
            "straight falling lines, one below the other, nearly parallel; the lowest is less "
            "steep than the stated slope."
        ),
    )


#: Curves of figure 5, with what bears the load.
VACUUM, AIR, FULL_DISC = "1 mbar", "1 atm", "1 atm, full disc"


def curves_5() -> list[FigureCurve]:
    """In vacuum and in air, with the mass too, and under the layer's full disc."""
    p = paper()
    V, f, eps = p.V_vacuum, p.frequency_vacuum, applied_amplitudes()
    vacuum, air = vacuum_shares()
    return [
        FigureCurve(VACUUM, EXT, V, eps, vacuum, f),
        FigureCurve(AIR, EXT, V, eps, air, f),
        FigureCurve(inertial_name(VACUUM), EXT, V, eps, vacuum, f, inertia=True),
        FigureCurve(inertial_name(AIR), EXT, V, eps, air, f, inertia=True),
        FigureCurve(FULL_DISC, EXT, V, eps, layer_share(f), f),
    ]


def figure_5() -> FigureNumbers:
    """Change of the mean in air and in vacuum, at 200 Hz."""
    p, seen = paper(), stated()
    V = p.V_vacuum
    (vacuum, air), disc = vacuum_shares(), layer_share(p.frequency_vacuum)
    data = solve_curves(curves_5())
    found = FigureNumbers(
        name="figure-05",
        place="Figure 5",
        title="Air bears part of the modulation",
        data=data,
    )
    ends = {name: found.last(name, "delta_mu") for name in data["curve"].unique()}
    percent = {name: -100 * value / mu_ss(V) for name, value in ends.items()}
    return found.described(
        scalars={
            "transmission_vacuum": vacuum,
            "transmission_air": disc,
            "air_over_vacuum": disc / vacuum,
            **{f"drop {name}": value for name, value in ends.items()},
        },
        caption=(
            "Elasto-plastic law at 200 Hz and 10 µm/s. In vacuum the contacts bear "
            f"ε_eff = {vacuum:.3f} ε, by the appendix' 1/|1 − ω²/ω₀²|; in air "
            f"{seen.collapse:g} of that, {air:.3f} ε, the factor by which the paper's data "
            "collapse: plotted against ε/2.5, the curve in air falls on that in vacuum. Here 2f "
            "is close to the resonance of the slider on its asperities, which the paper's models "
            "leave out: with the mass of the slider (dark) the drop at ε = 0.5 is "
            f"{percent[inertial_name(AIR)]:.0f} % in air instead of {percent[AIR]:.0f} %, and "
            f"{percent[inertial_name(VACUUM)]:.0f} % in vacuum instead of {percent[VACUUM]:.0f} %. "
            f"Grey: the appendix' layer under its full disc, {disc:.2f} ε, a ratio of "
            f"{disc / vacuum:.2f} to vacuum: half of the stated 0.4, as the paper itself notes."
        ),
        alt=(
            "Change of the mean friction coefficient against modulation amplitude: at 1 millibar "
            f"it falls to {ends[VACUUM]:.2f} at amplitude 0.5, at 1 atmosphere only to "
            f"{ends[AIR]:.2f}; rescaled by 2.5 the curve in air lies on that in vacuum. With "
            f"inertia the two fall to {ends[inertial_name(VACUUM)]:.2f} and "
            f"{ends[inertial_name(AIR)]:.2f}."
        ),
    )


def curves_6() -> list[FigureCurve]:
    """Both velocities."""
    return [FigureCurve(velocity_text(V), RR, V, applied_amplitudes()) for V in velocities()]


def figure_6() -> FigureNumbers:
    """Rice-Ruina: change of the mean against eps, all of the load borne by the contacts."""
    data = solve_curves(curves_6())
    found = FigureNumbers(
        name="figure-06",
        place="Figure 6",
        title="Rice–Ruina, before the air layer is accounted for",
        data=data,
    )
    drops = [found.last(velocity_text(V), "delta_mu") for V in velocities()]
    relative = percent_drops(found)
    return found.described(
        scalars={
            "drop_slow": drops[0],
            "drop_fast": drops[1],
            "relative_drop_slow": relative[0] / 100,
            "relative_drop_fast": relative[1] / 100,
        },
        caption=(
            "Rice–Ruina law with the whole modulation on the contacts. It predicts "
            f"{relative[0]:.0f} % at ε = 0.5 where the text states 20 % (ochre, of the friction "
            "coefficient at 1 and at 10 µm/s): the load that the contacts carry must be smaller. "
            f"The text has a very weak dependence on V: Δμ̄ at the two velocities differs by "
            f"{100 * (drops[0] / drops[1] - 1):.1f} %, its share of μ̄ by "
            f"{relative[0] - relative[1]:.1f} percentage points."
        ),
        alt=(
            "Change of the mean friction coefficient against modulation amplitude by the "
            f"Rice-Ruina law: two close curves falling to {drops[0]:.3f} and {drops[1]:.3f} at "
            "amplitude 0.5, more than twice the stated drop."
        ),
    )


def curves_7() -> list[FigureCurve]:
    """The slow velocity."""
    return curves_6()[:1]


def figure_7() -> FigureNumbers:
    """Rice-Ruina at the slow velocity, and where the fitted share puts the stated drop."""
    seen, slow = stated(), velocities()[0]
    data = solve_curves(curves_7())
    found = FigureNumbers(
        name="figure-07",
        place="Figure 7",
        title="How much of the modulation the contacts bear",
        data=data,
    )
    name, drop = velocity_text(slow), seen.drops[0]
    there = found.at(name, "delta_mu", seen.epsilon_eff)
    rows = found.curve(name)
    needed = float(np.interp(-drop, -rows["delta_mu"], rows["epsilon_eff"]))
    return found.described(
        scalars={
            "drop_at_scaled": there,
            "epsilon_needed": needed,
            "share_needed": needed / seen.epsilon,
        },
        caption=(
            f"Rice–Ruina law at 1 µm/s. At ε_eff = {seen.share:g} × 0.5 it gives Δμ̄ = "
            f"{there:.4f}, and the stated 20 % is Δμ̄ = {drop:.3f}: multiplying ε by {seen.share:g} "
            "(the caption of the paper's Fig. 7 divides by 2.1) brings the one onto the other. "
            f"From that single statement the factor would be {needed / seen.epsilon:.3f}; the "
            "paper fitted all of its points."
        ),
        alt=(
            "The Rice-Ruina curve of the mean friction against amplitude at 1 µm/s; an arrow moves "
            "the stated drop from amplitude 0.5 to 0.24, where it meets the curve."
        ),
    )
