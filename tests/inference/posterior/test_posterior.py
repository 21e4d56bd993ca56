"""Posteriors: the sampler on known densities, and a posterior against its integral."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from arviz_stats.base import array_stats
from benchmarks.coverage import CASES, TRUE, runs_of
from scipy.integrate import quad
from scipy.special import ndtri

from asperity.errors import InputError
from asperity.inference import Prior, RunOptions, fit
from asperity.inference.posterior import sample_posterior
from asperity.inference.posterior.density import Coordinates, Whitened
from asperity.inference.posterior.sampling import next_block, warmed_up
from asperity.outputs import Interrupted


def half_normal(z, data):
    """x = exp(z_0) half-normal, z_1 normal about x^2 / 4: curved, with its Jacobian."""
    x = jnp.exp(z[0])
    return -0.5 * x**2 + z[0] - 0.5 * (z[1] - x**2 / 4) ** 2


def gap(z, data):
    """A standard normal that cannot be computed beyond three."""
    return jnp.where(z[0] > 3.0, jnp.nan, -0.5 * z[0] ** 2)


def drawn(density, start, blocks):
    state, _ = warmed_up(density, 0.0, np.asarray(jax.random.key_data(jax.random.key(5))), start)
    kept = []
    for _ in range(blocks):
        state, transitions = next_block(density, 0.0, state)
        kept.append(transitions)
    return [np.concatenate(part) for part in zip(*kept, strict=True)]


def test_the_sampler_draws_from_the_density():
    z, *_ = drawn(half_normal, np.zeros(2), 80)
    x = np.exp(z[:, 0])
    for values, exact in ((x, math.sqrt(2 / math.pi)), (x**2, 1.0), (z[:, 1], 0.25)):
        error = values.std() / math.sqrt(array_stats.ess(values[None], method="mean"))
        assert abs(values.mean() - exact) < 4 * error
    # Quantiles of the half-normal distribution.
    for p in (0.16, 0.5, 0.84):
        assert np.mean(x < ndtri(0.5 + p / 2)) == pytest.approx(p, abs=0.04)


def test_where_the_density_cannot_be_computed_there_are_no_draws():
    z, log_density, *_, failed, _ = drawn(gap, np.zeros(1), 40)
    assert np.isfinite(log_density).all()
    assert z.max() <= 3
    assert 0 < failed.sum() < 0.2 * failed.size
    assert z.std() == pytest.approx(1.0, abs=0.1)


def test_coordinates_carry_densities_over():
    coordinates = Coordinates(*(np.array([x]) for x in (-1.0, 2.0, False, 1.0, 0.0, 0.0)))
    np.testing.assert_allclose(
        coordinates.to_u(coordinates.to_q(np.array([0.7]))), [0.7], rtol=1e-12
    )

    def carried(q):
        q = np.array([q])
        x = float(coordinates.to_u(q)[0])
        return math.exp(-0.5 * x**2 + float(coordinates.log_slope(q)[0]))

    expected = quad(lambda x: math.exp(-0.5 * x**2), -1, 2)[0]
    assert quad(carried, -40, 40, limit=400, points=[0.0])[0] == pytest.approx(expected, rel=1e-6)


@pytest.fixture(scope="module")
def result(readings, pmma):
    return fit(readings(11), "elasto-plastic", ("lambda", "eps_ratio"), material=pmma)


SAMPLED = {"chains": 2, "draws": 250, "seed": 3, "jobs": 1}


@pytest.fixture(scope="module")
def posterior(result):
    return sample_posterior(result, **SAMPLED)


def test_a_posterior_is_the_normalised_likelihood(result, posterior, tmp_path):
    assert not posterior.failed.any()
    # By quadrature over a grid, in the coordinates in which the prior is flat.
    values = result.values
    se = {n: p.se / p.value for n, p in result.parameters.items()}
    # lambda may be zero, so that its prior is flat in itself; that of eps_ratio in the logarithm.
    x = values["lambda"] * (1 + se["lambda"] * np.linspace(-6, 6, 13))
    y = values["eps_ratio"] * np.exp(se["eps_ratio"] * np.linspace(-6, 6, 13))
    chi2 = [
        [
            result.objective.chi2(result.objective.coordinates({"lambda": a, "eps_ratio": b}))
            for b in y
        ]
        for a in x
    ]
    weight = np.exp(-0.5 * (np.array(chi2) - result.chi2))
    for name, grid, axis in (("lambda", x, 1), ("eps_ratio", y, 0)):
        marginal = weight.sum(axis) / weight.sum()
        mean = float(marginal @ grid)
        sd = math.sqrt(float(marginal @ (grid - mean) ** 2))
        p = posterior.parameters[name]
        assert p.r_hat < 1.03
        assert p.mean == pytest.approx(mean, abs=5 * sd / math.sqrt(p.ess_bulk))
        assert p.sd == pytest.approx(sd, rel=0.15)
    posterior.to_netcdf(tmp_path / "draws.nc")
    tree = xr.open_datatree(tmp_path / "draws.nc", engine="h5netcdf")
    np.testing.assert_array_equal(tree["posterior"]["lambda"], posterior.draws["lambda"])
    assert tree["posterior"]["lambda"].attrs["units"] == "m"
    assert set(tree["sample_stats"]) >= {"lp", "diverging", "energy", "acceptance_rate"}
    tree.close()


@pytest.mark.long
def test_draws_do_not_depend_on_the_number_of_processes(result, posterior):
    again = sample_posterior(result, **{**SAMPLED, "draws": 100, "jobs": 2})
    for name, draws in posterior.draws.items():
        np.testing.assert_array_equal(again.draws[name], draws[:, :100])


def test_an_interrupted_run_says_so(result):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="nothing was written"):
        sample_posterior(result, **SAMPLED, progress=stop)


def test_what_cannot_be_sampled_is_refused(result):
    with pytest.raises(InputError, match="chains must be at least 2"):
        sample_posterior(result, chains=1)
    with pytest.raises(InputError, match="seed must be at least 0"):
        sample_posterior(result, seed=-1)


@pytest.fixture(scope="module")
def steps():
    (run,) = runs_of(CASES["steps"], 1)
    return run


#: Means over blocks, behind the low-pass of a gauge.
THROUGH_GAUGE = RunOptions(fit_rate=2.5, gauge=(2, 1.0))


def fit_of_steps(run, options=None, prior=None):
    free = ["A", "B", "D0"]
    return fit(run, "rice-ruina", free, start=TRUE, starts=1, runs=options, prior=prior)


def test_a_posterior_of_nothing_is_refused(result):
    with pytest.raises(InputError, match="posterior must be of free parameters, got none"):
        sample_posterior(replace(result, parameters={}))


@pytest.mark.long
@pytest.mark.parametrize(
    ("options", "samples"),
    [
        (RunOptions(fit_rate=2.5), 350),
        (THROUGH_GAUGE, 350),
        # At 14 Hz: between the samples, and as many times as the other gauge has, filled up.
        (RunOptions(gauge=(1, 1.75)), 1400),
    ],
)
def test_the_likelihood_of_means_and_through_a_gauge_is_that_of_the_fit(steps, options, samples):
    result = fit_of_steps(steps, options)
    (term,) = result.objective.terms
    assert result.observables["friction"][1] == samples
    residuals, data = term.compiled(result.objective.names)

    @jax.jit
    @jax.value_and_grad
    def compiled_of(A):
        return -0.5 * jnp.sum(residuals({**result.values, "A": A}, data) ** 2)

    def both(factor):
        values = result.values | {"A": factor * result.values["A"]}
        compiled = compiled_of(values["A"])
        expected = term.residuals(values)
        j = list(values).index("A")
        return compiled, (-0.5 * expected.values @ expected.values, expected, j)

    one, other = both(1.0), both(1.01)
    assert float(one[0][0] - other[0][0]) == pytest.approx(one[1][0] - other[1][0], abs=1e-6)
    for (_, gradient), (_, r, j) in (one, other):
        # Near the minimum the sum is far smaller than its terms.
        slope = r.jacobian[:, j]
        least = 1e-9 * np.linalg.norm(r.values) * np.linalg.norm(slope)
        assert float(gradient) == pytest.approx(-r.values @ slope, rel=1e-6, abs=least)


def test_the_density_of_a_recording_is_that_of_its_fit(steps):
    result = fit_of_steps(steps, THROUGH_GAUGE, {"gain": Prior(1.0, 0.02, "calibration")})
    whitened = Whitened.of(result)
    density, data = whitened.compiled()
    both = jax.jit(jax.value_and_grad(density))
    drawn = np.random.default_rng(0).normal(size=(2, whitened.mode.size))
    first, second = ((both(z, data), whitened.log_density(z)) for z in drawn)
    # The fit whitens and differentiates by NumPy. Both leave out the same constant.
    assert float(first[0][0] - second[0][0]) == pytest.approx(first[1][0] - second[1][0], abs=1e-6)
    for (_, gradient), (_, expected) in (first, second):
        np.testing.assert_allclose(gradient, expected, atol=1e-5)
