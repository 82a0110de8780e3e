"""What is wrong with a rule pack, found when it is loaded: everything that would otherwise surprise whoever uses it."""

from __future__ import annotations

import keyword
import re
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.language.domains import Choice, Count, Duration, is_unit
from cqos_core.language.expression import CONDITION_FUNCTIONS, SCOPES, VALUE_FUNCTIONS
from cqos_core.language.policy import BOTH, DIRECTIONS, ENDPOINT, LEVELS, NO, UNMATCHED, YES, ByOption, PerRole
from cqos_core.language.values import COMBINATIONS, FromPeers, OneOf, normalise
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.rule import SEVERITIES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.language.expression import Node
    from cqos_core.language.policy import Meaning, Policy
    from cqos_core.model.codes import CodeInfo
    from cqos_core.packs.pack import BoundRule, Dialect, Preset, RulePack
    from cqos_core.packs.rule import Rule


class Mistake(NamedTuple):
    """One mistake; ``at`` is where it stands, in the keys of a pack file: ``("policies", "care")``."""

    at: tuple[str, ...]
    message: str


def mistakes(pack: RulePack) -> Iterator[Mistake]:
    """Yield everything that is wrong with a pack beside its sentences."""
    yield from _names(pack)
    if pack.base_preset is not None and pack.base_preset not in pack.presets:
        yield Mistake(("base_preset",), f"base preset `{pack.base_preset}` is not among the presets")
    for policy in pack.policies:
        at = ("policies", policy.name)
        yield from (Mistake(at, f"policy `{policy.name}`: {message}") for message in _policy(policy, pack))
    for name, preset in pack.presets.items():
        yield from (Mistake(("presets", name), f"preset `{name}`: {message}") for message in _preset(preset, pack))
    for name, dialect in pack.dialects.items():
        yield from (Mistake(("dialects", name), f"dialect `{name}`: {message}") for message in _dialect(dialect, pack))
    for convention in pack.conventions:
        for name, text in convention.settings.items():
            where = f"convention of `{convention.pattern}`"
            yield from (Mistake(("conventions",), f"{where}: {said}") for said in _setting(pack, "topic", name, text))
    for option, value in pack.variants:
        messages = _option_value(pack, option, value)
        yield from (Mistake((), f"variant of {option} {value}: {message}") for message in messages)


def rule_mistakes(bound: BoundRule) -> Iterator[str]:
    """Yield what is wrong with a rule whose sentence is in order."""
    rule = bound.rule
    used = {use.term.name: use for use in (*bound.bound.uses, *bound.bound.aggregate_uses)}
    if rule.kind == "meets" and bound.scope != "pair":
        yield "a meeting condition compares a publisher with a subscriber"
    if rule.role not in {"", *BOTH}:
        yield f"role `{rule.role}` must be publisher or subscriber"
    for use in (*bound.bound.uses, *bound.bound.aggregate_uses):
        policy = bound.bound.vocabulary.policies[use.index]
        role = {"offered": PUBLISHER, "requested": SUBSCRIBER, "own": bound.role}.get(use.term.scope)
        if policy.level == ENDPOINT and role is not None and role not in policy.roles:
            yield f"`{use.term}` is of a {role}, and only a {' and '.join(policy.roles) or 'nothing'} has `{policy.name}`"
    read = {*used, *(f"{use.term.scope} {use.term.name}" for use in bound.bound.uses)}
    for name in rule.fixes:
        if name not in read:
            yield f"`fixes` names `{name}`, which the sentence does not read"
    yield from _severity(bound)
    words = {"publisher", "subscriber", "endpoint", "topic"}
    words |= {word for name in used for word in (name, f"offered {name}", f"requested {name}")}
    for word in re.findall(r"\{([^{}]+)\}", rule.says):
        if word not in words:
            yield f"`says` has {{{word}}}, which stands for nothing here"


def _severity(bound: BoundRule) -> Iterator[str]:
    """Yield what is wrong with a severity that depends on an option."""
    by, vocabulary = bound.rule.severity, bound.bound.vocabulary
    if isinstance(by, str):
        return
    at = vocabulary.indices.get(("option", by.option))
    option = None if at is None else vocabulary.policies[at]
    values = () if option is None else tuple(map(option.domain.format, option.domain.candidates()))
    if option is None or not values or not isinstance(option.default, str):
        yield f"its severity depends on `{by.option}`, which is no option with a default and listed values"
        return
    if bound.rule.kind == "meets":
        yield "a meeting condition has one severity"
    for value, severity in (*by.meanings, (values[0], by.otherwise)):
        if value not in values:
            yield f"its severity names `{value}`, but option `{by.option}` is one of {', '.join(values)}"
        if severity is not None and severity not in SEVERITIES:
            yield f"severity `{severity}` must be error, warning or note"
    if not by.meanings and by.otherwise is None:
        yield f"its severity lists no value of option `{by.option}`"


KEPT: Final = {
    ENDPOINT: frozenset(("profile", "id", "needs", "protocol", "external", "starts_after", "label", "observed")),
    "topic": frozenset(("external", "protocol")),
    "broker": frozenset(("protocol", "profile")),
}
"""By level, keys of the system file that mean something for every protocol, so that no policy can be set by them."""
_NAME: Final = re.compile(r"[a-z_][a-z0-9_]*(\.[a-z_][a-z0-9_]*)*")


def _names(pack: RulePack) -> Iterator[Mistake]:
    """Yield names that stand for two things."""
    seen: dict[str, str] = {}
    named: tuple[Rule | CodeInfo, ...] = (*pack.rules, *pack.codes)
    for rule in named:
        for spelling in (rule.code, rule.name, *rule.aliases):
            if spelling in seen:
                yield Mistake(("rules", rule.code), f"`{spelling}` names both {seen[spelling]} and {rule.code}")
            seen.setdefault(spelling, rule.code)
    taken: dict[tuple[str, str], str] = {}
    for policy in pack.policies:
        for spelling in sorted(policy.spellings):
            other = taken.setdefault((policy.level, spelling), policy.name)
            if other != policy.name:
                message = f"`{spelling}` spells both policy `{other}` and policy `{policy.name}`"
                yield Mistake(("policies", policy.name), message)
    presets: dict[str, str] = {}
    for name, preset in pack.presets.items():
        for spelling in (name, *preset.aliases):
            other = presets.setdefault(normalise(spelling), name)
            if other != name:
                yield Mistake(("presets", name), f"`{spelling}` names both preset `{other}` and preset `{name}`")
    yield from _definitions(pack)
    functions: set[str] = set()
    for function in pack.functions:
        if function.name in {*SCOPES, *VALUE_FUNCTIONS, *CONDITION_FUNCTIONS} or function.name in functions:
            yield Mistake((), f"function `{function.name}` has a name that is taken")
        functions.add(function.name)


def _definitions(pack: RulePack) -> Iterator[Mistake]:
    """Yield definitions whose name means something else too."""
    policies = {policy.name for policy in pack.policies}
    seen: dict[str, Node] = {}
    for rule in pack.rules:
        for node in rule.condition.walk():
            name = node.label
            if name and seen.setdefault(name, node).key != node.key:
                yield Mistake(
                    ("rules", rule.code), f"`{name}` is defined as `{seen[name].text()}` and as `{node.text()}`"
                )
            if name in policies:
                yield Mistake(("rules", rule.code), f"`{name}` names a definition and a policy")


def _policy(policy: Policy, pack: RulePack) -> Iterator[str]:
    if not _NAME.fullmatch(policy.name) or any(keyword.iskeyword(part) for part in policy.name.split(".")):
        yield "a name is snake_case, with dots between its parts, and no word of Python"
    for spelling in sorted(policy.spellings & KEPT.get(policy.level, frozenset())):
        yield f"`{spelling}` is a key of the system file with a meaning of its own, so no policy can be set by it"
    if policy.level not in LEVELS:
        yield f"level `{policy.level}` must be one of {', '.join(LEVELS)}"
    if policy.stronger not in DIRECTIONS:
        yield f"`stronger` is `{policy.stronger}`; it must be higher, lower or empty"
    if policy.stronger and not policy.domain.ordered:
        yield "`stronger` needs values that have an order"
    if policy.derived and policy.default is None:
        yield "a derived policy needs the default that holds where nothing else follows"
    if not set(policy.roles) <= set(BOTH):
        yield f"roles must be of {' and '.join(BOTH)}"
    yield from _domain(policy)
    for text in dict.fromkeys((*map(policy.default_for, BOTH), *policy.assume, policy.fallback)):
        yield from _text(policy, text)
    yield from _words(policy, pack)
    for option, by_value in policy.enforced.items():
        for value, treated in by_value.items():
            yield from _option_value(pack, option, value)
            if treated not in {YES, UNMATCHED, NO}:
                yield f"`enforced` says `{treated}`; it must be {YES}, {UNMATCHED} or {NO}"


def _words(policy: Policy, pack: RulePack) -> Iterator[str]:
    for word, meaning in policy.words.items():
        if _word(policy, word) != word:
            yield f"word `{word}` must be written as it is read, `{_word(policy, word)}`"
        if isinstance(policy.domain, Choice) and word in policy.domain.names:
            yield f"word `{word}` is also a value"
        yield from _meaning(policy, meaning, pack)
        yield from _circle(policy, word)
    if policy.zero is not None and policy.zero not in policy.words:
        yield f"zero is `{policy.zero}`, which is none of its words"


def _word(policy: Policy, text: str) -> str:
    """How a text is compared with the words; those of options come before the spellings of values."""
    return normalise(text) if policy.level == "option" else policy.domain.word(text)


def _domain(policy: Policy) -> Iterator[str]:
    domain = policy.domain
    if isinstance(domain, Choice):
        for rank, name in enumerate(domain.names):
            if domain.names.index(name) != rank:
                yield f"value `{name}` is listed twice"
            elif domain.word(name) != name:
                yield f"value `{name}` must be written as it is read, `{domain.word(name)}`"
    if isinstance(domain, Count) and domain.lowest > domain.maximum:
        yield f"there is no number from {domain.lowest} to {domain.maximum}"
    if isinstance(domain, Duration) and not is_unit(domain.bare_unit):
        yield f"`{domain.bare_unit}` is no unit of time"


def _text(policy: Policy, text: str | None) -> Iterator[str]:
    """Yield what keeps a text from being read as a value or a word of a policy."""
    if text is None or _word(policy, text) in policy.words:
        return
    try:
        policy.domain.parse(text)
    except InvalidValueError as problem:
        yield str(problem)


def _meaning(policy: Policy, meaning: Meaning, pack: RulePack) -> Iterator[str]:
    match meaning:
        case str():
            yield from _text(policy, meaning)
        case OneOf(values):
            for text in values:
                yield from _text(policy, text)
        case PerRole():
            yield from _meaning(policy, meaning.publisher, pack)
            yield from _meaning(policy, meaning.subscriber, pack)
        case ByOption(option, meanings, otherwise):
            if not meanings:
                yield from _option_value(pack, option, None)
            for value, inner in meanings:
                yield from _option_value(pack, option, value)
                yield from _meaning(policy, inner, pack)
            if otherwise is not None:
                yield from _meaning(policy, otherwise, pack)
        case FromPeers():
            if meaning.peers not in COMBINATIONS:
                yield f"peers are put together by `{meaning.peers}`; known: {', '.join(COMBINATIONS)}"
            yield from _text(policy, meaning.alone)


def _circle(policy: Policy, word: str) -> Iterator[str]:
    """Yield a word that stands for itself in the end."""
    seen, found = set(), {word}
    while found:
        seen |= found
        found = {follower for each in found for follower in _followers(policy, each)}
        if word in found:
            yield f"word `{word}` stands for itself"
            return
        found -= seen


def _followers(policy: Policy, word: str) -> Iterator[str]:
    for text in _texts(policy.words[word]):
        if _word(policy, text) in policy.words:
            yield _word(policy, text)
        elif policy.zero is not None and policy.zero in policy.words and _is_zero(policy, text):
            yield policy.zero


def _texts(meaning: Meaning) -> Iterator[str]:
    """Yield all texts that a word may be read as."""
    match meaning:
        case str():
            yield meaning
        case PerRole():
            yield from _texts(meaning.publisher)
            yield from _texts(meaning.subscriber)
        case ByOption(_, meanings, otherwise):
            for inner in (*(inner for _, inner in meanings), otherwise):
                if inner is not None:
                    yield from _texts(inner)


def _is_zero(policy: Policy, text: str) -> bool:
    try:
        return policy.domain.parse(text) == 0
    except InvalidValueError:
        return False


def _option_value(pack: RulePack, option: str, value: str | None) -> Iterator[str]:
    known = [policy for policy in pack.policies if policy.level == "option" and policy.name == option]
    if not known:
        yield f"`{option}` is no option"
    elif value is not None:
        yield from _text(known[0], value)


def _setting(pack: RulePack, level: str, name: str, text: str) -> Iterator[str]:
    known = [policy for policy in pack.policies if policy.level == level and policy.name == name]
    if not known:
        yield f"`{name}` is no {level} policy"
    else:
        yield from (f"`{name}`: {message}" for message in _text(known[0], text))


def _preset(preset: Preset, pack: RulePack) -> Iterator[str]:
    for name, text in preset.settings.items():
        yield from _setting(pack, preset.level, name, text)
    if preset.needs is not None:
        yield from _option_value(pack, *preset.needs)


def _dialect(dialect: Dialect, pack: RulePack) -> Iterator[str]:
    spellings = {spelling for policy in pack.policies for spelling in policy.spellings}
    for written, name in dialect.names.items():
        if normalise(name) not in spellings:
            yield f"`{written}` is read as `{name}`, which is no policy"
        if normalise(written) != written:
            yield f"`{written}` must be written as it is compared, `{normalise(written)}`"
    for name, codes in dialect.codes.items():
        yield from _codes(pack, name, codes)
    if not is_unit(dialect.bare_unit):
        yield f"`{dialect.bare_unit}` is no unit of time"


def _codes(pack: RulePack, name: str, codes: Mapping[str, str]) -> Iterator[str]:
    known = [policy for policy in pack.policies if policy.name == name]
    if not known:
        yield f"`codes` names `{name}`, which is no policy"
    for text in codes.values():
        if not any(not list(_text(policy, text)) for policy in known) and known:
            yield from (f"code of `{name}`: {message}" for message in _text(known[0], text))
