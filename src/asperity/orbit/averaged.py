"""The response in the limit of fast modulation, where it no longer depends on the frequency."""

from __future__ import annotations

import numpy as np
from jax.typing import ArrayLike

from asperity.loads import Harmonic
from asperity.orbit.periodic import periodic_response
from asperity.orbit.response import PeriodicResponse
from asperity.orbit.steady_sliding import steady_sliding
from asperity.parameters import DRIVE
from asperity.slider import QuasiStatic, Slider
from asperity.slider.problem import Problem, checked_slider, flatten

#: Rate per radian of a perturbation that stands in for zero: the response differs from the limit by
#: about as much, and the elastic motion of asperities, which does not vanish, drowns smaller rates.
_STIFFNESS = 1e-8


def averaged_response(
    slider: Slider, *, velocity: ArrayLike | str, epsilon: ArrayLike | str, harmonics: int = 8
) -> PeriodicResponse:
    """Response to a modulation far faster than the interface: spring force and age are constant.

    The states stay at the values at which the mean slip velocity is V and the age has no
    mean drift; for Rice-Ruina friction

        < exp[(f/w - mu_ss - B phi)/A] > = 1,     < e^(-phi) > = 1.

    Elastic asperities keep modulating the force: mu1 tends to its velocity-independent plateau.

    Parameters
    ----------
    slider : Slider
    velocity : array or str
        Pulling velocity V (m/s), positive.
    epsilon : array or str
        Relative amplitude, 0 <= eps < 1.
    harmonics : int

    Returns
    -------
    PeriodicResponse
        With `frequency` the one that stood in for infinity.

    Raises
    ------
    InputError
        As `periodic_response`.
    """
    checked_slider(slider)
    V = DRIVE["V"].check(velocity)
    problem, shape = flatten(
        Problem(QuasiStatic(slider, V, np.asarray(1.0)), Harmonic(np.asarray(0.0)))
    )
    stiffness = steady_sliding(problem).rate
    omega = np.maximum(stiffness.reshape(shape), 1e-300) / _STIFFNESS
    return periodic_response(
        slider,
        velocity=V,
        epsilon=epsilon,
        frequency=omega / (2 * np.pi),
        harmonics=harmonics,
    )
