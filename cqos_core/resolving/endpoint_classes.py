"""Classes of endpoints that differ in ids, topics and settings only; their common part is looked up once."""

from __future__ import annotations

import re
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.caches import LONGEST_REMEMBERED, MOST_LETTERS, keep
from cqos_core.model.system import MESSAGE, PUBLISHER
from cqos_core.resolving.endpoint_values import stated
from cqos_core.resolving.profiles import conventional

if TYPE_CHECKING:
    from cqos_core.model.system import Endpoint
    from cqos_core.packs.topic_matching import Naming
    from cqos_core.resolving.parts import Inherited
    from cqos_core.resolving.resolved_endpoint import ResolvedParticipant

_NAMED: Final[dict[tuple[Any, ...], Naming]] = {}
_ALIKE: Final = attrgetter("kind", "dialect", "role", "observed", "type", "external", "starts_after")


def class_key(endpoint: Endpoint) -> tuple[Any, ...]:
    """Return the key of an endpoint's class, among endpoints of one participant."""
    key: tuple[Any, ...] = _ALIKE(endpoint)
    if endpoint.profiles or endpoint.overlay or endpoint.needs:
        profiles = tuple([(ref.name, ref.scope) for ref in endpoint.profiles])
        return (*key, profiles, stated(endpoint.overlay), stated(endpoint.needs))
    return key


class EndpointClass:
    """A class of endpoints that differ in ids, topics and settings only.

    Attributes:
        endpoint: one of them.
        owner: their participant.
        expands: each of them stands for others.
        needs_in_vain: they state needs, and only a subscriber has any.
        external: a missing partner is no finding.
        starts_after: what they and their participant are stated to start after.
        inherited: their profile and layers before their own settings, if these do not depend on topics.
    """

    __slots__ = (
        "_before",
        "_context",
        "_is_plain",
        "_longest",
        "_number",
        "conventions",
        "endpoint",
        "expands",
        "external",
        "inherited",
        "needs_in_vain",
        "owner",
        "starts_after",
    )

    def __init__(self, endpoint: Endpoint, owner: ResolvedParticipant) -> None:
        """Take one of them, and their participant."""
        self.endpoint, self.owner = endpoint, owner
        self.inherited: Inherited | None = None
        self.external = endpoint.external or owner.participant.external
        self.starts_after = (*endpoint.starts_after, *owner.participant.starts_after)
        self.conventions = conventional(owner.pack)
        meeting = owner.pack.topic_matching
        expanded = meeting.expand(endpoint)
        self.needs_in_vain = bool(endpoint.needs) and endpoint.role == PUBLISHER and endpoint.kind == MESSAGE
        self.expands = len(expanded) != 1 or expanded[0] is not endpoint
        self._number, self._context = owner.name_context(endpoint.kind, endpoint.dialect, endpoint.role)
        self._before = meeting.before(self._context) if meeting.match is None else None
        self._is_plain = re.compile(meeting.plain).fullmatch
        self._longest = min(LONGEST_REMEMBERED, meeting.longest or LONGEST_REMEMBERED)

    def plain_name(self, topic: str | None) -> str | None:
        """Return the resolved name of a topic if it has no problems; None if that takes a full resolution."""
        if self._before is None or topic is None:
            return None
        full = topic if self._is_plain(topic) else self._before + topic
        is_short = len(full) <= self._longest
        return full if is_short and self._is_plain(full) and not self.conventions.may_match(full) else None

    def named(self, topic: str) -> Naming:
        """Return the resolved form of a topic name."""
        key = self._number, topic
        naming = _NAMED.get(key)
        if naming is None:
            naming = self.owner.pack.topic_matching.resolve(topic, self._context)
            if self._number is not None and len(topic) + len(naming.shown) <= MOST_LETTERS:
                keep(_NAMED, key, naming)
        return naming
