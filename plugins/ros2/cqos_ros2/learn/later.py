"""Walks what is called later: callbacks come often and in any order, so that a value which one of them changes is known in none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.system import Place
from cqos_ros2.launch.values import Unknown
from cqos_ros2.learn.calling import invoke
from cqos_ros2.learn.evaluating import evaluate, initial_value, shared_preset
from cqos_ros2.learn.frames import MOST_ELEMENTS, Condition, Frame, TooMuchError, lineage
from cqos_ros2.learn.profiles import content, is_profile
from cqos_ros2.learn.program import Function, Name, call_name
from cqos_ros2.learn.searching import calls_in
from cqos_ros2.learn.values import MISSING, PLAIN, Code, Either, Instance, NodeRecord, Undecided, same, used

if TYPE_CHECKING:
    from cqos_ros2.learn.frames import Walk
    from cqos_ros2.learn.program import Expression

_MOST_CALLBACKS: Final = 300
_MOST_ROUNDS: Final = 20


def run_later(walk: Walk) -> None:
    """Walk all callbacks until no further value changes: what they make may never be made.

    Raises:
        TooMuchError: it takes too many rounds.
    """
    walk.in_callback = True
    _prepare(walk)
    start = _Start(walk)
    for _ in range(_MOST_ROUNDS):
        if not _changing(walk, start):
            return
        start.restore(walk)
    raise TooMuchError


def _prepare(walk: Walk) -> None:
    """Make the qualities of service that any callback may be the first to use: what one sets, the others see."""
    table, program = walk.table, walk.program
    if program.language == "python":
        for name in table.presets:
            shared_preset(name, walk)
    for instance in [*walk.instances]:
        for cls in lineage(instance.cls, walk):
            for name, written in cls.initial.items():
                if name not in instance.members and _makes_quality(written, walk):
                    instance.members[name] = initial_value(instance, name, walk)
    for found in program.constants.values():
        for full, written, path in found:
            if _makes_quality(written, walk):
                walk.frames.append(Frame(Function(full, (), (), Place(path)), None))
                evaluate(Name(full), walk)
                walk.frames.pop()


def _makes_quality(written: Expression, walk: Walk) -> bool:
    """Whether an expression makes a quality of service."""
    table = walk.table
    calls = calls_in((), ((written, (written,), None),))
    return any(table.lookup(table.makers, call_name(each)) is not None for each in calls)


class _Start:
    """What a walk has found before the first callback, and which of its values change from then on."""

    def __init__(self, walk: Walk) -> None:
        """Keep it."""
        self.callbacks, self.steps, self.homeless = [*walk.callbacks], walk.steps, len(walk.homeless)
        self.instances, self.nodes = len(walk.instances), len(walk.nodes)
        self.current, self.strays = walk.current, {*walk.strays}
        self.spaces = {key: (each, dict(each)) for key, each in _spaces(walk).items()}
        self.made = [(each, len(each.made)) for each in _records(walk)]
        self.changing: dict[tuple[Any, str], Unknown] = {}

    def restore(self, walk: Walk) -> None:
        """Set a walk back to it, apart from what changes."""
        for record, count in self.made:
            del record.made[count:]
        del walk.instances[self.instances :], walk.nodes[self.nodes :], walk.homeless[self.homeless :]
        walk.callbacks, walk.steps, walk.current = [*self.callbacks], self.steps, self.current
        walk.strays = {name: each for name, each in walk.strays.items() if name in self.strays}
        for key, (space, names) in self.spaces.items():
            space.clear()
            space.update(names, **{name: unknown for (of, name), unknown in self.changing.items() if of == key})

    def key_of(self, key: int, owner: Instance | None) -> Any:
        """Return what names of a space are known by: objects that callbacks make are known by their class."""
        return key if key in self.spaces else owner.cls.name if owner is not None and owner.cls is not None else None


def _spaces(walk: Walk) -> dict[int, dict[str, Any]]:
    """Return all names that outlive a call, by their identity: members, names around lambdas, names of modules."""
    found = [each.members for each in walk.instances]
    found += [each.names for each in walk.callbacks]
    return {id(each): each for each in (*found, *walk.modules.values())}


def _records(walk: Walk) -> list[NodeRecord]:
    carried = [each.members.get("#node") for each in walk.instances]
    found = [*walk.nodes, *walk.strays.values(), walk.current, *(each.node for each in walk.instances), *carried]
    return [*{id(each): each for each in found if isinstance(each, NodeRecord)}.values()]


def _changing(walk: Walk, start: _Start) -> bool:
    """Walk each callback once; return whether one changed a value that was taken as known, or set one for which an earlier one waited."""
    known, done = len(start.changing), 0
    walk.awaited.clear()
    seen: dict[tuple[int, int], list[dict[str, Any]]] = {}
    while done < min(len(walk.callbacks), _MOST_CALLBACKS):
        each = walk.callbacks[done]
        done += 1
        known_names = seen.setdefault((id(each.function), id(each.this)), [])
        names = {**each.names, **each.own}
        if len(known_names) < MOST_ELEMENTS and not any(_alike(names, one) for one in known_names):
            known_names.append(names)
            _one(each, walk, start)
    return len(start.changing) > known or not walk.awaited.isdisjoint(walk.executed)


def _alike(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return one.keys() == other.keys() and all(
        same(content(value), content(other[name])) for name, value in one.items() if isinstance(value, PLAIN)
    )


def _one(code: Code, walk: Walk, start: _Start) -> None:
    nodes, this = walk.nodes, code.this
    own = this.node if this is not None else None
    walk.current = own if own is not None else nodes[0] if len(nodes) == 1 else None
    before = {key: dict(each) for key, each in _spaces(walk).items()}
    line = code.function.place.line
    walk.conditions.append(Condition(perhaps=f"it is made in a callback in line {line}"))
    given = [Unknown("what a callback is given") for _ in code.function.parameters]
    try:
        invoke(code.function, this, given, {}, walk, value=code)
    finally:
        walk.conditions.pop()
    owners = {id(each.members): each for each in walk.instances}
    for key, space in _spaces(walk).items():
        _settle(space, before.get(key), owners.get(key), start.key_of(key, owners.get(key)), walk, start)
    held = _held(walk, start.instances)
    walk.instances[start.instances :] = [each for each in walk.instances[start.instances :] if id(each) in held]


def _held(walk: Walk, count: int) -> set[int]:
    """Return the identities of the objects that something can still reach: nothing changes the others, so no branch need keep them."""
    waiting: list[Any] = [*walk.instances[:count], *walk.callbacks, *walk.constants.values()]
    waiting += [value for names in walk.modules.values() for value in names.values()]
    seen: set[int] = set()
    while waiting:
        each = used(waiting.pop())
        if not isinstance(each, (Instance, Code, list, dict, Either, Undecided)) or id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, Instance):
            waiting += each.members.values()
        elif isinstance(each, Code):
            waiting += [each.this, *each.names.values(), *each.own.values()]
        elif isinstance(each, Either):
            waiting += [value for _, value in each.cases]
        elif isinstance(each, Undecided):
            waiting += each.among
        else:
            waiting += each.values() if isinstance(each, dict) else each
    return seen


def _settle(
    space: dict[str, Any], before: dict[str, Any] | None, owner: Instance | None, key: Any, walk: Walk, start: _Start
) -> None:
    """Take back what a callback changed: it is not known from then on."""
    for name, value in [*space.items()]:
        if (key, name) in start.changing:
            space[name] = start.changing[key, name]
            continue
        old = MISSING if before is None else before.get(name, MISSING)
        if old is MISSING and before is None and owner is not None and owner.begins is not None:
            old = owner.begins.get(name, MISSING)
        if old is MISSING and before is not None and owner is not None:
            old = initial_value(owner, name, walk)
        if old is MISSING or old is None or same(old, value) or _is_as_before(old, value):
            continue
        if isinstance(old, Unknown):
            space[name] = old
            continue
        space[name] = unknown = Unknown(f"`{name[:60]}` changes while it runs")
        if key is not None:
            start.changing[key, name] = unknown


def _is_as_before(old: Any, value: Any) -> bool:
    """Whether an object is still there, or one is there that was made alike."""
    old, value = used(old), used(value)
    if is_profile(old) and is_profile(value):
        return same(content(old), content(value))
    if isinstance(old, (*PLAIN, Unknown)):
        return False
    if not isinstance(old, Instance) or not isinstance(value, Instance):
        return not isinstance(value, Instance)
    plain = [{name: each for name, each in one.members.items() if isinstance(each, PLAIN)} for one in (old, value)]
    return old.cls is value.cls and old.library == value.library and bool(plain[0] == plain[1])
