"""Changes that an unreached Python function may make to a quality of service at the top of a file, over any name of it.

The search does not follow the order of statements: a name that once means the object means it everywhere in the function. So a
change may be reported that never happens, and none is missed that a name of the program leads to.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.programs.program import (
    EACH,
    ENTER,
    LEAVE,
    PAIRS,
    THIS,
    YIELD,
    Assign,
    Attribute,
    Call,
    Closure,
    Conditional,
    Element,
    Literal,
    Loop,
    Name,
    NotFollowed,
    Operation,
    Reference,
    call_name,
)
from cqos_ros2_sources.programs.statement_search import expressions_in, inside, parts
from cqos_ros2_sources.walk.frames import lineage
from cqos_ros2_sources.walk.qualities import FIELDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_ros2_sources.programs.program import Class, Expression, Function, Statement
    from cqos_ros2_sources.walk.frames import Walk

_DEEPEST: Final = 8
"""Calls from one function to the next that are searched; beyond, the object counts as changed."""
_ADDING: Final = frozenset(("add", "append", "extend", "insert", "update", "setdefault", "appendleft", "put"))
"""Methods by which a container gets what they are handed."""
_OF_CONTAINERS: Final = _ADDING | {
    *("clear", "copy", "count", "discard", "get", "index", "items", "keys", "pop", "popitem", "popleft"),
    *("remove", "reverse", "sort", "values"),
}
_INLINE: Final = frozenset((EACH, PAIRS, ENTER, LEAVE, YIELD))
_CHOOSING: Final = frozenset(("and", "or", "+", "*"))
"""Operators whose result is, or has, one of their operands."""


def mentions(function: Function, names: Iterable[str], walk: Walk) -> bool:
    """Return whether a function has one of the names, or a text with it; one that has neither changes nothing under it."""
    found, words = _parts_of(function, walk), {last_part(each) for each in names}
    return not words.isdisjoint(found.words) or any(word in text for word in words for text in found.texts)


def changes(function: Function, names: Iterable[str], walk: Walk) -> bool:
    """Return whether a function may change the object that names mean in it: ``x`` itself, ``.x`` a member of its object."""
    return _Search(walk).function(function, frozenset(names))


def holding(full: str, walk: Walk) -> set[str]:
    """Return the full names at the top of files that are an object of a name, or a container with it."""
    program = walk.program
    stated = [(name, written) for values in program.constants.values() for name, written, _ in values]
    classes = {id(cls): cls for values in program.classes.values() for cls in values}.values()
    stated += [(f"{cls.name}.{name}", written) for cls in classes for name, written in cls.initial.items()]
    found, known = {full}, -1
    while len(found) != known:
        known = len(found)
        found |= {name for name, written in stated if _Names(seen_from(name, found), walk).holds(written)}
    return found


def seen_from(name: str, found: Iterable[str]) -> set[str]:
    """Return full names with how they may be written in what has a name: without what the two have in common."""
    parts_of_name = name.split(".")
    around = [f"{'.'.join(parts_of_name[:length])}." for length in range(1, len(parts_of_name))]
    return {*found, *(each.removeprefix(one) for each in found for one in around if each.startswith(one))}


def _is_rebound(target: Expression, names: frozenset[str]) -> bool:
    """Whether a module that is named gets another object under one of the names."""
    return isinstance(target, Attribute) and not _path(target).startswith(".") and _path(target) in names


class _Names:
    """The names that mean an object, or hold it."""

    def __init__(self, names: Iterable[str], walk: Walk) -> None:
        self.names, self.walk = set(names), walk

    def holds(self, written: Expression) -> bool:
        """Whether an expression may be the object, or something that has it."""
        if isinstance(written, Name):
            return written.text in self.names
        if isinstance(written, Attribute):
            return _path(written) in self.names or (written.name not in FIELDS and self.holds(written.of))
        if isinstance(written, Call):
            table, name = self.walk.table, call_name(written)
            if {name, last_part(name)} & table.copies or table.lookup(table.makers, name) is not None:
                return False
            if last_part(name) in table.calls:
                return False  # a publisher has a copy
            return self.given(written) or self.receives(written)
        return any(map(self.holds, _kept_parts(written)))

    def given(self, call: Call) -> bool:
        """Whether a call is handed it."""
        return any(map(self.holds, (*call.arguments, *(value for _, value in call.keywords))))

    def receives(self, call: Call) -> bool:
        """Whether a method is called on it."""
        return isinstance(call.function, Attribute) and self.holds(call.function.of)

    def add(self, target: Expression) -> None:
        """Take what is assigned for another name."""
        if isinstance(target, Name):
            self.names.add(target.text)
        elif isinstance(target, Attribute) and _path(target):
            self.names.add(_path(target))
        elif isinstance(target, (Element, Attribute)):
            self.add(target.of)

    def spread(self, found: _Parts) -> None:
        """Take all names of a function that may come to mean it."""
        # What a function inside is called with is not followed.
        self.names |= {each.name for closure in found.closures for each in closure.function.parameters}
        size = -1
        while len(self.names) != size:
            size = len(self.names)
            for target, value in found.assigned:
                if self.holds(value):
                    self.add(target)
            for call in found.calls:
                if isinstance(call.function, Attribute) and call.function.name in _ADDING and self.given(call):
                    self.add(call.function.of)


class _Parts:
    """What stands in a function, with the functions inside it."""

    def __init__(self, function: Function) -> None:
        """Find it."""
        self.closures = [each for each in expressions_in(function.body) if isinstance(each, Closure)]
        bodies = (function.body, *(each.function.body for each in self.closures))
        statements = [each for body in bodies for each in inside(body)]
        self.targets = tuple(each.target for each in statements if isinstance(each, Assign))
        defaults = [each.default for closure in self.closures for each in closure.function.parameters if each.default]
        also = (*self.targets, *defaults)
        self.written = [*expressions_in(function.body, (("", also, function.place),))]
        self.calls = [each for each in self.written if isinstance(each, Call)]
        self.texts = [each.value for each in self.written if isinstance(each, Literal) and isinstance(each.value, str)]
        self.assigned = [*_assigned(statements)]
        given = expressions_in(
            (), (("", [each.default for each in function.parameters if each.default], function.place),)
        )
        self.words = {last_part(each.text) for each in (*self.written, *given) if isinstance(each, Name)}
        self.words |= {each.name for each in (*self.written, *given) if isinstance(each, Attribute)}


def _parts_of(function: Function, walk: Walk) -> _Parts:
    known = walk.program.parts
    if id(function) not in known:
        known[id(function)] = _Parts(function)
    found: _Parts = known[id(function)]
    return found


def _kept_parts(written: Expression) -> list[Expression]:
    """Return the parts of an expression that its value may be, or may have."""
    if isinstance(written, Conditional):
        return [written.then, written.otherwise]
    if isinstance(written, Element):
        return [written.of]
    if isinstance(written, Operation) and written.operator not in _CHOOSING:
        return []
    return parts(written)


def _path(written: Attribute) -> str:
    """Return the name of a member: ``.x`` of the object itself, ``y.x`` of another; empty where it is none of a name."""
    if not isinstance(written.of, Name):
        return ""
    return f".{written.name}" if written.of.text == THIS else f"{written.of.text}.{written.name}"


class _Search:
    """Searches functions from one to the next."""

    def __init__(self, walk: Walk) -> None:
        self.walk = walk
        self.known: dict[tuple[int, frozenset[str]], bool] = {}
        self.depth = 0

    def function(self, function: Function, names: frozenset[str]) -> bool:
        """Whether a function may change it; one that is being searched adds nothing."""
        key = id(function), names
        if key not in self.known:
            if self.depth >= _DEEPEST:
                return True
            self.known[key] = False
            self.depth += 1
            self.known[key] = self._searched(function, names)
            self.depth -= 1
        return self.known[key]

    def _searched(self, function: Function, names: frozenset[str]) -> bool:
        found = _parts_of(function, self.walk)
        if any(self.walk.table.is_listed("anything", call_name(each)) for each in found.calls):
            words = {last_part(each) for each in names}
            if any(word in text for word in words for text in found.texts):
                return True
        means = _Names(names, self.walk)
        means.names |= {each.name for each in function.parameters if each.default and means.holds(each.default)}
        if not any(map(means.holds, found.written)):
            return False
        means.spread(found)
        if any(_is_policy_of(each, means) or _is_rebound(each, names) for each in found.targets):
            return True
        if any(self._changed_by(each, means) for each in found.calls):
            return True
        members = frozenset(each for each in means.names - names if each.startswith("."))
        return bool(members) and any(self.function(each, members) for each in self._siblings(function))

    def _siblings(self, function: Function) -> Iterator[Function]:
        """Yield the methods of the class of a method, and of what it is made from."""
        program = self.walk.program
        for cls in lineage(program.find_class(function.owner, function.place.source), self.walk):
            yield from program.owned(cls.name)

    def _changed_by(self, call: Call, means: _Names) -> bool:
        """Whether a call may change it."""
        table, name = self.walk.table, call_name(call)
        last = last_part(name)
        if means.receives(call) and last not in _OF_CONTAINERS | table.reads | table.copies:
            # A method of the program is one of an object that has it: what made the object was searched.
            of_program = last in self.walk.program.functions and not last.startswith("__")
            if not of_program and not table.is_listed("harmless", name):
                return True
        if not means.given(call) or last in _INLINE:
            return False
        if last == "setattr" or last in table.lists["changing"]:
            return True
        made = table.lookup(table.makers, name) is not None
        if last in _ADDING or made or {name, last} & table.copies or last in table.calls:
            return False
        if table.is_listed("calling", name) or last == "partial":
            return any(self._called_changes(each) for each in call.arguments if not means.holds(each))
        return not table.is_listed("harmless", name) and self._handed_changes(name, call, means)

    def _called_changes(self, written: Expression) -> bool:
        """Whether a function that is handed on may change what it is called with; a text or number is none."""
        if isinstance(written, Closure):
            return False  # its body is searched where it stands
        if not isinstance(written, (Name, Reference)):
            return isinstance(written, (Attribute, Call))
        name = written.text if isinstance(written, Name) else written.name
        if self.walk.table.is_listed("harmless", name):
            return False
        functions = self.walk.program.functions.get(last_part(name), [])
        return not functions or any(
            self._with(each, frozenset(one.name for one in each.parameters)) for each in functions
        )

    def _handed_changes(self, name: str, call: Call, means: _Names) -> bool:
        """Whether what a call means may change what it is handed: a function, or a class that keeps it."""
        from cqos_ros2_sources.walk.call_effects import unread_bases

        program = self.walk.program
        cls = program.find_class(name, call.place.source)
        if cls is not None and unread_bases(cls, self.walk):
            return True
        if cls is not None:
            found = [program.methods(each, "__init__") for each in lineage(cls, self.walk)]
            return any(self._made_with(each, cls, _taken(each, call, means)) for each in next(filter(None, found), []))
        functions = program.functions.get(last_part(name), [])
        return not functions or any(self._with(each, _taken(each, call, means)) for each in functions)

    def _made_with(self, start: Function, cls: Class, names: frozenset[str]) -> bool:
        """Whether the constructor of a class, or a method with what that keeps, may change it."""
        kept = _Names(names, self.walk)
        kept.spread(_parts_of(start, self.walk))
        members = frozenset(each for each in kept.names if each.startswith("."))
        methods = [one for each in lineage(cls, self.walk) for one in self.walk.program.owned(each.name)]
        return self._with(start, names) or any(self.function(each, members) for each in methods)

    def _with(self, function: Function, names: frozenset[str]) -> bool:
        """Whether a function may change what some of its parameters mean; what wraps it may do anything."""
        wrapped = any(not self.walk.table.is_listed("decorators", each) for each in function.decorators)
        return wrapped or self.function(function, names)


def _taken(function: Function, call: Call, means: _Names) -> frozenset[str]:
    """Return the parameters of a function that are handed it; all of them where arguments are not written one by one."""
    several = any(isinstance(each, NotFollowed) for each in call.arguments) or "**" in dict(call.keywords)
    if several or any(each.kind for each in function.parameters):
        return frozenset(each.name for each in function.parameters)
    pairs = zip((each.name for each in function.parameters), call.arguments, strict=False)
    return frozenset(name for name, value in (*pairs, *call.keywords) if means.holds(value))


def _assigned(statements: Iterable[Statement]) -> Iterator[tuple[Expression, Expression]]:
    """Yield what is assigned, with its value: in assignments and loops."""
    for each in statements:
        if isinstance(each, Assign):
            yield each.target, each.value
        elif isinstance(each, Loop) and each.over is not None:
            for name in each.targets:
                yield Name(name), each.over


def _is_policy_of(target: Expression, means: _Names) -> bool:
    """Whether an assignment sets a policy of it."""
    if isinstance(target, Attribute):
        return (target.name in FIELDS or target.name.startswith("_")) and means.holds(target.of)
    if isinstance(target, Element) and isinstance(target.of, Attribute):
        return target.of.name.startswith("__") and means.holds(target.of.of)
    return False
