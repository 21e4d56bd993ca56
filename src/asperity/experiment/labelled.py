"""Arrays of an experiment in the shape of its arguments, and as a labelled Dataset."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from asperity._version import __version__
from asperity.laws import Law
from asperity.orbit.response import dimension_names
from asperity.parameters import MACHINE, law_parameters
from asperity.slider.named import slider_values

if TYPE_CHECKING:
    import xarray

Float = NDArray[np.float64]


class Shaped:
    """Arrays in the shape of the arguments."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape = shape

    def __call__(self, array: Any) -> Any:
        """An array with the points first, in that shape."""
        array = np.asarray(array)
        return array.reshape((*self._shape, *array.shape[1:]))


def labelled(
    record: Any,
    meanings: Mapping[str, tuple[str, str]],
    drive: Mapping[str, tuple[str, Float]],
    dims: tuple[str, ...] | None = None,
) -> xarray.Dataset:
    """A record as a Dataset: its arrays, drive, slider and law with units and meanings.

    Parameters
    ----------
    record : object
        With arrays of one shape, `result` among them, and its `slider`.
    meanings : mapping of str to (str, str)
        Unit and meaning by the name of an attribute; those that the record has are taken.
    drive : mapping of str to (str, array)
        Unit and values of what drives the slider.
    dims : tuple of str, optional
        Names of the axes; by default of what varies along each alone.
    """
    import xarray

    shape = record.result.shape
    values = {name: (np.asarray(v), {"units": unit}) for name, (unit, v) in drive.items()}
    law: type[Law] = type(record.slider.law)
    known = {**law_parameters(law), **MACHINE}
    for name, value in slider_values(record.slider).items():
        array = np.asarray(value, float)
        padded = array.reshape((1,) * (len(shape) - array.ndim) + array.shape)
        values[name] = padded, known[name].attributes
    varying = {name: _varying(value) for name, (value, _) in values.items()}
    names = dimension_names(shape, varying, dims)
    data = {
        name: (names, getattr(record, name), {"units": unit, "long_name": meaning})
        for name, (unit, meaning) in meanings.items()
        if hasattr(record, name)
    }
    data["result"] = (names, record.result.astype(str), {"long_name": "what follows"})
    coords = {
        name: (
            [d for d, n in zip(names, varying[name], strict=True) if n > 1],
            value[tuple(slice(None) if n > 1 else 0 for n in varying[name])],
            attributes,
        )
        for name, (value, attributes) in values.items()
    }
    attrs = {"asperity_version": __version__, "law": law.name}
    return xarray.Dataset(data, coords=coords, attrs=attrs)


def _varying(value: Float) -> tuple[int, ...]:
    """The shape of an array, with length 1 along the axes on which it does not vary."""
    return tuple(
        1 if np.all(value == np.take(value, [0], axis=axis)) else size
        for axis, size in enumerate(value.shape)
    )
