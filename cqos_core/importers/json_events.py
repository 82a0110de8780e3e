"""JSON and JSON5 as a stream of YAML events; YAML refuses their tabs, surrogate pairs, and comments with slashes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Final

from yaml.error import Mark
from yaml.events import (
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

from cqos_core.model.encoding import Lines
from cqos_core.model.regular_expressions import re, regular_expression

_BLANK = regular_expression(r"[ \t\r\n]*+")
_WORD = regular_expression(r"-?(?:0|[1-9][0-9]*+)(?:\.[0-9]++)?(?:[eE][-+]?[0-9]++)?(?![\w.+-])|(?:true|false|null)\b")
_NOTHING = regular_expression(r"(?!)")
_IGNORED: Final = regular_expression(r"(?:[\s\ufeff]++|//[^\n\r\u2028\u2029]*+|/\*(?:[^*]|\*(?!/))*+\*/)*+")
_NUMBER: Final = (
    r"[-+]?(?:0[xX][0-9a-fA-F]++|(?:(?:0|[1-9][0-9]*+)(?:\.[0-9]*+)?|\.[0-9]++)(?:[eE][-+]?[0-9]++)?|Infinity|NaN)"
)
_WORD5: Final = regular_expression(rf"(?:{_NUMBER}|true|false|null)(?![\w.$+-])")
_IDENTIFIER: Final = regular_expression(r"[^\W\d][\w$]*+|\$[\w$]*+")
_PLAIN: Final = regular_expression(r"""[^"'\\\n\r]++""")
_ESCAPE: Final = regular_expression(r"\\(?:x([0-9a-fA-F]{2})|u([0-9a-fA-F]{4})|(\r\n|[^xu1-9]))", re.DOTALL)
_BARE: Final = regular_expression(
    r"""'([^'"\n]+)'|[\u201c\u201d\u201e\u00ab\u00bb]([^"\n\u201c\u201d\u201e\u00ab\u00bb]+)[\u201c\u201d\u201e\u00ab\u00bb]|([^\W\d][\w.-]*)"""
)
"""A text in quotes that JSON does not have, or without quotes."""
_BRACKETS: Final = regular_expression(r"""[\[{}\]]|"(?:[^"\\\n]|\\.)*+\"""")
_CLOSING: Final = {"{": "}", "[": "]"}
_ESCAPED: Final = {
    "b": "\b",
    "f": "\f",
    "n": "\n",
    "r": "\r",
    "t": "\t",
    "v": "\v",
    "0": "\0",
    **dict.fromkeys(("\n", "\r", "\r\n", "\u2028", "\u2029"), ""),  # the text goes on in the next line
}


class JsonError(ValueError):
    """The text is not JSON, or not JSON5; line and column are one-based, ``advice`` says what to write, where that is known."""

    def __init__(self, message: str, line: int, column: int, advice: str | None = None) -> None:
        super().__init__(message)
        self.advice = advice
        self.line = line
        self.column = column


_STRINGS = json.JSONDecoder()


def json_events(data: bytes) -> Iterator[Event]:
    """Yield the events a YAML parser would yield for the JSON document ``data``.

    Raises:
        JsonError: where the text is not JSON, when the iteration gets there.
    """
    return _Scanner(_decoded(data)).events()


def json5_events(data: bytes) -> Iterator[Event]:
    """Yield the events a YAML parser would yield for the JSON5 document ``data``.

    Raises:
        JsonError: where the text is not JSON5, when the iteration gets there.
    """
    return _Json5Scanner(_decoded(data)).events()


def _decoded(data: bytes) -> str:
    try:
        text = data.decode(json.detect_encoding(data))
    except UnicodeDecodeError as error:
        raise JsonError(f"its bytes are not {error.encoding}", 1, 1) from None
    return text.removeprefix("\ufeff")


class _Scanner:
    """One pass over a text of JSON; JSON5 overrides the attributes.

    Attributes:
        quotes: characters that begin and end a text.
        word, blanks, name: patterns of a number or word, of blanks between values, and of a key without quotes.
        values, keys: what is expected where a value or a key begins, for messages.
        comma_at_end: a comma may stand before the bracket that closes a list or map.
    """

    quotes = '"'
    word = _WORD
    values = "text in double quotes, number, true, false, null, list or map"
    blanks = _BLANK
    name = _NOTHING
    keys = "a key in double quotes is expected here"
    comma_at_end = False

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines = Lines(text)
        self.at = 0
        self.began = 0  # of the last text in quotes

    def events(self) -> Iterator[Event]:
        """Yield events to the end of the text."""
        yield DocumentStartEvent()
        yield from self.value()
        self.blank()
        if self.at < len(self.text):
            raise self.error("something follows after the end of the document")
        yield StreamEndEvent()

    def value(self) -> Iterator[Event]:
        """Read a value; the caller stops where lists and maps are nested too deep."""
        self.blank()
        mark, first = self.mark(), self.peek()
        if first == "{":
            yield MappingStartEvent(None, None, True, mark, mark)
            yield from self.parts("}", self.entry)
            yield MappingEndEvent(self.mark())
        elif first == "[":
            yield SequenceStartEvent(None, None, True, mark, mark)
            yield from self.parts("]", self.value)
            yield SequenceEndEvent(self.mark())
        elif first and first in self.quotes:
            yield self.string()
        elif word := self.word.match(self.text, self.at):
            self.at = word.end()
            yield ScalarEvent(None, None, (True, False), word[0], mark, mark)
        else:
            raise self.error(f"a value is expected here: {self.values}", self.meant())

    def parts(self, closing: str, part: Callable[[], Iterator[Event]]) -> Iterator[Event]:
        """Read the contents of a list or map, from its first bracket to behind its last one."""
        start = self.at
        self.at += 1
        self.blank()
        more = self.peek() != closing
        while more:
            yield from part()
            self.blank()
            more = self.peek() == ","
            if more:
                comma = self.at
                self.at += 1
                self.blank()
                more = not (self.comma_at_end and self.peek() == closing)
                if more and self.peek() == ",":
                    raise self.error("one comma too many", "remove it")
                if more and self.peek() == closing:
                    self.at = comma
                    raise self.error(
                        f"a comma stands before `{closing}`", "remove it; JSON has none behind the last part"
                    )
        if self.peek() != closing:
            raise self.not_closed(start, closing)
        self.at += 1

    def meant(self) -> str | None:
        """Say how the word that stands here, without quotes or in others, is written."""
        if self.text.startswith(("//", "/*", "#"), self.at):
            return "remove the comment: JSON has none"
        found = _BARE.match(self.text, self.at)
        if found is None:
            return None
        word = next(filter(None, found.groups()))
        constant = {"True": "true", "False": "false", "None": "null"}.get(word)
        return f"write `{constant}`" if constant else f'write `"{word}"`'

    def not_closed(self, start: int, closing: str) -> JsonError:
        """Make an error for a list or map that begins at ``start`` and is neither closed nor continued here."""
        line, column = self.lines.position(start)
        opened = f"`{self.text[start]}` of line {line}, column {column}"
        if not self.peek():
            if (found := self.badly_nested()) is not None:
                start, self.at = found
                line, column = self.lines.position(start)
                text = self.lines.line(self.lines.position(self.at)[0]).strip()
                opened = f"`{self.text[start]}` of line {line}, column {column}"
                return self.error(
                    f"{opened} is not closed before here", f"write `{_CLOSING[self.text[start]]}` before `{text}`"
                )
            self.at = start
            return self.error(f"{opened} is not closed", f"write `{closing}` where its last part ends")
        if self.peek().isalnum() and self.text[self.at - 1] == '"':
            text = self.text[self.began + 1 : self.at - 1]
            self.at = self.began
            return self.error(
                f"the text `{text}` ends where the next one begins", f'close its quotes: `"{text.split(",")[0]}"`'
            )
        if self.peek() in "]}":
            return self.error(
                f"`{self.peek()}` does not close {opened}", f"write `{closing}` before it or in its place"
            )
        self.at = len(self.text[: self.at].rstrip())
        return self.error(
            f"a comma or `{closing}` is expected here", f"write `,` here, or `{closing}` where {opened} ends"
        )

    def entry(self) -> Iterator[Event]:
        """Read a key and its value."""
        yield self.key()
        yield from self.value()

    def key(self) -> Event:
        """Read a key, in quotes or where the format allows it a name, and its colon."""
        found = self.name.match(self.text, self.at)
        if found is None and (not self.peek() or self.peek() not in self.quotes):
            raise self.error(self.keys, self.meant())
        mark = self.mark()
        key = self.string() if found is None else _text_event(found[0], mark)
        self.at = self.at if found is None else found.end()
        self.blank()
        if self.peek() != ":":
            raise self.error("a colon is expected between key and value")
        self.at += 1
        return key

    def badly_nested(self) -> tuple[int, int] | None:
        """Return a bracket, and the one on a line of its own that closes it but is indented less than its line."""
        opened: list[int] = []
        for found in _BRACKETS.finditer(self.text):
            if found[0] in _CLOSING:
                opened.append(found.start())
            elif found[0] in "]}" and opened:
                begin, end = self._indent(opened[-1]), self._indent(found.start())
                if end < begin and not self.text[: found.start()].rpartition("\n")[2].strip():
                    return opened[-1], found.start()
                opened.pop()
        return None

    def _indent(self, at: int) -> int:
        line = self.lines.line(self.lines.position(at)[0])
        return len(line) - len(line.lstrip())

    def string(self) -> Event:
        """Read a text in quotes."""
        mark = self.mark()
        self.began = self.at
        try:
            return _text_event(self.characters(mark).encode("utf-16-le", "surrogatepass").decode("utf-16-le"), mark)
        except UnicodeDecodeError:
            self.at = mark.index
            raise self.error("half a surrogate pair is no character") from None

    def characters(self, mark: Mark) -> str:  # noqa: ARG002 - JSON5 reports some errors where the text begins
        """Return the text within quotes, escapes resolved."""
        try:
            text, self.at = _STRINGS.raw_decode(self.text, self.at)
        except json.JSONDecodeError as error:
            self.at = error.pos
            raise self.error(error.msg[0].lower() + error.msg[1:]) from None
        return str(text)

    def blank(self) -> None:
        """Go over blanks, and over comments where the format has them."""
        found = self.blanks.match(self.text, self.at)
        self.at = found.end() if found else self.at
        if self.blanks is _IGNORED and self.text.startswith("/*", self.at):
            raise self.error("the comment that begins here does not end")

    def peek(self) -> str:
        """Return the next character, or nothing at the end."""
        return self.text[self.at : self.at + 1]

    def mark(self) -> Mark:
        """Return the zero-based place, as YAML's events have it."""
        line, column = self.lines.position(self.at)
        return Mark("", self.at, line - 1, column - 1, None, 0)

    def error(self, message: str, advice: str | None = None) -> JsonError:
        """Make an error for the place reached."""
        return JsonError(message, *self.lines.position(self.at), advice)


class _Json5Scanner(_Scanner):
    """One pass over JSON5 (spec.json5.org): comments, names without quotes, single quotes, a comma at the end."""

    quotes = "\"'"
    word = _WORD5
    values = "text in quotes, number, true, false, null, list or map"
    blanks = _IGNORED
    name = _IDENTIFIER
    keys = "a key is expected here: a name, or text in quotes"
    comma_at_end = True

    def characters(self, mark: Mark) -> str:
        """Return the text within quotes of either kind, escapes resolved."""
        quote = self.peek()
        self.at += 1
        parts: list[str] = []
        while (char := self.peek()) != quote:
            plain, escape = _PLAIN.match(self.text, self.at), _ESCAPE.match(self.text, self.at)
            if plain is not None:
                parts.append(plain[0])
                self.at = plain.end()
            elif escape is not None:
                code = escape[1] or escape[2]
                parts.append(chr(int(code, 16)) if code else _ESCAPED.get(escape[3], escape[3]))
                self.at = escape.end()
            elif char and char in self.quotes:
                parts.append(char)
                self.at += 1
            elif char == "\\":
                raise self.error("an escape of JSON5 is expected after the backslash")
            else:
                self.at = mark.index
                raise self.error("the text that begins here does not end on its line")
        self.at += 1
        return "".join(parts)


def _text_event(text: str, mark: Mark) -> Event:
    return ScalarEvent(None, None, (False, True), text, mark, mark, style='"')
