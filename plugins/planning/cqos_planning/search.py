"""The smallest repair: solve, apply to the texts, check again, and refine until a check confirms the result."""

from __future__ import annotations

from dataclasses import field, replace
from itertools import product
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.analysis.plan import PlannedChange, RepairPlan, is_known, members_of
from cqos_core.files.edited_files import Edited, apply_edits
from cqos_core.language.solutions import restated
from cqos_core.matching.judge import ask
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InputError
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_planning.checked_system import CheckedSystem, checked
from cqos_planning.constraints import Constraint, Goals, ends_of
from cqos_planning.model import PINNED, GoalPart, Refusals, RepairModel, build, pin_of
from cqos_planning.plan_cost import priced
from cqos_planning.solver import conflict, solve
from cqos_planning.wording import ConflictWords, change_text, reason_of

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Group, Report
    from cqos_core.model.system import System
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_planning.solver import Solution, Task

_ROUNDS: Final = 200
"""So many plans are checked before C-QoS says that it found no repair that a check confirms."""


_MOST_CONFLICTS: Final = 20
"""Of so many parts of the goal that are given up, C-QoS says why."""
_ENOUGH: Final = "no requirement needs more"


def find_repair(
    sources: Mapping[str, bytes],
    read: Callable[[Mapping[str, bytes]], System],
    context: CheckContext,
    *,
    keep: Sequence[str] = (),
    decide: bool = False,
    importer: str | None = None,
) -> RepairPlan:
    """Find the changes of least weight after which no pair is incompatible and all requirements hold.

    Args:
        sources: the texts, by name.
        read: reads texts as one system.
        context: the packs, and what is assumed where the system says nothing.
        keep: shell patterns of endpoints, participants and files that stay as they are.
        decide: unknown pairs have to become compatible, too.
        importer: reads all texts, if given.

    Raises:
        CqosError: OR-tools is not installed, or found no answer in time.
    """
    before = checked(read(sources), context)
    goals = Goals(decide=decide, excused=accepted_of(before.report))
    active = [key for key in before.pipeline.topics if _is_broken(key, before, decide=decide)]
    return quietest(Search(sources, read, context, importer, before, goals, active, keep), everything=False)


def quietest(search: Search, *, everything: bool) -> RepairPlan:
    """Run a search; of plans with the same weight prefer one that brings no warning.

    Args:
        search: what to run.
        everything: the plan has all costs of its changes, not only what they multiply.
    """
    found = _quietest(search)
    after = search.after
    return found if after is None or not found.changes else priced(found, search.before, after, everything=everything)


def _quietest(search: Search) -> RepairPlan:
    found = search.run()
    if not found.brought or found.conflicts or not found.changes:
        return found
    goals = replace(search.goals, quiet=frozenset({"warning"}))
    other = replace(search, goals=goals, active=[*search.active], most=found.weight, partial=False)
    silent = other.run()
    if not silent.confirmed or silent.brought:
        return found
    search.after = other.after
    return silent


def accepted_of(report: Report) -> frozenset[tuple[str, str]]:
    """Return the codes of accepted findings with the endpoints that they name."""
    accepted = (each for each in report.findings if each.accepted is not None)
    return frozenset((each.code, member) for each in accepted for member in each.endpoints)


def _bad(report: Report, *, decide: bool) -> set[str]:
    """Return the topics with pairs that are not as they have to be."""
    worst = Verdict.COMPATIBLE if decide else Verdict.UNKNOWN
    return {group.topic for group in report.groups if group.verdict.rank > worst.rank}


def _is_broken(key: TopicKey, checked: CheckedSystem, *, decide: bool) -> bool:
    endpoints = checked.pipeline.topics[key]
    names = {each.shown for each in endpoints}
    ids = {each.id for each in endpoints}
    errors = (each for each in checked.report.findings if each.severity is Severity.ERROR and each.accepted is None)
    return not names.isdisjoint(_bad(checked.report, decide=decide)) or any(
        not ids.isdisjoint(each.endpoints) for each in errors
    )


@dataclass(slots=True)
class Search:
    """A search for changes of texts.

    Attributes:
        sources: the texts, by name.
        read: reads texts as one system.
        importer: reads all texts, if given.
        before: the system as it is.
        active: the topics in the model; those that a check finds in trouble are added.
        may: whether a policy of an endpoint may change, by its index.
        most: the greatest weight; None: any.
        partial: where not all can be reached, as much as possible is reached.
        after: the system with the confirmed changes.
    """

    sources: Mapping[str, bytes]
    read: Callable[[Mapping[str, bytes]], System]
    context: CheckContext
    importer: str | None
    before: CheckedSystem
    goals: Goals
    active: list[TopicKey]
    keep: Sequence[str] = ()
    may: Callable[[Resolved, int], bool] = lambda _endpoint, _index: True
    most: int | None = None
    partial: bool = True
    after: CheckedSystem | None = field(default=None, init=False)

    def run(self) -> RepairPlan:
        """Solve and check, until a check confirms a plan or none is left."""
        refusals, model, give_up = Refusals(), self._model(), False
        for tried in range(1, _ROUNDS + 1):
            task = model.task(refusals, self.most)
            found = solve(task, give_up=give_up)
            if found is None:
                if give_up or not self.partial:
                    break
                give_up = True
                continue
            changes = self._changes(model, found.chosen)
            edited = apply_edits(self.sources, (edit for each in changes for edit in each.edits), self.importer)
            after, objections = self._objections(edited, found, model)
            if after is not None and not objections:
                self.after = after
                return RepairPlan(
                    changes=changes,
                    weight=found.weight,
                    confirmed=bool(changes) or not found.given_up,
                    proven=found.proven,
                    conflicts=_conflicts(task, found, ConflictWords(model, refusals.words)),
                    tried=tried,
                    edited=edited,
                    before=self.before.report,
                    after=after.report,
                    cut=tuple(_cut(model)),
                )
            if self._widened(objections):
                refusals, model, give_up = Refusals(), self._model(), False
                continue
            for each in objections:
                name = (each.code, each.topic)
                refusals.words[name] = each.text
                refusals.cuts.append(
                    (name, {place: found.chosen.get(place, 0) for place in each.places or model.slots})
                )
                if each.stays:
                    refusals.open.add(name)
        nothing = Edited(dict(self.sources), {})
        return RepairPlan(
            changes=(),
            weight=0,
            confirmed=False,
            proven=False,
            conflicts=(),
            tried=tried,
            edited=nothing,
            before=self.before.report,
            after=self.before.report,
        )

    def _model(self) -> RepairModel:
        return build(self.before.pipeline.topics, self.active, self.goals, self.keep, self.may)

    def _widened(self, objections: Iterable[_Objection]) -> bool:
        """Take topics on which a check found something into the model; whether there is any that was not in it."""
        names = {each.topic for each in objections}
        keys = [
            key
            for key, endpoints in self.before.pipeline.topics.items()
            if key not in self.active and any(each.shown in names for each in endpoints)
        ]
        self.active += keys
        return bool(keys)

    def _changes(self, model: RepairModel, chosen: Mapping[Hashable, int]) -> tuple[PlannedChange, ...]:
        made = []
        reading = grouped((id(end), each) for each in model.constraints for _, end in ends_of(each))
        for place, number in chosen.items():
            slot, new = model.slots[place], model.slots[place].candidates[number]
            without = {other: at for other, at in chosen.items() if other != place}
            over = dict.fromkeys(each for end, _ in slot.readers for each in reading.get(id(end), ()))
            broken = dict.fromkeys(map(reason_of, _violated(model, without, over))) or (_ENOUGH,)
            members = tuple(sorted({each.id for end, _ in slot.readers for each in end.endpoints}))
            end, index = slot.readers[0]
            value = slot.policy.domain.format(new.value)  # type: ignore[arg-type]
            made.append(
                PlannedChange(
                    text=change_text(slot, value, members),
                    policy=slot.policy.name,
                    old=slot.policy.format(end.profile.values[index]),
                    new=value,
                    members=members,
                    weight=new.weight,
                    weakens=new.weakens,
                    kind=new.kind,
                    shared=slot.shared,
                    because=tuple(broken),
                    edits=new.edits,
                )
            )
        return tuple(sorted(made, key=lambda each: (each.members, each.policy)))

    def _objections(
        self, edited: Edited, found: Solution, model: RepairModel
    ) -> tuple[CheckedSystem | None, list[_Objection]]:
        """Read and check new texts; return the result, and what speaks against them."""
        if edited.left:
            edit, reason = edited.left[0]
            chosen = found.chosen
            places = {place for place in chosen if edit in model.slots[place].candidates[chosen[place]].edits}
            text = f"{edit.place} cannot be edited: {reason}"
            return None, [_Objection("edit", "", text, stays=False, places=frozenset(places))]
        try:
            after = checked(self.read({**self.sources, **edited.texts}), self.context)
        except InputError as error:
            return None, [_Objection("read", "", f"the changed texts cannot be read: {error}", stays=False)]
        given_up: frozenset[GoalPart] = found.given_up  # type: ignore[assignment]
        whole = any(each.any_change for by in model.loose.values() for each in by.values())
        faults: dict[tuple[str, str], _Objection] = {}
        for each in self._faults(after, _GivenUp(given_up)):
            known = faults.get((each.code, each.topic), each)
            # Of a topic on which pairs stay and others are worse, the worse ones count.
            worse = each if known.stays else known
            faults[each.code, each.topic] = worse._replace(
                places=frozenset(() if whole else model.topics.get(each.topic, ()))
            )
        return after, [*faults.values()]

    def _faults(self, after: CheckedSystem, given_up: _GivenUp) -> Iterable[_Objection]:
        """Yield what is not as it has to be."""
        before, report = self.before.report, after.report
        ranks = {
            (p, s, each.topic): each.verdict.rank
            for each in before.groups
            for p in each.publishers
            for s in each.subscribers
        }
        names = {each.shown for key in self.active for each in self.before.pipeline.topics[key]}
        allowed = Verdict.COMPATIBLE if self.goals.decide else Verdict.UNKNOWN
        findings = grouped((topic, each) for each in report.findings for topic in (each.topic, *each.more_topics))
        for group in report.groups:
            rank, topic = group.verdict.rank, group.topic
            if not rank or any(
                (code, each) in self.goals.excused for code in group.codes for each in group.subscribers
            ):
                continue
            for p, s in product(group.publishers, group.subscribers):
                was = ranks.get((p, s, topic), 0)
                limit = min(was, allowed.rank) if topic in names and not given_up.has(topic, p, s) else was
                if rank > limit:
                    code, text = _cause(group, p, s, findings.get(topic, ()))
                    yield _Objection(code, topic, text, stays=rank <= was)
                    break
        known = {(each.code, member) for each in before.findings for member in members_of(each)}
        for each in report.findings:
            loud = each.severity.value in self.goals.heard and each.accepted is None
            if loud and not is_known(each, known) and not given_up.covers(each):
                yield _Objection(each.code, each.topic or "", f"{each.code}: {each.message}", stays=False)
        if self.keep and _kept(after, self.keep) != _kept(self.before, self.keep):
            text = f"the change reaches endpoints that --keep {' --keep '.join(self.keep)} names"
            yield _Objection(PINNED, "", text, stays=False)


class _Objection(NamedTuple):
    """What a check has against a plan.

    Attributes:
        stays: a pair is not better than before, and not worse.
        places: where another choice may help; all if empty.
    """

    code: str
    topic: str
    text: str
    stays: bool
    places: frozenset[Hashable] = frozenset()


class _GivenUp:
    """The pairs that a plan leaves as they are."""

    def __init__(self, units: Iterable[GoalPart]) -> None:
        """Take the parts of the goal that are given up; see `unit_of`."""
        self._topics: set[str] = set()
        self._ends: set[tuple[str, str]] = set()
        self._pairs: set[tuple[str, str, str]] = set()
        for topic, first, second in units:
            if first is None or second is None:
                self._topics.add(topic)
            elif first is second:
                self._ends.update((topic, each.id) for each in first.endpoints)
            else:
                self._pairs.update((topic, p.id, s.id) for p in first.endpoints for s in second.endpoints)

    def covers(self, finding: Finding) -> bool:
        """Whether a finding is about nothing but these pairs."""
        offering, requesting = (
            [member for side in finding.sides if side.role == role for member in side.members]
            for role in (PUBLISHER, SUBSCRIBER)
        )
        pairs = [*product(offering, requesting)]
        return bool(pairs) and all(self.has(finding.topic or "", p, s) for p, s in pairs)

    def has(self, topic: str, publisher: str, subscriber: str) -> bool:
        """Whether a pair is among them."""
        return (
            topic in self._topics
            or (topic, publisher, subscriber) in self._pairs
            or not self._ends.isdisjoint(((topic, publisher), (topic, subscriber)))
        )


def _cut(model: RepairModel) -> Iterator[str]:
    """Yield, in words, each policy that has more values than were tried."""
    for (topic, policy), (tried, count) in sorted(model.cut.items()):
        yield f"{policy} on `{topic}`: {tried} of {count} values were tried, those nearest to what is stated"


def _conflicts(task: Task, solution: Solution, words: ConflictWords) -> tuple[tuple[str, ...], ...]:
    """Return what keeps each part of the goal that was given up, in words; equal conflicts once."""
    found: dict[frozenset[Hashable], tuple[str, ...]] = {}
    # What is asked of one end alone comes first: its pairs follow from it.
    given_up: Iterable[GoalPart] = solution.given_up  # type: ignore[assignment]
    units = sorted(given_up, key=lambda unit: (unit.first is not unit.second, unit.topic))
    for unit in units[:_MOST_CONFLICTS]:
        names = conflict(task, solution.given_up - {unit})
        if names:
            found.setdefault(frozenset(names), tuple(words.of(name) for name in names))
    return tuple(found.values())


def _cause(group: Group, publisher: str, subscriber: str, findings: Iterable[Finding]) -> tuple[str, str]:
    """Return the code and the words of what makes a pair of a group what it is, also of a fact that is not stated."""
    for each in findings:
        if each.verdict is group.verdict and {publisher, subscriber} <= {*each.endpoints}:
            return each.code, f"{each.code}: {each.message}{f' ({each.help})' if each.help else ''}"
    code, text = next(iter(group.codes), ""), f"`{publisher}` and `{subscriber}` on `{group.topic}` are {group.verdict}"
    return code, f"{code}: {text}" if code else text


def _kept(checked: CheckedSystem, keep: Sequence[str]) -> dict[str, object]:
    return {each.id: each.profile for each in checked.pipeline.endpoints if pin_of(each, keep)}


def _violated(
    model: RepairModel, chosen: Mapping[Hashable, int], constraints: Iterable[Constraint]
) -> Iterable[Constraint]:
    """Yield the constraints that some choices leave open or violate."""
    for each in constraints:
        answer = _answer(model, each, chosen)
        if answer is not each.wanted.answer and not (answer is None and each.wanted.lenient):
            yield each


def _answer(model: RepairModel, constraint: Constraint, chosen: Mapping[Hashable, int]) -> bool | None:
    """Return what the rule of a constraint answers after choices."""
    sides = []
    for end, values in zip((constraint.first, constraint.second), constraint.values, strict=True):
        every = [*values]
        for index in model.variables.get(end, {}):
            value = model.value(end, index, chosen)
            if value is not None:
                for at, each in restated(values, end.profile.pack.vocabulary, index, value).items():
                    every[at] = each
        sides.append(tuple(every))
    violation = ask(constraint.bound, sides[0], sides[1])
    silent = constraint.wanted.answer
    return silent if violation is None else violation.outcome.result
