"""All findings of a system that is being edited: an edit changes those that its topics have to do with.

What several topics, participants or instances share is kept by what makes it one finding.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from datetime import date
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from cqos_core.checking.acceptance import Accepting, with_severities
from cqos_core.checking.alone import Alone
from cqos_core.checking.beyond import Beyond
from cqos_core.checking.checker import alike_of_instances, collapses, nothing_compared, with_instances
from cqos_core.checking.findings import Made, by_endpoints, cause_of, merged, one_per_cause
from cqos_core.checking.stages import Item, Stage
from cqos_core.model.changes import Counts
from cqos_core.model.dataclass import dataclass
from cqos_core.resolving.left_over import of_one_cause

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

    from cqos_core.checking.topic import TopicResult
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.matching.pipeline import Context
    from cqos_core.model.report import Finding, Group
    from cqos_core.model.system import System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved import Resolved

Remark = tuple["tuple[object, ...] | None", "Finding"]
"""A finding about what an endpoint states, with the cause that it may share with others."""
REMARK = "remark"
Numbered = tuple[tuple[int, int], "Resolved"]
"""An endpoint, with its place among all."""
_STATED, _COLLAPSED, _NOTHING, _SAID = 0, 3, 5, 6


@dataclass(frozen=True, slots=True)
class Step:
    """What an edit does to what is judged: topics with their former and new result, endpoints and remarks that go and that come."""

    topics: Mapping[TopicKey, tuple[TopicResult | None, TopicResult | None]]
    gone: Sequence[Numbered]
    came: Sequence[Numbered]
    unsaid: Sequence[Item] = ()
    said: Sequence[Item] = ()


class KnownFindings:
    """The findings and groups of a system in which no endpoint meets others beyond its own topic."""

    def __init__(
        self,
        system: System,
        context: Context,
        packs: Mapping[str, RulePack],
        results: Mapping[TopicKey, TopicResult],
        kind_of: Callable[[str], str],
    ) -> None:
        """Begin with no endpoint.

        Args:
            system: read for everything but its endpoints.
            context: the packs.
            packs: those in use.
            results: of the topics as they are at any time.
            kind_of: tells the kind of a stated endpoint by its id.
        """
        self._system, self._find_rule = system, context.find_rule
        today = date.today()  # noqa: DTZ011 - a calendar day, where the user is
        self._accepting = Accepting(system.accept, context.find_rule, today)
        self._used = Counter[int]()
        self._templates: dict[str, str] = {}
        self._of = {each.id: each.template for each in system.participants.values() if each.template is not None}
        self._alone = Alone(packs, results, kind_of, partial=system.partial)
        self._beyond = Beyond()
        self._of_topics: dict[TopicKey, list[Item]] = {}
        self._by_key = Stage(_merge_key, self._merged)
        self._by_cause = Stage(_cause, self._of_one_cause)
        self._by_instances = Stage(_instances, _once)
        self._unused: list[Item] = []
        self._nothing: list[Item] = []
        self._endpoints = self._external = 0
        self._pairs = Counter[Any]()
        self._topics = 0
        self._severities = Counter[Any]()

    @property
    def all(self) -> list[Finding]:
        """All of them, in no order."""
        return [item.made.finding for item in self._by_instances]

    @property
    def counts(self) -> Counts:
        """How much there is of everything."""
        unmatched = self._alone.count if self._system.partial else 0
        return Counts(self._endpoints, self._topics, unmatched, +self._pairs, +self._severities)

    def change(self, step: Step) -> tuple[list[Finding], list[Finding], list[Group], list[Group]]:
        """Follow an edit; return findings that go and that come, and groups that go and that come."""
        for numbered, sign in ((step.gone, -1), (step.came, 1)):
            for _, endpoint in numbered:
                self._count(endpoint, sign)
        gone, came = [*step.unsaid], [*step.said]
        old_groups: list[Group] = []
        new_groups: list[Group] = []
        for key, (before, now) in step.topics.items():
            old, new = self._of_topics.pop(key, []), _items_of(key, now)
            if not self._templates:  # what others share and what stays as it was is not put together anew
                known = {each.order: each for each in old}
                new = [
                    known[each.order] if each.order in known and _same(each, known[each.order]) else each
                    for each in new
                ]
            if new:
                self._of_topics[key] = new
            kept = {*old} & {*new}
            gone += [each for each in old if each not in kept]
            came += [each for each in new if each not in kept]
            old_groups += before.groups if before else ()
            new_groups += now.groups if now else ()
            self._topics += (now is not None) - (before is not None)
        for groups, sign in ((old_groups, -1), (new_groups, 1)):
            for group in groups:
                self._pairs[group.verdict] += sign * group.pairs
        gone_findings, new_findings = self._pass(gone, came, step)
        return gone_findings, new_findings, old_groups, new_groups

    def _count(self, endpoint: Resolved, sign: int) -> None:
        stated = endpoint.endpoint
        self._endpoints += sign
        self._external += sign * endpoint.external
        if stated.template is not None and sign > 0:
            self._templates[endpoint.id] = stated.template
        elif stated.template is not None:
            self._templates.pop(endpoint.id, None)

    def _pass(
        self, gone: list[Item], came: list[Item], step: Step | None = None
    ) -> tuple[list[Finding], list[Finding]]:
        """Let findings of topics go and come, with those that follow from all of a step."""
        if step is not None:
            for old, new in (
                self._alone.change(step.topics),
                self._beyond.change(step.gone, step.came),
                self._compare(),
            ):
                gone, came = [*gone, *old], [*came, *new]
        old, new = self._by_key.change(gone, came)
        unused, excusing = self._excuse(old, new)
        old, new = self._by_cause.change([*old, *unused], [*new, *excusing])
        old, new = self._by_instances.change(old, new)
        for items, sign in ((old, -1), (new, 1)):
            for item in items:
                if item.made.finding.accepted is None:
                    self._severities[item.made.finding.severity] += sign
        return [item.made.finding for item in old], [item.made.finding for item in new]

    def _compare(self) -> tuple[list[Item], list[Item]]:
        """Report that nothing was compared."""
        old = self._nothing
        self._nothing = []
        if not any(self._pairs.values()):
            finding = nothing_compared(self._system, self._endpoints, self._external)
            self._nothing = [_plain((1, _NOTHING), finding)]
        return old, self._nothing

    def _excuse(self, gone: Iterable[Item], came: Iterable[Item]) -> tuple[list[Item], list[Item]]:
        """Report acceptances that excuse nothing."""
        if not self._system.accept:
            return [], []
        for items, sign in ((gone, -1), (came, 1)):
            for item in items:
                self._used.update(dict.fromkeys(item.excuses, sign))
        old = self._unused
        said = [Made(each, (), frozenset()) for each in self._accepting.said({*+self._used})]
        made = with_severities(said, self._system.severities, self._find_rule)
        self._unused = [Item((2, at), one) for at, one in enumerate(made)]
        return old, self._unused

    def _merged(self, items: Sequence[Item]) -> list[Item]:
        """What topics share, with the severity that is asked for, accepted or not."""
        first = items[0].made
        together = of_one_cause if first.merge_key[0] == REMARK else merged
        whole = first if len(items) == 1 else replace(first, finding=together([each.made.finding for each in items]))
        found = with_severities([whole], self._system.severities, self._find_rule)
        return [Item(items[0].order, *self._accepting.marked(one)) for one in found]

    def _of_one_cause(self, items: Sequence[Item]) -> list[Item]:
        """What one missing fact leaves open, with what its members are instances of."""
        found = []
        for position, one in enumerate(one_per_cause([each.made for each in items])):
            finding = one.finding
            members = (
                {member for side in finding.sides for member in side.members} if self._templates or self._of else ()
            )
            of = {name: memory[name] for memory in (self._of, self._templates) for name in members if name in memory}
            whole = replace(one, finding=with_instances(finding, of)) if of else one
            found.append(Item((*by_endpoints(one), items[0].order, position), whole))
        return found


def _plain(order: tuple[Any, ...], finding: Finding) -> Item:
    return Item(order, Made(finding, ("own",), frozenset()))


def plain_items(findings: Sequence[Finding]) -> list[Item]:
    """Findings that no edit of an endpoint changes."""
    return [_plain((1, _STATED, at), finding) for at, finding in enumerate(findings)]


def joined(remarks: Sequence[Item]) -> list[Finding]:
    """Put remarks of one cause together, as a check reports them."""
    found: dict[Hashable, list[Finding]] = {}
    for item in sorted(remarks, key=attrgetter("order")):
        found.setdefault(_merge_key(item), []).append(item.made.finding)
    return [same[0] if len(same) == 1 else of_one_cause(same) for same in found.values()]


def remarks_of(number: int, said: Iterable[Remark]) -> list[Item]:
    """Remarks about an endpoint, which has a place among all."""
    return [
        Item((1, _SAID, number, at), Made(finding, ("own",) if cause is None else (REMARK, cause), frozenset()))
        for at, (cause, finding) in enumerate(said)
    ]


def _items_of(key: TopicKey, result: TopicResult | None) -> list[Item]:
    """The findings of one topic."""
    if result is None:
        return []
    own = [endpoint for endpoint in result.topic.endpoints if not endpoint.is_copy]
    return [
        *(Item((0, key, position), one) for position, one in enumerate(result.made)),
        *(_plain((1, _COLLAPSED, key), finding) for finding in collapses(own)),
    ]


def _merge_key(item: Item) -> Hashable:
    return item.order if item.made.merge_key[0] == "own" else item.made.merge_key


def _cause(item: Item) -> Hashable:
    return cause_of(item.made) if item.made.cause else item.order


def _instances(item: Item) -> Hashable:
    return alike_of_instances(item.made.finding) or item.order


def _once(items: Sequence[Item]) -> Sequence[Item]:
    """What is reported alike of the topics of instances."""
    if len(items) == 1:
        return items
    whole = merged([each.made.finding for each in items])
    return [Item(items[0].order, replace(items[0].made, finding=whole))]


def _same(one: Item, other: Item) -> bool:
    """Whether two findings mean the same to what they are put together with."""
    made, known = one.made, other.made
    return made.merge_key == known.merge_key != ("own",) and made == known
