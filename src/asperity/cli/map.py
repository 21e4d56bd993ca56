"""``asperity map``: response and stability over two numbers, as NetCDF and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import json_option, names_option, plot_option, point_options
from asperity.errors import InputError, closest

if TYPE_CHECKING:
    import xarray

    from asperity.parameters import Names
    from asperity.questions.point import Point

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


@click.command(epilog=_EPILOG)
@click.option("--x", "x", metavar="AXIS", help='Number along x, like "epsilon=0.01:0.5:200".')
@click.option("--y", "y", metavar="AXIS", help='Number along y, like "K=0.05:0.5:200 N/um".')
@point_options
@plot_option()
@names_option()
@json_option()
@click.option("--out", type=Path, metavar="NC", help="Where the map goes, as NetCDF.")
@click.option(
    "--show",
    metavar="QUANTITY",
    default="growth_rate",
    show_default=True,
    help="What the picture shows: mu1, delta_mu, floquet_max, ...",
)
@click.option("--log-x", is_flag=True, help="Points along x at equal ratios.")
@click.option("--log-y", is_flag=True, help="Points along y at equal ratios.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted map.")
def map(
    x: str | None,
    y: str | None,
    log_x: bool,
    log_y: bool,
    point: Point,
    out: Path | None,
    plot: Path | None,
    names: Names,
    show: str,
    resume: bool,
    as_json: bool,
) -> int:
    """Response and stability over any two numbers, with the stability boundary.

    The boundary is located to 1e-4 of the axes or better, with the bifurcation and the frequency
    of the mode at each of its points.
    """
    _check_outputs(out, plot, show)
    result = _solve(point, (x, log_x), (y, log_y), out, resume)
    if plot is not None:
        from asperity.cli.report import save_figure
        from asperity.figures.map import draw_map

        save_figure(lambda: draw_map(result, show), plot, names)
    _print(result, out, as_json, names)
    unresolved = int(result.attrs["boundary_unresolved_chords"])
    if unresolved:
        click.echo(
            f"asperity: the boundary bends too much for the grid at {unresolved} places, where "
            "it is not known to 1e-4; refine the grid",
            err=True,
        )
    failed = int((~result["converged"]).sum())
    if failed:
        click.echo(
            f"asperity: {failed} of {result['converged'].size} points have no response; the "
            f"variable 'result' of {out} says why",
            err=True,
        )
    return 1 if failed else 0


def _solve(
    point: Point,
    x: tuple[str | None, bool],
    y: tuple[str | None, bool],
    out: Path | None,
    resume: bool,
) -> xarray.Dataset:
    from asperity.cli.progress import bar
    from asperity.operating_point import offered_numbers
    from asperity.study.map import Axis, write_map

    axes = []
    for option, (text, log) in (("--x", x), ("--y", y)):
        if text is None:
            raise InputError(
                f"{option} must be given, got nothing; write it like {option} "
                "'epsilon=0.01:0.5:200'"
            )
        axes.append(Axis.parse(text, log))
    # A material's number gives way to an axis; one that was given for this map does not.
    kept, varied = point.parameters, {axis.name for axis in axes}
    numbers = {
        name: number
        for name, number in offered_numbers(point, "command line").items()
        if name in kept or name not in varied
    }
    assert out is not None
    with bar("point", "map") as update:
        return write_map(
            out,
            point.law,
            numbers,
            x=axes[0],
            y=axes[1],
            resume=resume,
            progress=lambda done, total: update(done, total, ""),
        )


def _check_outputs(out: Path | None, plot: Path | None, show: str) -> None:
    """Check files and quantity before anything is solved."""
    from asperity.cli.report import require_picture
    from asperity.outputs import output_files
    from asperity.study.map import SHOWN

    if show not in SHOWN:
        raise InputError(
            f"--show must be a quantity of the map, got '{show}'; {closest(show, SHOWN)}"
        )
    if out is None:
        raise InputError("--out must be given, got nothing; name the file, like --out map.nc")
    require_picture(plot)
    output_files({"--out": out, "--plot": plot})


def _print(dataset: xarray.Dataset, out: Path | None, as_json: bool, names: Names) -> None:
    from asperity.cli.report import to_json
    from asperity.outputs.tables import aligned
    from asperity.parameters import display_name

    record = _record(dataset, out)
    if as_json:
        click.echo(to_json(record, names, str(dataset.attrs["law"])))
        return
    rows = [(name, str(record[name])) for name in ("points", "stable", "unstable", "failed")]
    click.echo(aligned(rows))
    for line in record["boundaries"]:
        kinds = " and ".join(dict.fromkeys(line["kind"]))
        spans = ", ".join(
            f"{display_name(name, names)} {min(line[name]):.6g} to {max(line[name]):.6g}"
            for name in (record["x"], record["y"])
        )
        click.echo(f"boundary  {kinds}, {len(line['kind'])} points: {spans}")


def _record(dataset: xarray.Dataset, out: Path | None) -> dict[str, Any]:
    converged = dataset["converged"].values
    stable = int(dataset["stable"].values.sum())
    sides = (dataset.attrs["x"], dataset.attrs["y"])
    number = dataset["boundary_line"].values
    kinds = dataset["boundary_kind"].values.astype(str)

    def line(index: Any) -> dict[str, Any]:
        values = {name: dataset[f"boundary_{name}"].values[index].tolist() for name in sides}
        frequency = dataset["boundary_mode_frequency"].values[index].tolist()
        return {**values, "kind": kinds[index].tolist(), "mode_frequency": frequency}

    return {
        "points": int(converged.size),
        "stable": stable,
        "unstable": int(converged.sum()) - stable,
        "failed": int((~converged).sum()),
        "x": sides[0],
        "y": sides[1],
        "boundaries": [line(number == k) for k in range(number.max(initial=-1) + 1)],
        "boundary_not_found": int((number < 0).sum()),
        "boundary_unresolved_chords": int(dataset.attrs["boundary_unresolved_chords"]),
        "out": str(out),
    }
