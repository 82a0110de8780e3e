"""Edits system files in YAML or JSON: adds and replaces settings. Comments and layout stay."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import yaml

from cqos_core.importers.tree import ScalarNode, quoted_where_needed
from cqos_core.model.encoding import Lines
from cqos_core.model.source import Replacement

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.model.settings import Place


_MOST_KEPT: Final = 1_000_000  # characters; the nodes of a larger text are not kept


def is_json(text: str) -> bool:
    """Whether a text is JSON, so that new values must be JSON too."""
    return text.lstrip()[:1] in {"{", "["} and text.lstrip().lstrip(" \t\r\n[{")[:1] in {'"', "}", "]"}


def scalar(value: str, like: str = "", *, in_json: bool = False) -> str:
    """Return a value as YAML or JSON, with the quotes of the text ``like`` that it replaces."""
    if in_json:
        # A number takes the place of a number.
        typed = value[:1] in {"[", "{"} or like[:1] not in {"", '"'}
        return json.dumps(yaml.safe_load(value) if typed else value)
    if value[:1] in {"[", "{"}:
        return value
    if like[:1] == '"':
        return json.dumps(value, ensure_ascii=False)
    if like[:1] == "'":
        return "'" + value.replace("'", "''") + "'"
    return quoted_where_needed(ScalarNode(value, None, None, plain=True))


def difference(before: str, after: str) -> Replacement:
    """Return the smallest replacement that turns one text into another."""
    most = min(len(before), len(after))
    start = next((at for at in range(most) if before[at] != after[at]), most)
    same = next((at for at in range(most - start) if before[-1 - at] != after[-1 - at]), most - start)
    return Replacement(start, len(before) - same, after[start : len(after) - same])


def insert(text: str, place: Place, settings: Mapping[str, str], *, typed: bool = False) -> Replacement | None:
    """Add settings to the map at ``place``, or to the one that the key at ``place`` has as its value.

    In JSON ``typed`` values are the numbers and flags that they look like, else texts.
    """
    found = _found(text, place)
    if found is None:
        return None
    key, node = found
    edited = _YamlText(text)
    stated = edited.stated(settings, typed=typed)
    if isinstance(node, yaml.MappingNode):
        return edited.add(node, stated)
    return edited.as_map(key, node, stated) if isinstance(node, yaml.ScalarNode) and key is not None else None


def insert_nested(text: str, place: Place, path: tuple[str, ...], settings: Mapping[str, str]) -> Replacement | None:
    """Add settings to the map at ``path`` below the one at ``place``; missing maps of the path are added."""
    _, node = _found(text, place) or (None, None)
    where, missing = place, list(path)
    while missing and isinstance(node, yaml.MappingNode):
        inner = next(((key, each) for key, each in node.value if key.value == missing[0]), None)
        if inner is None:
            break
        where = replace(place, line=inner[0].start_mark.line + 1, column=inner[0].start_mark.column + 1)
        node, missing = inner[1], missing[1:]
    if not missing:
        return insert(text, where, settings, typed=True)
    flow_text = "{" + ", ".join(f"{name}: {scalar(value)}" for name, value in settings.items()) + "}"
    for name in reversed(missing[1:]):
        flow_text = f"{{{name}: {flow_text}}}"
    return insert(text, where, {missing[0]: flow_text})


def state(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """Set settings of the map at ``place``: replace those that it has, add the others."""
    changed = text
    for name, value in settings.items():
        _, node = _found(changed, place) or (None, None)
        entries = node.value if isinstance(node, yaml.MappingNode) else ()
        there = [each for key, each in entries if key.value == name and isinstance(each, yaml.ScalarNode)]
        made = _YamlText(changed).replaced(there[-1], value) if there else insert(changed, place, {name: value})
        if made is None:
            return None
        changed = changed[: made.start] + made.text + changed[made.end :]
    return difference(text, changed)


def insert_beside(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """Add settings beside the key at ``place``; a key with dots gives its first parts to the new keys."""
    root = _root(text)
    if root is None or place.line is None or place.column is None:
        return None
    for node in (root, *(value for _, value in _entries(root))):
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if _is_at(key, place.line - 1, place.column - 1):
                head, dot, _ = key.value.rpartition(".")
                edited = _YamlText(text)
                return edited.add(node, edited.stated({head + dot + name: value for name, value in settings.items()}))
    return None


def replace_within(text: str, place: Place, name: str, old: str, new: str) -> Replacement | None:
    """Replace a value at ``place``, a list in block form, or one field of the map there by the last part of its ``name``."""
    root = _root(text)
    nodes = [] if root is None or place.line is None or place.column is None else _entries(root)
    edited = _YamlText(text)
    for key, node in nodes:
        if not _is_at(node, (place.line or 1) - 1, (place.column or 1) - 1):
            continue
        if isinstance(node, yaml.ScalarNode) and node.value == old:
            return edited.replaced(node, new)
        if isinstance(node, yaml.SequenceNode) and node.value and key is not None:
            items = [item.value for item in node.value if isinstance(item, yaml.ScalarNode)]
            if len(items) != len(node.value) or items != yaml.load(old, Loader=yaml.BaseLoader):  # noqa: S506 - text only
                return None
            start, end = text.index(":", edited.span(key)[1]) + 1, edited.span(node.value[-1])[1]
            return Replacement(start, end, f" {edited.scalar(new)}")
        for inner, value in node.value if isinstance(node, yaml.MappingNode) else ():
            named = inner.value == name.rpartition(".")[2]
            if named and isinstance(value, yaml.ScalarNode) and value.value == old:
                return edited.replaced(value, new)
    return None


def _root(text: str) -> Any:
    return _kept(text) if len(text) <= _MOST_KEPT else _composed(text)


@lru_cache(maxsize=1)
def _kept(text: str) -> Any:
    """Return the composed nodes of a text; the last text is kept for further edits."""
    return _composed(text)


def _composed(text: str) -> Any:
    try:
        return yaml.compose(text, Loader=getattr(yaml, "CBaseLoader", yaml.BaseLoader))
    except yaml.YAMLError:
        return None


def _entries(root: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every value of a map with its key, and every item of a list."""
    waiting = [root]
    seen: set[int] = set()
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        children = node.value if not isinstance(node, yaml.ScalarNode) else ()
        for child in children:
            entry = child if isinstance(node, yaml.MappingNode) else (None, child)
            yield entry
            waiting.append(entry[1])


def _found(text: str, place: Place) -> tuple[Any, Any] | None:
    """Return key and value at a place, or None and the list item that begins there."""
    root = _root(text)
    if root is None or place.line is None or place.column is None:
        return None
    line, column = place.line - 1, place.column - 1
    for key, value in _entries(root):
        if key is None:
            if _is_at(value, line, column):
                return None, value
        # An alias refers to a map elsewhere that has other users.
        elif _is_at(key, line, column) and (value.start_mark.line, value.start_mark.column) >= (line, column):
            return key, value
    return None


def _is_at(node: Any, line: int, column: int) -> bool:
    return bool(node.start_mark.line == line and node.start_mark.column == column)


class _YamlText:
    """A YAML or JSON text, with replacements at the places of its nodes."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines = Lines(text)
        self.in_json = is_json(text)

    def scalar(self, value: str, like: str = "") -> str:
        """Return a value in the syntax of this text."""
        return scalar(value, like, in_json=self.in_json)

    def span(self, node: Any) -> tuple[int, int]:
        """Return where a node begins and ends."""
        start, end = ((self.lines.start(mark.line + 1) or 0) + mark.column for mark in (node.start_mark, node.end_mark))
        return start, end

    def stated(self, settings: Mapping[str, str], *, typed: bool = False) -> list[str]:
        """Return entries of a map; in JSON ``typed`` values are the numbers and flags that they look like."""
        as_json = self.in_json and typed
        return [
            f"{self.scalar(name)}: {json.dumps(yaml.safe_load(value)) if as_json else self.scalar(value)}"
            for name, value in settings.items()
        ]

    def replaced(self, node: Any, value: str) -> Replacement:
        """Return the replacement of a scalar by a value."""
        start, end = self.span(node)
        return Replacement(start, end, self.scalar(value, like=self.text[start:end]))

    def add(self, node: Any, stated: list[str]) -> Replacement:
        """Return the replacement that adds entries to a map."""
        return self._in_flow(node, stated) if node.flow_style else self._in_block(node, stated)

    def _in_flow(self, node: Any, stated: list[str]) -> Replacement:
        start, end = self.span(node)
        if node.value:
            after = self.span(node.value[-1][1])[1]
            after = after if self.text[after : after + 1] in {",", "}", " ", "\n", "\r"} else end - 1
            return Replacement(after, after, f", {', '.join(stated)}")
        return Replacement(self.text.index("{", start, end) + 1, end - 1, ", ".join(stated))

    def _in_block(self, node: Any, stated: list[str]) -> Replacement:
        key, last = node.value[0][0], node.value[-1][1]
        indent = " " * int(key.start_mark.column)
        newline = "\r\n" if "\r\n" in self.text else "\n"
        simple = isinstance(last, yaml.ScalarNode) and last.style not in {"|", ">"}
        if (simple or last.flow_style is True) and last.start_mark.line >= key.start_mark.line:
            line = last.end_mark.line + 1
            end = (self.lines.start(line) or 0) + len(self.lines.line(line))
            return Replacement(end, end, "".join(f"{newline}{indent}{each}" for each in stated))
        start, _ = self.span(key)
        return Replacement(start, start, "".join(f"{each}{newline}{indent}" for each in stated))

    def as_map(self, key: Any, node: Any, stated: list[str]) -> Replacement | None:
        """Return the replacement of an empty value, or of the name of a profile, by a map."""
        start, end = self.span(node)
        if node.value and not (not node.style and node.value in {"~", "null", "Null", "NULL"}):
            profile = '"profile"' if self.in_json else "profile"
            return Replacement(start, end, f"{{{profile}: {self.text[start:end]}, {', '.join(stated)}}}")
        if node.value:
            return Replacement(start, end, f"{{{', '.join(stated)}}}")
        _, after = self.span(key)
        colon = self.text.find(":", after)
        if colon < 0 or self.text[after:colon].strip():
            return None
        return Replacement(colon + 1, colon + 1, f" {{{', '.join(stated)}}}")
