"""``asperity sweep``: a plan into a store, and what can be done with one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from asperity.cli.options import json_option
from asperity.errors import InputError

_EPILOG = """\b
Examples:
  asperity sweep plan.toml --dry-run
  asperity sweep plan.toml --out results.zarr
  asperity sweep plan.toml --out results.zarr --cluster 4
  asperity sweep status results.zarr
  asperity sweep summary results.zarr
  asperity sweep export results.zarr results.nc
  asperity sweep plot results.zarr --show delta_mu --x epsilon --y stiffness_ratio --out drop.png

\b
The same command goes on after an interruption of any kind: chunks that are done
and sound are kept, and the numbers are the same to the last bit.
"""


class SweepGroup(click.Group):
    """A group whose first argument may also be a plan, for the command that runs it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the name of the command that runs a plan in front of one."""
        if args and args[0] not in self.commands and args[0] not in ("-h", "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)

    def collect_usage_pieces(self, ctx: click.Context) -> list[str]:
        """A plan, or a command."""
        return ["PLAN --out STORE [OPTIONS] | COMMAND ..."]


@click.group(cls=SweepGroup, epilog=_EPILOG, invoke_without_command=True)
@click.pass_context
def sweep(context: click.Context) -> None:
    """Solve ten points or a billion: one plan, one command, one labelled store.

    A plan says what varies (products, lists, draws), what stays and what is solved; the store is
    Zarr, which xarray opens. asperity sweep run --help lists the options of a run.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@sweep.command()
@click.argument("plan", type=Path)
@click.option("--out", type=Path, metavar="STORE", help="Folder of the store, like results.zarr.")
@click.option(
    "--workers", type=int, metavar="N", help="Processes of this machine; one a core by default."
)
@click.option(
    "--cluster", type=int, metavar="N", help="A Dask cluster of N workers on this machine, instead."
)
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler that runs, instead.")
@click.option("--extend", is_flag=True, help="The plan has more rows behind those of the store.")
@click.option("--retry-failed", is_flag=True, help="Solve chunks with failed points again.")
@click.option("--dry-run", is_flag=True, help="Only say what it would take, from a sample.")
@json_option()
def run(
    plan: Path,
    out: Path | None,
    workers: int | None,
    cluster: int | None,
    scheduler: str | None,
    extend: bool,
    retry_failed: bool,
    dry_run: bool,
    as_json: bool,
) -> int:
    """Run a plan; "asperity sweep PLAN" is the same."""
    if dry_run:
        return _estimate(plan, as_json)
    if out is None:
        raise InputError(
            "--out must be given, got nothing; name the store, like --out results.zarr"
        )
    from asperity.cli.report import aligned, to_json
    from asperity.cli.sweep.progress import shown
    from asperity.outputs import size_text
    from asperity.sweep import run_sweep

    with shown() as (progress, log):
        found = run_sweep(
            plan,
            out,
            workers=workers,
            cluster=cluster,
            address=scheduler,
            extend_store=extend,
            retry_failed=retry_failed,
            progress=progress,
            log=log,
        )
    record: dict[str, Any] = {**vars(found), "out": str(found.out)}
    rows = [
        ("points", f"{found.points:,}"),
        ("failed", f"{found.failed:,}"),
        ("solved now", f"{found.solved:,} in {found.seconds:.1f} s"),
        ("memory", f"{size_text(found.memory)} in the largest worker"),
        ("store", str(found.out)),
    ]
    click.echo(to_json(record) if as_json else aligned(rows))
    if found.failed:
        click.echo(
            f"asperity: {found.failed:,} of {found.points:,} points have no answer; the variable "
            "'outcome' says why, and asperity sweep status counts the reasons",
            err=True,
        )
    return 1 if found.failed else 0


def _estimate(plan: Path, as_json: bool) -> int:
    from asperity.cli.report import aligned, to_json
    from asperity.cli.sweep.progress import time_text
    from asperity.orbit.search import available_cores
    from asperity.outputs import size_text
    from asperity.sweep import dry_run

    found = dry_run(plan)
    cores = available_cores()
    alone, together = time_text(found.seconds), time_text(found.seconds / cores)
    rows = [
        ("points", f"{found.points:,} ({' x '.join(map(str, found.shape))})"),
        ("chunks", f"{found.chunks:,} of {' x '.join(map(str, found.chunk_shape))} points"),
        ("disk", f"{size_text(found.bytes)} at most"),
        ("sample", f"{found.sample:,} points"),
        ("second stage", f"{found.second_stage:.2%} of the points"),
        ("failed", f"{found.failed:.2%} of the sample"),
        ("time", f"{alone} of one core, about; {together} on {cores}"),
    ]
    click.echo(to_json({**vars(found), "cores": cores}) if as_json else aligned(rows))
    return 0


@sweep.command()
@click.argument("store", type=Path)
@json_option()
def status(store: Path, as_json: bool) -> int:
    """How far a store is, what failed and why, and who has run it."""
    from asperity.cli.report import aligned, to_json
    from asperity.outputs import size_text
    from asperity.sweep import store_status
    from asperity.sweep.status import status_record

    found = store_status(store)
    if as_json:
        click.echo(to_json(status_record(found)))
        return 0
    done = found.done / found.points
    rows = [
        ("title", found.title),
        ("points", f"{found.done:,} of {found.points:,} ({done:.1%})"),
        ("chunks", f"{found.chunks_done:,} of {found.chunks:,}"),
        *(
            [("damaged", f"{found.chunks_damaged:,} chunks, which the next run solves again")]
            if found.chunks_damaged
            else []
        ),
        ("failed", f"{found.failed:,}"),
        *((f"  {name}", f"{count:,}") for name, count in found.outcomes.items()),
        ("disk", size_text(found.bytes)),
        ("running", found.running or "no"),
        ("runs", f"{len(found.runs)}"),
        *((f"  {run['started']}", _run_text(run)) for run in found.runs),
    ]
    click.echo(aligned(rows))
    return 0


def _run_text(run: dict[str, Any]) -> str:
    text = f"{run['workers']} on {run['host']}, asperity {run['asperity']}"
    if not run.get("ended"):
        return f"{text}, not ended"
    return f"{text}, {run['points_solved']:,} points in {run['seconds']:.1f} s"


@sweep.command()
@click.argument("store", type=Path)
@json_option()
def summary(store: Path, as_json: bool) -> int:
    """Count, mean, deviation, smallest and largest value of every output."""
    from asperity.cli.report import aligned, to_json
    from asperity.sweep import summary_statistics

    found = summary_statistics(store)
    if as_json:
        click.echo(to_json(found))
        return 0
    names = ("count", "mean", "std", "min", "max")
    rows = [
        (name, f"{s['count']:,}", *(f"{s[key]:.6g}" for key in names[1:]))
        for name, s in found.items()
    ]
    click.echo(aligned([("", *names), *rows]))
    return 0


@sweep.command()
@click.argument("store", type=Path)
@click.argument("out", type=Path)
def export(store: Path, out: Path) -> int:
    """Write a store to one file: .nc, .csv or .parquet."""
    from asperity.sweep import export_store

    count = export_store(store, out)
    click.echo(f"{count:,} points in {out}")
    return 0


@sweep.command()
@click.argument("store", type=Path)
@click.option("--show", metavar="OUTPUT", help="What is drawn, such as delta_mu.")
@click.option("--x", "x", metavar="AXIS", help="Axis along x.")
@click.option("--y", "y", metavar="AXIS", help="Axis along y; a curve without it.")
@click.option(
    "--at", multiple=True, metavar="AXIS=VALUE", help="Where another axis is: SI value, or row."
)
@click.option("--out", type=Path, metavar="PNG", help="Where the picture goes.")
def plot(
    store: Path,
    show: str | None,
    x: str | None,
    y: str | None,
    at: tuple[str, ...],
    out: Path | None,
) -> int:
    """Draw an output over one or two axes."""
    from asperity.cli.options import settings_of

    for name, value in (("--show", show), ("--x", x), ("--out", out)):
        if value is None:
            raise InputError(f"{name} must be given, got nothing; see asperity sweep plot --help")
    assert show is not None
    assert x is not None
    assert out is not None
    from asperity.figures.slice import plot_slice
    from asperity.figures.style import style
    from asperity.outputs import output_file, written_file

    where = settings_of(at, "--at")
    for name, value in where.items():
        try:
            float(value)
        except ValueError:
            raise InputError(
                f"--at must be a number in SI or the number of a row, got '{name}={value}'; write "
                "it like --at epsilon=0.1"
            ) from None
    target = output_file(out, "--out", example="slice.png")
    with style(), written_file(target, "--out") as file:
        figure = plot_slice(store, show, x=x, y=y, at={n: float(v) for n, v in where.items()})
        figure.savefig(file, metadata={"Software": None})
    return 0
