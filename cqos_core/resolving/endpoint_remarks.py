"""Findings about endpoints with blanks for their name and places; they hold for all endpoints that state the same."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeAlias, TypeVar

from cqos_core.model.settings import Place, Setting

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.finding import Finding
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Endpoint

WHOSE: Final = "\0whose\0"
"""The blank for the name of the endpoint."""

Remark: TypeAlias = "tuple[tuple[object, ...] | None, Finding]"
"""A finding, with the cause that others may share."""
_Part = TypeVar("_Part")


class OwnPlace(Place):
    """The blank for a place: of the setting ``element`` among those that the attribute ``source`` of the endpoint has.

    Without a name it is the place of the endpoint itself; without a line it is that, too, where the setting has no place.
    """

    __slots__ = ()

    def of(self, endpoint: Endpoint) -> Place | None:
        """Return the place that an endpoint has there."""
        stated: Setting | None = getattr(endpoint, self.source).get(self.element) if self.element else None
        place = None if stated is None else stated.place
        if place is None:
            return endpoint.place if self.line is None else None
        if self.path is None:
            return place
        from cqos_core.model.excerpt import key_of

        return key_of(place, self.path[:-1])


OWN: Final = OwnPlace("")
"""The place of the endpoint itself."""


def with_blanks(settings: Mapping[str, Setting], attribute: str) -> Settings:
    """Return settings that an attribute of an endpoint has, with blanks for their places."""
    return {name: replace(each, place=OwnPlace(attribute, 1, 1, name)) for name, each in settings.items()}


def filled(remark: Remark, endpoint: Endpoint, identifier: str) -> Remark:
    """Return a remark about an endpoint that goes by an id."""
    cause, finding = remark
    owner = f"{endpoint.role} `{identifier}`"

    def fill(part: _Part) -> _Part:
        if isinstance(part, OwnPlace):
            return part.of(endpoint)  # type: ignore[return-value]
        return part.replace(WHOSE, owner, 1) if isinstance(part, str) else part  # type: ignore[return-value]

    sides = [
        replace(
            side,
            members=tuple([identifier if member == WHOSE else member for member in side.members]),
            place=fill(side.place),
        )
        for side in finding.sides
    ]
    return (
        None if cause is None else tuple(map(fill, cause)),
        replace(finding, message=fill(finding.message), sides=tuple(sides)),
    )
