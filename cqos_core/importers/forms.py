"""Forms: the contents of a document as data. They read, check and explain it, and describe it as JSON schema.

A `Shape` reads one value and knows its schema. A `Form` lists the keys of a map. It collects mistakes of the map in the
`Reading`, and returns the valid rest as an `Entry`, typed by its keys.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Any, Final, Generic, TypeAlias, TypeVar

from cqos_core.importers.reading import did_you_mean, listed, shown
from cqos_core.importers.tree import (
    MappingNode,
    ScalarNode,
    SequenceNode,
    flag,
    flow_text,
    is_null,
    whole_number,
)
from cqos_core.model.pattern import PatternError, pattern
from cqos_core.model.system import Setting

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.importers.reading import Reading
    from cqos_core.importers.tree import Node
    from cqos_core.model.system import Place, Settings

T = TypeVar("T")
Schema: TypeAlias = dict[str, Any]

_SCALARS: Final = ("string", "number", "boolean")
_NAME: Final[Schema] = {"minLength": 1}


class Shape(Generic[T]):
    """One kind of value.

    Attributes:
        expected: the kind in words, for messages.
        leaf: the JSON schema where no other shape is part of it.
    """

    def __init__(self, expected: str, leaf: Schema | None = None) -> None:
        self.expected = expected
        self.leaf = leaf or {}

    def read(self, node: Node, reading: Reading, name: str) -> T | None:
        """Return the value; report a refused one and return None.

        ``node`` states something (see `is_null`); ``name`` is its key, or that of the list it stands in.
        """
        raise NotImplementedError

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Return the JSON schema; forms put theirs into ``shared`` and are referred to by name."""
        del shared
        return dict(self.leaf)

    def refuse(self, node: Node, reading: Reading, name: str, advice: str | None = None) -> None:
        """Say that ``node`` is of another kind."""
        reading.problem("CQ009", f"{shown(name)} must be {self.expected}, found {described(node)}", node, advice)


def described(node: Node) -> str:
    """Say what is written, for messages."""
    if isinstance(node, MappingNode):
        return "a map"
    if isinstance(node, SequenceNode):
        return "a list"
    return "nothing" if is_null(node) else shown(node.text) if node.text else "an empty text"


class Text(Shape[str]):
    """Any text that is not empty; a number or flag is the text it is written as."""

    def __init__(self) -> None:
        super().__init__("a text", {"type": [*_SCALARS], "minLength": 1})

    def read(self, node: Node, reading: Reading, name: str) -> str | None:
        """Take the text as it is."""
        if isinstance(node, ScalarNode) and node.text and not is_null(node):
            return node.text
        self.refuse(node, reading, name)
        return None


class Flag(Shape[bool]):
    """True or false."""

    def __init__(self) -> None:
        super().__init__("true or false", {"type": "boolean"})

    def read(self, node: Node, reading: Reading, name: str) -> bool | None:
        """Take what YAML 1.2 takes for a flag: ``yes`` is a text."""
        value = flag(node) if isinstance(node, ScalarNode) else None
        if value is None:
            self.refuse(node, reading, name)
        return value


class Word(Shape[str]):
    """One of a few words."""

    def __init__(self, *words: str) -> None:
        super().__init__(listed(words), {"type": "string", "enum": [*words]})
        self.words = words

    def read(self, node: Node, reading: Reading, name: str) -> str | None:
        """Take one of the words, exactly as spelt."""
        if isinstance(node, ScalarNode) and node.text in self.words:
            return node.text
        hint = did_you_mean(node.text, self.words) if isinstance(node, ScalarNode) else ""
        message = f"{shown(name)} must be {self.expected}, found {described(node)}{hint}"
        reading.problem("CQ011", message, node)
        return None


class Expression(Shape[str]):
    """A regular expression over names."""

    def __init__(self) -> None:
        super().__init__("a regular expression", {"type": [*_SCALARS], "minLength": 1})

    def read(self, node: Node, reading: Reading, name: str) -> str | None:
        """Take what can be matched."""
        text = TEXT.read(node, reading, name)
        if text is not None:
            try:
                pattern(text)
            except PatternError as error:
                reading.problem("CQ011", f"{shown(name)} cannot be read as a regular expression: {error}", node)
                return None
        return text


class Date(Shape[str]):
    """A day, as ISO 8601 writes it."""

    def __init__(self) -> None:
        leaf: Schema = {"type": "string", "format": "date", "pattern": r"^\d{4}-\d\d-\d\d$"}
        super().__init__("a date such as 2027-01-31", leaf)

    def read(self, node: Node, reading: Reading, name: str) -> str | None:
        """Take the text of a day that exists."""
        text = node.text if isinstance(node, ScalarNode) else ""
        if re.fullmatch(r"\d{4}-\d\d-\d\d", text, re.ASCII):
            try:
                return date.fromisoformat(text).isoformat()
            except ValueError:
                reading.problem("CQ011", f"{shown(name)}: there is no day {text}", node)
                return None
        reading.problem("CQ011", f"{shown(name)} must be {self.expected}, found {described(node)}", node)
        return None


class Version(Shape[int]):
    """The version of the form."""

    def __init__(self, version: int) -> None:
        super().__init__(str(version), {"const": version})
        self.version = version

    def read(self, node: Node, reading: Reading, name: str) -> int | None:
        """Take the one version that is known."""
        if isinstance(node, ScalarNode) and whole_number(node) == self.version:
            return self.version
        if isinstance(node, ScalarNode) and not node.plain:
            message = f"{shown(name)} must be the number {self.version}, found the text {described(node)}"
        else:
            message = f"version {described(node)} of the form is not known, only version {self.version} is"
        reading.problem("CQ004", message, node, f"write `{name}: {self.version}`, or install a newer C-QoS")
        return None


class Texts(Shape[tuple[Setting, ...]]):
    """One text or a list of texts, each with its place."""

    def __init__(self) -> None:
        super().__init__("a text or a list of texts")

    def read(self, node: Node, reading: Reading, name: str) -> tuple[Setting, ...] | None:
        """Take every text; a refused one is left out."""
        found = []
        for item in node.items if isinstance(node, SequenceNode) else [node]:
            if isinstance(item, ScalarNode) and item.text and not is_null(item):
                found.append(Setting(item.text, reading.place(item)))
            else:
                self.refuse(item, reading, name)
        return tuple(found)

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A text or a list."""
        text = TEXT.schema(shared)
        return {"anyOf": [text, {"type": "array", "items": text}]}


class AnySetting(Shape[Setting]):
    """One setting: what may be stated is known to the rule pack, not to the form.

    ``maps`` tells whether its value may be a map.
    """

    def __init__(self, *, maps: bool) -> None:
        super().__init__("a text, number, flag, list or map" if maps else "a text, number, flag or list")
        self.maps = maps

    def read(self, node: Node, reading: Reading, name: str) -> Setting | None:
        """Take the value as text in YAML flow form; ``{unknown: why}`` is a value that is not known."""
        if isinstance(node, MappingNode) and set(node.entries) == {"unknown"}:
            _, why = node.entries["unknown"]
            if isinstance(why, ScalarNode) and why.text and not is_null(why):
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
            "type": [*_SCALARS, "array", *(["object"] if self.maps else []), "null"],
            **whatever_is_below(shared),
        }
        shared[name] = {
            "description": "A setting by its name in the rule pack; null means not stated.",
            "anyOf": [stated, {"$ref": "#/$defs/not_known"}],
        }
        return {"$ref": f"#/$defs/{name}"}


@dataclass(frozen=True, slots=True)
class Member(Generic[T]):
    """One value of a map, with the place of its key."""

    value: T
    place: Place


class MapOf(Shape[dict[str, Member[T]]]):
    """A map from names that people choose to values of one shape.

    ``empty`` tells that a name without a value states something all the same: a topic with nothing but defaults.
    """

    def __init__(self, shape: Shape[T], expected: str, *, empty: bool = False) -> None:
        super().__init__(expected)
        self.shape = shape
        self.empty = empty

    def read(self, node: Node, reading: Reading, name: str) -> dict[str, Member[T]] | None:
        """Read every value; a refused one is left out."""
        if not isinstance(node, MappingNode):
            listed_instead = isinstance(node, SequenceNode)
            advice = "write each as `name: …`, without a dash" if listed_instead else _missing_blank(node)
            self.refuse(node, reading, name, advice)
            return None
        found = {}
        for key, value in node.entries.values():
            if not self.empty and is_null(value):
                continue
            read = self.shape.read(value, reading, key.text)
            if read is not None:
                found[key.text] = Member(read, reading.place(key))
        return found

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Any name, values of one schema."""
        values = self.shape.schema(shared)
        return named(values if self.empty else nullable(values))


class ListOf(Shape[list[T]]):
    """A list of values of one shape."""

    def __init__(self, shape: Shape[T], expected: str) -> None:
        super().__init__(expected)
        self.shape = shape

    def read(self, node: Node, reading: Reading, name: str) -> list[T] | None:
        """Read every value; a refused one is left out."""
        if not isinstance(node, SequenceNode):
            self.refuse(node, reading, name, "begin each with a dash: `- …`")
            return None
        return _read_items(self.shape, node, reading, name)

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A list, items of one schema."""
        return {"type": "array", "items": self.shape.schema(shared)}


def _read_items(shape: Shape[T], node: SequenceNode, reading: Reading, name: str) -> list[T]:
    """Read every item; refused ones are left out."""
    read = (shape.read(item, reading, f"{name}[{index}]") for index, item in enumerate(node.items))
    return [item for item in read if item is not None]


class OneOrMore(Shape[list[T]]):
    """A value, or a list of such values where there are several."""

    def __init__(self, shape: Shape[T]) -> None:
        super().__init__(shape.expected)
        self.shape = shape

    def read(self, node: Node, reading: Reading, name: str) -> list[T] | None:
        """Read the one or every one; refused ones are left out."""
        if not isinstance(node, SequenceNode):
            read = self.shape.read(node, reading, name)
            return None if read is None else [read]
        if not node.items:
            message = f"the list at {shown(name)} is empty"
            reading.problem("CQ009", message, node, "remove the key, or list what there is")
            return None
        return _read_items(self.shape, node, reading, name)

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """One, or a list that is not empty."""
        one = self.shape.schema(shared)
        return {"anyOf": [one, {"type": "array", "items": one, "minItems": 1}]}


@dataclass(frozen=True, slots=True, eq=False)
class Key(Generic[T]):
    """One key of a form.

    Attributes:
        help: one or two sentences for people; the schema shows them in editors.
        required: the key must be there and state something.
        hints: parts of the schema in which rule packs suggest values; they refuse nothing.
    """

    name: str
    shape: Shape[T]
    help: str
    required: bool = False
    hints: tuple[str, ...] = ()


class Entry:
    """What one map states, as its form reads it.

    Attributes:
        place: where the map, or the text that is short for one, begins.
        settings: the keys that are not the form's own, where the form allows them.
    """

    __slots__ = ("_values", "place", "settings")

    def __init__(self, place: Place, values: dict[str, Any], settings: Settings) -> None:
        self.place = place
        self.settings = settings
        self._values = values

    def get(self, key: Key[T]) -> T | None:
        """Return the value of ``key``, None where it is not stated (or was refused)."""
        value: T | None = self._values.get(key.name)
        return value

    def require(self, key: Key[T]) -> T:
        """Return the value of a required key."""
        value: T = self._values[key.name]
        return value


class Form(Shape[Entry]):
    """A map with keys of its own; an empty value is a map that states nothing.

    Attributes:
        name: of the schema's part; ``expected`` is what people call the thing (``a participant``).
        short: the key that a bare text stands for, as in ``topic: profile``; None where a map is wanted.
        others: the shape of settings, which may stand beside the form's own keys; None where nothing may.
        never: names that are no settings, because they are keys of a form nearby.
        one_of: at least one of these keys is required.
        hints: parts of the schema in which rule packs suggest settings or the bare text; they refuse nothing.
    """

    def __init__(
        self,
        name: str,
        expected: str,
        keys: Iterable[Key[Any]],
        *,
        short: str | None = None,
        others: Shape[Setting] | None = None,
        never: tuple[str, ...] = (),
        one_of: tuple[str, ...] = (),
        hints: tuple[str, ...] = (),
    ) -> None:
        super().__init__(expected)
        self.name = name
        self.keys = {key.name: key for key in keys}
        self.short = short
        self.others = others
        self.never = never
        self.one_of = one_of
        self.hints = hints
        self.required = tuple(key.name for key in self.keys.values() if key.required)
        self.flat = isinstance(others, AnySetting) and not others.maps

    def read(self, node: Node, reading: Reading, name: str) -> Entry | None:
        """Read every key by its shape, and the others as settings; None where a required one is missing or refused."""
        if isinstance(node, MappingNode):
            return self._map(node, reading)
        if is_null(node) and not self.required:
            return Entry(reading.place(node), {}, {})
        if isinstance(node, ScalarNode) and self.short is not None and node.text:
            key = ScalarNode(self.short, node.line, node.column, plain=True)
            return self._map(MappingNode(node.line, node.column, {self.short: (key, node)}), reading)
        self.refuse(node, reading, name, _missing_blank(node))
        return None

    def refuse(self, node: Node, reading: Reading, name: str, advice: str | None = None) -> None:
        """Say that ``node`` is no such map."""
        kinds = "a map" if self.short is None else "a text or a map"
        message = f"{shown(name)} must be {kinds} ({self.expected}), found {described(node)}"
        reading.problem("CQ009", message, node, advice)

    def _map(self, node: MappingNode, reading: Reading) -> Entry | None:
        keys = self.keys
        values: dict[str, Any] = {}
        settings: Settings = {}
        for name, (key, value) in node.entries.items():
            own = keys.get(name)
            if own is not None:
                if not is_null(value):
                    values[name] = own.shape.read(value, reading, name)
            elif self.others is None or name in self.never or (self.flat and isinstance(value, MappingNode)):
                self._unknown(key, reading)
            elif not is_null(value):
                setting = self.others.read(value, reading, name)
                if setting is not None:
                    settings[name] = setting
        if self.required and (not self._complete(node, reading) or None in map(values.get, self.required)):
            return None
        return Entry(reading.place(node), values, settings)

    def _complete(self, node: MappingNode, reading: Reading) -> bool:
        """Say what is missing."""
        stated = {name for name, (_, value) in node.entries.items() if not is_null(value)}
        missing = [name for name in self.required if name not in stated]
        for name in missing:
            help_text = self.keys[name].help.rstrip(".")
            reading.problem("CQ010", f"{self.expected} needs `{name}`", node, help_text[0].lower() + help_text[1:])
        if self.one_of and stated.isdisjoint(self.one_of):
            missing += self.one_of
            words = listed(f"`{name}`" for name in self.one_of)
            reading.problem("CQ010", f"{self.expected} needs {words}", node)
        return not missing

    def _unknown(self, key: ScalarNode, reading: Reading) -> None:
        known = tuple(self.keys)
        message = f"{self.expected} has no key {shown(key.text)}{did_you_mean(key.text, known)}"
        more = "" if self.others is None else ", or a setting that is no map" if self.flat else ", or a setting"
        reading.problem("CQ006", message, key, f"allowed: {', '.join(known)}{more}")

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Refer to the one definition of this form."""
        if self.name not in shared:
            shared[self.name] = {}  # keeps its place in the order of first use
            shared[self.name] = self.definition(shared)
        return {"$ref": f"#/$defs/{self.name}"}

    def definition(self, shared: dict[str, Schema]) -> Schema:
        """Return the schema itself rather than a reference to it."""
        kinds = ["object"]
        if not self.required:
            kinds.append("null")
        if self.short is not None:
            kinds += _SCALARS
        properties: Schema = {
            key.name: {"description": key.help, **_of(key, shared), **_hinted(key.hints)} for key in self.keys.values()
        }
        properties |= dict.fromkeys(self.never, False)
        schema: Schema = {
            "type": kinds if len(kinds) > 1 else kinds[0],
            "properties": properties,
            "additionalProperties": self.others.schema(shared) if self.others is not None else False,
        }
        if self.others is not None:
            schema["propertyNames"] = _NAME
        if self.short is not None:
            schema["minLength"] = 1
        if self.required:
            schema["required"] = list(self.required)
        if self.one_of:
            schema["anyOf"] = [
                {"required": [name], "properties": {name: {"not": {"type": "null"}}}} for name in self.one_of
            ]
        return schema | _hinted(self.hints)


def _hinted(parts: tuple[str, ...]) -> Schema:
    return {"allOf": [{"$ref": f"#/$defs/{part}"} for part in parts]} if parts else {}


def _of(key: Key[Any], shared: dict[str, Schema]) -> Schema:
    schema = key.shape.schema(shared)
    return schema if key.required else nullable(schema)


def named(values: Schema) -> Schema:
    """Return the schema of a map from names, which are never empty, to ``values``."""
    return {"type": "object", "propertyNames": _NAME, "additionalProperties": values}


def whatever_is_below(shared: dict[str, Schema]) -> Schema:
    """Return what a schema says of a list's items and a map's values where they may be anything: no key is empty."""
    below: Schema = {"$ref": "#/$defs/value"}
    rest: Schema = {"items": below, "propertyNames": _NAME, "additionalProperties": below}
    shared["value"] = {"description": "Any value.", **rest}
    return rest


def nullable(schema: Schema) -> Schema:
    """Return the schema of the same value or nothing."""
    if "type" in schema and "enum" not in schema:
        kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
        return schema if "null" in kinds else {**schema, "type": [*kinds, "null"]}
    return {"anyOf": [*schema.get("anyOf", [schema]), {"type": "null"}]}


def _missing_blank(node: Node) -> str | None:
    """Suspect ``key:value`` where a map is wanted."""
    glued = isinstance(node, ScalarNode) and node.plain and re.fullmatch(r"([\w.-]+):(\S+)", node.text[:200])
    return f"write a blank after the colon: `{glued[1]}: {glued[2]}`" if glued else None


TEXT = Text()
FLAG = Flag()
TEXTS = Texts()
SETTING = AnySetting(maps=True)
FLAT_SETTING = AnySetting(maps=False)


class SettingsMap(Shape["Settings"]):
    """A map of settings and nothing else."""

    def __init__(self, expected: str, shape: Shape[Setting] = SETTING, *, advice: str = "") -> None:
        super().__init__(expected)
        self.shape = shape
        self.advice = advice

    def read(self, node: Node, reading: Reading, name: str) -> Settings | None:
        """Read every setting; a refused one is left out."""
        if not isinstance(node, MappingNode):
            advice = self.advice.format(name=name, found=node.text) if isinstance(node, ScalarNode) else ""
            self.refuse(node, reading, name, _missing_blank(node) or advice or None)
            return None
        read = {
            key.text: self.shape.read(value, reading, key.text)
            for key, value in node.entries.values()
            if not is_null(value)
        }
        return {name: setting for name, setting in read.items() if setting is not None}

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Any name, any setting."""
        return named(self.shape.schema(shared))
