"""Claims of sections III.A.2 to III.C: Rice-Ruina, Linker-Dieterich and the elasto-plastic law."""

from __future__ import annotations

import numpy as np

from asperity.ledger import check
from asperity_papers.bureau2000.machine import (
    EXT,
    LD,
    RR,
    STRONGEST,
    Machine,
    Numbers,
    at,
)

# --- III.A.2 and III.A.3: the Rice-Ruina model integrated numerically ----------------------------


@check("fitted-transmission")
def fitted_transmission(machine: Machine) -> Numbers:
    return {"1 um/s": _share_for_the_drop(machine, RR, np.array([0.45, 0.5, 0.55]))}


def _share_for_the_drop(machine: Machine, law: str, applied: np.ndarray) -> float:
    """eps_eff/eps that gives the stated drop at eps = 0.5 and 1 um/s."""
    p = machine.numbers
    stated = p.relative_drop * at(machine.curve(law).mu_ss)[0]
    drops = -machine.response(law, machine.velocities[0], applied).delta_mu
    return float(np.interp(stated, drops, applied)) * p.transmission / STRONGEST


# --- III.B: Linker and Dieterich's ageing law ----------------------------------------------------


@check("alpha-upper-limit")
def alpha_upper_limit(machine: Machine) -> Numbers:
    p = machine.numbers
    needed = _share_for_the_drop(machine, LD, np.linspace(STRONGEST, 1.0, 11))
    measured = p.transmission_air_over_vacuum * machine.borne(p.frequency_vacuum, None)
    low, none = (
        at(r.delta_mu)[0] for r in (machine.curve(LD, alpha=p.alpha_low), machine.curve(RR))
    )
    return {
        "1 um/s": needed / measured,
        "needed": needed,
        "measured": measured,
        "loss": 1 - low / none,
    }


# --- III.C: the elasto-plastic extension ---------------------------------------------------------


@check("extended-equation")
def extended_equation(machine: Machine) -> Numbers:
    """The fast solver against Eq. (29), written out and integrated in time."""
    p, r = machine.numbers, machine.curve(EXT)
    gaps: Numbers = {}
    quantities = map(at, (r.delta_mu, r.mu1, r.mu2))
    for (name, V), drop, mu1, mu2 in zip(machine.speeds, *quantities, strict=True):
        point = machine.operating_point(V, lambda_=p.lambda_)
        orbit = machine.orbit(point, machine.strongest, drop)
        gaps[f"drop, {name}"] = drop / orbit.delta_mu - 1
        gaps[f"mu1, {name}"] = mu1 / abs(orbit.c1) - 1
        gaps[f"mu2, {name}"] = mu2 / abs(orbit.c2) - 1
    return gaps | {"worst": max(abs(gap) for gap in gaps.values())}
