"""Values of endpoints in reports: their texts, and the options that decide the meaning of words."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from cqos_core.language.policy import ByOption, PerRole
from cqos_core.language.values import Anything, Depends, Value, is_plain
from cqos_core.model.caches import LONGEST_REMEMBERED, MAXIMUM_REMEMBERED
from cqos_core.model.finding import Fact
from cqos_core.resolving.reader import word_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.language.policy import Meaning, Policy
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved


def value_text(policy: Policy, value: Value, written: str | None) -> str:
    """Return the text of a value; an undetermined one is shown as written, with the options or causes that it depends on."""
    if isinstance(value, (Anything, Depends)):
        text = "" if written is None else written
        if isinstance(value, Anything):
            return "unknown" if not text or _is_value(policy, text) else text
        cases: dict[str, list[str]] = {}
        for name, case in value.cases:
            cases.setdefault(value_text(policy, case, None), []).append(name)
        itself = all(names == [shown] for shown, names in cases.items())
        listed = "; ".join(shown if itself else f"{shown} with {', '.join(names)}" for shown, names in cases.items())
        return f"{text} ({listed})" if text else f"undetermined ({listed})"
    return policy.format(value)


def _is_value(policy: Policy, text: str) -> bool:
    """Return whether a text stands for one value under all options."""
    meaning = policy.words.get(policy.domain.word(text))
    return policy.domain.read(text) is not None if meaning is None else isinstance(meaning, (str, PerRole))


def bare_fact(resolved: Resolved, value: Value, index: int) -> Fact:
    """Return the value of one policy of one endpoint, without origin and place."""
    policy = resolved.pack.policies[index]
    return Fact(policy.name, value_text(policy, value, None if is_plain(value) else resolved.written(index)), "")


def fact(resolved: Resolved, profile: QosProfile, index: int) -> Fact:
    """Return the value of one policy of one endpoint, with its origin and place."""
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


def options_in_words(endpoint: Resolved) -> frozenset[str]:
    """Return the options that decide the meaning of the endpoint's words, stated or by default."""
    pack, role, steered = endpoint.pack, endpoint.role, steered_by_options(endpoint.pack)
    if endpoint.wire_origin is not None:
        texts = {index: endpoint.written(index) or "" for index in steered}
    else:
        texts = {}
        for layer in (*endpoint.layers, *endpoint.participant.layers):
            if layer.settings:
                for index in steered:
                    if index not in texts and index in layer.settings:
                        texts[index] = layer.settings[index].text
    found = _by_default(pack, steered.difference(texts), role)
    for index, text in texts.items():
        behind = _remembered if len(text) <= LONGEST_REMEMBERED else options_behind
        if names := behind(pack, index, text, role):
            found = found.union(names)
    return found


@lru_cache
def _by_default(pack: RulePack, indices: frozenset[int], role: str) -> frozenset[str]:
    """Return the options that decide the defaults of policies."""
    return frozenset(name for index in indices for name in options_behind(pack, index, "", role))


def options_behind(pack: RulePack, index: int, text: str, role: str) -> tuple[str, ...]:
    """Return the options that decide the meaning of a policy's text, or of its default."""
    policy = pack.policies[index]
    word = word_of(policy, text or policy.default_for(role) or "")
    return tuple(_options_of(policy.words.get(word), role))


_remembered = lru_cache(maxsize=MAXIMUM_REMEMBERED)(options_behind)


@lru_cache
def steered_by_options(pack: RulePack) -> frozenset[int]:
    """Return the policies whose spelling depends on an option, and that a rule which sets verdicts reads."""
    verdicts = (
        each for each in pack.by_scope.get("pair", ()) if each.rule.kind == "requires" and not each.rule.guarantee
    )
    read = {use.index for bound in verdicts for use in bound.bound.uses}
    return frozenset(
        index
        for index in read
        if any(
            _options_of(meaning, role)
            for meaning in pack.policies[index].words.values()
            for role in pack.policies[index].roles
        )
    )


def _options_of(meaning: Meaning | None, role: str) -> Iterator[str]:
    if isinstance(meaning, PerRole):
        yield from _options_of(getattr(meaning, role), role)
    elif isinstance(meaning, ByOption):
        yield meaning.option
