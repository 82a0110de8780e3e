"""The QoS of one endpoint in the terms of ROS 2 itself: names of enumerations, nanoseconds, counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cqos_core.files.export import ExportEndpoint, endpoints_of_pack
from cqos_core.model.problems import InvalidValueError
from cqos_core.packs import ENDPOINT, INFINITE, Choice
from cqos_ros2.policies import (
    AVOID_CONVENTIONS,
    DEADLINE,
    DEPTH,
    DURABILITY,
    FROM_PUBLISHERS,
    HISTORY,
    LEASE,
    LIFESPAN,
    LIVELINESS,
    RELIABILITY,
    UNSPECIFIED,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.system import System
    from cqos_core.packs import Policy
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.layers import Layer
    from cqos_core.resolving.resolved_endpoint import Resolved

PROTOCOL: Final = "ros2"
QOS: Final = (
    HISTORY,
    DEPTH,
    RELIABILITY,
    DURABILITY,
    DEADLINE,
    LIFESPAN,
    LIVELINESS,
    LEASE,
    AVOID_CONVENTIONS,
)
"""What an `rmw_qos_profile_t` holds, in its order."""
DURATIONS: Final = frozenset(policy.name for policy in (DEADLINE, LIFESPAN, LEASE))
BEST_AVAILABLE: Final = "best_available"
BEST_AVAILABLE_NS: Final = 2**63 - 2
"""The duration that stands for best_available (rmw/types.h)."""
SYSTEM_DEFAULT: Final = "system_default"


@dataclass(frozen=True, slots=True)
class Value:
    """A value of a policy.

    Attributes:
        word: the name of an enumeration's value, None for numbers.
        number: nanoseconds, a count, or a flag as 0 or 1.
    """

    policy: Policy
    word: str | None = None
    number: int = 0


class NoValueError(Exception):
    """An endpoint has no value that ROS 2 can be given; the text says why."""


def stated(part: Resolved, policy: Policy) -> Value | None:
    """Return the stated value of a policy, or None; a default in a preset does not count as stated.

    Raises:
        NoValueError: it is no value that an endpoint can be created with.
    """
    layer = _layer(part, policy)
    if layer is None:
        return None
    value = _value(part, policy, layer)
    return value if layer.counts_as_stated or not is_rmw_default(value) else None


def effective(part: Resolved, policy: Policy) -> Value:
    """Return the value of a policy, or its default.

    Raises:
        NoValueError: it is no value that an endpoint can be created with, or was not reported by discovery.
    """
    layer = _layer(part, policy)
    if layer is not None:
        return _value(part, policy, layer)
    if part.endpoint.observed:
        raise NoValueError("discovery did not report it")
    return _read(policy, str(policy.default))


def is_rmw_default(value: Value) -> bool:
    """Whether a value is that of `rmw_qos_profile_default`, which needs no mention."""
    if value.policy.name in DURATIONS:
        return value.number in {0, INFINITE}
    if value.policy is AVOID_CONVENTIONS:
        return not value.number
    return value.policy is LIVELINESS and value.word in {LIVELINESS.default, SYSTEM_DEFAULT}


def _layer(part: Resolved, policy: Policy) -> Layer | None:
    """Return the nearest settings that give a policy a value, unless they are only assumed."""
    index = part.pack.find(ENDPOINT, policy.name)
    found = (each for each in part.layers if index in each.settings and each.overlay != "may_hold")
    layer = next(found, None)
    return None if layer is None or layer.assumed else layer


def _value(part: Resolved, policy: Policy, layer: Layer) -> Value:
    return _read(policy, layer.settings[part.pack.vocabulary.indices[ENDPOINT, policy.name]].text)


def _read(policy: Policy, text: str) -> Value:
    word = policy.domain.word(text)
    if word == FROM_PUBLISHERS:
        raise NoValueError("the bridge takes it from publishers")
    if policy.name in DURATIONS:
        return _duration(policy, text, word)
    if word == SYSTEM_DEFAULT and policy is DEPTH:
        return Value(policy, number=0)
    if word == "unknown":
        raise NoValueError("it is not known")
    if word in policy.words:
        return Value(policy, word)
    plain = _plain(policy, text)
    return (
        Value(policy, word=policy.domain.format(plain))
        if isinstance(policy.domain, Choice)
        else Value(policy, number=plain)
    )


def _duration(policy: Policy, text: str, word: str) -> Value:
    if word == BEST_AVAILABLE:
        return Value(policy, number=BEST_AVAILABLE_NS)
    # A zero is what says that a duration is not specified.
    return Value(policy, number=0 if word in UNSPECIFIED else _plain(policy, text))


def _plain(policy: Policy, text: str) -> int:
    try:
        return int(policy.domain.parse(text))  # type: ignore[arg-type]
    except InvalidValueError:
        raise NoValueError(f"`{text}` is none of its values") from None


def ros_endpoints(system: System, context: ExportContext, notes: dict[str, None]) -> Iterator[ExportEndpoint]:
    """Yield the endpoints of ROS 2, also those that are not to be written; note that there are others."""
    return endpoints_of_pack(PROTOCOL, system, context, notes)


def kind_of(each: ExportEndpoint) -> str:
    """What an endpoint is, for notes: ``a service server``."""
    kind = each.endpoint.kind.replace("_", " ")
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
