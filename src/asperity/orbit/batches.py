"""Running a compiled function over many operating points in chunks of a fixed shape.

One shape needs one compilation, and the memory does not grow with the number of points. Chunks run
in sequence: programs of XLA's CPU backend that are called from several threads may deadlock.
Several cores are used by several processes, see `asperity.orbit.search`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import jax
import numpy as np

from asperity._jax import spare_mappings
from asperity.arrays import Index

#: Points in a block of the fast method; not a power of two, at which arrays share cache lines.
FAST_BLOCK = 240

#: Points in a call for a single operating point, as a slider of the page moves it.
FEW = 8

#: Chunks whose points are gathered at once: an index for each of dozens of arrays costs a call of
#: the fast method a tenth of its time, a slice nothing.
_GATHERED = 16

#: Points in a chunk of orbits on meshes, for up to three states and for more: a few points that
#: need a finer mesh than the others take a smaller chunk.
_MESH_CHUNKS = ((24, 8), (8,))


def points_of(tree: Any) -> int:
    """How many points a pytree holds whose arrays carry the points along the last axis."""
    return int(jax.tree.leaves(tree)[0].shape[-1])


def take(tree: Any, index: Index | slice) -> Any:
    """The points `index` of a pytree whose arrays carry the points along the last axis."""
    return jax.tree.map(lambda a: a[..., index], tree)


def put(tree: Any, index: Index, values: Any) -> None:
    """Write `values` for the points `index` into a pytree of NumPy arrays."""
    where = _as_slice(index)

    def write(target: np.ndarray, value: np.ndarray) -> None:
        target[..., where] = value

    jax.tree.map(write, tree, values)


def _as_slice(index: Index) -> Index | slice:
    """Consecutive points as a slice, which reads and writes them in a seventh of the time."""
    block = len(index) > 0 and bool((np.diff(index) == 1).all())
    return slice(index[0], index[-1] + 1) if block else index


def run_chunks(
    function: Callable[..., Any],
    inputs: tuple[Any, ...],
    index: Index,
    chunk: int | tuple[int, ...],
) -> Iterator[tuple[Index, Any]]:
    """Apply `function` to the points `index` of `inputs`.

    Parameters
    ----------
    function : callable
        Takes pytrees with as many points as a chunk has along the last axis of every array,
        returns another.
    inputs : tuple of pytrees of NumPy arrays
        Its arguments.
    index : array of int
        The points to work on.
    chunk : int or tuple of int
        Points per call, or several such numbers in falling order. The last chunk has the smallest
        size that holds the remaining points, and is filled up with copies of its last point.

    Yields
    ------
    indices, outputs
        As NumPy arrays without the filling.
    """
    sizes = (chunk,) if isinstance(chunk, int) else chunk
    for start in range(0, len(index), _GATHERED * sizes[0]):
        gathered = index[start : start + _GATHERED * sizes[0]]
        points = take(inputs, _as_slice(gathered))
        for first in range(0, len(gathered), sizes[0]):
            spare_mappings()
            part = gathered[first : first + sizes[0]]
            size = min(size for size in sizes if size >= len(part))
            full = size == len(part)
            filled = slice(first, first + size) if full else _filled(first, len(part), size)
            outputs = jax.tree.map(np.asarray, function(*take(points, filled)))
            yield part, outputs if full else take(outputs, slice(0, len(part)))


def _filled(first: int, count: int, size: int) -> Index:
    """Indices of `count` points from `first` on, filled up to `size` with the last of them."""
    return np.minimum(np.arange(first, first + size), first + count - 1)


def chunk_of(index: Index, most: int) -> int:
    """Points in a call that works on the points `index`: `FEW`, `FAST_BLOCK` or `most`."""
    return next(size for size in (FEW, FAST_BLOCK, most) if size >= min(len(index), most))


def mesh_chunk(size: int) -> tuple[int, ...]:
    """Points in a call that works on orbits with `size` states on meshes."""
    return _MESH_CHUNKS[size > 3]
