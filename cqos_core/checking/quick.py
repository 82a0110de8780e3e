"""The quick way of an edit: one endpoint is resolved, and its topics are judged.

It is open where an endpoint has to do with its own topic only. No bridge, overlay, chain or link reaches it, and no order of start is
stated. No control flow leads from topic to topic, no pack lets values follow from all endpoints, and resolving reported nothing. All
else takes the general way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.checking.checker import assemble, made, stated_findings
from cqos_core.checking.known_findings import KnownFindings, Step, joined, plain_items, remarks_of
from cqos_core.checking.topic import check_topic
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.checking.checker import JudgedTopics
    from cqos_core.checking.known_findings import Numbered
    from cqos_core.checking.stages import Item
    from cqos_core.checking.stated import StatedEndpoints
    from cqos_core.checking.topic import TopicResult
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.matching.pipeline import Context, Pipeline
    from cqos_core.model.report import Finding, Group, Report
    from cqos_core.model.system import Endpoint, System
    from cqos_core.resolving.resolved import Resolved


def is_quick(pipeline: Pipeline) -> bool:
    """Whether edits of the endpoints of a system may take the quick way."""
    system, resolver = pipeline.stated, pipeline.resolver
    packs = resolver.result.packs
    return not (
        (system.overlays or system.bridges or system.hypothetical or system.flows or system.chains or system.links)
        or (resolver.unjudged or resolver.clashes or resolver.completed)
        or any(each.meeting.match is not None for each in packs.values())
        or any(each.wire is not None and each.wire.protocol in packs for each in packs.values())
        or any(each.starts_after for each in system.participants.values())
        or any(each.starts_after or each.alternative for each in system.endpoints)
    )


def quick_way(
    pipeline: Pipeline, judged: JudgedTopics, topics: dict[TopicKey, list[Resolved]], stated: StatedEndpoints
) -> Quick | None:
    """Return the quick way of a system of ``stated`` endpoints that was judged; None where it is closed.

    Edits change ``topics`` and the results.
    """
    quick = Quick(pipeline, judged, topics, stated) if is_quick(pipeline) else None
    return quick if quick is not None and quick.begin(pipeline.where) else None


def _is_of(finding: Finding, endpoint: Endpoint, parts: Sequence[Resolved]) -> bool:
    """Whether a finding of resolving is about one endpoint, and nothing that others share."""
    ids = {part.id for part in parts}
    return all(side.role == endpoint.role and side.members and ids.issuperset(side.members) for side in finding.sides)


class Quick:
    """A system whose edits may take the quick way.

    Attributes:
        findings: those of the system.
    """

    def __init__(
        self, pipeline: Pipeline, judged: JudgedTopics, topics: dict[TopicKey, list[Resolved]], stated: StatedEndpoints
    ) -> None:
        """See `quick_way`."""
        self._system = pipeline.stated
        self._resolver = pipeline.resolver
        self._judged = judged
        self._topics = topics
        self._stated = stated
        self._noted = {note.endpoint for note in self._system.notes}
        result = self._resolver.result
        parts: dict[str, list[Resolved]] = {}
        for each in result.endpoints:
            parts.setdefault(each.stated_id, []).append(each)
        numbers = ((each.id, found[0]) for each in stated if (found := stated.find(each.id)) is not None)
        self._parts = {name: (number, tuple(parts.get(name, ()))) for name, number in numbers}
        self._remarks: dict[str, list[Item]] = {}
        self.findings = KnownFindings(self._system, pipeline.where, dict(result.packs), judged.results, stated.kind_of)

    def begin(self, context: Context) -> bool:
        """Find all that there is to report; return whether what resolving reported is of single endpoints."""
        result = self._resolver.result
        reported, endpoints = [*result.findings], result.endpoints
        result.endpoints = []
        if reported and not self._attributed(reported):
            result.findings[:], result.endpoints = reported, endpoints
            return False
        plain = stated_findings(self._system, result, context, self._judged.problems)
        topics = {key: (None, each) for key, each in self._judged.results.items()}
        remarks = [*plain_items(plain), *(item for items in self._remarks.values() for item in items)]
        self.findings.change(Step(topics, [], self._numbered(self._parts), [], remarks))
        return True

    def _attributed(self, reported: Sequence[Finding]) -> bool:
        """Resolve all endpoints again that findings name; return whether that reports the same."""
        members = {member for finding in reported for side in finding.sides for member in side.members}
        self._resolver.reader.taken()
        for name, (number, parts) in self._parts.items():
            found = self._stated.find(name)
            if found is not None and any(part.id in members for part in parts):
                self._resolver.ids.difference_update(part.id for part in parts)
                if self._resolve(number, found[1]) is None:
                    return False
        again = self._reported()
        return len(again) == len(reported) and all(each in again for each in reported)

    def _reported(self) -> list[Finding]:
        """What resolving all endpoints reports."""
        return joined([item for items in self._remarks.values() for item in items])

    def parts(self, name: str) -> tuple[Resolved, ...]:
        """Return what an endpoint amounts to, by its id."""
        return self._parts[name][1] if name in self._parts else ()

    @property
    def groups(self) -> list[Group]:
        """All groups, in no order."""
        return [group for result in self._judged.results.values() for group in result.groups]

    def report(self, system: System, context: Context) -> Report:
        """Return the report on the whole, which is ``system`` now."""
        result = self._resolver.result
        result.findings += self._reported()
        result.endpoints = [part for each in system.endpoints for part in self._parts[each.id][1]]
        report = made(assemble(system, result, self._judged.results, context, self._judged.problems))
        result.endpoints = []
        result.findings.clear()
        return report

    def follow(self, touched: Iterable[str]) -> Step | None:
        """Resolve endpoints that were edited, and judge their topics; None where that is not all that changes.

        After None, this is good for nothing more.
        """
        if not len(self._stated):
            return None
        gone: list[Numbered] = []
        came: list[Numbered] = []
        unsaid: list[Item] = []
        said: list[Item] = []
        for name in touched:
            gone += self._numbered([name])
            _, old = self._parts.pop(name, (0, ()))
            if self._beyond(old) or (self._system.checks and any(each.endpoint.protocol for each in old)):
                return None  # it may be the only one of a protocol
            self._resolver.ids.difference_update(each.id for each in old)
            unsaid += self._remarks.pop(name, ())
            found = self._stated.find(name)
            if found is not None:
                parts = self._resolve(*found)
                if parts is None:
                    return None
                self._parts[name] = found[0], parts
                came += self._numbered([name])
                said += self._remarks.get(name, ())
        return Step(self._judge(gone, came), gone, came, unsaid, said)

    def _numbered(self, names: Iterable[str]) -> list[Numbered]:
        return [
            ((number, position), part)
            for name in names
            for number, parts in [self._parts.get(name, (0, ()))]
            for position, part in enumerate(parts)
        ]

    def _resolve(self, number: int, endpoint: Endpoint) -> tuple[Resolved, ...] | None:
        """Resolve an endpoint, where that needs and reports nothing new that others may share."""
        if endpoint.starts_after or endpoint.alternative or (self._system.checks and endpoint.protocol):
            return None
        resolver = self._resolver
        packs, participants = len(resolver.result.packs), len(resolver.result.participants)
        resolver.stated(endpoint)
        parts, resolver.result.endpoints = tuple(resolver.result.endpoints), []
        remarks = resolver.reader.taken()
        if remarks:
            self._remarks[endpoint.id] = remarks_of(number, remarks)
        news = (
            (resolver.unjudged or resolver.clashes)
            or len(resolver.result.packs) > packs
            or len(resolver.result.participants) > participants
            or self._beyond(parts)
            or (endpoint.needs and endpoint.role != PUBLISHER and not all(part.pack.needs for part in parts))
            or (remarks and (endpoint.profiles or self._system.profiles))
            or not all(_is_of(finding, endpoint, parts) for _, finding in remarks)
        )
        return None if news else parts

    def _beyond(self, parts: Sequence[Resolved]) -> bool:
        """Whether any of them is an instance, and findings about something else name it."""
        named = (each.id for each in parts if each.endpoint.template is not None)
        return any(name in self._noted or name in self._system.participants for name in named)

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
