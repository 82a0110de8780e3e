"""Values of a fleet that depend on assumptions, as columns that are constant under each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_bulk.forms import Column, whole
from cqos_core.language.values import Range, in_world, worlds_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.language.vocabulary import Vocabulary

_MOST_WORLDS: Final = 16


def worlds_of_ends(
    vocabulary: Vocabulary, ends: tuple[Mapping[int, Any], Mapping[int, Any]]
) -> list[dict[Column, Any]] | None:
    """Return the columns that depend on assumptions as constants, for each assignment of these.

    Args:
        vocabulary: of the pack.
        ends: of publishers and of subscribers, by index the values that depend on assumptions.

    Returns:
        One assignment without constants where nothing depends on any; None where there are too many.
    """
    worlds = worlds_of(value for end in ends for value in end.values())
    if worlds is None or len(worlds) > _MOST_WORLDS:
        return None
    found = []
    for world in worlds:
        constants: dict[Column, Any] = {}
        for second, end in enumerate(ends):
            for index, value in end.items():
                here = in_world(value, world)
                span: tuple[int | str, int | str] = whole(vocabulary.policies[index].domain)
                if isinstance(here, Range):
                    span = here
                elif isinstance(here, (int, str)):
                    span = (here, here)
                for most in (False, True):
                    constants[Column(bool(second), index, "value", most)] = span[most]
        found.append(constants)
    return found
