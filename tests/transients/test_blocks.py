"""Blocks: the same numbers as in one piece, a bounded size, and a way to go on."""

import itertools

import numpy as np
import pytest

from asperity.loads import Modulate, Programme, Slide, StepLoad
from asperity.transients import Trajectory, integrate_blocks, transient

PROGRAMME = Programme(
    *(Slide("0.2 s"), Modulate("0.3 s", 0.2, "40 Hz", rise="0.1 s"), StepLoad("8 N")),
    Slide("0.5 s"),
    load="7 N",
    velocity="1 um/s",
)
COLUMNS = ("time", "force", "load", "velocity", "slip_velocity", "displacement", "states")
SAMPLINGS = {"rate": "1 kHz", "times": np.linspace(0, 1, 777) ** 2, "steps": None}


@pytest.fixture(scope="module")
def slider(physical):
    return physical.Experiment(lambda_=6.2e-7).slider


@pytest.mark.parametrize("sampling", SAMPLINGS.values(), ids=SAMPLINGS)
def test_blocks_are_the_whole_in_pieces(slider, sampling) -> None:
    whole = transient(slider, PROGRAMME, sampling=sampling)
    blocks = list(integrate_blocks(slider, PROGRAMME, sampling=sampling, rows=64))
    assert len(blocks) > 3
    assert {len(b.time) for b in blocks[:-1]} == {64}
    joined = Trajectory.joined(blocks)
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(joined, name), getattr(whole, name))
    assert joined.events == whole.events
    assert [b.termination for b in blocks] == [None] * len(blocks)
    assert whole.time[0] == 0
    assert whole.time[-1] == 1.0
    assert np.all(np.diff(whole.time) > 0)


def test_samples_lie_where_they_were_asked_for(slider) -> None:
    found = transient(slider, PROGRAMME, sampling="1 kHz")
    np.testing.assert_array_equal(found.time, np.arange(1001) / 1000)
    np.testing.assert_allclose(found.load, PROGRAMME.load(found.time), rtol=1e-13)
    times = np.array([0.0, 0.123, 0.5, 1.0])
    np.testing.assert_array_equal(transient(slider, PROGRAMME, sampling=times).time, times)


def test_an_interrupted_run_goes_on_where_it_was(slider) -> None:
    whole = transient(slider, PROGRAMME, sampling="1 kHz")
    reported = []

    def interrupt(t: float, end: float) -> None:
        reported.append(t)
        if t > 0.3:
            raise KeyboardInterrupt

    kept = []
    blocks = integrate_blocks(slider, PROGRAMME, sampling="1 kHz", rows=50, progress=interrupt)
    with pytest.raises(KeyboardInterrupt):
        kept.extend(blocks)  # what was handed out before is there
    assert sum(len(b.time) for b in kept) >= 200
    rest = integrate_blocks(
        slider, PROGRAMME, sampling="1 kHz", rows=50, resume=kept[-1].checkpoint
    )
    joined = Trajectory.joined([*kept, *rest])
    np.testing.assert_array_equal(joined.time, whole.time)
    np.testing.assert_allclose(joined.force, whole.force, rtol=1e-8)
    np.testing.assert_allclose(joined.displacement, whole.displacement, rtol=0, atol=1e-13)
    kinds = [e.kind for e in joined.events if e.kind.startswith("slip")]
    assert kinds == [e.kind for e in whole.events if e.kind.startswith("slip")]
    assert reported == sorted(reported)


def test_a_long_run_starts_at_once_and_holds_one_block(slider) -> None:
    """Ten minutes at 10 kHz are six million rows: only those asked for are made."""
    programme = Programme(
        Slide("300 s"), Modulate("300 s", 0.2, "120 Hz"), load="7 N", velocity="1 um/s"
    )
    blocks = integrate_blocks(slider, programme, sampling="10 kHz", rows=20_000)
    first = list(itertools.islice(blocks, 3))
    assert [len(b.time) for b in first] == [20_000] * 3
    np.testing.assert_array_equal(first[2].time, np.arange(40_000, 60_000) / 10_000)
