"""Findings that the core itself reports, under its own codes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.finding import Finding, Severity, Side
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.finding import Remedy
    from cqos_core.model.settings import Place

VERBS: Final[dict[str, tuple[str, str]]] = {
    PUBLISHER: ("offers", "offer"),
    SUBSCRIBER: ("requests", "request"),
}
"""The verb of each role: third person, and imperative."""


def asks_less(remedy: Remedy) -> str:
    """Return how a fix that weakens the design does so: ``asks for less``, or ``promises less`` of a publisher."""
    return "promises less" if remedy.role == PUBLISHER else "asks for less"


def core_finding(
    code: str,
    message: str,
    *,
    place: Place | None = None,
    role: str = "system",
    members: Sequence[str] = (),
    help: str | None = None,  # noqa: A002 - the field's name
    topic: str | None = None,
    severity: Severity | None = None,
) -> Finding:
    """Make a finding of the core under one of its own codes."""
    from cqos_core.model.codes import CODES

    info = CODES[code]
    return Finding(
        code=code,
        name=info.name,
        severity=severity or Severity(info.severity),
        message=message,
        topic=topic,
        sides=(Side(role, tuple(members), place=place),),
        because=info.reason,
        help=help or info.help or None,
    )
