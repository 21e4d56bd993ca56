"""Force, velocities and age over a period: held against the equations that they have to obey."""

import numpy as np
import pytest

import asperity as asp
from asperity.orbit import over_a_period

#: Fourier differentiation of a waveform that is good to 1e-8.
TOLERANCE = 1e-6
V, F, EPSILON = 1e-6, 120.0, 0.15


def rate(values):
    """Derivative by the phase (rad)."""
    n = len(values)
    order = np.fft.fftfreq(n, 1 / n)
    return np.fft.ifft(1j * order * np.fft.fft(values)).real


def orbit(law):
    """One period with a law; figure 13 of the report has it with inertia."""
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law(law), spring=material.K, load=material.W0)
    response = asp.periodic_response(
        slider, velocity=V, epsilon=EPSILON, frequency=F, waveform=256, methods=("fourier",)
    )
    return material, over_a_period(response)


@pytest.mark.parametrize("law", ["rice-ruina", "elasto-plastic", "linker-dieterich"])
def test_the_age_obeys_the_law_of_ageing(law):
    material, period = orbit(law)
    # (V/(omega D0)) dPhi/dt per radian, with dPhi/dt = 1 - v Phi/D0 - (alpha/B) (dW/dt/W) Phi.
    ageing = V / (2 * np.pi * F * material.D0) * (1 - period.velocity * period.age)
    if law == "linker-dieterich":
        load_rate = -EPSILON * np.sin(2 * np.pi * period.phase) / period.load
        ageing -= material.alpha / material.B * load_rate * period.age
    assert rate(period.age) == pytest.approx(ageing, abs=TOLERANCE * np.abs(ageing).max())
    assert period.velocity.mean() == pytest.approx(1.0, abs=1e-7)
    # The strain of the asperities, F lambda/W, returns: the joint slips as far as the slider moves.
    assert period.plastic_velocity.mean() == pytest.approx(1.0, abs=1e-7)


@pytest.mark.parametrize("law", ["rice-ruina", "elasto-plastic", "amontons"])
def test_a_modulated_pull_moves_the_slider(law):
    """dF/dt = K (V p - v) of the pulled spring, with p = 1 + 0.2 cos(wt)."""
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law(law), spring=material.K, load=material.W0)
    modulation = asp.loads.modulated(EPSILON, pull=0.2)
    response = asp.periodic_response(
        slider, velocity=V, modulation=modulation, frequency=F, waveform=256, methods=("fourier",)
    )
    period = over_a_period(response)
    stretching = 2 * np.pi * F * material.W0 / (material.K * V) * rate(period.force)
    pull = 1 + 0.2 * np.cos(2 * np.pi * period.phase)
    assert period.velocity == pytest.approx(pull - stretching, abs=1e-6)


def test_no_age_where_the_law_has_none():
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law("amontons"), spring=material.K, load=material.W0)
    drive = {"velocity": V, "epsilon": [[EPSILON]], "frequency": F}
    period = over_a_period(asp.periodic_response(slider, **drive, waveform=64))
    assert period.age is None
    # Also of a point in a grid of one row and one column.
    assert {np.shape(values) for values in period[:5]} == {(64,)}


@pytest.mark.parametrize(
    ("epsilon", "samples", "got"),
    [(EPSILON, 0, "1 points of 0"), ([EPSILON, EPSILON / 2], 64, "2 points of 64")],
)
def test_a_period_needs_one_point_and_a_waveform(epsilon, samples, got):
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law("rice-ruina"), spring=material.K, load=material.W0)
    response = asp.periodic_response(
        slider, velocity=V, epsilon=epsilon, frequency=F, waveform=samples, methods=("fourier",)
    )
    with pytest.raises(asp.InputError, match=f"of one point, with a waveform, got {got} samples"):
        over_a_period(response)
