"""The output of a command: JSON, or sections as text, and a picture."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.errors import require
from asperity.parameters import NAMES, Names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from asperity.outputs.sections import Section

#: Key of the chosen set of names in click's context.
CHOSEN_NAMES = "asperity.names"


@dataclass(frozen=True)
class Output:
    """The options of a command on its output: ``--json``, ``--names`` and ``--plot``.

    Attributes
    ----------
    as_json : bool
    names : {"friction", "geophysics"}
    plot : Path, optional
    """

    as_json: bool = False
    names: Names = NAMES[0]
    plot: Path | None = None

    def answer(
        self,
        record: Callable[[], Mapping[str, Any]],
        sections: Callable[[], Iterable[Section]],
        law: str = "",
        indent: str = "  ",
    ) -> None:
        """Print the record as JSON, or the sections as text.

        Keys of JSON are the names of `asperity.parameters`; with another set of names, the key
        ``names`` maps them to it. A number that is not finite becomes null.

        Parameters
        ----------
        record, sections : callable
            Only the printed one is called.
        law : str
            Law whose parameters are renamed, in addition to those that several laws share.
        indent : str
            Text before each row of a table.
        """
        from asperity.laws import get_law
        from asperity.outputs import json
        from asperity.outputs.sections import as_text
        from asperity.parameters.table import plain_names

        if self.as_json:
            laws = [get_law(law)] if law else []
            names = {} if self.names == NAMES[0] else {"names": plain_names(*laws)}
            click.echo(json.to_json({**record(), **names}, indent=2))
        else:
            click.echo(as_text(sections(), indent))

    def require_picture(self, *inputs: Path) -> None:
        """Check the path of ``--plot`` before anything is computed."""
        from asperity.outputs import output_files

        if self.plot is not None:
            png = self.plot.suffix.lower() == ".png"
            require(
                png, "--plot", "be a PNG file", f"'{self.plot}'", "write it like --plot out.png"
            )
            output_files({"--plot": self.plot}, inputs={f"the file {p}": p for p in inputs})

    def draw(self, draw: Callable[[], Figure]) -> None:
        """Draw a figure if ``--plot`` is given."""
        if self.plot is not None:
            save_figure(draw, self.plot, self.names)
            say(f"the figure is {self.plot}")


def say(*sentences: object) -> None:
    """Print sentences on stderr, a line each; those that are empty are left out."""
    for sentence in filter(None, sentences):
        click.echo(f"asperity: {sentence}", err=True)


def save_figure(
    draw: Callable[[], Figure], path: Path, names: Names = NAMES[0], option: str = "--plot"
) -> None:
    """Draw a figure in the style of the package, and write it as PNG.

    Parameters
    ----------
    draw : callable
    path : Path
    names : {"friction", "geophysics"}
        Names of parameters in its labels.
    option : str
        Option of the path, for messages.
    """
    from asperity.figures.style import style
    from asperity.outputs import written_file
    from asperity.parameters.parameter import labelled

    with style(), written_file(path, option) as file:
        labelled(draw(), names).savefig(file, metadata={"Software": None})
