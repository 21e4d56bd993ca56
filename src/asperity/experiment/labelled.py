"""Arrays of an experiment in the shape of its arguments, and as a labelled Dataset."""

from __future__ import annotations

from dataclasses import field, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from asperity._version import __version__
from asperity.arrays import Float
from asperity.laws import Law
from asperity.orbit.response import dimension_names
from asperity.parameters import MACHINE, law_parameters
from asperity.parameters.parameter import Displayed, SummaryLine, number_line
from asperity.slider import Slider
from asperity.slider.parameters import slider_values

if TYPE_CHECKING:
    import xarray


def shaped(array: Any, shape: tuple[int, ...]) -> Any:
    """An array whose first axis, the points, is reshaped to the shape of the arguments."""
    array = np.asarray(array)
    return array.reshape((*shape, *array.shape[1:]))


def measured(unit: str, meaning: str, *, drive: bool = False) -> Any:
    """A field of a `Labelled` record: a result, or a quantity of the drive (a coordinate)."""
    return field(metadata={"unit": unit, "drive" if drive else "meaning": meaning})


class Labelled(Displayed):
    """A dataclass of arrays of one shape, `result` among them, and its `slider`.

    Class attributes
    ----------------
    shown : tuple of str
        Names of the fields that the summary shows.
    """

    shown: ClassVar[tuple[str, ...]]

    result: NDArray[np.object_]
    slider: Slider

    @property
    def meanings(self) -> dict[str, tuple[str, str]]:
        """Unit and meaning of each result by its name."""
        about = {f.name: f.metadata for f in fields(self)}  # type: ignore[arg-type]
        return {n: (a["unit"], a["meaning"]) for n, a in about.items() if a.get("meaning")}

    def outcomes(self) -> str:
        """Number of points of each outcome, as text."""
        raise NotImplementedError

    def values(self) -> list[tuple[str, float, str, str]]:
        """Name, value, unit and meaning of every number of a single point."""
        return [(n, float(getattr(self, n).item()), *about) for n, about in self.meanings.items()]

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Law and outcomes, and the ranges of the fields `shown`."""
        lines = [number_line(n, getattr(self, n), self.meanings[n][1]) for n in self.shown]
        return f"{type(self).__name__}, {self.slider.law.name}, {self.outcomes()}", lines

    def to_dataset(self, dims: tuple[str, ...] | None = None) -> xarray.Dataset:
        """Arrays, drive, slider and law with units and meanings.

        Parameters
        ----------
        dims : tuple of str, optional
            Names of the axes. By default an axis has the name of the only quantity that varies
            along it.
        """
        import xarray

        shape = self.result.shape
        values = {
            f.name: (
                np.asarray(getattr(self, f.name)),
                {"units": f.metadata["unit"], "long_name": f.metadata["drive"]},
            )
            for f in fields(self)  # type: ignore[arg-type]
            if "drive" in f.metadata
        }
        law: type[Law] = type(self.slider.law)
        known = {**law_parameters(law), **MACHINE}
        for name, value in slider_values(self.slider).items():
            array = np.asarray(value, float)
            padded = array.reshape((1,) * (len(shape) - array.ndim) + array.shape)
            values[name] = padded, known[name].attributes
        varying = {name: _varying(value) for name, (value, _) in values.items()}
        names = dimension_names(shape, varying, dims)
        data = {
            name: (names, getattr(self, name), {"units": unit, "long_name": meaning})
            for name, (unit, meaning) in self.meanings.items()
        }
        data["result"] = (names, self.result.astype(str), {"long_name": "what follows"})
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
