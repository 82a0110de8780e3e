"""Paths of samples from a publisher to subscriptions, direct and over bridges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.matching.hops import Hop, PeerIndex
from cqos_core.matching.judge import judge_pair
from cqos_core.matching.peer_values import settled_profiles

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from cqos_core.matching.hops import Topics
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

Pair = tuple["Resolved", "Resolved"]
Way = list["Pair | Hop"]
"""Pairs and hops in alternation."""
DUPLICATE_FREE: Final = "duplicate_free"
"""The guarantee that no sample arrives twice."""
TAKES_BACK: Final = "own"
"""The word in `carries` of a bridge that takes its own samples back."""
_MOST: Final = 2
"""The most paths to one subscription that are followed: it only matters whether there are several."""


class DeliveryPaths:
    """Finds the paths between endpoints of a system with resolved bridges."""

    def __init__(self, hops: Sequence[Hop], by_topic: Topics) -> None:
        """Take hops and topics, as `linked` returns them."""
        self._meeting = PeerIndex(by_topic)
        self._by_source = {hop.source.id: hop for hop in hops}
        self._met: dict[str, dict[str, Pair]] = {}
        self._settled: dict[int, dict[int, QosProfile]] = {}

    def ways(self, publisher: Resolved, passing: Collection[bool | None] | None = None) -> dict[str, list[Way]]:
        """Return the two shortest paths to each subscription that a publisher reaches, by its id.

        Args:
            publisher: where they begin.
            passing: use only pairs that samples certainly (True) or possibly (None) pass, and no bridge that would take its
                own samples back; without it, use all matching pairs.
        """
        found: dict[str, list[Way]] = {}
        through: dict[Hop, int] = {}
        begun: list[Way] = [[]]
        while begun:
            longer = []
            for way in begun:
                last = way[-1] if way else None
                for name, pair in self._pairs(last.target if isinstance(last, Hop) else publisher).items():
                    if passing is not None and self.passes(pair) not in passing:
                        continue
                    if len(known := found.setdefault(name, [])) < _MOST:
                        known.append([*way, pair])
                    hop = self._by_source.get(name)
                    if hop is None or hop in way or through.get(hop, 0) == _MOST:
                        continue
                    back = isinstance(last, Hop) and hop.bridge is last.bridge and TAKES_BACK not in hop.bridge.carries
                    if passing is None or not back:
                        through[hop] = through.get(hop, 0) + 1
                        longer.append([*way, pair, hop])
            begun = longer
        return found

    def repeats(self, publisher: Resolved) -> dict[str, tuple[bool, list[Way]]]:
        """Return the subscriptions at which a sample arrives twice: whether that is certain, and the paths."""
        sure = {name: ways for name, ways in self.ways(publisher, {True}).items() if len(ways) == _MOST}
        perhaps = {name: ways for name, ways in self.ways(publisher, {True, None}).items() if len(ways) == _MOST}
        return {name: (name in sure, sure.get(name, ways)) for name, ways in perhaps.items()}

    def _pairs(self, publisher: Resolved) -> dict[str, Pair]:
        """Return the pairs of a publisher by the id of the subscription."""
        found = self._met.get(publisher.id)
        if found is None:
            found = self._met[publisher.id] = {pair[1].id: pair for pair in self._meeting.pairs(publisher)}
        return found

    def passes(self, pair: Pair) -> bool | None:
        """Whether samples pass a matching pair; None if not known."""
        publisher, subscriber = pair
        return samples_pass(self.profile(publisher), self.profile(subscriber))

    def profile(self, endpoint: Resolved) -> QosProfile:
        """Return the values of an endpoint, with those from its peers."""
        beside = self._meeting.beside(endpoint)
        found = self._settled.get(id(beside))
        if found is None:
            found = self._settled[id(beside)] = settled_profiles(beside)
        return found[id(endpoint)]


def samples_pass(publisher: QosProfile, subscriber: QosProfile) -> bool | None:
    """Whether samples pass between two settled profiles that match; None if not known."""
    if any(subscriber.values[index] == value for index, value in subscriber.pack.one_way):
        return False
    refusals = [
        each
        for each in judge_pair(publisher, subscriber).violations
        if each.bound.rule.kind == "requires" and not each.bound.rule.guarantee
    ]
    if any(not each.unknown for each in refusals):
        return False
    return None if refusals else True


def repetition(publisher: str, at: str, ways: Sequence[Way], *, sure: bool) -> str:
    """Return in words over which two paths the samples of a publisher arrive."""
    one, other = (_described(way) for way in ways)
    return f"what `{publisher}` publishes {'arrives' if sure else 'may arrive'} at {at} twice: {one}, and {other}"


def _described(way: Way) -> str:
    bridges = [f"`{each.bridge.id}`" for each in way if isinstance(each, Hop)]
    return f"over {' and then '.join(bridges)}" if bridges else "straight"
