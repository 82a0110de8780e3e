"""What endpoints that differ in a few settings have in common is resolved once, and each puts in what it states.

Only what nothing has to be said of goes this way: settings with names and values that are known, each policy stated once.
For all else there is no answer here, and it is resolved as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any, Final, NamedTuple, TypeAlias, cast

from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import KNOWN, UNREAD, Value, WrittenValue
from cqos_core.model.dataclass import dataclass
from cqos_core.model.memory import LONGEST_REMEMBERED, MOST_LETTERS, keep, letters, number_of
from cqos_core.model.system import Cases, Endpoint, Setting
from cqos_core.resolving.reader import SettingsReader, ValueSource, how_written
from cqos_core.resolving.resolved import READ, Layer, QosProfile, Resolved, ResolvedParticipant, Stated

_Item: TypeAlias = "tuple[str, str, str | Cases, bool]"
"""A setting as `Endpoint.said` has it."""
_NOT_PLAINLY: Final = -1


class Override:
    """What one setting changes; without an index, nothing.

    Attributes:
        letters: how many its name and its text have.
        index: of the policy whose value and word it changes.
        stated: the setting after its name was recognised.
        plainly: the index, where it changes it to a value that is known; else `_NOT_PLAINLY`.
    """

    __slots__ = ("index", "letters", "plainly", "stated", "value", "word")

    def __init__(
        self,
        letters: int = 0,
        index: int | None = None,
        stated: Stated | None = None,
        value: Value = 0,
        word: WrittenValue | None = None,
    ) -> None:
        """Take what it changes."""
        self.letters = letters
        self.index = index
        self.stated = stated
        self.value = value
        self.word = word
        plainly = index is not None and type(value) in KNOWN and word is not UNREAD
        self.plainly: int = index if plainly else _NOT_PLAINLY  # type: ignore[assignment]


_NOTHING: Final = Override()
_PLAINLY: Final = attrgetter("plainly")


@dataclass(slots=True, eq=False)
class Base:
    """An endpoint that states nothing: its profile, and its layers around its own settings.

    Attributes:
        size: of the pack's vocabulary.
        room: the number of what its overrides rest on.
        fixed: where a setting changes more than its value and word, or meets another statement.
    """

    profile: QosProfile
    size: int
    room: int
    above: tuple[Layer, ...]
    own: Mapping[int, Stated]
    below: tuple[Layer, ...]
    fixed: frozenset[int]

    def is_plain(self, overrides: Collection[Override]) -> bool:
        """Whether overrides only put known values in the place of others, each of them its own."""
        indices = {*map(_PLAINLY, overrides)}
        return len(indices) == len(overrides) and self.fixed.isdisjoint(indices)

    def known(self, overrides: Iterable[Override]) -> list[Any]:
        """Return what `QosProfile.known` is of an endpoint with plain overrides."""
        known, size = [*self.profile.known], self.size
        for each in overrides:
            index = each.plainly
            known[index], known[size + index] = each.value, each.word
        return known

    def made(self, overrides: tuple[Override, ...]) -> tuple[QosProfile, tuple[Layer, ...]] | None:
        """Return the profile and layers of an endpoint with overrides; None where two of them meet."""
        key = (self, *overrides)
        found = READ.get(key)
        if found is not None:
            return found
        own = dict(self.own)
        changes: dict[int, Any] = {}
        for each in overrides:
            if each.index is None or each.stated is None:
                continue
            if each.index in own:
                return None
            own[each.index] = each.stated
            changes[each.index], changes[self.size + each.index] = each.value, each.word
        if self.is_plain(overrides):
            profile = self.profile.with_known(tuple(self.known(overrides)))
        else:
            profile = self.profile.with_values(changes)
        result = profile, (*self.above, Layer("explicit", own, here=True), *self.below)
        if sum([each.letters for each in overrides]) <= MOST_LETTERS:
            keep(READ, key, result)
        return result


class Draft(NamedTuple):
    """What an endpoint with plain overrides is made of; see `cqos_core.resolving.resolved.Unmade`.

    Attributes:
        of_topic: what is stated of its topic.
    """

    base: Base
    overrides: tuple[Override, ...]
    of_topic: tuple[Layer, ...]

    @property
    def known(self) -> Sequence[Any]:
        """Its values, put together anew."""
        return self.base.known(self.overrides)

    def value(self, index: int) -> Value:
        """Return the value of an override, or that of its base."""
        size = self.base.size
        for each in self.overrides:
            if each.plainly == index % size:
                return each.value if index < size else each.word  # type: ignore[return-value]
        value: Value = self.base.profile.values[index]
        return value

    @property
    def changed(self) -> Mapping[int, Override]:
        """Its overrides, by policy; all else is that of its base."""
        return {each.plainly: each for each in self.overrides}

    def made(self) -> tuple[QosProfile, tuple[Layer, ...]]:
        """Return the profile and its layers."""
        found = self.base.made(self.overrides)
        assert found is not None  # noqa: S101 - plain ones do not meet
        return found[0], found[1] + self.of_topic


_BASES: Final[dict[tuple[Any, ...], Base | None]] = {}
_OVERRIDES: Final[dict[tuple[int, _Item], Override | None]] = {}
"""By the number of a room, what a setting changes there; None where something has to be said of it."""


class Bases:
    """Resolves endpoints by what they have in common.

    Attributes:
        reader: reads on trial: where it has anything to report, there is no answer.
        resolve: resolves an endpoint as a whole, with that reader.
    """

    def __init__(
        self,
        reader: SettingsReader,
        resolve: Callable[[Endpoint, ResolvedParticipant, tuple[Layer, ...]], tuple[QosProfile, tuple[Layer, ...]]],
    ) -> None:
        """Take what resolves and reports nothing."""
        self.reader = reader
        self.resolve = resolve

    def read(
        self,
        room: tuple[Any, ...],
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        topic_layers: tuple[Layer, ...],
    ) -> Draft | tuple[QosProfile, tuple[Layer, ...]] | None:
        """Return the profile and layers of an endpoint, or a draft of them; None where it has to be resolved as a whole.

        Args:
            room: all that the values rest on beside the endpoint's own settings.
            endpoint: it has settings only: no profile, overlay or need.
            participant: to which it belongs.
            topic_layers: what is stated of its topic.
        """
        base = self.base(room, endpoint, participant, topic_layers)
        if base is None:
            return None
        overrides = self.overrides(base, endpoint.said()[0], endpoint, participant)
        if overrides is None:
            return None
        return Draft(base, overrides, topic_layers) if base.is_plain(overrides) else base.made(overrides)

    def base(
        self,
        room: tuple[Any, ...],
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        topic_layers: tuple[Layer, ...],
    ) -> Base | None:
        """Return what is known of endpoints like one before they state anything; None where that is nothing; see `read`."""
        try:
            return _BASES[room]
        except KeyError:
            return self._base(room, endpoint, participant, topic_layers)

    def overrides(
        self, base: Base, said: Iterable[_Item], endpoint: Endpoint, participant: ResolvedParticipant
    ) -> tuple[Override, ...] | None:
        """Return what settings change of a base, for any endpoint like this one; None where something has to be said of them."""
        number = base.room
        found = [_OVERRIDES.get((number, item)) or self._override(number, item, endpoint, participant) for item in said]
        return cast("tuple[Override, ...]", tuple(found)) if all(found) else None

    def redrafted(self, draft: Draft, of: Resolved, stated: Iterable[tuple[str, str]]) -> Draft | None:
        """Return the draft of what differs in settings, names and texts, from one that has a draft; None where it has none."""
        said = [(name, text, "", False) for name, text in stated]
        overrides = self.overrides(draft.base, said, of.endpoint, of.participant)
        if overrides is None or not draft.base.is_plain(overrides):
            return None
        return Draft(draft.base, overrides, draft.of_topic)

    def _base(
        self,
        room: tuple[Any, ...],
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        topic_layers: tuple[Layer, ...],
    ) -> Base | None:
        if letters(room) > MOST_LETTERS:
            return None
        bare = Endpoint(
            id="",
            role=endpoint.role,
            topic=endpoint.topic,
            participant=endpoint.participant,
            type=endpoint.type,
            dialect=endpoint.dialect,
            observed=endpoint.observed,
        )
        before = self.reader.remarks
        profile, layers = self.resolve(bare, participant, topic_layers)
        base = None
        if self.reader.remarks == before:
            own_room = (participant.surroundings, endpoint.role, endpoint.dialect, endpoint.observed)
            at = next(index for index, layer in enumerate(layers) if layer.origin == "explicit" and layer.here)
            above, own, below = layers[:at], layers[at].settings, layers[at + 1 :]
            size = len(participant.pack.policies)
            fixed = frozenset((_NOT_PLAINLY, *own, *(index % size for index in profile.frame.deciding)))
            base = Base(profile, size, number_of(own_room), above, own, below, fixed)
        keep(_BASES, room, base)
        return base

    def _override(
        self, room: int, item: _Item, endpoint: Endpoint, participant: ResolvedParticipant
    ) -> Override | None:
        """Return what a setting changes, None where something has to be said of it."""
        name, text, unknown, derived = item
        key = (room, item)
        if unknown or derived or _OVERRIDES.get(key, _NOTHING) is None:
            return None
        found = self._read(name, Setting(text), endpoint, participant)
        if len(name) + len(text) <= LONGEST_REMEMBERED:
            keep(_OVERRIDES, key, found)
        return found

    def _read(
        self, name: str, setting: Setting, endpoint: Endpoint, participant: ResolvedParticipant
    ) -> Override | None:
        """Read a setting by itself; None where something has to be said of it, or it changes several policies."""
        pack, role = participant.pack, endpoint.role
        dialect = pack.dialects.get(endpoint.dialect, pack.dialects.get("yaml"))
        before = self.reader.remarks
        found, unread = self.reader.recognise(pack, (ENDPOINT,), {name: setting}, dialect, role, role, [])
        if self.reader.remarks != before or unread or len(found) > 1:
            return None
        if not found:
            return _NOTHING
        ((index, stated),) = found.items()
        policy = pack.policies[index]
        layers = (Layer("explicit", found, here=True),)
        reading = ValueSource(role, layers, participant.values, dialect, role, observed=endpoint.observed)
        value = self.reader.value(pack, index, reading)
        if self.reader.remarks != before or role not in policy.roles:
            return None
        word = how_written(policy, index, layers) if index in pack.asked else None
        return Override(len(name) + len(setting.text), index, stated, value, word)
