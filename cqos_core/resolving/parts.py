"""What the profiles of endpoints are put together from: what they inherit, and what each of their own settings changes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import field
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.values import KNOWN, UNREAD
from cqos_core.model.caches import keep
from cqos_core.model.dataclass import dataclass
from cqos_core.resolving.layers import Layer

if TYPE_CHECKING:
    from cqos_core.language.values import Value, WrittenValue
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.endpoint_remarks import Remark
    from cqos_core.resolving.layers import Stated
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.reader import Recognised

_NONE: Final = -1


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What participants give their endpoints: values of options, connection and broker, and the texts of the former two.

    Participants that state the same share it.

    Attributes:
        is_of_any_system: equal ones of other systems are the same object.
        unread: codes of what is reported of it as not understood.
        unstated: what was found of endpoints that state nothing: the value by policy, role, whether they were observed, and dialect.
    """

    values: Mapping[int, Value]
    texts: Mapping[str, str]
    unread: tuple[str, ...] = ()
    is_of_any_system: bool = False
    unstated: dict[tuple[int, str, bool, str], Value] = field(default_factory=dict)


class ReadContext(NamedTuple):
    """All that the meaning of an endpoint's own settings rests on.

    Attributes:
        asked: policies whose spelling is asked for.
    """

    pack: RulePack
    surroundings: Surroundings
    role: str
    dialect: str
    observed: bool
    asked: frozenset[int]


class OwnSetting:
    """A setting of an endpoint's own, read by itself.

    Attributes:
        recognised: what its name spells.
        remarks: on its name.
        is_of_any_system: equal ones of other systems are the same object, as it has little text.
        index: of the only policy that it changes, to a known value and without any remark; -1 where it is not so.
        value, word, on_value: of the only policy that it states, with remarks on the value.
    """

    __slots__ = ("index", "is_of_any_system", "on_value", "recognised", "remarks", "value", "word")

    def __init__(self, recognised: Recognised, remarks: tuple[Remark, ...], *, is_of_any_system: bool) -> None:
        """Take what its name spells."""
        self.recognised = recognised
        self.remarks = remarks
        self.is_of_any_system = is_of_any_system
        self.index = _NONE
        self.value: Value = 0
        self.word: WrittenValue | None = None
        self.on_value: tuple[Remark, ...] = ()

    def take(self, index: int, value: Value, word: WrittenValue | None, on_value: tuple[Remark, ...]) -> None:
        """Take the value of the only policy that it states."""
        self.value, self.word, self.on_value = value, word, on_value
        said = self.remarks or on_value or self.recognised.misread or self.recognised.refused
        if type(value) in KNOWN and word is not UNREAD and not said:
            self.index = index


INDEX_OF: Final = attrgetter("index")


class Laid(NamedTuple):
    """A profile, the layers that it came from, and what is to be reported of an endpoint that has both."""

    profile: QosProfile
    layers: tuple[Layer, ...]
    remarks: tuple[Remark, ...]


@dataclass(slots=True, eq=False)
class Inherited:
    """What an endpoint has before any settings of its own: a profile, and the layers around them.

    Attributes:
        number: stands for the context in keys.
        own: the type, where that is a policy.
        above: what wins over settings of its own.
        below: layers that these win over.
        fixed: policies that its own settings cannot change by a known value alone.
        remarks: by policy, which those replace that change it; or -1.
        memory: of `Laid`, by this, overlays and own settings.
    """

    context: ReadContext
    number: int
    profile: QosProfile
    above: Layer
    own: Mapping[int, Stated]
    below: tuple[Layer, ...]
    fixed: frozenset[int]
    remarks: tuple[tuple[int, Remark], ...]
    memory: dict[tuple[Any, ...], Any]
    size: int

    @property
    def is_of_any_system(self) -> bool:
        """Whether it rests on nothing that stands elsewhere in its system."""
        return self.memory is READ

    def takes(self, settings: Collection[OwnSetting]) -> bool:
        """Whether settings only put known values in the place of others, each of them its own, and nothing has to be said."""
        indices = {*map(INDEX_OF, settings)}
        return len(indices) == len(settings) and not self.remarks and self.fixed.isdisjoint(indices)

    def around(self, own: Mapping[int, Stated], unread: tuple[str, ...] = ()) -> tuple[Layer, ...]:
        """Return all layers, of which the endpoint's own settings are one."""
        return self.above, Layer("explicit", own, here="settings", unread=unread), *self.below

    def known(self, settings: Iterable[OwnSetting]) -> list[Any]:
        """Return what `QosProfile.known` is with settings that it takes."""
        known, size = [*self.profile.known], self.size
        for each in settings:
            index = each.index
            known[index], known[size + index] = each.value, each.word
        return known


READ: Final[dict[tuple[Any, ...], Any]] = {}
"""What endpoints inherit, and what that is with their own settings, of any system."""


class ProfileParts(NamedTuple):
    """A profile and its layers, not put together yet: most endpoints are judged without either.

    Attributes:
        settings: its own, which what it inherits takes.
        of_topic: what is stated of its topic.
    """

    inherited: Inherited
    settings: tuple[OwnSetting, ...]
    of_topic: tuple[Layer, ...]

    @property
    def known(self) -> Sequence[Any]:
        """What `QosProfile.known` will be."""
        return self.inherited.known(self.settings)

    def value(self, index: int) -> Value:
        """Return what will stand in `QosProfile.values`."""
        size = self.inherited.size
        for each in self.settings:
            if each.index == index % size:
                return each.value if index < size else each.word  # type: ignore[return-value]
        value: Value = self.inherited.profile.values[index]
        return value

    @property
    def changed(self) -> Mapping[int, OwnSetting]:
        """Its own settings, by policy; all else is inherited."""
        return {each.index: each for each in self.settings}

    def made(self) -> tuple[QosProfile, tuple[Layer, ...]]:
        """Return the profile and its layers."""
        inherited = self.inherited
        key = (inherited, (), *self.settings)
        found: Laid | None = inherited.memory.get(key)
        if found is None:
            own = {each.index: each.recognised.found[each.index] for each in self.settings}
            profile = inherited.profile.with_known(tuple(self.known))
            found = Laid(profile, inherited.around({**inherited.own, **own}), ())
            if all(each.is_of_any_system for each in self.settings):
                keep(inherited.memory, key, found)
        return found.profile, found.layers + self.of_topic
