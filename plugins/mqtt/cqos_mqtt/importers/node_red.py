"""Reads the flows of Node-RED (flows.json): each configured broker is a client, its nodes are what that client does.

The editor writes every field of a node, changed or not, so a default value of Node-RED does not count as stated.
The devices on the other side are in no flow: the clients are external.
"""

from __future__ import annotations

from typing import Final

from cqos_core.importers.reading import shown
from cqos_core.importers.tree import MappingNode, ScalarNode, stated
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Room, Setting, Settings
from cqos_mqtt.importers.document import Document, truth
from cqos_mqtt.importers.editing import FIELDS

BROKER: Final = "mqtt-broker"
IN: Final = "mqtt in"
OUT: Final = "mqtt out"
_VERSIONS: Final = {"3": "3.1.1", "4": "3.1.1", "5": "5.0"}
_WILL: Final = {"willTopic": "topic", "willQos": "qos", "willRetain": "retain", "willPayload": "payload"}
_OF_NODES: Final = ("qos", "retain", "expiry", "topic", "broker", "nl", "rap", "rh", "d", "z")
_OF_BROKERS: Final = (
    *("broker", "port", "clientid", "cleansession", "keepalive", "protocolVersion", "sessionExpiry", "willMsg"),
    *_WILL,
    *("birthTopic", "birthQos", "birthRetain", "closeTopic", "closeQos", "closeRetain"),
)
_OF_WILLS: Final = ("delay", "expiry")
_OTHERS: Final = frozenset(
    (
        *("id", "type", "name", "g", "x", "y", "l", "info", "env", "wires", "inputs", "datatype", "respTopic"),
        *("contentType", "userProps", "correl", "tls", "usetls", "verifyservercert", "compatmode", "autoConnect"),
        *("autoUnsubscribe", "credentials", "birthPayload", "birthMsg", "closePayload", "closeMsg"),
    )
)
"""Fields of nodes that hold no QoS that is read here."""
_DEFAULT_IN: Final = "2"
_DEFAULT_OUT: Final = "0"


class _Reader(Document):
    """Reads flows as clients and what they publish and subscribe."""

    def read_root(self) -> None:
        """Read the brokers, then the nodes that use them."""
        nodes = [self.a_map(each, "node") for each in self.a_list(self.root, "flows")]
        off = {self.a_text(node, "id") for node in nodes if truth(stated(node, "disabled"))}
        clients: dict[str, tuple[str, bool]] = {}
        for node in nodes:
            if self.a_text(node, "type") == BROKER:
                clients[self.a_text(node, "id")] = self.connection(node)
        for node in nodes:
            kind = self.a_text(node, "type")
            if kind in {IN, OUT} and not truth(stated(node, "d")) and self.a_text(node, "z") not in off:
                self.node(node, kind, clients)
        if not clients:
            self.note("MQTT923", "no node of these flows is about MQTT", self.root)

    def unused(self, node: MappingNode, names: tuple[str, ...]) -> None:
        """Report fields that Node-RED passes over; it then takes its default."""
        self.misspelt(node, names, _OTHERS, cause="Node-RED has no field")

    def connection(self, node: MappingNode) -> tuple[str, bool]:
        """Add a client; return its id and whether it speaks 5.0."""
        self.unused(node, _OF_BROKERS)
        host, port = self.a_text(node, "broker"), self.a_text(node, "port")
        version = _VERSIONS.get(self.a_text(node, "protocolVersion"), "3.1.1")
        where = stated(node, "broker") or node
        settings: Settings = {"protocol_version": self._given(node, "protocolVersion", version)}
        if host:
            settings["broker"] = self.broker(f"{host}:{port}" if port and "://" not in host else host, where)
        client_id = self.a_text(node, "clientid")
        clean = truth(stated(node, "cleansession"), otherwise=True)
        if client_id:
            settings["client_id"] = self._given(node, "clientid", client_id)
        # Without an id Node-RED makes one up, and then begins with a new session, whatever is chosen.
        settings["clean_start"] = self._given(node, "cleansession", "false" if client_id and not clean else "true")
        for name, policy in (("keepalive", "keep_alive"), ("sessionExpiry", "session_expiry_interval")):
            text = self.a_text(node, name)
            if text and (version == "5.0" or name == "keepalive"):
                settings[policy] = self._given(node, name, text)
        self._will(node, settings, in_5_0=version == "5.0")
        name = self._named(node)
        client = self.participant(name, node, settings, external=True)
        for moment in ("birth", "close"):
            topic = self.a_text(node, f"{moment}Topic")
            if topic and not _from_environment(topic):
                own = {
                    policy: self._given(node, f"{moment}{field}", text)
                    for field, policy in (("Qos", "qos"), ("Retain", "retain"))
                    if (text := self.a_text(node, f"{moment}{field}"))
                }
                self.endpoint(
                    client, PUBLISHER, topic, stated(node, f"{moment}Topic") or node, own, label=f"{moment} message"
                )
        return client, version == "5.0"

    def _will(self, node: MappingNode, settings: Settings, *, in_5_0: bool) -> None:
        topic = self.a_text(node, "willTopic")
        if not topic or _from_environment(topic):
            return
        for name, field in _WILL.items():
            text = self.a_text(node, name)
            if text:
                settings[f"will.{field}"] = self._given(node, name, text)
        message = self.a_map(stated(node, "willMsg"), "willMsg")
        self.unused(message, _OF_WILLS)
        for name, field in (("delay", "delay_interval"), ("expiry", "message_expiry_interval")):
            text = self.a_text(message, name)
            if text and in_5_0:
                settings[f"will.{field}"] = self._given(message, name, text)

    def _named(self, node: MappingNode) -> str:
        """Return an id for a client: its name, made unique by the id of its node."""
        name = self.a_text(node, "name") or self.a_text(node, "broker") or BROKER
        return name if name not in self.system.participants else f"{name} ({self.a_text(node, 'id')})"

    def node(self, node: MappingNode, kind: str, clients: dict[str, tuple[str, bool]]) -> None:
        """Add what a node publishes or subscribes."""
        topic = self.a_text(node, "topic")
        broker = stated(node, "broker")
        label = self.a_text(node, "name")
        if not topic or _from_environment(topic) or (kind == IN and self.a_text(node, "inputs") == "1"):
            self.note("MQTT921", f"{shown(label or kind)} takes its topic from elsewhere", node)
            return
        found = clients.get(broker.text) if isinstance(broker, ScalarNode) else None
        if found is None:
            self.note("MQTT922", f"{shown(label or kind)} on {shown(topic)} is connected to no broker", broker or node)
            return
        client, in_5_0 = found
        self.unused(node, _OF_NODES)
        where = stated(node, "topic") or node
        if kind == IN:
            settings = self._stated(node, (("qos", "qos", _DEFAULT_IN),))
            if in_5_0:
                options = (
                    ("nl", "no_local", "false"),
                    ("rap", "retain_as_published", ""),
                    ("rh", "retain_handling", "0"),
                )
                settings |= self._stated(node, options)
            policies = tuple(policy for policy in FIELDS if policy != "retain" and (in_5_0 or policy == "qos"))
            room = Room(self.place(node), policies, restated=True)
            self.endpoint(client, SUBSCRIBER, topic, where, settings, presets=("node_red_in",), label=label, room=room)
            return
        fields = (("qos", "qos", _DEFAULT_OUT), ("retain", "retain", "false"))
        settings = self._stated(node, fields)
        if in_5_0:
            settings |= self._stated(node, (("expiry", "message_expiry_interval", ""),))
        room = Room(self.place(node), ("qos", "retain"), restated=True)
        self.endpoint(client, PUBLISHER, topic, where, settings, presets=("node_red_out",), label=label, room=room)

    def _stated(self, node: MappingNode, fields: tuple[tuple[str, str, str], ...]) -> Settings:
        """Return what is set to something else than the default."""
        return {
            policy: self._given(node, name, text)
            for name, policy, default in fields
            if (text := self.a_text(node, name)) and text.lower() != default
        }

    def _given(self, node: MappingNode, name: str, text: str) -> Setting:
        return Setting(text, self.place(stated(node, name) or node))


def _from_environment(topic: str) -> bool:
    """Whether a part of the topic is filled in when the flow is started."""
    return "${" in topic


read = _Reader.load
