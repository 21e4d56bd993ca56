"""Files and data at hand are fitted alike, by the law of their kind."""

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.inference.answers import answer_fit
from asperity.questions.fit import Fit
from asperity.recording.writers import write


def test_a_file_is_fitted_as_what_it_is(tmp_path) -> None:
    trace = asp.samples.velocity_steps(seed=5).slice(120, 330)
    file = write(trace, tmp_path / "steps.csv")
    fit = asp.fit(file, starts=1)
    assert fit.law == "rice-ruina"
    for name, true in (("A", 0.009), ("B", 0.0125), ("D0", 8e-6)):
        low, high = fit.parameters[name].interval_95
        middle, half = (low + high) / 2, (high - low) / 2
        # Twice the half-width of 95 %: four standard errors.
        assert abs(true - middle) < 2 * half
    figure = fit.plot()
    residual = figure.axes[1].get_lines()[0].get_ydata()
    assert np.std(residual) < 1e-3


def test_a_file_that_is_not_there_is_named(tmp_path) -> None:
    with pytest.raises(InputError, match=r"no\.csv"):
        asp.fit(tmp_path / "no.csv")
    with pytest.raises(InputError, match="law"):
        asp.compare(tmp_path / "no.csv", laws=["no-such-law"])


READINGS = """V (um/s),epsilon,frequency (Hz),mu1,mu1_uncertainty
1,0.1,120,0.01,1e-4
1,0.3,120,0.03,1e-4
"""


def test_materials_and_priors_go_by_their_names(tmp_path) -> None:
    file = tmp_path / "readings.csv"
    file.write_text(READINGS)
    pmma = asp.materials.load("bureau2000")
    options = {"free": ["D0"], "starts": 0}
    named = asp.fit(file, material="bureau2000", prior="bureau2000", **options)
    loaded = asp.fit(file, material=pmma, prior=pmma, **options)
    assert named.values == loaded.values
    own = asp.fit(file, material=pmma, prior=["D0=0.5+-1e-6 um"], **options)
    assert abs(own.values["D0"] - 0.5e-6) < 1e-9


def test_a_window_of_a_table_is_refused(tmp_path) -> None:
    file = tmp_path / "readings.csv"
    file.write_text(READINGS)
    question = Fit(data=({"file": file, "window": (0, 1)},), material="bureau2000")
    with pytest.raises(InputError, match="window must go with a recording, got a table"):
        answer_fit(question)
