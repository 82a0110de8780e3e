"""The quick way of an edit: one endpoint is resolved, and its topics are judged.

It is open where an endpoint has to do with its own topic only. No bridge or overlay reaches it, and no order of start is stated.
No pack lets values follow from all endpoints, and resolving reported nothing. All else takes the general way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.checking.checker import assemble, stated_findings
from cqos_core.checking.known_findings import KnownFindings, Step
from cqos_core.checking.topic import check_topic
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.checking.checker import JudgedTopics
    from cqos_core.checking.known_findings import Numbered
    from cqos_core.checking.stated import StatedEndpoints
    from cqos_core.checking.topic import TopicResult
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.matching.pipeline import Context, Pipeline
    from cqos_core.model.report import Group, Report
    from cqos_core.model.system import Endpoint, System
    from cqos_core.resolving.resolved import Resolved


def is_quick(pipeline: Pipeline) -> bool:
    """Whether edits of the endpoints of a system may take the quick way."""
    system, resolver = pipeline.stated, pipeline.resolver
    packs = resolver.result.packs
    return not (
        (system.overlays or system.bridges or system.hypothetical)
        or (resolver.said or resolver.clashes or resolver.completed)
        or any(each.meeting.match is not None for each in packs.values())
        or any(each.wire is not None and each.wire.protocol in packs for each in packs.values())
        or any(each.starts_after for each in system.participants.values())
        or any(each.starts_after or each.alternative for each in system.endpoints)
    )


class Quick:
    """A system whose edits may take the quick way.

    Attributes:
        findings: those of the system.
    """

    def __init__(
        self, pipeline: Pipeline, judged: JudgedTopics, topics: dict[TopicKey, list[Resolved]], stated: StatedEndpoints
    ) -> None:
        """Begin with a system of ``stated`` endpoints that was judged; ``topics`` and results are changed by edits."""
        self._system = pipeline.stated
        self._resolver = pipeline.resolver
        self._judged = judged
        self._topics = topics
        self._noted = {note.endpoint for note in self._system.notes}
        result = self._resolver.result
        parts: dict[str, list[Resolved]] = {}
        for each in result.endpoints:
            parts.setdefault(each.stated_id, []).append(each)
        numbers = ((each.id, found[0]) for each in stated if (found := stated.find(each.id)) is not None)
        self._parts = {name: (number, tuple(parts.get(name, ()))) for name, number in numbers}
        result.endpoints = []
        plain = stated_findings(self._system, result, pipeline.where, judged.problems)
        self.findings = KnownFindings(self._system, pipeline.where, dict(result.packs), judged.results, plain)
        self.findings.change(
            Step({key: (None, each) for key, each in judged.results.items()}, [], self._numbered(self._parts))
        )

    @property
    def groups(self) -> list[Group]:
        """All groups, in no order."""
        return [group for result in self._judged.results.values() for group in result.groups]

    def report(self, system: System, context: Context) -> Report:
        """Return the report on the whole, which is ``system`` now."""
        result = self._resolver.result
        result.endpoints = [part for each in system.endpoints for part in self._parts[each.id][1]]
        report = assemble(system, result, self._judged.results, context, self._judged.problems)
        result.endpoints = []
        return report

    def follow(self, touched: Iterable[str], stated: StatedEndpoints) -> Step | None:
        """Resolve endpoints that were edited, and judge their topics; None where that is not all that changes.

        After None, this is good for nothing more.
        """
        if not len(stated):
            return None
        gone: list[Numbered] = []
        came: list[Numbered] = []
        for name in touched:
            if name in self._noted or name in self._system.participants:
                return None
            gone += self._numbered([name])
            number, old = self._parts.pop(name, (0, ()))
            if self._system.checks and any(each.endpoint.protocol for each in old):
                return None  # it may be the only one of a protocol
            self._resolver.ids.difference_update(each.id for each in old)
            found = stated.find(name)
            if found is not None:
                number, endpoint = found
                parts = self._resolve(endpoint)
                if parts is None:
                    return None
                self._parts[name] = number, parts
                came += self._numbered([name])
        return Step(self._judge(gone, came), gone, came)

    def _numbered(self, names: Iterable[str]) -> list[Numbered]:
        return [
            ((number, position), part)
            for name in names
            for number, parts in [self._parts.get(name, (0, ()))]
            for position, part in enumerate(parts)
        ]

    def _resolve(self, endpoint: Endpoint) -> tuple[Resolved, ...] | None:
        """Resolve an endpoint, where that tells and needs nothing new but its values."""
        if endpoint.starts_after or endpoint.alternative or (self._system.checks and endpoint.protocol):
            return None
        resolver = self._resolver
        packs, participants = len(resolver.result.packs), len(resolver.result.participants)
        resolver.stated(endpoint)
        parts, resolver.result.endpoints = tuple(resolver.result.endpoints), []
        news = (
            (resolver.said or resolver.clashes)
            or len(resolver.result.packs) > packs
            or len(resolver.result.participants) > participants
            or any(part.id in self._system.participants for part in parts)
            or (endpoint.needs and endpoint.role != PUBLISHER and not all(part.pack.needs for part in parts))
        )
        return None if news else parts

    def _judge(
        self, gone: Sequence[Numbered], came: Sequence[Numbered]
    ) -> dict[TopicKey, tuple[TopicResult | None, TopicResult | None]]:
        """Judge the topics that endpoints leave or come to; return their former and new results."""
        touched: dict[TopicKey, None] = {}
        for numbered, leave in ((gone, True), (came, False)):
            for _, part in numbered:
                if part.key is not None:
                    key = part.pack.id, part.key
                    touched[key] = None
                    if leave:
                        self._topics[key].remove(part)
                    else:
                        self._topics.setdefault(key, []).append(part)
        results = self._judged.results
        changed: dict[TopicKey, tuple[TopicResult | None, TopicResult | None]] = {}
        for key in touched:
            before = results.pop(key, None)
            if self._topics[key]:
                results[key] = check_topic(self._topics[key], self._judged.excused, self._judged.teams)
            else:
                del self._topics[key]
            changed[key] = before, results.get(key)
        return changed
