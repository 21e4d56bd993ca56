"""Claims of section II.B.3: the air under the slider, and the control experiment in vacuo."""

from __future__ import annotations

import numpy as np

from asperity.air import AirLayer, NormalContact
from asperity.papers.bureau2000.checks.model import EXT, Model, percent
from asperity.papers.ledger.checks import CheckResult, check


@check("sheared-air")
def _sheared_air(model: Model) -> CheckResult:
    p = model.numbers
    R, V = model.nominal_radius, model.velocities[1]
    viscous = p.eta_air * V * np.pi * R**2 / p.h0
    share = viscous / (p.mu0 * p.W0)
    return CheckResult({"10 um/s": share}, f"{share:.1e} of the friction force")


@check("larger-in-vacuum")
def _larger_in_vacuum(model: Model) -> CheckResult:
    p, applied = model.numbers, 0.2
    shares = {
        "air": model.borne(p.frequency_vacuum, model.air_layer()),
        "vacuum": model.borne(p.frequency_vacuum, None),
    }
    # `response` takes applied amplitudes in terms of the transmission fitted at 120 Hz.
    amplitudes = [applied * share / p.transmission for share in shares.values()]
    r = model.response(EXT, model.velocities[1], amplitudes, frequency=p.frequency_vacuum)
    air, vacuum = (float(x) for x in -r.delta_mu)
    return CheckResult({"eps = 0.2": vacuum / air}, f"{vacuum:.3f} against {air:.3f} at eps = 0.2")


def _ratio(model: Model, layer: AirLayer) -> float:
    f = model.numbers.frequency_vacuum
    return model.borne(f, layer) / model.borne(f, None)


@check("collapse-order")
def _same_order(model: Model) -> CheckResult:
    full, patch = (
        _ratio(model, layer)
        for layer in (model.air_layer(), model.air_layer(R=model.numbers.patch_radius))
    )
    return CheckResult({"full area": full}, f"{full:.3f}; {patch:.3f} with the patch of 2.5 cm")


def _share_at_amplitude(model: Model, epsilon: float) -> float:
    """eps_eff/eps at 120 Hz with the logarithmic law of the contacts, first harmonic only."""
    from scipy.optimize import brentq

    p, omega = model.numbers, 2 * np.pi * model.numbers.frequency
    contact = NormalContact(W0=p.W0, lambda_z=p.lambda_z)
    rest = model.air_layer().dynamic_stiffness(omega) - p.M * omega**2

    def contacts(amplitude: float) -> float:
        return p.W0 * float(contact.load_harmonics(amplitude, count=1)[0])

    def excess(amplitude: float) -> float:
        return abs(contacts(amplitude) + rest * amplitude) - epsilon * p.W0

    amplitude = brentq(excess, 1e-9 * p.lambda_z, 10 * p.lambda_z, xtol=1e-18, rtol=1e-12)
    return contacts(amplitude) / (epsilon * p.W0)


@check("linear-normal-response")
def _linear_normal_response(model: Model) -> CheckResult:
    low, high = model.numbers["epsilon_range"].si_range or (np.nan, np.nan)
    change = _share_at_amplitude(model, high) / _share_at_amplitude(model, low) - 1
    share = high * model.borne(model.numbers.frequency, model.air_layer())
    return CheckResult(
        {"relative change": change},
        f"{change:+.2%} from eps = 0.005 to 0.5; the gap moves by {percent(share)} of lambda_z",
    )
