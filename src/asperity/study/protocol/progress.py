"""How far a run has come: kept beside its unfinished file, so that it can go on from there.

``OUT.partial`` is a NetCDF file of all finished blocks, ``OUT.partial.json`` its lengths, the
checkpoint behind its last row and the fingerprint of the protocol. The record is replaced after
each block has been written.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError
from asperity.solve.transients import Checkpoint


@dataclass
class Progress:
    """What the record says.

    Attributes
    ----------
    lengths : dict of str to int
        Of the growing dimensions.
    time : float
        Of the last row (s); NaN without one.
    checkpoint : Checkpoint or None
    settled : int
        Segment of the last event "steady", -1 without one.
    steps, rejected : int
        Of the integrator so far.
    methods : list of str
        That it has used.
    stopped : str
        Why the motion ended before the programme; empty where it did not.
    finished : bool
        Whether nothing follows.
    """

    lengths: dict[str, int] = field(default_factory=dict)
    time: float = float("nan")
    checkpoint: Checkpoint | None = None
    settled: int = -1
    steps: int = 0
    rejected: int = 0
    methods: list[str] = field(default_factory=list)
    stopped: str = ""
    finished: bool = False


class Record:
    """The unfinished file of a run and its record.

    Parameters
    ----------
    target : Path
        Appears only when the run is finished.
    fingerprint : str
        Identifies protocol and version.
    """

    def __init__(self, target: Path, fingerprint: str) -> None:
        self.target, self.fingerprint = target, fingerprint
        self.data = target.with_name(target.name + ".partial")
        self.note = target.with_name(target.name + ".partial.json")

    def take_up(self, resume: bool) -> Progress:
        """What an interrupted run has left, or the beginning.

        Raises
        ------
        InputError
            If finished blocks exist and are not to be used, or belong to another protocol.
        """
        if not (self.note.exists() and self.data.exists()):
            return Progress()
        if not resume:
            raise InputError(
                f"{self.target} must not have an unfinished run, got '{self.note}'; "
                "go on with --resume, or delete it to start over"
            )
        try:
            told = json.loads(self.note.read_text(encoding="utf-8"))
            same = told.pop("fingerprint") == self.fingerprint
            progress = Progress(**told)
            if progress.checkpoint is not None:
                progress.checkpoint = _checkpoint(told["checkpoint"])
        except (OSError, ValueError, KeyError, TypeError):
            same = False
        if not same:
            raise InputError(
                f"{self.note} must belong to the same protocol and version, got another; "
                "repeat the earlier command, or delete it to start over"
            )
        return progress

    def keep(self, progress: Progress) -> None:
        """Replace the record, after the block that it tells of has been written."""
        told = {f.name: getattr(progress, f.name) for f in fields(progress)}
        here = progress.checkpoint
        told["checkpoint"] = None if here is None else _plain(here)
        fresh = self.note.with_name(self.note.name + ".new")
        with fresh.open("w", encoding="utf-8") as stream:
            json.dump({"fingerprint": self.fingerprint, **told}, stream)
            stream.flush()
            os.fsync(stream.fileno())
        fresh.replace(self.note)

    def finish(self) -> None:
        """Put the file in its place."""
        self.data.replace(self.target)
        self.note.unlink(missing_ok=True)

    def drop_if_empty(self, progress: Progress) -> None:
        """Leave nothing behind when not one block was finished."""
        if not progress.lengths:
            self.data.unlink(missing_ok=True)
            self.note.unlink(missing_ok=True)


def _plain(checkpoint: Checkpoint) -> dict[str, Any]:
    """JSON writes doubles so that they are read back as they were."""
    told = {f.name: getattr(checkpoint, f.name) for f in fields(checkpoint)}
    return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in told.items()}


def _checkpoint(told: dict[str, Any]) -> Checkpoint:
    values: dict[str, Any] = {
        name: np.array(value) if isinstance(value, list) else value for name, value in told.items()
    }
    return Checkpoint(**values)
