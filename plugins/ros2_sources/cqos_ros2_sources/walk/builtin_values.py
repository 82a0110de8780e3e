"""Built-in values of both languages: their constructors, and the results of their methods."""

from __future__ import annotations

from string import Formatter
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import inner_type, last_part, refers
from cqos_ros2_sources.programs.program import Attribute, Name
from cqos_ros2_sources.walk.call_effects import note_nodes, open_to
from cqos_ros2_sources.walk.cpp_copies import copied, type_of_name
from cqos_ros2_sources.walk.expressions import replace_value
from cqos_ros2_sources.walk.operators import element
from cqos_ros2_sources.walk.other_writers import is_class
from cqos_ros2_sources.walk.override_options import overriding_of
from cqos_ros2_sources.walk.profiles import forget
from cqos_ros2_sources.walk.values import (
    MISSING,
    NO_POSITION,
    Code,
    Condition,
    Counted,
    Instance,
    Template,
    Test,
    joined,
)
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_ros2_sources.programs.program import Expression
    from cqos_ros2_sources.walk.endpoint_calls import Given
    from cqos_ros2_sources.walk.frames import Walk

_NUMBERS: Final = frozenset(
    (
        "int",
        "float",
        "double",
        "bool",
        "size_t",
        "unsigned",
        "long",
        "char",
        "uint8_t",
        "int32_t",
        "int64_t",
        "uint32_t",
        "uint16_t",
        "auto",
    )
)
_TEXTS: Final = frozenset(("string", "std::string"))
_LISTS: Final = frozenset(("vector", "array", "list", "set", "initializer_list"))
_MAPS: Final = frozenset(("map", "unordered_map"))
_POINTERS: Final = frozenset(("shared_ptr", "unique_ptr", "weak_ptr", "optional"))
_READING: Final = frozenset(
    (
        *("find", "size", "length", "count", "begin", "end", "compare", "substr", "split", "strip", "lstrip", "rstrip"),
        *("value_to_string", "get_type", "get_type_name", "type_name", "starts_with", "ends_with", "contains", "c_str"),
        *("find_first_of", "find_last_of", "find_first_not_of", "find_last_not_of", "get_name", "cbegin", "cend"),
        *("startswith", "lower", "upper", "replace", "keys", "values", "items", "join", "get", "back", "front", "data"),
    )
)
"""Methods that leave a text or list as it is."""
_KEEPS: Final = frozenset(("push_back", "emplace_back", "append"))
_OF_LISTS: Final = frozenset(("at", "get", "front", "back", "keys", "values", "items"))
_OF_CHARACTERS: Final = frozenset(("at", "front", "back"))
_HELD: Final = {list: _OF_LISTS, dict: _OF_LISTS, str: _OF_CHARACTERS, Template: frozenset(("at",))}
"""Methods that return what is in a value, by its kind."""
_OF_TEXTS: Final = frozenset(
    (
        "lower",
        "upper",
        "strip",
        "lstrip",
        "rstrip",
        "replace",
        "startswith",
        "endswith",
        "split",
        "removeprefix",
        "title",
    )
)
_BRACES: Final = frozenset(("fmt::format", "std::format"))
_WRITES: Final = frozenset(("to_string", "str"))
_STREAMS: Final = frozenset(("stringstream", "ostringstream"))
_LONGEST_LIST: Final = 100
_LONGEST_TEXT: Final = 1_000
_MOST_ARGUMENTS: Final = 3


def library_value(name: str, given: Given, walk: Walk) -> Any:
    """Return a value of a plain type, or an object of a library; the mark for none where it is a function that is not known."""
    last, arguments = last_part(name), given.arguments
    cpp = walk.program.language == "cpp"
    found = _of_cpp(name, given) if cpp else builtin(name, given)
    if found is not MISSING:
        listed = cpp and last in (_LISTS | _MAPS) and isinstance(given.call.function, Name)
        return copied(found, given.call.function.text, walk) if listed else found  # type: ignore[union-attr]
    overriding = overriding_of(name, given)
    if overriding is not None:
        return overriding
    if walk.table.is_same(name) and len(arguments) >= 1:
        return str(arguments[0]) if type(arguments[0]) is int and last in _WRITES else arguments[0]
    if not last[:1].isupper() or (walk.program.language == "cpp" and not is_class(last)):
        return MISSING  # a function that is not known, or a macro
    note_callbacks(given, walk)
    values = (*given.arguments, *given.keywords.values())
    note_nodes(name, given.call, values, walk)
    open_to(name, given.call, values, walk)
    if walk.program.language == "cpp" and not walk.table.is_listed("harmless", name):
        forget(values, f"`{name[:60]}` may change it", given.call.place)
    made = Instance(None, library=name)
    node = next((each.node for each in arguments if isinstance(each, Instance) and each.node is not None), None)
    if node is not None:
        made.members["#node"] = node
    return made


def _of_cpp(name: str, given: Given) -> Any:
    """Return a text, list, number, or what a pointer points to, in C++; the mark for none where the call makes none."""
    last, arguments = last_part(name), given.arguments
    if name in _TEXTS or last == "string":
        return arguments[0] if len(arguments) == 1 else "" if not arguments else Unknown("a text of several values")
    if last in _STREAMS:
        return Unknown("a stream that begins with a text") if arguments else ""
    if name in _BRACES and arguments and isinstance(arguments[0], str):
        return braces(arguments[0], arguments[1:], {})
    if name == "#range":
        return builtin("range", given)
    if last in _LISTS:
        whole = arguments[0] if len(arguments) == 1 and isinstance(arguments[0], list) else list(arguments)
        return whole if given.call.types == ("{",) or not arguments else Unknown("a list that is not known")
    if last in _MAPS:
        pairs = arguments[0] if len(arguments) == 1 and _paired(arguments[0]) else list(arguments)
        return dict(pairs) if _paired(pairs) else Unknown("a map that is not known")
    if name in _NUMBERS:
        return arguments[0] if len(arguments) == 1 else Unknown("it has no value before it is used")
    written = given.call.function.text if isinstance(given.call.function, Name) else name
    if last in _POINTERS or inner_type(written) != written:
        return arguments[0] if arguments else None
    return MISSING


def _paired(value: Any) -> bool:
    """Whether a value lists pairs of a plain key and a value."""
    return isinstance(value, list) and all(
        isinstance(each, list) and len(each) == 2 and isinstance(each[0], (str, int))  # noqa: PLR2004 - a pair
        for each in value
    )


def note_callbacks(given: Given, walk: Walk) -> None:
    """Note functions that a library is handed: it calls them later."""
    walk.callbacks += [each for each in (*given.arguments, *given.keywords.values()) if isinstance(each, Code)]


# Methods and functions of plain values


def on_plain(receiver: Any, function: Attribute, given: Given, walk: Walk) -> Any:
    """Return the result of a method of a text, list or dictionary; the mark for none where it is not followed."""
    name = function.name
    written = given.call.arguments
    kind = type_of_name(function.of, walk)
    held = [
        copied(each, _type_of_element(kind, one, walk), walk, written=one)
        for each, one in zip(given.arguments, written, strict=False)
    ]
    changes = _changed(receiver, name, held if name in _KEEPS else given.arguments)
    if changes is not MISSING:
        replace_value(function.of, receiver, changes, walk)
        return None
    if name == "format" and isinstance(receiver, str):
        return braces(receiver, given.arguments, given.keywords)
    if name == "empty" and isinstance(receiver, (str, list)):
        return not receiver
    if name == "empty" and isinstance(receiver, Template):
        return _empty(receiver)
    if name in {"size", "length"} and isinstance(receiver, (str, list)) and not given.arguments:
        return len(receiver)
    if name in _HELD.get(type(receiver), ()):
        return _held(receiver, name, given)
    if name == "size" and isinstance(receiver, Template) and receiver.parameter:
        return Counted(receiver)
    if isinstance(receiver, (str, Template, list, dict)) and name not in _READING:
        replace_value(function.of, receiver, Unknown(f"`{name[:60]}` may change it", given.call.place), walk)
    elif isinstance(receiver, str) and walk.program.language == "python":
        return _of_text(receiver, name, given)
    elif isinstance(receiver, str):
        return _of_cpp_text(receiver, name, given.arguments)
    return MISSING


def _type_of_element(kind: str, written: Expression, walk: Walk) -> str:
    """Return the type of what a list of a type is given: a pointer, a quality of service, or what is written for it."""
    inner = kind.partition("<")[2].rpartition(">")[0].strip()
    stated = refers(inner) or walk.table.lookup(walk.table.makers, inner) is not None
    return inner if stated else type_of_name(written, walk)


def _changed(receiver: Any, name: str, arguments: Sequence[Any]) -> Any:
    """Return what a text or list is after a method that changes it; the mark for none where it does not."""
    if name in _KEEPS and isinstance(receiver, list):
        new = [*receiver, *arguments]
        return new if len(new) <= _LONGEST_LIST else Unknown("a long list")
    if name == "pop_back" and isinstance(receiver, (list, str)) and receiver:
        return receiver[:-1]
    if name in {"append", "push_back"} and isinstance(receiver, (str, Template)) and len(arguments) == 1:
        return joined([receiver, *arguments])
    if name == "str" and isinstance(receiver, (str, Template)) and arguments:  # `stream.str("")`
        return arguments[0]
    return MISSING


def _of_cpp_text(text: str, name: str, arguments: Sequence[Any]) -> Any:
    """Return the result of a method of a text in C++; the mark for none where it is not followed."""
    kinds = [type(each) for each in arguments]
    if name == "substr" and kinds in ([int], [int, int]) and arguments[0] <= len(text):
        return text[arguments[0] :][: arguments[1] if len(arguments) > 1 else None]
    if name in {"find", "rfind"} and kinds == [str]:
        at = getattr(text, name)(arguments[0])
        return at if at >= 0 else NO_POSITION
    if (name, kinds) == ("rfind", [str, int]) and arguments[1] == 0:
        return 0 if text.startswith(arguments[0]) else NO_POSITION
    if name in {"starts_with", "ends_with"} and kinds == [str]:
        return getattr(text, name.replace("_", ""))(arguments[0])
    return MISSING


def _held(receiver: Any, name: str, given: Given) -> Any:
    """Return what a list, dictionary or text holds."""
    if isinstance(receiver, dict) and name in {"keys", "values", "items"} and not given.arguments:
        return [list(each) if name == "items" else each for each in getattr(receiver, name)()]
    key = {"front": 0, "back": -1}.get(name, given.arguments[0] if given.arguments else None)
    return element(receiver, key)


def _of_text(text: str, name: str, given: Given) -> Any:
    """Return the result of a method of a text in Python."""
    arguments = given.arguments
    if name == "join" and len(arguments) == 1 and isinstance(arguments[0], list) and not given.keywords:
        parts = [part for each in arguments[0] for part in (text, each)]
        return joined(parts[1:])
    short = len(text) <= _LONGEST_TEXT and len(arguments) <= _MOST_ARGUMENTS
    if name not in _OF_TEXTS or given.keywords or not short or not all(isinstance(each, str) for each in arguments):
        return MISSING
    try:
        return getattr(text, name)(*arguments)
    except (TypeError, ValueError):
        return MISSING


def _empty(receiver: Template) -> Any:
    return Condition((Test(receiver.parameter, ("",)),)) if receiver.parameter else Unknown("whether a text is empty")


def braces(text: str, arguments: Sequence[Any], keywords: Mapping[str, Any]) -> Any:
    """Return a text with the values of arguments in place of ``{}``, ``{0}`` and ``{name}``."""
    parts: list[Any] = []
    count = 0
    try:
        fields = list(Formatter().parse(text))
    except ValueError:
        return Unknown("a formatted text")
    for plain, field, layout, conversion in fields:
        parts.append(plain)
        if field is None:
            continue
        index = int(field) if field.isdigit() else count
        count += not field
        known = keywords.get(field, MISSING) if field and not field.isdigit() else MISSING
        if (not field or field.isdigit()) and index < len(arguments):
            known = arguments[index]
        if known is MISSING or layout or conversion:
            return Unknown("a formatted text")
        parts.append(known)
    return joined(parts)


def builtin(name: str, given: Given) -> Any:
    """Return the result of a function of Python that makes a list or number of known values; the mark for none for any other."""
    arguments = given.arguments if not given.keywords else []
    if name == "len" and len(arguments) == 1 and isinstance(arguments[0], Template) and arguments[0].parameter:
        return Counted(arguments[0])
    if name == "range" and arguments and arguments[:-1] in ([], [0]) and isinstance(arguments[-1], Counted):
        return arguments[-1]
    if name == "range" and not all(type(each) is int for each in arguments):
        return Unknown("how often a loop runs is not known")
    if name == "range" and arguments and all(type(each) is int for each in arguments):
        if len(arguments) > _MOST_ARGUMENTS or arguments[2:] == [0]:
            return MISSING
        found = range(*arguments)
        return list(found) if len(found) <= _LONGEST_LIST else Unknown("a long list")
    if name == "len" and len(arguments) == 1 and isinstance(arguments[0], (str, list, dict)):
        return len(arguments[0])
    lists = [[*each] if isinstance(each, dict) else each for each in arguments]
    if not lists or not all(isinstance(each, list) for each in lists):
        return MISSING
    if name in {"list", "tuple"} and len(lists) == 1:
        return lists[0]
    if name == "enumerate" and len(lists) == 1:
        return [[number, each] for number, each in enumerate(lists[0])]
    return [list(each) for each in zip(*lists, strict=False)] if name == "zip" else MISSING
