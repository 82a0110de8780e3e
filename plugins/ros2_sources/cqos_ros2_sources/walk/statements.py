"""Walks statements of functions: branches are joined, loops are followed over known lists, unknown values stay unknown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Final

from cqos_ros2_sources.programs.program import (
    STATIC,
    Assign,
    Attribute,
    Call,
    Do,
    Element,
    Expression,
    Function,
    If,
    Leave,
    Literal,
    Loop,
    Name,
    Operation,
    Return,
    Statement,
    Try,
)
from cqos_ros2_sources.programs.statement_search import inside
from cqos_ros2_sources.walk.cpp_copies import copied, type_of_name
from cqos_ros2_sources.walk.expressions import assign, evaluate, made_once, whole
from cqos_ros2_sources.walk.frames import MOST_ELEMENTS, MOST_ROUNDS, Condition, Walk, Way
from cqos_ros2_sources.walk.operators import truth
from cqos_ros2_sources.walk.profiles import undecided
from cqos_ros2_sources.walk.values import Condition as Decided
from cqos_ros2_sources.walk.values import Counted, Profile, Template, Test, Word, flipped
from cqos_ros2_workspace.launch.values import Unknown

_CHANGES: Final = "it changes in a loop"
_ABSENT: Final = (Literal(None), Literal(False))


def run(statements: Iterable[Statement], walk: Walk) -> bool:
    """Walk statements; return whether the walk comes behind them."""
    depth = len(walk.conditions)
    try:
        for each in statements:
            walk.step()
            if not _one(each, walk):
                return False
        return True
    finally:
        del walk.conditions[depth:]


def run_body(function: Function, walk: Walk) -> bool:
    """Walk the body of a function; return whether the walk comes to its end. Behind it, values are as each way out of it left them."""
    frame = walk.frame
    finished = run(function.body, walk)
    if not finished and frame.ways:
        values = frame.ways.pop().values
        if values is not None:
            walk.restore(values)
    for tests, values, place in reversed(frame.ways):
        if values is not None:
            walk.merge(values, tests, f"`{function.last}` may return before, in line {place.line}", place)
    return finished


def _one(statement: Statement, walk: Walk) -> bool:
    if isinstance(statement, Assign):
        _assign(statement, walk)
    elif isinstance(statement, Do):
        evaluate(statement.expression, walk)
    elif isinstance(statement, If):
        return _if(statement, walk)
    elif isinstance(statement, Loop):
        return _loop(statement, walk)
    elif isinstance(statement, Return):
        _return(statement, walk)
        return False
    elif isinstance(statement, Try):
        return _try(statement, walk)
    elif isinstance(statement, Leave):
        if statement.kind != "throw":
            walk.frame.left.append(walk.snapshot())
        elif walk.thrown is not None:
            walk.thrown.append((len(walk.frames), walk.snapshot()))
        return False
    return True


def _return(statement: Return, walk: Walk) -> None:
    frame, tests = walk.frame, walk.tests_here()
    value = None if statement.value is None else whole(statement.value, walk)
    frame.returned.append((tests, value))
    sometimes = len(walk.conditions) > frame.conditions
    frame.ways.append(Way(tests, walk.snapshot() if sometimes else None, statement.place))


def _try(statement: Try, walk: Walk) -> bool:
    """Walk statements and what handles their exceptions; return whether the walk comes behind both."""
    place, depth = statement.place, len(walk.frames)
    outer, walk.thrown = walk.thrown, []
    before = walk.snapshot()
    reached = run(statement.body, walk)
    thrown, walk.thrown = walk.thrown, outer
    if not statement.handlers:
        if outer is not None:
            outer += thrown
        return reached
    ways = [walk.snapshot()] if reached else []
    cause = f"an exception may come before, in line {place.line}"
    for each in (before, *(values[:depth] + values[count:] for count, values in thrown)):
        walk.merge(each, None, cause, place)
    begin = walk.snapshot()
    condition = Condition(perhaps=f"it depends on an exception in line {place.line}", branch=1)
    for handler in statement.handlers:
        walk.restore(begin)
        if _branch(handler, condition, walk):
            ways.append(walk.snapshot())
    if not ways:
        return False
    walk.restore(ways.pop())
    for each in ways:
        walk.merge(each, None, cause, place)
    if not reached:
        walk.conditions.append(condition)
    return True


def _value(statement: Assign, walk: Walk) -> Any:
    """Return what an assignment gives; a quality of service at the top of a file of Python, or in a static name of C++, is made once."""
    written, type_text = statement.value, statement.type
    if walk.frame.function.last == "__main__" and isinstance(statement.target, Name):
        return made_once(written, lambda: whole(written, walk), walk)
    if type_text.startswith(STATIC):
        return made_once(written, lambda: copied(whole(written, walk), type_text, walk, written=written), walk)
    return whole(written, walk)


def _assign(statement: Assign, walk: Walk) -> None:
    value = _value(statement, walk)
    target = statement.target
    if isinstance(value, Word) and statement.type:
        made = Call(Name(statement.type), (), (), (), statement.place)
        value = evaluate(made, walk) if walk.table.lookup(walk.table.objects, statement.type) is not None else value
    if statement.declares and isinstance(target, Name):
        static = isinstance(value, Profile) and statement.type.startswith(STATIC)
        held = value if static else copied(value, statement.type, walk, written=statement.value)
        walk.frame.names[target.text] = held
        walk.frame.declared[target.text] = statement.type
        walk.frame.aliases.pop(target.text, None)
        changes = statement.type.endswith(("&", "*")) and not statement.type.startswith("const ")
        if changes and isinstance(statement.value, (Name, Attribute, Element)):
            walk.frame.aliases[target.text] = statement.value, statement.type.endswith("*")
        return
    assign(target, copied(value, type_of_name(target, walk), walk, written=statement.value), walk)


def _if(statement: If, walk: Walk) -> bool:
    decided = truth(whole(statement.condition, walk))
    if _makes_what_it_asks_for(statement):
        decided = True
    count = len(walk.frame.ways)
    if decided is True or decided is False:
        reached = run(statement.then if decided else statement.otherwise, walk)
        _behind(walk.frame.ways[count:], walk)
        return reached
    tests = decided.tests if isinstance(decided, Decided) else None
    cause = _cause(decided, statement)
    negated = flipped(tests) if tests is not None else None
    before, counted = walk.snapshot(), len(walk.made_at)
    reached = _branch(statement.then, Condition(tests or (), "" if tests is not None else cause, 1), walk)
    ways = walk.frame.ways[count:] if reached else []
    after, made_then = walk.snapshot(), len(walk.made_at) > counted
    walk.restore(before)
    count = len(walk.frame.ways)
    other = Condition(negated or (), "" if negated is not None else cause, -1)
    behind = _branch(statement.otherwise, other, walk)
    ways += walk.frame.ways[count:] if behind else []
    if reached and behind:
        walk.merge(after, tests, cause, statement.place)
    elif reached:
        walk.restore(after)
        if tests is not None and statement.otherwise:
            walk.conditions.append(Condition(tests))
    elif behind and (tests is not None or made_then):
        walk.conditions.append(other)
    _behind(ways, walk)
    return reached or behind


def _behind(ways: list[Way], walk: Walk) -> None:
    """Note that the walk only comes here where parameters do not choose one of some ways out of the function."""
    here = {*walk.tests()}
    for each in ways:
        tests = tuple(test for test in each.tests or () if test not in here)
        if len({test.subject for test in tests}) == 1 and all(test.negated for test in tests):  # none of some values
            tests = (Test(tests[0].subject, tuple(value for test in tests for value in test.values), negated=True),)
        other = flipped(tests)
        if other is not None:
            walk.conditions.append(Condition(other))
        elif tests:
            walk.conditions.append(Condition(perhaps=f"it depends on a return in line {each.place.line}"))


def _branch(statements: tuple[Statement, ...], condition: Condition, walk: Walk) -> bool:
    walk.conditions.append(condition)
    depth = len(walk.conditions)
    try:
        return run(statements, walk)
    finally:
        del walk.conditions[depth - 1 :]


def _cause(decided: Any, statement: If) -> str:
    line = statement.place.line
    cause = decided.cause if isinstance(decided, Unknown) else ""
    return f"it depends on a condition in line {line}{f': {cause}' if cause else ''}"[:200]


def _makes_what_it_asks_for(statement: If) -> bool:
    """Whether a decision only asks whether something was made before, and makes it."""
    asked = statement.condition
    if (isinstance(asked, Operation) and asked.operator == "not") or (
        isinstance(asked, Operation) and asked.operator == "==" and asked.operands[1] in _ABSENT
    ):
        asked = asked.operands[0]
    else:
        return False
    return isinstance(asked, (Name, Attribute)) and any(
        isinstance(each, Assign) and each.target == asked for each in statement.then
    )


def _loop(statement: Loop, walk: Walk) -> bool:
    """Walk a loop; return whether the walk comes behind it."""
    over = None if statement.over is None else evaluate(statement.over, walk)
    names = walk.frame.names
    if isinstance(over, dict):
        over = [*over] if walk.program.language == "python" else [list(each) for each in over.items()]
    if isinstance(over, list) and len(over) <= MOST_ELEMENTS and _is_short(statement, len(over)):
        for each in over:
            _bind(statement.targets, copied(each, "auto", walk) if statement.copies else each, walk)
            if not _round(statement, Condition(), walk):
                return False
        return True
    for target in _assigned(statement.body):
        assign(target, Unknown(_CHANGES, statement.place), walk)
    condition = Condition(perhaps=f"it is made in a loop in line {statement.place.line}")
    listed = over.of if isinstance(over, Counted) else over
    if isinstance(listed, Template) and listed.parameter and len(statement.targets) == 1:
        name = f"each_{statement.targets[0]}"
        names[statement.targets[0]] = Counted(listed, name) if listed is not over else Template(f"${{{name}}}")
        condition = Condition(each=(name, listed.text))
    else:
        for name in statement.targets:
            names[name] = undecided(Unknown("it is an element of a list that is not known", statement.place), over)
    before = walk.snapshot()
    _round(statement, condition, walk)
    walk.merge(before, None, _CHANGES, statement.place)
    return True


def _round(statement: Loop, condition: Condition, walk: Walk) -> bool:
    """Walk one round of a loop: behind it, values are as each way out of it left them. Return whether the walk comes behind it."""
    frame = walk.frame
    outer, frame.left = frame.left, []
    count = len(frame.ways)
    reached = _branch(statement.body, condition, walk)
    ways, frame.left = frame.left, outer
    left = bool(ways)
    if ways and not reached:
        walk.restore(ways.pop())
    for each in ways:
        walk.merge(each, None, _CHANGES, statement.place)
    _behind(frame.ways[count:], walk)
    return reached or left


def _is_short(statement: Loop, rounds: int) -> bool:
    """Whether each round of a loop can be followed."""
    body = [*inside(statement.body)]
    return Leave("break") not in body and rounds * len(body) <= MOST_ROUNDS


def _bind(targets: tuple[str, ...], value: Any, walk: Walk) -> None:
    if len(targets) == 1:
        walk.frame.names[targets[0]] = value
        return
    items = (
        value
        if isinstance(value, list) and len(value) == len(targets)
        else [undecided(Unknown("it is unpacked"), value)] * len(targets)
    )
    walk.frame.names.update(zip(targets, items, strict=True))


def _assigned(statements: Iterable[Statement]) -> Iterator[Expression]:
    for each in inside(statements):
        if isinstance(each, Assign) and not each.declares and not _creates(each.value):
            yield each.target


def _creates(value: Expression) -> bool:
    """Whether a value is an object that is made: such a member is no value that changes."""
    return isinstance(value, Call)
