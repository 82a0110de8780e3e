"""What the importers of configuration files of ROS 2 tools share: endpoints, flags of YAML 1.1, names filled in at launch."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, flag, stated, whole_number
from cqos_core.model.settings import Setting
from cqos_core.model.system import Endpoint, Overlay, ProfileRef, Role, endpoint_id
from cqos_core.packs.document_importer import DocumentImporter
from cqos_core.packs.file_importer import FileImporter
from cqos_ros2.importers.codes import CODES

if TYPE_CHECKING:
    from cqos_core.model.settings import Place, Settings

LARGEST: int = 2**63 - 1
"""The largest integer that ROS 2 parameters and YAML readers of ROS 2 tools take."""


class RosFile(FileImporter):
    """One file of ROS 2 that is being read."""

    protocol = "ros2"
    codes = {info.code: info for info in CODES}  # noqa: RUF012 - a table

    def endpoint(
        self,
        participant: str,
        role: Role,
        topic: str,
        where: Node | Place,
        settings: Settings,
        *,
        type_name: str = "",
        kind: str = "message",
        profiles: Iterable[ProfileRef] = (),
        label: str | None = None,
        external: bool = False,
    ) -> Endpoint:
        """Return an endpoint with an id that no other has."""
        return Endpoint(
            id=self.numbered(endpoint_id(participant, role if kind == "message" else kind, topic)),
            role=role,
            topic=topic,
            participant=participant,
            settings=settings,
            profiles=tuple(profiles),
            type=type_name or None,
            kind=kind,
            label=label,
            external=external,
            place=self.place(where),
        )


class Configuration(RosFile, DocumentImporter):
    """One configuration file of a ROS 2 tool that is being read."""

    def a_flag(self, entries: MappingNode, name: str, otherwise: bool) -> bool:  # noqa: FBT001 - the default
        """Return the flag of a key, as YAML 1.1 writes flags; report a value of another kind."""
        node = stated(entries, name)
        value = None if node is None else as_flag(node)
        if node is not None and value is None:
            self.refuse(node, name, "true or false")
        return otherwise if value is None else value

    def a_count(self, entries: MappingNode, name: str) -> int | None:
        """Return the whole number of a key, None where it states none; report a value of another kind."""
        node = stated(entries, name)
        number = None if node is None else as_integer(node)
        if node is not None and number is None:
            self.refuse(node, name, "a whole number")
        return number

    def bridge_node(self, name: str, where: Node) -> str:
        """Add the node of a bridge, which takes back nothing that it publishes, also where a snapshot shows it; return its id."""
        if name not in self.system.participants:
            settings: Settings = {"bridge": Setting(name, self.place(where), derived=True)}
            self.system.overlays.append(
                Overlay(
                    "own publications of a bridge",
                    settings,
                    participant=f"/{name}",
                    protocol=self.protocol,
                    place=self.place(where),
                )
            )
        return self.participant(name, where)

    def is_filled_in(self, name: str, where: Node) -> bool:
        """Whether a name has a placeholder, ``<robot>`` or ``$(var robot)``, which a launch file replaces; report it."""
        if "<" not in name and "$(" not in name:
            return False
        self.note("ROS943", f"the name {shown(name)} is filled in at launch", where, "give the file that is left then")
        return True


_FLAGS: Final = {
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


def as_count(node: Node) -> str | None:
    """Return the integer of 64 bits that a plain scalar is, as text; None where it is negative."""
    number = as_integer(node)
    return None if number is None or number < 0 else str(number)
