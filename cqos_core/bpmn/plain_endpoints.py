"""What plain events of one document share; each is a row until one reads it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from cqos_core.bpmn.names import fold
from cqos_core.model.regular import re
from cqos_core.model.rows import FIRST_TEXT, Pattern, RowKind
from cqos_core.model.system import Place, ProfileRef

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.rows import LinesOf, Row
    from cqos_core.model.system import Endpoint

_NAME: Final = re.compile(rb'[ \t\r\n]name="([^"]*)"')


class Kind(RowKind):
    """Events that are alike. In their rows stands the byte at which the start tag ends.

    Attributes:
        tag: what the elements are.
        texts: those of settings of `endpoint` in whose place others stand.
    """

    __slots__ = ("lines", "tag", "texts")

    def __init__(self, endpoint: Endpoint, pattern: Pattern, lines: LinesOf, tag: str, texts: Sequence[str]) -> None:
        super().__init__(endpoint, pattern)
        self.lines = lines
        self.tag = tag
        self.texts = texts

    def of(self, participant: str) -> Kind:
        """Return the kind of such events of a participant."""
        return Kind(replace(self.endpoint, participant=participant), self.pattern, self.lines, self.tag, self.texts)

    def place(self, row: Row) -> Place:
        """See `RowKind.place`."""
        return Place(self.lines.source, self.lines.line(row[3]), None, row[1])

    def make(self, name: str, row: Row) -> Any:
        """See `RowKind.make`."""
        match name:
            case "label":
                found = _NAME.search(self.lines.data, self.lines.data.rindex(b"<", 0, row[3]), row[3])
                return found and (fold(found[1].decode()) or None)
            case "profiles":
                place = self.place(row)
                every = self.endpoint.profiles
                return tuple(ProfileRef(each.name, _moved(each.place, place), each.scope) for each in every)
            case "settings":
                place, texts = self.place(row), dict(zip(self.texts, row[FIRST_TEXT:], strict=True))
                return {
                    word: replace(each, text=texts.get(each.text, each.text), place=_moved(each.place, place))
                    for word, each in self.endpoint.settings.items()
                }
        return super().make(name, row)


def _moved(place: Place | None, to: Place) -> Place | None:
    return place and Place(to.source, to.line, None, to.element, place.path)


def pattern_of(endpoint: Endpoint, texts: Sequence[str]) -> Pattern:
    """Return the pattern of endpoints that have other texts in the place of ``texts``."""
    said = endpoint.said()
    return Pattern(said, [next(at for at, each in enumerate(said[0]) if each[1] == text) for text in texts])
