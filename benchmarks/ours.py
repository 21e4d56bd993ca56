"""The rows of asperity on one core."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

import asperity as asp
from asperity.loads import Harmonic
from asperity.slider import QuasiStatic
from benchmarks.cases import FREQUENCY, Batch, batch
from benchmarks.clock import timed
from benchmarks.equations import Answer
from benchmarks.peers import reference
from benchmarks.table import Row

#: Points in a block of the programs compiled here: the arrays fit into the cache of a core.
_BLOCK = 240
_NODES = 32


def respond(points: Batch, **options) -> asp.orbit.PeriodicResponse:
    """The periodic response of a batch."""
    return asp.periodic_response(
        points.slider(),
        velocity=points.velocity,
        epsilon=points.epsilon,
        frequency=FREQUENCY,
        **options,
    )


def _answer(response: asp.orbit.PeriodicResponse) -> Answer:
    """The response in the form that is compared; every point must have converged."""
    if not response.converged.all():
        raise RuntimeError(f"{(~response.converged).sum()} points of the batch did not converge")
    return Answer(response.mean_friction, response.mu1, response.mu2, response.multipliers.T)


def response_row(law: str, points: int, repeats: int, what: str, **options) -> Row:
    """`periodic_response`, with mean, eight harmonics and multipliers."""
    whole = batch(law, points)
    seconds, response = timed(lambda: respond(whole, workers=1, **options), repeats)
    row = Row(f"{what}, {law}", points, seconds)
    return row.with_errors(_answer(response), reference(batch, law, points))


def _blocks(points: Batch) -> tuple[QuasiStatic, Harmonic]:
    """System and load of the batch in blocks, sorted like the search sorts them."""
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
        # States differ at every node; the compiler would compute equal exponentials only once.
        states = system.steady()[:, None] + 1e-3 * jnp.cos(theta)
        values = system.rates(states, load.at(theta))
        # Only means leave the cache; writing all values to memory would take three times as long.
        return jnp.stack([share @ rate for rate in values])

    compiled = jax.jit(lambda inputs: jax.lax.map(rates, inputs))
    seconds, _ = timed(lambda: jax.block_until_ready(compiled(inputs)), repeats)
    return Row(f"right-hand side on {_NODES} nodes, {law}", inputs[1].epsilon.size, seconds)


def gradient_rows(law: str, points: int, repeats: int) -> list[Row]:
    """Mean and two harmonics, and these with their derivatives by all parameters, as in a fit.

    The errors of the second row are those of the derivatives by the logarithm of A, compared with
    Richardson's extrapolation of differences of `periodic_response`.
    """
    part = batch(law, points)
    slider = part.slider()
    fields = dataclasses.fields(slider.law)
    parameters = {f.name.rstrip("_"): float(getattr(slider.law, f.name)) for f in fields}
    parameters |= {name: float(getattr(slider, name)) for name in ("K", "W0", "M")}
    parameters |= {"V": part.velocity, "epsilon": part.epsilon, "frequency": FREQUENCY}
    model = asp.response_function(law)
    forward = timed(lambda: jax.block_until_ready(model(parameters)), repeats)
    with_slopes = timed(
        lambda: jax.block_until_ready(model.value_and_jacobian(parameters)), repeats
    )
    exact = respond(part)
    row = Row(f"mean and two harmonics, {law}", points, forward[0])
    first = _with_errors(row, forward[1], exact.mean_friction, exact.harmonics)
    slope = jax.tree.map(lambda a: a * parameters["A"], with_slopes[1][1]["A"])
    note = f"{with_slopes[0] / forward[0]:.2f} x forward"
    second = Row(f"the same with all derivatives, {law}", points, with_slopes[0], note=note)
    return [first, _with_errors(second, slope, *_slopes(part))]


def _with_errors(row: Row, values: asp.orbit.ResponseValues, mean, harmonics) -> Row:
    """Errors relative to the largest of all points."""
    size = np.abs(harmonics[:, :2]).max(0)
    mu1, mu2 = np.abs(np.asarray(values.harmonics) - harmonics[:, :2]).max(0) / size
    error = np.abs(np.asarray(values.mean_friction) - mean).max() / np.abs(mean).max()
    return dataclasses.replace(row, mean=float(error), mu1=float(mu1), mu2=float(mu2))


def _slopes(part: Batch) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of mean and harmonics by the logarithm of A, from differences."""

    def at(change: float) -> np.ndarray:
        slider = part.slider()
        law = dataclasses.replace(slider.law, A=slider.law.A * (1 + change))
        response = asp.periodic_response(
            asp.Slider(law, spring=slider.K, load=slider.W0, mass=slider.M),
            velocity=part.velocity,
            epsilon=part.epsilon,
            frequency=FREQUENCY,
        )
        return np.column_stack([response.mean_friction, response.harmonics[:, :2]])

    coarse, fine = ((at(h) - at(-h)) / (2 * h) for h in (2e-3, 1e-3))
    slopes = (4 * fine - coarse) / 3
    return slopes[:, 0].real, slopes[:, 1:]


def sensitivities_row(law: str, points: int) -> Row:
    """Derivatives of all outputs by all parameters, by the robust method."""
    part = batch(law, points)

    def run() -> asp.orbit.Sensitivities:
        return asp.sensitivities(
            part.slider(), velocity=part.velocity, epsilon=part.epsilon, frequency=FREQUENCY
        )

    return Row(f"sensitivities, {law}", points, timed(run, 1)[0])
