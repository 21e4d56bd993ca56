"""Provenance of a trajectory."""

from __future__ import annotations

from typing import Any

from asperity._version import __version__
from asperity.slider.named import values_as_text
from asperity.transients.integration import Integration


def provenance(integration: Integration) -> dict[str, Any]:
    """Version, law, parameters with units, programme, equations, tolerances and effort."""
    motion = integration.motion
    law = type(motion.slider.law)
    return {
        "asperity_version": __version__,
        "law": law.name,
        "source": law.source,
        "equation_of_motion": motion.name,
        "parameters": values_as_text(motion),
        "programme": repr(integration.programme),
        "method": " and ".join(sorted(integration.methods)),
        "relative_tolerance": integration.tolerances.rtol,
        "absolute_tolerance": integration.tolerances.atol,
        "slip_velocity": integration.thresholds.slip,
        "unresolved_ringing": integration.unresolved,
        "steps": integration.steps,
        "rejected_steps": integration.rejected,
    }
