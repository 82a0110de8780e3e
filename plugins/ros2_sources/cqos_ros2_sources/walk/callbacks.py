"""Walks of callbacks: they come often and in any order, so a value that one of them changes is known in none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.walk.calls import invoke
from cqos_ros2_sources.walk.expressions import initial_value
from cqos_ros2_sources.walk.frames import MOST_ELEMENTS, Condition, TooMuchError
from cqos_ros2_sources.walk.profiles import content, is_profile, parts_of
from cqos_ros2_sources.walk.trial_snapshot import Start, prepare, spaces
from cqos_ros2_sources.walk.values import MISSING, PLAIN, Code, Either, Instance, Undecided, same, used
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_sources.walk.frames import Walk

_MOST_CALLBACKS: Final = 300
_MOST_ROUNDS: Final = 20


def run_later(walk: Walk) -> None:
    """Walk all callbacks until no further value changes: what they make may never be made.

    Raises:
        TooMuchError: it takes too many rounds.
    """
    walk.in_callback = True
    prepare(walk)
    start = Start(walk)
    for _ in range(_MOST_ROUNDS):
        if not _changing(walk, start):
            return
        start.restore(walk)
    raise TooMuchError


def _changing(walk: Walk, start: Start) -> bool:
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


def _one(code: Code, walk: Walk, start: Start) -> None:
    nodes, this = walk.nodes, code.this
    own = this.node if this is not None else None
    walk.current = own if own is not None else nodes[0] if len(nodes) == 1 else None
    before = {key: dict(each) for key, each in spaces(walk).items()}
    line = code.function.place.line
    walk.conditions.append(Condition(perhaps=f"it is made in a callback in line {line}"))
    given = [Unknown("what a callback is given") for _ in code.function.parameters]
    try:
        invoke(code.function, this, given, {}, walk, value=code)
    finally:
        walk.conditions.pop()
    owners = {id(each.members): each for each in walk.instances}
    for key, space in spaces(walk).items():
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
        waiting += parts_of(each)
    return seen


def _settle(
    space: dict[str, Any], before: dict[str, Any] | None, owner: Instance | None, key: Any, walk: Walk, start: Start
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
