"""A protocol from its first step to its last, into a NetCDF file."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity import materials
from asperity.errors import InputError
from asperity.solve import Trajectory, integrate_blocks
from asperity.study.protocol.growing import CHUNKS, append, describe
from asperity.study.protocol.progress import Progress, Record
from asperity.study.protocol.protocol import Protocol

if TYPE_CHECKING:
    import xarray

#: Rows integrated and written at a time: what an interruption can cost.
_ROWS = 20_000


@dataclass(frozen=True)
class RunSummary:
    """How a run went.

    Attributes
    ----------
    rows, events : int
    time : float
        Of the last row (s).
    stopped : str or None
        Why the motion ended before the programme, in a sentence; None where it did not.
    out : Path
    """

    rows: int
    events: int
    time: float
    stopped: str | None
    out: Path


class RunInterrupted(KeyboardInterrupt):
    """The user stopped a run; the message says how to go on."""


def run_protocol(
    protocol: Protocol,
    out: str | Path,
    *,
    resume: bool = False,
    progress: Callable[[float], None] | None = None,
    rows: int = _ROWS,
) -> RunSummary:
    """Integrate the motion that a protocol describes, and write it block by block.

    Every block begins at the checkpoint that the one before it left, in an interrupted run and in
    any other: both give the same numbers to the last bit.

    Parameters
    ----------
    protocol : Protocol
    out : str or path
        NetCDF file; appears when the run is finished. Until then ``OUT.partial`` holds the
        finished blocks and can be read.
    resume : bool
        Go on after an interruption; without one, start from the beginning.
    progress : callable, optional
        Called now and then with the time reached (s).
    rows : int
        Rows of a block. They are part of the numbers' last bits, and have to be the same when a
        run is resumed.

    Returns
    -------
    RunSummary

    Raises
    ------
    InputError
        If `out` cannot be written or an unfinished run is in its way.
    RunInterrupted
        On Ctrl-C.
    """
    target = _checked_target(Path(out))
    record = Record(target, f"{protocol.fingerprint} {rows}")
    done = record.take_up(resume)
    try:
        while not done.finished:
            done = _one_block(protocol, record, done, rows, progress)
            if progress is not None:
                progress(done.time)
        _undisturbed(partial(_close, record, _attributes(protocol, done)))
    except KeyboardInterrupt:
        total = protocol.programme.duration
        raise RunInterrupted(
            f"interrupted after {done.time:.6g} s of {total:.6g} s, which '{record.data.name}' "
            "holds; repeat the command with --resume to go on from there"
            if done.lengths
            else "interrupted before the first block was finished; nothing was written"
        ) from None
    finally:
        record.drop_if_empty(done)
    return RunSummary(
        done.lengths["time"], done.lengths["event"], done.time, done.stopped or None, target
    )


def _one_block(
    protocol: Protocol,
    record: Record,
    done: Progress,
    rows: int,
    progress: Callable[[float], None] | None,
) -> Progress:
    blocks = integrate_blocks(
        protocol.slider,
        protocol.programme,
        rows=rows,
        resume=done.checkpoint,
        progress=progress,
        **protocol.integration,
    )
    # Where the last block has filled exactly, nothing but its end is left.
    for block in islice(blocks, 1):
        new = not block.time.size or not block.time[0] <= done.time
        events, settled = _news(protocol, block, done.settled)
        dataset = block.to_dataset().isel(event=events)
        if not new:
            dataset = dataset.isel(time=slice(1, None))
        if not done.lengths:
            dataset = dataset.assign_attrs(_attributes(protocol, done))
        over = block.stop is not None or _at_end(protocol, block)
        told = block.provenance
        after = Progress(
            {name: done.lengths.get(name, 0) + dataset.sizes[name] for name in CHUNKS},
            float(block.time[-1]) if block.time.size else done.time,
            block.checkpoint,
            settled,
            done.steps + told["steps"],
            done.rejected + told["rejected_steps"],
            sorted({*done.methods, *told["method"].split(" and ")} - {""}),
            block.stopped or "",
            over,
        )
        _undisturbed(partial(_write, record, dataset, done, after))
        return after
    return Progress(**{**vars(done), "finished": True})


def _write(record: Record, dataset: xarray.Dataset, done: Progress, after: Progress) -> None:
    append(record.data, dataset, done.lengths)
    record.keep(after)


def _close(record: Record, attributes: dict[str, Any]) -> None:
    describe(record.data, attributes)
    record.finish()


def _undisturbed(work: Callable[[], Any]) -> None:
    """Do what Ctrl-C must not tear apart: it reaches the main thread only, which waits."""
    with ThreadPoolExecutor(1) as worker:
        worker.submit(work).result()


def _at_end(protocol: Protocol, block: Trajectory) -> bool:
    last = len(protocol.programme.segments) - 1
    here = block.checkpoint
    duration = float(protocol.programme.segments[last].duration)
    return here.segment > last or (here.segment == last and here.t >= duration)


def _news(protocol: Protocol, block: Trajectory, settled: int) -> tuple[list[int], int]:
    """Events that no earlier block has told; "steady" counts once in a segment."""
    kept = []
    for i, event in enumerate(block.events):
        if event.kind == "steady":
            starts = protocol.programme.starts[1:-1]
            segment = int(np.searchsorted(starts, event.time, side="right"))
            if segment <= settled:
                continue
            settled = segment
        kept.append(i)
    return kept, settled


def _attributes(protocol: Protocol, done: Progress) -> dict[str, Any]:
    """What the file says about itself besides the provenance of the solver."""
    numbers = protocol.numbers
    source = protocol.slider.law.source
    return {
        "title": protocol.title or "run of a protocol",
        "protocol": "; ".join(protocol.lines),
        "start": f"load {protocol.programme.level.load!r} N, "
        f"velocity {protocol.programme.level.velocity!r} m/s",
        "material": protocol.material,
        "origin_of_parameters": "; ".join(f"{n}: {v.origin}" for n, v in numbers.items()),
        "citation": "\n".join(
            materials.citation(key.strip()) for key in source.split(",") if key.strip()
        ),
        "method": " and ".join(done.methods),
        "steps": done.steps,
        "rejected_steps": done.rejected,
        "stopped": done.stopped or "end of the programme",
    }


def _checked_target(out: Path) -> Path:
    target = out.resolve()
    if target.exists() and not target.is_file():
        raise InputError(
            f"out must be the name of a file, got '{out}', which is none; "
            "add a file name such as 'run.nc'"
        )
    if not target.parent.is_dir():
        raise InputError(
            f"out must lie in a folder that exists, got '{out}'; make the folder or choose another"
        )
    return target
