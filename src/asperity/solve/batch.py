"""Running a compiled function over many operating points in chunks of a fixed shape.

One shape means one compilation, and bounded memory whatever the number of points. Chunks run on as
many threads as there are cores: XLA releases the interpreter while it computes, and its own
threading of small element-wise programs gains nothing.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


def available_cores() -> int:
    """Cores this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def take(tree: Any, index: Indices) -> Any:
    """The points `index` of a pytree whose arrays carry the points along the last axis."""
    return jax.tree.map(lambda a: a[..., index], tree)


def put(tree: Any, index: Indices, values: Any) -> None:
    """Write `values` for the points `index` into a pytree of NumPy arrays."""

    def write(target: np.ndarray, value: np.ndarray) -> None:
        target[..., index] = value

    jax.tree.map(write, tree, values)


def run_chunks(
    function: Callable[[Any], Any], inputs: Any, index: Indices, chunk: int
) -> Iterator[tuple[Indices, Any]]:
    """Apply `function` to the points `index` of `inputs`.

    Parameters
    ----------
    function : callable
        Compiled; takes a pytree with `chunk` points along the last axis of every
        array, returns another.
    inputs : pytree of NumPy arrays
    index : array of int
        The points to work on.
    chunk : int
        Points per call; the last chunk is filled up with copies of its last point.

    Yields
    ------
    indices, outputs
        In any order as they come, as NumPy arrays without the filling.
    """

    def work(part: Indices) -> tuple[Indices, Any]:
        filled = np.concatenate([part, np.full(chunk - len(part), part[-1])])
        outputs = function(take(inputs, filled))
        return part, jax.tree.map(lambda a: np.asarray(a)[..., : len(part)], outputs)

    parts = [index[i : i + chunk] for i in range(0, len(index), chunk)]
    if len(parts) < 2:
        yield from map(work, parts)
        return
    with ThreadPoolExecutor(available_cores()) as pool:
        pending = []
        try:
            # A bounded queue: results of a million points must not pile up before they are read.
            for part in parts:
                pending.append(pool.submit(work, part))
                if len(pending) > 2 * available_cores():
                    yield pending.pop(0).result()
            while pending:
                yield pending.pop(0).result()
        finally:
            for job in pending:
                job.cancel()
