"""What a response says of where its numbers come from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity._version import __version__
from asperity.slider.named import values_as_text

if TYPE_CHECKING:
    from asperity.orbit.response import PeriodicResponse


def provenance_of(response: PeriodicResponse) -> dict[str, Any]:
    """Version, law, conventions, tolerance and source of the numbers."""
    law = type(response.slider.law)
    return {
        "asperity_version": __version__,
        "law": law.name,
        "source": law.source,
        "equation_of_motion": response.motion.name,
        "parameters": values_as_text(response.motion, response.load),
        "relative_tolerance": 1e-8,
        "modulation": response.load.formula,
        "convention": "F/W0 = mean + sum mu_n cos(n w t + phase_n), load w(t) = W/W0",
    }
