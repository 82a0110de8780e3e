"""Frames between the service and a worker process: one per call, one per answer."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from functools import partial
from io import BytesIO
from typing import BinaryIO, Final, NamedTuple

_HEAD: Final = struct.Struct(">BQQ")

ANSWER, ANSWER_JSON, ANSWER_PAIR, OPEN_SESSION, EDIT_SESSION, CLOSE_SESSION, REOPEN_SESSION, OPEN_MODEL = range(8)
"""Kinds of calls."""
OK, REFUSED, FAILED, SPENT, GONE = range(5)
"""Kinds of answers: an answer, a google.rpc.Status, an internal traceback, the last google.rpc.Status of a worker that has no
memory left, or an unknown session."""


class Frame(NamedTuple):
    """One message.

    Attributes:
        kind: the kind of call or answer.
        number: of the method (`worker.METHOD_NAMES`), or of the session.
    """

    kind: int
    number: int
    data: bytes

    def encoded(self) -> bytes:
        """Return its bytes."""
        return _HEAD.pack(self.kind, self.number, len(self.data)) + self.data


def head(data: bytes) -> tuple[int, int, int]:
    """Return kind, number and length of data of a frame's first `HEAD_SIZE` bytes."""
    kind, number, size = _HEAD.unpack(data)
    return kind, number, size


HEAD_SIZE: Final = _HEAD.size


def pack_messages(messages: Iterable[bytes]) -> bytes:
    """Join messages; `unpack_messages` splits them."""
    return b"".join(Frame(EDIT_SESSION, 0, each).encoded() for each in messages)


def unpack_messages(data: bytes) -> list[bytes]:
    """Return the messages that `pack_messages` joined."""
    return [frame.data for frame in iter(partial(read, BytesIO(data)), None)]


def read(stream: BinaryIO) -> Frame | None:
    """Return the next frame; None if the other side is gone."""
    start = stream.read(HEAD_SIZE)
    if len(start) < HEAD_SIZE:
        return None
    kind, number, size = head(start)
    data = stream.read(size)
    return Frame(kind, number, data) if len(data) == size else None
