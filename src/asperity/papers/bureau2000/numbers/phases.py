"""A figure of our own: phases of the first and second harmonic, which the paper does not report.

It measures amplitudes with a lock-in amplifier, which gives the phases as well.
"""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.numbers.curves import FigureCurve, solve_curves
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers, stated
from asperity.papers.bureau2000.numbers.machine import (
    EXT,
    LD,
    RR,
    borne_amplitudes,
    paper,
    velocities,
    velocity_text,
)

#: What is compared: name to law, parameters that replace the paper's, and whether the mass counts.
CASES: dict[str, tuple[str, dict[str, float], bool]] = {
    "RR": (RR, {}, False),
    "LD": (LD, {"alpha": float(paper().alpha)}, False),
    "EXT": (EXT, {}, False),
    "EXT, inertia": (EXT, {}, True),
}


def phase_figure() -> FigureNumbers:
    """Phases against eps_eff, by law and velocity."""
    data = solve_curves(
        FigureCurve(
            f"{name}, {velocity_text(V)}", law, V, borne_amplitudes(), overrides=overrides,
            inertia=inertia,
        )
        for name, (law, overrides, inertia) in CASES.items()
        for V in velocities()
    )  # fmt: skip
    found = FigureNumbers("figure-14", "A figure of our own", "Phases of the harmonics", data)
    at = stated().epsilon_eff
    degrees = {
        f"{column} {curve}": float(np.degrees(found.at(curve, column, at)))
        for curve in data["curve"].unique()
        for column in ("phase1", "phase2")
    }
    rigid, elastic = degrees["phase1 RR, 1 um/s"], degrees["phase1 EXT, 1 um/s"]
    return found.described(
        scalars=degrees,
        caption=(
            "Phases against the load (cosine convention, F/W₀ = mean + Σ μₙ cos(nωt + φₙ)). The "
            "paper reports amplitudes only, but its lock-in amplifier has the phases too, and "
            "they tell the models apart at one amplitude and one velocity: at 1 µm/s and "
            f"ε_eff = {at:g} the first harmonic is at {rigid:+.0f}° by Rice–Ruina, whose slip "
            f"lags the load by a quarter of a period, and at {elastic:+.0f}° with elastic "
            "asperities, which follow the load at once."
        ),
        alt=(
            "Phase of the first and of the second harmonic against effective amplitude, by law "
            f"and velocity: at 1 µm/s the first harmonic lies near {rigid:.0f} degrees by the "
            f"Rice-Ruina law and near {elastic:.0f} degrees by the elasto-plastic one."
        ),
    )
