"""Real velocity steps, where the recordings are beside the repository."""

from pathlib import Path

import pytest

from asperity.inference import RunOptions, fit, recorded_run

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data"
BASALT = FOLDER / "velstep4_BRAVA_expb819_basalt.txt"


@pytest.mark.skipif(not BASALT.is_file(), reason="the recordings are not beside the repository")
def test_basalt():
    run = recorded_run(BASALT, window=(11640, 11700))
    assert run.load_unit == "Pa"
    found = fit(run, "rice-ruina", ["A", "B", "D0"], starts=4)
    white = fit(run, "rice-ruina", ["A", "B", "D0"], starts=4, runs=RunOptions(order=0))
    (term,) = found.objective.terms
    assert found.converged
    assert term.noise["effective_samples"] < 0.6 * run.time.size
    # What the record shows by eye: steady friction rises by less than 1e-3 from 3 to 10 um/s.
    assert abs(found.values["A"] - found.values["B"]) < 1e-3
    assert found.parameters["D0"].se > 1.5 * white.parameters["D0"].se
