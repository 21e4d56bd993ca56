"""Claims of section II.B.3: the air under the slider, and the control experiment in vacuo."""

from __future__ import annotations

import numpy as np

from asperity.air import AirLayer, NormalContact
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged
from asperity.study.claims.curves import (
    EXT,
    air_layer,
    borne,
    nominal_radius,
    paper,
    percent,
    response,
    velocities,
)


def claims() -> list[Claim]:
    """All claims of section II.B.3."""
    return [
        _mean_free_path(),
        _sheared_air(),
        _larger_in_vacuum(),
        _collapse(),
        _same_order(),
        _linear_normal_response(),
    ]


def _mean_free_path() -> Claim:
    p = paper()
    layer = air_layer(P0=p.P_vacuum)
    path, gap = float(layer.mean_free_path), float(layer.h0)
    return judged(
        rules.of_order(p.mean_free_path_vacuum, "mean free path in m"),
        {"mean free path": path},
        id="mean-free-path-order",
        place="Section II.B.3",
        statement="At 1 mbar the mean free path is of order 10 um, much larger than the gap.",
        stated=str(p["mean_free_path_vacuum"]),
        computed=f"{1e6 * path:.0f} um, {path / gap:.1f} times the gap",
        how="(eta/P) sqrt(pi R T/(2 m)) with the paper's eta = 1e-5 Pa s, 300 K, h0 = 6.5 um.",
        why="Nearer to the 'several 10 um' of the appendix; with the viscosity of real air 68 um. "
        "The argument gains from it.",
    )


def _sheared_air() -> Claim:
    p = paper()
    R, V = nominal_radius(), velocities()[1]
    viscous = p.eta_air * V * np.pi * R**2 / p.h0
    share = viscous / (p.mu0 * p.W0)
    return judged(
        rules.below(rules.NEGLIGIBLE, "viscous over frictional force"),
        {"10 um/s": share},
        id="sheared-air",
        place="Section II.B.3",
        statement="The viscous force of the sheared air is negligible against friction.",
        stated="mu0 about 0.5 in air and in vacuo",
        computed=f"{share:.1e} of the friction force",
        how="eta V Sigma0/h0 over mu0 W0 at 10 um/s.",
        why="Nearly eight orders of magnitude below friction.",
    )


def _larger_in_vacuum() -> Claim:
    p, applied = paper(), 0.2
    shares = {
        "air": borne(p.frequency_vacuum, air_layer()),
        "vacuum": borne(p.frequency_vacuum, None),
    }
    # `response` takes applied amplitudes in terms of the transmission fitted at 120 Hz.
    amplitudes = [applied * share / p.transmission for share in shares.values()]
    r = response(EXT, velocities()[1], amplitudes, frequency=p.frequency_vacuum)
    air, vacuum = (float(x) for x in -r.delta_mu)
    return judged(
        rules.above(1, "drop in vacuo over drop in air"),
        {"eps = 0.2": vacuum / air},
        id="larger-in-vacuum",
        place="Section II.B.3, Fig. 5",
        statement="At a given eps the drop is larger in vacuo than in air.",
        stated="larger",
        computed=f"{vacuum:.3f} against {air:.3f} at eps = 0.2",
        how="eps_eff/eps of the appendix's air layer and of the vacuum at 200 Hz; elasto-plastic "
        "law at 10 um/s.",
        why="In air the layer bears most of the modulation.",
    )


def _ratio(layer: AirLayer) -> float:
    f = paper().frequency_vacuum
    return borne(f, layer) / borne(f, None)


def _collapse() -> Claim:
    p = paper()
    full, patch = _ratio(air_layer()), _ratio(air_layer(R=p.patch_radius))
    return judged(
        rules.about(1 / p.collapse_divisor_200Hz, "eps_eff in air over eps_eff in vacuo"),
        {"full area": full},
        id="collapse-ratio",
        place="Section II.B.3, Fig. 5; Section I",
        statement="Data in air collapse on those in vacuo as a function of eps/2.5.",
        stated=f"{1 / p.collapse_divisor_200Hz:g}",
        computed=f"{full:.3f} with the full area, {patch:.3f} with the patch of 2.5 cm",
        how="Air layer of the appendix at 200 Hz against the vacuum.",
        why="A measurement; the paper itself notes the factor 2. The patch radius that the paper "
        "chooses to meet 0.48 at 120 Hz meets this number too.",
    )


def _same_order() -> Claim:
    ratio = _ratio(air_layer())
    return judged(
        rules.of_order(paper().transmission_air_over_vacuum, "eps_eff in air over in vacuo"),
        {"full area": ratio},
        id="collapse-order",
        place="Section II.B.3",
        statement="The order of magnitude estimated for eps_eff/eps at 200 Hz is compatible with "
        "the measured value.",
        stated=str(paper()["transmission_air_over_vacuum"]),
        computed=f"{ratio:.3f}",
        how="Air layer of the appendix at 200 Hz against the vacuum.",
        why="Within a factor of 2.",
    )


def _share_at_amplitude(epsilon: float) -> float:
    """eps_eff/eps at 120 Hz with the logarithmic law of the contacts, first harmonic only."""
    from scipy.optimize import brentq

    p, omega = paper(), 2 * np.pi * paper().frequency
    contact = NormalContact(W0=p.W0, lambda_z=p.lambda_z)
    rest = air_layer().dynamic_stiffness(omega) - p.M * omega**2

    def contacts(amplitude: float) -> float:
        return p.W0 * float(contact.load_harmonics(amplitude, count=1)[0])

    def excess(amplitude: float) -> float:
        return abs(contacts(amplitude) + rest * amplitude) - epsilon * p.W0

    amplitude = brentq(excess, 1e-9 * p.lambda_z, 10 * p.lambda_z, xtol=1e-18, rtol=1e-12)
    return contacts(amplitude) / (epsilon * p.W0)


def _linear_normal_response() -> Claim:
    low, high = paper()["epsilon_range"].si_range or (np.nan, np.nan)
    change = _share_at_amplitude(high) / _share_at_amplitude(low) - 1
    share = high * borne(paper().frequency, air_layer())
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "from eps = 0.005 to 0.5, eps_eff/eps"),
        {"relative change": change},
        id="linear-normal-response",
        place="Section II.B.3; Appendix",
        statement="The normal response is linear, so that eps_eff/eps does not depend on eps.",
        stated="independent of eps",
        computed=f"{change:+.2%} from eps = 0.005 to 0.5",
        how="Logarithmic contact law without linearisation, first harmonic balanced against the "
        "air "
        "layer and inertia at 120 Hz.",
        why=f"The gap moves by {percent(share)} of lambda_z at most. With all harmonics, marched "
        "in "
        "time, the change is -0.4 % (see the documentation's page on the air layer).",
    )
