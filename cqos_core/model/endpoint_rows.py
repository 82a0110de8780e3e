"""Endpoints of large files as rows: a row has an endpoint's own values, and becomes an object when it is read.

A row begins with its pattern (shared with other rows), its id, its topic and its place. Then follow the texts of settings that differ
from those of other rows. It takes a sixth of the memory of an object with its settings, and its pattern is evaluated once.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import fields
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_core.model.system import Endpoint, Room

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from cqos_core.model.settings import Place, Settings, SettingTexts
    from cqos_core.model.system import System

Row: TypeAlias = "tuple[Any, ...]"
FIRST_TEXT: Final = 4
"""The place of the first text in a row."""


class SettingsPattern:
    """The settings that several endpoints have in common, with gaps for the texts that differ; compared by identity.

    Attributes:
        setting_texts: the `Endpoint.setting_texts` of one of the endpoints.
        at: the positions in it of the settings whose texts differ.
    """

    __slots__ = ("at", "setting_texts")

    def __init__(self, setting_texts: SettingTexts, at: list[int]) -> None:
        self.setting_texts = setting_texts
        self.at = at

    def says(self, texts: Iterable[str]) -> SettingTexts:
        """Return the `Endpoint.setting_texts` of an endpoint with other texts there."""
        settings = [*self.setting_texts[0]]
        for at, text in zip(self.at, texts, strict=True):
            name, _, unknown, derived = settings[at]
            settings[at] = (name, text, unknown, derived)
        return tuple(settings), self.setting_texts[1]


def pattern_of(names: tuple[str, ...], known: dict[tuple[str, ...], SettingsPattern]) -> SettingsPattern:
    """Return the pattern of settings with these names, whose texts all differ; ``known`` caches patterns."""
    found = known.get(names)
    if found is None:
        said = tuple([(name, "", "", False) for name in names]), ()
        found = known[names] = SettingsPattern(said, [*range(len(names))])
    return found


class RowPattern(ABC):
    """The part that rows of one file share; id, label, topic, place and the texts of some settings differ. Importers derive from it.

    Attributes:
        endpoint: an endpoint like theirs, which is not changed any more: no instance of a template, and no alternative.
        pattern: of its settings.
    """

    __slots__ = ("endpoint", "pattern")

    def __init__(self, endpoint: Endpoint, pattern: SettingsPattern) -> None:
        self.endpoint = endpoint
        self.pattern = pattern

    @abstractmethod
    def place(self, row: Row) -> Place | None:
        """Return where the endpoint that a row is stands; None where no file states it."""

    def make(self, name: str, row: Row) -> Any:
        """Return the label, the place, the room, the profiles or the settings of the endpoint that a row is."""
        if name not in {"place", "room"}:
            return getattr(self.endpoint, name)
        place = self.place(row)
        return place if name == "place" or place is None else Room(place)


class EndpointList(list[Endpoint]):
    """A list of endpoints. Those that were added as rows become objects, which stay, when one reads them."""

    __slots__ = ()

    def rows(self) -> Iterator[Endpoint | Row]:
        """Yield the endpoints, rows as rows."""
        return super().__iter__()

    def __getitem__(self, at: Any) -> Any:
        if isinstance(at, slice):
            return [self[each] for each in range(*at.indices(len(self)))]
        found: Any = super().__getitem__(at)
        if type(found) is tuple:
            self[at] = found = as_object(found)
        return found

    def __iter__(self) -> Iterator[Endpoint]:
        at = 0
        while at < len(self):
            yield self[at]
            at += 1

    def __radd__(self, _other: object) -> Any:
        self[:] = self[:]
        return NotImplemented  # the other list goes on, with objects: `+` makes a new one, `+=` changes it

    def __reduce__(self) -> tuple[Any, ...]:
        return list, ([*self],)


def _of_objects(name: str) -> Callable[..., Any]:
    """Return a method of lists that makes all rows objects first."""
    method = getattr(list, name)

    def of_objects(one: EndpointList, *given: Any, **named: Any) -> Any:
        for each in (one, *given):
            if isinstance(each, EndpointList):
                each[:] = each[:]
        return method(one, *given, **named)

    return of_objects


for _name in (
    "__add__",
    "__contains__",
    "__eq__",
    "__imul__",
    "__mul__",
    "__ne__",
    "__repr__",
    "__reversed__",
    "__rmul__",
):
    setattr(EndpointList, _name, _of_objects(_name))
for _name in ("copy", "count", "index", "pop", "remove", "sort"):
    setattr(EndpointList, _name, _of_objects(_name))


def add_rows(system: System, rows: Iterable[Endpoint | Row]) -> None:
    """Add endpoints to a system, rows as rows."""
    if not isinstance(system.endpoints, EndpointList):
        system.endpoints = EndpointList(system.endpoints)
    list.extend(system.endpoints, rows)  # type: ignore[misc]


def as_object(endpoint: Endpoint | Row) -> Endpoint:
    """Return an endpoint as an object."""
    if not isinstance(endpoint, tuple):
        return endpoint
    made = RowEndpoint.__new__(RowEndpoint)
    kind, made.id, made.topic, *_ = made.row = endpoint
    made._made, made.needs, made.overlay = None, {}, {}  # noqa: SLF001 - as an init does
    for put, get in _SHARED:
        put(made, get(kind.endpoint))
    if not kind.endpoint.profiles:
        made.profiles = ()
    return made


def id_of(endpoint: Endpoint | Row) -> str:
    """Return the id of an endpoint, which may be a row."""
    return endpoint[1] if isinstance(endpoint, tuple) else endpoint.id


def topic_of(endpoint: Endpoint | Row) -> str | None:
    """Return the topic of an endpoint, which may be a row."""
    return endpoint[2] if isinstance(endpoint, tuple) else endpoint.topic


def rows_of(endpoints: Iterable[Endpoint]) -> Iterator[Endpoint | Row]:
    """Yield endpoints, rows as rows."""
    return endpoints.rows() if isinstance(endpoints, EndpointList) else iter(endpoints)


def kinds_of(endpoints: Iterable[Endpoint]) -> Iterator[Endpoint]:
    """Yield at least one endpoint of each kind: of rows of one pattern only one."""
    if not isinstance(endpoints, EndpointList):
        yield from endpoints
        return
    kinds: dict[RowPattern, None] = {}
    for each in endpoints.rows():
        if type(each) is tuple:
            kinds[each[0]] = None
        else:
            yield each  # type: ignore[misc]
    for kind in kinds:
        yield kind.endpoint


class RowEndpoint(Endpoint):
    """An `Endpoint` that was a row. Its settings, label, profiles, place and room are made when one reads them."""

    __slots__ = ("_made", "row")
    row: Row
    _made: Settings | None

    def __getattr__(self, name: str) -> Any:
        """Make a field that is not set yet."""
        if name not in _MADE:
            raise AttributeError(name)
        setattr(self, name, self.row[0].make(name, self.row))
        return getattr(self, name)

    @property
    def settings(self) -> Settings:
        """Explicit settings."""
        if self._made is None:
            made: Settings = self.row[0].make("settings", self.row)
            self._made = made
        return self._made

    @settings.setter
    def settings(self, stated: Settings) -> None:
        self._made = stated

    def pattern(self) -> tuple[SettingsPattern, tuple[str, ...]] | None:
        """Return its pattern and its own texts; None once its settings are made and may be changed."""
        return None if self._made is not None or self.overlay else (self.row[0].pattern, self.row[FIRST_TEXT:])

    def setting_texts(self) -> SettingTexts:
        """See `Endpoint.setting_texts`; that of its row, until the settings are made and may be changed."""
        found = self.pattern()
        return super().setting_texts() if found is None else found[0].says(found[1])

    def states_like(self, other: RowEndpoint) -> bool:
        """Whether it is equal to another one but for its line, without making settings and places."""
        return self.setting_texts() == other.setting_texts() and _plainly(self) == _plainly(other)

    def __eq__(self, other: object) -> bool:
        """Compare as endpoints, however they were made."""
        if not isinstance(other, Endpoint):
            return NotImplemented
        return _values(self) == _values(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return repr(Endpoint(**_values(self)))

    def __reduce__(self) -> tuple[Any, ...]:
        return _endpoint, (_values(self),)


_MADE: Final = frozenset(("label", "profiles", "place", "room"))
_OWN: Final = frozenset(("id", "topic", "settings", "overlay", "needs", *_MADE))
_SHARED: Final = [
    (getattr(Endpoint, each.name).__set__, getattr(Endpoint, each.name).__get__)
    for each in fields(Endpoint)
    if each.name not in _OWN
]
_plainly: Final = attrgetter(
    *(each.name for each in fields(Endpoint) if each.name not in {"settings", "place", "room"})
)
"""All fields but places and settings."""


def _values(endpoint: Endpoint) -> dict[str, Any]:
    return {each.name: getattr(endpoint, each.name) for each in fields(Endpoint)}


def _endpoint(values: dict[str, Any]) -> Endpoint:
    return Endpoint(**values)
