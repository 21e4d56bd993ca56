"""An axis of a map: its grid, and what is answered to mistakes."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.study.map import Axis


def test_an_axis_as_text() -> None:
    axis = Axis.parse("K=0.05:0.5:10 N/um")
    assert (axis.name, axis.count, axis.unit, axis.log) == ("K", 10, "N/m", False)
    np.testing.assert_allclose(axis.values, np.linspace(5e4, 5e5, 10), rtol=1e-14)
    assert Axis.parse(" epsilon = 1:50:3 %").values.tolist() == [0.01, 0.255, 0.5]
    assert Axis.parse("epsilon=1:50:3%") == Axis("epsilon", 0.01, 0.5, 3)
    assert Axis.parse("lambda=0.1:1:3 um").name == "lambda"


def test_a_logarithmic_axis_has_equal_ratios() -> None:
    axis = Axis("frequency", "0.1 Hz", "1 kHz", 5, log=True)
    np.testing.assert_allclose(axis.values, [0.1, 1.0, 10.0, 100.0, 1000.0], rtol=1e-13)
    assert axis.values[[0, -1]].tolist() == [0.1, 1000.0]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("K", ["axis must be NAME=LOW:HIGH:COUNT UNIT, got 'K'"]),
        ("K=1:2 N/um", ["got 'K=1:2 N/um'"]),
        ("K=1:2:3.5 N/um", ["got 'K=1:2:3.5 N/um'"]),
        ("K=1:2:10", ["axis of K must carry a unit", "'K=1:2:10 N/m'"]),
        ("K=1:2:10 N", ["axis of K must be a stiffness (N/m), got '1 N'"]),
        ("K=2:1:10 N/um", ["axis of K must go from a smaller to a larger", "2e+06 to 1e+06 N/m"]),
        ("K=1:1:10 N/um", ["axis of K must go from a smaller to a larger"]),
        ("K=1:2:1 N/um", ["axis of K must have at least 2 points, got 1"]),
        ("K=0:2:9 N/um", ["axis of K must be positive, got 0 N/m"]),
        ("epsilon=0.1:1:9", ["axis of epsilon must be at least 0 and below 1", "got 1;"]),
        ("epsilon=x:1:9", ["axis of epsilon must be a finite number, got 'x'"]),
        ("epsilom=0.1:0.2:9", ["axis must be a number of an operating point, got 'epsilom'"]),
        ("inertia=0:1:2", ["axis must be a number of an operating point, got 'inertia'"]),
    ],
)
def test_a_bad_axis(text: str, parts: list[str]) -> None:
    with pytest.raises(InputError) as error:
        Axis.parse(text)
    for part in parts:
        assert part in str(error.value)


def test_a_logarithmic_axis_does_not_start_at_zero() -> None:
    with pytest.raises(InputError, match="must start above zero to be logarithmic, got 0"):
        Axis.parse("epsilon=0:0.5:10", log=True)
