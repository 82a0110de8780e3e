"""Endpoints with values: what `resolve` makes, and all that follows reads.

Endpoints with equal values share one interned `QosProfile`. Where a value came from is not stored: `Resolved.origin` finds
it again in the layers, for the few values a finding prints.
"""

from __future__ import annotations

from dataclasses import field
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from cqos_core.language.domains import Names, Text
from cqos_core.language.policy import NO, UNMATCHED, Policy
from cqos_core.language.values import KNOWN, UNREAD, Anything, Depends, FromPeers, Value, is_plain
from cqos_core.model.dataclass import dataclass
from cqos_core.model.memory import MAXIMUM_REMEMBERED, MOST_LETTERS, letters, number_of
from cqos_core.model.rows import as_object
from cqos_core.packs.meeting import NameContext

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.language.values import Plain, Values, WrittenValue
    from cqos_core.model.report import Finding
    from cqos_core.model.rows import Row
    from cqos_core.model.system import Broker, Endpoint, Participant, Place, Room, Setting, Settings, System
    from cqos_core.packs.meeting import Naming
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.parts import ProfileParts


class Stated(NamedTuple):
    """A setting after its name was recognised.

    Attributes:
        name: the one it was written with.
        field: the key, where the value is one of a map.
        code: of the finding that reports why the value is not known, where there is one already.
    """

    text: str
    setting: Setting
    name: str = ""
    code: str = ""
    field: str = ""


class Layer(NamedTuple):
    """Settings from one place of the hierarchy, by policy index; ``origin`` says which in a message.

    Attributes:
        here: the attribute of the endpoint that has them; empty where they stand elsewhere.
        counts_as_stated: ``stated(P)`` holds for them.
        assumed: not stated: what the protocol gives an endpoint that states nothing.
        overlay: they are laid over the endpoint's own from elsewhere: ``holds``, or ``may_hold`` where that is not known.
        unread: codes of the errors that report what was stated beside them and is not understood.
        dialect: of an overlay or profile: which of the pack's dialects its texts are written in.
        room: where its file has room for further settings.
    """

    origin: str
    settings: Mapping[int, Stated]
    here: str = ""
    counts_as_stated: bool = True
    assumed: bool = False
    overlay: Literal["no", "holds", "may_hold"] = "no"
    unread: tuple[str, ...] = ()
    dialect: str = "yaml"
    room: Room | None = None

    @property
    def texts(self) -> tuple[object, ...]:
        """What they are stated as, without where."""
        stated = [(index, stated.text, stated.setting.unknown) for index, stated in self.settings.items()]
        return (*stated, self.unread) if self.unread else tuple(stated)


@dataclass(frozen=True, slots=True, eq=False)
class ProfileFrame:
    """What profiles have in common that differ in known values of endpoints only; equal ones are one object.

    Attributes:
        open: values that are not known, by index.
        options: values of the pack's options, by index.
        unmatched: indices of policies that the middleware in use does not match on.
        from_peers: indices of values that `settle` takes from the other side.
        needs: the guarantees that are needed.
        deciding: where a value decides more of a profile than itself.
    """

    open: Mapping[int, Any]
    options: Mapping[int, Any]
    unmatched: frozenset[int]
    from_peers: tuple[int, ...]
    needs: frozenset[str]
    deciding: frozenset[int]


class QosProfile:
    """The values of one endpoint, shared by all endpoints with equal ones and compared by identity.

    Attributes:
        known: one value per policy of the pack, then one `WrittenValue` or None per policy; where one is not known, something
            of its type stands in for it.
        frame: those that are not known, and what decides how the others are taken.
        beside: codes of the findings about what was stated beside the values and is not understood.
        refused: codes of errors for which no pair of the endpoint works, beside those of the rules over its values.
        unread: those of `beside`, and of the findings about values that are not: no pair is compatible by ignorance of either.
    """

    __slots__ = ("_values", "beside", "frame", "known", "pack", "refused", "unread")

    def __init__(
        self,
        pack: RulePack,
        known: Values,
        frame: ProfileFrame,
        beside: tuple[str, ...] = (),
        refused: tuple[str, ...] = (),
        unread: tuple[str, ...] = (),
    ) -> None:
        """Take all of it; only `intern` and its own methods make profiles."""
        self.pack = pack
        self.known = known
        self.frame = frame
        self.beside = beside
        self.refused = refused
        self.unread = unread
        self._values: Values | None = None if frame.open else known

    @property
    def values(self) -> Values:
        """The known values, and those that are not known."""
        if self._values is None:
            every = [*self.known]
            for index, value in self.frame.open.items():
                every[index] = value
            self._values = tuple(every)
        return self._values

    @property
    def unmatched(self) -> frozenset[int]:
        """Indices of policies that the middleware in use does not match on."""
        return self.frame.unmatched

    @property
    def from_peers(self) -> tuple[int, ...]:
        """Indices of values that `settle` takes from the other side."""
        return self.frame.from_peers

    @property
    def needs(self) -> frozenset[str]:
        """The guarantees that are needed."""
        return self.frame.needs

    def with_values(
        self,
        changes: Mapping[int, Value | WrittenValue | None],
        beside: Iterable[str] = (),
        refused: Iterable[str] = (),
    ) -> QosProfile:
        """Return the interned profile with some values replaced, and with more codes beside them."""
        size = self.pack.vocabulary.size
        known = all(type(v) in KNOWN if at < size else v is not UNREAD for at, v in changes.items())
        plainly = known and not beside and not refused and self.frame.deciding.isdisjoint(changes)
        every = [*(self.known if plainly else self.values)]
        for index, value in changes.items():
            every[index] = value
        if plainly:
            return self.with_known(tuple(every))
        return intern(self.pack, tuple(every), (*self.beside, *beside), (*self.refused, *refused))

    def with_known(self, known: Values) -> QosProfile:
        """Return the interned profile with other known values, none of them at `ProfileFrame.deciding`."""
        # Most are new, and to make one in vain costs less than to hash all values twice.
        profile = QosProfile(self.pack, known, self.frame, self.beside, self.refused, self.unread)
        return _kept((known, self.frame, self.beside, self.refused), profile)


_PROFILES: dict[tuple[object, ...], QosProfile] = {}
_FRAMES: dict[tuple[object, ...], ProfileFrame] = {}
_MAXIMUM_PROFILES: Final = 200_000
_NOTHING: Final = frozenset[str]()
READ: Final[dict[tuple[Any, ...], Any]] = {}
"""What endpoints inherit, and what that is with their own settings, of any system; dropped with the profiles, or equal ones would differ."""


def _kept(key: tuple[object, ...], profile: QosProfile) -> QosProfile:
    if len(_PROFILES) >= _MAXIMUM_PROFILES:
        _PROFILES.clear()
        _FRAMES.clear()
        READ.clear()
    return _PROFILES.setdefault(key, profile)


def intern(pack: RulePack, values: Values, beside: Iterable[str] = (), refused: Iterable[str] = ()) -> QosProfile:
    """Return the one `QosProfile` of ``pack`` with these values and codes."""
    beside, refused = tuple(sorted({*beside})), tuple(sorted({*refused}))
    size = pack.vocabulary.size
    opened = {
        index: value
        for index, value in enumerate(values)
        if (type(value) not in KNOWN if index < size else value is UNREAD)
    }
    known = values
    if opened:
        known = tuple([_stand_in(pack, at) if at in opened else value for at, value in enumerate(values)])
    frame = _frame(pack, values, opened)
    key = (known, frame, beside, refused)
    profile = _PROFILES.get(key)
    if profile is None:
        codes = {value.code for value in opened.values() if isinstance(value, Anything) and value.code}
        profile = _kept(key, QosProfile(pack, known, frame, beside, refused, tuple(sorted({*beside, *codes}))))
    return profile


def _frame(pack: RulePack, values: Values, opened: Mapping[int, Any]) -> ProfileFrame:
    options = {index: values[index] for index in _options(pack)}
    needs = frozenset(name for name, (index, nothing) in pack.needs.items() if values[index] != nothing)
    key = (pack, tuple(opened.items()), tuple(options.values()), needs)
    found = _FRAMES.get(key)
    if found is None:
        from_peers = tuple(index for index, value in opened.items() if isinstance(value, FromPeers))
        unmatched = _treated_as(pack, UNMATCHED, tuple([values[index] for index in _deciding(pack)]))
        deciding = frozenset((*opened, *options, *(index for index, _ in pack.needs.values())))
        found = _FRAMES.setdefault(key, ProfileFrame(opened, options, unmatched, from_peers, needs, deciding))
    return found


@cache
def _options(pack: RulePack) -> tuple[int, ...]:
    return tuple(index for index, policy in enumerate(pack.policies) if policy.level == "option")


def _stand_in(pack: RulePack, index: int) -> Plain | None:
    """Return what stands in for an unknown value, so that conditions can be asked of it; their answer is not used."""
    if index >= pack.vocabulary.size:
        return None
    domain = pack.policies[index].domain
    return () if isinstance(domain, Names) else "" if isinstance(domain, Text) else 0


@cache
def _deciding(pack: RulePack) -> tuple[int, ...]:
    """The options that distinguish middleware that ignores policies, or matches without them."""
    options = {pack.vocabulary.indices["option", name] for policy in pack.policies for name in policy.enforced}
    return tuple(sorted(options))


@lru_cache(maxsize=MAXIMUM_REMEMBERED)
def _treated_as(pack: RulePack, how: str, deciding: tuple[Value, ...]) -> frozenset[int]:
    """The policies that the middleware treats in a way, under these values of `_deciding`; the first option that says counts."""
    values = dict(zip(_deciding(pack), deciding, strict=True))
    found = set()
    for index, policy in enumerate(pack.policies):
        at = [(pack.vocabulary.indices["option", option], table) for option, table in policy.enforced.items()]
        said = (treated(table, pack.policies[option], values[option]) for option, table in at)
        if next((each for each in said if each is not None), "yes") == how:
            found.add(index)
    return frozenset(found)


def treated(by_value: Mapping[str, str], option: Policy, value: Value) -> str | None:
    """What a table by option value says; of an undetermined option, what it says of every value in play."""
    if isinstance(value, Depends):
        found = {treated(by_value, option, case) for _, case in value.cases}
        return found.pop() if len(found) == 1 else None
    return by_value.get(option.domain.format(value)) if is_plain(value) else None  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What participants give their endpoints: values of options, connection and broker, and the texts of the former two.

    Participants that state the same share it.

    Attributes:
        unread: codes of what is reported of it as not understood.
        unstated: what was found of endpoints that state nothing: the value by policy, role, whether they were observed, and dialect.
    """

    values: Mapping[int, Value]
    texts: Mapping[str, str]
    unread: tuple[str, ...] = ()
    unstated: dict[tuple[int, str, bool, str], Value] = field(default_factory=dict)


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
        """Return what names of topics are resolved with, for endpoints of one kind, and its number; none if it is long."""
        found = self._contexts.get((kind, dialect, role))
        if found is None:
            owner = self.participant
            context = NameContext(owner.id, owner.label, self.texts, owner.remap, kind, dialect, role)
            key = (self.pack, self.surroundings, owner.id, owner.label, tuple(owner.remap.items()), kind, dialect, role)
            number = number_of(key) if letters(key) <= MOST_LETTERS else None
            found = self._contexts[kind, dialect, role] = number, context
        return found

    @property
    def values(self) -> Mapping[int, Value]:
        """Values of options, connection and broker, by policy index."""
        return self.surroundings.values

    @property
    def texts(self) -> Mapping[str, str]:
        """What options and the connection were stated as, by policy name."""
        return self.surroundings.texts


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """An endpoint that appears on the wire of another protocol; ``own_index`` leads from wire policies to its own."""

    endpoint: Resolved
    own_index: Mapping[int, int]


@dataclass(slots=True, eq=False)
class Resolved:
    """One endpoint with its values and the topic it meets on.

    Attributes:
        id: the endpoint's id, unique in the system.
        stated_id: the id of the stated endpoint that it is, or is a part of.
        key: the topic in the form endpoints meet on; None where it names none.
        shown: the topic as messages print it.
        profile: the values.
        layers: nearest first; where values came from. Endpoints with equal settings share them.
        carried: the endpoint of another protocol that this one is on the wire.
        bridge: where it is an end of a bridge, the ids of that and of the endpoint at which it arrives: one for both ends.
        visiting: it is a copy, beside publishers that it meets although its own key is another one.
        starts_after: ids of all participants and endpoints that are stated to be up before it, directly or by way of others.
        parts: what `profile` and `layers` are made of, until then.
        row: what `endpoint` is made of when it is first read; None where it is an object.
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
    carried: Carried | None = None
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
        # By hand, as an init would set what is made later.
        made = cls.__new__(cls)
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

    @property
    def kin(self) -> Endpoint:
        """The endpoint, or one that differs from it in id, topic, settings, label and place only, and need not be made."""
        row = self.row
        return self.endpoint if row is None else row[0].endpoint

    @property
    def like(self) -> QosProfile:
        """A profile with the frame and the codes of its own, which need not be made for it."""
        parts = self.parts
        return self.profile if parts is None else parts.inherited.profile

    @property
    def known(self) -> Sequence[Any]:
        """What `QosProfile.known` is of its profile, which need not be made for it."""
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
        """What others name that start after it."""
        return frozenset((self.id, self.stated_id, self.participant.participant.id))

    @property
    def is_copy(self) -> bool:
        """Whether the endpoint itself is elsewhere, on another wire or another key."""
        return self.visiting or self.carried is not None

    @property
    def role(self) -> str:
        """``publisher`` or ``subscriber``."""
        return self.kin.role

    def origin(self, index: int) -> tuple[str, Place | None]:
        """Where the value of a policy came from, and its place or the endpoint's."""
        if self.carried is not None and index in self.carried.own_index:
            return self.carried.endpoint.origin(self.carried.own_index[index])
        deciding = tuple([self.profile.values[option] for option in _deciding(self.pack)])
        if index in _treated_as(self.pack, NO, deciding):
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
        """The text the value was written as, where it was."""
        if self.carried is not None and index in self.carried.own_index:
            return self.carried.endpoint.written(self.carried.own_index[index])
        for layer in (*self.layers, *self.participant.layers):
            stated = layer.settings.get(index)
            if stated is not None:
                return stated.text
        return None


@dataclass(slots=True)
class ResolvedSystem:
    """All endpoints that a pack judges, and what was found on the way."""

    system: System
    endpoints: list[Resolved] = field(default_factory=list)
    participants: dict[tuple[str, int], ResolvedParticipant] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    packs: dict[str, RulePack] = field(default_factory=dict)
