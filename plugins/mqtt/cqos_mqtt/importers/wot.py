"""Reads W3C WoT Thing Descriptions with MQTT forms: what a Thing publishes, and what it subscribes to.

A form says what a consumer does, so the Thing does the opposite: it publishes what is observed and subscribes to what is
written or invoked. The QoS of a form is a minimum (MQTT binding template): with it the Thing publishes, and a QoS that a
consumer must use is a need of the Thing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final
from urllib.parse import unquote, urlsplit

from cqos_core.importers.source_reading import shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, stated
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Room
from cqos_core.packs.qos_keys import looks_like_qos
from cqos_mqtt.importers.document import Document, levels
from cqos_mqtt.importers.editing import TERMS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.tree import Node
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import ReadContext, Source

_AFFORDANCES: Final = ("properties", "actions", "events")
# What a consumer does for an operation, where the form does not say it itself.
_PACKETS: Final = {
    "readproperty": "subscribe",
    "observeproperty": "subscribe",
    "subscribeevent": "subscribe",
    "readallproperties": "subscribe",
    "observeallproperties": "subscribe",
    "subscribeallevents": "subscribe",
    "writeproperty": "publish",
    "invokeaction": "publish",
    "writeallproperties": "publish",
}
_DEFAULT_OPS: Final = {
    "properties": ("readproperty", "writeproperty"),
    "actions": ("invokeaction",),
    "events": ("subscribeevent",),
}
_TERMS: Final = {term: policy for policy, term in TERMS.items()}
"""Terms of a form that hold QoS, with their policies."""
_OTHER_TERMS: Final = frozenset(("mqv:filter", "mqv:topic", "mqv:controlPacket"))
_SCHEMES: Final = ("mqtt", "mqtts", "mqtt+ws", "mqtt+wss", "mqtt+tcp", "mqtts+tcp")


class _Reader(Document):
    """Reads a Thing Description as the MQTT client that the Thing is."""

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.clients: dict[str, str] = {}  # by host

    def read_root(self) -> None:
        """Read all forms."""
        thing = self.a_map(self.root, "Thing Description")
        name = self.a_text(thing, "title") or self.a_text(thing, "id") or self.source.name
        self.system.name = name
        base = self.a_text(thing, "base")
        for affordance in _AFFORDANCES:
            for key, node in self.a_map(stated(thing, affordance), affordance).entries.values():
                entries = self.a_map(node, key.text)
                read_only = self.a_text(entries, "readOnly") == "true"
                for form in self.a_list(stated(entries, "forms"), "forms"):
                    default = _DEFAULT_OPS[affordance][: 1 if read_only else None]
                    self.form(name, key, self.a_map(form, "forms"), base, default)
        for form in self.a_list(stated(thing, "forms"), "forms"):
            self.form(name, None, self.a_map(form, "forms"), base, ())

    def form(self, thing: str, key: ScalarNode | None, form: MappingNode, base: str, default: tuple[str, ...]) -> None:
        """Add what one form makes the Thing do."""
        written = self.a_text(form, "href")
        href = written if "://" in written else f"{base.rstrip('/')}/{written.lstrip('/')}" if base else written
        try:
            address = urlsplit(href.replace("#", "%23"))
        except ValueError as error:
            self.note("MQTT920", f"{shown(href)} is no address: {error}", stated(form, "href") or form)
            return
        if address.scheme not in _SCHEMES and not any(name.startswith("mqv:") for name in form.entries):
            return
        host = address.netloc.rpartition("@")[2]
        for packet in self.packets(form, default):
            topics = list(self.topics(form, "mqv:filter" if packet == "subscribe" else "mqv:topic", address.path))
            if not topics:
                self.note("MQTT920", f"this form of `{key.text if key else thing}` names no topic", form)
            for node, topic in topics:
                self.does(self.client_at(host, thing, form), packet, levels(topic), node, form)

    def client_at(self, host: str, thing: str, form: MappingNode) -> str:
        """Return the client that the Thing has at a host; it is called after the Thing, a further one after its host too."""
        if host not in self.clients:
            name = f"{thing} at {host}" if self.clients and host else thing
            settings = {"broker": self.broker(host, form)} if host else {}
            self.clients[host] = self.participant(name, form, settings, external=True)
        return self.clients[host]

    def packets(self, form: MappingNode, default: tuple[str, ...]) -> list[str]:
        """Return what a consumer sends: as the form says, else as its operations mean."""
        node = stated(form, "mqv:controlPacket")
        if isinstance(node, ScalarNode):
            packet = node.text.removeprefix("mqv:").lower()
            return [packet] if packet in {"publish", "subscribe"} else []
        operations = stated(form, "op")
        names = [each.text for each in _scalars(operations)] or list(default)
        return list(dict.fromkeys(_PACKETS[name] for name in names if name in _PACKETS))

    def topics(self, form: MappingNode, term: str, path: str) -> Iterator[tuple[Node, str]]:
        """Yield the topics or filters of a form; older ones have them in the address."""
        other = "mqv:topic" if term == "mqv:filter" else "mqv:filter"
        node = stated(form, term) or stated(form, other)
        if node is not None:
            yield from ((each, each.text) for each in _scalars(node))
        elif path.strip("/"):
            yield stated(form, "href") or form, unquote(path.removeprefix("/"))

    def does(self, client: str, packet: str, topic: str, where: Node, form: MappingNode) -> None:
        """Add the Thing's end of what a consumer does."""
        unclear = self.misspelt(form, (*_TERMS, *_OTHER_TERMS), cause="the MQTT binding has no term")
        settings: Settings = {_TERMS[meant]: setting for meant, setting in unclear if meant in _TERMS}
        typing_errors = {each for each in form.entries if looks_like_qos(each, (*_TERMS, *_OTHER_TERMS))}
        self.leave_open(form, {*_TERMS, *_OTHER_TERMS, *typing_errors}, "the MQTT term", settings, "mqv:")
        qos, retain = stated(form, "mqv:qos"), stated(form, "mqv:retain")
        if qos is not None:
            settings["qos"] = self.setting(qos)
        if packet == "subscribe":
            if retain is not None:
                settings["retain"] = self.setting(retain)
            self.endpoint(client, PUBLISHER, topic, where, settings, room=Room(self.place(form), tuple(TERMS)))
            return
        needs = {
            word: Setting("true", self.place(qos))
            for level, word in (("1", "loss_free"), ("2", "duplicate_free"))
            if isinstance(qos, ScalarNode) and qos.text >= level
        }
        if needs and qos is not None:
            # The form asks for a QoS on the way to the Thing. What the Thing does with messages is not its subject.
            settings["taken_every"] = Setting("0s", self.place(qos), derived=True)
        self.endpoint(client, SUBSCRIBER, topic, where, settings, needs=needs)


def _scalars(node: Node | None) -> Iterator[ScalarNode]:
    nodes = node.items if isinstance(node, SequenceNode) else () if node is None else (node,)
    yield from (each for each in nodes if isinstance(each, ScalarNode))


read = _Reader.load
