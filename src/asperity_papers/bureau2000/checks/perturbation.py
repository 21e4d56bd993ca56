"""Claims of section III.A.1: the scales of the problem, and Eqs. (10) to (24)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from asperity import Slider, perturbation_response
from asperity.ledger import check
from asperity.theory import SmallModulation, closed_forms as cf
from asperity_papers.bureau2000.integration import IntegratedOrbit
from asperity_papers.bureau2000.machine import RR, Machine, Numbers

Form = Literal["as_printed", "derived"]

#: Amplitude of the integrations that check formulas of leading order: eps mu/A = 0.04.
SMALL = 1e-3


# --- Scales, and what may be neglected -----------------------------------------------------------


@check("critical-stiffness")
def critical_stiffness(machine: Machine) -> Numbers:
    V = machine.velocities[1]
    Kc = float(cf.critical_stiffness(machine.small_modulation(V)))
    growth = _growth_rate(machine, Kc) * machine.numbers.D0 / V
    return {"growth rate": float(growth.real), "Kc": Kc}


def _growth_rate(machine: Machine, K: float) -> complex:
    """Leading eigenvalue (1/s) of unmodulated Rice-Ruina sliding at 10 um/s."""
    slider = Slider(machine.slider(RR).law, spring=K, load=machine.numbers.W0)
    r = perturbation_response(
        slider, velocity=machine.velocities[1], frequency=machine.numbers.frequency
    )
    return complex(r.eigenvalues[0])


@check("critical-pulsation")
def critical_pulsation(machine: Machine) -> Numbers:
    point = machine.small_modulation(machine.velocities[1])
    growth = _growth_rate(machine, float(cf.critical_stiffness(point)))
    return {"printed": float(cf.critical_pulsation(point)), "independent": abs(growth.imag)}


@check("determinant-limit")
def determinant_limit(machine: Machine) -> Numbers:
    p, V = machine.numbers, machine.velocities[1]
    point = machine.small_modulation(V, M=p.M)
    limit = float(point.omega) ** 2 * p.A * p.W0 / V
    return {"10 um/s": float(abs(cf.determinant(point))) / limit}


# --- Formulas, as printed and as derived, against an integration ---------------------------------


def _at(machine: Machine, V: float, **changes: float) -> tuple[SmallModulation, IntegratedOrbit]:
    """Arguments of the closed forms, rigid asperities, and the orbit at a small amplitude."""
    orbit = machine.orbit(machine.operating_point(V, **changes), SMALL)
    return machine.small_modulation(V, **changes), orbit


def _forms(formula: Callable[[Form], Any]) -> Numbers:
    """A formula as printed and as derived."""
    return {"printed": float(formula("as_printed")), "derived": float(formula("derived"))}


def _position_amplitude(machine: Machine, orbit: IntegratedOrbit) -> complex:
    """X1 (m) from an integration: x = V t - F/K."""
    return -orbit.c1 / SMALL * machine.numbers.W0 / machine.numbers.K


@check("steady-position")
def steady_position(machine: Machine) -> Numbers:
    p, V = machine.numbers, machine.velocities[1]
    point = machine.small_modulation(V)
    steady = machine.orbit(machine.operating_point(V), 0.0)
    forms = _forms(lambda form: -cf.steady_position(point, 0.0, form) * p.K / p.W0)
    return forms | {"independent": steady.mu + steady.delta_mu}


@check("exchanged-amplitudes")
def exchanged_amplitudes(machine: Machine) -> Numbers:
    p, V = machine.numbers, machine.velocities[1]
    point, orbit = _at(machine, V, M=p.M)
    return {
        "printed": float(abs(cf.age_amplitude(point))),
        "derived": float(abs(cf.position_amplitude(point))),
        "independent": abs(_position_amplitude(machine, orbit)),
        "age": abs(orbit.log_age1) / SMALL * p.D0 / V,
    }


@check("linear-system")
def linear_system(machine: Machine) -> Numbers:
    p, V, w = machine.numbers, machine.velocities[1], 2 * np.pi * machine.numbers.frequency
    _, orbit = _at(machine, V, M=p.M)
    X1, Phi1 = _position_amplitude(machine, orbit), orbit.log_age1 / SMALL * p.D0 / V
    force = (-p.M * w**2 + p.K + 1j * p.W0 * w * p.A / V) * X1 + p.W0 * p.B * V / p.D0 * Phi1
    ageing = 1j * w / V * X1 + (1j * w + V / p.D0) * Phi1
    return {
        "Eq. (13)": abs(force / (-p.W0 * orbit.mu) - 1),
        "Eq. (14)": abs(ageing) / abs(w / V * X1),
    }


@check("determinant")
def determinant(machine: Machine) -> Numbers:
    p, V = machine.numbers, machine.velocities[1]
    point, orbit = _at(machine, V, M=p.M)
    numerator = p.W0 * float(point.mu) * (1j * float(point.omega) + V / p.D0)
    forms = _forms(lambda form: abs(cf.determinant(point, form)))
    return forms | {"independent": abs(-numerator / _position_amplitude(machine, orbit))}


@check("first-harmonic")
@check("linker-dieterich-first-harmonic", "alpha")
def first_harmonic(machine: Machine, *parameters: str) -> Numbers:
    changes = {name: machine.numbers[name].si for name in parameters}
    point, orbit = _at(machine, machine.velocities[1], **changes)
    both = {"printed": float(cf.first_harmonic(point, SMALL)), "independent": abs(orbit.c1)}
    return both | {f"{name} over eps": value / SMALL for name, value in both.items()}


@check("second-harmonic")
def second_harmonic(machine: Machine) -> Numbers:
    point, orbit = _at(machine, machine.velocities[0])
    scale = float(point.kappa) * SMALL**2
    forms = _forms(lambda form: cf.second_harmonic(point, SMALL, form) / scale)
    return forms | {"independent": abs(orbit.c2) / scale}


@check("mean-shift")
def mean_shift(machine: Machine) -> Numbers:
    point, orbit = _at(machine, machine.velocities[1])
    printed = float(cf.mean_shift(point, SMALL))
    return {"printed": printed / SMALL**2, "independent": orbit.delta_mu / SMALL**2}


@check("mean-decreases")
def mean_decreases(machine: Machine) -> Numbers:
    point, orbit = _at(machine, machine.velocities[1])
    return {"integrated": orbit.delta_mu, "Eq. (22)": float(cf.mean_shift(point, SMALL))}


@check("age-over-velocity")
def age_over_velocity(machine: Machine) -> Numbers:
    p, V = machine.numbers, machine.velocities[1]
    point, orbit = _at(machine, V)
    # v/V = 1 - (W0/(K V)) df/dt.
    velocity = abs(orbit.c1) * 2 * np.pi * p.frequency * p.W0 / (p.K * V)
    forms = _forms(lambda form: cf.age_to_velocity_ratio(point, form))
    return forms | {"independent": abs(orbit.log_age1) / velocity}


@check("velocity-modulation")
def velocity_modulation(machine: Machine) -> Numbers:
    point, orbit = _at(machine, machine.velocities[1])
    independent = abs(orbit.c1) / SMALL / float(point.kappa)
    return {"printed": float(cf.velocity_modulation(point, 1.0)), "independent": independent}
