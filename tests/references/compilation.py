"""The table at the end of a run of the tests: compiled programs and times of each folder ("room").

Programs compiled in processes that tests start are not counted.
"""

from collections import Counter, defaultdict
from contextlib import contextmanager

import pytest

_EVENTS = {
    "/jax/core/compile/backend_compile_duration": "compiling",
    "/jax/core/compile/jaxpr_to_mlir_module_duration": "tracing",
    "/jax/core/compile/jaxpr_trace_duration": "tracing",
}

#: For each room: tests, programs, and seconds in total, of compiling and of tracing.
totals = defaultdict(Counter)
_running = Counter()


def _count(event, duration_secs, **_):
    kind = _EVENTS.get(event)
    if kind:
        _running[kind] += duration_secs
        _running["programs"] += kind == "compiling"


def _room(nodeid):
    return nodeid.split("::")[0].split("/")[1]


@contextmanager
def compiled_programs():
    """A list of the names of the programs that are compiled, or read from the cache, meanwhile."""
    import jax

    names = []

    def listen(event, *_, fun_name="", **__):
        if _EVENTS.get(event) == "compiling":
            names.append(fun_name)

    jax.monitoring.register_event_duration_secs_listener(listen)
    try:
        yield names
    finally:
        jax.monitoring.unregister_event_duration_listener(listen)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session):
    """Count compilations once tests are collected; listing tests does not import JAX."""
    result = yield
    if not session.config.option.collectonly:
        import jax

        jax.monitoring.register_event_duration_secs_listener(_count)
    return result


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Add the programs of a test and its fixtures to its room."""
    _running.clear()
    result = yield
    totals[_room(item.nodeid)].update(_running)
    return result


def pytest_runtest_logreport(report):
    """Add the time of set-up, call and tear-down of a test."""
    counts = totals[_room(report.nodeid)]
    # Reports of the processes of xdist arrive here, their numbers of programs at the end.
    counts["seconds"] += report.duration
    counts["tests"] += report.when == "call"


def pytest_sessionfinish(session):
    """Send the numbers of a process of xdist to the process that prints."""
    output = getattr(session.config, "workeroutput", None)
    if output is not None:
        kinds = ("programs", "compiling", "tracing")
        output["compilation"] = {r: {k: c[k] for k in kinds} for r, c in totals.items()}


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """Add the numbers of a process of xdist."""
    for room, counts in getattr(node, "workeroutput", {}).get("compilation", {}).items():
        totals[room].update(counts)


def pytest_terminal_summary(terminalreporter):
    """Print the table, the slowest room first."""
    rows = sorted(totals.items(), key=lambda pair: -pair[1]["seconds"])
    if sum(counts["programs"] for _, counts in rows) == 0:
        return
    write = terminalreporter.write_line
    terminalreporter.section("seconds and compiled programs")
    write(f"{'room':<16}{'tests':>7}{'seconds':>9}{'programs':>10}{'compiling':>11}{'tracing':>9}")
    whole = sum((counts for _, counts in rows), Counter())
    for room, c in [*rows, ("all", whole)]:
        write(
            f"{room:<16}{c['tests']:>7}{c['seconds']:>9.0f}{c['programs']:>10}"
            f"{c['compiling']:>11.1f}{c['tracing']:>9.1f}"
        )
