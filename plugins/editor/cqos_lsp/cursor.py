"""Finds the position of a cursor in unfinished YAML, JSON or TOML: the keys above it, and the word at it.

Parsers refuse unfinished text, so this reads it line by line, and assumes the most likely meaning.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field
from typing import Final, TypeAlias

from cqos_core.model.dataclass import dataclass

Path: TypeAlias = tuple["str | int", ...]
"""Keys and indices from the root of a document."""


@dataclass(frozen=True, slots=True)
class Cursor:
    """The position of a cursor in a document.

    Attributes:
        path: of the map, list or value around the cursor.
        at_key: a key of the map at ``path`` may be typed here.
        at_value: the value at ``path`` may be typed here.
        start, end: columns of the word, from 0; a word goes on behind the cursor.
        word: the typed part of it.
        followed: a colon follows the word.
        keys: the other keys of the map.
        scalars: the plain values before the cursor, by path.
        quoted: the word is in quotes.
    """

    path: Path
    at_key: bool
    at_value: bool
    start: int
    end: int
    word: str
    followed: bool = False
    keys: frozenset[str] = frozenset()
    scalars: dict[Path, str] = field(default_factory=dict)
    quoted: bool = False


@dataclass(slots=True)
class _Frame:
    """An open map or list: its column, and its last key or index."""

    indent: int
    is_list: bool
    flow: bool
    last: str | int | None = None
    keys: set[str] = field(default_factory=set)


_QUOTED: Final = r'"(?:[^"\\]|\\.)*"|' + r"'(?:[^']|'')*'"
_KEY: Final = re.compile(rf"({_QUOTED}|[^\s\[\]{{}},#&*!|>'\"%@`-][^\n]*?|-[^\s][^\n]*?)\s*:(?=\s|$)")
_FLOW: Final = re.compile(
    rf"\s+(?:#.*)?|({_QUOTED})(\s*:)?|([\[{{])|([\]}}])|(,)|(:)|((?:[^\s\[\]{{}},:\"'#]|:(?=[^\s,\[\]{{}}])|#|\s(?=[^\s\[\]{{}},:#]))+)|."
)
_BLOCK_TEXT: Final = re.compile(r"[|>][-+\d]*\s*(?:#.*)?$")
_WORD: Final = re.compile(r"[^\s\[\]{},:\"'#][^\[\]{},\"'#]*$|$")
_REST: Final = re.compile(r"[^\s\[\]{},:\"'#]*")


class _Yaml:
    """Reads lines up to a cursor."""

    def __init__(self) -> None:
        self.frames: list[_Frame] = []
        self.scalars: dict[Path, str] = {}
        self.text_within: int | None = None  # the column of the key of a text block
        self.after_key = False  # the value of the last key of the top frame follows

    @property
    def flow(self) -> bool:
        return bool(self.frames) and self.frames[-1].flow

    @property
    def path(self) -> Path:
        """The keys and indices of all open maps and lists."""
        return tuple(frame.last for frame in self.frames if frame.last is not None)

    def above(self) -> Path:
        """The path of the top frame itself."""
        return tuple(frame.last for frame in self.frames[:-1] if frame.last is not None)

    def line(self, text: str) -> None:
        """Read a line, or the beginning of one."""
        column = 0
        if not self.flow:
            stripped = text.lstrip(" ")
            indent = len(text) - len(stripped)
            if self.text_within is not None:
                if not stripped or indent > self.text_within:
                    return
                self.text_within = None
            if not stripped or stripped.startswith("#"):
                return
            if text.startswith(("---", "...")):
                self.__init__()  # type: ignore[misc]
                return
            column = self.block(text, indent)
        if column < len(text):
            self.rest(text, column)

    def block(self, text: str, column: int) -> int:
        """Read the dashes and the key of a line in block form; return where its value begins."""
        while text[column : column + 2] in {"- ", "-"}:
            self.leave(column, is_list=True)
            if not (self.frames and self.frames[-1].is_list and self.frames[-1].indent == column):
                self.frames.append(_Frame(column, is_list=True, flow=False))
            top = self.frames[-1]
            top.last = 0 if top.last is None else int(top.last) + 1
            self.after_key = True
            column += 1
            column += len(text[column:]) - len(text[column:].lstrip(" "))
        found = _KEY.match(text, column)
        if found is None:
            self.leave(column, is_list=False)
            return column
        self.leave(column, is_list=False)
        if not self.frames or self.frames[-1].is_list or self.frames[-1].indent < column:
            self.frames.append(_Frame(column, is_list=False, flow=False))
        self.key(found[1])
        return found.end()

    def leave(self, column: int, *, is_list: bool) -> None:
        """Close the maps and lists that a line at this column does not belong to."""
        while self.frames and (
            self.frames[-1].indent > column
            or (self.frames[-1].indent == column and self.frames[-1].is_list and not is_list)
        ):
            self.frames.pop()

    def key(self, written: str) -> None:
        """Add a key to the top map."""
        name = _unquoted(written)
        self.frames[-1].last = name
        self.frames[-1].keys.add(name)
        self.after_key = True

    def rest(self, text: str, column: int) -> None:
        """Read the text behind a key or dash, or a line of a flow collection."""
        if not self.flow:
            value = text[column:].strip()
            if _BLOCK_TEXT.fullmatch(value):
                self.text_within = self.frames[-1].indent if self.frames else 0
                return
            if value[:1] not in {"{", "["}:
                plain = re.sub(r"\s+#.*", "", value)
                if plain and not plain.startswith("#"):
                    self.scalars[self.path] = _unquoted(plain)
                    self.after_key = False
                return
        for found in _FLOW.finditer(text, column):
            self.token(found)

    def token(self, found: re.Match[str]) -> None:
        """Read one part of a flow collection."""
        quoted, colon, opening, closing, comma, lone, plain = found.groups()
        top = self.frames[-1] if self.frames else None
        if opening:
            frame = _Frame(-1, is_list=opening == "[", flow=True, last=0 if opening == "[" else None)
            self.frames.append(frame)
            self.after_key = opening == "["
        elif top is None or not top.flow:
            return
        elif closing:
            self.frames.pop()
            self.after_key = False
        elif comma:
            top.last = int(top.last or 0) + 1 if top.is_list else None
            self.after_key = top.is_list
        elif lone:
            self.after_key = True
        elif quoted or plain:
            if top.is_list or top.last is not None:
                self.scalars[self.path] = _unquoted(quoted or plain)
            else:
                self.key(quoted or plain.rstrip())
                self.after_key = bool(colon)


def _unquoted(text: str) -> str:
    return text[1:-1] if text[:1] in {"'", '"'} and text[-1:] == text[:1] and len(text) > 1 else text


def yaml_cursor(text: str, line: int, column: int) -> Cursor | None:
    """Return the cursor at a zero-based line and column; None in comments and text blocks."""
    lines = text.split("\n")
    reader = _Yaml()
    for each in lines[:line]:
        reader.line(each.rstrip("\r"))
    current = lines[line].rstrip("\r") if line < len(lines) else ""
    before = current[:column]
    if re.search(r"(?:^|\s)#", re.sub(_QUOTED, "", before)) or (reader.text_within is not None and before.strip()):
        return None
    odd = before.count('"') % 2 or re.search(r"(?<!\w)'[^']*$", before)
    found = re.search(r"[\"'][^\"']*$", before) if odd else _WORD.search(before)
    start = found.start() if found else column
    if not odd and (cut := re.search(r".*(?:\s-|^-|:)\s+", before[start:])):
        start += cut.end()
    word = before[start:].lstrip("\"'")
    rest = _REST.match(current, column)
    end = rest.end() if rest else column
    end += 1 if odd and current[end : end + 1] in {"'", '"'} else 0
    followed = bool(re.match(r"\s*:", current[end:]))
    return _typed(reader, lines, line, Cursor((), False, False, start, end, word, followed, quoted=bool(odd)))


def _typed(reader: _Yaml, lines: list[str], line: int, at: Cursor) -> Cursor:
    """Return the cursor with the path of its word."""
    from dataclasses import replace

    before = lines[line][: at.start]
    was_flow = reader.flow
    indented = not was_flow and not before.strip()
    if indented:
        reader.leave(at.start, is_list=False)
        top = reader.frames[-1] if reader.frames else None
        here = top is not None and not top.is_list and top.indent == at.start
        keys = frozenset(top.keys) if here and top is not None else frozenset[str]()
        path = reader.above() if here else reader.path
        keys |= {*_following(lines, line, at.start)}
        value = not here and top is not None and (reader.after_key or top.is_list)
        return replace(at, path=path, at_key=True, at_value=value, keys=keys, scalars=reader.scalars)
    reader.line(before)
    top = reader.frames[-1] if reader.frames else None
    if top is None:
        return replace(at, path=(), at_key=not before.strip(), at_value=False, scalars=reader.scalars)
    if top.flow and not top.is_list and not reader.after_key:
        return replace(at, path=reader.above(), at_key=True, keys=frozenset(top.keys), scalars=reader.scalars)
    item = top.is_list and not top.flow
    return replace(at, path=reader.path, at_key=item, at_value=True, scalars=reader.scalars)


def _following(lines: list[str], line: int, indent: int) -> Iterator[str]:
    """Yield the keys that follow in the same block map."""
    for each in lines[line + 1 :]:
        stripped = each.lstrip(" ")
        here = len(each) - len(stripped)
        if not stripped.strip() or stripped.startswith("#") or here > indent:
            continue
        if here < indent:
            return
        if found := _KEY.match(each, here):
            yield _unquoted(found[1])


_HEADER: Final = re.compile(r"\s*(\[\[?)\s*([^\]]*?)\s*(\]\]?)?\s*(?:#.*)?$")
_ASSIGNED: Final = re.compile(rf"\s*((?:{_QUOTED}|[\w-]+)(?:\s*\.\s*(?:{_QUOTED}|[\w-]+))*)\s*=\s*")
_PARTS: Final = re.compile(rf"{_QUOTED}|[^\s.\"']+")


def toml_cursor(text: str, line: int, column: int, table: Path = ()) -> Cursor | None:
    """Return the cursor in TOML below ``table``; None elsewhere and in comments."""
    lines = text.split("\n")
    above: Path = ()
    keys: set[str] = set()
    scalars: dict[Path, str] = {}
    counts: dict[Path, int] = {}
    for each in lines[:line]:
        if (header := _HEADER.match(each)) and header[3]:
            above, keys = _parts(header[2]), set()
            if header[1] == "[[":
                counts[above] = counts.get(above, -1) + 1
                above = (*above, counts[above])
        elif assigned := _ASSIGNED.match(each):
            path = (*above, *_parts(assigned[1]))
            keys.add(str(path[len(above)]))
            scalars[path] = _unquoted(each[assigned.end() :].strip())
    current = lines[line].rstrip("\r") if line < len(lines) else ""
    before = current[:column]
    if "#" in re.sub(_QUOTED, "", before):
        return None
    start = column - len(re.search(r"[\w-]*$", before)[0])  # type: ignore[index] # it matches anything
    odd = before.count('"') % 2 == 1
    start = before.rindex('"') if odd else start
    rest = re.compile(r"[\w-]*\"?" if odd else r"[\w-]*").match(current, column)
    end = rest.end() if rest else column
    word, followed = before[start:].lstrip('"'), bool(re.match(r"\s*=", current[end:]))
    path, at_key, at_value = above, True, False
    if before.lstrip().startswith("["):
        path, keys = _parts(before[:start].strip().lstrip("[")), set()
    elif assigned := _ASSIGNED.match(before):
        inner = _Yaml()
        inner.frames.append(_Frame(0, is_list=False, flow=False, last="", keys=set()))
        inner.rest(re.sub(r"(?<=[\w\"'])\s*=", ":", before[assigned.end() : start]), 0)
        below = tuple(frame.last for frame in inner.frames[1:] if frame.last is not None)
        top = inner.frames[-1]
        path = (*above, *_parts(assigned[1]), *below)
        at_key = top.flow and not top.is_list and not inner.after_key
        at_value, keys = not at_key, top.keys
    else:
        path = (*above, *_parts(before[:start].strip().rstrip(".")))
        keys = keys if path == above else set()
    if path[: len(table)] != table:
        return None
    cut = len(table)
    found = {where[cut:]: value for where, value in scalars.items() if where[:cut] == table}
    return Cursor(path[cut:], at_key, at_value, start, end, word, followed, frozenset(keys), found, odd)


def _parts(dotted: str) -> tuple[str, ...]:
    return tuple(_unquoted(part) for part in _PARTS.findall(dotted))
