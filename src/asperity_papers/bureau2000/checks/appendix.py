"""Claims of the appendix: the contacts in the normal direction, and the air layer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from asperity.air import bessel_ratio, shear_viscosity_ratio
from asperity.ledger import check
from asperity_papers.bureau2000.machine import RR, Float, Machine, Mixed, Numbers

# --- The contacts in the normal direction, and the gap between them ------------------------------


@check("only-fitting-parameter")
def only_fitting_parameter(machine: Machine) -> Mixed:
    p = machine.numbers
    fitted = [n for n in ("A", "B", "D0", "lambda", "transmission") if p[n].kind == "fitted"]
    return {"fitted": len(fitted), "names": " and ".join(fitted)}


# --- The formulas of the air layer, Eqs. (35) to (40) --------------------------------------------


def _layer_by_differences(machine: Machine) -> tuple[Float, NDArray[np.complex128], np.complex128]:
    """Radii, delta P/delta h of Eq. (35) at 120 Hz by finite volumes, and its sum over rings.

    The sum times the width of a ring is the force on the layer per delta h.
    """
    p, layer, cells = machine.numbers, machine.air_layer(), 1000
    omega = 2 * np.pi * p.frequency
    R, h0 = float(layer.R), float(layer.h0)
    dr = R / cells
    faces = dr * np.arange(cells + 1)
    radius = faces[:-1] + dr / 2
    conductance = h0**2 / (12 * p.eta_air) * faces / dr
    # The rim, where the pressure excess is zero, is half a cell from the last centre.
    conductance[-1] *= 2
    volume = radius * dr
    banded = np.zeros((3, cells), dtype=complex)
    banded[0, 1:] = banded[2, :-1] = conductance[1:-1]
    banded[1] = -conductance[:-1] - conductance[1:] - 1j * omega * volume / p.P0
    pressure = np.asarray(solve_banded((1, 1), banded, 1j * omega * volume / h0))
    return np.asarray(radius), pressure, np.sum(pressure * 2 * np.pi * radius)


@check("pressure-profile")
def pressure_profile(machine: Machine) -> Numbers:
    radius, by_differences, _ = _layer_by_differences(machine)
    formula = machine.air_layer().pressure(radius, 2 * np.pi * machine.numbers.frequency)
    distance = np.abs(formula - by_differences).max()
    return {"difference": float(distance / np.abs(by_differences).max())}


@check("pressure-force")
def pressure_force(machine: Machine) -> Numbers:
    radius, _, rings = _layer_by_differences(machine)
    layer, omega = machine.air_layer(), 2 * np.pi * machine.numbers.frequency
    integral = rings * (float(layer.R) / radius.size)
    formula = complex(-layer.dynamic_stiffness(omega))
    return {
        "difference": abs(formula / integral - 1),
        "formula, real": formula.real / 1e6,
        "formula, imaginary": formula.imag / 1e6,
        "integrated, real": integral.real / 1e6,
        "integrated, imaginary": integral.imag / 1e6,
    }


@check("viscous-limit")
def viscous_limit(machine: Machine) -> Numbers:
    p, layer = machine.numbers, machine.air_layer(R=1e-4)
    omega = 2 * np.pi * p.frequency
    expected = -1j * omega * 3 * p.eta_air * float(layer.R) ** 2 / (2 * p.P0 * p.h0**2)
    ratio = complex(bessel_ratio(layer.squeeze(omega))) / expected
    film = 1j * omega * 3 * np.pi * p.eta_air * float(layer.R) ** 4 / (2 * p.h0**3)
    force = complex(layer.dynamic_stiffness(omega)) / film
    return {
        "J2/J0": abs(ratio - 1),
        "force of an incompressible squeeze film": abs(force - 1),
        "ratio": abs(ratio),
        "force over it": abs(force),
    }


@check("spring-and-damper")
def spring_and_damper(machine: Machine) -> Numbers:
    ratios = bessel_ratio(np.geomspace(0.1, 100, 61))
    stiffness = machine.air_layer().dynamic_stiffness(2 * np.pi * machine.numbers.frequency)
    return {
        "spring": float((-ratios.real).min()),
        "damper": float((-ratios.imag).min()),
        "real at 120 Hz": float(stiffness.real / 1e6),
        "imaginary at 120 Hz": float(stiffness.imag / 1e6),
    }


@check("borne-fraction-formula")
def borne_fraction_formula(machine: Machine) -> Numbers:
    p, omega = machine.numbers, 2 * np.pi * machine.numbers.frequency
    radius, _, rings = _layer_by_differences(machine)
    force = rings * float(machine.air_layer().R) / radius.size
    kappa = p.W0 / p.lambda_z
    independent = abs(kappa / (kappa - p.M * omega**2 - force))
    printed = machine.borne(p.frequency, machine.air_layer())
    return {"printed": printed, "independent": float(independent)}


# --- Stiffnesses, the borne fraction at 120 Hz, the shear of the air -----------------------------


def _two_forces(machine: Machine) -> float:
    """Viscous over rate-dependent force of an oscillation, each force from its definition."""
    p, V = machine.numbers, machine.numbers.shear_viscosity_velocity
    law, omega, amplitude = machine.slider(RR).law, 2 * np.pi * p.frequency, 1e-9
    velocity = omega * amplitude
    viscous = p.eta_air * velocity * p.Sigma0 / p.h0
    state, nudge = law.steady_state(V), 1e-4 * V
    change = law.friction(V + nudge, state, 1.0) - law.friction(V - nudge, state, 1.0)
    return viscous / (p.W0 * float(change / (2 * nudge)) * velocity)


@check("shear-viscosity-ratio")
def shear_viscosity(machine: Machine) -> Numbers:
    p, layer = machine.numbers, machine.air_layer(R=machine.nominal_radius)
    printed, derived = (
        float(
            shear_viscosity_ratio(
                p.shear_viscosity_velocity, W0=p.W0, A=p.A, layer=layer, as_printed=as_printed
            )
        )
        for as_printed in (True, False)
    )
    return {"printed": printed, "derived": derived, "independent": _two_forces(machine)}


@check("shear-negligible")
def shear_negligible(machine: Machine) -> Numbers:
    return {"100 um/s": _two_forces(machine)}
