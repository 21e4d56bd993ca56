"""Claims of section III.C: the elasto-plastic extension."""

from __future__ import annotations

import numpy as np

from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged
from asperity.study.claims.curves import (
    EXT,
    RR,
    STRONGEST,
    amplitude_slopes,
    at,
    curve,
    experiment,
    paper,
    slider,
    velocities,
    velocity_exponent,
)
from asperity.study.claims.features import inertial_outputs, outputs
from asperity.study.claims.integration import periodic_orbit

_EXT = "Elasto-plastic law, periodic orbits at 1 and 10 um/s, 120 Hz"


def claims() -> list[Claim]:
    """All claims of section III.C."""
    return [
        _elastic_length_order(),
        _stationary(),
        _equation(),
        _inertia(),
        _within_uncertainty(),
        _most_sensitive(),
        _mean_unaffected(),
        _weaker("mu1", "Fig. 11b"),
        _weaker("mu2", "Fig. 11c"),
        _no_saturation("mu1", "Fig. 11b"),
        _no_saturation("mu2", "Fig. 11c"),
    ]


def _elastic_length_order() -> Claim:
    p = paper()
    return judged(
        rules.of_order(p.lambda_order, "lambda in m"),
        {"quasi-static": p.lambda_quasi_static, "fitted": p.lambda_},
        id="elastic-length-order",
        place="Section III.C",
        statement="kappa_asp = W/lambda with lambda of order 1 um.",
        stated=str(p["lambda_order"]),
        computed=f"{p['lambda_quasi_static']} (quasi-static), {p['lambda']} (fitted)",
        how="Values given below in the section.",
        why="Both lengths are of the order of the size of the asperities.",
    )


def _stationary() -> Claim:
    changes = {
        f"{V * 1e6:g} um/s": float(slider(EXT).law.mu_ss(V) / slider(RR).law.mu_ss(V)) - 1
        for V in velocities()
    }
    return judged(
        rules.change_below(1e-12, "against Rice-Ruina, the steady friction coefficient"),
        changes,
        id="stationary-unchanged",
        place="Section III.C",
        statement="In stationary sliding under constant load the usual velocity dependence holds.",
        stated="the usual dependence on dx/dt",
        computed="identical mu_ss(V)",
        how="Steady state of both laws.",
        why="F/kappa_asp is constant, so that the plastic velocity is the slider's.",
    )


def _equation() -> Claim:
    """The fast solver against Eq. (29), written out and integrated in time."""
    p, r = paper(), outputs(EXT)
    gaps: dict[str, float] = {}
    for i, V in enumerate(velocities()):
        orbit = periodic_orbit(experiment(V, lambda_=p.lambda_), _strongest(), r.delta_mu[i])
        found = {"drop": orbit.delta_mu, "mu1": abs(orbit.c1), "mu2": abs(orbit.c2)}
        ours = {"drop": r.delta_mu[i], "mu1": r.mu1[i], "mu2": r.mu2[i]}
        gaps |= {f"{k}, {V * 1e6:g} um/s": ours[k] / found[k] - 1 for k in found}
    worst = max(abs(g) for g in gaps.values())
    return judged(
        rules.change_below(1e-6, "against the integration, every number"),
        gaps,
        id="extended-equation",
        place="Section III.C, Eqs. (26)-(29)",
        statement="The extended model is Eq. (29) with the age law (2).",
        stated="Eqs. (29), (2)",
        computed=f"mean, mu1 and mu2 agree to {worst:.0e}",
        how="Periodic orbits of the law of the package against Eq. (29) written out and integrated "
        "by "
        "DOP853, eps = 0.5, 1 and 10 um/s.",
        why="What the package solves is the printed equation.",
    )


def _strongest() -> float:
    """eps_eff at eps = 0.5."""
    return paper().transmission * STRONGEST


def _inertial_transmission() -> float:
    """eps_eff/eps that makes the drop 20 % at eps = 0.5 and 1 um/s, with inertia."""
    p, V = paper(), velocities()[0]
    measured, largest = p.relative_drop, _strongest()
    smaller = p.transmission_air_over_vacuum * STRONGEST
    orbit = periodic_orbit(experiment(V, M=p.M, lambda_=p.lambda_), smaller, -measured * p.mu0)
    drops = [-orbit.delta_mu / orbit.mu, inertial_outputs().relative_drop[0]]
    return float(np.interp(measured, drops, [smaller, largest])) / STRONGEST


def _inertia() -> Claim:
    heavy, light = inertial_outputs(), outputs(EXT)
    changes = {}
    for i, name in enumerate(("1 um/s", "10 um/s")):
        changes[f"drop, {name}"] = heavy.delta_mu[i] / light.delta_mu[i] - 1
        changes[f"mu1, {name}"] = heavy.mu1[i] / light.mu1[i] - 1
        changes[f"mu2, {name}"] = heavy.mu2[i] / light.mu2[i] - 1
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "with the mass of the slider, drop, mu1 and mu2"),
        changes,
        id="inertia-negligible-elastic",
        place="Section III.C, Eq. (29)",
        statement="In the experimental conditions inertia can be neglected in the extended model.",
        stated="can be neglected",
        computed="; ".join(f"{k}: {v:+.0%}" for k, v in changes.items())
        + f"; a drop of 20 % then needs eps_eff/eps = {_inertial_transmission():.2f}",
        how="Elasto-plastic law with M = 1.6 kg and without, integrated in time at eps = 0.5.",
        why="The argument of section III.A is linear and for rigid asperities. On elastic ones the "
        "slider resonates near 400 Hz, close to the third harmonic, and the pulses of slip "
        "excite it. The fitted 0.48 stands in part for the missing inertia: with it, the fit comes "
        "near the 0.4 measured against the vacuum.",
    )


def _within_uncertainty() -> Claim:
    p = paper()
    distance = p.lambda_ - p.lambda_quasi_static
    uncertainty = p["lambda_quasi_static"].si_uncertainty or np.nan
    return judged(
        rules.between(-1, 1, "distance over the uncertainty"),
        {"distance": distance / uncertainty},
        id="lambda-within-uncertainty",
        place="Section III.C",
        statement="The fitted lambda = 0.7 um lies within the uncertainty of the measured one.",
        stated=str(p["lambda_quasi_static"]),
        computed=f"{distance / uncertainty:.2f} of the uncertainty away",
        how="(0.7 - 0.62)/0.15.",
        why="Half an uncertainty: fit and measurement agree.",
    )


def _most_sensitive() -> Claim:
    p, other = paper(), curve(EXT, lambda_=paper().lambda_quasi_static)
    r, step = curve(EXT), np.log(paper().lambda_ / p.lambda_quasi_static)

    def sensitivity(a: np.ndarray, b: np.ndarray) -> float:
        return abs(float(np.log(at(np.abs(a))[0] / at(np.abs(b))[0]) / step))

    drop = sensitivity(r.delta_mu, other.delta_mu)
    mu1, mu2 = sensitivity(r.mu1, other.mu1), sensitivity(r.mu2, other.mu2)
    return judged(
        rules.above(0, "sensitivity of mu1 to lambda beyond that of the other quantity"),
        {"drop": mu1 - drop, "mu2": mu1 - mu2},
        id="mu1-most-sensitive",
        place="Section III.C",
        statement="The mu1 data are the most sensitive to lambda.",
        stated="most sensitive",
        computed=f"d ln/d ln lambda: mu1 {mu1:.2f}, mu2 {mu2:.2f}, drop {drop:.3f}",
        how="Elasto-plastic law at 1 um/s, eps = 0.5, lambda = 0.62 and 0.7 um.",
        why="mu1 is close to proportional to lambda.",
    )


def _mean_unaffected() -> Claim:
    a, b = outputs(EXT).delta_mu, outputs(RR).delta_mu
    changes = {"1 um/s": a[0] / b[0] - 1, "10 um/s": a[1] / b[1] - 1}
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "against Rice-Ruina, the drop"),
        changes,
        id="mean-weakly-affected",
        place="Section III.C, Fig. 11a",
        statement="The drop of the mean is only very weakly affected by the extension.",
        stated="very weakly",
        computed="; ".join(f"{k}: {v:+.1%}" for k, v in changes.items()),
        how=f"{_EXT}, eps = 0.5.",
        why="The averaged balance contains lambda only through the small K lambda/W0.",
    )


def _weaker(name: str, figure: str) -> Claim:
    r, rigid = curve(EXT), curve(RR)
    values = {"mu1": r.mu1, "mu2": r.mu2}[name]
    exponent = velocity_exponent(values)
    unmodified = velocity_exponent({"mu1": rigid.mu1, "mu2": rigid.mu2}[name])
    small = velocity_exponent(values, 0.05)
    return judged(
        rules.below(0.5, f"exponent of {name} in V at eps = 0.5"),
        {"exponent": exponent},
        id=f"{name}-weaker-velocity-dependence",
        place=f"Section III.C, {figure}",
        statement=f"The quasi-linear V-dependence of {name} is replaced by a much weaker one.",
        stated="much weaker",
        computed=f"exponent {exponent:.3f} at eps = 0.5, where Rice-Ruina has {unmodified:.2f}; "
        f"{small:.2f} at eps = 0.05",
        how=f"{_EXT}.",
        why="The elastic part does not depend on V and outgrows the plastic one as eps rises.",
    )


def _no_saturation(name: str, figure: str) -> Claim:
    r = curve(EXT)
    slopes = amplitude_slopes({"mu1": r.mu1, "mu2": r.mu2}[name]).min(1)
    return judged(
        rules.above(rules.UNSATURATED, f"smallest d ln({name})/d ln(eps) up to eps_eff = 0.3"),
        {"1 um/s": slopes[0], "10 um/s": slopes[1]},
        id=f"{name}-no-saturation",
        place=f"Section III.C, {figure}",
        statement=f"{name} no longer saturates in the range eps_eff < 0.3.",
        stated=f"eps_eff {paper()['no_saturation_below']}",
        computed=f"smallest logarithmic slope {slopes[0]:.2f} and {slopes[1]:.2f} at 1 and 10 um/s",
        how=f"{_EXT}, eps_eff from 0.0024 to 0.3.",
        why="The elastic exchange grows with eps without limit.",
    )
