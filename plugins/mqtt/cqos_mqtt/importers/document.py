"""What the importers of YAML and JSON documents share: the document, its references, clients and endpoints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.forms import described
from cqos_core.importers.reading import Reading, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, flag, flow_text, is_null
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.problems import InputError
from cqos_core.system import PUBLISHER, Broker, Endpoint, Participant, Place, ProfileRef, Setting, System
from cqos_mqtt.filters import has_wildcards
from cqos_mqtt.importers.codes import note
from cqos_mqtt.names import PATTERN

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.importers.source import Source
    from cqos_core.importers.tree import Node
    from cqos_core.problems import Problem
    from cqos_core.system import ImportNote, Role, Settings

REF: Final = "$ref"


class Document(Reading):
    """One document that is being read.

    Attributes:
        system: what it states, as far as it is read.
        root: the document.
    """

    def __init__(self, source: Source) -> None:
        super().__init__(source, [], [])
        self.system = System(protocol="mqtt", notes=self.notes, sources={source.name: source.data})
        self.root: Node = MappingNode(1, 1)
        self._numbers: dict[str, int] = {}
        self._told: set[tuple[str, int | None, int | None]] = set()

    # The document

    def load(self) -> Node:
        """Return the root of the one document in the file.

        Raises:
            InputError: the file is neither YAML nor JSON, or is empty.
        """
        documents = read_tree(self).documents
        if not documents and not self.problems:
            self.problem("CQ001", "there is nothing in this file", Place(self.source.name, 1, 1))
        for more in documents[1:]:
            self.problem("CQ009", "another document begins here; only one is read", more)
        if self.problems:
            raise InputError(self.problems)
        self.root = documents[0]
        return self.root

    def finish(self) -> System:
        """Return the system.

        Raises:
            InputError: there were problems.
        """
        if self.problems:
            raise InputError(sorted(self.problems, key=_position))
        self.notes.sort(key=_position)
        return self.system

    def note(self, code: str, message: str, where: Node | Place, advice: str | None = None) -> None:
        """Say something that is no reason to stop, once for each place."""
        place = where if isinstance(where, Place) else self.place(where)
        key = (message, place.line, place.column)
        if key not in self._told:
            self._told.add(key)
            self.notes.append(note(code, message, place, advice))

    # What is expected

    def a_map(self, node: Node | None, name: str) -> MappingNode:
        """Return the map that ``node`` is or leads to, else tell that it is none and return an empty one."""
        found = self.followed(node)
        if isinstance(found, MappingNode):
            return found
        if found is not None and not is_null(found):
            self._refuse(found, name, "a map")
        return MappingNode(None, None) if found is None else MappingNode(found.line, found.column)

    def a_list(self, node: Node | None, name: str) -> list[Node]:
        """Return the items of the list that ``node`` is or leads to, else tell that it is none."""
        found = self.followed(node)
        if isinstance(found, SequenceNode):
            return found.items
        if found is not None and not is_null(found):
            self._refuse(found, name, "a list")
        return []

    def a_text(self, entries: MappingNode, name: str) -> str:
        """Return the text of a key, empty where it states none; tell a value of another kind."""
        node = stated(entries, name)
        if node is None or isinstance(node, ScalarNode):
            return "" if node is None else node.text
        self._refuse(node, name, "a text")
        return ""

    def _refuse(self, node: Node, name: str, expected: str) -> None:
        self.problem("CQ009", f"{shown(name)} must be {expected}, found {described(node)}", node)

    def setting(self, node: Node, text: str | None = None) -> Setting:
        """Return a value with its place; ``text`` stands for what is written."""
        return Setting(flow_text(node) if text is None else text, self.place(node))

    # References

    def followed(self, node: Node | None) -> Node | None:
        """Follow a `$ref` to what it leads to in the document; None where it leads to nothing, which is told."""
        trail: list[str] = []
        while isinstance(node, MappingNode) and (reference := stated(node, REF)) is not None:
            if not isinstance(reference, ScalarNode):
                self._refuse(reference, REF, "a text")
                return None
            target = reference.text
            if target in trail:
                circle = " → ".join([*trail[trail.index(target) :], target])
                self.note("MQTT902", f"references lead in a circle: {circle}", reference)
                return None
            trail.append(target)
            node = self.pointed(target)
            if node is None:
                why = "leads out of the document" if not target.startswith("#") else "leads to nothing"
                self.note("MQTT901", f"reference {shown(target)} {why}", reference)
        return node

    def pointed(self, pointer: str) -> Node | None:
        """Return what a JSON pointer of the form ``#/a/b`` leads to."""
        if not pointer.startswith("#/"):
            return self.root if pointer == "#" else None
        node: Node | None = self.root
        for part in pointer[2:].split("/"):
            key = _unescaped(part)
            if isinstance(node, SequenceNode):
                node = node.items[int(key)] if key.isdecimal() and int(key) < len(node.items) else None
            else:
                node = node.entries.get(key, (None, None))[1] if isinstance(node, MappingNode) else None
            if node is None:
                return None
        return node

    # What is found

    def broker(self, name: str, where: Node) -> Setting:
        """Add a broker by its address, once; return it as what a client is connected to."""
        self.system.brokers.setdefault(name, Broker(name, "mqtt", place=self.place(where)))
        return Setting(name, self.place(where))

    def client(self, name: str, where: Node, settings: Settings, *, external: bool = False) -> str:
        """Add a client, once; return its id."""
        if name not in self.system.participants:
            place = self.place(where)
            self.system.participants[name] = Participant(name, "mqtt", settings, external=external, place=place)
        return name

    def endpoint(
        self,
        client: str,
        role: Role,
        topic: str,
        where: Node,
        settings: Settings,
        *,
        presets: Iterable[str] = (),
        needs: Settings | None = None,
        label: str | None = None,
    ) -> None:
        """Add an endpoint; one that publishes to a name with a wildcard publishes to several topics."""
        identifier = f"{client}/{role}/{topic}"
        number = self._numbers[identifier] = self._numbers.get(identifier, 0) + 1
        place = self.place(where)
        self.system.endpoints.append(
            Endpoint(
                identifier if number == 1 else f"{identifier}#{number}",
                role,
                topic,
                client,
                settings,
                tuple(ProfileRef(name, place) for name in presets),
                needs=needs or {},
                kind=PATTERN if role == PUBLISHER and has_wildcards(topic) else "message",
                label=label or None,
                place=place,
            )
        )


def levels(topic: str) -> str:
    """Return a topic with each level that has a parameter, ``{id}``, as a wildcard."""
    return "/".join("+" if "{" in level and "}" in level else level for level in topic.split("/"))


def stated(entries: MappingNode, name: str) -> Node | None:
    """Return the value of a key, None where it is not there or states nothing."""
    _, value = entries.entries.get(name, (None, None))
    return None if value is None or is_null(value) else value


def truth(node: Node | None, *, otherwise: bool = False) -> bool:
    """Return a flag, also one that is written as a text."""
    if not isinstance(node, ScalarNode):
        return otherwise
    value = flag(node)
    return node.text.lower() == "true" if value is None else value


def entries_of(node: MappingNode) -> Iterator[tuple[ScalarNode, Node]]:
    """Yield keys and values in the order of the document, without extensions."""
    yield from (entry for name, entry in node.entries.items() if not name.startswith("x-"))


def _unescaped(part: str) -> str:
    from urllib.parse import unquote

    return unquote(part).replace("~1", "/").replace("~0", "~")


def _position(said: Problem | ImportNote) -> tuple[int, int]:
    place = said.place
    return (0, 0) if place is None else (place.line or 0, place.column or 0)
