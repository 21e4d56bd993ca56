"""Records for programs: responses as JSON has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.outputs import json
from asperity.parameters import OUTPUTS

if TYPE_CHECKING:
    from asperity.operating_point import SourcedNumber
    from asperity.orbit import PeriodicResponse


def to_json(record: Mapping[str, Any]) -> str:
    """JSON for people and programs, indented; a number that is not finite becomes null."""
    return json.to_json(record, indent=2)


#: Outputs in the order of the JSON; complex ones are pairs of real and imaginary part.
_JSON = (
    *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"),
    *("harmonics", "multipliers", "log_multipliers", "floquet_max"),
    *("stable", "mode", "mode_frequency", "growth_rate", "converged", "result"),
)


def response_record(
    response: PeriodicResponse, numbers: Mapping[str, SourcedNumber]
) -> dict[str, Any]:
    """Everything about the response at one point.

    Parameters
    ----------
    response : PeriodicResponse
        Of a single point.
    numbers : mapping of str to SourcedNumber
        What was asked, by name.
    """
    converged = bool(response.converged)

    def shown(value: Any) -> Any:
        """A number as JSON has it, None without a converged response."""
        array = np.asarray(value)
        if array.dtype.kind in "bOU":
            return array.item()
        if not converged:
            return np.full(array.shape, None).tolist()
        return array.astype(float).tolist()

    record: dict[str, Any] = {}
    for name in _JSON:
        value = np.asarray(getattr(response, name))
        if np.iscomplexobj(value):
            value = np.stack([value.real, value.imag], axis=-1)
        for key in (name, *OUTPUTS[name].former):
            record[key] = shown(value)
    return {**record, "provenance": _provenance(response, numbers)}


def _provenance(response: PeriodicResponse, numbers: Mapping[str, SourcedNumber]) -> dict[str, Any]:
    from asperity.materials import cited_works
    from asperity.parameters import point_parameters

    units = point_parameters(type(response.slider.law))
    provenance = response.provenance
    return {
        "version": provenance.pop("asperity_version"),
        **provenance,
        "parameters": {
            name: {"value": number.value, "unit": units[name].unit, "from": number.origin}
            for name, number in numbers.items()
        },
        "citation": cited_works(provenance["source"]),
    }
