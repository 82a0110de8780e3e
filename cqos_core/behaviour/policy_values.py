"""Values of policies that findings about behaviour ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.language.binding import bind
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import INFINITE

if TYPE_CHECKING:
    from cqos_core.language.expression import Condition
    from cqos_core.resolving.resolved import Resolved


def finite_value(end: Resolved, policy: str) -> int | None:
    """Return the value of a policy of an endpoint, None where it is infinite, not known, or the pack has no such policy."""
    indices = end.pack.vocabulary.indices
    if not policy or (ENDPOINT, policy) not in indices:
        return None
    value = end.profile.values[indices[ENDPOINT, policy]]
    return value if isinstance(value, int) and value < INFINITE else None


def is_one_of(end: Resolved, meaning: tuple[str, tuple[str, ...]]) -> bool | None:
    """Return whether a policy of an endpoint has one of some values; None where that is not known."""
    name, texts = meaning
    if not name:
        return False
    value = end.profile.values[end.pack.vocabulary.indices[ENDPOINT, name]]
    domain = end.pack.policy(name).domain
    return value in {domain.parse(text) for text in texts} if isinstance(value, (int, str)) else None


def _may_be_kept(end: Resolved) -> bool:
    """Whether samples may be kept for subscribers that come later, as far as one end says."""
    return not end.pack.timing.kept[0] or _keeps(end) is not False


def _keeps(end: Resolved) -> bool | None:
    kept = end.pack.timing.kept
    return True if kept[0] and end.role not in end.pack.policy(kept[0]).roles else is_one_of(end, kept)


def keep_for_late_joiners(publisher: Resolved, subscriber: Resolved) -> bool | None:
    """Return whether both ends keep samples for a subscription that comes later; None where that is not known."""
    timing = publisher.pack.timing
    answers = {_keeps(publisher), _keeps(subscriber), _judged(timing.replayed, publisher, subscriber)}
    return False if False in answers else None if None in answers else True


def storage_time(publisher: Resolved, subscriber: Resolved) -> int | None:
    """Return for how long an intermediary keeps samples for later subscriptions; None where nothing limits it for certain."""
    timing = publisher.pack.timing
    return finite_value(publisher, timing.kept_for) if _judged(timing.expires, publisher, subscriber) else None


def _judged(condition: Condition | None, publisher: Resolved, subscriber: Resolved) -> bool | None:
    if condition is None:
        return True
    values = publisher.profile.values, subscriber.profile.values
    return bind(condition, publisher.pack.vocabulary).judge(*values).result


def required_value(end: Resolved, word: str) -> int | None:
    """Return what an endpoint requires of a guarantee, None where it requires nothing or that is not known."""
    index, nothing = end.pack.needs.get(word, (None, None))
    value = None if index is None else end.profile.values[index]
    return value if isinstance(value, int) and value != nothing else None
