"""The smallest repair: solve, apply to the texts, check again, and refine until a check confirms the result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.analysis.planning.constraints import Constraint, Goals, ends_of
from cqos_core.analysis.planning.model import PINNED, RepairModel, build, pin_of
from cqos_core.analysis.planning.slots import changeable
from cqos_core.analysis.planning.solver import conflict, solve
from cqos_core.checking.checker import check_system
from cqos_core.checking.fixes import remedy_text
from cqos_core.files.applying import Edited, apply_edits
from cqos_core.language.policy import BROKER, TOPIC
from cqos_core.language.solve import restated
from cqos_core.matching.judge import ask
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InputError
from cqos_core.model.remarks import plural
from cqos_core.model.report import Severity, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

    from cqos_core.analysis.planning.slots import Slot
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.matching.pipeline import Context
    from cqos_core.model.report import Edit, Finding, Report
    from cqos_core.model.system import Role, System
    from cqos_core.resolving.resolved import Resolved

_ROUNDS: Final = 200
"""So many plans are checked before C-QoS says that it found no repair that a check confirms."""


_ENOUGH: Final = "no requirement needs more"


@dataclass(frozen=True, slots=True)
class PlannedChange:
    """One change of a plan.

    Attributes:
        text: the change in words.
        members: the endpoints whose value it changes.
        old, new: the values as text.
        weakens: it promises or demands less than before.
        kind: ``configuration``, or ``needs_code`` where the program must keep a stronger promise.
        shared: the place that changes is shared by several endpoints.
        because: the rules that report without this change, each with its code and reason.
        edits: the change as new texts.
    """

    text: str
    policy: str
    old: str
    new: str
    members: tuple[str, ...]
    weight: int
    weakens: bool
    kind: str
    shared: bool
    because: tuple[str, ...]
    edits: tuple[Edit, ...]


@dataclass(frozen=True, slots=True)
class RepairPlan:
    """What came of a search for changes.

    Attributes:
        changes: none where nothing has to change, or nothing can.
        weight: of all changes.
        confirmed: a check of the changed texts shows that the goal is reached.
        proven: no other changes have less weight.
        conflict: where no changes reach the goal, what excludes each other; none of it can be left out.
        tried: how many plans were checked.
        edited: the texts.
        before, after: reports of the texts.
        costs: what is known of the cost of the changes.
    """

    changes: tuple[PlannedChange, ...]
    weight: int
    confirmed: bool
    proven: bool
    conflict: tuple[str, ...]
    tried: int
    edited: Edited
    before: Report
    after: Report
    costs: tuple[str, ...] = ()

    @property
    def left(self) -> tuple[Finding, ...]:
        """The errors that are still there, which no change of settings was looked for."""
        return tuple(each for each in self.after.findings if each.severity is Severity.ERROR and each.accepted is None)


class CheckedSystem(NamedTuple):
    """A system with its report and its endpoints by topic."""

    pipeline: Pipeline
    report: Report


def find_repair(
    sources: Mapping[str, bytes],
    read: Callable[[Mapping[str, bytes]], System],
    context: Context,
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
    return Search(sources, read, context, importer, before, goals, active, keep).run()


def checked(system: System, context: Context) -> CheckedSystem:
    """Check a system."""
    return CheckedSystem(Pipeline(system, context), check_system(system, context))


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
    """

    sources: Mapping[str, bytes]
    read: Callable[[Mapping[str, bytes]], System]
    context: Context
    importer: str | None
    before: CheckedSystem
    goals: Goals
    active: list[TopicKey]
    keep: Sequence[str] = ()
    may: Callable[[Resolved, int], bool] = lambda _endpoint, _index: True

    def run(self) -> RepairPlan:
        """Solve and check, until a check confirms a plan or none is left."""
        cuts: list[tuple[Hashable, Mapping[Hashable, int]]] = []
        refused: dict[Hashable, str] = {}
        model = self._model()
        for tried in range(1, _ROUNDS + 1):
            task = model.task(cuts)
            found = solve(task)
            if found is None:
                words = _ConflictWords(model, refused)
                return self._plan((), 0, tried - 1, conflict=tuple(words.of(name) for name in conflict(task)))
            changes = self._changes(model, found.chosen)
            edited = self._applied(changes)
            after, objections = self._objections(edited, found.chosen, model)
            if after is not None and not objections:
                return self._plan(changes, found.weight, tried, edited, after, proven=found.proven)
            if self._widened(objections):
                model, cuts = self._model(), []
                continue
            for name, text, places in objections:
                refused[name] = text
                cuts.append((name, {place: found.chosen.get(place, 0) for place in places or model.slots}))
        return self._plan((), 0, _ROUNDS)

    def _model(self) -> RepairModel:
        return build(self.before.pipeline.topics, self.active, self.goals, self.keep, self.may)

    def _plan(
        self,
        changes: tuple[PlannedChange, ...],
        weight: int,
        tried: int,
        edited: Edited | None = None,
        after: Report | None = None,
        *,
        proven: bool = False,
        conflict: tuple[str, ...] = (),
    ) -> RepairPlan:
        confirmed = after is not None
        nothing = Edited(dict(self.sources), {})
        before = self.before.report
        return RepairPlan(
            changes,
            weight,
            confirmed,
            proven,
            conflict,
            tried,
            edited or nothing,
            before,
            before if after is None else after,
        )

    def _applied(self, changes: Sequence[PlannedChange]) -> Edited:
        return apply_edits(self.sources, (edit for each in changes for edit in each.edits), self.importer)

    def _widened(self, objections: Iterable[tuple[Hashable, str, object]]) -> bool:
        """Take topics on which a check found something into the model; whether there is any that was not in it."""
        names = {name[1] for name, _, _ in objections if isinstance(name, tuple)}
        keys = [
            key
            for key, endpoints in self.before.pipeline.topics.items()
            if key not in self.active and any(each.shown in names for each in endpoints)
        ]
        self.active += keys
        return bool(keys)

    def _changes(self, model: RepairModel, chosen: Mapping[Hashable, int]) -> tuple[PlannedChange, ...]:
        made = []
        for place, number in chosen.items():
            slot, new = model.slots[place], model.slots[place].candidates[number]
            without = {other: at for other, at in chosen.items() if other != place}
            broken = dict.fromkeys(_reason(each) for each in _violated(model, without, slot)) or (_ENOUGH,)
            members = tuple(sorted({each.id for end, _ in slot.readers for each in end.endpoints}))
            end, index = slot.readers[0]
            value = slot.policy.domain.format(new.value)  # type: ignore[arg-type]
            made.append(
                PlannedChange(
                    text=_text(slot, value, members),
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
        self, edited: Edited, chosen: Mapping[Hashable, int], model: RepairModel
    ) -> tuple[Report | None, list[tuple[Hashable, str, set[Hashable]]]]:
        """Read and check new texts; return the report, and what speaks against them: a name, words, and the places in question."""
        if edited.left:
            edit, reason = edited.left[0]
            places = {place for place in chosen if edit in model.slots[place].candidates[chosen[place]].edits}
            return None, [(("edit", "", str(edit.place)), f"{edit.place} cannot be edited: {reason}", places)]
        try:
            after = checked(self.read({**self.sources, **edited.texts}), self.context)
        except InputError as error:
            return None, [(("read", ""), f"the changed texts cannot be read: {error}", set())]
        found: dict[Hashable, tuple[str, set[Hashable]]] = {}
        for code, topic, text in self._faults(after):
            whole = any(each.any_change for by in model.loose.values() for each in by.values())
            found[code, topic] = (text, set() if whole else model.topics.get(topic, set()))
        return after.report, [(name, *rest) for name, rest in found.items()]

    def _faults(self, after: CheckedSystem) -> Iterable[tuple[str, str, str]]:
        """Yield what is not as it has to be: code, topic and words."""
        before, report = self.before.report, after.report
        ranks = {
            (p, s, each.topic): each.verdict.rank
            for each in before.groups
            for p in each.publishers
            for s in each.subscribers
        }
        names = {each.shown for key in self.active for each in self.before.pipeline.topics[key]}
        allowed = Verdict.COMPATIBLE if self.goals.decide else Verdict.UNKNOWN
        for group in report.groups:
            was = max(ranks.get((p, s, group.topic), 0) for p in group.publishers for s in group.subscribers)
            limit = min(was, allowed.rank) if group.topic in names else was
            accepted = any((code, each) in self.goals.excused for code in group.codes for each in group.subscribers)
            if group.verdict.rank > limit and not accepted:
                code, ends = next(iter(group.codes), ""), f"`{group.publishers[0]}` and `{group.subscribers[0]}`"
                yield code, group.topic, f"{code}: {ends} on `{group.topic}` are {group.verdict}"
        known = {(each.code, member) for each in before.findings for member in _members(each)}
        for each in report.findings:
            loud = each.severity.value in self.goals.severities and each.accepted is None
            if loud and not known.issuperset((each.code, member) for member in _members(each)):
                yield each.code, each.topic or "", f"{each.code}: {each.message}"
        if self.keep and _kept(after, self.keep) != _kept(self.before, self.keep):
            yield PINNED, "", f"the change reaches endpoints that --keep {' --keep '.join(self.keep)} names"


def _members(finding: Finding) -> list[str]:
    return [member for side in finding.sides for member in side.members]


def _kept(checked: CheckedSystem, keep: Sequence[str]) -> dict[str, object]:
    return {each.id: each.profile for each in checked.pipeline.endpoints if pin_of(each, keep)}


def _violated(model: RepairModel, chosen: Mapping[Hashable, int], slot: Slot) -> Iterable[Constraint]:
    """Yield the constraints over readers of a slot that some choices leave open or violate."""
    readers = {id(end) for end, _ in slot.readers}
    for each in model.constraints:
        if readers.isdisjoint(id(end) for _, end in ends_of(each)):
            continue
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
    spoken = ask(constraint.bound, sides[0], sides[1])
    silent = constraint.wanted.answer
    return silent if spoken is None else spoken.outcome.result


def _reason(constraint: Constraint) -> str:
    return f"{constraint.bound.rule.code}: {constraint.bound.rule.because}"


def _text(slot: Slot, value: str, members: tuple[str, ...]) -> str:
    role: Role = slot.role  # type: ignore[assignment]
    level, shared = slot.policy.level, ""
    first = slot.endpoints[0]
    if level == BROKER and first.participant.broker is not None:
        shared = f"of broker {first.participant.broker.id}"
    elif level == TOPIC:
        shared = f"of topic {first.shown}"
    elif slot.shared and level == "endpoint":
        more = f" and {plural(len(members) - 1, 'other endpoint')}" if len(members) > 1 else ""
        shared = f"in what {members[0]}{more} share" if more else f"in the profile of {members[0]}"
    return remedy_text(role, slot.policy.name, value, members, level, shared)


@dataclass(frozen=True, slots=True)
class _ConflictWords:
    """Puts the parts of a conflicting set into words."""

    model: RepairModel
    refused: Mapping[Hashable, str]

    def of(self, name: Hashable) -> str:
        """Return one part in words."""
        if isinstance(name, tuple) and name[0] == PINNED:
            return f"`--keep {name[1]}` keeps {name[2]} of `{name[3]}` as it is"
        if name in self.refused:
            return self.refused[name]
        constraint = next(each for each in self.model.constraints if each.label == name)
        rule, (first, second) = constraint.bound.rule, (constraint.first, constraint.second)
        ends = (
            f"`{second.first.id}`" if first is second else f"`{second.first.id}` and its publisher `{first.first.id}`"
        )
        required = f" (needs {rule.guarantee})" if rule.guarantee else ""
        fixed = dict.fromkeys(
            f"{use.term.name} of `{end.first.id}`"
            for end, use in changeable(constraint)
            if use.index not in self.model.variables.get(end, {})
        )
        where = f"; no file has a place to change {', '.join(fixed)}" if fixed else ""
        text = f"{rule.code}{required}: {ends} on `{constraint.topic}`: {rule.because}{where}"
        return f"{text} ({rule.help})" if rule.help else text
