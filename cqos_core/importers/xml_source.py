"""Safe parsing of XML: bytes become a tree, or one clear error with its line and column.

For every importer of XML. Documents come from strangers, so the parser has no entities, no document types, no files and no
network. Depth and lengths are limited, and time and memory are those of one plain parse.
"""

from __future__ import annotations

import codecs
from bisect import bisect_right
from functools import cached_property
from itertools import islice
from threading import Lock
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar, cast
from urllib.parse import quote

from lxml import etree

from cqos_core.model.encoding import Lines, byte_order_mark, codec, decode, encoding_of
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.regular_expressions import re
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from typing import TypeAlias

    from cqos_core.model.source import Source

    # lxml's stubs, and lxml, have no public name for the type of elements.
    Element: TypeAlias = etree._Element  # noqa: SLF001

_Target = TypeVar("_Target", bound="Target")
_SPACE = b" \t\r\n"
_LONGEST = 100
LONGEST_TEXT: Final = 10_000_000
"""Letters of the longest text that the parser puts into a tree."""
MOST_LINES: Final = 65_535
"""The line at which the parser stops counting."""
_PART: Final = 32_768
_OPTIONS: Final[dict[str, Any]] = {
    "encoding": "utf-8",  # instead of the declared one, which `_utf8` has seen to
    "resolve_entities": False,
    "load_dtd": False,
    "dtd_validation": False,
    "attribute_defaults": False,
    "no_network": True,
    "huge_tree": False,
    "collect_ids": False,
    "remove_comments": True,
    "remove_pis": True,
}
# There is no document type that could declare any. Without this, targets are told `&#38;` where an attribute has `&amp;`.
_OF_TARGETS: Final[dict[str, Any]] = _OPTIONS | {"resolve_entities": "internal"}
# Blanks, comments and processing instructions; possessive, so that the time is linear whatever stands there.
_PROLOG = re.compile(rb"(?:[ \t\r\n]++|<\?(?:[^?]++|\?(?!>))*+\?>|<!--(?:[^-]++|-(?!->))*+-->)*+")
_HTML = re.compile(rb"<!doctype\s+html|<html[\s>]", re.IGNORECASE)
_DOCTYPE_WORDS = re.compile(rb"""[^"'\[>]++|"[^"]*+"|'[^']*+'""")
# Namespace names; comments and sections are passed over. Possessive, too.
_NAMESPACE_NAME = re.compile(
    rb"""<!--(?:[^-]++|-(?!->))*+|<!\[CDATA\[(?:[^\]]++|\](?!\]>))*+"""
    rb"""|(?P<before>\sxmlns(?::[^\s=<>"'/]++)?+\s*+=\s*+(?P<quote>["']))(?P<name>[^<"']++)(?P<after>(?P=quote))"""
)
# Comments, sections and instructions, which have no tags; and a start tag outside of them.
_NO_TAG = re.compile(rb"<!--(?:[^-]++|-(?!->))*+-->|<!\[CDATA\[(?:[^\]]++|\](?!\]>))*+\]\]>|<\?(?:[^?]++|\?(?!>))*+\?>")
_START_TAG = re.compile(rb"""<(?!/)(?:[^<>"']++|"[^"]*+"|'[^']*+')*+>""")
_MARKS: Final = (b"<!", b"<?")
_BLOCK: Final = 2_048
_WEB = re.compile(rb"https?://", re.IGNORECASE)
_SURELY_URI = re.compile(rb"[A-Za-z][\w.-]*+:?(?:[\w./?=;-]++|&amp;)*+(?:#[\w./-]*+)?", re.ASCII)
_DEPTH = re.compile(r"Excessive depth in document: (\d+)")
_NAMESPACE = re.compile(r"Namespace prefix (\S+) (?:for (\S+) )?on (\S+) is not defined")
_UNCLOSED = re.compile(r"Premature end of data in tag (.+) line (\d+)")


def parse_xml(source: Source, most_tags: int | None = None) -> Element:
    """Return the root element of ``source``; lines are in ``sourceline``, where the start tag ends.

    ``most_tags`` is more than real files of the format have; a document with more is refused before it is parsed.

    Raises:
        InputError: with the one problem that stopped the parser: CQ001 if this is no well-formed XML in the
            encoding it says, CQ002 if it declares entities or has parts that no real document has.
    """
    if most_tags is not None and source.data.count(b"<") > most_tags:
        raise _error(source, "CQ002", f"there are more than {most_tags} tags in this file, which is refused")
    return parse_utf8(source, plain_utf8(source))


def plain_utf8(source: Source) -> bytes:
    """Return the document in UTF-8, without byte order mark and document type; see `parse_xml` for errors."""
    return _without_document_type(source, _utf8(source))


def parse_utf8(source: Source, data: bytes) -> Element:
    """Return the root element of ``data``, which `plain_utf8` made of ``source``; see `parse_xml` for errors."""
    parser = _parser()
    try:
        return etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        if not any(entry.type_name == "WAR_NS_URI" for entry in parser.error_log):
            raise InputError([_explain(source, parser, error)]) from None
    parser = _parser()
    try:
        return etree.fromstring(_NAMESPACE_NAME.sub(_as_uri, data), parser)
    except etree.XMLSyntaxError as error:
        raise InputError([_explain(source, parser, error)]) from None


class Target(Protocol):
    """Receives the contents of a document from the parser."""

    def start(self, tag: str, attributes: Mapping[str, str], namespaces: Mapping[str, str]) -> Any:
        """Take a start tag, and the namespaces that it declares."""

    def data(self, text: str) -> Any:
        """Take text, or a part of it."""

    def end(self, tag: str) -> Any:
        """Take an end tag."""

    def close(self) -> Any:
        """Take the end of the document."""


class LongTextError(Exception):
    """A target was told of a text that is longer than `LONGEST_TEXT`."""


def parse_into(source: Source, data: bytes, begin: Callable[[], _Target]) -> _Target:
    """Return a target that received all of ``data``, which `plain_utf8` made of ``source``. See `parse_xml` for errors."""
    text = data
    for _ in ("as it is", "with other names of namespaces"):
        target = begin()
        # The stubs of lxml do not know targets that are told of namespaces.
        parser: Any = etree.XMLParser(target=cast("Any", target), **_OF_TARGETS)
        try:
            # In one piece: fed with several, the parser does not look how deep it is.
            etree.fromstring(text, parser)
        except (etree.XMLSyntaxError, LongTextError):
            is_complete = False
        else:
            is_complete = True
        errors = {entry.type_name for entry in parser.error_log if entry.level_name != "WARNING"}
        if is_complete and not errors:
            return target
        if "WAR_NS_URI" not in errors:
            break
        text = _NAMESPACE_NAME.sub(_as_uri, data)
    parse_utf8(source, data)  # says what is wrong
    raise _error(source, "CQ001", "this is not well-formed XML")


class StartTags:
    """Tells the line where any start tag of a document ends, by its number; it looks as far as one asks."""

    def __init__(self, data: bytes) -> None:
        """Take a document that was parsed, as `plain_utf8` returned it."""
        self._written = data
        self._start = _prolog_end(data, 0)
        # Start tags and lines before each block that was looked at, and before the next one.
        self._tags = [0]
        self._lines = [1 + data.count(b"\n", 0, self._start)]
        self._lock = Lock()  # several threads may read one report
        self._block = -1  # the last that was asked for, and the lines of its start tags
        self._in_block: list[int] = []

    @cached_property
    def _data(self) -> bytes:
        """The document with blanks in place of comments, sections and instructions behind its first start tag."""
        # One letter is found much faster than two.
        if all(
            self._written.find(mark[1:], self._start) < 0 or self._written.find(mark, self._start) < 0
            for mark in _MARKS
        ):
            return self._written
        return _NO_TAG.sub(lambda match: re.sub(rb"[^\n]", b" ", match[0]), self._written)

    def line(self, number: int) -> int:
        """Return the one-based line where a start tag ends; the first one has the number 0."""
        with self._lock:
            self._look_until(number)
            block = bisect_right(self._tags, number) - 1
            if block != self._block:
                self._block, self._in_block = block, [*self._lines_in(block)]
            return self._in_block[number - self._tags[block]]

    def _look_until(self, number: int) -> None:
        data, tags, lines = self._data, self._tags, self._lines
        for start in range(self._start + (len(tags) - 1) * _BLOCK, len(data), _BLOCK):
            if tags[-1] > number:
                break
            end = start + _BLOCK
            tags.append(tags[-1] + data.count(b"<", start, end) - data.count(b"</", start, end + 1))
            lines.append(lines[-1] + data.count(b"\n", start, end))

    def _lines_in(self, block: int) -> Iterator[int]:
        """Yield the lines of the start tags that begin in a block."""
        data, line = self._data, self._lines[block]
        start = self._start + block * _BLOCK
        for found in islice(_START_TAG.finditer(data, start), self._tags[block + 1] - self._tags[block]):
            line += data.count(b"\n", start, found.end())
            start = found.end()
            yield line


class ElementLines:
    """Tells the line where the start tag of an element ends; the parser's own count ends at 65,535."""

    def __init__(self, source: Source) -> None:
        """Take the source of a tree that nothing is removed from."""
        self._source = source
        self._known: tuple[StartTags, dict[Element, int]] | None = None

    def line(self, element: Element) -> int | None:
        """Return the one-based line."""
        line = element.sourceline
        if line is None or line < MOST_LINES:
            return line
        if self._known is None:
            numbers = {each: number for number, each in enumerate(element.getroottree().iter("*"))}
            self._known = StartTags(plain_utf8(self._source)), numbers
        tags, numbers = self._known
        return tags.line(numbers[element])


def elements(above: Element) -> Iterator[Element]:
    """Yield the elements directly below one."""
    return (child for child in above if isinstance(child.tag, str))


def children(above: Element, *names: str) -> list[Element]:
    """Return the elements of some names directly below one."""
    return [child for child in elements(above) if local(child) in names]


def local(element: Element) -> str:
    """Return the name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def written(element: Element) -> str:
    """Return the name of an element as the file writes it."""
    return f"{element.prefix}:{local(element)}" if element.prefix else local(element)


def text_of(element: Element) -> str:
    """Return the text of an element."""
    return (element.text or "").strip()


def _parser() -> etree.XMLParser:
    parser: etree.XMLParser = etree.XMLParser(**_OPTIONS)
    return parser


def _as_uri(match: re.Match[bytes]) -> bytes:
    """Escape characters that no URI may have: the standard allows any namespace name, libxml2 refuses ``http://my model``."""
    name = match["name"]
    if name is None or _SURELY_URI.fullmatch(name):
        return match[0]
    web = _WEB.match(name)
    start = web[0] if web else b"x:"
    return match["before"] + start + quote(name.removeprefix(start), safe="/").encode() + match["after"]


def _utf8(source: Source) -> bytes:
    """Return the document as UTF-8 without a byte order mark; its XML declaration then means nothing."""
    data = source.data
    if not data.strip(_SPACE + b"\0\xef\xbb\xbf\xff\xfe"):
        raise _error(source, "CQ001", "the file is empty")
    name = encoding_of(data)
    encoding = codec(name)
    if encoding is None:
        message = f"the encoding `{name}` that the XML declaration names is not known"
        raise _error(source, "CQ001", message, advice="save the file as UTF-8")
    _, skip = byte_order_mark(data)
    try:
        if encoding == "utf-8" and _is_utf8(data, skip):
            return data[skip:]
        text = data[skip:].decode(encoding)
    except UnicodeDecodeError as error:
        raise _undecodable(source, name, error) from None
    return text.encode("utf-8")


def _is_utf8(data: bytes, start: int) -> bool:
    """Whether a document is UTF-8; its whole text, which may take four times as much, is not made for it."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for at in range(start, len(data), _PART):
            decoder.decode(data[at : at + _PART], final=at + _PART >= len(data))
    except UnicodeDecodeError:
        return False
    return True


def _undecodable(source: Source, name: str, error: UnicodeDecodeError) -> InputError:
    """Say which bytes are not of the encoding; their line and column are those of the text before them."""
    before = bytes(error.object[: error.start]).decode(error.encoding, "replace")
    at = Lines(before).position(len(before))
    found = bytes(error.object[error.start : max(error.end, error.start + 1)][:4]).hex(" ")
    message = f"the bytes `{found}` are not {name}, in which the file says or seems to be written"
    is_utf8 = bytes(error.object).decode("utf-8", "ignore").encode() == error.object
    guess = "UTF-8" if is_utf8 else "windows-1252"
    advice = f'save the file as UTF-8, or declare what it is, perhaps `encoding="{guess}"`'
    return _error(source, "CQ001", message, at, advice=advice)


def _without_document_type(source: Source, data: bytes) -> bytes:
    """Blank a plain DOCTYPE out, so that it can name nothing to be fetched; refuse one that declares something."""
    at = _prolog_end(data, 0)
    if _HTML.match(data, at):
        message = "this is an HTML page, not the XML document it was meant to be"
        raise _error(source, "CQ001", message, advice="download the file itself, not the page that shows it")
    while data.startswith(b"<!DOCTYPE", at):
        end = at
        while word := _DOCTYPE_WORDS.match(data, end):
            end = word.end()
        if data[end : end + 1] == b"[":
            before = data[:at].decode("utf-8")
            message = "the DOCTYPE declares entities or a grammar of its own, which is refused"
            where = Lines(before).position(len(before))
            raise _error(source, "CQ002", message, where, advice="remove the DOCTYPE: BPMN and DDS need none")
        if end == len(data):
            break  # never closed: the parser will say so
        blank = re.sub(rb"[^\n]", b" ", data[at : end + 1])
        data = data[:at] + blank + data[end + 1 :]
        at = _prolog_end(data, end + 1)
    return data


def _prolog_end(data: bytes, at: int) -> int:
    found = _PROLOG.match(data, at)
    return found.end() if found else at


def _explain(source: Source, parser: etree.XMLParser, error: etree.XMLSyntaxError) -> Problem:
    """Turn an error of the parser into a problem with advice: the first fault, as the others follow from it."""
    entries = [entry for entry in parser.error_log if entry.level_name != "WARNING"]
    line, column = (entries[0].line, entries[0].column) if entries else error.position
    said = (entries[0].message if entries else error.msg or "").strip()
    kind = entries[0].type_name if entries else ""
    place = Place(source.name, max(line, 1), max(column, 1))
    if kind == "ERR_RESOURCE_LIMIT" or "XML_PARSE_HUGE" in said:
        depth = _DEPTH.search(said)
        found = f"elements are nested deeper than {depth[1]}" if depth else "a name, value or text is longer than 10 MB"
        return Problem("CQ002", f"{found}, which is refused", place)
    if unbound := _NAMESPACE.search(said):
        prefix, name = _short(unbound[1]), _short(f"{unbound[1]}:{unbound[2] or unbound[3]}")
        message = f"`{name}` uses the prefix `{prefix}`, which is not declared"
        return Problem("CQ001", message, place, f'add `xmlns:{prefix}="…"` to the first element')
    if kind == "ERR_UNDECLARED_ENTITY":
        advice = "XML knows &lt; &gt; &amp; &quot; &apos;; write any other character itself"
        return Problem("CQ001", f"this is not well-formed XML: {_short(said)}", place, advice)
    if unclosed := _UNCLOSED.search(said):
        message = f"the file ends too early: <{_short(unclosed[1])}> from line {unclosed[2]} is never closed"
        return Problem("CQ001", message, place, "fetch or save the file again, it was cut off")
    if said.startswith("Start tag expected"):
        start = _short(decode(source.data[:200]).strip().partition("\n")[0])
        return Problem("CQ001", f"this is not XML: it starts with `{start}`", place)
    is_cut_off = kind != "ERR_DOCUMENT_END" and not source.data.rstrip(_SPACE + b"\0").endswith(b">")
    hint = "the file does not end with `>`, so it seems to be cut off" if is_cut_off else None
    return Problem("CQ001", f"this is not well-formed XML: {_short(said)}", place, hint)


def _short(text: str) -> str:
    """Return the beginning of a text of a file or the parser, without control characters."""
    return "".join(character if character.isprintable() else "\ufffd" for character in text[:_LONGEST])


def _error(
    source: Source, code: str, message: str, at: tuple[int, int] = (1, 1), *, advice: str | None = None
) -> InputError:
    return InputError([Problem(code, message, Place(source.name, *at), advice)])
