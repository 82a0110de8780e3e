"""Settings to write in place of common mistakes: words of other protocols, calls such as ``QoSProfile(depth=10)``, lists of values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.language.domains import Choice, Count, Duration
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import normalise
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.regular_expressions import re, regular_expression

if TYPE_CHECKING:
    from cqos_core.language.domains import Domain
    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain
    from cqos_core.packs.pack import RulePack

_LONGEST: Final = 300
_CALL: Final = regular_expression(r"([A-Za-z_][\w.:]*)\(((?:[^()]|\([^()]*\))*)\)")
_ARGUMENT: Final = regular_expression(r"(?:[^,()]|\([^()]*\))+")
_NAMED: Final = regular_expression(r"\s*(\w+)\s*=\s*(.+?)\s*")
_CHAIN: Final = regular_expression(r"(?:\.?[A-Za-z_][\w.:]*\((?:[^()]|\([^()]*\))*\))+")
_ASSIGNED: Final = regular_expression(r"^(?:auto\s+)?\w+\s*=\s*(?=[A-Za-z_])|;$")
_OF_A_TOPIC: Final = frozenset(("create_publisher", "create_subscription", "advertise", "publish", "subscribe"))
"""Calls that also take topics, types, payloads and functions."""
_LAST: Final = regular_expression(r".*(?:\.|::)")
_CAMEL: Final = regular_expression(r"(?<=[a-z])(?=[A-Z])")
_NUMBER: Final = regular_expression(r"\d{1,9}")


def meant_instead(pack: RulePack, text: str) -> str:
    """Return the text to write for a setting, ``name: value``, or a profile that the pack lists as a common mistake; else nothing."""
    for slip in pack.common_mistakes:
        if (found := re.fullmatch(slip.written, text.strip(), re.IGNORECASE)) is not None:
            return found.expand(slip.write)
    return ""


def settings_of_call(pack: RulePack, text: str, of: str = "") -> str:
    """Return the settings, as a map, that a call or a chain of calls in a program makes; empty where not all of it is understood.

    ``of`` is a policy that must be among them.
    """
    if len(text) > _LONGEST:
        return ""
    text = _ASSIGNED.sub("", text.strip())
    if not _CHAIN.fullmatch(text):
        return ""
    found: dict[str, str] = {}
    return _written(found) if _read_calls(pack, text, found) and (not of or of in found) else ""


def value_within(policy: Policy, text: str) -> str:
    """Return the only value of a policy that is a part of a longer text; else nothing.

    Such are ``RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT`` and ``10 messages``.
    """
    if isinstance(policy.domain, Count):
        counted = _COUNTED.fullmatch(text)
        return counted[1] if counted is not None else ""
    if not isinstance(policy.domain, Choice) or not _NAME.fullmatch(text):
        return ""
    written = "_".join(("", *re.split(r"[.:]+", normalise(_words(text))), ""))
    found = [word for word in policy.domain.names if f"_{word}_" in written and not word.isdigit()]
    found = [word for word in found if not any(word != other and word in other for other in found)]
    return found[0] if len(found) == 1 and not any(f"_{word}_" in written for word in _NEGATIONS) else ""


_NAME: Final = regular_expression(r"[A-Za-z_][\w.:]{0,80}")
_COUNTED: Final = regular_expression(r"(\d{1,9})\s+[a-z]{1,20}", re.IGNORECASE)
_NEGATIONS: Final = ("not", "no", "non", "un", "never")


def preset_within(pack: RulePack, text: str) -> str:
    """Return the settings that take a preset that a program names with its module, ``rclpy.qos.qos_profile_sensor_data``; else nothing."""
    last = _last(text.strip())
    name = pack.preset_names.get(normalise(last)) or pack.preset_names.get(normalise(_words(last)))
    return f"{{profile: {name}}}" if name is not None and _NAME.fullmatch(text.strip()) else ""


def settings_of_assignments(pack: RulePack, text: str) -> str:
    """Return the settings, as a map, of ``depth = 5, reliability = reliable``; empty where not all of it is understood."""
    if len(text) > _LONGEST or _ASSIGNMENT.sub("", text).strip(" \t\n,;"):
        return ""
    found: dict[str, str] = {}
    return _written(found) if all(_set(pack, name, value, found) for name, value in _ASSIGNMENT.findall(text)) else ""


_ASSIGNMENT: Final = regular_expression(r"(\w++)\s*+=\s*+([^\s,;]++)")


def settings_of_values(pack: RulePack, texts: list[str]) -> str:
    """Return the settings, as a map, of which only the values are written; empty where not each is the value of one policy alone."""
    words = {word for policy in pack.policies for word in policy.words}
    presets = [text for text in texts if normalise(text) in pack.preset_names.keys() - words]
    found = {"profile": presets[0]} if len(presets) == 1 < len(texts) else {}
    return _written(found) if all(text in found.values() or _read_value(pack, text, found) for text in texts) else ""


def _written(found: dict[str, str]) -> str:
    return f"{{{', '.join(f'{name}: {value}' for name, value in found.items())}}}" if found else ""


def _read_calls(pack: RulePack, text: str, found: dict[str, str]) -> bool:
    """Add what calls set; whether all of it is understood."""
    return all(_read_call(pack, call[1], call[2].strip(), found) for call in _CALL.finditer(text))


def _read_call(pack: RulePack, function: str, arguments: str, found: dict[str, str]) -> bool:
    name = _last(function)
    if policies := _policies_with(pack, _words(name)):
        return _read_value(pack, name, found) and (
            _set_time(pack, policies[0], arguments, found) or _read_arguments(pack, arguments, found)
        )
    if pack.find(ENDPOINT, name) is not None:
        return _set(pack, name, arguments, found)
    if name in _OF_A_TOPIC:
        for argument in _ARGUMENT.findall(arguments):
            _read_arguments(pack, argument, found)
        return bool(found)
    return _read_arguments(pack, arguments, found)


def _read_arguments(pack: RulePack, arguments: str, found: dict[str, str]) -> bool:
    for argument in _ARGUMENT.findall(arguments):
        named = _NAMED.fullmatch(argument)
        if named is not None:
            understood = _set_by_call(pack, named[1], named[2], found) or _set(pack, named[1], named[2], found)
        elif _CALL.search(argument):
            understood = _read_calls(pack, argument, found)
        elif preset := preset_within(pack, argument):
            found["profile"] = preset.removeprefix("{profile: ").removesuffix("}")
            understood = True
        else:
            understood = _read_value(pack, argument, found)
        if not understood:
            return False
    return True


def _set_by_call(pack: RulePack, name: str, text: str, found: dict[str, str]) -> bool:
    """Add what a call sets that stands for the value of a policy, ``history=keep_last(5)``; False where it does not set that policy."""
    more: dict[str, str] = {}
    index = pack.find(ENDPOINT, name)
    if index is None or not _CHAIN.fullmatch(text) or not _read_calls(pack, text, more):
        return False
    if pack.policies[index].name not in more:
        return False
    found.update(more)
    return True


def _set_time(pack: RulePack, name: str, text: str, found: dict[str, str]) -> bool:
    """Add the time that belongs to a value, ``Reliable(duration(seconds=1))``; False where there is none, or several may be meant."""
    times = [each for each in pack.policies if each.name.startswith(f"{name}.") and isinstance(each.domain, Duration)]
    return bool(text) and len(times) == 1 and _set(pack, times[0].name, text, found)


def _words(name: str) -> str:
    """Return a name in camel case, ``KeepLast``, as words with underscores."""
    return _CAMEL.sub("_", name)


def _last(text: str) -> str:
    """Return a name without the namespaces and classes before it."""
    return _LAST.sub("", text.strip())


def _set(pack: RulePack, name: str, text: str, found: dict[str, str]) -> bool:
    """Add a value of a policy; False where there is no such policy, or it has no such value."""
    index = pack.find(ENDPOINT, name)
    if index is None:
        return False
    policy = pack.policies[index]
    for word in (text.strip(), _last(text), _words(_last(text))):
        value, near = _read(policy.domain, word)
        if value is not None or near:
            found[policy.name] = near if value is None else policy.domain.format(value)
            return True
    return False


def _read(domain: Domain, text: str) -> tuple[Plain | None, str]:
    try:
        return domain.parse(text), ""
    except InvalidValueError as problem:
        return None, problem.near if "(" in text else ""


def _read_value(pack: RulePack, text: str, found: dict[str, str]) -> bool:
    """Add a value by the only policy that has it, or as the pack reads it; a number is a depth."""
    slip = meant_instead(pack, text)
    if slip.startswith("{"):
        entries = (each.partition(": ") for each in slip[1:-1].split(", "))
        found.update({name: value for name, _, value in entries})
        return True
    if _NUMBER.fullmatch(text.strip()):
        return bool(pack.timing.depth) and _set(pack, pack.timing.depth, text, found)
    name = _words(_last(text))
    policies = _policies_with(pack, name)
    return len(policies) == 1 and _set(pack, policies[0], name, found)


def _policies_with(pack: RulePack, text: str) -> list[str]:
    """Return the policies of endpoints that have a word as one of a few values; those that are a part of another do not count."""
    return [
        policy.name
        for policy in pack.policies
        if policy.level == ENDPOINT
        and "." not in policy.name
        and isinstance(policy.domain, Choice)
        and policy.domain.read(text) is not None
    ]
