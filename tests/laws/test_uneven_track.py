"""A friction level that varies along the track: its spectrum, and the motion over it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from asperity import Slider, laws, periodic_response
from asperity.errors import InputError
from asperity.experiment import hold_response, stick_slip_response
from asperity.laws.uneven_track import on_uneven_track
from asperity.loads import Programme, Slide, StepLoad
from asperity.protocol import Protocol, ProtocolError
from asperity.transients import transient

A, B, D0, V0, MU0 = 0.013, 0.026, 4e-7, 1e-6, 0.5
LAW = laws.RiceRuina(mu0=MU0, A=A, B=B, D0=D0, V0=V0)
K, M, W0, V = 5e4, 1.6, 7.0, 1e-4


def test_the_motion_agrees_with_scipy_with_mu0_of_the_position() -> None:
    law = on_uneven_track(LAW, amplitude=0.02, length="20 um", exponent=3.0, origin="1 mm")
    slider = Slider(law, spring=K, load=W0, mass=M)
    times = np.linspace(0, 0.25, 251)
    drive = Programme(Slide(duration=0.25, velocity=V), load=W0, velocity=V / 2)
    motion = transient(slider, drive, sampling=times, inertia=True, rtol=1e-9)

    # The level is tabulated; `test_the_level_has_the_spectrum_of_its_formula` tests it.
    places = np.linspace(-1, 6, 7001)
    level = CubicSpline(places, law.level(places))

    def rates(t, y):
        force, log_v, phi, x = y
        v = np.exp(log_v)
        friction = float(level(x / 20e-6)) + A * np.log(v / V0) + B * phi
        ageing = (V0 * np.exp(-phi) - v) / D0
        return [K * (V - v), (force - W0 * friction) / (M * v), ageing, v]

    start = [W0 * (float(level(0.0)) - (B - A) * np.log(V / 2 / V0)), np.log(V / 2)]
    start += [-np.log(V / 2 / V0), 0.0]
    exact = solve_ivp(rates, (0, 0.25), start, "LSODA", times, rtol=1e-9, atol=1e-12)
    assert np.ptp(exact.y[0]) > 0.1 * W0
    np.testing.assert_allclose(motion.force, exact.y[0], atol=1e-4 * W0)
    np.testing.assert_allclose(motion.displacement, exact.y[3], atol=1e-4 * W0 / K)
    # With an amplitude of zero the law is unchanged.
    short = Programme(Slide(duration=0.05, velocity=V), load=W0, velocity=V / 2)
    flat, even = (
        transient(Slider(law, spring=K, load=W0, mass=M), short, sampling=1e3, inertia=True)
        for law in (on_uneven_track(LAW, amplitude=0.0, length="20 um"), LAW)
    )
    np.testing.assert_allclose(flat.force, even.force, rtol=1e-4)


@pytest.mark.parametrize("exponent", [1.5, 2.0, 4.0])
def test_the_level_has_the_spectrum_of_its_formula(exponent) -> None:
    length, step = 20e-6, 0.02
    law = on_uneven_track(LAW, amplitude=0.01, length=length, exponent=exponent)
    x = step * np.arange(2**18)
    level = np.asarray(law.level(x)) - MU0
    assert level.std() == pytest.approx(0.01, rel=0.02)
    power = np.abs(np.fft.rfft(level * np.hanning(x.size))) ** 2
    k = 2 * np.pi * np.fft.rfftfreq(x.size, step)
    for above in (0.3, 1.0, 3.0):
        share = power[k > above].sum() / power.sum()
        # Integral of (p - 1) / (1 + u)^p, to which each of 32 modes contributes one part.
        assert share == pytest.approx((1 + above) ** (1 - exponent), abs=1.5 / 32)
    # Places far apart are independent.
    far_law = on_uneven_track(LAW, amplitude=0.01, length=length, exponent=exponent, origin=1.0)
    correlation = np.corrcoef(level, np.asarray(far_law.level(x)))[0, 1]
    assert abs(correlation) < 0.1


def test_a_motion_under_another_load_starts_in_steady_sliding() -> None:
    law = on_uneven_track(LAW, amplitude=0.01, length="20 um")
    drive = Programme(StepLoad(8.0), Slide(duration=1e-3, velocity=V), load=8.0, velocity=V)
    motion = transient(Slider(law, spring=K, load=W0, mass=M), drive, inertia=True, rtol=1e-6)
    assert motion.velocity[0] == pytest.approx(V, rel=1e-6)


def protocol(**track):
    return Protocol(
        law="rice-ruina",
        steps=["slide for 10 ms"],
        parameters={"mu0": MU0, "A": A, "B": B, "D0": D0, "V0": V0, "K": K, "W0": W0, "M": M},
        start={"velocity": V},
        solver={"inertia": True},
        track=track,
    )


def test_a_protocol_may_have_a_track() -> None:
    run = protocol(amplitude=0.02, length="20 um", origin="1 cm")
    assert run.slider.law.state_names == ("log_age", "position")
    assert float(run.slider.law.track_origin) == 0.01
    assert float(run.slider.K) == K
    # An interrupted run is not resumed with another track.
    assert run.inputs != protocol(amplitude=0.02, length="20 um", origin="2 cm").inputs


@pytest.mark.parametrize(
    ("track", "message"),
    [
        ({"amplitude": 0.02}, "track.length must"),
        ({"amplitude": -0.02, "length": "20 um"}, "track.amplitude must not be negative"),
        ({"amplitude": 0.02, "length": "20 N"}, "track.length must"),
        ({"amplitude": 0.02, "length": "20 um", "exponent": 1.0}, "track.exponent must be above 1"),
    ],
)
def test_a_wrong_track_is_refused(track, message) -> None:
    with pytest.raises((ProtocolError, InputError)) as raised:
        protocol(**track)
    assert message in str(raised.value)


def test_what_needs_steady_sliding_refuses_an_uneven_track() -> None:
    """Limit cycles called steady sliding unstable for any spring, as the position never relaxes."""
    slider = Slider(on_uneven_track(LAW, amplitude=0.01, length=1e-5), spring=K, load=W0, mass=M)
    for question in (
        lambda: periodic_response(slider, velocity=V, epsilon=0.1, frequency=120.0),
        lambda: stick_slip_response(slider, velocity=V),
        lambda: hold_response(slider, velocity=V, hold_time=10.0),
    ):
        with pytest.raises(InputError, match="integrate it as a transient"):
            question()
    with pytest.raises(InputError, match="the same everywhere"):
        on_uneven_track(slider.law, amplitude=0.01, length=1e-5)
