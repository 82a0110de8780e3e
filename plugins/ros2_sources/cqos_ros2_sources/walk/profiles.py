"""Qualities of service as objects: what names, members and lists share. What sets a policy of one sets it for all that hold it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.walk.values import Code, Either, Instance, Profile, Undecided, each_case, flat, same, used
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.walk.frames import Walk
    from cqos_ros2_sources.walk.values import Tests

CONTENT: Final = "#qos"
"""The member that has the policies."""
_DEEPEST: Final = 4
_MISSING: Final = object()


def profile(value: Any, walk: Walk) -> Any:
    """Return a new object with a quality of service."""
    made = Profile(None, members={CONTENT: value})
    walk.instances.append(made)
    return made


def content(value: Any) -> Any:
    """Return the quality of service that an object has now; any other value as it is."""
    if isinstance(value, Profile):
        return value.members[CONTENT]
    if isinstance(value, Either) and is_profile(value):
        return each_case(value, content)
    if isinstance(value, Undecided) and value.exhaustive:
        found = [content(each) for each in value.among]
        return found[0] if all(same(each, found[0]) for each in found) else value
    if isinstance(value, list) and len(value) == 1:
        return [content(value[0])]
    return value


def is_profile(value: Any) -> bool:
    """Whether a value is a quality of service, or one of some."""
    if isinstance(value, Either):
        return any(is_profile(each) for _, each in value.cases)
    if isinstance(value, Undecided) and value.exhaustive:
        return any(is_profile(each) for each in value.among)
    return isinstance(value, Profile)


def change(value: Any, new: Callable[[Any], Any], cause: str, place: Place | None = None) -> None:
    """Change a quality of service; where a value may be one of some, each as far as that is known."""
    if isinstance(value, Profile):
        value.members[CONTENT] = each_case(value.members[CONTENT], new)
    elif isinstance(value, Either):
        before: list[Tests] = []
        for tests, each in value.cases:
            if isinstance(each, Profile):
                old = each.members[CONTENT]
                other = [(one, old) for one in before]
                each.members[CONTENT] = flat((*other, (tests, each_case(old, new)), ((), old)))
            else:
                change(each, new, cause, place)
            before.append(tests)
    else:
        forget(value, cause, place)


def replace(value: Any, other: Any) -> None:
    """Give a quality of service of C++ the policies of another value, as an assignment does."""
    found = content(other)
    change(value, lambda _: found, "it may be set here")


def forget(value: Any, cause: str, place: Place | None = None) -> None:
    """Take the qualities of service as not known that a value is, may be, or holds in lists: something may have changed them."""
    for each in held(value):
        each.members[CONTENT] = Unknown(cause, place)


def held(value: Any, depth: int = 0) -> Iterator[Profile]:
    """Yield the qualities of service that a value is, may be, or holds in lists."""
    if isinstance(value, Profile):
        yield value
    elif depth <= _DEEPEST and not isinstance(value, (Instance, str)):
        inner = (
            [each for _, each in value.cases]
            if isinstance(value, Either)
            else value.among
            if isinstance(value, Undecided)
            else [*value.values()]
            if isinstance(value, dict)
            else value
        )
        for each in inner if isinstance(inner, (list, tuple)) else ():
            yield from held(each, depth + 1)


def reached(*values: Any) -> list[Profile]:
    """Return the qualities of service that values are, may be, or hold: in lists, in objects and theirs, and in functions."""
    waiting, seen, found = [*values], set(), []
    while waiting:
        each = used(waiting.pop())
        if not isinstance(each, (Instance, Code, list, dict, Either, Undecided)) or id(each) in seen:
            continue
        seen.add(id(each))
        found += [each] if isinstance(each, Profile) else []
        waiting += parts_of(each)
    return found


def parts_of(value: Instance | Code | list[Any] | dict[Any, Any] | Either | Undecided) -> list[Any]:
    """Return the values that a value holds."""
    if isinstance(value, Instance):
        return [*value.members.values()]
    if isinstance(value, Code):
        return [value.this, *value.names.values(), *value.own.values(), *value.given, *value.named.values()]
    if isinstance(value, Either):
        return [each for _, each in value.cases]
    if isinstance(value, Undecided):
        return [*value.among]
    return [*(value.values() if isinstance(value, dict) else value)]


def undecided(unknown: Any, *values: Any) -> Any:
    """Return a value that is not known, with the qualities of service that it may be; any other value as it is."""
    if not isinstance(unknown, Unknown) or isinstance(unknown, Undecided):
        return unknown
    among = tuple(each for value in values for each in held(value))
    return Undecided(unknown.cause, unknown.place, unknown.subject, among) if among else unknown


def once(kept: dict[Any, Any], key: Any, make: Callable[[], Any], walk: Walk) -> Any:
    """Return what is made when something asks for it first: one object in all branches, as long as the walk keeps it."""
    known = kept.get(key, _MISSING)
    gone = (
        isinstance(known, Instance) and known.begins is not None and all(known is not each for each in walk.instances)
    )
    if known is _MISSING or gone:
        count = len(walk.instances)
        kept[key] = known = make()
        for each in walk.instances[count:]:
            each.begins = dict(each.members)
    return known
