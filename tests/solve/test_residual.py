"""Every converged point of a random batch, put back into the equations of motion.

The waveform (F/W0, slip rate) that the package returns is differentiated spectrally; spring, age
law and friction law are written here once more. An answer that claims convergence and is no
solution shows up whichever method found it.
"""

import dataclasses

import numpy as np
import pytest

from asperity import Slider, periodic_response
from asperity.laws import ElastoPlastic, RiceRuina

#: Residual of either equation over its largest term. The waveform is good to 3e-5 of its swing
#: (see test_periodic), more in its steepest parts, and is differentiated once.
RESIDUAL = 1e-3
#: Mean slip rate over V: not differentiated, and what the mean of F hangs on.
SLIP = 1e-6
#: Harmonics of the waveform over its swing.
HARMONICS = 3e-5
#: A spectrum whose last 16th is below this, relative, is resolved by its samples.
RESOLVED = 1e-6

SAMPLES = 4096
POINTS = 75
LAWS = {"rice-ruina": RiceRuina, "elasto-plastic": ElastoPlastic}


@dataclasses.dataclass(frozen=True)
class Batch:
    """Parameters of shape (points, 1) and the response to them."""

    numbers: dict
    response: object

    @property
    def elastic(self):
        """Stiffness of the spring over that of the asperities."""
        n = self.numbers
        return n["lambda_"] * n["K"] / n["W0"] if "lambda_" in n else 0.0


def draw(count, seed):
    """Operating points over the whole range that the package answers for."""
    random = np.random.default_rng(seed)

    def spread(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), count))

    numbers = {"mu0": random.uniform(0.4, 0.8, count), "A": spread(0.002, 0.05)}
    numbers |= {"D0": spread(1e-7, 2e-6), "W0": spread(3.0, 16.0), "V0": np.full(count, 1e-6)}
    numbers["B"] = numbers["A"] * spread(1.15, 4.0)
    critical = (numbers["B"] - numbers["A"]) * numbers["W0"] / numbers["D0"]
    numbers |= {"K": critical * spread(0.1, 100.0), "V": spread(1e-9, 1e-3)}
    return numbers | {"epsilon": random.uniform(0, 0.9, count), "f": spread(1e-5, 1e4)}


@pytest.fixture(scope="module", params=LAWS)
def batch(request):
    law = LAWS[request.param]
    numbers = draw(POINTS, 41)
    if law is ElastoPlastic:
        numbers["lambda_"] = np.geomspace(5e-8, 2e-6, POINTS)
    law = law(**{f.name: numbers[f.name] for f in dataclasses.fields(law)})
    response = periodic_response(
        Slider(law, spring=numbers["K"], load=numbers["W0"]),
        velocity=numbers["V"],
        epsilon=numbers["epsilon"],
        frequency=numbers["f"],
        waveform=SAMPLES,
    )
    return Batch({name: a[:, None] for name, a in numbers.items()}, response)


def derivative(y):
    """d/dtheta of periodic samples."""
    k = np.arange(y.shape[-1] // 2 + 1)
    return np.fft.irfft(1j * k * np.fft.rfft(y), y.shape[-1])


def age(n, w, friction, log_slip):
    """ln(V0 Phi/D0) from the friction law."""
    rate = n["A"] * (log_slip + np.log(n["V"] / n["V0"]))
    return (friction / w - n["mu0"] - rate) / n["B"]


def ends_of_spectra(n, w, friction, log_slip):
    """Largest relative coefficient in the last 16th of the spectra of both non-linear terms."""
    largest = []
    for term in (np.exp(log_slip), np.exp(-age(n, w, friction, log_slip))):
        spectrum = np.abs(np.fft.rfft(term))
        last = spectrum[:, -term.shape[1] // 32 :]
        largest.append(last.max(1) / spectrum.max(1))
    return np.max(largest, axis=0)


def residuals(n, elastic, friction, log_slip):
    """Residuals (points,) of spring equation and age law, each over its largest term."""
    samples = friction.shape[1]
    theta = 2 * np.pi * np.arange(samples) / samples
    w, dw = 1 + n["epsilon"] * np.cos(theta), -n["epsilon"] * np.sin(theta)
    omega, slip = 2 * np.pi * n["f"], np.exp(log_slip)
    gain = n["V"] * n["K"] / (omega * n["W0"])
    d_friction = derivative(friction)
    v = 1 - d_friction / gain  # velocity of the slider over V
    # v_pl = d/dt (x - F lambda/W), over V
    strained = elastic / gain * (d_friction / w - friction * dw / w**2)
    spring = np.abs(v - strained - slip).max(1) / slip.max(1)
    phi = age(n, w, friction, log_slip)
    terms = np.stack(
        [n["V0"] / n["D0"] * np.exp(-phi), -n["V"] / n["D0"] * v, -omega * derivative(phi)]
    )
    ageing = np.abs(terms.sum(0)).max(1) / np.abs(terms).max((0, 2))
    return np.maximum(spring, ageing), ends_of_spectra(n, w, friction, log_slip)


def faults(batch, waveform, harmonics, rows):
    """Which of the points `rows` contradict the equations, and which are resolved."""
    wrong, resolved = np.zeros(len(rows), dtype=bool), np.zeros(len(rows), dtype=bool)
    n = {name: a[rows] for name, a in batch.numbers.items()}
    elastic = batch.elastic if np.isscalar(batch.elastic) else batch.elastic[rows]
    for step in (8, 4, 2, 1):  # as few samples as resolve: more of them amplify round-off
        friction, log_slip = waveform[..., ::step]
        residual, end = residuals(n, elastic, friction, log_slip)
        swing = np.ptp(friction, axis=1)
        spectrum = 2 * np.fft.rfft(friction)[:, 1:9] / friction.shape[1]
        fault = residual > RESIDUAL
        fault |= np.abs(np.exp(log_slip).mean(1) - 1) > SLIP
        fault |= np.abs(spectrum - harmonics).max(1) > HARMONICS * swing
        now = ~resolved & (end < RESOLVED)
        wrong[now], resolved[now] = fault[now], True
    return wrong, resolved


def answers(batch):
    rows = np.flatnonzero(batch.response.converged)
    return rows, batch.response.waveform[:, rows], batch.response.harmonics[rows]


def test_most_of_the_range_converges(batch):
    # Without a periodic orbit at K < Kc there is nothing to converge to; that is under a tenth.
    assert batch.response.converged.mean() > 0.9


def test_every_converged_point_obeys_the_equations(batch):
    rows, waveform, harmonics = answers(batch)
    wrong, resolved = faults(batch, waveform, harmonics, rows)
    assert not rows[wrong].size
    assert resolved.mean() > 0.97


def test_the_mean_is_that_of_the_waveform(batch):
    rows, waveform, _ = answers(batch)
    error = np.abs(waveform[0].mean(1) - batch.response.mean_friction[rows])
    assert (error <= HARMONICS * np.ptp(waveform[0], axis=1) + 1e-14).all()


def test_numbers_of_a_point_that_converged_are_given(batch):
    rows = batch.response.converged
    logs = batch.response.log_multipliers[rows].real
    assert np.isfinite(batch.response.harmonics[rows]).all()
    assert np.isfinite(logs[:, 0]).all()
    # Of orbits so unstable that the largest overflows, the other one may not be known.
    assert (np.isfinite(logs[:, 1]) | (logs[:, 0] > 709)).all()


def test_numbers_of_a_point_that_failed_are_not_given(batch):
    failed = ~batch.response.converged
    assert np.isnan(batch.response.mean_friction[failed]).all()
    assert np.isnan(batch.response.multipliers[failed]).all()
    assert (batch.response.result[failed] != "converged").all()


def shifted(waveform, harmonics):
    """Late by a 512th of the period."""
    step = SAMPLES // 512
    turn = np.exp(-1j * np.arange(1, 9) * 2 * np.pi / 512)
    return np.roll(waveform, step, axis=2), harmonics * turn


def swollen(waveform, harmonics):
    """Force changes 1 % too large, slip rate consistent with the age."""
    mean = waveform[0].mean(1, keepdims=True)
    return np.stack([mean + 1.01 * (waveform[0] - mean), waveform[1]]), 1.01 * harmonics


def too_fast(waveform, harmonics):
    """Slip rate 1e-5 too large throughout."""
    return np.stack([waveform[0], waveform[1] + 1e-5]), harmonics


def conjugated(waveform, harmonics):
    """Phases of the other sign convention."""
    return waveform, harmonics.conj()


@pytest.mark.parametrize("planted", [shifted, swollen, too_fast, conjugated])
def test_planted_wrong_answers_are_caught(batch, planted):
    rows, waveform, harmonics = answers(batch)
    modulated = (batch.numbers["epsilon"][rows, 0] > 0.05) & (np.ptp(waveform[0], axis=1) > 1e-9)
    rows, waveform, harmonics = rows[modulated], waveform[:, modulated], harmonics[modulated]
    wrong, resolved = faults(batch, *planted(waveform, harmonics), rows)
    caught = wrong[resolved].mean()
    # At low frequency force and load are in phase, and a conjugate is no other answer.
    in_phase = np.abs(harmonics[:, 0].imag) < 1e-3 * np.abs(harmonics[:, 0])
    if planted is conjugated:
        caught = wrong[resolved & ~in_phase].mean()
    assert caught == 1.0
