"""What `import asperity` offers, what it costs, and how programs are compiled and loaded."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import asperity
from asperity import _jax


def run(script: str, **environment: str) -> str:
    """Standard output of a fresh interpreter."""
    done = subprocess.run(
        [sys.executable, "-c", script],
        check=True,
        capture_output=True,
        text=True,
        env=os.environ | environment,
    )
    return done.stdout.strip()


#: Rooms from the lightest to the heaviest; what is not loaded after one was not loaded before.
LOADED = """
import sys

def absent(*names):
    assert [name for name in names if name in sys.modules] == []

import asperity
asperity.__version__
absent("jax", "numpy", "pint", "pydantic", "scipy")
from asperity.units import to_si
to_si("1 um/s", "velocity", "x")
to_si("120 Hz", "frequency", "x")
import asperity.parameters
import asperity.materials
absent("jax", "pint", "pydantic")
assert asperity.materials.load("bureau2000").K == 2e5
absent("jax", "pint")
import asperity.air
absent("scipy")
to_si("1 inch/s", "velocity", "x")  # an unusual spelling
assert "pint" in sys.modules
"""


def test_a_room_loads_nothing_heavy_that_it_does_not_need() -> None:
    run(LOADED)


@pytest.mark.parametrize("name", asperity.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(asperity, name) is not None
    assert name in dir(asperity)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'sliders'"):
        _ = asperity.sliders


CONFIGURE = """
import jax
chosen = None
{}
from asperity._jax import configure
folder = configure()
assert configure() is folder
assert jax.numpy.ones(1).dtype == "float64"
jax.jit(lambda x: x * 3 + 1)(2.0)
print(folder)
print(jax.config.jax_default_device is chosen or jax.config.jax_default_device)
"""

#: By case: Python before `configure`, the environment, the folder of programs and the device.
STARTS = {
    "nothing said": ("", {"JAX_COMPILATION_CACHE_DIR": "{}/chosen"}, "{}/chosen", "cpu"),
    "platform chosen, the user's cache folder": (
        "",
        {"JAX_PLATFORMS": "cpu", "XDG_CACHE_HOME": "{}"},
        "{}/asperity/jax",
        "True",
    ),
    "device chosen, no writable folder": (
        "chosen = jax.devices()[0]; jax.config.update('jax_default_device', chosen)",
        {"JAX_COMPILATION_CACHE_DIR": "{}/file/below"},
        "None",
        "True",
    ),
}


@pytest.mark.parametrize("case", STARTS)
def test_where_compiled_programs_are_kept_and_run(tmp_path: Path, case: str) -> None:
    """On the CPU unless another device is chosen, and in a cache wherever that can be written."""
    before, environment, folder, device = STARTS[case]
    (tmp_path / "file").write_text("", encoding="utf-8")
    given = {name: value.format(tmp_path) for name, value in environment.items()}
    unset = {"JAX_COMPILATION_CACHE_DIR": "", "JAX_PLATFORMS": ""}
    folder = folder.format(tmp_path)
    assert run(CONFIGURE.format(before), **unset | given).splitlines() == [folder, device]
    assert folder == "None" or any(Path(folder).iterdir())


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
    large = _jax.jit_large(wave, static_argnames=("order",))
    x = jnp.linspace(0.0, 1.0, 7)
    cubes = np.sin(x) ** 3
    np.testing.assert_allclose(large(x, order=3), cubes.sum(), rtol=1e-13)
    within = jax.jit(lambda y: 2 * large(y, order=3))
    np.testing.assert_allclose(within(x), 2 * cubes.sum(), rtol=1e-13)
    slope = jax.grad(lambda y: large(y, order=3))(x)
    np.testing.assert_allclose(slope, 3 * np.sin(x) ** 2 * np.cos(x), rtol=1e-13)


def test_an_option_that_this_xla_does_not_know_is_left_out(monkeypatch):
    ours = tuple(_jax._LARGE)
    monkeypatch.setattr(_jax, "_LARGE", {"xla_no_such_option": True, **_jax._LARGE})
    known = _jax.known_options(("xla_no_such_option", *ours))
    assert "xla_no_such_option" not in known
    assert set(ours[1:]) <= set(known)  # the first is gone in newer releases of XLA
