"""Objects that a container, an optional or a variant of C++ makes in place, from the arguments of a method."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import last_part, points, without_arguments
from cqos_ros2_sources.programs.program import Call, Name
from cqos_ros2_sources.walk.cpp_copies import type_of_name
from cqos_ros2_sources.walk.endpoint_calls import Given
from cqos_ros2_sources.walk.expressions import evaluate, replace_value
from cqos_ros2_sources.walk.frames import lineage
from cqos_ros2_sources.walk.functions import arity, split_types, takes
from cqos_ros2_sources.walk.objects import construct
from cqos_ros2_sources.walk.values import Instance, used

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_ros2_sources.programs.program import Attribute, Class
    from cqos_ros2_sources.walk.frames import Walk

_IN_PLACE: Final = frozenset(("emplace_back", "emplace_front", "emplace", "emplace_hint", "try_emplace"))
_FROM_BRACES: Final = frozenset(("push_back", "push_front", "push", "insert", "insert_or_assign", "assign"))
"""Methods that make an element of what stands in braces."""
_MAPS: Final = frozenset(("map", "unordered_map", "multimap", "unordered_multimap", "flat_map"))
_LISTS: Final = frozenset(
    ("vector", "deque", "list", "forward_list", "set", "unordered_set", "stack", "queue", "static_vector")
)
_POSITIONED: Final = frozenset(("vector", "deque", "list", "static_vector"))
"""Those whose `emplace` is given a position first."""
_OPTIONAL: Final = "optional"
_PIECEWISE: Final = "piecewise_construct"


def with_element(function: Attribute, given: Given, walk: Walk) -> Given:
    """Return what a method of a container is given, with the element that it makes in place of the arguments for it.

    An element that it may make and that is not followed is noted in the walk.
    """
    if walk.program.language != "cpp" or function.name not in _IN_PLACE | _FROM_BRACES:
        return given
    stated = _stated(function, walk)
    kind, types = last_part(without_arguments(stated)), split_types(stated) if "<" in stated else ()
    if not types:
        if function.name in _IN_PLACE and any(_is_node(each) for each in given.arguments):
            _may_be_any(given.arguments, walk)
        return given
    before = kind in _MAPS or (function.name == "emplace" and kind in _POSITIONED)
    keys, written = (given.arguments[:1], given.call.arguments[1:]) if before else ([], given.call.arguments)
    element = types[-1] if kind in _MAPS and len(types) == 2 else types[0]  # noqa: PLR2004 - key and value
    cls = None if points(element) else walk.program.find_class(element, walk.frame.function.place.source)
    values = given.arguments[len(keys) :]
    if any(isinstance(each, Name) and last_part(each.text) == _PIECEWISE for each in given.call.arguments):
        pair = given.call.arguments[-1]
        written = pair.arguments if isinstance(pair, Call) else ()
        values = [evaluate(each, walk) for each in written]
    if cls is None or not values or any(_is_one(each, cls, walk) for each in values):
        return given
    known = function.name in _IN_PLACE and kind in (_MAPS | _LISTS | {_OPTIONAL}) and function.name != "emplace_hint"
    call = Call(Name(element), tuple(written), (), (), given.call.place)
    inner = Given(call, values, given.keywords, split_types(element) if "<" in element else ())
    if not known or not (arity(_constructors(cls, walk), inner) or not _constructors(cls, walk)):
        walk.cut += [each for one in lineage(cls, walk) for each in _constructors(one, walk)]
        return given
    made = construct(cls, inner, walk)
    if kind == _OPTIONAL:
        replace_value(function.of, None, made, walk)
    return Given(given.call, [*keys, made], {}, given.types)


def _stated(function: Attribute, walk: Walk) -> str:
    """Return the type that a container is declared with; of an alias, what it stands for."""
    text = type_of_name(function.of, walk).removesuffix("&").strip()
    return text if "<" in text else walk.program.aliases.get(last_part(text), text)


def _constructors(cls: Class, walk: Walk) -> list[Any]:
    return walk.program.methods(cls, last_part(cls.name))


def _is_one(value: Any, cls: Class, walk: Walk) -> bool:
    """Whether a value is an object of a class already, which is copied or moved."""
    found = used(value)
    return isinstance(found, Instance) and any(each is cls for each in lineage(found.cls, walk))


def _is_node(value: Any) -> bool:
    found = used(value)
    return isinstance(found, Instance) and found.node is not None


def note_braces(items: Sequence[Any], walk: Walk) -> None:
    """Note the constructors that what stands in braces with a node may be for."""
    if any(_is_node(each) for each in items):
        _may_be_any(items, walk)


def _may_be_any(values: Sequence[Any], walk: Walk) -> None:
    """Note the constructors that take values of which one is a node, where the class that is made is not known."""
    for classes in walk.program.classes.values():
        for cls in classes:
            found = [each for each in _constructors(cls, walk) if takes(each, len(values))]
            walk.cut += [each for each in found if each.body or each.initializers]
