"""Types of values in documents: each reads one value, explains a refusal, and has a JSON schema."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date
from typing import Any, Final, Generic, TypeAlias, TypeVar

from cqos_core.importers.source_reading import SourceReading, described, did_you_mean, listed, shown
from cqos_core.importers.tree import (
    MappingNode,
    Node,
    ScalarNode,
    SequenceNode,
    flag,
    flow_text,
    is_null,
    part_text,
    quoted_where_needed,
    whole_number,
)
from cqos_core.model.re2_patterns import PatternError, name_matcher
from cqos_core.model.settings import Place, Setting
from cqos_core.model.spelling import nearest

T = TypeVar("T")
Schema: TypeAlias = dict[str, Any]

SCALARS: Final = ("string", "number", "boolean")
NAME: Final[Schema] = {"minLength": 1}


class ValueType(Generic[T]):
    """One kind of value.

    Attributes:
        expected: the kind in words, for messages.
        leaf: the JSON schema where no other shape is part of it.
    """

    def __init__(self, expected: str, leaf: Schema | None = None) -> None:
        self.expected = expected
        self.leaf = leaf or {}

    def read(self, node: Node, reading: SourceReading, name: str) -> T | None:
        """Return the value; None where it is refused, which is then reported.

        ``node`` states something (see `is_null`); ``name`` is its key, or that of the list it stands in.
        """
        raise NotImplementedError

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Return the JSON schema; forms put theirs into ``shared`` and are referred to by name."""
        del shared
        return dict(self.leaf)

    def refuse(self, node: Node, reading: SourceReading, name: str, advice: str | None = None) -> None:
        """Say that ``node`` is of another kind, unless its place is reported already."""
        if any(problem.place == reading.place(node) for problem in reading.problems):
            return
        reading.problem("CQ009", f"{shown(name)} must be {self.expected}, found {described(node)}", node, advice)


class Scalar(ValueType[T]):
    """A value that is one scalar.

    Attributes:
        take: returns the value, None where it is refused; raises `ValueError` with a text that follows the name of the key.
        words: what may be stated, where that is a few words.
        code: of the problem where it is of another kind.
        advice: says what to write in place of a refused value of the key with a name; empty where nothing was surely meant.
    """

    def __init__(
        self,
        expected: str,
        leaf: Schema,
        take: Callable[[ScalarNode], T | None],
        *,
        words: tuple[str, ...] = (),
        code: str = "CQ009",
        advice: Callable[[str, Node], str] = lambda _name, _node: "",
    ) -> None:
        super().__init__(expected, leaf)
        self.advice = advice
        self.take = take
        self.words = words
        self.code = code

    def read(self, node: Node, reading: SourceReading, name: str) -> T | None:
        """Take the value."""
        try:
            value = self.take(node) if isinstance(node, ScalarNode) else None
        except ValueError as error:
            reading.problem("CQ011", f"{shown(name)}{error}", node)
            return None
        if value is None:
            hint = did_you_mean(node.text, self.words) if isinstance(node, ScalarNode) else ""
            quoted = isinstance(node, ScalarNode) and not node.plain and self is FLAG
            message = f"{shown(name)} must be {self.expected}, found {'the text ' * quoted}{described(node)}{hint}"
            reading.problem(self.code, message, node, self.advice(name, node) or None)
        return value


def one_of(*words: str) -> Scalar[str]:
    """Return the shape of one of a few words, exactly as spelt."""

    def take(node: ScalarNode) -> str | None:
        return node.text if node.text in words else None

    return Scalar(listed(words), {"type": "string", "enum": [*words]}, take, words=words, code="CQ011")


def _text(node: ScalarNode) -> str | None:
    return node.text if node.text and not is_null(node) else None


def _expression(node: ScalarNode) -> str | None:
    text = _text(node)
    try:
        name_matcher(text or "")
    except PatternError as error:
        raise ValueError(f" cannot be read as a regular expression: {error}") from None
    return text


def _count(node: ScalarNode) -> int | None:
    number = whole_number(node)
    return number if number is not None and number >= 0 else None


def _date(node: ScalarNode) -> str | None:
    if not re.fullmatch(r"\d{4}-\d\d-\d\d", node.text, re.ASCII):
        return None
    try:
        return date.fromisoformat(node.text).isoformat()
    except ValueError:
        raise ValueError(f": there is no day {node.text}") from None


def _meant_flag(name: str, node: Node) -> str:
    """Say how a flag is written that is spelled as in another language, or in quotes."""
    word = node.text.strip().lower() if isinstance(node, ScalarNode) else ""
    meant = "true" if word in _YES else "false" if word in _NO else nearest(word, ("true", "false")) if word else None
    return f"write `{name}: {meant}`" if meant else f"write `{name}: true` or `{name}: false`"


_YES: Final = frozenset(("true", "t", "yes", "y", "on", "1", "enabled"))
_NO: Final = frozenset(("false", "f", "no", "n", "off", "0", "disabled"))


def _meant_text(name: str, node: Node) -> str:
    """Say how a text is written that stands in a list or in a map, and where the other keys of the map belong."""
    if isinstance(node, SequenceNode) and len(node.items) == 1 and isinstance(node.items[0], ScalarNode):
        return f"write it without a list: `{name}: {quoted_where_needed(node.items[0])}`"
    if not isinstance(node, MappingNode):
        return ""
    own = next((word for word in ("name", "id", name) if word in node.entries), "")
    text = node.entries[own][1] if own else None
    if not isinstance(text, ScalarNode):
        return f"write one text: `{name}: TEXT`"
    others = [f"`{word}`" for word in node.entries if word != own]
    more = f", and {listed(others, 'and')} beside it, with the same indentation" if others else ""
    return f"write `{name}: {quoted_where_needed(text)}`{more}"


_TEXT: Final[Schema] = {"type": [*SCALARS], "minLength": 1}
_DATE: Final[Schema] = {"type": "string", "format": "date", "pattern": r"^\d{4}-\d\d-\d\d$"}
TEXT: Final = Scalar("a text", _TEXT, _text, advice=_meant_text)
"""Any text that is not empty; a number or flag is the text it is written as."""
FLAG: Final = Scalar("true or false", {"type": "boolean"}, flag, advice=_meant_flag)
"""A flag of YAML 1.2; ``yes`` is a text."""
EXPRESSION: Final = Scalar("a text", _TEXT, _expression)
"""A regular expression over names."""
COUNT: Final = Scalar("a whole number", {"type": "integer", "minimum": 0}, _count)
"""A number of things, 0 or more."""
DATE: Final = Scalar("a date such as 2027-01-31", _DATE, _date, code="CQ011")
"""A day that exists, as ISO 8601 writes it."""


def _without_map(node: Node, name: str) -> str:
    """Say how the names are written that a map has as keys; or that settings need no key around them."""
    entries = node.entries if isinstance(node, MappingNode) else {}
    if not entries:
        return ""
    if all(isinstance(value, ScalarNode) and (is_null(value) or flag(value)) for _, value in entries.values()):
        return f"write `{name}: [{', '.join(entries)}]`"
    return f"write what is in it without `{name}` around it: `{part_text(node)[1:-1]}`"


class Texts(ValueType[tuple[Setting, ...]]):
    """One text or a list of texts, each with its place."""

    def __init__(self) -> None:
        super().__init__("a text or a list of texts")

    def read(self, node: Node, reading: SourceReading, name: str) -> tuple[Setting, ...] | None:
        """Take every text; a refused one is left out."""
        found = []
        for item in node.items if isinstance(node, SequenceNode) else [node]:
            if isinstance(item, ScalarNode) and _text(item):
                found.append(Setting(item.text, reading.place(item)))
            else:
                self.refuse(item, reading, name, _without_map(item, name) or None)
        return tuple(found)

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A text or a list."""
        text = TEXT.schema(shared)
        return {"anyOf": [text, {"type": "array", "items": text}]}


class AnySetting(ValueType[Setting]):
    """One setting; the rule pack knows its allowed values, the form does not.

    ``maps`` tells whether its value may be a map.
    """

    def __init__(self, *, maps: bool) -> None:
        super().__init__("a text, number, flag, list or map" if maps else "a text, number, flag or list")
        self.maps = maps

    def read(self, node: Node, reading: SourceReading, name: str) -> Setting | None:
        """Take the value as text in YAML flow form; ``{unknown: why}`` is a value that is not known."""
        if isinstance(node, ScalarNode):
            return Setting(node.text, Place(reading.source.name, node.line, node.column))
        if isinstance(node, MappingNode) and set(node.entries) == {"unknown"}:
            _, why = node.entries["unknown"]
            if isinstance(why, ScalarNode) and _text(why):
                return Setting("", reading.place(node), why.text)
        if isinstance(node, MappingNode) and not self.maps:
            self.refuse(node, reading, name)
            return None
        return Setting(flow_text(node), reading.place(node))

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Refer to one definition for all settings."""
        name = "setting" if self.maps else "flat_setting"
        shared["not_known"] = {
            "description": "A value that is not known, and why.",
            "type": "object",
            "properties": {"unknown": {**TEXT.schema(shared), "description": "Why it is not known."}},
            "required": ["unknown"],
            "additionalProperties": False,
        }
        stated = {
            "type": [*SCALARS, "array", *(["object"] if self.maps else []), "null"],
            **whatever_is_below(shared),
        }
        shared[name] = {
            "description": "A setting by its name in the rule pack; null means not stated.",
            "anyOf": [stated, {"$ref": "#/$defs/not_known"}],
        }
        return {"$ref": f"#/$defs/{name}"}


def whatever_is_below(shared: dict[str, Schema]) -> Schema:
    """Return the schema of a list's items and a map's values of any type: no key is empty."""
    below: Schema = {"$ref": "#/$defs/value"}
    rest: Schema = {"items": below, "propertyNames": NAME, "additionalProperties": below}
    shared["value"] = {"description": "Any value.", **rest}
    return rest


TEXTS: Final = Texts()
SETTING: Final = AnySetting(maps=True)
FLAT_SETTING: Final = AnySetting(maps=False)
