"""Matches filters of subscribers with topics, by the index of the pack, for all subscribers of a participant.

The index is made of the distinct topics that match others, such as filters. The distinct published topics stream by, so memory follows
from the index, and from the distinct sets of topics that match one.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.policy import ENDPOINT
from cqos_core.model.grouping import grouped
from cqos_fleet.value_numbers import Numbered

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_fleet.clients import Clients
    from cqos_fleet.table_store import Spool

    Rows = Iterable[tuple[Any, ...]]

HEARD: Final = {"system": "text", "topic": "text", "publishers": "number", "met": "number"}
"""The columns of published topics: numbers of their publishers, and of the other topics that match them."""
NEAR: Final = {"system": "text", "topic": "text", "p": "number", "owner": "number", "own": "number"}
"""The columns of endpoints that match others on their own topic only."""
_Amount = tuple[tuple[int, int], ...]


class FilterMatches:
    """Which topics match others, and the publishers there.

    Attributes:
        far: numbers of the topics that match others, by system and name.
        met: sets of such topics that match one topic.
    """

    def __init__(self, clients: Clients, far: Iterable[tuple[str, str]]) -> None:
        """Index the topics that match others, by system and name."""
        self.clients = clients
        self.far = {each: number for number, each in enumerate(far)}
        self.met, self._publishers, self._amounts = (Numbered[Any]([()]) for _ in range(3))
        self._heard: list[int] = []
        self._answers: dict[_Amount, dict[int, int]] = {}

    def write_topics(self, rows: Rows, out: Spool) -> None:
        """Write the published topics.

        Args:
            rows: publishers in order of system and topic: these, the number of the end, and how many they are.
            out: has the columns of `HEARD`.
        """
        by_system = grouped(self.far)
        pairs = Counter[tuple[int, int]]()
        for system, of_system in groupby(by_topic(rows), lambda each: each[0][0]):
            filters = by_system.get(system)
            finding = self.clients.folding.finder(filters) if filters else None
            for (_, topic), ends in of_system:
                heard = sorted([self.far[system, each] for each in finding(topic)]) if finding is not None else ()
                publishers, met = _number(self._publishers, ends), _number(self.met, heard)
                pairs[publishers, met] += 1
                out.add(system, topic, publishers, met)
        publishing: list[Counter[int]] = [Counter() for _ in self.far]
        for (publishers, met), number in pairs.items():
            for each in self.met[met]:
                publishing[each][publishers] += number
        self._heard = [_number(self._amounts, sorted(each.items())) for each in publishing]

    def write_subscribers(self, subscribers: Rows, out: Spool, far: Spool) -> None:
        """Write subscribers with the values that follow from what all those of their participant hear.

        Args:
            subscribers: in order of the owner: system, topic, number of the end, owner, own, far, and the publishers of the topic.
            out: has the columns of `NEAR`.
            far: has the columns of `cqos_fleet.filter_subscribers.FAR`, for all others.
        """
        for _, of_owner in groupby(subscribers, itemgetter(3)):
            rows = [*of_owner]
            heard = [
                (
                    self._heard[self.far[row[0], row[1]]]
                    if row[5]
                    else _number(self._amounts, ((row[6], 1),) * (row[6] > 0))
                )
                for row in rows
            ]
            key = tuple(sorted([(each, row[2]) for each, row in zip(heard, rows, strict=True)]))
            ends = self._answers.get(key)
            if ends is None:
                ends = self._answers[key] = self._answer(key)
            for system, topic, p, owner, own, is_far, _ in rows:
                if is_far:
                    far.add(self.far[system, topic], owner, ends[p])
                else:
                    out.add(system, topic, ends[p], owner, own)

    def _answer(self, key: _Amount) -> dict[int, int]:
        """Return the ends with what follows from all of them."""
        clients, known = self.clients, self.clients.known
        asked = [
            ([(self._profiles(by), number) for by, number in self._amounts[heard]], known[p].resolved.profile)
            for heard, p in key
        ]
        indices = clients.pack.vocabulary.indices
        facts = {indices[ENDPOINT, name]: value for name, value in clients.folding.heard(asked).items()}
        found = {}
        for p in dict.fromkeys(p for _, p in key):
            resolved = known[p].resolved
            with_facts = replace(resolved, profile=resolved.profile.with_values(facts))
            found[p] = clients.number(known[p]._replace(resolved=with_facts))
        return found

    def _profiles(self, publishers: int) -> Mapping[Any, int]:
        found = Counter[Any]()
        for p, number in self._publishers[publishers]:
            found[self.clients.known[p].resolved.profile] += number
        return found


def _number(known: Numbered[Any], values: Iterable[Any]) -> int:
    """Return the number of some values."""
    together = tuple(values)
    return known.number(together, together)


def by_topic(rows: Rows) -> Iterator[tuple[tuple[str, str], list[tuple[Any, ...]]]]:
    """Yield system and topic with their rows, without these two columns; rows come in their order."""
    for name, of_topic in groupby(rows, itemgetter(0, 1)):
        yield name, [row[2:] for row in of_topic]
