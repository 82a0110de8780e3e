"""Endpoints that state what others of their file state: each has what is its own, and makes settings and places when they are asked for."""

from __future__ import annotations

from dataclasses import fields
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

from cqos_core.bpmn.names import fold
from cqos_core.model.lazy_endpoint import LazyEndpoint
from cqos_core.model.regular import re
from cqos_core.model.system import Endpoint, Place, ProfileRef, Room, Setting

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.system import Said, Settings

_BLOCK: Final = 4096
_NAME: Final = re.compile(rb'[ \t\r\n]name="([^"]*)"')


class LinesOf:
    """Tells the line of any byte of a document. Of a long one no table of lines is kept; where they are not ``known``, it has none."""

    def __init__(self, source: str, data: bytes, *, known: bool = True) -> None:
        self.source = source
        self._data, self._known = data, known
        self._before: list[int] = []

    def line(self, offset: int) -> int | None:
        """Return the one-based line of the byte at ``offset``."""
        if not self._known:
            return None
        if not self._before:
            count = 1
            for start in range(0, len(self._data) + 1, _BLOCK):
                self._before.append(count)
                count += self._data.count(b"\n", start, start + _BLOCK)
        block = offset // _BLOCK
        return self._before[block] + self._data.count(b"\n", block * _BLOCK, offset)

    def name(self, offset: int) -> str | None:
        """Return the name of the element whose start tag ends at ``offset``."""
        found = _NAME.search(self._data, self._data.rindex(b"<", 0, offset), offset)
        return found and (fold(found[1].decode()) or None)


class Kind:
    """What endpoints of one file share that differ in texts of their settings, and in what each has for itself.

    Attributes:
        endpoint: one such endpoint, as its importer makes it.
        said: what `Endpoint.said` returns of it.
        tag: what their elements are.
        texts: those texts of it in whose place others stand.
        at: the settings with these texts, by their places in ``said``.
    """

    __slots__ = ("at", "endpoint", "lines", "said", "tag", "texts")

    def __init__(self, endpoint: Endpoint, lines: LinesOf, tag: str, texts: Sequence[str]) -> None:
        """Take an endpoint that is not changed any more."""
        self.endpoint = endpoint
        self.said = endpoint.said()
        self.texts = texts
        settings = self.said[0]
        self.at = [next(at for at, each in enumerate(settings) if each[1] == text) for text in texts]
        self.lines = lines
        self.tag = tag

    def says(self, texts: Sequence[bytes]) -> Said:
        """Return what `Endpoint.said` returns with other texts, in UTF-8."""
        settings = [*self.said[0]]
        for at, text in zip(self.at, texts, strict=True):
            name, _, unknown, derived = settings[at]
            settings[at] = (name, text.decode(), unknown, derived)
        return tuple(settings), self.said[1]


class Model(tuple[Any, ...]):
    """What endpoints of one file share that differ in id, label, topic, participant and place.

    It is a kind and texts, in UTF-8, in the place of those of the kind: a large diagram has as many models as events.
    """

    __slots__ = ()

    @property
    def _kind(self) -> Kind:
        kind: Kind = self[0]
        return kind

    @property
    def _texts(self) -> tuple[bytes, ...]:
        return tuple(self[1:])

    @property
    def pattern(self) -> tuple[Kind, tuple[bytes, ...]]:
        """What `Endpoint.pattern` returns."""
        return self[0], self[1:]

    @property
    def tag(self) -> str:
        """What the elements of the endpoints are."""
        return self._kind.tag

    @property
    def said(self) -> Said:
        """What `Endpoint.said` returns."""
        return self._kind.says(self._texts)

    def another(self, name: str, topic: str, offset: int) -> PlainEndpoint:
        """Return an endpoint like the model, whose start tag ends at the byte at ``offset``."""
        like = self._kind.endpoint
        made = PlainEndpoint.__new__(PlainEndpoint)
        made.settings = self
        made.offset = offset
        made.id = name
        made.role = like.role
        made.topic = topic
        made.participant = like.participant
        made._needs = made._overlay = None  # noqa: SLF001 - as an init does
        made.type = like.type
        made.kind = like.kind
        made.dialect = like.dialect
        made.observed = like.observed
        made.external = like.external
        made.topic_is_guess = like.topic_is_guess
        made.starts_after = like.starts_after
        made.template = like.template
        made.alternative = like.alternative
        made.protocol = like.protocol
        if not like.profiles:
            made.profiles = ()
        return made

    def make(self, of: PlainEndpoint, name: str) -> Any:
        """Return what an endpoint has not made yet: its label, its place, its room or its profiles."""
        lines = self._kind.lines
        if name == "label":
            return lines.name(of.offset)
        place = Place(lines.source, lines.line(of.offset), None, of.id)
        if name == "place":
            return place
        if name == "room":
            return Room(place)
        return tuple(
            ProfileRef(each.name, _moved(each.place, place), each.scope) for each in self._kind.endpoint.profiles
        )

    def settings(self, of: PlainEndpoint) -> Settings:
        """Return the settings of an endpoint, each with its place."""
        place = self.make(of, "place")
        texts = {each: text.decode() for each, text in zip(self._kind.texts, self._texts, strict=True)}
        return {
            word: Setting(
                texts.get(each.text, each.text),
                _moved(each.place, place),
                each.unknown,
                each.derived,
                each.reported,
            )
            for word, each in self._kind.endpoint.settings.items()
        }


def _moved(place: Place | None, to: Place) -> Place | None:
    return place and Place(to.source, to.line, None, to.element, place.path)


class PlainEndpoint(LazyEndpoint):
    """An `Endpoint` that also makes its label, profiles, place and room when one reads them."""

    __slots__ = ("offset",)
    written: Model
    offset: int

    def __getattr__(self, name: str) -> Any:
        """Make what is not there yet."""
        if name not in {"label", "profiles", "place", "room"}:
            raise AttributeError(name)
        made = self.written.make(self, name)
        setattr(self, name, made)
        return made

    @property
    def tag(self) -> str:
        """What the element is."""
        return self.written.tag

    def states_like(self, other: PlainEndpoint) -> bool:
        """Whether it is equal to another one but for its line, without making settings and places."""
        return self.said() == other.said() and _plainly(self) == _plainly(other)


_plainly: Final = attrgetter(
    *(each.name for each in fields(Endpoint) if each.name not in {"settings", "place", "room"})
)
"""All that is no place and no setting."""
