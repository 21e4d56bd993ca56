"""What drives the slider at one instant: normal load, shear force and pulling velocity."""

from __future__ import annotations

from typing import NamedTuple

from jax import Array
from jax.typing import ArrayLike


class Excitation(NamedTuple):
    """Values and slopes at a phase theta = omega t; slopes are derivatives with respect to theta.

    What is not modulated keeps its default, a number that compiled programs fold away.

    Attributes
    ----------
    w, w_slope : array
        Normal load W/W0 and its slope.
    shear, shear_slope : array
        Force on the slider along the pulling direction, besides the spring's, over W0, and its
        slope: what an exciter at an angle adds.
    pull : array
        Velocity of the far end of the spring over its mean V.
    """

    w: Array
    w_slope: ArrayLike = 0.0
    shear: ArrayLike = 0.0
    shear_slope: ArrayLike = 0.0
    pull: ArrayLike = 1.0
