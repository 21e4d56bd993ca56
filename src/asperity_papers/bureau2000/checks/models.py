"""Claims of sections III.A.2 to III.C: Rice-Ruina, Linker-Dieterich and the elasto-plastic law."""

from __future__ import annotations

import numpy as np

from asperity.air import effective_modulation
from asperity.ledger import check
from asperity_papers.bureau2000.machine import (
    EXT,
    LD,
    RR,
    SPEEDS,
    STRONGEST,
    Machine,
    Outputs,
    amplitude_slopes,
    at,
    by_speed,
    relative,
)

Numbers = dict[str, float]
Mixed = dict[str, float | str]


# --- III.A.2 and III.A.3: the Rice-Ruina model integrated numerically ----------------------------


@check("rice-ruina-drop-velocity")
def rice_ruina_drop_velocity(machine: Machine) -> Numbers:
    drop = machine.curve(RR).delta_mu
    return {f"eps = {e:g}": relative(at(drop, e)) for e in (0.2, 0.35, STRONGEST)}


@check("fitted-transmission")
def fitted_transmission(machine: Machine) -> Numbers:
    return {"1 um/s": _share_for_the_drop(machine, RR, np.array([0.45, 0.5, 0.55]))}


def _share_for_the_drop(machine: Machine, law: str, applied: np.ndarray) -> float:
    """eps_eff/eps that gives the stated drop at eps = 0.5 and 1 um/s."""
    p = machine.numbers
    stated = p.relative_drop * at(machine.curve(law).mu_ss)[0]
    drops = -machine.response(law, machine.velocities[0], applied).delta_mu
    return float(np.interp(stated, drops, applied)) * p.transmission / STRONGEST


@check("weak-frequency-dependence")
def weak_frequency_dependence(machine: Machine) -> Numbers:
    p = machine.numbers
    layers = {
        "full area": machine.air_layer(), "patch of 2.5 cm": machine.air_layer(R=p.patch_radius)
    }  # fmt: skip
    return {
        name: machine.borne(p.frequency_vacuum, layer) / machine.borne(p.frequency, layer) - 1
        for name, layer in layers.items()
    }


@check("transmission-200-Hz")
def transmission_200_hz(machine: Machine) -> Numbers:
    p = machine.numbers
    vacuum = machine.borne(p.frequency_vacuum, None)
    return {"200 Hz": p.transmission_air_over_vacuum * vacuum, "vacuum": vacuum}


@check("depends-on-normal-stiffness")
def depends_on_normal_stiffness(machine: Machine) -> Numbers:
    p, layer, factor = machine.numbers, machine.air_layer(), 1.01
    shares = [
        float(effective_modulation(p.frequency, W0=p.W0, M=p.M, lambda_z=length, layer=layer))
        for length in (p.lambda_z, p.lambda_z / factor)
    ]
    return {"sensitivity": float(np.log(shares[1] / shares[0]) / np.log(factor))}


@check("rice-ruina-mu1-linear-in-V", "mu1")
@check("rice-ruina-mu2-linear-in-V", "mu2")
def rice_ruina_quasi_linear(machine: Machine, name: str) -> Numbers:
    values = getattr(machine.curve(RR), name)
    return {f"eps = {e:g}": machine.velocity_exponent(values, e) for e in (0.05, 0.25, STRONGEST)}


@check("rice-ruina-mu1-saturates", "mu1")
@check("rice-ruina-mu2-saturates", "mu2")
def rice_ruina_saturates(machine: Machine, name: str) -> Numbers:
    return by_speed(amplitude_slopes(getattr(machine.curve(RR), name))[:, -1])


@check("rice-ruina-disagrees", RR)
@check("linker-dieterich-harmonics-disagree", LD)
def harmonics_disagree(machine: Machine, law: str) -> Numbers:
    r, order = machine.curve(law), machine.numbers.mu1_order
    return {
        "exponent of mu1 in V": machine.velocity_exponent(r.mu1),
        "orders of magnitude of mu1 at 1 um/s": float(np.log10(order / at(r.mu1)[0])),
        "of mu2": machine.velocity_exponent(r.mu2),
        "slope of mu1 in eps": float(amplitude_slopes(r.mu1)[0, -1]),
    }


# --- III.B: Linker and Dieterich's ageing law ----------------------------------------------------


def _low_alpha(machine: Machine) -> Outputs:
    """Response at eps = 0.5 with alpha = 0.02."""
    return machine.outputs(LD, alpha=machine.numbers.alpha_low)


@check("alpha-significant")
def alpha_significant(machine: Machine) -> Numbers:
    mu = float(machine.small_modulation(machine.velocities[1]).mu)
    drop = machine.outputs(LD).delta_mu[1] / machine.outputs(RR).delta_mu[1] - 1
    return {
        "mu1, small eps": abs(mu - machine.numbers.alpha) / mu - 1, "drop at eps = 0.5": drop
    }  # fmt: skip


@check("drop-depends-on-alpha")
def drop_depends_on_alpha(machine: Machine) -> Numbers:
    low, high = _low_alpha(machine).delta_mu, machine.outputs(LD).delta_mu
    return by_speed((low[0] / high[0], low[1] / high[1]))


@check("linker-dieterich-drop-velocity")
def drop_with_velocity(machine: Machine) -> Numbers:
    return {
        "alpha = 0.02": relative(_low_alpha(machine).delta_mu),
        "alpha = 0.2": relative(machine.outputs(LD).delta_mu),
    }


@check("linker-dieterich-drop-too-small")
def drop_too_small(machine: Machine) -> Numbers:
    drop, stated = machine.outputs(LD).relative_drop, machine.numbers.relative_drop
    return by_speed((drop[0] / stated, drop[1] / stated)) | by_speed(drop, "drop, ")


@check("small-alpha-fits")
def small_alpha_fits(machine: Machine) -> Numbers:
    drop, stated = _low_alpha(machine).relative_drop, machine.numbers.relative_drop
    return by_speed((drop[0] / stated - 1, drop[1] / stated - 1)) | by_speed(drop, "drop, ")


@check("small-alpha-close-to-rice-ruina")
def close_to_rice_ruina(machine: Machine) -> Numbers:
    a, b = _low_alpha(machine), machine.outputs(RR)
    return {
        f"{name}, {speed}": getattr(a, name)[k] / getattr(b, name)[k] - 1
        for name in ("mu1", "mu2")
        for k, speed in enumerate(SPEEDS)
    }


@check("caption-mean")
def caption_mean(machine: Machine) -> Numbers:
    missing, full = _low_alpha(machine).delta_mu
    dotted = machine.outputs(LD).delta_mu[0]
    return {"drop": missing / dotted - 1, "missing": -missing, "dotted": -dotted, "full": -full}


@check("caption-harmonics")
def caption_harmonics(machine: Machine) -> Numbers:
    a, b = machine.curve(LD, alpha=machine.numbers.alpha_low), machine.curve(LD)
    apart = {
        "mu1": float(np.abs(a.mu1 - b.mu1)[0].max()), "mu2": float(np.abs(a.mu2 - b.mu2)[0].max())
    }  # fmt: skip
    scaled = {name: gap / machine.numbers.mu1_order for name, gap in apart.items()}
    return scaled | {f"{name} apart": gap for name, gap in apart.items()}


@check("alpha-upper-limit")
def alpha_upper_limit(machine: Machine) -> Numbers:
    p = machine.numbers
    needed = _share_for_the_drop(machine, LD, np.linspace(STRONGEST, 1.0, 11))
    measured = p.transmission_air_over_vacuum * machine.borne(p.frequency_vacuum, None)
    loss = 1 - _low_alpha(machine).delta_mu[0] / machine.outputs(RR).delta_mu[0]
    return {"1 um/s": needed / measured, "needed": needed, "measured": measured, "loss": loss}


# --- III.C: the elasto-plastic extension ---------------------------------------------------------


@check("elastic-length-order")
def elastic_length_order(machine: Machine) -> Mixed:
    p = machine.numbers
    return {
        "quasi-static": p.lambda_quasi_static,
        "fitted": p.lambda_,
        "measured length": str(p["lambda_quasi_static"]),
        "fitted length": str(p["lambda"]),
    }


@check("stationary-unchanged")
def stationary_unchanged(machine: Machine) -> Numbers:
    elastic, rigid = machine.slider(EXT).law, machine.slider(RR).law
    return by_speed(float(elastic.mu_ss(V) / rigid.mu_ss(V)) - 1 for V in machine.velocities)


@check("extended-equation")
def extended_equation(machine: Machine) -> Numbers:
    """The fast solver against Eq. (29), written out and integrated in time."""
    p, r = machine.numbers, machine.outputs(EXT)
    gaps: Numbers = {}
    for i, V in enumerate(machine.velocities):
        point = machine.operating_point(V, lambda_=p.lambda_)
        orbit = machine.orbit(point, machine.strongest, r.delta_mu[i])
        gaps[f"drop, {SPEEDS[i]}"] = r.delta_mu[i] / orbit.delta_mu - 1
        gaps[f"mu1, {SPEEDS[i]}"] = r.mu1[i] / abs(orbit.c1) - 1
        gaps[f"mu2, {SPEEDS[i]}"] = r.mu2[i] / abs(orbit.c2) - 1
    return gaps | {"worst": max(abs(gap) for gap in gaps.values())}


@check("inertia-negligible-elastic")
def inertia_negligible(machine: Machine) -> Numbers:
    heavy, light = machine.inertial_outputs(), machine.outputs(EXT)
    columns = {"drop": "delta_mu", "mu1": "mu1", "mu2": "mu2"}
    return {
        f"{name}, {speed}": getattr(heavy, column)[i] / getattr(light, column)[i] - 1
        for i, speed in enumerate(SPEEDS)
        for name, column in columns.items()
    }


@check("mu1-most-sensitive")
def mu1_most_sensitive(machine: Machine) -> Numbers:
    p, r = machine.numbers, machine.curve(EXT)
    other = machine.curve(EXT, lambda_=p.lambda_quasi_static)
    step = np.log(p.lambda_ / p.lambda_quasi_static)
    drop, mu1, mu2 = (
        abs(float(np.log(at(np.abs(a))[0] / at(np.abs(b))[0]) / step))
        for a, b in ((r.delta_mu, other.delta_mu), (r.mu1, other.mu1), (r.mu2, other.mu2))
    )
    exponents = {"of mu1": mu1, "of mu2": mu2, "of the drop": drop}
    return {"drop": mu1 - drop, "mu2": mu1 - mu2, **exponents}


@check("mean-weakly-affected")
def mean_weakly_affected(machine: Machine) -> Numbers:
    a, b = machine.outputs(EXT).delta_mu, machine.outputs(RR).delta_mu
    return by_speed((a[0] / b[0] - 1, a[1] / b[1] - 1))


@check("mu1-weaker-velocity-dependence", "mu1")
@check("mu2-weaker-velocity-dependence", "mu2")
def weaker_velocity_dependence(machine: Machine, name: str) -> Numbers:
    elastic, rigid = (getattr(machine.curve(law), name) for law in (EXT, RR))
    return {
        "exponent": machine.velocity_exponent(elastic),
        "of Rice-Ruina": machine.velocity_exponent(rigid),
        "at small eps": machine.velocity_exponent(elastic, 0.05),
    }


@check("mu1-no-saturation", "mu1")
@check("mu2-no-saturation", "mu2")
def no_saturation(machine: Machine, name: str) -> Numbers:
    return by_speed(amplitude_slopes(getattr(machine.curve(EXT), name)).min(1))
