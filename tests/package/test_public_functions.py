"""`asperity.read`, `measure`, `run` and `map` on files, and what objects show of themselves."""

import cmath
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.laws import RiceRuina
from asperity.loads import Programme, Slide

A, B, D0, V0, MU0, K, W0, M = 0.013, 0.026, 4e-7, 1e-6, 0.5, 2e5, 7.0, 1.6
EPSILON, FREQUENCY, MU1, PHASE = 0.1, 40.0, 3e-3, -1.2


@pytest.fixture(scope="module")
def slider():
    law = RiceRuina(mu0=MU0, A=A, B=B, D0=D0, V0=V0)
    return asp.Slider(law, spring=K, load=W0, mass=M)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A laboratory's file: columns with units, 10 s at 1 kHz."""
    phase = 2 * np.pi * FREQUENCY * (time := np.arange(10_000) * 1e-3)
    load = W0 * (1 + EPSILON * np.cos(phase))
    force = W0 * (0.4 + MU1 * np.cos(phase + PHASE))
    path = tmp_path_factory.mktemp("lab") / "recording.csv"
    header = "time (s),normal force (N),shear force (kN)"
    columns = np.stack([time, load, 1e-3 * force], axis=1)
    np.savetxt(path, columns, "%.12f", ",", header=header, comments="")
    return path


@pytest.fixture(scope="module")
def protocol(tmp_path_factory):
    path = tmp_path_factory.mktemp("protocol") / "protocol.toml"
    path.write_text(
        'law = "rice-ruina"\nmaterial = "bureau2000"\nsteps = ["slide at 2 um/s for 0.2 s"]\n'
        '[parameters]\nK = "0.2 N/um"\n[start]\nvelocity = "1 um/s"\n'
        '[solver]\nsampling = "100 Hz"\n',
        encoding="utf-8",
    )
    return path


def test_read_has_the_columns_in_si(recording):
    trace = asp.read(recording)
    assert trace.time.shape == (10_000,)
    expected = W0 * (0.4 + MU1 * np.cos(PHASE + 2 * np.pi * FREQUENCY * trace.time))
    np.testing.assert_allclose(trace.channel("F").values, expected, rtol=1e-8)


def test_measure_takes_a_file_or_a_trace(recording):
    for given in (recording, str(recording), asp.read(recording)):
        reading = asp.measure(given, harmonics=2).reading
        assert reading.epsilon == pytest.approx(EPSILON, rel=1e-6)
        assert reading.frequency == pytest.approx(FREQUENCY, rel=1e-8)
        assert reading.mean_friction == pytest.approx(0.4, rel=1e-6)
        assert abs(reading.harmonics[0]) == pytest.approx(MU1, rel=1e-6)
        assert cmath.phase(reading.harmonics[0]) == pytest.approx(PHASE, abs=1e-6)


def test_run_takes_a_file(protocol, tmp_path):
    """Against SciPy: F/W0 and ln Phi after a velocity step from 1 to 2 um/s."""
    reached = []
    done = asp.run(protocol, tmp_path / "run.nc", progress=lambda *now: reached.append(now))
    assert done.rows == 21
    assert reached[-1] == (0.2, 0.2)

    def rates(_, y):
        f, phi = y
        v = V0 * np.exp((f - MU0 - B * phi) / A)
        return [K / W0 * (2e-6 - v), (V0 * np.exp(-phi) - v) / D0]

    exact = solve_ivp(rates, (0, 0.2), [MU0, 0.0], "Radau", rtol=1e-11, atol=1e-13).y[0, -1]
    with xarray.open_dataset(done.out) as run:
        assert float(run.force[-1]) == pytest.approx(W0 * exact, rel=1e-8)
        # The paper's slider at K/Kc = 0.88.
        assert run.attrs["unstable_start"] == done.unstable_start
        assert "K is 0.879 of the critical stiffness" in done.unstable_start


class Table(HTMLParser):
    """Caption and rows of a table."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.rows, self.caption = [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag == "td":
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.tags[-1] == "caption":
            self.caption += data
        else:
            self.rows[-1][-1] += data


def shown(thing):
    """The texts by which an object shows itself, after checks that hold for all."""
    text, table = repr(thing), Table(thing._repr_html_())
    for dump in ("array(", "f64[", "object at 0x", "\n"):
        assert dump not in text
    assert {"table", "caption"} <= set(table.tags)
    assert table.caption
    return text, {name: value for name, value, *_ in table.rows}


def test_a_slider_shows_its_parameters_with_units(slider):
    text, rows = shown(slider)
    assert text.startswith("<Slider, rice-ruina: ")
    assert (rows["D0"], rows["V0"], rows["M"]) == ("400 nm", "1 um/s", "1.6 kg")
    assert all(f"{name}={value}" in text for name, value in rows.items())
    assert shown(slider.law)[1]["A"] == "0.013"


def test_results_show_ranges_and_counts(slider):
    response = asp.periodic_response(slider, velocity=V0, epsilon=[0.05, 0.24], frequency=120.0)
    text, rows = shown(response)
    assert "2 points" in text
    assert rows["epsilon"] == "0.05 to 0.24 (2,)"
    assert rows["converged"] == "2 of 2"
    motion = asp.transient(slider, Programme(Slide(0.1, V0), load=W0, velocity=V0))
    assert shown(motion)[1]["time"] == "0 to 0.1"


def test_recordings_and_measurements_show_what_they_hold(recording):
    text, rows = shown(asp.read(recording))
    assert "10000 samples of normal force (N), shear force (" in text
    assert rows["time"] == "0 to 9.999"
    rows = shown(asp.measure(recording))[1]
    assert rows["frequency"] == "40"
    assert rows["mu1"] == "0.003"


def test_names_are_escaped_in_tables(tmp_path):
    path = tmp_path / "recording.csv"
    values = np.stack([np.arange(100.0), np.ones(100), np.ones(100)], axis=1)
    header = "time (s),load <b>x</b> (N),shear force (N)"
    np.savetxt(path, values, "%.6f", ",", header=header, comments="")
    assert "<b>" not in asp.read(path)._repr_html_()
