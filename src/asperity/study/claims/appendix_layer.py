"""Claims of the appendix: the formulas of the air layer, Eqs. (35) to (40)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.air import NormalContact, bessel_ratio
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged, judged_formula
from asperity.study.claims.curves import air_layer, borne, paper

#: What a finite-volume solution of Eq. (35) may leave.
TOLERANCE = 1e-3


def claims() -> list[Claim]:
    """All claims about the formulas of the layer."""
    return [
        _pressure_profile(),
        _pressure_force(),
        _elastic_limit(),
        _viscous_limit(),
        _both_parts(),
        _equation_of_motion_sign(),
        _borne_fraction(),
    ]


def _layer_by_differences() -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Radii and delta P/delta h of Eq. (35) at 120 Hz by finite volumes."""
    from scipy.linalg import solve_banded

    p, layer, omega, cells = paper(), air_layer(), 2 * np.pi * paper().frequency, 1000
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
    pressure = solve_banded((1, 1), banded, 1j * omega * volume / h0)
    return np.asarray(radius, dtype=float), np.asarray(pressure)


def _pressure_profile() -> Claim:
    radius, by_differences = _layer_by_differences()
    formula = air_layer().pressure(radius, 2 * np.pi * paper().frequency)
    gap = float(np.abs(formula - by_differences).max() / np.abs(by_differences).max())
    return judged(
        rules.below(TOLERANCE, "largest difference, over the largest pressure,"),
        {"difference": gap},
        id="pressure-profile",
        place="Appendix, Eqs. (35)-(37)",
        statement="Eq. (36) with gamma of Eq. (37) solves the pressure equation (35).",
        stated="Eqs. (36), (37)",
        computed=f"differs by {gap:.1e}",
        how="Eq. (36) against a finite-volume solution of Eq. (35) at 120 Hz, R = 3.9 cm.",
        why="Correct, signs included.",
    )


def _pressure_force() -> Claim:
    radius, by_differences = _layer_by_differences()
    layer = air_layer()
    dr = float(layer.R) / radius.size
    integral = complex(np.sum(by_differences * 2 * np.pi * radius) * dr)
    formula = complex(-layer.dynamic_stiffness(2 * np.pi * paper().frequency))
    return judged(
        rules.below(TOLERANCE, "relative difference"),
        {"difference": abs(formula / integral - 1)},
        id="pressure-force",
        place="Appendix, Eq. (38)",
        statement="The pressure force is P0 pi R^2 (delta h/h0) J2(gamma R)/J0(gamma R).",
        stated="Eq. (38)",
        computed=f"({formula.real / 1e6:.3f} {formula.imag / 1e6:+.3f}i) N/um, integrated "
        f"({integral.real / 1e6:.3f} {integral.imag / 1e6:+.3f}i) N/um",
        how="Eq. (38) against the integral of a finite-volume solution of Eq. (35) at 120 Hz.",
        why="Correct, sign included.",
    )


def _elastic_limit() -> Claim:
    value = complex(bessel_ratio(1e6))
    return judged(
        rules.below(1e-5, "|J2/J0 + 1| at |gamma R| = 1e6"),
        {"difference": abs(value + 1)},
        id="elastic-limit",
        place="Appendix",
        statement="For gamma R to infinity J2/J0 tends to -1: a purely elastic response.",
        stated="-1",
        computed=f"{value.real:.7f} {value.imag:+.1e}i at |gamma R| = 1e6",
        how="Asymptotic series of the ratio of Bessel functions.",
        why="The air has no time to leak.",
    )


def _viscous_limit() -> Claim:
    p, layer = paper(), air_layer(R=1e-4)
    omega = 2 * np.pi * p.frequency
    expected = -1j * omega * 3 * p.eta_air * float(layer.R) ** 2 / (2 * p.P0 * p.h0**2)
    value = complex(bessel_ratio(layer.squeeze(omega)))
    force = complex(layer.dynamic_stiffness(omega))
    incompressible = 1j * omega * 3 * np.pi * p.eta_air * float(layer.R) ** 4 / (2 * p.h0**3)
    return judged(
        rules.below(1e-4, "relative difference"),
        {
            "J2/J0": abs(value / expected - 1),
            "force of an incompressible squeeze film": abs(force / incompressible - 1),
        },
        id="viscous-limit",
        place="Appendix",
        statement="For gamma R to 0, J2/J0 tends to -iw 3 eta R^2/(2 P0 h0^2): viscous damping.",
        stated="-iw (3 eta R^2)/(2 P0 h0^2)",
        computed=f"ratio {abs(value / expected):.8f}; force over 3 pi eta R^4 w/(2 h0^3) "
        f"{abs(force / incompressible):.8f}",
        how="Layer of R = 0.1 mm at 120 Hz against the limit and the incompressible squeeze film.",
        why="P0 drops out of the force.",
    )


def _both_parts() -> Claim:
    ratios = bessel_ratio(np.geomspace(0.1, 100, 61))
    stiffness = air_layer().dynamic_stiffness(2 * np.pi * paper().frequency)
    return judged(
        rules.above(0, "smallest spring and damper part for |gamma R| from 0.1 to 100"),
        {"spring": float((-ratios.real).min()), "damper": float((-ratios.imag).min())},
        id="spring-and-damper",
        place="Appendix",
        statement="In between, the force has a reactive part that stiffens and a dissipative one.",
        stated="both",
        computed=f"({stiffness.real / 1e6:.1f} {stiffness.imag / 1e6:+.1f}i) N/um at 120 Hz",
        how="-J2/J0, and the dynamic stiffness of the layer of R = 3.9 cm.",
        why="The layer stores and dissipates at any frequency.",
    )


def _equation_of_motion_sign() -> Claim:
    p, epsilon = paper(), 0.01
    contact = NormalContact(W0=p.W0, lambda_z=p.lambda_z)
    printed = epsilon * p.lambda_z
    found = -float(contact.closure(p.W0 * (1 + epsilon)))
    return judged_formula(
        printed=printed,
        derived=-printed,
        independent=found,
        tolerance=TOLERANCE + epsilon,
        id="equation-of-motion-sign",
        place="Appendix, Eq. (39)",
        statement="(-M w^2 + kappa_z) dh - dF_p = +eps W0.",
        stated="+eps W0",
        computed=f"dh under a load 1 % heavier: {1e9 * printed:+.2f} nm as printed, "
        f"{-1e9 * printed:+.2f} nm with -eps W0, {1e9 * found:+.2f} nm from the logarithmic law",
        how="Limit w = 0 of Eq. (39) with P0 = 0 against h0 - h = lambda_z ln(W/W0).",
        why="A heavier load narrows the gap. Eq. (38) counts dh as a widening, Eq. (39) as a "
        "closure; "
        "eps_eff, a modulus, does not notice.",
    )


def _borne_fraction() -> Claim:
    p, omega = paper(), 2 * np.pi * paper().frequency
    radius, by_differences = _layer_by_differences()
    force = np.sum(by_differences * 2 * np.pi * radius) * float(air_layer().R) / radius.size
    kappa = p.W0 / p.lambda_z
    independent = abs(kappa / (kappa - p.M * omega**2 - force))
    value = borne(p.frequency, air_layer())
    return judged(
        rules.agrees(float(independent), TOLERANCE, "Eq. (40)"),
        {"120 Hz": value},
        id="borne-fraction-formula",
        place="Appendix, Eq. (40)",
        statement="eps_eff/eps is given by Eq. (40).",
        stated="Eq. (40)",
        computed=f"{value:.5f}; from the integrated pressure {independent:.5f}",
        how="Eq. (40) against Eq. (39) with the force of a finite-volume solution of Eq. (35).",
        why="Follows from Eqs. (38) and (39), whose sign of eps W0 drops out of the modulus.",
    )
