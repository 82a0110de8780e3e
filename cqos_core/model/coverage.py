"""The share of the inputs that a report covers."""

from __future__ import annotations

from collections import Counter
from dataclasses import field
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding_json import place_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.model.system import Part

_ALL: Final = 100


@dataclass(frozen=True, slots=True)
class Coverage:
    """The share of the inputs that a report covers.

    Attributes:
        endpoints: how many were read.
        unclear: ids of those that state something that is not known.
        unread: what was recognised and not read, although it may decide a verdict.
        totals: how many parts of a kind there are, read or not, where that is known: ``{"node": 14}``.
    """

    endpoints: int = 0
    unclear: tuple[str, ...] = ()
    unread: tuple[Part, ...] = ()
    totals: Mapping[str, int] = field(default_factory=dict, hash=False)

    @property
    def percent(self) -> int:
        """Return the percentage of existing endpoints that were read and understood completely; 100 only if nothing is unread."""
        known = self.endpoints - len(self.unclear)
        whole = self.endpoints + sum(each.endpoints for each in self.unread)
        if known == whole and not self.unread:
            return _ALL
        return min(_ALL * known // whole, _ALL - 1) if whole else 0

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data with the keys of the JSON report."""
        return {
            "percent": self.percent,
            "endpoints": self.endpoints,
            "unclear": list(self.unclear),
            "unread": [_part(each) for each in self.unread],
            "totals": dict(self.totals),
        }


def _part(part: Part) -> dict[str, Any]:
    return {
        "kind": part.kind,
        "name": part.name,
        "cause": part.cause,
        "place": place_json(part.place),
        "endpoints": part.endpoints,
    }


def joined(several: Iterable[Coverage]) -> Coverage:
    """Return the coverage of several reports as one."""
    every = [*several]
    totals: Counter[str] = Counter()
    for each in every:
        totals.update(each.totals)
    return Coverage(
        sum(each.endpoints for each in every),
        tuple(name for each in every for name in each.unclear),
        tuple(part for each in every for part in each.unread),
        dict(totals),
    )
