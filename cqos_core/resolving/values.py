"""From one text to a value: words, units, dialects, and meanings that depend on the role or on options."""

from __future__ import annotations

import json
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from cqos_core.language.evaluate import UNREAD, WrittenValue
from cqos_core.language.policy import (
    INFINITE,
    NEED,
    NO,
    Anything,
    ByOption,
    Count,
    Depends,
    Duration,
    FromPeers,
    Meaning,
    OneOf,
    PerRole,
    Policy,
    Value,
    flow,
    is_plain,
)
from cqos_core.model.memory import LONGEST_REMEMBERED
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.system import SUBSCRIBER, Setting
from cqos_core.resolving.resolved import Stated, treated

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.language.policy import Domain, Plain
    from cqos_core.packs.pack import Dialect, RulePack
    from cqos_core.resolving.resolved import Layer, ResolvedParticipant


def read_value(
    pack: RulePack,
    policy: Policy,
    text: str,
    role: str,
    options: Mapping[int, Value],
    dialect: Dialect | None,
) -> Value:
    """Return the value that a text in a dialect stands for.

    Raises:
        InvalidValueError: the policy has no such value.
    """
    # A text may be a whole list of access control, and each of its clients reads it.
    meaning = policy.words.get(policy.domain.word(text)) if policy.words else None
    if meaning is None:
        unit = dialect.bare_unit if dialect else None
        read = _plain_remembered if len(text) <= LONGEST_REMEMBERED else _plain
        plain = read(policy.domain, text, unit)
        if plain != 0 or policy.zero is None:
            return plain
        meaning = policy.words[policy.zero]
    return _meaning(pack, policy, meaning, role, options)


def _meaning(pack: RulePack, policy: Policy, meaning: Meaning, role: str, options: Mapping[int, Value]) -> Value:
    match meaning:
        case str():
            return read_value(pack, policy, meaning, role, options, None)
        case PerRole():
            return _meaning(pack, policy, getattr(meaning, role), role, options)
        case ByOption():
            return _by_option(pack, policy, meaning, role, options)
        case OneOf(values):
            return Anything(f"it is one of {', '.join(values)}")
    return meaning


def _by_option(pack: RulePack, policy: Policy, meaning: ByOption, role: str, options: Mapping[int, Value]) -> Value:
    index = pack.vocabulary.indices["option", meaning.option]
    listed = dict(meaning.meanings)
    domain = pack.policies[index].domain

    def under(value: Value) -> Value:
        if isinstance(value, Depends):
            cases = tuple((name, under(case)) for name, case in value.cases)
            return cases[0][1] if len({case for _, case in cases}) == 1 else Depends(value.on, cases)
        if not is_plain(value):
            return Anything(f"option {meaning.option} is not known")
        chosen = listed.get(domain.format(value), meaning.otherwise)  # type: ignore[arg-type]
        if chosen is None:
            return Anything(f"it is not known for {meaning.option} {domain.format(value)}")  # type: ignore[arg-type]
        return _meaning(pack, policy, chosen, role, options)

    return under(options[index])


def ignored_by(pack: RulePack, policy: Policy, options: Mapping[int, Value]) -> str | None:
    """The option and its value under which the middleware ignores the policy; None where it does not."""
    for option, by_value in policy.enforced.items():
        index = pack.vocabulary.indices["option", option]
        value = options.get(index)
        if value is not None and treated(by_value, pack.policies[index], value) == NO:
            return f"{option} {pack.policies[index].format(value)}"
    return None


def _plain(domain: Domain, text: str, unit: str | None) -> Plain:
    """Read a text as a plain value; ``unit`` is that of numbers without one."""
    return domain.parse(domain.with_unit(text, unit))


# Few texts make up most systems, and they are read alike every time.
_plain_remembered = lru_cache(maxsize=16_384)(_plain)
_ZEROS: Final = frozenset(("0", "0s"))


def depends(pack: RulePack, option: Policy, names: Iterable[str]) -> Depends:
    """The value of an option that may have any of these values."""
    return Depends(f"{pack.id}.{option.name}", tuple((name, option.domain.parse(name)) for name in names))


def word_of(policy: Policy, text: str) -> str:
    """The word that ``text`` is, or that its zero stands for."""
    word = policy.word(text)
    return policy.zero if policy.zero is not None and word in _ZEROS else word


def either(participant: ResolvedParticipant, when: tuple[str, str], then: Value, otherwise: Value) -> Value:
    """The value ``then`` under a value of an option that is not known, else ``otherwise``."""
    if then == otherwise:
        return then
    pack = participant.pack
    index = pack.vocabulary.indices["option", when[0]]
    option = participant.values[index]
    if not isinstance(option, Depends) or isinstance(otherwise, FromPeers):
        return Anything(f"it depends on option {when[0]}", code=getattr(option, "code", ""))
    expected = pack.policies[index].domain.parse(when[1])
    cases = ((name, then if case == expected else otherwise) for name, case in option.cases)
    return Depends(option.on, tuple((name, _under(value, option.on, name)) for name, value in cases))


def _under(value: Value, option: str, case: str) -> Value:
    """What a value is under one case of an option."""
    return dict(value.cases)[case] if isinstance(value, Depends) and value.on == option else value


def how_written(policy: Policy, index: int, layers: Sequence[Layer]) -> WrittenValue | None:
    """How the nearest of ``layers`` states a policy; None where nobody does, or a preset."""
    for layer in layers:
        stated = layer.settings.get(index)
        if stated is not None:
            if isinstance(stated.setting.unknown, str) and stated.setting.unknown:
                return UNREAD
            return WrittenValue(policy.word(stated.text), layer.here) if layer.counts_as_stated else None
    return None


def spelled(policy: Policy, text: str, dialect: Dialect | None) -> str | None:
    """Return a dialect's text in the spelling of the YAML form: integer codes in words, durations with their unit.

    None where a zero of the dialect means that nobody stated the value.
    """
    if dialect is None:
        return text
    stripped = text.strip()
    codes = dialect.codes.get(policy.name)
    if codes is not None and stripped in codes:
        return codes[stripped]
    numeric = isinstance(policy.domain, (Duration, Count))
    if dialect.zero_is_unset and numeric and _is_zero(stripped):
        return None
    return policy.domain.with_unit(text, dialect.bare_unit)


def respelled(policy: Policy, value: Plain, dialect: Dialect | None, old: str | None) -> str | None:
    """Return the text of a value as a dialect writes it, in the manner of an ``old`` one; None where it has no text.

    The text is read back with the same dialect, so a value that the dialect cannot write is never returned.
    """
    plain = policy.spelling(value)
    if plain is None:
        return None
    codes = dialect.codes.get(policy.name, {}) if dialect is not None else {}
    coded = [code for code, word in codes.items() if word == plain]
    bare = _in_unit(policy.domain, value, dialect.bare_unit if dialect is not None else None)
    alike = [] if old is None else _in_the_manner_of(old, policy, plain)
    if old is None or old.strip() in codes:
        tried = [*coded, *bare, plain] if old is not None else [plain, *coded]
    elif old.strip().replace(".", "", 1).isdigit():
        tried = [*bare, plain, *coded]
    else:
        tried = [*alike, plain, *bare, *coded]
    return next((text for text in tried if _reads_as(policy, text, dialect, value)), None)


def _in_unit(domain: Domain, value: Plain, unit: str | None) -> list[str]:
    """Return a duration as a bare number of a unit, where it is a number of it."""
    if unit is None or not isinstance(domain, Duration) or not isinstance(value, int) or value >= INFINITE:
        return []
    whole, rest = divmod(value, domain.parse(f"1{unit}"))
    size = len(str(domain.parse(f"1{unit}"))) - 1
    return [f"{whole}.{rest:0{size}d}".rstrip("0").rstrip(".") if rest else str(whole)]


def _in_the_manner_of(old: str, policy: Policy, plain: str) -> list[str]:
    """Return a name with the affixes and in the case of another one: ``RELIABLE_RELIABILITY_QOS``, ``Best Effort``."""
    name = policy.domain.word(old)
    for was, now in ((name, plain), (name.replace("_", " "), plain.replace("_", " "))):
        at = old.lower().find(was)
        if was and at >= 0:
            part = old[at : at + len(was)]
            cased = now.upper() if part.isupper() else now.title() if part.istitle() else now
            return [old[:at] + cased + old[at + len(was) :]]
    return []


def _reads_as(policy: Policy, text: str, dialect: Dialect | None, value: Plain) -> bool:
    read = spelled(policy, text, dialect)
    if read is None or policy.domain.word(read) in policy.words:
        return False
    try:
        return policy.domain.parse(read) == value and not (value == 0 and policy.zero is not None)
    except InvalidValueError:
        return False


def _is_zero(text: str) -> bool:
    return bool(text) and set(text) <= {"0", ".", "+"} and "0" in text


def can_be_stated(policy: Policy) -> bool:
    """Whether a system may state a policy: needs are those of subscriptions, what publishers have of them is found out."""
    return policy.level != NEED or SUBSCRIBER in policy.roles


def fields_of(
    pack: RulePack, levels: tuple[str, ...], name: str, setting: Setting
) -> tuple[dict[int, Stated], tuple[str, ...]]:
    """Read a map whose keys are the fields of a policy: ``will: {topic: x}`` states ``will.topic``.

    Returns:
        The settings by index, and what the keys that are no fields would be called; two times nothing for what is no map.
    """
    found: dict[int, Stated] = {}
    others = []
    if not setting.text.lstrip().startswith("{"):
        return found, ()
    try:
        fields = flow(setting.text)
    except InvalidValueError:
        return found, ()
    for key, value in fields.items() if isinstance(fields, dict) else ():
        index = next((i for level in levels if (i := pack.find(level, f"{name}.{key}")) is not None), None)
        if index is None:
            others.append(f"{name}.{key}")
            continue
        text = value if isinstance(value, str) else json.dumps(value)
        found[index] = Stated(text, Setting(text, setting.place), name, field=key)
    return found, tuple(others)
