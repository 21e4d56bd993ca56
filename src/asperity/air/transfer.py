"""The fraction of a normal-load modulation that the micro-contacts carry.

Source: Bureau, Baumberger and Caroli (2000), Appendix, Eqs. (39) and (40). The slider
(mass M) moves normally on the contacts' spring kappa_z and the air layer, in parallel:

    (-M w^2 + kappa_z + kappa_layer(w)) delta = eps W0,   delta the amplitude of the closure h0 - h,

    T = kappa_z delta/(eps W0) = 1/(1 - w^2/w0z^2 + kappa_layer/kappa_z).

The contacts carry W(t) = W0 [1 + eps Re(T e^{+i w t})]. Written for the gap h, Eq. (39)
needs -eps W0 on its right-hand side, as a heavier load narrows the gap; with the printed +eps W0,
h is counted as closure. The modulus is the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.air.layer import AirLayer
from asperity.air.normal_contact import NormalContact, Real, as_real
from asperity.errors import InputError
from asperity.parameters.arguments import broadcast_shape, typed


@typed
def transfer_function(
    frequency: ArrayLike,
    *,
    W0: ArrayLike,
    M: ArrayLike,
    lambda_z: ArrayLike,
    layer: AirLayer | None = None,
) -> Any:
    """Complex transfer function T from the applied to the borne load modulation.

    Parameters
    ----------
    frequency : array
        Frequency of the modulation (Hz), not negative.
    W0 : array
        Mean normal load (N).
    M : array
        Mass of the slider (kg); zero leaves inertia out.
    lambda_z : array
        Normal elastic length (m).
    layer : AirLayer or None
        Its fields broadcast with the other arguments. None is a vacuum.

    Returns
    -------
    complex array
        T, dimensionless, e^{+i w t}; 1 at frequency 0. In a vacuum exactly at the resonance, where
        nothing limits the motion, it is infinite.

    Raises
    ------
    InputError
        When an argument is not a finite positive number, the shapes do not broadcast, or the
        stiffnesses leave the range of doubles.
    """
    contact = NormalContact(W0=W0, lambda_z=lambda_z)  # type: ignore[arg-type]
    f = as_real("modulation.frequency", frequency, "frequency", "not negative")
    mass = as_real("modulation.M", M, "mass", "not negative")
    fields: tuple[Real, ...] = ()
    if layer is not None:
        fields = (layer.P0, layer.h0, layer.eta, layer.R, layer.temperature)
    broadcast_shape("modulation.frequency", f, mass, contact.W0, contact.lambda_z, *fields)
    with np.errstate(all="ignore"):
        omega = 2 * np.pi * np.asarray(f)
        denominator = 1 - mass * omega**2 / contact.stiffness + 0j
        if layer is not None:
            denominator = denominator + layer.dynamic_stiffness(omega) / contact.stiffness
    if not np.all(np.isfinite(denominator)):
        rule = "leave stiffnesses that are finite numbers"
        advice = "bring it, the slider and the layer nearer to an experiment"
        raise InputError("modulation.frequency", rule, f"{np.max(f):g} Hz", advice)
    d = np.asarray(denominator)
    # Adding 0 turns the -0.0 imaginary part of 1/(negative real) into +0.0: the phase is then
    # +pi, in (-pi, pi], and not -pi.
    safe = np.where(d == 0, 1.0, d)
    return np.where(d == 0, np.inf, 1 / safe + 0.0)[()]


@typed
def effective_modulation(
    frequency: ArrayLike,
    *,
    W0: ArrayLike,
    M: ArrayLike,
    lambda_z: ArrayLike,
    layer: AirLayer | None = None,
) -> Real:
    """eps_eff/eps = |T|, Eq. (40): the fraction of the modulation that the contacts carry.

    Independent of eps as long as eps_eff << 1. Parameters, shapes and errors as in
    `transfer_function`; in a vacuum it is 1/|1 - w^2/w0z^2|.
    """
    modulus: Real = np.abs(transfer_function(frequency, W0=W0, M=M, lambda_z=lambda_z, layer=layer))
    return modulus


@typed
def modulation_phase(
    frequency: ArrayLike,
    *,
    W0: ArrayLike,
    M: ArrayLike,
    lambda_z: ArrayLike,
    layer: AirLayer | None = None,
) -> Real:
    """Phase arg T (rad) of the borne against the applied modulation, in (-pi, pi].

    Negative is a lag (e^{+i w t}); an air layer always makes the contacts lag. In a vacuum 0 below
    the resonance and pi above. Parameters as in `transfer_function`.
    """
    phase: Real = np.angle(transfer_function(frequency, W0=W0, M=M, lambda_z=lambda_z, layer=layer))
    return phase


@typed
def air_vacuum_ratio(
    frequency: ArrayLike, *, W0: ArrayLike, M: ArrayLike, lambda_z: ArrayLike, layer: AirLayer
) -> Real:
    """eps_eff in air over eps_eff in a vacuum at the same eps (dimensionless).

    The factor by which the paper's figure 5 scales the data in air onto those in vacuo.
    Parameters as in `transfer_function`.

    Raises
    ------
    InputError
        Also if `layer` is None.
    """
    air = effective_modulation(frequency, W0=W0, M=M, lambda_z=lambda_z, layer=layer)
    vacuum = effective_modulation(frequency, W0=W0, M=M, lambda_z=lambda_z)
    return air / vacuum
