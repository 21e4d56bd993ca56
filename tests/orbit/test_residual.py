"""The residual of the equations of motion at every converged point of a random batch."""

import dataclasses

import numpy as np
import pytest
from benchmarks.residual import LAWS, answer, draw, faults, faults_marched

from references.populations import population

pytestmark = pytest.mark.slow

SAMPLES = 4096
POINTS = 25


@dataclasses.dataclass(frozen=True)
class Batch:
    """Parameters of shape (points,) and the response to them."""

    numbers: dict
    response: object

    def part(self, rows):
        return {name: a[rows] for name, a in self.numbers.items()}


@pytest.fixture(scope="module", params=population(LAWS))
def batch(request):
    numbers = {name: np.append(a[:POINTS], a[0]) for name, a in draw(request.param, 75, 41).items()}
    # One that is not searched, for what is said of points that failed.
    numbers["epsilon"][-1] = 0.9995
    return Batch(numbers, answer(request.param, numbers, SAMPLES))


def answers(batch):
    """Rows that converged, with waveform, mean and harmonics."""
    r = batch.response
    rows = np.flatnonzero(r.converged)
    return rows, r.waveform[:, rows], r.mean_friction[rows], r.harmonics[rows]


def test_most_points_of_the_range_converge(batch):
    # Without a periodic orbit at K < Kc there is nothing to converge to; that is under a tenth.
    assert batch.response.converged.mean() > 0.9


def test_every_converged_point_obeys_the_equations(batch):
    rows, *answer = answers(batch)
    wrong, resolved = faults(batch.part(rows), *answer)
    assert not rows[wrong].size
    assert resolved.mean() > 0.97


def test_a_point_that_converged_has_numbers(batch):
    rows = batch.response.converged
    logs = batch.response.log_multipliers[rows].real
    assert np.isfinite(batch.response.harmonics[rows]).all()
    assert np.isfinite(logs[:, 0]).all()
    # Of orbits so unstable that the largest overflows, the other one may not be known.
    assert (np.isfinite(logs[:, 1]) | (logs[:, 0] > 709)).all()


def test_a_point_that_failed_has_no_numbers(batch):
    failed = ~batch.response.converged
    assert failed[-1]
    assert np.isnan(batch.response.mean_friction[failed]).all()
    assert np.isnan(batch.response.multipliers[failed]).all()
    assert (batch.response.result[failed] != "converged").all()


def shifted(waveform, mean, harmonics):
    """Late by a 512th of the period."""
    step = SAMPLES // 512
    turn = np.exp(-1j * np.arange(1, 9) * 2 * np.pi / 512)
    return np.roll(waveform, step, axis=2), mean, harmonics * turn


def swollen(waveform, mean, harmonics):
    """Force changes 1 % too large, slip rate consistent with the age."""
    level = waveform[0].mean(1, keepdims=True)
    swollen = np.stack([level + 1.01 * (waveform[0] - level), waveform[1]])
    return swollen, mean, 1.01 * harmonics


def too_fast(waveform, mean, harmonics):
    """Slip rate 1e-5 too large throughout."""
    return np.stack([waveform[0], waveform[1] + 1e-5]), mean, harmonics


def conjugated(waveform, mean, harmonics):
    """Phases of the other sign convention."""
    return waveform, mean, harmonics.conj()


def lifted(waveform, mean, harmonics):
    """Mean too large by a ten-thousandth of the swing."""
    return waveform, mean + 1e-4 * np.ptp(waveform[0], axis=1), harmonics


@pytest.mark.parametrize("planted", [shifted, swollen, too_fast, conjugated, lifted])
def test_planted_wrong_responses_are_detected(batch, planted):
    rows, waveform, mean, harmonics = answers(batch)
    modulated = (batch.numbers["epsilon"][rows] > 0.05) & (np.ptp(waveform[0], axis=1) > 1e-9)
    rows, waveform = rows[modulated], waveform[:, modulated]
    mean, harmonics = mean[modulated], harmonics[modulated]
    wrong, resolved = faults(batch.part(rows), *planted(waveform, mean, harmonics))
    caught = wrong[resolved].mean()
    # At low frequency force and load are in phase, and a conjugate is no other answer.
    in_phase = np.abs(harmonics[:, 0].imag) < 1e-3 * np.abs(harmonics[:, 0])
    if planted is conjugated:
        caught = wrong[resolved & ~in_phase].mean()
    assert caught == 1.0


def test_integration_from_sample_to_sample_agrees(batch):
    rows, waveform, mean, harmonics = answers(batch)
    n = batch.part(rows)
    # Slow modulation takes steps by the thousand.
    few = np.flatnonzero(n["V"] / (n["D0"] * n["f"]) < 50)[:5]
    numbers = batch.part(rows[few])
    waveform, mean, harmonics = waveform[:, few], mean[few], harmonics[few]
    assert not faults_marched(numbers, waveform, mean, harmonics).any()
    # At each point another mistake.
    swing = np.ptp(waveform[0], axis=1)
    mean[0] += 1e-4 * swing[0]
    harmonics[1] += 1e-4 * swing[1]
    waveform[1, 2] += 0.1
    waveform[1, 3] += 1e-5
    mean[4] = np.nan
    assert faults_marched(numbers, waveform, mean, harmonics).all()
