"""Claims of section III.A.1: the scales of the problem and what may be neglected."""

from __future__ import annotations

import numpy as np

from asperity.slider import Slider
from asperity.solve import closed_forms as cf
from asperity.solve.ageing_response import ageing_response
from asperity.solve.perturbation import perturbation_response
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged
from asperity.study.claims.curves import (
    APPLIED,
    RR,
    ageless_changes,
    at,
    curve,
    paper,
    slider,
    small_modulation,
    velocities,
)
from asperity.study.claims.perturbative import TOLERANCE


def claims() -> list[Claim]:
    """All claims about scales and orders of magnitude."""
    return [
        _critical_stiffness(),
        _critical_pulsation(),
        _inertial_pulsation(),
        _contrast(),
        _pulsation_number(),
        _slow_bifurcation(),
        _stiffness_ratio(),
        _determinant_limit(),
        _inertia_negligible(),
        _velocity_gain(),
        _out_of_reach(),
        _age_negligible(),
    ]


def _critical_stiffness() -> Claim:
    V = velocities()[1]
    Kc = float(cf.critical_stiffness(small_modulation(V)))
    growth = _growth_rate(Kc) * paper().D0 / V
    return judged(
        rules.change_below(1e-6, "growth rate at K = Kc, in units of V/D0,"),
        {"growth rate": float(growth.real)},
        id="critical-stiffness",
        place="Section III.A.1, Eq. (18)",
        statement="Kc = (B - A) W0/D0 is the critical stiffness of the stick-slip bifurcation.",
        stated="Kc = (B - A) W0/D0",
        computed=f"Kc = {1e-6 * Kc:.4f} N/um; growth rate there {growth.real:.1e} V/D0",
        how="Eigenvalues of steady sliding of the Rice-Ruina law by automatic differentiation.",
        why="Correct for rigid asperities without inertia.",
    )


def _growth_rate(K: float) -> complex:
    """Leading eigenvalue (1/s) of unmodulated Rice-Ruina sliding at 10 um/s."""
    s = Slider(slider(RR).law, spring=K, load=paper().W0)
    r = perturbation_response(s, velocity=velocities()[1], frequency=paper().frequency)
    return complex(r.eigenvalues[0])


def _critical_pulsation() -> Claim:
    point = small_modulation(velocities()[1])
    stated = float(cf.critical_pulsation(point))
    found = abs(_growth_rate(float(cf.critical_stiffness(point))).imag)
    return judged(
        rules.agrees(stated, TOLERANCE, "pulsation at K = Kc"),
        {"pulsation": found},
        id="critical-pulsation",
        place="Section III.A.1, Eq. (19)",
        statement="wc = sqrt((B - A)/A) V/D0 is the critical pulsation of stick-slip.",
        stated="wc = sqrt((B - A)/A) V/D0",
        computed=f"{stated:.3f} 1/s by the formula, {found:.3f} 1/s from the eigenvalues",
        how="Imaginary part of the eigenvalue of steady sliding at K = Kc, 10 um/s.",
        why="K = Kc makes the eigenvalues purely imaginary; wc does not depend on K.",
    )


def _inertial_pulsation() -> Claim:
    value = float(cf.inertial_pulsation(small_modulation(velocities()[1], M=paper().M)))
    return judged(
        rules.about(paper().omega0, "sqrt(K/M) in 1/s"),
        {"sqrt(K/M)": value},
        id="inertial-pulsation",
        place="Section III.A.1",
        statement="w0 = sqrt(K/M) is about 360 1/s.",
        stated=str(paper()["omega0"]),
        computed=f"{value:.1f} 1/s",
        how="K = 0.2 N/um, M = 1.6 kg.",
        why="Rounded upwards.",
    )


def _contrast() -> Claim:
    p = paper()
    value = (p.B - p.A) / p.A
    return judged(
        rules.rounds_to(1, 1, "(B - A)/A"),
        {"(B - A)/A": value},
        id="contrast",
        place="Section III.A.1",
        statement="(B - A)/A is of order 1.",
        stated=str(p["rate_state_contrast"]),
        computed=f"{value:.3g}",
        how="A = 0.013, B = 0.026.",
        why="Exactly 1 at the central values, about which it is uncertain by a factor of several.",
    )


def _pulsation_number() -> Claim:
    value = float(cf.critical_pulsation(small_modulation(velocities()[1])))
    return judged(
        rules.about(paper().omega_c, "wc in 1/s"),
        {"10 um/s": value},
        id="critical-pulsation-number",
        place="Section III.A.1",
        statement="At 10 um/s wc is about 25 1/s.",
        stated=str(paper()["omega_c"]),
        computed=f"{value:.1f} 1/s",
        how="Eq. (19).",
        why="Exact.",
    )


def _slow_bifurcation() -> Claim:
    point = small_modulation(velocities()[1], M=paper().M)
    wc = float(cf.critical_pulsation(point))
    return judged(
        rules.below(1 / rules.MUCH, "wc over the other pulsation"),
        {
            "wc/w": wc / float(point.omega),
            "wc/w0": wc / float(cf.inertial_pulsation(point)),
        },
        id="slow-bifurcation",
        place="Section III.A.1; Section III.D",
        statement="wc is much smaller than w and w0.",
        stated="wc << w, w0",
        computed=f"wc/w = {wc / float(point.omega):.3f}, "
        f"wc/w0 = {wc / float(cf.inertial_pulsation(point)):.3f} at 10 um/s",
        how="Eq. (19), 120 Hz, sqrt(K/M).",
        why="The modulation is far above the stick-slip frequency.",
    )


def _stiffness_ratio() -> Claim:
    value = paper().K / float(cf.critical_stiffness(small_modulation(velocities()[1])))
    return judged(
        rules.above(1 - rules.ABOUT, "K/Kc"),
        {"K/Kc": value},
        id="stiffness-ratio",
        place="Section III.A.1",
        statement="In the experimental conditions K/Kc is greater than or about 1.",
        stated="K/Kc >~ 1",
        computed=f"{value:.3f}",
        how="K = 0.2 N/um over Eq. (18) at the central values.",
        why="Below 1, where steady sliding is unstable. A and B are known to 40 %, which allows "
        "0.5 to above 5; nothing in the rest of the section hangs on the side of 1.",
    )


def _determinant_limit() -> Claim:
    p, point = paper(), small_modulation(velocities()[1], M=paper().M)
    limit = float(point.omega) ** 2 * p.A * p.W0 / velocities()[1]
    value = float(abs(cf.determinant(point))) / limit
    return judged(
        rules.about(1, "|Delta| over w^2 A W0/V"),
        {"10 um/s": value},
        id="determinant-limit",
        place="Section III.A.1",
        statement="Delta is about -w^2 A W0/V.",
        stated="-w^2 A W0/V",
        computed=f"|Delta| is {value:.4f} of that",
        how="Derived determinant at 10 um/s with M = 1.6 kg.",
        why="The printed Eq. (17) would have (K/Kc)^2 = 0.77 times the limit.",
    )


def _inertia_negligible() -> Claim:
    changes = {}
    for name, V in {"1 um/s": velocities()[0], "10 um/s": velocities()[1]}.items():
        heavy, light = (
            ageing_response(small_modulation(V, M=M)).transfer for M in (paper().M, 0.0)
        )
        changes[name] = float(abs(heavy) / abs(light)) - 1
    _, top = paper()["V_range"].si_range or (np.nan, np.nan)
    heavy, light = (ageing_response(small_modulation(top, M=M)).transfer for M in (paper().M, 0.0))
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "mu1"),
        changes,
        id="inertia-negligible-linear",
        place="Section III.A.1",
        statement="In the linear response of rigid asperities inertia is negligible.",
        stated="negligible",
        computed=f"mu1 changes by {changes['10 um/s']:+.1%} at 10 um/s, and by "
        f"{float(abs(heavy) / abs(light)) - 1:+.0%} at 100 um/s",
        how="Exact linear response with M = 1.6 kg and without.",
        why="True at the velocities of the figures. It does not carry over to elastic asperities: "
        "see the claim on Eq. (29).",
    )


def _velocity_gain() -> Claim:
    p = paper()
    gain = p.mu0 / p.A
    low, high = (p.mu0 / (p.A + s * (p["A"].si_uncertainty or 0.0)) for s in (1, -1))
    return judged(
        rules.rounds_to(p.velocity_gain, 10, "mu/A"),
        {"mu/A": gain},
        id="velocity-gain",
        place="Section III.A.1, Eq. (24)",
        statement="The effective perturbation parameter is about 50 eps.",
        stated=f"{p.velocity_gain:g} eps",
        computed=f"{gain:.1f} eps; {low:.0f} to {high:.0f} within the uncertainty of A",
        how="mu0/A with mu0 = 0.5, A = 0.013.",
        why="50 would need mu = 0.65 or A = 0.010. The argument does not depend on it.",
    )


def _out_of_reach() -> Claim:
    p = paper()
    parameter = p.perturbative_epsilon * p.mu0 / p.A
    r = curve(RR)
    smallest, onset = at(-r.delta_mu, APPLIED[0])[0], at(-r.delta_mu, p.epsilon_onset)[0]
    return judged(
        rules.above(1 / rules.MUCH, "eps mu/A at eps = 0.01"),
        {"eps mu/A": parameter},
        id="perturbation-out-of-reach",
        place="Section III.A.1",
        statement="Perturbation theory needs eps << 0.01 and is out of experimental reach.",
        stated=str(p["perturbative_epsilon"]),
        computed=f"eps mu/A = {parameter:.2f} at eps = 0.01; at the smallest applied eps, 0.005, "
        "the "
        f"drop is {smallest:.1e}, {onset / smallest:.0f} times below the noise",
        how="Eq. (24); Rice-Ruina drop at eps = 0.005 against that at eps = 0.05, where it emerges "
        "from the noise.",
        why="The formulas themselves are good to 10 % up to eps_eff = 0.02.",
    )


def _age_negligible() -> Claim:
    changes = ageless_changes(RR)
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "drop, mu1 and mu2"),
        changes,
        id="age-negligible",
        place="Section III.A.1",
        statement="The modulation of the age contributes negligibly to the shear response.",
        stated="negligible",
        computed="; ".join(f"{k} {v:+.1e}" for k, v in changes.items()) + " without it, at 10 um/s",
        how="Rice-Ruina law with B = 0 at the same mu(V) against the full law; periodic orbits at "
        "eps = 0.5.",
        why="The age is renewed over many periods and stays at its mean.",
    )
