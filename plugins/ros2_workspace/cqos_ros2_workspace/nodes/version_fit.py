"""Facts of one version of a package beside the sources of another one: the sources win where they were understood."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import takewhile
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.nodes.endpoint_templates import Filled

ANOTHER: Final = "another version"
"""The subject of what is known of another version than the one in the workspace."""
_SAME: Final = 2
"""How many parts of a version two of one distribution share: releases into a distribution change the last one only."""


class Fit(NamedTuple):
    """Which facts of a node file a package in the workspace takes.

    Attributes:
        distro: the distribution whose facts are the nearest.
        known: the version that these are of.
        there: the version in the workspace; empty where its `package.xml` has none.
        place: its `package.xml`.
        unread: why its sources were not read; empty where they were.
    """

    distro: str
    known: str
    there: str
    place: Place
    unread: str = ""

    @property
    def same(self) -> bool:
        """Whether the facts are of this version, save for its last part."""
        return _alike(self.known, self.there) >= _SAME


def fit(versions: Mapping[str, str], there: str, place: Place, distro: str) -> Fit:
    """Return which of some versions, by distribution, is the nearest to the one that is there.

    Args:
        versions: at least one, in the order of the distributions.
        there: the version in the workspace.
        place: of its `package.xml`.
        distro: the one that is stated; it is taken of several that are as near.
    """

    def nearness(each: str) -> tuple[int, int, bool]:
        alike = _alike(versions[each], there)
        numbers = [(*_numbers(text), *[0] * alike, 0)[alike] for text in (versions[each], there)]
        return alike, -abs(numbers[0] - numbers[1]), each == distro

    nearest = max(reversed([*versions]), key=nearness)
    return Fit(nearest, versions[nearest], there, place)


def _numbers(version: str) -> list[int]:
    return [int(each) for each in re.findall(r"\d{1,9}", version)]


def _alike(first: str, second: str) -> int:
    """Return how many leading parts two versions share."""
    return sum(
        1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(_numbers(first), _numbers(second), strict=False))
    )


def settled(
    known: Sequence[Filled], read: Sequence[Filled] | None, gaps: Sequence[Unknown], found: Fit, package: str
) -> tuple[list[Filled], list[Unknown]]:
    """Return the endpoints of a part and what is not known of it: as its sources say, with the known ones that they say nothing of.

    Where the sources name all endpoints of a type and direction, no known one of them stands beside them. Any other that only
    another version has lacks no partner, since this version may call it otherwise.

    Args:
        known: of another version.
        read: of the sources; None where they do not have the part.
        gaps: what is not known, of either.
        found: which version is known.
        package: its name.
    """
    said = {(each.direction, each.name) for each in read or () if isinstance(each.name, str)}
    open_types = {(each.direction, each.type) for each in read or () if not isinstance(each.name, str)}
    types = {(each.direction, each.type) for each in read or ()} - open_types
    kept = [
        replace(each, optional=True, doubtful=True)
        for each in known
        if (each.direction, each.name) not in said and (each.direction, each.type) not in types
    ]
    named = {(each.direction, each.type) for each in kept}
    optional = {(each.direction, each.name) for each in known if each.optional}
    endpoints = [
        replace(each, optional=each.optional or (each.direction, each.name) in optional)
        for each in read or ()
        if isinstance(each.name, str) or (each.direction, each.type) not in named
    ]
    if not kept:
        return endpoints, [*gaps]
    there = f"the workspace has {found.there or 'no version'}{f', and {found.unread}' if found.unread else ''}"
    return [*endpoints, *kept], [*gaps, Unknown(f"`{package}` {found.known} ({there})", found.place, ANOTHER)]
