"""Hops over bridges, between who meets whom on either side of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cqos_core.pairing import apart
from cqos_core.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.resolved import Resolved
    from cqos_core.system import Bridge

Topics = dict[tuple[str, str], list["Resolved"]]
_LIVELINESS: Final = "liveliness"


@dataclass(frozen=True, slots=True, eq=False)
class Hop:
    """A link between resolved endpoints."""

    bridge: Bridge
    source: Resolved
    target: Resolved

    @property
    def carries_liveliness(self) -> bool:
        """Whether it stops publishing when its source is gone."""
        return _LIVELINESS in self.bridge.carries


class Meetings:
    """Who meets whom, whatever wire or key they meet on; an endpoint may be on several, as copies of itself."""

    def __init__(self, by_topic: Topics) -> None:
        """Find every copy of every endpoint."""
        self._copies: dict[str, list[tuple[Resolved, list[Resolved]]]] = {}
        for beside in by_topic.values():
            for endpoint in beside:
                self._copies.setdefault(endpoint.id, []).append((endpoint, beside))

    def copies(self, endpoint: Resolved) -> list[Resolved]:
        """Return an endpoint with its copies."""
        return [copy for copy, _ in self._copies.get(endpoint.id, ())]

    def beside(self, copy: Resolved) -> list[Resolved]:
        """Return all endpoints on the topic that an endpoint, or this copy of it, is on."""
        return next(beside for each, beside in self._copies[copy.id] if each is copy)

    def pairs(self, endpoint: Resolved) -> Iterator[tuple[Resolved, Resolved]]:
        """Yield publisher and subscriber of every pair that an endpoint is in."""
        for copy, beside in self._copies.get(endpoint.id, ()):
            for other in beside:
                if other.role == copy.role or (copy.is_copy and other.is_copy):
                    continue
                publisher, subscriber = (copy, other) if copy.role == PUBLISHER else (other, copy)
                if not apart(publisher.profile, subscriber.profile):
                    yield publisher, subscriber
