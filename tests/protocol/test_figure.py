"""The figure of a run shows what the run holds."""

import numpy as np
import pytest

from asperity.figures.style import style
from asperity.figures.trajectory import draw_run
from asperity.protocol import RunOutline


def drawn(low, high, events=()):
    time = np.linspace(0, 10, 50)
    flat = np.full(50, 7.0)
    run = RunOutline(
        time,
        {"load": flat, "force": 0.4 * flat, "velocity": low},
        {"load": flat, "force": 0.5 * flat, "velocity": high},
        list(events),
        "a title",
        "rice-ruina",
    )
    with style():
        figure = draw_run(run)
        figure.canvas.draw()
    return run, figure.axes


def test_edges_of_the_bands_are_the_extremes() -> None:
    slow = np.full(50, 1e-5)
    run, (load, force, velocity) = drawn(0.9 * slow, 1.1 * slow)
    low, high = (line.get_ydata() for line in force.lines)
    np.testing.assert_array_equal(low, run.low["force"])
    np.testing.assert_array_equal(high, run.high["force"])
    np.testing.assert_allclose(velocity.lines[1].get_ydata(), 11.0)
    assert velocity.get_yscale() == "linear"
    assert velocity.get_xlim() == (0, 10)
    below, above = load.get_ylim()
    assert below < 7 < above
    assert load.get_title() == "a title"


@pytest.mark.parametrize(("least", "scale"), [(1e-9, "log"), (-1e-6, "symlog")])
def test_pulses_are_seen_beside_slow_sliding(least, scale) -> None:
    low, high = np.full(50, least), np.full(50, 1e-5)
    high[20] = 1e-3
    _, (_, _, velocity) = drawn(low, high)
    assert velocity.get_yscale() == scale
    below, above = velocity.get_ylim()
    assert below < 1e6 * least
    assert above > 1e3


def test_events_are_marked_unless_there_are_too_many() -> None:
    slow = np.full(50, 1e-5)
    _, (_, force, _) = drawn(slow, slow, [(2.0, "steady"), (3.0, "slip start"), (4.0, "slip end")])
    assert sorted(line.get_xdata()[0] for line in force.lines[2:]) == [2.0, 3.0]
    _, (_, force, _) = drawn(slow, slow, [(0.1 * i, "slip start") for i in range(100)])
    assert len(force.lines) == 2
