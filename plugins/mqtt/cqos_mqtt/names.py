"""Topic names and filters as endpoints meet on them, and what is wrong with those that no broker takes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from cqos_core.model.system import PUBLISHER
from cqos_core.packs import NameContext, NameProblem, Naming
from cqos_mqtt.filters import bare, has_wildcards, matches, wrong_with_filter, wrong_with_name

PATTERN: Final = "pattern"
"""The kind of an endpoint that publishes to several topics with one known pattern."""


def resolve(written: str, context: NameContext) -> Naming:
    """Take a name as it is written: MQTT compares character by character."""
    publishing = context.role == PUBLISHER
    if publishing and context.kind != PATTERN:
        wrong, code, what = wrong_with_name(written), "MQTT602", "topic name"
    else:
        wrong, code, what = wrong_with_filter(written), "MQTT601", "filter"
    if wrong is None:
        return Naming(written, written)
    shown = written.encode("unicode_escape").decode() if not written.isprintable() else written
    advice = (
        "publish to each topic by its name" if publishing else "write `+` for one level, or end the filter with `#`"
    )
    advice = advice if has_wildcards(written) else ""
    return Naming(None, shown, (NameProblem(code, "error", f"{what} `{shown}` is not valid: {wrong}", advice),))


def is_filter(written: str) -> bool:
    """Whether a text is a valid filter."""
    return wrong_with_filter(written) is None


def is_topic(written: str) -> bool:
    """Whether a text is a valid name of a topic."""
    return wrong_with_name(written) is None


def hears(topic: str, filters: Sequence[str]) -> bool:
    """Whether some filter matches a topic."""
    return any(is_filter(written) and matches(written, topic) for written in filters)


def may_read(topic: str, readable: Sequence[str], unreadable: Sequence[str]) -> bool:
    """Whether a topic may be read; nothing readable means that nothing is known."""
    return (not readable or hears(topic, readable)) and not hears(topic, unreadable)


def without_case(key: str) -> str:
    """Return a name as it is without the difference of upper and lower case."""
    return bare(key).casefold()


def without_slashes(key: str) -> str:
    """Return a name as it is without slashes at its ends."""
    return bare(key).strip("/")


def without_dollar(key: str) -> str:
    """Return a name as it is without a `$` at its start."""
    return bare(key).removeprefix("$")
