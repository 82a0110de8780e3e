"""HTTP connections of browsers, bounded in number and time from accept until the last answer is read."""

from __future__ import annotations

import asyncio
import socket
import struct
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

if TYPE_CHECKING:
    import ssl
    from collections.abc import Callable

    from cqos_core.service.settings import Limits

_FIRST_SECONDS: Final = 10.0
KEPT_SECONDS: Final = 75
"""How long an idle connection is kept: longer than by proxies and browsers, so that no request crosses its end."""
ABORT: Final = "cqos.abort"
"""Key of the ASGI scope: a function that ends the connection at once."""
_PIECE: Final = 64 * 1024
"""Bytes of an answer that are written at once; the next piece follows when they are sent."""
_FREE_CHUNKS: Final = 256
_CHUNK_BYTES: Final = 512
"""The least average size of further chunks: parsing a chunk takes as long as kilobytes in one chunk."""
_REST_BYTES: Final = 16 * 1024 * 1024
"""The most bytes that are dropped of a request that was answered early, so that its caller can read the answer."""
_ACCEPTING_SECONDS: Final = 0.05
"""Pause before the next accept if no file descriptor is left."""
_DESCRIPTORS_PART: Final = 4
"""Browsers may use one in so many file descriptors of the process; the others are for gRPC."""


def most_connections(limits: Limits) -> int:
    """Return the most connections of browsers: as many as calls, within their part of the file descriptors."""
    if sys.platform == "win32":
        return limits.calls
    import resource

    descriptors, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return limits.calls if descriptors < 0 else max(min(limits.calls, descriptors // _DESCRIPTORS_PART), 1)


class Connections:
    """The open connections of one server, bounded in number; those without a request are ended first."""

    def __init__(self, limits: Limits) -> None:
        self.seconds = limits.seconds
        self.most = most_connections(limits)
        self._open: dict[_Connection, None] = {}

    @property
    def first_seconds(self) -> float:
        """The most seconds from accept to the complete head of the first request, and for each further head."""
        return min(self.seconds, _FIRST_SECONDS)

    async def accept(
        self, listening: socket.socket, protocol: Callable[[], IdleTimeoutProtocol], context: ssl.SSLContext | None
    ) -> None:
        """Accept connections until cancelled, one in each turn of the loop."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                opened, _ = await loop.sock_accept(listening)
            except OSError:  # it is gone already, or there is no descriptor for it until another one ends
                await asyncio.sleep(_ACCEPTING_SECONDS)
                continue
            accepted = _Connection(self)
            self._open[accepted] = None
            self._make_room(accepted)
            accepted.begin(opened, protocol, context)
            await asyncio.sleep(0)

    def _make_room(self, newest: _Connection) -> None:
        """If there are too many connections, end one without a request, else an idle one, else the newest."""
        if len(self._open) > self.most:
            silent = (each for each in self._open if each.is_silent and each is not newest)
            idle = (each for each in self._open if each.is_idle and each is not newest)
            (next(silent, None) or next(idle, None) or newest).end()

    def ended(self, accepted: _Connection) -> None:
        """Forget a connection."""
        self._open.pop(accepted, None)

    def leave(self) -> None:
        """End the connections that still negotiate."""
        for each in [*self._open]:
            if each.protocol is None:
                each.end()


class _Connection:
    """A connection from accept on, also during the TLS handshake.

    Attributes:
        protocol: the HTTP protocol, once it has begun.
        until: when the head of its first request must be complete.
    """

    def __init__(self, held: Connections) -> None:
        self._held = held
        self._ended = False
        self._task: asyncio.Task[Any] | None = None
        self.protocol: IdleTimeoutProtocol | None = None
        self.until = asyncio.get_running_loop().time() + held.first_seconds

    @property
    def is_silent(self) -> bool:
        """Whether no request has come yet."""
        return self.protocol is None or self.protocol.cycle is None

    @property
    def is_idle(self) -> bool:
        """Whether no request is under way."""
        return self.protocol is None or self.protocol.is_idle

    def begin(
        self, opened: socket.socket, protocol: Callable[[], IdleTimeoutProtocol], context: ssl.SSLContext | None
    ) -> None:
        """Start the TLS handshake, then HTTP."""
        if self._ended:
            opened.close()
            return
        self._task = asyncio.ensure_future(self._begun(opened, protocol, context))

    async def _begun(
        self, opened: socket.socket, protocol: Callable[[], IdleTimeoutProtocol], context: ssl.SSLContext | None
    ) -> None:
        loop = asyncio.get_running_loop()

        def speaking() -> IdleTimeoutProtocol:
            self.protocol = protocol()
            self.protocol.accepted = self
            return self.protocol

        seconds = max(self.until - loop.time(), 0.001)
        # A client without TLS, or one that goes away, is not worth a log line.
        with suppress(OSError):
            async with asyncio.timeout_at(self.until):  # type: ignore[attr-defined,unused-ignore] # Python 3.11, as the extra `web`
                await loop.connect_accepted_socket(  # type: ignore[call-arg,unused-ignore]
                    speaking,
                    opened,
                    ssl=context,
                    ssl_handshake_timeout=None if context is None else seconds,
                    ssl_shutdown_timeout=None if context is None else self._held.first_seconds,
                )
            return
        self.gone()

    def end(self) -> None:
        """End the connection at once."""
        self.gone()
        if self.protocol is not None and self.protocol.transport is not None:
            self.protocol.drop()
        elif self._task is not None:
            self._task.cancel()

    def gone(self) -> None:
        """Remove it from the open connections."""
        self._ended = True
        self._held.ended(self)


class _Parser(h11.Connection):
    """An HTTP/1.1 parser that refuses bodies of very many small chunks."""

    def __init__(self, most_head: int) -> None:
        super().__init__(h11.SERVER, most_head)
        self._chunks = self._bytes = 0

    def next_event(self) -> Any:
        event = super().next_event()
        if isinstance(event, h11.Request):
            self._chunks = self._bytes = 0
        elif isinstance(event, h11.Data):
            self._chunks += 1
            self._bytes += len(event.data)
            if self._chunks > _FREE_CHUNKS + self._bytes // _CHUNK_BYTES:
                raise h11.RemoteProtocolError("the body comes in too many small chunks")
        return event


class _ClosingTransport:
    """A transport whose close lets the last answer arrive, within a bounded time."""

    def __init__(self, transport: asyncio.Transport, connection: IdleTimeoutProtocol) -> None:
        self._transport = transport
        self._connection = connection

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def close(self) -> None:
        self._connection.finish(self._transport)

    def is_closing(self) -> bool:
        return self._connection.finishing or self._transport.is_closing()


class IdleTimeoutProtocol(H11Protocol):
    """The HTTP/1.1 protocol with timeouts: for idle connections, incomplete requests, and answers that are not read.

    Attributes:
        accepted: its connection.
        finishing: whether it is closing; further bytes are dropped.
    """

    held: Connections
    accepted: _Connection
    finishing = False
    _seen: Any = None
    _in_part = False
    _dropped = 0
    _looking: asyncio.TimerHandle

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.conn = _Parser(self.conn._max_incomplete_event_size)  # noqa: SLF001 - as it was told
        self.app = self._answered

    @property
    def is_idle(self) -> bool:
        """Whether no request is under way."""
        latest: Any = self.cycle
        return latest is None or latest.response_complete

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the timeout for the first request."""
        closing: Any = _ClosingTransport(transport, self)
        transport.set_write_buffer_limits(_PIECE)
        super().connection_made(closing)
        self._looking = self.loop.call_at(self.accepted.until, self._look)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timeout."""
        self.finishing = True
        self._looking.cancel()
        self.accepted.gone()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Parse bytes, and bound the time for the rest of a head."""
        if not self.finishing:
            super().data_received(data)
            self._bound_rest()
            return
        self._dropped += len(data)
        if self._dropped > _REST_BYTES:
            self.drop()

    def send_400_response(self, msg: str) -> None:
        """Refuse an invalid request; an answer that has begun is cut off."""
        latest: Any = self.cycle
        if latest is not None:  # it waits for the rest of its body
            latest.disconnected = True
            latest.message_event.set()
        if self.conn.our_state is h11.SEND_RESPONSE or self.conn.our_state is h11.IDLE:
            super().send_400_response(msg)
        else:
            self.transport.abort()

    def on_response_complete(self) -> None:
        """Continue with the next request, whose head may have begun."""
        super().on_response_complete()
        self._bound_rest()

    def _bound_rest(self) -> None:
        """Start the timeout for the rest of a head that has begun."""
        in_part = self.is_idle and bool(self.conn.trailing_data[0])
        if in_part and not self._in_part and self.cycle is not None:
            self._look_in(self.held.first_seconds)
        self._in_part = in_part

    def _look_in(self, seconds: float) -> None:
        self._looking.cancel()
        self._seen = self.cycle
        self._looking = self.loop.call_later(seconds, self._look)

    def _look(self) -> None:
        """Close the connection if no request came since the last check."""
        if self.cycle is self._seen and self.is_idle:
            self.transport.close()
        else:
            self._look_in(KEPT_SECONDS)

    def drop(self) -> None:
        """End the connection at once, and discard the unread answer in the kernel."""
        opened = self.transport.get_extra_info("socket")
        if opened is not None and opened.fileno() >= 0:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.transport.abort()

    def finish(self, transport: asyncio.Transport) -> None:
        """Close the connection after the answer is read and the rest of the request has come, within bounds."""
        if self.finishing:
            return
        self.finishing = True
        self._looking.cancel()
        self._looking = self.loop.call_later(self.held.first_seconds, self.drop)
        if self.conn.their_state not in (h11.SEND_BODY, h11.ERROR):
            transport.close()
            return
        # Closing with unread bytes would send a reset, which overtakes the answer.
        transport.resume_reading()
        if transport.can_write_eof():
            transport.write_eof()

    async def _answered(self, scope: Any, receive: Any, send: Any) -> None:
        """Answer a request; the answer is written in pieces and must be read in time."""
        late: asyncio.TimerHandle | None = None
        cycle: Any = self.cycle

        async def in_pieces(message: Any) -> None:
            nonlocal late
            if message["type"] == "http.response.start" and cycle.more_body:
                # The rest of the request is not read.
                message = {**message, "headers": [*message.get("headers", ()), (b"connection", b"close")]}
            if message["type"] != "http.response.body":
                await send(message)
                return
            if late is None:
                late = self.loop.call_later(self.held.seconds, self.drop)
            body, more = memoryview(message.get("body", b"")), message.get("more_body", False)
            for start in range(0, len(body) or 1, _PIECE):
                rest = start + _PIECE < len(body)
                await send({**message, "body": bytes(body[start : start + _PIECE]), "more_body": rest or more})

        try:
            await self.config.loaded_app({**scope, ABORT: self.drop}, receive, in_pieces)
        finally:
            if late is not None:
                late.cancel()


def idle_timeout_protocol(connections: Connections) -> type[IdleTimeoutProtocol]:
    """Return the protocol class for the connections of one server."""
    return type("Protocol", (IdleTimeoutProtocol,), {"held": connections})
