"""What events share that are rows until one reads them, and where they stand."""

from __future__ import annotations

from array import array
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cqos_core.bpmn.names import fold
from cqos_core.model.endpoint_rows import FIRST_TEXT, RowPattern, SettingsPattern
from cqos_core.model.settings import Place
from cqos_core.model.system import ProfileRef

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.importers.xml_source import StartTags
    from cqos_core.model.endpoint_rows import Row
    from cqos_core.model.system import Endpoint


class EventPlaces:
    """Where the events of a document stand that are rows; in these are their numbers here.

    Attributes:
        labels: their names as they are written.
        numbers: of their start tags in the document.
    """

    __slots__ = ("_source", "_tags", "labels", "numbers")

    def __init__(self, source: str, tags: StartTags | None) -> None:
        """Take the name of the document, and its start tags; None: places have no lines."""
        self.labels: list[str | None] = []
        self.numbers = array("L")
        self._source, self._tags = source, tags

    def place(self, row: Row) -> Place:
        """Return the place of one."""
        line = None if self._tags is None else self._tags.line(self.numbers[row[3]])
        return Place(self._source, line, None, row[1])


class EventKind(RowPattern):
    """Events that are alike.

    Attributes:
        tag: what the elements are.
    """

    __slots__ = ("_places", "_settings", "tag")

    def __init__(self, endpoint: Endpoint, settings: Sequence[str], tag: str, places: EventPlaces) -> None:
        """Take what one of them states, and the names of the settings whose texts are in the rows."""
        said = endpoint.setting_texts()
        names = [name for name, *_ in said[0]]
        super().__init__(endpoint, SettingsPattern(said, [names.index(each) for each in settings]))
        self.tag = tag
        self._settings, self._places = settings, places

    def place(self, row: Row) -> Place:
        """See `RowPattern.place`."""
        return self._places.place(row)

    def make(self, name: str, row: Row) -> Any:
        """See `RowPattern.make`."""
        match name:
            case "label":
                return fold(self._places.labels[row[3]]) or None
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
