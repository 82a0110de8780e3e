"""Finds text that YAML reads otherwise than a person meant: names lost in comments, keys glued to their values.

It never reports an ordinary comment.
"""

from __future__ import annotations

import re
import unicodedata
from itertools import islice
from typing import TYPE_CHECKING

from cqos_core.importers.source_reading import in_quotes, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, is_null, quoted_where_needed, walk
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.source_reading import SourceReading
    from cqos_core.importers.tree import Node
    from cqos_core.importers.yaml_tree import Tree

_LONE_HASH = regular_expression(r"(?<=[:/])[ \t]+#[ \t]*\r?$", re.MULTILINE)
_HASH_KEY = regular_expression(r"^([ \t]+)#:(?:[ \t].*)?\r?$", re.MULTILINE)
_ENOUGH = 20
_WIDEST = 1000
_LOST = "a `#` after a blank begins a comment"
_QUOTE = 'write a filter with `#` in quotes: "#"'
_GLUED = regular_expression(r"[^:/]+:[^:/\s]\S*")


# Blanks that are none to YAML, and invisible characters; a mark at the very beginning of a file is none of its text.
_ODD = regular_expression("[\\u00a0\\u00ad\\u1680\\u180e\\u2000-\\u200f\\u2028-\\u202f\\u205f-\\u206f\\u3000\\ufeff]")


_DASHES = "\u2010\u2011\u2012\u2013\u2014\u2212\u2022\u2023\u25e6\u00b7"
_QUOTES = "\u2018\u2019\u201a\u201c\u201d\u201e\u00ab\u00bb"
_APOSTROPHES = "\u2018\u2019"
_LOOKS_ODD = regular_expression(f"{_ODD.pattern}|^[{_DASHES}{_QUOTES}]|[,{_QUOTES}]$")


def refuse_odd_texts(tree: Tree, reading: SourceReading, free: tuple[str, ...]) -> None:
    """Collect a problem for each key or value without quotes that holds what YAML takes for a part of the text, but people do not.

    These are characters that only look like a blank, or like nothing; typographic quotes around a text; a dash of another kind before
    an item; a comma at the end. Values of the keys ``free`` are texts for people, which may have all of these but the first.
    """
    if not any(_LOOKS_ODD.search(text) for text in tree.texts if text[-1:] == "," or not text.isascii()):
        return
    for_people: set[int] = set()
    for node in walk(tree.documents):
        if isinstance(node, MappingNode):
            for_people.update(id(node.entries[name][1]) for name in free if name in node.entries)
        if not isinstance(node, ScalarNode) or not node.plain or not node.text:
            continue
        if odd := _ODD.search(node.text):
            character = f"U+{ord(odd[0]):04X} {unicodedata.name(odd[0], 'without a name')}"
            message = f"{shown(node.text)} contains {character}, which is no blank to YAML"
            advice = "write an ordinary blank, or put the text in quotes if the character belongs to it"
            reading.problem("CQ002", message, node, advice)
            continue
        rest = reading.rest_of_line(node.line, (node.column or 1) + len(node.text))
        if id(node) not in for_people and (said := _foreign(node.text, rest)) is not None:
            message, advice = said
            if node.text[0] in _DASHES and node.text[1:2] == " " and rest.startswith(":"):
                advice = f"write `{node.text[1:].strip()}:`, or in a list `- {node.text[1:].strip()}:`"
            if reading.source.name.lower().endswith(".json"):
                advice = f'write `"{node.text.strip(_QUOTES + ",")}"`'
            reading.problem("CQ002", message, node, advice)


def _foreign(text: str, rest: str) -> tuple[str, str] | None:
    """Say what is wrong with a text that has signs of a word processor, or of JSON, around it; ``rest`` is what its line has after it."""
    if text[0] in _DASHES and text[1:2] == " ":
        message = f"{shown(text)} begins with a dash (U+{ord(text[0]):04X}) that begins no item in YAML"
        return message, f"write `- {text[1:].split(f' {text[0]} ', maxsplit=1)[0].strip()}`"
    if text[0] in _DASHES and (text[1:2].isalpha() or text[1:2] == "/"):
        message = f"{shown(text)} begins with a dash (U+{ord(text[0]):04X}) that begins no item in YAML"
        return (
            message,
            f"write `{text.strip(_DASHES)}`; if the dash belongs to the text, put it in quotes: `{in_quotes(text)}`",
        )
    inner = text.strip(f"{_QUOTES}\"'")
    if text[0] in _QUOTES or text[-1] in _QUOTES.translate(dict.fromkeys(map(ord, _APOSTROPHES))):
        word = quoted_where_needed(ScalarNode(inner, None, None, plain=True)) if inner else '""'
        message = f"typographic quotes are part of {shown(text)} to YAML"
        return message, f"write `{word}`; if they belong to the text, put it in straight quotes: `{in_quotes(text)}`"
    if text[-1] == "," and text[:-1].strip() and not rest.strip():
        advice = f"remove the comma: `{text[:-1].rstrip()}`; if it belongs to the text, put it in quotes: `{in_quotes(text)}`"
        return f"a comma at the end is part of {shown(text)} to YAML", advice
    return None


_CUT_CALL = regular_expression(r"\w\([^()\n]*(?:\([^()\n]*\)[^()\n]*)*,")


def join_calls(tree: Tree, reading: SourceReading) -> None:
    """Make one text again of a call in a map between brackets, ``{/scan: QoSProfile(depth=5, durability=volatile)}``.

    YAML ends a text at a comma, so the arguments behind it are keys to it. The whole text is what has to be reported.
    """
    if b"(" not in reading.source.data or not _CUT_CALL.search(reading.lines.text):
        return
    for node in walk(tree.documents):
        if isinstance(node, MappingNode):
            _join_calls(node, reading)


def _join_calls(node: MappingNode, reading: SourceReading) -> None:
    opened: ScalarNode | None = None
    for name, (key, value) in [*node.entries.items()]:
        if opened is not None:
            more = reading.rest_of_line(key.line, key.column or 1)[: len(name)]
            opened.text += f", {more}"
            del node.entries[name]
            last: Node = key if is_null(value) else value
        else:
            last = value
        if not isinstance(last, ScalarNode) or not last.plain:
            return
        if opened is None and last.text.count("(") > last.text.count(")"):
            opened = last
        elif opened is not None and opened.text.count("(") <= opened.text.count(")"):
            opened = None


def warn_of_traps(tree: Tree, reading: SourceReading, topic_maps: tuple[str, ...]) -> None:
    """Collect a note for each trap in ``tree``; ``topic_maps`` are the keys whose values have topics as keys."""
    for key in tree.glued:
        _warn_of_glued(key, reading)
    if b"#" not in reading.source.data:
        return
    text = reading.lines.text
    if _LONE_HASH.search(text):
        for root in tree.documents:
            _warn_of_lone_hashes(root, reading)
    hashes = dict(reading.lines.position(found.end(1)) for found in islice(_HASH_KEY.finditer(text), _ENOUGH))
    if hashes:
        for root in tree.documents:
            _warn_of_hash_keys(root, hashes, reading, topic_maps)


def _warn_of_glued(key: ScalarNode, reading: SourceReading) -> None:
    """Tell a key such as ``depth:5`` in a flow map: the colon needs a blank after it."""
    after = reading.rest_of_line(key.line, (key.column or 1) + len(key.text)).lstrip()
    if _GLUED.fullmatch(key.text) and not after.startswith(":"):
        name, _, value = key.text.partition(":")
        message = f"{shown(key.text)} is a key without a value"
        reading.warn("CQ020", message, key, f"if a value was meant, write a blank after the colon: `{name}: {value}`")


def _warn_of_lone_hashes(root: Node, reading: SourceReading) -> None:
    """Tell a value that is missing, or a name that ends in a slash, before a lone ``#`` at the end of the line."""
    for key, node in _scalars(root):
        if is_null(node):
            before, pattern = key, r":\s+#\s*"
        elif node.text.endswith("/"):
            before, pattern = node, r"\s+#\s*"
        else:
            continue
        if before is None or not before.plain or before.column is None:
            continue
        end = before.column + len(before.text)
        rest = reading.rest_of_line(before.line, end)
        if re.fullmatch(pattern, rest):
            place = Place(reading.source.name, before.line, end + rest.index("#"))
            reading.warn("CQ019", f"a name may be lost here: {_LOST}", place, _QUOTE)


def _scalars(root: Node) -> Iterator[tuple[ScalarNode | None, ScalarNode]]:
    """Yield the scalar values of every map and list, with their keys where they have some."""
    for node in walk([root]):
        if isinstance(node, MappingNode):
            yield from ((key, value) for key, value in node.entries.values() if isinstance(value, ScalarNode))
        elif isinstance(node, SequenceNode):
            yield from ((None, item) for item in node.items if isinstance(item, ScalarNode))


def _warn_of_hash_keys(root: Node, hashes: dict[int, int], reading: SourceReading, topic_maps: tuple[str, ...]) -> None:
    """Tell a comment that looks like an entry, ``#: profile``, among the entries of a map of topics."""
    for key, value in _maps(root, topic_maps):
        first = key.line or 0
        if isinstance(value, MappingNode):
            last, least, most = value.end or 0, value.column or 0, value.column or 0
        elif is_null(value):
            last, least, most = _end_of_comments(first, reading), (key.column or 0) + 1, _WIDEST
        else:
            continue
        for line, column in hashes.items():
            if first < line < last and least <= column <= most:
                place = Place(reading.source.name, line, column)
                reading.warn("CQ019", f"a topic `#` may be lost here: {_LOST}", place, _QUOTE)


def _maps(root: Node, names: tuple[str, ...]) -> Iterator[tuple[ScalarNode, Node]]:
    """Yield every entry with one of ``names``, once."""
    for node in walk([root]):
        if isinstance(node, MappingNode):
            yield from (node.entries[name] for name in names if name in node.entries)


def _end_of_comments(line: int, reading: SourceReading) -> int:
    """Return the first line below ``line`` that holds something else than a comment."""
    line += 1
    while reading.lines.line(line).lstrip().startswith("#"):
        line += 1
    return line
