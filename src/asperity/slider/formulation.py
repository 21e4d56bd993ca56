"""Which equation of motion a question asks for."""

from __future__ import annotations

import numpy as np
from jax.typing import ArrayLike

from asperity.errors import InputError
from asperity.slider.inertial import Inertial, RadiatingAsperities, StiffInertial
from asperity.slider.motion import Motion
from asperity.slider.quasi_static import QuasiStatic
from asperity.slider.radiating import Radiating
from asperity.slider.slider import Slider


def equation_of_motion(
    slider: Slider,
    V: ArrayLike,
    omega: ArrayLike,
    *,
    inertia: bool = False,
    eta: ArrayLike | None = None,
) -> Motion:
    """The equation of motion with or without inertia and radiation damping.

    Parameters
    ----------
    slider : Slider
    V, omega : array
        Pulling velocity (m/s) and angular frequency of the modulation (rad/s).
    inertia : bool
        Whether the mass of the slider counts.
    eta : array, optional
        Radiation damping (N s/m); None for none.

    Returns
    -------
    Motion

    Raises
    ------
    InputError
        If inertia is asked for without a mass, damping is not positive where nothing else
        would be left of it, a batch mixes points with and without elastic asperities, or either is
        asked of a law that does not depend on the velocity.
    """
    if not inertia and eta is None:
        return QuasiStatic(slider, V, omega)
    if not slider.law.rate_dependent:
        raise InputError(
            f"law must depend on the velocity where inertia or radiation damping counts, got "
            f"{slider.law.name}; leave both out or choose another law"
        )
    if inertia:
        _require_positive("slider.M", slider.M, "kg", "give the mass, as mass='1.6 kg'")
    else:
        _require_positive("radiation_damping", eta, "N s/m", "leave it out where there is none")
    damping = 0.0 if eta is None else eta
    if _elastic(slider):
        asperities = Inertial if inertia else RadiatingAsperities
        return asperities(slider, V, omega, damping)
    bare = StiffInertial if inertia else Radiating
    return bare(slider, V, omega, damping)


def _require_positive(name: str, value: ArrayLike | None, unit: str, remedy: str) -> None:
    array = np.asarray(value, float)
    bad = array[~(array > 0)]
    if bad.size:
        raise InputError(f"{name} must be positive, got {bad.flat[0]:g} {unit}; {remedy}")


def _elastic(slider: Slider) -> bool:
    """Whether the asperities are elastic, at every point or at none."""
    length = np.asarray(slider.law.elastic_length)
    if np.any(length > 0) and np.any(length == 0):
        raise InputError(
            "law.lambda must be positive at all points or 0 at all points when inertia or "
            "radiation damping counts, got both: the states differ; solve the two groups separately"
        )
    return bool(np.all(length > 0))
