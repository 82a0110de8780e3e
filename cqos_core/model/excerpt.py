"""Finds the exact line and column of a `Place`, and the words to show and underline there.

Importers of XML know an element's line only, and that where its start tag ends. This module reads the source again
for the places that are really shown. Places in XML are found by the `element` id and the `path`, which is one of

- nothing: the start tag of the element;
- ``@qos:reliability``: an attribute of the element;
- ``qos:policy[2]``: the second such tag that follows the element's own start tag;
- ``qos:policy[2]/@reliability``: an attribute of it.

In other formats a path that ends with a colon, ``reliability:``, is the key of the value that begins at the place.

Paths use the prefixes of `NAMESPACES`, whatever the file calls them.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from cqos_core.model.dataclass import dataclass
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.regular_expressions import re, regular_expression

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.model.settings import Place

NAMESPACES = {
    "bpmn": "http://www.omg.org/spec/BPMN/20100524/MODEL",
    "camunda": "http://camunda.org/schema/1.0/bpmn",
    "qos": "http://qos",
    "ros": "http://ros",
    "zeebe": "http://camunda.org/schema/zeebe/1.0",
}
"""The prefixes that paths of places use, with their namespaces."""

_WIDEST = 200
_ABOVE = 3  # lines above a value in which its key may stand

# Comments, CDATA and instructions are skipped, then start tags match. Possessive: linear on any input.
_TAG = regular_expression(
    r"""<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"""
    r"""|<(?P<name>[^\s<>/!?=]++)(?P<attributes>(?:[^<>"']++|"[^"]*+"|'[^']*+')*+)>""",
    re.DOTALL,
)
_ATTRIBUTE = regular_expression(r"""(?P<name>[^\s=/<>"']++)\s*+=\s*+(?P<value>"[^"]*+"|'[^']*+')""")
_ID = regular_expression(r"\sid\s*+=")
_BINDING = regular_expression(r"""\sxmlns(?::(?P<prefix>[^\s=]+))?\s*=\s*["'](?P<uri>[^"']*)["']""")
_PATH = regular_expression(r"(?:(?P<tag>[^\[\]/@]+)\[(?P<number>\d+)\]/?)?(?:@(?P<attribute>.+))?")
_START = regular_expression(r"<[^\s/>]*")
_QUOTED = regular_expression(r"""'(?:[^']|'')*'|"(?:[^"\\]|\\.)*\"""")
_PLAIN_END = regular_expression(r"\s+#|:(?=\s|$)|\s*$")
_PLAIN_END_IN_FLOW = regular_expression(r"\s+#|:(?=[\s,\[\]{}]|$)|\s*[,\[\]{}]|\s*$")


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A line to show, and the part to underline.

    Attributes:
        line: one-based number of the line in its file.
        text: the line, cut at both sides to a readable width if it is very long; tabs are kept.
        column: one-based, in `text`, where the underlining begins; a tab counts as one.
        width: how many characters to underline, at least one.
    """

    line: int
    text: str
    column: int
    width: int


def exact(places: Iterable[Place], sources: Mapping[str, bytes]) -> dict[Place, Place]:
    """Return every place with its exact line and column; of an attribute those of its name.

    Each source is read once, however many places lie in it. Places that have a column already, lie in no XML source,
    or cannot be found come back as they are.
    """
    found = {place: place for place in places}
    by_source: dict[str, list[Place]] = {}
    for place in found:
        if place.line is not None and (place.column is None or _names_key(place)) and place.source in sources:
            by_source.setdefault(place.source, []).append(place)
    for name, wanted in by_source.items():
        lines = _lines(sources[name])
        if is_xml(lines.text):
            found |= _find(wanted, lines)
        else:
            found |= {place: _key(place, lines) for place in wanted if _names_key(place)}
    return found


def key_of(place: Place | None, name: str) -> Place | None:
    """Return the place of the key ``name`` of the value at ``place``, as far as the format has such a thing."""
    if place is None or place.path is not None or place.column is None:
        return place
    return replace(place, path=f"{name}:")


def _names_key(place: Place) -> bool:
    return place.column is not None and place.path is not None and place.path.endswith(":")


def _key(place: Place, lines: Lines) -> Place:
    """Find the last key of that name before the value, on its line or the nearest one above that has it."""
    name = re.escape((place.path or "")[:-1])
    key = re.compile(rf"""(?<![\w.-])(?P<quote>["']?)(?P<name>{name})(?P=quote)\s*[:=]""")
    number, end = place.line or 1, (place.column or 1) - 1
    for line in range(number, max(0, number - _ABOVE), -1):
        if lines.start(line) is None:
            continue
        text = lines.line(line)
        found = _last(key, text, end if line == number else len(text))
        if found is not None:
            return replace(place, line=line, column=found.start("name") + 1, path=None)
    return replace(place, path=None)


def _last(pattern: re.Pattern[str], text: str, end: int) -> re.Match[str] | None:
    """Find the last match before ``end``. A file may be one long line, so look near the end first."""
    window = 256
    while True:
        found = None
        for found in pattern.finditer(text, max(0, end - window), end):  # noqa: B007 - the last one
            pass
        if found is not None or window >= end:
            return found
        window *= 4


def span(place: Place, sources: Mapping[str, bytes]) -> Excerpt | None:
    """Return the excerpt for ``place``: an XML attribute with its value, a tag, a YAML scalar or flow collection.

    None where the place has no line or its source is not at hand. Give many places to `exact` first: an XML place
    without a column makes the whole source be read again.
    """
    data = sources.get(place.source)
    if data is None or place.line is None:
        return None
    lines = _lines(data)
    place = exact([place], sources)[place]
    if place.line is None or lines.start(place.line) is None:
        return None
    text = lines.line(place.line)
    if place.column is None:
        start = len(text) - len(text.lstrip())
        width = len(text.strip())
    else:
        start = min(place.column - 1, len(text))
        width = (_xml_width if is_xml(lines.text) else _yaml_width)(lines, place.line, start)
    return _cut(Excerpt(place.line, text, start + 1, max(1, min(width, len(text) - start))))


@lru_cache(maxsize=4)
def _lines(data: bytes) -> Lines:
    return Lines(decode(data))


def _start_tags(text: str) -> Iterator[tuple[int, re.Match[str]]]:
    """Yield each start tag, after the line where it ends."""
    line, counted = 1, 0
    for match in _TAG.finditer(text):
        line += text.count("\n", counted, match.end())
        counted = match.end()
        if match["name"] is not None:
            yield line, match


def is_xml(source: bytes | str) -> bool:
    """Whether a source, or its text, is XML."""
    text = source if isinstance(source, str) else decode(source[:_WIDEST])
    return text[:_WIDEST].lstrip().startswith("<")


def _cut(excerpt: Excerpt) -> Excerpt:
    """Cut a line that no screen holds, as in a document written in one line, to the surroundings of its middle."""
    if len(excerpt.text) <= _WIDEST:
        return excerpt
    width = min(excerpt.width, _WIDEST // 2)
    first = max(0, excerpt.column - 1 - _WIDEST // 4)
    last = min(len(excerpt.text), first + _WIDEST)
    before, after = "…" if first else "", "…" if last < len(excerpt.text) else ""
    text = f"{before}{excerpt.text[first:last]}{after}"
    return Excerpt(excerpt.line, text, excerpt.column - first + len(before), width)


def _xml_width(lines: Lines, line: int, start: int) -> int:
    offset = (lines.start(line) or 0) + start
    found = _ATTRIBUTE.match(lines.text, offset) or _START.match(lines.text, offset)
    return found.end() - found.start() if found else 1


def _yaml_width(lines: Lines, line: int, start: int) -> int:
    text = lines.line(line)
    if text[start : start + 1] in ("[", "{"):
        return _flow_end(text, start) - start
    if quoted := _QUOTED.match(text, start):
        return quoted.end() - start
    end = (_PLAIN_END_IN_FLOW if _in_flow(text[:start]) else _PLAIN_END).search(text, start)
    return end.start() - start if end else len(text) - start


def _in_flow(before: str) -> bool:
    bare = _QUOTED.sub("", before)
    return sum(map(bare.count, "[{")) > sum(map(bare.count, "]}"))


def _flow_end(text: str, start: int) -> int:
    """Return where the flow collection that begins at ``start`` ends, or the line, if it goes on in the next one."""
    depth = 0
    at = start
    while at < len(text):
        if quoted := _QUOTED.match(text, at):
            at = quoted.end()
            continue
        depth += (text[at] in "[{") - (text[at] in "]}")
        at += 1
        if depth == 0:
            return at
    return len(text.rstrip())


class _Tag(NamedTuple):
    """A start tag of the source that a place may mean; `number` counts all start tags, `line` is where it ends."""

    number: int
    line: int
    match: re.Match[str]


@dataclass(slots=True)
class _Found:
    """The start tags that may be meant, in the order of the document; `by_name` has the names of paths."""

    by_id: dict[str, list[_Tag]] = field(default_factory=dict)
    by_name: dict[str, list[_Tag]] = field(default_factory=dict)
    by_line: dict[int, list[_Tag]] = field(default_factory=dict)


class _Names:
    """Compares the names of paths with those that a document writes."""

    def __init__(self, text: str) -> None:
        """Collect the prefixes that ``text`` binds anywhere to a namespace of `NAMESPACES`."""
        self._written: dict[str, set[str]] = {}
        canonical = {uri: prefix for prefix, uri in NAMESPACES.items()}
        for match in _BINDING.finditer(text):
            if prefix := canonical.get(match["uri"]):
                self._written.setdefault(prefix, set()).add(match["prefix"] or "")

    def spellings(self, name: str) -> set[str]:
        """Return the ways in which the document may write ``name``."""
        prefix, colon, local = name.rpartition(":")
        written = self._written.get(prefix) if colon else None
        return {f"{p}:{local}" if p else local for p in written} if written else {name}


def _find(wanted: list[Place], lines: Lines) -> dict[Place, Place]:
    names = _Names(lines.text)
    paths = {place: _PATH.fullmatch(place.path) if place.path else None for place in wanted}
    tags = {
        name: path["tag"] for path in paths.values() if path and path["tag"] for name in names.spellings(path["tag"])
    }
    ids = {place.element for place in wanted if place.element is not None}
    numbers = {place.line for place in wanted if place.element is None}
    found = _Found()
    for number, (line, match) in enumerate(_start_tags(lines.text)):
        name, identity = match["name"], _identity(match["attributes"]) if ids else None
        if line in numbers or name in tags or identity in ids:
            tag = _Tag(number, line, match)
            found.by_line.setdefault(line, []).append(tag)
            found.by_name.setdefault(tags.get(name, name), []).append(tag)
            found.by_id.setdefault(identity or "", []).append(tag)
    result = {}
    for place, path in paths.items():
        offset = _offset(place, path, found, names)
        if offset is not None:
            line, column = lines.position(offset)
            result[place] = replace(place, line=line, column=column)
    return result


def _identity(attributes: str) -> str | None:
    """Return the value of the attribute ``id`` as an XML parser does."""
    if not _ID.search(attributes):
        return None
    written = next((match["value"] for match in _ATTRIBUTE.finditer(attributes) if match["name"] == "id"), None)
    from html import unescape  # its table of entities takes 1 ms, and only XML needs it

    return None if written is None else unescape(re.sub(r"[\t\r\n]", " ", written[1:-1]))


def _attributes(tag: re.Match[str]) -> Iterator[tuple[str, int]]:
    """Yield the name and the offset of every attribute."""
    for match in _ATTRIBUTE.finditer(tag.string, *tag.span("attributes")):
        yield match["name"], match.start()


def _offset(place: Place, path: re.Match[str] | None, found: _Found, names: _Names) -> int | None:
    """Return where the thing that ``place`` names begins, the one nearest to its line if there are several.

    An attribute that is not there, because it should be, is shown as its tag.
    """
    tags = _candidates(place, path, found, names)
    spellings = names.spellings(path["attribute"] or "") if path else set()
    offsets = [(tag.line, at) for tag in tags for name, at in _attributes(tag.match) if name in spellings]
    offsets = offsets or [(tag.line, tag.match.start()) for tag in tags]
    line = place.line or 0
    return min(offsets, key=lambda offset: abs(offset[0] - line))[1] if offsets else None


def _candidates(place: Place, path: re.Match[str] | None, found: _Found, names: _Names) -> list[_Tag]:
    """Return the start tags that ``place`` may mean; several if an id is missing or not unique."""
    child = path["tag"] if path else None
    if place.element is None:
        tags = found.by_line.get(place.line or 0, [])
        return [tag for tag in tags if tag.match["name"] in names.spellings(child)] if child else tags
    owners = found.by_id.get(place.element, [])
    if path is None or child is None:
        return owners
    children = found.by_name.get(child, [])
    nth = int(path["number"]) - 1
    picked = (bisect_right(children, owner.number, key=lambda tag: tag.number) + nth for owner in owners)
    return [children[index] for index in picked if index < len(children)]
