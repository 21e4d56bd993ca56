"""What the page needs beyond the core: the packages of the extra ``app``."""

from __future__ import annotations

from importlib.util import find_spec

from asperity.errors import InputError

_PACKAGES = ("starlette", "uvicorn", "latex2mathml")


def require_extra() -> None:
    """Check that the packages of the extra are installed.

    Raises
    ------
    InputError
        If one is not.
    """
    missing = [name for name in _PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(
            f"the extra 'app' must be installed to serve the page, got no {', '.join(missing)}; "
            "write pip install 'asperity[app]'"
        )
