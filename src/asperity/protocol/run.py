"""Running a protocol into a NetCDF file, with resumption after an interruption.

The finished blocks of a run are saved with the state of the integration, from which an interrupted
run is resumed. A run that begins with unstable steady sliding reports this.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np

from asperity import materials
from asperity.errors import keys_of_file
from asperity.outputs import (
    UnfinishedOutput,
    output_file,
    require_disk,
    require_netcdf,
    undisturbed,
)
from asperity.parameters.arguments import FilePath, at_least, typed
from asperity.protocol.protocol import FIELDS, Protocol, load_protocol
from asperity.protocol.run_file import CHUNKS, append, describe
from asperity.slider import Slider, equation_of_motion
from asperity.theory import closed_forms as cf
from asperity.transients import Checkpoint, integrate_blocks

if TYPE_CHECKING:
    import xarray


#: Growth rate over velocity (1/m) that counts as zero; that of any interface is far larger.
_ROUND_OFF = 1e-3


def stability_statement(protocol: Protocol) -> str:
    """A sentence if the run begins with unstable steady sliding, else empty.

    Without a perturbation such sliding continues until rounding errors have grown, and looks
    stable until then.

    Parameters
    ----------
    protocol : Protocol

    Notes
    -----
    Where no closed form of the critical stiffness exists (other laws, radiation damping, elastic
    asperities with inertia), the rate comes from the equations linearised at steady sliding.
    """
    numbers: dict[str, Any] = {name: number.value for name, number in protocol.numbers.items()}
    level, heavy = protocol.programme.level, protocol.solver.inertia
    # An uneven track perturbs the sliding from the beginning.
    even = protocol.track is None
    if protocol.start.states is not None or not level.velocity > 0 or not even:
        return ""
    lambda_ = numbers.get("lambda", 0.0)
    kc = cf.critical_stiffness_form(protocol.law, elastic=lambda_ != 0, inertia=heavy)
    if kc is None or numbers.get("eta", 0.0) > 0:
        return _linearised(protocol, numbers)
    fields: dict[str, Any] = {name: numbers[name] for name in ("A", "B", "D0", "K")}
    fields |= {"mu": numbers["mu0"], "W0": level.load, "V": level.velocity, "omega": 1.0}
    critical = kc(cf.SmallModulation(**fields, M=numbers.get("M", 0.0), lambda_=lambda_))
    if np.isinf(critical):
        return _linearised(protocol, numbers)
    ratio = float(numbers["K"] / critical)
    if not 0 < ratio < 1:
        return ""
    return _unstable(level.velocity, f"K is {ratio:.3g} of the critical stiffness")


def _linearised(protocol: Protocol, numbers: dict[str, Any]) -> str:
    """The sentence, from the growth rate of a small disturbance of steady sliding."""
    from asperity.slider.problem import flatten
    from asperity.theory.linear_stability import steady_growth

    law, level = protocol.slider.law, protocol.programme.level
    if not law.rate_dependent:
        return ""
    eta = numbers.get("eta", 0.0)
    slider = Slider(law, spring=numbers["K"], load=level.load, mass=numbers.get("M", 0.0))
    (flat, V), _ = flatten((slider, np.array([level.velocity])), "start")
    motion = equation_of_motion(
        flat, V, np.ones(1), inertia=protocol.solver.inertia, eta=eta if eta > 0 else None
    )
    rate = float(steady_growth(motion)[0])
    if not rate > _ROUND_OFF * level.velocity:
        return ""
    return _unstable(level.velocity, f"a disturbance doubles in {math.log(2) / rate:.3g} s")


def _unstable(velocity: float, why: str) -> str:
    return (
        f"steady sliding at {velocity:g} m/s is unstable at the start: {why}; without a "
        "perturbation, such as a step of the load, the run stays on it until rounding errors have "
        "grown"
    )


#: Rows of a block, the most that an interruption loses.
_ROWS = 20_000


@dataclass
class RunProgress:
    """State of a run between two blocks.

    Attributes
    ----------
    lengths : dict of str to int
        Lengths of the growing dimensions in the file.
    time : float
        Time of the last row (s); NaN without one.
    checkpoint : Checkpoint or None
        State from which the integration continues.
    steps, rejected : int
        Steps of the integrator so far.
    unresolved_ringing : float
        Velocity (m/s) below which ringing was not resolved; see `asperity.transient`.
    methods : list of str
        Methods of integration that have been used.
    stopped : str
        Reason why the motion ended before the programme; empty if it did not.
    finished : bool
        Whether no block follows.
    """

    lengths: dict[str, int] = field(default_factory=dict)
    time: float = float("nan")
    checkpoint: Checkpoint | None = None
    steps: int = 0
    rejected: int = 0
    unresolved_ringing: float = 0.0
    methods: list[str] = field(default_factory=list)
    stopped: str = ""
    finished: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, from which doubles are restored exactly."""
        values = asdict(self)
        if self.checkpoint is not None:
            values["checkpoint"]["states"] = self.checkpoint.states.tolist()
        return values

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Self:
        """Read what `to_json` has written.

        Raises
        ------
        TypeError, ValueError
            If the values are not those of a `RunProgress`.
        """
        progress = cls(**values)
        if progress.checkpoint is not None:
            state = dict(values["checkpoint"])
            progress.checkpoint = Checkpoint(**{**state, "states": np.array(state["states"])})
        return progress


@dataclass(frozen=True)
class RunSummary:
    """Counts and end of a run.

    Attributes
    ----------
    rows, events : int
    time : float
        Time of the last row (s).
    stopped : str or None
        Sentence why the motion ended before the programme; None if it did not.
    out : Path
    unstable_start : str
        Sentence that steady sliding is unstable at the start; empty if it is stable.
    """

    rows: int
    events: int
    time: float
    stopped: str | None
    out: Path
    unstable_start: str = ""


@typed
def run_protocol(
    protocol: Protocol | FilePath,
    out: FilePath,
    *,
    resume: bool = False,
    progress: Callable[[float, float], None] | None = None,
    rows: Annotated[int, at_least(1)] = _ROWS,
) -> RunSummary:
    """Integrate the motion of a protocol and write it block by block, as ``asperity run`` does.

    Every block starts from the checkpoint of the block before. An interrupted and resumed run
    therefore gives the same numbers, to the last bit, as an uninterrupted run.

    Parameters
    ----------
    protocol : Protocol or path
        A protocol, or the path of its TOML file.
    out : path
        NetCDF file, written when the run is finished. Until then the finished blocks are in
        ``OUT.partial``, which can be read.
    resume : bool
        Whether to continue an interrupted run, if there is one.
    progress : callable, optional
        Called repeatedly with the time reached and the end of the programme (s).
    rows : int
        Rows of a block. The last bits of the numbers depend on this; a resumed run must have the
        same value.

    Returns
    -------
    RunSummary

    Raises
    ------
    InputError
        If the protocol has a mistake, `out` cannot be written, the disk cannot hold the rows, an
        unfinished run of this name exists, or the interface has no contact at the beginning.
    Interrupted
        On Ctrl-C.

    Examples
    --------
    >>> import asperity as asp
    >>> protocol = asp.protocol.Protocol(
    ...     law="rice-ruina",
    ...     material="bureau2000",
    ...     start={"velocity": "1 um/s"},
    ...     steps=["slide for 2 s", "hold 10 s", "slide at 10 um/s for 2 s"],
    ... )
    >>> print(asp.run(protocol, "run.nc"))
    """
    if not isinstance(protocol, Protocol):
        protocol = load_protocol(protocol)
    target = output_file(out, example="run.nc")
    require_netcdf(target, "out", "run.nc")
    output = UnfinishedOutput(target, {**protocol.inputs, "rows of a block": rows})
    done = _saved_progress(output, resume)
    require_room(protocol, target, done.lengths.get("time", 0))
    duration = protocol.programme.duration
    with output.interruptible(lambda: f"{done.time:.6g} s of {duration:.6g} s"):
        while not done.finished:
            with keys_of_file(FIELDS):
                done = _one_block(protocol, output, done, rows, progress)
            if progress is not None and math.isfinite(done.time):
                progress(done.time, duration)
        attributes = _attributes(protocol, done)
        if unstable := stability_statement(protocol):
            attributes["unstable_start"] = unstable
        undisturbed(partial(_close, output, attributes))
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
    # There is no block after the end of the programme.
    for block in islice(blocks, 1):
        new = not block.time.size or not block.time[0] <= done.time
        dataset = block.to_dataset()
        if not new:
            dataset = dataset.isel(time=slice(1, None))
        if not done.lengths:
            dataset = dataset.assign_attrs(_attributes(protocol, done))
        provenance = block.provenance
        after = RunProgress(
            {name: done.lengths.get(name, 0) + dataset.sizes[name] for name in CHUNKS},
            float(block.time[-1]) if block.time.size else done.time,
            block.checkpoint,
            done.steps + provenance["steps"],
            done.rejected + provenance["rejected_steps"],
            max(done.unresolved_ringing, provenance["unresolved_ringing"]),
            sorted({*done.methods, *provenance["method"].split(" and ")} - {""}),
            block.stopped or "",
            block.termination is not None,
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


def _attributes(protocol: Protocol, done: RunProgress) -> dict[str, Any]:
    """Attributes of the file in addition to those of the solver."""
    numbers = protocol.numbers
    works = materials.cited_works(protocol.slider.law.source)
    if protocol.material:
        source = materials.load_from(protocol.folder, protocol.material).source
        works |= materials.cited_works(source)
    return {
        "title": protocol.title or "run of a protocol",
        "protocol": "; ".join(protocol.lines),
        "start": f"load {protocol.programme.level.load!r} N, "
        f"velocity {protocol.programme.level.velocity!r} m/s",
        "material": protocol.material,
        "origin_of_parameters": "; ".join(f"{n}: {v.origin}" for n, v in numbers.items()),
        "citation": "\n".join(works.values()),
        "method": " and ".join(done.methods),
        "steps": done.steps,
        "unresolved_ringing": done.unresolved_ringing,
        "rejected_steps": done.rejected,
        "stopped": done.stopped or "end of the programme",
    }
