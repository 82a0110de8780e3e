"""Systems that are checked as wholes, one after the other; those of equal content once.

They are read from files, or their protocol has values that follow from all endpoints together, or two protocols match in them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from hashlib import blake2b
from itertools import groupby, islice
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.checking.checker import assemble, judge_topics
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.caches import keep
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.problems import CqosError
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Participant, System
from cqos_fleet.profiles import SEVERITIES, endpoint_of, settings_of, stated_twice
from cqos_fleet.value_numbers import Numbered

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Finding
    from cqos_core.model.system import Endpoint
    from cqos_core.packs.pack import RulePack

_LEFT_OUT: Final = frozenset(("CQ404", "CQ406"))
"""Notes about a whole system that say nothing of a fleet: nothing was compared, and a participant hears itself."""
_REMEMBERED: Final = 1_000
_MOST: Final = 400_000
"""The most endpoints of one system: 8 kB of memory for each, and 30 kB where each client has its own values."""


class NamedSystem(NamedTuple):
    """A system of a fleet.

    Attributes:
        content: equal for systems that differ in their name only; None: not known.
        versions: of endpoints, by id.
    """

    name: str
    system: System
    content: object = None
    versions: Mapping[str, str] = {}


@dataclass(slots=True)
class WholeSystems:
    """Checks systems, and counts what it finds.

    Attributes:
        severity: the least that is reported.
        texts: what each profile states, by column; a number in a finding is a position here.
        totals: as in `cqos_fleet.audit.Audited`.
    """

    where: CheckContext
    severity: str
    texts: Numbered[Mapping[str, str]] = field(default_factory=Numbered)
    totals: Counter[str] = field(default_factory=Counter)
    _known: dict[object, tuple[Counter[str], list[dict[str, Any]]]] = field(default_factory=dict)

    def findings(self, systems: Iterable[NamedSystem]) -> Iterator[dict[str, Any]]:
        """Yield the findings of each system, as rows."""
        for each in systems:
            known = self._known.get(each.content) if each.content is not None else None
            if known is None:
                known = self._checked(each)
                if each.content is not None:
                    keep(self._known, each.content, known, _REMEMBERED)
            totals, rows = known
            self.totals.update(totals)
            yield from ({**row, "system": each.name} for row in rows)
        self.totals["profiles"] = len(self.texts)

    def _checked(self, each: NamedSystem) -> tuple[Counter[str], list[dict[str, Any]]]:
        with gc_paused(len(each.system.endpoints)):
            pipeline = Pipeline(each.system, self.where)
            judged = judge_topics(pipeline)
            resolved = pipeline.resolver.result
            report = assemble(pipeline.system, resolved, judged.results, self.where, judged.problems)
        totals = Counter(endpoints=report.endpoints, topics=report.topics)
        for group in report.groups:
            totals[group.verdict.value] += len(group.publishers) * len(group.subscribers)
        ends = {end.id: (end.role, end.endpoint, end.pack.id) for end in resolved.endpoints}
        by_code: dict[str, list[Finding]] = {}
        for result in judged.results.values() if any(one.more_topics for one in report.findings) else ():
            for made in result.made:
                by_code.setdefault(made.finding.code, []).append(made.finding)
        rows = []
        severities = SEVERITIES[: SEVERITIES.index(self.severity) + 1]
        for finding in report.findings:
            if finding.accepted is None and finding.severity.value in severities and finding.code not in _LEFT_OUT:
                parts = _by_topic(finding, by_code.get(finding.code, ()))
                rows += [self._row(part, finding, each, ends) for part in parts]
        return totals, rows

    def _row(
        self, part: Finding, whole: Finding, of: NamedSystem, ends: Mapping[str, tuple[str, Endpoint, str]]
    ) -> dict[str, Any]:
        members: dict[str, list[str]] = {PUBLISHER: [], SUBSCRIBER: []}
        for side in part.sides:
            for member in side.members:
                if member in ends:
                    members[ends[member][0]].append(member)
        protocols = {ends[member][2] for listed in members.values() for member in listed}
        return {
            "protocol": min(protocols, default=of.system.protocol or ""),
            "code": part.code,
            "severity": whole.severity.value,
            "verdict": part.verdict.value if part.verdict else "",
            "topic": part.topic or "",
            **{role: self._number(ends[listed[0]][1], of) if listed else -1 for role, listed in members.items()},
            **{f"{role}s": len(listed) for role, listed in members.items()},
            "pairs": part.pairs,
            "help": part.help if part.code in {"CQ401", "CQ402"} and "did you mean" in (part.help or "") else "",
        }

    def _number(self, endpoint: Endpoint, of: NamedSystem) -> int:
        """Return the number of what an endpoint states."""
        owner = of.system.participants[endpoint.participant]
        settings = {**owner.settings, **endpoint.settings}
        texts = {name: each.text for name, each in settings.items() if not each.derived}
        if endpoint.profiles:
            texts["profile"] = ", ".join(each.name for each in endpoint.profiles)
        texts["version"] = of.versions.get(endpoint.id, "")
        return self.texts.number(tuple(texts.items()), texts)


def _by_topic(finding: Finding, made: Sequence[Finding]) -> Sequence[Finding]:
    """Return a finding for each topic of one that several topics share."""
    topics = {finding.topic, *finding.more_topics}
    found = (
        [each for each in made if each.topic in topics and each.verdict == finding.verdict] if len(topics) > 1 else []
    )
    return found if found and sum(each.pairs for each in found) == finding.pairs else [finding]


def systems_of(
    rows: Iterable[Mapping[str, str]],
    pack_of: Callable[[str], RulePack],
    options: Mapping[str, Mapping[str, Setting]],
) -> Iterator[NamedSystem]:
    """Yield the systems of a table.

    Args:
        rows: endpoints; those of one system stand one after the other.
        pack_of: gives the pack of a protocol.
        options: of packs, by id.

    Raises:
        CqosError: a participant has two values of one setting, or a system is too large.
    """
    for name, of_system in groupby(rows, lambda row: row["system"]):
        listed = [{key: text for key, text in row.items() if key != "system"} for row in islice(of_system, _MOST + 1)]
        if len(listed) > _MOST:
            raise CqosError(
                f"system `{name}` has more than {_MOST:,} endpoints that are checked together", "split it by `system`"
            )
        listed.sort(key=lambda row: tuple(row.values()))
        system = System(options={pack: dict(given) for pack, given in options.items()})
        for at, row in enumerate(listed):
            _add(system, row, str(at), name, pack_of(row["protocol"]))
        versions = {str(at): row["version"] for at, row in enumerate(listed)}
        content = blake2b(repr([[*row.values()] for row in listed]).encode("utf-8", "replace")).digest()
        yield NamedSystem(name, system, content, versions)


def _add(system: System, row: Mapping[str, str], identifier: str, name: str, pack: RulePack) -> None:
    """Add an endpoint and its participant."""
    owner = row["participant"]
    owned = settings_of(pack, row, owned=True)
    known = system.participants.setdefault(owner, Participant(owner, pack.id, {}))
    for key, text in owned.items():
        if (other := known.settings.setdefault(key, Setting(text)).text) != text:
            raise stated_twice(name, owner, key, other, text)
    system.endpoints.append(endpoint_of(pack, row, identifier, row["topic"], owner))
