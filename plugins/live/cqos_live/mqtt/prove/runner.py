"""Runs one pair on Mosquitto, with exactly the values that were resolved, and injects one fault."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from cqos_core.packs import INFINITE, Policy
from cqos_core.packs.prover import FAULTS, End, Event, Fault, NotRunnableError, Outcome, Plan, numbers
from cqos_live.mqtt.prove.client import WIDEST, Client, Connection, Publication, Subscription
from cqos_live.mqtt.prove.mosquitto import Link, Mosquitto, program, version
from cqos_live.mqtt.prove.packets import Message, Will
from cqos_mqtt import broker_policies as of_broker
from cqos_mqtt import connection_policies as of_connection
from cqos_mqtt import endpoint_policies as of
from cqos_mqtt import policies as of_deployment
from cqos_mqtt.kinds import LONGEST, Access
from cqos_mqtt.runnable_pairs import ensure_runnable, known
from cqos_mqtt.sessions import EVERY_USER, NO_USER

_SECOND: Final = 1_000_000_000
_READY: Final = 1.0
"""Seconds within which a client on loopback is connected and subscribed."""
_EARLY: Final = 0.02  # seconds between messages that are sent before the subscriber starts
_AT_ONCE: Final = 20
"""Messages that a client of 3.1.1 has on their way where nothing is stated, as those of Mosquitto and Paho do.

Mosquitto drops what a client of 3.1.1 sends beyond as many of QoS 2.
"""
_QUIET: Final = 0.3
"""Seconds of silence after which nothing more is expected."""
_LATER: Final = 0.1
"""Seconds by which the subscriber connects again later than the publisher, which is the worst of what may happen."""
_ENDED: Final = 3
"""Ends of a connection, with no fault injected, after which the broker does not want what it is sent."""
_SMALLEST: Final = 20
_SHORTEST: Final = 10
_HOUR: Final = 3600 * _SECOND
_FIXED: Final = (
    (of_broker.WILDCARD_AVAILABLE, 1),
    (of_broker.SHARED_AVAILABLE, 1),
    (of_broker.IDENTIFIER_AVAILABLE, 1),
    (of_broker.GRANTED_QOS, 2),
    (of_broker.OLDEST, 0),
    (of_broker.NEWEST, 1),
)
"""What no configuration of Mosquitto changes."""


class Mosquittos:
    """Runs pairs on Mosquitto; see `cqos_core.packs.prover.Prover`."""

    title = "Mosquitto"
    faults = frozenset(FAULTS)
    assumes: Mapping[str, str] = MappingProxyType({})

    def missing(self) -> str | None:
        """Say how to install Mosquitto where it is not there."""
        return None if program() else "Mosquitto is not installed; install the package `mosquitto` of your system"

    def prove(self, plan: Plan, report: Callable[[Event], None] = lambda _event: None) -> Outcome:
        """Run the plan.

        Raises:
            NotRunnableError: Mosquitto, or this runner, has no means for something in the plan.
        """
        if missing := self.missing():
            raise NotRunnableError(missing)
        ensure_runnable(plan)
        return asyncio.run(_Run(plan, report).run())


MOSQUITTO: Final = Mosquittos()


def _number(policy: Policy, values: Mapping[str, str]) -> int | None:
    """Return a number, a rank, or a flag; None where it is unlimited, endless or not known."""
    value = known(policy, values)
    return value if isinstance(value, int) and value != INFINITE else None


def _seconds(policy: Policy, values: Mapping[str, str]) -> int | None:
    """Return whole seconds; None where it is endless or not known."""
    value = _number(policy, values)
    return None if value is None else value // _SECOND


def configuration(values: Mapping[str, str]) -> list[str]:
    """Write the values of a broker as lines of mosquitto.conf.

    Raises:
        NotRunnableError: Mosquitto cannot be configured so.
    """
    for policy, only in _FIXED:
        if known(policy, values) != only:
            raise NotRunnableError(
                f"Mosquitto cannot be configured with {policy.name} {values[policy.name]}: it always has "
                f"{policy.domain.format(only)}"
            )
    size, kept = _number(of_broker.BROKER_PACKET_SIZE, values), _number(of_broker.BROKER_SESSION_EXPIRY, values)
    pings = _seconds(of_broker.SERVER_KEEP_ALIVE, values)
    saves, saved = known(of_broker.AUTOSAVE, values) is not None, _seconds(of_broker.AUTOSAVE, values)
    for is_wrong, why in (
        (
            size is not None and size < _SMALLEST,
            f"Mosquitto takes no maximum_packet_size below {_SMALLEST}, got {size}",
        ),
        (
            pings is not None and pings < _SHORTEST,
            f"Mosquitto takes no server_keep_alive below {_SHORTEST} s, got {pings} s",
        ),
        (saves and saved == 0, "Mosquitto does not save each message before it acknowledges it (autosave_interval)"),
        (
            kept is not None and (kept % _HOUR or not kept),
            "Mosquitto counts persistent_client_expiration in whole hours",
        ),
    ):
        if is_wrong:
            raise NotRunnableError(why)
    limited = {name: policy for name, policy in _LIMITS.items() if known(policy, values) is not None}
    directives = {
        "max_qos": known(of_broker.MAXIMUM_QOS, values),
        **{name: "true" if known(policy, values) else "false" for name, policy in _FLAGS.items()},
        **{name: _number(policy, values) or 0 for name, policy in limited.items()},
        "max_packet_size": size,
        "max_keepalive": pings,
        "autosave_interval": saved or 0 if saves else None,
        "persistent_client_expiration": None if kept is None else f"{kept // _HOUR}h",
    }
    return [f"{name} {value}" for name, value in directives.items() if value is not None]


_FLAGS: Final = {
    "retain_available": of_broker.RETAIN_AVAILABLE,
    "queue_qos0_messages": of_broker.QUEUES_QOS0,
    "upgrade_outgoing_qos": of_broker.UPGRADES,
    "persistence": of_broker.PERSISTENCE,
}
_LIMITS: Final = {
    "max_queued_messages": of_broker.QUEUED,
    "max_queued_bytes": of_broker.QUEUED_BYTES,
    "max_inflight_messages": of_broker.INFLIGHT,
    "max_topic_alias": of_broker.BROKER_ALIASES,
}


def access_list(values: Mapping[str, str]) -> list[str]:
    """Write the access control of a broker as lines of an acl_file."""
    text = values.get(of_broker.ACCESS.name)
    entries = [entry.split(" ", 2) for entry in Access().parse(text)] if text else []
    return [
        *(f"topic {access} {written}" for access, user, written in entries if user == NO_USER),
        *(
            line
            for access, user, written in entries
            if user not in {EVERY_USER, NO_USER}
            for line in (f"user {user}", f"topic {access} {written}")
        ),
        *(f"pattern {access} {written}" for access, user, written in entries if user == EVERY_USER),
    ]


def _or(value: int | None, endless: int) -> int:
    return endless if value is None else value


def connection(end: End, role: str, patience: float = 0.0) -> Connection:
    """Return what the client of an end says when it connects."""
    values = end.participant
    written = known(of_connection.WILL_TOPIC, values)
    will = None
    if written:
        will = Will(
            str(written),
            str(known(of_connection.WILL_PAYLOAD, values) or "gone").encode(),
            _number(of_connection.WILL_QOS, values) or 0,
            bool(known(of_connection.WILL_RETAIN, values)),
            _or(_seconds(of_connection.WILL_DELAY, values), LONGEST),
            _seconds(of_connection.WILL_EXPIRY, values),
        )
    name, user = known(of_connection.CLIENT_ID, values), known(of_connection.USERNAME, values)
    five = values.get(of_deployment.VERSION.name, "5.0") == "5.0"
    return Connection(
        f"cqos-{role}" if name is None else str(name),
        five=five,
        clean=bool(known(of_connection.CLEAN, values)),
        session_expiry=_or(_seconds(of_connection.SESSION_EXPIRY, values), LONGEST),
        keep_alive=_seconds(of_connection.KEEP_ALIVE, values) or 0,
        receive_maximum=_number(of_connection.RECEIVE_MAXIMUM, values) or WIDEST,
        maximum_packet_size=_number(of_connection.PACKET_SIZE, values),
        sends_at_once=_number(of_connection.SENDS_AT_ONCE, values) or (WIDEST if five else _AT_ONCE),
        username=None if user is None else str(user),
        will=will,
        stores_session=bool(known(of_connection.STORES_SESSION, values)),
        patience=patience,
    )


class _Run:
    """One run of one plan."""

    def __init__(self, plan: Plan, report: Callable[[Event], None]) -> None:
        self.plan, self.report = plan, report
        self.began = self.last = time.monotonic()
        self.events: list[Event] = []
        self.ends = {"publisher": 0, "subscriber": 0}
        self.slow = plan.fault.seconds if plan.fault is not None and plan.fault.kind == "slow_reader" else 0.0
        self.disturbed = False
        self.reasons: dict[str, str] = {}
        self.taken: set[str] = set()
        self.broker = Mosquitto(configuration(plan.broker), access_list(plan.broker))
        self.links = {role: Link(self.broker.port) for role in ("publisher", "subscriber")}
        self.clients: dict[str, Client] = {}

    async def run(self) -> Outcome:
        """Start everything, send, and stop everything."""
        plan = self.plan
        limit = plan.patience + plan.samples * plan.period + (plan.fault.seconds if plan.fault else 0.0)
        try:
            await self.broker.start()
            for link in self.links.values():
                await link.start()
            await asyncio.wait_for(self._send_and_wait(), limit)
        except asyncio.TimeoutError:
            self._tell("link", "patience", f"the run ends after {limit:g} s")
        finally:
            for client in self.clients.values():
                await client.stop()
            for link in self.links.values():
                await link.close()
            await self.broker.close()
        return Outcome(
            f"Mosquitto {version()}",
            tuple(self.events),
            None if self.reasons else len(self.taken) == len(self.ends),
            numbers(self.events, "sent"),
            numbers(self.events, "arrived"),
            not_created=self.reasons,
        )

    async def _send_and_wait(self) -> None:
        plan = self.plan
        await self._start("publisher")
        for number in range(plan.early):
            self._publish(number)
            await asyncio.sleep(min(plan.period, _EARLY))
        await self._start("subscriber")
        fault: asyncio.Task[None] | None = None
        middle = plan.early + (plan.samples - plan.early - plan.during) // 2
        for number in range(plan.early, plan.samples):
            if number == middle and plan.fault is not None and plan.fault.kind != "slow_reader":
                fault = asyncio.create_task(self._inject(plan.fault))
                await asyncio.sleep(0)
            await self.clients["publisher"].running.wait()
            self._publish(number)
            await asyncio.sleep(plan.period)
        if fault is not None:
            await fault
            await asyncio.sleep(2 * _LATER)
        self.last = time.monotonic()
        while time.monotonic() - self.last < _QUIET + self.slow:
            if max(self.ends.values()) >= _ENDED and not self.disturbed:
                return
            await asyncio.sleep(0.02)

    async def _start(self, role: str) -> None:
        """Start the client of one end, and wait until the broker has taken it, or does not."""
        plan, port, tell = self.plan, self.links[role].port, self._teller(role)
        if role == "publisher":
            client = Client(connection(plan.publisher, role), port, tell)
        else:
            own = connection(plan.subscriber, role, _LATER)
            client = Client(own, port, tell, self._deliver, self._subscription(), self.slow)
        self.clients[role] = client
        client.start()
        await self._settled(role)

    async def _settled(self, role: str) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self.clients[role].settled.wait(), _READY)

    def _subscription(self) -> Subscription:
        values = self.plan.subscriber.values
        return Subscription(
            self.plan.filter or self.plan.topic,
            _number(of.QOS, values) or 0,
            bool(known(of.NO_LOCAL, values)),
            bool(known(of.RETAIN_AS_PUBLISHED, values)),
            _number(of.RETAIN_HANDLING, values) or 0,
            _number(of.SUBSCRIPTION_ID, values),
        )

    def _publish(self, number: int) -> None:
        values, payload = self.plan.publisher.values, str(number).encode()
        size = _number(of.PAYLOAD, values)
        if size is not None and size < len(payload):
            raise NotRunnableError(f"samples of {size} bytes cannot be distinguished; the smallest has {len(payload)}")
        publication = Publication(
            self.plan.topic,
            payload.ljust(size or 0),
            _number(of.QOS, values) or 0,
            bool(known(of.RETAIN, values)),
            _seconds(of.EXPIRY, values),
            _number(of.TOPIC_ALIAS, values),
        )
        self._tell("publisher", "sent", number=number)
        self.clients["publisher"].publish(publication)

    def _deliver(self, message: Message) -> None:
        written = message.payload.strip().decode(errors="replace")
        text = f"QoS {message.qos}" + (", retained" if message.retain else "")
        if written.isascii() and written.isdigit():
            self.last = time.monotonic()
            self._tell("subscriber", "arrived", text, int(written))
        else:
            self._tell("subscriber", "arrived", f"QoS {message.qos}: {written}")

    # Faults

    async def _inject(self, fault: Fault) -> None:
        self.disturbed = True
        if fault.kind == "link_outage":
            await self._cut(fault.seconds)
        elif fault.kind in {"broker_stop", "broker_crash"}:
            crash = fault.kind == "broker_crash"
            self._tell("broker", "killed" if crash else "stopped")
            await self.broker.end(crash=crash)
            await asyncio.sleep(fault.seconds)
            await self.broker.start()
            self._tell("broker", "started")
        else:
            await self._restart(fault.kind.removesuffix("_restart"), fault.seconds)

    async def _cut(self, seconds: float) -> None:
        """Cut both links: the broker sees the connections break, the clients see nothing until the links are back."""
        self._tell("link", "cut")
        for link in self.links.values():
            link.silent = link.cut = True
            link.break_off(towards_broker=True, towards_client=False)
        await asyncio.sleep(seconds)
        for link in self.links.values():
            link.silent = link.cut = False
            link.break_off(towards_broker=False, towards_client=True)
        self._tell("link", "restored")
        await asyncio.sleep(_LATER)

    async def _restart(self, role: str, seconds: float) -> None:
        """Kill a client while one sample is on its way, and start it again."""
        link, client = self.links[role], self.clients[role]
        link.silent = True
        await asyncio.sleep(1.5 * self.plan.period)
        await client.kill()
        link.break_off(towards_broker=True, towards_client=True)
        self._tell(role, "killed")
        await asyncio.sleep(seconds)
        link.silent = False
        if known(
            of_connection.GENERATED_ID,
            (self.plan.publisher if role == "publisher" else self.plan.subscriber).participant,
        ):
            client.connection = replace(client.connection, client_id=f"cqos-{role}-again")
        client.start()
        self._tell(role, "started")
        await self._settled(role)

    # The timeline

    def _teller(self, role: str) -> Callable[[str, str], None]:
        def tell(what: str, text: str) -> None:
            if what == "connected":
                self.taken.add(role)
                what = "matched"
            elif what == "disconnected" and not self.disturbed:
                self.ends[role] += 1
                if self.ends[role] == _ENDED:
                    self.reasons[role] = self.clients[role].refusal or "the broker ends the connection"
            elif what == "refused" and not self.disturbed:
                self.reasons.setdefault(role, text)
            self._tell(role, what, text)

        return tell

    def _tell(self, who: str, what: str, text: str = "", number: int | None = None) -> None:
        event = Event(time.monotonic() - self.began, who, what, number, text)
        self.events.append(event)
        self.report(event)
