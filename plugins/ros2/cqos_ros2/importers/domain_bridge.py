"""Reads configurations of domain_bridge: one node per domain, subscribing in one and publishing in the other.

The bridge waits for publishers in the domain that it bridges from. It requests the reliability and durability that all of them
offer, and offers the same in the other domain. Settings in `qos` win, on both sides; deadline and lifespan are
infinite unless they are stated or ``auto``. Its command line may disable the wait: it then has the defaults of
ROS 2 (domain_bridge: domain_bridge, wait_for_graph_events, qos_options, parse_domain_bridge_yaml_config).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import described, listed, read_switches, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, stated
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Bridge, Route
from cqos_core.packs.document_importer import Field, word_field
from cqos_ros2.importers.configuration import Configuration, as_count, as_integer
from cqos_ros2.policies import FROM_PUBLISHERS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.tree import Node
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Endpoint, Role

NAME: Final = "domain_bridge"
SWITCHES: Final = {"wait_for_publisher": ("true", "false")}
_OF_TOPICS: Final = ("type", "from_domain", "to_domain", "remap", "qos", "bidirectional", "reversed")
_OF_COMMAND_LINE: Final = ("wait_for_publisher", "wait_for_subscription", "auto_remove")
_AUTO: Final = "auto"
_LEASE: Final = "liveliness_lease_duration"
_COPIED: Final = ("reliability", "durability")
_COMPRESSED: Final = "domain_bridge/msg/CompressedMsg"
_MODES: Final = ("normal", "compress", "decompress")
_SERVICES: Final = ("services", "actions")


@dataclass(frozen=True, slots=True)
class _Way:
    """One topic as it is bridged one way; ``key`` names it in the file."""

    key: ScalarNode
    type: str
    start: int
    end: int
    remap: str
    settings: Settings


class _Reader(Configuration):
    """Reads a configuration as a bridge between the nodes ``<name>_<domain>``."""

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.waits = read_switches("domain_bridge", context, SWITCHES).get("wait_for_publisher") != "false"
        self.routes: list[Route] = []
        self.bridged: dict[tuple[str, str, int, int], ScalarNode] = {}
        self.name = NAME
        self.mode = _MODES[0]

    def run(self) -> None:
        """Read what holds for all topics, then each of them."""
        entries = self.a_map(self.document(repeated="keep"), "configuration")
        self.once(entries)
        self.name = self.a_text(entries, "name") or NAME
        mode = stated(entries, "mode")
        if mode is not None:
            self.mode = self.a_text(entries, "mode")
            if self.mode not in _MODES:
                self.refused(f"there is no mode {shown(self.mode)}", mode, f"expected {listed(_MODES)}")
        topics = stated(entries, "topics")
        for key, node in self.topics(topics) if topics is not None else ():
            self.topic(key, self.a_map(node, key.text), entries)
        if self.routes:
            self.system.bridges[self.name] = Bridge(self.name, tuple(self.routes), place=self.place(entries))
        for name in _SERVICES:
            others = stated(entries, name)
            if others is not None:
                self.note(
                    "ROS951", f"domain_bridge reads no {shown(name)} from a file: bridge them in a program", others
                )

    def topics(self, node: Node) -> Iterator[tuple[ScalarNode, Node]]:
        """Yield every topic; a name may come several times."""
        if isinstance(node, MappingNode):
            yield from sorted([*node.entries.values(), *(node.repeated or ())], key=lambda entry: entry[0].line or 0)
            return
        if not isinstance(node, SequenceNode):
            self.refuse(node, "topics", "a map")
            return
        self.refused("`topics` is a list", node, "write `topics:` as a map from each topic's name to its entries")
        for item in node.items:
            yield from list(self.a_map(item, "topics").entries.values())[:1]

    def once(self, entries: MappingNode) -> None:
        """Refuse keys that stand twice, but for names of topics."""
        waiting: list[tuple[str, Node]] = [("", entries)]
        seen: set[int] = set()
        while waiting:
            above, node = waiting.pop()
            if not isinstance(node, MappingNode) or id(node) in seen:
                continue
            seen.add(id(node))
            repeated = node.repeated or []
            if above != "topics":
                for key, _ in repeated:
                    self.problem("CQ005", f"key {shown(key.text)} stands twice in one map", key, "keep one of them")
            waiting += [(key.text, value) for key, value in (*node.entries.values(), *repeated)]

    def refused(self, message: str, where: Node, advice: str) -> None:
        """Report why the bridge does not start."""
        self.note("ROS950", f"domain_bridge does not start with this: {message}", where, advice)

    def topic(self, key: ScalarNode, entries: MappingNode, above: MappingNode) -> None:
        """Add what is bridged under one name."""
        domains = [self.domain(name, key, entries, above) for name in ("from_domain", "to_domain")]
        type_name = self.a_text(entries, "type")
        if not type_name:
            self.refused(f"topic {shown(key.text)} has no `type`", key, "for instance `type: std_msgs/msg/String`")
        start, end = domains
        if start is None or end is None:
            return
        if self.a_flag(entries, "reversed", otherwise=False):
            start, end = end, start
        if start == end:
            message = f"topic {shown(key.text)} is not bridged: it would stay in domain {start}"
            self.note("ROS950", message, key, "state two different domains")
            return
        self.unread(entries)
        settings = self.qos(key, entries)
        remap = self.a_text(entries, "remap")
        self.add(_Way(key, type_name, start, end, remap, settings))
        if self.a_flag(entries, "bidirectional", otherwise=False):
            self.add(_Way(key, type_name, end, start, remap, settings))

    def unread(self, entries: MappingNode) -> None:
        """Report which keys of a topic the bridge does not look at."""
        for name, (own_key, _) in entries.entries.items():
            if name in _OF_COMMAND_LINE:
                advice = f"give it `--{name.replace('_', '-')}` on the command line"
                if name in SWITCHES:
                    advice += f", and C-QoS `--switch {NAME}.{name}=false` where it is not to wait"
                self.note("ROS951", f"domain_bridge reads no {shown(name)} from a file", own_key, advice)
            elif name not in _OF_TOPICS:
                message = f"domain_bridge ignores the key {shown(name)} of a topic: it does not know it"
                self.note("ROS951", message, own_key, f"it knows {listed(_OF_TOPICS, 'and')}")

    def domain(self, name: str, key: ScalarNode, entries: MappingNode, above: MappingNode) -> int | None:
        """Return a domain of a topic, its own or that of all."""
        holder = entries if stated(entries, name) is not None else above
        domain = self.a_count(holder, name)
        if domain is None and stated(holder, name) is None:
            self.refused(f"topic {shown(key.text)} has no `{name}`", key, f"state `{name}` here or for all topics")
        return domain

    def add(self, way: _Way) -> None:
        """Add the route of a topic that is bridged one way."""
        topic = way.key.text
        where = way.key
        known = self.bridged.setdefault((topic, way.type, way.start, way.end), where)
        if known is not where:
            message = (
                f"topic {shown(topic)} is bridged from domain {way.start} to domain {way.end} already on line "
                f"{known.line}, so domain_bridge ignores this"
            )
            self.note("ROS951", message, where, "keep one of them")
            return
        source = _COMPRESSED if self.mode == "decompress" else way.type
        target = _COMPRESSED if self.mode == "compress" else way.type
        self.routes.append(
            Route(
                self.end(SUBSCRIBER, way.start, topic, source, way),
                self.end(PUBLISHER, way.end, way.remap or topic, target, way),
                self.place(where),
            )
        )

    def end(self, role: Role, domain: int, topic: str, type_name: str, way: _Way) -> Endpoint:
        """Return the endpoint of a way in one domain."""
        # Its subscriptions ignore what their own node publishes.
        own = {"domain": Setting(str(domain), self.place(way.key)), "bridge": Setting(self.name)}
        if topic == "~" or topic.startswith("~/"):  # stands for the name of the bridge, not for that of its node
            topic = f"/{self.name}{topic[1:]}"
        participant = self.participant(f"{self.name}_{domain}", way.key, own)
        return self.endpoint(participant, role, topic, way.key, dict(way.settings), type_name=type_name)

    # QoS

    def qos(self, key: ScalarNode, entries: MappingNode) -> Settings:
        """Read what both endpoints of a topic have; what is not stated is taken from the publishers there are."""
        node = stated(entries, "qos")
        stated_qos = self.a_map(node, "qos") if node is not None else MappingNode(key.line, key.column)
        settings: Settings = {}
        if self.waits:
            settings = {policy: self.setting(key, FROM_PUBLISHERS) for policy in _COPIED}
        settings |= self.policies(stated_qos, _FIELDS, self.no_such)
        self.lease(stated_qos, settings)
        for name, (own_key, _) in stated_qos.entries.items():
            if name not in _FIELDS:
                message = f"domain_bridge ignores the key {shown(name)}: it does not know it"
                self.note("ROS951", message, own_key, f"it knows {listed(_FIELDS, 'and')}")
        return settings

    def no_such(self, key: str, node: Node, field: Field) -> None:
        """Report a value that keeps the bridge from starting."""
        if key != "liveliness" or not _is_auto(node):
            self.refused(f"{described(node)} is no {key}", node, field.expected)

    def lease(self, entries: MappingNode, settings: Settings) -> None:
        """Take a lease for what the bridge takes it for (domain_bridge 0.5.0, parse_qos_options)."""
        if (node := stated(entries, _LEASE)) is None or _LEASE not in settings or as_integer(node) is None:
            return
        settings["lifespan"] = settings.pop(_LEASE)
        message = f"domain_bridge takes {shown(_LEASE)} for the lifespan, and its lease stays infinite"
        self.note("ROS951", message, node, "state `lifespan` if that is meant, and no lease")


def _is_auto(node: Node) -> bool:
    return isinstance(node, ScalarNode) and node.text == _AUTO


def _duration(policy: str, auto: str) -> Field:
    """Return a field with whole nanoseconds, negative for infinite, or ``auto``."""

    def take(node: Node) -> str | None:
        number = as_integer(node)
        if number is None:
            return auto if _is_auto(node) else None
        return "infinite" if number < 0 else f"{number}ns"

    return Field(policy, take, "expected whole nanoseconds, -1 for infinite, or auto")


_FIELDS: Final = {
    field.policy: field
    for field in (
        word_field("history", "keep_last", "keep_all"),
        word_field("reliability", "reliable", "best_effort"),
        word_field("durability", "volatile", "transient_local"),
        word_field("liveliness", "automatic", "manual_by_topic", "system_default"),
        Field("depth", as_count, "expected a whole number"),
        _duration("deadline", FROM_PUBLISHERS),
        _duration("lifespan", FROM_PUBLISHERS),
        _duration(_LEASE, "unspecified"),  # it is never taken from publishers
    )
}
read = _Reader.load
