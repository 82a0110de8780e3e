"""Structures of C++ are values: what a variable of such a type is given is a copy, apart from references and pointers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2.learn.frames import lineage
from cqos_ros2.learn.names import without_arguments
from cqos_ros2.learn.program import THIS, Attribute, Name
from cqos_ros2.learn.values import Instance

if TYPE_CHECKING:
    from cqos_ros2.learn.frames import Walk
    from cqos_ros2.learn.program import Expression

_DEEPEST: Final = 4


def copied(value: Any, type_text: str, walk: Walk, depth: int = 0) -> Any:
    """Return what a variable of a type holds that is given a value: of a class of the program, a copy; else the value itself."""
    if walk.program.language != "cpp" or not isinstance(value, Instance) or type_text.endswith(("&", "*")):
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
        if isinstance(inner, Instance):
            made.members[name] = copied(inner, _field(made, name, walk), walk, depth + 1)
    return made


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
