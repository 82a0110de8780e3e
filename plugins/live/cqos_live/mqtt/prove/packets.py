"""Control packets of MQTT 3.1.1 and 5.0 as bytes: what a client sends, and the parts of what it receives."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    import asyncio

CONNACK: Final = 2
PUBLISH: Final = 3
PUBACK: Final = 4
PUBREC: Final = 5
PUBREL: Final = 6
PUBCOMP: Final = 7
SUBACK: Final = 9
DISCONNECT: Final = 14
_FAILURE: Final = 0x80
_CONTINUES: Final = 0x80
# Kinds of properties by identifier (5.0, 2.2.2.2): bytes of a number, or `text`, `pair`, `number`.
_BYTE, _TWO, _FOUR = 1, 2, 4
_SIZES: Final = {
    **dict.fromkeys((0x01, 0x17, 0x19, 0x24, 0x25, 0x28, 0x29, 0x2A), _BYTE),
    **dict.fromkeys((0x13, 0x21, 0x22, 0x23), _TWO),
    **dict.fromkeys((0x02, 0x11, 0x18, 0x27), _FOUR),
}
_NUMBER: Final = 0x0B
_PAIR: Final = 0x26


class Packet(NamedTuple):
    """A packet as it came."""

    kind: int
    flags: int
    body: bytes


class Message(NamedTuple):
    """A publication as it came."""

    topic: str
    payload: bytes
    qos: int
    retain: bool
    number: int


class Will(NamedTuple):
    """The last words of a connection."""

    topic: str
    payload: bytes
    qos: int
    retain: bool
    delay: int
    expiry: int | None


def number(value: int) -> bytes:
    """Write a number of variable length."""
    written = bytearray()
    while value >= _CONTINUES:
        written.append(value % _CONTINUES | _CONTINUES)
        value //= _CONTINUES
    return bytes([*written, value])


def text(value: str | bytes) -> bytes:
    """Write a text, or bytes, with the length before it."""
    data = value if isinstance(value, bytes) else value.encode()
    return struct.pack("!H", len(data)) + data


def packet(kind: int, flags: int, body: bytes = b"") -> bytes:
    """Write a packet with its fixed header."""
    return bytes([kind << 4 | flags]) + number(len(body)) + body


def properties(entries: dict[int, int | str | None]) -> bytes:
    """Write the properties that have a value."""
    body = bytearray()
    for identifier, value in entries.items():
        if isinstance(value, str):
            body += bytes([identifier]) + text(value)
        elif value is not None:
            size = _SIZES.get(identifier)
            body += bytes([identifier]) + (number(value) if size is None else value.to_bytes(size, "big"))
    return number(len(body)) + bytes(body)


def acknowledgement(kind: int, number_of_packet: int) -> bytes:
    """Write PUBACK, PUBREC, PUBREL or PUBCOMP."""
    return packet(kind, 2 if kind == PUBREL else 0, struct.pack("!H", number_of_packet))


async def receive(stream: asyncio.StreamReader, first: int | None = None) -> Packet:
    """Read one packet, or the rest of one whose first byte was read.

    Raises:
        asyncio.IncompleteReadError: the connection ended.
        ConnectionError: it broke.
    """
    if first is None:
        first = (await stream.readexactly(1))[0]
    length = b"\x80"
    while length[-1] & _CONTINUES:
        length += await stream.readexactly(1)
    return Packet(first >> 4, first & 15, await stream.readexactly(_number_at(length, 1)[0]))


def publication(received: Packet, *, five: bool) -> Message:
    """Read a PUBLISH."""
    size = struct.unpack_from("!H", received.body)[0]
    at = 2 + size
    topic = received.body[2:at].decode()
    qos = received.flags >> 1 & 3
    identifier = 0
    if qos:
        identifier = struct.unpack_from("!H", received.body, at)[0]
        at += 2
    if five:
        length, at = _number_at(received.body, at)
        at += length
    return Message(topic, received.body[at:], qos, bool(received.flags & 1), identifier)


def answered(received: Packet, *, five: bool) -> tuple[int, int]:
    """Return which packet an acknowledgement is about, and the reason code: of a SUBACK that of its one filter."""
    identifier = struct.unpack_from("!H", received.body)[0]
    if received.kind == SUBACK:
        return identifier, received.body[-1]
    return identifier, received.body[2] if five and len(received.body) > 2 else 0  # noqa: PLR2004 - the identifier


def refused(code: int) -> bool:
    """Whether a reason code is a failure."""
    return code >= _FAILURE


def limits(connack: Packet, *, five: bool) -> dict[int, int]:
    """Return the numeric properties of a CONNACK, by identifier."""
    found: dict[int, int] = {}
    length, at = _number_at(connack.body, 2) if five else (0, 0)
    end = at + length
    while at < end:
        identifier = connack.body[at]
        at += 1
        size = _SIZES.get(identifier)
        if size is not None:
            found[identifier] = int.from_bytes(connack.body[at : at + size], "big")
            at += size
        elif identifier == _NUMBER:
            found[identifier], at = _number_at(connack.body, at)
        else:
            for _ in range(2 if identifier == _PAIR else 1):
                at += 2 + struct.unpack_from("!H", connack.body, at)[0]
    return found


def _number_at(data: bytes, at: int) -> tuple[int, int]:
    """Read a number of variable length; return it and where the rest begins."""
    last = next(place for place in range(at, len(data)) if not data[place] & _CONTINUES)
    digits = (data[place] % _CONTINUES << 7 * (place - at) for place in range(at, last + 1))
    return sum(digits), last + 1
