"""The fast method with inertia and radiation damping: Fourier collocation of slow states.

The elongation z = f + l F_i/W of spring and joint and the states of the law change little within a
period, as without inertia. The friction g = F_i/W changes much; the balance of forces gives it on
the whole grid at once. With slip u = v_pl/V, slider velocity v = u + g'/s and mobility m,

    g''/(m s) + (d/s) g' + (w + l) g + d u + u'/m = z + S,      dz/dtheta = kappa (p - u),

where 1/m = 0 without inertia, d = 0 without damping and 1/s = 0 on rigid asperities, and a prime is
d/dtheta. A step of the iteration solves the balance for g by Newton's method, a dense system over
the grid, and advances z and the states of the law as `asperity.orbit.methods.fourier` does.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.algebra.fourier_grid import grid, interpolation
from asperity.algebra.small_systems import (
    Matrix,
    apply,
    averaged,
    inverse_by_elimination,
    inverse_points,
)
from asperity.loads import Excitation, Harmonic
from asperity.orbit.methods.fourier import (
    GridEquations,
    LoadCycle,
    States,
    advance,
    iterated,
    spectrum,
    together,
    truncation,
)
from asperity.slider import Inertial, QuasiStatic, StiffInertial
from asperity.slider.problem import Problem
from asperity.theory.limits import averaged_limit

#: Largest change of the slip exponent in a step.
_LARGEST_CHANGE = 2.0
#: Change of an exponent below which the matrix of the balance is kept.
_NEAR = 3e-2
#: Round-off of the slip exponent; changes do not fall below this value.
_ROUND_OFF = 1e-11
#: Nodes of the grid on which the iteration begins, and its tolerance there.
FIRST_NODES, _COARSE_TOLERANCE = 32, 1e-5
#: Tolerance on the error, small because harmonics may be much smaller than the states; and the
#: largest number of steps on a grid.
_TOLERANCE, _MOST_STEPS = 1e-11, 40
#: Number of steps for a linear system beyond that of the orbit.
_MORE_STEPS = 3
#: Tolerance on the averaged limit from which the iteration starts.
_AVERAGED_TOLERANCE = 1e-2


class BalanceUnknowns(NamedTuple):
    """An orbit: slow states as means (points,) and zero-mean parts, and F_i/W, (nodes, points)."""

    mean: States
    zero_mean: States
    friction: Array


Parameters: TypeAlias = tuple[Problem, "Prepared", Array]


class _Coefficients(NamedTuple):
    """Coefficients of the balance, each (points,)."""

    inertness: Array  # 1/m
    damping: Array  # d
    elastic: Array  # 1/s
    ratio: Array  # l


class Prepared(NamedTuple):
    """Data of an iteration step, computed at an orbit or near it.

    Attributes
    ----------
    inverse : array, shape (nodes, nodes, points)
        Inverse of the derivative of the balance by the friction.
    friction : tuple of arrays, shape (nodes, points)
        Change of the friction with the mean of each slow state.
    rates : matrix of arrays, shape (nodes, points)
        Change of the rates of the slow states with their means.
    mean_inverse : matrix of arrays, shape (points,)
        Inverse of the mean of `rates`.
    """

    inverse: Array
    friction: States
    rates: Matrix
    mean_inverse: Matrix


class BalanceEquations(GridEquations):
    """The equations of an orbit on a grid, for the solver and for the implicit-function rule.

    The parameters are the problem, the linearisation that the last step of the solver used, and
    the number of steps that linear systems take.
    """

    def prepare(self, parameters: Parameters, unknowns: BalanceUnknowns) -> tuple[Prepared, Array]:
        """Prepared arrays of the solver, and its steps."""
        return parameters[1], parameters[2] + _MORE_STEPS

    def linearised(self, problem: Problem, unknowns: BalanceUnknowns) -> Prepared:
        """Inverse of the balance, and the response to changes of the means."""
        cycle = self.cycle(problem)
        slow, g = together(unknowns.mean, unknowns.zero_mean), unknowns.friction
        D, c = self.derivative, _coefficients(problem)
        n, ones, none = range(len(slow)), jnp.ones_like(g), jnp.zeros_like(g)
        _, push = jax.linearize(lambda *Y: _slip(problem, cycle.at, Y[0], Y[1:]), g, *slow[1:])
        # Derivatives of the slip by the friction and by each state of the law.
        softening, *by_state = (push(*(ones if i == j else none for i in n)) for j in n)
        matrix = (D @ D)[..., None] * (c.inertness * c.elastic) + D[..., None] * (
            c.damping * c.elastic + c.inertness * softening[None]
        )
        diagonal = (cycle.at.w + c.ratio) + c.damping * softening
        inverse = inverse_by_elimination(matrix + np.eye(self.nodes)[..., None] * diagonal[:, None])
        drags = (-c.damping * slip - c.inertness * (D @ slip) for slip in by_state)
        friction = tuple(_times(inverse, pull) for pull in (ones, *drags))
        _, push_rates = jax.linearize(lambda *Y: self._rates(problem, cycle, Y[1:], Y[0]), g, *slow)
        columns = [push_rates(friction[j], *(ones if i == j else none for i in n)) for j in n]
        rates = [[columns[j][i] for j in n] for i in n]
        return Prepared(inverse, friction, rates, inverse_points(averaged(rates, cycle.share)))

    def _advance(
        self,
        problem: Problem,
        cycle: LoadCycle,
        unknowns: BalanceUnknowns,
        at: Prepared,
        moved: Array,
        largest: float = jnp.inf,
    ) -> tuple[BalanceUnknowns, States]:
        """The next unknowns for a change of the friction, and the change of the means."""
        slow, g = together(unknowns.mean, unknowns.zero_mean), unknowns.friction + moved
        rates = self._rates(problem, cycle, slow, g)
        mean, zero_mean, change = advance(
            cycle, at.mean_inverse, unknowns.mean, rates, lambda *c: apply(at.rates, c), largest
        )
        (with_means,) = apply([list(at.friction)], change)
        return BalanceUnknowns(mean, zero_mean, g + with_means), change

    def bounded_step(
        self, problem: Problem, cycle: LoadCycle, unknowns: BalanceUnknowns, at: Prepared
    ) -> tuple[BalanceUnknowns, Array]:
        """A step that changes no exponent by much, and the largest change, shape (points,)."""
        slow, g = together(unknowns.mean, unknowns.zero_mean), unknowns.friction
        moved = _times(at.inverse, -self._balance(problem, cycle, slow, g))
        _, exponent = jax.jvp(lambda g: _log_slip(problem, cycle.at, g, slow[1:]), (g,), (moved,))
        leap = jnp.abs(exponent).max(0)
        moved = moved * jnp.minimum(1.0, _LARGEST_CHANGE / jnp.maximum(leap, 1e-300))
        new, change = self._advance(problem, cycle, unknowns, at, moved, _LARGEST_CHANGE)
        parts = zip(new.zero_mean, unknowns.zero_mean, strict=True)
        moves = [jnp.abs(a - b).max(0) for a, b in parts]
        # The change of z counts relative to z, because its rate has the round-off of kappa; the
        # other states are exponents.
        moves[0] /= jnp.abs(new.zero_mean[0]).max(0) + 1e-3 * problem.system.kappa
        return new, jnp.stack([leap, *moves, *map(jnp.abs, change)]).max(0)

    def residual(
        self, parameters: Parameters, unknowns: BalanceUnknowns, at: Prepared
    ) -> BalanceUnknowns:
        """The unknowns minus the result of one iteration step from them."""
        problem = parameters[0]
        cycle, slow = self.cycle(problem), together(unknowns.mean, unknowns.zero_mean)
        gap = self._balance(problem, cycle, slow, unknowns.friction)
        moved = _times(at.inverse, -gap)
        stepped, _ = self._advance(problem, cycle, unknowns, at, moved)
        return jax.tree.map(jnp.subtract, unknowns, stepped)

    def orbits(
        self, problem: Problem, harmonics: int
    ) -> tuple[BalanceUnknowns, Prepared, Array, Array]:
        """Iterate to the periodic orbit of every operating point, first on `FIRST_NODES` at most.

        Parameters
        ----------
        problem : Problem
            With inertia or damping, parameters of shape (points,).
        harmonics : int
            Harmonics whose truncation counts.

        Returns
        -------
        BalanceUnknowns
            Undefined where the error is not small.
        Prepared
            The linearisation that the last step used.
        error : array, shape (points,)
            Estimated; inf where the iteration does not converge.
        steps : array, shape ()
        """
        coarse = BalanceEquations(min(self.nodes, FIRST_NODES), self.grading)
        unknowns, steps = _start(coarse, problem), jnp.asarray(0)
        if self.nodes > FIRST_NODES:
            unknowns, _, _, steps = _iterate(coarse, problem, unknowns, _COARSE_TOLERANCE)
            unknowns = _resampled(unknowns, self.nodes)
        unknowns, prepared, error, more = _iterate(self, problem, unknowns, _TOLERANCE)
        slow, at = together(unknowns.mean, unknowns.zero_mean), self.cycle(problem).at
        exponent = _log_slip(problem, at, unknowns.friction, slow[1:])
        # Where the interface sticks it has kinks, which no Fourier series resolves.
        error = jnp.where(jnp.isfinite(exponent).all(0), error, jnp.inf)
        for waves in (unknowns.zero_mean[0], unknowns.friction, at.w * unknowns.friction):
            error = jnp.maximum(error, truncation(waves, harmonics))
        return unknowns, prepared, error, steps + more

    def steady(self, problem: Problem) -> BalanceUnknowns:
        """Steady sliding under the mean load."""
        law, V = problem.system.slider.law, problem.system.V
        at = self.cycle(problem).at
        mu = law.mu_ss(V) + 0 * V
        states = tuple(state + 0 * V for state in law.steady_state(V))
        none = jnp.zeros((self.nodes, *V.shape)) + 0 * at.w
        z = mu * (1 + problem.system.compliance_ratio)
        return BalanceUnknowns((z, *states), (none,) * (1 + len(states)), mu + none)

    def force_spectrum(
        self, problem: Problem, unknowns: BalanceUnknowns, harmonics: int
    ) -> tuple[Array, Array]:
        """Mean of F/W0 and its complex harmonics, shape (harmonics, points)."""
        cycle, c = self.cycle(problem), _coefficients(problem)
        g, kappa = unknowns.friction, problem.system.kappa
        centre = cycle.share @ g
        constant, zero_mean = unknowns.mean[0] - c.ratio * centre, g - centre
        mean, phasors = spectrum(
            cycle, constant, unknowns.zero_mean[0] - c.ratio * zero_mean, harmonics
        )
        # Where inertia holds the slider back, z and l g nearly cancel, and the harmonics of
        # f''/(m kappa) + (d/kappa) f' + f = w g - S + d p + p'/m keep more digits.
        waves = 1j * np.arange(1, harmonics + 1)[:, None]
        drag = c.damping + waves * c.inertness
        impedance = 1 + waves * drag / kappa
        heavy = c.ratio * jnp.abs(impedance) > 1
        none = jnp.zeros_like(g)
        _, carried = spectrum(cycle, centre, cycle.at.w * g - cycle.at.shear, harmonics)
        _, pull = spectrum(cycle, centre, none + cycle.at.pull, harmonics)
        carried = (carried + drag * pull) / jnp.where(heavy, impedance, 1.0)
        return mean, jnp.where(heavy, carried, phasors)

    @property
    def derivative(self) -> np.ndarray:
        """Matrix of d/dtheta on the grid, (nodes, nodes)."""
        return _derivative(self.nodes, self.grading)

    def _balance(self, problem: Problem, cycle: LoadCycle, slow: States, g: Array) -> Array:
        """Residual of the force balance over W0."""
        D, c, at = self.derivative, _coefficients(problem), cycle.at
        slip = _slip(problem, at, g, slow[1:])
        elastic = c.elastic * (D @ g) + slip
        return (
            c.inertness * (D @ elastic)
            + c.damping * elastic
            + (at.w + c.ratio) * g
            - (slow[0] + at.shear)
        )

    def _rates(self, problem: Problem, cycle: LoadCycle, slow: States, g: Array) -> States:
        """Rates of the slow states per radian."""
        system, at = problem.system, cycle.at
        slip = _slip(problem, at, g, slow[1:])
        v = slip + _coefficients(problem).elastic * (self.derivative @ g)
        law = system.slider.law
        rates = law.state_rate(system.V * v, system.V * slip, tuple(slow[1:]), at.w)
        none = jnp.zeros_like(slip)
        z_rate = system.kappa * (at.pull - slip)
        return (z_rate, *(none + r / system.omega for r in rates))


def _times(matrix: Array, vector: Array) -> Array:
    """Product of a matrix (nodes, nodes, points) and a vector (nodes, points)."""
    return jnp.einsum("ijp,jp->ip", matrix, vector)


def _coefficients(problem: Problem) -> _Coefficients:
    system = problem.system
    none = jnp.zeros_like(system.V)
    massive = isinstance(system, Inertial | StiffInertial)
    return _Coefficients(
        1 / system.mobility if massive else none,
        system.damping + none,
        none + system.slider.law.elastic_length * system.omega / system.V,
        none + system.compliance_ratio,
    )


def _log_slip(problem: Problem, at: Excitation, g: Array, state: States) -> Array:
    """ln(v_pl / V)."""
    system = problem.system
    return system.slider.law.log_velocity(g, tuple(state), at.w) - jnp.log(system.V)


def _slip(problem: Problem, at: Excitation, g: Array, state: States) -> Array:
    """v_pl / V."""
    return jnp.exp(_log_slip(problem, at, g, state))


@lru_cache
def _derivative(nodes: int, grading: float) -> np.ndarray:
    tau = grid(nodes)[0]
    k = np.arange(1, nodes // 2)[:, None, None]
    by_tau = (-2 / nodes) * (k * np.sin(k * (tau[:, None] - tau))).sum(0)
    return by_tau / (1 + grading * np.cos(tau))[:, None]


def _iterate(
    equations: BalanceEquations,
    problem: Problem,
    start: BalanceUnknowns,
    tolerance: float,
) -> tuple[BalanceUnknowns, Prepared, Array, Array]:
    """Unknowns, the linearisation that their last step used, estimated error, number of steps."""
    cycle = equations.cycle(problem)
    prepare = partial(equations.linearised, problem)

    def step(state: tuple[BalanceUnknowns, Prepared], last: Array) -> tuple[Any, Array]:
        unknowns, at = state
        far = jnp.any((last > _NEAR) & ~jnp.isnan(last))
        at = jax.lax.cond(far, prepare, lambda _: at, unknowns)
        new, change = equations.bounded_step(problem, cycle, unknowns, at)
        return (new, at), change

    # By hand: JAX would trace the linearisation once more for its shapes.
    (nodes, points), size = start.friction.shape, len(start.mean)
    none, row = jnp.zeros((nodes, points)), [jnp.zeros(points)] * size
    nothing = Prepared(
        jnp.zeros((nodes, nodes, points)), (none,) * size, [[none] * size] * size, [row] * size
    )
    state, error, steps = iterated(
        step, (start, nothing), points, tolerance, _ROUND_OFF, _MOST_STEPS
    )
    return *state, error, steps


def _resampled(unknowns: BalanceUnknowns, nodes: int) -> BalanceUnknowns:
    """The same trigonometric polynomials in tau at more nodes."""
    kernel = interpolation(grid(nodes)[0], grid(unknowns.friction.shape[0])[0])
    zero_mean = tuple(kernel @ part for part in unknowns.zero_mean)
    return BalanceUnknowns(unknowns.mean, zero_mean, kernel @ unknowns.friction)


def _start(equations: BalanceEquations, problem: Problem) -> BalanceUnknowns:
    """The averaged limit of a slider that swings on its asperities without slip."""
    system = problem.system
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    cycle = equations.cycle(problem)
    swing, _ = sticking_joint(problem, cycle.at, cycle.theta[:, None])
    at = cycle.at._replace(w=1 / swing - system.compliance_ratio)
    averaged = averaged_limit(quasi_static, at, cycle.share, tolerance=_AVERAGED_TOLERANCE)
    zero = jnp.zeros_like(swing)
    friction = swing * (averaged.centre[0] + cycle.at.shear)
    return BalanceUnknowns(averaged.centre, (zero,) * len(averaged.centre), friction)


#: Orders of the harmonics of the elastic swing.
_ORDERS = np.arange(1, 13)
#: Smallest value of the elastic swing relative to rigid asperities; a smaller value means that the
#: modulation is faster than the resonance of the elastic asperities, and the swing is not used.
_LEAST_SWING = 0.2


def sticking_joint(
    problem: Problem, at: Excitation, theta: np.ndarray, softening: ArrayLike = 0.0
) -> tuple[Array, Array]:
    """The motion of a slider on a joint that sticks, per unit of elongation z of spring and joint.

    Under a harmonic load the harmonics of F_i/W obey

        (1 + l + impedance_n) G_n + eps/2 (G_{n-1} + G_{n+1}) = delta_{n0},

    a three-term recurrence, whose minimal solution is a continued fraction. Under other loads the
    function leaves out inertia and damping.

    Parameters
    ----------
    problem : Problem
    at : Excitation
        Samples of the load, arrays of shape (nodes, points).
    theta : array, shape (nodes, 1)
    softening : array, shape (points,)
        Mean change of ln(v_pl) with F_i/W, by which slip relaxes the joint.

    Returns
    -------
    friction : array, shape (nodes, points)
        F_i/W.
    velocity : array, shape (nodes, points)
        Velocity of the slider over V, less its mean.
    """
    load, c = problem.load, _coefficients(problem)
    rigid = 1 / (at.w + c.ratio)
    if not isinstance(load, Harmonic):
        return rigid, jnp.zeros_like(rigid)
    turn, carried = 1j * _ORDERS[:, None], 1 + c.ratio
    relaxing = turn * c.elastic + softening
    impedance = (turn * c.inertness + c.damping) * relaxing
    half, ratios = 0.5 * load.epsilon, []
    last = jnp.zeros_like(impedance[0])
    for at_order in impedance[::-1]:
        last = -half / (carried + at_order + half * last)
        ratios.append(last)
    mean = 1 / (carried + 2 * half * last.real)
    harmonics = 2 * mean * jnp.cumprod(jnp.stack(ratios[::-1]), axis=0)
    waves = harmonics[:, None] * np.exp(1j * _ORDERS[:, None, None] * theta)
    friction = mean + waves.real.sum(0)
    usable = (friction * carried > _LEAST_SWING).all(0)
    velocity = (waves * relaxing[:, None]).real.sum(0)
    return jnp.where(usable, friction, rigid), jnp.where(usable, velocity, 0.0)
