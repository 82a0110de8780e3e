"""Growth of memory and traffic that a change of values causes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.behaviour.paths.budgets import StreamReader, history_of, stream_of
from cqos_core.behaviour.paths.delivery_paths import samples_pass
from cqos_core.behaviour.paths.link_facts import rate_text, size_text
from cqos_core.matching.judge import failed_match_conditions
from cqos_core.model.finding import plural

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.behaviour.paths.budgets import Stream
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.resolving.qos_profile import QosProfile

    Profiles = Mapping[int, QosProfile]

LEAST_FACTOR: Final = 2.0
"""A smaller growth is not reported."""
_MOST_PAIRS: Final = 500
"""The most pairs of groups for which the traffic of a topic is computed."""


class Memory(NamedTuple):
    """The most bytes that histories keep, None without limit, and the number of their endpoints."""

    size: int | None
    endpoints: int


class Traffic(NamedTuple):
    """The least and most bytes per second on a topic, with a copy for each receiver."""

    least: float
    most: float


def memory_of(groups: Iterable[EndpointGroup], profiles: Profiles) -> Memory | None:
    """Return the memory of endpoints with other profiles, given by the identity of their group; None if no size is stated."""
    total, count, limited = 0, 0, True
    for members in groups:
        own = [each for each in members.endpoints if not each.is_copy]
        kept = history_of(members.first, profiles.get(id(members), members.profile)) if own else None
        if kept is not None:
            count += len(own)
            limited = limited and kept.size is not None
            total += (kept.size or 0) * len(own)
    return Memory(total if limited else None, count) if count else None


def traffic_of(topic: MatchedTopic, profiles: Profiles) -> Traffic | None:
    """Return the traffic of a topic with other profiles of groups; None if its period or size is not stated.

    It includes headers if the implementations of all publishers are known.
    """
    if len(topic.publishers) * len(topic.subscribers) > _MOST_PAIRS:
        return None
    streams = []
    for members in topic.publishers:
        profile = profiles.get(id(members), members.profile)
        stream = stream_of(members.first, profile, _readers(topic.subscribers, profile, profiles))
        if stream is None:
            return None
        streams.append((stream, len(members.endpoints)))
    known = all(stream.wire() is not None for stream, _ in streams)
    least = sum(_rate(stream, known=known) * len(stream.receivers) * many for stream, many in streams)
    most = sum(_rate(stream, known=known) * len(stream.receivers | stream.perhaps) * many for stream, many in streams)
    return Traffic(least, most) if streams else None


def _rate(stream: Stream, *, known: bool) -> float:
    return (stream.wire() or 0.0) if known else stream.payload


def _readers(groups: Sequence[EndpointGroup], publisher: QosProfile, profiles: Profiles) -> Iterable[StreamReader]:
    for members in groups:
        profile = profiles.get(id(members), members.profile)
        if not failed_match_conditions(publisher, profile):
            passes = samples_pass(publisher, profile)
            yield from (StreamReader(each.endpoint.participant, profile, passes) for each in members.endpoints)


def growth_in_words(
    topic: MatchedTopic, changing: Sequence[EndpointGroup], before: Profiles, after: Profiles
) -> tuple[str, ...]:
    """Return in words the certain growth by a change of profiles: ``multiplies memory by 100: …``.

    The result is empty if a fact is missing. Traffic is left out if there was none before.
    """
    found = []
    kept = memory_of(changing, before)
    keeps = None if kept is None else memory_of(changing, after)
    if kept is not None and keeps is not None and (text := memory_growth(kept, keeps)):
        found.append(text)
    flowed = traffic_of(topic, before)
    flows = None if flowed is None else traffic_of(topic, after)
    if flowed is not None and flows is not None and 0 < flowed.most * LEAST_FACTOR <= flows.least:
        factor = f"{flows.least / flowed.most:.3g}"
        found.append(
            f"multiplies traffic of `{topic.shown}` by {factor}: {rate_text(flows.least)} with a copy for each "
            f"receiver, {rate_text(flowed.most)} before"
        )
    return tuple(found)


def memory_growth(before: Memory, after: Memory) -> str:
    """Return a growth of histories in words; empty if it is small."""
    if before.size is None or before.size == 0:
        return ""
    several = f" of {plural(after.endpoints, 'endpoint')}" if after.endpoints > 1 else ""
    if after.size is None:
        return f"removes the limit of memory: at most {size_text(before.size)}{several} before"
    if after.size < before.size * LEAST_FACTOR:
        return ""
    factor = f"{after.size / before.size:.3g}"
    return f"multiplies memory by {factor}: at most {size_text(after.size)}{several}, {size_text(before.size)} before"
