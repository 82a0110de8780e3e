"""What the MQTT pack predicts and what Mosquitto does, side by side: each section asks one question in many cases."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, Any

from cqos_core import check
from cqos_core.packs import forbids
from cqos_mqtt.filters import matches, wrong_with_filter, wrong_with_name
from cqos_mqtt.pack import PACK
from cqos_mqtt.rules import EFFECTIVE, GRANTED
from tests.conformance.mosquitto import PATIENCE, V3, V5, Broker, Client, takes

if TYPE_CHECKING:
    from cqos_core.packs import Operand, RulePack

VERSIONS = (V3, V5)
LEVELS = (0, 1, 2)


@dataclass
class Section:
    """One question.

    Attributes:
        name: of the row in the table.
        asked: how many cases were tried.
        differences: cases in which the two differ: the case, what the pack predicts, what Mosquitto does.
    """

    name: str
    asked: int = 0
    differences: list[tuple[str, str, str]] = field(default_factory=list)

    def compare(self, case: str, predicted: object, seen: object) -> None:
        """Count a case."""
        self.asked += 1
        if predicted != seen:
            self.differences.append((case, str(predicted), str(seen)))


# What the pack predicts


def system(
    publication: dict[str, Any],
    subscription: dict[str, Any],
    *,
    publishes: str = V5,
    subscribes: str = V5,
    client: dict[str, Any] | None = None,
    needs: dict[str, Any] | None = None,
    broker: dict[str, Any] | None = None,
    topic: str = "t",
    filter: str | None = None,  # noqa: A002
    period: str = "1s",
) -> bytes:
    """Return a system of one publisher and one subscriber at a Mosquitto."""
    return json.dumps(
        {
            "cqos": 1,
            "protocol": "mqtt",
            "brokers": {"main": {"profile": "mosquitto", **(broker or {})}},
            "topics": {topic: {"period": period}},
            "participants": {
                "publisher": {"options": {"version": publishes}, "publishes": {topic: publication}},
                "subscriber": {
                    "options": {"version": subscribes},
                    "client": client or {},
                    "subscribes": {filter or topic: {**subscription, "needs": needs or {}}},
                },
            },
        }
    ).encode()


def gives(needs: dict[str, Any], publication: dict[str, Any], subscription: dict[str, Any], **more: Any) -> bool:
    """Say whether the pack predicts that a need is met."""
    report = check(system(publication, subscription, needs=needs, **more), importer="yaml")
    assert report.verdict != "unknown", [finding.message for finding in report.findings]
    return report.verdict == "compatible"


def codes(text: bytes) -> set[str]:
    """Return the codes of all errors."""
    return {finding.code for finding in check(text, importer="yaml").findings if finding.severity == "error"}


def level(operand: Operand, text: bytes) -> int:
    """Return the QoS that an operand of the pack's rules amounts to."""
    found = {finding.code for finding in check(text, importer="yaml", packs=[asking(operand)]).findings}
    (qos,) = (qos for qos in LEVELS if f"MQTT99{qos}" in found)
    return qos


@cache
def asking(operand: Operand) -> RulePack:
    """The pack with a rule for each QoS, which speaks where the operand amounts to it."""
    rules = (
        forbids(operand == str(qos), code=f"MQTT99{qos}", name=f"level-{qos}", because="so it is", severity="note")
        for qos in LEVELS
    )
    return replace(PACK, rules=(*PACK.rules, *rules))


# Sections


def online(broker: Broker) -> Section:
    """With which QoS a message arrives: every combination of QoS and versions."""
    section = Section("online: QoS of publication and subscription, versions")
    publishers = {version: Client(broker, version) for version in VERSIONS}
    subscribers = {version: Client(broker, version) for version in VERSIONS}
    cases = list(product(VERSIONS, LEVELS, VERSIONS, LEVELS))
    for version, subscriber in subscribers.items():
        subscriber.subscribe([(f"on/{pv}/{pq}/{sv}/{sq}", sq) for pv, pq, sv, sq in cases if sv == version])
    for pv, pq, sv, sq in cases:
        publishers[pv].publish(f"on/{pv}/{pq}/{sv}/{sq}", pq)
    arrived = {each.topic: each.qos for client in subscribers.values() for each in client.collect(18)}
    for pv, pq, sv, sq in cases:
        predicted = level(EFFECTIVE, system({"qos": pq}, {"qos": sq}, publishes=pv, subscribes=sv))
        section.compare(f"{pv} QoS {pq} to {sv} QoS {sq}", predicted, arrived.get(f"on/{pv}/{pq}/{sv}/{sq}"))
    _close(publishers, subscribers)
    return section


def retained(broker: Broker) -> Section:
    """Whether and with which QoS a late joiner gets the retained message."""
    section = Section("retained: QoS of publication and subscription, versions")
    publishers = {version: Client(broker, version) for version in VERSIONS}
    cases = list(product(VERSIONS, LEVELS, VERSIONS, LEVELS))
    for pv, pq, sv, sq in cases:
        publishers[pv].publish(f"re/{pv}/{pq}/{sv}/{sq}", pq, retain=True)
    subscribers = {version: Client(broker, version) for version in VERSIONS}
    for version, subscriber in subscribers.items():
        subscriber.subscribe([(f"re/{pv}/{pq}/{sv}/{sq}", sq) for pv, pq, sv, sq in cases if sv == version])
    arrived = {each.topic: (each.qos, each.retain) for client in subscribers.values() for each in client.collect(18)}
    for pv, pq, sv, sq in cases:
        publication = {"qos": pq, "retain": True}
        met = gives({"late_join": 1}, publication, {"qos": sq}, publishes=pv, subscribes=sv)
        predicted = level(EFFECTIVE, system(publication, {"qos": sq}, publishes=pv, subscribes=sv))
        seen = arrived.get(f"re/{pv}/{pq}/{sv}/{sq}")
        section.compare(f"{pv} QoS {pq} to {sv} QoS {sq}", (predicted, True) if met else None, seen)
    _close(publishers, subscribers)
    return section


def late_join(broker: Broker) -> Section:
    """Who gets a message from before: retain, retain handling, shared subscriptions, subscribing again."""
    section = Section("late join: retain, retain handling, shares")
    publisher = Client(broker)
    subscribers = []
    cases = list(product((False, True), LEVELS, (False, True)))
    for retain, handling, shared in cases:
        topic = f"late/{retain}/{handling}/{shared}"
        publisher.publish(topic, 1, retain=retain)
        subscriber = Client(broker)
        subscriber.subscribe([(f"$share/g/{topic}" if shared else topic, 1)], retainHandling=handling)
        subscribers.append(subscriber)
    subscribers[-1].collect()
    for (retain, handling, shared), subscriber in zip(cases, subscribers, strict=True):
        predicted = gives(
            {"late_join": 1},
            {"qos": 1, "retain": retain},
            {"qos": 1, "retain_handling": handling},
            filter="$share/g/t" if shared else None,
        )
        case = f"retain {retain}, retain handling {handling}, shared {shared}"
        if predicted:
            subscriber.wait(1)
        section.compare(case, predicted, bool(subscriber.messages))
        subscriber.close()
    again = Client(broker)
    for _ in range(2):
        again.subscribe([("late/True/0/False", 1)], retainHandling=1)
    section.compare("retain handling 1, subscribed twice", 1, len(again.collect(1)))
    _close({"": publisher}, {"": again})
    return section


SESSIONS = (
    (V3, True, 0),
    (V3, False, 0),
    (V5, True, 0),
    (V5, False, 0),
    (V5, True, 3600),
    (V5, False, 3600),
)


def offline(broker: Broker, name: str = "offline: sessions, QoS, versions", **limits: Any) -> Section:
    """What waits for a client that is away: every kind of session with every QoS."""
    section = Section(name)
    ids = [f"away-{section.name[:12]}-{number}" for number in range(len(SESSIONS))]
    pairs = list(product(LEVELS, LEVELS))

    def connect(number: int) -> Client:
        version, clean, expiry = SESSIONS[number]
        return Client(broker, version, ids[number], clean=clean, session_expiry=expiry)

    for number in range(len(SESSIONS)):
        client = connect(number)
        client.subscribe([(f"away/{number}/{pq}/{sq}", sq) for pq, sq in pairs])
        client.close()
    publisher = Client(broker)
    for number, (pq, sq) in product(range(len(SESSIONS)), pairs):
        publisher.publish(f"away/{number}/{pq}/{sq}", pq)
    publisher.collect()
    back = [connect(number) for number in range(len(SESSIONS))]
    for client in back:
        client.collect()
    for number, client in enumerate(back):
        version, clean, expiry = SESSIONS[number]
        arrived = {each.topic for each in client.messages}
        for pq, sq in pairs:
            state = {"clean_start": clean, **({"session_expiry_interval": expiry} if version == V5 else {})}
            predicted = gives(
                {"offline": "1s"}, {"qos": pq}, {"qos": sq}, subscribes=version, client=state, broker=limits
            )
            case = f"{version}, clean {clean}, expiry {expiry}, QoS {pq} to {sq}"
            section.compare(case, predicted, f"away/{number}/{pq}/{sq}" in arrived)
        client.close()
    publisher.close()
    return section


def expiry(broker: Broker) -> Section:
    """What expires meanwhile: messages that wait, retained messages, sessions."""
    section = Section("expiry: waiting and retained messages, sessions")
    clients = {
        version: Client(broker, version, f"exp-{version}", clean=False, session_expiry=60) for version in VERSIONS
    }
    for client in clients.values():
        client.subscribe([("exp/1", 1), ("exp/60", 1), ("exp/never", 1)])
        client.close()
    short = Client(broker, V5, "exp-short", clean=False, session_expiry=1)
    short.subscribe([("exp/never", 1)])
    short.close()
    publisher = Client(broker)
    seconds: Any
    for seconds in (1, 60, None):
        name = "never" if seconds is None else str(seconds)
        publisher.publish(f"exp/{name}", 1, expiry=seconds)
        publisher.publish(f"kept/{name}", 1, retain=True, expiry=seconds)
    time.sleep(3.1)
    for version in VERSIONS:
        state = {"clean_start": False, **({"session_expiry_interval": 60} if version == V5 else {})}
        client = Client(broker, version, f"exp-{version}", clean=False, session_expiry=60)
        arrived = {each.topic for each in client.collect(2)}
        client.messages.clear()
        client.subscribe([("kept/+", 1)])
        kept = {each.topic for each in client.collect(2)}
        for seconds in ("1", "60", "never"):
            publication = {"qos": 1, "message_expiry_interval": seconds}
            predicted = gives({"offline": "3s"}, publication, {"qos": 1}, subscribes=version, client=state)
            section.compare(f"{version} away, message expiry {seconds}", predicted, f"exp/{seconds}" in arrived)
            late = gives({"late_join": 1}, {**publication, "retain": True}, {"qos": 1}, subscribes=version, period="3s")
            section.compare(f"{version} late, message expiry {seconds}", late, f"kept/{seconds}" in kept)
        client.close()
    back = Client(broker, V5, "exp-short", clean=False, session_expiry=1)
    state = {"clean_start": False, "session_expiry_interval": 1}
    predicted = gives({"offline": "3s"}, {"qos": 1}, {"qos": 1}, client=state)
    section.compare("5.0 away, session expiry 1", predicted, bool(back.collect()))
    _close({"": publisher}, {"": back})
    return section


LIMITED = {"max_qos": 1, "retain_available": False, "max_packet_size": 200}


def capabilities(broker: Broker) -> Section:
    """What a broker with limits refuses: the broker runs with `LIMITED`."""
    section = Section("capabilities: max_qos, retain_available, max_packet_size")
    for version in VERSIONS:
        for qos, retain in product(LEVELS, (False, True)):
            text = system({"qos": qos, "retain": retain}, {}, publishes=version, broker=LIMITED)
            client = Client(broker, version)
            client.publish("limits", qos, retain=retain)
            if not qos:
                client.collect()
            refused = bool(codes(text) & {"MQTT201", "MQTT205"})
            section.compare(f"{version} publishes with QoS {qos}, retain {retain}", refused, client.ended)
            client.close()
        for qos, retain in product(LEVELS, (False, True)):
            own = json.loads(system({}, {}, subscribes=version, broker=LIMITED))
            own["participants"]["subscriber"]["client"] = {"will": {"topic": "gone", "qos": qos, "retain": retain}}
            refused = bool(codes(json.dumps(own).encode()) & {"MQTT204", "MQTT206"})
            client = Client(broker, version, will={"topic": "gone", "payload": "x", "qos": qos, "retain": retain})
            section.compare(
                f"{version} has a Will with QoS {qos}, retain {retain}", refused, client.reason != "Success"
            )
            client.close()
        client = Client(broker, version)
        for qos in LEVELS:
            text = system({"qos": 2}, {"qos": qos}, subscribes=version, broker=LIMITED)
            section.compare(
                f"{version} asks for QoS {qos}", [level(GRANTED, text)], client.subscribe([(f"g/{qos}", qos)])
            )
        client.close()
        for size in (100, 1000):
            client = Client(broker, version)
            client.publish("big", 1, payload="x" * size)
            text = system({"qos": 1, "max_payload": size}, {}, publishes=version, broker=LIMITED)
            section.compare(f"{version} sends {size} bytes", "MQTT209" in codes(text), client.ended)
            client.close()
    return section


def overflow(broker: Broker, queued: int) -> Section:
    """Whether more messages than it queues are lost to a client that is away."""
    section = Section("queue overflow: max_queued_messages")
    for number in (queued, queued + 1):
        client = Client(broker, V5, f"full-{number}", clean=False, session_expiry=60)
        client.subscribe([(f"full/{number}", 1)])
        client.close()
        publisher = Client(broker)
        for each in range(number):
            publisher.publish(f"full/{number}", 1, payload=str(each))
        publisher.close()
        back = Client(broker, V5, f"full-{number}", clean=False, session_expiry=60)
        arrived = back.collect(queued)
        state = {"clean_start": False, "session_expiry_interval": 60}
        needs = {"offline": f"{number - 1}s"}  # with a message a second, one comes at each end of that time
        predicted = gives(needs, {"qos": 1}, {"qos": 1}, client=state, broker={"max_queued_messages": queued})
        section.compare(f"{number} messages, {queued} queued", predicted, len(arrived) == number)
        back.close()
    return section


def options(broker: Broker) -> Section:
    """What options of subscriptions do: no local, retain as published, shares, overlapping filters."""
    section = Section("options: no local, retain as published, shares, overlaps")
    for flag in (False, True):
        both = Client(broker)
        both.subscribe([(f"own/{flag}", 1)], noLocal=flag)
        both.publish(f"own/{flag}", 1)
        text = system({"qos": 1}, {"qos": 1, "no_local": flag}, topic=f"own/{flag}")
        document = json.loads(text)
        publisher = document["participants"].pop("publisher")
        document["participants"]["subscriber"]["publishes"] = publisher["publishes"]
        pairs = check(json.dumps(document).encode(), importer="yaml").groups
        section.compare(f"own message, no local {flag}", bool(pairs), bool(both.collect(0 if flag else 1)))
        both.close()
    publisher = Client(broker)
    for version, kept in ((V3, False), (V5, False), (V5, True)):
        client = Client(broker, version)
        client.subscribe([(f"rap/{version}/{kept}", 1)], **({"retainAsPublished": kept} if version == V5 else {}))
        publisher.publish(f"rap/{version}/{kept}", 1, retain=True)
        own = {"qos": 1, "needs_retain_flag": True, **({"retain_as_published": kept} if version == V5 else {})}
        report = check(system({"qos": 1, "retain": True}, own, subscribes=version), importer="yaml")
        predicted = "MQTT614" not in {finding.code for finding in report.findings}
        section.compare(
            f"{version} sees the RETAIN flag, as published {kept}", [predicted], [m.retain for m in client.collect(1)]
        )
        client.close()
    for version in VERSIONS:
        members = [Client(broker, version) for _ in range(2)]
        for member in members:
            member.subscribe([(f"$share/g/share/{version}", 1)])
        for number in range(10):
            publisher.publish(f"share/{version}", 1, payload=str(number))
        until = time.monotonic() + PATIENCE
        while sum(len(member.messages) for member in members) < 10 and time.monotonic() < until:
            time.sleep(0.01)
        arrived = [len(member.messages) for member in members]
        whole = gives({"loss_free": True}, {"qos": 1}, {"qos": 1}, subscribes=version, filter="$share/g/t")
        section.compare(f"{version} member of a share gets all of 10", whole, max(arrived) == 10)
        section.compare(f"{version} share gets all of 10", 10, sum(arrived))
        _close({}, dict(enumerate(members)))
    for version in VERSIONS:
        client = Client(broker, version)
        client.subscribe([(f"two/{version}/+", 2), (f"two/{version}/#", 2)])
        publisher.publish(f"two/{version}/x", 2)
        # The standard allows one message or one for each filter, so the pack promises neither.
        section.compare(f"{version} two filters match, it comes once or twice", True, len(client.collect(1)) in {1, 2})
        client.close()
    publisher.close()
    return section


def wills(broker: Broker) -> Section:
    """When the Will comes, and with which QoS."""
    section = Section("Will: QoS, end in good order or by a break")
    watcher = Client(broker)
    watcher.subscribe([("will/#", 2)])
    for version, qos, broken in product(VERSIONS, LEVELS, (False, True)):
        topic = f"will/{version}/{qos}/{broken}"
        client = Client(broker, version, will={"topic": topic, "payload": "gone", "qos": qos})
        if broken:
            client.cut()
        else:
            client.close()
    arrived = {each.topic: each.qos for each in watcher.collect(6)}
    for version, qos, broken in product(VERSIONS, LEVELS, (False, True)):
        predicted = level(EFFECTIVE, system({"qos": qos}, {"qos": 2}, publishes=version)) if broken else None
        case = f"{version}, QoS {qos}, {'a break' if broken else 'in good order'}"
        section.compare(case, predicted, arrived.get(f"will/{version}/{qos}/{broken}"))
    watcher.close()
    return section


WORDS = ("a", "b", "", "$x")
NAMES = [
    "/".join(levels)
    for length in (1, 2, 3)
    for levels in product(WORDS, repeat=length)
    if levels != ("",) and not "/".join(levels).startswith("$SYS")
]
FILTERS = [
    "/".join(levels)
    for length in (1, 2, 3)
    for levels in product(("a", "", "$x", "+", "#"), repeat=length)
    if levels != ("",) and wrong_with_filter("/".join(levels)) is None
]
INVALID = [
    *("", "a#", "#a", "a/#/b", "#/a", "a+", "+a", "a/b+/c", "a+/b", "##", "++", "a/#b", "+#", "#/#"),
    *(
        "$share",
        "$share/",
        "$share/g",
        "$share//a",
        "$share/g/",
        "$share/g+/a",
        "$share/#/a",
        "$share/g/a#",
        "$share/g/#/a",
    ),
    *("a\0b", "a\ud800"),
]
PLAIN = [
    "a",
    "/",
    "a/",
    "//",
    " ",
    "ü/ö",
    "$x",
    "+",
    "#",
    "a/+",
    "a/#",
    "+/+",
    "$share/g/a",
    "$share/g/#",
    "$share/g/+/b",
    "$SYS/#",
]


def matching(broker: Broker) -> Section:
    """Which filters match which names: all of them in one connection, distinguished by subscription identifiers."""
    section = Section("filters: which name each matches")
    subscriber, publisher = Client(broker), Client(broker)
    for number, written in enumerate(FILTERS, 1):
        assert subscriber.subscribe([(written, 0)], number) == [0], written
    for name in NAMES:
        publisher.publish(name, 1)
    found: set[tuple[int, str]] = set()
    for message in subscriber.collect(len(NAMES)):
        found |= {(identifier, message.topic) for identifier in message.filters}
    for (number, written), name in product(enumerate(FILTERS, 1), NAMES):
        section.compare(f"`{written}` and `{name}`", matches(written, name), (number, name) in found)
    _close({"": publisher}, {"": subscriber})
    return section


def validity(broker: Broker) -> Section:
    """Which filters and names the broker takes."""
    section = Section("filters and names: which are valid")
    for version in VERSIONS:
        for written in (*INVALID, *PLAIN):
            shown = written.encode("unicode_escape").decode()
            section.compare(
                f"{version} filter `{shown}`",
                wrong_with_filter(written) is None,
                takes(broker, version, filter=written),
            )
        for name in ("a", "/", "a//b", "ü", "$x/a", "", "+", "a/+", "#", "a/#", "a\0b", "a\ud800"):
            shown = name.encode("unicode_escape").decode()
            section.compare(
                f"{version} topic `{shown}`", wrong_with_name(name) is None, takes(broker, version, topic=name)
            )
    return section


def _close(publishers: dict[Any, Client], subscribers: dict[Any, Client]) -> None:
    for client in (*publishers.values(), *subscribers.values()):
        client.close()
