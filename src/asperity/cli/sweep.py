"""``asperity sweep``: run a plan into a store; status, summary, export and plot of a store."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import Count, option, output_options, switch
from asperity.cli.progress import bar
from asperity.cli.report import Output, save_figure, say
from asperity.errors import InputError, require

if TYPE_CHECKING:
    from asperity.outputs.sections import Section
    from asperity.study.engine import SweepProgress

_PERIODS = ((86_400 * 365.25, "years"), (86_400, "days"), (3600, "h"), (60, "min"))


def _time_text(seconds: float) -> str:
    """A duration in a readable unit; "unknown" if there is no estimate."""
    if not math.isfinite(seconds):
        return "unknown"
    for length, name in _PERIODS:
        if seconds >= 1.5 * length:
            return f"{seconds / length:.3g} {name}"
    return f"{seconds:.3g} s"


def _section(*rows: tuple[str, ...], head: tuple[str, ...] = ()) -> list[Section]:
    from asperity.outputs.sections import Section

    return [Section("", head=head, rows=rows)]


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
After an interruption of any kind the same command continues: finished, undamaged
chunks are kept, and the numbers are the same to the last bit.
"""


class SweepGroup(click.Group):
    """A group whose first argument may also be a plan, which is then run."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert the command ``run`` if the first argument is a plan."""
        if args and args[0] not in self.commands and args[0] not in ("-h", "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)

    def collect_usage_pieces(self, ctx: click.Context) -> list[str]:
        """A plan, or a command."""
        return ["PLAN --out STORE [OPTIONS] | COMMAND ..."]


@click.group(
    cls=SweepGroup,
    epilog=_EPILOG,
    invoke_without_command=True,
    short_help="Solve a plan of ten points or a billion.",
)
@click.pass_context
def sweep(context: click.Context) -> None:
    """Solve ten points or a billion: one plan, one command, one labelled store.

    A plan says what varies (products, lists, draws), what stays fixed and what is solved. The store
    is a Zarr folder, which xarray opens. asperity sweep run --help lists the options of a run.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@sweep.command()
@click.argument("plan", type=Path)
@option("--out", "STORE", "Folder of the store, like results.zarr.", Path)
@option("--workers", "N", "Processes of this machine; one a core by default.", Count())
@option("--cluster", "N", "A Dask cluster of N workers on this machine, instead.", Count())
@option("--scheduler address", "ADDRESS", "A Dask scheduler that runs, instead.")
@switch("--extend extend_store", "The plan has more rows after those of the store.")
@switch("--retry-failed", "Solve chunks with failed points again.")
@switch("--dry-run", "Only say what it would take, from a sample.")
@output_options()
def run(
    plan: Path,
    out: Path | None,
    dry_run: bool,
    output: Output,
    **options: Any,
) -> int:
    """Run a plan; "asperity sweep PLAN" is the same."""
    if dry_run:
        rule, advice = (
            "go without --dry-run",
            "a dry run is that of the whole plan, on this machine",
        )
        for written, name in (
            ("--extend", "extend_store"), ("--retry-failed", "retry_failed"),
            ("--scheduler", "address"),
        ):  # fmt: skip
            require(not options[name], written, rule, "both", advice)
        workers, cluster = options["workers"], options["cluster"]
        one = workers is None or cluster is None
        require(one, "--workers and --cluster", "be given alone", "both", "leave one out")
        return _estimate(plan, cluster if workers is None else workers, output)
    if out is None:
        raise InputError("--out", "be given", "nothing", "name the store, like --out results.zarr")
    from tqdm import tqdm

    from asperity.outputs import size_text
    from asperity.study import run_sweep

    done = "nothing"
    try:
        with bar("point") as update:

            def progress(now: SweepProgress) -> None:
                nonlocal done
                done = f"{now.points:,} of {now.total:,} points"
                label = f"{now.failed:,} failed, {now.rate:,.0f} points/s"
                left = f", {_time_text(now.left)} left" if math.isfinite(now.left) else ""
                update(now.points, now.total, label + left)

            result = run_sweep(
                plan,
                out,
                progress=progress,
                log=lambda text: tqdm.write(text, file=sys.stderr),
                **options,
            )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted with {done} solved; chunks that are done stay in the store, and the "
            "same command goes on from there"
        ) from None
    counts = ("points", "failed", "solved", "seconds", "memory", "lost")
    output.answer(
        lambda: {**{name: getattr(result, name) for name in counts}, "out": str(result.out)},
        lambda: _section(
            ("points", f"{result.points:,}"),
            ("failed", f"{result.failed:,}"),
            ("solved now", f"{result.solved:,} in {result.seconds:.1f} s"),
            ("memory", f"{size_text(result.memory)} in the largest worker"),
            ("store", str(result.out)),
        ),
        indent="",
    )
    if result.failed:
        say(
            f"{result.failed:,} of {result.points:,} points have no answer; the variable "
            "'outcome' says why, and asperity sweep status counts the reasons"
        )
    return 1 if result.failed else 0


def _estimate(plan: Path, processes: int | None, output: Output) -> int:
    from asperity._processes import available_cores, process_count
    from asperity.outputs import size_text
    from asperity.study import dry_run

    result = dry_run(plan)
    cores = available_cores() if processes is None else process_count(processes, "workers")
    alone, together = _time_text(result.seconds), _time_text(result.seconds / cores)
    output.answer(
        lambda: {**vars(result), "cores": cores},
        lambda: _section(
            ("points", f"{result.points:,} ({' x '.join(map(str, result.shape))})"),
            ("chunks", f"{result.chunks:,} of {' x '.join(map(str, result.chunk_shape))} points"),
            ("disk", f"{size_text(result.bytes)} at most"),
            ("sample", f"{result.sample:,} points"),
            ("failed", f"{result.failed:.2%} of the sample"),
            ("time", f"{alone} of one core, about; {together} on {cores}"),
        ),
        indent="",
    )
    return 0


@sweep.command()
@click.argument("store", type=Path)
@output_options()
def status(store: Path, output: Output) -> None:
    """Progress of a store, failed points with reasons, and its runs."""
    from asperity.outputs import size_text
    from asperity.study import store_status

    result = store_status(store)
    damaged = f"{result.chunks_damaged:,} chunks, which the next run solves again"
    share = f"{result.done / result.points:.1%}"
    output.answer(
        lambda: {**vars(result), "store": str(result.store)},
        lambda: _section(
            ("title", result.title),
            ("points", f"{result.done:,} of {result.points:,} ({share})"),
            ("chunks", f"{result.chunks_done:,} of {result.chunks:,}"),
            *([("damaged", damaged)] if result.chunks_damaged else []),
            ("failed", f"{result.failed:,}"),
            *((f"  {name}", f"{count:,}") for name, count in result.outcomes.items()),
            ("disk", size_text(result.bytes)),
            ("running", result.running or "no"),
            ("runs", f"{len(result.runs)}"),
            *((f"  {run['started']}", _run_text(run)) for run in result.runs),
        ),
        indent="",
    )


def _run_text(run: dict[str, Any]) -> str:
    text = f"{run['workers']} on {run['host']}, asperity {run['asperity']}"
    if not run.get("ended"):
        return f"{text}, not ended"
    return f"{text}, {run['points_solved']:,} points in {run['seconds']:.1f} s"


@sweep.command(short_help="Count, mean, deviation and extremes of every output.")
@click.argument("store", type=Path)
@output_options()
def summary(store: Path, output: Output) -> None:
    """Count, mean, deviation, smallest and largest value of every output."""
    from asperity.study import summary_statistics

    result = summary_statistics(store)
    head = ("count", "mean", "std", "min", "max")
    rows = (
        (name, f"{s['count']:,}", *(f"{s[key]:.6g}" for key in head[1:]))
        for name, s in result.items()
    )
    output.answer(lambda: result, lambda: _section(*rows, head=("", *head)), indent="")


@sweep.command()
@click.argument("store", type=Path)
@click.argument("out", type=Path)
def export(store: Path, out: Path) -> int:
    """Write a store to one file: .nc, .csv or .parquet."""
    from asperity.study import export_store

    count = export_store(store, out)
    click.echo(f"{count:,} points in {out}")
    return 0


@sweep.command()
@click.argument("store", type=Path)
@option("--show", "OUTPUT", "What is drawn, such as delta_mu.", required=True)
@option("--x x", "AXIS", "Axis along x.", required=True)
@option("--y y", "AXIS", "Axis along y; a curve without it.")
@option("--at", "AXIS=VALUE", "Where another axis is: its nearest value, or row.", multiple=True)
@option("--out", "PNG", "Where the picture goes.", Path, required=True)
def plot(
    store: Path,
    show: str,
    x: str,
    y: str | None,
    at: tuple[str, ...],
    out: Path,
) -> int:
    """Draw an output over one or two axes."""
    from matplotlib.backend_bases import FigureCanvasBase

    from asperity.cli.options import settings_of
    from asperity.figures.slice import plot_slice
    from asperity.outputs import output_file

    where = settings_of(at, "--at")
    target = output_file(out, "--out", example="slice.png")
    pictures = FigureCanvasBase.get_supported_filetypes()
    known = target.suffix.lower().removeprefix(".") in pictures
    require(known, "--out", "be a picture", f"'{out}'", "write it like slice.png")
    save_figure(lambda: plot_slice(store, show, x=x, y=y, at=where), target, option="--out")
    return 0
