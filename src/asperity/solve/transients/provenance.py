"""Where the numbers of a trajectory come from."""

from __future__ import annotations

import dataclasses
from typing import Any

from asperity._version import __version__
from asperity.slider import QuasiStatic
from asperity.solve.transients.march import March


def provenance(march: March) -> dict[str, Any]:
    """Version, law, parameters with units, programme, equations, tolerances and effort."""
    motion = march.motion
    law = type(motion.slider.law)
    return {
        "asperity_version": __version__,
        "law": law.name,
        "source": law.source,
        "equation_of_motion": motion.name,
        "parameters": _parameters(march),
        "programme": repr(march.programme),
        "method": " and ".join(sorted(march.methods)),
        "relative_tolerance": march.tolerances.rtol,
        "absolute_tolerance": march.tolerances.atol,
        "slip_velocity": march.thresholds.slip,
        "steps": march.steps,
        "rejected_steps": march.rejected,
    }


def _parameters(march: March) -> str:
    motion = march.motion
    slider = motion.slider
    values = {
        field.name.rstrip("_"): (getattr(slider.law, field.name), field.metadata.get("unit", ""))
        for field in dataclasses.fields(slider.law)
    }
    values |= {"K": (slider.K, "N/m"), "W0": (slider.W0, "N")}
    if not isinstance(motion, QuasiStatic):
        values |= {"M": (slider.M, "kg"), "eta": (getattr(motion, "eta", 0.0), "N s/m")}
    return "; ".join(f"{k} = {float(v)!r} {unit}".rstrip() for k, (v, unit) in values.items())
