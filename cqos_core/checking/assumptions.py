"""The values that are assumed for options that a system leaves open, where a verdict or a finding rests on them."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.values import Depends, OneOf
from cqos_core.matching.judge import assuming, errors_that_read, refusing_values, refusing_worlds, unset_errors
from cqos_core.model.caches import keep
from cqos_core.model.finding import Severity
from cqos_core.model.report import Assumption
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.resolving.finding_facts import options_behind, options_in_words, steered_by_options
from cqos_core.resolving.parts import INDEX_OF

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from cqos_core.language.policy import Policy
    from cqos_core.matching.judge import UnsetErrors
    from cqos_core.model.finding import Finding
    from cqos_core.model.system import System
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.parts import OwnSetting
    from cqos_core.resolving.resolved_endpoint import Resolved, ResolvedParticipant


class _Open(NamedTuple):
    """An option with several values in play; ``partly``: the pack has further ones, which it does not assume."""

    name: str
    option: str
    values: tuple[str, ...]
    partly: bool


def assumptions(
    participants: Iterable[ResolvedParticipant],
    endpoints: Iterable[Resolved],
    paired: Iterable[str],
    findings: Iterable[Finding],
    packs: Mapping[str, RulePack],
) -> tuple[Assumption, ...]:
    """Return what is assumed for options on which verdicts, errors or warnings rest.

    ``paired`` are the ids of endpoints in pairs. A value under which an end of a pair cannot exist is not assumed.
    """
    owners = {*participants}
    opened = {id(owner): found for owner in owners if (found := tuple(_opened(owner)))}
    unset = {id(owner): options for owner in owners if (options := tuple(_unset(owner)))}
    every = [*endpoints] if opened or unset else []
    ends = cache(lambda: frozenset(paired))
    concerned = [each for each in every if id(each.participant) in opened]
    named: dict[str, _Open] = {}
    barred: dict[str, set[str]] = {}
    in_part = {owner: frozenset(each.name for each in found if each.partly) for owner, found in opened.items()}
    for each, read, refused in _of_pairs(concerned, ends, in_part, named.keys()):
        for option in opened[id(each.participant)]:
            without = {value for value in option.values if f"{option.name}={value}" in refused}
            barred.setdefault(option.name, set()).update(without)
            if without or (option.partly and option.option in read):
                named[option.name] = option
    partly = {option.name for found in opened.values() for option in found if option.partly}
    for bound, each in _of_findings(concerned, findings, packs) if partly - named.keys() else ():
        read = _read_by(bound, each)
        named |= {o.name: o for o in opened[id(each.participant)] if o.partly and o.option in read}
    for option, refused in _of_unset(every, ends, unset):
        named[option.name] = option
        barred.setdefault(option.name, set()).update(refused)
    return tuple(
        Assumption(name, tuple(value for value in named[name].values if value not in barred.get(name, ())))
        for name in sorted(named)
    )


def _unset(owner: ResolvedParticipant) -> Iterator[tuple[_Open, int]]:
    """Yield the options of few values that nothing states and for which the pack assumes none."""
    for option, at in _without_assumption(owner.pack):
        if not any(at in layer.settings for layer in owner.layers):
            yield option, at


@lru_cache
def _without_assumption(pack: RulePack) -> tuple[tuple[_Open, int], ...]:
    """The options that a pack assumes nothing for and that decide whether an end exists."""
    needed = {preset.needs[0] for preset in pack.presets.values() if preset.needs is not None}
    found = []
    for at, policy in enumerate(pack.policies):
        values = tuple(map(policy.domain.format, policy.domain.candidates()))
        assumed = policy.level != "option" or policy.default is not None or policy.assume
        read = (errors_that_read(pack, role, False, at) for role in (PUBLISHER, SUBSCRIBER))
        if values and not assumed and (policy.name in needed or any(read)):
            found.append((_Open(f"{pack.id}.{policy.name}", policy.name, values, partly=False), at))
    return tuple(found)


def _without_presets(endpoint: Resolved, option: str) -> frozenset[str]:
    """Return the values of an option under which a preset of an endpoint does not exist."""
    pack, found = endpoint.pack, set()
    for layer in endpoint.layers:
        preset = pack.presets.get(layer.origin.removeprefix("preset "))
        if preset is not None and preset.needs is not None and preset.needs[0] == option:
            domain = pack.policies[pack.vocabulary.indices["option", option]].domain
            found |= {domain.format(each) for each in domain.candidates() if each < domain.parse(preset.needs[1])}  # type: ignore[operator]
    return frozenset(found)


def _of_unset(
    endpoints: Iterable[Resolved], ends: Callable[[], frozenset[str]], unset: Mapping[int, Sequence[tuple[_Open, int]]]
) -> Iterator[tuple[_Open, frozenset[str]]]:
    """Yield the options that nothing states with values under which an end of a pair does not exist or is refused."""
    known: dict[tuple[object, ...], UnsetErrors] = {}
    for each in endpoints if unset else ():
        kin, frame = each.representative, each.like.frame
        for option, at in unset.get(id(each.participant), ()):
            key = frame, kin.role, kin.observed, at
            errors = known.get(key)
            if errors is None:
                errors = known[key] = unset_errors(each.pack, *key)
            refusing = errors.that_may_refuse(each.known)
            if (refusing or kin.profiles) and each.id in ends():
                refused = _without_presets(each, option.option) if kin.profiles else _NONE
                for bound in refusing:
                    refused |= refusing_values(each.pack, bound, kin.role, at, tuple(map(each.value, bound.bound.own)))
                if refused:
                    yield option, refused


def with_imported(found: tuple[Assumption, ...], system: System) -> tuple[Assumption, ...]:
    """Return assumptions with those that importers made, save for options that the system states."""
    if not system.assumed:
        return found
    named = {each.option: each.values for each in found}
    stated = {f"{pack}.{name}" for pack, settings in system.options.items() for name in settings}
    for option, values in system.assumed.items():
        if option not in stated:
            named[option] = tuple(each for each in named.get(option, values) if each in values)
    return tuple(Assumption(option, named[option]) for option in sorted(named))


def _opened(owner: ResolvedParticipant) -> Iterator[_Open]:
    for index, policy, name in _options(owner.pack):
        value = owner.values[index]
        if isinstance(value, Depends) and value.on == name:
            stated = any(index in layer.settings for layer in owner.layers)
            values = tuple(case for case, _ in value.cases)
            partly = not stated and len(values) < len(policy.domain.candidates())
            yield _Open(name, policy.name, values, partly)


@lru_cache
def _options(pack: RulePack) -> tuple[tuple[int, Policy, str], ...]:
    """The options of a pack that may have several values at a time."""
    return tuple(
        (index, policy, f"{pack.id}.{policy.name}")
        for index, policy in enumerate(pack.policies)
        if policy.level == "option"
        and (policy.assume or any(isinstance(each, OneOf) for each in policy.words.values()))
    )


def _of_pairs(
    concerned: Sequence[Resolved],
    ends: Callable[[], frozenset[str]],
    in_part: Mapping[int, frozenset[str]],
    named: AbstractSet[str],
) -> Iterator[tuple[Resolved, frozenset[str], frozenset[str]]]:
    """Yield ends of pairs with the options that their values rest on and the worlds without them, where either is of interest.

    Args:
        concerned: endpoints whose participant leaves options open.
        ends: the ids of endpoints in pairs.
        in_part: by identity of a participant, its open options for which the pack has further values.
        named: the options that are known already as the base of a verdict.
    """
    known: dict[tuple[Any, ...], frozenset[str]] = {}
    rules: dict[tuple[object, ...], bool] = {}
    for each in concerned:
        frame, role, observed = each.like.frame, each.representative.role, each.representative.observed
        refusing = rules.get((frame, role, observed))
        if refusing is None:
            refusing = rules[frame, role, observed] = bool(assuming(each.pack, frame, role, observed))
        if not refusing and in_part[id(each.participant)] <= named:
            continue
        read = _resting(each, known)
        refused = refusing_worlds(each.profile, role, observed) if refusing else _NONE
        if (read or refused) and each.id in ends():
            yield each, read, refused


def _resting(endpoint: Resolved, known: dict[tuple[Any, ...], frozenset[str]]) -> frozenset[str]:
    """Return the options on which values of an endpoint rest; where it has none of its own behind its texts, what it inherits says so."""
    parts = endpoint.parts
    memory = known
    key: tuple[Any, ...] = ()
    if parts is not None and not parts.of_topic and parts.inherited.is_of_any_system:
        own = parts.settings
        if _PLAIN.keys() >= {*own} or all(_is_plain(each, endpoint) for each in own):
            memory, key = _RESTING, (parts.inherited, *map(INDEX_OF, own))
    key = key or (endpoint.profile, id(endpoint.layers))
    found = memory.get(key)
    if found is None:
        found = keep(memory, key, options_in_words(endpoint) | _needed(endpoint))
    return found


def _is_plain(setting: OwnSetting, endpoint: Resolved) -> bool:
    """Whether no option stands behind the text of a setting."""
    if setting in _PLAIN:
        return True
    if not setting.is_of_any_system:
        return False
    pack, steered = endpoint.pack, setting.index in steered_by_options(endpoint.pack)
    if steered and options_behind(pack, setting.index, setting.recognised.found[setting.index].text, endpoint.role):
        return False
    return keep(_PLAIN, setting, value=True)


_PLAIN: Final[dict[OwnSetting, bool]] = {}
_RESTING: Final[dict[tuple[Any, ...], frozenset[str]]] = {}
_NONE: Final[frozenset[str]] = frozenset()


def _needed(endpoint: Resolved) -> frozenset[str]:
    """The options that decide whether an endpoint gets what it needs."""
    guaranteed = (bound for word in endpoint.profile.needs for bound in endpoint.pack.guaranteed.get(word, ()))
    return frozenset(name for bound in guaranteed for name in _options_read(bound))


def _options_read(bound: BoundRule) -> Iterator[str]:
    """Yield the options that a rule reads, or that say whether what it reads is enforced."""
    for use in (*bound.bound.uses, *bound.bound.aggregate_uses):
        policy = bound.bound.vocabulary.policies[use.index]
        if policy.level == "option":
            yield policy.name
        yield from policy.enforced


def _of_findings(
    concerned: Sequence[Resolved], findings: Iterable[Finding], packs: Mapping[str, RulePack]
) -> Iterator[tuple[BoundRule, Resolved]]:
    """Yield the rules behind errors, warnings and verdicts, with the endpoints concerned."""
    loud = [each for each in findings if each.severity is not Severity.NOTE or each.verdict is not None]
    ends: dict[str, Resolved] = {}
    for each in concerned if loud else ():
        ends[each.id] = each
        ends.setdefault(each.participant.participant.id, each)
    for finding in loud:
        pack = packs.get(finding.source)
        bound = next((each for each in pack.judging_rules if each.rule.code == finding.code), None) if pack else None
        for side in finding.sides if bound is not None else ():
            for member in side.members:
                if member in ends:
                    yield bound, ends[member]  # type: ignore[misc]


def _read_by(bound: BoundRule, endpoint: Resolved) -> frozenset[str]:
    """The endpoint's options that a rule rests on, also one of the protocol on whose wire the endpoint is."""
    read = {*_options_read(bound)}
    if bound.rule not in endpoint.pack.rules and endpoint.pack.wire is not None:
        read = {own for own, there in endpoint.pack.wire.options.items() if there in read}
    return frozenset(read) | options_in_words(endpoint)
