"""Likelihood of a recording as a compiled program evaluates it.

The motion is differentiated forwards, as in a fit: the likelihood hands its gradient to the
sampler, which would differentiate it backwards. Noise and lines are those of the estimate, and
linear nuisances are integrated out under flat priors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.inference.runs.drive import Drive
from asperity.inference.runs.motion import density_through
from asperity.inference.runs.noise import Whitening
from asperity.inference.runs.reading import Reading


class RunArrays(NamedTuple):
    """Numbers of a recording.

    Attributes
    ----------
    motion : Motion
        Equation of motion whose law and slider are replaced; arrays only.
    fixed : dict of str to array, shape ()
        Parameters of the motion that are not free.
    drive : Drive
    reading : Reading
    recorded : array, shape (n,)
    noise : tuple of Whitening
        Of each stretch.
    basis : array, shape (n, columns)
        Whitened linear nuisances, orthonormal.
    """

    motion: Any
    fixed: dict[str, Any]
    drive: Drive
    reading: Reading
    recorded: Any
    noise: tuple[Whitening, ...]
    basis: Any


@dataclass(frozen=True)
class RunLikelihood:
    """Log likelihood of a recording under the noise of the estimate, but for a constant.

    Attributes
    ----------
    equation : Motion
        What of the equation of motion is no number.
    inner : tuple of (str, str)
        Free parameters that this recording depends on, and their names in the motion.
    stretches : tuple of (int, int)
        First sample and the one after the last of each stretch of noise.
    room : int
        Steps of the integrator at most.
    """

    equation: Any
    inner: tuple[tuple[str, str], ...]
    stretches: tuple[tuple[int, int], ...]
    room: int

    def __call__(self, values: Mapping[str, Array], data: RunArrays) -> Array:
        """Log likelihood of parameters by name; NaN where the motion cannot be computed."""
        motion = eqx.combine(data.motion, self.equation)
        names = tuple(inner for _, inner in self.inner)

        def density(friction: Array) -> Array:
            departures = friction - data.recorded
            white = innovations(departures, data.noise, self.stretches, data.basis, jnp)
            return -0.5 * jnp.sum(white**2)

        def both(x: Array) -> tuple[Array, Array]:
            given = {**data.fixed, **dict(zip(names, x, strict=True))}
            return density_through(
                density, motion, names, given, data.drive, data.reading, room=self.room
            )

        @jax.custom_vjp
        def likelihood(x: Array) -> Array:
            return both(x)[0]

        likelihood.defvjp(both, lambda gradient, change: (change * gradient,))
        return likelihood(jnp.stack([values[name] for name, _ in self.inner]))


def innovations(
    columns: Any,
    noise: Sequence[Whitening],
    stretches: Sequence[tuple[int, int]],
    basis: Any = None,
    module: Any = np,
) -> Any:
    """Innovations of unit variance, without what linear nuisances take of them.

    Parameters
    ----------
    columns : array, shape (n,) or (n, columns)
        Computed less recorded friction, and its derivatives; of NumPy or of JAX.
    noise : sequence of Whitening
        Of each stretch.
    stretches : sequence of (int, int)
    basis : array, shape (n, nuisances), optional
        Whitened linear nuisances, orthonormal.
    module : module
        numpy, or jax.numpy within compiled programs.
    """
    parts = [w.of(columns[a:b], module) for w, (a, b) in zip(noise, stretches, strict=True)]
    white = module.concatenate(parts)
    return white if basis is None else white - basis @ (basis.T @ white)
