"""Adds settings to AsyncAPI documents, Thing Descriptions, flows of Node-RED and mosquitto.conf; comments and layout stay."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.files.yaml_edits import difference, insert, insert_nested, state
from cqos_core.model.encoding import Lines
from cqos_core.packs import INFINITE, Duration

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place
    from cqos_core.model.source import Replacement

BINDINGS: Final = {
    "clean_start": "cleanSession",
    "no_local": "x-noLocal",
    "qos": "qos",
    "retain": "retain",
    "retain_as_published": "x-retainAsPublished",
}
"""The field of an MQTT binding in AsyncAPI for a policy, of those whose values are written alike."""
TERMS: Final = {"qos": "mqv:qos", "retain": "mqv:retain"}
"""The term of a form in a Thing Description for a policy."""
FIELDS: Final = {"no_local": "nl", "qos": "qos", "retain": "retain", "retain_as_published": "rap"}
"""The field of a node of Node-RED for a policy, of those whose values are written alike."""
_ROUTE: Final = re.compile(
    r'(?P<head>\s*topic\s+(?:"[^"]*"|\S+)(?:\s+(?P<way>in|out|both))?)(?:\s+(?P<qos>[012])(?=\s|$))?'
)


def insert_bindings(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """Add fields to the MQTT binding of the operation or server at ``place``."""
    return insert_nested(text, place, ("bindings", "mqtt"), {BINDINGS[name]: value for name, value in settings.items()})


def insert_terms(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """Add terms to the form at ``place``."""
    return insert(text, place, {TERMS[name]: value for name, value in settings.items()}, typed=True)


def state_fields(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """State fields of the node at ``place``."""
    return state(text, place, {FIELDS[name]: value for name, value in settings.items()})


def state_directives(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """State limits of the broker at the start of the file, or the QoS of the ``topic`` line at ``place``."""
    changed = text
    for name, value in settings.items():
        if name == "qos":
            made = _route(changed, place, value)
        else:
            directive = _directive(name, value)
            made = None if directive is None else _stated(changed, *directive, everywhere=name in OF_LISTENERS)
        if made is None:
            return None
        changed = made
    return difference(text, changed)


def _route(text: str, place: Place, value: str) -> str | None:
    start = Lines(text).start(place.line or 0)
    found = _ROUTE.match(text, start) if start is not None else None
    if found is None:
        return None
    way = "" if found["way"] else " out"
    return f"{text[: found.end('head')]}{way} {value}{text[found.end() :]}"


def _directive(name: str, value: str) -> tuple[str, tuple[str, ...], str] | None:
    """Return a directive, the names that it has to take the place of, and its value; None where it cannot say that."""
    names = DIRECTIVES[name]
    if name == "session_expiry_interval":
        seconds = _seconds(value)
        return None if seconds is None else (names[0], names, f"{-(-seconds // 3600)}h")
    if name == "server_keep_alive":
        seconds = _seconds(value)
        return None if not seconds or seconds < LEAST_KEEP_ALIVE else (names[0], names, str(seconds))
    if value == "unlimited":
        return names[-1], names, "0"
    return names[0], names, value


def _seconds(value: str) -> int | None:
    read = Duration().parse(value)
    return None if read >= INFINITE else read // 1_000_000_000


def _stated(text: str, name: str, names: tuple[str, ...], value: str, *, everywhere: bool) -> str:
    """State a directive where it, or one that means the same, stands; else of every listener, or of the whole broker."""
    lines = text.splitlines(keepends=True)
    newline = "\r\n" if "\r\n" in text else "\n"
    words = [line.split(None, 1)[:1] for line in lines]
    there = [number for number, word in enumerate(words) if word and word[0] in names]
    for number in there:
        line = lines[number]
        indent, end = line[: len(line) - len(line.lstrip())], line[len(line.rstrip()) :]
        lines[number] = f"{indent}{name} {value}{end}"
    if there:
        return "".join(lines)
    heads = [number for number, word in enumerate(words) if word in (["listener"], ["connection"])]
    if everywhere and (listeners := [number for number in heads if words[number] == ["listener"]]):
        for number in listeners:
            lines[number] = f"{lines[number].rstrip()}{newline}{name} {value}{newline}"
    elif heads:
        lines.insert(heads[0], f"{name} {value}{newline}")
    else:
        head = "" if not lines or lines[-1].endswith("\n") else newline
        lines.append(f"{head}{name} {value}{newline}")
    return "".join(lines)


LEAST_KEEP_ALIVE: Final = 10
"""Seconds; Mosquitto refuses a lower `max_keepalive`."""
DIRECTIVES: Final = {
    "maximum_qos": ("max_qos",),
    "retain_available": ("retain_available",),
    "max_queued_messages": ("max_queued_messages",),
    "max_queued_bytes": ("max_queued_bytes",),
    "max_inflight_messages": ("max_inflight_messages",),
    "queue_qos0_messages": ("queue_qos0_messages",),
    "maximum_packet_size": ("max_packet_size", "message_size_limit"),
    "server_keep_alive": ("max_keepalive",),
    "persistence": ("persistence",),
    "session_expiry_interval": ("persistent_client_expiration",),
    "topic_alias_maximum": ("max_topic_alias",),
}
"""The directives of mosquitto.conf that state a policy of the broker; without a limit, the last of them is 0."""
OF_LISTENERS: Final = frozenset(("maximum_qos", "topic_alias_maximum"))
