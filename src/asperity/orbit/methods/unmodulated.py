"""Without modulation: the orbit is steady sliding, and its multipliers are those of the Jacobian.

Under slow modulation no mesh resolves the multipliers of a stiff slider, whose exponents are larger
than thousands; here they are 2 pi times the eigenvalues of the constant Jacobian.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import value_and_jacobian
from asperity.loads import Excitation
from asperity.orbit.batches import chunk_of, points_of, put, run_chunks
from asperity.orbit.observables import Observables
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.orbit.steady_sliding import unmodulated
from asperity.slider.problem import Problem

#: Points in a call.
_CHUNK = 4096
#: Largest distance of the law's steady state from that of the equations: a user's law may compute
#: it by iteration.
_STEADY = 1e-9


class Unmodulated(Method):
    """Steady sliding where the load, the shear force and the pulling velocity are constant."""

    name = "steady sliding"
    choice = "fourier"
    block = 2**20

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; only points without modulation are tried."""
        solution = Solution.unsolved(problem, options)
        rows = np.flatnonzero(unmodulated(problem.load, points_of(problem.system)))
        for part, found in run_chunks(_steady, (problem,), rows, chunk_of(rows, _CHUNK)):
            Y, rates, jacobian, force, log_slip, margin = found
            with np.errstate(all="ignore"):
                correction = np.linalg.solve(np.moveaxis(jacobian, -1, 0), rates.T[..., None])
            steady = np.flatnonzero(np.abs(correction[..., 0]).max(1) < _STEADY)
            at, size, points = part[steady], len(Y), len(steady)
            exponent, none = 2 * np.pi * jacobian[..., steady], np.zeros(points)
            observables = Observables(
                force[steady],
                np.zeros((options.harmonics, points), complex),
                np.full((size, size, points), np.nan),
                none,
                np.trace(exponent),
                exponent,
                none + np.inf,
                Y[:, steady],
                margin[steady],
            )
            solution.store(at, observables)
            waves = np.stack([force[steady], log_slip[steady]])
            solution.waveform[..., at] = waves[:, None]
            if options.intervals:
                even = np.linspace(0, 2 * np.pi, options.intervals + 1)
                orbit = solution.orbit
                put((orbit.mesh, orbit.centre), at, (even[:, None], Y[:, steady]))
            options.progress(points)
        return solution


@jit_large
def _steady(problem: Problem) -> tuple[Array, ...]:
    """States of steady sliding, rates, Jacobian, F/W0, ln(v_pl/V) and reversal margin."""
    system = problem.system
    Y = system.steady()
    at = Excitation(jnp.ones(Y.shape[1:]))
    rates, jacobian = value_and_jacobian(lambda Y: system.rates(Y, at), Y)
    values = system.force(Y, at), system.log_slip(Y, at), system.reversal_margin(Y, at)
    return Y, rates, jacobian, *(a * jnp.ones(Y.shape[1:]) for a in values)
