"""Topics that Python judges: where an assumption, a peer, a whole topic or a condition of matching decides; and topics of one side."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

from cqos_core.checking.partners import reported_alone
from cqos_core.checking.topic import TopicResult, settled
from cqos_core.language.relation import positions
from cqos_core.matching.topic_shape import judge_shape
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.bulk.profiles import FleetProfiles
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.model.report import Finding
    from cqos_core.resolving.resolved import Resolved

PYTHON, ALONE = 2, 3
"""Routes of topics: all of it is judged here; it has one side only."""


@dataclass(slots=True)
class SlowTopics:
    """Judges topics, one endpoint for each profile; that endpoint stands for as many as there are.

    Attributes:
        rows: the findings.
        verdicts: numbers of pairs by verdict.
    """

    profiles: FleetProfiles
    rows: list[dict[str, Any]] = field(default_factory=list)
    verdicts: dict[str, int] = field(default_factory=dict)
    _counts: dict[str, int] = field(default_factory=dict)
    _numbers: dict[str, int] = field(default_factory=dict)
    _lonely: dict[TopicKey, list[Resolved]] = field(default_factory=dict)

    def judge(self, groups: Iterable[Mapping[str, Any]]) -> None:
        """Judge groups of endpoints; those of one system, and of one topic in it, stand one after the other."""
        for system, of_system in groupby(groups, lambda row: row["system"]):
            for topic, of_topic in groupby(of_system, lambda row: row["topic"]):
                self._judge(system, topic, [*of_topic])
            packs = {self.profiles.pack.id: self.profiles.pack}
            found = reported_alone(self._lonely, packs, {}, lambda _: lambda _: None, partial=False)
            for (_, topic), findings in found.items():
                for finding in findings:
                    self._note(system, topic, finding)
            for known in (self._lonely, self._counts, self._numbers):
                known.clear()

    def _judge(self, system: str, name: str, groups: Sequence[Mapping[str, Any]]) -> None:
        ends = [self._end(name, row) for row in groups]
        if len({each.role for each in ends}) == 1:
            self._lonely[self.profiles.pack.id, name] = ends
        if all(row["route"] == ALONE for row in groups):
            return
        topic = settled(ends)
        publishers, subscribers = (
            tuple(
                members.alike._replace(size=sum(self._counts[each.id] for each in members.endpoints))
                for members in listed
            )
            for listed in (topic.publishers, topic.subscribers)
        )
        outcomes = judge_shape(topic.shape._replace(publishers=publishers, subscribers=subscribers))
        for row in outcomes.rows:
            pairs = sum(publishers[at].size for at in row.publishers) * sum(
                subscribers[at].size for at in positions(row.subscribers)
            )
            self.verdicts[row.verdict.value] = self.verdicts.get(row.verdict.value, 0) + pairs
        # Findings about a single profile are reported for all topics alike.
        outlines = tuple(each for each in outcomes.outlines if each.spoken.bound.scope != "endpoint")
        result = TopicResult(ends, outcomes._replace(outlines=outlines))
        result.topic = topic
        for made in result.made:
            self._note(system, name, made.finding)

    def _end(self, name: str, row: Mapping[str, Any]) -> Resolved:
        known = self.profiles.known[row["p"]].resolved
        identifier = str(len(self._counts))
        self._counts[identifier] = row["publishers"] + row["subscribers"]
        self._numbers[identifier] = row["p"]
        owner = replace(known.endpoint, participant=identifier)
        end: Resolved = replace(known, id=identifier, key=name, shown=name, endpoint=owner)
        return end

    def _note(self, system: str, topic: str, finding: Finding) -> None:
        """Keep a finding, where it is severe enough."""
        if finding.severity.value not in self.profiles.severities:
            return
        members: dict[str, list[str]] = {"publisher": [], "subscriber": []}
        known = self.profiles.known
        for side in finding.sides:
            for member in side.members:
                role = known[self._numbers[member]].resolved.role
                members["publisher" if role == PUBLISHER else "subscriber"].append(member)
        ends = {role: self._numbers[listed[0]] if listed else -1 for role, listed in members.items()}
        counts = {f"{role}s": sum(self._counts[each] for each in listed) for role, listed in members.items()}
        verdict = finding.verdict.value if finding.verdict else ""
        stated = {"code": finding.code, "severity": finding.severity.value, "verdict": verdict}
        self.rows.append({**stated, "system": system, "topic": topic, **ends, **counts, "pairs": finding.pairs})
