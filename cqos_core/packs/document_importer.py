"""Base of importers of YAML and JSON documents of other programs: tables of fields, and parts of an expected kind."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from cqos_core.importers.source_reading import SourceReading, described, listed, shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, SequenceNode, flow_text, is_null, stated
from cqos_core.importers.yaml_tree import Repeated, read_json5, read_tree
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place, Setting, Settings
from cqos_core.packs.file_importer import FileImporter
from cqos_core.packs.qos_keys import looks_like_qos

if TYPE_CHECKING:
    from cqos_core.model.system import ImportNote, System


class Field(NamedTuple):
    """A key that states a policy.

    Attributes:
        take: returns the value in the words of system files, None for one that the owner of the format refuses.
        expected: what may stand there, for messages.
    """

    policy: str
    take: Callable[[Node], str | None]
    expected: str = ""


def word_field(policy: str, *words: str) -> Field:
    """Return a field with one of a few words, exactly as spelt."""

    def take(node: Node) -> str | None:
        return node.text if isinstance(node, ScalarNode) and node.text in words else None

    return Field(policy, take, f"expected {listed(words)}")


class DocumentImporter(FileImporter):
    """Reads one YAML or JSON document of another program."""

    def finish(self) -> System:
        """Return the system, with its notes in the order of the document.

        Raises:
            InputError: there were problems.
        """
        self.problems.sort(key=position)
        self.notes.sort(key=position)
        return super().finish()

    def document(self, *, repeated: Repeated = "refuse", json5: bool = False) -> Node:
        """Return the root of the one document in the file; see `read_tree` for ``repeated``.

        Raises:
            InputError: the file is no YAML, or no JSON5 where it has to be that, or is empty.
        """
        root = only_document(self, repeated=repeated, json5=json5)
        if root is None or self.problems:
            raise InputError(self.problems)
        return root

    def followed(self, node: Node | None) -> Node | None:
        """Return the target of a reference, or the node itself; formats with references override it."""
        return node

    def a_map(self, node: Node | None, name: str) -> MappingNode:
        """Return the map that ``node`` is, else report that it is none and return an empty one."""
        found = self.followed(node)
        if isinstance(found, MappingNode):
            return found
        self._refuse_other(found, name, "a map")
        return MappingNode(None, None) if found is None else MappingNode(found.line, found.column)

    def a_list(self, node: Node | None, name: str) -> list[Node]:
        """Return the items of the list that ``node`` is, else report that it is none."""
        found = self.followed(node)
        if isinstance(found, SequenceNode):
            return found.items
        self._refuse_other(found, name, "a list")
        return []

    def _refuse_other(self, node: Node | None, name: str, expected: str) -> None:
        if node is not None and not is_null(node):
            self.refuse(node, name, expected)

    def maps(self, node: Node | None, name: str) -> Iterator[MappingNode]:
        """Yield the maps of a list, and report what else is in it."""
        for item in self.a_list(node, name):
            if isinstance(item, MappingNode):
                yield item
            else:
                self.refuse(item, name, "a list of maps")

    def a_text(self, entries: MappingNode, name: str) -> str:
        """Return the text of a key, empty where it states none; report a value of another kind."""
        node = stated(entries, name)
        if node is None or isinstance(node, ScalarNode):
            return "" if node is None else node.text
        self.refuse(node, name, "a text")
        return ""

    def refuse(self, node: Node, name: str, expected: str) -> None:
        """Report a value of another kind, once for each place."""
        message = f"{shown(name)} must be {expected}, found {described(node)}"
        if self.is_new(message, node):
            self.problem("CQ009", message, node)

    def policies(
        self, entries: MappingNode, fields: Mapping[str, Field], refused: Callable[[str, Node, Field], None]
    ) -> Settings:
        """Return the policies that a map states; ``refused`` reports a value that its field does not take."""
        settings: Settings = {}
        for key, field in fields.items():
            node = stated(entries, key)
            text = None if node is None else field.take(node)
            if node is not None and text is None:
                refused(key, node, field)
            elif node is not None:
                settings[field.policy] = self.setting(node, text)
        return settings

    def misspelt(
        self, entries: MappingNode, names: Iterable[str], known: Container[str] = (), *, cause: str, effect: str = ""
    ) -> list[tuple[str, Setting]]:
        """Report keys that look like one of ``names`` and are neither these nor ``known``.

        Returns the name that each may stand for, and what then is not known.
        """
        read = tuple(names)
        found = []
        for name, (key, value) in entries.entries.items():
            meant = None if name in read or name in known else looks_like_qos(name, read)
            if meant is not None:
                said = f"{cause} {shown(name)}"
                self.warn_once("CQ040", f"{said}, so {effect or 'it is not read'}", key, f"did you mean `{meant}`?")
                found.append((meant, Setting(flow_text(value), self.place(key), unknown=said, reported="CQ040")))
        return found

    def warn_once(self, code: str, message: str, where: Node, advice: str) -> None:
        """Warn with a code of the core, once for each place."""
        if self.is_new(message, where):
            self.warn(code, message, where, advice)


def only_document(reading: SourceReading, *, repeated: Repeated = "refuse", json5: bool = False) -> Node | None:
    """Return the root of the one document in a file, None where the file is empty; faults are reported."""
    before = len(reading.problems)
    documents = (read_json5(reading) if json5 else read_tree(reading, repeated=repeated)).documents
    if not documents and len(reading.problems) == before:
        reading.problem("CQ001", "there is nothing in this file", Place(reading.source.name, 1, 1))
    for more in documents[1:]:
        reading.problem("CQ009", "another document begins here; only one is read", more)
    return documents[0] if documents else None


def position(reported: Problem | ImportNote) -> tuple[str, int, int]:
    """Return the sort key of a problem or note: its place."""
    place = reported.place
    return ("", 0, 0) if place is None else (place.source, place.line or 0, place.column or 0)
