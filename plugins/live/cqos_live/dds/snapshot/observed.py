"""A system of the observed endpoints of a domain, with endpoints of ROS 2 where possible.

An endpoint becomes one of ROS 2 if its names are mangled as in ROS 2 and ROS 2 can express all that matters to a verdict. Two
topics become a service if both exist with equal QoS. All others stay endpoints of
DDS, and are compared with those of ROS 2 on the wire.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.files.export import unique_name
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, System, Topic, endpoint_id, numbered
from cqos_live.dds.snapshot import ros
from cqos_live.dds.snapshot.seen_endpoints import SeenParticipant

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.model.system import Role
    from cqos_live.dds.snapshot.ros import RosName
    from cqos_live.dds.snapshot.seen_endpoints import Seen, SeenEndpoint, SeenNode

PROTOCOL: Final = "dds"
_SERVICES: Final[dict[tuple[str, Role], str]] = {
    ("request", SUBSCRIBER): "service_server",
    ("response", PUBLISHER): "service_server",
    ("request", PUBLISHER): "service_client",
    ("response", SUBSCRIBER): "service_client",
}


def system_of(seen: Seen, *, with_ros: bool) -> System:
    """Return what was seen as a system; ``with_ros``: the pack of ROS 2 is there to judge its endpoints."""
    system = System(name=f"dds_domain_{seen.domain}", protocol=PROTOCOL)
    known = {each.key: each for each in seen.participants}
    for endpoint in seen.endpoints:
        known.setdefault(endpoint.participant, SeenParticipant(endpoint.participant))
    owners = _nodes(seen.nodes, known) if with_ros else {}
    of: dict[str, list[SeenEndpoint]] = defaultdict(list)
    for endpoint in sorted(seen.endpoints, key=lambda each: (each.participant, each.key)):
        of[owners.get((endpoint.participant, endpoint.key), endpoint.participant)].append(endpoint)
    for key, participant in _participants(known.values()):
        runs_ros = with_ros and known[key].implementation in ros.IMPLEMENTATIONS
        endpoints = list(_endpoints(of[key], participant.id, with_ros=runs_ros))
        system.participants[participant.id] = participant
        system.endpoints += endpoints
        if known[key].implementation is not None:
            # Both packs know the middleware by this name, and DDS alone by the other.
            both = any(each.protocol == ros.PROTOCOL for each in endpoints)
            participant.settings["rmw" if both else "implementation"] = Setting(str(known[key].implementation))
        if known[key].namespace and all(each.protocol == ros.PROTOCOL for each in endpoints):
            participant.protocol = ros.PROTOCOL
            # DDS has no namespaces, so a node is in one only where all that it has is of ROS 2.
            if known[key].namespace != "/":
                participant.settings["namespace"] = Setting(known[key].namespace)
    _number(system.endpoints)
    packs = [PROTOCOL, *({ros.PROTOCOL} if any(each.protocol for each in system.endpoints) else ())]
    system.options = {pack: {"domain": Setting(str(seen.domain))} for pack in packs}
    _keys(system, seen.endpoints)
    named = {endpoint.topic for endpoint in seen.endpoints}
    for topic in sorted(seen.topics, key=lambda each: (each.name, each.type)):
        if topic.name not in named:
            system.topics.setdefault(topic.name, Topic(topic.name, {"type": Setting(topic.type)}))
    return system


def _keys(system: System, seen: Iterable[SeenEndpoint]) -> None:
    """State of each topic of DDS whether it has keys, where its endpoints agree."""
    keyed: dict[str, set[bool | None]] = defaultdict(set)
    for each in seen:
        keyed[each.topic].add(each.keyed)
    for name in sorted({each.topic for each in system.endpoints if each.protocol is None and each.topic}):
        (known,) = keyed[name] if len(keyed[name]) == 1 else [None]
        if known is not None:
            system.topics[name] = Topic(name, {"keyed": Setting(str(known).lower())})


# Participants


def _nodes(nodes: Iterable[SeenNode], known: dict[str, SeenParticipant]) -> dict[tuple[str, str], str]:
    """Add nodes to the participants, each with what is known of its process; return whose each endpoint is."""
    owners: dict[tuple[str, str], str] = {}
    for node in nodes:
        process = known.get(node.participant)
        if process is not None and process.implementation in ros.IMPLEMENTATIONS:
            key = f"{node.participant} {node.namespace} {node.name}"
            known[key] = replace(process, key=key, name=node.name, namespace=node.namespace or "/")
            owners |= {(node.participant, endpoint): key for endpoint in node.endpoints}
    return owners


def _participants(known: Iterable[SeenParticipant]) -> Iterator[tuple[str, Participant]]:
    """Yield participants by their names, each with its key."""
    taken: set[str] = set()
    for each in sorted(known, key=lambda each: (_called(each), each.key)):
        yield each.key, Participant(unique_name(_called(each), taken), label=_described(each))


def _called(participant: SeenParticipant) -> str:
    """Return the name of a participant: that of its program, else of the process, else a unique one."""
    for name in (participant.name, participant.process):
        # Fast DDS calls every node of ROS 2 `/`.
        if any(map(str.isalnum, name)):
            return name
    return f"{participant.implementation or 'participant'}_{participant.key.replace('-', '')[4:24]}"


def _described(participant: SeenParticipant) -> str | None:
    """Return who runs a participant, beside its name."""
    name = _called(participant)
    process = "" if participant.process == name else participant.process
    details = [
        process,
        f"pid {participant.pid}" if participant.pid else "",
        participant.host and f"on {participant.host}",
    ]
    return f"{name} ({', '.join(filter(None, details))})" if any(details) else None


# Endpoints


def _endpoints(seen: Iterable[SeenEndpoint], participant: str, *, with_ros: bool) -> Iterator[Endpoint]:
    """Yield the endpoints of one participant."""
    parts: dict[tuple[str, RosName], list[tuple[SeenEndpoint, dict[str, str]]]] = defaultdict(list)
    for each in seen:
        name = ros.demangled(each.topic, each.type)
        of_ros = ros.settings(each.settings) if name is not None and with_ros else None
        if name is None or of_ros is None:
            yield _of_dds(each, participant, name)
        elif name.part == "topic":
            if name.plain:
                of_ros["avoid_ros_namespace_conventions"] = "true"
            yield _of_ros(each, participant, name, of_ros)
        else:
            kind = _SERVICES[name.part, each.role]
            parts[kind, ros.RosName("request", name.name, name.type)].append((each, of_ros))
    for (kind, name), members in parts.items():
        yield from _services(kind, name, members, participant)


def _services(
    kind: str, name: RosName, members: Sequence[tuple[SeenEndpoint, dict[str, str]]], participant: str
) -> Iterator[Endpoint]:
    """Yield the service that requests and responses make together; where they do not, they stay what they are."""
    sides = [[each for each in members if each[0].role == role] for role in (PUBLISHER, SUBSCRIBER)]
    for writer, reader in zip(*sides, strict=False):
        common = writer[1].keys() & reader[1].keys()
        if all(writer[1][policy] == reader[1][policy] for policy in common):
            yield _of_ros(reader[0], participant, name, {**reader[1], **writer[1]}, kind)
        else:
            yield from (_of_dds(each, participant, name) for each, _ in (writer, reader))
    fewer = min(map(len, sides))
    for side in sides:
        yield from (_of_dds(each, participant, name) for each, _ in side[fewer:])


def _of_dds(seen: SeenEndpoint, participant: str, name: RosName | None) -> Endpoint:
    label = seen.name or (f"{name.name} of ROS 2" if name is not None else None)
    return _endpoint(seen, participant, seen.topic, seen.type, seen.settings, label)


def _of_ros(
    seen: SeenEndpoint, participant: str, name: RosName, settings: Mapping[str, str], kind: str = "message"
) -> Endpoint:
    made = _endpoint(seen, participant, name.name, name.type, settings, seen.name or None)
    return replace(made, protocol=ros.PROTOCOL, kind=kind)


def _endpoint(
    seen: SeenEndpoint, participant: str, topic: str, type_name: str, settings: Mapping[str, str], label: str | None
) -> Endpoint:
    return Endpoint(
        id="",
        role=seen.role,
        topic=topic,
        participant=participant,
        settings={name: Setting(text) for name, text in settings.items()},
        type=type_name or None,
        observed=True,
        label=label,
    )


def _number(endpoints: Sequence[Endpoint]) -> None:
    """Give endpoints the ids that a system file gives them."""
    numbers: dict[str, int] = {}
    for endpoint in endpoints:
        kind = endpoint.role if endpoint.kind == "message" else endpoint.kind
        endpoint.id = numbered(endpoint_id(endpoint.participant, kind, endpoint.topic or ""), numbers)
