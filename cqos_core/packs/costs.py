"""Costs of samples: the bytes that an implementation puts around them, and the number that an endpoint keeps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.language.expression import Condition
    from cqos_core.language.policy import Policy


@dataclass(frozen=True, slots=True)
class Framing:
    """The framing of a sample by one implementation; all sizes in bytes.

    Attributes:
        value: of `RulePack.implementation_option`: ``cyclonedds``.
        packet: headers of each packet, those of IP and transport with them.
        sample: sent once with every sample.
        whole: sent with a sample that one packet carries.
        fragment: sent with each packet of a sample that needs several.
        undivided: the most bytes of sample and `encapsulation` that are sent in one packet.
        part: the most of them in each packet where they need several.
        encapsulation: the part of `sample` that is divided with it.
        confirmed: when the following are sent too.
        last, other: with the last packet of a sample, and with each other one.
        source: where the figures come from.
        evenly: the packets of a sample are of about one size; else all but the last one are full.
        answer: sent back by a reader for a confirmed sample.
        answers: at most so many answers of a reader to a writer in a second.
    """

    value: str
    packet: int
    sample: int
    whole: int
    fragment: int
    undivided: int
    part: int
    encapsulation: int
    confirmed: Condition
    last: int
    other: int
    source: str
    evenly: bool = True
    answer: int = 0
    answers: int = 0

    def packet_sizes(self, size: int, *, confirmed: bool) -> tuple[tuple[int, int], ...]:
        """Return the sizes of the packets of a sample of ``size`` bytes, each with how many there are."""
        first, last = self.packet + self.sample - self.encapsulation, self.last if confirmed else 0
        needed = size + self.encapsulation
        if needed <= self.undivided:
            return ((first + self.whole + needed + last, 1),)
        count = -(-needed // self.part)
        piece = -(-needed // count) if self.evenly else self.part
        other = self.packet + self.fragment + piece + (self.other if confirmed else 0)
        rest = self.packet + self.fragment + needed - (count - 1) * piece + last
        sizes = ((other + first - self.packet, 1), (other, count - 2), (rest, 1))
        return tuple((each, many) for each, many in sizes if many)


@dataclass(frozen=True, slots=True)
class MessageFraming:
    """The framing of a sample as one message over TCP; all sizes in bytes.

    A message has a fixed header, a length of seven bits a byte, the name of the topic, fields, and the sample.

    Attributes:
        fixed: the fixed header without the length.
        named: sent with the name of the topic.
        fields: further parts of the message, each with when it is there: over the values of publisher and subscriber.
        further: further messages of the sender with each sample, likewise.
        source: where the figures come from.
    """

    fixed: int
    named: int
    fields: tuple[tuple[Condition, int], ...]
    further: tuple[tuple[Condition, int], ...]
    source: str

    def message_bytes(self, size: int, name: str, holds: Callable[[Condition], bool | None]) -> int | None:
        """Return the bytes of all messages of a sample of ``size`` bytes; None where a condition is not known."""
        held = [
            (part, holds(condition), many)
            for part in (True, False)
            for condition, many in (self.fields if part else self.further)
        ]
        if any(there is None for _, there, _ in held):
            return None
        body = self.named + len(name.encode()) + size + sum(many for inside, there, many in held if inside and there)
        length = next(count for count in range(1, body.bit_length() + 2) if body < 1 << 7 * count)
        return self.fixed + length + body + sum(many for inside, there, many in held if not inside and there)


@dataclass(frozen=True, slots=True)
class Store:
    """The most samples that an endpoint keeps.

    Attributes:
        when: over the values of the endpoint, written as those of a publisher.
        samples: the policy with the number; None: nothing limits it.
        each_instance: it holds for each instance.
    """

    when: Condition
    samples: Policy | None
    each_instance: bool = False


@dataclass(frozen=True, slots=True)
class Costs:
    """Costs of the samples of a protocol.

    Attributes:
        keyed: the fact of a topic that it has several instances; None: no topic has.
        instances: the policy with the most instances that an endpoint keeps.
        framings: by implementation.
        stores: the first one that holds counts.
        to_broker: how a publication travels to a broker, and `from_broker`: from it; None: samples go straight to subscribers.
        thinned: when a publisher may send fewer samples to a subscriber than it publishes; None: never.
    """

    keyed: Policy | None = None
    instances: Policy | None = None
    framings: tuple[Framing, ...] = ()
    stores: tuple[Store, ...] = ()
    thinned: Condition | None = None
    to_broker: MessageFraming | None = None
    from_broker: MessageFraming | None = None
