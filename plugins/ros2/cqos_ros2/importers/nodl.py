"""Reads NoDL documents, version 2 (`*.nodl.yaml`): the interface of one node, named like the file (ros-tooling/nodl 0.3.1, nodl_schema).

QoS is obligatory for topics. Zero stands for a duration that is not limited. Parameters decide nothing, so they are passed over.
"""

from __future__ import annotations

from pathlib import PurePath
from typing import Final

from cqos_core.importers.tree import MappingNode, Node, ScalarNode, stated, whole_number
from cqos_core.model.settings import EVERY_OTHER, Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Role
from cqos_core.packs.document_importer import Field, word_field
from cqos_ros2.importers.configuration import Configuration

ENDING: Final = ".nodl.yaml"
VERSION: Final = 2
SECTIONS: Final[dict[str, tuple[str, Role]]] = {
    "publishers": ("message", PUBLISHER),
    "subscriptions": ("message", SUBSCRIBER),
    "service_servers": ("service_server", SUBSCRIBER),
    "service_clients": ("service_client", PUBLISHER),
    "action_servers": ("action_server", SUBSCRIBER),
    "action_clients": ("action_client", PUBLISHER),
}


def _nanoseconds(node: Node) -> str | None:
    number = whole_number(node) if isinstance(node, ScalarNode) else None
    if number is None or number < 0:
        return None
    return f"{number}ns" if number else "infinite"


def _count(node: Node) -> str | None:
    number = whole_number(node) if isinstance(node, ScalarNode) else None
    return None if number is None or number < 1 else str(number)


def _word(policy: str, *words: str) -> Field:
    field = word_field(policy, *words)
    return field._replace(take=lambda node: None if field.take(node) is None else str(field.take(node)).lower())


_TIME: Final = "expected a whole number of nanoseconds"
FIELDS: Final = {
    "history": _word("history", "KEEP_LAST", "KEEP_ALL", "SYSTEM_DEFAULT"),
    "depth": Field("depth", _count, "expected a whole number above 0"),
    "reliability": _word("reliability", "RELIABLE", "BEST_EFFORT", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
    "durability": _word("durability", "TRANSIENT_LOCAL", "VOLATILE", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
    "deadline_ns": Field("deadline", _nanoseconds, _TIME),
    "lifespan_ns": Field("lifespan", _nanoseconds, _TIME),
    "liveliness": _word("liveliness", "AUTOMATIC", "MANUAL_BY_TOPIC", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
    "liveliness_lease_duration_ns": Field("liveliness_lease_duration", _nanoseconds, _TIME),
}


class _Reader(Configuration):
    """Reads a document as one participant."""

    def run(self) -> None:
        """Read every section."""
        root = self.a_map(self.document(), "document")
        version = stated(root, "nodl_version")
        if not isinstance(version, ScalarNode) or whole_number(version) != VERSION:
            self.note("ROS956", f"only version {VERSION} of NoDL is read", version or root)
            return
        name = PurePath(self.source.name).name
        participant = self.participant(name.removesuffix(ENDING).partition(".")[0], root)
        for key, (kind, role) in SECTIONS.items():
            for entry in self.maps(stated(root, key), key):
                self.entry(entry, participant, kind, role)
        included = stated(root, "include")
        if included is not None:
            self.note("ROS956", "documents that it includes are not read, so it may have more endpoints", included)

    def entry(self, entry: MappingNode, participant: str, kind: str, role: Role) -> None:
        """Add one endpoint."""
        topic, node = self.a_text(entry, "name"), stated(entry, "name")
        if node is None or not topic:
            self.note("ROS956", "an entry without `name` is left out", entry)
            return
        qos = stated(entry, "qos")
        settings: Settings = {} if qos is None else self.qos(self.a_map(qos, "qos"))
        if qos is None and kind == "message":
            settings = {EVERY_OTHER: Setting("", self.place(node), "the document states no `qos`")}
        type_name = self.a_text(entry, "type")
        self.system.endpoints.append(
            self.endpoint(participant, role, topic, node, settings, type_name=type_name, kind=kind)
        )

    def qos(self, entries: MappingNode) -> Settings:
        """Return the policies of a profile; the one that has no allowed value is not known."""
        wrong: Settings = {}

        def refused(key: str, node: Node, field: Field) -> None:
            self.note("ROS956", f"`{key}` has no allowed value: {field.expected}", node)
            wrong[field.policy] = Setting("", self.place(node), f"`{key}` has no allowed value")

        found = self.policies(entries, FIELDS, refused)
        for meant, unknown in self.misspelt(entries, FIELDS, cause="NoDL has no key"):
            wrong[FIELDS[meant].policy] = unknown
        return {**found, **wrong}


read = _Reader.load
