"""Everything that is wrong with a plan, in one message."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from asperity.errors import InputError, MistakesError, closest
from asperity.parameters.arguments import shown


class PlanError(MistakesError):
    """A plan that cannot be run."""

    subject = "plan"


def sentences(error: ValidationError, models: Mapping[str, type[BaseModel]]) -> list[str]:
    """The mistakes that pydantic found, as ``<field> must <rule>, got <value>; <what to do>``.

    Parameters
    ----------
    error : ValidationError
    models : mapping of str to type of BaseModel
        Model of each table by its name, the plan's own under ``""``.
    """
    return [_sentence(mistake, models) for mistake in error.errors(include_url=False)]


def _sentence(mistake: Any, models: Mapping[str, type[BaseModel]]) -> str:
    own = mistake.get("ctx", {}).get("error")
    if isinstance(own, InputError):
        return str(own)
    place = mistake["loc"]
    field = ".".join(map(str, place)) or "plan"
    if mistake["type"] == "extra_forbidden":
        model = models[str(place[0]) if len(place) > 1 else ""]
        known = [f.alias or name for name, f in model.model_fields.items()]
        advice = closest(str(place[-1]), known)
        return f"{field} must be a known field, got {shown(mistake['input'])}; {advice}"
    if mistake["type"] == "missing":
        return f"{field} must be given, got nothing; add it"
    rule = " ".join(mistake["msg"].split()).removeprefix("Input should be ")
    return f"{field} must be {rule}, got {shown(mistake['input'])}; correct the value"
