"""Functions of a program: which one a call means, and how arguments get into its names and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_ros2_sources.programs.program import Attribute, Name
from cqos_ros2_sources.walk.cpp_copies import copied
from cqos_ros2_sources.walk.expressions import assign, evaluate, made_once
from cqos_ros2_sources.walk.frames import lineage
from cqos_ros2_sources.walk.profiles import is_profile, undecided
from cqos_ros2_sources.walk.values import Code, Template
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.program import Class, Expression, Function, Variable
    from cqos_ros2_sources.walk.endpoint_calls import Given
    from cqos_ros2_sources.walk.frames import Frame, Walk


def split_types(text: str) -> tuple[str, ...]:
    """Return the template arguments of a type as written."""
    inner = text[text.find("<") + 1 : text.rfind(">")]
    found, depth, start = [], 0, 0
    for at, sign in enumerate(inner):
        depth += (sign == "<") - (sign == ">")
        if sign == "," and depth == 0:
            found.append(inner[start:at].strip())
            start = at + 1
    return (*found, inner[start:].strip())


def near(name: str, walk: Walk) -> list[Function]:
    """Return the functions that a name may mean: those of its own module or file, else all."""
    found = walk.program.find_functions(name)
    if walk.program.language == "cpp":
        return beside(found, walk.frame.function.place)
    if "." not in name:
        here = f"{walk.frame.function.name}."
        return [
            each for each in found if not each.owner and here.startswith(f"{each.name.rpartition('.')[0]}.")
        ] or found
    return found


def beside(functions: list[Function], place: Place) -> list[Function]:
    """Return those of some functions that stand in one file with something; all where none does: programs may have alike ones."""
    return [each for each in functions if each.place.source == place.source] or functions


def method_of(cls: Class | None, name: str, walk: Walk) -> list[Function]:
    """Return the methods of a class by name: its own, else those of a class that it is made from."""
    for each in lineage(cls, walk):
        found = walk.program.methods(each, name)
        if found:
            return found
    return []


def arity(functions: list[Function], given: Given) -> list[Function]:
    """Return the functions that take as many arguments."""
    count = len(given.arguments) + len(given.keywords)
    found = [each for each in functions if takes(each, count)]
    if len(found) > 1:
        found = [each for each in found if all(map(_may_take, each.parameters, given.arguments))]
    return found


def takes(function: Function, count: int) -> bool:
    """Whether a function takes as many arguments."""
    least = sum(1 for variable in function.parameters if variable.default is None and not variable.kind)
    return least <= count and (count <= len(function.parameters) or any(each.kind for each in function.parameters))


def _may_take(variable: Variable, value: Any) -> bool:
    """Whether a parameter may be given a value, as far as types tell overloads apart."""
    if isinstance(value, Code):
        return not any(word in variable.type for word in ("QoS", "string", "qos_profile", "int", "bool"))
    if isinstance(value, (str, Template)) and "QoS" in variable.type:
        return False
    return not (is_profile(value) and "string" in variable.type)


def bind(function: Function, arguments: Sequence[Any], keywords: Mapping[str, Any], frame: Frame, walk: Walk) -> None:
    """Give the parameters of a function the values of the arguments, or why they are not known."""
    for index, variable in enumerate(function.parameters):
        if not variable.name:
            continue
        if variable.kind:
            given = _rest(variable, arguments[index:], function, keywords, walk)
        elif variable.name in keywords:
            given = keywords[variable.name]
        elif index < len(arguments):
            given = arguments[index]
        elif "**" in keywords:
            given = undecided(Unknown("it may be among the rest of the arguments"), keywords["**"])
        elif variable.default is not None:
            given = _default(variable.default, walk)
        else:
            given = Unknown(f"the argument `{variable.name}` of `{function.last}`", function.place)
        shares = variable.by_reference or function.macro
        frame.names[variable.name] = given if shares else copied(given, variable.type, walk)
        frame.declared[variable.name] = variable.type


def _default(written: Expression, walk: Walk) -> Any:
    """Return the value of a default argument: in Python, a quality of service is one object for all calls."""
    if walk.program.language == "cpp":
        return evaluate(written, walk)
    return made_once(written, lambda: evaluate(written, walk), walk)


def _rest(
    variable: Variable, positional: Sequence[Any], function: Function, keywords: Mapping[str, Any], walk: Walk
) -> Any:
    """Return what a call leaves for the rest of the arguments, where all of it is known, as in Python."""
    own = {each.name for each in function.parameters}
    named = {name: value for name, value in keywords.items() if name not in own}
    open_names = variable.kind == "**" and "**" in named
    if walk.program.language != "python" or open_names or any(isinstance(each, Unknown) for each in positional):
        return undecided(Unknown("the rest of the arguments"), *positional, *named.values())
    return named if variable.kind == "**" else [*positional]


def hand_back(function: Function, frame: Frame, written: Sequence[Expression], walk: Walk) -> None:
    """Give the names of a call what the function left in the arguments that it takes by reference."""
    for variable, expression in zip(function.parameters, written, strict=False):
        if variable.by_reference and variable.name in frame.names and isinstance(expression, (Name, Attribute)):
            assign(expression, frame.names[variable.name], walk)
