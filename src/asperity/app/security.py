"""Who may ask the server, how much they may send, and what the page may load.

The server answers this machine only. A page of another site that runs in the user's browser can
still send requests here, by a name that resolves to this machine (DNS rebinding) or straight across
origins. Both are refused: the `Host` must be one of this server's names, and an `Origin` must be
that of this server.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterable
from typing import Any

from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: Largest body of a request (bytes) where its endpoint names no other limit.
BODY_LIMIT = 64 * 1024
#: Longest time (s) to wait for a piece of a body, and bytes a second that a body must come with on
#: average: this machine sends to itself.
BODY_PAUSE, BODY_RATE = 10.0, 64 * 1024

#: Names of the address of this machine.
_NAMES = ("127.0.0.1", "localhost", "[::1]")

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors {ancestors}"
)


class Guard:
    """Checks every request before the application sees it, and adds headers to every answer.

    Parameters
    ----------
    app : ASGI application
    port : int
        On which the server listens.
    in_notebook : bool
        Whether pages of this machine, such as a notebook, may show the page in a frame.
    body_limits : mapping of str to int
        Largest body (bytes) of paths that take more than `BODY_LIMIT`.
    """

    def __init__(
        self,
        app: ASGIApp,
        port: int,
        in_notebook: bool = False,
        body_limits: dict[str, int] | None = None,
    ) -> None:
        self.app = app
        self.hosts = frozenset(f"{name}:{port}" for name in _NAMES)
        if port == 80:
            self.hosts |= frozenset(_NAMES)
        self.origins = frozenset(f"http://{host}" for host in self.hosts)
        local = " ".join(f"http://{name}:*" for name in _NAMES[:2])
        ancestors = f"'self' {local}" if in_notebook else "'none'"
        self.headers = _security_headers(ancestors, in_notebook)
        self.body_limits = body_limits or {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # no WebSocket is served
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                kept = [(n, v) for n, v in message["headers"] if n.lower() != b"server"]
                message["headers"] = kept + self.headers
            await send(message)

        limit = self.body_limits.get(scope["path"], BODY_LIMIT)
        refusal = self._refusal(scope, limit)
        if refusal is not None:
            await sentence(refusal)(scope, receive, send_guarded)
            return
        body = _LimitedBody(receive, limit)
        await self.app(scope, body, send_guarded)

    def _refusal(self, scope: Scope, limit: int) -> HTTPException | None:
        hosts = list(_values(scope["headers"], b"host"))
        if len(hosts) != 1 or hosts[0].lower() not in self.hosts:
            return HTTPException(421, "the address must be that of this machine, such as localhost")
        origins = list(_values(scope["headers"], b"origin"))
        site = next(_values(scope["headers"], b"sec-fetch-site"), "same-origin")
        elsewhere = scope["path"].startswith("/api/") and site not in ("same-origin", "none")
        if elsewhere or any(origin.lower() not in self.origins for origin in origins):
            text = "a request must come from the page itself, not from another site"
            return HTTPException(403, text)
        length = next(_values(scope["headers"], b"content-length"), "0")
        if not length.isdecimal() or len(length) > 20 or int(length) > limit:
            return _too_large(limit)
        return None


def body_too_slow() -> HTTPException:
    """A body did not arrive in time; the connection ends with the answer."""
    text = "the request did not arrive in time; send it again"
    return HTTPException(408, text, {"connection": "close"})


def _too_large(limit: int) -> HTTPException:
    shown = f"{limit // 1024**2} MB" if limit >= 1024**2 else f"{limit // 1024} kB"
    return HTTPException(413, f"a request must be at most {shown} long; send less")


class _LimitedBody:
    """`receive` that counts the bytes of the body, and the time in which they come.

    Senders need not say how many bytes follow. Each byte allows to wait for more, so that neither
    a pause nor drops without end hold a connection.
    """

    def __init__(self, receive: Receive, limit: int) -> None:
        self.receive = receive
        self.left = self.limit = limit
        self.patience = BODY_PAUSE
        self.complete = False

    async def __call__(self) -> Message:
        if self.complete:  # waiting for the end of the connection may take as long as it takes
            return await self.receive()
        begin = time.monotonic()
        try:
            message = await asyncio.wait_for(self.receive(), self.patience)
        except TimeoutError:
            raise body_too_slow() from None
        if message["type"] == "http.request":
            size = len(message.get("body", b""))
            waited = time.monotonic() - begin
            self.patience = min(self.patience - waited + size / BODY_RATE, BODY_PAUSE)
            self.left -= size
            self.complete = not message.get("more_body", False)
            if self.left < 0:
                raise _too_large(self.limit)
        return message


def sentence(refusal: HTTPException) -> JSONResponse:
    """An answer that says in one sentence why there is no other."""
    return JSONResponse({"error": refusal.detail}, refusal.status_code, refusal.headers)


def _values(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> Any:
    return (value.decode("latin-1") for key, value in headers if key.lower() == name)


def _security_headers(ancestors: str, in_notebook: bool) -> list[tuple[bytes, bytes]]:
    headers = {
        "content-security-policy": _POLICY.format(ancestors=ancestors),
        "x-content-type-options": "nosniff",
        "referrer-policy": "no-referrer",
        "cross-origin-opener-policy": "same-origin",
        "cross-origin-resource-policy": "same-origin",
        "cache-control": "no-cache",
    }
    if not in_notebook:
        headers["x-frame-options"] = "DENY"
    return [(name.encode(), value.encode()) for name, value in headers.items()]
