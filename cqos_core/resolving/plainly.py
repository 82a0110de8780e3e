"""Endpoints that state settings of their own and nothing else, as most do: what they have in common is looked up once.

An endpoint with a profile, an overlay or a need has no answer here, nor has one whose topic has facts or a questionable name. It is
resolved as any other.
"""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from cqos_core.model.lazy_endpoint import is_bare
from cqos_core.model.memory import MAXIMUM_REMEMBERED, MOST_LETTERS, keep
from cqos_core.resolving.bases import Draft
from cqos_core.resolving.profiles import conventional
from cqos_core.resolving.resolved import Resolved

if TYPE_CHECKING:
    from cqos_core.model.system import Endpoint, Pattern, System
    from cqos_core.packs.meeting import NameContext, Naming
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.bases import Base, Bases, Override
    from cqos_core.resolving.resolved import Layer, ResolvedParticipant

_NAMED: Final[dict[tuple[Any, ...], Naming]] = {}
_NOTHING: Final = frozenset[str]()
_ALIKE: Final = attrgetter("participant", "protocol", "kind", "dialect", "role", "observed", "type", "external")
"""What endpoints of one `_Kin` have in common."""


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
    endpoint: Endpoint,
    participant: ResolvedParticipant,
    naming: Naming | None,
    identifier: str,
    stated_id: str,
    external: bool,  # noqa: FBT001 - as `Resolved` has it
) -> Resolved:
    """Return an endpoint that has neither a draft nor a profile and layers yet."""
    # By hand, as an init would set what is made later.
    made = Resolved.__new__(Resolved)
    made.endpoint, made.id, made.stated_id, made.pack = endpoint, identifier, stated_id, participant.pack
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

    def of_topic(self, written: str, naming: Naming, pack: RulePack) -> tuple[tuple[Layer, ...], bool]:
        """Return what is stated of a topic, and whether its partners may be elsewhere."""


class PlainEnd(NamedTuple):
    """An endpoint before it is made: its settings change a base, and its topic has a name."""

    owner: ResolvedParticipant
    base: Base
    overrides: tuple[Override, ...]
    naming: Naming
    external: bool

    @property
    def known(self) -> list[Any]:
        """What `QosProfile.known` will be."""
        return self.base.known(self.overrides)

    def made(self, endpoint: Endpoint) -> Resolved:
        """Make it."""
        made = without_values(endpoint, self.owner, self.naming, endpoint.id, endpoint.id, self.external)
        made.draft = tuple.__new__(Draft, (self.base, self.overrides, ()))
        return made


class Plainly:
    """Resolves such endpoints of one system."""

    def __init__(self) -> None:
        """Begin without any."""
        self._kin: dict[tuple[Any, ...], _Kin | None] = {}
        self._patterns: dict[Base, dict[Pattern, _Texts]] = {}

    def resolved(self, endpoint: Endpoint, owner: ResolvedParticipant, within: Resolving) -> Resolved | None:
        """Return an endpoint of a participant with its values; None where it has to be resolved as any other."""
        found = self.found(endpoint, owner, within)
        return None if found is None else found.made(endpoint)

    def found(self, endpoint: Endpoint, owner: ResolvedParticipant, within: Resolving) -> PlainEnd | None:
        """Return what such an endpoint is made of; None where it has to be resolved as any other."""
        if not is_bare(endpoint):
            return None
        topic = endpoint.topic
        alike = _ALIKE(endpoint)
        kin = self._kin.get(alike)
        if kin is None:
            if alike in self._kin or topic is None:
                return None
            if len(self._kin) >= MAXIMUM_REMEMBERED:
                self._kin.clear()
            kin = self._kin[alike] = self._kin_of(endpoint, owner, within)
        if kin is None or topic is None:
            return None
        naming = named(topic, owner.pack, kin.number, kin.context)
        key, _, problems = naming
        if problems or key is None:
            return None
        external = kin.external
        if kin.conventions.may_match(key) or within.system.topics:
            layers, of_topic = within.of_topic(topic, naming, owner.pack)
            if layers:
                return None
            external = external or of_topic
        overrides = kin.overrides(endpoint)
        return None if overrides is None else tuple.__new__(PlainEnd, (owner, kin.base, overrides, naming, external))

    def _kin_of(self, endpoint: Endpoint, owner: ResolvedParticipant, within: Resolving) -> _Kin | None:
        """Return what is known of endpoints like one; None where each of them has to be resolved as any other."""
        bases = within.bases
        expanded = owner.pack.meeting.expand(endpoint)
        if owner.participant.starts_after or len(expanded) != 1 or expanded[0] is not endpoint:
            return None
        base = bases.base(room_of(endpoint, owner), endpoint, owner, ())
        return None if base is None else _Kin(endpoint, owner, base, bases, self._patterns.setdefault(base, {}))


def room_of(endpoint: Endpoint, participant: ResolvedParticipant) -> tuple[Any, ...]:
    """Return all that the values of an endpoint rest on, beside its own settings and those of its topic."""
    return (participant.surroundings, endpoint.role, endpoint.dialect, endpoint.observed, endpoint.type)


class _Kin:
    """Endpoints that differ in ids, topics and settings only."""

    __slots__ = (
        "_bases",
        "_endpoint",
        "_owner",
        "_patterns",
        "base",
        "context",
        "conventions",
        "external",
        "number",
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
        self._endpoint, self._owner, self._bases = endpoint, owner, bases
        self.base = base
        self.external = endpoint.external or owner.participant.external
        self.number, self.context = owner.name_context(endpoint.kind, endpoint.dialect, endpoint.role)
        self.conventions = conventional(owner.pack)
        self._patterns = patterns

    def overrides(self, endpoint: Endpoint) -> tuple[Override, ...] | None:
        """Return what the settings of one change, each another value; None where they have to be resolved as a whole."""
        found = endpoint.pattern()
        written = None if found is None else self._patterns.get(found[0])
        if written is not None and found is not None:
            return written.overrides(found[1], self)
        overrides = self.stated(endpoint.said()[0])
        if overrides is None or not self.base.is_plain(overrides):
            return None
        if found is not None:
            self._patterns[found[0]] = _Texts(found[0], overrides)
        return overrides

    def stated(self, said: Any) -> tuple[Override, ...] | None:
        """Return what settings change; None where something has to be said of them."""
        return self._bases.overrides(self.base, said, self._endpoint, self._owner)


class _Texts:
    """Settings that some endpoints state in the same order, with other texts in some places."""

    __slots__ = ("_known", "_said", "_whole")

    def __init__(self, pattern: Pattern, overrides: tuple[Override, ...]) -> None:
        """Take what the settings of one of them change."""
        self._whole = overrides
        self._said = pattern.said[0]
        self._known: list[tuple[int, dict[Any, Override]]] = [(at, {}) for at in pattern.at]

    def overrides(self, texts: tuple[Any, ...], kin: _Kin) -> tuple[Override, ...] | None:
        """Return what the settings of one with these texts change; None where they have to be resolved as a whole."""
        found = [*self._whole]
        for (at, known), text in zip(self._known, texts):  # noqa: B905 - a pattern has as many texts as places
            try:
                found[at] = known[text]
            except KeyError:
                changed = self._changed(at, text, kin)
                if changed is None:
                    return None
                if len(known) >= MAXIMUM_REMEMBERED:
                    known.clear()
                found[at] = known[text] = changed
        return tuple(found)

    def _changed(self, at: int, text: Any, kin: _Kin) -> Override | None:
        """Return what one setting changes with a text; None where that is not what it changes with another."""
        name, _, unknown, derived = self._said[at]
        overrides = kin.stated([(name, text.decode() if type(text) is bytes else text, unknown, derived)])
        return overrides[0] if overrides is not None and overrides[0].plainly == self._whole[at].plainly else None
