"""Friction of a motion as recorded, with derivatives, and the likelihood of a recording.

The states are continuous from one piece of the drive to the next: velocity steps, holds, ramps and
load changes follow each other as in the experiment. The continuous extension of the integrator
gives the friction between its steps. A fit uses the friction and its forward derivatives; a sampler
uses the logarithm of the likelihood and its gradient.
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

from asperity._jax import jit_large
from asperity.arrays import Float
from asperity.inference.runs.drive import Drive, excitation, filled_up, shifted
from asperity.inference.runs.gauge import GAIN, GaugeReading
from asperity.inference.runs.integration import (
    Curve,
    Free,
    arranged,
    integrated,
    with_values,
)
from asperity.inference.runs.noise import innovations
from asperity.laws import Law
from asperity.parameters import law_parameters
from asperity.recording.defects.autoregression import Whitening
from asperity.slider.motion import Motion
from asperity.slider.parameters import slider_from
from asperity.slider.problem import equation_of_motion

#: Smallest number of steps of a program, and of its steps for each piece of the drive: after a
#: change of the load, some 8 follow the evolution of friction.
_STEPS, _STEPS_EACH = 2048, 16
#: Room that is used if no start can be computed with less. A motion with more steps is taken for
#: stick-slip, which a fit of sliding cannot follow.
MOST_STEPS = 32768
#: Larger derivatives belong to a motion that runs away; their squares would overflow.
_STEEPEST = 1e100
#: Gauss-Legendre on (0, 1): exact for the continuous extension, which is of degree 4.
_GAUSS = np.stack(np.polynomial.legendre.leggauss(3), axis=1) / 2 + [0.5, 0.0]


def run_equations(
    law: type[Law],
    velocity: float,
    fixed: Mapping[str, float] | None = None,
    *,
    inertia: bool = False,
    radiation_damping: bool = False,
) -> Motion:
    """Equation of motion of a recording, without numbers: `recorded_friction` sets them.

    Parameters
    ----------
    law : type of Law
    velocity : float
        Pulling velocity of the first piece (m/s), positive.
    fixed : mapping of str to float, optional
        Fixed parameters: with lambda fixed to 0 the asperities are not elastic.
    inertia, radiation_damping : bool
        Whether mass and damping count in the equation of motion.

    Raises
    ------
    InputError
        If a mass or damping that counts is fixed to 0.
    """
    # Arrays, because plain numbers would be constants of the compiled program.
    names = (*law_parameters(law), "M", "eta")
    numbers = {n: jnp.asarray((fixed or {}).get(n, 1.0), float) for n in names}
    slider = slider_from(law, numbers | {"K": 1.0, "W0": 1.0})
    V, eta = jnp.asarray(float(velocity)), numbers["eta"] if radiation_damping else None
    return equation_of_motion(slider, V, 1.0, inertia=inertia, eta=eta)


def room_for(drive: Drive) -> int:
    """Number of steps of the integrator for which a sliding motion has room."""
    return max(_STEPS, _STEPS_EACH * len(filled_up(drive).pull))


def recorded_friction(
    motion: Motion,
    values: Mapping[str, float],
    free: tuple[str, ...],
    drive: Drive,
    reading: GaugeReading,
    room: int | None = None,
) -> tuple[Float, Float] | None:
    """Friction at the samples of a run; None if the motion runs away or cannot be computed.

    Parameters
    ----------
    motion : Motion
        As `run_equations` returns it.
    values : mapping of str to float
        Parameters of the law, K, W0, M, eta, eps_ratio; `gain` of the gauge; `start_force` and
        `start_state_i`, departures of the initial states from steady sliding (0 where not given);
        `shift_j`, delay of the j-th edge of the drive (s).
    free : tuple of str
        Names in `values` for derivatives.
    drive : Drive
    reading : GaugeReading
    room : int, optional
        Largest number of steps of the integrator, that of `room_for` by default.

    Returns
    -------
    friction : array, shape (n,)
        Spring force over the instantaneous applied load, F/W.
    derivatives : array, shape (n, parameters)
    """
    given: dict[str, Any] = {name: np.float64(value) for name, value in values.items()}
    drive = filled_up(drive)
    arrays, wanted = arranged(given, free, motion.size, len(drive.edges))
    room = room or room_for(drive)
    curve, by_curve, steps, done = _integrated(motion, wanted, arrays, drive, room)
    friction, slopes = _read(
        motion, wanted, arrays, drive, reading.filled_up(), curve, by_curve, steps
    )
    n = len(reading.index)
    f, jacobian = np.asarray(friction)[:n], np.asarray(slopes).T[:n, : len(free)]
    # NaN and infinity also fail this comparison.
    good = bool(done) and np.isfinite(f).all() and (np.abs(jacobian) < _STEEPEST).all()
    return (f, jacobian) if good else None


#: Compiled apart from the reading: recordings of any number of samples share the program of a law,
#: which takes most of the time to compile.
_integrated = jit_large(integrated, static_argnames=("room",))


@jit_large
def _read(
    motion: Motion,
    free: Free,
    given: dict[str, Any],
    drive: Drive,
    reading: GaugeReading,
    curve: Curve,
    slopes: Curve,
    steps: Array,
) -> tuple[Array, Array]:
    """Friction as recorded, and its derivatives, from the motion and its derivatives."""
    x = free.numbers(given)

    def friction(curve: Curve, x: Array) -> Array:
        return ComputedRun.of(motion, drive, free.values(given, x), curve, steps).recorded(reading)

    f = friction(curve, x)
    if not len(free.directions):
        return f, jnp.zeros((0, f.size))

    def along(change: Curve, direction: Array) -> Array:
        return jax.jvp(friction, (curve, x), (change, direction))[1]

    return f, jax.vmap(along)(slopes, free.directions)


class ComputedRun(NamedTuple):
    """A computed motion through a recording, from which friction is read at any time.

    Attributes
    ----------
    motion : Motion
    drive : Drive
        With its edges delayed.
    values : mapping of str to array
    curve : Curve
    steps : array
        Number of the integrator's steps.
    """

    motion: Motion
    drive: Drive
    values: Mapping[str, Array]
    curve: Curve
    steps: Array

    @classmethod
    def of(
        cls, motion: Motion, drive: Drive, values: Mapping[str, Array], curve: Curve, steps: Array
    ) -> ComputedRun:
        """With the numbers of motion and drive in `values`."""
        return cls(with_values(motion, values), shifted(drive, values), values, curve, steps)

    def recorded(self, reading: GaugeReading) -> Array:
        """F/W as the gauge records it."""
        times = reading.times
        if reading.means:
            friction = self._averaged(times)
        else:
            i = self._step_of(times)
            share = (times - self.curve.begin[i]) / self.curve.length[i]
            friction = self._friction(i, share, times)
        return self.values[GAIN] * reading.recorded(friction)

    def _averaged(self, edges: Array) -> Array:
        """Mean F/W between neighbouring edges; 0 between equal edges."""
        length = self.curve.length
        numbers = jnp.arange(length.size)
        taken = numbers < self.steps
        begin = jnp.where(taken, self.curve.begin, 0.0)
        # Means are differences of an integral; integrating small numbers keeps more digits.
        level = jax.lax.stop_gradient(self._friction(numbers[:1], jnp.zeros(1), begin[:1]))

        def integral(step: Array, share: Array) -> Array:
            """Integral of F/W from the beginning of a step to a share of its length."""
            total = jnp.zeros(share.shape)
            for node, weight in _GAUSS:
                at = begin[step] + node * share * length[step]
                total = total + weight * (self._friction(step, node * share, at) - level)
            return total * share * length[step]

        whole = jnp.where(taken, integral(numbers, jnp.ones(numbers.size)), 0.0)
        before = jnp.cumsum(whole) - whole
        i = self._step_of(edges)
        rise = jnp.diff(before[i] + integral(i, (edges - begin[i]) / length[i]))
        apart = jnp.diff(edges)
        return jnp.where(apart > 0, level + rise / jnp.where(apart > 0, apart, 1.0), 0.0)

    def _step_of(self, times: Array) -> Array:
        """Index of the integrator's step that contains each time."""
        begin = jax.lax.stop_gradient(self.curve.begin)
        i = jnp.clip(jnp.searchsorted(begin, times, side="right") - 1, 0)
        return jnp.minimum(i, self.steps - 1)

    def _friction(self, step: Array, share: Array, times: Array) -> Array:
        """F/W at times, each a share of the length of a step after its beginning."""
        drive, x = self.drive, share

        def state(i: int) -> Array:
            # State by state: states without influence on the force are then not computed.
            c = [self.curve.coefficients[:, j, i][step] for j in range(5)]
            return c[0] + x * (c[1] + (1 - x) * (c[2] + x * (c[3] + x * c[4])))

        y = [state(i) for i in range(self.curve.coefficients.shape[2])]
        piece = jnp.searchsorted(jax.lax.stop_gradient(drive.edges), times, side="right") - 1
        piece = jnp.clip(piece, 0, drive.pull.shape[0] - 1)
        at = excitation(drive, self.values, piece, times)
        load = drive.load[piece] + drive.load_slope[piece] * (times - drive.edges[piece])
        return self.motion.force(jnp.stack(y), at) / load


class RunArrays(NamedTuple):
    """Numbers of a recording.

    Attributes
    ----------
    motion : Motion
        Equation of motion whose law and slider are replaced; arrays only.
    fixed : dict of str to array, shape ()
        Parameters of the motion that are not free.
    drive : Drive
    reading : GaugeReading
    recorded : array, shape (n,)
    noise : tuple of Whitening
        Noise of each stretch.
    basis : array, shape (n, columns)
        Whitened linear nuisances, orthonormal.
    """

    motion: Any
    fixed: dict[str, Any]
    drive: Drive
    reading: GaugeReading
    recorded: Any
    noise: tuple[Whitening, ...]
    basis: Any


@dataclass(frozen=True)
class RunResiduals:
    """Innovations of a recording within compiled programs, under the noise of the estimate.

    The motion is differentiated forwards, as by `recorded_friction`, and the samples, of which
    there are far more than steps, backwards.

    Attributes
    ----------
    equation : Motion
        The equation of motion without its numbers.
    inner : tuple of (str, str)
        Free parameters of this recording, and their names in the motion.
    stretches : tuple of (int, int)
        First sample and the one after the last of each stretch of noise.
    room : int
        Largest number of steps of the integrator.
    """

    equation: Any
    inner: tuple[tuple[str, str], ...]
    stretches: tuple[tuple[int, int], ...]
    room: int

    def __call__(self, values: Mapping[str, Array], data: RunArrays) -> Array:
        """Residuals for parameters by name, shape (n,); NaN if the motion cannot be computed."""
        motion = eqx.combine(data.motion, self.equation)
        names = tuple(inner for _, inner in self.inner)

        def forward(x: Array) -> tuple[Array, Any]:
            numbers = {**data.fixed, **dict(zip(names, x, strict=True))}
            given, free = arranged(numbers, names, motion.size, len(data.drive.edges), jnp)
            curve, slopes, steps, done = integrated(motion, free, given, data.drive, self.room)

            def white(curve: Curve, x: Array) -> Array:
                values = free.values(given, x)
                run = ComputedRun.of(motion, data.drive, values, curve, steps)
                departures = run.recorded(data.reading) - data.recorded
                return innovations(departures, data.noise, self.stretches, data.basis, jnp)

            result, back = jax.vjp(white, curve, free.numbers(given))
            return jnp.where(done, result, jnp.nan), (back, slopes, free.directions)

        def backward(saved: Any, change: Array) -> tuple[Array]:
            back, slopes, directions = saved
            by_curve, direct = back(change)
            gradient = directions @ direct
            for weight, slope in zip(by_curve, slopes, strict=True):
                gradient += jnp.sum(weight * slope, axis=tuple(range(1, slope.ndim)))
            return (gradient[: len(names)],)

        residuals = jax.custom_vjp(lambda x: forward(x)[0])
        residuals.defvjp(forward, backward)
        return residuals(jnp.stack([values[name] for name, _ in self.inner]))
