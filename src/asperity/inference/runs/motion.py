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

from collections.abc import Mapping
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
            {k: given[k] for k in free},
            given,
            padded,
            at,
            room=self.room,
            means=times.ndim == 2,
        )
        if not bool(done):
            return None
        f = np.asarray(friction)[taken]
        columns = [np.asarray(slopes[name])[taken] for name in free]
        jacobian = np.stack(columns, axis=1) if columns else np.zeros((f.size, 0))
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
    free: dict[str, Any],
    given: dict[str, Any],
    drive: Drive,
    times: Any,
    *,
    room: int,
    means: bool = False,
) -> tuple[Array, dict[str, Array], Array, Array]:
    """Friction at the samples under given numbers, differentiated forwards.

    Parameters
    ----------
    motion : Motion
        Whose numbers are replaced by `given`.
    free : dict of str to array, shape ()
        Parameters for derivatives.
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
    derivatives : dict of str to array, of the same shape
    steps : array, shape ()
    done : array, shape ()
        Whether the end was reached.
    """

    def friction(moving: dict[str, Array]) -> tuple[Array, tuple[Array, Array, Array]]:
        values = {**given, **moving}
        changed = _with_values(motion, values)
        moved = _shifted(drive, values)
        dense = _integrated(changed, moved, values, room)
        f = (_averaged if means else _observed)(changed, moved, values, dense, times)
        return f, (f, dense.steps, dense.done)

    if not free:
        f, (_, count, done) = friction(free)
        return f, {}, count, done
    slopes, (f, count, done) = jax.jacfwd(friction, has_aux=True)(free)
    return f, slopes, count, done


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
    edges = jnp.asarray(drive.edges)
    for name, value in values.items():
        if name.startswith("shift_"):
            edges = edges.at[int(name.removeprefix("shift_"))].add(value)
    return drive._replace(edges=edges)


class _Dense(NamedTuple):
    """Steps with the coefficients of the continuous extension."""

    begin: Array
    length: Array
    coefficients: Array
    steps: Array
    done: Array


def _excitation(drive: Drive, values: Mapping[str, Array], piece: Array, t: Array) -> Excitation:
    since = t - drive.edges[piece]
    ratio = values.get("eps_ratio", 1.0)
    load = drive.load[piece] + drive.load_slope[piece] * since
    return Excitation(
        w=1 + ratio * (load - 1),
        w_slope=ratio * drive.load_slope[piece],
        pull=drive.pull[piece] + drive.pull_slope[piece] * since,
    )


def _integrated(motion: Motion, drive: Drive, values: Mapping[str, Array], room: int) -> _Dense:
    still = jax.lax.stop_gradient
    pieces = drive.pull.shape[0]
    y0 = motion.steady()
    m = y0.shape[0]
    departures = [values.get("start_force", 0.0)] + [
        values.get(f"start_state_{i}", 0.0) for i in range(m - 1)
    ]
    y0 = y0 + jnp.stack([jnp.asarray(d, float) for d in departures])
    end = still(drive.edges[-1])

    def body(carry: Any) -> Any:
        t, h, y, piece, n, tries, begin, length, table = carry
        edge = drive.edges[piece + 1]
        last = still(t + 1.01 * h) >= still(edge)
        step = jnp.where(last, edge - t, still(h))

        def rates(at: Array, state: Array) -> Array:
            return motion.rates(state, _excitation(drive, values, piece, at))

        def stage(k: Array, coefficients: tuple[Array, Array, Array]) -> tuple[Array, Array]:
            number, node, row = coefficients
            inner = y + step * (row @ k)
            return k.at[number].set(rates(t + node * step, inner)), inner

        # Unrolled: half the time for 1.7 s more of compiling.
        numbers = (jnp.arange(7), jnp.asarray(_NODES), jnp.asarray(_STAGES))
        k, inner = jax.lax.scan(stage, jnp.zeros((7, m)), numbers, unroll=7)
        new = inner[-1]  # the last stage is the solution of order 5
        error = step * (jnp.asarray(_ERROR) @ k)
        scale = _ABSOLUTE + _RELATIVE * jnp.maximum(jnp.abs(y), jnp.abs(new))
        norm = still(jnp.sqrt(jnp.mean((error / scale) ** 2)))
        norm = jnp.where(jnp.isfinite(norm), norm, 1e10)
        # A piece without length is passed.
        accepted = (norm <= 1.0) | (still(step) <= 1e-14 * end)
        dense = step * (jnp.asarray(_DENSE) @ k)
        rise = new - y
        first = step * k[0] - rise
        second = rise - step * k[6] - first
        begin = begin.at[n].set(t)
        length = length.at[n].set(step)
        table = table.at[n].set(jnp.stack([y, rise, first, second, dense]))
        factor = jnp.clip(0.9 * jnp.maximum(norm, 1e-10) ** -0.2, 0.2, 5.0)
        h_next = still(step) * factor
        h_next = jnp.where(last & accepted, jnp.maximum(h_next, h), h_next)
        moved = accepted & (still(step) > 1e-14 * end)
        t = jnp.where(accepted, jnp.where(last, edge, t + step), t)
        y = jnp.where(moved, new, y)
        piece = jnp.where(accepted & last, piece + 1, piece)
        return (
            t,
            still(h_next),
            y,
            piece,
            jnp.where(moved, n + 1, n),
            tries + 1,
            begin,
            length,
            table,
        )

    def going(carry: Any) -> Array:
        _, h, _, piece, n, tries, *_ = carry
        return (piece < pieces) & (n < room) & (tries < room + room // 2) & (h > 1e-13 * end)

    start: Any = (
        drive.edges[0],
        1e-3 * (drive.edges[1] - drive.edges[0]),
        y0,
        jnp.asarray(0),
        jnp.asarray(0),
        jnp.asarray(0),
        jnp.full(room, jnp.inf),
        jnp.ones(room),
        jnp.zeros((room, 5, m)),
    )
    start = (start[0], still(start[1]), *start[2:])
    *_, piece, n, _, begin, length, table = jax.lax.while_loop(going, body, start)
    return _Dense(begin, length, table, n, piece >= pieces)


def _observed(
    motion: Motion, drive: Drive, values: Mapping[str, Array], dense: _Dense, times: Array
) -> Array:
    """F/W at the samples."""
    i = _step_of(dense, times)
    share = (times - dense.begin[i]) / dense.length[i]
    return _friction(motion, drive, values, dense, i, share, times)


def _averaged(
    motion: Motion, drive: Drive, values: Mapping[str, Array], dense: _Dense, edges: Array
) -> Array:
    """Mean F/W between neighbouring edges; 0 where there is no time between them."""
    numbers = jnp.arange(dense.begin.size)
    taken = numbers < dense.steps
    begin = jnp.where(taken, dense.begin, 0.0)
    # Means are differences of an integral: of what is small, they keep more digits.
    level = jax.lax.stop_gradient(
        _friction(motion, drive, values, dense, numbers[:1], jnp.zeros(1), begin[:1])
    )

    def integral(step: Array, share: Array) -> Array:
        """Of F/W from the beginning of a step to a share of its length."""
        total = jnp.zeros(share.shape)
        for node, weight in _GAUSS:
            at = begin[step] + node * share * dense.length[step]
            f = _friction(motion, drive, values, dense, step, node * share, at)
            total = total + weight * (f - level)
        return total * share * dense.length[step]

    whole = jnp.where(taken, integral(numbers, jnp.ones(numbers.size)), 0.0)
    before = jnp.cumsum(whole) - whole
    i = _step_of(dense, edges)
    rise = jnp.diff(before[i] + integral(i, (edges - begin[i]) / dense.length[i]))
    apart = jnp.diff(edges)
    return jnp.where(apart > 0, level + rise / jnp.where(apart > 0, apart, 1.0), 0.0)


def _step_of(dense: _Dense, times: Array) -> Array:
    """Step of the integrator that each time lies in."""
    begin = jax.lax.stop_gradient(dense.begin)
    i = jnp.clip(jnp.searchsorted(begin, times, side="right") - 1, 0)
    return jnp.minimum(i, dense.steps - 1)


def _friction(
    motion: Motion,
    drive: Drive,
    values: Mapping[str, Array],
    dense: _Dense,
    step: Array,
    share: Array,
    times: Array,
) -> Array:
    """F/W at times, each a share of the length of a step after its beginning."""
    x = share

    def state(i: int) -> Array:
        # Each state by itself: those that the force does not depend on are not computed.
        c = [dense.coefficients[:, j, i][step] for j in range(5)]
        return c[0] + x * (c[1] + (1 - x) * (c[2] + x * (c[3] + (1 - x) * c[4])))

    y = [state(i) for i in range(dense.coefficients.shape[2])]
    piece = jnp.searchsorted(jax.lax.stop_gradient(drive.edges), times, side="right") - 1
    piece = jnp.clip(piece, 0, drive.pull.shape[0] - 1)
    at = _excitation(drive, values, piece, times)
    load = drive.load[piece] + drive.load_slope[piece] * (times - drive.edges[piece])
    return motion.force(jnp.stack(y), at) / load
