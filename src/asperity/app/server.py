"""The server of the page, which listens on this machine only.

The packages of the extra ``app`` are checked first.
"""

from __future__ import annotations

import signal
import socket
import threading
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from asperity.errors import InputError, require
from asperity.parameters.arguments import shown


def require_extra() -> None:
    """Refuse to serve the page if a package of the extra ``app`` is not installed.

    Raises
    ------
    InputError
    """
    for name in ("starlette", "uvicorn", "latex2mathml"):
        try:
            import_module(name)
        except ImportError:
            advice = "write make app in a clone, or pip install 'asperity[app]' in an environment"
            rule = "be installed to serve the page"
            raise InputError("the extra 'app'", rule, f"no {name}", advice) from None


ADDRESS = "127.0.0.1"


def serve(
    port: int = 8765,
    *,
    laws: Sequence[str] = (),
    started: Callable[[str], Any] | None = None,
) -> None:
    """Serve the page until the process gets SIGTERM or SIGINT.

    Parameters
    ----------
    port : int
        0 for any free port.
    laws : sequence of str
        Laws outside the package, as `asperity.laws.known_law` takes them.
    started : callable, optional
        Called with the page's address when it can be opened.

    Raises
    ------
    InputError
        If the extra ``app`` is not installed, a law is not found or the port cannot be used.
    """
    require_extra()
    from asperity.laws import get_law, known_law

    for law in laws:
        get_law(known_law(law))
    listening = listen(port)
    server = server_on(listening, laws=laws)
    if started is not None:
        _call_when_started(server, started, address_of(listening))
    # uvicorn shuts down on both signals, and then raises them again, which would be an error here.
    earlier = {s: signal.signal(s, signal.SIG_IGN) for s in (signal.SIGTERM, signal.SIGINT)}
    try:
        server.run(sockets=[listening])
    finally:
        for number, handler in earlier.items():
            signal.signal(number, handler)
        listening.close()


def serve_in_background() -> str:
    """Serve the page from a thread of this process, on a free port; returns its address.

    Pages of this machine, such as a notebook, may show it in a frame. Nothing is compiled before a
    request needs it.
    """
    require_extra()
    listening = listen(0)
    server = server_on(listening, in_notebook=True, prepare=False)
    run = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
    run.start()
    while not server.started and run.is_alive():
        time.sleep(0.01)
    return address_of(listening)


def listen(port: int) -> socket.socket:
    """A socket that listens on this machine only.

    Raises
    ------
    InputError
        If the number is no port, or the port is in use.
    """
    holds, advice = 0 <= port < 65536, "leave it out for 8765"
    require(holds, "--port", "be from 0 to 65535", shown(port), advice)
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((ADDRESS, port))
    except OSError as error:
        listening.close()
        got, advice = f"{port} ({error.strerror})", "name another one, or 0 for any"
        raise InputError("--port", "be free", got, advice) from None
    return listening


def address_of(listening: socket.socket) -> str:
    """The page's address."""
    return f"http://{ADDRESS}:{listening.getsockname()[1]}/"


def server_on(
    listening: socket.socket,
    *,
    in_notebook: bool = False,
    prepare: bool = True,
    laws: Sequence[str] = (),
) -> Any:
    """A uvicorn server for a socket; parameters as for `asperity.app.application.build`."""
    import uvicorn

    from asperity.app.application import build
    from asperity.app.security import HEAD_PAUSE, Connection

    config = uvicorn.Config(
        build(listening.getsockname()[1], in_notebook=in_notebook, prepare=prepare, laws=laws),
        # The logging configuration of uvicorn would close all logging handlers of the process, and
        # with them, through that of absl, the streams of a notebook.
        log_config=None,
        log_level="warning",
        server_header=False,
        date_header=False,
        http=Connection,
        # uvloop, taken where it is installed, starts workers by a fork, and JAX warns of that.
        loop="asyncio",
        ws="none",
        lifespan="on",
        timeout_keep_alive=HEAD_PAUSE,
        timeout_graceful_shutdown=2,
        limit_concurrency=256,
        h11_max_incomplete_event_size=32 * 1024,
    )
    return uvicorn.Server(config)


def _call_when_started(server: Any, started: Callable[[str], Any], address: str) -> None:
    def wait() -> None:
        while not server.started:
            time.sleep(0.01)
        started(address)

    threading.Thread(target=wait, daemon=True).start()
