"""Motion of the slider through a whole recording, with exact derivatives.

The states are carried from one piece of the drive to the next: velocity steps, holds, ramps and
load changes follow each other as in the experiment. Within a piece the pulling velocity and the
load are linear in time. The integrator is the pair of Dormand and Prince (J. Comput. Appl. Math. 6,
19, 1980) of orders 5 and 4 with adaptive steps that end at every change of the drive, and its
continuous extension gives the friction at the samples, or its means over blocks of time.
Derivatives are those of the computed solution at its steps, by forward differentiation; step ends
move with the changes of the drive.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.laws import Law
from asperity.loads import Excitation
from asperity.parameters import law_parameters
from asperity.slider import Slider
from asperity.slider.formulation import equation_of_motion
from asperity.slider.motion import Motion

Float = NDArray[np.float64]

#: Relative and absolute local error of a step, of states of order 1.
_RELATIVE, _ABSOLUTE = 1e-7, 1e-9
#: Room for steps: the last where no start is computed in the first. A motion that needs more is
#: taken to slip in events that no fit of smooth sliding can follow.
_ROOMS = (2048, 32768)

#: Dormand and Prince: nodes, coefficients of the stages, error of the step.
_NODES = np.array([0.0, 0.2, 0.3, 0.8, 8 / 9, 1.0, 1.0])
_STAGES = np.zeros((7, 7))
_STAGES[1, :1] = 1 / 5
_STAGES[2, :2] = 3 / 40, 9 / 40
_STAGES[3, :3] = 44 / 45, -56 / 15, 32 / 9
_STAGES[4, :4] = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
_STAGES[5, :5] = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
_STAGES[6, :6] = 35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
_ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
#: Of the continuous extension (Hairer, Norsett and Wanner, Solving ODEs I, II.6).
_DENSE = np.array(
    [
        -12715105075 / 11282082432,
        0.0,
        87487479700 / 32700410799,
        -10690763975 / 1880347072,
        701980252875 / 199316789632,
        -1453857185 / 822651844,
        69997945 / 29380423,
    ]
)
#: Steps that are differentiated side by side.
_SIDE_BY_SIDE = 64
#: Derivatives beyond this, whose squares overflow, are those of a motion that runs away.
_STEEPEST = 1e100
#: Gauss-Legendre on (0, 1): exact for the continuous extension, which is of degree 4.
_GAUSS = np.stack(np.polynomial.legendre.leggauss(3), axis=1) / 2 + [0.5, 0.0]


class Drive(NamedTuple):
    """Pulling velocity and load over time, linear in each piece.

    Attributes
    ----------
    edges : array, shape (pieces + 1,)
        Times of the changes (s), the first 0.
    pull, pull_slope : array, shape (pieces,)
        Pulling velocity over that of the first piece at the beginning of each piece, and its
        slope (1/s).
    load, load_slope : array, shape (pieces,)
        W/W0 at the beginning of each piece and its slope (1/s).
    """

    edges: Any
    pull: Any
    pull_slope: Any
    load: Any
    load_slope: Any

    def load_at(self, times: Float) -> Float:
        """W/W0 at times (s) from the beginning."""
        piece = np.searchsorted(self.edges, times, side="right") - 1
        piece = np.clip(piece, 0, len(self.load) - 1)
        return np.asarray(
            self.load[piece] + self.load_slope[piece] * (times - self.edges[piece]), np.float64
        )


class Motions(NamedTuple):
    """Friction at the samples with its derivatives.

    Attributes
    ----------
    friction : array, shape (n,)
        Spring force over the instantaneous applied load, F/W.
    derivatives : array, shape (n, parameters)
    steps : int
        Steps of the integrator.
    """

    friction: Float
    derivatives: Float
    steps: int


class RunMotion:
    """Friction at the samples of a run as a function of its parameters.

    Parameters
    ----------
    law : type of Law
    velocity : float
        Pulling velocity of the first piece (m/s), which is sliding.
    inertia, radiation_damping : bool
        What counts in the equation of motion.
    """

    def __init__(
        self,
        law: type[Law],
        velocity: float,
        *,
        inertia: bool = False,
        radiation_damping: bool = False,
    ) -> None:
        self.law, self.velocity = law, float(velocity)
        self.inertia, self.damped = inertia, radiation_damping
        self._room = 0
        self._equations: Motion | None = None

    def __call__(
        self, values: Mapping[str, float], free: tuple[str, ...], drive: Drive, times: Float
    ) -> Motions | None:
        """Friction at the samples; None where the motion runs away or stops being computable.

        Parameters
        ----------
        values : mapping of str to float
            Parameters of the law, K, W0, M, eta, eps_ratio; `start_force` and `start_state_i`,
            departures of the initial states from steady sliding (0 where not given); `shift_j`,
            delay of the j-th edge of the drive (s).
        free : tuple of str
            Names for derivatives, of those.
        drive : Drive
        times : array, shape (n,) or (n, 2)
            Of the samples, or of the beginnings and ends of blocks over which friction is averaged,
            from the beginning of the drive (s).
        """
        given: dict[str, Any] = {name: np.float64(value) for name, value in values.items()}
        motion, padded, at, taken = self.prepared(given, drive, times)
        friction, slopes, steps, done = through(
            motion,
            free,
            given,
            padded,
            at,
            room=self.room,
            means=times.ndim == 2,
        )
        if not bool(done):
            return None
        f = np.asarray(friction)[taken]
        jacobian = np.asarray(slopes).T[taken]
        # NaN and infinity are not below it either.
        if not (np.isfinite(f).all() and (np.abs(jacobian) < _STEEPEST).all()):
            return None
        return Motions(f, jacobian, int(steps))

    def prepared(
        self, given: Mapping[str, Any], drive: Drive, times: Float
    ) -> tuple[Motion, Drive, Float, NDArray[np.intp]]:
        """What `through` takes: equation of motion, drive and times, filled up to a few lengths.

        The numbers of the equation are replaced by those that `through` is given. The last of the
        four says which of what it returns belongs to which of the times.
        """
        if self._equations is None:
            self._equations = self._template(given)
        at = times if times.ndim == 1 else np.unique(times)
        taken = np.arange(at.size) if times.ndim == 1 else np.searchsorted(at, times[:, 0])
        size = 1024 * int(np.ceil(at.size / 1024))
        at = np.concatenate([at, np.full(size - at.size, at[-1])])
        return self._equations, _padded(drive), at, taken

    @property
    def room(self) -> int:
        """Steps of the integrator at most."""
        return _ROOMS[self._room]

    def allow_more_steps(self) -> None:
        """Take as many steps as there is memory for, from now on."""
        self._room = len(_ROOMS) - 1

    def _template(self, given: Mapping[str, Any]) -> Motion:
        fields = _fields(self.law)
        law = self.law(**{field: jnp.asarray(given[name]) for name, field in fields.items()})
        slider = Slider(
            law,
            spring=float(given["K"]),
            load=float(given["W0"]),
            mass=float(given.get("M", 0.0)),
        )
        eta = float(given["eta"]) if self.damped else None
        # An array: as a number it would be part of the compiled program.
        V = jnp.asarray(self.velocity)
        return equation_of_motion(slider, V, 1.0, inertia=self.inertia, eta=eta)


def _fields(law: type[Law]) -> dict[str, str]:
    """Fields of a law by the names of their parameters."""
    return {n: p.path.rsplit(".", 1)[-1] for n, p in law_parameters(law).items()}


def _padded(drive: Drive) -> Drive:
    """The drive with empty pieces at its end, to one of a few lengths."""
    pieces = len(drive.pull)
    size = 8
    while size < pieces:
        size *= 2
    extra = size - pieces
    edges = np.concatenate([drive.edges, np.full(extra, drive.edges[-1])])
    # Their values are those at the end, where a sample may lie.
    last = float(drive.edges[-1] - drive.edges[-2])

    def padded(values: Float, slopes: Float) -> tuple[Float, Float]:
        end = values[-1] + slopes[-1] * last
        return (
            np.concatenate([values, np.full(extra, end)]),
            np.concatenate([slopes, np.zeros(extra)]),
        )

    return Drive(
        edges, *padded(drive.pull, drive.pull_slope), *padded(drive.load, drive.load_slope)
    )


@eqx.filter_jit
def through(
    motion: Motion,
    free: tuple[str, ...],
    given: dict[str, Any],
    drive: Drive,
    times: Any,
    *,
    room: int,
    means: bool = False,
) -> tuple[Array, Array, Array, Array]:
    """Friction at the samples under given numbers, differentiated forwards.

    Parameters
    ----------
    motion : Motion
        Whose numbers are replaced by `given`.
    free : tuple of str
        Names for derivatives.
    given : dict of str to array, shape ()
        All parameters, as of `RunMotion`.
    drive : Drive
    times : array, shape (n,)
    room : int
        Steps at most.
    means : bool
        Whether friction is averaged between neighbouring times, which are then in order.

    Returns
    -------
    friction : array, shape (n,), or (n - 1,) for means
    derivatives : array, shape (parameters, n)
        In the order of `free`.
    steps : array, shape ()
    done : array, shape ()
        Whether the end was reached.
    """
    x = _numbers(free, given)
    curve, slopes, steps, done = _integrated(motion, free, given, drive, room)
    shown = _averaged if means else _observed

    def friction(curve: _Curve, x: Array) -> Array:
        values = {**given, **dict(zip(free, x, strict=True))}
        changed, moved = _with_values(motion, values), _shifted(drive, values)
        return shown(changed, moved, values, curve, steps, times)

    f = friction(curve, x)
    if not free:
        return f, jnp.zeros((0, f.size)), steps, done

    def along(change: _Curve, direction: Array) -> Array:
        return jax.jvp(friction, (curve, x), (change, direction))[1]

    return f, jax.vmap(along)(slopes, jnp.eye(len(free))), steps, done


def density_through(
    density: Callable[[Array, Mapping[str, Array]], Array],
    motion: Motion,
    free: tuple[str, ...],
    given: dict[str, Any],
    drive: Drive,
    times: Any,
    *,
    room: int,
    means: bool = False,
) -> tuple[Array, Array]:
    """A number that depends on the friction at the samples, and its gradient.

    The motion is differentiated forwards, as by `through`, and the samples, of which there are far
    more than steps, backwards.

    Parameters
    ----------
    density : callable
        Of what `through` gives as friction, and of the parameters by name.
    motion, free, given, drive, times, room, means
        As of `through`.

    Returns
    -------
    value : array, shape ()
        NaN where the end was not reached.
    gradient : array, shape (parameters,)
        In the order of `free`.
    """
    x = _numbers(free, given)
    curve, slopes, steps, done = _integrated(motion, free, given, drive, room)
    shown = _averaged if means else _observed

    def value_of(curve: _Curve, x: Array) -> Array:
        values = {**given, **dict(zip(free, x, strict=True))}
        changed, moved = _with_values(motion, values), _shifted(drive, values)
        return density(shown(changed, moved, values, curve, steps, times), values)

    value, (back, gradient) = jax.value_and_grad(value_of, argnums=(0, 1))(curve, x)
    for weight, slope in zip(back, slopes, strict=True):
        gradient += jnp.sum(weight * slope, axis=tuple(range(1, slope.ndim)))
    return jnp.where(done, value, jnp.nan), gradient


def _numbers(names: tuple[str, ...], given: Mapping[str, Any]) -> Array:
    return jnp.array([given[name] for name in names], float)


def _with_values(motion: Motion, values: Mapping[str, Array]) -> Motion:
    fields = _fields(type(motion.slider.law))
    law = type(motion.slider.law)(**{f: values[n] for n, f in fields.items()})
    slider = motion.slider
    changed = eqx.tree_at(
        lambda s: (s.law, s.K, s.W0, s.M),
        slider,
        (law, values["K"], values["W0"], values.get("M", slider.M)),
    )
    return eqx.tree_at(lambda m: m.slider, motion, changed)


def _shifted(drive: Drive, values: Mapping[str, Array]) -> Drive:
    drive = Drive(*map(jnp.asarray, drive))
    edges = drive.edges
    for name, value in values.items():
        if name.startswith("shift_"):
            edges = edges.at[int(name.removeprefix("shift_"))].add(value)
    return drive._replace(edges=edges)


class _Curve(NamedTuple):
    """Steps with the coefficients of the continuous extension, filled up to the room for them."""

    begin: Array
    length: Array
    coefficients: Array


def _excitation(drive: Drive, values: Mapping[str, Array], piece: Array, t: Array) -> Excitation:
    since = t - drive.edges[piece]
    ratio = values.get("eps_ratio", 1.0)
    load = drive.load[piece] + drive.load_slope[piece] * since
    return Excitation(
        w=1 + ratio * (load - 1),
        w_slope=ratio * drive.load_slope[piece],
        pull=drive.pull[piece] + drive.pull_slope[piece] * since,
    )


def _integrated(
    motion: Motion, free: tuple[str, ...], given: dict[str, Any], drive: Drive, room: int
) -> tuple[_Curve, _Curve, Array, Array]:
    """The motion, its derivatives, its number of steps, and whether the end was reached.

    Of a step the derivatives depend on those of the steps before it only through the states at its
    beginning: they are computed for many steps side by side, and then added up along them. Their
    first axis is that of the parameters.
    """

    def begun(x: Array) -> tuple[Motion, Drive, Mapping[str, Array]]:
        values = {**given, **dict(zip(free, x, strict=True))}
        return _with_values(motion, values), _shifted(drive, values), values

    def first_states(x: Array) -> Array:
        now, _, values = begun(x)
        return _first_states(now, values)

    x = _numbers(free, given)
    taken, curve, steps, done = _steps_taken(*begun(x), room)
    count, m = x.size, taken.states.shape[1]
    nothing = jax.tree.map(lambda all_: jnp.zeros((count, *all_.shape)), curve)
    if not free:
        return curve, nothing, steps, done

    def slopes_of(part: _Step, change: Array) -> tuple[Array, _Curve]:
        """Of the states after a part of the steps, and of the motion at these."""

        def one(step: _Step, direction: Array) -> tuple[Array, _Curve]:
            """Along one direction of the parameters, or of the states."""

            def moved(x: Array, y: Array) -> tuple[Array, _Curve]:
                now, drawn, values = begun(x)
                begin = drawn.edges[step.piece] + step.since
                length = jnp.where(step.last, drawn.edges[step.piece + 1] - begin, step.length)
                new, _, rows = _stepped(now, drawn, values, step.piece, begin, length, y)
                return new, _Curve(begin, length, rows)

            along = direction[:count], direction[count:]
            return jax.jvp(moved, (x, step.states), along)[1]

        each_direction = jax.vmap(one, (None, 0))
        after, found = jax.vmap(each_direction, (0, None), 1)(part, jnp.eye(count + m))

        def onwards(dy: Array, own: Array) -> tuple[Array, Array]:
            return own[:count] + jnp.sum(dy[:, :, None] * own[count:], axis=1), dy

        change, before = jax.lax.scan(onwards, change, jnp.moveaxis(after, 1, 0))
        by_states = jnp.moveaxis(before, 0, 1)[..., None, None]
        whole = jnp.sum(by_states * found.coefficients[count:].swapaxes(0, 1), axis=2)
        return change, _Curve(
            found.begin[:count], found.length[:count], found.coefficients[:count] + whole
        )

    def body(carry: Any) -> Any:
        first, change, slopes = carry
        part = jax.tree.map(
            lambda all_: jax.lax.dynamic_slice_in_dim(all_, first, _SIDE_BY_SIDE), taken
        )
        change, found = slopes_of(part, change)
        slopes = jax.tree.map(
            lambda all_, new: jax.lax.dynamic_update_slice_in_dim(all_, new, first, 1),
            slopes,
            found,
        )
        return first + _SIDE_BY_SIDE, change, slopes

    start = jnp.asarray(0), jax.jacfwd(first_states)(x).T, nothing
    *_, slopes = jax.lax.while_loop(lambda carry: carry[0] < steps, body, start)
    return curve, slopes, steps, done


class _Step(NamedTuple):
    """What a step begins with.

    Attributes
    ----------
    piece : int array
        Of the drive.
    since, length : array
        Time since the beginning of the piece, and length of the step (s).
    last : bool array
        Whether it ends with the piece.
    states : array
    """

    piece: Array
    since: Array
    length: Array
    last: Array
    states: Array


def _first_states(motion: Motion, values: Mapping[str, Array]) -> Array:
    """States at the beginning: those of steady sliding and the departures from it."""
    steady = motion.steady()
    names = ("start_force", *(f"start_state_{i}" for i in range(steady.shape[0] - 1)))
    return steady + jnp.stack([jnp.asarray(values.get(n, 0.0), float) for n in names])


def _stepped(
    motion: Motion,
    drive: Drive,
    values: Mapping[str, Array],
    piece: Array,
    begin: Array,
    length: Array,
    y: Array,
) -> tuple[Array, Array, Array]:
    """States after a step, their error, and the coefficients of the continuous extension."""

    @jax.jit  # traced once for all stages
    def rates(at: Array, state: Array) -> Array:
        return motion.rates(state, _excitation(drive, values, piece, at))

    # Sums written out: products of such small matrices take longer than all else.
    k: list[Array] = []
    new = y
    for node, row in zip(_NODES, _STAGES, strict=True):
        new = y + length * _combined(row, k) if k else y
        k.append(rates(begin + node * length, new))
    # The last stage is the solution of order 5.
    rise = new - y
    first = length * k[0] - rise
    second = rise - length * k[6] - first
    rows = jnp.stack([y, rise, first, second, length * _combined(_DENSE, k)])
    return new, length * _combined(_ERROR, k), rows


def _steps_taken(
    motion: Motion, drive: Drive, values: Mapping[str, Array], room: int
) -> tuple[_Step, _Curve, Array, Array]:
    """The steps, the motion at them, their number, and whether the end was reached."""
    pieces = drive.pull.shape[0]
    y0 = _first_states(motion, values)
    end = drive.edges[-1]

    def body(carry: Any) -> Any:
        t, h, y, piece, n, tries, kept, curve = carry
        edge = drive.edges[piece + 1]
        last = t + 1.01 * h >= edge
        step = jnp.where(last, edge - t, h)
        new, error, rows = _stepped(motion, drive, values, piece, t, step, y)
        scale = _ABSOLUTE + _RELATIVE * jnp.maximum(jnp.abs(y), jnp.abs(new))
        norm = jnp.sqrt(jnp.mean((error / scale) ** 2))
        norm = jnp.where(jnp.isfinite(norm), norm, 1e10)
        # A piece without length is passed.
        accepted = (norm <= 1.0) | (step <= 1e-14 * end)
        this = _Step(piece, t - drive.edges[piece], step, last, y)
        kept = jax.tree.map(lambda all_, one: all_.at[n].set(one), kept, this)
        curve = jax.tree.map(lambda all_, one: all_.at[n].set(one), curve, _Curve(t, step, rows))
        factor = jnp.clip(0.9 * jnp.maximum(norm, 1e-10) ** -0.2, 0.2, 5.0)
        h_next = step * factor
        h_next = jnp.where(last & accepted, jnp.maximum(h_next, h), h_next)
        moved = accepted & (step > 1e-14 * end)
        t = jnp.where(accepted, jnp.where(last, edge, t + step), t)
        y = jnp.where(moved, new, y)
        piece = jnp.where(accepted & last, piece + 1, piece)
        return t, h_next, y, piece, jnp.where(moved, n + 1, n), tries + 1, kept, curve

    def going(carry: Any) -> Array:
        _, h, _, piece, n, tries, *_ = carry
        return (piece < pieces) & (n < room) & (tries < room + room // 2) & (h > 1e-13 * end)

    zero = jnp.asarray(0)
    kept = _Step(
        jnp.zeros(room, int),
        jnp.zeros(room),
        jnp.zeros(room),
        jnp.zeros(room, bool),
        # Those that fill up are computed with the others.
        jnp.zeros((room, *y0.shape)) + y0,
    )
    curve = _Curve(jnp.full(room, jnp.inf), jnp.ones(room), jnp.zeros((room, 5, *y0.shape)))
    start = drive.edges[0], 1e-3 * (drive.edges[1] - drive.edges[0]), y0, zero, zero, zero
    *_, piece, n, _, kept, curve = jax.lax.while_loop(going, body, (*start, kept, curve))
    return kept, curve, n, piece >= pieces


def _combined(weights: Float, rates: Sequence[Array]) -> Array:
    """Sum of the rates by their weights, those of zero left out."""
    return functools.reduce(
        jnp.add, [w * k for w, k in zip(weights, rates, strict=False) if w != 0.0]
    )


def _observed(
    motion: Motion,
    drive: Drive,
    values: Mapping[str, Array],
    curve: _Curve,
    steps: Array,
    times: Array,
) -> Array:
    """F/W at the samples."""
    i = _step_of(curve, steps, times)
    share = (times - curve.begin[i]) / curve.length[i]
    return _friction(motion, drive, values, curve, i, share, times)


def _averaged(
    motion: Motion,
    drive: Drive,
    values: Mapping[str, Array],
    curve: _Curve,
    steps: Array,
    edges: Array,
) -> Array:
    """Mean F/W between neighbouring edges; 0 where there is no time between them."""
    numbers = jnp.arange(curve.begin.size)
    taken = numbers < steps
    begin = jnp.where(taken, curve.begin, 0.0)
    # Means are differences of an integral: of what is small, they keep more digits.
    level = jax.lax.stop_gradient(
        _friction(motion, drive, values, curve, numbers[:1], jnp.zeros(1), begin[:1])
    )

    def integral(step: Array, share: Array) -> Array:
        """Of F/W from the beginning of a step to a share of its length."""
        total = jnp.zeros(share.shape)
        for node, weight in _GAUSS:
            at = begin[step] + node * share * curve.length[step]
            f = _friction(motion, drive, values, curve, step, node * share, at)
            total = total + weight * (f - level)
        return total * share * curve.length[step]

    whole = jnp.where(taken, integral(numbers, jnp.ones(numbers.size)), 0.0)
    before = jnp.cumsum(whole) - whole
    i = _step_of(curve, steps, edges)
    rise = jnp.diff(before[i] + integral(i, (edges - begin[i]) / curve.length[i]))
    apart = jnp.diff(edges)
    return jnp.where(apart > 0, level + rise / jnp.where(apart > 0, apart, 1.0), 0.0)


def _step_of(curve: _Curve, steps: Array, times: Array) -> Array:
    """Step of the integrator that each time lies in."""
    begin = jax.lax.stop_gradient(curve.begin)
    i = jnp.clip(jnp.searchsorted(begin, times, side="right") - 1, 0)
    return jnp.minimum(i, steps - 1)


def _friction(
    motion: Motion,
    drive: Drive,
    values: Mapping[str, Array],
    curve: _Curve,
    step: Array,
    share: Array,
    times: Array,
) -> Array:
    """F/W at times, each a share of the length of a step after its beginning."""
    x = share

    def state(i: int) -> Array:
        # Each state by itself: those that the force does not depend on are not computed.
        c = [curve.coefficients[:, j, i][step] for j in range(5)]
        return c[0] + x * (c[1] + (1 - x) * (c[2] + x * (c[3] + (1 - x) * c[4])))

    y = [state(i) for i in range(curve.coefficients.shape[2])]
    piece = jnp.searchsorted(jax.lax.stop_gradient(drive.edges), times, side="right") - 1
    piece = jnp.clip(piece, 0, drive.pull.shape[0] - 1)
    at = _excitation(drive, values, piece, times)
    load = drive.load[piece] + drive.load_slope[piece] * (times - drive.edges[piece])
    return motion.force(jnp.stack(y), at) / load
