"""Qualities of service in programs: what makes one, what changes one, and the words of policies."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2.presets import PRESETS
from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.walk.profiles import content
from cqos_ros2_sources.walk.values import Duration, Either, Qos, Template, Test, Word, each_case
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from cqos_ros2_sources.walk.frames import Walk

WORDS: Final = {
    "history": ("keep_last", "keep_all", "system_default"),
    "reliability": ("reliable", "best_effort", "system_default", "best_available"),
    "durability": ("volatile", "transient_local", "system_default", "best_available"),
    "liveliness": ("automatic", "manual_by_topic", "system_default", "best_available"),
}
DURATIONS: Final = ("deadline", "lifespan", "liveliness_lease_duration")
_IGNORED: Final = ("avoid_ros_namespace_conventions",)
FIELDS: Final = (*WORDS, "depth", *DURATIONS)


def policy_value(policy: str, value: Any) -> Any:
    """Return the value of a policy as node files write it: a word, a number, a duration, a template; else why it is not known."""
    if isinstance(value, (Unknown, Template)):
        return value
    if policy in WORDS:
        name = value.name if isinstance(value, Word) else value if isinstance(value, str) else ""
        word = _word(policy, name)
        return word or Unknown(f"`{name[:60]}` is no value of {policy} that is known")
    if policy == "depth":
        return (
            value
            if isinstance(value, int) and not isinstance(value, bool) and value >= 0
            else Unknown("its depth is not known")
        )
    if policy in DURATIONS:
        return value if isinstance(value, Duration) else Unknown(f"its {policy} is not known")
    return Unknown(f"{policy} is not followed")


def _word(policy: str, name: str) -> str:
    last = last_part(name)
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", last).lower()
    for start in (f"rmw_qos_policy_{policy}_", "qos_policy_"):
        plain = plain.removeprefix(start)
    return plain if plain in WORDS[policy] else ""


def policy_of(qos: Qos, policy: str) -> Any:
    """Return a policy of a quality of service: what is stated, or what its preset has."""
    known = PRESETS.get(qos.preset)
    found = dict(qos.settings).get(policy, known.settings.get(policy) if known is not None else None)
    if policy == "depth" and isinstance(found, str):
        return int(found)
    return found if found is not None and policy in (*WORDS, "depth") else Unknown(f"`{policy[:60]}` of a preset")


def changed(qos: Any, policy: str, value: Any) -> Any:
    """Return a quality of service after one of its policies is set by its name."""
    if not isinstance(qos, Qos):
        return qos if isinstance(qos, Unknown) else Unknown("its quality of service is not known")
    if isinstance(value, Either):
        return each_case(value, partial(changed, qos, policy))
    if policy in _IGNORED:
        return qos
    if policy not in FIELDS:
        return Unknown(f"`{policy[:60]}` of a quality of service is not followed")
    return qos.having({policy: policy_value(policy, value)})


def setter(qos: Qos, name: str, arguments: Sequence[Any], walk: Walk) -> Any:
    """Return a quality of service after a method of it was called; None where the method sets nothing."""
    stated = walk.table.setters.get(name)
    if stated is None:
        return None
    if len(arguments) == 1 and isinstance(arguments[0], Either):
        return each_case(arguments[0], lambda one: setter(qos, name, [one], walk))
    settings: dict[str, Any] = {}
    for policy, text in stated.items():
        first = arguments[0] if len(arguments) == 1 and text == "argument" else None
        if policy in walk.table.numbers and isinstance(first, (int, Template)) and not isinstance(first, bool):
            return _by_number(qos, policy, first, walk.table.numbers[policy])
        given = arguments[0] if arguments else Unknown(f"{policy} is set to a value that is not known")
        if len(arguments) > 1:
            given = Unknown(f"{policy} is set from several values")
        settings[policy] = policy_value(policy, given if text == "argument" else text)
    return qos.having(settings)


def _by_number(qos: Qos, policy: str, value: int | Template, words: Mapping[int, str]) -> Any:
    """Return a quality of service with the policy that a number means: one for each number where a parameter has it."""
    if isinstance(value, int):
        return qos.having({policy: words.get(value, Unknown(f"{value} is no number of {policy}"))})
    if not value.parameter:
        return qos.having({policy: Unknown(f"its {policy} is not known")})
    return Either(
        tuple(((Test(value.parameter, (str(number),)),), qos.having({policy: word})) for number, word in words.items())
    )


def number_of(word: Word, walk: Walk) -> Any:
    """Return the number of a value of an enumeration; the word itself where none is known."""
    plain = word.name.lower().replace("_", "")
    found = {
        number
        for policy, words in walk.table.numbers.items()
        for number, known in words.items()
        if (f"policy{policy}" in plain or f"{policy}policy" in plain) and _word(policy, word.name) == known
    }
    return found.pop() if len(found) == 1 else word


def maker(name: str, arguments: Sequence[Any], keywords: Mapping[str, Any], walk: Walk) -> Any:
    """Return the quality of service, or duration, that a call makes; None where it makes none."""
    scale = walk.table.lookup(walk.table.durations, name)
    if scale is not None:
        return _duration(scale, arguments, keywords)
    stated = walk.table.lookup(walk.table.makers, name)
    if stated is None:
        return None
    given = [content(each) for each in (*arguments, *keywords.values())]
    return _for_each(given, partial(_made, stated, len(arguments), tuple(keywords), walk))


def _for_each(values: list[Any], function: Callable[[list[Any]], Any]) -> Any:
    """Apply a function to values, or to each of the alternatives that one of them has."""
    at = next((index for index, each in enumerate(values) if isinstance(each, Either)), None)
    if at is None:
        return function(values)
    return each_case(values[at], lambda one: _for_each([*values[:at], one, *values[at + 1 :]], function))


def _made(stated: Mapping[str, Any], count: int, names: Sequence[str], walk: Walk, values: list[Any]) -> Any:
    """Return the quality of service that a call makes of values: `count` by position, the others by name."""
    arguments, keywords = values[:count], dict(zip(names, values[count:], strict=True))
    fields = stated.get("fields")
    if fields is not None:
        return _structure(fields, arguments)
    positions = stated.get("positions")
    if positions is not None:
        given = zip(positions, arguments, strict=False)
        return Qos("", tuple((name, policy_value(name, value)) for name, value in given))
    base = str(stated.get("base", ""))
    fixed = {policy: stated[policy] for policy in WORDS if policy in stated}
    made = Qos(base).having(fixed) if fixed else Qos(base)
    if "default_depth" in stated and not arguments:
        made = made.having({"depth": stated["default_depth"]})
    if stated.get("keywords"):
        return _by_keyword(made, arguments, keywords, walk.table.numbers)
    if not arguments or "depth" not in stated:
        return made
    return _from_first(made, arguments)


def _by_keyword(
    made: Qos, arguments: Sequence[Any], keywords: Mapping[str, Any], numbers: Mapping[str, Mapping[int, str]]
) -> Any:
    if arguments or "**" in keywords:
        return Unknown("it is made from values that are not followed")
    settings: dict[str, Any] = {}
    chosen: dict[str, Any] = {}
    for name, value in keywords.items():
        if name in _IGNORED and value is False:
            continue
        if name not in FIELDS:
            return Unknown(f"`{name[:60]}` is no policy that is known")
        if name in numbers and isinstance(value, (int, Template)) and not isinstance(value, bool):
            chosen[name] = value
        else:
            settings[name] = policy_value(name, value)
    found: Any = made.having(settings)
    for name, value in chosen.items():
        found = each_case(found, partial(_by_number, policy=name, value=value, words=numbers[name]))
    return found


def _from_first(made: Qos, arguments: Sequence[Any]) -> Any:
    """Return a quality of service made from a depth, a depth with history, or another one."""
    first = arguments[0]
    for each in arguments[1:]:  # `rclcpp::QoS(KeepLast(1), profile)`
        if isinstance(each, Qos) and isinstance(first, Qos):
            return each.having(dict(first.settings))
        return each if isinstance(each, Unknown) else Unknown("it is made from several values")
    if isinstance(first, list) and len(first) == 1:
        first = first[0]
    if isinstance(first, Qos):
        return (
            made.having(dict(first.settings))
            if first.preset in {"", made.preset} or (made.preset in {"", "default"} and not first.preset)
            else first
        )
    if isinstance(first, Word) and _word("history", first.name):
        return made.having({"history": _word("history", first.name)})
    if isinstance(first, (int, Template)) and not isinstance(first, bool):
        return made.having({"depth": policy_value("depth", first)})
    return first if isinstance(first, Unknown) else Unknown("its depth or profile is not known")


def _structure(fields: Sequence[str], arguments: Sequence[Any]) -> Any:
    if not arguments:
        return Unknown("its fields are set one by one")
    if len(arguments) < 4:  # noqa: PLR2004 - history, depth, reliability, durability
        return arguments[0] if isinstance(arguments[0], Qos) else Unknown("not all of its fields are stated")
    settings: dict[str, Any] = {}
    for policy, value in zip(fields, arguments, strict=False):
        if policy in DURATIONS:
            continue  # `RMW_QOS_DEADLINE_DEFAULT` and the like
        settings[policy] = policy_value(policy, value)
    for policy, value in zip(fields, arguments, strict=False):
        if policy in DURATIONS and not (isinstance(value, Word) and value.name.endswith("_DEFAULT")):
            settings[policy] = policy_value(policy, value)
    return Qos("default").having(settings)


def _duration(scale: Any, arguments: Sequence[Any], keywords: Mapping[str, Any]) -> Any:
    if isinstance(scale, int):
        value: Any = arguments[0] if len(arguments) == 1 else None
        return Duration(round(value * scale)) if _number(value) else Unknown("a duration that is not known")
    if len(arguments) == 1 and isinstance(arguments[0], Duration):
        return arguments[0]
    total = 0
    for part, factor in (("seconds", 10**9), ("nanoseconds", 1)):
        place = scale.get(part)
        value = (
            keywords.get(place, 0)
            if isinstance(place, str)
            else arguments[place]
            if isinstance(place, int) and place < len(arguments)
            else 0
        )
        if not _number(value):
            return Unknown("a duration that is not known")
        total += round(value * factor)
    return Duration(total) if arguments or keywords else Unknown("a duration that is not known")


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def preset(name: str, walk: Walk) -> Qos | None:
    """Return the preset that a name of a library means; None where it means none."""
    head, _, last = name.rpartition(".")
    found = walk.table.lookup(walk.table.presets, head if head and walk.table.is_same(last) else name)
    return None if found is None else Qos(str(found))


def as_qos(value: Any, walk: Walk) -> Any:
    """Return the quality of service that an argument means: one, or a depth."""
    value = content(value)
    if isinstance(value, Word):
        number = number_of(value, walk)
        if isinstance(number, int):  # an enumeration converts to a depth
            return Qos("default", (("depth", number),))
        return preset(value.name, walk) or Unknown(f"`{value.name[:60]}` is not known")
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if isinstance(value, (int, Template)) and not isinstance(value, bool):
        return Qos("default", (("depth", value),))
    if isinstance(value, Qos) and not value.preset:
        return Qos("default", value.settings)
    return value
