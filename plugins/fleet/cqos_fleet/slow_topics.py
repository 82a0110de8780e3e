"""Topics that Python judges, once for each combination of profiles, and similar names of topics with one side.

In Python are those on which an assumption, a peer, a whole topic or a condition of matching decides.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from cqos_core.model.caches import keep
from cqos_core.model.grouping import grouped
from cqos_fleet.representatives import StandIns

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_fleet.profiles import FleetProfiles

QUIET, COLUMNS, PYTHON, ALONE, SPECIAL = range(5)
"""Routes of topics: no rule reports; pairs are asked in columns; all of it is judged here; it has one side only; its name decides."""
_Shape = tuple[tuple[int, int], ...]
"""Profiles, and how many endpoints of a topic have each."""


@dataclass(slots=True)
class SlowTopics:
    """Judges topics, one endpoint for each profile; that endpoint stands for as many as there are.

    Attributes:
        verdicts: numbers of pairs by verdict.
    """

    profiles: FleetProfiles
    verdicts: Counter[str] = field(default_factory=Counter)
    _known: dict[_Shape, tuple[Counter[str], list[dict[str, Any]]]] = field(default_factory=dict)

    def judge(
        self, groups: Iterable[Mapping[str, Any]], busy: Iterable[Mapping[str, Any]]
    ) -> Iterator[Mapping[str, Any]]:
        """Yield findings about groups of endpoints.

        Args:
            groups: those of one system, and of one topic in it, stand one after the other.
            busy: topics with both sides that may be meant by a similar name.
        """
        named = grouped((row["system"], row["topic"]) for row in busy)
        for system, of_system in groupby(groups, itemgetter("system")):
            stand_ins = StandIns(self.profiles)
            unmatched: dict[str, list[Resolved]] = {}
            for topic, of_topic in groupby(of_system, itemgetter("topic")):
                ends = [*of_topic]
                shape = tuple([(end["p"], end["publishers"] + end["subscribers"]) for end in ends])
                if len({end["publishers"] > 0 for end in ends}) == 1:
                    unmatched[topic] = [stand_ins.add(*each, topic) for each in shape]
                if any(end["route"] != ALONE for end in ends):
                    known = self._known.get(shape) or keep(self._known, shape, self._of_shape(shape))
                    self.verdicts.update(known[0])
                    yield from ({**row, "system": system, "topic": topic} for row in known[1])
            for topic, row in stand_ins.alone(unmatched, named.get(system, ())):
                yield {**row, "system": system, "topic": topic}

    def _of_shape(self, shape: _Shape) -> tuple[Counter[str], list[dict[str, Any]]]:
        """Return the pairs by verdict and the findings of a topic."""
        stand_ins = StandIns(self.profiles)
        result, verdicts = stand_ins.judged([stand_ins.add(*each) for each in shape])
        # Findings about a single profile are reported for all topics alike.
        hits = tuple(each for each in result.outcomes.hits if each.violation.bound.scope != "endpoint")
        result.outcomes = result.outcomes._replace(hits=hits)
        return verdicts, stand_ins.rows(made.finding for made in result.made)
