"""Reads the parameters of mqtt_client, the bridge between ROS 2 and MQTT (ika-rwth-aachen/mqtt_client, for ROS 2).

Each bridged topic is a route: from a ROS 2 subscription to an MQTT publication, or the other way round. What the file leaves
out is as mqtt_client has it by default: QoS 0, not retained, a clean session, histories of depth 1; towards MQTT it copies
reliability and durability from the publishers that it finds. Unless a topic is `primitive`, the type of its messages goes
over a topic of its own, which is always retained.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cqos_core.importers.source_reading import shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, stated
from cqos_core.model.settings import Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Bridge, Endpoint, Participant, Role, Route
from cqos_mqtt.importers.document import Document, truth

NAME: Final = "mqtt_client"
PARAMETERS: Final = "ros__parameters"
TYPES: Final = "mqtt_client/ros_msg_type/"
_TO_MQTT: Final = ("ros2mqtt", "ros_topics", "mqtt_topic")
_TO_ROS: Final = ("mqtt2ros", "mqtt_topics", "ros_topic")
_COPIED: Final = {"reliability": "from_publishers", "durability": "from_publishers"}
_SYSTEM: Final = {"reliability": "system_default", "durability": "system_default"}
_AUTO: Final = "auto"
_WILL: Final = {"topic": "topic", "message": "payload", "qos": "qos", "retained": "retain"}


class _Reader(Document):
    """Reads parameters as bridges between a ROS 2 node and an MQTT client."""

    def read_root(self) -> None:
        """Read each node that has parameters of mqtt_client."""
        self.system.protocol = None
        for name, node in self.with_parameters("", self.a_map(self.root, "parameters")):
            bridge = self.under(node, "bridge")
            if bridge.entries:
                self.bridge(name, node, bridge)

    def with_parameters(self, above: str, entries: MappingNode) -> Iterator[tuple[str, MappingNode]]:
        """Yield nodes by name; a pattern stands for the node as it is called by default."""
        for name, (_, value) in entries.entries.items():
            if name == PARAMETERS:
                last = above.rpartition("/")[2]
                yield (NAME if not last or "*" in last else last), self.a_map(value, name)
            elif isinstance(value, MappingNode):
                yield from self.with_parameters(f"{above}/{name.strip('/')}", value)

    def under(self, entries: MappingNode, *names: str) -> MappingNode:
        """Return what stands under a name, whether the parameters are nested or joined by dots."""
        found = entries
        for name in names:
            nested = self.a_map(stated(found, name), name)
            joined = {
                key.removeprefix(f"{name}."): entry
                for key, entry in found.entries.items()
                if key.startswith(f"{name}.")
            }
            merged = MappingNode(nested.line or found.line, nested.column or found.column)
            merged.entries.update({**joined, **nested.entries})
            found = merged
        return found

    def bridge(self, name: str, node: MappingNode, entries: MappingNode) -> None:
        """Read one bridge."""
        other = f"{name}/mqtt"
        self.system.participants[name] = Participant(name, "ros2", place=self.place(node))
        self.participant(other, node, self.connection(node))
        routes: list[Route] = []
        for direction, listed, target in (_TO_MQTT, _TO_ROS):
            own = self.under(entries, direction)
            for topic, key, about in self.bridged(own, listed):
                renamed = stated(about, target)
                if not isinstance(renamed, ScalarNode):
                    message = (
                        f"{shown(topic)} is listed in `{listed}`, but has no `{target}`: mqtt_client does not bridge it"
                    )
                    self.note("MQTT960", message, key, f"state `{direction}: {{{topic}: {{{target}: …}}}}`")
                elif direction == _TO_MQTT[0]:
                    routes.append(self.to_mqtt(name, other, topic, key, renamed, about))
                else:
                    routes.append(self.to_ros(name, other, topic, key, renamed, about))
        self.system.bridges[name] = Bridge(name, tuple(routes), place=self.place(entries))

    def bridged(self, entries: MappingNode, listed: str) -> Iterator[tuple[str, Node, MappingNode]]:
        """Yield the topics that are listed, each with what is stated of it."""
        for item in self.a_list(stated(entries, listed), listed):
            if isinstance(item, ScalarNode):
                yield item.text, item, self.under(entries, item.text)

    def connection(self, node: MappingNode) -> Settings:
        """Read where and how the MQTT side connects."""
        broker, client = self.under(node, "broker"), self.under(node, "client")
        host = self.a_text(broker, "host") or "localhost"
        port = self.a_text(broker, "port") or "1883"
        where = stated(broker, "host") or node
        settings: Settings = {
            "protocol_version": Setting("3.1.1"),
            "broker": self.broker(f"{host}:{port}", where),
            "clean_start": self.given(client, "clean_session", "true"),
            "keep_alive": self.given(client, "keep_alive_interval", "60"),
        }
        if self.a_text(client, "id"):
            settings["client_id"] = self.given(client, "id", "")
        will = self.under(client, "last_will")
        if self.a_text(will, "topic"):
            settings |= {
                f"will.{field}": self.given(will, name, "") for name, field in _WILL.items() if stated(will, name)
            }
        return settings

    def given(self, entries: MappingNode, name: str, otherwise: str) -> Setting:
        """Return what is stated under a name, else what mqtt_client takes."""
        node = stated(entries, name)
        return Setting(otherwise) if node is None else self.setting(node)

    def to_mqtt(self, name: str, other: str, topic: str, key: Node, renamed: ScalarNode, about: MappingNode) -> Route:
        """Read a topic that goes from ROS 2 to MQTT."""
        ros, mqtt = self.under(about, "advanced", "ros"), self.under(about, "advanced", "mqtt")
        subscription = self.ros_settings(ros, _COPIED)
        publication: Settings = {
            "qos": self.given(mqtt, "qos", "0"),
            "retain": self.given(mqtt, "retained", "false"),
        }
        if not truth(stated(about, "primitive")):
            types = {**publication, "retain": Setting("true", self.place(renamed))}
            self.endpoint(other, PUBLISHER, f"{TYPES}{renamed.text}", renamed, types, label="type of messages")
        kind = self.a_text(about, "ros_type") or None
        source = self.side(name, SUBSCRIBER, topic, key, subscription, kind)
        return Route(source, self.side(other, PUBLISHER, renamed.text, renamed, publication), self.place(key))

    def to_ros(self, name: str, other: str, topic: str, key: Node, renamed: ScalarNode, about: MappingNode) -> Route:
        """Read a topic that goes from MQTT to ROS 2."""
        ros, mqtt = self.under(about, "advanced", "ros"), self.under(about, "advanced", "mqtt")
        if (latched := stated(ros, "latched")) is not None and truth(latched):
            message = f"mqtt_client ignores `latched` of {shown(topic)} in ROS 2"
            self.note("MQTT961", message, latched, "state `qos: {durability: transient_local}` instead")
        subscription: Settings = {"qos": self.given(mqtt, "qos", "0")}
        kind = self.a_text(about, "ros_type") or None
        if not truth(stated(about, "primitive")) and kind is None:
            self.endpoint(other, SUBSCRIBER, f"{TYPES}{topic}", key, dict(subscription), label="type of messages")
        publication = self.ros_settings(ros, _SYSTEM)
        source = self.side(other, SUBSCRIBER, topic, key, subscription)
        return Route(source, self.side(name, PUBLISHER, renamed.text, renamed, publication, kind), self.place(key))

    def ros_settings(self, ros: MappingNode, otherwise: dict[str, str]) -> Settings:
        """Read the QoS of the ROS 2 side."""
        qos = self.under(ros, "qos")
        given = {policy: self.given(qos, policy, default) for policy, default in otherwise.items()}
        read = {policy: Setting(_COPIED[policy]) if each.text == _AUTO else each for policy, each in given.items()}
        return {"depth": self.given(ros, "queue_size", "1"), **read}

    def side(
        self, participant: str, role: Role, topic: str, where: Node, settings: Settings, kind: str | None = None
    ) -> Endpoint:
        """Return one end of a route."""
        return Endpoint(
            id=f"{participant}/{role}/{topic}",
            role=role,
            topic=topic,
            participant=participant,
            settings=settings,
            type=kind,
            place=self.place(where),
        )


read = _Reader.load
