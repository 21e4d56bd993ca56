"""Who may ask the server, how much and how slowly they may send, and what the page may load.

The server answers this machine only. A page of another site that runs in the user's browser can
still send requests here, by a name that resolves to this machine (DNS rebinding) or straight across
origins. Both are refused: the `Host` must be one of this server's names, and an `Origin` must be
that of this server.

A client may hold a connection open without sending. uvicorn ends a connection that is silent after
an answer, but it waits without limit for the first request and for the end of a request's head, and
counts such connections towards its limit. `Connection` ends them.
"""

from __future__ import annotations

import asyncio
import time
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

#: Largest body of a request (bytes) where its endpoint names no other limit.
BODY_LIMIT = 64 * 1024
#: Longest time (s) between two pieces of a body, and the smallest average rate of a body (bytes/s):
#: this machine sends to itself.
BODY_PAUSE, BODY_RATE = 10.0, 64 * 1024
#: Longest time (s) from the opening of a connection, or from its last answer, to the end of the
#: next request's head.
HEAD_PAUSE = 30
#: Above this number of connections a new one ends the idle connection that has waited longest.
MOST_CONNECTIONS = 128

#: Names of the address of this machine.
_NAMES = ("127.0.0.1", "localhost", "[::1]")

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors {ancestors}"
)
#: Headers of every answer, besides the policies on content and frames.
_HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-cache",
}


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
        self.headers = {**_HEADERS, "content-security-policy": _POLICY.format(ancestors=ancestors)}
        if not in_notebook:
            self.headers["x-frame-options"] = "DENY"
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
                MutableHeaders(scope=message).update(self.headers)
            await send(message)

        limit = self.body_limits.get(scope["path"], BODY_LIMIT)
        refusal = self._refusal(scope, limit)
        if refusal is not None:
            await sentence(refusal)(scope, receive, send_guarded)
            return
        body = _LimitedBody(receive, limit)
        await self.app(scope, body, send_guarded)

    def _refusal(self, scope: Scope, limit: int) -> HTTPException | None:
        headers = Headers(scope=scope)
        hosts = headers.getlist("host")
        if len(hosts) != 1 or hosts[0].lower() not in self.hosts:
            return HTTPException(421, "the address must be that of this machine, such as localhost")
        other = [o for o in headers.getlist("origin") if o.lower() not in self.origins]
        site = headers.get("sec-fetch-site", "same-origin")
        elsewhere = scope["path"].startswith("/api/") and site not in ("same-origin", "none")
        if elsewhere or other:
            text = "a request must come from the page itself, not from another site"
            return HTTPException(403, text)
        length = headers.get("content-length", "0")
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
    """`receive` with limits on the bytes of the body and on the time in which they arrive.

    A sender need not announce the length of a body. Each byte extends the time for the next
    piece, so that neither a pause nor an endless trickle of bytes holds a connection.
    """

    def __init__(self, receive: Receive, limit: int) -> None:
        self.receive = receive
        self.left = self.limit = limit
        self.patience = BODY_PAUSE
        self.complete = False

    async def __call__(self) -> Message:
        if self.complete:  # the wait for the end of the connection has no limit
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


class Connection(H11Protocol):
    """A connection that ends when its client is silent too long; uvicorn makes and calls it."""

    _deadline: asyncio.TimerHandle | None = None
    #: Time (s) since which the connection waits for its present or next request.
    _since = 0.0

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request; if there are too many connections, end an idle one."""
        super().connection_made(transport)
        self._wait()
        others = [c for c in self.connections if isinstance(c, Connection) and c is not self]
        idle = [other for other in others if other.idles]
        if len(self.connections) > MOST_CONNECTIONS and idle:
            # A connection without a request goes before one with an incomplete request.
            longest = min(idle, key=lambda other: (other.asks, other._since))
            longest.transport.abort()
            # uvicorn removes it later, after further connections may have opened.
            self.connections.discard(longest)

    def handle_events(self) -> None:
        """Stop waiting when the head of a request is complete."""
        super().handle_events()
        if self.asks:
            self._stop_waiting()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        self._wait()
        super().on_response_complete()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._stop_waiting()
        super().connection_lost(exc)

    @property
    def asks(self) -> bool:
        """Whether a request has no complete answer yet."""
        cycle: Any = self.cycle  # None before the first request
        return cycle is not None and not cycle.response_complete

    @property
    def idles(self) -> bool:
        """Whether the server waits for the client to send or to read."""
        return not self.asks or bool(self.cycle.more_body or self.flow.write_paused)

    def _wait(self) -> None:
        self._stop_waiting()
        self._since = self.loop.time()
        self._deadline = self.loop.call_later(HEAD_PAUSE, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


def sentence(refusal: HTTPException) -> JSONResponse:
    """The answer to a refused request: one sentence with the reason."""
    return JSONResponse({"error": refusal.detail}, refusal.status_code, refusal.headers)
