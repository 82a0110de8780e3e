"""What follows from the values of all endpoints: what waits in the one queue of a client, and how large packets are.

A broker has one queue for each client, whatever its topics and filters, and bounds it in messages and in bytes.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from cqos_core.language.binder import bind
from cqos_core.matching.judge import failed_match_conditions
from cqos_core.model.grouping import grouped
from cqos_core.model.suggestions import listed
from cqos_core.model.system import PUBLISHER
from cqos_core.packs import INFINITE, TAKEN_EVERY, Anything, Depends, as_condition, broker, is_plain
from cqos_mqtt.broker_policies import (
    GROWS,
    INFLIGHT,
    QUEUED,
    QUEUED_BYTES,
    QUEUES_QOS0,
)
from cqos_mqtt.connection_policies import RECEIVE_MAXIMUM
from cqos_mqtt.endpoint_policies import (
    BURST_BYTES,
    BURSTS,
    ENVELOPE,
    ENVELOPE_TO_BROKER,
    EXPIRY,
    IS_WILL,
    PACED,
    PAYLOAD,
    PROPERTIES,
    QOS,
    QUEUE_LASTS,
    SHARED,
    TOPIC_ALIAS,
    WAITING,
    WAITING_BYTES,
)
from cqos_mqtt.filters import LONGEST, has_wildcards, match
from cqos_mqtt.policies import BURST, PERIOD, VERSION
from cqos_mqtt.rules import EFFECTIVE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.language.bound_condition import BoundCondition
    from cqos_core.packs import Policy, RulePack, Value
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

Client = tuple[tuple[str, "QosProfile"], ...]
"""The subscriptions of one client: filter and values of each."""


class Stream(NamedTuple):
    """What comes on one topic to one subscription and may wait; a fact of a topic counts once for all its publishers.

    Attributes:
        topic: its name.
        sure: whether all of it certainly takes room in the queue.
        period, size: of the messages; a period of INFINITE is one message. None: not known.
        burst: how many come at once. None: not known.
        bursts: whether `burst` is stated; else it is one where there is a period.
        taken: how often the program takes them; 0: not stated, None: not known.
    """

    topic: str
    sure: bool
    period: int | None
    size: int | None
    burst: int | None
    bursts: bool
    taken: int | None

    def within(self, time: int) -> int | None:
        """Return how many messages come within a time; None where that is not known."""
        if self.period is None or (self.burst is None and self.bursts):
            return None
        return max(self.burst or 0, 1 if self.period == INFINITE else -(-time // max(self.period, 1))) if time else 0


Alike = tuple[Stream, int]
"""So many streams that differ in nothing but the topic; the first of them."""
Amount = tuple[Stream, "int | None"]
"""So many messages of streams that are alike; None: not known how many."""


def sum_up(endpoints: Sequence[Resolved]) -> Mapping[int, Mapping[str, Value]]:
    """Return, by position, the values of endpoints that follow from those of all."""
    found: dict[int, Mapping[str, Value]] = {}
    clients: dict[str, list[tuple[int, Resolved]]] = {}
    published: dict[str, Counter[QosProfile]] = {}
    for position, each in enumerate(endpoints):
        if each.key is None:
            continue
        if each.role == PUBLISHER:
            if packet := _packet(each.key, each.profile):
                found[position] = packet
            published.setdefault(each.key, Counter())[each.profile] += 1
        else:
            clients.setdefault(each.endpoint.participant, []).append((position, each))
    queues = _Queues(published, {each.key or "" for own in clients.values() for _, each in own})
    for own in clients.values():
        client = tuple(sorted(((each.key or "", each.profile) for _, each in own), key=lambda each: each[0]))
        facts = queues.of(client)
        found |= {position: facts for position, _ in own}
    return found


# Packets


@lru_cache(maxsize=10_000)
def _packet(topic: str, profile: QosProfile) -> Mapping[str, Value]:
    """Say how large a packet is around the largest payload."""
    payload, level = _value(profile, PAYLOAD), _value(profile, QOS)
    if not isinstance(payload, int):
        return {}
    name = 2 + len(topic.encode(errors="replace"))
    around: Value = name + _header(payload + name)
    if has_wildcards(topic):
        longest = 2 + LONGEST
        around = Depends(
            f"the length of topic `{topic}`", (("shortest", around), ("longest", longest + _header(payload + longest)))
        )
    identifiers: Value = 2 * (level != 0)
    if not is_plain(level):
        identifiers = Depends(f"the QoS of `{topic}`", (("0", 0), ("1 or 2", 2)))
    alias = 3 * _is_stated(profile, TOPIC_ALIAS)
    # A client of 3.1.1 cannot say that its messages expire.
    expiry = _over(_value(profile, VERSION), lambda rank: _value(profile, EXPIRY) if rank else INFINITE)
    return {
        ENVELOPE.name: around,
        ENVELOPE_TO_BROKER.name: _over(identifiers, lambda size: _over(around, lambda other: size + other + alias)),
        PROPERTIES.name: _over(expiry, lambda time: 1 + 5 * (time != INFINITE)),
    }


def _header(remaining: int) -> int:
    """Return the size of a fixed header: a byte, and one to four for the length of what follows."""
    return 2 + sum(remaining >= limit for limit in (128, 16_384, 2_097_152))


# Queues


class _Queues:
    """What the publications of a system bring to its clients; clients with equal subscriptions are looked at once."""

    def __init__(self, published: Mapping[str, Counter[QosProfile]], filters: set[str]) -> None:
        self._published = published
        matched = ((written, topic) for topic, written in match(published.keys(), filters))
        self._topics = grouped([*matched, *((topic, topic) for topic in published.keys() & filters)])
        self._streams: dict[tuple[str, QosProfile], tuple[Alike, ...]] = {}
        self._facts: dict[Client, Mapping[str, Value]] = {}

    def of(self, client: Client) -> Mapping[str, Value]:
        """Return what is true of all subscriptions of a client."""
        facts = self._facts.get(client)
        if facts is None:
            streams = [alike for written, profile in client for alike in self._to(written, profile)]
            if not any(profile.needs for _, profile in client):
                # No message names what is not known, so clients that differ in names alone stay alike.
                streams = [(each._replace(topic=""), number) for each, number in streams]
            facts = _facts(streams, client[0][1])
            facts[PACED.name] = _is_paced(profile for _, profile in client)
            self._facts[client] = facts
        return facts

    def _to(self, written: str, profile: QosProfile) -> tuple[Alike, ...]:
        """Return what comes to one subscription; where it is not known who publishes, what its own topic says."""
        key = (written, profile)
        streams = self._streams.get(key)
        if streams is None:
            topics = self._topics.get(written)
            found = (
                [each for topic in sorted(topics) for each in _streams(topic, self._published[topic], profile)]
                if topics
                else _from_outside(written, profile)
            )
            streams = self._streams[key] = _alike((each, 1) for each in found)
        return streams


Heard: TypeAlias = "Sequence[tuple[Mapping[QosProfile, int], int]]"
"""Publishers of a topic by profile, and how many topics have such publishers."""


def heard(client: Sequence[tuple[Heard, QosProfile]]) -> Mapping[str, Value]:
    """Return what `sum_up` says of all subscriptions of a client, from what each hears, without names of topics."""
    streams: list[Alike] = []
    for topics, profile in client:
        found = [(each, number) for publishers, number in topics for each in _streams("", publishers, profile)]
        streams += _alike(found if topics else ((each, 1) for each in _from_outside("", profile)))
    return {**_facts(streams, client[0][1]), PACED.name: _is_paced(profile for _, profile in client)}


def _is_paced(client: Iterable[QosProfile]) -> int:
    """Whether it is stated how often the program of a client takes messages."""
    return int(any(_is_stated(each, TAKEN_EVERY) for each in client))


def _streams(topic: str, publishers: Mapping[QosProfile, int], subscriber: QosProfile) -> Iterator[Stream]:
    """Yield what comes on a topic to a subscription and takes room in the queue of its client."""
    meeting = [(each, number) for each, number in publishers.items() if not failed_match_conditions(each, subscriber)]
    taken = _fact(subscriber, TAKEN_EVERY)
    waits: list[bool | None] = []
    sizes: list[int | None] = []
    for publisher, number in meeting:
        waiting = _waiting(subscriber.pack).judge(publisher.values, subscriber.values).result
        size = _fact(publisher, PAYLOAD) if _is_stated(publisher, PAYLOAD) else None
        if _value(publisher, IS_WILL) == 1:
            will = Stream(topic, waiting is True, INFINITE, size, 1, bursts=False, taken=taken)
            yield from () if waiting is False else (will,) * number
        else:
            waits.append(waiting)
            sizes.append(size)
    if all(each is False for each in waits):
        return
    known = [size for size in sizes if size is not None]
    yield _stream(
        topic,
        next(publisher for publisher, _ in meeting if _value(publisher, IS_WILL) != 1),
        max(known) if len(known) == len(sizes) else None,
        taken,
        sure=all(waits) and _value(subscriber, SHARED) == 0,
    )


def _from_outside(written: str, subscriber: QosProfile) -> tuple[Stream, ...]:
    if _value(subscriber, QOS) == 0 and _value(subscriber, QUEUES_QOS0) == 0:
        return ()
    return (_stream(written, subscriber, None, _fact(subscriber, TAKEN_EVERY), sure=False),)


def _stream(topic: str, facts: QosProfile, size: int | None, taken: int | None, *, sure: bool) -> Stream:
    period = _fact(facts, PERIOD) if _is_stated(facts, PERIOD) else None
    bursts = _is_stated(facts, BURST)
    burst = _fact(facts, BURST) if bursts else None if period is None else 1
    return Stream(topic, sure, period, size, burst, bursts, taken)


@lru_cache(maxsize=8)
def _waiting(pack: RulePack) -> BoundCondition:
    """Return the condition that messages of a pair wait for a client that does not take them."""
    return bind((EFFECTIVE >= "1") | as_condition(broker(QUEUES_QOS0)), pack.vocabulary)


def _value(profile: QosProfile, policy: Policy) -> Value:
    value: Value = profile.values[profile.pack.vocabulary.indices[policy.level, policy.name]]
    return value


def _is_stated(profile: QosProfile, policy: Policy) -> bool:
    """Whether a fact is stated, even if it is not understood."""
    value = _value(profile, policy)
    return not isinstance(value, Anything) or value.reported


def _fact(profile: QosProfile, policy: Policy) -> int | None:
    """Return a fact; 0 where it is not stated, None where it is not known."""
    value = _value(profile, policy)
    if isinstance(value, int):
        return value
    return None if _is_stated(profile, policy) else 0


def _facts(streams: Sequence[Alike], client: QosProfile) -> dict[str, Value]:
    """Return the derived values of all subscriptions of a client."""
    kept, size = _value(client, QUEUED), _value(client, QUEUED_BYTES)
    slowest = max((each.taken or 0 for each, _ in streams), default=0)
    at_once: list[Amount] = []
    between: list[Amount] = []
    if any(each.bursts for each, _ in streams):
        at_once = [(each, _times(number, each.burst)) for each, number in streams]
    if any(each.taken != 0 for each, _ in streams):
        between = [
            (each, _times(number, None if each.taken is None else each.within(min(slowest, each.taken or slowest))))
            for each, number in streams
        ]
    return {
        QUEUE_LASTS.name: _over(kept, lambda most: _over(size, lambda most_bytes: _lasts(streams, most, most_bytes))),
        BURSTS.name: _messages(at_once),
        BURST_BYTES.name: _queued_bytes(at_once, size, client),
        WAITING.name: _messages(between),
        WAITING_BYTES.name: _queued_bytes(between, size, client),
    }


def _times(number: int, amount: int | None) -> int | None:
    return None if amount is None else number * amount


def _over(value: Value, result: Callable[[int], Value]) -> Value:
    """Return what follows from a value that may not be known."""
    if isinstance(value, Depends):
        return Depends(value.on, tuple((name, _over(case, result)) for name, case in value.cases))
    return result(value) if isinstance(value, int) else value


def _between(streams: Iterable[Stream], least: int, most: int) -> Value:
    """Return what follows from the least and from the most that may come on topics that are not fully known."""
    if least == most:
        return least
    topics = sorted({f"`{each.topic}`" for each in streams if each.topic})
    what = listed(topics) if topics else "topics that are not fully known"
    return Depends(f"what comes on {what}", (("the least", least), ("the most", most)))


def _messages(amounts: Sequence[Amount]) -> Value:
    """Return how many messages wait together."""
    least = sum(number or 0 for stream, number in amounts if stream.sure)
    most = sum(INFINITE if number is None else number for _, number in amounts)
    doubtful = (stream for stream, number in amounts if number is None or not stream.sure)
    return _between(doubtful, least, min(most, INFINITE))


def _queued_bytes(amounts: Sequence[Amount], kept: Value, client: QosProfile) -> Value:
    """Return how many bytes count when the last message comes: Mosquitto keeps it while these are fewer than the limit."""
    if kept == INFINITE or not amounts:
        return 0
    with_window = _bytes(amounts, 0)
    grows = _value(client, GROWS)
    if grows == 0:
        return with_window
    window = _over(
        _value(client, RECEIVE_MAXIMUM), lambda most: _over(_value(client, INFLIGHT), lambda own: min(most, own))
    )
    without = _over(window, lambda number: _bytes(amounts, number))
    if grows == 1 or with_window == without:
        return without
    return Depends(f"whether `{GROWS.name}` holds for the broker", (("false", with_window), ("true", without)))


def _bytes(amounts: Sequence[Amount], beside: int) -> Value:
    """Return how many bytes wait when the last message comes, with so many messages beside the queue, whichever these are."""
    sure = [(each.size or 0, number or 0) for each, number in amounts if each.sure]
    doubtful = [stream for stream, number in amounts if None in {number, stream.size} or not stream.sure]
    least = _before_the_last(_others(sure, beside, largest=True))
    if any(None in {number, each.size} for each, number in amounts):
        most = INFINITE
    else:
        all_of_them = [(each.size or 0, number or 0) for each, number in amounts]
        most = _before_the_last(_others(all_of_them, beside, largest=False))
    if doubtful or least == most:
        return _between(doubtful, least, most)
    return Depends("which messages are on their way", (("the largest", least), ("the smallest", most)))


def _others(amounts: Sequence[tuple[int, int]], beside: int, *, largest: bool) -> list[tuple[int, int]]:
    """Return sizes and numbers of messages without so many of the largest, or of the smallest."""
    left: list[tuple[int, int]] = []
    for size, number in sorted(amounts, reverse=largest):
        taken = min(number, beside)
        beside -= taken
        left.append((size, number - taken))
    return left


def _before_the_last(amounts: Sequence[tuple[int, int]]) -> int:
    """Return the sum of sizes but for the smallest one, which may come last."""
    there = [(size, number) for size, number in amounts if number]
    return sum(size * number for size, number in there) - min((size for size, _ in there), default=0)


def _lasts(streams: Sequence[Alike], kept: int, kept_bytes: int) -> Value:
    """Return the longest time in which no more comes than is kept."""
    if kept == kept_bytes == INFINITE or not streams:
        return INFINITE
    doubtful = [each for each, _ in streams if not each.sure or _is_open(each, kept_bytes)]
    sure = [(each, number) for each, number in streams if each.sure]
    least = _longest(_nameless(sure), kept, kept_bytes)
    if not doubtful:
        return least
    endless = any(_is_open(each, kept_bytes) for each in doubtful)
    return _between(doubtful, least, 0 if endless else _longest(_nameless(streams), kept, kept_bytes))


def _is_open(stream: Stream, kept_bytes: int) -> bool:
    """Whether it is not known how much comes, in messages or in bytes where these are bounded."""
    return stream.within(1) is None or (stream.size is None and kept_bytes < INFINITE)


def _alike(streams: Iterable[Alike]) -> tuple[Alike, ...]:
    """Return those that differ in nothing but the topic once, under the first."""
    found: dict[Stream, tuple[Stream, int]] = {}
    for each, number in streams:
        nameless = each._replace(topic="")
        first, before = found.get(nameless, (each, 0))
        found[nameless] = (first, before + number)
    return tuple(found.values())


def _nameless(streams: Iterable[Alike]) -> tuple[Alike, ...]:
    """Return streams that bring the same as one, for every subscriber, certain or not."""
    return tuple(
        sorted(_alike((each._replace(topic="", sure=True, taken=0), number) for each, number in streams), key=str)
    )


@lru_cache(maxsize=10_000)
def _longest(streams: tuple[Alike, ...], kept: int, kept_bytes: int) -> int:
    """Search the longest time within which all that comes is kept."""

    def fits(time: int) -> bool:
        amounts = [(each.size or 0, number * (each.within(time) or 0)) for each, number in streams]
        return sum(number for _, number in amounts) <= kept and _before_the_last(amounts) < kept_bytes

    if fits(INFINITE):
        return INFINITE
    low, high = 0, INFINITE
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low - next((unit for unit in _UNITS if 100 * unit <= low), min(low, 1))


_UNITS: Final = (1_000_000_000, 1_000_000, 1_000)
"""Nanoseconds; one of them is the room to connect again, because at the very end of the time one message more may come."""
