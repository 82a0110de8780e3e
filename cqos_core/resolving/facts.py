"""The values of endpoints as reports print them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.language.values import Anything, Depends, Value, is_plain
from cqos_core.model.report import Fact

if TYPE_CHECKING:
    from cqos_core.language.policy import Policy
    from cqos_core.resolving.resolved import QosProfile, Resolved


def value_text(policy: Policy, value: Value, written: str | None) -> str:
    """Print a value; what is undetermined is printed as it was written, with what it depends on."""
    if isinstance(value, (Anything, Depends)):
        text = "" if written is None else written
        if isinstance(value, Anything):
            return text or "unknown"
        cases: dict[str, list[str]] = {}
        for name, case in value.cases:
            cases.setdefault(value_text(policy, case, None), []).append(name)
        itself = all(names == [shown] for shown, names in cases.items())
        listed = "; ".join(shown if itself else f"{shown} with {', '.join(names)}" for shown, names in cases.items())
        return f"{text} ({listed})" if text else f"undetermined ({listed})"
    return policy.format(value)


def bare_fact(resolved: Resolved, value: Value, index: int) -> Fact:
    """The value of one policy of one endpoint, without origin and place."""
    policy = resolved.pack.policies[index]
    return Fact(policy.name, value_text(policy, value, None if is_plain(value) else resolved.written(index)), "")


def fact(resolved: Resolved, profile: QosProfile, index: int) -> Fact:
    """The value of one policy of one endpoint, with its origin and place."""
    policy = profile.pack.policies[index]
    origin, place = resolved.origin(index)
    value = profile.values[index]
    settled = resolved.profile is not profile and value != resolved.profile.values[index]
    written = resolved.written(index)
    return Fact(
        policy.name,
        value_text(policy, value, written),
        f"settled from {written}" if settled else origin,
        place,
    )
