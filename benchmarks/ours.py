"""The rows of asperity on one core."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

import asperity as asp
from asperity.loads import Harmonic
from asperity.slider import QuasiStatic
from asperity.solve import harmonic_response
from benchmarks.cases import FREQUENCY, Batch, batch
from benchmarks.clock import timed
from benchmarks.equations import Answer
from benchmarks.peers import reference
from benchmarks.table import Row

#: Points in a block of the rows that are compiled here: their arrays fit into a core's cache.
_BLOCK = 240
_NODES = 32


def respond(points: Batch, **options) -> asp.solve.PeriodicResponse:
    """The periodic response of a batch."""
    return asp.periodic_response(
        points.slider(),
        velocity=points.velocity,
        epsilon=points.epsilon,
        frequency=FREQUENCY,
        **options,
    )


def _answer(found: asp.solve.PeriodicResponse) -> Answer:
    """The form in which all are compared; every point must have converged."""
    if not found.converged.all():
        raise RuntimeError(f"{(~found.converged).sum()} points of the batch did not converge")
    return Answer(found.mean_friction, found.mu1, found.mu2, found.multipliers.T)


def response_row(law: str, points: int, repeats: int, what: str, **options) -> Row:
    """`periodic_response`, with mean, eight harmonics and multipliers."""
    everything = batch(law, points)
    seconds, found = timed(lambda: respond(everything, workers=1, **options), repeats)
    row = Row(f"{what}, {law}", points, seconds)
    return row.with_errors(_answer(found), reference(batch, law, points))


def _blocks(points: Batch) -> tuple[QuasiStatic, Harmonic]:
    """System and load of the batch, sorted as the search does, in blocks."""
    whole = len(points) - len(points) % _BLOCK
    part = points.part(np.argsort(points.velocity)[:whole] if whole else np.zeros(_BLOCK, int))
    system = QuasiStatic(part.slider(), part.velocity, 2 * np.pi * FREQUENCY)

    def shaped(value) -> jax.Array:
        return jnp.asarray(np.broadcast_to(np.asarray(value, float), len(part)).reshape(-1, _BLOCK))

    return jax.tree.map(shaped, (system, Harmonic(part.epsilon)))


def rates_row(law: str, points: int, repeats: int) -> Row:
    """One evaluation of the right-hand side on a grid of 32 nodes, block by block."""
    inputs = _blocks(batch(law, points))
    theta = jnp.asarray(2 * np.pi * (np.arange(_NODES) + 0.5) / _NODES)[:, None]
    share = np.full(_NODES, 1 / _NODES)

    def rates(block: tuple[QuasiStatic, Harmonic]) -> jax.Array:
        system, load = block
        # Different at every node, or exponentials would be taken once for all.
        states = system.steady()[:, None] + 1e-3 * jnp.cos(theta)
        values = system.rates(states, load.at(theta))
        # Only means leave the cache: writing all values to memory would cost three times as much.
        return jnp.stack([share @ rate for rate in values])

    compiled = jax.jit(lambda inputs: jax.lax.map(rates, inputs))
    seconds, _ = timed(lambda: jax.block_until_ready(compiled(inputs)), repeats)
    return Row(f"right-hand side on {_NODES} nodes, {law}", inputs[1].epsilon.size, seconds)


def gradient_rows(law: str, points: int, repeats: int) -> list[Row]:
    """mu1 by the differentiable solve, and its gradient to all parameters in reverse mode."""
    inputs = _blocks(batch(law, points))

    def mu1(block: tuple[QuasiStatic, Harmonic]) -> jax.Array:
        _, harmonics = harmonic_response(*block)
        return jnp.abs(harmonics[0]).sum()

    rows = []
    for what, function in (("mu1 alone", mu1), ("gradient of mu1", jax.grad(mu1))):
        compiled = jax.jit(lambda inputs, function=function: jax.lax.map(function, inputs))
        seconds, _ = timed(
            lambda compiled=compiled: jax.block_until_ready(compiled(inputs)), repeats
        )
        rows.append(Row(f"{what}, {law}", inputs[1].epsilon.size, seconds))
    ratio = rows[1].microseconds / rows[0].microseconds
    first, second = rows
    return [first, Row(second.what, second.points, second.seconds, note=f"{ratio:.2f} x forward")]


def sensitivities_row(law: str, points: int) -> Row:
    """All outputs to all parameters, by the robust method."""
    part = batch(law, points)

    def run() -> asp.solve.Sensitivities:
        return asp.sensitivities(
            part.slider(), velocity=part.velocity, epsilon=part.epsilon, frequency=FREQUENCY
        )

    return Row(f"sensitivities, {law}", points, timed(run, 1)[0])
