"""An MQTT client that does what the standard asks and no more: no library helps it over a fault."""

from __future__ import annotations

import asyncio
import struct
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Final

from cqos_live.mqtt.prove import packets

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_live.mqtt.prove.packets import Message, Will

AGAIN: Final = 0.02
"""Seconds between two attempts to connect."""
_BLOCK: Final = 0.005
"""Seconds of silence after which a slow program has taken all that is there."""
WIDEST: Final = 65_535


@dataclass(frozen=True, slots=True)
class Connection:
    """What a client says when it connects."""

    client_id: str
    five: bool = True
    clean: bool = True
    session_expiry: int = 0
    keep_alive: int = 60
    receive_maximum: int = WIDEST
    maximum_packet_size: int | None = None
    sends_at_once: int = WIDEST
    username: str | None = None
    will: Will | None = None
    stores_session: bool = False
    """Whether its part of the session is still there after its program was killed."""
    patience: float = 0.0
    """Seconds that it waits before it connects again."""


@dataclass(slots=True)
class Publication:
    """What a program publishes."""

    topic: str
    payload: bytes
    qos: int
    retain: bool = False
    expiry: int | None = None
    alias: int | None = None
    received: bool = False
    """Of QoS 2: whether the broker has said that it has it."""


@dataclass(slots=True)
class Session:
    """The client's part of a session."""

    unacknowledged: dict[int, Publication] = field(default_factory=dict)
    seen: set[int] = field(default_factory=set)
    """Of QoS 2: identifiers of publications that were handed to the program and are not released yet."""


@dataclass(slots=True)
class Subscription:
    """A filter with its options."""

    filter: str
    qos: int
    no_local: bool = False
    as_published: bool = False
    handling: int = 0
    identifier: int | None = None


class Client:
    """One client: connects, and connects again when its connection breaks, until it is stopped or killed."""

    def __init__(
        self,
        connection: Connection,
        port: int,
        tell: Callable[[str, str], None],
        deliver: Callable[[Message], None] = lambda _message: None,
        subscription: Subscription | None = None,
        every: float = 0.0,
    ) -> None:
        """``tell`` is called with what happens, ``deliver`` with what arrives; ``every``: seconds between two takes."""
        self.connection, self.port, self.tell, self.deliver = connection, port, tell, deliver
        self.subscription, self.every = subscription, every
        self.session = Session()
        self.waiting: deque[Publication] = deque()
        self.window = connection.sends_at_once
        self.ready = asyncio.Event()
        """Set while it is connected and, if it has a subscription, subscribed."""
        self.settled = asyncio.Event()
        """Set once it is connected, or refused."""
        self.running = asyncio.Event()
        """Set while its program runs."""
        self.refusal = ""
        """Why the broker does not take it, where it does not."""
        self._writer: asyncio.StreamWriter | None = None
        self._last = 0
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to connect."""
        self.running.set()
        self.settled.clear()
        self._task = asyncio.create_task(self._run())

    async def stop(self) -> None:
        """Disconnect in good order."""
        if self._writer is not None and self.ready.is_set():
            self._send(packets.packet(packets.DISCONNECT, 0))
        await self._end()

    async def kill(self) -> None:
        """End as a killed process ends: the connection breaks, and what is in memory is gone."""
        if self._writer is not None:
            self._writer.transport.abort()
        await self._end()
        if not self.connection.stores_session:
            self.waiting.clear()
            self.session = Session()

    def freeze(self) -> None:
        """Fall silent, as a program that hangs: the connection stays."""
        if self._task is not None:
            self._task.cancel()

    async def _end(self) -> None:
        self.running.clear()
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None
        self._close()

    def _close(self) -> None:
        self.ready.clear()
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    def publish(self, publication: Publication) -> None:
        """Send it, or keep it until there is room and a connection; QoS 0 waits for none."""
        if publication.qos or self.ready.is_set():
            self.waiting.append(publication)
            self._flush()

    # The connection

    async def _run(self) -> None:
        while True:
            with suppress(OSError, asyncio.IncompleteReadError):
                stream, self._writer = await asyncio.open_connection("127.0.0.1", self.port)
                await self._talk(stream)
            if self.ready.is_set():
                self.tell("disconnected", "")
            self._close()
            await asyncio.sleep(max(AGAIN, self.connection.patience))

    async def _talk(self, stream: asyncio.StreamReader) -> None:
        self._send(self._connect())
        connack = await packets.receive(stream)
        if code := connack.body[1]:
            self._refused("refuses the connection", code)
            return
        resumed = bool(connack.body[0] & 1)
        self.session = self.session if resumed else Session()
        announced = packets.limits(connack, five=self.connection.five)
        self.window = min(self.connection.sends_at_once, announced.get(0x21, WIDEST))
        if self.subscription is None:
            self._ready(resumed)
        else:
            self._send(self._subscribe(self.subscription))
        pings = asyncio.create_task(self._ping(announced.get(0x13, self.connection.keep_alive)))
        try:
            while True:
                await self._take(stream, resumed=resumed)
        finally:
            pings.cancel()

    async def _take(self, stream: asyncio.StreamReader, *, resumed: bool) -> None:
        """Take one packet; a slow program takes all that is there, and then none for a while."""
        if not self.every or not self.ready.is_set():
            self._handle(await packets.receive(stream), resumed=resumed)
            return
        await asyncio.sleep(self.every)
        with suppress(asyncio.TimeoutError):
            while True:
                head = await asyncio.wait_for(stream.readexactly(1), _BLOCK)
                self._handle(await packets.receive(stream, head[0]), resumed=resumed)

    async def _ping(self, keep_alive: int) -> None:
        while keep_alive:
            await asyncio.sleep(keep_alive / 2)
            self._send(packets.packet(12, 0))

    def _ready(self, resumed: bool) -> None:  # noqa: FBT001
        self.refusal = ""
        self.settled.set()
        self.tell("connected", "session resumed" if resumed else "new session")
        self.ready.set()
        for identifier, publication in self.session.unacknowledged.items():
            released = packets.acknowledgement(packets.PUBREL, identifier)
            self._send(released if publication.received else self._publish(publication, identifier, again=True))
        self._flush()

    def _handle(self, received: packets.Packet, *, resumed: bool) -> None:
        five = self.connection.five
        if received.kind == packets.PUBLISH:
            self._arrived(packets.publication(received, five=five))
            return
        if received.kind == packets.DISCONNECT:
            self._refused("ends the connection", received.body[0] if received.body else 0)
            return
        if received.kind not in {packets.PUBACK, packets.PUBREC, packets.PUBREL, packets.PUBCOMP, packets.SUBACK}:
            return
        identifier, code = packets.answered(received, five=five)
        if packets.refused(code) and received.kind != packets.PUBCOMP:
            self._refused("refuses it", code)
            self.session.unacknowledged.pop(identifier, None)
        elif received.kind == packets.SUBACK:
            self.tell("granted", f"QoS {code}")
            self._ready(resumed)
        elif received.kind == packets.PUBREC:
            if (publication := self.session.unacknowledged.get(identifier)) is not None:
                publication.received = True
            self._send(packets.acknowledgement(packets.PUBREL, identifier))
        elif received.kind == packets.PUBREL:
            self.session.seen.discard(identifier)
            self._send(packets.acknowledgement(packets.PUBCOMP, identifier))
        else:
            self.session.unacknowledged.pop(identifier, None)
            self._flush()

    def _refused(self, does: str, code: int) -> None:
        self.refusal = f"the broker {does}, reason code 0x{code:02X}"
        self.settled.set()
        self.tell("refused", self.refusal)

    def _arrived(self, message: Message) -> None:
        if message.qos < 2 or message.number not in self.session.seen:  # noqa: PLR2004 - exactly once
            self.deliver(message)
        if message.qos == 1:
            self._send(packets.acknowledgement(packets.PUBACK, message.number))
        elif message.qos:
            self.session.seen.add(message.number)
            self._send(packets.acknowledgement(packets.PUBREC, message.number))

    # Sending

    def _flush(self) -> None:
        while self.ready.is_set() and self.waiting:
            publication = self.waiting[0]
            if publication.qos and len(self.session.unacknowledged) >= self.window:
                return
            self.waiting.popleft()
            identifier = self._identifier() if publication.qos else 0
            if publication.qos:
                self.session.unacknowledged[identifier] = publication
            self._send(self._publish(publication, identifier))

    def _identifier(self) -> int:
        others = (each % WIDEST + 1 for each in count(self._last))
        self._last = next(each for each in others if each not in self.session.unacknowledged)
        return self._last

    def _send(self, data: bytes) -> None:
        if self._writer is not None and not self._writer.is_closing():
            self._writer.write(data)

    def _connect(self) -> bytes:
        own, will = self.connection, self.connection.will
        flags = 2 * own.clean | (own.username is not None) << 7
        tail = [packets.text(own.client_id)]
        if will is not None:
            flags |= 4 | will.qos << 3 | will.retain << 5
            stated = packets.properties({0x18: will.delay or None, 0x02: will.expiry})
            tail += [stated if own.five else b"", packets.text(will.topic), packets.text(will.payload)]
        if own.username is not None:
            tail.append(packets.text(own.username))
        entries: dict[int, int | str | None] = {
            0x11: own.session_expiry or None,
            0x21: own.receive_maximum if own.receive_maximum < WIDEST else None,
            0x27: own.maximum_packet_size,
        }
        head = packets.text("MQTT") + bytes([5 if own.five else 4, flags]) + struct.pack("!H", own.keep_alive)
        return packets.packet(1, 0, b"".join([head, packets.properties(entries) if own.five else b"", *tail]))

    def _subscribe(self, wanted: Subscription) -> bytes:
        options, more = wanted.qos, b""
        if self.connection.five:
            options |= wanted.no_local << 2 | wanted.as_published << 3 | wanted.handling << 4
            more = packets.properties({0x0B: wanted.identifier})
        body = struct.pack("!H", self._identifier()) + more + packets.text(wanted.filter) + bytes([options])
        return packets.packet(8, 2, body)

    def _publish(self, publication: Publication, identifier: int, *, again: bool = False) -> bytes:
        flags = publication.qos << 1 | publication.retain | again << 3
        number = struct.pack("!H", identifier) if publication.qos else b""
        stated = packets.properties({0x02: publication.expiry, 0x23: publication.alias})
        body = packets.text(publication.topic) + number + (stated if self.connection.five else b"")
        return packets.packet(packets.PUBLISH, flags, body + publication.payload)
