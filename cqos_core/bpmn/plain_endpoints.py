"""Endpoints that state what others of their file state: each has what is its own, and makes settings and places when they are asked for."""

from __future__ import annotations

from dataclasses import fields
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.lazy_endpoint import LazyEndpoint
from cqos_core.model.system import Endpoint, Place, ProfileRef, Room, Setting

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.system import Said, Settings

_BLOCK: Final = 4096


class LinesOf:
    """Tells the line of any byte of a document. Of a long one no table of lines is kept; without ``data`` it has no lines."""

    def __init__(self, source: str, data: bytes | None) -> None:
        self.source = source
        self._data = data
        self._before: list[int] = []

    def line(self, offset: int) -> int | None:
        """Return the one-based line of the byte at ``offset``."""
        if self._data is None:
            return None
        if not self._before:
            count = 1
            for start in range(0, len(self._data) + 1, _BLOCK):
                self._before.append(count)
                count += self._data.count(b"\n", start, start + _BLOCK)
        block = offset // _BLOCK
        return self._before[block] + self._data.count(b"\n", block * _BLOCK, offset)


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


class Model:
    """What endpoints of one file share that differ in id, label, topic, participant and place."""

    __slots__ = ("_kind", "_texts")

    def __init__(self, kind: Kind, texts: tuple[bytes, ...]) -> None:
        """Take ``texts``, in UTF-8, in the place of those of a kind."""
        self._kind = kind
        self._texts = texts

    @property
    def pattern(self) -> tuple[Kind, tuple[bytes, ...]]:
        """What `Endpoint.pattern` returns."""
        return self._kind, self._texts

    @property
    def tag(self) -> str:
        """What the elements of the endpoints are."""
        return self._kind.tag

    @property
    def said(self) -> Said:
        """What `Endpoint.said` returns."""
        return self._kind.says(self._texts)

    def another(self, name: str, label: str | None, topic: str, offset: int) -> PlainEndpoint:
        """Return an endpoint like the model, whose place is the line of the byte at ``offset``."""
        like = self._kind.endpoint
        made = PlainEndpoint.__new__(PlainEndpoint)
        made.settings = self
        made.offset = offset
        made.id = name
        made.role = like.role
        made.topic = topic
        made.participant = like.participant
        made.overlay = {}
        made.needs = {}
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
        made.label = label
        if not like.profiles:
            made.profiles = ()
        return made

    def make(self, of: PlainEndpoint, name: str) -> Any:
        """Return what an endpoint has not made yet: its place, its room or its profiles."""
        lines = self._kind.lines
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
    """An `Endpoint` that also makes its profiles, place and room when one reads them."""

    __slots__ = ("offset",)
    written: Model
    offset: int

    def __getattr__(self, name: str) -> Any:
        """Make what is not there yet."""
        if name not in {"profiles", "place", "room"}:
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
