"""What events share that were taken out of the tree of a document; each is a row until one reads it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cqos_core.bpmn.names import fold
from cqos_core.model.rows import FIRST_TEXT, Pattern, RowKind
from cqos_core.model.system import Place, ProfileRef

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.bpmn.taken import RowPlaces
    from cqos_core.model.rows import Row
    from cqos_core.model.system import Endpoint


class EventKind(RowKind):
    """Events that are alike. In their rows stands their number in the document.

    Attributes:
        tag: what the elements are.
    """

    __slots__ = ("_places", "_settings", "tag")

    def __init__(self, endpoint: Endpoint, settings: Sequence[str], tag: str, places: RowPlaces) -> None:
        """Take what one of them states, and the names of the settings whose texts are in the rows."""
        said = endpoint.said()
        names = [name for name, *_ in said[0]]
        super().__init__(endpoint, Pattern(said, [names.index(each) for each in settings]))
        self.tag = tag
        self._settings, self._places = settings, places

    def place(self, row: Row) -> Place:
        """See `RowKind.place`."""
        return self._places.place(row)

    def make(self, name: str, row: Row) -> Any:
        """See `RowKind.make`."""
        match name:
            case "label":
                return fold(self._places.events.labels[row[3]]) or None
            case "profiles":
                place = self.place(row)
                every = self.endpoint.profiles
                return tuple(ProfileRef(each.name, _moved(each.place, place), each.scope) for each in every)
            case "settings":
                place, texts = self.place(row), dict(zip(self._settings, row[FIRST_TEXT:], strict=True))
                return {
                    word: replace(each, text=texts.get(word, each.text), place=_moved(each.place, place))
                    for word, each in self.endpoint.settings.items()
                }
        return super().make(name, row)


def _moved(place: Place | None, to: Place) -> Place | None:
    return place and Place(to.source, to.line, None, to.element, place.path)
