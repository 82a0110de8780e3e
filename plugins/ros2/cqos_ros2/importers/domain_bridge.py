"""Reads configurations of domain_bridge: one node per domain, subscribing in one and publishing in the other.

The bridge waits for publishers in the domain that it bridges from. It requests the reliability and durability that all of them
offer, and offers the same in the other domain. Settings in `qos` win, on both sides; deadline and lifespan are
infinite unless they are stated or ``auto``. Its command line may disable the wait: it then has the defaults of
ROS 2 (domain_bridge: domain_bridge, wait_for_graph_events, qos_options, parse_domain_bridge_yaml_config).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cqos_core.importers.forms import described
from cqos_core.importers.reading import collector_paused, listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Bridge, Route, Setting
from cqos_ros2.importers.configuration import Configuration, as_integer, stated
from cqos_ros2.importers.switches import read_switches
from cqos_ros2.policies import FROM_PUBLISHERS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.source import ReadContext, Source
    from cqos_core.importers.tree import Node
    from cqos_core.model.system import Endpoint, Role, Settings, System

NAME: Final = "domain_bridge"
SWITCHES: Final = {"wait_for_publisher": ("true", "false")}
_OF_TOPICS: Final = ("type", "from_domain", "to_domain", "remap", "qos", "bidirectional", "reversed")
_OF_COMMAND_LINE: Final = ("wait_for_publisher", "wait_for_subscription", "auto_remove")
_WORDS: Final = {
    "history": ("keep_last", "keep_all"),
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
    "liveliness": ("automatic", "manual_by_topic", "system_default"),
}
_AUTO: Final = "auto"
# What `auto` stands for; liveliness is never taken from publishers.
_LEASE: Final = "liveliness_lease_duration"
_DURATIONS: Final = {"deadline": FROM_PUBLISHERS, "lifespan": FROM_PUBLISHERS, _LEASE: "unspecified"}
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


def read(source: Source, context: ReadContext) -> System:
    """Read a configuration as a bridge between the nodes ``<name>_<domain>``.

    Raises:
        InputError: it is no YAML, or no configuration of domain_bridge; or there is no such switch.
    """
    waits = read_switches("domain_bridge", context, SWITCHES).get("wait_for_publisher") != "false"
    reader = _Reader(source, waits=waits)
    with collector_paused():
        reader.configuration(reader.a_map(reader.document(repeated="keep"), "configuration"))
    return reader.finish()


class _Reader(Configuration):
    """Reads the topics of one configuration."""

    def __init__(self, source: Source, *, waits: bool) -> None:
        super().__init__(source)
        self.waits = waits
        self.routes: list[Route] = []
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
        self.unread(entries)
        settings = self.qos(key, entries)
        remap = self.a_text(entries, "remap")
        self.add(_Way(key, type_name, start, end, remap, settings))
        if self.a_flag(entries, "bidirectional", otherwise=False):
            self.add(_Way(key, type_name, end, start, remap, settings))

    def unread(self, entries: MappingNode) -> None:
        """Tell which keys of a topic the bridge does not look at."""
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
        return self.made(participant, role, topic, way.key, dict(way.settings), type_name=type_name)

    # QoS

    def qos(self, key: ScalarNode, entries: MappingNode) -> Settings:
        """Read what both endpoints of a topic have; what is not stated is taken from the publishers there are."""
        node = stated(entries, "qos")
        stated_qos = self.a_map(node, "qos") if node is not None else MappingNode(key.line, key.column)
        settings: Settings = {}
        if self.waits:
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
        self.lease(stated_qos, settings)
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

    def lease(self, entries: MappingNode, settings: Settings) -> None:
        """Take a lease for what the bridge takes it for (domain_bridge 0.5.0, parse_qos_options)."""
        if (node := stated(entries, _LEASE)) is None or _LEASE not in settings or as_integer(node) is None:
            return
        settings["lifespan"] = settings.pop(_LEASE)
        message = f"domain_bridge takes {shown(_LEASE)} for the lifespan, and its lease stays infinite"
        self.note("ROS951", message, node, "state `lifespan` if that is meant, and no lease")
