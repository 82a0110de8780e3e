"""Resolved endpoints: the results of `Resolver`, which all later stages read.

Endpoints with equal values share one interned `QosProfile`. Where a value came from is not stored: `Resolved.origin` finds
it again in the layers, for the few values a finding prints.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.caches import MOST_LETTERS, letters, new_number, number_of
from cqos_core.model.dataclass import dataclass
from cqos_core.model.endpoint_rows import as_object
from cqos_core.packs.topic_matching import NameContext

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.language.values import Value
    from cqos_core.model.endpoint_rows import Row
    from cqos_core.model.finding import Finding
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Broker, Endpoint, Participant, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.topic_matching import Naming
    from cqos_core.resolving.layers import Layer, Stated
    from cqos_core.resolving.parts import ProfileParts, Surroundings
    from cqos_core.resolving.qos_profile import QosProfile


@dataclass(slots=True, eq=False)
class ResolvedParticipant:
    """A participant in the eyes of one pack: its participant-level and option values, and where they came from.

    Attributes:
        requiring: topics on which its endpoints require guarantees, where values follow from all endpoints together.
    """

    participant: Participant
    pack: RulePack
    surroundings: Surroundings
    layers: tuple[Layer, ...]
    broker: Broker | None = None
    requiring: set[str | None] = field(default_factory=set)
    _contexts: dict[tuple[str, str, str], tuple[int | None, NameContext]] = field(init=False, default_factory=dict)

    def name_context(self, kind: str, dialect: str, role: str) -> tuple[int | None, NameContext]:
        """Return the surroundings of topic names for endpoints of one kind, and their number; None for long ones."""
        found = self._contexts.get((kind, dialect, role))
        if found is None:
            owner = self.participant
            context = NameContext(owner.id, owner.label, self.texts, owner.remap, kind, dialect, role)
            key = (self.pack, self.surroundings, owner.id, owner.label, tuple(owner.remap.items()), kind, dialect, role)
            number = None
            if letters(key) <= MOST_LETTERS:
                number = number_of(key) if self.surroundings.is_of_any_system else new_number()
            found = self._contexts[kind, dialect, role] = number, context
        return found

    @property
    def values(self) -> Mapping[int, Value]:
        """Values of options, connection and broker, by policy index."""
        return self.surroundings.values

    @property
    def texts(self) -> Mapping[str, str]:
        """The stated texts of options and the connection, by policy name."""
        return self.surroundings.texts


@dataclass(frozen=True, slots=True, eq=False)
class WireOrigin:
    """The endpoint behind a copy on the wire of another protocol; ``own_index`` maps wire policies to its own."""

    endpoint: Resolved
    own_index: Mapping[int, int]


_NOTHING: Final = frozenset[str]()


@dataclass(slots=True, eq=False)
class Resolved:
    """One endpoint with its values and its resolved topic.

    Attributes:
        id: the endpoint's id, unique in the system.
        stated_id: the id of the stated endpoint that it is, or is a part of.
        key: the topic in the form endpoints meet on; None where it names none.
        shown: the topic as messages print it.
        profile: the values.
        layers: nearest first; where values came from. Endpoints with equal settings share them.
        wire_origin: of a copy on the wire, the endpoint of the other protocol.
        bridge: where it is an end of a bridge, the ids of that and of the endpoint at which it arrives: one for both ends.
        visiting: it is a copy, beside publishers that it meets although its own key is another one.
        starts_after: ids of all participants and endpoints that are stated to be up before it, directly or by way of others.
        parts: the parts that `profile` and `layers` are made of, until then.
        row: the row that `endpoint` is made of when it is first read; None if it is an object.
    """

    endpoint: Endpoint
    id: str
    stated_id: str
    pack: RulePack
    key: str | None
    shown: str
    profile: QosProfile
    layers: tuple[Layer, ...]
    participant: ResolvedParticipant
    external: bool
    wire_origin: WireOrigin | None = None
    visiting: bool = False
    bridge: tuple[str, str] | None = None
    starts_after: frozenset[str] = frozenset()
    parts: ProfileParts | None = None
    row: Row | None = None

    def __getattr__(self, name: str) -> Any:
        """Make the endpoint of a row, or the profile and its layers."""
        if name == "endpoint" and self.row is not None:
            self.endpoint = as_object(self.row)
        elif name in {"profile", "layers"} and (parts := self.parts) is not None:
            self.profile, self.layers = parts.made()
            self.parts = None
        return object.__getattribute__(self, name)  # which another thread may have made

    @classmethod
    def of(
        cls,
        endpoint: Endpoint | Row,
        participant: ResolvedParticipant,
        naming: Naming | None,
        identifier: str,
        stated_id: str,
        *,
        external: bool,
    ) -> Resolved:
        """Return an endpoint that has neither parts nor a profile and layers yet."""
        # Set fields by hand: an init would set those that are made later.
        made = cls.__new__(cls)
        made.id, made.stated_id, made.pack = identifier, stated_id, participant.pack
        if type(endpoint) is tuple:
            made.row = endpoint
        else:
            made.row, made.endpoint = None, endpoint  # type: ignore[assignment]
        made.key, made.shown = (naming[0], naming[1]) if naming is not None else (None, "")
        made.participant = participant
        made.external = external
        made.wire_origin, made.visiting, made.bridge = None, False, None
        made.starts_after = _NOTHING
        return made

    @property
    def representative(self) -> Endpoint:
        """An endpoint of the same class: it may differ in id, topic, settings, label and place. A row need not become an object for it."""
        row = self.row
        return self.endpoint if row is None else row[0].endpoint

    @property
    def like(self) -> QosProfile:
        """A profile with the same frame and codes; its own need not be made for it."""
        parts = self.parts
        return self.profile if parts is None else parts.inherited.profile

    @property
    def known(self) -> Sequence[Any]:
        """`QosProfile.known` of its profile, which need not be made for it."""
        parts = self.parts
        return self.profile.known if parts is None else parts.known

    def value(self, index: int) -> Value:
        """Return a value of its profile, which need not be made for it."""
        parts = self.parts
        return self.profile.values[index] if parts is None else parts.value(index)

    def is_after(self, other: Resolved) -> bool:
        """Whether the other endpoint is stated to be up before this one."""
        return not self.starts_after.isdisjoint(other.names)

    @property
    def names(self) -> frozenset[str]:
        """The names by which others start after it."""
        return frozenset((self.id, self.stated_id, self.participant.participant.id))

    @property
    def is_copy(self) -> bool:
        """Whether the endpoint itself is elsewhere, on another wire or another key."""
        return self.visiting or self.wire_origin is not None

    @property
    def role(self) -> str:
        """``publisher`` or ``subscriber``."""
        return self.representative.role

    def origin(self, index: int) -> tuple[str, Place | None]:
        """Return the origin of a policy's value, and its place or the endpoint's."""
        if self.wire_origin is not None and index in self.wire_origin.own_index:
            return self.wire_origin.endpoint.origin(self.wire_origin.own_index[index])
        if index in self.profile.ignored:
            return "ignored by the middleware", self.endpoint.place
        for layer in (*self.layers, *self.participant.layers):
            stated = layer.settings.get(index)
            if stated is not None:
                return layer.origin, self._place(layer, stated) or self.endpoint.place
        return "default", self.endpoint.place

    def _place(self, layer: Layer, stated: Stated) -> Place | None:
        """The place of a stated value; layers are shared, but an endpoint's own settings stand at its own place."""
        if not layer.here:
            return stated.setting.place
        own: Settings = getattr(self.endpoint, layer.here)
        return own[stated.name].place if stated.name in own else None

    def written(self, index: int) -> str | None:
        """Return the text of a value as it was written; None if it was not."""
        if self.wire_origin is not None and index in self.wire_origin.own_index:
            return self.wire_origin.endpoint.written(self.wire_origin.own_index[index])
        for layer in (*self.layers, *self.participant.layers):
            stated = layer.settings.get(index)
            if stated is not None:
                return stated.text
        return None


@dataclass(slots=True)
class ResolvedSystem:
    """All endpoints of packs, and findings of resolving; ``packless`` are endpoints without a pack, by protocol."""

    system: System
    endpoints: list[Resolved] = field(default_factory=list)
    participants: dict[tuple[str, int], ResolvedParticipant] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    packs: dict[str, RulePack] = field(default_factory=dict)
    packless: dict[str, list[Endpoint]] = field(default_factory=dict)
