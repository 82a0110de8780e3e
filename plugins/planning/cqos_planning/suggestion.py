"""The weakest settings that meet all requirements, for endpoints that have none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.language.policy import ENDPOINT
from cqos_core.model.system import SUBSCRIBER
from cqos_planning.checked_system import checked
from cqos_planning.constraints import Goals
from cqos_planning.search import Search, accepted_of, quietest

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.analysis.plan import RepairPlan
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.system import System
    from cqos_core.resolving.resolved_endpoint import Resolved


def find_suggestion(
    sources: Mapping[str, bytes],
    read: Callable[[Mapping[str, bytes]], System],
    context: CheckContext,
    *,
    importer: str | None = None,
) -> RepairPlan:
    """Find the weakest settings that meet all requirements, for endpoints that state no settings.

    These are the subscribers with requirements, the publishers on their topics, and what their participants leave unstated.

    Args:
        sources: the texts, by name.
        read: reads texts as one system.
        context: the packs, and what is assumed where the system says nothing.
        importer: reads all texts, if given.

    Raises:
        CqosError: OR-tools is not installed, or found no answer in time.
    """
    before = checked(read(sources), context)
    topics = before.pipeline.topics
    active = [key for key, endpoints in topics.items() if _asks(endpoints)]
    accepted = accepted_of(before.report)

    def search(*severities: str, partial: bool) -> Search:
        goals = Goals(decide=True, severities=frozenset(severities), excused=accepted)
        return Search(sources, read, context, importer, before, goals, [*active], may=is_open, partial=partial)

    # Without any warning if that is possible.
    found = quietest(search("error", "warning", partial=False), everything=True)
    return found if found.confirmed else quietest(search("error", partial=True), everything=True)


def _asks(endpoints: list[Resolved]) -> bool:
    """Whether any subscriber has requirements, and any endpoint has no settings."""
    return any(each.profile.needs for each in endpoints if each.role == SUBSCRIBER) and any(map(_is_bare, endpoints))


def _is_bare(endpoint: Resolved) -> bool:
    """Whether an endpoint states no setting; facts about its program are none."""
    policies = endpoint.pack.policies
    return not any(
        policies[index].level == ENDPOINT and policies[index].default is not None and not policies[index].derived
        for layer in endpoint.layers
        if not layer.assumed
        for index in layer.settings
    )


def is_open(endpoint: Resolved, index: int) -> bool:
    """Whether a policy is of an endpoint without settings, or of a participant that leaves it unstated."""
    if not _is_bare(endpoint):
        return False
    level = endpoint.pack.policies[index].level
    stated = any(index in layer.settings for layer in endpoint.participant.layers if not layer.assumed)
    return level == ENDPOINT or (level == "participant" and not stated)
