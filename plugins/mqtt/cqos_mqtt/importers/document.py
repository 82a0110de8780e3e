"""What the importers of YAML and JSON documents share: the document, its references, clients and endpoints."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import unquote

from cqos_core.importers.source_reading import SourceReading, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, flag, flow_text, stated, walk
from cqos_core.model.problems import InputError
from cqos_core.model.settings import EVERY_OTHER, Place, Setting
from cqos_core.model.system import PUBLISHER, Broker, Endpoint, ProfileRef
from cqos_core.packs.document_importer import DocumentImporter, only_document
from cqos_mqtt.filters import has_wildcards
from cqos_mqtt.importers.codes import CODES
from cqos_mqtt.names import PATTERN

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator

    from cqos_core.importers.tree import Node
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import Opener, ReadContext, Source
    from cqos_core.model.system import Role, Room

REF: Final = "$ref"
_MOST_FILES: Final = 1000
_MOST_DIGITS: Final = 9
_MOST_STEPS: Final = 20
_NOT_A_FILE: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:|//")


class _File(NamedTuple):
    """A file that is read: its path, and what stands in it."""

    path: str
    root: Node


class Document(DocumentImporter):
    """One document that is being read, with the parts of other files that it refers to.

    Attributes:
        root: the document.
    """

    protocol = "mqtt"
    reports_once = True
    codes = {info.code: info for info in CODES}  # noqa: RUF012 - a table
    opener: Opener | None = None
    """Opens the files that references lead to; None where they lead to none."""

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.root: Node = MappingNode(1, 1)
        self._files: dict[str, _File] = {}
        # By the file that names it and the name: the file, or why it is missing.
        self._by_name: dict[tuple[str, str], _File | str] = {}
        # Of nodes that stand in other files, by identity: the name of the file.
        self._homes: dict[int, str] = {}
        # Of nodes with a reference, by identity: what it leads to.
        self._followed: dict[int, Node | None] = {}

    def run(self) -> None:
        """Read the one document in the file, and all that it states."""
        self.root = self.document()
        self._files[_same(self.source.name)] = _File(self.source.name, self.root)
        self.read_root()

    def read_root(self) -> None:
        """Fill the system from the root."""
        raise NotImplementedError

    def place(self, node: Node | Place) -> Place:
        """Return where ``node`` begins, in whichever file it stands."""
        if isinstance(node, Place):
            return node
        return Place(self._homes.get(id(node), self.source.name), node.line, node.column)

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
        if self.opener is None:
            return "it leads out of the document"
        try:
            source = self.opener(unquote(name), home)
        except InputError as error:
            return "; ".join(problem.message for problem in error.problems)
        known = self._files.get(_same(source.name))
        if known is not None:
            return known
        if len(self._files) >= _MOST_FILES:
            return f"more than {_MOST_FILES} files are referred to, which is refused"
        root = only_document(SourceReading(source, self.problems, self.notes))
        if root is None:
            return f"{shown(source.name)} cannot be read"
        if not self.stands_alone(root):
            self.system.sources[source.name] = source.data
        self._homes.update((id(node), source.name) for node in walk([root]))
        return self._files.setdefault(_same(source.name), _File(source.name, root))

    def stands_alone(self, root: Node) -> bool:  # noqa: ARG002 - for formats in which there is more to say
        """Whether another file is also a document of its own, rather than a part of those that refer to it."""
        return False

    # What is not modelled

    def leave_open(
        self, entries: MappingNode, known: Container[str], whose: str, settings: Settings, begin: str = ""
    ) -> None:
        """Report the fields, of those that begin so, that no table has; nothing else is then known of what they are stated for.

        A field that looks like one that is read is reported as a typing error, by `misspelt`.
        """
        for name, (key, value) in entries.entries.items():
            if name in known or not name.startswith(begin) or name.startswith("x-") or name == REF:
                continue
            cause = f"{whose} {shown(name)}"
            self.note("MQTT948", f"{cause} is not modelled", key)
            settings[EVERY_OTHER] = Setting(
                flow_text(value), self.place(key), unknown=f"{cause} is not modelled", reported="MQTT948"
            )

    # What is found

    def broker(self, name: str, where: Node) -> Setting:
        """Add a broker by its address, once; return it as what a client is connected to."""
        self.system.brokers.setdefault(name, Broker(name, "mqtt", place=self.place(where)))
        return Setting(name, self.place(where))

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
        place = self.place(where)
        self.system.endpoints.append(
            Endpoint(
                id=self.numbered(f"{client}/{role}/{topic}"),
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
        key = unquote(part).replace("~1", "/").replace("~0", "~")
        if isinstance(node, SequenceNode):
            # No list is so long that its numbers have more digits.
            number = int(key) if key.isdecimal() and len(key) <= _MOST_DIGITS else len(node.items)
            node = node.items[number] if number < len(node.items) else None
        else:
            node = node.entries.get(key, (None, None))[1] if isinstance(node, MappingNode) else None
        if node is None:
            return None
    return node


def _same(name: str) -> str:
    """Return what is equal for different ways to write one path."""
    return os.path.normpath(name)
