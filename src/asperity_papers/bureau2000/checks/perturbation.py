"""Claims of section III.A.1: the scales of the problem, and Eqs. (10) to (24)."""

from __future__ import annotations

import numpy as np

from asperity import Slider, perturbation_response
from asperity.ledger import check
from asperity.theory import closed_forms as cf
from asperity_papers.bureau2000.integration import IntegratedOrbit
from asperity_papers.bureau2000.machine import RR, Machine

Numbers = dict[str, float]

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


def _fast(machine: Machine) -> float:
    return machine.velocities[1]


def _integrated(machine: Machine, **overrides: float) -> IntegratedOrbit:
    """Rigid asperities at 10 um/s, small amplitude."""
    return machine.orbit(machine.operating_point(_fast(machine), **overrides), SMALL)


def _position_amplitude(machine: Machine) -> complex:
    """X1 (m) from the integration with inertia: x = V t - F/K."""
    p = machine.numbers
    return -_integrated(machine, M=p.M).c1 / SMALL * p.W0 / p.K


@check("steady-position")
def steady_position(machine: Machine) -> Numbers:
    p, point = machine.numbers, machine.small_modulation(_fast(machine))
    steady = machine.orbit(machine.operating_point(_fast(machine)), 0.0)
    return {
        "printed": float(-cf.steady_position(point, 0.0, "as_printed") * p.K / p.W0),
        "derived": float(-cf.steady_position(point, 0.0, "derived") * p.K / p.W0),
        "independent": steady.mu + steady.delta_mu,
    }


@check("exchanged-amplitudes")
def exchanged_amplitudes(machine: Machine) -> Numbers:
    p, V = machine.numbers, _fast(machine)
    point = machine.small_modulation(V, M=p.M)
    return {
        "printed": float(abs(cf.age_amplitude(point))),
        "derived": float(abs(cf.position_amplitude(point))),
        "independent": abs(_position_amplitude(machine)),
        "age": abs(_integrated(machine, M=p.M).log_age1) / SMALL * p.D0 / V,
    }


@check("linear-system")
def linear_system(machine: Machine) -> Numbers:
    p, V, w = machine.numbers, _fast(machine), 2 * np.pi * machine.numbers.frequency
    orbit, X1 = _integrated(machine, M=p.M), _position_amplitude(machine)
    Phi1 = orbit.log_age1 / SMALL * p.D0 / V
    force = (-p.M * w**2 + p.K + 1j * p.W0 * w * p.A / V) * X1 + p.W0 * p.B * V / p.D0 * Phi1
    ageing = 1j * w / V * X1 + (1j * w + V / p.D0) * Phi1
    return {
        "Eq. (13)": abs(force / (-p.W0 * orbit.mu) - 1),
        "Eq. (14)": abs(ageing) / abs(w / V * X1),
    }


@check("determinant")
def determinant(machine: Machine) -> Numbers:
    p, V = machine.numbers, _fast(machine)
    point = machine.small_modulation(V, M=p.M)
    numerator = p.W0 * float(point.mu) * (1j * float(point.omega) + V / p.D0)
    return {
        "printed": float(abs(cf.determinant(point, "as_printed"))),
        "derived": float(abs(cf.determinant(point, "derived"))),
        "independent": abs(-numerator / _position_amplitude(machine)),
    }


@check("first-harmonic")
@check("linker-dieterich-first-harmonic", "alpha")
def first_harmonic(machine: Machine, *parameters: str) -> Numbers:
    V = _fast(machine)
    overrides = {name: machine.numbers[name].si for name in parameters}
    printed = float(cf.first_harmonic(machine.small_modulation(V, **overrides), SMALL))
    independent = abs(machine.orbit(machine.operating_point(V, **overrides), SMALL).c1)
    return {
        "printed": printed,
        "independent": independent,
        "printed over eps": printed / SMALL,
        "independent over eps": independent / SMALL,
    }


@check("second-harmonic")
def second_harmonic(machine: Machine) -> Numbers:
    V = machine.velocities[0]
    point = machine.small_modulation(V)
    scale = float(point.kappa) * SMALL**2
    return {
        "printed": float(cf.second_harmonic(point, SMALL, "as_printed")) / scale,
        "derived": float(cf.second_harmonic(point, SMALL, "derived")) / scale,
        "independent": abs(machine.orbit(machine.operating_point(V), SMALL).c2) / scale,
    }


@check("mean-shift")
def mean_shift(machine: Machine) -> Numbers:
    printed = float(cf.mean_shift(machine.small_modulation(_fast(machine)), SMALL))
    independent = _integrated(machine).delta_mu
    return {"printed": printed / SMALL**2, "independent": independent / SMALL**2}


@check("mean-decreases")
def mean_decreases(machine: Machine) -> Numbers:
    printed = float(cf.mean_shift(machine.small_modulation(_fast(machine)), SMALL))
    return {"integrated": _integrated(machine).delta_mu, "Eq. (22)": printed}


@check("age-over-velocity")
def age_over_velocity(machine: Machine) -> Numbers:
    p, V = machine.numbers, _fast(machine)
    point, orbit = machine.small_modulation(V), _integrated(machine)
    # v/V = 1 - (W0/(K V)) df/dt.
    velocity = abs(orbit.c1) * 2 * np.pi * p.frequency * p.W0 / (p.K * V)
    return {
        "printed": float(cf.age_to_velocity_ratio(point, "as_printed")),
        "derived": float(cf.age_to_velocity_ratio(point, "derived")),
        "independent": abs(orbit.log_age1) / velocity,
    }


@check("velocity-modulation")
def velocity_modulation(machine: Machine) -> Numbers:
    point = machine.small_modulation(_fast(machine))
    independent = abs(_integrated(machine).c1) / SMALL / float(point.kappa)
    return {"printed": float(cf.velocity_modulation(point, 1.0)), "independent": independent}
