"""Operating points of a part of a sweep, as every kind of solve takes them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.laws import get_law
from asperity.parameters import point_parameters

Float = NDArray[np.float64]

#: Bytes that a point takes while it is solved: 1.6 kB on periodic responses and 1.2 kB on the
#: stiffnesses of thresholds, from the largest resident memory at 1e5 to 4e5 points of rice-ruina.
POINT_BYTES = 2000.0


@dataclass(frozen=True)
class Points:
    """Operating points of a chunk, along one axis.

    Attributes
    ----------
    laws : str array, shape (points,)
    values : dict of str to array, shape (points,)
        SI numbers by name, NaN where a point has none.
    data : str array, shape (points,), or None
        Files of data, where they vary.
    """

    laws: NDArray[np.object_]
    values: dict[str, Float]
    data: NDArray[np.object_] | None = None

    def __len__(self) -> int:
        return len(self.laws)

    def take(self, index: Any) -> Points:
        """The points `index`."""
        data = None if self.data is None else self.data[index]
        return Points(self.laws[index], {n: v[index] for n, v in self.values.items()}, data)

    def of_law(self, law: str) -> dict[str, Float]:
        """Values of all parameters of one law, with defaults where a point has none."""
        rows = len(self)
        found = {}
        for name, parameter in point_parameters(get_law(law)).items():
            default = math.nan if parameter.default is None else parameter.default
            values = self.values.get(name, np.full(rows, default))
            found[name] = np.where(np.isnan(values), default, values)
        return found
