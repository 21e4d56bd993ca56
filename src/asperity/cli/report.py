"""Answers as they leave: records for programs, sections for people, pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from asperity.errors import InputError
from asperity.outputs import json, output_files, written_file
from asperity.outputs.tables import Section, as_text
from asperity.parameters import NAMES, OUTPUTS, Names, in_names
from asperity.parameters.names import plain_names
from asperity.parameters.parameter import Drawn, labelled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from asperity.laws import Law
    from asperity.operating_point import SourcedNumber
    from asperity.orbit import PeriodicResponse


def to_json(record: Mapping[str, Any], names: Names = "friction", law: str = "") -> str:
    """JSON for people and programs, indented; a number that is not finite becomes null.

    Keys keep the one name of each parameter; ``names`` says what another set of names calls it.
    """
    if names != "friction":
        record = {**record, "names": plain_names(_law_of(law))}
    return json.to_json(record, indent=2)


def sections_text(sections: Iterable[Section], names: Names, law: str = "") -> str:
    """Sections as text, the parameters in a set of names."""
    chosen = _law_of(law)
    return as_text(s.worded(partial(in_names, names=names, law=chosen)) for s in sections)


def _law_of(name: str) -> type[Law] | None:
    from asperity.laws import get_law

    return get_law(name) if name else None


def require_picture(path: Path | None, *inputs: Path) -> None:
    """Check the path of ``--plot`` before anything is computed."""
    if path is None:
        return
    if path.suffix.lower() != ".png":
        raise InputError(f"--plot must be a PNG file, got '{path}'; write it like --plot out.png")
    output_files({"--plot": path}, inputs={f"the file {p}": p for p in inputs})


def write_picture(drawn: Drawn, path: Path | None, names: Names) -> None:
    """Draw an answer where ``--plot`` was given."""
    if path is None:
        return
    save_figure(lambda: drawn.plot(names), path)
    click.echo(f"asperity: the figure is {path}", err=True)


def save_figure(
    draw: Callable[[], Figure], path: Path, names: Names = NAMES[0], option: str = "--plot"
) -> None:
    """Draw a figure in the style of the package, and write it as PNG.

    Parameters
    ----------
    draw : callable
    path : Path
    names : {"friction", "geophysics"}
        Of its labels.
    option : str
        That names the path, for messages.
    """
    from asperity.figures.style import style

    with style(), written_file(path, option) as file:
        labelled(draw(), names).savefig(file, metadata={"Software": None})


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
        Inputs by name.
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
