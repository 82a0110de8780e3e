"""What endpoints that differ in a few settings have in common is resolved once, and each puts in what it states.

Only what nothing has to be said of goes this way: settings with names and values that are known, each policy stated once.
For all else there is no answer here, and it is resolved as a whole.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.policy import ENDPOINT
from cqos_core.model.memory import MOST_LETTERS, keep, letters, remember
from cqos_core.model.system import Endpoint
from cqos_core.resolving.reader import ValueSource, how_written
from cqos_core.resolving.resolved import READ, Layer

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.language.values import Value, WrittenValue
    from cqos_core.model.system import Setting
    from cqos_core.resolving.reader import SettingsReader
    from cqos_core.resolving.resolved import QosProfile, ResolvedParticipant, Stated


class _Override(NamedTuple):
    """What one setting changes; without an index, nothing."""

    at: int | None
    stated: Stated | None = None
    value: Value = 0
    word: WrittenValue | None = None


class _Base(NamedTuple):
    """An endpoint that states nothing: its profile, and its layers around its own settings; what its overrides rest on."""

    profile: QosProfile
    room: tuple[Any, ...]
    above: tuple[Layer, ...]
    own: Mapping[int, Stated]
    below: tuple[Layer, ...]


_BASES: Final[dict[tuple[Any, ...], _Base | None]] = {}
_OVERRIDES: Final[dict[tuple[Any, ...], _Override | None]] = {}
_NOTHING: Final = _Override(None)


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
        stated: tuple[Any, ...],
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        topic_layers: tuple[Layer, ...],
    ) -> tuple[QosProfile, tuple[Layer, ...]] | None:
        """Return the profile and layers of an endpoint, None where it has to be resolved as a whole.

        Args:
            room: all that the values rest on beside the endpoint's own settings.
            stated: the same with these settings, to remember it by.
            endpoint: it has settings only: no profile, overlay or need.
            participant: to which it belongs.
            topic_layers: what is stated of its topic.
        """
        try:
            base = _BASES[room]
        except KeyError:
            base = self._base(room, endpoint, participant, topic_layers)
        if base is None:
            return None
        changes: dict[int, Any] = {}
        own: dict[int, Stated] = {}
        size = len(participant.pack.policies)
        length = 0
        for name, setting in endpoint.settings.items():
            text = setting.text
            if setting.unknown or setting.derived:
                return None
            length += len(name) + len(text)
            key = (base.room, name, text)
            try:
                override = _OVERRIDES[key]
            except KeyError:
                override = self._override(name, setting, endpoint, participant)
                remember(_OVERRIDES, key, override)
            if override is None:
                return None
            index, found, value, word = override
            if index is None or found is None:
                continue
            if index in own or index in base.own:
                return None
            own[index] = found
            changes[index] = value
            changes[size + index] = word
        layer = Layer("explicit", {**own, **base.own} if base.own else own, here=True)
        result = base.profile.with_values(changes), (*base.above, layer, *base.below)
        if length <= MOST_LETTERS:
            keep(READ, stated, result)
        return result

    def _base(
        self,
        room: tuple[Any, ...],
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        topic_layers: tuple[Layer, ...],
    ) -> _Base | None:
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
            base = _Base(profile, own_room, layers[:at], layers[at].settings, layers[at + 1 :])
        keep(_BASES, room, base)
        return base

    def _override(
        self, name: str, setting: Setting, endpoint: Endpoint, participant: ResolvedParticipant
    ) -> _Override | None:
        """Return what a setting changes, None where something has to be said of it."""
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
        return _Override(index, stated, value, how_written(policy, index, layers) if index in pack.asked else None)
