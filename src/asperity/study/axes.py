"""The axes of a sweep: rows of numbers that belong together, listed or drawn."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Column = NDArray[Any]

#: Columns of texts.
TEXTS = ("law", "data")

#: Rows that are drawn at a time with a seed of their own: any of them can be drawn without those
#: before.
_DRAWN_TOGETHER = 4096

#: Bits of a Sobol sequence, which has as many points; SciPy cannot skip points of longer ones.
SOBOL_BITS = 30


class SweepAxis(ABC):
    """One axis: a name, a length, and the columns that vary along it.

    Attributes
    ----------
    name : str
    length : int
    names : tuple of str
        Of the columns: parameters, ratios, or ``law``.
    """

    name: str

    @property
    @abstractmethod
    def length(self) -> int:
        """Number of rows."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""

    @abstractmethod
    def rows(self, start: int, stop: int) -> dict[str, Column]:
        """The columns from row `start` to before `stop`: SI, NaN where a row has no value.

        Columns of texts hold names, "" where a row has none.
        """

    @property
    def labelled(self) -> bool:
        """Whether the axis is named after its only column, which then labels the dimension."""
        return self.names == (self.name,)


@dataclass(frozen=True)
class ListedAxis(SweepAxis):
    """An axis whose rows are all known.

    Attributes
    ----------
    name : str
    columns : mapping of str to array, shape (length,)
    """

    name: str
    columns: Mapping[str, Column]

    @property
    def length(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values())))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.columns)

    def rows(self, start: int, stop: int) -> dict[str, Column]:
        """As in `SweepAxis`."""
        return {name: values[start:stop] for name, values in self.columns.items()}


@dataclass(frozen=True)
class Spread:
    """How a drawn number is spread.

    Attributes
    ----------
    low, high : float
        Ends of a uniform distribution; mean and standard deviation of a normal one.
    kind : {"linear", "log", "normal"}
        Uniform in the number, uniform in its logarithm, or normal.
    """

    low: float
    high: float
    kind: str

    def at(self, u: Column) -> Column:
        """The quantile `u`, 0 < u < 1."""
        from scipy.special import ndtri

        if self.kind == "normal":
            return np.asarray(self.low + self.high * ndtri(u))
        if self.kind == "log":
            return np.asarray(np.exp(np.log(self.low) + u * np.log(self.high / self.low)))
        return np.asarray(self.low + u * (self.high - self.low))


@dataclass(frozen=True)
class DrawnAxis(SweepAxis):
    """An axis of random or quasi-random draws; any row can be had without those before it.

    Attributes
    ----------
    name : str
    method : {"random", "sobol", "halton"}
        Sobol and Halton sequences are scrambled by the seed.
    seed, count : int
    spreads : mapping of str to Spread
        One dimension of the draws each, in this order.
    """

    name: str
    method: str
    seed: int
    count: int
    spreads: Mapping[str, Spread]

    @property
    def length(self) -> int:
        """Number of rows."""
        return self.count

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.spreads)

    def rows(self, start: int, stop: int) -> dict[str, Column]:
        """As in `SweepAxis`."""
        u = self._uniform(start, stop)
        # Both ends are left out: the normal distribution has no quantile there.
        u = np.clip(u, 2.0**-53, 1 - 2.0**-53)
        return {n: s.at(u[:, i]) for i, (n, s) in enumerate(self.spreads.items())}

    def _uniform(self, start: int, stop: int) -> Column:
        """Draws in the unit cube, shape (rows, columns)."""
        from scipy.stats import qmc

        dimensions = len(self.spreads)
        if self.method == "random":
            first = start // _DRAWN_TOGETHER
            blocks = [
                np.random.default_rng([self.seed, block]).random((_DRAWN_TOGETHER, dimensions))
                for block in range(first, -(-stop // _DRAWN_TOGETHER))
            ]
            skip = start - first * _DRAWN_TOGETHER
            return np.concatenate(blocks)[skip : skip + stop - start]
        scramble = np.random.default_rng(self.seed)
        if self.method == "halton":
            sequence: Any = qmc.Halton(dimensions, rng=scramble)
            # Its points follow from their numbers; SciPy's fast_forward makes all those before.
            sequence.num_generated = start
        else:
            sequence = qmc.Sobol(dimensions, bits=SOBOL_BITS, rng=scramble)
            if start:
                sequence.fast_forward(start)
        with warnings.catch_warnings():
            # Any part of a Sobol sequence is taken, its balanced powers of two or not.
            warnings.simplefilter("ignore", UserWarning)
            return np.asarray(sequence.random(stop - start))


def columns_of(axis: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the columns of an axis's record."""
    return tuple(axis["columns"] if "columns" in axis else axis["over"])
