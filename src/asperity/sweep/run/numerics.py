"""What changes the last digits of a sweep: versions, kind of processor, and the code of the solver.

JAX must not be loaded when this module is imported, see `asperity.sweep.run.tasks`.
"""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from asperity._version import __version__

#: Packages that the numbers come from.
_PACKAGES = ("jax", "jaxlib", "numpy", "scipy")
#: Parts of this package that do not compute a number of a sweep.
_ASIDE = ("app", "cli", "experiment", "figures", "fit_report", "ledger", "recording")


def package_version(package: str) -> str:
    """Version of an installed package, "" without it."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


@cache
def numerics() -> dict[str, str]:
    """Names and values; two runs with the same give the same bits."""
    return {
        "asperity": __version__,
        **{name: package_version(name) for name in _PACKAGES},
        "processor": platform.machine(),
        "solver": _sources(),
    }


def _sources() -> str:
    """Digest of the package's modules, which may change between versions where it is developed."""
    root = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        place = file.relative_to(root)
        if place.parts[0] not in _ASIDE:
            digest.update(place.as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
