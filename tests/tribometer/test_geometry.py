"""Forces of rigs and stresses on their surfaces, from the statics of each."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.tribometer.geometry import DirectShear, DoubleDirectShear, Triaxial


def test_double_direct_shear_has_half_the_stress_at_the_same_force() -> None:
    single, double = DirectShear(area="25 cm^2"), DoubleDirectShear(area="25 cm^2")
    assert single.stresses(10e3, 25e3) == pytest.approx((4e6, 10e6))
    assert double.stresses(10e3, 25e3) == pytest.approx((2e6, 10e6))
    assert double.forces(*double.stresses(7.0, 11.0)) == pytest.approx((7.0, 11.0))


@pytest.mark.parametrize("degrees", [20.0, 30.0, 45.0, 60.0])
def test_triaxial_stresses_are_those_of_the_stress_tensor(degrees) -> None:
    cell = Triaxial(diameter="20 mm", angle=f"{degrees} deg")
    axial, confining, pore = 20e3, 30e6, 5e6
    # Traction of diag(s1, s3) on the plane whose normal is (sin, cos) of the angle to the axis.
    s1 = confining + axial / (np.pi * 0.01**2)
    normal = np.array([np.sin(cell.angle), np.cos(cell.angle)])
    traction = np.diag([s1, confining]) @ normal
    sigma = traction @ normal
    tau = np.sqrt(traction @ traction - sigma**2)
    assert cell.stresses(axial, confining, pore) == pytest.approx((tau, sigma - pore))
    assert cell.forces(tau, sigma) == pytest.approx((axial, confining))
    assert cell.area == pytest.approx(np.pi * 1e-4 / np.sin(cell.angle))


def test_what_is_no_geometry_is_one_sentence() -> None:
    with pytest.raises(InputError, match=r"DirectShear\.area must be positive"):
        DirectShear(area=0.0)
    with pytest.raises(InputError, match=r"Triaxial\.angle must be less than a right angle"):
        Triaxial(diameter="20 mm", angle=30.0)
