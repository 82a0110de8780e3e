"""Other writers of a name: methods that a walk has not reached, and lambdas that are kept for later."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import fits, last_part
from cqos_ros2_sources.programs.program import (
    THIS,
    Assign,
    Attribute,
    Call,
    Class,
    Closure,
    Element,
    Function,
    Loop,
    Name,
    NotFollowed,
    Operation,
    Reference,
    Return,
    call_name,
)
from cqos_ros2_sources.programs.statement_search import assignments, calls_in, inside
from cqos_ros2_sources.walk.frames import Walk, lineage
from cqos_ros2_sources.walk.profiles import forget, is_profile
from cqos_ros2_sources.walk.python_aliases import changes, holding, mentions, seen_from
from cqos_ros2_sources.walk.qualities import FIELDS
from cqos_ros2_sources.walk.spin_calls import called_later
from cqos_ros2_sources.walk.values import PLAIN, Code, Instance
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_sources.programs.program import Expression

_COUNTS: Final = "++"
"""How a name stands in a list of setters that is made from its own value."""
CHANGING: Final = frozenset(
    (
        *("add", "append", "extend", "insert", "update", "remove", "discard", "pop", "clear"),
        *("push_back", "emplace_back", "pop_back", "emplace", "erase", "resize", "assign"),
    )
)
"""Methods that change a list, set or dictionary."""
_TRANSITIONS: Final = frozenset(("on_deactivate", "on_cleanup", "on_shutdown", "on_error"))
"""What the life cycle of a node calls, apart from its start."""
STARTS: Final = ("create_", "add_")
_LATER: Final = frozenset(("thread", "async", "bind", "connect", "registerCallback", "subscribe"))
"""Calls that call what they are handed later, from another place: it sets nothing before the node has started."""


def set_elsewhere(instance: Instance, name: str, walk: Walk) -> str:
    """Return why a member may have another value than the walk saw; empty where it cannot."""
    cyclic = not walk.in_callback and _has_life_cycle(instance, walk)
    for cls in lineage(instance.cls, walk):
        key = cls.name, cyclic
        if key not in walk.setters:
            walk.setters[key] = _setters(cls, walk, cyclic=cyclic)
        if walk.in_callback and f"{name}{_COUNTS}" in walk.setters[key]:
            return f"`{name}` counts while it runs"
        for function in walk.setters[key].get(name, ()):
            if id(function) not in walk.executed or (not walk.in_callback and id(function) in called_later(walk)):
                walk.awaited.add(id(function))
                return f"`{name}` is also set in `{function.last}`"
    return ""


def _has_life_cycle(instance: Instance, walk: Walk) -> bool:
    """Whether methods of an object are called in the order of a life cycle: of a node, or of a plugin."""
    known = walk.table.node_class(instance.library)
    if known is not None:
        return bool(known[1].values.get("lifecycle"))
    return instance.cls is not None and any(fits(instance.cls.name, each) for each in walk.program.plugins)


def _setters(cls: Class, walk: Walk, *, cyclic: bool) -> dict[str, list[Function]]:
    found: dict[str, list[Function]] = {}
    skipped = {last_part(cls.name), "__init__", *walk.at_run_time}
    if cyclic:  # what the end of a life cycle sets is gone or set again before the next start
        skipped |= {*walk.table.lists["lifecycle"], *_TRANSITIONS}
    for function in walk.program.owned(cls.name):
        at_start = function.last in skipped or function.last.startswith("~")
        for name in _names_set(function, walk):
            if not at_start or (name.endswith(_COUNTS) and function.last not in {last_part(cls.name), "__init__"}):
                found.setdefault(name, []).append(function)
        if walk.program.language == "cpp" and (at_start or b"[" in function.source):
            for inner in _lambdas(function):
                for name in _names_set(inner, walk):
                    found.setdefault(name, []).append(inner)
    return found


def changed_in(full: str, file: str, walk: Walk) -> Function | None:
    """Return a function that may change what stands at the top of a file, and that the walk has not come to.

    Args:
        full: its name.
        file: where it stands.
        walk: where the walk is.
    """
    program, key = walk.program, (full, file)
    if key not in program.changing:
        functions = {id(each): each for found in program.functions.values() for each in found}.values()
        if program.language == "cpp":
            mentioning = (each for each in functions if each.mentions((last_part(full).encode(),)))
            program.changing[key] = [each for each in mentioning if _changes(each, full, file, walk)]
        else:
            names = holding(full, walk)
            mentioning = (each for each in functions if mentions(each, names, walk))
            program.changing[key] = [each for each in mentioning if _changes_any(each, names, walk)]
    return next((each for each in program.changing[key] if id(each) not in walk.executed), None)


def _changes_any(function: Function, names: Iterable[str], walk: Walk) -> bool:
    """Whether a function of Python may change an object that stands at the top of files under some names."""
    made = [each for each in inside(function.body) if isinstance(each, Assign)]
    members = {f".{last_part(each)}" for each in names if function.owner and each.rpartition(".")[0] == function.owner}
    return changes(function, members | (seen_from(function.name, names) - _own_names(function, made)), walk)


def _own_names(function: Function, made: Iterable[Assign]) -> set[str]:
    """Return the names of a function that are its own: parameters, and what it declares."""
    own = {each.name for each in function.parameters}
    own |= {each.target.text for each in made if isinstance(each.target, Name)}
    return own | {each for loop in inside(function.body) if isinstance(loop, Loop) for each in loop.targets}


def _changes(function: Function, full: str, file: str, walk: Walk) -> bool:
    """Whether a function of C++ may change what stands at the top of a file."""
    name = last_part(full)
    made = [each for each in inside(function.body) if isinstance(each, Assign) and each.declares]
    own = _own_names(function, made)
    written = {each.removesuffix(_COUNTS) for each in _names_set(function, walk)}
    cls = walk.program.find_class(function.owner, function.place.source) if function.owner else None
    alike = {each for _, _, each in walk.program.constants.get(name, ())} & walk.program.reached(function.place.source)
    if name in own or (alike and file not in alike) or any(name in each.fields for each in lineage(cls, walk)):
        return False
    if any(last_part(each) == name for each in written):
        return True
    refers = [each.value for each in made if each.type.endswith(("&", "*")) and not each.type.startswith("const ")]
    if function.returns.endswith(("&", "*")) and not function.returns.startswith("const "):
        refers += [each.value for each in inside(function.body) if isinstance(each, Return) and each.value is not None]
    calls = (each for each in calls_in(function.body) if walk.table.is_listed("calling", call_name(each)))
    refers += [given for each in calls for given in each.arguments]
    return any(_means(each, name) for each in refers)


def _means(written: Expression, name: str) -> bool:
    """Whether an expression means the object of a plain name, or refers to it."""
    if isinstance(written, Operation) and len(written.operands) == 1:
        written = written.operands[0]
    bound = written.bound if isinstance(written, Reference) else ()
    return (isinstance(written, Name) and last_part(written.text) == name) or any(_means(each, name) for each in bound)


def _lambdas(function: Function) -> Iterator[Function]:
    for each in calls_in(function.body, function.initializers):
        yield from (part.function for part in each.arguments if isinstance(part, Closure))


def _names_set(function: Function, walk: Walk) -> tuple[str, ...]:
    """Return the names that a function sets; they are searched once."""
    known = walk.program.names_set
    if id(function) not in known:
        known[id(function)] = tuple(_set_in(function, walk))
    return known[id(function)]


def _set_in(function: Function, walk: Walk) -> Iterator[str]:
    """Yield the names that a function sets: plain ones, and those of its object."""
    for each in assignments(function):
        target = each.target
        own = isinstance(target, Attribute) and target.of == Name(THIS)
        name = target.text if isinstance(target, Name) else target.name if own else ""  # type: ignore[union-attr]
        if isinstance(target, Attribute) and isinstance(target.of, (Name, Attribute)) and not own:
            root = target.of.text if isinstance(target.of, Name) else target.of.name
            yield f"{root}.{target.name}"
        if isinstance(target, Attribute) and target.name in FIELDS:
            yield from _root(target.of)
        if name:
            yield name
            value = each.value
            if isinstance(value, NotFollowed) or (isinstance(value, Operation) and target in value.operands):
                yield f"{name}{_COUNTS}"
    for call in calls_in(function.body):
        of = call.function.of if isinstance(call.function, Attribute) else None
        if isinstance(of, (Name, Attribute)) and call_name(call) in CHANGING:
            yield of.text if isinstance(of, Name) else of.name
        if (
            of is not None
            and call_name(call) in walk.table.setters
            and (call.arguments or call_name(call) not in FIELDS)
        ):
            yield from _root(of)
        if call_name(call) == "setattr" and call.arguments:
            yield from _root(call.arguments[0])
    if walk.program.language == "cpp":
        yield from _handed_out(function, walk)


def _root(written: Expression) -> Iterator[str]:
    """Yield the name of the quality of service that an expression means, or a policy of it."""
    while True:
        if isinstance(written, Call) and isinstance(written.function, Attribute):
            written = written.function.of
        elif (isinstance(written, Attribute) and written.of != Name(THIS) and written.name in FIELDS) or isinstance(
            written, Element
        ):
            written = written.of
        else:
            break
    if isinstance(written, Name) and written.text != THIS:
        yield written.text
    elif isinstance(written, Attribute):
        yield written.name


def _handed_out(function: Function, walk: Walk) -> Iterator[str]:
    """Yield the plain names that a function of C++ hands to calls that may change them."""
    for each in calls_in(function.body):
        name = call_name(each)
        known = walk.program.functions.get(last_part(name), [])
        into = {row.values["into"] for row in walk.table.parameters.get(last_part(name), []) if "into" in row.values}
        for index, given in enumerate(each.arguments):
            if not isinstance(given, Name) or given.text.isupper():
                continue
            changed = any(variable.by_reference for one in known for variable in one.parameters[index : index + 1])
            if index in into or changed or not (known or walk.table.is_listed("harmless", name) or is_class(name)):
                yield given.text


def is_class(name: str) -> bool:
    """Whether a name that nothing defines is written like that of a class: macros may change what they are given."""
    last = last_part(name)
    return last[:1].isupper() and not (last.isupper() and "_" in last)


def kept_for_later(values: Iterable[Any], call: Call, walk: Walk) -> None:
    """Note lambdas that a call was handed and did not call: what they set is not known from then on."""
    name = last_part(call_name(call))
    if walk.program.language != "cpp" or name in _LATER or name.startswith(STARTS):
        return
    for each in values:
        if isinstance(each, Code) and each.function.name == "lambda" and id(each.function) not in walk.executed:
            walk.callbacks.append(each)
            for set_there in _names_set(each.function, walk):
                _forget(set_there.removesuffix(_COUNTS), each, walk)


def _forget(name: str, code: Code, walk: Walk) -> None:
    from cqos_ros2_sources.walk.expressions import member

    unknown = Unknown(f"`{name[:60]}` is also set in a lambda in line {code.function.place.line}")
    if name in code.own:
        forget(code.own[name], unknown.cause)
        return
    if name in code.names:
        forget(code.names[name], unknown.cause)
        plain = isinstance(code.names[name], PLAIN) and not is_profile(code.names[name])
        code.names[name] = unknown if plain else code.names[name]
    elif code.this is not None and isinstance(found := member(code.this, name, walk), PLAIN):
        forget(found, unknown.cause)
        code.this.members[name] = found if is_profile(found) else unknown


def forget_all(instance: Instance, name: str, walk: Walk) -> None:
    """Take the values of an object as not known where a method of it is called whose definition was not read."""
    from cqos_ros2_sources.walk.functions import method_of

    if not any(name in cls.declared for cls in lineage(instance.cls, walk)) or method_of(instance.cls, name, walk):
        return
    forget_members(instance, f"the definition of `{name[:60]}` was not read", walk)


def forget_members(instance: Instance, cause: str, walk: Walk) -> None:
    """Take the values of an object as not known: something may have changed them that was not followed."""
    unknown = Unknown(cause)
    for cls in lineage(instance.cls, walk):
        for each in cls.initial:
            if each not in cls.fixed:
                instance.members.setdefault(each, unknown)
    for each, value in instance.members.items():
        if is_profile(value):
            forget(value, cause)
        elif isinstance(value, PLAIN) and value is not None and not each.startswith("#"):
            forget(value, cause)
            instance.members[each] = unknown
