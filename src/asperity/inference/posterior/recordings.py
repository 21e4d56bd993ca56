"""Likelihood of a recording as a compiled program evaluates it.

The motion is differentiated forwards, as in a fit: the likelihood hands its gradient to the
sampler, which would differentiate it backwards. Noise and lines are those of the estimate, and
linear nuisances are integrated out under flat priors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.inference.posterior.gauge import GaugeArrays, gauge_arrays
from asperity.inference.runs.drive import Drive
from asperity.inference.runs.gain import GAIN
from asperity.inference.runs.motion import density_through
from asperity.inference.runs.term import RunTerm

Float = NDArray[np.float64]

#: Samples with weights of their own are filled up to a multiple of this.
_ROUNDED = 64


class RunArrays(NamedTuple):
    """Numbers of a recording; samples that fill up have taps of 0.

    A sample is a mean over a block where `RunLikelihood.means` says so.

    Attributes
    ----------
    motion : Motion
        Equation of motion whose law and slider are replaced; arrays only.
    fixed : dict of str to array, shape ()
        Parameters of the motion that are not free.
    drive : Drive
    times : array, shape (m,)
        Of the samples, or edges of blocks.
    taken : array of int, shape (n,)
        Which of the times, or of the blocks between them, each sample is; without a gauge.
    gauge : GaugeArrays or None
        Through which the motion at the times is recorded.
    recorded : array, shape (n,)
    weights : array, shape (order + 1,)
        Whitening by the noise of the longest stretch: w_t = sum_k weights[k] x_(t-k).
    others : array of int, shape (m,)
        Samples that have weights of their own: the first of each stretch, and all of the others;
        n where they fill up.
    own_weights : array, shape (m, order + 1)
    basis : array, shape (n, columns)
        Whitened linear nuisances, orthonormal.
    """

    motion: Any
    fixed: dict[str, Any]
    drive: Drive
    times: Any
    taken: Any
    gauge: GaugeArrays | None
    recorded: Any
    weights: Any
    others: Any
    own_weights: Any
    basis: Any

    def as_recorded(self, friction: Array) -> Array:
        """Recorded samples of friction at the times, filled up; linear in it."""
        shown = friction[self.taken] if self.gauge is None else self.gauge.recorded(friction)
        return jnp.append(shown, jnp.zeros(self.recorded.size - shown.size))

    def whitened(self, x: Array) -> Array:
        """Innovations of the noise, of unit variance; linear in x."""
        lags = self.weights.size
        before = jnp.append(jnp.zeros(lags - 1), x)
        # By a library's loop over the samples: a sum of shifted copies takes five times as long.
        white = jnp.convolve(before, self.weights, mode="valid")
        reach = self.others[:, None] + jnp.arange(lags)[::-1]
        own = jnp.sum(self.own_weights * before.at[reach].get(mode="fill", fill_value=0.0), axis=1)
        return white.at[self.others].set(own, mode="drop")


@dataclass(frozen=True)
class RunLikelihood:
    """Log likelihood of a recording under the noise of the estimate, but for a constant.

    Attributes
    ----------
    equation : Motion
        What of the equation of motion is no number.
    own : tuple of (str, str)
        Free parameters that this recording depends on, and their names in the motion.
    room : int
        Steps of the integrator at most.
    means : bool
        Whether the motion is averaged over blocks.
    """

    equation: Any
    own: tuple[tuple[str, str], ...]
    room: int
    means: bool

    def __call__(self, values: Mapping[str, Array], data: RunArrays) -> Array:
        """Log likelihood of parameters by name; NaN where the motion cannot be computed."""
        motion = eqx.combine(data.motion, self.equation)

        names = tuple(inner for _, inner in self.own)

        def density(friction: Array, values: Mapping[str, Array]) -> Array:
            shown = data.as_recorded(values.get(GAIN, 1.0) * friction)
            white = data.whitened(shown - data.recorded)
            white = white - data.basis @ (data.basis.T @ white)
            return -0.5 * jnp.sum(white**2)

        def both(x: Array) -> tuple[Array, Array]:
            return density_through(
                density,
                motion,
                names,
                {**data.fixed, **dict(zip(names, x, strict=True))},
                data.drive,
                data.times,
                room=self.room,
                means=self.means,
            )

        @jax.custom_vjp
        def likelihood(x: Array) -> Array:
            return both(x)[0]

        likelihood.defvjp(both, lambda gradient, change: (change * gradient,))
        return likelihood(jnp.stack([values[name] for name, _ in self.own]))


def likelihood_of_run(term: RunTerm, names: tuple[str, ...]) -> tuple[RunLikelihood, RunArrays]:
    """The likelihood of a recording, and its arrays."""
    own = tuple((n, inner) for n in names if (inner := term.inner(n)) is not None)
    fixed = {n: np.float64(v) for n, v in {**term.fixed, "W0": term.run.W0}.items()}
    at, rate = (term.run.at, 0.0) if term.gauge is None else term.filter_times()
    # Any numbers serve for the template: those of the parameters take their place.
    motion, drive, times, taken = term.motion.prepared(
        {**fixed, **{inner: np.float64(1.0) for _, inner in own if inner not in {*fixed, GAIN}}},
        term.run.drive,
        at,
    )
    n = term.run.time.size
    size = 1024 * int(np.ceil(n / 1024))
    arrays, equation = eqx.partition(motion, eqx.is_array_like)
    more = (0, size - n)
    gauge = None
    if term.gauge is not None:
        gauge = gauge_arrays(term.gauge, rate, at.size, term.run.at, times.size)
    means = term.run.blocks is not None and gauge is None
    return RunLikelihood(equation, own, term.motion.room, means), RunArrays(
        jax.tree.map(np.asarray, arrays),
        fixed,
        drive,
        times,
        taken,
        gauge,
        np.pad(term.run.friction, more),
        *_weights(term, size),
        np.pad(term.basis, (more, (0, 0))),
    )


def _weights(term: RunTerm, size: int) -> tuple[Float, NDArray[np.intp], Float]:
    """Weights of the whitening of `size` samples, as of `RunArrays`; 0 after the last."""
    n, lags = term.run.time.size, max(m.order for m in term.models) + 1
    stretches = list(zip(term.models, term.run.stretches, strict=True))
    longest, _ = max(stretches, key=lambda pair: pair[1][1] - pair[1][0])
    weights = np.zeros(lags)
    weights[: longest.order + 1] = longest.taps(lags)[-1]
    others, own = [np.arange(n, size)], [np.zeros((size - n, lags))]
    for model, (a, b) in stretches:
        taps = np.zeros((b - a, lags))
        taps[:, : model.order + 1] = model.taps(b - a)
        different = np.flatnonzero((taps != weights).any(axis=1))
        others.append(a + different)
        own.append(taps[different])
    found, rows = np.concatenate(others), np.concatenate(own)
    more = (0, -found.size % _ROUNDED)
    return weights, np.pad(found, more, constant_values=size), np.pad(rows, (more, (0, 0)))
