"""Reads a ``connection`` block of mosquitto.conf: a bridge from the broker to another one, with its topics and QoS.

`topic PATTERN [out|in|both] [QOS] [LOCAL-PREFIX] [REMOTE-PREFIX]`: the prefixes stand before the pattern on their side. The
bridge subscribes and publishes with the stated QoS, and passes the RETAIN flag on. It keeps its session without
``cleansession true`` (mosquitto.conf(5), configuring bridges).
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.model.settings import EVERY_OTHER, Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Bridge, Broker, Endpoint, Participant, Room, Route
from cqos_mqtt.filters import has_wildcards, intersection, wrong_wildcards
from cqos_mqtt.importers.mosquitto_directives import ADDRESSES, CANNOT_MATTER, UNDECIDED_OF_BRIDGES
from cqos_mqtt.names import PATTERN
from cqos_mqtt.sessions import BRIDGE_STATES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Role, System
    from cqos_core.packs.file_importer import FileImporter
    from cqos_mqtt.importers.mosquitto import Line

_DIRECTIONS: Final = {"out": ("out",), "in": ("in",), "both": ("out", "in")}
_VERSIONS: Final = {"mqttv31": "3.1.1", "mqttv311": "3.1.1", "mqttv50": "5.0"}
FLAGS: Final = {"true": "true", "1": "true", "false": "false", "0": "false"}
"""The words that Mosquitto takes for a flag."""
_QUALITIES: Final = ("0", "1", "2")
_PORT: Final = "1883"
_TAKES_BACK: Final = "own"
TAKEN: Final = frozenset(
    (
        *(
            *ADDRESSES,
            "bridge_outgoing_retain",
            "bridge_protocol_version",
            "bridge_session_expiry_interval",
        ),
        *("cleansession", "clientid", "keepalive_interval", "local_cleansession", "local_clientid"),
        *("notification_topic", "notifications", "notifications_local_only", "remote_clientid", "topic", "try_private"),
    )
)
"""The directives of a connection that are taken as settings."""
OF_CONNECTIONS: Final = frozenset(
    (
        *TAKEN,
        *UNDECIDED_OF_BRIDGES,
        *(name for name in CANNOT_MATTER if name.startswith(("bridge_", "local_", "remote_"))),
        *("attempt_unsubscribe", "idle_timeout", "password", "restart_timeout", "threshold", "username"),
    )
)
"""The directives that belong to the connection above them; others below it are about the broker."""

_POLICIES: Final = {
    "cleansession": "clean_start",
    "local_cleansession": "clean_start",
    "keepalive_interval": "keep_alive",
    "clientid": "client_id",
    "local_clientid": "client_id",
    "remote_clientid": "client_id",
    "bridge_protocol_version": "protocol_version",
    "bridge_session_expiry_interval": "session_expiry_interval",
}
_RETAINED: Final = {"try_private": ("in",), "bridge_outgoing_retain": ("out",), "bridge_protocol_version": ("in",)}
"""The ways whose RETAIN flag a directive decides."""


def add_bridge(reading: FileImporter, local_broker: str, name: str, lines: Sequence[Line]) -> None:
    """Add one bridge, as a client of either broker and a route for each topic.

    Raises:
        ValueError: Mosquitto refuses a line; the text says why, its second argument is the line.
    """
    system = reading.system
    refused = [line for line in lines if line.refused]
    lines = [line for line in lines if not line.refused]
    stated = {line.name: line for line in lines if line.name != "topic"}
    addresses = [line for line in lines if line.name in ADDRESSES]
    if not addresses:
        raise ValueError("a connection needs an `address`", lines[0])
    if len(addresses) > 1:
        raise ValueError("another line has the addresses of the connection", addresses[1])
    address = addresses[0]
    host, port = _host_and_port(address.value.split()[0])
    remote_broker = f"{host}:{port}"
    system.brokers.setdefault(remote_broker, Broker(remote_broker, "mqtt", place=address.place))
    local, remote = f"{name} ({local_broker})", f"{name} ({local_broker} at {host})"
    client_id = f"{local_broker}.{name}"
    unclear = {_POLICIES[line.name]: _unknown(line) for line in refused if line.name in _POLICIES}
    here = _connection(stated, local_broker, f"local.{client_id}", here=True) | unclear
    there = _connection(stated, remote_broker, client_id, here=False) | unclear
    system.participants[local] = Participant(local, "mqtt", here, place=lines[0].place)
    system.participants[remote] = Participant(remote, "mqtt", there, external=True, place=lines[0].place)
    five = "bridge_protocol_version" in stated and _word(stated["bridge_protocol_version"]) == "mqttv50"
    # As a bridge, or by the options of 5.0, it is sent messages with their RETAIN flag and never its own ones.
    knows = five or _is_true(stated, "try_private", otherwise=True)
    retained = {
        "out": Setting("from_publishers" if _is_true(stated, "bridge_outgoing_retain", otherwise=True) else "false"),
        "in": Setting("from_publishers" if knows else "unknown"),
    }
    for line in refused:
        retained |= dict.fromkeys(_RETAINED.get(line.name, ()), _unknown(line))
    any_topic = next((_unknown(line) for line in refused if line.name == "topic"), None)
    routes: list[Route] = []
    for line in lines:
        if line.name == "topic":
            routes += _routes(local, remote, line, retained, any_topic)
    if not knows:
        back = dict(_brought_back([line for line in lines if line.name == "topic"]))
        for filter_, place in back.items():
            message = (
                f"with `try_private false` the broker at {host} sends back what it gets over bridge `{name}`: what is "
                f"published here on `{filter_}` arrives here twice"
            )
            reading.note("MQTT943", message, place)
        if back:
            here["brings_back"] = Setting(json.dumps(list(back)), next(iter(back.values())), derived=True)
    for line in lines:
        about = UNDECIDED_OF_BRIDGES.get(line.name)
        several = line is not address or len(line.value.split()) > 1
        if about and several and _word(line) not in about.harmless:
            message = f"`{line.name} {line.value}` {about.effect}, which is not modelled"
            reading.note("MQTT948", message, line.place)
            for side in (here, there):
                side[EVERY_OTHER] = Setting(line.value, line.place, unknown=message, reported="MQTT948")
    _notifications(system, stated, local, remote)
    carries = () if knows else (_TAKES_BACK,)
    system.bridges[local] = Bridge(local, tuple(routes), carries, place=lines[0].place)


def _unknown(line: Line) -> Setting:
    """Return what a misspelt line leaves open; that Mosquitto refuses it is reported where it is read."""
    return Setting(line.value, line.place, unknown=line.refused, reported="CQ040")


def _host_and_port(address: str) -> tuple[str, str]:
    """Split an address; those of IPv6 have colons of their own."""
    host, colon, port = address.rpartition(":")
    if not colon or (":" in host and not host.endswith("]")):
        host, port = address, _PORT
    return host.strip("[]"), port or _PORT


def _is_true(stated: dict[str, Line], name: str, *, otherwise: bool) -> bool:
    """Return a flag of a connection.

    Raises:
        ValueError: Mosquitto refuses its value.
    """
    line = stated.get(name)
    if line is None:
        return otherwise
    word = _word(line)
    if word not in FLAGS:
        raise ValueError("expected true or false", line)
    return FLAGS[word] == "true"


def _word(line: Line) -> str:
    """Return the first word of a line; Mosquitto passes over what follows a flag, a number or a word of its own."""
    return line.value.partition(" ")[0]


def _notifications(system: System, stated: dict[str, Line], local: str, remote: str) -> None:
    """Add what the bridge publishes of its own state: ``1`` on either broker, ``0`` as its Will, retained."""
    if not _is_true(stated, "notifications", otherwise=True):
        return
    given = stated.get("remote_clientid") or stated.get("clientid")
    written = stated.get("notification_topic")
    topic = written.value if written else BRIDGE_STATES.replace("+", given.value if given else "+")
    settings: Settings = {"qos": Setting("1"), "retain": Setting("true")}
    kind = PATTERN if has_wildcards(topic) else "message"
    there = () if _is_true(stated, "notifications_local_only", otherwise=False) else (remote,)
    for side in (local, *there):
        system.endpoints.append(
            Endpoint(
                id=f"{side}/publisher/{topic}",
                role=PUBLISHER,
                topic=topic,
                participant=side,
                settings=dict(settings),
                kind=kind,
                external=True,
                label="state of the bridge",
                place=(written or system.participants[side]).place,
            )
        )
    if there and kind != PATTERN:
        system.participants[remote].settings |= {
            "will.topic": Setting(topic),
            "will.payload": Setting("0"),
            "will.qos": Setting("1"),
            "will.retain": Setting("true"),
        }


def _connection(stated: dict[str, Line], broker: str, client_id: str, *, here: bool) -> Settings:
    """The connection to one of the brokers; what is not stated is as Mosquitto has it."""
    clean = (stated.get("local_cleansession") if here else None) or stated.get("cleansession")
    given = stated.get("local_clientid") if here else stated.get("remote_clientid") or stated.get("clientid")
    version = stated.get("bridge_protocol_version")
    settings = {
        "broker": Setting(broker),
        "client_id": _given(given, client_id),
        "clean_start": _given(clean, "false"),
        "keep_alive": _given(stated.get("keepalive_interval"), "60"),
        "protocol_version": Setting("3.1.1") if version is None or here else _version(version),
    }
    expiry = stated.get("bridge_session_expiry_interval")
    if expiry is not None and settings["protocol_version"].text == "5.0":
        settings["session_expiry_interval"] = _given(expiry, "")
    return settings


def _given(line: Line | None, otherwise: str) -> Setting:
    if line is None:
        return Setting(otherwise)
    text = line.value if line.name.endswith("clientid") else _word(line)
    return Setting(FLAGS.get(text, text) if "clean" in line.name else text, line.place, derived=True)


def _version(line: Line) -> Setting:
    word = _word(line)
    if word not in _VERSIONS:
        raise ValueError(f"expected one of {', '.join(_VERSIONS)}", line)
    return Setting(_VERSIONS[word], line.place, derived=True)


def _routes(
    local: str, remote: str, line: Line, retained: dict[str, Setting], unclear: Setting | None
) -> Iterator[Route]:
    """Yield the ways of one ``topic`` line; ``unclear`` is another one that may be about the same topics."""
    pattern, ways, qos, here, there = _topic(line)
    settings: Settings = {"qos": unclear or Setting(qos, line.place)}
    for name, expression in _named(pattern):
        for way in ways:
            ends = ((local, f"{here}{name}"), (remote, f"{there}{name}"))
            (source, from_topic), (target, to_topic) = ends if way == "out" else ends[::-1]
            before = here if way == "out" else there
            sent = {**settings, "retain": replace(retained[way], place=line.place, derived=True)}
            yield Route(
                _end(source, SUBSCRIBER, from_topic, {**settings, "taken_every": _AT_ONCE}, line.place),
                _end(target, PUBLISHER, to_topic, sent, line.place),
                line.place,
                () if expression is None else (f"{re.escape(before)}{expression}",),
                # A wildcard at the start matches no name that begins with `$`.
                (r"\$.*",) if pattern[:1] in {"+", "#"} and not before else (),
            )


class _Topic(NamedTuple):
    """One ``topic`` line: a filter, the ways in which it is carried, and the prefixes on both sides."""

    pattern: str
    ways: tuple[str, ...]
    qos: str
    here: str
    there: str


def _topic(line: Line) -> _Topic:
    """Read a ``topic`` line.

    Raises:
        ValueError: Mosquitto refuses it.
    """
    if not line.value.split():
        raise ValueError("it needs a value", line)
    pattern, *rest = (part.strip('"') for part in line.value.split())
    direction, qos, here, there = [*rest, *("out", "0", "", "")[len(rest) :]][:4]
    if direction not in _DIRECTIONS:
        raise ValueError(f"expected one of {', '.join(_DIRECTIONS)} as the direction", line)
    if qos not in _QUALITIES:
        raise ValueError("expected 0, 1 or 2 as the QoS", line)
    if wrong := wrong_wildcards(pattern):
        raise ValueError(f"`{pattern}` is no filter: {wrong}", line)
    return _Topic(pattern, _DIRECTIONS[direction], qos, here, there)


def _brought_back(lines: Sequence[Line]) -> Iterator[tuple[str, Place]]:
    """Yield the filters here whose topics go out by one line and come in by another, or the same, under their own name."""
    topics = [(_topic(line), line.place) for line in lines]
    for (out, place), (back, _) in product(topics, repeat=2):
        if "out" not in out.ways or "in" not in back.ways:
            continue
        longer, shorter = (out, back) if len(out.here) >= len(back.here) else (back, out)
        more = longer.here[len(shorter.here) :]
        if (longer.here, longer.there) != (f"{shorter.here}{more}", f"{shorter.there}{more}"):
            continue
        common = intersection(f"{out.here}{out.pattern}", f"{back.here}{back.pattern}")
        if common is not None:
            yield common, place


def _named(pattern: str) -> Iterator[tuple[str, str | None]]:
    """Yield as which names with a ``*`` a filter is carried, each with the expression that its names match."""
    levels = pattern.split("/")
    if "+" in levels:
        yield "*", _expression(levels)
    elif levels[-1] == "#":
        yield f"{pattern.removesuffix('#')}*", None
        if len(levels) > 1:  # `t/#` carries `t` too
            yield pattern.removesuffix("/#"), None
    else:
        yield pattern, None


def _expression(levels: Sequence[str]) -> str:
    """Write a filter as a regular expression over names."""
    *parts, last = (_ONE if level == "+" else re.escape(level) for level in levels)
    if levels[-1] == "#":
        return f"{'/'.join(parts)}(?:/.*)?"
    return "/".join((*parts, last))


_ONE: Final = "[^/]*"
_AT_ONCE: Final = Setting("0s")
"""How often a bridge takes messages: no program stands between, the broker itself takes what comes and passes it on."""


def _end(participant: str, role: Role, topic: str, settings: Settings, place: Place) -> Endpoint:
    # A missing partner of a bridged topic is no mistake: the other side is often in no file.
    return Endpoint(
        id="",
        role=role,
        topic=topic,
        participant=participant,
        settings=dict(settings),
        external=True,
        place=place,
        room=Room(place, ("qos",), restated=True),
    )
