"""A slice of a store as a picture: the numbers that are drawn are those of the store."""

from pathlib import Path

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.figures.slice import plot_slice
from asperity.study import open_store, run_sweep
from references.closed_form_sweep import ClosedForm, ThisProcess, plan_of


def test_a_plane_and_a_curve(tmp_path: Path, closed_form: ClosedForm) -> None:
    run_sweep(plan_of(), tmp_path / "s.zarr", workers=ThisProcess())
    values = open_store(tmp_path / "s.zarr")["mu1"].values
    plane = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", y="K")
    (mesh,) = plane.axes[0].collections
    drawn = np.ma.filled(mesh.get_array(), np.nan).reshape(values.shape)
    assert np.array_equal(drawn, values, equal_nan=True)
    curve = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", at={"K": 2.1})
    assert np.array_equal(curve.axes[0].lines[0].get_ydata(), values[1], equal_nan=True)
    with pytest.raises(InputError, match="did you mean 'epsilon'"):
        plot_slice(tmp_path / "s.zarr", "mu1", x="epsilom")
    with pytest.raises(InputError, match="show must be an output"):
        plot_slice(tmp_path / "s.zarr", "mu9", x="epsilon")
