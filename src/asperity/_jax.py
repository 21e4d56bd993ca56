"""JAX set-up: double precision, and compiled programs kept between processes."""

from __future__ import annotations

import gc
import math
import os
import tempfile
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

import jax

P = ParamSpec("P")
T = TypeVar("T")

_LEVEL = "xla_backend_optimization_level"
#: Options of large programs. XLA's older generator of code makes a few pieces of a program where
#: the newer one compiles every operation for itself: of hundreds of operations it makes half of the
#: memory mappings in half to two thirds of the time. Optimisation at level 1 takes off another
#: third. The collocation programs run as fast with both (662 against 723 us a point), the fast
#: method takes 10 to 20 % longer, which its compilation makes up for over millions of points; small
#: programs over long arrays are slower with either (jaxlib 0.10.2; 0.12 has the newer generator
#: alone and takes a fifth longer to compile). Vectors of 512 bits where the
#: processor has them (256 is XLA's own choice) take a tenth off the fast method, and nothing off
#: the others. Integrations of many motions at once take a fifth (holds) to twice (shooting) as long
#: with these options and are compiled without.
_LARGE = {
    "xla_cpu_use_fusion_emitters": False,
    _LEVEL: 1,
    "xla_cpu_prefer_vector_width": 512,
}
#: The same where JAX's own switch sets the level.
_BRIEF = ("xla_cpu_use_fusion_emitters",)

#: Programs after whose loading the memory mappings of the process are counted.
_OFTEN = 8
_loaded = 0
_compiling = 0.0


def _count(event: str, duration_secs: float, **_: str | int) -> None:
    global _loaded, _compiling  # JAX tells of its programs in no other way
    if event.endswith(("backend_compile_duration", "jaxpr_to_mlir_module_duration")):
        _compiling += duration_secs
    if event.endswith("backend_compile_duration"):
        _loaded += 1


def seconds_compiling() -> float:
    """Time that this process has spent on compiling and loading programs so far (s)."""
    return _compiling


def spare_mappings() -> None:
    """Drop the loaded programs where the system is about to refuse more of them.

    A compiled program takes a thousand memory mappings and more, of which Linux allows a process
    65,530 by default; beyond that XLA crashes. Dropped programs come back from the cache on
    disk when they are called again. To be called between programs, not within one.
    """
    global _loaded
    if _loaded < _OFTEN:
        return
    _loaded = 0
    used, most = _mappings()
    if used > most / 3:
        jax.clear_caches()
        gc.collect()


def _mappings() -> tuple[int, float]:
    """Memory mappings of this process and how many it may have; no limit on other systems."""
    try:
        most = int(Path("/proc/sys/vm/max_map_count").read_text())
        with Path("/proc/self/maps").open("rb") as maps:
            return sum(1 for _ in maps), most
    except (OSError, ValueError):
        return 0, math.inf


def jit_large(
    function: Callable[P, T], static_argnames: tuple[str, ...] = (), *, brief: bool = False
) -> Callable[P, T]:
    """`jax.jit` for a program of hundreds of operations: compiled and loaded in less time.

    JAX's own switch ``jax_disable_most_optimizations`` (``JAX_DISABLE_MOST_OPTIMIZATIONS``) holds
    here too: such a program compiles in half the time, and runs several times as long. `brief`
    does so for a program that runs for a millisecond.
    """

    @cache
    def compiled(options: tuple[str, ...]) -> Callable[P, T]:
        chosen = {name: _LARGE[name] for name in options}
        if brief and _LEVEL in chosen:
            chosen[_LEVEL] = 0
        return jax.jit(function, static_argnames=static_argnames, compiler_options=chosen)

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        # Within another program that one's options hold, and JAX takes no others.
        inner = any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves((args, kwargs)))
        unoptimised = jax.config.read("jax_disable_most_optimizations")
        options = () if inner else known_options(_BRIEF if unoptimised else tuple(_LARGE))
        return compiled(options)(*args, **kwargs)

    return call


@cache
def known_options(names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the options of `jit_large` that this XLA knows: releases differ in them."""

    def known(*some: str) -> bool:
        try:
            jax.jit(lambda x: x + 1, compiler_options={n: _LARGE[n] for n in some})(1.0)
        except jax.errors.JaxRuntimeError:
            return False
        return True

    return names if known(*names) else tuple(name for name in names if known(name))


@cache
def configure() -> Path | None:
    """Switch JAX to double precision, to the CPU, and its compilation cache on; once per process.

    Arrays lie on the CPU unless JAX_PLATFORMS or JAX's default device say otherwise: the searches
    are loops of small programs, which an accelerator only slows down.

    The cache lies in ``$JAX_COMPILATION_CACHE_DIR`` if set, else in ``asperity/jax`` under
    ``$XDG_CACHE_HOME`` or ``~/.cache``. Where that cannot be written, there is no cache.

    Returns
    -------
    Path or None
        The folder of the cache, None without one.
    """
    # Without it each full collection of garbage goes through the objects of JAX, 50 ms of them, and
    # a first answer takes a tenth longer.
    gc.freeze()
    jax.config.update("jax_enable_x64", True)
    if not any(getattr(jax.config, name) for name in ("jax_platforms", "jax_default_device")):
        jax.config.update("jax_default_device", "cpu")
    # Results are read as soon as they are computed: a second thread for programs of a millisecond
    # only adds its waking up, a twelfth of the time of a fit.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    jax.monitoring.register_event_duration_secs_listener(_count)
    folder = _cache_folder()
    if folder is None or not _writable(folder):
        return None
    jax.config.update("jax_compilation_cache_dir", str(folder))
    # The defaults skip programs that compile in under a second: nearly all of ours, whose sum is
    # what a user waits for.
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    return folder


def _cache_folder() -> Path | None:
    chosen = os.environ.get("JAX_COMPILATION_CACHE_DIR")
    if chosen:
        return Path(chosen)
    root = os.environ.get("XDG_CACHE_HOME")
    try:
        return (Path(root) if root else Path.home() / ".cache") / "asperity" / "jax"
    # An account without a home directory, as some batch systems have.
    except RuntimeError:
        return None


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Permission bits do not tell for root, full disks and read-only mounts: write and see.
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
