"""All mistakes in a protocol, in one message."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from asperity.errors import InputError, MistakesError, closest
from asperity.parameters.arguments import shown


class ProtocolError(MistakesError):
    """A protocol that cannot be run."""

    subject = "protocol"


def sentences(error: ValidationError, models: Mapping[str, type[BaseModel]]) -> list[str]:
    """The mistakes that pydantic has found, as ``<field> must <rule>, got <value>; <what to do>``.

    Parameters
    ----------
    error : ValidationError
    models : mapping of str to type of BaseModel
        Model of each table, the protocol's own under ``""``.
    """
    found: list[str] = []
    steps: set[int] = set()
    for mistake in error.errors(include_url=False):
        if mistake["loc"][:1] == ("steps",) and len(mistake["loc"]) > 1:
            # pydantic reports a wrong step once for each kind of step.
            if int(mistake["loc"][1]) in steps:
                continue
            steps.add(int(mistake["loc"][1]))
        own = mistake.get("ctx", {}).get("error")
        if isinstance(own, ProtocolError):
            found += own.mistakes
        elif isinstance(own, InputError):
            found.append(str(own))
        else:
            found.append(_sentence(mistake, models))
    return found


def _sentence(mistake: Any, models: Mapping[str, type[BaseModel]]) -> str:
    place = mistake["loc"]
    if place and place[0] == "steps" and len(place) > 1:
        return (
            f"step {place[1] + 1} must be a text, or a table of repeat and steps, got "
            f"{_shown(mistake)}; write it like 'hold 10 s' or "
            "{ repeat = 3, steps = ['hold 10 s', 'slide for 60 s'] }"
        )
    field = ".".join(map(str, place)) or "protocol"
    if mistake["type"] == "extra_forbidden":
        table = str(place[0]) if len(place) > 1 else ""
        known = models[table].model_fields
        advice = closest(str(place[-1]), known)
        return f"{field} must be a known field, got {_shown(mistake)}; {advice}"
    if mistake["type"] == "missing":
        return f"{field} must be given, got nothing; add it"
    rule = " ".join(mistake["msg"].split()).removeprefix("Input should be ")
    return f"{field} must be {rule}, got {_shown(mistake)}; correct the value"


def _shown(mistake: Any) -> str:
    value = mistake["input"]
    if isinstance(value, Mapping):
        return f"a table of {len(value)} fields"
    return shown(value)
