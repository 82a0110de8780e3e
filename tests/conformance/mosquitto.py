"""A real Mosquitto, asked what it does: started on a free port of loopback, and stopped by its process."""

from __future__ import annotations

import shutil
import socket
import struct
import subprocess
import tempfile
import threading
import time
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.subscribeoptions import SubscribeOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

PATIENCE = 10.0
"""Seconds within which something that must come has come."""
SILENCE = 0.3
"""Seconds after which nothing more is expected to arrive on loopback."""
V3, V5 = "3.1.1", "5.0"
_PROTOCOLS = {V3: paho.MQTTv311, V5: paho.MQTTv5}


def program() -> str | None:
    """Return where Mosquitto is; Debian has it where only root looks."""
    return shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:/opt/homebrew/sbin")


def version() -> str:
    """Return the version of Mosquitto."""
    usage = subprocess.run([program() or "mosquitto", "-h"], capture_output=True, text=True, check=False).stdout
    return usage.split()[2]


class Message(NamedTuple):
    """What arrived."""

    topic: str
    payload: str
    qos: int
    retain: bool
    filters: tuple[int, ...] = ()


class Broker:
    """A Mosquitto that runs."""

    def __init__(self, *directives: str) -> None:
        """Start it with these lines of configuration."""
        self.folder = tempfile.TemporaryDirectory()
        for _ in range(5):
            self.port = _free_port()
            lines = (f"listener {self.port} 127.0.0.1", "allow_anonymous true", *directives)
            conf = Path(self.folder.name) / "mosquitto.conf"
            conf.write_text("\n".join(lines) + "\n", encoding="utf-8")
            self.process = subprocess.Popen(
                [program() or "mosquitto", "-c", str(conf)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
            )
            if self._answers():
                return
            self.stop()
        raise AssertionError("Mosquitto does not start")

    def _answers(self) -> bool:
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until and self.process.poll() is None:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
            except OSError:
                time.sleep(0.01)
            else:
                return self.process.poll() is None
        return False

    def stop(self) -> None:
        """End it."""
        self.process.terminate()
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        if self.process.stderr is not None:
            self.process.stderr.close()
        self.folder.cleanup()


def _free_port() -> int:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        port: int = listening.getsockname()[1]
        return port


@contextmanager
def running(*directives: str) -> Iterator[Broker]:
    """Run a Mosquitto for as long as the block takes."""
    broker = Broker(*directives)
    try:
        yield broker
    finally:
        broker.stop()


_numbers = count()


class Client:
    """One client, which records what the broker sends.

    Attributes:
        reason: what the broker answered to the connection; the words of MQTT.
        ended: whether the broker ended the connection.
    """

    def __init__(
        self,
        broker: Broker,
        version: str = V5,
        client_id: str | None = None,
        *,
        clean: bool = True,
        session_expiry: int = 0,
        will: dict[str, Any] | None = None,
        keep_alive: int = 60,
    ) -> None:
        """Connect, and wait for the answer."""
        self.version = version
        name = client_id or f"cqos-{next(_numbers)}"
        clean_session: dict[str, Any] = {} if version == V5 else {"clean_session": clean}
        self.paho: Any = paho.Client(
            CallbackAPIVersion.VERSION2,
            name,
            protocol=_PROTOCOLS[version],
            reconnect_on_failure=False,
            **clean_session,
        )
        self.paho.max_inflight_messages_set(0)
        self.reason = ""
        self.ended = False
        self.messages: list[Message] = []
        self.granted: dict[int, list[int]] = {}
        self._changed = threading.Condition()
        self.paho.on_connect = self._connected
        self.paho.on_disconnect = self._disconnected
        self.paho.on_message = self._arrived
        self.paho.on_subscribe = self._subscribed
        self._published: set[int] = set()
        self.paho.on_publish = self._acknowledged
        if will is not None:
            self.paho.will_set(**will)
        more: dict[str, Any] = {}
        if version == V5:
            properties = Properties(PacketTypes.CONNECT)
            properties.SessionExpiryInterval = session_expiry
            more = {"clean_start": clean, "properties": properties}
        self.paho.connect("127.0.0.1", broker.port, keep_alive, **more)
        self.paho.loop_start()
        self._wait(lambda: bool(self.reason) or self.ended)

    # What paho tells

    def _connected(self, _client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        with self._changed:
            self.reason = str(reason)
            self._changed.notify_all()

    def _disconnected(self, *_: Any) -> None:
        with self._changed:
            self.ended = True
            self._changed.notify_all()

    def _arrived(self, _client: Any, _data: Any, message: Any) -> None:
        ids = tuple(getattr(message.properties, "SubscriptionIdentifier", ())) if message.properties else ()
        with self._changed:
            own = Message(message.topic, message.payload.decode(), message.qos, message.retain, ids)
            self.messages.append(own)
            self._changed.notify_all()

    def _subscribed(self, _client: Any, _data: Any, number: int, reasons: Sequence[Any], _properties: Any) -> None:
        with self._changed:
            self.granted[number] = [reason.value for reason in reasons]
            self._changed.notify_all()

    def _acknowledged(self, _client: Any, _data: Any, number: int, *_: Any) -> None:
        with self._changed:
            self._published.add(number)
            self._changed.notify_all()

    def _wait(self, there: Callable[[], bool], seconds: float = PATIENCE) -> bool:
        with self._changed:
            return self._changed.wait_for(there, seconds)

    # What it does

    def subscribe(
        self,
        filters: Iterable[tuple[str, int]],
        identifier: int | None = None,
        **options: Any,
    ) -> list[int]:
        """Subscribe, and return what is granted; options are those of 5.0."""
        properties = None
        wanted: list[Any] = list(filters)
        if self.version == V5:
            wanted = [(each, SubscribeOptions(qos=qos, **options)) for each, qos in wanted]
            if identifier is not None:
                properties = Properties(PacketTypes.SUBSCRIBE)
                properties.SubscriptionIdentifier = identifier
        result, number = self.paho.subscribe(wanted, properties=properties)
        assert result == paho.MQTT_ERR_SUCCESS
        self._wait(lambda: number in self.granted or self.ended)
        return self.granted.get(number, [])

    def publish(
        self, topic: str, qos: int = 0, *, retain: bool = False, expiry: int | None = None, payload: str | None = None
    ) -> None:
        """Publish; of QoS 1 and 2 wait until the broker has taken it, or ends the connection."""
        properties = None
        if expiry is not None:
            properties = Properties(PacketTypes.PUBLISH)
            properties.MessageExpiryInterval = expiry
        info = self.paho.publish(topic, payload or topic, qos, retain, properties)
        if info.rc == paho.MQTT_ERR_SUCCESS and qos:
            self._wait(lambda: info.mid in self._published or self.ended)

    def wait(self, expected: int) -> None:
        """Wait for so many messages."""
        self._wait(lambda: len(self.messages) >= expected or self.ended)

    def collect(self, expected: int | None = None) -> list[Message]:
        """Return what arrives until nothing does for a while; ``expected`` messages are waited for longer."""
        if expected is not None:
            self.wait(expected)
        known = -1
        while known != len(self.messages):
            known = len(self.messages)
            self._wait(lambda known=known: len(self.messages) != known, SILENCE)  # type: ignore[misc]
        return list(self.messages)

    def close(self) -> None:
        """Disconnect in good order."""
        self.paho.disconnect()
        self.paho.loop_stop()

    def cut(self) -> None:
        """Break the connection, as a crash does."""
        sock = self.paho.socket()
        if sock is not None:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            sock.close()
        self.paho.loop_stop()


# What paho refuses to send, byte by byte.


def _text(text: str) -> bytes:
    data = text.encode("utf-8", "surrogatepass")
    return struct.pack("!H", len(data)) + data


def _packet(kind: int, body: bytes) -> bytes:
    length, head = len(body), bytearray([kind])
    while True:
        length, digit = divmod(length, 128)
        head.append(digit | (0x80 if length else 0))
        if not length:
            return bytes(head) + body


def takes(broker: Broker, version: str, *, filter: str | None = None, topic: str | None = None) -> bool:  # noqa: A002
    """Say whether the broker takes a subscription, or a publication of QoS 1; without any client library in between."""
    v5 = version == V5
    properties = b"\0" if v5 else b""
    connect = (
        _text("MQTT") + bytes([5 if v5 else 4, 2]) + struct.pack("!H", 60) + properties + _text(f"raw-{next(_numbers)}")
    )
    with socket.create_connection(("127.0.0.1", broker.port), PATIENCE) as connection:
        connection.sendall(_packet(0x10, connect))
        assert _answer(connection)[0] == 0x20
        if filter is not None:
            connection.sendall(_packet(0x82, struct.pack("!H", 1) + properties + _text(filter) + b"\0"))
        else:
            connection.sendall(_packet(0x32, _text(topic or "") + struct.pack("!H", 1) + properties + b"x"))
        answer = _answer(connection)
    if not answer or answer[0] not in {0x90, 0x40}:
        return False
    if answer[0] == 0x90:
        return answer[-1] < 0x80
    return len(answer) <= 4 or answer[4] < 0x80


def _answer(connection: socket.socket) -> bytes:
    """Read one packet; nothing where the connection ends."""
    try:
        head = connection.recv(2)
        if len(head) < 2:
            return b""
        length = head[1]  # no answer here is longer than 127 bytes
        body = b""
        while len(body) < length and (more := connection.recv(length - len(body))):
            body += more
    except ConnectionError:
        return b""
    return head + body
