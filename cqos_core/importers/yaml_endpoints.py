"""Endpoints of system files: rows, where settings are all that an endpoint states of its own; objects, where it states more."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.importers import yaml_form as form
from cqos_core.importers.document_form import TextEntry, settings_at
from cqos_core.model.endpoint_rows import FIRST_TEXT, RowPattern, SettingsPattern, pattern_of
from cqos_core.model.settings import Place
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, ProfileRef, Room

if TYPE_CHECKING:
    from cqos_core.importers.document_form import Entry, Key, Member
    from cqos_core.model.endpoint_rows import Row
    from cqos_core.model.settings import Setting, Settings
    from cqos_core.model.system import Role

_IN_ROWS: Final = frozenset(key.name for key in (form.ID, form.TYPE, form.PROTOCOL, form.EXTERNAL, form.OBSERVED))
"""Keys that a row may have beside settings: its id, and keys with one value for all rows of a pattern."""


class Direction(NamedTuple):
    """A key whose value maps topics to endpoints, with their role and kind."""

    key: Key[dict[str, Member[list[Entry]]]]
    role: Role
    kind: str = "message"

    @property
    def word(self) -> str:
        """The role or kind in the ids of endpoints that state none."""
        return self.role if self.kind == "message" else self.kind


PUBLISHES: Final = Direction(form.PUBLISHES, PUBLISHER)
SUBSCRIBES: Final = Direction(form.SUBSCRIBES, SUBSCRIBER)
# A server receives requests, a client sends them; packs derive the topics from that.
DIRECTIONS: Final = (
    PUBLISHES,
    SUBSCRIBES,
    Direction(form.SERVES, SUBSCRIBER, "service_server"),
    Direction(form.CALLS, PUBLISHER, "service_client"),
    Direction(form.ACTION_SERVERS, SUBSCRIBER, "action_server"),
    Direction(form.ACTION_CLIENTS, PUBLISHER, "action_client"),
)


class YamlRowPattern(RowPattern):
    """Endpoints that are alike but for the texts of their settings.

    In their rows stands a tuple: the line and column of the endpoint, the line of its map, and the spots of its settings below that.
    """

    __slots__ = ("source",)

    def __init__(self, endpoint: Endpoint, pattern: SettingsPattern, source: str) -> None:
        super().__init__(endpoint, pattern)
        self.source = source

    def place(self, row: Row) -> Place:
        """See `RowPattern.place`."""
        line, column, *_ = row[3]
        return Place(self.source, line, column)

    def make(self, name: str, row: Row) -> Any:
        """See `RowPattern.make`."""
        if name != "settings":
            return super().make(name, row)
        _, _, line, *spots = row[3]
        names = [word for word, *_ in self.pattern.setting_texts[0]]
        return settings_at(self.source, line, names, row[FIRST_TEXT:], spots)


class Maker:
    """Makes endpoints of one participant, or of a group of it, and of one direction.

    Args:
        shared: the profiles of their group.
        observed: whether they are reported by a running system, where they do not say it.
        patterns: those of their system, by the names of settings.
    """

    def __init__(
        self,
        participant: str,
        direction: Direction,
        shared: tuple[ProfileRef, ...],
        patterns: dict[tuple[str, ...], SettingsPattern],
        *,
        observed: bool,
    ) -> None:
        self._participant = participant
        self._direction = direction
        self._shared = shared
        self._patterns = patterns
        self._observed = observed
        self._kinds: dict[object, YamlRowPattern] = {}

    def endpoint(self, stated: Entry, name: str, topic: str, place: Place) -> Endpoint | Row:
        """Return the endpoint of an entry, with an id."""
        if not stated.values.keys() <= _IN_ROWS:
            return self._object(stated, name, topic, stated.settings, place)
        if isinstance(stated, TextEntry):
            (names, texts, spots), line = stated.stated(), stated.node.line
        elif stated.settings:
            return self._object(stated, name, topic, stated.settings, place)
        else:
            names, texts, spots, line = (), (), (), None
        key: tuple[object, ...] = (names,)
        if stated.values:
            own = stated.get(form.TYPE), stated.get(form.PROTOCOL), stated.get(form.EXTERNAL), stated.get(form.OBSERVED)
            key = (names, *own)
        kind = self._kinds.get(key)
        if kind is None:
            like = self._object(stated, "", None, {}, place)
            kind = self._kinds[key] = YamlRowPattern(like, pattern_of(names, self._patterns), place.source)
        return (kind, name, topic, (place.line, place.column, line, *spots), *texts)

    def _object(self, stated: Entry, name: str, topic: str | None, settings: Settings, place: Place) -> Endpoint:
        _, role, kind = self._direction
        made = Endpoint(
            id=name,
            role=role,
            topic=topic,
            participant=self._participant,
            settings=settings,
            profiles=self._shared,
            kind=kind,
            observed=self._observed,
            place=place,
            room=Room(place),
        )
        if stated.values:
            own = stated.get(form.OBSERVED)
            made.profiles += profiles(stated)
            made.needs = stated.get(form.NEEDS) or {}
            made.type = stated.get(form.TYPE)
            made.observed = self._observed if own is None else own
            made.external = stated.get(form.EXTERNAL) or False
            made.starts_after = texts_of(stated, form.STARTS_AFTER)
            made.protocol = stated.get(form.PROTOCOL)
            made.label = stated.get(form.LABEL)
        return made


def profiles(entry: Entry) -> tuple[ProfileRef, ...]:
    """Return the profiles that an entry names."""
    return tuple([ProfileRef(name.text, name.place) for name in entry.get(form.PROFILE) or ()])


def texts_of(entry: Entry, key: Key[tuple[Setting, ...]]) -> tuple[str, ...]:
    """Return the texts that an entry lists at a key."""
    return tuple([text.text for text in entry.get(key) or ()])
