"""JSON as a stream of YAML events, for the JSON that YAML does not read: tabs, surrogate pairs, keys of any length."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, TypeAlias

from yaml.error import Mark
from yaml.events import (
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

from cqos_core.encoding import Lines

if TYPE_CHECKING:
    from collections.abc import Iterator

    from yaml.events import Event

_BLANK = re.compile(r"[ \t\r\n]*+")
_WORD = re.compile(r"-?(?:0|[1-9][0-9]*+)(?:\.[0-9]++)?(?:[eE][-+]?[0-9]++)?(?![\w.+-])|(?:true|false|null)\b")


class JsonError(ValueError):
    """The text is not JSON; line and column are one-based."""

    def __init__(self, message: str, line: int, column: int) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


_STRINGS = json.JSONDecoder()

_Awaited: TypeAlias = str
"""What may come next: ``value``, ``first item``, ``first key``, ``key``, ``next``."""


def json_events(data: bytes) -> Iterator[Event]:
    """Yield the events a YAML parser would yield for the JSON document ``data``, of any depth.

    Raises:
        JsonError: where the text is not JSON, when the iteration gets there.
    """
    try:
        text = data.decode(json.detect_encoding(data))
    except UnicodeDecodeError as error:
        raise JsonError(f"its bytes are not {error.encoding}", 1, 1) from None
    return _Scanner(text.removeprefix("\ufeff")).events()


class _Scanner:
    """One pass over a text; ``opened`` holds the brackets that are not yet closed."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines = Lines(text)
        self.at = 0
        self.opened: list[str] = []

    def events(self) -> Iterator[Event]:
        """Yield events to the end of the text."""
        yield DocumentStartEvent()
        awaited: _Awaited = "value"
        while awaited != "next" or self.opened:
            self.blank()
            if awaited == "next":
                event, awaited = self.after_value()
            elif awaited == "key" or (awaited == "first key" and self.peek() != "}"):
                event, awaited = self.key(), "value"
            elif self.peek() == self.closing() and awaited.startswith("first"):
                event, awaited = self.close(), "next"
            else:
                event, awaited = self.value()
            if event is not None:
                yield event
        self.blank()
        if self.at < len(self.text):
            raise self.error("something follows after the end of the document")
        yield StreamEndEvent()

    def value(self) -> tuple[Event, _Awaited]:
        """Read a scalar, or begin a list or map."""
        mark = self.mark()
        first = self.peek()
        if first in {"{", "["}:
            self.opened.append(first)
            self.at += 1
            if first == "{":
                return MappingStartEvent(None, None, True, mark, mark), "first key"
            return SequenceStartEvent(None, None, True, mark, mark), "first item"
        if first == '"':
            return self.string(), "next"
        word = _WORD.match(self.text, self.at)
        if word is None:
            raise self.error("a value is expected here: text in double quotes, number, true, false, null, list or map")
        self.at = word.end()
        return ScalarEvent(None, None, (True, False), word[0], mark, mark), "next"

    def key(self) -> Event:
        """Read a key and its colon."""
        if self.peek() != '"':
            raise self.error("a key in double quotes is expected here")
        key = self.string()
        self.blank()
        if self.peek() != ":":
            raise self.error("a colon is expected between key and value")
        self.at += 1
        return key

    def after_value(self) -> tuple[Event | None, _Awaited]:
        """Go over a comma, or end the list or map."""
        if self.peek() == ",":
            self.at += 1
            return None, "key" if self.opened[-1] == "{" else "value"
        if self.peek() != self.closing():
            raise self.error(f"a comma or `{self.closing()}` is expected here")
        return self.close(), "next"

    def close(self) -> Event:
        """End a list or map."""
        mark = self.mark()
        self.at += 1
        return MappingEndEvent(mark, mark) if self.opened.pop() == "{" else SequenceEndEvent(mark, mark)

    def string(self) -> Event:
        """Read a text in double quotes."""
        mark = self.mark()
        try:
            text, self.at = _STRINGS.raw_decode(self.text, self.at)
            text.encode()
        except json.JSONDecodeError as error:
            self.at = error.pos
            raise self.error(error.msg[0].lower() + error.msg[1:]) from None
        except UnicodeEncodeError:
            self.at = mark.index
            raise self.error("half a surrogate pair is no character") from None
        return ScalarEvent(None, None, (False, True), text, mark, mark, style='"')

    def blank(self) -> None:
        """Go over blanks."""
        found = _BLANK.match(self.text, self.at)
        self.at = found.end() if found else self.at

    def peek(self) -> str:
        """Return the next character, or nothing at the end."""
        return self.text[self.at : self.at + 1]

    def closing(self) -> str:
        """Return the bracket that closes the innermost list or map."""
        return "}" if self.opened and self.opened[-1] == "{" else "]"

    def mark(self) -> Mark:
        """Return the zero-based place, as YAML's events have it."""
        line, column = self.lines.position(self.at)
        return Mark("", self.at, line - 1, column - 1, None, 0)

    def error(self, message: str) -> JsonError:
        """Make an error for the place reached."""
        return JsonError(message, *self.lines.position(self.at))
