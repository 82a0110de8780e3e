"""Topics of one publisher and one subscriber on which no rule has anything to report, as most topics of a large system are.

They are judged while the system is resolved. Only the places of their endpoints are kept; endpoints and names are made again where
they are read, which is seldom.
"""

from __future__ import annotations

from array import array
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_core.model.report import Group, Verdict
from cqos_core.model.rows import as_object, id_of, rows_of, topic_of
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from cqos_core.model.system import Endpoint, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.plainly import Kin
    from cqos_core.resolving.resolve import Resolver
    from cqos_core.resolving.resolved import QosProfile, Resolved

LEAST: Final = 1_000
"""Endpoints of the smallest system for which this is worth while."""
End: TypeAlias = "tuple[QosProfile, bool, list[Any]]"
"""What the profiles of an endpoint and of those like it have in common, whether it was observed, and its known values."""
_OTHER: Final = -1
_FIRST: Final = -2


def may_be_quiet(system: System) -> bool:
    """Whether the endpoints of a system have to do with their own topics only, and are many."""
    return len(system.endpoints) >= LEAST and not (
        (system.bridges or system.chains or system.links or system.flows)
        or (system.checks or system.accept or system.hypothetical)
    )


class QuietTopics:
    """Such topics of one system."""

    def __init__(self, says_nothing: Callable[[End, End], bool]) -> None:
        """Begin without any; ``says_nothing`` judges a publisher and a subscriber."""
        self._says_nothing = says_nothing
        self._samples: dict[tuple[Any, ...], tuple[Kin, Any]] = {}
        self._sampled: set[Kin] = set()
        self._places = array("L")
        self._resolving: Any = None

    def __len__(self) -> int:
        return len(self._places) // 2

    def others(self, resolver: Resolver) -> Iterator[Endpoint]:
        """Yield all endpoints on other topics, each to be resolved before the next is asked for."""
        self._resolving, result, endpoints = resolver, resolver.result, resolver.system.endpoints
        if resolver.completed or not resolver.is_plain or len({*map(id_of, rows_of(endpoints))}) < len(endpoints):
            yield from endpoints
            return
        topics: dict[RulePack, dict[str, int]] = {}
        others, gone = self._sorted_out(endpoints, resolver, topics)
        for at in sorted(others):
            yield endpoints[at]
        # What was resolved as any other may have come to one of the topics, or meet it on the wire.
        if any(pack.wire is not None and pack.wire.protocol in result.packs for pack in topics):
            gone.update(range(len(self)))
        met = (topics.get(each.pack, {}).get(each.key or "", _OTHER) for each in result.endpoints)
        gone.update(_FIRST - number for number in [*met] if number <= _FIRST)
        for number in sorted(gone):
            yield from (endpoints[at] for at in self._ends(number))
        kept = [number for number in range(len(self)) if number not in gone] if gone else range(len(self))
        self._places = array("L", (at for number in kept for at in self._ends(number)))

    def _sorted_out(
        self, endpoints: Sequence[Endpoint], resolver: Resolver, topics: dict[RulePack, dict[str, int]]
    ) -> tuple[list[int], set[int]]:
        """Sort endpoints by topic; return the places of those that are on others, and the topics that are quiet no longer.

        A topic has the place of its only endpoint, `_OTHER`, or the number of a quiet one, counted down from `_FIRST`.
        """
        others: list[int] = []
        gone: set[int] = set()
        stored, kin_of = [*rows_of(endpoints)], resolver.plainly.kin
        for at, each in enumerate(stored):
            kin = kin_of(each, resolver)
            if isinstance(each, tuple):
                topic = each[2]
            else:
                topic = None if each.template is not None or each.alternative else each.topic
            key = None if kin is None else kin.key(topic, resolver)
            if kin is None or key is None:
                others.append(at)
                continue
            pack = kin.owner.pack
            of_pack = topics.get(pack)
            if of_pack is None:
                of_pack = topics[pack] = {}
            before = of_pack.setdefault(key, at)
            if before == at:
                continue
            if before >= 0:
                other = kin_of(stored[before], resolver)
                if other is not None and self._is_quiet((before, stored[before], other), (at, each, kin)):
                    of_pack[key] = _FIRST - len(self) + 1
                    continue
                others.append(before)
            elif before != _OTHER:
                gone.add(_FIRST - before)
            others.append(at)
            of_pack[key] = _OTHER
        others += [at for of_pack in topics.values() for at in of_pack.values() if at >= 0]
        return others, gone

    def _is_quiet(self, one: tuple[int, Any, Kin], other: tuple[int, Any, Kin]) -> bool:
        """Judge two endpoints that are alone on their topic, and keep their places where there is nothing to report."""
        if one[2].endpoint.role != PUBLISHER:
            one, other = other, one
        (first, publishing, publisher), (second, subscribing, subscriber) = one, other
        offering, requesting = publisher.endpoint, subscriber.endpoint
        if not (offering.role == PUBLISHER != requesting.role) or offering.participant == requesting.participant:
            return False
        offered, requested = publisher.known(publishing), subscriber.known(subscribing)
        if offered is None or requested is None:
            return False
        ends = (
            (publisher.base.profile, offering.observed, offered),
            (subscriber.base.profile, requesting.observed, requested),
        )
        if not self._says_nothing(*ends):
            return False
        self._places.extend((first, second))
        for kin, each in ((publisher, publishing), (subscriber, subscribing)):
            if kin not in self._sampled:
                self._sampled.add(kin)
                key = kin.owner.surroundings, kin.base.profile.frame, kin.endpoint.observed
                self._samples.setdefault(key, (kin, each))
        return True

    def with_samples(self, others: Sequence[Resolved]) -> Sequence[Resolved]:
        """Return other endpoints, and one for each of what profiles of these topics have in common."""
        return (*others, *self._resolved(self._samples.values()))

    def _ends(self, number: int) -> Sequence[int]:
        return self._places[2 * number : 2 * number + 2]

    @property
    def groups(self) -> Iterator[Group]:
        """Yield the pair of each topic."""
        resolver, found = self._resolving, self._found()
        for (kin, one), (_, other) in zip(found, found, strict=True):
            topic = kin.key(topic_of(one), resolver) or ""
            yield Group(topic, (id_of(one),), (id_of(other),), Verdict.COMPATIBLE, kin.owner.pack.id)

    def endpoints(self) -> Iterator[Resolved]:
        """Yield their endpoints, resolved again."""
        return self._resolved(self._found())

    def _resolved(self, found: Iterable[tuple[Kin, Any]]) -> Iterator[Resolved]:
        for kin, each in found:
            made = kin.resolved(as_object(each), self._resolving)
            if made is not None:
                yield made

    def _found(self) -> Iterator[tuple[Kin, Any]]:
        """Yield each publisher, then its subscriber, as a row or an endpoint."""
        resolver = self._resolving
        stored = [*rows_of(resolver.system.endpoints)] if self._places else []
        for at in self._places:
            kin = resolver.plainly.kin(stored[at], resolver)
            if kin is not None:
                yield kin, stored[at]
