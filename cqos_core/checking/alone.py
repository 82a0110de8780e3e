"""Topics without partners while a system is edited: an edit touches those whose names have to do with its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.checking.findings import Made
from cqos_core.checking.partners import BusyTopics, reported_alone
from cqos_core.checking.stages import Item
from cqos_core.model.spelling import stubs_of
from cqos_core.model.system import MESSAGE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.checking.topic import TopicResult
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved import Resolved

LONELY = 4
"""The place of these findings among those of no topic."""


class Alone:
    """Findings about endpoints without partner.

    Attributes:
        count: how many such endpoints there are.
    """

    def __init__(
        self,
        packs: Mapping[str, RulePack],
        results: Mapping[TopicKey, TopicResult],
        kind_of: Callable[[str], str],
        *,
        partial: bool,
    ) -> None:
        """Begin without any; ``results`` are read when names of other topics are asked for, and ``kind_of`` tells the kind of a stated endpoint."""
        self._packs = packs
        self._results = results
        self._kind_of = kind_of
        self._partial = partial
        self._busy: BusyTopics | None = None
        self._lonely: dict[TopicKey, Sequence[Resolved]] = {}
        self._by_token: dict[tuple[str, ...], dict[TopicKey, None]] = {}
        self._items: dict[TopicKey, list[Item]] = {}
        self.count = 0

    def change(
        self, changed: Mapping[TopicKey, tuple[TopicResult | None, TopicResult | None]]
    ) -> tuple[list[Item], list[Item]]:
        """Follow results that are others now; return which findings go and which come."""
        named = self._around(self._follow_busy(changed))
        alone = {key: [result.lonely if result else () for result in both] for key, both in changed.items()}
        moved = [key for key, both in alone.items() if any(both)]
        touched = self._around([*named, *moved])
        for key in moved:
            self._put(key, alone[key][1])
        touched |= self._around([*touched, *moved])
        return self._report(touched) if touched else ([], [])

    def _follow_busy(
        self, changed: Mapping[TopicKey, tuple[TopicResult | None, TopicResult | None]]
    ) -> Iterator[TopicKey]:
        """Note on which topics endpoints match now; yield topics without partner for which these may be meant."""
        for key, both in changed.items():
            before, now = (shown_busy(result) for result in both)
            if before == now:
                continue
            if self._busy is not None:
                self._busy.put(key, now)
            for token in self._tokens(key) if self._lonely and not self._partial else ():
                yield from self._by_token.get(token, ())

    def _put(self, key: TopicKey, lonely: Sequence[Resolved]) -> None:
        known = self._lonely.pop(key, ())
        self.count += len(lonely) - len(known)
        if lonely:
            self._lonely[key] = lonely
        if bool(lonely) is bool(known):
            return
        for token in self._tokens(key):
            if lonely:
                self._by_token.setdefault(token, {})[key] = None
            else:
                del self._by_token[token][key]
                if not self._by_token[token]:
                    del self._by_token[token]

    def _tokens(self, key: TopicKey) -> Iterator[tuple[str, ...]]:
        """What names have in common that nearly agree."""
        pack_id, name = key
        for words, fold in self._packs[pack_id].meeting.folds:
            yield pack_id, words, fold(name)
        for stub in stubs_of(name):
            yield pack_id, stub

    def _around(self, keys: Iterable[TopicKey]) -> dict[TopicKey, None]:
        """Return those of the topics that have no partner, and all that have to do with them, directly or by way of others."""
        found: dict[TopicKey, None] = {}
        left = [*keys]
        while left:
            key = left.pop()
            if key not in found and key in self._lonely:
                found[key] = None
                for token in self._tokens(key):
                    left += self._by_token[token]
        return found

    def _report(self, touched: Iterable[TopicKey]) -> tuple[list[Item], list[Item]]:
        gone = [item for key in touched for item in self._items.pop(key, ())]
        lonely = {key: self._lonely[key] for key in sorted(touched) if key in self._lonely}
        stated = {each.stated_id for endpoints in lonely.values() for each in endpoints}
        kinds = {name: kind for name in stated if (kind := self._kind_of(name)) != MESSAGE}
        packs = {pack_id: self._packs[pack_id] for pack_id, _ in lonely}
        for key, findings in reported_alone(lonely, packs, kinds, self._meant, partial=self._partial).items():
            self._items[key] = [
                Item((1, LONELY, key, position), Made(finding, ("own",), frozenset()))
                for position, finding in enumerate(findings)
            ]
        return gone, [item for key in lonely for item in self._items.get(key, ())]

    def _meant(self, keys: Sequence[TopicKey]) -> Callable[[TopicKey], str | None]:
        if self._busy is None and keys:
            self._busy = BusyTopics(self._packs)
            for key, result in self._results.items():
                self._busy.put(key, shown_busy(result))
        return (lambda _key: None) if self._busy is None else self._busy.meant


def shown_busy(result: TopicResult | None) -> str | None:
    """Return how the endpoints that match on a topic write it; None where none match."""
    return result.topic.shown if result is not None and result.outcomes.rows else None
