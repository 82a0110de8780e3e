"""Topics of one publisher and one subscriber, as most topics of a large system are, judged in bulk while the system is resolved.

Functions over values tell which rules report. Only rows and outcomes are kept; endpoints and names are made again where they are read.
"""

from __future__ import annotations

from array import array
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

from cqos_core.model.report import Group
from cqos_core.model.rows import as_object, id_of, rows_of, topic_of
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

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


class PairOutcome(Protocol):
    """What rules say of a topic: the verdict and the codes of each of its pairs, and what there is to report."""

    @property
    def rows(self) -> Sequence[Any]:
        """The pairs."""

    @property
    def outlines(self) -> Sequence[Any]:
        """The findings."""


Reporting: TypeAlias = "Callable[[End, End], tuple[Mapping[int, PairOutcome], int] | None]"
"""Returns which rules report on a publisher and a subscriber, as bits, with outcomes by bits; None where values alone do not tell."""


def may_be_in_bulk(system: System) -> bool:
    """Whether the endpoints of a system have to do with their own topics only, and are many."""
    return len(system.endpoints) >= LEAST and not (
        (system.bridges or system.chains or system.links or system.flows)
        or (system.checks or system.accept or system.hypothetical)
    )


class BulkTopics:
    """Such topics of one system."""

    def __init__(self, reporting: Reporting, judge: Callable[[Sequence[Resolved]], PairOutcome]) -> None:
        """Begin without any; ``judge`` finds an outcome that is not known yet."""
        self._reporting, self._judge = reporting, judge
        self._samples: dict[tuple[Any, ...], Any] = {}
        self._sampled: set[Kin] = set()
        self._places = array("L")
        self._ends: list[Any] = []
        self._outcomes: list[PairOutcome] = []
        self._resolving: Any = None

    def __len__(self) -> int:
        return len(self._outcomes)

    def others(self, resolver: Resolver) -> Iterator[Endpoint]:
        """Yield all endpoints on other topics, each to be resolved before the next is asked for."""
        self._resolving, result, endpoints = resolver, resolver.result, resolver.system.endpoints
        if resolver.completed or not resolver.is_plain or len({*map(id_of, rows_of(endpoints))}) < len(endpoints):
            yield from endpoints
            return
        topics: dict[RulePack, dict[str, int]] = {}
        stored = [*rows_of(endpoints)]
        others, gone = self._sorted_out(stored, resolver, topics)
        for at in sorted(others):
            yield endpoints[at]
        # What was resolved as any other may have come to one of the topics, or meet it on the wire.
        if any(pack.wire is not None and pack.wire.protocol in result.packs for pack in topics):
            gone.update(range(len(self)))
        met = (topics.get(each.pack, {}).get(each.key or "", _OTHER) for each in result.endpoints)
        gone.update(_FIRST - number for number in [*met] if number <= _FIRST)
        for number in sorted(gone):
            yield from (endpoints[at] for at in self._places[2 * number : 2 * number + 2])
        # Rows do not change, whatever a caller does with the system before it reads the report.
        self._ends = [stored[at] for position, at in enumerate(self._places) if position // 2 not in gone]
        self._outcomes = [each for number, each in enumerate(self._outcomes) if number not in gone]

    def _sorted_out(
        self, stored: Sequence[Any], resolver: Resolver, topics: dict[RulePack, dict[str, int]]
    ) -> tuple[list[int], set[int]]:
        """Sort endpoints by topic; return the places of those that are on others, and the topics that are not judged in bulk after all.

        A topic has the place of its only endpoint, `_OTHER`, or the number of one in bulk, counted down from `_FIRST`.
        """
        others: list[int] = []
        gone: set[int] = set()
        kin_of = resolver.plainly.kin
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
                if other is not None and self._is_in_bulk((before, stored[before], other), (at, each, kin)):
                    of_pack[key] = _FIRST - len(self) + 1
                    continue
                others.append(before)
            elif before != _OTHER:
                gone.add(_FIRST - before)
            others.append(at)
            of_pack[key] = _OTHER
        others += [at for of_pack in topics.values() for at in of_pack.values() if at >= 0]
        return others, gone

    def _is_in_bulk(self, one: tuple[int, Any, Kin], other: tuple[int, Any, Kin]) -> bool:
        """Judge two endpoints that are alone on their topic, and keep their places where values alone tell the outcome."""
        if one[2].endpoint.role != PUBLISHER:
            one, other = other, one
        (first, publishing, publisher), (second, subscribing, subscriber) = one, other
        offering, requesting = publisher.endpoint, subscriber.endpoint
        if not (offering.role == PUBLISHER != requesting.role) or offering.participant == requesting.participant:
            return False
        offered, requested = publisher.known(publishing), subscriber.known(subscribing)
        if offered is None or requested is None:
            return False
        found = self._reporting(
            (publisher.base.profile, offering.observed, offered),
            (subscriber.base.profile, requesting.observed, requested),
        )
        # An object may be changed before its findings are read.
        if found is None or (found[1] and not (isinstance(publishing, tuple) and isinstance(subscribing, tuple))):
            return False
        outcomes, bits = found
        self._outcomes.append(outcomes.get(bits) or self._judge([*self._resolved((publishing, subscribing))]))
        self._places.extend((first, second))
        for kin, each in ((publisher, publishing), (subscriber, subscribing)):
            if kin not in self._sampled:
                self._sampled.add(kin)
                key = kin.owner.surroundings, kin.base.profile.frame, kin.endpoint.observed
                self._samples.setdefault(key, each)
        return True

    def with_samples(self, others: Sequence[Resolved]) -> Sequence[Resolved]:
        """Return other endpoints, and one for each of what profiles of these topics have in common."""
        return (*others, *self._resolved(self._samples.values()))

    @property
    def outcomes(self) -> Iterable[PairOutcome]:
        """All that rules say of any of them."""
        return {id(each): each for each in self._outcomes}.values()

    @property
    def groups(self) -> Iterator[Group]:
        """Yield the pair of each topic."""
        resolver, ends = self._resolving, iter(self._ends)
        for outcome, one, other in zip(self._outcomes, ends, ends, strict=True):
            kin = resolver.plainly.kin(one, resolver)
            for row in outcome.rows if kin is not None else ():
                topic = kin.key(topic_of(one), resolver) or ""
                ids = (id_of(one),), (id_of(other),)
                yield Group(topic, *ids, row.verdict, kin.owner.pack.id, codes=row.codes)

    def reported(self) -> Iterator[Sequence[Resolved]]:
        """Yield the endpoints of each topic with findings, resolved again."""
        for number, outcome in enumerate(self._outcomes):
            if outcome.outlines:
                yield [*self._resolved(self._ends[2 * number : 2 * number + 2])]

    def endpoints(self) -> Iterator[Resolved]:
        """Yield their endpoints, resolved again."""
        return self._resolved(self._ends)

    def _resolved(self, ends: Iterable[Any]) -> Iterator[Resolved]:
        for each in ends:
            kin = self._resolving.plainly.kin(each, self._resolving)
            made = None if kin is None else kin.resolved(as_object(each), self._resolving)
            if made is not None:
                yield made
