"""Figures 2 to 9, 11, 14 and 16: the mean friction, and the harmonics of the force."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import (
    APPLIED,
    CurveFigure,
    FigureCurve,
    curves_of_laws,
    elastic_curves,
    speed_curves,
)
from asperity_papers.bureau2000.machine import EXT, LD, RR, SLOW, Float, Machine

#: Velocities per decade in figure 3.
_PER_DECADE = 12
#: Curves of figure 5: the pressure of the air, and the extent of the layer.
VACUUM, AIR, FULL_DISC = "1 mbar", "1 atm", "1 atm, full disc"


# --- Figure 2: change of the mean against eps at 120 Hz ------------------------------------------


def curves_2(machine: Machine) -> list[FigureCurve]:
    """Curves at both velocities, with inertia, at the ends of uncertainties, and of the layer."""
    eps, slow = machine.applied_amplitudes(), machine.velocities[0]
    layer = machine.borne(machine.numbers.frequency, machine.air_layer())
    return [
        *elastic_curves(machine, eps, machine.share),
        FigureCurve("air layer", EXT, slow, eps, layer),
    ]


def _straight_line(machine: Machine, read: FigureNumbers) -> dict[str, Any]:
    """The line through the slow curve above the onset, and the largest departure from it."""
    slow = read.curve(SLOW)
    line = slow[slow[APPLIED] >= machine.numbers.epsilon_onset]
    slope, intercept = np.polyfit(line[APPLIED], line["delta_mu"], 1)
    departure = line["delta_mu"] - slope * line[APPLIED] - intercept
    return {
        "line_slope": slope,
        "line_intercept": intercept,
        "line_departure": np.abs(departure).max(),
    }


#: Change of the mean against eps at 120 Hz.
figure_2 = CurveFigure("figure-02", curves_2, _straight_line)


# --- Figure 3: mean against V for four amplitudes ------------------------------------------------


def velocity_axis(machine: Machine) -> Float:
    """Pulling velocities (m/s) of the lines."""
    low, high = machine.range_of("V_range")
    return np.geomspace(low, high, _PER_DECADE * round(np.log10(high / low)) + 1)


def curves_3(machine: Machine) -> list[FigureCurve]:
    """A curve for each amplitude of the figure."""
    V = velocity_axis(machine)
    amplitudes = machine.numbers["epsilon_figure3"].si_values or ()
    return [FigureCurve(f"eps = {eps:g}", EXT, V, eps, machine.share) for eps in amplitudes]


#: Mean against V for four amplitudes.
figure_3 = CurveFigure("figure-03", curves_3)


# --- Figure 5: air and vacuum at 200 Hz ----------------------------------------------------------


def curves_5(machine: Machine) -> list[FigureCurve]:
    """In vacuum and in air, without and with inertia, and with an air layer under the whole disc.

    The share of the modulation that the contacts bear is 1/|1 - (omega/omega_0)^2| in vacuum, by
    the appendix; in air it is divided by 2.5, the factor by which the paper's data collapse.
    """
    p, eps = machine.numbers, machine.applied_amplitudes()
    V, f = p.V_vacuum, p.frequency_vacuum
    vacuum, disc = (machine.borne(f, layer) for layer in (None, machine.air_layer()))
    shares = {VACUUM: vacuum, AIR: vacuum / p.collapse_divisor_200Hz}
    curves = [FigureCurve(name, EXT, V, eps, share, f) for name, share in shares.items()]
    inertial = [replace(curve, name=f"{curve.name}, inertia", inertia=True) for curve in curves]
    return [*curves, *inertial, FigureCurve(FULL_DISC, EXT, V, eps, disc, f)]


#: Change of the mean in air and in vacuum, at 200 Hz.
figure_5 = CurveFigure("figure-05", curves_5)


# --- Figures 4, 6 to 9, 11, 14 and 16: laws and their harmonics ----------------------------------


#: Rice-Ruina: change of the mean against eps.
figure_6 = CurveFigure(
    "figure-06", lambda machine: speed_curves(machine, RR, machine.applied_amplitudes())
)


#: Rice-Ruina at the slow velocity, with the stated drop at the fitted share.
figure_7 = CurveFigure("figure-07", lambda machine: figure_6.curves(machine)[:1])


#: Harmonics against eps at 120 Hz.
figure_4 = CurveFigure(
    "figure-04",
    lambda machine: elastic_curves(machine, machine.applied_amplitudes(), machine.share),
)


#: Rice-Ruina: harmonics against eps_eff.
figure_8 = CurveFigure(
    "figure-08", lambda machine: speed_curves(machine, RR, machine.borne_amplitudes())
)


def curves_9(machine: Machine) -> list[FigureCurve]:
    """Linker-Dieterich with two coefficients alpha and Rice-Ruina, at both velocities."""
    p = machine.numbers
    two = {f"alpha = {alpha:g}": (LD, {"alpha": alpha}) for alpha in (p.alpha, p.alpha_low)}
    return curves_of_laws(machine, {**two, "RR": (RR, {})})


#: Linker-Dieterich with two coefficients, and Rice-Ruina for comparison.
figure_9 = CurveFigure("figure-09", curves_9)


#: The elasto-plastic law, also at the ends of its parameters' uncertainties, and with inertia.
figure_11 = CurveFigure(
    "figure-11", lambda machine: elastic_curves(machine, machine.borne_amplitudes())
)


def law_curves(machine: Machine) -> list[FigureCurve]:
    """Three laws at both velocities."""
    alpha = {"alpha": float(machine.numbers.alpha)}
    return curves_of_laws(machine, {"RR": (RR, {}), "LD": (LD, alpha), "EXT": (EXT, {})})


#: The three laws on common axes, for the head of the report.
law_figure = CurveFigure("figure-16", law_curves)


def phase_curves(machine: Machine) -> list[FigureCurve]:
    """Three laws, and the elasto-plastic law with inertia, at both velocities."""
    eps = machine.borne_amplitudes()
    inertial = speed_curves(machine, EXT, eps, case="EXT, inertia", inertia=True)
    return [*law_curves(machine), *inertial]


#: Phases against eps_eff, by law and velocity: the paper measures amplitudes with a lock-in
#: amplifier, which gives the phases as well.
phase_figure = CurveFigure("figure-14", phase_curves)
