"""Shared references of the tests, and which process of xdist runs which folder ("room")."""

import gc
import os
from importlib.metadata import version
from itertools import groupby, islice

import pytest
from hypothesis import settings

# No assertion depends on time, so that examples have no deadline.
settings.register_profile("no deadline", parent=settings.default, deadline=None)
settings.load_profile("no deadline")

pytest_plugins = [
    "references.browser",
    "references.compilation",
    "references.planted_recordings",
    "references.published_equations",
]

# XLA splits a program into up to 32 modules to compile them on several cores. Here other tests use
# the other cores, and a single module takes a sixth less processor time.
_ONE_MODULE = "--xla_cpu_parallel_codegen_split_count=1"
# The generator of code that `asperity._jax.jit_large` takes compiles a single operation, of which
# tests run a thousand different ones, in half the time. The long tests take XLA's own choice, and
# so do later releases, which no longer know the flag: XLA ends a process for an unknown one.
_OLDER_GENERATOR = ["--xla_cpu_use_fusion_emitters=false"] * version("jaxlib").startswith("0.10.")

# Tests of stores and files wait for the disk a third of their time, and none cuts the power.
os.fsync = lambda descriptor: None

# The threads of a BLAS wait for each other in loops, which takes processor time from the other
# process. NumPy reads this variable when it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

#: Rooms that take longest from an empty compilation cache; they run first. `app` waits for a
#: browser and for processes: at the end the other process would have nothing left to run meanwhile.
LONGEST = (
    *("app", "orbit", "inference", "papers", "branches", "docs", "transients", "study"),
    *("measurement", "cli", "laws", "theory", "lock_in"),
)

#: Rooms that are distributed file by file: the longest, and those that compile nothing.
BY_FILE = ("orbit", "measurement", "lock_in", "recording")

#: Files, by the beginnings of their names, whose programs are compiled with few optimisations, as
#: optimising them takes longer than running them; processes that they start do the same. The other
#: files run optimised programs, as users do, and run first: JAX keeps programs in memory, and those
#: with few optimisations would take them several times as long.
BRIEF = (
    *("orbit/", "docs/", "theory/", "transients/", "laws/", "app/", "study/"),
    *("papers/bureau2000/", "fit_report/", "examples/", "samples/", "loads/", "figures/"),
    *("branches/test_boundaries.py", "branches/test_bifurcations.py"),
    *(f"cli/test_{name}.py" for name in ("other_commands", "response", "run")),
    *(f"inference/{name}/" for name in ("comparison", "design", "posterior", "tables")),
    *("inference/fitting/test_fit.py", "inference/fitting/test_parabola.py"),
    *("inference/runs/test_motion.py", "inference/runs/test_with_readings.py"),
)
_SWITCH = "jax_disable_most_optimizations"

#: Fixtures that take seconds: whole figures, claims and experiments of a paper. Tests with them are
#: not for `make quick`.
SLOW_FIXTURES = {"figures", "claims", "experiment"}


def pytest_configure(config):
    """Say how XLA compiles: JAX reads this when it first looks for devices."""
    flags = os.environ.get("XLA_FLAGS", "").split()
    flags += [_ONE_MODULE, *([] if config.option.markexpr == "long" else _OLDER_GENERATOR)]
    os.environ["XLA_FLAGS"] = " ".join(dict.fromkeys(flags))


def is_short(item):
    """Whether a test takes little time once its programs are compiled."""
    marked = any(map(item.get_closest_marker, ("slow", "long")))
    return not marked and SLOW_FIXTURES.isdisjoint(item.fixturenames)


def room(nodeid):
    """The folder of a test."""
    return nodeid.split("::")[0].split("/")[1]


def is_brief(nodeid):
    """Whether the programs of a test are compiled in half the time."""
    return nodeid.partition("/")[2].startswith(BRIEF)


def scope(nodeid):
    """Unit that one process of xdist runs: a file, or the files of a room compiled alike."""
    if room(nodeid) in BY_FILE:
        return nodeid.split("::")[0]
    return f"{room(nodeid)} brief" if is_brief(nodeid) else room(nodeid)


@pytest.hookimpl(tryfirst=True)  # before `-m` selects
def pytest_collection_modifyitems(items):
    """Sort rooms, those with few optimisations last, and mark the tests of `make quick`."""
    for _, file in groupby(items, key=lambda item: item.path):
        for first in islice(filter(is_short, file), 1):
            first.add_marker("quick")
    order = {name: place for place, name in enumerate(LONGEST)}
    last = len(order)
    items.sort(key=lambda i: (is_brief(i.nodeid), order.get(room(i.nodeid), last)))


def pytest_collection_finish():
    """Exclude imported objects from garbage collection, which saves a twentieth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """With `pytest -n`, a room runs in one process, where its tests share compiled programs.

    By default of xdist each process would compile programs of nearly every room. `--dist loadgroup`
    does not group with pytest 9.2 and pytest-xdist 3.8.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByRoom(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            # The first tests of the files hardly share programs.
            return nodeid if config.option.markexpr == "quick" else scope(nodeid)

    if config.getvalue("dist") != "load":
        return None
    config.option.loadscopereorder = False
    return ByRoom(config, log)


@pytest.hookimpl(tryfirst=True)  # before fixtures are made
def pytest_runtest_setup(item):
    """In some files compile programs in half the time; they run several times as long."""
    import jax

    brief = is_brief(item.nodeid)
    jax.config.update(_SWITCH, brief)
    if brief:
        os.environ[_SWITCH.upper()] = "1"
    else:
        os.environ.pop(_SWITCH.upper(), None)
