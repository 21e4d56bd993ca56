"""Loaded programs are dropped before the system refuses the process more memory mappings."""

import jax
import jax.numpy as jnp
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
