"""The comparison that ROS 2 itself offers, `rmw_qos_profile_check_compatible`, to the letter.

It differs from the rules of this pack because it looks at what was written, not at what it means: nothing is
resolved, durations are compared field by field as they were written, and an unspecified duration (0) is not an
infinite one. Its three answers ok, warning and error are compatible, unknown and incompatible here.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from cqos_core.packs import (
    ENDPOINT,
    Anything,
    ByOption,
    Condition,
    Duration,
    Meaning,
    PerRole,
    Plain,
    Policy,
    by_option,
    define,
    flow,
    offered,
    requested,
    requires,
)
from cqos_ros2.policies import (
    DEADLINE,
    DURABILITY,
    FROM_FIRST,
    FROM_PUBLISHERS,
    FROM_SUBSCRIBERS,
    LEASE,
    LIVELINESS,
    MANUAL_BY_NODE,
    POLICIES,
    RELIABILITY,
    REPORTED_UNKNOWN,
    choice,
)
from cqos_ros2.rules import BOTH_BRIDGES, BOTH_ON_ZENOH, NAMES, REQUEST_OFFER

_FIELD: Final = 64
_SECOND: Final = 1_000_000_000
COPIED: Final[dict[str, Anything]] = {
    FROM_PUBLISHERS: Anything("the bridge takes it from the publishers on its other side"),
    FROM_SUBSCRIBERS: Anything("the bridge takes it from the subscriptions that it serves"),
    FROM_FIRST: Anything("the bridge takes it from the endpoint that is there first"),
}
_WORDS: Final[dict[str, Meaning]] = {
    "unspecified": "{sec: 0, nsec: 0}",
    "default": "{sec: 0, nsec: 0}",
    "system_default": "{sec: 0, nsec: 0}",
    "best_available": "{sec: 9223372036, nsec: 854775806}",
    **COPIED,
}


class RawDuration(Duration):
    """A duration as the two fields of `rmw_time_t`, compared one after the other and never carried over."""

    lowest = 0
    highest = 2 ** (2 * _FIELD) - 1

    def parse(self, text: str) -> int:
        """Read any duration; ``{sec, nsec}`` keeps its fields as they are."""
        total = super().parse(text)
        if not text.lstrip().startswith("{"):
            seconds, nanoseconds = divmod(total, _SECOND)
            return seconds << _FIELD | nanoseconds
        fields: dict[str, int] = {name[0]: min(int(number), 2**_FIELD - 1) for name, number in flow(text).items()}
        return fields.get("s", 0) << _FIELD | fields.get("n", 0)

    def format(self, value: Plain) -> str:
        """Print the two fields."""
        seconds, nanoseconds = divmod(int(value), 1 << _FIELD)  # type: ignore[arg-type]
        return f"{{sec: {seconds}, nsec: {nanoseconds}}}"


LEFT_OPEN: Final = Anything("it is `system_default`, which the reference check takes for any value")


def _undetermined(meaning: Anything, weak: str, strong: str) -> ByOption:
    """Anything, except under Zenoh, whose one warning does not ask about such values."""
    return by_option("rmw", otherwise=meaning, zenoh=PerRole(publisher=weak, subscriber=strong))


def _fits_everything(weak: str, strong: str) -> ByOption:
    """A value that no comparison mentions: the strongest offer and the weakest request, but nothing to Zenoh."""
    return by_option(
        "rmw",
        otherwise=PerRole(publisher=strong, subscriber=weak),
        zenoh=PerRole(publisher=weak, subscriber=strong),
    )


def _raw_kind(policy: Policy, weak: str, strong: str, *unmentioned: str) -> Policy:
    words = {word: _fits_everything(weak, strong) for word in ("best_available", *unmentioned)}
    words |= {"unknown": _undetermined(REPORTED_UNKNOWN, weak, strong)}
    words |= {"system_default": _undetermined(LEFT_OPEN, weak, strong)}
    # A bridge that has not asked its publishers yet: no profile of rmw has such a value.
    words |= {word: _undetermined(meaning, weak, strong) for word, meaning in COPIED.items() if word in policy.words}
    return replace(policy, words=words, enforced={})


def _raw_duration(policy: Policy) -> Policy:
    words = {word: meaning for word, meaning in _WORDS.items() if word in policy.words}
    return replace(policy, domain=RawDuration(), words=words, zero=None, default="unspecified", enforced={})


RAW: Final = {
    "reliability": _raw_kind(RELIABILITY, "best_effort", "reliable"),
    "durability": _raw_kind(DURABILITY, "volatile", "transient_local"),
    "liveliness": _raw_kind(
        # The reference has no clause for manual_by_node.
        replace(LIVELINESS, domain=choice("liveliness", "automatic", "manual_by_topic", **MANUAL_BY_NODE)),
        "automatic",
        "manual_by_topic",
        "manual_by_node",
    ),
    "deadline": _raw_duration(DEADLINE),
    "liveliness_lease_duration": _raw_duration(LEASE),
}
RAW_POLICIES: Final = tuple(RAW.get(p.name, p) if p.level == ENDPOINT else p for p in POLICIES)


def _raw_durations_fit(policy: Policy) -> Condition:
    fits = (requested(policy) == 0) | ((offered(policy) != 0) & (offered(policy) <= requested(policy)))
    return define(f"{policy.name}_fits", fits)


DURATIONS: Final = {"ROS103": _raw_durations_fit(DEADLINE), "ROS105": _raw_durations_fit(LEASE)}
RAW_RULES: Final = (
    *(
        replace(
            rule,
            condition=BOTH_ON_ZENOH | BOTH_BRIDGES | DURATIONS.get(rule.code, rule.condition),
            clause="rmw_dds_common, qos_profile_check_compatible",
        )
        for rule in REQUEST_OFFER
    ),
    requires(
        ~(BOTH_ON_ZENOH & (offered(DURABILITY) == "transient_local") & (requested(DURABILITY) == "volatile")),
        code="ROS201",
        name="history-not-requested",
        because="the publisher keeps samples for late subscriptions, but this one does not ask for them",
        clause="rmw_zenoh, rmw_qos_profile_check_compatible",
        severity="warning",
        doubt=True,
    ),
    *NAMES,
)
