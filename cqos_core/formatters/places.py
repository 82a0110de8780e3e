"""Exact places of findings, and source excerpts at them."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.model.excerpt import Excerpt
    from cqos_core.model.finding import Finding
    from cqos_core.model.settings import Place
    from cqos_core.model.style import Style


class Places:
    """Finds the columns that importers leave open, scanning each source once for all findings."""

    def __init__(self, findings: Iterable[Finding], sources: Mapping[str, bytes]) -> None:
        """Find the exact places of all values, sides and edits of ``findings``."""
        self._sources = sources
        places = [place for finding in findings for place in _places(finding)]
        self._exact: Mapping[Place, Place] = {}
        if places:
            from cqos_core.model.excerpt import exact

            self._exact = exact(places, sources)

    def exact(self, place: Place) -> Place:
        """Return ``place`` with its column, if the source tells it."""
        return self._exact.get(place, place)

    def excerpt(self, place: Place) -> Excerpt | None:
        """Return the line of ``place`` and the part to mark; None without source or line."""
        from cqos_core.model.excerpt import span

        return span(self.exact(place), self._sources)


def _places(finding: Finding) -> Iterator[Place]:
    for side in finding.sides:
        candidates = (side.place, *(fact.place for fact in side.facts))
        yield from (place for place in candidates if place is not None)
    for remedy in finding.remedies:
        yield from (edit.place for edit in remedy.edits)


def relative(source: str, style: Style) -> str:
    """Return the path of a source with slashes, relative to the folder of the run if it is below it."""
    if style.folder and source.startswith(style.folder.rstrip(os.sep) + os.sep):
        source = source[len(style.folder.rstrip(os.sep)) + 1 :]
    return source.replace(os.sep, "/").removeprefix("./")
