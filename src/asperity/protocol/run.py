"""A protocol from its first step to its last, into a NetCDF file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity import materials
from asperity.errors import InputError
from asperity.outputs import (
    Interrupted,
    UnfinishedOutput,
    output_file,
    require_disk,
    undisturbed,
)
from asperity.protocol.growing_file import CHUNKS, append, describe
from asperity.protocol.progress import RunProgress
from asperity.protocol.protocol import Protocol
from asperity.protocol.stability import stability_statement
from asperity.transients import Trajectory, integrate_blocks

if TYPE_CHECKING:
    import xarray

#: Rows integrated and written at a time: at most so many are lost by an interruption.
_ROWS = 20_000


@dataclass(frozen=True)
class RunSummary:
    """Counts and end of a run.

    Attributes
    ----------
    rows, events : int
    time : float
        Time of the last row (s).
    stopped : str or None
        Why the motion ended before the programme, in a sentence; None where it did not.
    out : Path
    unstable_start : str
        A sentence where the run begins with steady sliding that is unstable; empty where not.
    """

    rows: int
    events: int
    time: float
    stopped: str | None
    out: Path
    unstable_start: str = ""


def run_protocol(
    protocol: Protocol,
    out: str | Path,
    *,
    resume: bool = False,
    progress: Callable[[float, float], None] | None = None,
    rows: int = _ROWS,
) -> RunSummary:
    """Integrate the motion of a protocol and write it block by block.

    Every block starts from the checkpoint of the block before, whether the run was interrupted or
    not: both give the same numbers to the last bit.

    Parameters
    ----------
    protocol : Protocol
    out : str or path
        NetCDF file, written when the run is finished. Until then the finished blocks are in
        ``OUT.partial``, which can be read.
    resume : bool
        Continue an interrupted run; without one, start from the beginning.
    progress : callable, optional
        Called now and then with the time reached and the end of the programme (s).
    rows : int
        Rows of a block. The last bits of the numbers depend on it; a resumed run must have the
        same.

    Returns
    -------
    RunSummary

    Raises
    ------
    InputError
        If `out` cannot be written, the disk cannot hold the rows, an unfinished run of
        this name exists, or the interface has no contact at the beginning.
    Interrupted
        On Ctrl-C.
    """
    target = output_file(out, example="run.nc")
    output = UnfinishedOutput(target, {**protocol.inputs, "rows of a block": rows})
    done = _saved_progress(output, resume)
    require_room(protocol, target, done.lengths.get("time", 0))
    try:
        while not done.finished:
            done = _one_block(protocol, output, done, rows, progress)
            if progress is not None and math.isfinite(done.time):
                progress(done.time, protocol.programme.duration)
        attributes = _attributes(protocol, done)
        if unstable := stability_statement(protocol):
            attributes["unstable_start"] = unstable
        undisturbed(partial(_close, output, attributes))
    except InputError as error:
        # A protocol calls the argument `initial` of a transient otherwise.
        if not str(error).startswith("initial "):
            raise
        raise InputError(f"start.states{str(error).removeprefix('initial')}") from None
    except KeyboardInterrupt:
        total = protocol.programme.duration
        raise Interrupted(
            f"{done.time:.6g} s of {total:.6g} s" if output.progress else ""
        ) from None
    finally:
        output.discard_if_empty()
    return RunSummary(
        done.lengths["time"],
        done.lengths["event"],
        done.time,
        done.stopped or None,
        target,
        unstable,
    )


def require_room(protocol: Protocol, target: Path, finished: int = 0) -> None:
    """Refuse a run whose file is larger than the free space of its disk.

    Parameters
    ----------
    protocol : Protocol
    target : Path
    finished : int
        Rows already written by an interrupted run.

    Raises
    ------
    InputError
        If there is too little room.
    """
    if protocol.rows is not None:
        require_disk(
            (protocol.rows - finished) * protocol.row_bytes, target.parent,
            "solver.sampling", f"{protocol.rows:.6g} rows",
            "lower the rate, shorten the programme, or write to another disk",
        )  # fmt: skip


def _one_block(
    protocol: Protocol,
    output: UnfinishedOutput,
    done: RunProgress,
    rows: int,
    progress: Callable[[float, float], None] | None,
) -> RunProgress:
    blocks = integrate_blocks(
        protocol.slider,
        protocol.programme,
        rows=rows,
        resume=done.checkpoint,
        progress=progress,
        **protocol.integration,
    )
    # After a last block that was filled exactly only the end remains.
    for block in islice(blocks, 1):
        new = not block.time.size or not block.time[0] <= done.time
        events, steady_segment = _new_events(protocol, block, done.steady_segment)
        dataset = block.to_dataset().isel(event=events)
        if not new:
            dataset = dataset.isel(time=slice(1, None))
        if not done.lengths:
            dataset = dataset.assign_attrs(_attributes(protocol, done))
        over = block.termination is not None or _at_end(protocol, block)
        provenance = block.provenance
        after = RunProgress(
            {name: done.lengths.get(name, 0) + dataset.sizes[name] for name in CHUNKS},
            float(block.time[-1]) if block.time.size else done.time,
            block.checkpoint,
            steady_segment,
            done.steps + provenance["steps"],
            done.rejected + provenance["rejected_steps"],
            max(done.unresolved_ringing, provenance["unresolved_ringing"]),
            sorted({*done.methods, *provenance["method"].split(" and ")} - {""}),
            block.stopped or "",
            over,
        )
        undisturbed(partial(_write, output, dataset, done, after))
        return after
    return RunProgress(**{**vars(done), "finished": True})


def _saved_progress(output: UnfinishedOutput, resume: bool) -> RunProgress:
    try:
        return RunProgress.from_json(output.start(resume))
    except (TypeError, KeyError):
        raise output.damaged() from None


def _write(
    output: UnfinishedOutput, dataset: xarray.Dataset, done: RunProgress, after: RunProgress
) -> None:
    append(output.data, dataset, done.lengths)
    output.save(after.to_json())


def _close(output: UnfinishedOutput, attributes: dict[str, Any]) -> None:
    describe(output.data, attributes)
    output.finish()


def _at_end(protocol: Protocol, block: Trajectory) -> bool:
    last = len(protocol.programme.segments) - 1
    here = block.checkpoint
    duration = float(protocol.programme.segments[last].duration)
    return here.segment > last or (here.segment == last and here.t >= duration)


def _new_events(
    protocol: Protocol, block: Trajectory, steady_segment: int
) -> tuple[list[int], int]:
    """Events that no earlier block has; "steady" at most once per segment."""
    kept = []
    for i, event in enumerate(block.events):
        if event.kind == "steady":
            starts = protocol.programme.starts[1:-1]
            segment = int(np.searchsorted(starts, event.time, side="right"))
            if segment <= steady_segment:
                continue
            steady_segment = segment
        kept.append(i)
    return kept, steady_segment


def _attributes(protocol: Protocol, done: RunProgress) -> dict[str, Any]:
    """Attributes of the file besides those of the solver."""
    numbers = protocol.numbers
    return {
        "title": protocol.title or "run of a protocol",
        "protocol": "; ".join(protocol.lines),
        "start": f"load {protocol.programme.level.load!r} N, "
        f"velocity {protocol.programme.level.velocity!r} m/s",
        "material": protocol.material,
        "origin_of_parameters": "; ".join(f"{n}: {v.origin}" for n, v in numbers.items()),
        "citation": "\n".join(materials.cited_works(protocol.slider.law.source).values()),
        "method": " and ".join(done.methods),
        "steps": done.steps,
        "unresolved_ringing": done.unresolved_ringing,
        "rejected_steps": done.rejected,
        "stopped": done.stopped or "end of the programme",
    }
