"""Comparison of the policies of two endpoints."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.policy import ENDPOINT, NEED
from cqos_core.model.caches import keep, number_of
from cqos_core.model.finding import Verdict
from cqos_core.model.report import PolicyComparison
from cqos_core.resolving.finding_facts import fact

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.parts import OwnSetting, ProfileParts
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

COMPARED: Final[dict[tuple[Any, ...], PolicyComparison | None]] = {}


def compare_policies(
    sides: Sequence[tuple[Resolved, QosProfile]], parts: Sequence[ProfileParts | None], spoken: Mapping[str, bool]
) -> Iterator[PolicyComparison]:
    """Yield one line per endpoint policy and stated fact, with the verdict of the pair rules that compare it.

    Args:
        sides: a publisher and a subscriber, each with its values.
        parts: of both, where the two are alone: then lines are remembered that no speaking rule reads.
        spoken: by code of the rules that report, whether that leaves the pair open.
    """
    alike = [_alike(resolved, each) for (resolved, _), each in zip(sides, parts, strict=False)]
    remembered = len(alike) == len(sides) and None not in alike
    for index, codes in _comparing(sides[0][0].pack):
        key = (index, *[(first, changed.get(index)) for first, changed in filter(None, alike)])
        quiet = remembered and spoken.keys().isdisjoint(codes)
        if quiet and key in COMPARED:
            found = COMPARED[key]
        else:
            found = _comparison(index, codes, sides, spoken)
            if quiet:
                keep(COMPARED, key, found)
        if found is not None:
            yield found


def _alike(end: Resolved, parts: ProfileParts | None) -> tuple[int, Mapping[int, OwnSetting]] | None:
    """Return a number for the part that an end shares with others, and its own settings; None if places or long texts are its own."""
    if parts is None or not parts.inherited.is_of_any_system or end.endpoint.place is not None:
        return None
    changed, around = parts.changed, (*parts.of_topic, *end.participant.layers)
    own = (*end.endpoint.settings.values(), *end.endpoint.overlay.values())
    stated = (*own, *(each.setting for of in around for each in of.settings.values()))
    long = not all(each.is_of_any_system for each in changed.values())
    if long or any(each.place is not None for each in stated):
        return None
    return number_of((parts.inherited, *[(layer.origin, layer.texts) for layer in around])), changed


def _comparison(
    index: int, codes: tuple[str, ...], sides: Sequence[tuple[Resolved, QosProfile]], spoken: Mapping[str, bool]
) -> PolicyComparison | None:
    """Compare both values of a policy; None of a fact that is stated nowhere."""
    (one, a), (other, b) = sides
    policy = one.pack.policies[index]
    offered, requested = fact(one, a, index), fact(other, b, index)
    if _is_fact(policy) and offered.origin == requested.origin == "default":
        return None
    said = [spoken[code] for code in codes if code in spoken]
    verdict = Verdict.COMPATIBLE if codes else None
    if said:
        verdict = Verdict.UNKNOWN if all(said) else Verdict.INCOMPATIBLE
    return PolicyComparison(policy.name, offered, requested, verdict, codes)


def _is_fact(policy: Policy) -> bool:
    """Whether a policy says something about the system that is no setting of an endpoint."""
    return policy.level != ENDPOINT or policy.default is None


@lru_cache
def _comparing(pack: RulePack) -> list[tuple[int, tuple[str, ...]]]:
    """Return the index of each endpoint policy, and of each fact that rules of pairs read, with the rules that compare it."""
    pairs = pack.by_scope.get("pair", ())
    read = {index for each in pairs for index in each.bound.indices}
    rules = [each for each in pairs if each.rule.kind == "requires" and not each.rule.guarantee]
    return [
        (index, tuple([each.rule.code for each in rules if index in each.bound.indices]))
        for index, policy in enumerate(pack.policies)
        if not _is_fact(policy) or (index in read and policy.level not in {NEED, "option"})
    ]
