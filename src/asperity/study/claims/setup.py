"""Claims of section II.A: the machine, and the steadiness of sliding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.solve import PeriodicResponse
from asperity.solve import closed_forms as cf
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged
from asperity.study.claims.curves import (
    APPLIED,
    EXT,
    STRONGEST,
    at,
    both,
    curve,
    paper,
    small_modulation,
    velocities,
)
from asperity.study.claims.features import Pair


def claims() -> list[Claim]:
    """All claims of section II.A."""
    return [
        _most_compliant(),
        _dead_weight(),
        _away_from_resonance(),
        _steady_without_modulation(),
        _no_stick_slip(),
    ]


def _most_compliant() -> Claim:
    p = paper()
    lightest, _ = p["W0_range"].si_range or (np.nan, np.nan)
    ratio = lightest / p.lambda_ / p.K
    return judged(
        rules.above(rules.MUCH, "stiffness of the asperities over that of the spring"),
        {"3 N": ratio},
        id="spring-most-compliant",
        place="Section II.A",
        statement="The leaf spring is the most compliant part of the system.",
        stated="more compliant",
        computed=f"asperities {ratio:.0f} times stiffer at 3 N, {p.W0 / p.lambda_ / p.K:.0f} at 7 "
        "N",
        how="kappa_asp = W0/lambda with lambda = 0.7 um, K = 0.2 N/um.",
        why="Even so the asperities dominate mu1: their stiffness is modulated.",
    )


def _dead_weight() -> Claim:
    p, standard_gravity = paper(), 9.80665
    weight = p.M * standard_gravity
    return judged(
        rules.rounds_to(p.slider_weight, 1, "weight in N"),
        {"weight": weight},
        id="dead-weight",
        place="Section II.A; Appendix",
        statement="The slider weighs 16 N and has a mass of 1.6 kg.",
        stated=str(p["slider_weight"]),
        computed=f"{weight:.1f} N",
        how="M g with M = 1.6 kg, g = 9.80665 m/s^2.",
        why="The mass is the weight over g, rounded.",
    )


def _away_from_resonance() -> Claim:
    p = paper()
    natural = {
        "spring": np.sqrt(p.K / p.M),
        "asperities, tangential": np.sqrt(p.W0 / (p.lambda_ * p.M)),
        "asperities, normal": np.sqrt(p.W0 / (p.lambda_z * p.M)),
    }
    hertz = {name: float(w / (2 * np.pi)) for name, w in natural.items()}
    distance = {
        f"{f:g} Hz": min(abs(f / own - 1) for own in hertz.values())
        for f in (p.frequency, p.frequency_vacuum)
    }
    listed = ", ".join(f"{name} {f:.0f} Hz" for name, f in hertz.items())
    return judged(
        rules.above(rules.QUASI, "relative distance to the nearest natural frequency"),
        distance,
        id="away-from-resonance",
        place="Section II.A",
        statement="120 and 200 Hz are away from any mechanical resonance of the setup.",
        stated="away",
        computed=listed,
        how="sqrt(K/M), sqrt(W0/(lambda M)), sqrt(W0/(lambda_z M)) over 2 pi.",
        why="True of the excitation, not of its overtones: 3 x 120 Hz and 2 x 200 Hz lie within 10 "
        "% "
        "and 1 % of the tangential contact resonance.",
    )


def _steady_without_modulation() -> Claim:
    p = paper()
    point = small_modulation(velocities()[0], lambda_=p.lambda_)
    ratio = p.K / float(cf.critical_stiffness_elastic(point))
    growth = at(curve(EXT).floquet_max, APPLIED[0])
    return judged(
        rules.above(1, "K/Kc"),
        {"elasto-plastic": ratio, "Rice-Ruina": p.K / float(cf.critical_stiffness(point))},
        id="steady-without-modulation",
        place="Section II.A",
        statement="At eps = 0 the slider slides steadily at the W0 and V of the experiments.",
        stated="steady sliding",
        computed=f"K/Kc = {ratio:.2f}: unstable; leading multiplier per period at eps = 0.005 "
        f"{both(growth, 5)}",
        how="Kc = (B - A) W0/(D0 + A lambda) at the central values; Floquet multipliers.",
        why="B - A = 0.013 +- 0.011: within their uncertainties A and B allow K/Kc from 0.5 to "
        "above 5, so that the experiments and the law are compatible.",
    )


def stabilising_amplitude(r: PeriodicResponse) -> Pair:
    """Applied amplitude at which the leading multiplier of a curve enters the unit circle."""
    logs = np.log(r.floquet_max)

    def crossing(row: NDArray[np.float64]) -> float:
        # Falls with eps; np.interp wants its abscissae to rise.
        return float(np.interp(0.0, row[::-1], APPLIED[::-1]))

    return crossing(logs[0]), crossing(logs[1])


def _no_stick_slip() -> Claim:
    r = curve(EXT)
    worst = max(at(r.floquet_max, eps)[1] for eps in APPLIED if eps <= STRONGEST)
    return judged(
        rules.below(1, "leading Floquet multiplier at every amplitude from 0.005 to 0.5"),
        {"10 um/s": worst},
        id="no-stick-slip-under-modulation",
        place="Section II.A",
        statement="With eps > 0 the force shows no low-frequency stick-slip oscillation.",
        stated="none",
        computed=f"stable from eps = {both(stabilising_amplitude(r), 2)} on, unstable below",
        how="Elasto-plastic law, periodic orbits at the central parameters; Floquet multipliers.",
        why="The central values put K/Kc just below 1. Modulation stabilises sliding, and at the "
        "large amplitudes the statement holds even there.",
    )
