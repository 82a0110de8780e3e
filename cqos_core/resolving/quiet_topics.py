"""Topics of one publisher and one subscriber on which no rule has anything to report, as most topics of a large system are.

They are judged while the system is resolved. Only the places of their endpoints are kept; endpoints and names are made again where
they are read, which is seldom.
"""

from __future__ import annotations

from array import array
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_core.model.report import Group, Verdict
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cqos_core.model.system import Endpoint, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.plainly import PlainEnd
    from cqos_core.resolving.resolve import Resolver
    from cqos_core.resolving.resolved import Resolved

LEAST: Final = 1_000
"""Endpoints of the smallest system for which this is worth while."""
End: TypeAlias = "tuple[int, Endpoint, PlainEnd]"
"""An endpoint with its place among all."""
_OTHER: Final = -1


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
        self._samples: dict[tuple[Any, ...], Resolved] = {}
        self._places = array("L")
        self._resolver: Resolver | None = None

    def __len__(self) -> int:
        return len(self._places) // 2

    def others(self, resolver: Resolver) -> Iterator[Endpoint]:
        """Yield all endpoints on other topics, each to be resolved before the next is asked for."""
        self._resolver, result, endpoints = resolver, resolver.result, resolver.system.endpoints
        if resolver.completed or not resolver.is_plain or len({each.id for each in endpoints}) < len(endpoints):
            yield from endpoints
            return
        topics: dict[RulePack, dict[str, End | int]] = {}
        others, gone = self._sorted_out(endpoints, resolver, topics)
        for at in sorted(others):
            yield endpoints[at]
        # What was resolved as any other may have come to one of the topics, or meet it on the wire.
        if any(pack.wire is not None and pack.wire.protocol in result.packs for pack in topics):
            gone.update(range(len(self)))
        met = (topics.get(each.pack, {}).get(each.key or "") for each in result.endpoints)
        gone.update(number for number in [*met] if isinstance(number, int))
        for number in sorted(gone - {_OTHER}):
            yield from (endpoints[at] for at in self._ends(number))
        kept = [number for number in range(len(self)) if number not in gone] if gone else range(len(self))
        self._places = array("L", (at for number in kept for at in self._ends(number)))

    def _sorted_out(
        self, endpoints: Sequence[Endpoint], resolver: Resolver, topics: dict[RulePack, dict[str, End | int]]
    ) -> tuple[list[int], set[int]]:
        """Sort endpoints by topic; return the places of those that are on others, and the topics that are quiet no longer."""
        others: list[int] = []
        gone: set[int] = set()
        # The ends of a topic come after each other, so few wait for their other end at a time.
        names = [each.topic or "" for each in endpoints]
        for at in sorted(range(len(endpoints)), key=names.__getitem__):
            endpoint = endpoints[at]
            owner = resolver.owner_of(endpoint)
            found = None if owner is None else resolver.plainly.found(endpoint, owner, resolver)
            if owner is None or found is None or not _may_be(endpoint, found, owner.pack):
                others.append(at)
                continue
            of_pack = topics.setdefault(owner.pack, {})
            key, end = found.naming.shown, (at, endpoint, found)
            known = of_pack.get(key)
            if known is None:
                of_pack[key] = end
                continue
            if isinstance(known, tuple):
                pair = (known, end) if endpoint.role != PUBLISHER else (end, known)
                if self._is_quiet(*pair):
                    of_pack[key] = len(self)
                    self._places.extend((pair[0][0], pair[1][0]))
                    self._sample(known)
                    self._sample(end)
                    continue
                others.append(known[0])
            else:
                gone.add(known)
            others.append(at)
            of_pack[key] = _OTHER
        others += [each[0] for of_pack in topics.values() for each in of_pack.values() if isinstance(each, tuple)]
        return others, gone

    def _is_quiet(self, one: End, other: End) -> bool:
        publisher, subscriber = one[1], other[1]
        return (
            (publisher.role == PUBLISHER != subscriber.role)
            and publisher.participant != subscriber.participant
            and self._says_nothing(one, other)
        )

    def _sample(self, end: End) -> None:
        _, endpoint, found = end
        key = found.owner.surroundings, found.base.profile.frame, endpoint.observed
        if key not in self._samples:
            self._samples[key] = found.made(endpoint)

    def with_samples(self, others: Sequence[Resolved]) -> Sequence[Resolved]:
        """Return other endpoints, and one for each of what profiles of these topics have in common."""
        return (*others, *self._samples.values())

    def _ends(self, number: int) -> Sequence[int]:
        return self._places[2 * number : 2 * number + 2]

    @property
    def groups(self) -> Iterator[Group]:
        """Yield the pair of each topic."""
        ends = self._found()
        for (one, found), (other, _) in zip(ends, ends, strict=True):
            yield Group(found.naming.shown, (one.id,), (other.id,), Verdict.COMPATIBLE, found.owner.pack.id)

    def endpoints(self) -> Iterator[Resolved]:
        """Yield their endpoints, resolved again."""
        return (found.made(endpoint) for endpoint, found in self._found())

    def _found(self) -> Iterator[tuple[Endpoint, PlainEnd]]:
        """Yield each publisher, then its subscriber, and what they are made of."""
        resolver = self._resolver
        for at in self._places if resolver is not None else ():
            endpoint = resolver.system.endpoints[at]  # type: ignore[union-attr]
            owner = resolver.owner_of(endpoint)  # type: ignore[union-attr]
            found = None if owner is None else resolver.plainly.found(endpoint, owner, resolver)  # type: ignore[union-attr,arg-type]
            if found is not None:
                yield endpoint, found


def _may_be(endpoint: Endpoint, found: PlainEnd, pack: RulePack) -> bool:
    """Whether an endpoint has to do with nothing but its topic, under the name that it states."""
    return (
        (found.naming.key == found.naming.shown and pack.meeting.match is None)
        and endpoint.template is None
        and not endpoint.alternative
    )
