"""Values of policies that findings about behaviour ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.language.binder import bind
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import INFINITE

if TYPE_CHECKING:
    from cqos_core.language.expression import Condition
    from cqos_core.resolving.resolved_endpoint import Resolved


def finite_value(end: Resolved, policy: str) -> int | None:
    """Return the value of a policy of an endpoint; None if it is infinite, unknown, or no policy of the pack."""
    indices = end.pack.vocabulary.indices
    if not policy or (ENDPOINT, policy) not in indices:
        return None
    value = end.profile.values[indices[ENDPOINT, policy]]
    return value if isinstance(value, int) and value < INFINITE else None


def is_one_of(end: Resolved, meaning: tuple[str, tuple[str, ...]]) -> bool | None:
    """Whether a policy of an endpoint has one of some values; None if not known."""
    name, texts = meaning
    if not name:
        return False
    value = end.profile.values[end.pack.vocabulary.indices[ENDPOINT, name]]
    domain = end.pack.policy(name).domain
    return value in {domain.parse(text) for text in texts} if isinstance(value, (int, str)) else None


def may_be_kept(end: Resolved) -> bool:
    """Whether one end may keep samples for late joiners."""
    return not end.pack.timing.kept[0] or _keeps(end) is not False


def _keeps(end: Resolved) -> bool | None:
    kept = end.pack.timing.kept
    return True if kept[0] and end.role not in end.pack.policy(kept[0]).roles else is_one_of(end, kept)


def keep_for_late_joiners(publisher: Resolved, subscriber: Resolved) -> bool | None:
    """Whether both ends keep samples for late joiners; None if not known."""
    timing = publisher.pack.timing
    answers = {_keeps(publisher), _keeps(subscriber), _judged(timing.replayed, publisher, subscriber)}
    return False if False in answers else None if None in answers else True


def storage_time(publisher: Resolved, subscriber: Resolved) -> int | None:
    """Return how long an intermediary keeps samples for late joiners; None without certain limit."""
    timing = publisher.pack.timing
    return finite_value(publisher, timing.kept_for) if _judged(timing.expires, publisher, subscriber) else None


def _judged(condition: Condition | None, publisher: Resolved, subscriber: Resolved) -> bool | None:
    if condition is None:
        return True
    values = publisher.profile.values, subscriber.profile.values
    return bind(condition, publisher.pack.vocabulary).judge(*values).result


def required_value(end: Resolved, word: str) -> int | None:
    """Return the value that an endpoint requires of a guarantee; None if nothing or unknown."""
    index, nothing = end.pack.needs.get(word, (None, None))
    value = None if index is None else end.profile.values[index]
    return value if isinstance(value, int) and value != nothing else None
