"""Likelihood of a recording as a compiled program evaluates it.

The motion is differentiated forwards, as in a fit: the likelihood hands its gradient to the
sampler, which would differentiate it backwards. Noise and lines are those of the estimate, and
linear nuisances are integrated out under flat priors.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.inference.posterior.gauge import GaugeArrays, gauge_arrays
from asperity.inference.runs.gain import GAIN
from asperity.inference.runs.motion import Drive, through
from asperity.inference.runs.term import RunTerm


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
    taps : array, shape (order + 1, n)
        Whitening: w_t = sum_k taps[k, t] x_(t-k).
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
    taps: Any
    basis: Any

    def as_recorded(self, friction: Array) -> Array:
        """Recorded samples of friction at the times, filled up; linear in it."""
        shown = friction[self.taken] if self.gauge is None else self.gauge.recorded(friction)
        return jnp.append(shown, jnp.zeros(self.recorded.size - shown.size))


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

        def both(x: Array) -> tuple[Array, Array]:
            moving = {inner: x[i] for i, (_, inner) in enumerate(self.own)}
            gain = moving.pop(GAIN, 1.0)
            friction, slopes, _, done = through(
                motion,
                moving,
                {**data.fixed, **moving},
                data.drive,
                data.times,
                room=self.room,
                means=self.means,
            )
            shown, back_to_motion = jax.vjp(data.as_recorded, gain * friction)
            white = _whitened(data.taps, shown - data.recorded)
            white = white - data.basis @ (data.basis.T @ white)
            value = jnp.where(done, -0.5 * jnp.sum(white**2), jnp.nan)
            (back,) = back_to_motion(_transposed(data.taps, white))
            slopes = {inner: gain * slope for inner, slope in slopes.items()} | {GAIN: friction}
            return value, -jnp.stack([slopes[inner] @ back for _, inner in self.own])

        @jax.custom_vjp
        def likelihood(x: Array) -> Array:
            return both(x)[0]

        likelihood.defvjp(both, lambda gradient, change: (change * gradient,))
        return likelihood(jnp.stack([values[name] for name, _ in self.own]))


def _whitened(taps: Array, x: Array) -> Array:
    # Written out: one loop over the samples, where a scan would pass over them for every tap.
    lags, n = taps.shape
    before = jnp.append(jnp.zeros(lags - 1), x)
    parts = [taps[k] * before[lags - 1 - k : lags - 1 - k + n] for k in range(lags)]
    return functools.reduce(jnp.add, parts)


def _transposed(taps: Array, x: Array) -> Array:
    lags, n = taps.shape
    after = jnp.pad(taps * x, ((0, 0), (0, lags - 1)))
    return functools.reduce(jnp.add, [after[k, k : k + n] for k in range(lags)])


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
    taps = np.zeros((max(m.order for m in term.models) + 1, size))
    for model, (a, b) in zip(term.models, term.run.stretches, strict=True):
        taps[: model.order + 1, a:b] = model.taps(b - a).T
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
        taps,
        np.pad(term.basis, (more, (0, 0))),
    )
