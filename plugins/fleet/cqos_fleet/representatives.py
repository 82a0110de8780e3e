"""Endpoints that represent many equal ones: a check reports a few, and the audit reports all."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cqos_core.checking.topic_check import TopicResult, settled
from cqos_core.checking.unmatched_endpoints import reported_alone
from cqos_core.language.relation import positions
from cqos_core.matching.topic_outcomes import judge_shape
from cqos_core.model.codes import CODES
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.model.finding import Finding
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_fleet.clients import Clients
    from cqos_fleet.profiles import FleetProfiles


class StandIns:
    """The endpoints of one comparison.

    Attributes:
        counts: by id, for how many endpoints it stands.
        numbers: by id, its profile.
    """

    def __init__(self, of: FleetProfiles | Clients) -> None:
        """Begin without any; ``of`` has the profiles, and the severities that are reported."""
        self.of = of
        self.counts: dict[str, int] = {}
        self.numbers: dict[str, int] = {}

    def add(self, p: int, number: int, topic: str = "topic", owner: str = "") -> Resolved:
        """Return an endpoint that stands for ``number`` of a profile; without ``owner`` its participant has no other."""
        resolved = self.of.known[p].resolved
        identifier = str(len(self.counts))
        self.counts[identifier], self.numbers[identifier] = number, p
        endpoint = replace(resolved.endpoint, participant=owner or identifier)
        end: Resolved = replace(resolved, id=identifier, key=topic, shown=topic, endpoint=endpoint, row=None)
        return end

    def judged(self, ends: Sequence[Resolved]) -> tuple[TopicResult, Counter[str]]:
        """Judge the endpoints of a topic; return also the pairs by verdict."""
        topic = settled(ends)
        publishers, subscribers = (
            tuple(
                members.key._replace(size=sum(self.counts[each.id] for each in members.endpoints)) for members in listed
            )
            for listed in (topic.publishers, topic.subscribers)
        )
        outcomes = judge_shape(topic.shape._replace(publishers=publishers, subscribers=subscribers))
        verdicts = Counter[str]()
        for row in outcomes.rows:
            offers = sum(publishers[at].size for at in row.publishers)
            verdicts[row.verdict.value] += offers * sum(subscribers[at].size for at in positions(row.subscribers))
        result = TopicResult(ends, outcomes)
        result.topic = topic
        return result, verdicts

    def alone(
        self, unmatched: Mapping[str, Sequence[Resolved]], busy: Iterable[str]
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield what a check says of topics with one side, as topics and rows.

        Args:
            unmatched: by topic its endpoints.
            busy: topics with both sides that may be meant by a similar name.
        """
        pack = self.of.pack
        meant = (((pack.id, topic), topic) for topic in busy)
        ends = {(pack.id, topic): listed for topic, listed in unmatched.items()}
        found = reported_alone(ends, {pack.id: pack}, {}, meant, partial=False)
        for (_, topic), findings in found.items():
            yield from ((topic, row) for row in self.rows(findings))

    def rows(self, findings: Iterable[Finding]) -> list[dict[str, Any]]:
        """Return findings about one topic as rows without topic and system: those that are severe enough."""
        return [self._row(each) for each in findings if each.severity.value in self.of.severities]

    def _row(self, finding: Finding) -> dict[str, Any]:
        members: dict[str, list[str]] = {PUBLISHER: [], SUBSCRIBER: []}
        for side in finding.sides:
            for member in side.members:
                members[self.of.known[self.numbers[member]].resolved.role].append(member)
        usual = CODES.get(finding.code)
        return {
            "code": finding.code,
            "severity": finding.severity.value,
            "verdict": finding.verdict.value if finding.verdict else "",
            **{role: self.numbers[listed[0]] if listed else -1 for role, listed in members.items()},
            **{f"{role}s": sum(self.counts[each] for each in listed) for role, listed in members.items()},
            "pairs": finding.pairs,
            "help": finding.help if usual is not None and finding.help != usual.help else "",
        }
