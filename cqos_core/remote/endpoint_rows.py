"""Endpoints of messages: rows, where settings are all that an endpoint states of its own; objects, where it states more."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos.v1 import system_pb2
from cqos_core.model.endpoint_rows import FIRST_TEXT, EndpointList, RowPattern, SettingsPattern, pattern_of
from cqos_core.model.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cqos_core.model.system import Endpoint

    _Read: TypeAlias = Callable[[system_pb2.Endpoint], Endpoint]

_FIELDS: Final = system_pb2.Endpoint.DESCRIPTOR.fields_by_name
_TOPIC, _LABEL, _SETTINGS = (_FIELDS[name] for name in ("topic", "label", "settings"))
_OWN: Final = frozenset((_FIELDS["id"], _TOPIC, _LABEL, _SETTINGS))
"""What each row states itself."""
_SHARED: Final = frozenset(
    _FIELDS[name]
    for name in (
        *("role", "participant", "type", "kind", "dialect"),
        *("observed", "external", "topic_is_guess", "protocol"),
    )
)
"""What is the same for all rows of a kind."""


class MessageKind(RowPattern):
    """Endpoints of one system that are alike but for their ids, topics, labels and the texts of their settings."""

    __slots__ = ()

    def place(self, row: tuple[Any, ...]) -> None:
        """Return None: no file states it."""

    def make(self, name: str, row: tuple[Any, ...]) -> Any:
        """See `RowPattern.make`."""
        if name == "label":
            return row[3]
        if name != "settings":
            return super().make(name, row)
        return {
            word: Setting(text)
            for (word, *_), text in zip(self.pattern.setting_texts[0], row[FIRST_TEXT:], strict=True)
        }


class EndpointRows:
    """Makes the endpoints of a system; ``read`` makes those that are no row."""

    def __init__(self, read: _Read) -> None:
        self._read = read
        self._kinds: dict[tuple[object, ...], MessageKind] = {}
        self._patterns: dict[tuple[str, ...], SettingsPattern] = {}

    def endpoint(self, message: system_pb2.Endpoint) -> Any:
        """Return the row that a message is, or an object where it states more than rows have."""
        own: dict[Any, Any] = {}
        shared = []
        for stated in message.ListFields():
            if stated[0] in _SHARED:
                shared.append(stated)
            elif stated[0] in _OWN:
                own[stated[0]] = stated[1]
            else:
                return self._read(message)
        texts = own.get(_SETTINGS, {})
        names = tuple(sorted(texts))
        alike = (names, *shared)
        kind = self._kinds.get(alike)
        if kind is None:
            like = system_pb2.Endpoint(**{field.name: value for field, value in shared})
            kind = self._kinds[alike] = MessageKind(self._read(like), pattern_of(names, self._patterns))
        return (kind, message.id, own.get(_TOPIC), own.get(_LABEL), *[texts[name] for name in names])


def endpoints_of(messages: Iterable[system_pb2.Endpoint], read: _Read) -> list[Endpoint]:
    """Return the endpoints of a system; ``read`` makes those that are no row."""
    return EndpointList(map(EndpointRows(read).endpoint, messages))
