"""Observables of periodic orbits, common to all methods."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jax import Array

from asperity.arrays import Complex, Float
from asperity.orbit.floquet import log_multipliers, log_multipliers_of_exponent
from asperity.slider.pointwise import excitation_at, values_at
from asperity.slider.problem import Problem
from asperity.theory.limits import even_phases

if TYPE_CHECKING:
    from asperity.orbit.mesh.mesh import Orbit
    from asperity.orbit.methods.fourier import FourierOrbit

#: Shares of the first harmonic and of the mean whose round-off a harmonic may have.
_SMALL_HARMONIC, _SMALL_MEAN = 5e-8, 5e-11
#: Round-off of harmonics without modulation, over the mean: up to 9e-16 on meshes.
_ROUND_OFF = 2e-15


class Observables(NamedTuple):
    """Mean, harmonics and monodromy matrix of orbits; F/W0 = mean + sum Re(c_n e^{i n theta}).

    Attributes
    ----------
    mean_friction : array, shape (points,)
        Mean of F/W0.
    harmonics : complex array, shape (count, points)
        c_1, c_2, ...
    monodromy : array, shape (size, size, points)
        The monodromy matrix over exp(`log_scale`); of no meaning where `exponent` is known.
    log_scale : array, shape (points,)
    log_determinant : array, shape (points,)
        Logarithm of the determinant of the monodromy matrix: the integral of the trace of the
        Jacobian (Liouville), free of cancellation.
    exponent : array, shape (size, size, points)
        A matrix whose exponential is the monodromy matrix; NaN where it is not known.
    growth : array, shape (points,)
        Integral of the largest real part of the eigenvalues of the Jacobian; inf where it was not
        computed.
    start : array, shape (size, points)
        States at theta = 0.
    reversal_margin : array, shape (points,)
        Smallest value of `Motion.reversal_margin`; inf where the method itself accepts no orbit
        with a negative one.
    """

    mean_friction: Array
    harmonics: Array
    monodromy: Array
    log_scale: Array
    log_determinant: Array
    exponent: Array
    growth: Array
    start: Array
    reversal_margin: Array

    @property
    def numbers(self) -> Complex:
        """Mean, then harmonics, shape (1 + count, points)."""
        return np.concatenate([np.asarray(self.mean_friction)[None], self.harmonics])

    @property
    def log_multipliers(self) -> Complex:
        """Logarithms of the Floquet multipliers by falling modulus, shape (size, points)."""
        monodromy, log_scale, log_determinant, exponent = map(np.asarray, self[2:6])
        # Of multipliers near 1 a matrix of their logarithms keeps more digits.
        known = np.isfinite(exponent).all((0, 1))
        logs = np.empty(monodromy.shape[1:], complex)
        logs[:, known] = log_multipliers_of_exponent(exponent[..., known], log_determinant[known])
        others = monodromy[..., ~known], log_scale[~known], log_determinant[~known]
        logs[:, ~known] = log_multipliers(*others)
        return logs


def response_gap(before: Complex, now: Complex, *, each: int = 2) -> Float:
    """Largest relative difference of mean and harmonics, shape (points,); inf where not finite.

    Parameters
    ----------
    before, now : complex array, shape (1 + count, points)
        Mean, then harmonics.
    each : int
        Number of harmonics whose difference is divided by their own modulus; that of a higher
        harmonic is divided by the modulus of the first. A harmonic that vanishes relative to the
        first, or to the mean, is compared up to round-off.
    """
    with np.errstate(all="ignore"):
        mean, first = np.abs(now[0]), np.abs(now[1])
        scale = np.abs(now) + _SMALL_HARMONIC * first + _SMALL_MEAN * mean
        scale[0], scale[1 + each :] = mean, scale[1]
        gap = (np.abs(now - before) / scale).max(0)
    return np.where(np.isfinite(gap), gap, np.inf)


def without_round_off(numbers: Complex) -> Complex:
    """Mean and harmonics, (1 + count, points), without harmonics that are round-off of the mean.

    All are, without modulation: the phase and the derivatives of round-off mean nothing.
    """
    still = (np.abs(numbers[1:]) < _ROUND_OFF * np.abs(numbers[0])).all(0)
    return np.concatenate([numbers[:1], np.where(still, 0.0, numbers[1:])])


def waveform(problem: Problem, orbit: Orbit | FourierOrbit, phases: int) -> Float:
    """F/W0 and ln(v_pl/V) at theta = 2 pi k / phases, shape (2, phases, points)."""
    theta = even_phases(phases)
    return waveform_of(problem, orbit.states(theta), theta)


def waveform_of(problem: Problem, Y: Float, theta: Float) -> Float:
    """F/W0 and ln(v_pl/V) of the states `Y`, (size, phases, points), at the phases `theta`."""
    at = excitation_at(problem.load, theta * np.ones(Y.shape[2]))
    values = values_at(problem.system, at, np.zeros_like(Y[:, 0]), Y)
    return np.stack([values.force, values.log_slip])
