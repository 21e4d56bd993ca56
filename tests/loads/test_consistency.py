"""A load of a user's own, whose members must agree with each other."""

import jax.numpy as jnp
import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.loads import (
    CyclicLoading,
    Excitation,
    Harmonic,
    Modulation,
    Periodic,
    Programme,
    modulated,
)
from asperity.loads.consistency import checked_modulation


class Skewed(Modulation):
    """w = sqrt(1 - a^2) / (1 - a cos theta), of mean 1, with a shear force in proportion."""

    a: float
    gain: float = 0.3

    def at(self, theta):
        root = jnp.sqrt(1 - self.a**2)
        w = root / (1 - self.a * jnp.cos(theta))
        w_slope = -self.a / root * jnp.sin(theta) * w**2
        return Excitation(w, w_slope, self.gain * (w - 1), self.gain * w_slope)

    @property
    def amplitude(self):
        # Of the Fourier series, 1 + 2 sum over n of q^n cos n theta.
        return 2 * self.a / (1 + jnp.sqrt(1 - self.a**2))

    @property
    def formula(self):
        return "skewed"

    def scaled(self, share):
        return type(self)(self.a * share, self.gain)


class Heavier(Skewed):
    def at(self, theta):
        at = super().at(theta)
        return at._replace(w=at.w + 0.01)


class Faster(Skewed):
    def at(self, theta):
        return super().at(theta)._replace(pull=1.01)


class Lighter(Skewed):
    def at(self, theta):
        at = super().at(theta)
        return at._replace(w=1 + 3 * (at.w - 1))


class SlopeInTime(Skewed):
    def at(self, theta):
        at = super().at(theta)
        return at._replace(w_slope=754 * at.w_slope)


class NoShearSlope(Skewed):
    def at(self, theta):
        return super().at(theta)._replace(shear_slope=0.0)


class OtherAmplitude(Skewed):
    @property
    def amplitude(self):
        return self.a


class NotScaled(Skewed):
    def scaled(self, share):
        return self


class Fails(Skewed):
    def scaled(self, share):
        return Skewed(self.b)


class Branches(Skewed):
    def at(self, theta):
        return super().at(theta) if self.a > 0.3 else Excitation(jnp.ones_like(theta))


class OfPullOnly(Skewed):
    def at(self, theta):
        return Excitation(w=1.0, pull=super().at(theta).w)


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (OfPullOnly, "give w an entry for each phase, got an array of shape"),
        (Heavier, "a w of mean 1 over the period, got 1.01"),
        (Faster, "a pull of mean 1 over the period, got 1.01"),
        (Lighter, "keep W/W0 positive"),
        (SlopeInTime, "w_slope as the derivative of w with respect to theta"),
        (NoShearSlope, "shear_slope as the derivative of shear"),
        (OtherAmplitude, "that of the first harmonic of W/W0, 0.535898, got 0.5"),
        (Fails, r"work on arrays of jax.numpy, got AttributeError .*'b'"),
        (Branches, "work on arrays of jax.numpy, got TracerBoolConversionError"),
        (NotScaled, r"scaled\(0\) must be a constant load"),
    ],
)
def test_a_load_that_contradicts_itself_is_refused(load, message: str) -> None:
    with pytest.raises(InputError, match=message):
        checked_modulation(load(0.5))


def test_a_load_is_checked_by_every_function_that_takes_it() -> None:
    slider = asp.Slider(asp.materials.load("bureau2000").law("rice-ruina"), spring=2e5, load=7.0)
    with pytest.raises(InputError, match="mean 1"):
        asp.periodic_response(slider, velocity=1e-6, frequency=120.0, modulation=Heavier(0.5))
    with pytest.raises(InputError, match="mean 1"):
        asp.response_function("rice-ruina", modulation=Heavier(0.5))
    with pytest.raises(InputError, match=r"steps\[0\].modulation.at must give a w of mean 1"):
        Programme(CyclicLoading(1.0, Heavier(0.5), 120.0), load=7.0, velocity=1e-6)


def test_no_step_of_a_transient_misses_a_pulse_of_a_load() -> None:
    step = CyclicLoading("1 s", Skewed(0.999), "1 Hz")
    (segment,) = Programme(step, load=7.0, velocity=1e-6).segments
    # Of the variance, the sum of q^2n, half lies in the first 8 harmonics.
    q = 0.999 / (1 + np.sqrt(1 - 0.999**2))
    assert q**16 < 0.5 < q**14
    assert segment.longest_step == pytest.approx(0.1 / 8)


def test_a_field_with_a_text_is_refused() -> None:
    with pytest.raises(InputError, match="numbers for its fields, got '24 %'"):
        checked_modulation(Harmonic("24 %"))


@pytest.mark.parametrize(
    "load", [Harmonic(1.5), Harmonic(np.nan), Periodic(((1.5, 0.0),))], ids=str
)
def test_contact_lost_by_a_load_made_without_its_function_is_refused(load) -> None:
    with pytest.raises(InputError, match=r"must lie in|never lost|finite"):
        checked_modulation(load)


def test_arrays_that_do_not_broadcast_are_refused() -> None:
    with pytest.raises(InputError, match=r"shapes that broadcast, got \(2,\), \(3,\)"):
        checked_modulation(Skewed(np.full(2, 0.1), np.full(3, 0.1)))


def test_one_bad_point_among_many_is_refused() -> None:
    a = np.full(300, 0.1)
    assert checked_modulation(Skewed(a)) is not None
    a[280] = 1.0
    with pytest.raises(InputError, match="finite"):
        checked_modulation(Skewed(a))


@pytest.mark.parametrize("a", [0.0, 1e-6, 0.5, 0.999, 0.99999])
def test_pulses_of_any_width_pass(a: float) -> None:
    assert checked_modulation(Skewed(a)).a == a


def test_a_load_with_a_kink_passes() -> None:
    class Triangle(Skewed):
        def at(self, theta):
            x = jnp.abs(jnp.mod(theta + jnp.pi, 2 * jnp.pi) - jnp.pi) / jnp.pi
            rising = jnp.mod(theta, 2 * jnp.pi) > jnp.pi
            slope = jnp.where(rising, 2 * self.a, -2 * self.a) / jnp.pi
            return Excitation(1 + self.a * (1 - 2 * x), slope)

        @property
        def amplitude(self):
            return 8 * self.a / jnp.pi**2

    assert checked_modulation(Triangle(0.4)).a == 0.4


def test_loads_of_the_package_pass_unchanged() -> None:
    own = modulated(0.2, load={2: (0.1, 0.3)}, pull=0.1, tilt="5 deg")
    assert checked_modulation(own) is own
