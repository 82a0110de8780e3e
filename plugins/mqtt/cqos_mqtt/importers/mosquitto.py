"""Reads configurations of Mosquitto: the limits of the broker, who may publish and read what, and its bridges.

The broker is called after the file (`mosquitto.conf` is `mosquitto`), or as the switch `mosquitto.broker` says. An acl_file is
opened where the configuration names it.
"""

from __future__ import annotations

import json
from pathlib import PurePath
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.encoding import decode
from cqos_core.importers.reading import Reading, listed, shown
from cqos_core.problems import InputError, Problem
from cqos_core.system import Broker, Place, ProfileRef, Setting, System
from cqos_mqtt.importers.codes import note
from cqos_mqtt.importers.mosquitto_bridge import add_bridge
from cqos_mqtt.kinds import LONGEST
from cqos_mqtt.sessions import ANYBODY, NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.importers.source import ReadContext, Source
    from cqos_core.system import Settings

SWITCH: Final = "broker"
_UNITS: Final = {"h": 3600, "d": 86_400, "w": 7 * 86_400, "m": 30 * 86_400, "y": 365 * 86_400}
_ACCESS: Final = ("read", "write", "readwrite", "deny")


class Line(NamedTuple):
    """One directive: its name, the rest of its line, and where it stands."""

    name: str
    value: str
    place: Place


def read(source: Source, context: ReadContext) -> System:
    """Read a configuration as a broker.

    Raises:
        InputError: a directive has a value that Mosquitto refuses.
    """
    return _Reader(source, context).read()


class _Reader(Reading):
    """Reads one configuration and what it names."""

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, [], [])
        self.context = context
        self.settings: Settings = {}
        self.sources = {source.name: source.data}

    def read(self) -> System:
        """Read all directives."""
        switches = dict(self.context.options.get("mosquitto", {}))
        for name in switches:
            if name != SWITCH:
                message = f"the importer `mosquitto` has no switch {shown(name)}; it has {SWITCH}"
                raise InputError([Problem("CQ047", message)])
        listeners = 0
        bridges: list[list[Line]] = []
        for line in _lines(self.source):
            if line.name == "connection":
                bridges.append([line])
                continue
            if bridges:
                bridges[-1].append(line)
                continue
            listeners += line.name == "listener"
            take = _DIRECTIVES.get(line.name)
            if take is not None:
                self.directive(line, take)
                if listeners and line.name in _OF_LISTENERS:
                    message = f"`{line.name}` holds for one listener, and is taken for the whole broker"
                    self.notes.append(note("MQTT942", message, line.place))
            elif line.name == "acl_file":
                self.access(line)
        name = switches.get(SWITCH) or PurePath(self.source.name).stem or "mosquitto"
        place = Place(self.source.name, 1, 1)
        broker = Broker(name, "mqtt", self.settings, (ProfileRef("mosquitto", place),), place)
        system = System(name, "mqtt", brokers={name: broker}, notes=self.notes, sources=self.sources)
        for lines in bridges:
            try:
                add_bridge(system, name, lines[0].value or "bridge", lines)
            except ValueError as error:
                why, line = error.args
                message = f"Mosquitto refuses `{line.name} {line.value}`: {why}"
                self.problems.append(Problem("MQTT940", message, line.place))
        if self.problems:
            raise InputError(self.problems)
        return system

    def directive(self, line: Line, take: Callable[[str], tuple[str, str]]) -> None:
        """Take one directive as a setting."""
        try:
            policy, text = take(line.value)
        except ValueError as error:
            message = f"Mosquitto refuses `{line.name} {line.value}`: {error}"
            self.problems.append(Problem("MQTT940", message, line.place))
            return
        known = self.settings.get(policy)
        # Of several listeners the stricter value is taken.
        if known is None or not _is_number(known.text) or not _is_number(text) or int(text) < int(known.text):
            self.settings[policy] = Setting(text, line.place)

    # Access

    def access(self, line: Line) -> None:
        """Read the acl_file that a line names."""
        try:
            opened = self.context.open(line.value, self.source.name)
        except InputError as error:
            why = error.problems[0].message
            self.notes.append(note("MQTT941", f"the acl_file {shown(line.value)} is not read: {why}", line.place))
            return
        self.sources[opened.name] = opened.data
        self.settings["acl"] = Setting(json.dumps(list(self.entries(opened)), ensure_ascii=False), line.place)

    def entries(self, source: Source) -> Iterator[str]:
        """Yield the lines of an acl_file as ``access who topic``."""
        user = NOBODY
        for line in _lines(source):
            if line.name == "user":
                user = line.value
                continue
            if line.name not in {"topic", "pattern"}:
                message = f"an acl_file has lines of user, topic and pattern, not of {shown(line.name)}"
                self.problems.append(Problem("MQTT940", message, line.place))
                continue
            first, _, rest = line.value.partition(" ")
            access, topic = (first, rest.strip()) if first in _ACCESS and rest.strip() else ("readwrite", line.value)
            yield f"{access} {ANYBODY if line.name == 'pattern' else user.replace(' ', '_')} {topic}"


def _lines(source: Source) -> Iterator[Line]:
    """Yield the directives of a file; a line that begins with `#` is a comment."""
    for number, text in enumerate(decode(source.data).splitlines(), 1):
        written = text.strip()
        if written and not written.startswith("#"):
            name, _, value = written.partition(" ")
            yield Line(name, value.strip(), Place(source.name, number, len(text) - len(text.lstrip()) + 1))


def _is_number(text: str) -> bool:
    return text.isdecimal()


def _number(policy: str, least: int, most: int, none: int | None = None) -> Callable[[str], tuple[str, str]]:
    """Return a reader of a whole number; ``none`` is the one that stands for no limit."""

    def take(text: str) -> tuple[str, str]:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise ValueError(f"expected a whole number from {least} to {most}")
        return policy, "unlimited" if none is not None and int(text) == none else text

    return take


def _flag(policy: str) -> Callable[[str], tuple[str, str]]:
    def take(text: str) -> tuple[str, str]:
        if text not in {"true", "false"}:
            raise ValueError(f"expected {listed(('true', 'false'))}")
        return policy, text

    return take


def _period(text: str) -> tuple[str, str]:
    number, unit = text[:-1], text[-1:]
    if not number.isdecimal() or unit not in _UNITS:
        raise ValueError(f"expected a number with one of {', '.join(_UNITS)} after it")
    return "session_expiry_interval", f"{min(int(number) * _UNITS[unit], LONGEST)}s"


def _autosave(text: str) -> tuple[str, str]:
    """Read seconds; 0 saves only at the end."""
    name, seconds = _number("autosave_interval", 0, LONGEST)(text)
    return name, "infinite" if int(seconds) == 0 else f"{seconds}s"


_DIRECTIVES: Final = {
    "max_qos": _number("maximum_qos", 0, 2),
    "retain_available": _flag("retain_available"),
    "max_queued_messages": _number("max_queued_messages", 0, 65_535, 0),
    "max_inflight_messages": _number("max_inflight_messages", 0, 65_535, 0),
    "queue_qos0_messages": _flag("queue_qos0_messages"),
    "max_packet_size": _number("maximum_packet_size", 20, 268_435_456),
    "message_size_limit": _number("maximum_packet_size", 0, 268_435_456, 0),
    "max_keepalive": _number("server_keep_alive", 10, 65_535),
    "persistence": _flag("persistence"),
    "persistent_client_expiration": _period,
    "max_queued_bytes": _number("max_queued_bytes", 0, LONGEST, 0),
    "autosave_interval": _autosave,
    "upgrade_outgoing_qos": _flag("upgrade_outgoing_qos"),
    "max_topic_alias": _number("topic_alias_maximum", 0, 65_535),
}
_OF_LISTENERS: Final = frozenset(("max_qos", "max_topic_alias"))
