"""Structures of C++ are values: a variable of such a type gets a copy, apart from references and pointers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import last_part, points, refers, without_arguments
from cqos_ros2_sources.programs.program import ADDRESS, THIS, Attribute, Call, Name, Operation, call_name
from cqos_ros2_sources.walk.frames import lineage
from cqos_ros2_sources.walk.profiles import content, held, is_profile, profile
from cqos_ros2_sources.walk.qualities import maker
from cqos_ros2_sources.walk.values import Instance, Qos, Template, Word
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_sources.programs.program import Expression
    from cqos_ros2_sources.walk.frames import Walk

_DEEPEST: Final = 4


def copied(value: Any, type_text: str, walk: Walk, depth: int = 0, written: Expression | None = None) -> Any:
    """Return what a variable of a type holds that is given a value: of a class of the program, a copy; else the value itself.

    Args:
        value: what it is given.
        type_text: the type as written; empty where it is not known.
        walk: where the walk is.
        depth: how deep in a structure the value stands.
        written: what is written for the value.
    """
    if walk.program.language != "cpp":
        return value
    if is_profile(value) or is_quality(type_text, walk):
        return _copied_profile(value, type_text, written, walk)
    if isinstance(value, (list, dict)) and not refers(type_text) and any(True for _ in held(value)):
        return _copied_list(value, type_text, walk, written)
    if not isinstance(value, Instance) or type_text.endswith(("&", "*")):
        return value
    cls, objects = value.cls, walk.table.objects
    if cls is None and walk.table.lookup(objects, value.library) is not None:
        plain = without_arguments(type_text)
        if plain != "auto" and walk.table.lookup(objects, plain) is None:
            return value
        made = Instance(None, value.library, dict(value.members))
        walk.instances.append(made)
        return made
    if cls is None or value.node is not None or depth > _DEEPEST or "<" in type_text:
        return value
    around = walk.frame.function
    stated = walk.program.find_class(type_text, around.place.source, around.name)
    if stated is None or all(stated is not each for each in lineage(cls, walk)):
        return value
    made = Instance(cls, value.library, dict(value.members), dict(value.types))
    walk.instances.append(made)
    for name, inner in made.members.items():
        if isinstance(inner, Instance) or is_profile(inner):
            made.members[name] = copied(inner, _field(made, name, walk), walk, depth + 1)
    return made


def is_quality(type_text: str, walk: Walk) -> bool:
    """Whether a type is one of qualities of service, or refers to one."""
    return walk.table.lookup(walk.table.makers, without_arguments(type_text)) is not None


def _copied_profile(value: Any, type_text: str, written: Expression | None, walk: Walk) -> Any:
    """Return what a variable holds that is given a quality of service, or what converts to one."""
    if is_profile(value):
        if refers(type_text) or (type_text in {"", "auto"} and written is not None and _points(written, walk)):
            return value
        found = content(value)
        bare = isinstance(found, Qos) and not found.preset  # `rclcpp::KeepLast(5)`
    else:
        found, bare = value, isinstance(value, (int, Template, Word, list))
        if points(type_text) or not (bare or isinstance(value, Unknown)):
            return value
    made = maker(without_arguments(type_text), [found], {}, walk) if bare else None
    return profile(found if made is None else made, walk)


def _copied_list(value: Any, type_text: str, walk: Walk, written: Expression | None) -> Any:
    """Return a copy of a list or map of C++: with copies of its elements, apart from pointers."""
    kind = type_of_name(written, walk) if type_text in {"", "auto"} and written is not None else type_text
    inner = kind.partition("<")[2].rpartition(">")[0].rpartition(",")[2].strip()
    if isinstance(value, dict):
        return {key: copied(each, inner, walk) for key, each in value.items()}
    return [copied(each, inner, walk) for each in value]


def _points(written: Expression, walk: Walk) -> bool:
    """Whether what is written is a pointer, as far as types tell."""
    if isinstance(written, Call):
        return any(points(each.returns) for each in walk.program.functions.get(last_part(call_name(written)), ()))
    pointer = isinstance(written, Operation) and written.operator == ADDRESS and len(written.operands) == 1
    return pointer or points(type_of_name(written, walk))


def type_of_name(written: Expression, walk: Walk) -> str:
    """Return the type of a local name or of a member of the object that the walk is in; empty where it is not known."""
    if isinstance(written, Name) and written.text in walk.frame.names:
        return walk.frame.declared.get(written.text, "")
    own = written.text if isinstance(written, Name) else ""
    if isinstance(written, Attribute) and written.of == Name(THIS):
        own = written.name
    this = walk.frame.this
    return _field(this, own, walk) if own and this is not None else ""


def _field(instance: Instance, name: str, walk: Walk) -> str:
    return next((each.fields[name] for each in lineage(instance.cls, walk) if name in each.fields), "")
