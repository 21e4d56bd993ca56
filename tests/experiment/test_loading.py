"""The loading-unloading test recovers lambda, within the uncertainty it states."""

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.experiment import elastic_length, loading_recording
from asperity.recording import Channel, Trace, read
from asperity.recording.writers import write
from asperity.tribometer.sensors import DisplacementGauge, LoadCell, SpringGauge
from asperity.tribometer.tribometer import Recorder, Tribometer

PMMA = asp.materials.load("bureau2000")
LAMBDA = 0.62e-6
SLIDER = asp.Slider(
    PMMA.law("elasto-plastic", lambda_=LAMBDA), spring="0.5 N/um", mass=PMMA.M, load=PMMA.W0
)
TRIBOMETER = Tribometer(
    sensors={
        "shear force": SpringGauge(stiffness=SLIDER.K, bandwidth="500 Hz", noise="5 nm"),
        "normal force": LoadCell(bandwidth="500 Hz", noise="2 mN"),
        "displacement": DisplacementGauge(bandwidth="500 Hz", noise="3 nm", drift=2e-9),
        "drive position": DisplacementGauge(bandwidth="500 Hz", noise="3 nm"),
    },
    recorder=Recorder(rate="500 Hz", cut_off="100 Hz"),
)


@pytest.fixture(scope="module")
def recordings():
    return [
        loading_recording(SLIDER, TRIBOMETER, velocity="2 um/s", seed=seed) for seed in range(12)
    ]


@pytest.mark.parametrize("channel", ["displacement", "drive position"])
def test_lambda_is_recovered_within_its_uncertainty(recordings, channel) -> None:
    spring = None if channel == "displacement" else SLIDER.K
    lengths = [elastic_length(r, displacement=channel, spring=spring) for r in recordings]
    # Six cycles: Student's t with five degrees of freedom, whose 99.9 % are 6.9.
    errors = np.array([(f.lambda_ - LAMBDA) / f.uncertainty for f in lengths])
    assert np.all(np.abs(errors) < 6.9)
    # No bias beyond what the scatter of twelve tests leaves.
    mean = np.mean([f.lambda_ for f in lengths])
    doubt = np.std([f.lambda_ for f in lengths], ddof=1) / np.sqrt(len(lengths))
    assert abs(mean - LAMBDA) < 5 * doubt
    stated = np.sqrt(np.mean([f.uncertainty**2 for f in lengths]))
    # 99.8 % of chi squared with eleven degrees of freedom.
    assert np.sqrt(1.83 / 11) < doubt * np.sqrt(len(lengths)) / stated < np.sqrt(31.3 / 11)
    assert stated < 0.02 * LAMBDA


def test_the_slope_is_the_stiffness_of_the_asperities(recordings) -> None:
    measured = elastic_length(recordings[0])
    assert measured.stiffness == pytest.approx(7.0 / LAMBDA, rel=0.01)
    assert measured.cycles.size == 6
    series = elastic_length(recordings[0], displacement="drive position", spring=SLIDER.K)
    in_series = 1 / (1 / float(SLIDER.K) + LAMBDA / 7.0)
    assert series.stiffness == pytest.approx(in_series, rel=1e-3)


def test_the_same_from_a_file(recordings, tmp_path) -> None:
    path = write(recordings[0], tmp_path / "loading.csv", units={"displacement": "um"})
    again = elastic_length(read(path))
    assert again.lambda_ == pytest.approx(elastic_length(recordings[0]).lambda_, rel=1e-5)


def test_a_planted_slope_is_read_in_the_presence_of_drift() -> None:
    time = np.arange(0, 60, 0.01)
    triangle = np.abs((time / 5) % 2 - 1)
    force = 1.0 + triangle
    x = 0.8e-6 / 7 * force + 3e-9 * time
    channels = {
        "shear force": Channel(force, "force", "N"),
        "normal force": Channel(np.full(time.size, 7.0), "force", "N"),
        "displacement": Channel(x, "length", "m"),
    }
    measured = elastic_length(Trace(time, channels))
    assert measured.lambda_ == pytest.approx(0.8e-6, rel=1e-9)
    assert measured.cycles.size == 5


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"low": 0.7}, "must lie between 0 and 1 and rise"),
        ({"cycles": 1}, "at least 2"),
        ({"velocity": "2 um"}, "velocity"),
    ],
)
def test_bad_input_is_named(options, message) -> None:
    with pytest.raises(InputError, match=message):
        loading_recording(SLIDER, TRIBOMETER, **{"velocity": "2 um/s", **options})


def test_a_recording_without_cycles_is_refused(recordings) -> None:
    with pytest.raises(InputError, match="two cycles"):
        elastic_length(recordings[0].slice(0, 4))


def _planted(kinds, signs=(1, 1, 1), spring=np.inf):
    """Loading and unloading; kinds of force and load, signs of displacement, force and load."""
    time = np.arange(0, 60, 0.01)
    force = 1.0 + np.abs((time / 5) % 2 - 1)
    values = (0.8e-6 / 7 + 1 / spring) * force, force, np.full(time.size, 7.0)
    names = "displacement", "shear force", "normal force"
    units = {"length": "m", "force": "N", "pressure": "Pa"}
    channels = {
        name: Channel(sign * v, kind, units[kind])
        for name, sign, v, kind in zip(names, signs, values, ("length", *kinds), strict=True)
    }
    return Trace(time, channels)


@pytest.mark.parametrize("signs", [(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)])
def test_signs_of_the_recorder_do_not_matter(signs) -> None:
    trace = _planted(("force", "force"), signs, spring=2e5)
    measured = elastic_length(trace, spring="0.2 N/um")
    assert measured.lambda_ == pytest.approx(0.8e-6, rel=1e-9)
    assert measured.stiffness > 0


def test_stresses_have_a_length_but_not_with_a_spring() -> None:
    measured = elastic_length(_planted(("pressure", "pressure")))
    assert measured.lambda_ == pytest.approx(0.8e-6, rel=1e-9)
    with pytest.raises(InputError, match="spring must go with a force"):
        elastic_length(_planted(("pressure", "pressure"), spring=2e5), spring="0.2 N/um")
    with pytest.raises(InputError, match=r"elastic_length\.force must have the dimension"):
        elastic_length(_planted(("force", "pressure")))


def test_a_displacement_in_an_unknown_unit_is_no_length() -> None:
    planted = _planted(("force", "force"))
    volts = {**planted.channels, "displacement": Channel(planted.channels["displacement"].values)}
    with pytest.raises(
        InputError, match=r"elastic_length\.displacement must be a length, got 'disp"
    ):
        elastic_length(Trace(planted.time, volts))
