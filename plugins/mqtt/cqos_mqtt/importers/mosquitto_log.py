"""Reads the log of Mosquitto: who was connected, and what each client subscribed and published.

`log_type subscribe` and `log_type unsubscribe` write subscriptions, `log_type notice` connections, and `log_type debug`
publications and Wills; `log_type all` writes all of them. A client counts with what it last did, also when it is gone. Other lines
are passed over. The log does not say what only 5.0 has, so that stays unknown.
"""

from __future__ import annotations

import re
from pathlib import PurePath
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import read_switches, shown
from cqos_core.model.encoding import decode
from cqos_core.model.settings import Place
from cqos_core.model.system import Broker, ProfileRef
from cqos_core.packs.file_importer import FileImporter
from cqos_mqtt.importers.codes import CODES
from cqos_mqtt.importers.seen_clients import SeenClient, fill

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.model.source import ReadContext, Source

SWITCH: Final = "broker"
_STAMP: Final = re.compile(r"(?:.*?\bmosquitto\[\d+\]: )?(?:\d[\d\-/.:TZ+ ]*: )?")
_PACKET: Final = r"\(d\d, q(?P<qos>\d), r(?P<retain>\d), m\d+, '(?P<topic>.*)', \.\.\. \(\d+ bytes\)\)"
_FURTHER: Final = re.compile(r"(?P<topic>.*?)(?: \(QoS (?P<qos>[012])\))?")
_GRANTED: Final = re.compile(r" (?P<qos>[012]) (?=\S)")
_GENERATED: Final = re.compile(r"auto-[0-9A-F]{8}-")
_VERSIONS: Final = {"1": "3.1.1", "2": "3.1.1", "5": "5.0"}
_UNREPORTED: Final = "the log of Mosquitto does not report it"
_TRUTH: Final = {"0": "false", "1": "true"}


class _Reader(FileImporter):
    """Follows the log line by line.

    Attributes:
        clients: by their ids.
        latest: who connected last; its Will follows.
        takes: what the indented lines below the last line are about.
        asked: subscriptions that a client asked for, by client and filter, until the broker grants them.
        grants, publishes: the log has lines of granted subscriptions, of publications.
    """

    protocol = "mqtt"
    codes = {info.code: info for info in CODES}  # noqa: RUF012 - a table

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.clients: dict[str, SeenClient] = {}
        self.latest: SeenClient | None = None
        self.takes: Callable[[str, str | None, Place], None] | None = None
        self.asked: dict[tuple[str, str], tuple[str, Place]] = {}
        self.ports: dict[str, None] = {}
        self.grants = self.publishes = False

    def run(self) -> None:
        """Read all lines, then add the broker and its clients."""
        switches = read_switches("mosquitto_log", self.context, {SWITCH: ()})
        for number, line in enumerate(decode(self.source.data).splitlines(), 1):
            stamp = _STAMP.match(line)
            self.line(line[stamp.end() if stamp else 0 :], Place(self.source.name, number, 1))
        first = Place(self.source.name, 1, 1)
        self.settle()
        if not self.publishes:
            self.note("MQTT945", "no line of this log is about a publication, so who publishes is not known", first)
        name = switches.get(SWITCH) or PurePath(self.source.name).stem or "mosquitto"
        addresses = tuple(f"{host}:{port}" for port in self.ports for host in ("localhost", "*"))
        broker = Broker(name, "mqtt", {}, (ProfileRef("mosquitto", first),), first, addresses)
        fill(self.system, broker, self.clients.values(), _UNREPORTED)

    def line(self, text: str, place: Place) -> None:
        """Read one line without its time."""
        if text.startswith("\t"):
            found = _FURTHER.fullmatch(text[1:])
            if found and self.takes is not None:
                self.takes(found["topic"], found["qos"], place)
            return
        if not text.startswith(_OTHERS):
            self.granted(text, place)  # the next filter of the same packet may follow
            return
        self.takes = None
        for pattern, take in _LINES:
            if found := pattern.fullmatch(text):
                take(self, found, place)
                return

    def client(self, name: str, place: Place) -> SeenClient:
        """Return the client of an id."""
        return self.clients.setdefault(name, SeenClient(name, place=place))

    def opened(self, found: re.Match[str], _: Place) -> None:
        """Take the port of a listener."""
        self.ports[found["port"]] = None

    def connected(self, found: re.Match[str], place: Place) -> None:
        """Take what a client states when it connects."""
        client = self.latest = self.client(found["client"], place)
        version = _VERSIONS.get(found["version"])
        client.five, client.place = None if version is None else version == "5.0", place
        client.settings = {"clean_start": _TRUTH[found["clean"]], "keep_alive": f"{found['alive']}s"}
        if found["user"]:
            client.settings["username"] = found["user"]
        if _GENERATED.match(client.id):
            client.settings["generated_client_id"] = "true"
        if found["clean"] == "1":
            client.forget_subscriptions()

    def will(self, found: re.Match[str], _: Place) -> None:
        """Take the Will of the client that connected last; its topic is in the next line."""
        client = self.latest
        if client is not None:
            stated = {"will.qos": found["qos"], "will.retain": _TRUTH[found["retain"]]}
            self.takes = lambda topic, _qos, _place: client.settings.update({"will.topic": topic, **stated})

    def subscribes(self, found: re.Match[str], place: Place) -> None:
        """Take what a client asks for."""
        name = self.client(found["client"], place).id
        self.takes = lambda topic, qos, there: self.asked.update({(name, topic): (qos or "0", there)})

    def unsubscribes(self, found: re.Match[str], place: Place) -> None:
        """Take what a client no longer subscribes."""
        client = self.client(found["client"], place)

        def ended(topic: str, _qos: str | None, _place: Place) -> None:
            client.unsubscribe(topic)
            self.asked.pop((client.id, topic), None)

        self.takes = ended

    def publication(self, found: re.Match[str], place: Place) -> None:
        """Take a publication."""
        settings = {"qos": found["qos"], "retain": _TRUTH[found["retain"]]}
        self.client(found["client"], place).publish(found["topic"], settings, place)
        self.publishes = True

    def denied(self, found: re.Match[str], place: Place) -> None:
        """Say which publication the broker refused; no subscriber gets it."""
        self.publishes = True
        message = f"the broker refused what {shown(found['client'])} published to {shown(found['topic'])}"
        self.note("MQTT946", message, place)

    def granted(self, text: str, place: Place) -> None:
        """Take a line of `log_type subscribe`, ``client qos filter``, or `log_type unsubscribe`, ``client filter``."""
        parts = [(text[: each.start()], each["qos"], text[each.end() :]) for each in _GRANTED.finditer(text)]
        known = [each for each in parts if each[0] in self.clients]
        if parts and (known or not self.latest):
            name, qos, topic = (known or parts)[0]
            self.client(name, place).subscribe(topic, {"qos": qos}, place)
            self.asked.pop((name, topic), None)
            self.grants = True
            return
        for end in (at for at, letter in enumerate(text) if letter == " "):
            client = self.clients.get(text[:end])
            if client is not None:
                client.unsubscribe(text[end + 1 :])

    def settle(self) -> None:
        """Decide of what was asked for and not granted: refused, where the log says what is granted."""
        for (name, topic), (qos, place) in self.asked.items():
            if self.grants:
                message = f"the broker refused {shown(name)} the subscription of {shown(topic)}"
                self.note("MQTT946", message, place)
            else:
                self.clients[name].subscribe(topic, {"qos": qos}, place)


_LINES: Final = (
    (re.compile(r"Opening \S+ listen socket on port (?P<port>\d+)\."), _Reader.opened),
    (
        re.compile(
            r"New (?:client|bridge) connected from \S+ as (?P<client>.*) "
            r"\(p(?P<version>\d), c(?P<clean>[01]), k(?P<alive>\d+)(?:, u'(?P<user>.*)')?\)\."
        ),
        _Reader.connected,
    ),
    (
        re.compile(r"Will message specified \(\d+ bytes\) \(r(?P<retain>[01]), q(?P<qos>[012])\)\."),
        _Reader.will,
    ),
    (re.compile(r"Received SUBSCRIBE from (?P<client>.*)"), _Reader.subscribes),
    (re.compile(r"Received UNSUBSCRIBE from (?P<client>.*)"), _Reader.unsubscribes),
    (re.compile(rf"Received PUBLISH from (?P<client>.*) {_PACKET}"), _Reader.publication),
    (re.compile(rf"Denied PUBLISH from (?P<client>.*) {_PACKET}"), _Reader.denied),
)
_OTHERS: Final = (
    *("Bridge ", "Client ", "Config ", "Connecting ", "Denied ", "Error", "Loading ", "New ", "No will ", "Notice"),
    *("OpenSSL ", "Opening ", "Outgoing ", "Received ", "Reloading ", "Saving ", "Sending ", "Socket ", "Warning"),
    *("Will ", "mosquitto version "),
)
"""How lines begin that are of no subscription."""

read = _Reader.load
