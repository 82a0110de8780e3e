"""Finds names in system files: definitions and uses of profiles, topics and participants."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from cqos_core.importers.format_detection import claims_yaml
from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import MappingNode, SequenceNode
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import Place
from cqos_core.model.source import Source
from cqos_lsp.positions import located

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.importers.tree import Node
    from cqos_lsp.cursor import Path

Kind: TypeAlias = Literal["profile", "topic", "service", "action", "participant", "broker", "rule", ""]

MEMBERS: Final[Mapping[str, Kind]] = {
    "profiles": "profile",
    "topics": "topic",
    "participants": "participant",
    "brokers": "broker",
    "severities": "rule",
    "publishes": "topic",
    "subscribes": "topic",
    "serves": "service",
    "calls": "service",
    "action_servers": "action",
    "action_clients": "action",
}
"""The kind of the names that are keys of a map, by the key of the map."""
ENDPOINTS: Final = frozenset(("publishes", "subscribes", "serves", "calls", "action_servers", "action_clients"))
VALUES: Final[Mapping[str, Kind]] = {
    "profile": "profile",
    "topic": "topic",
    "participant": "participant",
    "at": "participant",
    "starts_after": "participant",
    "endpoint": "participant",
    "broker": "broker",
    "rule": "rule",
}
"""The kind of the name that is a value, by its key; ids of endpoints begin with that of their participant."""
_OF_LINKS: Final[Mapping[str, Kind]] = {"participants": "participant", "topics": "topic"}
_DEFINING: Final = frozenset(("profiles", "topics", "participants", "brokers"))
_HEAD: Final = 65_536


@dataclass(frozen=True, slots=True)
class Name:
    """One occurrence of a name.

    Attributes:
        place: of its first character.
        defines: whether it is the key of the definition.
        path: of the key, or of the value.
    """

    kind: Kind
    text: str
    place: Place
    defines: bool
    path: Path


def kind_of_key(path: Path) -> Kind:
    """Return the kind of the names that are keys of the map at a path."""
    if not path or not isinstance(path[-1], str) or (path[0] == "links" and len(path) > 1):
        return ""
    top = path[-1] in _DEFINING or path[-1] == "severities"
    return MEMBERS.get(path[-1], "") if (len(path) == 1) == top else ""


def kind_of_value(path: Path) -> Kind:
    """Return the kind of the name that is the value at a path; list items are like single values."""
    keys = [part for part in path if isinstance(part, str)]
    last = keys[-1] if keys else ""
    above = keys[-2] if len(keys) > 1 else ""
    if above in ENDPOINTS:
        return "profile"
    if path[:1] == ("links",):
        return _OF_LINKS.get(last, "")
    if path[:1] == ("chains",) and last == "steps":
        return "participant"
    return VALUES.get(last, "") if len(keys) > 1 else ""


@lru_cache(maxsize=64)
def names_in(name: str, data: bytes) -> tuple[Name, ...]:
    """Return all names in a system file, in their order; none in other formats."""
    if not claims_yaml(name, data[:_HEAD]):
        return ()
    source = Source(name, data)
    documents = read_tree(SourceReading(source, [], [])).documents
    return tuple(found for document in documents for found in _names(document, (), name))


def _names(node: Node, path: Path, source: str) -> Iterator[Name]:
    if isinstance(node, MappingNode):
        kind = kind_of_key(path)
        for key, value in node.entries.values():
            below = (*path, key.text)
            if kind:
                yield Name(kind, key.text, Place(source, key.line, key.column), path[-1] in _DEFINING, below)
            yield from _names(value, below, source)
    elif isinstance(node, SequenceNode):
        for number, item in enumerate(node.items):
            yield from _names(item, (*path, number), source)
    elif node.text and (kind := kind_of_value(path)):
        yield Name(kind, node.text, Place(source, node.line, node.column), defines=False, path=path)


def names_of(sources: Mapping[str, bytes]) -> list[Name]:
    """Return all names in the system files among some sources."""
    return [found for name, data in sources.items() for found in names_in(name, data)]


def name_at(names: Iterable[Name], sources: Mapping[str, bytes], source: str, line: int, column: int) -> Name | None:
    """Return the name at a one-based line and column."""
    for name in names:
        if name.place.source == source and name.place.line == line:
            found = located(name.place, sources)
            if found is not None and found[2] <= column <= found[2] + found[3]:
                return name
    return None
