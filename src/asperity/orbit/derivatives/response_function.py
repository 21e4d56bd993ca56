"""The periodic response as a function that JAX programs call and differentiate.

A call finds the orbits and then evaluates them. Orbits are computed without derivatives, by the
fast method within the compiled program, and by the search of `asperity.orbit.search` where the fast
method does not converge or does not resolve the orbit. Derivatives come from the implicit-function
rule at the orbit, whichever method solved for it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import partial
from typing import Annotated, Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity._jax import jit_large, spare_mappings
from asperity.arrays import Bool, Float
from asperity.errors import InputError, closest, require
from asperity.laws import Law, get_law
from asperity.laws.consistency import checked_law
from asperity.loads import Harmonic, Modulation
from asperity.loads.consistency import checked_modulation
from asperity.orbit.derivatives.fourier_orbits import (
    FastOrbits,
    fast_orbits,
    fast_values,
    has_fast_method,
)
from asperity.orbit.derivatives.mesh_orbits import add_derivatives, searched_values, values_of
from asperity.orbit.derivatives.mesh_search import (
    KnownOrbits,
    SearchedOrbits,
    growth_of,
    search_orbits,
)
from asperity.orbit.derivatives.parametrised import (
    Parameters,
    ParametrisedProblem,
    Program,
    ResponseValues,
    by_point,
    chosen,
    coefficients_of,
    load_values,
)
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import METHODS, find_orbits
from asperity.orbit.solution import SearchOptions
from asperity.parameters import obeying
from asperity.parameters.arguments import at_least, typed
from asperity.slider import QuasiStatic
from asperity.slider.parameters import law_from
from asperity.slider.problem import motion_type

#: Smallest number of points that a program is compiled for; larger numbers are powers of two.
_FEWEST = 4


#: Methods that take milliseconds a point.
_QUICK = ("fourier", "shooting", "series", "collocation")


class ResponseFunction:
    """Mean, harmonics and multipliers as a function of named parameters; see `response_function`.

    Attributes
    ----------
    parameters : tuple of str
        Names of the parameters.
    """

    @typed
    def __init__(
        self, program: Program, defaults: Mapping[str, Any], least_points: int = _FEWEST
    ) -> None:
        self._program = program
        self._defaults = dict(defaults)
        self._least_points = least_points
        self._law_is_checked = False

    @classmethod
    @typed
    def of(
        cls, equations: ParametrisedProblem, *, harmonics: int, multipliers: bool
    ) -> ResponseFunction:
        """The response of given equations of motion; see `response_function`."""
        _require_rate_dependence(equations.law)
        return cls(Program(equations, harmonics, multipliers, search=True), {})

    @property
    def equations(self) -> ParametrisedProblem:
        """Equations of motion and load as functions of the parameters."""
        return self._program.equations

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, those that have no influence included."""
        return self._program.equations.names

    def __repr__(self) -> str:
        return f"response_function of {', '.join(self.parameters)}"

    @typed
    def compiled_points(self, points: Annotated[int, at_least(1)]) -> int:
        """Number of points of the compiled program that a call with `points` points uses."""
        return 1 << (max(points, self._least_points, _FEWEST) - 1).bit_length()

    @typed
    def __call__(
        self,
        parameters: Mapping[str, ArrayLike],
        known: KnownOrbits | None = None,
        *,
        motions: bool | None = None,
    ) -> ResponseValues:
        """Response at one or many points.

        Parameters
        ----------
        parameters : mapping of str to array
            Every parameter by name, each a number or of shape (points,); in SI, or a text
            with its unit.
        known : KnownOrbits, optional
            Orbits of the same points from earlier calls with other parameters. The call stores
            there the orbits that the fast method does not find, and ``search="direct"`` and
            ``search="coarse"`` take their initial guesses from there. Only for a search without
            multipliers and for parameters that are not traced.
        motions : bool, optional
            Whether a direct search integrates a transient where it finds no orbit otherwise, 10 ms
            a point; by default ``search="direct"`` does and ``search="coarse"`` does not.

        Returns
        -------
        ResponseValues
            Without the axis of points if all parameters are numbers.

        Raises
        ------
        InputError
            If a name is unknown or missing, a shape is wrong, a value that is not traced breaks
            its rule, or `known` does not fit. Where a traced value breaks its rule, the outcome is
            `Outcome.INVALID`.
        """
        padded, points = self._padded(parameters)
        orbits = self._orbits(padded, points or 1, known, motions=motions)
        values = _evaluated(padded, orbits)
        return _cut(_with_searched(values, orbits), points)

    @typed
    def value_and_jacobian(
        self,
        parameters: Mapping[str, ArrayLike],
        known: KnownOrbits | None = None,
        *,
        motions: bool | None = None,
        every: bool = False,
        names: Collection[str] | None = None,
    ) -> tuple[ResponseValues, dict[str, ResponseValues]]:
        """Response, and its derivatives by the parameters at every point.

        Parameters
        ----------
        parameters : mapping of str to array
        known : KnownOrbits, optional
        motions : bool, optional
            As for a call.
        every : bool
            Whether the result is needed only if every point has a response, as in a fit. The search
            may then end at the first point without an orbit, and leaves out derivatives.
        names : collection of str, optional
            Parameters to differentiate to; all by default. Each takes time where orbits are
            searched for.

        Returns
        -------
        values : ResponseValues
        derivatives : dict of str to ResponseValues
            For each parameter, with the shapes of `values`: the derivative of the response at each
            point to the parameter at the same point. The derivative by a parameter that all points
            share is the sum over the points.
        """
        self._check_names("names", names or ())
        padded, points = self._padded(parameters)
        orbits = self._orbits(padded, points or 1, known, every=every, motions=motions)
        whole, table = _differentiated(padded, orbits)
        whole = _with_searched(whole, orbits)
        outcome = whole.outcome[: points or 1]
        if orbits.searched and (not every or (outcome == Outcome.CONVERGED).all()):
            add_derivatives(table, orbits.program, padded, orbits.searched, names)
        values = _cut(whole, points)
        cut = table[:, 0] if points is None else table[:, :points]
        derivative = partial(
            ResponseValues.of_columns, outcome=values.outcome, harmonics=self._program.harmonics
        )
        columns = zip(self._program.equations.names, cut, strict=True)
        return values, {n: derivative(c) for n, c in columns if names is None or n in names}

    @typed
    def growth(
        self, parameters: Mapping[str, ArrayLike], known: KnownOrbits | None = None
    ) -> Float:
        """Growth of perturbations in a period, ln |m| with the largest Floquet multiplier m.

        Where it is positive, the response is unstable: the slider leaves it and is not measured
        there. Orbits are searched for as by ``search="coarse"``, with errors of about 1e-6.

        Parameters
        ----------
        parameters : mapping of str to array
            As for a call.
        known : KnownOrbits, optional
            Orbits of the same points, where the search begins; those that it finds replace them.

        Returns
        -------
        array, shape (points,)
            NaN where the search finds no orbit.

        Raises
        ------
        InputError
            As for a call.
        """
        padded, points = self._padded(parameters)
        if known is not None:
            self._check_known(known, points or 1, traced=_traced(padded))
        numbers = {n: np.asarray(v)[: points or 1] for n, v in padded.items()}
        return growth_of(self.equations, numbers, known)

    @typed
    def reverses(self, parameters: Mapping[str, ArrayLike]) -> Bool:
        """Whether slip would reverse, see `PeriodicResponse.reverses`.

        False where no orbit is found without following branches, and without inertia, damping and
        shear force, where only slip forwards lowers the interface force.

        Parameters
        ----------
        parameters : mapping of str to array
            As for a call.

        Returns
        -------
        bool array, shape (points,)
        """
        padded, points = self._padded(parameters)
        numbers = {n: np.asarray(v)[: points or 1] for n, v in padded.items()}
        problem = self.equations.problem(numbers)
        if isinstance(problem.system, QuasiStatic) and isinstance(problem.load, Harmonic):
            return np.zeros(points or 1, bool)
        quick = tuple(m for m in METHODS if m.name in _QUICK)
        return find_orbits(problem, SearchOptions(2), quick).reversal_margin < 0

    def _orbits(
        self,
        parameters: Parameters,
        points: int,
        known: KnownOrbits | None,
        *,
        every: bool = False,
        motions: bool | None = None,
    ) -> _Orbits:
        """Orbits of the first `points` points; further points are padding."""
        program, traced = self._program, _traced(parameters)
        if known is not None:
            self._check_known(known, points, traced=traced)
        if traced:
            fast = _fast_orbits(program, jax.lax.stop_gradient(parameters))
            wanted = program.equations.valid(parameters)
            wanted = wanted if fast is None else wanted & ~fast.converged
            return _Orbits(program, fast, wanted if program.search else None, None)
        if not self._law_is_checked:
            checked_law(law_from(program.equations.law, parameters))
            self._law_is_checked = True
        spare_mappings()
        # A direct search does not resolve multipliers.
        direct = program.search in ("direct", "coarse") and not program.multipliers
        # The known orbits are those that the fast method did not find at other parameters.
        searching = direct and known is not None and known.known.all()
        fast = None if searching else _fast_orbits(program, parameters)
        rows, searched = np.arange(len(parameters["V"])) < points, None
        if fast is not None:
            left = ~np.asarray(fast.converged)
            fast = None if left[rows].all() else fast
            rows &= left
        if program.search and rows.any():
            searched = search_orbits(
                program.equations,
                program.harmonics,
                {n: np.asarray(v) for n, v in parameters.items()},
                rows,
                direct=direct,
                coarse=program.search == "coarse",
                motions=motions,
                known=known,
                every=every,
            )
        return _Orbits(program.without_search, fast, None, searched)

    def _check_names(self, argument: str, given: Collection[str]) -> None:
        """Refuse names of parameters that the equations do not have."""
        known = self.parameters
        for name in given:
            if name not in known:
                raise InputError(
                    f"{argument} must have known names, got '{name}'; {closest(name, known)}"
                )

    def _check_known(self, known: KnownOrbits, points: int, *, traced: bool) -> None:
        """Refuse known orbits that this call cannot take as initial guesses."""
        if traced or not self._program.search or self._program.multipliers:
            raise InputError(
                "known must go with a search, no multipliers and parameters that are not traced; "
                "leave it out"
            )
        rule = f"be of as many points as the parameters, {points}"
        require(known.points == points, "known", rule, known.points)
        if known.orbit is not None and known.orbit.centre.shape[0] != self._program.states:
            rule = f"be of equations with {self._program.states} states"
            got = known.orbit.centre.shape[0]
            raise InputError("known", rule, got, "each law and motion needs its own")

    def _padded(self, parameters: Mapping[str, ArrayLike]) -> tuple[Parameters, int | None]:
        """All parameters, padded to the size of the compiled program, and the number of points.

        The number is None if every parameter is a number.
        """
        equations = self._program.equations
        given = self._defaults | dict(parameters)
        self._check_names("parameters", given)
        missing = [n for n in equations.names if n not in given and n not in equations.optional]
        if missing:
            raise InputError(
                f"parameters must be complete, got none for {', '.join(missing)}; give them in SI"
            )
        given = {
            n: obeying(given.get(n, 0.0), f"parameters['{n}']", p.kind, p.rule)
            for n, p in equations.table.items()
        }
        traced = any(isinstance(v, jax.core.Tracer) for v in given.values())
        shapes = {n: np.shape(v) for n, v in given.items()}
        long = {s for s in shapes.values() if s}
        if len(long) > 1 or any(len(s) > 1 or s[0] == 0 for s in long):
            got = ", ".join(f"{n} {s}" for n, s in shapes.items() if s)
            raise InputError(
                f"parameters must be numbers or arrays of one shape (points,), got {got}; "
                "flatten grids first"
            )
        (count,) = next(iter(long), (1,))
        size = self.compiled_points(count)
        pad = partial(_padded, count=count, size=size, module=jnp if traced else np)
        return {n: pad(v) for n, v in given.items()}, count if long else None


def _require_rate_dependence(law: type[Law]) -> None:
    rule, got = "depend on the velocity", f"{law.name}, whose force follows the load"
    require(law.rate_dependent, "law", rule, got, "choose another law")


def _padded(value: Any, *, count: int, size: int, module: Any) -> Any:
    """A parameter of `count` points, its last value repeated up to `size` points."""
    flat = module.broadcast_to(module.asarray(value, dtype=float), (count,))
    return module.concatenate([flat, module.broadcast_to(flat[-1:], (size - count,))])


def _cut(values: ResponseValues, points: int | None) -> ResponseValues:
    """Values without the padding points; NumPy arrays outside of traced functions."""

    def cut(a: Array) -> Any:
        whole = a if isinstance(a, jax.core.Tracer) else np.asarray(a)
        return whole[0] if points is None else whole[:points]

    return jax.tree.map(cut, values)


@typed
def response_function(
    law: str | type[Law],
    *,
    inertia: bool = False,
    radiation_damping: bool = False,
    harmonics: Annotated[int, at_least(1)] = 2,
    multipliers: bool = False,
    modulation: Modulation | None = None,
    search: bool | Literal["direct", "coarse"] = True,
    least_points: Annotated[int, at_least(1)] = _FEWEST,
) -> ResponseFunction:
    """The periodic response as a function of named parameters, for fits, samplers and designs.

    The function that is returned maps a dictionary of named parameters, each a number or an array
    over the operating points, to mean, harmonics and multipliers. It may be called within
    `jax.jit`, and `jax.jvp`, `jax.vjp`, `jax.grad`, `jax.jacfwd`, `jax.jacrev` and `jax.hessian`
    differentiate it. Programs are compiled once for each power of two that the number of points
    is filled up to.

    Parameters
    ----------
    law : str or type of Law
        A rate-dependent law, by name or as a class.
    inertia : bool
        Whether the mass M counts.
    radiation_damping : bool
        Whether there is a radiation damping eta (N s/m).
    harmonics : int
        Number of harmonics of the force, at least 1.
    multipliers : bool
        Whether to compute the logarithms of the Floquet multipliers.
    modulation : Modulation, optional
        In place of the harmonic load with its parameter epsilon: a load of `asperity.loads`, whose
        Fourier coefficients, "load_cos_1", "load_sin_1", "shear_cos_1", "pull_cos_1", ..., become
        parameters with the coefficients of `modulation` as defaults.
    search : bool, "direct" or "coarse"
        Whether to search for orbits that the fast method does not find. With False these points do
        not converge, and the compiled programs are smaller. True allows every method, also those
        that follow branches, which may take a minute for one point. "direct" takes some
        milliseconds a point: it tries series under slow modulation, and collocation from the orbits
        of `KnownOrbits`, from the averaged limit and, under a harmonic load, from the last period
        of a transient from steady sliding. Within `jax.jit`, and where multipliers are wanted,
        "direct" means True. "coarse" is "direct" on 72 intervals without a check of the mesh, and
        without transients unless a call asks for them: its values have errors of about 1e-6, small
        enough to look for the minima of a fit.
    least_points : int
        Calls with fewer points are padded to this number, so that calls with different numbers of
        points share one compiled program.

    Returns
    -------
    ResponseFunction
        Its attribute `parameters` has the names of the parameters: those of the law, then K, W0,
        M, V, frequency (Hz), eta and epsilon, all in SI.

    Raises
    ------
    InputError
        If the law is unknown or does not depend on the velocity.

    Examples
    --------
    >>> import asperity as asp
    >>> model = asp.response_function("rice-ruina")
    >>> numbers = {"mu0": 0.37, "A": 0.013, "B": 0.019, "D0": 0.4e-6, "V0": 1e-6, "K": 2e5}
    >>> model(numbers | {"W0": 7.0, "V": 1e-6, "epsilon": 0.2, "frequency": 120.0})

    Notes
    -----
    Bureau et al. (2000), Eqs. (1), (2), (6), (8) and (26)-(29). With D the equations of an orbit
    Y for parameters p, D(p, Y) = 0, its derivative is -D_Y^-1 D_p.

    Where the search is needed within `jax.jit`, a separate process runs it, which takes some
    seconds to start. Multipliers with inertia or radiation damping need the search at every point.
    Derivatives at orbits of the search are those of collocation on 216, 648 or 1,944 intervals: the
    fewest on which mean and harmonics agree with those of the search to 1e-10. Their error is about
    1e-7 of the largest derivative of an output, 1e-5 where the interface sticks (`cut-off`) and
    slip is sharp; derivatives of multipliers are NaN where it sticks. Second derivatives at these
    orbits, within JAX's transformations, are NaN. A direct search takes its values from these
    meshes too: from the first mesh that agrees with a mesh of a third as many intervals so well
    that the error of the finer mesh is below 1e-10. Where the finest mesh differs from the search
    by more than 1e-8, the outcome is `Outcome.NOT_RESOLVED`.
    """
    law_type = law if isinstance(law, type) and issubclass(law, Law) else get_law(law)
    if modulation is not None:
        modulation = checked_modulation(modulation)
    _require_rate_dependence(law_type)
    elastic = law_type.elastic_length is not Law.elastic_length
    motion = motion_type(inertia=inertia, damped=radiation_damping, elastic=elastic)
    coefficients = None if modulation is None else coefficients_of(modulation)
    equations = ParametrisedProblem(law_type, motion, radiation_damping, coefficients)
    defaults = {} if modulation is None or coefficients is None else load_values(modulation)
    program = Program(equations, harmonics, multipliers, search)
    return ResponseFunction(program, defaults, least_points)


def _traced(parameters: Parameters) -> bool:
    return any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(parameters))


class _Orbits(NamedTuple):
    """Orbits of all points, and the program that evaluates them."""

    program: Program
    #: Of the fast method; None without one, or where it has found none.
    fast: FastOrbits | None
    #: Within a compiled program: mask of the points that are left to the search.
    wanted: Array | None
    #: Of the search, outside of compiled programs.
    searched: SearchedOrbits | None


def _fast_orbits(program: Program, parameters: Parameters) -> FastOrbits | None:
    return (
        fast_orbits(parameters, program=program.without_search)
        if has_fast_method(program)
        else None
    )


def _with_searched(values: ResponseValues, orbits: _Orbits) -> ResponseValues:
    """Values of the fast method and of the search together, NumPy arrays."""
    searched = orbits.searched
    if searched is None:
        return values
    whole = ResponseValues(*(np.array(a) for a in values))
    missing = whole.outcome == Outcome.NO_ORBIT
    whole.outcome[missing] = searched.outcome[missing]
    for index, on_mesh in searched.parts:
        values = values_of(on_mesh, multipliers=orbits.program.multipliers)
        for target, part in zip(whole, values, strict=True):
            target[index] = part
    return whole


def _values(
    parameters: Parameters,
    fast: FastOrbits | None,
    wanted: Array | None,
    program: Program,
) -> ResponseValues:
    """Response of converged orbits, with its derivatives by the parameters."""
    valid = program.equations.valid(parameters)
    count = program.harmonics, program.states if program.multipliers else 0
    points = valid.shape[0]
    outcome = jnp.where(valid, int(Outcome.NO_ORBIT), int(Outcome.INVALID))
    values = ResponseValues(
        jnp.zeros(points),
        jnp.zeros((points, count[0]), dtype=complex),
        jnp.zeros((points, count[1]), dtype=complex),
        outcome,
    )
    if wanted is not None:
        values = searched_values(parameters, wanted, program)
        values = values._replace(outcome=jnp.where(valid, values.outcome, outcome))
    if fast is not None:
        values = chosen(fast.converged, fast_values(parameters, fast, program), values)
    # Multiplication by NaN makes the derivatives NaN, too.
    known = jnp.where(values.outcome == Outcome.CONVERGED, 1.0, jnp.nan)
    mean, harmonics, logs = (by_point(known, a) * a for a in values[:3])
    return ResponseValues(mean, harmonics, logs, values.outcome)


_evaluate = jit_large(_values, static_argnames=("program",))


@partial(jit_large, static_argnames=("program",))
def _differentiate(
    parameters: Parameters,
    fast: FastOrbits | None,
    wanted: Array | None,
    *,
    program: Program,
) -> tuple[ResponseValues, Array]:
    """Values, and derivatives at each point to the parameters of that point.

    The derivatives are of shape (parameters, points, columns), with `ResponseValues.columns`.
    """

    def evaluate(parameters: Parameters) -> tuple[Array, ResponseValues]:
        values = _values(parameters, fast, wanted, program)
        return values.columns, values

    names = program.equations.names
    points = parameters[names[0]].shape[0]
    count = program.columns
    if count < len(names):
        _, pull, values = jax.vjp(evaluate, parameters, has_aux=True)
        unit = jnp.broadcast_to(jnp.eye(count)[:, None], (count, points, count))
        (gradients,) = jax.vmap(pull)(unit)
        columns = {n: g.T for n, g in gradients.items()}
    else:
        _, push, values = jax.linearize(evaluate, parameters, has_aux=True)
        ones, zeros = jnp.ones(points), jnp.zeros(points)
        basis = {n: jnp.stack([ones if n == m else zeros for m in names]) for n in names}
        columns = dict(zip(names, jax.vmap(push)(basis), strict=True))
    known = jnp.where(values.outcome == Outcome.CONVERGED, 1.0, jnp.nan)
    # One array: every output of a compiled program costs time.
    return values, known[:, None] * jnp.stack([columns[n] for n in names])


def _evaluated(parameters: Parameters, orbits: _Orbits) -> ResponseValues:
    """Response of the fast orbits, and within compiled programs of the searched ones."""
    if orbits.fast is None and not _traced(parameters):
        return _without_orbits(parameters, orbits.program)[0]
    return _evaluate(parameters, orbits.fast, orbits.wanted, program=orbits.program)


def _differentiated(parameters: Parameters, orbits: _Orbits) -> tuple[ResponseValues, Any]:
    """As `_evaluated`, and derivatives as of `_differentiate`, which may be written to."""
    if _traced(parameters):
        return _differentiate(parameters, orbits.fast, orbits.wanted, program=orbits.program)
    if orbits.fast is None:
        return _without_orbits(parameters, orbits.program)
    values, table = _differentiate(parameters, orbits.fast, None, program=orbits.program)
    return values, np.array(table)


def _without_orbits(parameters: Parameters, program: Program) -> tuple[ResponseValues, Float]:
    """The result of `_differentiate` without an orbit, for which nothing need be compiled."""
    points, names = len(parameters["V"]), program.equations.names
    table = np.full((len(names), points, program.columns), np.nan)
    outcome = np.full(points, int(Outcome.NO_ORBIT))
    return ResponseValues.of_columns(table[0], outcome, program.harmonics), table
