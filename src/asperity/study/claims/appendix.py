"""Claims of the appendix: the contacts in the normal direction and the gap between them."""

from __future__ import annotations

import numpy as np

from asperity.air import NormalContact, mindlin_length_ratio, normal_length
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged, judged_formula
from asperity.study.claims.curves import nominal_radius, paper, percent


def claims() -> list[Claim]:
    """All claims about the contacts and the gap."""
    return [
        _only_fitting_parameter(),
        _length_of_roughness(),
        _linear_stiffness(),
        _restoring_sign(),
        _length_ratio(),
        _normal_length(),
        _measured_length(),
        _gap(),
        _radius(),
        _pressure_over_modulus(),
        _contact_pressure(),
        _small_pressure(),
    ]


def _only_fitting_parameter() -> Claim:
    p = paper()
    fitted = [n for n in ("A", "B", "D0", "lambda", "transmission") if p[n].kind == "fitted"]
    return judged(
        rules.rounds_to(1, 1e-6, "number of fitted parameters"),
        {"fitted": len(fitted)},
        id="only-fitting-parameter",
        place="Appendix",
        statement="eps_eff/eps is the only fitting parameter of the model.",
        stated="1",
        computed=f"{len(fitted)}: {' and '.join(fitted)}",
        how="Count of the parameters of the elasto-plastic model that the text calls fitted.",
        why="Section III.C integrates with lambda as a free parameter and takes its best fit, 0.7 "
        "um. "
        "True of the Rice-Ruina model.",
    )


def _length_of_roughness() -> Claim:
    p = paper()
    return judged(
        rules.of_order(p.roughness, "lambda_z in m"),
        {"lambda_z": p.lambda_z},
        id="normal-length-of-roughness",
        place="Appendix",
        statement="lambda_z is of the order of the roughness, 1.3 um.",
        stated=str(p["roughness"]),
        computed=f"{p['lambda_z']}, {p.lambda_z / p.roughness:.2f} of the roughness",
        how="lambda_z = lambda/1.7.",
        why="Just outside half a decade, which is 0.316. Harmless: the paper goes on to give "
        "lambda_z itself.",
    )


def _contact() -> NormalContact:
    return NormalContact(W0=paper().W0, lambda_z=paper().lambda_z)


def _linear_stiffness() -> Claim:
    contact, p = _contact(), paper()
    step = 1e-6 * p.lambda_z
    slope = float(contact.load(step) - contact.load(-step)) / (2 * step)
    return judged(
        rules.agrees(float(contact.stiffness), 1e-6, "dW/d(h0 - h) in N/m"),
        {"slope of the logarithmic law": slope},
        id="normal-stiffness",
        place="Appendix, Eq. (30)",
        statement="For small motions the normal stiffness is W/lambda_z.",
        stated="kappa_z = W/lambda_z",
        computed=f"{slope:.4g} N/m at 7 N",
        how="Central difference of h0 - h = lambda_z ln(W/W0).",
        why="Derivative of the logarithm.",
    )


def _restoring_sign() -> Claim:
    p, contact = paper(), _contact()
    closure = 0.01 * p.lambda_z
    printed = p.W0 * -closure / p.lambda_z
    return judged_formula(
        printed=printed,
        derived=-printed,
        independent=float(contact.load(closure)) - p.W0,
        tolerance=0.01,
        id="restoring-force-sign",
        place="Appendix, Eq. (30)",
        statement="The elastic restoring force along z is W0 (h - h0)/lambda_z.",
        stated="+W0 (h - h0)/lambda_z",
        computed=f"gap 0.01 lambda_z narrower: {printed:+.4f} N as printed, {-printed:+.4f} N with "
        f"the sign turned, {float(contact.load(closure)) - p.W0:+.4f} N from the logarithmic law",
        how="Upward force on the slider, in excess of W0.",
        why="A restoring force opposes the displacement; as printed F_el is counted downwards. "
        "Moduli do not notice.",
    )


def _length_ratio() -> Claim:
    p = paper()
    ratio = float(mindlin_length_ratio(p.poisson_ratio))
    return judged(
        rules.about(p.lambda_over_lambda_z, "lambda/lambda_z"),
        {"nu = 0.44": ratio},
        id="length-ratio",
        place="Appendix",
        statement="lambda is expected to be about 1.7 lambda_z for a Poisson ratio of 0.44.",
        stated=str(p["lambda_over_lambda_z"]),
        computed=f"{ratio:.3f}; at most {float(mindlin_length_ratio(0.5)):g}, for nu = 1/2",
        how="(2 - nu)/(2 (1 - nu)), Mindlin's stiffnesses of a contact between like solids.",
        why="No admissible Poisson ratio gives 1.7. With 1.393 lambda_z is 0.50 um and eps_eff/eps "
        "at "
        "120 Hz 0.20 instead of 0.24.",
    )


def _normal_length() -> Claim:
    p = paper()
    value = float(normal_length(p.lambda_, p.lambda_over_lambda_z))
    return judged(
        rules.rounds_to(p.lambda_z, 0.1e-6, "lambda_z in m"),
        {"lambda_z": value},
        id="normal-length",
        place="Appendix",
        statement="lambda = 0.7 um yields lambda_z of about 0.4 um.",
        stated=str(p["lambda_z"]),
        computed=f"{1e6 * value:.3f} um",
        how="0.7 um/1.7.",
        why="Given the ratio 1.7; with Mindlin's 1.393 it would be 0.50 um.",
    )


def _measured_length() -> Claim:
    p = paper()
    return judged(
        rules.rounds_to(p.lambda_, 0.1e-6, "measured lambda in m"),
        {"quasi-static": p.lambda_quasi_static},
        id="measured-lambda",
        place="Appendix; Section III.C",
        statement="lambda = 0.7 um is a measured value.",
        stated="measured, 0.7 um",
        computed=f"measured {p['lambda_quasi_static']}; fitted {p['lambda']}",
        how="Section III.C.",
        why="0.7 um is the fit, 0.62 um the measurement. lambda_z rounds to 0.4 um from either.",
    )


def _gap() -> Claim:
    p = paper()
    return judged(
        rules.rounds_to(p.h0, 0.1e-6, "h0 in m"),
        {"h0": p.gap_over_roughness * p.roughness},
        id="gap",
        place="Appendix",
        statement="The gap is 5 times the roughness of 1.3 um, 6.5 um.",
        stated=str(p["h0"]),
        computed=f"{1e6 * p.gap_over_roughness * p.roughness:.2f} um",
        how="5 x 1.3 um.",
        why="The factor is Brown and Scholz's, for ground glass.",
    )


def _radius() -> Claim:
    p, R = paper(), nominal_radius()
    return judged(
        rules.rounds_to(p.R, 0.1e-2, "radius in m of the disc of 49 cm^2"),
        {"R": R},
        id="radius-of-area",
        place="Appendix",
        statement="R = 3.9 cm and Sigma0 = 49 cm^2 = pi R^2.",
        stated=f"{p['R']}; {p['Sigma0']}",
        computed=f"49 cm^2 is a disc of {100 * R:.3f} cm; 3.9 cm gives "
        f"{1e4 * np.pi * p.R**2:.1f} cm^2",
        how="sqrt(Sigma0/pi).",
        why="Consistent to rounding; the paper uses now one, now the other, 2.5 % apart in area.",
    )


def _pressure_over_modulus() -> Claim:
    p = paper()
    modulus = p.W0 / p.Sigma0 / p.pressure_over_modulus
    return judged(
        rules.between(
            1e9, 1e10, "Young's modulus, in Pa, of a glassy polymer that would make it so,"
        ),
        {"modulus": modulus},
        id="pressure-over-modulus",
        place="Appendix",
        statement="The average pressure is of order 1e-5 of Young's modulus, as in the "
        "experiments.",
        stated=str(p["pressure_over_modulus"]),
        computed=f"{p.W0 / p.Sigma0 / 1e3:.2f} kPa is 1e-5 of {modulus / 1e9:.2f} GPa",
        how="W0/Sigma0 over 1e-5. The paper gives no modulus; glassy polymers have 1 to 10 GPa.",
        why="For PMMA (about 3 GPa) the ratio is nearer 5e-7: the load is lighter than in the "
        "measurements on glass that the gap is taken from.",
    )


def _contact_pressure() -> Claim:
    p = paper()
    pressure = p.W0 / p.Sigma0
    return judged(
        rules.of_order(p.contact_pressure, "W0/Sigma0 in Pa"),
        {"pressure": pressure},
        id="contact-pressure",
        place="Appendix",
        statement="The loading pressure W0/Sigma0 is of order 10 mbar.",
        stated=str(p["contact_pressure"]),
        computed=f"{pressure / 100:.1f} mbar",
        how="7 N over 49 cm^2.",
        why="Nearer to 14 than to 10 mbar.",
    )


def _small_pressure() -> Claim:
    p = paper()
    _, epsilon = p["epsilon_range"].si_range or (np.nan, np.nan)
    ratio = epsilon * p.W0 / p.Sigma0 / p.P0
    return judged(
        rules.below(1 / rules.MUCH, "eps W0/Sigma0 over P0"),
        {"eps = 0.5": ratio},
        id="small-pressure",
        place="Appendix",
        statement="The pressure excess remains much smaller than the atmospheric pressure.",
        stated="much smaller",
        computed=percent(ratio),
        how="Upper bound eps W0/Sigma0 at eps = 0.5.",
        why="Linearisation is legitimate.",
    )
