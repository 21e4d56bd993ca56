"""Checks of a modulation on samples of its period, for what the equations assume."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np
from jax.typing import ArrayLike

from asperity.arrays import Float
from asperity.errors import InputError, code_of_others, require
from asperity.loads.modulation import (
    Excitation,
    Harmonic,
    Modulation,
    Periodic,
    require_contact_within_period,
)
from asperity.parameters.arguments import broadcast_shape, shown
from asperity.parameters.rules import obeying

#: Numbers of samples of the period; a fault counts if it remains with more samples.
_SAMPLES = (64, 1024, 16384)

#: Values of one evaluation: points times samples.
_VALUES = 2**18

#: Largest error of a mean or of the amplitude, and share of the variation of W/W0 that its slope
#: may miss: far above the error of a load with a kink, far below that of a wrong sign or factor.
_MEAN, _SLOPE = 1e-3, 2e-2


def checked_modulation(modulation: Modulation, name: str = "modulation") -> Modulation:
    """Check that the members of a modulation agree with each other, and return it.

    Parameters
    ----------
    modulation : Modulation
        Numbers or arrays of any shapes that broadcast. Members of `Harmonic` and `Periodic` agree
        by their construction.
    name : str
        Name of the modulation in messages.

    Raises
    ------
    InputError
        If its fields are not numbers or arrays that broadcast; if over a period a value is not
        finite, W does not stay positive, the mean of W/W0 or of the pull is not 1, or `w_slope` is
        not the derivative of `w`; if `amplitude` is not that of the first harmonic, `scaled(0)` is
        not steady sliding, or `even` is True for a load that is not even; or if a member fails.
    """
    leaves, structure = jax.tree.flatten(modulation)
    for leaf in leaves:
        if isinstance(leaf, str):
            raise InputError(name, "have numbers for its fields", shown(leaf), "give them in SI")
    if type(modulation) is Harmonic:
        obeying(modulation.epsilon, f"{name}.epsilon", "dimensionless", "amplitude")
        return modulation
    if type(modulation) is Periodic:
        require_contact_within_period(modulation.load)
        return modulation
    shape = broadcast_shape(name, *leaves)
    flat = [np.ravel(np.broadcast_to(np.asarray(leaf, float), shape)) for leaf in leaves]
    rule = "have members that work on arrays of jax.numpy"
    page, where = "see the page 'Write your own load'", type(modulation).__name__
    with code_of_others(name, rule, page, where):
        _check(structure, flat, int(np.prod(shape)), name)
    return modulation


def _check(
    structure: Any, leaves: list[Float], points: int, name: str, samples: int = _SAMPLES[0]
) -> None:
    """Raise `InputError` for a fault that remains with more samples."""
    at_once = _VALUES // samples
    for first in range(0, points, at_once):
        part = [leaf[first : first + at_once] for leaf in leaves]
        try:
            _check_samples(structure.unflatten(part), samples, name)
        except InputError:
            if samples == _SAMPLES[-1]:
                raise
            finer = _SAMPLES[_SAMPLES.index(samples) + 1]
            _check(structure, part, min(at_once, points - first), name, finer)


def _check_samples(modulation: Modulation, samples: int, name: str) -> None:
    """Raise `InputError` for the first faulty point."""
    theta = 2 * np.pi * np.arange(samples) / samples
    at, amplitude, still = jax.tree.map(np.asarray, _members(modulation, theta[:, None]))
    amplitude = np.atleast_1d(amplitude)
    rule, got = "give w an entry for each phase", f"an array of shape {np.shape(at.w)}"
    require(np.shape(at.w)[:1] == (samples,), f"{name}.at", rule, got, "fill an array")
    values = {
        field: value * np.ones((samples, amplitude.size))
        for field, value in zip(Excitation._fields, at, strict=True)
    }
    member = f"{name}.at"
    for field, part in values.items():
        rule, got = "be finite over the period", f"{field} that is not"
        require(np.isfinite(part).all(), member, rule, got, "correct it")
    w, pull = values["w"], values["pull"]
    rule = "keep W/W0 positive over the period, so that contact is never lost"
    require(w.min() > 0, name, rule, f"{w.min():.4g}", "lower its strength")
    for field, part in (("w", w), ("pull", pull)):
        means = part.mean(0)
        mean = float(means[np.argmax(np.abs(means - 1.0))])
        rule = f"give a {field} of mean 1 over the period"
        require(abs(mean - 1) <= _MEAN, member, rule, f"{mean:.6g}", "divide it by its mean")
    for field in ("w", "shear"):
        missed = _missed_by_slope(values[field], values[f"{field}_slope"])
        rule = f"give {field}_slope as the derivative of {field} with respect to theta"
        got = f"one that misses {100 * missed:.2g} % of its variation"
        require(missed <= _SLOPE, member, rule, got, f"differentiate {field} once more")
    first = 2 * np.abs((w * np.exp(-1j * theta)[:, None]).mean(0))
    wrong = np.argmax(np.abs(amplitude - first))
    rule = f"be that of the first harmonic of W/W0, {first[wrong]:.6g}"
    got, advice = f"{amplitude[wrong]:.6g}", "correct one of the two"
    holds = abs(amplitude[wrong] - first[wrong]) <= _MEAN
    require(holds, f"{name}.amplitude", rule, got, advice)
    rule, got = "be a constant load, W/W0 = 1", "one that changes"
    holds, advice = np.abs(still - 1).max() <= _MEAN, "multiply the strength by the share"
    require(holds, f"{name}.scaled(0)", rule, got, advice)


@jax.jit
def _members(modulation: Modulation, theta: Float) -> tuple[Excitation, ArrayLike, ArrayLike]:
    """Excitation, amplitude, and W/W0 of steady sliding, from one compiled program."""
    return modulation.at(theta), modulation.amplitude, modulation.scaled(0.0).at(theta).w


def _missed_by_slope(values: Float, slopes: Float) -> float:
    """Largest share of the variation that the integral of the slope misses, by Simpson's rule."""
    step = 2 * np.pi / len(values)
    ahead = [np.roll(slopes, -k, axis=0) for k in range(3)]
    integral = step / 3 * (ahead[0] + 4 * ahead[1] + ahead[2])
    change = np.roll(values, -2, axis=0) - values
    variation = np.abs(change).sum(0)
    missed = np.abs(change - integral).sum(0)
    return float(np.max(missed / np.maximum(variation, 1e-6), initial=0.0))
