"""Numbers of a protocol: its own, and its material's for the rest."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from asperity import materials
from asperity.errors import InputError, closest
from asperity.laws import get_law, registered
from asperity.operating_point import SourcedNumber, sourced_numbers
from asperity.parameters import MACHINE, canonical_name, law_parameters
from asperity.slider import Slider
from asperity.slider.named import slider_from


def numbers_of(
    law_name: str,
    given: Mapping[str, float | str],
    material: str,
    folder: Path,
    inertia: bool,
) -> dict[str, SourcedNumber]:
    """Every number that the motion depends on, in SI.

    Parameters
    ----------
    law_name : str
    given : mapping of str to float or str
    material : str
        Name, or file relative to `folder`; empty for none.
    folder : Path
    inertia : bool
        Whether a mass is needed.

    Raises
    ------
    InputError
        If law or material are unknown, a name belongs to neither law nor machine, or a
        number is missing or breaks its rule.
    """
    law = get_law(law_name)
    known = {**law_parameters(law), **MACHINE}
    names = tuple(known)
    for name in given:
        if canonical_name(name, known) is None:
            owners = [n for n, other in registered().items() if name in law_parameters(other)]
            raise InputError(
                f"parameters must belong to {law_name} or the machine, got '{name}'"
                + (f", which belongs to {', '.join(owners)}; leave it out" if owners else "; ")
                + ("" if owners else closest(name, names))
            )
    source = None
    if material:
        file = material.endswith(".toml")
        source = materials.load(folder / material if file else material)
    found = sourced_numbers(given, source, "protocol", law_name)
    needed = [n for n in names if known[n].default is None or (n == "M" and inertia)]
    missing = [n for n in needed if n not in found]
    if missing:
        raise InputError(
            f"parameters must have all numbers of {law_name}, got none for {', '.join(missing)}; "
            f"name a material that has them or give each one, like {missing[0]} = "
            f'"{known[missing[0]].example}"'
        )
    return {name: found[name] for name in names if name in found}


def slider_of(law_name: str, values: Mapping[str, float]) -> Slider:
    """The slider that SI values by name describe."""
    return slider_from(get_law(law_name), values)
