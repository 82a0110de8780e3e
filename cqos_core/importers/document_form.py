"""Forms of documents: classes that read a map, check it, explain mistakes, and describe it as JSON schema.

A `Form` lists the keys of a map, each with the `ValueType` of its value. A `SourceReading` collects the problems of the map. Its correct values come
back as an `Entry`, typed by its keys.
"""

from __future__ import annotations

import re
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Generic, TypeGuard, TypeVar

from cqos_core.importers.source_reading import described, did_you_mean, listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, TextMap, is_null, part_text, place_of
from cqos_core.importers.value_types import NAME, SCALARS, SETTING, AnySetting, Scalar, ValueType
from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import Place, Setting
from cqos_core.model.spelling import nearest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from cqos_core.importers.source_reading import SourceReading
    from cqos_core.importers.tree import Node
    from cqos_core.importers.value_types import Schema
    from cqos_core.model.settings import Settings

T = TypeVar("T")

WRITTEN: Final = "{value}"
"""In advice about a key: the value that was written for it."""

OTHERS: Final = "{others}"
"""In advice about a key: the map without it."""


@dataclass(frozen=True, slots=True)
class Member(Generic[T]):
    """One value of a map, with the place of its key."""

    value: T
    place: Place


class MapOf(ValueType[dict[str, Member[T]]]):
    """A map from names that people choose to values of one shape.

    ``empty`` tells that a name without a value states something all the same: a topic with nothing but defaults.
    ``instead`` is the key that a list or a text at this one was meant for. ``beside`` are keys of the map around it, which are no
    names where they hold names.
    """

    def __init__(
        self,
        shape: ValueType[T],
        expected: str,
        *,
        empty: bool = False,
        instead: str = "",
        beside: frozenset[str] = frozenset(),
    ) -> None:
        super().__init__(expected)
        self.shape = shape
        self.empty = empty
        self.instead = instead
        self.beside = beside

    def read(self, node: Node, reading: SourceReading, name: str) -> dict[str, Member[T]] | None:
        """Read every value; a refused one is left out."""
        if not isinstance(node, MappingNode):
            advice = _missing_blank(node) or _as_map(node, self.instead or name)
            if isinstance(self.shape, SettingsMap) and (joined := _joined(node)) and joined.is_flat():
                advice = (
                    f"write a map: `{name}: {{PACK: {part_text(joined)}}}`, where PACK is the protocol they are about"
                )
            self.refuse(node, reading, name, advice)
            return None
        if self._is_refused_whole(node, reading, name):
            return None
        found = {}
        before: Node | None = None
        last = ""
        for key, value in node.entries.values():
            if not self.empty and is_null(value):
                if _is_bare(key, value, reading):
                    old, _, new = (part.strip() for part in key.text.replace(":=", "=").partition("="))
                    advice = f"write `{old}: {new or 'VALUE'}`, with a colon and a blank"
                    reading.problem(
                        "CQ009", f"{shown(key.text)} in {shown(name)} is a key without a value", key, advice
                    )
                continue
            above = self._above(before, key.text, value)
            advice = f"indent it below `{above}`, which is empty"
            if not above and last and self._is_key_of_one(key.text, value):
                above, advice = last, f"indent it below `{last}`, with more blanks before it than before `{last}`"
            before, last = value, key.text
            if above:
                reading.problem("CQ006", f"{shown(key.text)} stands as a name within {shown(name)}", key, advice)
                continue
            if key.text in self.beside and self._holds_names(value):
                advice = f"write `{key.text}` beside `{name}`, with the same indentation"
                reading.problem("CQ006", f"{shown(key.text)} stands as a name within {shown(name)}", key, advice)
                continue
            read = self.shape.read(value, reading, key.text)
            if read is not None:
                found[key.text] = Member(read, Place(reading.source.name, key.line, key.column))
        return found

    def _holds_names(self, node: Node) -> bool:
        """Return whether a value does not belong to this map: its keys are names (their values are maps, or they have a slash), or it is no map."""
        if not isinstance(node, MappingNode):
            return isinstance(self.shape, Form) and self.shape.short is None and not is_null(node)
        if isinstance(self.shape, Form):
            own = self.shape.own
            return own.isdisjoint(node.entries) and any(
                isinstance(each, MappingNode) for _, each in node.entries.values()
            )
        return any("/" in name for name in node.entries)

    def _is_refused_whole(self, node: MappingNode, reading: SourceReading, name: str) -> bool:
        """Whether no key is a name here, which is reported: `from` and `to`, or topics in place of groups."""
        if isinstance(self.shape, Scalar) and node.entries.keys() == {"from", "to"}:
            source, target = _as_entry(node)
            message = f"{shown(name)} has `from` and `to` as names"
            reading.problem("CQ009", message, node, f"write `{name}: {{{source}: {target}}}`")
            return True
        if (
            self.instead
            and node.entries
            and not any(map(self._is_group, (value for _, value in node.entries.values())))
        ):
            written = part_text(node)
            advice = f"without groups write `{self.instead}: {written if len(written) <= _LONGEST_MAP else '…'}`"
            advice += f"; with a group `{name}: {{{_NAME}: {{{self.instead}: {{…}}}}}}`"
            message = f"{shown(name)} has groups by name, and none here has {shown(self.instead)}"
            reading.problem("CQ010", message, next(iter(node.entries.values()))[0], advice)
            return True
        return False

    def _is_group(self, node: Node) -> bool:
        """Whether a value may be a group: it has topics below a direction, or is of another kind, which is reported."""
        if not isinstance(node, MappingNode):
            return not is_null(node)
        misplaced = self.shape.never if isinstance(self.shape, Form) else {}
        return not {self.instead, *misplaced}.isdisjoint(node.entries)

    def _is_key_of_one(self, name: str, value: Node) -> bool:
        """Whether a name is a key that the values have, `subscribes`, with topics below it: it stands one level too high."""
        if not isinstance(self.shape, Form) or name not in self.shape.keys or not isinstance(value, MappingNode):
            return False
        return isinstance(self.shape.keys[name].shape, MapOf) and self.shape.own.isdisjoint(value.entries)

    def _above(self, before: Node | None, name: str, value: Node) -> str:
        """Return the empty key at the end of the map ``before`` a name that is a topic and no name of this map; else nothing."""
        if "/" not in name or not isinstance(self.shape, Form) or not isinstance(before, MappingNode):
            return ""
        keys = self.shape.keys
        if not isinstance(value, MappingNode) or not value.entries or not self.shape.own.isdisjoint(value.entries):
            return ""
        last, (_, below) = next(reversed(before.entries.items()), ("", (None, None)))
        is_open = below is not None and is_null(below) and last in keys and isinstance(keys[last].shape, MapOf)
        return last if is_open else ""

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Any name, values of one schema."""
        values = self.shape.schema(shared)
        return named(values if self.empty else nullable(values))


def _as_map(node: Node, name: str) -> str:
    """Say how a text, or the parts of a list, are written as the map at a key; or how the first are, where all are too long."""
    parts = [_as_entry(part) for part in (_pairs(node.items) if isinstance(node, SequenceNode) else [node])]
    if len(parts) == _PAIR and "/" in parts[0][0] and not (parts[0][1] or parts[1][1] or "/" in parts[1][0]):
        return f"write a map: `{name}: {{{parts[0][0]}: {parts[1][0]}}}`"
    if not parts:
        return f"write a map: `{name}: {{{_NAME}: …}}`"
    whole = f"{name}: {{{', '.join(f'{key}: {value}' if value else f'{key}: ' for key, value in parts)}}}"
    if len({key for key, _ in parts} - {_NAME}) < len(parts):
        return f"write each as `{_NAME}: …`, without a dash"
    if len(whole) <= _LONGEST_MAP:
        return f"write a map: `{whole}`"
    key, value = parts[0]
    if not value:
        keys = ", ".join(f"`{key}:`" for key, _ in parts[:_SHOWN])
        return f"write each with a colon, in a map: {keys}{', …' if len(parts) > _SHOWN else ''}"
    return f"write each without a dash: `{key}: {value if len(value) <= _LONGEST_MAP else '…'}`"


def _joined(node: Node) -> MappingNode | None:
    """Return one map in place of a list of maps with different keys; None for all else."""
    entries: dict[str, tuple[ScalarNode, Node]] = {}
    for item in node.items if isinstance(node, SequenceNode) else ():
        if not isinstance(item, MappingNode) or not entries.keys().isdisjoint(item.entries):
            return None
        entries.update(item.entries)
    return MappingNode(None, None, entries) if entries else None


def _pairs(items: list[Node]) -> list[Node]:
    """Return the items of a list, with each pair in round brackets, ``(a, b)``, as a list of two."""
    texts = [item.text if isinstance(item, ScalarNode) else "" for item in items]
    pairs: list[Node] = []
    for index, item in enumerate(items):
        if texts[index].startswith("(") and index + 1 < len(items) and texts[index + 1].endswith(")"):
            both = [texts[index][1:], texts[index + 1][:-1]]
            words = [ScalarNode(text.strip().strip("'\""), item.line, item.column, plain=True) for text in both]
            pairs.append(SequenceNode(item.line, item.column, [*words]))
        elif not (index and pairs and texts[index].endswith(")") and texts[index - 1].startswith("(")):
            pairs.append(item)
    return pairs


def _as_entry(node: Node) -> tuple[str, str]:
    """Return the key and the value, as they are written in a map, that a text or a map in a list was meant to be."""
    if isinstance(node, ScalarNode):
        before, arrow, after = node.text.partition(":=")
        return (before, after) if arrow else (part_text(node) if node.text else _NAME, "")
    if isinstance(node, SequenceNode) and len(node.items) == _PAIR:
        return part_text(node.items[0]), part_text(node.items[1])
    names = node.entries if isinstance(node, MappingNode) else {}
    if names.keys() == {"from", "to"}:
        source, target = (part_text(value) for _, value in names.values())
        return (source, target) if next(iter(names)) == "from" else (target, source)
    own = next((word for word in ("topic", "name", "id") if word in names), "")
    if not own:
        return next(((key, part_text(value)) for key, (_, value) in names.items() if len(names) == 1), (_NAME, "…"))
    rest = {key: entry for key, entry in names.items() if key != own}
    return part_text(names[own][1]), part_text(MappingNode(None, None, rest)) if rest else ""


_NAME: Final = "NAME"
_LONGEST_MAP: Final = 140
_NEAR: Final = 100
"""Characters before a key in which a key without a value is looked for."""
_SHOWN: Final = 4
_PAIR: Final = 2


class ListOf(ValueType[list[T]]):
    """A list of values of one shape."""

    def __init__(self, shape: ValueType[T], expected: str) -> None:
        super().__init__(expected)
        self.shape = shape

    def read(self, node: Node, reading: SourceReading, name: str) -> list[T] | None:
        """Read every value; a refused one is left out."""
        if not isinstance(node, SequenceNode):
            self.refuse(node, reading, name, self._as_list(node, name))
            return None
        return _read_items(self.shape, node, reading, name)

    def _as_list(self, node: Node, name: str) -> str:
        """Say how a text or a map is written as the list at a key."""
        own = [*self.shape.keys] if isinstance(self.shape, Form) else []
        if isinstance(node, MappingNode) and node.entries and own and not node.entries.keys() <= {*own}:
            items = [
                part_text(
                    MappingNode(
                        None, None, {own[0]: (ScalarNode(own[0], None, None, plain=True), key), **value.entries}
                    )
                )
                if isinstance(value, MappingNode)
                else part_text(key)
                for key, value in node.entries.values()
            ]
        else:
            items = [part_text(node)]
        whole = f"{name}: [{', '.join(items)}]"
        return f"write a list: `{whole}`" if len(whole) <= _LONGEST_MAP else f"begin each with a dash: `- {items[0]}`"

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A list, items of one schema."""
        return {"type": "array", "items": self.shape.schema(shared)}


def _has_one_key(node: Node) -> TypeGuard[MappingNode]:
    return isinstance(node, MappingNode) and len(node.entries) == 1


_SEVERAL: Final = 2


def _read_items(shape: ValueType[T], node: SequenceNode, reading: SourceReading, name: str) -> list[T]:
    """Read every item; refused ones are left out."""
    read = (shape.read(item, reading, f"{name}[{index}]") for index, item in enumerate(node.items))
    return [item for item in read if item is not None]


class OneOrMore(ValueType[list[T]]):
    """A value, or a list of such values where there are several."""

    def __init__(self, shape: ValueType[T]) -> None:
        super().__init__(shape.expected)
        self.shape = shape

    def read(self, node: Node, reading: SourceReading, name: str) -> list[T] | None:
        """Read the one or every one; refused ones are left out."""
        if not isinstance(node, SequenceNode):
            read = self.shape.read(node, reading, name)
            return None if read is None else [read]
        if not node.items:
            message = f"the list at {shown(name)} is empty"
            reading.problem("CQ009", message, node, "remove the key, or list what there is")
            return None
        self._warn_of_parts(node, reading, name)
        return _read_items(self.shape, node, reading, name)

    def _warn_of_parts(self, node: SequenceNode, reading: SourceReading, name: str) -> None:
        """Report items of one key each, all different and on lines of their own: one map was probably meant."""
        entries = [next(iter(item.entries.values())) for item in node.items if _has_one_key(item)]
        words, lines = {key.text for key, _ in entries}, {key.line for key, _ in entries}
        if len(node.items) < _SEVERAL or not len(node.items) == len(words) == len(lines):
            return
        one = part_text(MappingNode(None, None, {key.text: (key, value) for key, value in entries}))
        message = f"the list at {shown(name)} makes {len(entries)} of it, each with one setting"
        advice = (
            f"if one is meant, write `{name}: {one}`" if len(one) <= _LONGEST_MAP else "if one is meant, write one map"
        )
        reading.warn("CQ021", message, node, f"{advice}; if not, give each an `id`")

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
        former: an earlier name of the key, which stays readable.
    """

    name: str
    shape: ValueType[T]
    help: str
    required: bool = False
    hints: tuple[str, ...] = ()
    former: str = ""


class Entry:
    """The contents of one map, as its form reads it.

    Attributes:
        place: where the map, or the text that is short for one, begins.
        values: of the form's own keys, by their names.
        settings: the keys that are not the form's own, where the form allows them.
    """

    __slots__ = ("place", "settings", "values")

    def __init__(self, place: Place, values: dict[str, Any], settings: Settings) -> None:
        self.place = place
        self.settings = settings
        self.values = values

    def get(self, key: Key[T]) -> T | None:
        """Return the value of ``key``, None where it is not stated (or was refused)."""
        value: T | None = self.values.get(key.name)
        return value

    def corrected(self, other: Entry, joined: Mapping[str, Callable[[Any, Any], Any]] = MappingProxyType({})) -> Entry:
        """Return an entry with the keys of both: of a key of both the value of ``other``, or what ``joined`` makes of the two."""
        both = {
            name: join(self.values[name], other.values[name])
            for name, join in joined.items()
            if name in self.values and name in other.values
        }
        return Entry(other.place, {**self.values, **other.values, **both}, {**self.settings, **other.settings})

    def require(self, key: Key[T]) -> T:
        """Return the value of a required key."""
        value: T = self.values[key.name]
        return value


class TextEntry(Entry):
    """The contents of a map of texts. Its settings and its place are made when they are read.

    Attributes:
        node, reading: the map, and the reading of its source.
    """

    __slots__ = ("node", "reading")

    def __init__(self, node: TextMap, reading: SourceReading, values: dict[str, Any]) -> None:
        self.node = node
        self.reading = reading
        self.values = values

    def __getattr__(self, name: str) -> Any:
        """Make a field that is not set yet."""
        if name == "place":
            self.place = self.reading.place(self.node)
        elif name == "settings":
            self.settings = settings_at(self.reading.source.name, self.node.line or 0, *self.stated())
        else:
            raise AttributeError(name)
        return getattr(self, name)

    def stated(self) -> tuple[tuple[str, ...], tuple[str, ...], tuple[int, ...]]:
        """Return names, texts and spots of the settings; the spots are below the line of the map."""
        node, values = self.node, self.values
        every = node.names, node.texts, node.spots[1::2]
        if not values:
            return every
        settings = [each for each in zip(*every, strict=True) if each[0] not in values]
        names, texts, spots = zip(*settings, strict=True) if settings else ((), (), ())
        return names, texts, spots


def settings_at(
    source: str, line: int, names: Iterable[str], texts: Iterable[str], spots: Iterable[int]
) -> dict[str, Setting]:
    """Return settings that stand at spots below a line."""
    stated = zip(names, texts, spots, strict=True)
    return {name: Setting(text, Place(source, *place_of(spot, line))) for name, text, spot in stated}


class Form(ValueType[Entry]):
    """A map with keys of its own; an empty value is a map that states nothing.

    Attributes:
        name: of the schema's part; ``expected`` is what people call the thing (``a participant``).
        short: the key that a bare text stands for, as in ``topic: profile``; None where a map is wanted.
        others: the shape of settings, which may stand beside the form's own keys; None where nothing may.
        never: names that are no settings, because they are keys of a form nearby, with where they belong.
        one_of: at least one of these keys is required.
        hints: parts of the schema in which rule packs suggest settings or the bare text; they refuse nothing.
        bare: how a text, ``{0}``, is written as such a map; ``{name}`` is the name of the map.
        elsewhere: names that belong to other forms, with what to write there; `WRITTEN` in it stands for the value.
        guess: returns the text to write for an unknown key, by its name, its value and its map; empty if unknown.
    """

    def __init__(
        self,
        name: str,
        expected: str,
        keys: Iterable[Key[Any]],
        *,
        short: str | None = None,
        others: ValueType[Setting] | None = None,
        never: Mapping[str, str] = MappingProxyType({}),
        one_of: tuple[str, ...] = (),
        hints: tuple[str, ...] = (),
        bare: str = "",
        elsewhere: Mapping[str, str] = MappingProxyType({}),
        guess: Callable[[str, Node, MappingNode], str] = lambda _name, _value, _around: "",
    ) -> None:
        super().__init__(expected)
        self.name = name
        self.elsewhere = elsewhere
        self.guess = guess
        self.bare = bare
        self.keys = {key.name: key for key in keys}
        self.short = short
        self.others = others
        self.never = never
        self.one_of = one_of
        self.hints = hints
        self.required = tuple(key.name for key in self.keys.values() if key.required)
        self.former = {key.former: key.name for key in self.keys.values() if key.former}
        self.misplaced = frozenset((*self.former, *never))
        self.own = self.misplaced | self.keys.keys()
        self.flat = isinstance(others, AnySetting) and not others.maps
        self.takes_texts = isinstance(others, AnySetting) and not self.required

    def read(self, node: Node, reading: SourceReading, name: str) -> Entry | None:
        """Read every key by its shape, and the others as settings; None where a required one is missing or refused."""
        if isinstance(node, MappingNode):
            if self.takes_texts and isinstance(node, TextMap) and self.misplaced.isdisjoint(node.names):
                return TextEntry(node, reading, self._own(node, reading))
            return self._map(node, reading)
        if is_null(node) and not self.required:
            return Entry(reading.place(node), {}, {})
        if isinstance(node, ScalarNode) and self.short is not None and node.text:
            key = ScalarNode(self.short, node.line, node.column, plain=True)
            return self._map(MappingNode(node.line, node.column, {self.short: (key, node)}), reading)
        self.refuse(node, reading, name, _missing_blank(node) or self._instead_of(node, name))
        return None

    def _instead_of(self, node: Node, name: str) -> str | None:
        """Say what to write in place of a list or a text."""
        if (joined := _joined(node)) is not None:
            return f"write it without dashes: `{name}: {part_text(joined)}`"
        if not self.bare:
            return None
        named = "{name}" in self.bare
        text = node.text if isinstance(node, ScalarNode) and not named else part_text(node)
        advice = f"write `{self.bare.format('' if is_null(node) else text, name=name)}`"
        if self.flat and isinstance(node, ScalarNode) and node.text:
            advice += f"; if `{name}: {text}` is a setting, write it in {self.expected} or at an endpoint, `TOPIC: {{{name}: {text}}}`"
        return advice

    def refuse(self, node: Node, reading: SourceReading, name: str, advice: str | None = None) -> None:
        """Say that ``node`` is no such map."""
        kinds = "a map" if self.short is None else "a text or a map"
        message = f"{shown(name)} must be {kinds} ({self.expected}), found {described(node)}"
        reading.problem("CQ009", message, node, advice)

    def _own(self, node: TextMap, reading: SourceReading) -> dict[str, Any]:
        """Read the values of the form's own keys in a map of texts."""
        if self.own.isdisjoint(node.names):
            return {}
        keys = self.keys
        return {name: keys[name].shape.read(node.value(name), reading, name) for name in node.names if name in keys}

    def _map(self, node: MappingNode, reading: SourceReading) -> Entry | None:
        keys, others, never = self.keys, self.others, self.never
        values: dict[str, Any] = {}
        settings: Settings = {}
        for stated, (key, value) in node.entries.items():
            name = self.former.get(stated, stated)
            if name != stated and name in node.entries:
                advice = f"remove one; `{stated}` is the former name of `{name}`"
                reading.problem("CQ006", f"{self.expected} has both `{name}` and `{stated}`", key, advice)
            elif name in keys:
                if not is_null(value):
                    values[name] = keys[name].shape.read(value, reading, name)
            elif others is None or name in never or (self.flat and isinstance(value, MappingNode)):
                self._unknown(key, reading, node)
            elif not is_null(value):
                setting = others.read(value, reading, name)
                if setting is not None:
                    settings[name] = setting
            elif (glued := _glued(key, value, reading, next(reversed(settings), ""))) is not None:
                settings[glued[0]] = glued[1]
        if self.required and (not self._complete(node, reading) or None in map(values.get, self.required)):
            return None
        return Entry(reading.place(node), values, settings)

    def _complete(self, node: MappingNode, reading: SourceReading) -> bool:
        """Say what is missing."""
        stated = {self.former.get(name, name) for name, (_, value) in node.entries.items() if not is_null(value)}
        missing = [name for name in self.required if name not in stated]
        reported = [
            name
            for name in node.entries
            if name not in {**self.keys, **self.former} and (self.others is None or name in self.never)
        ]
        for name in missing:
            if any(slip in self.never or nearest(slip, (name,)) for slip in reported):
                continue  # the finding about that key says what to write
            help_text = self.keys[name].help.rstrip(".")
            advice = f"add `{name}: …`: {help_text[0].lower()}{help_text[1:]}"
            reading.problem("CQ010", f"{self.expected} needs `{name}`", node, advice)
        if self.one_of and stated.isdisjoint(self.one_of):
            missing += self.one_of
            words = listed(f"`{name}`" for name in self.one_of)
            reading.problem("CQ010", f"{self.expected} needs {words}", node)
        return not missing

    def _unknown(self, key: ScalarNode, reading: SourceReading, node: MappingNode) -> None:
        known = tuple(self.keys)
        above = next(
            (name for name in reversed(node.entries) if (node.entries[name][0].line or 0) < (key.line or 0)), ""
        )
        value = node.entries[key.text][1]
        belongs = above in known and is_null(node.entries[above][1]) and isinstance(self.keys[above].shape, MapOf)
        advice = f"indent it below `{above}`, which is empty" if belongs else self.never.get(key.text)
        advice = advice or self.elsewhere.get(key.text) or ""
        may_be = [
            each for each in known if not (isinstance(value, MappingNode) and isinstance(self.keys[each].shape, Scalar))
        ]
        guess = "" if advice else did_you_mean(key.text, may_be)
        if not advice and not guess:
            advice = self.guess(key.text, value, node)
        message = f"{self.expected} has no key {shown(key.text)}{guess}"
        more = "" if self.others is None else ", or a setting that is no map" if self.flat else ", or a setting"
        written = "" if is_null(value) else part_text(value)
        rest = MappingNode(None, None, {name: entry for name, entry in node.entries.items() if name != key.text})
        advice = advice.replace(WRITTEN, written if len(written) <= _LONGEST_MAP else "…").replace(
            OTHERS, part_text(rest)
        )
        reading.problem("CQ006", message, key, advice or f"allowed: {', '.join(known)}{more}")

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
            kinds += SCALARS
        properties: Schema = {
            key.name: {"description": key.help, **_of(key, shared), **_hinted(key.hints)} for key in self.keys.values()
        }
        properties |= {
            key.former: {**properties[key.name], "deprecated": True} for key in self.keys.values() if key.former
        }
        properties |= dict.fromkeys(self.never, False)
        schema: Schema = {
            "type": kinds if len(kinds) > 1 else kinds[0],
            "properties": properties,
            "additionalProperties": self.others.schema(shared) if self.others is not None else False,
        }
        if self.others is not None:
            schema["propertyNames"] = NAME
        if self.short is not None:
            schema["minLength"] = 1
        if self.required:
            schema["required"] = list(self.required)
        if self.one_of:
            former = [old for old, name in self.former.items() if name in self.one_of]
            schema["anyOf"] = [
                {"required": [name], "properties": {name: {"not": {"type": "null"}}}}
                for name in (*self.one_of, *former)
            ]
        return schema | _hinted(self.hints)


def _hinted(parts: tuple[str, ...]) -> Schema:
    return {"allOf": [{"$ref": f"#/$defs/{part}"} for part in parts]} if parts else {}


def _of(key: Key[Any], shared: dict[str, Schema]) -> Schema:
    schema = key.shape.schema(shared)
    return schema if key.required else nullable(schema)


def named(values: Schema) -> Schema:
    """Return the schema of a map from names, which are never empty, to ``values``."""
    return {"type": "object", "propertyNames": NAME, "additionalProperties": values}


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


def _is_bare(key: ScalarNode, value: Node, reading: SourceReading) -> bool:
    """Whether a key of a flow map has neither a value nor a colon."""
    if not (key.plain and isinstance(value, ScalarNode) and value.plain and not value.text):
        return False
    return not reading.rest_of_line(key.line, (key.column or 1) + len(key.text)).lstrip().startswith(":")


def _glued(key: ScalarNode, value: Node, reading: SourceReading, before: str) -> tuple[str, Setting] | None:
    """Return the meaning of a key of a flow map without a colon, as in ``{depth:5}`` and ``{depth=5}``: an unknown setting.

    ``before`` is the setting before it: in ``{deadline: 0,5s}`` a comma stands for a decimal point.
    """
    if not _is_bare(key, value, reading):
        return None  # an empty value states nothing
    line = reading.rest_of_line(key.line, 1)[: (key.column or 1) - 1]
    if (empty := re.search(r"([\w.-]+):\s*,\s*$", line[-_NEAR:])) is not None:
        message = f"{shown(empty[1])} has no value, and {shown(key.text)} behind the comma is a key without one"
        reading.warn("CQ020", message, key, f"write `{empty[1]}: {key.text}`")
        return empty[1], Setting(key.text, reading.place(key), message, reported="CQ020")
    if before and (number := re.search(r"[:\s](\d+),$", line)) and re.match(r"\d", key.text):
        message = f"a comma ends a value, so `{before}` is `{number[1]}` and `{key.text}` a key without a value"
        reading.warn("CQ020", message, key, f"write a decimal point: `{before}: {number[1]}.{key.text}`")
        return before, Setting(f"{number[1]},{key.text}", reading.place(key), message, reported="CQ020")
    name, mark, text = key.text, "", ""
    if (found := re.search("[:=\uff1a]", key.text)) is not None:
        name, mark, text = key.text[: found.start()].strip(), found[0], key.text[found.end() :].strip()
    elif (found := re.fullmatch(r"([\w.-]+)\s+(\S.*)", key.text)) is not None:
        name, text = found[1], found[2]
    other = mark and mark != ":"
    message = f"{shown(key.text)} {f'has `{mark}` in place of a colon' if other else 'is a key without a value'}"
    if mark != ":":  # which every map reports
        reading.warn("CQ020", message, key, f"write `{name}: {text or 'VALUE'}`, with a colon and a blank")
    return name, Setting(text, reading.place(key), message, reported="CQ020")


class SettingsMap(ValueType["Settings"]):
    """A map of settings and nothing else; ``listed`` is the value that a bare name in a list was meant to have."""

    def __init__(
        self, expected: str, shape: ValueType[Setting] = SETTING, *, advice: str = "", listed: str = ""
    ) -> None:
        super().__init__(expected)
        self.listed = listed
        self.shape = shape
        self.advice = advice

    def read(self, node: Node, reading: SourceReading, name: str) -> Settings | None:
        """Read every setting; a refused one is left out."""
        if not isinstance(node, MappingNode):
            advice = self.advice.format(name=name, found=node.text) if isinstance(node, ScalarNode) else ""
            if isinstance(node, SequenceNode):
                advice = self._as_one_map(node, name)
            self.refuse(node, reading, name, _missing_blank(node) or advice or None)
            return None
        read = {
            key.text: self.shape.read(value, reading, key.text)
            for key, value in node.entries.values()
            if not is_null(value)
        }
        entries = zip(node.entries.values(), ("", *node.entries), strict=False)
        glued = dict(filter(None, (_glued(key, value, reading, before) for (key, value), before in entries)))
        return {name: setting for name, setting in read.items() if setting is not None} | glued

    def _as_one_map(self, node: SequenceNode, name: str) -> str:
        """Say how a list of settings, or of their names, is written as a map."""
        parts = [_as_entry(part) for part in node.items]
        shown_value = self.listed or "VALUE"
        return f"write a map: `{name}: {{{', '.join(f'{key}: {value or shown_value}' for key, value in parts)}}}`"

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """Any name, any setting."""
        return named(self.shape.schema(shared))
