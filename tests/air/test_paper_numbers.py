"""Every number that the paper's Appendix states, on the paper's own inputs.

The tolerance of each is half a unit of the last digit stated, unless a comment says otherwise.
"""

import numpy as np
import pytest

from asperity.air import (
    AirLayer,
    NormalContact,
    air_vacuum_ratio,
    effective_modulation,
    patch_radius,
    shear_viscosity_ratio,
)

SLIDER = {"W0": 7.0, "M": 1.6, "lambda_z": 0.4e-6}
CONTACT = NormalContact(W0=7.0, lambda_z=0.4e-6)
#: R = 3.9 cm as stated, and the radius of the stated area of 49 cm^2 (3.949 cm).
R_STATED, R_AREA = 3.9e-2, np.sqrt(49e-4 / np.pi)


def layer(R=R_STATED, **change):
    return AirLayer(**{"P0": 1e5, "h0": 6.5e-6, "eta": 1e-5, "R": R, **change})


def test_stiffnesses():
    assert layer(R_AREA).stiffness == pytest.approx(7.5e7, abs=0.05e7)
    # "one order of magnitude larger than kappa_z" is a factor of 4.3
    assert layer(R_AREA).stiffness / CONTACT.stiffness == pytest.approx(4.31, abs=0.005)


def test_resonance_and_inertia():
    frequency = CONTACT.omega0(1.6) / (2 * np.pi)
    assert frequency == pytest.approx(530, abs=5)
    assert (120 / frequency) ** 2 == pytest.approx(5.2e-2, abs=0.05e-2)


def test_squeeze_number():
    omega = 2 * np.pi * 120
    assert layer().gamma(omega) * R_STATED == pytest.approx(4 * (1 - 1j), abs=0.06)


def test_borne_fraction_in_air():
    assert effective_modulation(120, **SLIDER, layer=layer()) == pytest.approx(0.24, abs=0.005)
    for R in (R_STATED, R_AREA):
        assert effective_modulation(200, **SLIDER, layer=layer(R)) == pytest.approx(0.23, abs=0.005)


def test_vacuum_and_ratio():
    # 1.169, stated as 1.2
    assert effective_modulation(200, **SLIDER) == pytest.approx(1.2, abs=0.05)
    assert air_vacuum_ratio(200, **SLIDER, layer=layer()) == pytest.approx(0.20, abs=0.005)
    # the "nominal" area of 49 cm^2 gives 0.194: 0.19, one unit of the last digit away
    assert air_vacuum_ratio(200, **SLIDER, layer=layer(R_AREA)) == pytest.approx(0.194, abs=5e-4)


def test_patch():
    assert effective_modulation(120, **SLIDER, layer=layer(2.5e-2)) == pytest.approx(0.48, abs=5e-3)
    assert np.pi * 2.5e-2**2 / 49e-4 == pytest.approx(0.4, abs=0.05)
    (radius,) = patch_radius(0.48, 120, **SLIDER, layer=layer()).solutions
    assert radius == pytest.approx(2.5e-2, abs=0.05e-2)
    # That radius, fixed by the fit at 120 Hz, also gives the 0.4 measured at 200 Hz against vacuum.
    assert air_vacuum_ratio(200, **SLIDER, layer=layer(radius)) == pytest.approx(0.4, abs=0.01)


def test_one_millibar():
    thin = layer(R_AREA, P0=100.0)
    # "two orders of magnitude below the multicontact one"
    assert thin.stiffness / CONTACT.stiffness == pytest.approx(4.3e-3, abs=0.05e-3)
    # "several 10 um ... larger than the gap width"
    assert 2e-5 < thin.mean_free_path < 9e-5
    assert thin.knudsen > 1
    vacuum = effective_modulation(200, **SLIDER)
    for flow in ("continuum", "slip", "free-molecular"):
        modulation = effective_modulation(
            200, **SLIDER, layer=layer(R_AREA, P0=100.0, gas_flow=flow)
        )
        assert modulation == pytest.approx(vacuum, rel=6e-3)


def test_shear_viscosity():
    arguments = {"W0": 7.0, "A": 0.013, "layer": layer(R_AREA)}
    printed = shear_viscosity_ratio(1e-4, **arguments, as_printed=True)
    assert printed == pytest.approx(1e-7, abs=0.5e-7)
    # with A, which the printed formula leaves out, 77 times larger and still negligible
    assert shear_viscosity_ratio(1e-4, **arguments) == pytest.approx(8.3e-6, abs=0.05e-6)
