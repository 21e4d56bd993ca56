"""Integration of the motion through a recording, with derivatives.

The integrator is the Rosenbrock method Rodas5P (G. Steinebach, BIT Numer. Math. 63, 27, 2023) of
order 5, with adaptive steps that end at every change of the drive, and its continuous extension. It
is L-stable: on a stiff machine the spring relaxes within a small part of the slip between samples,
and an explicit method would take steps at its limit of stability, where the motion is accurate and
its derivatives are not.

Derivatives are those of the discrete solution at its steps; the ends of steps move with the changes
of the drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree

from asperity.algebra.runge_kutta import rodas_5p
from asperity.algebra.small_systems import apply, inverse_points
from asperity.inference.runs.drive import Drive, excitation, shifted
from asperity.inference.runs.gauge import GAIN
from asperity.slider.motion import Motion
from asperity.slider.parameters import slider_from

#: Relative and absolute local error of a step, for states of order 1.
_RELATIVE, _ABSOLUTE = 1e-7, 1e-9
#: Number of steps that are differentiated in parallel.
_IN_PARALLEL = 64
#: Keys of the departures of the initial states, and of the delays of the edges of the drive.
START, SHIFT = "start", "shift"
#: All programs can differentiate in these parameters, so that fewer programs are compiled.
_ALWAYS_FREE = ("K", GAIN)
#: Numbers of derivatives are padded to a multiple of this.
_DERIVATIVES_PADDED = 4


class Free(eqx.Module):
    """Parameters of the derivatives.

    Names of parameters of law, machine and gauge are constants of a compiled program. Free initial
    states and changes of the drive, and the number of derivatives, are given by arrays: recordings
    with few and with many changes share a program.

    Attributes
    ----------
    names : tuple of str
        Free parameters of law, machine and gauge.
    directions : array, shape (derivatives, names + states + edges)
        Directions in the space of these parameters, the initial states and the edges of the drive;
        padded with zeros.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    directions: Any

    def numbers(self, given: Mapping[str, Any]) -> Array:
        """All numbers that derivatives may refer to: parameters, initial states, edges."""
        named = jnp.array([given[name] for name in self.names], float)
        return jnp.concatenate([named, given[START], given[SHIFT]])

    def values(self, given: Mapping[str, Any], x: Array) -> dict[str, Array]:
        """The given numbers, with those of `numbers` replaced by `x`."""
        edges = x.size - given[SHIFT].size
        named = dict(zip(self.names, x, strict=False))
        return {**given, **named, START: x[len(self.names) : edges], SHIFT: x[edges:]}


def arranged(
    values: Mapping[str, Any], wanted: Sequence[str], states: int, edges: int, module: Any = np
) -> tuple[dict[str, Any], Free]:
    """All numbers of a motion, with initial states and edges as arrays, and the wanted derivatives.

    Parameters
    ----------
    values : mapping of str to float or array, shape ()
        Numbers by name; `start_force` and `start_state_i` are departures of the initial states,
        `shift_j` is the delay of the j-th edge of the drive, 0 by default.
    wanted : sequence of str
        Names for derivatives.
    states, edges : int
    module : module
        NumPy, or JAX if values are traced.
    """
    starts = ("start_force", *(f"start_state_{i}" for i in range(states - 1)))
    shifts = tuple(f"shift_{j}" for j in range(edges))
    in_arrays = {*starts, *shifts}
    names = tuple(sorted({*wanted, *_ALWAYS_FREE} - in_arrays))
    place = {name: i for i, name in enumerate((*names, *starts, *shifts))}
    directions = np.zeros(
        (-(-len(wanted) // _DERIVATIVES_PADDED) * _DERIVATIVES_PADDED, len(place))
    )
    for row, name in enumerate(wanted):
        directions[row, place[name]] = 1.0
    # As an array: a plain number would be a constant of the program.
    given = {n: v for n, v in {GAIN: np.ones(()), **values}.items() if n not in in_arrays}
    for key, members in ((START, starts), (SHIFT, shifts)):
        given[key] = module.stack([module.asarray(values.get(n, 0.0), float) for n in members])
    return given, Free(names, directions)


class Curve(NamedTuple):
    """Steps with the coefficients of the continuous extension, padded to the room for steps."""

    begin: Array
    length: Array
    coefficients: Array


def integrated(
    motion: Motion, free: Free, given: dict[str, Any], drive: Drive, room: int
) -> tuple[Curve, Curve, Array, Array]:
    """The motion, its derivatives, its number of steps, and whether the end was reached.

    The derivatives of a step depend on earlier steps only through the states at its beginning. They
    are computed for many steps in parallel and then accumulated. The first axis of derivatives is
    that of the directions.
    """

    def first_states(x: Array) -> Array:
        values = free.values(given, x)
        return with_values(motion, values).steady() + values[START]

    x, drawn = free.numbers(given), shifted(drive, given)
    taken, curve, steps, done = _steps_taken(with_values(motion, given), drawn, given, room)
    count, m = len(free.directions), taken.states.shape[1]
    nothing = jax.tree.map(lambda all_: jnp.zeros((count, *all_.shape)), curve)
    if not count:
        return curve, nothing, steps, done
    # The steps do not depend on the gauge.
    names = tuple(name for name in free.names if name != GAIN)
    numbers = jnp.stack([given[name] for name in names])
    directions = jnp.asarray(free.directions)
    by_names = directions[:, jnp.asarray([free.names.index(name) for name in names])]
    by_edges = directions[:, -drawn.edges.size :]

    def slopes_of(part: _Step, change: Array) -> tuple[Array, Curve]:
        """Derivatives of the states after a part of the steps, and of the motion at these steps."""

        def one(step: _Step) -> tuple[Array, Curve]:
            """Derivatives along the directions, and to the states at the beginning of the step.

            A step depends on two edges only: those of its piece.
            """
            ends = step.piece + jnp.arange(2)
            piece = [all_[step.piece][None] for all_ in drawn[1:]]

            def moved(numbers: Array, edges: Array, y: Array) -> tuple[Array, Curve]:
                values = {**given, **dict(zip(names, numbers, strict=True))}
                now, begin = with_values(motion, values), edges[0] + step.since
                length = jnp.where(step.last, edges[1] - begin, step.length)
                new, _, rows = _stepped(
                    now, Drive(edges, *piece), values, jnp.asarray(0), begin, length, y
                )
                return new, Curve(begin, length, rows)

            at = numbers, drawn.edges[ends], step.states
            flat, parts = ravel_pytree(at)
            each = jax.vmap(lambda unit: jax.jvp(moved, at, parts(unit))[1])(jnp.eye(flat.size))
            weights = jnp.concatenate([by_names, by_edges[:, ends]], axis=1)
            weights = jax.scipy.linalg.block_diag(weights, jnp.eye(m))
            return jax.tree.map(lambda all_: jnp.tensordot(weights, all_, 1), each)

        after, result = jax.vmap(one, 0, 1)(part)

        def onwards(dy: Array, block: Array) -> tuple[Array, Array]:
            return block[:count] + jnp.sum(dy[:, :, None] * block[count:], axis=1), dy

        change, before = jax.lax.scan(onwards, change, jnp.moveaxis(after, 1, 0))
        by_states = jnp.moveaxis(before, 0, 1)[..., None, None]
        whole = jnp.sum(by_states * result.coefficients[count:].swapaxes(0, 1), axis=2)
        return change, Curve(
            result.begin[:count], result.length[:count], result.coefficients[:count] + whole
        )

    def body(carry: Any) -> Any:
        first, change, slopes = carry
        part = jax.tree.map(
            lambda all_: jax.lax.dynamic_slice_in_dim(all_, first, _IN_PARALLEL), taken
        )
        change, result = slopes_of(part, change)
        slopes = jax.tree.map(
            lambda all_, new: jax.lax.dynamic_update_slice_in_dim(all_, new, first, 1),
            slopes,
            result,
        )
        return first + _IN_PARALLEL, change, slopes

    def begin(direction: Array) -> Array:
        return jax.jvp(first_states, (x,), (direction,))[1]

    start = jnp.asarray(0), jax.vmap(begin)(free.directions), nothing
    *_, slopes = jax.lax.while_loop(lambda carry: carry[0] < steps, body, start)
    return curve, slopes, steps, done


class _Step(NamedTuple):
    """The beginning of a step.

    Attributes
    ----------
    piece : int array
        Piece of the drive.
    since, length : array
        Time since the beginning of the piece, and length of the step (s).
    last : bool array
        Whether the step ends with the piece.
    states : array
    """

    piece: Array
    since: Array
    length: Array
    last: Array
    states: Array


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
    table, size = rodas_5p(), y.size

    def rates(at: Array, state: Array) -> Array:
        return motion.rates(state, excitation(drive, values, piece, at))

    def along(direction: Array) -> Array:
        return jax.jvp(rates, (begin, y), (direction[0], direction[1:]))[1]

    by_time, *columns = jax.vmap(along)(jnp.eye(size + 1))
    diagonal = 1 / (table.gamma * length)
    inverse = inverse_points(
        [[diagonal * (i == j) - columns[j][i] for j in range(size)] for i in range(size)]
    )

    def solved(stages: Array, row: Any) -> tuple[Array, None]:
        k, node, A, C, weight = row
        right = rates(begin + node * length, y + A @ stages) + length * weight * by_time
        # Explicit sums: products of such small matrices would take most of the time.
        stage = apply(inverse, right + C @ stages / length)
        return stages.at[k].set(jnp.stack(stage)), None

    # A loop: the law is compiled once and not for each stage.
    rows = np.arange(len(table.nodes)), table.nodes, table.A, table.C, table.by_time
    stages, _ = jax.lax.scan(solved, jnp.zeros((len(table.nodes), size)), rows)
    new = y + table.A[-1] @ stages + stages[-1]
    coefficients = jnp.stack([y, new - y, *(table.dense @ stages)])
    return new, stages[-1], coefficients


def _steps_taken(
    motion: Motion, drive: Drive, values: Mapping[str, Array], room: int
) -> tuple[_Step, Curve, Array, Array]:
    """The steps, the motion at them, their number, and whether the end was reached."""
    pieces = drive.pull.shape[0]
    y0 = motion.steady() + values[START]
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
        # A piece without length is skipped.
        accepted = (norm <= 1.0) | (step <= 1e-14 * end)
        this = _Step(piece, t - drive.edges[piece], step, last, y)
        kept = jax.tree.map(lambda all_, one: all_.at[n].set(one), kept, this)
        curve = jax.tree.map(lambda all_, one: all_.at[n].set(one), curve, Curve(t, step, rows))
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

    zero, first = jnp.asarray(0), 1e-3 * (drive.edges[1] - drive.edges[0])
    # The padding is differentiated with the other steps, so that its steps have a length.
    padding = (
        _Step(zero, jnp.asarray(0.0), first, jnp.asarray(False), y0),
        Curve(jnp.asarray(jnp.inf), jnp.asarray(1.0), jnp.zeros((5, *y0.shape))),
    )
    taken = jax.tree.map(lambda one: jnp.broadcast_to(one, (room, *one.shape)), padding)
    start = drive.edges[0], first, y0, zero, zero, zero
    *_, piece, n, _, kept, curve = jax.lax.while_loop(going, body, (*start, *taken))
    # A last piece that was skipped has left a step without length.
    kept, curve = jax.tree.map(lambda all_, one: all_.at[n].set(one), (kept, curve), padding)
    return kept, curve, n, piece >= pieces


def with_values(motion: Motion, values: Mapping[str, Array]) -> Motion:
    """The equation of motion with new numbers of the law and the slider."""
    damping: dict[str, Any] = {name: values[name] for name in ("eta",) if name in values}
    return replace(motion, slider=slider_from(type(motion.slider.law), values), **damping)
