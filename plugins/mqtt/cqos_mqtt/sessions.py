"""What follows from all clients and their endpoints together: Wills, sessions, shares, client ids.

MQTT has subscriptions of a session and messages of a connection; an endpoint alone says little of either.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from cqos_core.model.grouping import grouped
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint
from cqos_core.packs import ENDPOINT, Completion, KnownEntity
from cqos_mqtt import names
from cqos_mqtt.broker_policies import ACCESS, DOTS_SEPARATE
from cqos_mqtt.connection_policies import (
    BRINGS_BACK,
    CLIENT_ID,
    USERNAME,
    WILL_EXPIRY,
    WILL_PAYLOAD,
    WILL_QOS,
    WILL_RETAIN,
    WILL_TOPIC,
)
from cqos_mqtt.endpoint_policies import NO_LOCAL, QOS
from cqos_mqtt.filters import SHARE, Trie, bare, has_wildcards, intersect, matches
from cqos_mqtt.policies import BROKER, POLICIES

WILL: Final = "will"
"""The kind of the endpoint that a Will is."""
BY_BROKER: Final = "broker"
"""The kind of an endpoint on which the broker itself publishes."""
RESERVED: Final = "$SYS/"
BRIDGE_STATES: Final = "$SYS/broker/connection/+/state"
EVERY_USER: Final = "*"
NO_USER: Final = "-"
"""Who in a line of access control: every client, and those who give no name."""
_TRUE: Final = Setting("true", derived=True)


def complete(
    participants: Sequence[KnownEntity], endpoints: Sequence[KnownEntity], brokers: Mapping[str, KnownEntity]
) -> Completion:
    """Add to clients and endpoints what only the whole says of them."""
    of_participants: dict[str, dict[str, Setting]] = {}
    of_endpoints = {position: _of_the_topic(endpoint) for position, endpoint in enumerate(endpoints)}
    _client_ids(participants, of_participants)
    changing = {name for name, broker in brokers.items() if broker.value(DOTS_SEPARATE) == 1}
    separating = {each.id for each in participants if _broker_of(each, brokers) in changing} if changing else set()
    by_client = grouped((each.participant, (position, each)) for position, each in enumerate(endpoints))
    for client, own in by_client.items():
        facts = _of_the_client(client, [endpoint for _, endpoint in own])
        if client in separating and any(_has_dots(each.topic or "") for _, each in own):
            facts["dotted"] = _TRUE
        for position, endpoint in own if client in separating else ():
            of_endpoints[position].update(_at_broker(endpoint))
        if facts:
            of_participants.setdefault(client, {}).update(facts)
        if len(own) > 1:
            _of_several(own, of_endpoints)
    wills = list(_wills(participants, by_client))
    sent = {each.participant: each for each in wills}
    for client in separating & sent.keys():
        sent[client].settings.update(_at_broker(sent[client]))
    clients = {each.id: each for each in participants}
    controls = _controls(brokers)
    for client, participant in clients.items() if controls else ():
        rights = _rights(participant, brokers, controls)
        if rights is None:
            continue
        for position, endpoint in by_client.get(client, ()):
            of_endpoints[position].update(_allowed(endpoint, rights))
        if client in sent:
            allowed = _allowed(sent[client], rights)
            sent[client].settings.update(allowed)
            of_participants.setdefault(client, {})["will_allowed"] = allowed["may_publish"]
    for position in _brought_back(endpoints, clients, brokers):
        of_endpoints[position]["brought_back"] = _TRUE
    kept = {position: facts for position, facts in of_endpoints.items() if facts}
    return Completion(of_participants, kept, tuple(wills))


def _is_reserved(topic: str) -> bool:
    """Whether only the broker publishes on a topic; Mosquitto takes the states of bridges from others too."""
    return topic.startswith(RESERVED) and not matches(BRIDGE_STATES, topic)


class _Filters:
    """Filters by what access control lets a client do there."""

    def __init__(self, lines: Iterable[tuple[str, str]]) -> None:
        valid = [(access, written) for access, written in lines if names.is_filter(written)]
        self.readable = Trie(written for access, written in valid if access in {"read", "readwrite"})
        self.writable = Trie(written for access, written in valid if access in {"write", "readwrite"})
        self.denied = Trie(written for access, written in valid if access == "deny")


class _Control:
    """The access control of one broker; what is for one user is filed once."""

    def __init__(self, lines: Iterable[str]) -> None:
        split = (line.split(" ", 2) for line in lines)
        self._lines = grouped((who, (access, written)) for access, who, written in split)
        self._filed: dict[str, _Filters] = {}
        self._names_users = not self._lines.keys() <= {EVERY_USER, NO_USER}

    def rights(self, user: Setting | None, client_id: Setting | None) -> list[_Filters] | None:
        """Return what a client may do; None where that is not known."""
        if user is None and self._names_users:
            return None
        known = {"%u": user.text if user is not None else "", "%c": client_id.text if client_id is not None else "+"}
        found, own = [], []
        for who in dict.fromkeys((EVERY_USER, user.text.replace(" ", "_") if user is not None else NO_USER)):
            lines = self._lines.get(who, [])
            if who not in self._filed:
                self._filed[who] = _Filters(line for line in lines if not _has_marks(line[1]))
                self._lines[who] = lines = [line for line in lines if _has_marks(line[1])]
            found.append(self._filed[who])
            own += [(access, _filled(written, known)) for access, written in lines]
        return [*found, _Filters(own)] if own else found


def _has_marks(written: str) -> bool:
    return "%u" in written or "%c" in written


def _controls(brokers: Mapping[str, KnownEntity]) -> dict[str, _Control]:
    """Return the access control of each broker that has one."""
    lines = {name: broker.value(ACCESS) for name, broker in brokers.items()}
    return {name: _Control(value) for name, value in lines.items() if isinstance(value, tuple)}


def _rights(
    client: KnownEntity, brokers: Mapping[str, KnownEntity], controls: dict[str, _Control]
) -> list[_Filters] | None:
    """Return what the access control of its broker says of a client; None where that is not known."""
    control = controls.get(_broker_of(client, brokers))
    user, own_id = client.setting(USERNAME), client.setting(CLIENT_ID)
    if control is None or (user is not None and user.unknown):
        return None
    return control.rights(user, own_id if own_id is not None and not own_id.unknown else None)


def _broker_of(client: KnownEntity, brokers: Mapping[str, KnownEntity]) -> str:
    """Return the name of the broker to which a client connects; empty where that is not known."""
    named = client.setting(BROKER)
    return named.text if named is not None else next(iter(brokers)) if len(brokers) == 1 else ""


def _brought_back(
    endpoints: Sequence[KnownEntity], clients: Mapping[str, KnownEntity], brokers: Mapping[str, KnownEntity]
) -> Iterable[int]:
    """Yield the publications that a bridge of the same broker publishes once more; those of the bridge itself are none."""
    back = grouped(
        (_broker_of(each, brokers), (each.id, filters))
        for each in clients.values()
        if isinstance(filters := each.value(BRINGS_BACK), tuple)
    )
    for position, endpoint in enumerate(endpoints) if back else ():
        client = clients.get(endpoint.participant)
        if endpoint.role != PUBLISHER or endpoint.topic is None or client is None:
            continue
        for bridge, filters in back.get(_broker_of(client, brokers), ()):
            if any(bridge != client.id and intersect(written, endpoint.topic) for written in filters):
                yield position


def _filled(written: str, known: Mapping[str, str]) -> str:
    for mark, text in known.items():
        written = written.replace(mark, text)
    return written


def _derived(text: str) -> Setting:
    return Setting(text, derived=True)


def _allowed(endpoint: KnownEntity | Endpoint, rights: Sequence[_Filters]) -> dict[str, Setting]:
    """Say what a client may do with one endpoint."""
    topic = endpoint.topic or ""
    if endpoint.role == PUBLISHER:
        allowed = any(True for each in rights for _ in each.writable.matching(topic))
        denied = any(True for each in rights for _ in each.denied.matching(topic))
        return {
            "may_publish": _derived("true" if allowed and not denied else "false"),
            "controlled_topic": _derived(topic),
        }
    # Other filters match no topic that it hears.
    readable = [written for each in rights for written in each.readable.intersecting(topic)]
    if not readable:
        return {"unreadable": _derived(json.dumps(["#", "$SYS/#", *_with_dollar(topic)]))}
    denied_here = [written for each in rights for written in each.denied.intersecting(topic)]
    return {"readable": _derived(json.dumps(readable)), "unreadable": _derived(json.dumps(denied_here))}


def _with_dollar(topic: str) -> tuple[str, ...]:
    return (bare(topic),) if bare(topic).startswith("$") else ()


def _has_dots(topic: str) -> bool:
    return "." in topic or "*" in topic


def _at_broker(endpoint: KnownEntity | Endpoint) -> dict[str, Setting]:
    """Say what a broker that takes a dot for a slash makes of a topic, where its filters may then match others."""
    topic = endpoint.topic or ""
    changed = topic.replace(".", "/").replace("*", "+")
    if endpoint.role == SUBSCRIBER:
        return {"filter_at_broker": _derived(bare(changed))} if has_wildcards(bare(topic)) else {}
    if not _has_dots(topic):
        return {}
    unknown = f"which topics `{topic}` stands for, and where they have dots" if has_wildcards(topic) else ""
    return {"topic_at_broker": Setting(changed, unknown=unknown, derived=True)}


def _of_the_topic(endpoint: KnownEntity) -> dict[str, Setting]:
    """Say what kind of filter a subscription has, and whether only the broker may publish on a topic."""
    topic = endpoint.topic
    if topic is None:
        return {}
    if endpoint.role == SUBSCRIBER:
        facts = {"shared": topic.startswith(SHARE), "wildcards": has_wildcards(bare(topic))}
    else:
        facts = {"reserved_topic": _is_reserved(topic) and endpoint.kind != BY_BROKER}
    return {name: _TRUE for name, holds in facts.items() if holds}


def _client_ids(participants: Iterable[KnownEntity], found: dict[str, dict[str, Setting]]) -> None:
    """Tell clients that have the id of another one of the same broker."""
    ids = {}
    for each in participants:
        own = each.setting(CLIENT_ID)
        if own is not None and own.text:
            connected = each.setting(BROKER)
            ids[each.id] = (own.text, connected.text if connected is not None else None), own
    numbers = Counter(key for key, _ in ids.values())
    for name, (key, own) in ids.items():
        if numbers[key] > 1:
            found.setdefault(name, {})["client_id_taken"] = Setting("true", own.place, derived=True)


def _of_the_client(client: str, endpoints: Sequence[KnownEntity]) -> dict[str, Setting]:
    """Say who the client is and what it subscribes to, where a rule has to know; else clients stay alike."""
    facts: dict[str, Setting] = {}
    if any(each.value(NO_LOCAL) not in {None, 0} for each in endpoints if each.role == SUBSCRIBER):
        facts["session"] = _derived(client)
    if any("liveness" in each.needs for each in endpoints):
        filters = sorted({each.topic for each in endpoints if each.role == SUBSCRIBER and each.topic})
        facts["subscribed"] = _derived(json.dumps(filters))
    return facts


def _of_several(own: Sequence[tuple[int, KnownEntity]], found: dict[int, dict[str, Setting]]) -> None:
    """Tell subscriptions that replace each other, and publications with several QoS."""
    alike = grouped(((each.role, each.topic), (position, each)) for position, each in own if each.kind != WILL)
    for (role, _), several in alike.items():
        if len(several) == 1:
            continue
        levels = {level.text for _, endpoint in several if (level := endpoint.setting(QOS)) is not None}
        different: set[object] = {_written(each) for _, each in several} if role == SUBSCRIBER else {*levels}
        for position, _ in several if len(different) > 1 else ():
            found[position]["repeated" if role == SUBSCRIBER else "mixed_qos"] = _TRUE


def _written(endpoint: KnownEntity) -> tuple[object, ...]:
    return tuple(endpoint.value(policy) for policy in POLICIES if policy.level == ENDPOINT and not policy.derived)


def _wills(
    participants: Iterable[KnownEntity], by_client: Mapping[str, Sequence[tuple[int, KnownEntity]]]
) -> Iterable[Endpoint]:
    """Yield the Will of each client that has one, as the publication that it is."""
    for each in participants:
        topic = each.setting(WILL_TOPIC)
        own = [endpoint for _, endpoint in by_client.get(each.id, ())]
        if topic is None or not topic.text or any(endpoint.kind == WILL for endpoint in own):
            continue
        settings = {WILL: _TRUE}
        stated = {"qos": WILL_QOS, "retain": WILL_RETAIN, "message_expiry_interval": WILL_EXPIRY}
        settings |= {name: value for name, policy in stated.items() if (value := each.setting(policy)) is not None}
        payload = each.setting(WILL_PAYLOAD)
        if payload is not None and payload.unknown:
            settings["max_payload"] = payload
        elif payload is not None:
            settings["max_payload"] = Setting(str(len(payload.text.encode(errors="replace"))), payload.place)
        if any(endpoint.role == PUBLISHER and endpoint.topic == topic.text for endpoint in own):
            settings["closing_message"] = _TRUE
        yield Endpoint(
            id=f"{each.id}/will",
            role=PUBLISHER,
            topic=topic.text,
            participant=each.id,
            settings=settings,
            kind=WILL,
            external=each.external,
            template=f"{each.template}/will" if each.template is not None else None,
            place=topic.place or each.place,
        )
