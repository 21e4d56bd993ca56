"""Sensors, one part at a time, against closed forms; forces and stresses of rigs, from statics."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.tribometer.geometry import DirectShear, DoubleDirectShear, Triaxial
from asperity.tribometer.sensors import (
    Accelerometer,
    DisplacementGauge,
    LoadCell,
    SpringGauge,
    filtered,
    low_pass,
)

RATE = 20_000.0
TIME = np.arange(0, 10, 1 / RATE)


def quiet(sensor, values):
    return sensor.read(values, RATE, np.random.default_rng(0))


def test_noise_has_its_variance_and_its_spectrum() -> None:
    sigma, corner = 2e-3, 400.0
    cell = LoadCell(bandwidth=corner, noise=sigma)
    noise = cell.read(np.full(TIME.size, 7.0), RATE, np.random.default_rng(7)) - 7.0
    # 2 pi corner T correlation times: the variance is known to 1.3 % (one sigma).
    independent = np.pi * corner * 10
    assert noise.var() == pytest.approx(sigma**2, rel=4 * np.sqrt(2 / independent))
    for lag in (5, 20, 60):
        expected = np.exp(-2 * np.pi * corner * lag / RATE)
        correlation = np.mean(noise[lag:] * noise[:-lag]) / noise.var()
        assert correlation == pytest.approx(expected, abs=4 / np.sqrt(independent))


def test_a_later_filter_lets_its_noise_bandwidth_through() -> None:
    sigma, corner, cut = 1.0, 2000.0, 50.0
    noise = quiet(LoadCell(bandwidth=corner, noise=sigma), np.zeros(TIME.size))
    out = filtered(noise, RATE, *low_pass(1, cut))
    # Two poles in a row, a closed form: sigma^2 cut/(cut + corner).
    independent = np.pi * cut * 10
    expected = sigma**2 * cut / (cut + corner)
    assert out.var() == pytest.approx(expected, rel=4 * np.sqrt(2 / independent))


def test_the_same_seed_makes_the_same_noise() -> None:
    cell = LoadCell(bandwidth=400.0, noise=1e-3)
    first, again, other = (
        cell.read(np.zeros(100), RATE, np.random.default_rng(s)) for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_spring_gauge_reads_a_force_by_the_elongation() -> None:
    force = 3.0 + 0.01 * np.sin(2 * np.pi * TIME)
    gauge = SpringGauge(
        stiffness="0.2 N/um", bandwidth="10 kHz", resolution="10 nm", offset="1 um", drift=2e-9
    )
    read = quiet(gauge, force)
    step = 0.2e6 * 10e-9
    np.testing.assert_allclose(read / step, np.rint(read / step), atol=1e-6)
    expected = force + 0.2e6 * (1e-6 + 2e-9 * TIME)
    assert np.abs(read - expected).max() < 0.51 * step
    assert np.unique(np.rint(read / step)).size > 5


def test_an_accelerometer_sees_only_what_changes() -> None:
    f, high = 120.0, 40.0
    load = 9.0 + 1.5 * np.cos(2 * np.pi * f * TIME)
    read = quiet(Accelerometer(bandwidth="10 kHz", mean="7 N", high_pass=high), load)
    late = TIME > 1
    angle = 2 * np.pi * f * TIME[late]
    columns = np.c_[np.cos(angle), -np.sin(angle), np.ones_like(angle)]
    a, b, mean = np.linalg.lstsq(columns, read[late], rcond=None)[0]
    gain = 1.5 / (1 - 1j * high / f) / (1 + 1j * f / 10_000)
    assert abs(a + 1j * b - gain) < 1e-5
    assert mean == pytest.approx(7.0, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LoadCell(bandwidth=0), "LoadCell.bandwidth must be positive, got 0 Hz"),
        (lambda: LoadCell(bandwidth="1 kHz", noise="2 nm"), "LoadCell.noise must be a force"),
        (lambda: SpringGauge(stiffness=1.0, bandwidth=1.0, noise="2 mN"), "must be a length"),
        (lambda: DisplacementGauge(bandwidth=1.0, resolution=-1.0), "not be negative"),
        (lambda: LoadCell(bandwidth=1.0, delay="-1 ms"), "LoadCell.delay must not be negative"),
        (lambda: quiet(LoadCell(bandwidth="11 kHz"), TIME), "at most half the sampling rate"),
    ],
)
def test_bad_sensors_are_named(make, message) -> None:
    with pytest.raises(InputError, match=message):
        make()


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
