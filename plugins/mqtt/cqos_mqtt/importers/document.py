"""What the importers of YAML and JSON documents share: the document, its references, clients and endpoints."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import unquote

from cqos_core.importers.forms import described
from cqos_core.importers.qos_keys import looks_like_qos
from cqos_core.importers.reading import Reading, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, flag, flow_text, is_null
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.problems import InputError
from cqos_core.model.system import PUBLISHER, Broker, Endpoint, Participant, Place, ProfileRef, Setting, System
from cqos_mqtt.filters import has_wildcards
from cqos_mqtt.importers.codes import note
from cqos_mqtt.names import PATTERN

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator

    from cqos_core.importers.source import Opener, Source
    from cqos_core.importers.tree import Node
    from cqos_core.model.problems import Problem
    from cqos_core.model.system import ImportNote, Role, Room, Settings

REF: Final = "$ref"
_MOST_FILES: Final = 1000
_MOST_DIGITS: Final = 9
_MOST_STEPS: Final = 20
_NOT_A_FILE: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:|//")


class _File(NamedTuple):
    """A file that is read: its path, and what stands in it."""

    path: str
    root: Node


class Document(Reading):
    """One document that is being read, with the parts of other files that it refers to.

    Attributes:
        system: what it states, as far as it is read.
        root: the document.
    """

    def __init__(self, source: Source, opener: Opener | None = None) -> None:
        """Read ``source``; references to other files are followed where there is an ``opener`` of files."""
        super().__init__(source, [], [])
        self.system = System(protocol="mqtt", notes=self.notes, sources={source.name: source.data})
        self.root: Node = MappingNode(1, 1)
        self._opener = opener
        self._files: dict[str, _File] = {}
        # By the file that names it and the name: the file, or why it is missing.
        self._by_name: dict[tuple[str, str], _File | str] = {}
        # Of nodes that stand in other files, by identity: the name of the file.
        self._homes: dict[int, str] = {}
        # Of nodes with a reference, by identity: what it leads to.
        self._followed: dict[int, Node | None] = {}
        self._numbers: dict[str, int] = {}
        self._reported: set[tuple[str, Place]] = set()

    # The document

    def load(self) -> Node:
        """Return the root of the one document in the file.

        Raises:
            InputError: the file is neither YAML nor JSON, or is empty.
        """
        root = _only_document(self)
        if root is None or self.problems:
            raise InputError(self.problems)
        self.root = root
        self._files[_same(self.source.name)] = _File(self.source.name, root)
        return root

    def finish(self) -> System:
        """Return the system.

        Raises:
            InputError: there were problems.
        """
        if self.problems:
            raise InputError(sorted(self.problems, key=_position))
        self.notes.sort(key=_position)
        return self.system

    def place(self, node: Node) -> Place:
        """Return where ``node`` begins, in whichever file it stands."""
        return Place(self._homes.get(id(node), self.source.name), node.line, node.column)

    def note(self, code: str, message: str, where: Node | Place, advice: str | None = None) -> None:
        """Say something that is no reason to stop, once for each place."""
        place = where if isinstance(where, Place) else self.place(where)
        key = (message, place)
        if key not in self._reported:
            self._reported.add(key)
            self.notes.append(note(code, message, place, advice))

    def warn_once(self, code: str, message: str, where: Node, advice: str) -> None:
        """Warn with a code of the core, once for each place."""
        key = (message, self.place(where))
        if key not in self._reported:
            self._reported.add(key)
            self.warn(code, message, where, advice)

    # What is expected

    def a_map(self, node: Node | None, name: str) -> MappingNode:
        """Return the map that ``node`` is or leads to, else tell that it is none and return an empty one."""
        found = self.followed(node)
        if isinstance(found, MappingNode):
            return found
        if found is not None and not is_null(found):
            self.refuse(found, name, "a map")
        return MappingNode(None, None) if found is None else MappingNode(found.line, found.column)

    def a_list(self, node: Node | None, name: str) -> list[Node]:
        """Return the items of the list that ``node`` is or leads to, else tell that it is none."""
        found = self.followed(node)
        if isinstance(found, SequenceNode):
            return found.items
        if found is not None and not is_null(found):
            self.refuse(found, name, "a list")
        return []

    def a_text(self, entries: MappingNode, name: str) -> str:
        """Return the text of a key, empty where it states none; tell a value of another kind."""
        node = stated(entries, name)
        if node is None or isinstance(node, ScalarNode):
            return "" if node is None else node.text
        self.refuse(node, name, "a text")
        return ""

    def refuse(self, node: Node, name: str, expected: str) -> None:
        """Tell that something else is expected, once for each place: several may refer to it."""
        message = f"{shown(name)} must be {expected}, found {described(node)}"
        key = (message, self.place(node))
        if key not in self._reported:
            self._reported.add(key)
            self.problem("CQ009", message, node)

    def setting(self, node: Node, text: str | None = None) -> Setting:
        """Return a value with its place; ``text`` stands for what is written."""
        written = flow_text(node)
        return Setting(written if text is None else text, self.place(node), derived=text not in {None, written})

    def misspelt(
        self, entries: MappingNode, names: Iterable[str], known: Container[str] = (), *, cause: str
    ) -> Iterator[tuple[str, Setting]]:
        """Report keys that look like one of ``names`` and are neither these nor ``known``.

        Yields the name that each may stand for, and what then is not known.
        """
        read = tuple(names)
        for name, (key, value) in entries.entries.items():
            meant = None if name in read or name in known else looks_like_qos(name, read)
            if meant is None:
                continue
            place = self.place(key)
            self.warn_once("CQ040", f"{cause} {shown(name)}, so it is not read", key, f"did you mean `{meant}`?")
            yield meant, Setting(flow_text(value), place, unknown=f"{cause} {shown(name)}", reported="CQ040")

    # References

    def followed(self, node: Node | None) -> Node | None:
        """Follow a `$ref` to its target; report a missing target and return None."""
        if not isinstance(node, MappingNode) or stated(node, REF) is None:
            return node
        if id(node) not in self._followed:
            passed: list[int] = []
            found = self._end_of(node, passed)
            self._followed.update(dict.fromkeys(passed, found))
        return self._followed[id(node)]

    def _end_of(self, node: Node | None, passed: list[int]) -> Node | None:
        """Follow references one by one; ``passed`` gets the identities of all nodes that lead to the same."""
        trail: dict[str, None] = {}
        while isinstance(node, MappingNode) and (reference := stated(node, REF)) is not None:
            if id(node) in self._followed:
                return self._followed[id(node)]
            passed.append(id(node))
            if not isinstance(reference, ScalarNode):
                self.refuse(reference, REF, "a text")
                return None
            name, _, pointer = reference.text.partition("#")
            file = self.file(name, reference)
            if file is None:
                return None
            target = f"#{pointer}" if file.root is self.root else f"{file.path}#{pointer}"
            if target in trail:
                steps = list(trail)
                circle = " → ".join([*steps[steps.index(target) :], target])
                self.note("MQTT902", f"references lead in a circle: {circle}", reference)
                return None
            trail[target] = None
            node = pointed(file.root, pointer)
            if node is None:
                self.note("MQTT901", f"reference {shown(reference.text)} leads to nothing", reference)
        return node

    def at_hand(self, node: Node | None) -> Node | None:
        """Return what ``node`` leads to in its own file, None where that is nothing; for what matters little if it is missing."""
        for _ in range(_MOST_STEPS):
            reference = stated(node, REF) if isinstance(node, MappingNode) else None
            if not isinstance(reference, ScalarNode):
                return node
            name, _, pointer = reference.text.partition("#")
            node = None if name else pointed(self._files[_same(self.place(reference).source)].root, pointer)
        return None

    def file(self, name: str, reference: ScalarNode) -> _File | None:
        """Return the file of a reference, relative to its own file; report a missing one and return None."""
        home = self.place(reference).source
        if not name:
            return self._files[_same(home)]
        if _NOT_A_FILE.match(name):
            self.note(
                "MQTT906", f"reference {shown(reference.text)} leads to the network, so it is not known", reference
            )
            return None
        key = (home, name)
        if key not in self._by_name:
            self._by_name[key] = self.opened(name, home)
        found = self._by_name[key]
        if isinstance(found, str):
            self.note("MQTT901", f"reference {shown(reference.text)} cannot be followed: {found}", reference)
            return None
        return found

    def opened(self, name: str, home: str) -> _File | str:
        """Open a file that ``home`` names, once however it is named; return why, where it cannot be."""
        if self._opener is None:
            return "it leads out of the document"
        try:
            source = self._opener(unquote(name), home)
        except InputError as error:
            return "; ".join(problem.message for problem in error.problems)
        known = self._files.get(_same(source.name))
        if known is not None:
            return known
        if len(self._files) >= _MOST_FILES:
            return f"more than {_MOST_FILES} files are referred to, which is refused"
        root = _only_document(Reading(source, self.problems, self.notes))
        if root is None:
            return f"{shown(source.name)} cannot be read"
        if not self.stands_alone(root):
            self.system.sources[source.name] = source.data
        self._homes.update((id(node), source.name) for node in everything(root))
        return self._files.setdefault(_same(source.name), _File(source.name, root))

    def stands_alone(self, root: Node) -> bool:  # noqa: ARG002 - for formats in which there is more to say
        """Whether another file is also a document of its own, rather than a part of those that refer to it."""
        return False

    # What is found

    def broker(self, name: str, where: Node) -> Setting:
        """Add a broker by its address, once; return it as what a client is connected to."""
        self.system.brokers.setdefault(name, Broker(name, "mqtt", place=self.place(where)))
        return Setting(name, self.place(where))

    def client(
        self, name: str, where: Node, settings: Settings, *, external: bool = False, room: Room | None = None
    ) -> str:
        """Add a client, once; return its id."""
        if name not in self.system.participants:
            place = self.place(where)
            self.system.participants[name] = Participant(
                name, "mqtt", settings, external=external, place=place, room=room
            )
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
        one_of: str | None = None,
        guessed: bool = False,
        room: Room | None = None,
    ) -> None:
        """Add an endpoint; one that publishes to a name with a wildcard publishes to several topics.

        Of the endpoints that stand for one, as ``one_of`` names it, any may be the one that there is. The topic may be
        ``guessed``.
        """
        identifier = f"{client}/{role}/{topic}"
        number = self._numbers[identifier] = self._numbers.get(identifier, 0) + 1
        place = self.place(where)
        self.system.endpoints.append(
            Endpoint(
                id=identifier if number == 1 else f"{identifier}#{number}",
                role=role,
                topic=topic,
                participant=client,
                settings=settings,
                profiles=tuple(ProfileRef(name, place) for name in presets),
                needs=needs or {},
                kind=PATTERN if role == PUBLISHER and has_wildcards(topic) else "message",
                label=label or None,
                template=one_of,
                alternative=one_of is not None,
                topic_is_guess=guessed,
                place=place,
                room=room,
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


def pointed(root: Node, pointer: str) -> Node | None:
    """Return what a JSON pointer of the form ``/a/b`` leads to; one that is empty leads to all of it."""
    if not pointer.startswith("/"):
        return None if pointer else root
    node: Node | None = root
    for part in pointer[1:].split("/"):
        key = _unescaped(part)
        if isinstance(node, SequenceNode):
            # No list is so long that its numbers have more digits.
            number = int(key) if key.isdecimal() and len(key) <= _MOST_DIGITS else len(node.items)
            node = node.items[number] if number < len(node.items) else None
        else:
            node = node.entries.get(key, (None, None))[1] if isinstance(node, MappingNode) else None
        if node is None:
            return None
    return node


def _only_document(reading: Reading) -> Node | None:
    """Return the root of the one document in a file; report mistakes, and return None without a document."""
    before = len(reading.problems)
    documents = read_tree(reading).documents
    if not documents and len(reading.problems) == before:
        reading.problem("CQ001", "there is nothing in this file", Place(reading.source.name, 1, 1))
    for more in documents[1:]:
        reading.problem("CQ009", "another document begins here; only one is read", more)
    return documents[0] if documents else None


def everything(root: Node) -> Iterator[Node]:
    """Yield all nodes of a tree, keys too."""
    waiting, seen = [root], {id(root)}
    while waiting:
        node = waiting.pop()
        yield node
        below: Iterable[Node] = ()
        if isinstance(node, SequenceNode):
            below = node.items
        elif isinstance(node, MappingNode):
            below = (part for pair in node.entries.values() for part in pair)
        for each in below:
            if id(each) not in seen:
                seen.add(id(each))
                waiting.append(each)


def _same(name: str) -> str:
    """Return what is equal for different ways to write one path."""
    return os.path.normpath(name)


def _unescaped(part: str) -> str:
    return unquote(part).replace("~1", "/").replace("~0", "~")


def _position(said: Problem | ImportNote) -> tuple[str, int, int]:
    place = said.place
    return ("", 0, 0) if place is None else (place.source, place.line or 0, place.column or 0)
