"""Finished pieces of chunks that are not done: what an interruption must not cost.

A chunk with hard points takes long. Its first stage and each of its batches are kept as files
beside the store, in ``STORE.pieces``, until the chunk is written.
"""

from __future__ import annotations

import os
import shutil
import uuid
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from asperity.sweep.solve import Findings


class Pieces:
    """Pieces of the chunks of one plan.

    Parameters
    ----------
    store : Path
    digest : str
        Of the plan: pieces of another plan are not used.
    """

    def __init__(self, store: Path, digest: str) -> None:
        self.root = pieces_folder(store)
        self.folder = self.root / digest[:16]

    def save(self, name: str, findings: Findings) -> None:
        """Keep a piece."""
        self.folder.mkdir(parents=True, exist_ok=True)
        fresh = self.folder / f"{name}.{uuid.uuid4().hex}.partial"
        try:
            with fresh.open("wb") as stream:
                arrays: dict[str, Any] = {f"number_{n}": v for n, v in findings.numbers.items()}
                np.savez(stream, outcome=findings.outcome, detail=findings.detail, **arrays)
            os.replace(fresh, self.folder / f"{name}.npz")
        finally:
            fresh.unlink(missing_ok=True)

    def load(self, name: str) -> Findings | None:
        """A piece, None where there is none or it is damaged."""
        try:
            with np.load(self.folder / f"{name}.npz", allow_pickle=False) as saved:
                values = {key: saved[key] for key in saved.files}
            numbers = {
                key.removeprefix("number_"): value
                for key, value in values.items()
                if key.startswith("number_")
            }
            return Findings(numbers, values["outcome"], values["detail"])
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None

    def has(self, name: str) -> bool:
        """Whether there is a piece of that name, sound or not."""
        return (self.folder / f"{name}.npz").is_file()

    def drop(self, chunk: int) -> None:
        """Forget the pieces of a chunk."""
        for file in self.folder.glob(f"{chunk}-*"):
            file.unlink(missing_ok=True)


def pieces_folder(store: Path) -> Path:
    """Where the pieces of a store lie."""
    return store.with_name(store.name + ".pieces")


def remove_pieces(store: Path) -> None:
    """Forget all pieces of a store."""
    shutil.rmtree(pieces_folder(store), ignore_errors=True)


def first_name(chunk: int) -> str:
    """Name of the first stage of a chunk."""
    return f"{chunk}-first"


def batch_name(chunk: int, batch: int) -> str:
    """Name of a batch of the second stage."""
    return f"{chunk}-batch-{batch}"
