"""``asperity map``: response and stability over two numbers, as NetCDF and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import option, output_options, parameter_name, point_options, switch
from asperity.cli.report import Output, say
from asperity.errors import InputError, require, symbol
from asperity.parameters.arguments import one_of

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from asperity.questions.point import Point
    from asperity.study.map import Axis

_EPILOG = """\b
Examples:
  asperity map --law elasto-plastic --material bureau2000 -V "1 um/s" -f "120 Hz" \\
      --x "epsilon=0.01:0.5:200" --y "K=0.05:0.5:200 N/um" --out map.nc --plot map.png
  asperity map --law rice-ruina --material bureau2000 -V "1 um/s" -e 0.2 \\
      --x "frequency=0.5:100:60 Hz" --log-x --y "K=0.1:0.6:60 N/um" --out map.nc

\b
An axis is NAME=LOW:HIGH:COUNT UNIT, for any parameter of the law, K, W0, M, eta,
V, epsilon or frequency, or a harmonic of the load, the modulated pull or the
tilt of the exciter (epsilon2, pull, tilt; see asperity response). The file
holds the response at each point, and the stability boundary with the
bifurcation and the frequency of its mode.
"""


#: Quantity of the picture by default.
_SHOWN = "growth_rate"


@click.command(epilog=_EPILOG, short_help="Response and stability over any two numbers.")
@option("--x x", "AXIS", 'Number along x, like "epsilon=0.01:0.5:200".', required=True)
@option("--y y", "AXIS", 'Number along y, like "K=0.05:0.5:200 N/um".', required=True)
@point_options
@output_options(plot=True)
@option("--out", "NC", "Where the map goes, as NetCDF.", Path, required=True)
@option(
    "--show",
    "QUANTITY",
    f"What the picture shows: mu1, delta_mu, floquet_max, ...; {_SHOWN} by default.",
)
@switch("--log-x", "Points along x at equal ratios.")
@switch("--log-y", "Points along y at equal ratios.")
@switch("--resume", "Continue an interrupted map.")
def map(
    x: str,
    y: str,
    log_x: bool,
    log_y: bool,
    point: Point,
    out: Path,
    output: Output,
    show: str | None,
    resume: bool,
) -> int:
    """Response and stability over any two numbers, with the stability boundary.

    The boundary is located to 1e-4 of the axes or better, with the bifurcation and the frequency
    of the mode at each of its points.
    """
    from asperity.cli.progress import bar
    from asperity.laws import get_law
    from asperity.operating_point import offered_numbers, require_given_influence
    from asperity.outputs import output_files, require_netcdf
    from asperity.outputs.sections import Section
    from asperity.parameters import point_parameters
    from asperity.parameters.parameter import count_text
    from asperity.study.map import SHOWN, write_map

    one_of(show or _SHOWN, SHOWN, "--show")
    pictured = show is None or output.plot is not None
    advice = "add --plot map.png or leave it out"
    require(pictured, "--show", "go with --plot", "no picture", advice)
    output.require_picture()
    output_files({"--out": out, "--plot": output.plot})
    require_netcdf(out, "--out", "map.nc")
    along_x, along_y = _axis(x, log_x, "--x"), _axis(y, log_y, "--y")
    # An axis replaces a number of the material; a number given by an option stays, and is refused.
    axes = (along_x.name, along_y.name)
    numbers = {
        name: number
        for name, number in offered_numbers(point, "command line").items()
        if name in point.parameters or name not in axes
    }
    require_given_influence(numbers, "command line", axes)
    with bar("point", "map") as update:
        result = write_map(
            out, point.law, numbers, x=along_x, y=along_y, resume=resume, progress=update
        )
    record = _record(result, out)
    rows = tuple((name, str(record[name])) for name in ("points", "stable", "unstable", "failed"))
    boundaries = []
    known = point_parameters(get_law(point.law))
    units = {name: known[name].unit for name in axes}
    for line in record["boundaries"]:
        kinds = " and ".join(dict.fromkeys(line["kind"]))
        spans = ", ".join(
            f"{symbol(name)} {min(line[name]):.6g} to {max(line[name]):.6g} {unit}".rstrip()
            for name, unit in units.items()
        )
        boundaries.append(f"boundary  {kinds}, {len(line['kind'])} points: {spans}")
    table = [Section("", rows=rows), Section("", tuple(boundaries))]
    output.answer(lambda: record, lambda: table, point.law, "")
    output.draw(lambda: _figure(result, show or _SHOWN))
    unresolved, failed = record["boundary_unresolved_chords"], record["failed"]
    missing = record["boundary_not_found"]
    say(
        missing
        and f"stability changes at {count_text(missing, 'place')} of the grid where no boundary "
        f"was located; the variable 'boundary_result' of {out} says why",
        unresolved
        and f"the boundary bends too much for the grid at {count_text(unresolved, 'place')}, where "
        "it is not known to 1e-4; refine the grid",
        record["reverses"]
        and f"slip would reverse at {count_text(record['reverses'], 'point')}, of a law that slips "
        f"forwards only; the variable 'reverses' of {out} says where",
        failed
        and f"{failed} of {record['points']} points have no response; the variable 'result' of "
        f"{out} says why",
    )
    return 1 if failed else 0


def _axis(text: str, log: bool, option: str) -> Axis:
    """The axis that an option describes; messages name the option."""
    from asperity.study.map import Axis

    try:
        name, *values = text.split("=", 1)
        return Axis.parse("=".join([parameter_name(name.strip()), *values]), log, option)
    except InputError as error:
        raise error.about(option) from None


def _figure(dataset: xarray.Dataset, show: str) -> Figure:
    # Matplotlib takes a third of a second to import.
    from asperity.figures.map import draw_map

    return draw_map(dataset, show)


def _record(dataset: xarray.Dataset, out: Path) -> dict[str, Any]:
    from asperity.study.map.dataset import boundary_lines

    converged = dataset["converged"].values
    stable = int(dataset["stable"].values.sum())
    return {
        "points": int(converged.size),
        "stable": stable,
        "unstable": int(converged.sum()) - stable,
        "failed": int((~converged).sum()),
        "reverses": int(dataset["reverses"].values.sum()),
        "x": dataset.attrs["x"],
        "y": dataset.attrs["y"],
        "boundaries": boundary_lines(dataset),
        "boundary_not_found": int((dataset["boundary_line"].values < 0).sum()),
        "boundary_unresolved_chords": int(dataset.attrs["boundary_unresolved_chords"]),
        "out": str(out),
    }
