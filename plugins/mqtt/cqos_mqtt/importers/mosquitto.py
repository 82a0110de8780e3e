"""Reads configurations of Mosquitto: the limits of the broker, who may publish and read what, and its bridges.

The broker is called after the file (`mosquitto.conf` is `mosquitto`), or as the switch `mosquitto.broker` says. An acl_file and
the files of an include_dir are opened where the configuration names them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.importers.source_reading import listed, read_switches, shown
from cqos_core.model.encoding import decode
from cqos_core.model.problems import InputError
from cqos_core.model.settings import EVERY_OTHER, Cases, Place, Setting
from cqos_core.model.system import Broker, Part, ProfileRef, Room
from cqos_core.packs.file_importer import FileImporter
from cqos_core.packs.qos_keys import looks_like_qos
from cqos_mqtt.importers.codes import CODES
from cqos_mqtt.importers.dynamic_security import PLUGIN, UnclearAccessError, access_of
from cqos_mqtt.importers.editing import DIRECTIVES, LEAST_KEEP_ALIVE
from cqos_mqtt.importers.mosquitto_bridge import FLAGS, OF_CONNECTIONS, add_bridge
from cqos_mqtt.importers.mosquitto_directives import CANNOT_MATTER, UNDECIDED
from cqos_mqtt.kinds import LONGEST
from cqos_mqtt.sessions import EVERY_USER, NO_USER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from cqos_core.model.settings import Settings
    from cqos_core.model.source import ReadContext, Source

SWITCH: Final = "broker"
_PORT: Final = "1883"
_CONF: Final = b".conf"
_UNITS: Final = {"h": 3600, "d": 86_400, "w": 7 * 86_400, "m": 30 * 86_400, "y": 365 * 86_400}
_ACCESS: Final = ("read", "write", "readwrite", "deny")
_PLUGINS: Final = ("plugin", "auth_plugin", "global_plugin", "plugin_load")
_OF_PLUGINS: Final = (*_PLUGINS, "plugin_opt_config_file", "auth_opt_config_file")


class Line(NamedTuple):
    """One directive: its name, the rest of its line, and where it stands; of a misspelt one the name that is meant."""

    name: str
    value: str
    place: Place
    refused: str = ""


@dataclass(slots=True, eq=False)
class _Listener:
    """Where clients connect, with what holds there only."""

    port: str = _PORT
    host: str = ""
    settings: Settings = field(default_factory=dict)


class _Reader(FileImporter):
    """Reads one configuration and what it names, line by line: most lines belong to what stands above them."""

    protocol = "mqtt"
    codes = {info.code: info for info in CODES}  # noqa: RUF012 - a table

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.settings: Settings = {}
        # Until a `listener` is named, lines are about the default one. It is opened where any is, or where there is no other.
        self.listeners = [_Listener()]
        self.listener = self.listeners[0]
        self.opens_default = False
        self.included = False
        self.access_files = 0
        self.dynamic = False  # the plugin whose options follow is that of dynamic security
        self.bridges: dict[str, list[Line]] = {}
        self.connection: list[Line] | None = None
        self.packet_limits: dict[str, str] = {}
        # Of equal ones the last, but each listener has its own.
        self.undecided: dict[tuple[_Listener | None, str], Line] = {}

    def run(self) -> None:
        """Read all directives."""
        switches = read_switches("mosquitto", self.context, {SWITCH: ()})
        self.file(self.source)
        if len(self.listeners) > 1 and not self.opens_default:
            del self.listeners[0]
        self.of_listeners()
        for line in self.undecided.values():
            self.leave_open(line)
        path = PurePath(self.source.name)
        name = switches.get(SWITCH) or path.stem or "mosquitto"
        place = Place(self.source.name, 1, 1)
        addresses = tuple(_addresses(self.listeners, {name, path.stem, path.parent.name}))
        profiles = (ProfileRef("mosquitto", place),)
        room = Room(place, tuple(DIRECTIVES), restated=True)
        broker = Broker(name, "mqtt", self.settings, profiles, place, addresses, room)
        self.system.name, self.system.brokers[name] = name, broker
        for lines in self.bridges.values():
            try:
                add_bridge(self, name, lines[0].value, lines)
            except ValueError as error:
                cause = f"Mosquitto refuses its line `{error.args[1].name}`"
                self.refused(error.args[1], error, Part("bridge", lines[0].value, cause, lines[0].place))

    def file(self, source: Source) -> None:
        """Read all lines of one file; each begins with the default listener and outside of all connections."""
        outer = self.listener, self.connection
        self.listener, self.connection = self.listeners[0], None
        for line in _lines(source):
            try:
                self.line(line)
            except ValueError as error:
                self.refused(line, error)
            self.opens_default |= self.listener is self.listeners[0] and line.name in _OPENS_DEFAULT
        self.listener, self.connection = outer

    def include(self, line: Line) -> None:
        """Read the files of a folder in the order of Mosquitto, which passes over folders that these name in turn."""
        if self.included:
            return
        try:
            names = self.context.open(f"{line.value.rstrip('/')}/", self.source.name).data.split(b"\n")
            wanted = sorted((each for each in names if each.endswith(_CONF) and each != _CONF), key=_by_letter)
            found = [self.context.open(f"{line.value.rstrip('/')}/{decode(each)}", self.source.name) for each in wanted]
        except InputError as error:
            cause = f"the files in {shown(line.value)} are not read"
            why = f"{cause}: {error.problems[0].message}; so what they may state is not known"
            self.note("MQTT944", why, line.place)
            self.settings[EVERY_OTHER] = Setting(line.value, line.place, unknown=cause, reported="MQTT944")
            return
        self.included = True
        for each in found:
            self.system.sources[each.name] = each.data
            self.file(each)
        self.included = False

    def refused(self, line: Line, error: ValueError, *unread: Part) -> None:
        """Say why Mosquitto does not start; what the line would state is not known, all else is read."""
        message = f"Mosquitto refuses `{f'{line.name} {line.value}'.strip()}`: {error.args[0]}"
        advice = f"write `{line.name} {line.value[1:].lstrip()}`" if line.value.startswith("=") else None
        self.note("MQTT940", message, line.place, advice, unread)
        if line.name in _DIRECTIVES:
            cause = f"Mosquitto refuses `{line.value}`"
            self.state(line, Setting(line.value, line.place, unknown=cause, reported="MQTT940"))

    def line(self, line: Line) -> None:
        """Read one line.

        Raises:
            ValueError: Mosquitto refuses it.
        """
        if line.name in _NEEDS_VALUE and not line.value:
            raise ValueError("it needs a value")
        if line.name == "connection":
            if line.value in self.bridges:
                raise ValueError("another connection has this name")
            self.connection = self.bridges[line.value] = [line]
        elif line.name in OF_CONNECTIONS:
            if self.connection is None:
                raise ValueError("it belongs below a `connection`")
            self.connection.append(line)
        elif line.name == "listener":
            port, _, host = line.value.partition(" ")
            self.listener = _Listener(port, host.strip())
            self.listeners.append(self.listener)
        elif line.name in {"port", "bind_address"}:
            setattr(self.listeners[0], {"port": "port", "bind_address": "host"}[line.name], line.value)
        elif line.name in _DIRECTIVES:
            self.directive(line)
        elif line.name == "acl_file" or line.name in _OF_PLUGINS:
            self.access(line)
        elif line.name == "include_dir":
            self.include(line)
        else:
            self.unread(line)

    def unread(self, line: Line) -> None:
        """Remember a directive that may decide; report one that Mosquitto does not know."""
        if line.name in UNDECIDED:
            self.undecided[self.listener if UNDECIDED[line.name].of_listener else None, line.name] = line
        elif line.name not in CANNOT_MATTER and not line.name.startswith(_OPTIONS_OF_PLUGINS):
            self.misspelt(line, looks_like_qos(line.name, (*_DIRECTIVES, *OF_CONNECTIONS, *UNDECIDED, *CANNOT_MATTER)))

    def directive(self, line: Line) -> None:
        """Take one directive as a setting; of several equal ones Mosquitto takes the last."""
        policy, take = _DIRECTIVES[line.name]
        # Mosquitto takes the first word, and passes over the rest of the line.
        text = take(line.value.partition(" ")[0])
        if policy == "maximum_packet_size":
            # Two directives limit a packet; the stricter counts.
            self.packet_limits[line.name] = text
            text = min(self.packet_limits.values(), key=lambda each: int(each) if each.isdecimal() else LONGEST)
        self.state(line, Setting(text, line.place))

    def state(self, line: Line, setting: Setting) -> None:
        """Take a setting for what a directive states, of the listener above it or of the broker."""
        settings = self.listener.settings if line.name in _OF_LISTENERS else self.settings
        settings[_DIRECTIVES[line.name][0]] = setting

    def leave_open(self, line: Line) -> None:
        """Say of a directive that is not modelled what is not known with it, unless it does nothing."""
        about = UNDECIDED[line.name]
        # Where there is no access control, nothing is forbidden.
        policies = [policy for policy in about.policies if policy != "acl" or policy in self.settings]
        if not policies or line.value.partition(" ")[0] in about.harmless:
            return
        cause = f"`{line.name} {line.value}` {about.effect}"
        self.note("MQTT948", f"{cause}, which is not modelled", line.place)
        for policy in policies:
            self.settings[policy] = Setting(line.value, line.place, unknown=cause, reported="MQTT948")

    def misspelt(self, line: Line, meant: str | None) -> None:
        """Say that Mosquitto does not know a directive, and so does not start: nothing is known of what it would do."""
        guess, advice = (f"; did you mean `{meant}`?", f"write `{meant}`") if meant else ("", "correct or remove it")
        self.warn(
            "CQ040", f"Mosquitto does not know {shown(line.name)}, and refuses to start{guess}", line.place, advice
        )
        cause = f"Mosquitto refuses {shown(line.name)}"
        if meant in OF_CONNECTIONS and self.connection is not None:
            self.connection.append(Line(meant, line.value, line.place, cause))
            return
        unknown = Setting(line.value, line.place, unknown=cause, reported="CQ040")
        self.settings[_DIRECTIVES[meant][0] if meant in _DIRECTIVES else EVERY_OTHER] = unknown

    def of_listeners(self) -> None:
        """Take what holds for one listener as what holds for the broker, where all have it alike."""
        for policy in sorted({policy for each in self.listeners for policy in each.settings}):
            stated = [each.settings.get(policy) for each in self.listeners]
            first = next(setting for setting in stated if setting is not None)
            cases = [
                (f"port {each.port}", _UNSTATED[policy] if setting is None else setting.text)
                for each, setting in zip(self.listeners, stated, strict=True)
            ]
            if self.bridges:
                cases.append(("a bridge of its own", _UNSTATED[policy]))
            if len({text for _, text in cases}) == 1:
                self.settings[policy] = first
                continue
            assumption = f"the listener of `{PurePath(self.source.name).name}` that clients use"
            self.settings[policy] = Setting(first.text, first.place, unknown=Cases(assumption, tuple(cases)))
            message = (
                f"`{policy}` differs among the listeners: {', '.join(f'{text} at {name}' for name, text in cases)}"
            )
            self.note("MQTT942", message, first.place or Place(self.source.name))

    # Access

    def access(self, line: Line) -> None:
        """Read the acl_file or the file of dynamic security that a line names."""
        if line.name in _PLUGINS:
            self.dynamic = PLUGIN in line.value
            if not self.dynamic:
                self.note("MQTT948", f"what the plugin {shown(line.value)} does is not known", line.place)
            return
        if line.name != "acl_file" and not self.dynamic:
            return
        self.access_files += 1
        try:
            lines = self.lines_of_access(line)
        except (InputError, UnclearAccessError) as error:
            why = error.problems[0].message if isinstance(error, InputError) else str(error)
            what = "acl_file" if line.name == "acl_file" else "dynamic security in"
            self.note("MQTT941", f"the {what} {shown(line.value)} is not read: {why}", line.place)
            self.settings.pop("acl", None)
        else:
            self.settings["acl"] = Setting(json.dumps(lines, ensure_ascii=False), line.place)

    def lines_of_access(self, line: Line) -> list[str]:
        """Return the lines of access control in the file that a line names.

        Raises:
            InputError: it cannot be opened.
            UnclearAccessError: lines cannot say what it says.
        """
        if self.dynamic and self.access_files > 1:
            raise UnclearAccessError("both an acl_file and dynamic security decide")
        opened = self.context.open(line.value, self.source.name)
        self.system.sources[opened.name] = opened.data
        return list(self.entries(opened)) if line.name == "acl_file" else access_of(opened)

    def entries(self, source: Source) -> Iterator[str]:
        """Yield the lines of an acl_file as ``access who topic``."""
        user = NO_USER
        for line in _lines(source):
            if line.name == "user":
                user = line.value
                continue
            if line.name not in {"topic", "pattern"}:
                message = f"an acl_file has lines of user, topic and pattern, not of {shown(line.name)}"
                self.note("MQTT940", message, line.place)
                raise UnclearAccessError(f"Mosquitto refuses its line {shown(line.name)}")
            first, _, rest = line.value.partition(" ")
            access, topic = (first, rest.strip()) if first in _ACCESS and rest.strip() else ("readwrite", line.value)
            yield f"{access} {EVERY_USER if line.name == 'pattern' else user.replace(' ', '_')} {topic}"


def _lines(source: Source) -> Iterator[Line]:
    """Yield the directives of a file; a line that begins with `#` is a comment."""
    for number, text in enumerate(decode(source.data).splitlines(), 1):
        written = text.strip()
        if written and not written.startswith("#"):
            name, _, value = written.partition(" ")
            yield Line(name, value.strip(), Place(source.name, number, len(text) - len(text.lstrip()) + 1))


def _by_letter(name: bytes) -> list[tuple[bytes, int]]:
    """Sort without regard to case, but the capital before the small letter at the first place where only that differs."""
    return [(bytes((letter,)).upper(), letter) for letter in name]


def _addresses(listeners: Iterable[_Listener], names: Iterable[str]) -> Iterator[str]:
    """Yield by which addresses others may name the broker: the names of its files stand for hosts."""
    for listener in listeners:
        hosts = {listener.host, *names} - {"", "0.0.0.0", "::", "."}  # noqa: S104 - what a file says
        yield from (f"{host.lower()}:{listener.port}" for host in sorted(hosts))
        yield f"localhost:{listener.port}"
        if listener.port not in _WELL_KNOWN:
            yield f"*:{listener.port}"


def _number(least: int, most: int, none: int | None = None) -> Callable[[str], str]:
    """Return a reader of a whole number; ``none`` is the one that stands for no limit."""

    def take(text: str) -> str:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise ValueError(f"expected a whole number from {least} to {most}")
        return "unlimited" if none is not None and int(text) == none else text

    return take


def _queue(most: int) -> Callable[[str], str]:
    """Return a reader of how much a queue holds: of 0, and of what is below, as much as there is."""
    take = _number(0, most, 0)
    return lambda text: "unlimited" if text.startswith("-") and text[1:].isdecimal() else take(text)


def _flag(text: str) -> str:
    if text not in FLAGS:
        raise ValueError(f"expected {listed(('true', 'false'))}")
    return FLAGS[text]


def _keep_alive(text: str) -> str:
    """Read seconds; 0 sets no limit, which Mosquitto takes since 2.0.13."""
    return "infinite" if text == "0" else _number(LEAST_KEEP_ALIVE, 65_535)(text)


def _period(text: str) -> str:
    number, unit = text[:-1], text[-1:]
    if not number.isdecimal() or unit not in _UNITS or int(number) == 0:
        raise ValueError(f"expected a number above 0 with one of {', '.join(_UNITS)} after it")
    return f"{min(int(number) * _UNITS[unit], LONGEST)}s"


def _autosave(text: str) -> str:
    """Read seconds; 0 saves only at the end."""
    seconds = _number(0, LONGEST)(text)
    return "infinite" if int(seconds) == 0 else f"{seconds}s"


_DIRECTIVES: Final = {
    **dict.fromkeys(("max_qos", "maximum_qos"), ("maximum_qos", _number(0, 2))),
    "retain_available": ("retain_available", _flag),
    "max_queued_messages": ("max_queued_messages", _queue(LONGEST)),
    "max_inflight_messages": ("max_inflight_messages", _queue(65_535)),
    "queue_qos0_messages": ("queue_qos0_messages", _flag),
    "max_packet_size": ("maximum_packet_size", _number(20, 268_435_456)),
    "message_size_limit": ("maximum_packet_size", _number(0, 268_435_456, 0)),
    "max_keepalive": ("server_keep_alive", _keep_alive),
    **dict.fromkeys(("persistence", "retained_persistence"), ("persistence", _flag)),
    "persistent_client_expiration": ("session_expiry_interval", _period),
    "max_queued_bytes": ("max_queued_bytes", _queue(LONGEST)),
    "autosave_interval": ("autosave_interval", _autosave),
    "upgrade_outgoing_qos": ("upgrade_outgoing_qos", _flag),
    "max_topic_alias": ("topic_alias_maximum", _number(0, 65_535)),
}
"""By directive: the policy that it states, and what reads its value."""
_OF_LISTENERS: Final = frozenset(("max_qos", "maximum_qos", "max_topic_alias"))
_UNSTATED: Final = {"maximum_qos": "2", "topic_alias_maximum": "10"}
"""What Mosquitto has where a listener does not state it."""
_WELL_KNOWN: Final = frozenset(("1883", "8883"))
_NEEDS_VALUE: Final = frozenset(
    ("connection", "address", "addresses", "topic", "listener", "port", "acl_file", "include_dir")
)
_OPENS_DEFAULT: Final = frozenset(
    (
        "port",
        "bind_address",
        "bind_interface",
        "max_qos",
        "maximum_qos",
        "max_topic_alias",
        "max_connections",
        "mount_point",
        "protocol",
        "socket_domain",
    )
)
TAKEN: Final = frozenset(
    (*_DIRECTIVES, *_OF_PLUGINS, "acl_file", "bind_address", "connection", "include_dir", "listener", "port")
)
"""The directives of a broker that are taken as settings, or lead to some."""
_OPTIONS_OF_PLUGINS: Final = ("plugin_opt_", "auth_opt_")


read = _Reader.load
