"""Memory and processor time that a process may take."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

try:
    import resource
except ImportError:  # Windows has no such limits
    resource = None  # type: ignore[assignment]


def set_limits(limits: Mapping[str, int]) -> None:
    """Address space (``memory``, bytes) and processor time (``seconds``) until the process ends.

    Both are beyond what the process has taken before. The system ends the process after its time,
    and refuses it memory.
    """
    for kind, end in _ends(limits).items():
        resource.setrlimit(kind, (end, end))


@contextlib.contextmanager
def limited(limits: Mapping[str, int]) -> Iterator[None]:
    """`set_limits` for a part of the work."""
    ends = _ends(limits)
    earlier = {kind: resource.getrlimit(kind) for kind in ends}
    for kind, end in ends.items():
        resource.setrlimit(kind, (end, earlier[kind][1]))
    try:
        yield
    finally:
        for kind, before in earlier.items():
            resource.setrlimit(kind, before)


def _ends(limits: Mapping[str, int]) -> dict[int, int]:
    """Where each of the system's limits comes to lie, within those that the process has."""
    if resource is None:
        return {}
    used = resource.getrusage(resource.RUSAGE_SELF)
    taken = {
        "memory": (resource.RLIMIT_AS, _address_space()),
        "seconds": (resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime) + 1),
    }
    found = {}
    for name, more in limits.items():
        kind, before = taken[name]
        own = [end for end in resource.getrlimit(kind) if end != resource.RLIM_INFINITY]
        found[kind] = min([before + more, *own])
    return found


def _address_space() -> int:
    """Address space (bytes) that the process has taken; 0 where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError):
        return 0
    return pages * resource.getpagesize()
