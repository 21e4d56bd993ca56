"""The paper's protocol on the virtual tribometer, against the periodic response."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import asperity as asp
from asperity.air import AirLayer, transfer_function
from asperity.errors import InputError
from asperity.experiment import Exciter, amplitude_series
from asperity.tribometer.sensors import LoadCell, SpringGauge
from asperity.tribometer.tribometer import Recorder, Tribometer

measure = partial(asp.measure, modulated=True)

PMMA = asp.materials.load("bureau2000")
# Stiffer than the critical stiffness: it slides steadily without modulation.
SLIDER = asp.Slider(PMMA.law("elasto-plastic"), spring="0.5 N/um", mass=PMMA.M, load=PMMA.W0)
V, F, EPSILONS = 1e-5, 120.0, [0.2, 0.5]
TRANSFER = 0.45 * np.exp(-0.3j)
SENSORS = {
    "shear force": SpringGauge(stiffness=SLIDER.K, bandwidth="20 kHz", noise="5 nm"),
    "normal force": LoadCell(bandwidth="20 kHz", noise="1 mN"),
}


@pytest.fixture(scope="module")
def series():
    tribometer = Tribometer(sensors=SENSORS, recorder=Recorder(rate="5 kHz", cut_off="2 kHz"))
    return amplitude_series(
        SLIDER, tribometer, Exciter(F, TRANSFER), EPSILONS,
        velocity=V, sliding="2 s", modulated="2 s", seed=4,
    )  # fmt: skip


def test_the_readings_are_the_response_to_what_the_contacts_bear(series) -> None:
    dataset = series.to_dataset()
    truth = asp.periodic_response(
        SLIDER, velocity=V, epsilon=abs(TRANSFER) * np.array(EPSILONS), frequency=F
    )
    np.testing.assert_allclose(dataset.measured_epsilon, EPSILONS, rtol=1e-3)
    for name in ("mean_friction", "delta_mu", "mu1", "mu2"):
        error = np.abs(dataset[name].values - getattr(truth, name))
        # The sensors' corner at 20 kHz and the filter's at 2 kHz leave harmonics to 1e-4.
        doubt = 5 * dataset[f"{name}_uncertainty"].values + 1e-4 * np.abs(getattr(truth, name))
        assert np.all(error < doubt), name
        assert np.all(dataset[f"{name}_uncertainty"] < 0.02 * np.abs(getattr(truth, name)))


def test_another_transfer_is_seen(series) -> None:
    dataset = series.to_dataset()
    other = asp.periodic_response(
        SLIDER, velocity=V, epsilon=1.05 * abs(TRANSFER) * np.array(EPSILONS), frequency=F
    )
    error = np.abs(dataset.mu1.values - other.mu1)
    assert np.all(error > 5 * dataset.mu1_uncertainty.values + 1e-4 * other.mu1)


def test_phases_are_against_the_applied_load(series) -> None:
    dataset = series.to_dataset()
    truth = asp.periodic_response(
        SLIDER, velocity=V, epsilon=abs(TRANSFER) * np.array(EPSILONS), frequency=F
    )
    for n in (1, 2):
        # Sensors of both channels shift alike; harmonic n of the force by that at n f, less n
        # times that of the load: third order in f over the corner, less than 1e-4 rad.
        expected = getattr(truth, f"phase{n}") + n * np.angle(TRANSFER)
        error = np.angle(np.exp(1j * (dataset[f"phase{n}"].values - expected)))
        doubt = dataset[f"phase{n}_uncertainty"].values
        assert np.all(np.abs(error) < 5 * doubt + 2e-3)


def test_the_force_without_modulation_comes_back(series) -> None:
    for point in series.points:
        assert abs(point.drift) < 1e-3
        assert point.measurement.verdict == "ok"
    static = series.to_dataset().static_friction
    np.testing.assert_allclose(static, float(SLIDER.law.mu_ss(V)), rtol=1e-3)


def test_the_recording_is_that_of_the_whole_protocol(series) -> None:
    trace = series.trace
    assert trace.time[-1] == pytest.approx(2 * (2 + 2) + 2, abs=1e-3)
    assert trace.provenance["law"] == "elasto-plastic"
    on = trace.slice(2.5, 3.5).channel("W").values
    assert np.ptp(on) == pytest.approx(2 * 0.2 * 7, rel=0.01)


def test_the_table_has_the_harmonics_that_were_read(series) -> None:
    point = series.points[0]
    part = series.trace.slice(point.begin, point.end)
    one = measure(part, load="normal force", force="shear force", frequency=F, harmonics=1)
    table = replace(series, points=(replace(point, measurement=one),)).to_dataset()
    assert "mu1" in table
    assert "mu2" not in table


def test_the_exciter_through_air_is_that_of_the_layer() -> None:
    layer = AirLayer(P0=1e5, h0=6.5e-6, eta=1e-5, R=3.9e-2)
    exciter = Exciter.through_air("120 Hz", SLIDER, "0.4 um", layer)
    expected = transfer_function(120.0, W0=7.0, M=PMMA.M, lambda_z=0.4e-6, layer=layer)
    assert exciter.transfer == expected
    assert abs(exciter.transfer) < 0.3
    vacuum = Exciter.through_air("120 Hz", SLIDER, "0.4 um", None)
    assert vacuum.transfer.real == pytest.approx(
        1 / (1 - (2 * np.pi * 120) ** 2 * PMMA.M * 0.4e-6 / 7), rel=1e-12
    )
    applied, borne = exciter.steps(0.3, 1.0, 0.1)
    assert (applied.epsilon, applied.phase) == (0.3, 0.0)
    assert borne.epsilon * np.exp(1j * borne.phase) == pytest.approx(0.3 * expected, rel=1e-12)


def test_contacts_that_would_be_lost_are_refused() -> None:
    with pytest.raises(InputError, match="must leave the contacts loaded"):
        Exciter(120.0, 1.2).steps(0.9, 1.0, 0.1)


def test_a_slider_that_runs_away_is_named() -> None:
    soft = asp.Slider(PMMA.law("elasto-plastic"), spring="0.1 N/um", mass=PMMA.M, load=PMMA.W0)
    tribometer = Tribometer(sensors=SENSORS, recorder=Recorder(rate="5 kHz"))
    with pytest.raises(InputError, match=r"ended: the slider ran away .* switch inertia on"):
        amplitude_series(
            soft, tribometer, Exciter(F, 1.0), [0.1], velocity=V, sliding="3 s", modulated="1 s"
        )
