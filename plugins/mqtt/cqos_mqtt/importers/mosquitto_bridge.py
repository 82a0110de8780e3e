"""Reads a ``connection`` block of mosquitto.conf: a bridge from the broker to another one, with its topics and QoS.

`topic PATTERN [out|in|both] [QOS] [LOCAL-PREFIX] [REMOTE-PREFIX]`: the prefixes stand before the pattern on their side. The
bridge subscribes and publishes with the QoS that is stated, passes the RETAIN flag on, and keeps its session unless
``cleansession true`` is stated (mosquitto.conf(5), configuring bridges).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.system import PUBLISHER, SUBSCRIBER, Bridge, Broker, Endpoint, Participant, Route, Setting
from cqos_mqtt.filters import wrong_wildcards

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.system import Place, Role, Settings, System
    from cqos_mqtt.importers.mosquitto import Line

_DIRECTIONS: Final = {"out": ("out",), "in": ("in",), "both": ("out", "in")}
_VERSIONS: Final = {"mqttv31": "3.1.1", "mqttv311": "3.1.1", "mqttv50": "5.0"}
_QUALITIES: Final = ("0", "1", "2")
_PORT: Final = "1883"


def add_bridge(system: System, local_broker: str, name: str, lines: Sequence[Line]) -> None:
    """Add one bridge, as a client of either broker and a route for each topic.

    Raises:
        ValueError: Mosquitto refuses a line; the text says why, its second argument is the line.
    """
    stated = {line.name: line for line in lines if line.name != "topic"}
    address = stated.get("address") or stated.get("addresses")
    if address is None:
        raise ValueError("a connection needs an `address`", lines[0])
    host, _, port = address.value.split()[0].partition(":")
    remote_broker = f"{host}:{port or _PORT}"
    system.brokers.setdefault(remote_broker, Broker(remote_broker, "mqtt", place=address.place))
    local, remote = f"{name} (here)", f"{name} ({host})"
    for side, broker in ((local, local_broker), (remote, remote_broker)):
        own = _connection(stated, broker, f"local.{name}" if side == local else name, here=side == local)
        system.participants[side] = Participant(side, "mqtt", own, external=side == remote, place=lines[0].place)
    retained = stated.get("bridge_outgoing_retain")
    keeps_retain = retained is None or retained.value != "false"
    routes: list[Route] = []
    for line in lines:
        if line.name == "topic":
            routes += _routes(local, remote, line, keeps_retain=keeps_retain)
    system.bridges[name] = Bridge(name, tuple(routes), place=lines[0].place)


def _connection(stated: dict[str, Line], broker: str, client_id: str, *, here: bool) -> Settings:
    """The connection to one of the brokers; what is not stated is as Mosquitto has it."""
    clean = (stated.get("local_cleansession") if here else None) or stated.get("cleansession")
    given = stated.get("local_clientid") if here else stated.get("remote_clientid") or stated.get("clientid")
    version = stated.get("bridge_protocol_version")
    alive = stated.get("keepalive_interval")
    settings = {
        "broker": Setting(broker),
        "client_id": Setting(client_id) if given is None else Setting(given.value, given.place),
        "clean_start": Setting("false") if clean is None else Setting(clean.value, clean.place),
        "keep_alive": Setting("60") if alive is None else Setting(alive.value, alive.place),
        "protocol_version": Setting("3.1.1") if version is None or here else _version(version),
    }
    expiry = stated.get("bridge_session_expiry_interval")
    if expiry is not None and settings["protocol_version"].text == "5.0":
        settings["session_expiry_interval"] = Setting(expiry.value, expiry.place)
    return settings


def _version(line: Line) -> Setting:
    if line.value not in _VERSIONS:
        raise ValueError(f"expected one of {', '.join(_VERSIONS)}", line)
    return Setting(_VERSIONS[line.value], line.place)


def _routes(local: str, remote: str, line: Line, *, keeps_retain: bool) -> Iterator[Route]:
    """Yield the ways of one ``topic`` line."""
    pattern, *rest = (part.strip('"') for part in line.value.split())
    direction, qos, here, there = [*rest, *("out", "0", "", "")[len(rest) :]][:4]
    if direction not in _DIRECTIONS:
        raise ValueError(f"expected one of {', '.join(_DIRECTIONS)} as the direction", line)
    if qos not in _QUALITIES:
        raise ValueError("expected 0, 1 or 2 as the QoS", line)
    if wrong := wrong_wildcards(pattern):
        raise ValueError(f"`{pattern}` is no filter: {wrong}", line)
    levels = pattern.split("/")
    name = "*" if "+" in levels else pattern.removesuffix("#") + "*" if levels[-1] == "#" else pattern
    settings: Settings = {"qos": Setting(qos, line.place)}
    for way in _DIRECTIONS[direction]:
        ends = ((local, f"{here}{name}"), (remote, f"{there}{name}"))
        (source, from_topic), (target, to_topic) = ends if way == "out" else ends[::-1]
        sent = {**settings, **({"retain": Setting("unknown")} if way == "in" or keeps_retain else {})}
        yield Route(
            _end(source, SUBSCRIBER, from_topic, settings, line.place),
            _end(target, PUBLISHER, to_topic, sent, line.place),
            line.place,
            (_expression(from_topic.removesuffix("*"), levels),) if "+" in levels else (),
        )


def _expression(before: str, levels: Sequence[str]) -> str:
    """Write a filter behind a prefix as a regular expression over names."""
    *parts, last = (_ONE if level == "+" else re.escape(level) for level in levels)
    if levels[-1] == "#":
        return f"{re.escape(before)}{'/'.join(parts)}(?:/.*)?"
    return f"{re.escape(before)}{'/'.join((*parts, last))}"


_ONE: Final = "[^/]*"


def _end(participant: str, role: Role, topic: str, settings: Settings, place: Place) -> Endpoint:
    # What is bridged is nobody's slip: the other side is often in no file.
    return Endpoint("", role, topic, participant, dict(settings), external=True, place=place)
