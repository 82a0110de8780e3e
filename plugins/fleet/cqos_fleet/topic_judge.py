"""Judges each distinct topic once with all that match there, subscribers of other topics among them.

Beside profiles, a check reads of a topic which endpoints have one participant. That counts where values name the participant, or where
several subscribers of it are there. Only such owners are looked at one by one.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.policy import ENDPOINT
from cqos_core.model.caches import keep
from cqos_core.model.system import PUBLISHER
from cqos_fleet.clients import NAME
from cqos_fleet.filter_matches import by_topic
from cqos_fleet.representatives import StandIns
from cqos_fleet.similar_names import BUSY, OFFERED, REQUESTED
from cqos_fleet.topic_frames import FINDING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_fleet.clients import Clients
    from cqos_fleet.filter_matches import FilterMatches
    from cqos_fleet.filter_subscribers import FarEnds, Visitors
    from cqos_fleet.table_store import Spool

ALONE: Final = {
    "system": "text",
    "topic": "text",
    "p": "number",
    "publishers": "number",
    "subscribers": "number",
    "first": "number",
    "last": "number",
}
"""The columns of endpoints without partners; `first` and `last` are the least and the largest number of their owners."""
_REMEMBERED: Final = 50_000


class End(NamedTuple):
    """Endpoints of one topic that are alike.

    Attributes:
        p: the number of the end.
        visiting: they hear the topic beside their own.
        overlapping: another subscriber of their participant is there, too.
        owner: a number where others of their participant are there, and count; else -1.
    """

    p: int
    visiting: bool = False
    overlapping: bool = False
    owner: int = -1


_Shape = tuple[tuple[End, int], ...]


class Outcome(NamedTuple):
    """What a check says of a topic.

    Attributes:
        verdicts: pairs by verdict.
        rows: its findings, without topic and system.
        met: positions of the visitors that form a pair.
        sides: see `cqos_fleet.similar_names`; 0: publishers have subscribers, and form no pair.
    """

    verdicts: Mapping[str, int]
    rows: Sequence[Mapping[str, Any]]
    met: Sequence[int]
    sides: int


def write_finding(out: Spool, system: str, topic: str, row: Mapping[str, Any]) -> None:
    """Write a finding of a topic to a table with the columns `FINDING`; what it does not state is about no end, and has no words."""
    out.add(*[{**_UNSTATED, **row, "system": system, "topic": topic}[each] for each in FINDING])


_UNSTATED: Final = {
    "protocol": "",
    "verdict": "",
    "help": "",
    "publisher": -1,
    "subscriber": -1,
    "publishers": 0,
    "subscribers": 0,
    "pairs": 0,
}


@dataclass(slots=True)
class Meetings:
    """Judges the topics of a fleet.

    Attributes:
        found: table of findings.
        alone: table with the columns `ALONE`.
        names: table with the columns `cqos_fleet.similar_names.NAMED`.
        totals: numbers of endpoints and topics, and of pairs by verdict.
    """

    clients: Clients
    hearing: FilterMatches
    far: FarEnds
    found: Spool
    alone: Spool
    names: Spool
    totals: Counter[str] = field(default_factory=Counter)
    _outcomes: dict[_Shape, Outcome] = field(default_factory=dict)
    _topics: dict[tuple[Any, ...], Outcome] = field(default_factory=dict)

    def judge(self, groups: Iterable[tuple[Any, ...]]) -> None:
        """Judge topics.

        Args:
            groups: of endpoints, in order of system and topic: these, end, own, number, the set of far topics that match, and the first and
                last owner.
        """
        for (system, topic), rows in by_topic(groups):
            met = rows[0][3]
            if all(own < 0 for _, own, *_ in rows):
                shape = (*[(p, number) for p, _, number, *_ in rows], met)
                outcome = self._topics.get(shape) or keep(self._topics, shape, self._plainly(rows, met), _REMEMBERED)
            else:
                outcome = self._with_owners(rows, met)
            self.totals["endpoints"] += sum([row[2] for row in rows])
            self._write(system, topic, outcome)
            if outcome.sides in {OFFERED, REQUESTED}:
                for p, _, number, _, first, last in rows:
                    self._write_alone(system, topic, p, number, first, last)

    def judge_far(self) -> None:
        """Judge the topics of visitors at home, where none of them has a partner; after all others."""
        for (system, topic), number in self.hearing.far.items():
            groups = self.far.groups(number)
            outcome = self._outcome({End(p): count for p, count in groups.items()})[0]
            left = [at for at in self.far.positions(number) if not self.far.met[at]]
            owners = [self.far.owner[at] for at in left]
            self.totals["endpoints"] += sum(groups.values())
            self._write(system, topic, outcome._replace(sides=REQUESTED), alone=bool(left))
            for p, count in sorted(Counter(self.far.p[at] for at in left).items()):
                self._write_alone(system, topic, p, count, min(owners), max(owners))

    def _write(self, system: str, topic: str, outcome: Outcome, *, alone: bool = True) -> None:
        self.totals["topics"] += alone
        for verdict, pairs in outcome.verdicts.items():
            self.totals[verdict] += pairs
        for row in outcome.rows:
            write_finding(self.found, system, topic, row)
        if outcome.sides and alone:
            self.names.add(system, topic, outcome.sides)

    def _write_alone(self, system: str, topic: str, p: int, number: int, first: int, last: int) -> None:
        offers = self.clients.known[p].resolved.role == PUBLISHER
        self.alone.add(system, topic, p, number * offers, number * (not offers), first, last)

    def _plainly(self, rows: Sequence[tuple[Any, ...]], met: int) -> Outcome:
        """Judge a topic on which no owner counts but among its visitors."""
        visitors = self._visitors(met).groups
        groups = Counter[End]()
        for p, _, number, *_ in rows:
            groups[End(p)] += number
        for (_, p, overlapping), number in visitors.items():
            groups[End(p, True, overlapping)] += number
        outcome, order = self._outcome(groups)
        self._note(outcome, order, visitors, met, frozenset())
        return outcome

    def _visitors(self, met: int) -> Visitors:
        """Return the subscribers of a set of far topics."""
        return self.far.visitors(met, self.hearing.met[met])

    def _with_owners(self, rows: Sequence[tuple[Any, ...]], met: int) -> Outcome:
        """Judge a topic on which it counts whose its endpoints are."""
        known, topics = self.clients.known, self.hearing.met[met]
        visitors, overlapping = self._visitors(met)
        visitors = Counter(visitors)
        groups = Counter[End]()
        owned: dict[int, list[tuple[int, int]]] = {}
        for p, own, number, *_ in rows:
            if own < 0:
                groups[End(p)] += number
            else:
                owned.setdefault(own, []).append((p, number))
        taken: list[tuple[int, int, int, End]] = []
        parts: list[tuple[tuple[End, int], ...]] = []
        for owner, ends in owned.items():
            elsewhere = [*self.far.of(owner, topics)] if visitors else []
            offers = [known[p].resolved.role == PUBLISHER for p, _ in ends]
            several = bool(elsewhere) and not all(offers)
            names = any(known[p].own for p, _ in ends) and any(offers) and (bool(elsewhere) or not all(offers))
            found = Counter[End]()
            for (p, number), publishes in zip(ends, offers, strict=True):
                found[End(p, False, several and not publishes, 0 if names and known[p].own else -1)] += number
            for far, at in elsewhere if several or names else ():
                p = self.far.p[at]
                before = owner in overlapping
                visitors[far, p, before] -= 1
                end = End(p, True, before or several, 0 if names and known[p].own else -1)
                found[end] += 1
                taken.append((far, at, len(parts), end))
            parts.append(tuple(sorted(found.items())))
        order = sorted(range(len(parts)), key=parts.__getitem__)
        numbers = {at: number for number, at in enumerate(order)}
        for at, part in enumerate(parts):
            for end, number in part:
                groups[end._replace(owner=numbers[at]) if end.owner >= 0 else end] += number
        for (_, p, several), number in (+visitors).items():
            groups[End(p, True, several)] += number
        outcome, listed = self._outcome(groups)
        self._note(outcome, listed, +visitors, met, frozenset(owned))
        for far, at, of_part, end in taken:
            whole = end._replace(owner=numbers[of_part]) if end.owner >= 0 else end
            if listed.index(whole) in outcome.met:
                self.far.pair_one(far, at)
        return outcome

    def _note(
        self,
        outcome: Outcome,
        listed: Sequence[End],
        visitors: Mapping[tuple[int, int, bool], int],
        met: int,
        without: frozenset[int],
    ) -> None:
        """Note which visitors have a partner, but for those of some owners."""
        partners = {listed[at] for at in outcome.met}
        overlapping = self._visitors(met).overlapping
        for far, p, several in visitors:
            if End(p, True, several) in partners:
                wanted = overlapping - without if several else overlapping | without
                self.far.pair(far, p, lambda owner, some=wanted, among=several: (owner in some) is among)  # type: ignore[misc]

    def _outcome(self, groups: Mapping[End, int]) -> tuple[Outcome, Sequence[End]]:
        """Judge groups of endpoints; return also their order."""
        listed = sorted(groups)
        shape = tuple([(end, groups[end]) for end in listed])
        outcome = self._outcomes.get(shape)
        if outcome is None:
            outcome = keep(self._outcomes, shape, self._judged(shape), _REMEMBERED)
        return outcome, listed

    def _judged(self, shape: _Shape) -> Outcome:
        stand_ins = StandIns(self.clients)
        result, verdicts = stand_ins.judged([self._stand_in(stand_ins, end, number) for end, number in shape])
        rows = stand_ins.rows(made.finding for made in result.made)
        for end, number in shape:
            rows += [] if end.visiting else remarks_of(self.clients, end.p, number)
        paired = {int(each) for group in result.groups for each in group.subscribers}
        both = bool(result.topic.publishers) + 2 * bool(result.topic.subscribers)
        sides = {1: OFFERED, 2: REQUESTED, 3: BUSY if result.groups else 0}[both]
        return Outcome(verdicts, rows, sorted(paired), sides)

    def _stand_in(self, stand_ins: StandIns, end: End, number: int) -> Resolved:
        known, pack = self.clients.known[end.p], self.clients.pack
        resolved, profile = stand_ins.add(end.p, number), known.resolved.profile
        changes: dict[int, Any] = {}
        if end.overlapping:
            changes[pack.vocabulary.indices[ENDPOINT, pack.topic_matching.overlapping]] = 1
        if known.own:
            # Other publishers and subscribers are of participants that are different in pairs.
            name = f"{NAME} {end.owner if end.owner >= 0 else resolved.role}"
            changes |= {index: name for index in self.clients.own if profile.values[index] == NAME}
        profile = profile.with_values(changes) if changes else profile
        return replace(resolved, profile=profile, visiting=end.visiting)


def remarks_of(clients: Clients, p: int, number: int) -> list[dict[str, Any]]:
    """Return the findings about single endpoints, as rows without topic and system."""
    known = clients.known[p]
    role = known.resolved.role
    return [{role: p, f"{role}s": number, "code": code, "severity": severity} for code, severity in known.remarks]
