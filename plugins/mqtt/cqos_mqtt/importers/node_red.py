"""Reads the flows of Node-RED (flows.json): each configured broker is a client, its nodes are what that client does.

The editor writes every field of a node, changed or not, so a default value of Node-RED does not count as stated.
The devices on the other side are in no flow: the clients are external.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import shown
from cqos_core.importers.tree import MappingNode, ScalarNode, stated
from cqos_core.model.settings import Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Room
from cqos_core.packs.qos_keys import looks_like_qos
from cqos_mqtt.importers.document import Document, truth
from cqos_mqtt.importers.editing import FIELDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.model.system import Role

BROKER: Final = "mqtt-broker"
IN: Final = "mqtt in"
OUT: Final = "mqtt out"
_VERSIONS: Final = {"3": "3.1.1", "4": "3.1.1", "5": "5.0"}
_CLIENT: Final = (
    ("clientid", "client_id", ""),
    ("keepalive", "keep_alive", ""),
    ("sessionExpiry", "session_expiry_interval", ""),
)
_WILL: Final = (
    ("willTopic", "will.topic", ""),
    ("willQos", "will.qos", ""),
    ("willRetain", "will.retain", ""),
    ("willPayload", "will.payload", ""),
)
_WILL_MESSAGE: Final = (("delay", "will.delay_interval", ""), ("expiry", "will.message_expiry_interval", ""))
_MESSAGE: Final = (("expiry", "message_expiry_interval", ""),)
_NODES: Final[dict[str, tuple[Role, str, tuple[tuple[str, str, str], ...]]]] = {
    IN: (
        SUBSCRIBER,
        "node_red_in",
        (
            ("qos", "qos", "2"),
            ("nl", "no_local", "false"),
            ("rap", "retain_as_published", ""),
            ("rh", "retain_handling", "0"),
        ),
    ),
    OUT: (
        PUBLISHER,
        "node_red_out",
        (("qos", "qos", "0"), ("retain", "retain", "false"), ("expiry", "message_expiry_interval", "")),
    ),
}
"""By type of a node: the role of its endpoint, its preset, and each field with its policy and the default of Node-RED."""
_OF_5_0: Final = frozenset(("sessionExpiry", "delay", "expiry", "nl", "rap", "rh"))
"""Fields that count only for MQTT 5.0."""
_OF_NODES: Final = ("qos", "retain", "expiry", "topic", "broker", "nl", "rap", "rh", "d", "z")
_OF_BROKERS: Final = (
    *("broker", "port", "clientid", "cleansession", "keepalive", "protocolVersion", "sessionExpiry", "willMsg"),
    *(name for name, _, _ in _WILL),
    *("birthTopic", "birthQos", "birthRetain", "closeTopic", "closeQos", "closeRetain"),
)
_OTHERS: Final = frozenset(
    (
        *("id", "type", "name", "g", "x", "y", "l", "info", "env", "wires", "inputs", "datatype", "respTopic"),
        *("contentType", "userProps", "correl", "tls", "usetls", "verifyservercert", "compatmode", "autoConnect"),
        *("autoUnsubscribe", "credentials", "birthPayload", "birthMsg", "closePayload", "closeMsg", "usews"),
        *("icon", "inputLabels", "outputLabels"),
    )
)
"""Fields of nodes that hold no QoS that is read here."""


class _Reader(Document):
    """Reads flows as clients and what they publish and subscribe."""

    def read_root(self) -> None:
        """Read the brokers, then the nodes that use them."""
        nodes = [self.a_map(each, "node") for each in self.a_list(self.root, "flows")]
        off = {self.a_text(node, "id") for node in nodes if truth(stated(node, "disabled"))}
        brokers = [node for node in nodes if self.a_text(node, "type") == BROKER]
        clients = {self.a_text(node, "id"): self.connection(node) for node in brokers}
        for node in nodes:
            kind = self.a_text(node, "type")
            if kind in _NODES and not truth(stated(node, "d")) and self.a_text(node, "z") not in off:
                self.node(node, kind, clients)
        if not clients:
            self.note("MQTT923", "no node of these flows is about MQTT", self.root)

    def unused(self, node: MappingNode, names: Iterable[str]) -> None:
        """Report fields that Node-RED passes over; it then takes its default."""
        self.misspelt(node, names, _OTHERS, cause="Node-RED has no field")

    def undecided(self, node: MappingNode, names: Sequence[str], settings: Settings) -> None:
        """Report fields of a node that no table has, save typing errors; what else holds for it is then not known."""
        typing_errors = {each for each in node.entries if looks_like_qos(each, names)}
        self.leave_open(node, {*names, *_OTHERS, *typing_errors}, "the field of an MQTT node", settings)

    def connection(self, node: MappingNode) -> tuple[str, bool]:
        """Add a client; return its id and whether it speaks 5.0."""
        self.unused(node, _OF_BROKERS)
        host, port = self.a_text(node, "broker"), self.a_text(node, "port")
        version = _VERSIONS.get(self.a_text(node, "protocolVersion"), "3.1.1")
        in_5_0 = version == "5.0"
        settings = self._stated(node, _CLIENT, in_5_0=in_5_0)
        self.undecided(node, _OF_BROKERS, settings)
        settings["protocol_version"] = self._given(node, "protocolVersion", version)
        if host:
            address = f"{host}:{port}" if port and "://" not in host else host
            settings["broker"] = self.broker(address, stated(node, "broker") or node)
        # Without an id Node-RED makes one up, and then begins with a new session, whatever is chosen.
        clean = truth(stated(node, "cleansession"), otherwise=True) or "client_id" not in settings
        settings["clean_start"] = self._given(node, "cleansession", "true" if clean else "false")
        settings |= self._will(node, in_5_0=in_5_0)
        client = self.participant(self._named(node), node, settings, external=True)
        for moment in ("birth", "close"):
            topic = self.a_text(node, f"{moment}Topic")
            if topic and not _from_environment(topic):
                fields = ((f"{moment}Qos", "qos", ""), (f"{moment}Retain", "retain", ""))
                own, where = self._stated(node, fields, in_5_0=in_5_0), stated(node, f"{moment}Topic") or node
                message = self.a_map(stated(node, f"{moment}Msg"), f"{moment}Msg")
                own |= self._stated(message, _MESSAGE, in_5_0=in_5_0)
                self.endpoint(client, PUBLISHER, topic, where, own, label=f"{moment} message")
        return client, in_5_0

    def _will(self, node: MappingNode, *, in_5_0: bool) -> Settings:
        topic = self.a_text(node, "willTopic")
        if not topic or _from_environment(topic):
            return {}
        message = self.a_map(stated(node, "willMsg"), "willMsg")
        self.unused(message, [name for name, _, _ in _WILL_MESSAGE])
        return self._stated(node, _WILL, in_5_0=in_5_0) | self._stated(message, _WILL_MESSAGE, in_5_0=in_5_0)

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
        role, preset, fields = _NODES[kind]
        written = {policy for name, policy, _ in fields if in_5_0 or name not in _OF_5_0}
        room = Room(self.place(node), tuple(policy for policy in FIELDS if policy in written), restated=True)
        settings, where = self._stated(node, fields, in_5_0=in_5_0), stated(node, "topic") or node
        self.undecided(node, _OF_NODES, settings)
        self.endpoint(client, role, topic, where, settings, presets=(preset,), label=label, room=room)

    def _stated(self, node: MappingNode, fields: Iterable[tuple[str, str, str]], *, in_5_0: bool) -> Settings:
        """Return what is set to something else than the default."""
        return {
            policy: self._given(node, name, text)
            for name, policy, default in fields
            if (in_5_0 or name not in _OF_5_0) and (text := self.a_text(node, name)) and text.lower() != default
        }

    def _given(self, node: MappingNode, name: str, text: str) -> Setting:
        return Setting(text, self.place(stated(node, name) or node))


def _from_environment(topic: str) -> bool:
    """Whether a part of the topic is filled in when the flow is started."""
    return "${" in topic


read = _Reader.load
