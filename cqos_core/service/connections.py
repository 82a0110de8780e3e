"""HTTP connections of browsers: bounded in number, and closed if they wait too long."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

if TYPE_CHECKING:
    import asyncio

    from cqos_core.service.settings import Limits

_FIRST_SECONDS: Final = 10.0
KEPT_SECONDS: Final = 75
"""For which a connection without a request is kept: longer than proxies and browsers do, or requests would cross its end."""


class Connections:
    """The open connections: bounded in number, and those without a request go first."""

    def __init__(self, limits: Limits) -> None:
        self.seconds = limits.seconds
        self.most = limits.calls
        self._open: dict[Patient, None] = {}

    def begun(self, connection: Patient) -> None:
        """Take a connection; where there are too many, one ends that has had no request yet, else one that is idle."""
        self._open[connection] = None
        if len(self._open) > self.most:
            silent = (each for each in self._open if each.is_silent and each is not connection)
            idle = (each for each in self._open if each.is_idle and each is not connection)
            (next(silent, None) or next(idle, None) or connection).close()

    def ended(self, connection: Patient) -> None:
        """Forget a connection."""
        self._open.pop(connection, None)


class Patient(H11Protocol):
    """HTTP/1.1 that closes connections that are idle, and those on which a request does not come or not as a whole."""

    held: Connections
    _seen: Any = None
    _in_part: bool = False
    _looking: asyncio.TimerHandle

    @property
    def is_silent(self) -> bool:
        """Whether no request has come yet."""
        latest: Any = self.cycle
        return latest is None

    @property
    def is_idle(self) -> bool:
        """Whether no request is under way."""
        latest: Any = self.cycle
        return latest is None or latest.response_complete

    def close(self) -> None:
        """End it."""
        self.held.ended(self)
        self.transport.abort()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request."""
        super().connection_made(transport)
        self._looking = self.loop.call_later(min(self.held.seconds, _FIRST_SECONDS), self._look)
        self.held.begun(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._looking.cancel()
        self.held.ended(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read, and bound the wait for the rest."""
        super().data_received(data)
        self._bound_rest()

    def on_response_complete(self) -> None:
        """Go on to the next request, whose beginning may be there."""
        super().on_response_complete()
        self._bound_rest()

    def _bound_rest(self) -> None:
        """Give the rest of a head that has begun as long as a first request, however slowly it comes."""
        in_part = self.is_idle and bool(self.conn.trailing_data[0])
        if in_part and not self._in_part:
            self._looking.cancel()
            self._seen = self.cycle
            self._looking = self.loop.call_later(min(self.held.seconds, _FIRST_SECONDS), self._look)
        self._in_part = in_part

    def _look(self) -> None:
        """Close it if nothing was under way since the last look."""
        if self.cycle is self._seen and self.is_idle:
            self.transport.close()
            return
        self._seen = self.cycle
        self._looking = self.loop.call_later(KEPT_SECONDS, self._look)


def patient(connections: Connections) -> type[H11Protocol]:
    """Return the protocol of the connections of one door."""
    return type("Protocol", (Patient,), {"held": connections})
