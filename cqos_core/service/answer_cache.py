"""A bounded cache of answers."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from datetime import date


class AnswerCache:
    """The latest answers by their requests, bounded in number and bytes."""

    def __init__(self, most: int, most_bytes: int) -> None:
        """Begin empty."""
        self._most = most
        self._most_bytes = most_bytes
        self._bytes = 0
        self._entries: OrderedDict[tuple[str, date, bytes], bytes] = OrderedDict()

    def get(self, key: tuple[str, date, bytes]) -> bytes | None:
        """Return the answer to a request, if it is still there."""
        found = self._entries.get(key)
        if found is not None:
            self._entries.move_to_end(key)
        return found

    def put(self, key: tuple[str, date, bytes], value: bytes) -> None:
        """Add an answer; the oldest ones are dropped beyond the bounds."""
        if key in self._entries:  # from an equal request at the same time
            return
        self._entries[key] = value
        self._bytes += len(key[2]) + len(value)
        while len(self._entries) > self._most or self._bytes > self._most_bytes:
            (_, _, asked), answered = self._entries.popitem(last=False)
            self._bytes -= len(asked) + len(answered)
