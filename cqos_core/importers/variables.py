"""Variables: `${drone}` in a text makes one copy of its object for each name in `instances: {drone: …}`.

A variable that the name of a thing mentions is bound for everything within it; several make every combination.
`$${` stands for the characters `${`.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from itertools import product
from math import prod
from typing import Any, Final, TypeVar

from cqos_core.importers.source_reading import SourceReading, described, did_you_mean, shown
from cqos_core.importers.tree import Node, ScalarNode, SequenceNode, is_null, whole_number
from cqos_core.importers.value_types import TEXT, Schema, ValueType
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import ProfileRef

T = TypeVar("T")

MOST_INSTANCES: Final = 100_000
"""The most participants, endpoints, topics and so on that `instances` may make altogether."""

MOST_CHARACTERS: Final = 100_000_000
"""The most characters of all texts together in which variables are replaced."""

_MENTION: Final = regular_expression(r"\$\$\{|\$\{([^{}$]*)(\}?)")
_LISTED: Final = "starts_after"
"""The one field in which a variable adds items to a list rather than copies of the whole."""


class InstancesType(ValueType[tuple[str, ...]]):
    """The names a variable stands for, or how many there are, numbered from 1."""

    def __init__(self) -> None:
        super().__init__("a list of names, or how many there are")

    def read(self, node: Node, reading: SourceReading, name: str) -> tuple[str, ...] | None:
        """Take every name."""
        if isinstance(node, SequenceNode):
            return self._listed(node, reading, name)
        number = whole_number(node) if isinstance(node, ScalarNode) else None
        if number is None:
            self.refuse(node, reading, name)
            return None
        if not 1 <= number <= MOST_INSTANCES:
            message = f"{shown(name)} must stand for 1 to {MOST_INSTANCES} instances, found {number}"
            reading.problem("CQ016", message, node)
            return None
        return tuple(str(index) for index in range(1, number + 1))

    def _listed(self, node: SequenceNode, reading: SourceReading, name: str) -> tuple[str, ...] | None:
        names: dict[str, None] = {}
        for item in node.items:
            # Replaced text must not end names and lists: no blanks, quotes, brackets or commas.
            text = item.text if isinstance(item, ScalarNode) and not is_null(item) else ""
            if not text or not all(letter.isalnum() or letter in "_.+:/@-" for letter in text):
                message = f"{shown(name)} must list names of letters, digits and _ . + : / @ -, found {described(item)}"
                reading.problem("CQ011", message, item)
            elif text in names:
                reading.problem("CQ012", f"instance {shown(text)} of {shown(name)} is listed twice", item)
            names[text] = None
        if not names:
            reading.problem("CQ009", f"the list at {shown(name)} is empty", node, "list at least one name")
        return tuple(names) or None

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A number or a list of names."""
        names = {"type": "array", "items": TEXT.schema(shared), "minItems": 1, "uniqueItems": True}
        return {"anyOf": [{"type": "integer", "minimum": 1, "maximum": MOST_INSTANCES}, names]}


class TooManyError(Exception):
    """``instances`` would make too many copies; the text names them."""


class Multiplier:
    """Makes the copies.

    ``active`` tells whether any text mentions a variable at all; otherwise every value is returned as it is.
    """

    def __init__(self, instances: Mapping[str, tuple[str, ...]], *, active: bool) -> None:
        self.instances = instances
        self.active = active
        self.things = 0
        self.characters = 0

    def check(self, node: ScalarNode, reading: SourceReading, refused: Container[str]) -> None:
        """Report variables in ``node`` that do not exist or are not closed; ``refused`` ones are reported already."""
        for mention in _MENTION.finditer(node.text):
            if mention[1] is None:
                continue
            where = Place(reading.source.name, node.line, _column(node, mention.start(), reading))
            if not mention[2]:
                message = f"the variable in {shown(node.text[mention.start() :])} is not closed"
                reading.problem("CQ014", message, where, "write `${name}`, or `$${` for the characters themselves")
            elif mention[1] not in self.instances and mention[1] not in refused:
                known = ", ".join(self.instances)
                hint = did_you_mean(mention[1], self.instances)
                advice = f"instances: {known}" if known else "there are no `instances:`; `$${` stands for `${` itself"
                reading.problem("CQ014", f"there is no variable {shown(mention[0])}{hint}", where, advice)

    def mentioned(self, *values: object) -> frozenset[str]:
        """Return the variables that any text within ``values`` mentions."""
        if not self.active:
            return frozenset()
        return frozenset(name for value in values for text in _texts(value) for name in self._names(text))

    def _names(self, text: str) -> Iterator[str]:
        return (mention[1] for mention in _MENTION.finditer(text) if mention[2] and mention[1] in self.instances)

    def bindings(self, names: Iterable[str]) -> Iterator[dict[str, str]]:
        """Yield every combination of values of the variables ``names``; one empty combination without variables.

        Raises:
            TooManyError: before anything is made.
        """
        chosen = [name for name in self.instances if name in set(names)]
        if chosen:
            self.things += prod(len(self.instances[name]) for name in chosen)
            if self.things > MOST_INSTANCES:
                raise TooManyError(f"more than {MOST_INSTANCES} copies")
        for combination in product(*(self.instances[name] for name in chosen)):
            yield dict(zip(chosen, combination, strict=True))

    def fill(self, value: T, binding: Mapping[str, str]) -> T:
        """Return ``value`` with its variables replaced; parts that mention none are shared, not copied.

        Raises:
            TooManyError: when the texts get too long altogether.
        """
        return _fill(value, binding, self) if self.active else value

    def text(self, text: str, binding: Mapping[str, str]) -> str:
        """Return one text with its variables replaced."""
        if "${" not in text:
            return text
        filled = _MENTION.sub(lambda found: "${" if found[1] is None else binding.get(found[1], found[0]), text)
        self.charge(len(filled))
        return filled

    def items(self, texts: tuple[str, ...], binding: Mapping[str, str]) -> tuple[str, ...]:
        """Return the texts, each once for every combination of the variables that are not bound yet."""
        return tuple(
            self.text(text, {**binding, **more})
            for text in texts
            for more in self.bindings(self.mentioned(text) - set(binding))
        )

    def charge(self, characters: int) -> None:
        """Count what is made."""
        self.characters += characters
        if self.characters > MOST_CHARACTERS:
            raise TooManyError(f"more than {MOST_CHARACTERS} characters")


def _column(node: ScalarNode, offset: int, reading: SourceReading) -> int | None:
    """Return the column of a character within a scalar, or where the scalar begins if that is not certain."""
    if node.column is None or node.line is None:
        return node.column
    line = reading.lines.line(node.line)
    begin = node.column - 1 + offset
    exact = next((at for at in (begin, begin + 1) if line[at : at + 2] == "${"), node.column - 1)
    return exact + 1


def _texts(value: object) -> Iterator[str]:
    """Yield every text in which a variable may stand."""
    if isinstance(value, str):
        if "${" in value:
            yield value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _texts(key)
            yield from _texts(item)
    elif isinstance(value, (tuple, list)):
        for item in value:
            yield from _texts(item)
    elif is_dataclass(value) and not isinstance(value, Place):
        for each in fields(value):
            if each.name != _LISTED:
                yield from _texts(getattr(value, each.name))


def _fill(value: Any, binding: Mapping[str, str], made: Multiplier) -> Any:
    if isinstance(value, str):
        return made.text(value, binding)
    if isinstance(value, Setting):
        why = value.unknown if isinstance(value.unknown, str) else ""
        if "${" not in value.text + why:
            return value
        return Setting(made.text(value.text, binding), value.place, made.text(why, binding))
    if isinstance(value, ProfileRef):
        return value if "${" not in value.name else replace(value, name=made.text(value.name, binding))
    if isinstance(value, dict):
        if not any(True for _ in _texts(value)):
            return value
        made.charge(len(value))
        return {_fill(key, binding, made): _fill(item, binding, made) for key, item in value.items()}
    if isinstance(value, tuple):
        return tuple(_fill(item, binding, made) for item in value)
    if is_dataclass(value) and not isinstance(value, (Place, type)):
        filled = {
            each.name: made.items(part, binding) if each.name == _LISTED else _fill(part, binding, made)
            for each in fields(value)
            if (part := getattr(value, each.name))
        }
        return replace(value, **filled)
    return value


def variables(names: Iterable[str]) -> str:
    """Return names as a text mentions them: `${drone}`, `${arm}`."""
    return ", ".join(f"`${{{name}}}`" for name in sorted(names))
