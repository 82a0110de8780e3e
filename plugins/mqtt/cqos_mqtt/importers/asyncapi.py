"""Reads AsyncAPI 2.x and 3.x: an application with its MQTT servers, what it sends and what it receives.

In 2.x the verbs take the view of the other side: `subscribe` is what the application sends. In 3.x `send` and `receive` take
its own. A channel parameter stands for one level of the topic. Each document is one application; several documents make a
system, and servers of one host are one broker.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, flow_text, stated, walk
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Room
from cqos_core.packs.qos_keys import looks_like_qos
from cqos_mqtt.filters import intersect
from cqos_mqtt.importers.document import REF, Document, entries_of, levels
from cqos_mqtt.importers.editing import BINDINGS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.importers.tree import Node
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Role

_PROTOCOLS: Final = frozenset(("mqtt", "mqtts", "secure-mqtt", "mqtt5", "mqtts5"))
_VERSION: Final = re.compile(r"(2|3)\.\d+(?:\.\d+)?(?:-\S+)?")
_CONNECTION: Final = {
    "clientId": "client_id",
    "cleanSession": "clean_start",
    "keepAlive": "keep_alive",
    "sessionExpiryInterval": "session_expiry_interval",
    "maximumPacketSize": "maximum_packet_size",
    "x-receiveMaximum": "receive_maximum",
}
_WILL: Final = {
    "topic": "will.topic",
    "qos": "will.qos",
    "message": "will.payload",
    "retain": "will.retain",
    "x-delayInterval": "will.delay_interval",
}
_WILLS: Final = ("lastWill",)
_PUBLICATION: Final = {"qos": "qos", "retain": "retain", "messageExpiryInterval": "message_expiry_interval"}
_SUBSCRIPTION: Final = {
    "qos": "qos",
    "x-noLocal": "no_local",
    "x-retainAsPublished": "retain_as_published",
    "x-retainHandling": "retain_handling",
}
_OTHERS: Final = frozenset(
    (
        *("bindingVersion", "lastWill", "payloadFormatIndicator", "correlationData", "contentType", "responseTopic"),
        *_CONNECTION,
        *_PUBLICATION,
        *_SUBSCRIPTION,
    )
)
"""Fields of MQTT bindings, wherever they stand."""
_BINDINGS: Final = ("mqtt", "mqtt5")
_PARAMETER: Final = re.compile(r"\{([^{}]*)\}")
_MOST_TOPICS: Final = 100
_UNCOUNTED: Final = 1_000_000
_SAYS: Final = {"subscribe": PUBLISHER, "publish": SUBSCRIBER, "send": PUBLISHER, "receive": SUBSCRIBER}
_ANSWERS: Final = {"subscribe": SUBSCRIBER, "publish": PUBLISHER, "send": SUBSCRIBER, "receive": PUBLISHER}
_ACTIONS: Final = ("send", "receive")
UNKNOWN: Final = "unknown"


@dataclass(frozen=True, slots=True)
class _Server:
    """A server that speaks MQTT, with the client that the application has there."""

    name: str
    node: MappingNode
    client: str


@dataclass(frozen=True, slots=True)
class _Topic:
    """A topic or filter, and the address that it is one of the ways to fill, if there are several."""

    name: str
    one_of: str | None = None


@dataclass(frozen=True, slots=True)
class _Answered:
    """An operation that may be answered: in which role the application has to do with the answer, and where."""

    key: ScalarNode
    operation: MappingNode
    channel: MappingNode
    role: Role
    servers: list[_Server]


class _Reader(Document):
    """Reads a document as the clients of one application."""

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.opener = context.open

    def read_root(self) -> None:
        """Read servers, then channels and operations."""
        root = self.a_map(self.root, "document")
        written = self.a_text(root, "asyncapi")
        version = _VERSION.fullmatch(written)
        if version is None:
            place = self.place(stated(root, "asyncapi") or root)
            message = f"{shown(written)} is no version of AsyncAPI that is read"
            raise InputError([*self.problems, Problem("MQTT907", message, place, "expected 2.0.0 to 2.6.0, or 3.x")])
        title = self.a_text(self.a_map(stated(root, "info"), "info"), "title") or self.source.name
        self.system.name = title
        servers = self.servers(root, title)
        if stated(root, "servers") is None and self.binds_mqtt(root):
            # Servers are optional: where the application connects is then not known.
            servers = [_Server("", root, self.participant(title, root, {}))]
        if not servers:
            where = stated(root, "servers") or Place(self.source.name, root.line, root.column)
            protocols = dict.fromkeys(
                protocol
                for _, node in entries_of(self.a_map(stated(root, "servers"), "servers"))
                if (protocol := self.a_text(self.a_map(node, "servers"), "protocol"))
            )
            over = (
                f"no importer reads AsyncAPI over {listed(protocols, 'and')}" if protocols else "no server speaks MQTT"
            )
            self.note("MQTT903", f"{over}, so nothing of `{title}` is read", where)
            return
        if version[1] == "2":
            self.of_version_2(self.a_map(stated(root, "channels"), "channels"), servers)
        else:
            self.of_version_3(self.a_map(stated(root, "operations"), "operations"), servers)

    # Servers

    def servers(self, root: MappingNode, title: str) -> list[_Server]:
        """Add a client for each server that speaks MQTT."""
        servers = self.a_map(stated(root, "servers"), "servers")
        known = [(key, self.a_map(node, key.text)) for key, node in entries_of(servers)]
        found = [(key, each) for key, each in known if self.a_text(each, "protocol").lower() in _PROTOCOLS]
        clients = []
        for key, server in found:
            client = title if len(found) == 1 else f"{title} at {key.text}"
            room = self.room(key, server, _CONNECTION) if stated(servers, key.text) is server else None
            self.participant(client, key, self.connection(server, key), room=room)
            clients.append(_Server(key.text, server, client))
        return clients

    def binds_mqtt(self, root: MappingNode) -> bool:
        """Whether anything in the document has a binding for MQTT."""
        found = []
        for node in walk([root]):
            for name, (_, value) in node.entries.items() if isinstance(node, MappingNode) else ():
                if name == "bindings":
                    found.append(self.at_hand(value))
                elif name.endswith("Bindings") and isinstance(value, MappingNode):
                    found += [self.at_hand(each) for _, each in value.entries.values()]
        return any(isinstance(each, MappingNode) and each.entries.keys() & set(_BINDINGS) for each in found)

    def connection(self, server: MappingNode, key: ScalarNode) -> Settings:
        """Read how the application connects."""
        address = self.a_text(server, "host") or self.a_text(server, "url")
        where = stated(server, "host") or stated(server, "url") or key
        settings: Settings = {"broker": self.reached_by(address, server, where, key.text)}
        version = stated(server, "protocolVersion")
        if version is not None:
            settings["protocol_version"] = self.setting(version)
        elif self.a_text(server, "protocol").lower() in {"mqtt5", "mqtts5"}:
            settings["protocol_version"] = Setting("5.0", self.place(stated(server, "protocol") or key))
        bindings = self.a_map(stated(server, "bindings"), "bindings")
        for name in reversed(_BINDINGS):
            binding = self.a_map(stated(bindings, name), name)
            self.take(binding, _CONNECTION, settings)
            for _, unknown in self.misspelt(
                binding, _WILLS, _OTHERS - set(_WILLS), cause="the MQTT binding has no field"
            ):
                settings.update(dict.fromkeys(_WILL.values(), replace(unknown, text="")))
            self.take(self.a_map(stated(binding, "lastWill"), "lastWill"), _WILL, settings)
        return settings

    def reached_by(self, address: str, server: MappingNode, where: Node, name: str) -> Setting:
        """Return the broker at an address, with the defaults of its variables; unknown where one of them has none."""
        variables = self.a_map(stated(server, "variables"), "variables")
        stating = {key.text: self.a_map(node, key.text) for key, node in entries_of(variables)}
        defaults = {key: self.a_text(each, "default") for key, each in stating.items()}
        filled = _filled(address, {key: text for key, text in defaults.items() if text})
        open_ = _PARAMETER.search(filled)
        if open_ is None:
            return self.broker(_host(filled) or name, where)
        default = stated(stating[open_[1]], "default") if open_[1] in stating else None
        has = "an empty default" if isinstance(default, ScalarNode) else "no default"
        cause = f"the variable `{open_[1]}` of server `{name}` has {has}"
        return Setting(_host(address), self.place(where), unknown=cause)

    # Channels and operations

    def of_version_2(self, channels: MappingNode, servers: list[_Server]) -> None:
        """Read channels with the operations in them, as 2.x writes them."""
        answered = []
        for key, node in entries_of(channels):
            channel = self.a_map(node, key.text)
            names = {
                each.text for each in self.a_list(stated(channel, "servers"), "servers") if isinstance(each, ScalarNode)
            }
            reached = [server for server in servers if not names or server.name in names]
            for verb in ("subscribe", "publish"):
                if stated(channel, verb) is not None:
                    operation = self.a_map(stated(channel, verb), verb)
                    own_key = channel.entries[verb][0]
                    # In 2.x what a trait says takes the place of what the operation says.
                    layers = [operation, *self.traits(operation)]
                    for topic in self.topics(channel, key.text):
                        self.operation(_SAYS[verb], topic, own_key, layers, reached, own=channel.entries[verb][1])
                    answered.append(_Answered(own_key, operation, channel, _ANSWERS[verb], reached))
        for each in answered:
            self.responses(each)

    def of_version_3(self, operations: MappingNode, servers: list[_Server]) -> None:
        """Read operations with the channels they lead to, as 3.x writes them."""
        answered = []
        for key, node in entries_of(operations):
            operation = self.a_map(node, key.text)
            action = self.a_text(operation, "action")
            if action not in _ACTIONS:
                where = stated(operation, "action") or key
                self.problem("CQ009", f"`action` must be {listed(_ACTIONS)}, found {shown(action)}", where)
                continue
            if stated(operation, "channel") is None:
                self.problem("CQ009", f"operation {shown(key.text)} has no `channel`", key)
                continue
            channel = self.channel(operation)
            if channel is None:
                continue
            # In 3.x what a trait says gives way to what the operation says.
            layers = [*self.traits(operation), operation]
            reached = self.reached(channel, servers)
            for topic in self.addressed(channel, f"the channel of operation {shown(key.text)}", key):
                self.operation(_SAYS[action], topic, key, layers, reached, own=node)
            answered.append(_Answered(key, operation, channel, _ANSWERS[action], reached))
        for each in answered:
            if stated(each.operation, "reply") is not None:
                self.reply(each, f"the reply to operation {shown(each.key.text)}", servers)
            else:
                self.responses(each)

    def reply(self, answered: _Answered, what: str, servers: list[_Server]) -> None:
        """Read where the reply to an operation goes; how, the operation says of itself only."""
        where, node = answered.operation.entries["reply"]
        reply = self.a_map(node, "reply")
        location = self.a_text(self.a_map(stated(reply, "address"), "address"), "location")
        channel = self.channel(reply)
        if location:
            if not self.responses(answered):
                self.note("MQTT921", f"{what} goes where {shown(location)} says, so it is passed over", where)
        elif channel is not None:
            for topic in self.addressed(channel, f"the channel of {what}", where):
                self.answer(answered.role, topic, where, self.reached(channel, servers))
        elif stated(reply, "channel") is None and not self.responses(answered):
            self.note("MQTT921", f"{what} has neither an address nor a channel, so it is passed over", where)

    def answer(
        self, role: Role, topic: _Topic, where: ScalarNode, servers: list[_Server], *, guessed: bool = False
    ) -> None:
        """Add what is done with answers, unless operations of their own, which say more of them, do it."""
        known = {
            each.participant
            for each in self.system.endpoints
            if each.role == role and each.topic is not None and intersect(each.topic, topic.name)
        }
        self.operation(role, topic, where, [], [each for each in servers if each.client not in known], guessed=guessed)

    def responses(self, answered: _Answered) -> bool:
        """Read where the messages of an operation say that answers go; return whether any says it."""
        found = False
        for message in self.messages(answered):
            for layer in (message, *self.parts(stated(message, "traits"))):
                bindings = self.at_hand(stated(layer, "bindings"))
                binding = self.at_hand(stated(bindings, "mqtt")) if isinstance(bindings, MappingNode) else None
                wanted = self.at_hand(stated(binding, "responseTopic")) if isinstance(binding, MappingNode) else None
                node, guessed = self.response(wanted)
                if node is None or not node.text:
                    continue
                found = True
                for topic in self.topics(answered.channel, node.text):
                    self.answer(answered.role, topic, node, answered.servers, guessed=guessed)
        return found

    def messages(self, answered: _Answered) -> list[MappingNode]:
        """Return the messages of an operation; in 3.x, those of its channel where it lists none."""
        own = self.at_hand(stated(answered.operation, "message"))
        if isinstance(own, MappingNode):
            return self.parts(stated(own, "oneOf")) or [own]
        return self.parts(stated(answered.operation, "messages")) or self.parts(stated(answered.channel, "messages"))

    def parts(self, node: Node | None) -> list[MappingNode]:
        """Return the maps in a list, or in a map, that are at hand."""
        found = self.at_hand(node)
        entries = found.entries.values() if isinstance(found, MappingNode) else ()
        items = found.items if isinstance(found, SequenceNode) else [value for _, value in entries]
        return [part for each in items if isinstance(part := self.at_hand(each), MappingNode)]

    def response(self, node: Node | None) -> tuple[ScalarNode | None, bool]:
        """Return the topic that a text or a schema stands for, and whether it is only an example."""
        if not isinstance(node, MappingNode):
            return (node if isinstance(node, ScalarNode) else None), False
        fixed = stated(node, "const")
        if isinstance(fixed, ScalarNode):
            return fixed, False
        for name, guessed in (("enum", False), ("examples", True)):
            values = self.at_hand(stated(node, name))
            if isinstance(values, SequenceNode) and len(values.items) == 1 and isinstance(values.items[0], ScalarNode):
                return values.items[0], guessed
        return None, False

    def channel(self, entries: MappingNode) -> MappingNode | None:
        """Return the channel of an operation or a reply; report a missing one and return None."""
        node = self.followed(stated(entries, "channel"))
        if node is None or isinstance(node, MappingNode):
            return node
        self.refuse(node, "channel", "a reference to a channel")
        return None

    def addressed(self, channel: MappingNode, what: str, where: ScalarNode) -> list[_Topic]:
        """Return the topics of a channel of 3.x; report a missing address and return none."""
        address = stated(channel, "address")
        if isinstance(address, ScalarNode):
            return self.topics(channel, address.text)
        self.note("MQTT921", f"{what} has no address, so it is passed over", where)
        return []

    def topics(self, channel: MappingNode, address: str) -> list[_Topic]:
        """Return the topics that an address stands for: one for each way to fill the parameters that have few values."""
        parameters = self.a_map(stated(channel, "parameters"), "parameters")
        used = dict.fromkeys(_PARAMETER.findall(address))
        choices = {name: few for name in used if (few := self.choices(parameters, name))}
        # The whole product may have thousands of digits.
        count = reduce(lambda known, few: min(known * len(few), _UNCOUNTED), choices.values(), 1)
        if count > _MOST_TOPICS:
            number = count if count < _UNCOUNTED else f"more than {_UNCOUNTED}"
            message = f"{shown(address)} stands for {number} topics; it is read as {shown(levels(address))}"
            self.note("MQTT905", message, stated(channel, "parameters") or channel)
            return [_Topic(levels(address))]
        filled = dict.fromkeys(
            levels(_filled(address, dict(zip(choices, chosen, strict=True)))) for chosen in product(*choices.values())
        )
        return [_Topic(topic, address if len(filled) > 1 else None) for topic in filled]

    def choices(self, parameters: MappingNode, name: str) -> list[str]:
        """Return the values that a parameter may have; none where it may have any."""
        if stated(parameters, name) is None:
            return []
        parameter = self.a_map(stated(parameters, name), name)
        # In 2.x a schema says what values there are, in 3.x the parameter itself.
        schema = self.a_map(stated(parameter, "schema"), "schema") if stated(parameter, "schema") else parameter
        fixed = stated(schema, "const")
        values = [fixed] if fixed is not None else self.a_list(stated(schema, "enum"), "enum")
        texts = [each.text for each in values if isinstance(each, ScalarNode) and each.text]
        return list(dict.fromkeys(texts)) if len(texts) == len(values) else []

    def stands_alone(self, root: Node) -> bool:
        """Whether a file that is referred to is an application too."""
        if not isinstance(root, MappingNode) or stated(root, "asyncapi") is None or stated(root, "servers") is None:
            return False
        version_2 = self.a_text(root, "asyncapi").startswith("2.")
        return stated(root, "channels" if version_2 else "operations") is not None

    def reached(self, channel: MappingNode, servers: list[_Server]) -> list[_Server]:
        """Return the servers on which a channel is, all where it names none."""
        named = self.a_list(stated(channel, "servers"), "servers")
        nodes = [self.followed(each) for each in named]
        for node in nodes:
            if node is not None and not isinstance(node, MappingNode):
                self.refuse(node, "servers", "a list of references to servers")
        return [server for server in servers if not named or any(server.node is node for node in nodes)]

    def traits(self, operation: MappingNode) -> list[MappingNode]:
        """Return the traits of an operation, in their order."""
        return [self.a_map(each, "traits") for each in self.a_list(stated(operation, "traits"), "traits")]

    def operation(
        self,
        role: Role,
        topic: _Topic,
        where: ScalarNode,
        layers: list[MappingNode],
        servers: list[_Server],
        *,
        own: Node | None = None,
        guessed: bool = False,
    ) -> None:
        """Add what an operation is at each server; of its layers a later one wins, and ``own`` is what stands at its key."""
        settings: Settings = {}
        names = _PUBLICATION if role == PUBLISHER else _SUBSCRIPTION
        for layer in layers:
            bindings = self.a_map(stated(layer, "bindings"), "bindings")
            binding = self.a_map(stated(bindings, "mqtt"), "mqtt")
            self.take(binding, names, settings)
            self.misplaced(bindings, names, settings)
        # A trait of 2.x wins over what stands at the operation, and what is referred to is stated for others too.
        room = self.room(where, own, names) if layers and own is layers[-1] else None
        for server in servers:
            one_of = None if topic.one_of is None else f"{server.client}/{role}/{topic.one_of}"
            self.endpoint(
                server.client, role, topic.name, where, dict(settings), one_of=one_of, guessed=guessed, room=room
            )

    def room(self, key: ScalarNode, node: Node | None, names: dict[str, str]) -> Room | None:
        """Return the room in the MQTT binding of what stands at a key, unless a reference leads elsewhere."""
        for name in ("bindings", "mqtt"):
            node = stated(node, name) if isinstance(node, MappingNode) else None
            if isinstance(node, MappingNode) and stated(node, REF) is not None:
                return None
        return Room(self.place(key), tuple(policy for policy in names.values() if policy in BINDINGS))

    # Values

    def take(self, binding: MappingNode, names: dict[str, str], settings: Settings) -> None:
        """Take the fields of a binding as settings."""
        unclear = self.misspelt(binding, names, _OTHERS, cause="the MQTT binding has no field")
        settings |= {names[meant]: unknown for meant, unknown in unclear}
        known = _OTHERS if names is not _WILL else _WILL.keys()
        typing_errors = {each for each in binding.entries if looks_like_qos(each, (*names, *_WILLS))}
        self.leave_open(binding, known | typing_errors, "the field of an MQTT binding", settings)
        for name, policy in names.items():
            node = self.followed(stated(binding, name))
            if node is not None:
                settings[policy] = self.value(node, name)

    def misplaced(self, bindings: MappingNode, names: Mapping[str, str], settings: Settings) -> None:
        """Report QoS that stands among the names of protocols."""
        for name, (key, value) in bindings.entries.items():
            if name in names:
                cause = f"{shown(name)} stands beside the bindings"
                self.warn_once("CQ040", f"{cause}, not in one, so it is not read", key, f"write `mqtt: {{{name}: …}}`")
                settings[names[name]] = Setting(flow_text(value), self.place(key), unknown=cause, reported="CQ040")

    def value(self, node: Node, name: str) -> Setting:
        """Read a value, or the schema of one: what it fixes, else that it is not known."""
        if not isinstance(node, MappingNode):
            return self.setting(node)
        listed_values = self.a_list(stated(node, "enum"), "enum") if stated(node, "const") is None else []
        fixed = stated(node, "const") or (listed_values[0] if len(listed_values) == 1 else None)
        if fixed is not None:
            return self.setting(fixed)
        stated_bounds = ((name, stated(node, name)) for name in ("minimum", "maximum"))
        bounds = ", ".join(f"{name} {each.text}" for name, each in stated_bounds if isinstance(each, ScalarNode))
        self.note("MQTT905", f"`{name}` is left open by its schema{f' ({bounds})' if bounds else ''}", node)
        return Setting(UNKNOWN, self.place(node))


def _filled(address: str, values: Mapping[str, str]) -> str:
    """Return an address with those of its parameters replaced that have a value."""
    return _PARAMETER.sub(lambda parameter: values.get(parameter[1], parameter[0]), address)


def _host(address: str) -> str:
    """Return host and port of an address, without scheme, path and user."""
    bare = address.partition("://")[2] or address
    return bare.partition("/")[0].rpartition("@")[2]


read = _Reader.load
