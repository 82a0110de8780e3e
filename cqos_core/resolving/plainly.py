"""Endpoints that state settings of their own and nothing else, as most do: what they have in common is looked up once.

An endpoint with a profile, an overlay or a need has no answer here, nor has one whose topic has facts or a questionable name. It is
resolved as any other.
"""

from __future__ import annotations

import re
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, Protocol

from cqos_core.model.memory import LONGEST_REMEMBERED, MOST_LETTERS, keep
from cqos_core.model.rows import FIRST_TEXT, RowEndpoint
from cqos_core.packs.meeting import Naming
from cqos_core.resolving.bases import Draft
from cqos_core.resolving.profiles import conventional
from cqos_core.resolving.resolved import Resolved

if TYPE_CHECKING:
    from cqos_core.model.rows import Pattern, Row, RowKind
    from cqos_core.model.system import Endpoint, System
    from cqos_core.packs.meeting import NameContext
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.bases import Base, Bases, Override
    from cqos_core.resolving.resolved import Layer, ResolvedParticipant

_NAMED: Final[dict[tuple[Any, ...], Naming]] = {}
_NOTHING: Final = frozenset[str]()
_ALIKE: Final = attrgetter("participant", "protocol", "kind", "dialect", "role", "observed", "type", "external")
"""What endpoints of one `Kin` have in common."""


def named(topic: str, pack: RulePack, number: int | None, context: NameContext) -> Naming:
    """Return the form in which endpoints meet on a name; ``number`` stands for the pack and the context, None: they are long."""
    key = number, topic
    naming = _NAMED.get(key)
    if naming is None:
        naming = pack.meeting.resolve(topic, context)
        if number is not None and len(topic) <= MOST_LETTERS:
            keep(_NAMED, key, naming)
    return naming


def without_values(
    endpoint: Endpoint | Row,
    participant: ResolvedParticipant,
    naming: Naming | None,
    identifier: str,
    stated_id: str,
    external: bool,  # noqa: FBT001 - as `Resolved` has it
) -> Resolved:
    """Return an endpoint that has neither a draft nor a profile and layers yet."""
    # By hand, as an init would set what is made later.
    made = Resolved.__new__(Resolved)
    made.id, made.stated_id, made.pack = identifier, stated_id, participant.pack
    if type(endpoint) is tuple:
        made.row = endpoint
    else:
        made.row, made.endpoint = None, endpoint  # type: ignore[assignment]
    made.key, made.shown = (naming[0], naming[1]) if naming is not None else (None, "")
    made.participant = participant
    made.external = external
    made.carried, made.visiting, made.bridge = None, False, None
    made.starts_after = _NOTHING
    return made


class Resolving(Protocol):
    """What resolves a system; nothing here holds it, for it holds all that was resolved."""

    @property
    def system(self) -> System:
        """The system."""

    @property
    def bases(self) -> Bases:
        """What endpoints have in common."""

    def owner_of(self, endpoint: Endpoint) -> ResolvedParticipant | None:
        """Return the participant of an endpoint in the eyes of its pack; None without a pack."""

    def of_topic(self, written: str, naming: Naming, pack: RulePack) -> tuple[tuple[Layer, ...], bool]:
        """Return what is stated of a topic, and whether its partners may be elsewhere."""


class Plainly:
    """Resolves such endpoints of one system."""

    def __init__(self) -> None:
        """Begin without any."""
        self._kin: dict[tuple[Any, ...], Kin | None] = {}
        self._of_rows: dict[RowKind, Kin | None] = {}
        self._patterns: dict[Base, dict[Pattern, _Texts]] = {}

    def resolved(self, endpoint: Endpoint | Row, within: Resolving) -> Resolved | None:
        """Return an endpoint with its values; None where it has to be resolved as any other."""
        kin = self.kin(endpoint, within)
        return None if kin is None else kin.resolved(endpoint, within)

    def kin(self, endpoint: Endpoint | Row, within: Resolving) -> Kin | None:
        """Return what is known of endpoints like one; None where each of them has to be resolved as any other."""
        if type(endpoint) is tuple:
            kind = endpoint[0]
            try:
                return self._of_rows[kind]
            except KeyError:
                found = self._of_rows[kind] = self.kin(kind.endpoint, within)
                return found
        if endpoint.needs or endpoint.overlay or endpoint.profiles or endpoint.starts_after:  # type: ignore[union-attr]
            return None
        key = _ALIKE(endpoint)
        try:
            return self._kin[key]
        except KeyError:
            return keep(self._kin, key, self._kin_of(endpoint, within))  # type: ignore[arg-type]

    def _kin_of(self, endpoint: Endpoint, within: Resolving) -> Kin | None:
        bases, owner = within.bases, within.owner_of(endpoint)
        if owner is None or owner.participant.starts_after:
            return None
        expanded = owner.pack.meeting.expand(endpoint)
        if len(expanded) != 1 or expanded[0] is not endpoint:
            return None
        base = bases.base(room_of(endpoint, owner), endpoint, owner, ())
        return None if base is None else Kin(endpoint, owner, base, bases, self._patterns.setdefault(base, {}))


def room_of(endpoint: Endpoint, participant: ResolvedParticipant) -> tuple[Any, ...]:
    """Return all that the values of an endpoint rest on, beside its own settings and those of its topic."""
    return (participant.surroundings, endpoint.role, endpoint.dialect, endpoint.observed, endpoint.type)


class Kin:
    """Endpoints that differ in ids, topics and settings only.

    Attributes:
        endpoint: one of them.
        owner: their participant.
        base: what their settings change.
    """

    __slots__ = (
        "_bases",
        "_before",
        "_context",
        "_conventions",
        "_external",
        "_is_plain",
        "_longest",
        "_number",
        "_patterns",
        "base",
        "endpoint",
        "owner",
    )

    def __init__(
        self,
        endpoint: Endpoint,
        owner: ResolvedParticipant,
        base: Base,
        bases: Bases,
        patterns: dict[Pattern, _Texts],
    ) -> None:
        """Take one of them, what it changes, and what is known of settings that change it."""
        self.endpoint, self.owner, self._bases = endpoint, owner, bases
        self.base = base
        self._external = endpoint.external or owner.participant.external
        self._number, self._context = owner.name_context(endpoint.kind, endpoint.dialect, endpoint.role)
        self._conventions = conventional(owner.pack)
        meeting = owner.pack.meeting
        self._before = meeting.before(self._context) if meeting.match is None else None
        self._is_plain = re.compile(meeting.plain).fullmatch
        self._longest = min(LONGEST_REMEMBERED, meeting.longest or LONGEST_REMEMBERED)
        self._patterns = patterns

    def resolved(self, endpoint: Endpoint | Row, within: Resolving) -> Resolved | None:
        """See `Plainly.resolved`."""
        row = endpoint if type(endpoint) is tuple else None
        topic = endpoint.topic if row is None else row[2]  # type: ignore[union-attr]
        if topic is None:
            return None
        full = self._plain_name(topic, within)
        if full is None:
            naming = named(topic, self.owner.pack, self._number, self._context)
            external = self._external_on(topic, naming, within)
        else:
            naming, external = Naming(full, full), self._external
        overrides = None if external is None else self._overrides(endpoint)
        if external is None or overrides is None:
            return None
        name = endpoint.id if row is None else row[1]  # type: ignore[union-attr]
        made = without_values(endpoint, self.owner, naming, name, name, external)
        made.draft = tuple.__new__(Draft, (self.base, overrides, ()))
        return made

    def _external_on(self, topic: str, naming: Naming, within: Resolving) -> bool | None:
        """Whether partners may be elsewhere; None where something has to be said of the name, or is stated of the topic."""
        key, _, problems = naming
        if problems or key is None:
            return None
        if self._conventions.may_match(key) or within.system.topics:
            layers, external = within.of_topic(topic, naming, self.owner.pack)
            return None if layers else self._external or external
        return self._external

    def _plain_name(self, topic: str, within: Resolving) -> str | None:
        """Return the name on which one with this topic meets others, where there is nothing to say of it; None where that takes longer."""
        if self._before is None or within.system.topics:
            return None
        full = topic if self._is_plain(topic) else self._before + topic
        is_short = len(full) <= self._longest
        return full if is_short and self._is_plain(full) and not self._conventions.may_match(full) else None

    def _overrides(self, endpoint: Endpoint | Row) -> tuple[Override, ...] | None:
        """Return what the settings of one change, each another value; None where they have to be resolved as a whole."""
        if type(endpoint) is tuple:
            pattern, texts = endpoint[0].pattern, endpoint[FIRST_TEXT:]
        else:
            found = endpoint.pattern() if isinstance(endpoint, RowEndpoint) else None
            if found is None:
                return self._plainly(endpoint.said()[0])  # type: ignore[union-attr]
            pattern, texts = found
        written = self._patterns.get(pattern)
        if written is not None:
            return written.overrides(texts, self)
        overrides = self._plainly(pattern.says(texts)[0])
        if overrides is not None:
            self._patterns[pattern] = _Texts(pattern, overrides)
        return overrides

    def _plainly(self, said: Any) -> tuple[Override, ...] | None:
        overrides = self.stated(said)
        return None if overrides is None or not self.base.is_plain(overrides) else overrides

    def stated(self, said: Any) -> tuple[Override, ...] | None:
        """Return what settings change; None where something has to be said of them."""
        return self._bases.overrides(self.base, said, self.endpoint, self.owner)


class _Texts:
    """Settings that some endpoints state in the same order, with other texts in some places."""

    __slots__ = ("_at", "_known", "_said", "_whole")

    def __init__(self, pattern: Pattern, overrides: tuple[Override, ...]) -> None:
        """Take what the settings of one of them change."""
        self._whole = overrides
        self._said = pattern.said[0]
        self._at = pattern.at
        self._known: list[dict[str, Override]] = [{} for _ in pattern.at]

    def overrides(self, texts: tuple[str, ...], kin: Kin) -> tuple[Override, ...] | None:
        """Return what the settings of one with these texts change; None where they have to be resolved as a whole."""
        found = [*self._whole]
        for at, known, text in zip(self._at, self._known, texts):  # noqa: B905 - a pattern has as many texts as places
            each = known.get(text)
            if each is None:
                each = self._changed(at, text, kin)
                if each is None:
                    return None
                keep(known, text, each)
            found[at] = each
        return tuple(found)

    def _changed(self, at: int, text: str, kin: Kin) -> Override | None:
        """Return what one setting changes with a text; None where that is not what it changes with another."""
        name, _, unknown, derived = self._said[at]
        overrides = kin.stated([(name, text, unknown, derived)])
        return overrides[0] if overrides is not None and overrides[0].plainly == self._whole[at].plainly else None
