"""Memory mappings of loaded programs, and how large programs are compiled."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from asperity import _jax


@pytest.mark.parametrize(("used", "times"), [(40_000, 1), (10_000, 0)])
def test_programs_are_dropped_near_the_limit_only(monkeypatch, used, times):
    calls = []
    monkeypatch.setattr(jax, "clear_caches", lambda: calls.append(True))
    monkeypatch.setattr(_jax, "_mappings", lambda: (used, 65_530))
    monkeypatch.setattr(_jax, "_loaded", _jax._OFTEN)
    _jax.spare_mappings()
    _jax.spare_mappings()  # not again before more programs are loaded
    assert len(calls) == times


def test_every_program_counts(monkeypatch):
    _jax.configure()
    monkeypatch.setattr(_jax, "_loaded", 0)
    jax.jit(lambda x: jnp.cos(x) * 0.377 + 1.1)(jnp.ones(5)).block_until_ready()
    assert _jax._loaded > 0


def wave(x, *, order):
    return (jnp.sin(x) ** order).sum()


@pytest.mark.parametrize("options", [_jax._LARGE, {"xla_no_such_option": True}])
def test_large_programs_compute_the_same_wherever_they_are_called(monkeypatch, options):
    monkeypatch.setattr(_jax, "_LARGE", options)
    _jax._takes_options.cache_clear()
    large = _jax.jit_large(wave, static_argnames=("order",))
    x = jnp.linspace(0.0, 1.0, 7)
    cubes = np.sin(x) ** 3
    np.testing.assert_allclose(large(x, order=3), cubes.sum(), rtol=1e-13)
    within = jax.jit(lambda y: 2 * large(y, order=3))
    np.testing.assert_allclose(within(x), 2 * cubes.sum(), rtol=1e-13)
    slope = jax.grad(lambda y: large(y, order=3))(x)
    np.testing.assert_allclose(slope, 3 * np.sin(x) ** 2 * np.cos(x), rtol=1e-13)
    _jax._takes_options.cache_clear()


def test_this_xla_knows_the_options():
    _jax._takes_options.cache_clear()
    assert _jax._takes_options()
