"""The drive of a recording: corners of the load and changes of the velocity."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.inference import recorded_run
from asperity.recording import Channel, Trace


def run_under(
    corners,
    levels,
    *,
    noise=1e-4,
    rate=10.0,
    end=100.0,
    steps=(),
    velocities=(1e-6,),
    friction=(0.6, 0.61),
):
    """A recording under a piecewise linear load."""
    time = np.arange(int(end * rate)) / rate
    edges = np.array([0.0, *steps, end])
    slip = np.interp(time, edges, np.append(0.0, np.cumsum(velocities * np.diff(edges))))
    load = np.interp(time, corners, levels)
    load = 2e7 * (load + noise * np.random.default_rng(0).normal(size=time.size))
    return recorded_run(
        Trace(
            time,
            {
                "friction": Channel(
                    np.resize(friction, time.size), "dimensionless", "", "friction", ""
                ),
                "displacement": Channel(slip, "length", "m", "displacement", "m"),
                "normal stress": Channel(load, "pressure", "Pa", "normal stress", "Pa"),
            },
        ),
        name="run",
        steps=list(steps),
        velocities=list(velocities),
    )


def test_friction_that_never_changes_is_refused():
    with pytest.raises(InputError, match="friction of run must vary, got 0"):
        run_under([0.0, 100.0], [1.0, 1.0], friction=(0.6,))


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_corners_of_the_load_are_placed_between_samples(noise):
    corners = np.array([0.0, 20.037, 20.512, 50.0, 50.451, 70.083, 95.0, 99.9])
    levels = np.array([1.0, 1.0, 1.15, 1.15, 1.0, 1.0, 0.7, 0.7])
    drive = run_under(corners, levels, noise=noise).drive
    # Corners of the slowest ramp, of 1.2 % a second, are known to some hundredths of a second.
    edges = drive.edges
    assert edges.size == corners.size
    np.testing.assert_allclose(edges[1:5], corners[1:5], atol=0.004 if noise else 5e-4)
    np.testing.assert_allclose(edges[5:7], corners[5:7], atol=0.1 if noise else 0.02)
    at = np.arange(0.0, 99.9, 0.013)
    np.testing.assert_allclose(
        drive.load_at(at),
        np.interp(at, corners, levels),
        atol=1.5e-3 if noise else 3e-4,
    )


@pytest.mark.parametrize("noise", [5e-4, 3e-3])
@pytest.mark.parametrize(
    ("corners", "levels"),
    [
        ([0.0, 300.0], [1, 1]),
        ([0.0, 100.04, 100.06, 200.04, 200.06, 300.0], [1, 1, 1.1, 1.1, 1, 1]),
    ],
)
def test_noise_of_a_load_cell_makes_no_corners(corners, levels, noise):
    """The largest of 6,000 samples are 4 standard deviations off, on both sides of the load."""
    drive = run_under(np.array(corners), np.array(levels), noise=noise, rate=20.0, end=300.0).drive
    assert drive.edges.size == len(corners)


def test_a_jump_of_the_load_stays_between_its_two_samples():
    drive = run_under([0.0, 39.92, 39.98, 99.9], [1.0, 1.0, 1.2, 1.2]).drive
    np.testing.assert_allclose(drive.edges, [0.0, 39.9, 40.0, 99.9])
    np.testing.assert_allclose(
        drive.load_at(np.array([10.0, 39.9, 40.0, 80.0])), [1, 1, 1.2, 1.2], atol=1e-4
    )


@pytest.mark.parametrize("seed", range(12))
def test_corners_of_short_ramps_are_placed_within_the_noise(seed):
    rng = np.random.default_rng(seed)
    begin, last, size = rng.uniform(40, 60), rng.uniform(0.35, 1.0), rng.uniform(0.05, 0.25)
    size *= rng.choice([-1, 1])
    corners, levels = [0.0, begin, begin + last, 99.9], [1.0, 1.0, 1.0 + size, 1.0 + size]
    edges = run_under(corners, levels).drive.edges
    assert edges.size == 4
    # The noise of 1e-4 over the slope, for the few samples of the ramp.
    np.testing.assert_allclose(edges[1:3], corners[1:3], atol=6e-4 * last / abs(size))


def test_a_change_of_the_velocity_near_a_corner_of_the_load_is_moved_to_it():
    """Otherwise a segment of 2 ms between them would bound the delay of the change."""
    corners, levels = [0.0, 40.03, 40.43, 99.9], [1.0, 1.0, 1.15, 1.15]
    run = run_under(corners, levels, steps=[40.028], velocities=[1e-6, 3e-6])
    assert run.drive.edges.size == 4
    assert run.cuts == (1,)
    assert run.drive.edges[1] == pytest.approx(40.03, abs=1e-3)
    np.testing.assert_allclose(run.drive.pull, [1, 3, 3])


def test_a_change_of_the_velocity_an_interval_from_a_corner_stays():
    corners, levels = [0.0, 40.03, 40.43, 99.9], [1.0, 1.0, 1.15, 1.15]
    run = run_under(corners, levels, steps=[39.9], velocities=[1e-6, 3e-6])
    assert run.drive.edges.size == 5
    assert run.drive.edges[1] == pytest.approx(39.9, abs=1e-9)
