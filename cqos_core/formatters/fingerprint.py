"""Identities of findings that do not depend on lines or wording."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cqos_core.model.finding import Finding, Side


def fingerprint(finding: Finding) -> str:
    """Return a stable identity of ``finding``: of its rule, topic, endpoints and policies, never of lines or values.

    Instances of one template are one, however many there are, and so are the topics that they are on. A finding without
    endpoints is identified by the elements it points at, and only without these by its message.
    """
    sides = [_identity(side) for side in finding.sides]
    named = any(members or elements for _, members, elements, _ in sides)
    topic = None if any(side.templates for side in finding.sides) else finding.topic
    identity = [finding.code, topic, sides, None if named else finding.message]
    return hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:32]


def _identity(side: Side) -> tuple[str, list[str], list[str], list[str]]:
    place = side.place
    elements = [] if place is None or side.members else [place.element or place.path or ""]
    return (
        side.role,
        sorted(side.templates or side.members),
        [name for name in elements if name],
        [fact.policy for fact in side.facts],
    )
