"""References that the tests of several rooms share, and how rooms go to the processes of xdist."""

import gc
import os
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

# XLA makes up to 32 modules of a program, to compile them on several cores; here other tests run on
# those, and one module takes a sixth less processor time. Read when JAX first looks for devices.
_ONE_MODULE = "--xla_cpu_parallel_codegen_split_count=1"
if _ONE_MODULE not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {_ONE_MODULE}".strip()

# The threads of a BLAS wait for each other actively, which takes the other process its core. Read
# when NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

#: Rooms that take longest from an empty compilation cache; they come first.
LONGEST = (
    *("orbit", "inference", "papers", "branches", "docs", "transients", "study", "app"),
    *("measurement", "cli", "laws", "theory", "lock_in"),
)

#: Rooms that go to the processes file by file: the longest, and those that compile nothing.
BY_FILE = ("orbit", "measurement", "lock_in", "recording")

#: Beginnings of the names of files whose programs take longer to be optimised than they run, in
#: processes that their tests start too. Others run what users run. JAX keeps a program in memory
#: however it was compiled, so that these come last: what is left to them is optimised, while
#: programs of theirs would cost the others several times as long.
BRIEF = (
    *("orbit/", "docs/", "theory/", "transients/", "laws/", "app/", "study/"),
    "papers/bureau2000/",
    *("branches/test_boundaries.py", "branches/test_bifurcations.py"),
    *(f"cli/test_{name}.py" for name in ("other_commands", "response", "run")),
    *(f"inference/{name}/" for name in ("comparison", "design", "posterior", "tables")),
    *("inference/fitting/test_fit.py", "inference/runs/test_motion.py"),
)
_SWITCH = "jax_disable_most_optimizations"


def room(nodeid):
    """The folder of a test."""
    return nodeid.split("::")[0].split("/")[1]


def is_brief(nodeid):
    """Whether the programs of a test are compiled in half the time."""
    return nodeid.partition("/")[2].startswith(BRIEF)


def scope(nodeid):
    """What one process of xdist runs at a time: a file, or the part of a room compiled alike."""
    if room(nodeid) in BY_FILE:
        return nodeid.split("::")[0]
    return f"{room(nodeid)} brief" if is_brief(nodeid) else room(nodeid)


@pytest.hookimpl(tryfirst=True)  # before `-m` selects
def pytest_collection_modifyitems(items):
    """Sort rooms, briefly compiled ones last, and mark the tests of `make quick`."""
    for _, file in groupby(items, key=lambda item: item.path):
        short = (i for i in file if not any(map(i.get_closest_marker, ("slow", "long"))))
        for first in islice(short, 1):
            first.add_marker("quick")
    order = {name: place for place, name in enumerate(LONGEST)}
    last = len(order)
    items.sort(key=lambda i: (is_brief(i.nodeid), order.get(room(i.nodeid), last)))


def pytest_collection_finish():
    """Leave what is imported out of the collections of garbage, a twentieth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """With `pytest -n`, one process runs a room: its tests share compiled programs.

    By xdist's default each process compiles those of nearly every room. `--dist loadgroup` does not
    group with pytest 9.2 and pytest-xdist 3.8.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByRoom(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            # The first tests of the files share hardly a program.
            return nodeid if config.option.markexpr == "quick" else scope(nodeid)

    if config.getvalue("dist") != "load":
        return None
    config.option.loadscopereorder = False
    return ByRoom(config, log)


@pytest.hookimpl(tryfirst=True)  # before fixtures are made
def pytest_runtest_setup(item):
    """Programs are compiled in half the time, and run several times as long, in some rooms."""
    import jax

    brief = is_brief(item.nodeid)
    jax.config.update(_SWITCH, brief)
    if brief:
        os.environ[_SWITCH.upper()] = "1"
    else:
        os.environ.pop(_SWITCH.upper(), None)
