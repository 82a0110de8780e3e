"""Validates a rule pack at load time."""

from __future__ import annotations

import keyword
import re
from dataclasses import fields
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.language.domains import Choice, Count, Duration, is_unit
from cqos_core.language.expression import CONDITION_FUNCTIONS, SCOPES, VALUE_FUNCTIONS
from cqos_core.language.policy import BOTH, DIRECTIONS, ENDPOINT, LEVELS, NO, TOPIC, UNMATCHED, YES, ByOption, parts_of
from cqos_core.language.values import COMBINATIONS, FromPeers, OneOf, normalise
from cqos_core.model.problems import ConditionError, InvalidValueError, PackError
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.bound_rule import bind_rule
from cqos_core.packs.property_panel import values_of
from cqos_core.packs.rule import SEVERITIES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from cqos_core.language.expression import Node
    from cqos_core.language.policy import Meaning, Policy
    from cqos_core.language.vocabulary import Vocabulary
    from cqos_core.model.code_info import CodeInfo
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack_definition import PackDefinition
    from cqos_core.packs.presets import Dialect, Preset
    from cqos_core.packs.rule import Rule


class Mistake(NamedTuple):
    """One mistake; ``at`` is where it stands, in the keys of a pack file: ``("policies", "care")``."""

    at: tuple[str, ...]
    message: str


def validate(pack: PackDefinition) -> None:
    """Bind every rule and read every default.

    Raises:
        PackError: naming every mistake found.
    """
    found = list(mistakes(pack))
    try:
        for rule in sorted(pack.rules, key=lambda rule: rule.code):
            found += _mistakes_of(rule, pack.vocabulary)
    except PackError as error:  # without distinct policies no condition can be parsed
        found.append(Mistake(("policies",), str(error)))
    if found:
        listed = "\n  ".join(mistake.message for mistake in found)
        raise PackError(f"rule pack `{pack.id}` is not well formed:\n  {listed}", found)


def _mistakes_of(rule: Rule, vocabulary: Vocabulary) -> Iterator[Mistake]:
    """Yield what is wrong with a rule."""
    at = ("rules", rule.code)
    bound = bind_rule(rule, vocabulary)
    try:
        _ = bound.bound
    except ConditionError as error:
        yield Mistake((*at, "condition"), f"rule {rule.code} `{rule.condition}`: {error}")
    else:
        yield from (Mistake(at, f"rule {rule.code}: {message}") for message in rule_mistakes(bound))


def mistakes(pack: PackDefinition) -> Iterator[Mistake]:
    """Yield everything that is wrong with a pack beside its conditions."""
    yield from _names(pack)
    if pack.base_preset is not None and pack.base_preset not in pack.presets:
        yield Mistake(("base_preset",), f"base preset `{pack.base_preset}` is not among the presets")
    for at, what, messages in _parts(pack):
        yield from (Mistake(at, f"{what}: {message}") for message in messages)


def _parts(pack: PackDefinition) -> Iterator[tuple[tuple[str, ...], str, Iterator[str]]]:
    """Yield where each part stands, what it is, and what is wrong with it."""
    for policy in pack.policies:
        at, what = ("policies", policy.name), f"policy `{policy.name}`"
        yield at, what, _policy(policy, pack)
        yield (*at, "values"), what, _domain(policy)
        yield (*at, "default"), what, _defaults(policy)
    for name, preset in pack.presets.items():
        yield ("presets", name), f"preset `{name}`", _preset(preset, pack)
    for name, dialect in pack.dialects.items():
        yield ("dialects", name), f"dialect `{name}`", _dialect(dialect, pack)
    yield ("panel",), "panel", _panel(pack)
    yield ("timing",), "timing", _timing(pack)
    for convention in pack.conventions:
        for name, text in convention.settings.items():
            yield ("conventions",), f"convention of `{convention.pattern}`", _setting(pack, "topic", name, text)
    for option, value in pack.variants:
        yield (), f"variant of {option} {value}", _option_value(pack, option, value)


def _timing(pack: PackDefinition) -> Iterator[str]:
    known = {policy.name: policy for policy in pack.policies}
    for part in (each for each in fields(pack.timing) if each.default is not None):
        stated = getattr(pack.timing, part.name)
        name, values = (stated, ()) if isinstance(stated, str) else stated
        if name and name not in known:
            yield f"`{part.name}` names `{name}`, which is no policy"
        elif name and not _says_time(part.name, known[name]):
            yield f"`{part.name}` names `{name}`, but needs {_TIMES.get(part.name, _TIME)}"
        for value in values if name in known else ():
            yield from (f"`{part.name}`: {message}" for message in _text(known[name], value))


_TIME: Final = "a policy of endpoints"
_TIMES: Final = {
    **dict.fromkeys(("gap", "lease", "lifespan", "kept_for"), "a duration of endpoints"),
    **dict.fromkeys(("depth", "strength", "strongest"), "a count of endpoints"),
    **dict.fromkeys(("period", "latched", "keyed"), "a policy of topics"),
}


def _says_time(part: str, policy: Policy) -> bool:
    """Return whether a policy has the kind and level that a part of `Timing` needs."""
    needed = _TIMES.get(part, "")
    kinds = (Duration,) if "duration" in needed else (Count,) if "count" in needed else ()
    fits = not kinds or isinstance(policy.domain, kinds)
    return fits and policy.level == (TOPIC if "topics" in needed else ENDPOINT)


def _wrong(*said: tuple[object, str]) -> Iterator[str]:
    """Yield the messages of the pairs whose first part is true."""
    return (message for wrong, message in said if wrong)


def rule_mistakes(bound: BoundRule) -> Iterator[str]:
    """Yield what is wrong with a rule whose condition is in order."""
    rule, of_itself = bound.rule, bound.bound.uses
    uses = (*of_itself, *bound.bound.aggregate_uses)
    used = {use.term.name for use in uses}
    read = {*used, *(f"{use.term.scope} {use.term.name}" for use in of_itself)}
    words = {"publisher", "subscriber", "endpoint", "topic"}
    words |= {word for name in used for word in (name, f"offered {name}", f"requested {name}")}
    yield from _wrong(
        (rule.kind == "meets" and bound.scope != "pair", "a meeting condition compares a publisher with a subscriber"),
        (rule.role not in {"", *BOTH}, f"role `{rule.role}` must be publisher or subscriber"),
    )
    for use in uses:
        policy = bound.bound.vocabulary.policies[use.index]
        role = {"offered": PUBLISHER, "requested": SUBSCRIBER, "own": bound.role}.get(use.term.scope)
        if policy.level == ENDPOINT and role is not None and role not in policy.roles:
            yield f"`{use.term}` is of a {role}, and only a {' and '.join(policy.roles) or 'nothing'} has `{policy.name}`"
    yield from _wrong(
        *((name not in read, f"`fixes` names `{name}`, which the condition does not read") for name in rule.fixes)
    )
    yield from _severity(bound)
    written = re.findall(r"\{([^{}]+)\}", rule.says)
    yield from _wrong(
        *((word not in words, f"`says` has {{{word}}}, which stands for nothing here") for word in written)
    )


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
    yield from _wrong((bound.rule.kind == "meets", "a meeting condition has one severity"))
    for value, severity in (*by.meanings, (values[0], by.otherwise)):
        other = f"its severity names `{value}`, but option `{by.option}` is one of {', '.join(values)}"
        unknown = severity not in {None, *SEVERITIES}
        yield from _wrong(
            (value not in values, other), (unknown, f"severity `{severity}` must be error, warning or note")
        )
    none = not by.meanings and by.otherwise is None
    yield from _wrong((none, f"its severity lists no value of option `{by.option}`"))


KEPT: Final = {
    ENDPOINT: frozenset(("profile", "id", "needs", "protocol", "external", "starts_after", "label", "observed")),
    "topic": frozenset(("external", "protocol")),
    "broker": frozenset(("protocol", "profile")),
}
"""By level, keys of the system file that mean something for every protocol, so that no policy can be set by them."""
_NAME: Final = regular_expression(r"[a-z_][a-z0-9_]*(\.[a-z_][a-z0-9_]*)*")


def _names(pack: PackDefinition) -> Iterator[Mistake]:
    """Yield names that stand for two things."""
    named: tuple[Rule | CodeInfo, ...] = (*pack.rules, *pack.codes)
    codes = [(spelling, rule.code) for rule in named for spelling in (rule.code, rule.name, *rule.aliases)]
    for spelling, code, other in _taken(codes):
        yield Mistake(("rules", code), f"`{spelling}` names both {other} and {code}")
    for level in dict.fromkeys(policy.level for policy in pack.policies):
        of_level = [policy for policy in pack.policies if policy.level == level]
        policies = [(spelling, policy.name) for policy in of_level for spelling in sorted(policy.spellings)]
        for spelling, name, other in _taken(policies):
            if name != other:
                yield Mistake(("policies", name), f"`{spelling}` spells both policy `{other}` and policy `{name}`")
    presets = [(each, name) for name, preset in pack.presets.items() for each in (name, *preset.aliases)]
    for spelling, name, other in _taken(presets, normalise):
        if name != other:
            yield Mistake(("presets", name), f"`{spelling}` names both preset `{other}` and preset `{name}`")
    yield from _definitions(pack)
    own = [(name, "") for name in (*SCOPES, *VALUE_FUNCTIONS, *CONDITION_FUNCTIONS)]
    for name, _, _ in _taken([*own, *((function.name, "") for function in pack.functions)]):
        yield Mistake((), f"function `{name}` has a name that is taken")


def _taken(named: Iterable[tuple[str, str]], alike: Callable[[str], str] = str) -> Iterator[tuple[str, str, str]]:
    """Yield each spelling that two things have, with its second and its first owner."""
    first: dict[str, str] = {}
    for spelling, name in named:
        if alike(spelling) in first:
            yield spelling, name, first[alike(spelling)]
        first.setdefault(alike(spelling), name)


def _definitions(pack: PackDefinition) -> Iterator[Mistake]:
    """Yield definitions whose name has another meaning too."""
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


def _policy(policy: Policy, pack: PackDefinition) -> Iterator[str]:
    legal = _NAME.fullmatch(policy.name) and not any(map(keyword.iskeyword, policy.name.split(".")))
    near = re.sub(r"[^a-z0-9.]+", "_", policy.name.lower()).strip("_")
    written = (
        f"; write `{near}`, and `{policy.name}` in its `aliases`"
        if _NAME.fullmatch(near) and near != policy.name
        else ""
    )
    yield from _wrong((not legal, f"a name is snake_case, with dots between its parts, and no word of Python{written}"))
    for spelling in sorted(policy.spellings & KEPT.get(policy.level, frozenset())):
        yield f"`{spelling}` is a key of the system file with a meaning of its own, so no policy can be set by it"
    unset = policy.derived and policy.default is None
    yield from _wrong(
        (policy.level not in LEVELS, f"level `{policy.level}` must be one of {', '.join(LEVELS)}"),
        (policy.stronger not in DIRECTIONS, f"`stronger` is `{policy.stronger}`; it must be higher, lower or empty"),
        (policy.stronger and not policy.domain.ordered, "`stronger` needs values that have an order"),
        (unset, "a derived policy needs the default that holds where nothing else follows"),
        (not set(policy.roles) <= set(BOTH), f"roles must be of {' and '.join(BOTH)}"),
    )
    yield from _words(policy, pack)
    for option, by_value in policy.enforced.items():
        for value, treated in by_value.items():
            yield from _option_value(pack, option, value)
            if treated not in {YES, UNMATCHED, NO}:
                yield f"`enforced` says `{treated}`; it must be {YES}, {UNMATCHED} or {NO}"


def _defaults(policy: Policy) -> Iterator[str]:
    for text in dict.fromkeys((*map(policy.default_for, BOTH), *policy.assume, policy.fallback)):
        yield from _text(policy, text)


def _words(policy: Policy, pack: PackDefinition) -> Iterator[str]:
    for word, meaning in policy.words.items():
        yield from _wrong(
            (
                _word(policy, word) != word,
                f"word `{word}` must be written in the pack as `{_word(policy, word)}`; files may write both",
            ),
            (word in getattr(policy.domain, "names", ()), f"word `{word}` is also a value"),
        )
        yield from _meaning(policy, meaning, pack)
        yield from _circle(policy, word)
    if policy.zero is not None and policy.zero not in policy.words:
        known = ", ".join(f"`{word}`" for word in policy.words) or "none: state it in `words`"
        yield f"zero is `{policy.zero}`, which is none of its words ({known})"


def _word(policy: Policy, text: str) -> str:
    """Return a text as it is compared with the words; those of options come before the spellings of values."""
    return normalise(text) if policy.level == "option" else policy.domain.word(text)


def _domain(policy: Policy) -> Iterator[str]:
    match policy.domain:
        case Choice() as choice:
            for rank, name in enumerate(choice.names):
                if choice.names.index(name) != rank:
                    yield f"value `{name}` is listed twice"
                elif choice.word(name) != name:
                    yield f"value `{name}` must be written in the pack as `{choice.word(name)}`; files may write both"
        case Count(lowest=lowest, maximum=maximum) if lowest > maximum:
            yield f"there is no number from {lowest} to {maximum}"
        case Duration(bare_unit=unit) if not is_unit(unit):
            yield f"`{unit}` is no unit of time"


def _text(policy: Policy, text: str | None) -> Iterator[str]:
    """Yield the reasons why a text is no value or word of a policy."""
    if text is None or _word(policy, text) in policy.words:
        return
    try:
        policy.domain.parse(text)
    except InvalidValueError as problem:
        # a value that is listed in a wrong spelling is reported there
        if normalise(text) not in map(normalise, getattr(policy.domain, "names", ())):
            yield str(problem)


def _meaning(policy: Policy, meaning: Meaning, pack: PackDefinition) -> Iterator[str]:
    for part in parts_of(meaning):
        match part:
            case str():
                yield from _text(policy, part)
            case OneOf(values):
                for text in values:
                    yield from _text(policy, text)
            case ByOption(option, meanings):
                for value in dict(meanings) or [None]:
                    yield from _option_value(pack, option, value)
            case FromPeers():
                if part.peers not in COMBINATIONS:
                    yield f"peers are put together by `{part.peers}`; known: {', '.join(COMBINATIONS)}"
                yield from _text(policy, part.alone)


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
    for text in (each for each in parts_of(policy.words[word]) if isinstance(each, str)):
        if _word(policy, text) in policy.words:
            yield _word(policy, text)
        elif policy.zero is not None and policy.zero in policy.words and policy.domain.read(text) == 0:
            yield policy.zero


def _option_value(pack: PackDefinition, option: str, value: str | None) -> Iterator[str]:
    known = _named(pack, option, "option")
    if known is None:
        yield f"`{option}` is no option"
    elif value is not None:
        yield from _text(known, value)


def _setting(pack: PackDefinition, level: str, name: str, text: str) -> Iterator[str]:
    known = _named(pack, name, level)
    if known is None:
        yield f"`{name}` is no {level} policy"
    else:
        yield from (f"`{name}`: {message}" for message in _text(known, text))


def _named(pack: PackDefinition, name: str, level: str) -> Policy | None:
    return next((policy for policy in pack.policies if policy.level == level and policy.name == name), None)


def _preset(preset: Preset, pack: PackDefinition) -> Iterator[str]:
    for name, text in preset.settings.items():
        yield from _setting(pack, preset.level, name, text)
    if preset.needs is not None:
        yield from _option_value(pack, *preset.needs)


def _dialect(dialect: Dialect, pack: PackDefinition) -> Iterator[str]:
    spellings = {spelling for policy in pack.policies for spelling in policy.spellings}
    for written, name in dialect.names.items():
        yield from _wrong(
            (normalise(name) not in spellings, f"`{written}` is read as `{name}`, which is no policy"),
            (
                normalise(written) != written,
                f"`{written}` must be written in the pack as `{normalise(written)}`; files may write both",
            ),
        )
    for name, codes in dialect.codes.items():
        yield from _codes(pack, name, codes)
    words = {word for policy in pack.policies for word in policy.words}
    yield from _wrong(
        *((word not in words, f"`words` names `{word}`, which no policy has") for word in dialect.words or ())
    )
    for name, attribute in dialect.writes.items():
        known = [policy for policy in pack.policies if policy.name == name]
        read = any(pack.find(policy.level, attribute, dialect) is not None for policy in known)
        yield from _wrong(
            (not known, f"`writes` names `{name}`, which is no policy"),
            (known and attribute and not read, f"`{name}` is written as `{attribute}`, which is not read as it"),
        )
    if not is_unit(dialect.bare_unit):
        yield f"`{dialect.bare_unit}` is no unit of time"


def _panel(pack: PackDefinition) -> Iterator[str]:
    panel = pack.panel
    known: dict[str, set[str]] = {}
    for policy in pack.policies:
        known.setdefault(policy.name, set()).update(values_of(policy))
    grouped = [name for names in panel.groups.values() for name in names]
    for name in dict.fromkeys(
        (*grouped, *panel.advanced, *panel.labels, *panel.values, *panel.value_labels, *panel.roles)
    ):
        yield from _wrong((name not in known, f"it names `{name}`, which is no policy"))
        yield from _wrong((grouped.count(name) > 1, f"`{name}` stands in several groups"))
    for table in (panel.values, panel.value_labels):
        for name, values in table.items():
            wrong = [value for value in values if value not in known.get(name, values)]
            yield from (f"`{value}` is no value of `{name}`" for value in wrong)


def _codes(pack: PackDefinition, name: str, codes: Mapping[str, str]) -> Iterator[str]:
    known = [policy for policy in pack.policies if policy.name == name]
    if not known:
        yield f"`codes` names `{name}`, which is no policy"
    for text in codes.values():
        if not any(not list(_text(policy, text)) for policy in known) and known:
            yield from (f"code of `{name}`: {message}" for message in _text(known[0], text))
