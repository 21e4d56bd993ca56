"""Figures 4, 8, 9, 11 and 14: the harmonics of the force, and their phases."""

from __future__ import annotations

import numpy as np

from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import (
    BORNE,
    FigureCurve,
    band_ends,
    curve_figure,
    elastic_curves,
    speed_curves,
    with_inertia,
)
from asperity_papers.bureau2000.machine import EXT, FAST, LD, RR, SLOW, SPEEDS, Machine

Numbers = dict[str, float]


def pulse_limit(machine: Machine, velocity: float) -> float:
    """Largest mu1 that slip can produce without elastic asperities, 2 V K/(omega W0).

    The spring gains V K/omega per radian; slip in one short pulse a period makes the force a
    sawtooth, whose harmonics n are 2 V K/(n omega W0).
    """
    p = machine.numbers
    return 2 * velocity * p.K / (2 * np.pi * p.frequency * p.W0)


def elastic_slope(machine: Machine, velocity: float) -> float:
    """D mu1/d eps of the velocity-independent plateau, mu l/(1 + l) with l = lambda K/W0."""
    slider = machine.slider(EXT)
    ratio = float(np.asarray(slider.law.elastic_length) * slider.K / slider.W0)
    return float(slider.law.mu_ss(velocity)) * ratio / (1 + ratio)


def late_over_early_slope(numbers: FigureNumbers, curve: str, column: str) -> float:
    """Slope of a curve in its last tenth over its mean slope; small where it saturates."""
    rows = numbers.curve(curve)
    x, y = rows[BORNE].to_numpy(), rows[column].to_numpy()
    tenth = len(x) // 10
    return float((y[-1] - y[-1 - tenth]) / (x[-1] - x[-1 - tenth]) / (y[-1] / x[-1]))


def curves_4(machine: Machine) -> list[FigureCurve]:
    """The elasto-plastic law against eps."""
    return elastic_curves(machine, machine.applied_amplitudes(), machine.share)


@curve_figure("figure-04", curves_4)
def figure_4(machine: Machine, read: FigureNumbers) -> tuple[Numbers, Numbers]:
    """Harmonics against eps at 120 Hz."""
    mu1, mu2 = ([read.last(name, column) for name in SPEEDS] for column in ("mu1", "mu2"))
    inertial = [read.last(with_inertia(name), "mu2") for name in SPEEDS]
    return {
        "mu1_slow": mu1[0],
        "mu1_fast": mu1[1],
        "mu2_slow": mu2[0],
        "mu2_fast": mu2[1],
        "mu2_inertia_slow": inertial[0],
        "mu2_inertia_fast": inertial[1],
        "ratio_slow": mu2[0] / mu1[0],
        "ratio_fast": mu2[1] / mu1[1],
        **{f"mu1 {end}": v for end, v in band_ends(machine, read, "mu1").items()},
    }, {"inertia slow": inertial[0] / mu2[0], "inertia fast": inertial[1] / mu2[1]}


def curves_8(machine: Machine) -> list[FigureCurve]:
    """Rice-Ruina at both velocities."""
    return speed_curves(machine, RR, machine.borne_amplitudes())


@curve_figure("figure-08", curves_8)
def figure_8(machine: Machine, read: FigureNumbers) -> tuple[Numbers, Numbers]:
    """Rice-Ruina: harmonics against eps_eff."""
    limits = [pulse_limit(machine, V) for V in machine.velocities]
    return {
        "growth_mu1": read.last(FAST, "mu1") / read.last(SLOW, "mu1"),
        "growth_mu2": read.last(FAST, "mu2") / read.last(SLOW, "mu2"),
        "share_of_limit": read.last(FAST, "mu1") / limits[1],
        "limit_slow": limits[0],
        "limit_fast": limits[1],
    }, {"limit of mu2, slow": limits[0] / 2, "limit of mu2, fast": limits[1] / 2}


def curves_9(machine: Machine) -> list[FigureCurve]:
    """Two coefficients at both velocities, and Rice-Ruina."""
    p, eps = machine.numbers, machine.borne_amplitudes()
    high, low = (
        speed_curves(machine, LD, eps, case=f"alpha = {a:g}", overrides={"alpha": a})
        for a in (p.alpha, p.alpha_low)
    )
    return [*high, *low, *speed_curves(machine, RR, eps, case="RR")]


@curve_figure("figure-09", curves_9)
def figure_9(machine: Machine, read: FigureNumbers) -> tuple[Numbers, Numbers]:
    """Linker-Dieterich with two coefficients, and Rice-Ruina to hold it against."""
    p, seen = machine.numbers, machine.stated()

    def at(curve: str, column: str) -> float:
        return read.at(curve, column, float(seen.epsilon_eff), BORNE)

    high, low = (f"alpha = {a:g}" for a in (p.alpha, p.alpha_low))
    drops = {name: at(f"{name}, {SLOW}", "delta_mu") for name in (high, low)}
    near = {
        f"low_alpha_{n}": at(f"{low}, {FAST}", n) / at(f"RR, {FAST}", n) - 1
        for n in ("delta_mu", "mu1", "mu2")
    }
    return {
        "share_of_drop": drops[high] / seen.drops[0],
        "low_over_high": drops[low] / drops[high],
        **near,
    }, {f"size of {name}": abs(value) for name, value in near.items()}


def curves_11(machine: Machine) -> list[FigureCurve]:
    """The elasto-plastic law against eps_eff."""
    return elastic_curves(machine, machine.borne_amplitudes())


@curve_figure("figure-11", curves_11)
def figure_11(machine: Machine, read: FigureNumbers) -> tuple[Numbers, Numbers]:
    """The elasto-plastic law, what the uncertainties make of it, and inertia."""
    at, slope = machine.strongest, elastic_slope(machine, machine.velocities[0])
    mu1, mu2, inertial = (
        [read.at(curve, column, at, BORNE) for curve in curves]
        for column, curves in (
            ("mu1", SPEEDS), ("mu2", SPEEDS), ("mu2", map(with_inertia, SPEEDS))
        )
    )  # fmt: skip
    return {
        "growth_mu1": mu1[1] / mu1[0],
        "growth_mu2": mu2[1] / mu2[0],
        "late_over_early_slow": late_over_early_slope(read, SLOW, "mu1"),
        "late_over_early_fast": late_over_early_slope(read, FAST, "mu1"),
        "over_plateau": mu1[0] / (at * slope),
        "elastic_slope": slope,
        "inertia_mu2_slow": inertial[0] / mu2[0],
        "inertia_mu2_fast": inertial[1] / mu2[1],
        **{f"mu1 {end}": v for end, v in band_ends(machine, read, "mu1").items()},
    }, {}


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
