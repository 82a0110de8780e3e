"""What the importers of configuration files share: one YAML document, endpoints with ids, notes by their codes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.importers.forms import described
from cqos_core.importers.reading import Reading, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, flag, flow_text, is_null, whole_number
from cqos_core.importers.yaml_tree import read_json5, read_tree
from cqos_core.model.problems import InputError
from cqos_core.model.system import Endpoint, Participant, Place, ProfileRef, Setting, System, endpoint_id
from cqos_ros2.importers.codes import note

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.importers.source import Source
    from cqos_core.importers.tree import Node
    from cqos_core.importers.yaml_tree import Repeated
    from cqos_core.model.problems import Problem
    from cqos_core.model.system import ImportNote, Role, Settings

LARGEST: int = 2**63 - 1
"""The largest integer that ROS 2 parameters and YAML readers of ROS 2 tools take."""


class Configuration(Reading):
    """One configuration file of a ROS 2 tool that is being read.

    Attributes:
        system: what it states, as far as it is read.
    """

    def __init__(self, source: Source) -> None:
        super().__init__(source, [], [])
        self.system = System(protocol="ros2", notes=self.notes, sources={source.name: source.data})
        self._numbers: dict[str, int] = {}

    # The document

    def document(self, *, repeated: Repeated = "refuse", json5: bool = False) -> Node:
        """Return the root of the one document in the file; see `read_tree` for ``repeated``.

        Raises:
            InputError: the file is no YAML, or no JSON5 where it has to be that, or is empty.
        """
        tree = read_json5(self) if json5 else read_tree(self, repeated=repeated)
        documents = tree.documents
        if not documents and not self.problems:
            self.problem("CQ001", "there is nothing in this file", Place(self.source.name, 1, 1))
        for more in documents[1:]:
            self.problem("CQ009", "another document begins here; only one is read", more)
        if self.problems:
            raise InputError(self.problems)
        return documents[0]

    def finish(self) -> System:
        """Return the system.

        Raises:
            InputError: there were problems.
        """
        if self.problems:
            raise InputError(sorted(self.problems, key=_position))
        self.system.notes.sort(key=_position)
        return self.system

    # What is expected

    def a_map(self, node: Node, name: str) -> MappingNode:
        """Return ``node`` if it is a map, else tell that and return an empty one."""
        if isinstance(node, MappingNode):
            return node
        if not is_null(node):
            self.refuse(node, name, "a map")
        return MappingNode(node.line, node.column)

    def a_list(self, node: Node, name: str) -> SequenceNode:
        """Return ``node`` if it is a list, else tell that and return an empty one."""
        if isinstance(node, SequenceNode):
            return node
        if not is_null(node):
            self.refuse(node, name, "a list")
        return SequenceNode(node.line, node.column)

    def maps(self, node: Node | None, name: str) -> Iterator[MappingNode]:
        """Yield the maps of a list, and tell what else is in it; None is an empty list."""
        for item in () if node is None else self.a_list(node, name).items:
            if isinstance(item, MappingNode):
                yield item
            else:
                self.refuse(item, name, "a list of maps")

    def refuse(self, node: Node, name: str, expected: str) -> None:
        """Tell that a value is of another kind."""
        self.problem("CQ009", f"{shown(name)} must be {expected}, found {described(node)}", node)

    def a_text(self, entries: MappingNode, name: str) -> str:
        """Return the text of a key, empty where it states none; tell a value of another kind."""
        node = stated(entries, name)
        if node is None:
            return ""
        if isinstance(node, ScalarNode):
            return node.text
        self.refuse(node, name, "a text")
        return ""

    def a_flag(self, entries: MappingNode, name: str, otherwise: bool) -> bool:  # noqa: FBT001 - the default
        """Return the flag of a key, as YAML 1.1 writes flags; tell a value of another kind."""
        node = stated(entries, name)
        if node is None:
            return otherwise
        value = as_flag(node)
        if value is None:
            self.refuse(node, name, "true or false")
        return otherwise if value is None else value

    def a_count(self, entries: MappingNode, name: str) -> int | None:
        """Return the whole number of a key, None where it states none; tell a value of another kind."""
        node = stated(entries, name)
        if node is None:
            return None
        number = as_integer(node)
        if number is None:
            self.refuse(node, name, "a whole number")
        return number

    def is_filled_in(self, name: str, where: Node) -> bool:
        """Whether a name has a placeholder, ``<robot>`` or ``$(var robot)``, for which a launch file puts in something; tell it."""
        if "<" not in name and "$(" not in name:
            return False
        self.note("ROS943", f"the name {shown(name)} is filled in at launch", where, "give the file that is left then")
        return True

    # What is found

    def note(self, code: str, message: str, where: Node | Place, advice: str | None = None) -> None:
        """Say something that is no reason to stop, with the severity of its code."""
        place = where if isinstance(where, Place) else self.place(where)
        self.notes.append(note(code, message, place, advice=advice))

    def setting(self, node: Node, text: str | None = None) -> Setting:
        """Return a value with its place; ``text`` stands for what is written."""
        written = flow_text(node)
        return Setting(written if text is None else text, self.place(node), derived=text not in {None, written})

    def participant(self, name: str, where: Node, settings: Settings | None = None) -> str:
        """Add a node of ROS 2, once; return its id."""
        if name not in self.system.participants:
            place = self.place(where)
            self.system.participants[name] = Participant(name, "ros2", settings or {}, place=place)
        return name

    def endpoint(
        self,
        participant: str,
        role: Role,
        topic: str,
        where: Node,
        settings: Settings,
        *,
        presets: Iterable[ProfileRef] = (),
        type_name: str = "",
        kind: str = "message",
        label: str | None = None,
        implied: bool = False,
    ) -> None:
        """Add an endpoint; one that is only ``implied`` by the file needs no partner."""
        made = self.made(participant, role, topic, where, settings, type_name=type_name, kind=kind)
        made.profiles, made.label, made.external = tuple(presets), label, implied
        self.system.endpoints.append(made)

    def made(
        self,
        participant: str,
        role: Role,
        topic: str,
        where: Node,
        settings: Settings,
        *,
        type_name: str = "",
        kind: str = "message",
    ) -> Endpoint:
        """Return an endpoint with an id that no other has."""
        identifier = endpoint_id(participant, role if kind == "message" else kind, topic)
        number = self._numbers[identifier] = self._numbers.get(identifier, 0) + 1
        return Endpoint(
            id=identifier if number == 1 else f"{identifier}#{number}",
            role=role,
            topic=topic,
            participant=participant,
            settings=settings,
            type=type_name or None,
            kind=kind,
            place=self.place(where),
        )


def _position(said: Problem | ImportNote) -> tuple[int, int]:
    place = said.place
    return (0, 0) if place is None else (place.line or 0, place.column or 0)


def stated(entries: MappingNode, name: str) -> Node | None:
    """Return the value of a key, None where it is not there or states nothing."""
    _, value = entries.entries.get(name, (None, None))
    return None if value is None or is_null(value) else value


_FLAGS = {
    **dict.fromkeys(("yes", "on", "y", "true"), True),
    **dict.fromkeys(("no", "off", "n", "false"), False),
}


def as_flag(node: Node) -> bool | None:
    """Return the flag that a plain scalar is in YAML 1.1, which the readers of ROS 2 follow."""
    if not isinstance(node, ScalarNode) or not node.plain:
        return None
    value = flag(node)
    return _FLAGS.get(node.text.lower()) if value is None else value


def as_integer(node: Node) -> int | None:
    """Return the integer of 64 bits that a plain scalar is."""
    number = whole_number(node) if isinstance(node, ScalarNode) else None
    return number if number is not None and -LARGEST <= number <= LARGEST else None
