"""Computes budgets: the bytes of topics on the wire and in histories, from stated periods and sizes.

A missing fact is left out of a sum, so the sum is a lower bound.
"""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from math import ceil
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.behaviour.paths.delivery_paths import DeliveryPaths
from cqos_core.behaviour.paths.link_facts import LinkFacts, facts_of
from cqos_core.language.binder import bind
from cqos_core.language.values import INFINITE, is_plain
from cqos_core.matching.hops import PeerIndex
from cqos_core.matching.pair_guarantees import guarantees_of
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from cqos_core.behaviour.paths.link_facts import LinkFault
    from cqos_core.language.expression import Condition
    from cqos_core.language.values import Value
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.model.chains import StatedLink
    from cqos_core.packs.costs import Framing, MessageFraming
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

_SECOND: Final = 1_000_000_000
_IP: Final = 20
_TCP: Final = 40  # headers of IPv4 and TCP
_UNIT: Final = 8  # the offset of an IP fragment counts units of 8 bytes


Parts = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Stream:
    """The samples that one publisher sends to its certain and possible subscribers.

    Attributes:
        size: bytes of a sample.
        per_second: samples of one instance in a second.
        single: the topic certainly has one instance.
        parts: packet sizes of a sample, each with its count; None if not known.
        header: bytes in front of each further fragment of a packet.
        confirmed: samples have the overhead of a reliable connection; None if not known.
        receivers: participants that certainly get all samples.
        perhaps: participants that may get samples, or get a part.
        unconfirmed: participants to which a lost sample is not sent again.
        answering: participants that confirm samples.
        answers: bytes per second that each of these sends back.
        late: samples that a late joiner gets, by its participant.
        broker: the intermediary that gets all samples first.
        to_broker: the packets of a sample on the way to it.
    """

    publisher: str
    participant: str
    topic: str
    names: frozenset[str]
    size: int
    per_second: float
    single: bool
    parts: Parts | None
    confirmed: bool | None
    receivers: frozenset[str]
    perhaps: frozenset[str]
    unconfirmed: frozenset[str] = frozenset()
    answering: frozenset[str] = frozenset()
    answers: float = 0.0
    late: tuple[tuple[str, int], ...] = ()
    header: int = _IP
    broker: str | None = None
    to_broker: Parts | None = None

    @property
    def payload(self) -> float:
        """Bytes of samples in a second, of one instance."""
        return self.size * self.per_second

    def packets(self, mtu: int | None) -> int | None:
        """Return how many IP packets a sample needs; None if the implementation is not known."""
        return None if self.parts is None else sum(many * self._cuts(size, mtu) for size, many in self.parts)

    def bytes_of_sample(self, mtu: int | None) -> int | None:
        """Return the bytes of the IP packets of a sample, without confirmations of readers."""
        if self.parts is None:
            return None
        return sum(many * (size + self.header * (self._cuts(size, mtu) - 1)) for size, many in self.parts)

    def wire(self, mtu: int | None = None) -> float | None:
        """Return the bytes of IP packets in a second, of one instance and to one receiver."""
        each = self.bytes_of_sample(mtu)
        return None if each is None else each * self.per_second

    def _cuts(self, size: int, mtu: int | None) -> int:
        """Return into how many IP packets a datagram or TCP segment is split."""
        if mtu is None or size <= mtu or mtu < self.header + _UNIT:
            return 1
        if self.header != _IP:
            return ceil((size - self.header) / (mtu - self.header))
        return ceil((size - _IP) / ((mtu - _IP) // _UNIT * _UNIT))

    def towards(self, there: Collection[str]) -> Stream | None:
        """Return the part of the stream to some participants and brokers; None if there is none."""
        if self.broker is not None and self.broker in there:
            only = frozenset((self.broker,))
            way = replace(
                self, receivers=only, perhaps=frozenset(), unconfirmed=frozenset(), late=(), parts=self.to_broker
            )
            return None if self.participant in there else way
        if self.broker is None and self.participant in there:
            return None
        some = frozenset(there)
        return replace(self, receivers=self.receivers & some, perhaps=self.perhaps & some)


@dataclass(frozen=True, slots=True)
class History:
    """The most samples and bytes that an endpoint keeps; None if there is no limit."""

    endpoint: str
    topic: str
    samples: int | None
    size: int | None


@dataclass(frozen=True, slots=True)
class LinkLoad:
    """The load of a link in one direction, in bytes per second.

    Attributes:
        link: the link.
        facts: its stated facts.
        inward: to its participants, else from them.
        certain: the samples that certainly go over it, once each and without headers.
        likely: with headers, a copy for each receiver, and confirmations of samples in the other direction; None if an
            implementation or a number of instances is not known.
        streams: the streams over it.
        lost: the lost part of samples, by best-effort topic.
        catching_up: the least seconds until a late joiner has all kept samples, by topic.
    """

    link: StatedLink
    facts: LinkFacts
    inward: bool
    certain: float
    likely: float | None
    streams: tuple[Stream, ...]
    lost: tuple[tuple[str, float], ...] = ()
    catching_up: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Budgets:
    """The budgets of a system."""

    streams: tuple[Stream, ...]
    histories: tuple[History, ...]
    loads: tuple[LinkLoad, ...]
    faults: tuple[LinkFault, ...]

    def sent(self, participant: str) -> float:
        """Return the bytes of samples per second that a participant publishes, once each."""
        return sum(each.payload for each in self.streams if each.participant == participant)

    def received(self, participant: str) -> float:
        """Return the bytes of samples per second that a participant gets."""
        return sum(each.payload for each in self.streams if participant in each.receivers)


def budgets_of_system(pipeline: Pipeline) -> Budgets:
    """Return the budgets of a system."""
    arrivals, meeting = DeliveryPaths(pipeline.hops, pipeline.topics), PeerIndex(pipeline.topics)
    publishers = [each for each in pipeline.endpoints if each.role == PUBLISHER]
    streams = tuple(stream for each in publishers if (stream := _stream(each, meeting, arrivals)) is not None)
    own = [each for each in pipeline.endpoints if not each.is_copy]
    histories = tuple(kept for each in own if (kept := history_of(each, arrivals.profile(each))) is not None)
    links = [facts_of(link) for _, link in sorted(pipeline.system.links.items())]
    known = {each.participant for each in streams}.union(*(each.receivers | each.perhaps for each in streams))
    known |= {each.broker for each in streams if each.broker is not None}
    loads = [
        load
        for facts in links
        for inward in (True, False)
        if (load := _load(facts, streams, known, inward=inward)).streams
    ]
    faults = tuple(fault for facts in links for fault in facts.faults)
    return Budgets(streams, histories, tuple(loads), faults)


def _value(profile: QosProfile, level: str, name: str) -> Any:
    """Return the value of a policy; None if it is not plain."""
    index = profile.pack.find(level, name)
    value: Value = profile.values[index] if index is not None else ""
    return value if index is not None and is_plain(value) else None


class StreamReader(NamedTuple):
    """A subscriber that matches a publisher; ``passes`` is None if it is not known whether samples pass."""

    participant: str
    profile: QosProfile
    passes: bool | None


def _stream(publisher: Resolved, meeting: PeerIndex, arrivals: DeliveryPaths) -> Stream | None:
    readers = (
        StreamReader(pair[1].endpoint.participant, arrivals.profile(pair[1]), arrivals.passes(pair))
        for pair in meeting.pairs(publisher)
    )
    return stream_of(publisher, arrivals.profile(publisher), readers)


def stream_of(publisher: Resolved, profile: QosProfile, readers: Iterable[StreamReader]) -> Stream | None:
    """Return the stream of a publisher with these values; None if its period or size is not stated."""
    period, size = _value(profile, "topic", "period"), _value(profile, "topic", "size")
    if not (isinstance(period, int) and isinstance(size, int) and 0 < period < INFINITE and 0 < size < INFINITE):
        return None
    framing, costs = _framing(profile), profile.pack.costs
    certain: set[str] = set()
    perhaps: set[str] = set()
    confirming: dict[str, bool | None] = {}
    late: dict[str, int] = {}
    sent: list[int | None] = []
    for other, reader, passes in readers:
        if passes is False:
            continue
        thinned = costs.thinned
        (certain if passes and (thinned is None or _holds(thinned, profile, reader) is False) else perhaps).add(other)
        if framing is not None:
            confirming[other] = _holds(framing.confirmed, profile, reader)
        sent.append(_message(costs.from_broker, publisher, size, profile, reader))
        kept = next((each.value for each in guarantees_of(profile, reader) if each.word.name == "late_join"), None)
        if kept:
            late[other] = max(late.get(other, 0), kept)
    answers = {*confirming.values()}
    confirmed = True if True in answers else None if None in answers else False
    parts = None if framing is None else framing.packet_sizes(size, confirmed=confirmed is not False)
    broker = publisher.participant.broker
    if costs.from_broker is not None:
        parts = _segments(None if not sent or None in sent else max(each for each in sent if each is not None))
    return Stream(
        publisher=publisher.id,
        participant=publisher.endpoint.participant,
        topic=publisher.shown,
        names=frozenset(filter(None, (publisher.shown, publisher.key, publisher.endpoint.topic))),
        size=size,
        per_second=_SECOND / period,
        single=_is_single(profile),
        parts=parts,
        confirmed=confirmed,
        receivers=frozenset(certain),
        perhaps=frozenset(perhaps - certain),
        unconfirmed=frozenset(name for name, each in confirming.items() if each is False),
        answering=frozenset(name for name, each in confirming.items() if each),
        answers=0.0 if framing is None else framing.answer * min(_SECOND / period, framing.answers),
        late=tuple(sorted(late.items())),
        header=_IP if costs.from_broker is None else _TCP,
        broker=None if costs.to_broker is None or broker is None else broker.id,
        to_broker=_segments(_message(costs.to_broker, publisher, size, profile, profile)),
    )


def _message(
    framing: MessageFraming | None, publisher: Resolved, size: int, profile: QosProfile, reader: QosProfile
) -> int | None:
    """Return the bytes of the messages of a sample; None if not known."""
    if framing is None:
        return None
    return framing.message_bytes(size, publisher.shown, lambda condition: _holds(condition, profile, reader))


def _segments(size: int | None) -> Parts | None:
    return None if size is None else ((_TCP + size, 1),)


def _holds(condition: Condition, publisher: QosProfile, subscriber: QosProfile) -> bool | None:
    return bind(condition, publisher.pack.vocabulary).judge(publisher.values, subscriber.values).result


def _is_single(profile: QosProfile) -> bool:
    keyed = profile.pack.costs.keyed
    return keyed is None or _value(profile, "topic", keyed.name) == 0


def _framing(profile: QosProfile) -> Framing | None:
    """Return the framing of an endpoint's implementation, if that is known."""
    pack = profile.pack
    index = pack.find("option", pack.implementations.option) if pack.implementations.option else None
    if index is None or not is_plain(profile.values[index]):
        return None
    name = pack.policies[index].format(profile.values[index])
    return next((each for each in pack.costs.framings if each.value == name), None)


def history_of(endpoint: Resolved, profile: QosProfile) -> History | None:
    """Return the history of an endpoint with these values; None if the size of its samples is not stated."""
    costs, size = profile.pack.costs, _value(profile, "topic", "size")
    if not isinstance(size, int):
        return None
    values, vocabulary = profile.values, profile.pack.vocabulary
    store = next((each for each in costs.stores if bind(each.when, vocabulary).judge(values, values).result), None)
    if store is None:
        return None
    samples: Any = None if store.samples is None else _value(profile, store.samples.level, store.samples.name)
    if store.each_instance and not _is_single(profile):
        most = None if costs.instances is None else _value(profile, costs.instances.level, costs.instances.name)
        samples = samples * most if isinstance(samples, int) and most and most < INFINITE else None
    limited = isinstance(samples, int) and samples < INFINITE
    return History(endpoint.id, endpoint.shown, samples if limited else None, samples * size if limited else None)


def _load(facts: LinkFacts, streams: Sequence[Stream], known: set[str], *, inward: bool) -> LinkLoad:
    """Return the load of a link in one direction."""
    link = facts.link
    inside = {name for name in known if any(fnmatchcase(name, each) for each in link.participants)}
    there = inside if inward else known - inside
    ways = [way for each in streams if (way := each.towards(there)) is not None and _goes(each, link)]
    over = [each for each in ways if each.receivers or each.perhaps]
    # A period belongs to a topic: publishers on both sides may share it.
    shared = {each.topic for each in streams if each.participant in there}
    certain = sum({each.topic: each.payload for each in over if each.receivers and each.topic not in shared}.values())
    wires = [
        None if (wire := each.wire(facts.mtu)) is None or not each.single else wire * len(each.receivers | each.perhaps)
        for each in over
    ]
    back = (
        each.answers * len(each.answering - there)
        for each in streams
        if each.participant in there and _goes(each, link)
    )
    likely = None if None in wires else sum(each for each in wires if each is not None) + sum(back)
    return LinkLoad(
        link=link,
        facts=facts,
        inward=inward,
        certain=certain,
        likely=likely,
        streams=tuple(over),
        lost=tuple(_lost(over, facts)),
        catching_up=tuple(_late(over, facts, there)),
    )


def _goes(stream: Stream, link: StatedLink) -> bool:
    """Whether a link carries the topic of a stream."""
    return not link.topics or any(fnmatchcase(name, want) for name in stream.names for want in link.topics)


def _lost(streams: Sequence[Stream], facts: LinkFacts) -> Iterator[tuple[str, float]]:
    """Yield the lost part of samples of each best-effort topic: one lost packet loses the sample."""
    for each in streams:
        packets = each.packets(facts.mtu)
        if facts.loss and packets is not None and each.unconfirmed & (each.receivers | each.perhaps):
            yield each.topic, 1 - (1 - facts.loss) ** packets


def _late(streams: Sequence[Stream], facts: LinkFacts, there: set[str]) -> Iterator[tuple[str, float]]:
    """Yield the least seconds until a late joiner has all kept samples, by topic."""
    for each in streams:
        most = max((count for name, count in each.late if name in there), default=0)
        if most and facts.rate:
            yield each.topic, most * each.size / facts.rate + (facts.round_trip or 0) / _SECOND
