"""Figures 4, 8, 9, 11 and 14: the harmonics of the force, and their phases."""

from __future__ import annotations

import numpy as np

from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import (
    BORNE,
    CurveFigure,
    FigureCurve,
    curve_figure,
    elastic_curves,
    speed_curves,
    with_inertia,
)
from asperity_papers.bureau2000.machine import EXT, LD, RR, Machine

Numbers = dict[str, float]


def curves_4(machine: Machine) -> list[FigureCurve]:
    """The elasto-plastic law against eps."""
    return elastic_curves(machine, machine.applied_amplitudes(), machine.share)


#: Harmonics against eps at 120 Hz.
figure_4 = CurveFigure("figure-04", curves_4)


def curves_8(machine: Machine) -> list[FigureCurve]:
    """Rice-Ruina at both velocities."""
    return speed_curves(machine, RR, machine.borne_amplitudes())


#: Rice-Ruina: harmonics against eps_eff.
figure_8 = CurveFigure("figure-08", curves_8)


def curves_9(machine: Machine) -> list[FigureCurve]:
    """Two coefficients at both velocities, and Rice-Ruina."""
    p, eps = machine.numbers, machine.borne_amplitudes()
    high, low = (
        speed_curves(machine, LD, eps, case=f"alpha = {a:g}", overrides={"alpha": a})
        for a in (p.alpha, p.alpha_low)
    )
    return [*high, *low, *speed_curves(machine, RR, eps, case="RR")]


#: Linker-Dieterich with two coefficients, and Rice-Ruina to hold it against.
figure_9 = CurveFigure("figure-09", curves_9)


def curves_11(machine: Machine) -> list[FigureCurve]:
    """The elasto-plastic law against eps_eff."""
    return elastic_curves(machine, machine.borne_amplitudes())


#: The elasto-plastic law, what the uncertainties make of it, and inertia.
figure_11 = CurveFigure("figure-11", curves_11)


def phase_curves(machine: Machine) -> list[FigureCurve]:
    """Three laws, and the elasto-plastic one with the mass, at both velocities."""
    eps, alpha = machine.borne_amplitudes(), {"alpha": float(machine.numbers.alpha)}
    return [
        *speed_curves(machine, RR, eps, case="RR"),
        *speed_curves(machine, LD, eps, case="LD", overrides=alpha),
        *speed_curves(machine, EXT, eps, case="EXT"),
        *speed_curves(machine, EXT, eps, case=with_inertia("EXT"), inertia=True),
    ]


@curve_figure("figure-14", phase_curves)
def phase_figure(machine: Machine, read: FigureNumbers) -> tuple[Numbers, Numbers]:
    """Phases against eps_eff, by law and velocity.

    The paper measures amplitudes with a lock-in amplifier, which gives the phases as well.
    """
    return {
        f"{column} {curve}": float(np.degrees(read.at(curve, column, machine.strongest, BORNE)))
        for curve in read.data["curve"].unique()
        for column in ("phase1", "phase2")
    }, {}
