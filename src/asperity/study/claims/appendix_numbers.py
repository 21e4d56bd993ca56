"""Claims of the appendix: stiffnesses, the borne fraction at 120 Hz, the shear of the air."""

from __future__ import annotations

import numpy as np

from asperity.air import shear_viscosity_ratio
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged, judged_formula
from asperity.study.claims.curves import RR, air_layer, borne, nominal_radius, paper, slider

_LAYER = "Air layer of the appendix, R = 3.9 cm"
#: Agreement of numbers that differ by round-off and a central difference only.
TOLERANCE = 1e-3


def claims() -> list[Claim]:
    """All numbers at atmospheric pressure and 120 Hz."""
    return [
        _air_stiffness(),
        _stiffer_than_contacts(),
        _normal_resonance(),
        _normal_inertia(),
        _squeeze_number(),
        _computed_fraction(),
        _same_order(),
        _small_effective_amplitude(),
        _shear_viscosity(),
        _shear_negligible(),
    ]


def _air_stiffness() -> Claim:
    p = paper()
    value = float(air_layer(R=nominal_radius()).stiffness)
    return judged(
        rules.rounds_to(p.kappa_air, 0.1e7, "kappa_air in N/m"),
        {"kappa_air": value},
        id="air-stiffness",
        place="Appendix, Eq. (31)",
        statement="kappa_air = P0 Sigma0/h0 = 7.5e7 N/m.",
        stated=str(p["kappa_air"]),
        computed=f"{value:.3g} N/m",
        how="Sigma0 = 49 cm^2, h0 = 6.5 um, P0 = 1e5 Pa.",
        why="With R = 3.9 cm instead of the area it would be 7.35e7 N/m.",
    )


def _stiffer_than_contacts() -> Claim:
    p = paper()
    ratio = float(air_layer(R=nominal_radius()).stiffness) * p.lambda_z / p.W0
    return judged(
        rules.of_order(p.kappa_air_over_kappa_z, "kappa_air/kappa_z"),
        {"kappa_air/kappa_z": ratio},
        id="air-stiffer-than-contacts",
        place="Appendix",
        statement="kappa_air is one order of magnitude larger than kappa_z at 7 N.",
        stated=str(p["kappa_air_over_kappa_z"]),
        computed=f"{ratio:.1f}",
        how="P0 Sigma0/h0 over W0/lambda_z, lambda_z = 0.4 um.",
        why="Half an order to be precise: stated loosely.",
    )


def _normal_frequency() -> float:
    p = paper()
    return float(np.sqrt(p.W0 / (p.lambda_z * p.M)) / (2 * np.pi))


def _normal_resonance() -> Claim:
    p, value = paper(), _normal_frequency()
    return judged(
        rules.rounds_to(p.normal_resonance, 10, "resonance in Hz"),
        {"resonance": value},
        id="normal-resonance",
        place="Appendix",
        statement="The normal resonance w0/(2 pi) is 530 Hz.",
        stated=str(p["normal_resonance"]),
        computed=f"{value:.1f} Hz",
        how="sqrt(W0/(lambda_z M)), 7 N, 0.4 um, 1.6 kg.",
        why="Rounded to two digits.",
    )


def _normal_inertia() -> Claim:
    p = paper()
    value = (p.frequency / _normal_frequency()) ** 2
    return judged(
        rules.rounds_to(p.normal_inertia_120Hz, 0.1e-2, "inertia over elastic force"),
        {"120 Hz": value},
        id="normal-inertia",
        place="Appendix",
        statement="At 120 Hz the inertia is 5.2e-2 of the elastic force of the asperities.",
        stated=str(p["normal_inertia_120Hz"]),
        computed=f"{value:.4f}",
        how="(120 Hz over the resonance) squared.",
        why="The exact resonance, 526 Hz, was used and not the rounded one.",
    )


def _squeeze_number() -> Claim:
    p, layer = paper(), air_layer()
    value = complex(layer.gamma(2 * np.pi * p.frequency) * layer.R)
    return judged(
        rules.rounds_to(
            p.gammaR_real_part, 1, "real part, and minus the imaginary part, of gamma R"
        ),
        {"real": value.real, "imaginary": -value.imag},
        id="squeeze-number",
        place="Appendix, Eq. (37)",
        statement="gamma R = 4 (1 - i).",
        stated="4 (1 - i)",
        computed=f"{value.real:.3f} (1 - i)",
        how=f"{_LAYER}, 120 Hz.",
        why="Between a viscous leak and an elastic cushion.",
    )


def _computed_fraction() -> Claim:
    p = paper()
    value = borne(p.frequency, air_layer())
    return judged(
        rules.rounds_to(p.transmission_computed_120Hz, 0.01, "eps_eff/eps at 120 Hz"),
        {"120 Hz": value},
        id="borne-fraction-120",
        place="Appendix, Eq. (40)",
        statement="At 120 Hz eps_eff/eps is about 0.24.",
        stated=str(p["transmission_computed_120Hz"]),
        computed=f"{value:.3f}; {borne(p.frequency, air_layer(R=nominal_radius())):.3f} with 49 "
        "cm^2",
        how=f"{_LAYER}.",
        why="Either radius rounds to within 0.01 of the stated number.",
    )


def _same_order() -> Claim:
    p = paper()
    value = borne(p.frequency, air_layer())
    return judged(
        rules.of_order(p.transmission, "eps_eff/eps computed"),
        {"120 Hz": value},
        id="borne-fraction-order",
        place="Appendix",
        statement="The computed eps_eff/eps is of the same order of magnitude as the fitted 0.48.",
        stated=str(p["transmission"]),
        computed=f"{value:.3f}, a factor {p.transmission / value:.2f} lower",
        how=f"{_LAYER}, 120 Hz.",
        why="The smooth discs of the model are an estimate, as the paper says.",
    )


def _small_effective_amplitude() -> Claim:
    p = paper()
    _, epsilon = p["epsilon_range"].si_range or (np.nan, np.nan)
    amplitudes = {
        "air, 120 Hz": epsilon * p.transmission,
        "vacuum, 200 Hz": epsilon * borne(p.frequency_vacuum, None),
    }
    return judged(
        rules.below(1 / rules.MUCH, "eps_eff at eps = 0.5"),
        amplitudes,
        id="small-effective-amplitude",
        place="Appendix",
        statement="The criterion of linearity eps_eff << 1 is always fulfilled in the experiments.",
        stated="eps_eff << 1",
        computed="; ".join(f"{k}: {v:.2f}" for k, v in amplitudes.items()),
        how="0.48 eps in air; 1/|1 - w^2/w0^2| eps in vacuo, if eps reached 0.5 there too.",
        why="Not small against 1, but the conclusion stands: the nonlinearity of the contacts "
        "changes "
        "eps_eff/eps by less than 1 % at eps = 0.5.",
    )


def _shear_ratio(as_printed: bool) -> float:
    p = paper()
    return float(
        shear_viscosity_ratio(
            p.shear_viscosity_velocity,
            W0=p.W0,
            A=p.A,
            layer=air_layer(R=nominal_radius()),
            as_printed=as_printed,
        )
    )


def _two_forces() -> float:
    """Viscous over rate-dependent force of one oscillation, each from its own definition."""
    p, V = paper(), paper().shear_viscosity_velocity
    law, omega, amplitude = slider(RR).law, 2 * np.pi * p.frequency, 1e-9
    velocity = omega * amplitude
    viscous = p.eta_air * velocity * p.Sigma0 / p.h0
    state, nudge = law.steady_state(V), 1e-4 * V
    slope = (law.friction(V + nudge, state, 1.0) - law.friction(V - nudge, state, 1.0)) / (
        2 * nudge
    )
    return viscous / (p.W0 * float(slope) * velocity)


def _shear_viscosity() -> Claim:
    printed, derived, found = _shear_ratio(True), _shear_ratio(False), _two_forces()
    return judged_formula(
        printed=printed,
        derived=derived,
        independent=found,
        tolerance=TOLERANCE,
        id="shear-viscosity-ratio",
        place="Appendix",
        statement="The viscous over the rate-dependent force is eta Sigma0 V/(W0 h0), 1e-7.",
        stated=str(paper()["shear_viscosity_ratio"]),
        computed=f"{printed:.3g} as printed, {derived:.3g} with A, {found:.3g} from the two forces",
        how="100 um/s; the two forces of one oscillation, that of friction from the slope of the "
        "law.",
        why="The rate term is A W0 w dx/V, as the line before says; its A is lost in the ratio.",
    )


def _shear_negligible() -> Claim:
    ratio = _two_forces()
    return judged(
        rules.below(rules.NEGLIGIBLE, "viscous over rate-dependent force"),
        {"100 um/s": ratio},
        id="shear-negligible",
        place="Appendix",
        statement="The shear viscosity of the layer is totally negligible.",
        stated="negligible",
        computed=f"{ratio:.1e}",
        how="The two forces at 100 um/s.",
        why="True with the A as well.",
    )
