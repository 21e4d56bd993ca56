"""What `import asperity` offers, and what it costs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import asperity


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


def test_importing_the_package_loads_nothing_heavy() -> None:
    script = (
        "import sys, asperity; asperity.__version__\n"
        "print([m for m in ('jax', 'numpy', 'pint', 'pydantic', 'scipy') if m in sys.modules])"
    )
    assert run(script) == "[]"


@pytest.mark.parametrize("name", asperity.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(asperity, name) is not None
    assert name in dir(asperity)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'sliders'"):
        _ = asperity.sliders


CONFIGURE = (
    "import jax\nfrom asperity._jax import configure\nfolder = configure()\n"
    "assert configure() is folder\nassert jax.numpy.ones(1).dtype == 'float64'\n"
    "jax.jit(lambda x: x * 3 + 1)(2.0)\nprint(folder)"
)


def test_compiled_programs_are_kept(tmp_path: Path) -> None:
    chosen = tmp_path / "chosen"
    assert run(CONFIGURE, JAX_COMPILATION_CACHE_DIR=str(chosen)) == str(chosen)
    assert any(chosen.iterdir())


def test_the_cache_follows_the_users_cache_folder(tmp_path: Path) -> None:
    folder = run(CONFIGURE, JAX_COMPILATION_CACHE_DIR="", XDG_CACHE_HOME=str(tmp_path))
    assert folder == str(tmp_path / "asperity" / "jax")
    assert any(Path(folder).iterdir())


def test_without_a_writable_folder_there_is_no_cache(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    assert run(CONFIGURE, JAX_COMPILATION_CACHE_DIR=str(blocked / "below")) == "None"
