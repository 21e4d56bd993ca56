"""Fits in several windows: their spread widens the intervals, and outlying windows are named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.coverage import CASES, TRUE, runs_of, trace_of

from asperity.errors import InputError, worded
from asperity.inference import WindowEstimate, fit, fit_windows
from asperity.inference.fitting.windows import disagreeing
from asperity.inference.unknowns import unknown_of
from asperity.laws import RiceRuina
from asperity.parameters import law_parameters

pytestmark = pytest.mark.slow

FREE = ["A", "B", "D0"]
#: The whole recording, and without parts of its first or last segment.
WINDOWS = [(0.0, 140.0), (13.0, 140.0), (0.0, 120.0)]


def traced(run, friction):
    return trace_of(run.time, friction, run.slip, np.full(run.time.size, run.W0))


@pytest.fixture(scope="module")
def run():
    return next(runs_of(CASES["steps"], 1))


def fit_in_windows(run, friction):
    # One start at the truth: these tests are not about the search.
    windows = WINDOWS[::2]
    return fit_windows(traced(run, friction), "rice-ruina", FREE, windows, start=TRUE, starts=1)


def test_a_disturbance_outside_one_window_widens_the_interval(run):
    calm = fit_in_windows(run, run.friction)
    assert [f.converged for f in calm.fits] == [True] * 2
    for name, truth in TRUE.items():
        p = calm.parameters[name]
        assert p.interval_95[0] < truth < p.interval_95[1]
        assert min(p.values) <= p.value <= max(p.values)
        assert p.se == pytest.approx(np.hypot(p.se_noise, p.se_window))
    # A hump after the end of the second window; one of 0.02 would hardly change B.
    hump = 0.05 * np.clip((run.time - 121.0) / 19.0, 0, 1) ** 2
    bent = fit_in_windows(run, run.friction + hump)
    share = [o.parameters["B"].se_window / o.parameters["B"].se_noise for o in (calm, bent)]
    assert share[1] > 3 * share[0]
    assert bent.record()["parameters"]["B"]["se_window"] == bent.parameters["B"].se_window


def test_a_warning_of_the_first_window_is_not_new_in_another(run, monkeypatch):
    single = fit(run, "rice-ruina", FREE, start=TRUE, starts=1)
    warned = [replace(single, sentences=w) for w in (("A s: b", "c"), ("A s: b", "d"))]
    monkeypatch.setattr("asperity.inference.fitting.windows.fit", lambda *_, **__: warned.pop(0))
    result = fit_in_windows(run, run.friction)
    assert result.new_warnings == ("window 0 to 120 s: d",)
    assert len(result.warnings) == 4


def test_all_windows_have_the_free_parameters_of_the_first(run, monkeypatch):
    """Also if its fit fails: the load changes only after its end."""
    load = np.where(run.time < 125, run.W0, 1.1 * run.W0)
    trace = trace_of(run.time, run.friction, run.slip, load)
    asked = []

    def failed(recording, law, free, **_):
        asked.append((recording.load_varies, free))
        return SimpleNamespace(converged=False, message="", sentences=())

    monkeypatch.setattr("asperity.inference.fitting.windows.fit", failed)
    fit_windows(trace, "linker-dieterich", None, [(0.0, 120.0), (0.0, 140.0)])
    assert asked == [(False, FREE), (True, FREE)]


def test_a_single_window_is_refused(run):
    with pytest.raises(InputError, match="windows must be two or more"):
        fit_windows(traced(run, run.friction), "rice-ruina", FREE, [(0, 100)])


def test_a_window_with_an_outlying_value_is_named():
    values = (1e-4, 9e-8, np.nan)
    estimate = WindowEstimate("D0", "m", 1e-4, 2e-5, 1e-5, 1e-5, (8e-5, 1e-4), (6e-5, 2e-4), values)
    D0 = unknown_of(law_parameters(RiceRuina)["D0"], None, None, (1e-8, 1e-3))
    (sentence,) = disagreeing(D0, estimate, WINDOWS)
    assert worded(sentence).startswith("window 13 to 140 s: D0 is 9e-08 m")
