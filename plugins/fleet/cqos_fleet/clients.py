"""Participants of a fleet by what tells them apart: each kind is resolved once, as a system of its own, with all that follows from it.

This needs what a pack says by `cqos_core.packs.Folding`. A participant is known by its topics, each with the texts of its endpoints and
with what the pack reads of the name; topics that differ in nothing else are one. The rest of a system shows in other stages: who has
the same id here, what a subscriber hears in `cqos_fleet.filter_matches`, and who meets whom in `cqos_fleet.topic_judge`.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.matching.judge import ask
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Participant, System
from cqos_core.resolving.profiles import conventional
from cqos_core.resolving.resolver import Resolver
from cqos_fleet.engines import DOT
from cqos_fleet.profiles import SEVERITIES, endpoint_of, remarked, setting_name, settings_of, stated_twice
from cqos_fleet.value_numbers import Numbered
from cqos_fleet.writers import pattern_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.packs.completion import Folding
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_fleet.table_store import Spool

NAME: Final = "participant"
"""What each participant is named while it is resolved."""
ENDS: Final = {
    "system": "text",
    "topic": "text",
    "second": "number",
    "p": "number",
    "owner": "number",
    "own": "number",
    "far": "number",
}
"""The columns of endpoints: `own` is the owner where the topic has to know it, else -1; `far` is 1 where other topics are heard, too."""
_SOME: Final = "…"
"""What stands in values for a text that is not compared."""


class KnownEnd(NamedTuple):
    """Endpoints that differ in nothing but names.

    Attributes:
        resolved: one of them.
        texts: what its row states, without texts that others do not share.
        remarks: code and severity of findings about it alone.
        own: its values name its participant.
    """

    resolved: Resolved
    texts: Mapping[str, str]
    remarks: tuple[tuple[str, str], ...]
    own: bool


class FoldedColumns(NamedTuple):
    """The columns whose texts are not compared as they are; each with its name as a setting.

    Attributes:
        topics: they name topics.
        shared: they count by whether another participant has the same.
        texts: all that have one text for many.
    """

    topics: Mapping[str, str]
    shared: Mapping[str, str]
    texts: Mapping[str, str]

    @property
    def names(self) -> list[str]:
        """All of them."""
        return [*self.topics, *self.shared, *self.texts]


def folded_columns(pack: RulePack, columns: Iterable[str]) -> FoldedColumns:
    """Return which columns of a table are folded; they may have other names of policies."""
    found = FoldedColumns({}, {}, {})
    folding = pack.system_facts.folding
    assert folding is not None  # noqa: S101 - asked by the caller
    for column in columns:
        index = pack.find("participant", setting_name(column)) if column.startswith(DOT) else None
        name = pack.policies[index].name if index is not None else ""
        for kind, names in (
            (found.topics, folding.topics),
            (found.shared, folding.shared),
            (found.texts, folding.texts),
        ):
            if name in names:
                kind[column] = name  # type: ignore[index] # filled here only
    return found


_Answer = tuple[dict[int, tuple[int, ...]], tuple[tuple[int, int], ...], bool]
"""By number of a kind of topic the ends there; implied ends, after the position of their topic; whether one hears other topics."""
Alike = tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
"""The other participants that have a shared text: the setting, and what each states beside."""


class Clients:
    """The kinds of participants of one protocol.

    Attributes:
        known: the ends that they have; a number of one is its position here.
        nameless: by system, topic and number, endpoints whose topic is no name.
    """

    def __init__(
        self,
        pack: RulePack,
        where: CheckContext,
        options: Mapping[str, Setting],
        severity: str,
        texts: Sequence[Mapping[str, str]],
        columns: FoldedColumns,
    ) -> None:
        """Begin without any; ``texts`` are the distinct rows of all other columns."""
        self.pack, self.where, self.options, self.texts, self.columns = pack, where, options, texts, columns
        assert pack.system_facts.folding is not None  # noqa: S101 - asked by the caller
        self.folding: Folding = pack.system_facts.folding
        self.severities = SEVERITIES[: SEVERITIES.index(severity) + 1]
        self.known = Numbered[KnownEnd]()
        self.nameless = Counter[tuple[str, str, int]]()
        self._topics: dict[tuple[object, ...], int] = {}
        self._kinds: dict[tuple[object, ...], _Answer] = {}
        patterns = "|".join(pattern_of(each.pattern) for each in pack.conventions)
        self._conventional = re.compile(rf"(?s)(?:{patterns})").fullmatch if patterns else None
        indices = pack.vocabulary.indices
        folded = (*self.folding.topics, *self.folding.shared, *self.folding.texts)
        self._folded = [indices["participant", name] for name in folded]
        self.own = [indices["participant", name] for name in self.folding.own]

    def write(self, rows: Iterable[tuple[Any, ...]], alike: Mapping[tuple[str, str], Alike], out: Spool) -> None:
        """Write the endpoints of all participants, those that follow from settings among them.

        Args:
            rows: in order of system and participant, then topic: these three, the number of the texts, and the folded columns.
            alike: by system and participant, what is known of others that have a shared text of it.
            out: has the columns of `ENDS`.
        """
        for owner, (named, of_owner) in enumerate(groupby(rows, itemgetter(0, 1))):
            topics: dict[str, list[int]] = {}
            stated: Sequence[str] | None = None
            for _, _, topic, number, *folded in of_owner:
                if stated is None:
                    stated = folded
                elif folded != stated:
                    stated = self._together(named, stated, folded)
                topics.setdefault(topic, []).append(number)
            self._add(out, owner, named, topics, stated or (), alike.get(named, ()))

    def _together(self, named: tuple[str, str], one: Sequence[str], other: Sequence[str]) -> list[str]:
        for name, text, more in zip(self.columns.names, one, other, strict=True):
            if text and more and text != more:
                raise stated_twice(*named, setting_name(name), text, more)
        return [text or more for text, more in zip(one, other, strict=True)]

    def _add(
        self,
        out: Spool,
        owner: int,
        named: tuple[str, str],
        topics: Mapping[str, Sequence[int]],
        stated: Sequence[str],
        alike: Alike,
    ) -> None:
        """Add the endpoints of one participant."""
        columns, reads = self.columns, self._reads
        count = len(columns.topics)
        of_settings = [*stated[:count]]
        numbers = [
            reads(topic, tuple(texts), tuple([at for at, each in enumerate(of_settings) if each == topic]))
            for topic, texts in topics.items()
        ]
        implied = tuple([text and reads(text, (), ()) for text in of_settings])
        shared = tuple([text != "" for text in stated[count : count + len(columns.shared)]])
        texts = tuple(
            [
                text and self.folding.texts[name](text)
                for name, text in zip(columns.texts.values(), stated[count + len(columns.shared) :], strict=True)
            ]
        )
        key = (tuple(sorted({*numbers})), implied, shared, texts, alike)
        found = self._kinds.get(key)
        if found is None:
            found = self._kinds[key] = self._of_kind(named, topics, numbers, stated, texts, alike)
        ends, more, hears_others = found
        known, system = self.known, named[0]
        rows = [(topic, p) for topic, number in zip(topics, numbers, strict=True) for p in ends[number]]
        rows += [(of_settings[at], p) for at, p in more]
        for topic, p in rows:
            each = known[p]
            if each.resolved.key is None:
                self.nameless[system, topic, p] += 1
                continue
            second = each.resolved.role != PUBLISHER
            own = owner if each.own or (second and hears_others) else -1
            out.add(system, topic, int(second), p, owner, own, int(second and self.folding.reaches(topic)))

    def _reads(self, topic: str, texts: tuple[int, ...], marks: tuple[int, ...]) -> int:
        """Return the number of a kind of topic: what is read of its name, and the endpoints on it."""
        said: tuple[object, ...] = ()
        if self._conventional is not None and self._conventional(topic):
            said = tuple(sorted(each.pattern for each in conventional(self.pack).matching(topic)))
        return self._topics.setdefault((self.folding.reads(topic), said, texts, marks), len(self._topics))

    def _of_kind(
        self,
        named: tuple[str, str],
        topics: Mapping[str, Sequence[int]],
        numbers: Sequence[int],
        stated: Sequence[str],
        texts: Sequence[str],
        alike: Alike,
    ) -> _Answer:
        """Resolve a participant, with others that have its shared texts."""
        pack, columns = self.pack, self.columns
        system = System(protocol=pack.id, options={pack.id: dict(self.options)})
        folded = [*stated[: len(columns.topics)], *("same" if text else "" for text in stated[len(columns.topics) :])]
        folded[len(columns.topics) + len(columns.shared) :] = texts
        own = {setting_name(name): Setting(text) for name, text in zip(columns.names, folded, strict=True) if text}
        owned: dict[str, str] = {}
        for number in dict.fromkeys(number for listed in topics.values() for number in listed):
            for key, text in settings_of(pack, self.texts[number], owned=True).items():
                if (other := own.setdefault(key, Setting(text)).text) != text:
                    raise stated_twice(*named, key, other, text)
                owned[key] = text
        system.participants[NAME] = Participant(NAME, pack.id, own)
        for at, (shared, beside) in enumerate(alike):
            settings = {shared: own[shared], **{key: Setting(text) for key, text in beside}}
            system.participants[f"{NAME}{at}"] = Participant(f"{NAME}{at}", pack.id, settings)
        first: dict[int, tuple[str, Sequence[int]]] = {}
        for (topic, listed), number in zip(topics.items(), numbers, strict=True):
            first.setdefault(number, (topic, listed))
        placed: dict[str, tuple[int, int]] = {}
        for number, (topic, listed) in first.items():
            for each in listed:
                placed[str(len(placed))] = number, each
                system.endpoints.append(endpoint_of(pack, self.texts[each], str(len(placed) - 1), topic, NAME))
        return self._resolved(system, placed, stated, {f"{DOT}{key}": text for key, text in owned.items()})

    def _resolved(
        self,
        system: System,
        placed: Mapping[str, tuple[int, int]],
        stated: Sequence[str],
        owned: Mapping[str, str],
    ) -> _Answer:
        """Resolve a participant; ``owned`` are its settings by column, which any of its rows may have."""
        where = self.where
        resolver = Resolver(system, where.find_pack, self.pack.id, {}, where.known_packs)
        ends: dict[int, list[int]] = {number: [] for number, _ in placed.values()}
        more: list[tuple[int, int]] = []
        hears_others = False
        for each, said in remarked(resolver.run(), NAME):
            if each.endpoint.participant != NAME:
                continue
            text = self.texts[placed[each.id][1]] if each.id in placed else {"version": ""}
            p = self._number(each, {**text, **owned}, [(one.code, one.severity) for one in said])
            hears_others |= each.role == SUBSCRIBER and each.key is not None and self.folding.reaches(each.key)
            if each.id in placed:
                ends[placed[each.id][0]].append(p)
            else:
                more.append(([*stated].index(each.endpoint.topic or ""), p))
        return {number: tuple(listed) for number, listed in ends.items()}, tuple(more), hears_others

    def _number(self, each: Resolved, text: Mapping[str, str], said: Sequence[tuple[str, str]]) -> int:
        values = each.profile.values
        folded = {index: _SOME for index in self._folded if isinstance(values[index], str) and values[index]}
        profile = each.profile.with_values(folded) if folded else each.profile
        beyond = (one for bound in self.pack.participant_rules if (one := ask(bound, values, values)) is not None)
        found = [*said, *((one.bound.rule.code, str(one.bound.severity)) for one in beyond if not one.unknown)]
        remarks = tuple(sorted({each for each in found if each[1] in self.severities}))
        own = any(values[index] == NAME for index in self.own)
        return self.number(KnownEnd(replace(each, profile=profile), text, remarks, own))

    def number(self, end: KnownEnd) -> int:
        """Return the number of an end."""
        each = end.resolved
        key = (each.role, id(each.profile), end.texts["version"], end.remarks, each.external, each.key is None)
        return self.known.number(key, end)
