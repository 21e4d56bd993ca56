"""The collocation equations of an orbit on a given mesh, for the implicit-function rule.

The linear system is condensed interval by interval to transfer maps as in Newton's method. Matrices
are factorised once; right-hand sides, of which there is one for each direction, only multiply.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.algebra.cyclic import CyclicFactors, factorise_cyclic, solve_factorised
from asperity.orbit.mesh.condensation import condense, transfer_maps
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.scheme import STAGES
from asperity.slider.pointwise import PointValues, point_values
from asperity.slider.problem import Problem


def unknowns_of(orbit: Orbit) -> Array:
    """The unknowns: states at the mesh points less the centre, before the slopes.

    Returns
    -------
    array, shape (n, 1 + STAGES, intervals, points)
        One array, since JAX transposes a linear solve only if every part of its right-hand side
        depends on what is transposed.
    """
    return jnp.concatenate([orbit.nodes[:, None], orbit.slopes], axis=1)


def values_on(problem: Problem, orbit: Orbit) -> PointValues:
    """The equation of motion at the collocation points, within a program."""
    system, load = problem
    centre = orbit.centre[:, None, None]
    return point_values(system, load.at(orbit.stage_phases), centre, orbit.stage_deviations)


def condensed_jacobian(jacobian: Array, right: Array, orbit: Orbit) -> tuple[Array, Array]:
    """`condense` of arrays (..., intervals, points) on the mesh of an orbit, within a program."""

    def flat(a: Array) -> Array:
        return a.reshape(*a.shape[:-2], -1)

    solved = condense(flat(jacobian), flat(right), flat(orbit.widths), orbit.scheme.a)
    response, constant = (a.reshape(*a.shape[:-1], *orbit.widths.shape) for a in solved)
    return response, constant


class _CondensedEquations(NamedTuple):
    widths: Array
    weights: Array  # (STAGES,): of the slopes in the rise over an interval
    response: Array  # (n, STAGES, n, intervals, points): slopes for a change at the left node
    inverse: Array  # (n, STAGES, STAGES * n, intervals, points): slopes for a change of the rates
    factors: CyclicFactors


@dataclass(frozen=True)
class CollocationEquations:
    """Collocation on the mesh of a found orbit; the parameters are (problem, found orbit)."""

    def orbit(self, parameters: tuple[Problem, Orbit], unknowns: Array) -> Orbit:
        """The orbit that the unknowns describe."""
        found = jax.lax.stop_gradient(parameters[1])
        return found.moved(nodes=unknowns[:, 0], slopes=unknowns[:, 1:])

    def prepare(self, parameters: tuple[Problem, Orbit], unknowns: Array) -> _CondensedEquations:
        """Condensed equations."""
        problem, orbit = parameters[0], self.orbit(parameters, unknowns)
        values = values_on(problem, orbit)
        n = values.rates.shape[0]
        unit = jnp.eye(n * STAGES).reshape(n, STAGES, n * STAGES, 1, 1)
        unit = jnp.broadcast_to(unit, (*unit.shape[:3], *orbit.widths.shape))
        response, inverse = condensed_jacobian(values.jacobian, unit, orbit)
        return _CondensedEquations(
            orbit.widths,
            jnp.asarray(orbit.scheme.b),
            response,
            inverse,
            factorise_cyclic(transfer_maps(response, orbit.widths, orbit.scheme.b)),
        )

    def residual(
        self, parameters: tuple[Problem, Orbit], unknowns: Array, at: _CondensedEquations
    ) -> Array:
        """Gaps at the ends of the intervals, and slopes less rates."""
        (system, load), orbit = parameters[0], self.orbit(parameters, unknowns)
        states = orbit.centre[:, None, None] + orbit.stage_deviations
        rates = system.rates(states, load.at(orbit.stage_phases))
        rise = orbit.widths * jnp.einsum("k,nkmb->nmb", orbit.scheme.b, orbit.slopes)
        gap = jnp.roll(orbit.nodes, -1, axis=1) - orbit.nodes - rise
        return jnp.concatenate([gap[:, None], orbit.slopes - rates], axis=1)

    def solve(self, product: Callable[[Any], Any], right: Array, at: _CondensedEquations) -> Array:
        """Nodes from the condensed equations, slopes from the nodes."""
        constant = jnp.einsum(
            "nkcmb,cmb->nkmb", at.inverse, right[:, 1:].reshape(-1, *at.widths.shape)
        )
        rise = at.widths * jnp.einsum("k,nkmb->nmb", at.weights, constant)
        nodes = solve_factorised(at.factors, right[:, 0] + rise)
        slopes = jnp.einsum("nkcmb,cmb->nkmb", at.response, nodes) + constant
        return jnp.concatenate([nodes[:, None], slopes], axis=1)

    def solve_transposed(
        self, product: Callable[[Any], Any], right: Array, at: _CondensedEquations
    ) -> Array:
        """The transpose of `solve`, which is linear in the right-hand side."""
        (transposed,) = jax.linear_transpose(lambda b: self.solve(product, b, at), right)(right)
        return transposed
