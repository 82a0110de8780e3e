"""Topics that Python judges, once for each combination of profiles, and similar names of topics with one side.

In Python are those on which an assumption, a peer, a whole topic or a condition of matching decides.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

from cqos_core.checking.partners import BusyTopics, reported_alone
from cqos_core.checking.topic import TopicResult, settled
from cqos_core.language.relation import positions
from cqos_core.matching.topic_shape import judge_shape
from cqos_core.model.codes import CODES
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_bulk.profiles import FleetProfiles
    from cqos_core.matching.pairing import MatchedTopic, TopicKey
    from cqos_core.matching.topic_shape import ShapeResult
    from cqos_core.model.report import Finding
    from cqos_core.resolving.resolved import Resolved

QUIET, COLUMNS, PYTHON, ALONE, SPECIAL = range(5)
"""Routes of topics: no rule reports; pairs are asked in columns; all of it is judged here; it has one side only; its name decides."""
_MOST_SHAPES: Final = 20_000


@dataclass(slots=True)
class SlowTopics:
    """Judges topics, one endpoint for each profile; that endpoint stands for as many as there are.

    Attributes:
        verdicts: numbers of pairs by verdict.
    """

    profiles: FleetProfiles
    verdicts: dict[str, int] = field(default_factory=dict)
    _counts: dict[str, int] = field(default_factory=dict)
    _numbers: dict[str, int] = field(default_factory=dict)
    _lonely: dict[TopicKey, list[Resolved]] = field(default_factory=dict)
    _known: dict[tuple[tuple[int, int], ...], tuple[dict[str, int], list[dict[str, Any]]]] = field(default_factory=dict)

    def judge(
        self, groups: Iterable[Mapping[str, Any]], busy: Iterable[Mapping[str, Any]]
    ) -> Iterator[Mapping[str, Any]]:
        """Yield findings about groups of endpoints.

        Args:
            groups: those of one system, and of one topic in it, stand one after the other.
            busy: topics with both sides that may be meant by a similar name.
        """
        packs = {self.profiles.pack.id: self.profiles.pack}
        named: dict[str, list[str]] = {}
        for row in busy:
            named.setdefault(row["system"], []).append(row["topic"])
        for system, of_system in groupby(groups, lambda row: row["system"]):
            meant = BusyTopics(packs)
            for topic in dict.fromkeys(named.get(system, ())):
                meant.put((self.profiles.pack.id, topic), topic)
            for topic, of_topic in groupby(of_system, lambda row: row["topic"]):
                verdicts, rows = self._judged(topic, [*of_topic])
                for verdict, pairs in verdicts.items():
                    self.verdicts[verdict] = self.verdicts.get(verdict, 0) + pairs
                yield from ({**row, "system": system, "topic": topic} for row in rows)
            found = reported_alone(self._lonely, packs, {}, lambda _, meant=meant: meant.meant, partial=False)  # type: ignore[misc]
            for (_, topic), findings in found.items():
                yield from (
                    {**row, "system": system, "topic": topic} for each in findings for row in self._row_of(each)
                )
            for known in (self._lonely, self._counts, self._numbers):
                known.clear()

    def _judged(self, name: str, groups: Sequence[Mapping[str, Any]]) -> tuple[dict[str, int], list[dict[str, Any]]]:
        """Return the pairs by verdict and the findings of a topic; keep it where it has one side."""
        if len({row["publishers"] > 0 for row in groups}) == 1:
            self._lonely[self.profiles.pack.id, name] = [self._end(name, row) for row in groups]
        if all(row["route"] == ALONE for row in groups):
            return {}, []
        shape = tuple([(row["p"], row["publishers"] + row["subscribers"]) for row in groups])
        known = self._known.get(shape)
        if known is None:
            if len(self._known) >= _MOST_SHAPES:
                self._known.clear()
            known = self._known[shape] = self._of_shape([self._end(name, row) for row in groups])
        return known

    def _of_shape(self, ends: Sequence[Resolved]) -> tuple[dict[str, int], list[dict[str, Any]]]:
        topic, outcomes, verdicts = judged(ends, self._counts)
        # Findings about a single profile are reported for all topics alike.
        outlines = tuple(each for each in outcomes.outlines if each.spoken.bound.scope != "endpoint")
        result = TopicResult(ends, outcomes._replace(outlines=outlines))
        result.topic = topic
        return verdicts, [row for made in result.made for row in self._row_of(made.finding)]

    def _end(self, name: str, row: Mapping[str, Any]) -> Resolved:
        known = self.profiles.known[row["p"]].resolved
        identifier = str(len(self._counts))
        self._counts[identifier] = row["publishers"] + row["subscribers"]
        self._numbers[identifier] = row["p"]
        owner = replace(known.endpoint, participant=identifier)
        end: Resolved = replace(known, id=identifier, key=name, shown=name, endpoint=owner)
        return end

    def _row_of(self, finding: Finding) -> Iterator[dict[str, Any]]:
        """Yield a finding as a row, where it is severe enough."""
        if finding.severity.value in self.profiles.severities:
            known, numbers = self.profiles.known, self._numbers
            yield row_of(finding, self._counts, numbers, lambda member: known[numbers[member]].resolved.role)


def judged(ends: Sequence[Resolved], counts: Mapping[str, int]) -> tuple[MatchedTopic, ShapeResult, dict[str, int]]:
    """Judge the endpoints of a topic; each stands for as many as ``counts`` says. Return also the pairs by verdict."""
    topic = settled(ends)
    publishers, subscribers = (
        tuple(members.alike._replace(size=sum(counts[each.id] for each in members.endpoints)) for members in listed)
        for listed in (topic.publishers, topic.subscribers)
    )
    outcomes = judge_shape(topic.shape._replace(publishers=publishers, subscribers=subscribers))
    verdicts: dict[str, int] = {}
    for row in outcomes.rows:
        pairs = sum(publishers[at].size for at in row.publishers) * sum(
            subscribers[at].size for at in positions(row.subscribers)
        )
        verdicts[row.verdict.value] = verdicts.get(row.verdict.value, 0) + pairs
    return topic, outcomes, verdicts


def row_of(
    finding: Finding, counts: Mapping[str, int], numbers: Mapping[str, int], role_of: Callable[[str], str]
) -> dict[str, Any]:
    """Return a finding as a row.

    Args:
        finding: about one topic.
        counts: by id of a member, for how many endpoints it stands.
        numbers: by id of a member, its profile.
        role_of: returns the role of a member.
    """
    members: dict[str, list[str]] = {"publisher": [], "subscriber": []}
    for side in finding.sides:
        for member in side.members:
            members["publisher" if role_of(member) == PUBLISHER else "subscriber"].append(member)
    ends = {role: numbers[listed[0]] if listed else -1 for role, listed in members.items()}
    sums = {f"{role}s": sum(counts[each] for each in listed) for role, listed in members.items()}
    verdict = finding.verdict.value if finding.verdict else ""
    stated = {"code": finding.code, "severity": finding.severity.value, "verdict": verdict}
    usual = CODES.get(finding.code)
    meant = finding.help if usual is not None and finding.help != usual.help else ""
    return {**stated, **ends, **sums, "pairs": finding.pairs, "help": meant}
