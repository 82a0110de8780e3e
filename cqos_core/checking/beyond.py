"""Findings about participants, brokers and options while a system is edited: one per rule and the values that it reads."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

from cqos_core.checking.checker import read_beyond, said_beyond
from cqos_core.checking.findings import Made, of_participants
from cqos_core.checking.stages import Item
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.matching.judge import Violation
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.resolving.resolved import Resolved

_BEYOND = 2


@dataclass(slots=True, eq=False)
class _Speaking:
    """What a rule says of some values: by participant the endpoints that have them, by their places among all.

    Attributes:
        shown: the endpoint that the finding shows; another one, or other participants, make another finding.
    """

    bound: BoundRule
    spoken: Violation
    number: int
    owners: dict[str, dict[tuple[int, int], Resolved]] = field(default_factory=dict)
    shown: Resolved | None = None
    item: Item | None = None


class Beyond:
    """What rules over participants, brokers and options say."""

    def __init__(self) -> None:
        """Begin without endpoints."""
        self._asked: dict[tuple[Any, ...], _Speaking | None] = {}

    def change(
        self,
        gone: Iterable[tuple[tuple[int, int], Resolved]],
        came: Iterable[tuple[tuple[int, int], Resolved]],
    ) -> tuple[list[Item], list[Item]]:
        """Follow endpoints that go and come; return which findings go and which come."""
        touched: dict[_Speaking, None] = {}
        for place, endpoint in came:
            for said in self._said(endpoint):
                owner = endpoint.participant.participant.id
                if owner not in said.owners:
                    said.owners[owner] = {}
                    touched[said] = None
                said.owners[owner][place] = endpoint
                first = min(said.owners[owner])
                if said.shown is None or (owner == _owner(said) and said.owners[owner][first] is not said.shown):
                    touched[said] = None
        for place, endpoint in gone:
            for said in self._said(endpoint):
                owner = endpoint.participant.participant.id
                if said.owners[owner].get(place) is endpoint:
                    del said.owners[owner][place]
                    if not said.owners[owner]:
                        del said.owners[owner]
                        touched[said] = None
                    elif said.shown is endpoint:
                        touched[said] = None
        return self._report(touched)

    def _said(self, endpoint: Resolved) -> Iterable[_Speaking]:
        for bound, read in read_beyond(endpoint):
            key = (id(bound), read)
            if key not in self._asked:
                spoken = said_beyond(bound, endpoint)
                self._asked[key] = None if spoken is None else _Speaking(bound, spoken, len(self._asked))
            said = self._asked[key]
            if said is not None:
                yield said

    def _report(self, touched: Iterable[_Speaking]) -> tuple[list[Item], list[Item]]:
        gone, came = [], []
        for said in touched:
            if said.item is not None:
                gone.append(said.item)
            said.item = said.shown = None
            if said.owners:
                # One endpoint of each participant is enough.
                first = [endpoints[min(endpoints)] for _, endpoints in sorted(said.owners.items())]
                said.shown = first[0]
                finding = of_participants(said.bound, said.spoken, first)
                said.item = Item((1, _BEYOND, said.number), Made(finding, ("own",), frozenset()))
                came.append(said.item)
        return gone, came


def _owner(said: _Speaking) -> str | None:
    return said.shown.participant.participant.id if said.shown is not None else None
