"""Claims of section II: the machine, the mean force and its harmonics as measured, and the air.

What the paper's own final model (elasto-plastic, quasi-static) gives for a measurement is compared
with what the text states of it.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from asperity.air import NormalContact
from asperity.ledger import altered, check
from asperity.theory import closed_forms as cf
from asperity.units import from_si
from asperity_papers.bureau2000.machine import (
    APPLIED,
    EXT,
    STRONGEST,
    Float,
    Machine,
    Numbers,
    by_speed,
)

# --- II.A: the machine, and the steadiness of sliding --------------------------------------------


@check("no-stick-slip-under-modulation")
def no_stick_slip(machine: Machine) -> Numbers:
    Kc = float(cf.critical_stiffness(machine.small_modulation(machine.velocities[0])))
    K = from_si(Kc, machine.numbers["K"].unit, "stiffness")
    critical = Machine(altered(machine.numbers, {"K": float(K)}))
    judged = APPLIED.index(STRONGEST) + 1
    worst = by_speed(critical.curve(EXT).floquet_max[:, :judged].max(1))
    # Where the leading multiplier enters the unit circle: its logarithm falls with eps, and
    # np.interp wants its abscissae to rise.
    logarithms = np.log(machine.curve(EXT).floquet_max)
    entered = [np.interp(0.0, row[::-1], APPLIED[::-1]) for row in logarithms]
    return {**worst, "largest": max(worst.values()), **by_speed(entered, "stable from, ")}


# --- II.B.1: the mean force ----------------------------------------------------------------------


def _line(machine: Machine) -> tuple[Float, Float, Float]:
    """Straight lines through the drop from eps = 0.05 to 0.5: slopes, intercepts, residuals."""
    span = slice(APPLIED.index(machine.numbers.epsilon_onset), APPLIED.index(STRONGEST) + 1)
    eps, drop = np.array(APPLIED[span]), -machine.curve(EXT).delta_mu[:, span]
    slope, intercept = np.polyfit(eps, drop.T, 1)
    return slope, intercept, drop - (slope[:, None] * eps + intercept[:, None])


@check("drop-quasi-linear")
def drop_quasi_linear(machine: Machine) -> Numbers:
    slope, intercept, residual = _line(machine)
    worst = np.abs(residual).max(1) / (slope * STRONGEST + intercept)
    return {**by_speed(worst), "worst": float(worst.max()), "slope": float(slope[0])}


@check("drop-not-through-zero")
def drop_not_through_zero(machine: Machine) -> Numbers:
    slope, intercept, residual = _line(machine)
    excess = by_speed(-intercept / np.abs(residual).max(1))
    return excess | by_speed(-intercept / slope, "zero, ")


# --- II.B.3: the air under the slider, and the control experiment in vacuo -----------------------


@check("larger-in-vacuum")
def larger_in_vacuum(machine: Machine) -> Numbers:
    p, applied = machine.numbers, 0.2
    layers = {"air": machine.air_layer(), "vacuum": None}
    shares = [machine.borne(p.frequency_vacuum, layer) for layer in layers.values()]
    # `response` takes applied amplitudes in terms of the transmission fitted at 120 Hz.
    amplitudes = [applied * share / p.transmission for share in shares]
    r = machine.response(EXT, machine.velocities[1], amplitudes, frequency=p.frequency_vacuum)
    air, vacuum = (float(x) for x in -r.delta_mu)
    return {"eps = 0.2": vacuum / air, "air": air, "vacuum": vacuum}


@check("linear-normal-response")
def linear_normal_response(machine: Machine) -> Numbers:
    low, high = machine.range_of("epsilon_range")
    change = _share_at_amplitude(machine, high) / _share_at_amplitude(machine, low) - 1
    share = machine.borne(machine.numbers.frequency, machine.air_layer())
    return {"relative change": change, "gap over lambda_z": high * share}


def _share_at_amplitude(machine: Machine, epsilon: float) -> float:
    """eps_eff/eps at 120 Hz with the logarithmic law of the contacts, first harmonic only."""
    p, omega = machine.numbers, 2 * np.pi * machine.numbers.frequency
    contact = NormalContact(W0=p.W0, lambda_z=p.lambda_z)
    others = machine.air_layer().dynamic_stiffness(omega) - p.M * omega**2

    def contacts(amplitude: float) -> float:
        return p.W0 * float(contact.load_harmonics(amplitude, count=1)[0])

    def excess(amplitude: float) -> float:
        return abs(contacts(amplitude) + others * amplitude) - epsilon * p.W0

    amplitude = brentq(excess, 1e-9 * p.lambda_z, 10 * p.lambda_z, xtol=1e-18, rtol=1e-12)
    return contacts(amplitude) / (epsilon * p.W0)
