"""Calls that let callbacks come before a program goes on: calls that spin, and functions that spin in a thread or elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import fits, inner_type, last_part
from cqos_ros2_sources.programs.program import THIS, Attribute, Name, Reference, call_name
from cqos_ros2_sources.programs.statement_search import calls_in
from cqos_ros2_sources.walk.values import Code, Instance, Word
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_ros2_sources.programs.program import Call, Class, Expression, Function
    from cqos_ros2_sources.walk.frames import Walk

_SPINS: Final = frozenset(
    (
        *("spin", "spin_once", "spin_some", "spin_all", "spin_until_complete", "spin_until_future_complete"),
        *("spin_node_once", "spin_node_some", "spin_node_until_future_complete", "spin_once_until_future_complete"),
    )
)
"""Calls that let callbacks come before the program goes on."""
_REGISTERS: Final = ("create_", "add_")
"""How calls begin that are handed what is called while something spins: timers, subscriptions."""
_CALLED: Final = ("operator()", "__call__")


def note_call(expression: Call, receiver: Any, values: Iterable[Any], walk: Walk) -> None:
    """Take what callbacks set as open where a call lets callbacks come, or is handed a function that does."""
    if not walk.starting:
        return
    name = last_part(call_name(expression))
    registers = name in walk.table.calls or (name.startswith(_REGISTERS) and "thread" not in name)
    if name in _SPINS or (not registers and any(_spins(each, walk) for each in _handed(values, walk))):
        walk.starting = False
    elif name == "start" and isinstance(receiver, Instance):  # a thread of a class of its own
        walk.starting = not any(_spins(each, walk) for each in _methods(receiver, ("run",), walk))


def note_value(name: str, value: Any, walk: Walk) -> None:
    """Take what callbacks set as open where a function of a library that spins is used as a value: a thread may call it."""
    if isinstance(value, (Unknown, Word)) and last_part(name) in _SPINS:
        walk.starting = False


def _handed(values: Iterable[Any], walk: Walk) -> Iterator[Code]:
    """Yield the functions in values."""
    for each in values:
        if isinstance(each, Code):
            yield each
        elif isinstance(each, Instance):
            yield from _methods(each, _CALLED, walk)
        elif isinstance(each, list):
            yield from _handed(each, walk)


def _methods(instance: Instance, names: Iterable[str], walk: Walk) -> Iterator[Code]:
    from cqos_ros2_sources.walk.functions import method_of

    for name in names:
        yield from (Code(each, instance) for each in method_of(instance.cls, name, walk))


def _spins(code: Code, walk: Walk) -> bool:
    """Whether a function, or one that it calls or hands on, lets callbacks come."""
    return any(last_part(_written(part)) in _SPINS for each in _reached(code, set(), walk) for part in _parts(each))


def called_later(walk: Walk) -> set[int]:
    """Return the identities of the functions that callbacks which are known by now call or hand on."""
    while walk.searched < len(walk.callbacks):
        walk.searched += 1
        for _ in _reached(walk.callbacks[walk.searched - 1], walk.later, walk):
            pass
    return walk.later


def _reached(code: Code, seen: set[int], walk: Walk) -> Iterator[Function]:
    """Yield a function with those that it calls or hands on, apart from those that were seen; they are seen then."""
    cls = code.this.cls if code.this is not None else _owner(code.function, walk)
    waiting: list[tuple[Function, Class | None]] = [(code.function, cls)]
    while waiting:
        function, cls = waiting.pop()
        if id(function) in seen:
            continue
        seen.add(id(function))
        yield function
        names = {**code.names, **code.own} if function is code.function else {}
        for part in _parts(function):
            waiting += _meant(part, cls, names, walk)


def _parts(function: Function) -> Iterator[Expression]:
    """Yield what a function calls and hands on."""
    for each in calls_in(function.body, function.initializers):
        yield from (each.function, *each.arguments, *(value for _, value in each.keywords))


def _written(part: Expression) -> str:
    return part.text if isinstance(part, Name) else getattr(part, "name", "")


def _meant(
    part: Expression, cls: Class | None, names: dict[str, Any], walk: Walk
) -> Iterator[tuple[Function, Class | None]]:
    """Yield the functions of the program that a name in a function of a class may mean, with their classes."""
    from cqos_ros2_sources.walk.functions import method_of

    of = part.of if isinstance(part, Attribute) else None
    text = part.text if isinstance(part, Name) else part.name if isinstance(part, (Attribute, Reference)) else ""
    last = last_part(text)
    if isinstance(names.get(text), Code) and of is None:
        yield names[text].function, cls
        return
    on = cls if of is None or of == Name(THIS) else _class_of(of, cls, names, walk)
    found = method_of(on, last, walk)
    if not found and of is None:
        found = [each for each in walk.program.functions.get(last, ()) if fits(each.name, text)]
        found = [each for each in found if not each.owner or last != text]
    elif not found and on is None:
        found = [each for each in walk.program.functions.get(last, ()) if each.owner]
    for each in found:
        yield each, _owner(each, walk)


def _owner(function: Function, walk: Walk) -> Class | None:
    return walk.program.find_class(function.owner, function.place.source) if function.owner else None


def _class_of(of: Expression, cls: Class | None, names: dict[str, Any], walk: Walk) -> Class | None:
    """Return the class of the program that an object in a function has; None where it is not known."""
    name = of.text if isinstance(of, Name) else of.name if isinstance(of, Attribute) and of.of == Name(THIS) else ""
    value = names.get(name)
    if isinstance(value, Instance):
        return value.cls
    written = cls.fields.get(name, "") if cls is not None else ""
    return walk.program.find_class(inner_type(written)) if written else None
