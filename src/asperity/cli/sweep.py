"""``asperity sweep``: a plan into a store, and what can be done with one.

Progress is a bar on a terminal, a line every ten seconds in a log.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import Count, json_option
from asperity.cli.progress import interruptible
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.study.engine import SweepProgress


#: Seconds between lines of a log.
_LINES = 10.0

_PERIODS = ((86_400 * 365.25, "years"), (86_400, "days"), (3600, "h"), (60, "min"))


def time_text(seconds: float) -> str:
    """A duration as a person says it; "unknown" where there is no estimate."""
    if not math.isfinite(seconds):
        return "unknown"
    for length, name in _PERIODS:
        if seconds >= 1.5 * length:
            return f"{seconds / length:.3g} {name}"
    return f"{seconds:.3g} s"


@contextmanager
def shown() -> Iterator[tuple[Callable[[SweepProgress], None], Callable[[str], None]]]:
    """Two functions: for the progress of a sweep, and for lines about it.

    Inside, Ctrl-C raises; what is in the store stays, and the message says so.
    """
    last: SweepProgress | None = None
    on_terminal = sys.stderr.isatty()
    with interruptible() as check:
        report, line, close = _bar() if on_terminal else _lines()

        def progress(now: SweepProgress) -> None:
            nonlocal last
            last = now
            check()
            report(now)

        try:
            yield progress, line
        except KeyboardInterrupt:
            done = f"{last.points:,} of {last.total:,} points" if last else "nothing"
            raise KeyboardInterrupt(
                f"interrupted with {done} solved; chunks that are done stay in the store, and the "
                "same command goes on from there"
            ) from None
        finally:
            close()


def _text(now: SweepProgress) -> str:
    return (
        f"{now.points:,} of {now.total:,} points, {now.failed:,} failed, {now.rate:,.0f} points/s, "
        f"{time_text(now.left)} left"
    )


def _lines() -> tuple[Callable[[SweepProgress], None], Callable[[str], None], Callable[[], None]]:
    next_line = time.monotonic() + _LINES

    def report(now: SweepProgress) -> None:
        nonlocal next_line
        if time.monotonic() >= next_line:
            next_line = time.monotonic() + _LINES
            line(_text(now))

    def line(text: str) -> None:
        click.echo(f"{time.strftime('%H:%M:%S')} {text}", err=True)

    return report, line, lambda: None


def _bar() -> tuple[Callable[[SweepProgress], None], Callable[[str], None], Callable[[], None]]:
    from tqdm import tqdm

    bar = tqdm(unit="point", file=sys.stderr, leave=False, dynamic_ncols=True,
               bar_format="{percentage:3.0f}%|{bar}| {desc}")  # fmt: skip

    def report(now: SweepProgress) -> None:
        bar.total, bar.n = now.total, now.points
        bar.set_description_str(_text(now), refresh=True)

    return report, lambda text: tqdm.write(text, file=sys.stderr), bar.close


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
    "--workers", type=Count(), metavar="N", help="Processes of this machine; one a core by default."
)
@click.option(
    "--cluster",
    type=Count(),
    metavar="N",
    help="A Dask cluster of N workers on this machine, instead.",
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
    from asperity.cli.report import to_json
    from asperity.outputs import size_text
    from asperity.outputs.tables import aligned
    from asperity.study import run_sweep

    with shown() as (progress, log):
        result = run_sweep(
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
    names = ("points", "failed", "solved", "seconds", "memory", "lost")
    record: dict[str, Any] = {name: getattr(result, name) for name in names}
    record["out"] = str(result.out)
    rows = [
        ("points", f"{result.points:,}"),
        ("failed", f"{result.failed:,}"),
        ("solved now", f"{result.solved:,} in {result.seconds:.1f} s"),
        ("memory", f"{size_text(result.memory)} in the largest worker"),
        ("store", str(result.out)),
    ]
    click.echo(to_json(record) if as_json else aligned(rows))
    if result.failed:
        click.echo(
            f"asperity: {result.failed:,} of {result.points:,} points have no answer; the variable "
            "'outcome' says why, and asperity sweep status counts the reasons",
            err=True,
        )
    return 1 if result.failed else 0


def _estimate(plan: Path, as_json: bool) -> int:
    from asperity.cli.report import to_json
    from asperity.orbit.search import available_cores
    from asperity.outputs import size_text
    from asperity.outputs.tables import aligned
    from asperity.study import dry_run

    result = dry_run(plan)
    cores = available_cores()
    alone, together = time_text(result.seconds), time_text(result.seconds / cores)
    rows = [
        ("points", f"{result.points:,} ({' x '.join(map(str, result.shape))})"),
        ("chunks", f"{result.chunks:,} of {' x '.join(map(str, result.chunk_shape))} points"),
        ("disk", f"{size_text(result.bytes)} at most"),
        ("sample", f"{result.sample:,} points"),
        ("failed", f"{result.failed:.2%} of the sample"),
        ("time", f"{alone} of one core, about; {together} on {cores}"),
    ]
    click.echo(to_json({**vars(result), "cores": cores}) if as_json else aligned(rows))
    return 0


@sweep.command()
@click.argument("store", type=Path)
@json_option()
def status(store: Path, as_json: bool) -> int:
    """How far a store is, what failed and why, and who has run it."""
    from asperity.cli.report import to_json
    from asperity.outputs import size_text
    from asperity.outputs.tables import aligned
    from asperity.study import store_status

    result = store_status(store)
    if as_json:
        click.echo(to_json({**vars(result), "store": str(result.store)}))
        return 0
    done = result.done / result.points
    rows = [
        ("title", result.title),
        ("points", f"{result.done:,} of {result.points:,} ({done:.1%})"),
        ("chunks", f"{result.chunks_done:,} of {result.chunks:,}"),
        *(
            [("damaged", f"{result.chunks_damaged:,} chunks, which the next run solves again")]
            if result.chunks_damaged
            else []
        ),
        ("failed", f"{result.failed:,}"),
        *((f"  {name}", f"{count:,}") for name, count in result.outcomes.items()),
        ("disk", size_text(result.bytes)),
        ("running", result.running or "no"),
        ("runs", f"{len(result.runs)}"),
        *((f"  {run['started']}", _run_text(run)) for run in result.runs),
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
    from asperity.cli.report import to_json
    from asperity.outputs.tables import aligned
    from asperity.study import summary_statistics

    result = summary_statistics(store)
    if as_json:
        click.echo(to_json(result))
        return 0
    names = ("count", "mean", "std", "min", "max")
    rows = [
        (name, f"{s['count']:,}", *(f"{s[key]:.6g}" for key in names[1:]))
        for name, s in result.items()
    ]
    click.echo(aligned([("", *names), *rows]))
    return 0


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
    from asperity.cli.report import save_figure
    from asperity.figures.slice import plot_slice
    from asperity.outputs import output_file

    where: dict[str, float] = {}
    for name, value in settings_of(at, "--at").items():
        try:
            where[name] = float(value)
        except ValueError:
            raise InputError(
                f"--at must be a number in SI or the number of a row, got '{name}={value}'; write "
                "it like --at epsilon=0.1"
            ) from None
    target = output_file(out, "--out", example="slice.png")
    save_figure(lambda: plot_slice(store, show, x=x, y=y, at=where), target, option="--out")
    return 0
