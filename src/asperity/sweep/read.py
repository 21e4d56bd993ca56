"""Reading a store with xarray, and the sentences of its outcomes."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from asperity.parameters.arguments import file_path
from asperity.sweep.solve.outcome import reason
from asperity.sweep.store.store import SweepStore

if TYPE_CHECKING:
    import xarray


def open_store(store: str | os.PathLike[str]) -> xarray.Dataset:
    """The dataset of a sweep, finished or not: labelled, with units, and lazy.

    `xarray.open_zarr` opens the same.

    Parameters
    ----------
    store : path

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is damaged.
    """
    import xarray

    found = SweepStore(file_path(store, "store"), mode="r")
    return xarray.open_zarr(found.path, consolidated=False, chunks=None)


def reasons(outcome: Any, detail: Any) -> NDArray[np.object_]:
    """What became of points, as sentences.

    Parameters
    ----------
    outcome, detail : array
        Variables of a store, or parts of them.
    """
    outcome, detail = np.broadcast_arrays(np.asarray(outcome), np.asarray(detail))
    found = np.empty(outcome.shape, dtype=object)
    for i in np.ndindex(outcome.shape):
        found[i] = reason(int(outcome[i]), float(detail[i]))
    return found
