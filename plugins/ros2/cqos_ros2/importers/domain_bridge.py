"""Reads configurations of domain_bridge: one node per domain, subscribing in one and publishing in the other.

The bridge waits for publishers in the domain that it bridges from, requests reliability and durability as all of them offer
them, and offers the same in the other domain. What `qos` states is taken instead, on both sides; deadline and lifespan are
infinite unless they are stated or ``auto`` (domain_bridge: domain_bridge, wait_for_graph_events, qos_options).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cqos_core.importers.forms import described
from cqos_core.importers.reading import collector_paused, listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode
from cqos_core.system import PUBLISHER, SUBSCRIBER, Setting
from cqos_ros2.importers.configuration import Configuration, as_integer, stated
from cqos_ros2.policies import FROM_PUBLISHERS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.source import ReadContext, Source
    from cqos_core.importers.tree import Node
    from cqos_core.system import Settings, System

NAME: Final = "domain_bridge"
_WORDS: Final = {
    "history": ("keep_last", "keep_all"),
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
    "liveliness": ("automatic", "manual_by_topic"),
}
_AUTO: Final = "auto"
# What `auto` stands for; liveliness is never taken from publishers.
_DURATIONS: Final = {
    "deadline": FROM_PUBLISHERS,
    "lifespan": FROM_PUBLISHERS,
    "liveliness_lease_duration": "unspecified",
}
_COPIED: Final = ("reliability", "durability")
_COMPRESSED: Final = "domain_bridge/msg/CompressedMsg"
_MODES: Final = ("normal", "compress", "decompress")
_SERVICES: Final = ("services", "actions")


@dataclass(frozen=True, slots=True)
class _Bridge:
    """One topic as it is bridged one way; ``key`` names it in the file."""

    key: ScalarNode
    type: str
    start: int
    end: int
    remap: str
    settings: Settings


def read(source: Source, context: ReadContext) -> System:  # noqa: ARG001 - nothing is included
    """Read a configuration as the endpoints of the nodes ``<name>_<domain>``.

    Raises:
        InputError: it is no YAML, or no configuration of domain_bridge.
    """
    reader = _Reader(source)
    with collector_paused():
        reader.configuration(reader.a_map(reader.document(keep_repeated=True), "configuration"))
    return reader.finish()


class _Reader(Configuration):
    """Reads the topics of one configuration."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self.bridged: dict[tuple[str, str, int, int], ScalarNode] = {}
        self.name = NAME
        self.mode = _MODES[0]

    def configuration(self, entries: MappingNode) -> None:
        """Read what holds for all topics, then each of them."""
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
        for name in _SERVICES:
            others = stated(entries, name)
            if others is not None:
                self.note(
                    "ROS951", f"domain_bridge reads no {shown(name)} from a file: bridge them in a program", others
                )

    def topics(self, node: Node) -> Iterator[tuple[ScalarNode, Node]]:
        """Yield every topic, of which one name may stand several times."""
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
        """Tell why the bridge does not start."""
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
        settings = self.qos(key, entries)
        remap = self.a_text(entries, "remap")
        self.add(_Bridge(key, type_name, start, end, remap, settings))
        if self.a_flag(entries, "bidirectional", otherwise=False):
            self.add(_Bridge(key, type_name, end, start, remap, settings))

    def domain(self, name: str, key: ScalarNode, entries: MappingNode, above: MappingNode) -> int | None:
        """Return a domain of a topic, its own or that of all."""
        holder = entries if stated(entries, name) is not None else above
        domain = self.a_count(holder, name)
        if domain is None and stated(holder, name) is None:
            self.refused(f"topic {shown(key.text)} has no `{name}`", key, f"state `{name}` here or for all topics")
        return domain

    def add(self, bridge: _Bridge) -> None:
        """Add the two endpoints of a topic that is bridged one way."""
        topic = bridge.key.text
        where = bridge.key
        known = self.bridged.setdefault((topic, bridge.type, bridge.start, bridge.end), where)
        if known is not where:
            message = (
                f"topic {shown(topic)} is bridged from domain {bridge.start} to domain {bridge.end} already on line "
                f"{known.line}, so domain_bridge ignores this"
            )
            self.note("ROS951", message, where, "keep one of them")
            return
        sides = (
            (SUBSCRIBER, bridge.start, topic, _COMPRESSED if self.mode == "decompress" else bridge.type),
            (PUBLISHER, bridge.end, bridge.remap or topic, _COMPRESSED if self.mode == "compress" else bridge.type),
        )
        for role, domain, name, type_name in sides:
            own = {"domain": Setting(str(domain), self.place(where))}
            participant = self.participant(f"{self.name}_{domain}", where, own)
            self.endpoint(participant, role, name, where, dict(bridge.settings), type_name=type_name)

    # QoS

    def qos(self, key: ScalarNode, entries: MappingNode) -> Settings:
        """Read what both endpoints of a topic have; what is not stated is taken from the publishers there are."""
        node = stated(entries, "qos")
        stated_qos = self.a_map(node, "qos") if node is not None else MappingNode(key.line, key.column)
        settings: Settings = {}
        if self.a_flag(entries, "wait_for_publisher", otherwise=True):
            settings = {policy: self.setting(key, FROM_PUBLISHERS) for policy in _COPIED}
        for policy in _WORDS:
            self.word(stated_qos, policy, settings)
        depth = stated(stated_qos, "depth")
        number = None if depth is None else as_integer(depth)
        if number is not None and number >= 0 and depth is not None:
            settings["depth"] = self.setting(depth)
        elif depth is not None:
            self.refused(f"{described(depth)} is no depth", depth, "expected a whole number")
        for policy in _DURATIONS:
            self.duration(stated_qos, policy, settings)
        known = (*_WORDS, "depth", *_DURATIONS)
        for name, (own_key, _) in stated_qos.entries.items():
            if name not in known:
                message = f"domain_bridge ignores the key {shown(name)}: it does not know it"
                self.note("ROS951", message, own_key, f"it knows {listed(known, 'and')}")
        return settings

    def word(self, entries: MappingNode, policy: str, settings: Settings) -> None:
        """Read a policy that has a few values."""
        node = stated(entries, policy)
        words = _WORDS[policy]
        if isinstance(node, ScalarNode) and node.text in words:
            settings[policy] = self.setting(node)
        elif node is not None and not (policy == "liveliness" and isinstance(node, ScalarNode) and node.text == _AUTO):
            self.refused(f"{described(node)} is no {policy}", node, f"expected {listed(words)}")

    def duration(self, entries: MappingNode, policy: str, settings: Settings) -> None:
        """Read whole nanoseconds, negative for infinite, or ``auto``."""
        node = stated(entries, policy)
        if node is None:
            return
        number = as_integer(node)
        if number is not None:
            settings[policy] = self.setting(node, "infinite" if number < 0 else f"{number}ns")
        elif isinstance(node, ScalarNode) and node.text == _AUTO:
            settings[policy] = self.setting(node, _DURATIONS[policy])
        else:
            advice = "expected whole nanoseconds, -1 for infinite, or auto"
            self.refused(f"{described(node)} is no {policy}", node, advice)
