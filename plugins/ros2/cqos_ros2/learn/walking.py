"""Walks statements of functions: branches are joined, loops are followed over known lists, and what is not known stays so."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Final

from cqos_ros2.launch.values import Unknown
from cqos_ros2.learn.evaluating import assign, evaluate
from cqos_ros2.learn.frames import MOST_ELEMENTS, MOST_ROUNDS, Condition, Walk
from cqos_ros2.learn.operators import truth
from cqos_ros2.learn.program import (
    Assign,
    Attribute,
    Call,
    Do,
    Expression,
    If,
    Leave,
    Literal,
    Loop,
    Name,
    Operation,
    Return,
    Statement,
)
from cqos_ros2.learn.searching import inside
from cqos_ros2.learn.values import Condition as Decided
from cqos_ros2.learn.values import Counted, Template, Word, flipped

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


def _one(statement: Statement, walk: Walk) -> bool:
    if isinstance(statement, Assign):
        _assign(statement, walk)
    elif isinstance(statement, Do):
        evaluate(statement.expression, walk)
    elif isinstance(statement, If):
        return _if(statement, walk)
    elif isinstance(statement, Loop):
        _loop(statement, walk)
    elif isinstance(statement, Return):
        value = None if statement.value is None else evaluate(statement.value, walk)
        walk.frame.returned.append((walk.tests_here(), value))
        return False
    elif isinstance(statement, Leave):
        if statement.kind != "throw":
            walk.frame.left.append(walk.snapshot())
        return False
    return True


def _assign(statement: Assign, walk: Walk) -> None:
    value = evaluate(statement.value, walk)
    target = statement.target
    if isinstance(value, Word) and statement.type:
        made = Call(Name(statement.type), (), (), (), statement.place)
        value = evaluate(made, walk) if walk.table.lookup(walk.table.objects, statement.type) is not None else value
    if statement.declares and isinstance(target, Name):
        walk.frame.names[target.text] = value
        return
    assign(target, value, walk)


def _if(statement: If, walk: Walk) -> bool:
    decided = truth(evaluate(statement.condition, walk))
    if _makes_what_it_asks_for(statement):
        decided = True
    if decided is True or decided is False:
        return run(statement.then if decided else statement.otherwise, walk)
    tests = decided.tests if isinstance(decided, Decided) else None
    cause = _cause(decided, statement)
    negated = flipped(tests) if tests is not None else None
    before, counted = walk.snapshot(), len(walk.made_at)
    reached = _branch(statement.then, Condition(tests or (), "" if tests is not None else cause, 1), walk)
    after, made_then = walk.snapshot(), len(walk.made_at) > counted
    walk.restore(before)
    other = Condition(negated or (), "" if negated is not None else cause, -1)
    behind = _branch(statement.otherwise, other, walk)
    if reached and behind:
        walk.merge(after, tests, cause, statement.place)
        return True
    if reached:
        walk.restore(after)
        if tests is not None and statement.otherwise:
            walk.conditions.append(Condition(tests))
        return True
    if behind and (tests is not None or made_then):
        walk.conditions.append(other)
    return behind


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


def _loop(statement: Loop, walk: Walk) -> None:
    over = None if statement.over is None else evaluate(statement.over, walk)
    names = walk.frame.names
    if isinstance(over, dict):
        over = [*over] if walk.program.language == "python" else [list(each) for each in over.items()]
    if isinstance(over, list) and len(over) <= MOST_ELEMENTS and _is_short(statement, len(over)):
        for each in over:
            _bind(statement.targets, each, walk)
            _round(statement, Condition(), walk)
        return
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
            names[name] = Unknown("it is an element of a list that is not known", statement.place)
    before = walk.snapshot()
    _round(statement, condition, walk)
    walk.merge(before, None, _CHANGES, statement.place)


def _round(statement: Loop, condition: Condition, walk: Walk) -> None:
    """Walk one round of a loop: behind it, values are as each way out of it left them."""
    frame = walk.frame
    outer, frame.left = frame.left, []
    reached = _branch(statement.body, condition, walk)
    ways, frame.left = frame.left, outer
    if ways and not reached:
        walk.restore(ways.pop())
    for each in ways:
        walk.merge(each, None, _CHANGES, statement.place)


def _is_short(statement: Loop, rounds: int) -> bool:
    """Whether each round of a loop can be followed."""
    body = [*inside(statement.body)]
    return Leave("break") not in body and rounds * len(body) <= MOST_ROUNDS


def _bind(targets: tuple[str, ...], value: Any, walk: Walk) -> None:
    if len(targets) == 1:
        walk.frame.names[targets[0]] = value
        return
    items = (
        value if isinstance(value, list) and len(value) == len(targets) else [Unknown("it is unpacked")] * len(targets)
    )
    walk.frame.names.update(zip(targets, items, strict=True))


def _assigned(statements: Iterable[Statement]) -> Iterator[Expression]:
    for each in inside(statements):
        if isinstance(each, Assign) and not each.declares and not _creates(each.value):
            yield each.target


def _creates(value: Expression) -> bool:
    """Whether a value is an object that is made: such a member is no value that changes."""
    return isinstance(value, Call)
