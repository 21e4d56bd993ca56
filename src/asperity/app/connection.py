"""Connections that wait for their client no longer than a time, and make room for others.

uvicorn ends a connection that is silent after an answer; it would wait without end for the first
request of a connection and for the end of a head, and would count such connections towards its
limit.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

#: Longest time (s) from the opening of a connection, or from its last answer, to the end of the
#: next request's head.
HEAD_PAUSE = 30
#: Connections above which a new one ends that which has waited longest for something of its client.
MOST = 128


class Connection(H11Protocol):
    """One connection; uvicorn makes and calls it."""

    _deadline: asyncio.TimerHandle | None = None
    #: When the connection began to wait for the request that it has now or will have (s).
    _since = 0.0

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request, and make room for it."""
        super().connection_made(transport)
        self._wait()
        others = [c for c in self.connections if isinstance(c, Connection) and c is not self]
        idle = [other for other in others if other.idles]
        if len(self.connections) > MOST and idle:
            # One without a request before one whose request is not whole.
            longest = min(idle, key=lambda other: (other.asks, other._since))
            longest.transport.abort()
            # Its loss is reported later, after others that come at the same time.
            self.connections.discard(longest)

    def handle_events(self) -> None:
        """Stop waiting once the head of a request is whole."""
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
        """Whether a request waits for its answer."""
        cycle: Any = self.cycle  # None before the first request
        return cycle is not None and not cycle.response_complete

    @property
    def idles(self) -> bool:
        """Whether the client has still to send or to take something."""
        return not self.asks or bool(self.cycle.more_body or self.flow.write_paused)

    def _wait(self) -> None:
        self._stop_waiting()
        self._since = self.loop.time()
        self._deadline = self.loop.call_later(HEAD_PAUSE, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
