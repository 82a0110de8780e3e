"""Snapshots of a walk, which are restored before a function is tried or called later."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_core.model.settings import Place
from cqos_ros2_sources.programs.program import Function, Name, call_name
from cqos_ros2_sources.programs.statement_search import calls_in
from cqos_ros2_sources.walk.cpp_copies import is_quality
from cqos_ros2_sources.walk.expressions import PARTS, evaluate, initial_value, member, shared_preset
from cqos_ros2_sources.walk.frames import Frame, lineage
from cqos_ros2_sources.walk.values import Instance, NodeRecord, used

if TYPE_CHECKING:
    from cqos_ros2_sources.programs.program import Class, Expression
    from cqos_ros2_sources.walk.frames import Walk
    from cqos_ros2_workspace.launch.values import Unknown


def prepare(walk: Walk) -> None:
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
    if program.qualities is None:
        stated = (each for found in program.constants.values() for each in found)
        program.qualities = [(full, path) for full, written, path in stated if _makes_quality(written, walk)]
    for full, path in program.qualities:
        walk.frames.append(Frame(Function(full, (), (), Place(path)), None))
        evaluate(Name(full), walk)
        walk.frames.pop()


def make_members(instance: Instance, walk: Walk) -> None:
    """Make the qualities of service that come with an object of C++ and its parts: what is handed the object may change them."""
    waiting, seen = [instance], {id(instance)}
    while waiting:
        each = waiting.pop()
        names = [name for cls in lineage(each.cls, walk) for name in cls.fields if _holds_quality(cls, name, walk)]
        for found in [used(member(each, name, walk)) for name in names]:
            if isinstance(found, Instance) and id(found) not in seen:
                seen.add(id(found))
                waiting.append(found)


def _holds_quality(cls: Class, name: str, walk: Walk) -> bool:
    """Whether a member is a quality of service, or an object or list that has one."""
    key = id(cls), name
    if key not in walk.program.holding:
        walk.program.holding[key] = False  # a class that has itself
        walk.program.holding[key] = _search(cls, name, walk)
    return walk.program.holding[key]


def _search(cls: Class, name: str, walk: Walk) -> bool:
    found = False
    for part in filter(None, map(str.strip, PARTS.split(cls.fields[name]))):
        inner = walk.program.find_class(part, cls.place.source, cls.name)
        found = found or is_quality(part, walk)
        found = found or any(_holds_quality(each, one, walk) for each in lineage(inner, walk) for one in each.fields)
    return found


def _makes_quality(written: Expression, walk: Walk) -> bool:
    """Whether an expression makes a quality of service."""
    table = walk.table
    calls = calls_in((), ((written, (written,), None),))
    return any(table.lookup(table.makers, call_name(each)) is not None for each in calls)


class Start:
    """What a walk has found before the first callback, and which of its values change from then on."""

    def __init__(self, walk: Walk) -> None:
        """Keep it."""
        self.callbacks, self.steps, self.homeless = [*walk.callbacks], walk.steps, len(walk.homeless)
        self.instances, self.nodes = len(walk.instances), len(walk.nodes)
        self.current, self.strays = walk.current, {*walk.strays}
        self.spaces = {key: (each, dict(each)) for key, each in spaces(walk).items()}
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


def spaces(walk: Walk) -> dict[int, dict[str, Any]]:
    """Return all names that outlive a call, by their identity: members, names around lambdas, names of modules."""
    found = [each.members for each in walk.instances]
    found += [each.names for each in walk.callbacks]
    return {id(each): each for each in (*found, *walk.modules.values())}


def _records(walk: Walk) -> list[NodeRecord]:
    carried = [each.members.get("#node") for each in walk.instances]
    found = [*walk.nodes, *walk.strays.values(), walk.current, *(each.node for each in walk.instances), *carried]
    return [*{id(each): each for each in found if isinstance(each, NodeRecord)}.values()]
