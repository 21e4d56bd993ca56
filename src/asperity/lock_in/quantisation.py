"""Quantisation error of a reading, by the steps of a recorder and noise finer than a step.

A channel x that is recorded in steps q has the error sum_n (-1)^n q/(pi n) sin(2 pi n x/q). For a
level with an oscillation of amplitude A at the fundamental and noise of standard deviation s, its
harmonic k has, over all levels, the variance

    q^2/(2 pi^2) sum_n [c_k J_k(2 pi n A/q) exp(-2 pi^2 n^2 s^2/q^2) / n]^2,    c_0 = 1, c_k = 2,

which is q^2/12 for the mean of a constant. Source: B. Widrow and I. Kollar, Quantization Noise
(Cambridge, 2008), of a sinusoid and Gaussian noise. This is for samples at all phases. Samples at
the same P phases in each period, fewer than the steps that a period passes, have P errors that do
not depend on each other, and the variance is at least c_k/P of that of a constant.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import jv

from asperity.arrays import Float
from asperity.lock_in.reading import LockInReading

#: Samples in which steps are searched, and terms of the sum.
_SEARCHED, _TERMS = 1 << 14, 50
#: Noise of ten steps leaves no error, exp(-2 pi^2 100) = 0 in doubles; a wrong value of 1e-300
#: in a damaged file makes steps whose ratio to the noise has no square.
_SMOOTH = 10.0


def step_of(values: Float) -> float:
    """Smallest difference between values that differ, (n,); 0 for a constant.

    `asperity.recording.defects.resolution.recorder_step` needs repeated samples, which a modulated
    signal does not have.
    """
    steps = np.diff(np.unique(values[:_SEARCHED]))
    return float(steps.min()) if steps.size else 0.0


def rounding_variance(
    step: float,
    noise: float,
    amplitude: float = 0.0,
    harmonics: int = 0,
    phases: float = np.inf,
) -> Float:
    """Variance of the mean and of the real part of each harmonic, (1 + harmonics,).

    Parameters
    ----------
    step, noise, amplitude : float
        Step of the recorder, standard deviation of what is recorded apart from the modulation, with
        the rounding, and amplitude of the fundamental.
    harmonics : int
    phases : float
        Number of phases at which samples are, if these are the same in each period.
    """
    if not step or noise > _SMOOTH * step:
        return np.zeros(1 + harmonics)
    n, k = np.arange(1, _TERMS + 1), np.arange(1 + harmonics)[:, None]
    # Rounding alone has the variance step^2/12.
    relative = max((noise / step) ** 2 - 1 / 12, 0.0)
    smoothed = np.exp(-2 * (np.pi * n) ** 2 * relative) / n
    weight = np.where(k, 2, 1)
    each = weight * jv(k, 2 * np.pi * n * amplitude / step) * smoothed
    alone = weight[:, 0] / phases * np.sum(smoothed**2)
    return np.asarray(step**2 / (2 * np.pi**2) * np.maximum(np.sum(each**2, axis=1), alone))


def common_phases(cycles: Float, steps: float) -> float:
    """Number of phases at which all samples are; infinite where it does not make their errors.

    Parameters
    ----------
    cycles : array, (n,)
        Phases of the samples over 2 pi.
    steps : float
        Amplitude of the fundamental in steps of the recorder.
    """
    cycles = cycles[:_SEARCHED]
    # Steps that the signal passes in a period; it has as many independent errors at most.
    passed = min(2 * np.pi * steps, cycles.size)
    phases = np.unique((cycles % 1.0 * passed).astype(int)).size
    return float(phases) if 2 * phases < passed else np.inf


def with_rounding(
    reading: LockInReading, time: Float, load: Float, force: Float, steps: tuple[float, float]
) -> LockInReading:
    """The reading with the errors by the recorder's steps in its covariance.

    Parameters
    ----------
    reading : LockInReading
    time, load, force : array, (n,)
        Samples of the window.
    steps : (float, float)
        Steps of the recorder of load and force, from `step_of`.
    """
    count, scale = reading.harmonics.size, abs(reading.W0)
    variances = []
    for c, values in enumerate((load, force)):
        size = (reading.epsilon, reading.phasor(1).amplitude)[c] * scale
        drift = float(np.sum(reading.drift[c] ** 2)) / 12
        left = float(np.var(reading.residual_of_piece(time, values)[1]))
        noise = float(np.sqrt(left + drift))
        phases = common_phases(reading.cycles(time), size / steps[c]) if steps[c] else np.inf
        variance = rounding_variance(steps[c], noise, size, count, phases)
        variances.append(variance / scale**2)
    of_load, of_force = variances
    of_phase = of_load[1] / max(reading.epsilon, 1e-300) ** 2
    added = {
        "W0": of_load[0] * scale**2,
        "epsilon": of_load[1],
        "mean_force": of_force[0] * scale**2,
        "mean_friction": of_force[0] + reading.mean_friction**2 * of_load[0],
    }
    for k in range(1, count + 1):
        turned = (k * abs(reading.harmonics[k - 1])) ** 2 * of_phase
        added |= dict.fromkeys((f"re{k}", f"im{k}"), of_force[k] + turned)
        added |= dict.fromkeys((f"load_re{k}", f"load_im{k}"), of_load[k])
    diagonal = np.diag([added.get(name, 0.0) for name in reading.names])
    return replace(reading, covariance=reading.covariance + diagonal)
