"""What the MQTT pack promises under each fault, against a Mosquitto on which the fault is injected.

Each run of the tests tries the designs that lose something, and one that loses nothing; `dev.py conformance` tries all.
"""

from __future__ import annotations

import asyncio
import json
import os
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core import check, explain, read
from cqos_core.analysis.run_plan import named, prepare
from cqos_core.api import context
from cqos_core.packs.prover import Fault
from cqos_live.mqtt.prove.client import Client, Connection, Publication, Subscription
from cqos_live.mqtt.prove.mosquitto import Link, Mosquitto, program, version
from cqos_live.mqtt.prove.packets import Message, Will
from cqos_live.prove.outcomes import disagreements, kept_by
from cqos_mqtt.pack import PACK
from tests.conformance.guarantees import paused
from tests.effort import EXPLORE

if TYPE_CHECKING:
    from collections.abc import Callable

    from typing_extensions import Self

MISSING = program() is None
if MISSING and os.environ.get("CI") == "true":
    raise RuntimeError("Mosquitto is not installed, and where CI runs it has to be: apt-get install mosquitto")
pytestmark = [
    pytest.mark.skipif(MISSING, reason="Mosquitto is not installed: apt-get install mosquitto"),
    pytest.mark.xdist_group("mosquitto"),
]

AT_ONCE = 8
"""Runs at the same time: they mostly wait."""
KEPT = {"clean_start": False, "session_expiry_interval": 3600, "stores_session": True}
LIMITS = {"max_queued_messages": 5, "max_inflight_messages": 3}
Design = dict[str, Any]


def design(
    publication: Design,
    subscription: Design,
    publisher: Design | None = None,
    subscriber: Design | None = None,
    **more: Any,
) -> Design:
    return {
        "cqos": 1,
        "protocol": "mqtt",
        "options": {"mqtt": {"protocol_version": more.pop("version", "5.0"), **more.pop("options", {})}},
        "brokers": {"main": {"profile": "mosquitto", "persistence": True, **more.pop("broker", {})}},
        "topics": {"t": {"period": "20ms"}},
        "participants": {
            "p": {"client": {"client_id": "p", **(publisher or {})}, "publishes": {"t": publication}},
            "s": {
                "client": {"client_id": "s", **(subscriber or {})},
                "subscribes": {"t": {"taken_every": "0ms", **subscription}},
            },
        },
    }


NEW_ONLY = {"qos": 2, "retain_handling": "send_if_new"}
RETAINED = {"qos": 2, "retain": True}
OLD = {"clean_start": False, "stores_session": True}
DESIGNS = {
    "sessions that go on": design({"qos": 2}, {"qos": 2}, KEPT, KEPT),
    "sessions of 3.1.1 that go on": design({"qos": 2}, {"qos": 2}, OLD, OLD, version="3.1.1"),
    "retained, a new session of the subscriber": design({"qos": 1, "retain": True}, {"qos": 1}, KEPT),
    "retained, sent to new subscriptions": design(RETAINED, NEW_ONLY, KEPT, KEPT),
    "one at a time": design(
        {"qos": 1}, {"qos": 1}, {**KEPT, "max_inflight_messages": 1}, {**KEPT, "receive_maximum": 1}
    ),
    "new sessions, QoS 2": design({"qos": 2}, {"qos": 2}),
    "new sessions, QoS 0, retained": design({"qos": 0, "retain": True}, {"qos": 0}),
    "a broker that forgets": design({"qos": 2}, {"qos": 2}, KEPT, KEPT, broker={"persistence": False}),
    "an expiry": design({"qos": 1, "message_expiry_interval": 60}, {"qos": 1}, KEPT, KEPT),
}
FAULTS = (None, *(Fault(kind, 0.4) for kind in ("link_outage", "subscriber_restart", "publisher_restart")))
BROKER_FAULTS = tuple(Fault(kind, 0.2) for kind in ("broker_stop", "broker_crash"))
SLOW = Fault("slow_reader", 0.3)
LOSSES = {
    ("new sessions, QoS 2", "link_outage"),
    ("new sessions, QoS 2", "subscriber_restart"),
    ("new sessions, QoS 2", "publisher_restart"),
    ("new sessions, QoS 2", "broker_stop"),
    ("a broker that forgets", "broker_stop"),
    ("new sessions, QoS 2", "broker_crash"),
    ("sessions that go on", "broker_crash"),
    ("a short queue", "slow_reader"),
    ("a queue of five", "link_outage"),
    ("a queue of five", "subscriber_restart"),
    ("a session of a second", "subscriber_restart"),
    ("an expiry of a second", "subscriber_restart"),
}
"""Where something must be lost: the other side of the boundary, seen as well."""
SHORT = design({"qos": 1}, {"qos": 1}, KEPT, KEPT, broker=LIMITS)
FIVE = design({"qos": 1}, {"qos": 1}, KEPT, KEPT, broker=LIMITS)
BRIEF = {**KEPT, "session_expiry_interval": 1}
LONG = Fault("subscriber_restart", 2.5)
RUNS = [
    *product(DESIGNS.items(), (*FAULTS, *BROKER_FAULTS)),
    (("sessions that go on", DESIGNS["sessions that go on"]), SLOW),
    (("an expiry", DESIGNS["an expiry"]), SLOW),
    (("a short queue", SHORT), SLOW),
    *((("a queue of five", FIVE), fault) for fault in (*FAULTS, *BROKER_FAULTS)),
    (("a session of a second", design({"qos": 1}, {"qos": 1}, KEPT, BRIEF)), LONG),
    (("an expiry of a second", design({"qos": 1, "message_expiry_interval": 1}, {"qos": 1}, KEPT, KEPT)), LONG),
]


def run(case: tuple[tuple[str, Design], Fault | None]) -> tuple[list[str], set[tuple[str, str]], tuple[int, ...]]:
    """Run one design under one fault: what the run contradicts, the guarantees that it kept, what was lost."""
    (name, own), fault = case
    where = context(())
    system = named(read(json.dumps(own).encode(), importer="yaml"), where)
    trial = prepare(system, "p/publisher/t", "s/subscriber/t", where, "mosquitto", fault)
    trial = replace(trial, plan=replace(paused(trial.plan, name), early=3, patience=10.0))
    outcome = trial.run()
    kept = {
        (each.word, "link" if fault is None else fault.kind)
        for each in trial.report.guarantees
        if (fault is None or fault.kind in each.survives) and kept_by(each.word, each.value, trial.plan, outcome)
    }
    contradictions = [f"{name}, {fault}: {each}" for each in disagreements(trial, outcome, where)]
    early = range(trial.plan.early)
    return contradictions, kept, tuple(number for number in outcome.lost if number not in early)


def is_tried(case: tuple[tuple[str, Design], Fault | None]) -> bool:
    """Whether a run belongs to the tests of each day."""
    (name, _), fault = case
    return EXPLORE or name == "sessions that go on" or (fault is not None and (name, fault.kind) in LOSSES)


@pytest.mark.explored
def test_what_is_promised_holds_under_every_fault():
    runs = [each for each in RUNS if is_tried(each)]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        results = list(pool.map(run, runs))
    assert [line for contradictions, _, _ in results for line in contradictions] == []
    lossy = {
        (name, fault.kind) for ((name, _), fault), (_, _, lost) in zip(runs, results, strict=True) if fault and lost
    }
    assert LOSSES <= lossy
    seen = {cell for _, kept, _ in results for cell in kept}
    proven = {(proof.guarantee, proof.fault) for proof in PACK.proofs} - ELSEWHERE
    assert seen == proven if EXPLORE else {fault for _, fault in seen} == {fault for _, fault in proven}
    assert {proof.version for proof in PACK.proofs} == {"2.0.11"}


ELSEWHERE = {
    *(("offline", fault) for fault in ("link", "subscriber_restart", "broker_stop")),
    *(("liveness", fault) for fault in ("link", "publisher_restart")),
    *(("max_age", fault) for fault in ("link", "subscriber_restart")),
    ("max_gap", "link"),
    ("duplicate_free", "broker_crash"),
}
"""Cells that the tests below, those of `test_mosquitto.py`, and the recorded runs of other designs show."""


# What a run of one pair does not show


async def while_still(still: Callable[[], object], patience: float = 5.0) -> None:
    """Wait as long as something still is so."""
    end = asyncio.get_running_loop().time() + patience
    while still():
        assert asyncio.get_running_loop().time() < end, f"still so after {patience:g} s"
        await asyncio.sleep(0.01)


class Watched:
    """A client that remembers what arrived and what its library reported."""

    def __init__(
        self, broker: Mosquitto | Link, name: str, subscription: Subscription | None = None, **more: Any
    ) -> None:
        self.arrived: list[Message] = []
        self.times: list[float] = []
        self.reports: list[str] = []
        every = more.pop("every", 0.0)
        self.client = Client(
            Connection(name, **more),
            broker.port,
            lambda what, text: self.reports.append(f"{what} {text}".strip()),
            self._take,
            subscription,
            every,
        )

    async def __aenter__(self) -> Self:
        self.client.start()
        await asyncio.wait_for(self.client.settled.wait(), 5)
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.client.kill()

    def _take(self, message: Message) -> None:
        self.arrived.append(message)
        self.times.append(time.monotonic())

    async def get(self, number: int, patience: float = 5.0) -> list[str]:
        """Wait for so many messages, and a little for more that should not come."""
        await while_still(lambda: len(self.arrived) < number, patience)
        await asyncio.sleep(0.2)
        return [message.payload.decode() for message in self.arrived]

    def publish(self, topic: str, payload: str = "x", qos: int = 1, **more: Any) -> None:
        self.client.publish(Publication(topic, payload.encode(), qos, **more))


@asynccontextmanager
async def running(*directives: str, access: tuple[str, ...] = ()):
    broker = Mosquitto(directives, access)
    try:
        await broker.start()
        yield broker
    finally:
        await broker.close()


STAYS: dict[str, Any] = {"clean": False, "session_expiry": 3600}


def codes(own: Design) -> set[str]:
    return {each.code for each in check(json.dumps(own).encode(), importer="yaml").findings if each.severity != "note"}


def test_a_member_of_a_share_that_is_away_finds_its_share_only():
    """The fact behind MQTT427."""

    async def show() -> tuple[list[str], list[str]]:
        own = Subscription("$share/g/t", 1)
        async with running() as broker, Watched(broker, "p") as p, Watched(broker, "there", own, **STAYS) as there:
            async with Watched(broker, "away", own, **STAYS):
                pass
            for number in range(10):
                p.publish("t", str(number))
            at_once = await there.get(5)
            async with Watched(broker, "away", own, **STAYS) as away:
                return at_once, await away.get(5)

    at_once, later = asyncio.run(show())
    assert sorted(at_once + later, key=int) == [str(number) for number in range(10)]
    assert len(at_once) == len(later) == 5


@pytest.mark.parametrize(
    ("directives", "number"),
    [
        (("max_queued_messages 5", "max_inflight_messages 3"), 5),
        (("max_queued_messages 0", "max_queued_bytes 100"), 10),
        (("max_queued_messages 5", "max_queued_bytes 40"), 4),
    ],
)
def test_the_queue_is_one_for_all_topics_of_a_client(directives, number):
    async def show() -> list[str]:
        own = Subscription("q/#", 1)
        async with running(*directives) as broker, Watched(broker, "p") as p:
            async with Watched(broker, "s", own, **STAYS):
                pass
            for each in range(30):
                p.publish(f"q/{each % 3}", f"{each:010d}")
            await while_still(lambda: p.client.session.unacknowledged or p.client.waiting)
            async with Watched(broker, "s", own, **STAYS) as s:
                return await s.get(number)

    assert asyncio.run(show()) == [f"{each:010d}" for each in range(number)]


TWO = ("t", "u")


def two_topics(limits: Design, subscription: Design, **topic: Any) -> Design:
    """A client with two topics; each alone has room in its queue."""
    own = design({"qos": 1, "max_payload": 10}, subscription, {}, KEPT, broker=limits)
    own["topics"] = {name: dict(topic) for name in TWO}
    own["participants"]["p"]["publishes"]["u"] = {"qos": 1, "max_payload": 10}
    own["participants"]["s"]["subscribes"]["u"] = {"qos": 1}
    return own


LIMITED = [
    ({"max_queued_messages": 12}, 6),
    ({"max_queued_messages": 0, "max_queued_bytes": 115}, 6),
    ({"max_queued_messages": 0, "max_queued_bytes": 110}, 5),
    ({"max_queued_messages": 11, "max_queued_bytes": 1000}, 5),
]


@pytest.mark.parametrize(("limits", "room"), LIMITED)
def test_an_absence_is_bridged_while_all_topics_together_have_room(limits, room):
    """Each topic alone has room; six of both together only where all twelve have."""

    async def show(each: int) -> set[str]:
        directives = [f"{name} {number}" for name, number in limits.items()]
        async with running(*directives) as broker, Watched(broker, "p") as p:
            async with Watched(broker, "s", Subscription("+", 1), **STAYS):
                pass
            for number in range(each):
                for name in TWO:
                    p.publish(name, f"{name}{number:09d}")
            await while_still(lambda: p.client.session.unacknowledged or p.client.waiting)
            async with Watched(broker, "s", Subscription("+", 1), **STAYS) as s:
                return set(await s.get(0))

    said = {name: number or "unlimited" for name, number in limits.items()}
    for each in (5, 6):
        assert (len(asyncio.run(show(each))) == 2 * each) is (each <= room)
        needs = {"qos": 1, "needs": {"offline": f"{each - 0.5:g}s"}}  # within it, so many may come
        assert ("MQTT407" in codes(two_topics(said, needs, period="1s"))) is (each > room)
        alone = two_topics(said, needs, period="1s")
        del alone["participants"]["s"]["subscribes"]["u"], alone["participants"]["p"]["publishes"]["u"]
        assert "MQTT407" not in codes(alone)


@pytest.mark.parametrize(("limits", "room"), LIMITED)
def test_a_burst_is_kept_while_all_topics_together_have_room(limits, room):
    """As above for a client that is connected and takes nothing; two messages are on their way to it.

    Mosquitto before 2.0.13 counts these two. From 2.0.13 on it does not, and lets two more wait.
    """
    on_their_way = 2
    grows = tuple(map(int, version().split(".")[:3])) >= (2, 0, 13)

    async def show(each: int) -> set[str]:
        directives = [f"{name} {number}" for name, number in limits.items()]
        more: dict[str, Any] = {**STAYS, "receive_maximum": on_their_way}
        async with running(*directives) as broker, Watched(broker, "p") as p:
            async with Watched(broker, "s", Subscription("+", 1), every=5.0, **more):
                for number in range(each):
                    for name in TWO:
                        p.publish(name, f"{name}{number:09d}")
                await while_still(lambda: p.client.session.unacknowledged or p.client.waiting)
            async with Watched(broker, "s", Subscription("+", 1), **STAYS) as s:
                return set(await s.get(0))

    said = {name: number or "unlimited" for name, number in limits.items()}
    in_bytes = limits["max_queued_messages"] == 0
    always = room + (0 if in_bytes else on_their_way // 2)
    room = always + (on_their_way // 2 if grows else 0)
    for each in (room, room + 1):
        assert (len(asyncio.run(show(each))) == 2 * each) is (each <= room)
    for broker, most in (({}, always), ({"queue_grows": grows}, room)):
        for each in (always, always + 1, always + 2):
            own = two_topics({**said, **broker}, {"qos": 1, "needs": {"loss_free": True}}, burst=each)
            own["participants"]["s"]["client"]["receive_maximum"] = on_their_way
            assert ("MQTT706" in codes(own)) is (each > most)


@pytest.mark.parametrize("crash", [False, True])
def test_what_waits_for_a_client_survives_a_stop_and_no_crash(crash):
    """The facts behind MQTT417 and MQTT428; without a fault, `test_mosquitto.py` asks for every kind of session."""

    async def show() -> list[str]:
        own = Subscription("t", 1)
        async with running("persistence true") as broker, Watched(broker, "p") as p:
            async with Watched(broker, "s", own, **STAYS):
                pass
            p.publish("t", "waits")
            await while_still(lambda: p.client.session.unacknowledged)
            await broker.end(crash=crash)
            await broker.start()
            async with Watched(broker, "s", own, **STAYS) as s:
                return await s.get(not crash)

    assert asyncio.run(show()) == ([] if crash else ["waits"])
    own = design({"qos": 1}, {"qos": 1}, {}, KEPT)
    fault = "broker_crash" if crash else "broker_stop"
    own["participants"]["s"]["subscribes"]["t"]["needs"] = {"offline": "1s", "survives": [fault]}
    assert ("MQTT428" in codes(own)) is crash


@pytest.mark.parametrize(("handling", "kept", "again"), [(0, True, 1), (1, True, 0), (1, False, 1), (2, False, 0)])
def test_who_is_sent_a_retained_message_again(handling, kept, again):
    """The facts behind MQTT317 and MQTT112."""

    async def show() -> int:
        own = Subscription("t", 1, handling=handling)
        more = STAYS if kept else {}
        async with running() as broker, Watched(broker, "p") as p:
            p.publish("t", "old", retain=True)
            await while_still(lambda: p.client.session.unacknowledged)
            async with Watched(broker, "s", own, **more) as s:
                await s.get(handling < 2)
            async with Watched(broker, "s", own, **more) as s:
                return len(await s.get(again))

    assert asyncio.run(show()) == again
    words = ("send", "send_if_new", "do_not_send")
    own = design({"qos": 1, "retain": True}, {"qos": 1, "retain_handling": words[handling]}, {}, KEPT if kept else {})
    for need, unmet in (("latest", not again), ("duplicate_free", bool(again))):
        own["participants"]["s"]["subscribes"]["t"]["needs"] = {need: True, "survives": ["subscriber_restart"]}
        wanted = {"latest": "MQTT317", "duplicate_free": "MQTT112"}[need]
        assert (wanted in codes(own)) is unmet, need


def test_no_will_tells_of_a_publisher_that_dies_while_the_broker_is_down():
    """The fact behind MQTT512; a broker that is stopped sends the Wills of all who are connected, dead or alive."""

    async def show(*, crash: bool) -> list[str]:
        async with running("persistence false") as broker, Watched(broker, "w", Subscription("gone", 1)) as watching:
            async with Watched(broker, "p", will=Will("gone", b"p", 1, False, 0, None)) as p:
                await broker.end(crash=crash)
                await while_still(lambda: "disconnected" not in p.reports)
            await broker.start()
            await while_still(lambda: watching.reports.count("connected new session") < 2)
            return await watching.get(0)

    assert asyncio.run(show(crash=True)) == []
    assert asyncio.run(show(crash=False)) == ["p"]


def test_access_control_holds_for_wills():
    async def show(topic: str) -> list[str]:
        rights = ("topic write ok/#", "topic read #")
        async with running(access=rights) as broker, Watched(broker, "w", Subscription("#", 1)) as watching:
            async with Watched(broker, "p", will=Will(topic, b"p", 1, False, 0, None)):
                pass
            return await watching.get(topic == "ok/p")

    for topic, sent in (("ok/p", ["p"]), ("no/p", [])):
        assert asyncio.run(show(topic)) == sent
        own = design({}, {"qos": 1, "needs": {"liveness": "5min"}}, {"will": {"topic": topic}, "username": "p"})
        own["brokers"]["main"]["acl"] = ["write p ok/#", "write p t", "read * #"]
        own["participants"]["s"]["subscribes"]["+/p"] = {}
        assert ("MQTT505" in codes(own)) is (not sent)


@pytest.mark.parametrize("five", [False, True])
def test_what_clients_publish_to_sys_is_dropped(five):
    """The fact behind MQTT622."""

    async def show() -> list[str]:
        own = Subscription("$SYS/own/#", 1)
        async with running() as broker, Watched(broker, "s", own) as s, Watched(broker, "p", five=five) as p:
            p.publish("$SYS/own/x")
            return await s.get(0)

    assert asyncio.run(show()) == []


def test_messages_expire_before_a_slow_program_takes_them():
    """The fact behind MQTT426."""

    async def show() -> list[str]:
        own = Subscription("t", 1)
        more: dict[str, Any] = {"receive_maximum": 1, "every": 2.2}
        async with running() as broker, Watched(broker, "s", own, **more) as s, Watched(broker, "p") as p:
            for number in range(3):
                p.publish("t", str(number), expiry=1)
            return await s.get(1, 8.0)

    assert asyncio.run(show()) == ["0"]


def test_mosquitto_notices_a_silent_client_late_and_within_what_the_preset_says():
    """The fact behind `keep_alive_delay`."""

    async def show() -> tuple[float, float]:
        """How long after the client began to connect, and after it fell silent, its Will came."""
        async with running() as broker, Watched(broker, "w", Subscription("gone", 1)) as watching:
            clock = asyncio.get_running_loop().time
            began = clock()
            async with Watched(broker, "p", keep_alive=1, will=Will("gone", b"p", 1, False, 0, None)) as p:
                p.client.freeze()
                silent = clock()
                await watching.get(1, 10.0)
                return clock() - began, clock() - silent - 0.2

    delay = 7.0
    assert PACK.presets["mosquitto"].settings["keep_alive_delay"] == f"{delay:g}s"
    most, least = asyncio.run(show())  # the last packet came between the two
    assert most > 1.0  # it counts whole seconds, so half of one may be missing
    assert least <= 1.5 + delay


@pytest.mark.parametrize(("expiry", "largest"), [(None, 94), (60, 89)])
def test_the_largest_packet_that_fits_a_subscriber_arrives(expiry, largest):
    """The fact behind MQTT210; again Mosquitto takes one more for each byte of the length."""

    async def show(size: int) -> int:
        own = Subscription("t", 0)
        async with (
            running() as broker,
            Watched(broker, "s", own, maximum_packet_size=100) as s,
            Watched(broker, "p") as p,
        ):
            p.publish("t", "x" * size, 0, expiry=expiry)
            return len(await s.get(size <= largest))

    assert asyncio.run(show(largest)) == 1
    assert asyncio.run(show(largest + 3)) == 0
    for size in (largest, largest + 1):
        stated = {"max_payload": size, **({} if expiry is None else {"message_expiry_interval": expiry})}
        own = design(stated, {}, None, {"maximum_packet_size": 100})
        assert ("MQTT210" in codes(own)) is (size > largest)


@pytest.mark.parametrize("raised", [False, True])
def test_messages_arrive_with_the_qos_that_explain_names(raised):
    """The fact behind MQTT107."""

    async def show(published: int, subscribed: int) -> str:
        directive = f"upgrade_outgoing_qos {str(raised).lower()}"
        own = Subscription("t", subscribed)
        async with running(directive) as broker, Watched(broker, "s", own) as s, Watched(broker, "p") as p:
            p.publish("t", qos=published)
            await s.get(1)
            return str(s.arrived[0].qos)

    for published, subscribed in product(range(3), repeat=2):
        own = design({"qos": published}, {"qos": subscribed}, broker={"upgrade_outgoing_qos": raised})
        report = explain(json.dumps(own).encode(), publisher="p/publisher/t", subscriber="s/subscriber/t")
        assert report.derived == (("arrives with QoS", asyncio.run(show(published, subscribed))),)


def test_what_is_published_with_a_period_arrives_with_it():
    """The fact behind MQTT504: the broker holds nothing back from a connected client."""

    async def show() -> float:
        period, times = 0.1, []
        async with running() as broker, Watched(broker, "p") as p, Watched(broker, "s", Subscription("t", 1)) as s:
            for number in range(10):
                p.publish("t", str(number))
                before = asyncio.get_running_loop().time()
                await while_still(lambda: len(s.arrived) <= number)  # noqa: B023 - waited for within the round
                times.append(asyncio.get_running_loop().time() - before)
                await asyncio.sleep(period)
        return max(times)

    assert asyncio.run(show()) < 1.0
    stated = design({"qos": 1}, {"qos": 1})
    stated["options"]["mqtt"]["repair_time"] = "0ms"
    report = explain(json.dumps(stated).encode(), publisher="p/publisher/t", subscriber="s/subscriber/t")
    assert [(each.value, each.cells[0].proven) for each in report.guarantees if each.word == "max_gap"] == [
        ("20ms", ("Mosquitto 2.0.11",))
    ]


@pytest.mark.parametrize(("five", "qos", "largest"), [(True, 0, 94), (True, 1, 92), (False, 0, 95), (False, 1, 93)])
def test_the_largest_packet_that_fits_is_taken(five, qos, largest):
    """The fact behind MQTT209; Mosquitto leaves the bytes of the length out of account, so it takes one more for each."""

    async def show(size: int) -> int:
        async with (
            running("max_packet_size 100") as broker,
            Watched(broker, "s", Subscription("t", 1), five=five) as s,
            Watched(broker, "p", five=five) as p,
        ):
            p.publish("t", "x" * size, qos)
            return len(await s.get(size <= largest))

    assert asyncio.run(show(largest)) == 1
    assert asyncio.run(show(largest + 3)) == 0
    for size in (largest, largest + 1):
        own = design({"qos": qos, "max_payload": size}, {"qos": 1}, version="5.0" if five else "3.1.1")
        own["brokers"]["main"]["maximum_packet_size"] = 100
        assert ("MQTT209" in codes(own)) is (size > largest)


# What the clock of the broker, the network and a bridge do


async def begin_second(at: float) -> None:
    """Wait until the clock is so many seconds behind a whole one, as Mosquitto counts whole seconds."""
    await asyncio.sleep((at - time.time()) % 1)


async def still_there(expiry: int, wait: float, at: float, *, retain: bool) -> bool:
    """Publish one message, and say whether a client that comes later gets it."""
    more = {} if retain else STAYS
    own = Subscription("t", 1)
    async with running() as broker, Watched(broker, "p") as p:
        if not retain:
            async with Watched(broker, "s", own, **more):
                pass
        await begin_second(at)
        p.publish("t", expiry=expiry, retain=retain)
        await asyncio.sleep(wait)
        async with Watched(broker, "s", own, **more) as s:
            return bool(await s.get(0))


@pytest.mark.parametrize(
    ("wait", "at", "retain", "there"),
    [
        (1.5, 0.05, False, True),  # half a second after its expiry
        (0.7, 0.9, False, True),
        (2.3, 0.05, False, False),
        (0.5, 0.05, True, True),
        (0.5, 0.7, True, False),  # half a second before its expiry
    ],
)
def test_an_expiry_counts_whole_seconds(wait, at, retain, there):
    """The facts behind MQTT502 and MQTT306."""
    assert asyncio.run(still_there(1, wait, at, retain=retain)) is there
    delay = PACK.presets["mosquitto"].settings["expiry_delay"]
    assert delay == "1s"
    for age, enough in (("1999ms", False), ("2s", True)):
        own = design({"qos": 1, "message_expiry_interval": 1}, {"qos": 1, "needs": {"max_age": age}})
        assert ("MQTT502" in codes(own)) is (not enough)


@pytest.mark.parametrize("retain", [False, True])
def test_an_expiry_of_zero_is_none(retain):
    """The fact behind MQTT515."""
    assert asyncio.run(still_there(0, 2.3, 0.05, retain=retain))
    own = design({"qos": 1, "message_expiry_interval": 0}, {"qos": 1, "needs": {"max_age": "1s"}})
    assert "MQTT515" in codes(own)


@pytest.mark.parametrize("payload", ["", "x"])
def test_an_empty_retained_message_deletes_the_stored_one(payload):
    """The fact behind MQTT339."""

    async def show() -> int:
        async with running() as broker, Watched(broker, "p") as p:
            for each in ("old", payload):
                p.publish("t", each, retain=True)
            await while_still(lambda: p.client.session.unacknowledged or p.client.waiting)
            async with Watched(broker, "s", Subscription("t", 1)) as s:
                return len(await s.get(bool(payload)))

    assert asyncio.run(show()) == len(payload)
    own = design({"qos": 1, "retain": True, "max_payload": len(payload)}, {"qos": 1, "needs": {"late_join": 1}})
    assert ("MQTT339" in codes(own)) is (not payload)


@pytest.mark.parametrize("private", [False, True])
@pytest.mark.parametrize("lines", [("topic # both 2",), ("topic t out 2", "topic # in 2"), ("topic t out 2",)])
def test_a_bridge_that_the_other_broker_does_not_know_brings_messages_back(tmp_path, private, lines):
    """The facts behind MQTT617 and MQTT709."""
    topics = ("connection up", "address {}", *lines, f"try_private {str(private).lower()}", "restart_timeout 1")
    back = not private and any(" in" in line or " both" in line for line in lines)

    async def show() -> list[str]:
        async with running() as there, Watched(there, "other", Subscription("t", 2)) as other:
            block = [line.format(f"127.0.0.1:{there.port}") for line in topics]
            async with running(*block) as here, Watched(here, "p") as p, Watched(here, "s", Subscription("t", 2)) as s:
                while not other.arrived:  # until the bridge is connected
                    p.publish("t", "first", 2)
                    await asyncio.sleep(0.2)
                await asyncio.sleep(0.5)
                before = len(s.arrived)
                for number in range(2):
                    p.publish("t", str(number), 2)
                return (await s.get(before + 2 * (1 + back)))[before:]

    arrived = asyncio.run(show())
    assert sorted(arrived) == sorted(["0", "1"] * (1 + back))
    conf, clients = tmp_path / "mosquitto.conf", tmp_path / "clients.yaml"
    conf.write_text("\n".join(("listener 1883", *(line.format("cloud:1883") for line in topics))) + "\n")
    own = design({"qos": 2}, {"qos": 2, "needs": {"duplicate_free": True, "ordered": True}})
    del own["brokers"]
    for each in own["participants"].values():
        each["broker"] = "mosquitto"
    clients.write_text(json.dumps(own))
    found = {each.code for each in check(conf, clients).findings}
    assert ("MQTT617" in found) is back
    assert ("MQTT709" in found) is back


def test_lost_packets_lengthen_a_gap():
    """The fact behind MQTT504: TCP holds back what follows a lost packet until it is sent again."""
    period, held = 0.05, 0.3

    class Holding(Link):
        """A link that holds back what comes, as TCP does while a packet is lost."""

        async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            while data := await reader.read(65_536):
                await flowing.wait()
                writer.write(data)

    async def show() -> list[float]:
        flowing.set()
        times: list[float] = []
        async with running() as broker, Watched(broker, "p") as p:
            link = Holding(broker.port)
            await link.start()
            async with Watched(link, "s", Subscription("t", 1)) as s:
                for number in range(20):
                    if number == 10:
                        flowing.clear()
                        asyncio.get_running_loop().call_later(held, flowing.set)
                    p.publish("t", str(number))
                    await asyncio.sleep(period)
                await s.get(20)
                times = s.times
            await link.close()
        return [after - before for before, after in pairwise(times)]

    flowing = asyncio.Event()
    gap = max(asyncio.run(show()))
    assert period + 0.1 < gap < period + held + 0.5
    own = design({"qos": 1}, {"qos": 1, "needs": {"max_gap": "320ms"}}, broker={"max_queued_messages": "unlimited"})
    for repair, unmet in ((None, True), ("301ms", True), ("300ms", False)):
        own["options"]["mqtt"].pop("repair_time", None)
        if repair:
            own["options"]["mqtt"]["repair_time"] = repair
        assert ("MQTT504" in codes(own)) is unmet
