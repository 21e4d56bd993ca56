"""The vibration exciter: the applied load modulation, and the part that the contacts carry."""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.air import AirLayer, transfer_function
from asperity.errors import require
from asperity.loads import Modulate
from asperity.slider import Slider
from asperity.units import to_si


@dataclass(frozen=True)
class Exciter:
    """A harmonic load, of which an air layer may carry a part.

    Attributes
    ----------
    frequency : float
        Hz.
    transfer : complex
        T, borne over applied modulation, e^{+i w t}: eps_eff = abs(T) eps.
    """

    frequency: float
    transfer: complex = 1.0

    @classmethod
    def through_air(
        cls,
        frequency: float | str,
        slider: Slider,
        lambda_z: float | str,
        layer: AirLayer | None,
    ) -> Exciter:
        """The exciter of a slider on elastic contacts and an air layer, None for a vacuum.

        Bureau et al. (2000), Appendix, Eq. (40).

        Parameters
        ----------
        frequency : float or str
            Hz.
        slider : Slider
            With mass and mean load.
        lambda_z : float or str
            Normal elastic length (m).
        layer : AirLayer or None
        """
        hertz = to_si(frequency, "frequency", "exciter.frequency")
        length = to_si(lambda_z, "length", "exciter.lambda_z")
        transfer = transfer_function(
            hertz, W0=np.asarray(slider.W0), M=np.asarray(slider.M), lambda_z=length, layer=layer
        )
        return cls(hertz, complex(transfer))

    def steps(self, epsilon: float, duration: float, rise: float) -> tuple[Modulate, Modulate]:
        """The applied modulation, and that of the load on the contacts.

        Parameters
        ----------
        epsilon : float
            Applied relative amplitude.
        duration, rise : float
            Seconds; the amplitude rises and falls within `rise` each.

        Raises
        ------
        InputError
            If the contacts would be lost.
        """
        size, phase = cmath.polar(self.transfer)
        got = f"{epsilon:g} of which they bear {size * epsilon:g}"
        advice = f"lower it below {1 / (size or np.inf):.3g}"
        loaded = size * epsilon < 1
        require(loaded, "exciter.epsilon", "leave the contacts loaded", got, advice)
        common: dict[str, Any] = {"frequency": self.frequency, "rise": rise, "fall": rise}
        applied = Modulate(duration, epsilon, **common)
        return applied, Modulate(duration, size * epsilon, phase=phase, **common)
