"""What a walk may come to and did not follow: calls on objects that it lost, of methods that lead to creating calls.

Another program of the package may have followed the same methods, which says nothing about this one.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_ros2_sources.programs.names import fits, last_part
from cqos_ros2_sources.programs.program import THIS, Assign, Attribute, Name, call_name
from cqos_ros2_sources.programs.statement_search import calls_in, expressions_in, inside
from cqos_ros2_sources.unread.unreached_code import NOT_FOLLOWED, creating_calls, is_of, what_creates
from cqos_ros2_sources.walk.frames import lineage
from cqos_ros2_sources.walk.functions import takes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.program import Call, Function
    from cqos_ros2_sources.walk.frames import Walk
    from cqos_ros2_sources.walk.package_walk import Exploration
    from cqos_ros2_sources.walk.values import NodeRecord

_MOST_FUNCTIONS: Final = 300
_OPEN: Final = frozenset(("", "auto"))


def note_unfollowed(found: Exploration, walk: Walk, nodes: list[NodeRecord]) -> None:
    """Name in the nodes of a walk the creating calls to which calls may lead that it did not follow."""
    for function, place in _unfollowed(found, walk) if nodes else ():
        found.noted.add(id(function))
        own = [each for each in nodes if is_of(found, each.cls, function.owner)]
        for node in own or nodes:
            node.gaps.setdefault((what_creates(function), NOT_FOLLOWED), place)


def _unfollowed(found: Exploration, walk: Walk) -> Iterator[tuple[Function, Place]]:
    calls = [
        (call, within) for call, within in walk.lost.values() if last_part(call_name(call)) in found.program.functions
    ]
    if not calls and not walk.cut:
        return
    known = _words(found, walk)
    waiting = [*walk.cut, *(each for call, within in calls for each in _meant(call, within, known, found, walk))]
    # What was walked for another object may be called on this one too.
    again = {id(each) for each in waiting} & walk.executed
    seen = {id(each) for each in waiting}
    while waiting and len(seen) < _MOST_FUNCTIONS:
        function = waiting.pop()
        for place in creating_calls(function, found):
            if id(function) in again or (place.source, place.line or 0) not in walk.made_at:
                yield function, place
        known = known | _of_class(function.owner, found, walk)
        for call in calls_in(function.body, function.initializers):
            for each in _meant(call, function, known, found, walk):
                if id(each) not in seen and (id(function) in again or id(each) not in walk.executed):
                    seen.add(id(each))
                    again.update({id(each)} if id(function) in again else ())
                    waiting.append(each)


def _meant(call: Call, within: Function, known: frozenset[str], found: Exploration, walk: Walk) -> Iterator[Function]:
    """Yield the functions of the program that a call in a function may mean.

    Args:
        call: the call.
        within: where it stands.
        known: words that stand in the program: a class that it does not name, nor one that it is made from, has no object there.
        found: what the package defines.
        walk: that did not follow the call.
    """
    name = last_part(call_name(call))
    on = call.function.of if isinstance(call.function, Attribute) else None
    stated = _type_of(on, within, found, walk)
    words = known if stated in _OPEN else frozenset(re.findall(r"\w+", stated))
    own = {each.name for each in lineage(found.program.find_class(within.owner, within.place.source), walk)}
    for each in found.program.functions.get(name, ()):
        if not takes(each, len(call.arguments) + len(call.keywords)):
            continue
        if on is None:
            if (each.owner in own or not each.owner) and fits(each.name, call_name(call)):
                yield each
        elif (
            each.owner
            and each.owner not in found.loaded - own
            and any(
                last_part(cls.name) in words
                for cls in lineage(found.program.find_class(each.owner, each.place.source), walk)
            )
        ):
            yield each


def _type_of(on: object, within: Function, found: Exploration, walk: Walk) -> str:
    """Return the type of what a method is called on, as far as its name tells; empty where that is not known."""
    if isinstance(on, Name):
        name = on.text
        locals_of = (each for each in inside(within.body) if isinstance(each, Assign) and each.declares)
        declared = [each.type for each in locals_of if each.target == on]
        declared += [each.type for each in within.parameters if each.name == name]
        if declared:
            return declared[0].removesuffix("&") if len({*declared}) == 1 else ""
    elif isinstance(on, Attribute) and on.of == Name(THIS):
        name = on.name
    else:
        return ""
    classes = lineage(found.program.find_class(within.owner, within.place.source), walk)
    return next((each.fields[name] for each in classes if name in each.fields), "")


def _words(found: Exploration, walk: Walk) -> frozenset[str]:
    """Return the words that stand in what a walk came to, and in the members of its classes."""
    walked = [each for each in found.functions if id(each) in walk.executed]
    words = {word for each in walked for word in _of_function(each)}
    return frozenset(words).union(*(_of_class(owner, found, walk) for owner in {each.owner for each in walked}))


def _of_function(function: Function) -> Iterable[str]:
    if function.source:
        return re.findall(r"\w+", function.source.decode(errors="replace"))
    expressions = [*expressions_in(function.body)]
    return [last_part(each.text) for each in expressions if isinstance(each, Name)] + [
        each.name for each in expressions if isinstance(each, Attribute)
    ]


def _of_class(owner: str, found: Exploration, walk: Walk) -> frozenset[str]:
    classes = lineage(found.program.find_class(owner), walk) if owner else ()
    return frozenset(word for each in classes for text in each.fields.values() for word in re.findall(r"\w+", text))
