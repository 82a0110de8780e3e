"""What no walk of a program came to: creating calls are named, and the classes that make them are walked by themselves."""

from __future__ import annotations

import posixpath
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import fits, inner_type, last_part, without_arguments
from cqos_ros2_sources.programs.program import Attribute, Call, Name, call_name
from cqos_ros2_sources.programs.statement_search import calls_in
from cqos_ros2_sources.walk.calls import invoke
from cqos_ros2_sources.walk.endpoint_calls import PLUGIN, Given
from cqos_ros2_sources.walk.frames import Condition, Walk, lineage
from cqos_ros2_sources.walk.node_options import CLASS
from cqos_ros2_sources.walk.objects import NO_CONSTRUCTOR, construct, library_base
from cqos_ros2_sources.walk.values import Instance, NodeRecord, Template
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.program import Class, Function, Program
    from cqos_ros2_sources.walk.call_tables import Row, Table
    from cqos_ros2_sources.walk.package_walk import Exploration

_MOST_CLASSES: Final = 300
HOMELESS: Final = "its node is not known"
NOT_FOLLOWED: Final = "what it is called on, or a condition before it, is not followed"


def not_reached(found: Exploration) -> None:
    """Note the creating calls that no walk came to, with the nodes that may make them; learn what their classes would make."""
    calls = list(missed(found))
    parts: dict[int, tuple[Class | None, list[Function]]] = {}
    for function, place in calls:
        if id(function) not in found.noted:
            _blame(found, function, place)
        if function.place.source not in found.package.own:
            continue  # it is a fragment of the package that it stands in
        cls = found.program.find_class(function.owner, function.place.source) if function.owner else None
        if cls is not None or not function.owner:
            parts.setdefault(id(cls or function), (cls, []))[1].append(function)
    names = [_alone(found, cls, functions) for cls, functions in [*parts.values()][:_MOST_CLASSES]]
    alone = [
        *found.result.fragments.values(),
        *(each for name in names for each in found.result.nodes.get(name, ())),
    ]
    stated = {(each.place.source, each.place.line) for record in alone for each in record.made}
    found.result.gaps = [
        each for each in found.result.gaps if each[1] == HOMELESS or (each[2].source, each[2].line) not in stated
    ]


def missed(found: Exploration) -> Iterator[tuple[Function, Place]]:
    """Yield the creating calls that no walk understood, with their functions."""
    for function in found.functions:
        if function.place.source in found.package.own or id(function) in found.executed:
            for place in creating_calls(function, found):
                if (place.source, place.line or 0) not in found.made_at:
                    yield function, place


def creating_calls(function: Function, found: Exploration) -> Iterator[Place]:
    """Yield where a function may create something by itself."""
    if function.mentions(found.creating):
        for each in calls_in(function.body, function.initializers):
            rows = found.table.calls.get(_called(each), ())
            if any(_may_be(each, row, found.members, found.table) for row in rows) and not _forwards(
                each, function, found.program
            ):
                yield each.place


def types_of_members(program: Program) -> dict[str, str]:
    """Return the types of members and of what stands at the top of files, by name."""
    found = {
        name: type_name
        for classes in program.classes.values()
        for cls in classes
        for name, type_name in cls.fields.items()
    }
    for name, values in program.constants.items():
        made = values[0][1]
        if isinstance(made, Call) and isinstance(made.function, Name):
            found.setdefault(name, made.function.text)
    return found


def _may_be(call: Call, row: Row, fields: dict[str, str], table: Table) -> bool:
    """Whether a call may be one of a row: names of methods of nodes are telling, those of other classes are not."""
    position, counts = row.position("topic"), row.values.get("arguments")
    if counts is not None and len(call.arguments) not in counts:
        return False
    given = len(call.arguments) + len(call.keywords)
    if "makes" not in row.values or (position is not None and given <= (position.index or 0)):
        return False
    if isinstance(call.function, Name) and not _is_named(call.function.text, row):
        return False
    if not row.on or (not row.protocol and any(each == "node" or each in table.nodes for each in row.on)):
        return True
    on = call.function.of if isinstance(call.function, Attribute) else None
    name = on.name if isinstance(on, Attribute) else on.text if isinstance(on, Name) else ""
    stated = without_arguments(inner_type(fields.get(name, "")))
    return any(fits(each, stated) for each in row.on) if stated else False


def _is_named(written: str, row: Row) -> bool:
    """Whether a name with its namespace or module may be that of a row: another library has functions of the same name."""
    scope = written.removesuffix(last_part(written)).strip(":.")
    return fits(row.call, written) if not row.on else not scope or any(fits(each, scope) for each in row.on)


def _called(call: Call) -> str:
    return without_arguments(last_part(call_name(call)))


# A class by itself


def _alone(found: Exploration, cls: Class | None, functions: list[Function]) -> str:
    """Walk a class, or a function of none, that no followed code calls: it is a fragment, and what it makes may never be made."""
    name, place = (cls.name, cls.place) if cls is not None else (functions[0].name, functions[0].place)
    name = name.strip(":")
    record = NodeRecord(name, "", "", place)

    def start(walk: Walk) -> None:
        walk.current = record
        instance = _made(cls, record, functions, walk) if cls is not None else None
        walk.starting = False
        if cls is not None and not isinstance(instance, Instance):
            return
        walk.current = (instance.node if instance is not None else None) or record
        for function in functions if cls is None else (*_callers(cls, functions, walk), *functions):
            if id(function) not in walk.executed:
                walk.conditions.append(Condition(perhaps=f"C-QoS found nothing that calls `{function.last}`"))
                given = [argument(each.name, each.type, walk.current, walk) for each in function.parameters]
                invoke(function, instance, given, {}, walk)
                walk.conditions.pop()

    before = frozenset(found.made_at)
    walk = found.walk(name, start)
    for each in (record, *walk.nodes):
        each.made = [made for made in each.made if (made.place.source, made.place.line or 0) not in before]
        each.gaps = {key: place for key, place in each.gaps.items() if place.source in found.package.own}
    own = next((each for each in walk.nodes if cls is not None and each.cls == cls.name and each.made), record)
    found.keep(name, own)
    inner = [each for each in walk.nodes if each is not own and each.made]
    if inner:
        found.result.nodes.setdefault(name, inner)
    return name


def _callers(cls: Class, functions: list[Function], walk: Walk) -> list[Function]:
    """Return the methods of a class that call some of its functions, over others too, and that no method of it calls."""
    methods = [each for each in walk.program.owned(cls.name) if id(each) not in walk.executed]
    called = {id(each): {last_part(call_name(call)) for call in calls_in(each.body)} for each in methods}
    found: list[Function] = []
    waiting, seen = [*functions], {id(each) for each in functions}
    while waiting:
        function = waiting.pop(0)
        by = [each for each in methods if function.last in called[id(each)] and each is not function]
        if not by and all(function is not each for each in functions):
            found.append(function)
        waiting += [each for each in by if id(each) not in seen]
        seen.update(id(each) for each in by)
    return found


def made_alone(name: str, walk: Walk) -> Instance | None:
    """Return an object of a class that no followed code makes; None where it cannot be made."""
    cls = walk.program.find_class(name)
    made = None if cls is None else _made(cls, NodeRecord(name, "", "", cls.place), [], walk)
    return made if isinstance(made, Instance) else None


def _made(cls: Class, record: NodeRecord, functions: list[Function], walk: Walk) -> Any:
    """Return an object of a class, made with what is not known, and with the node where it takes one."""
    last = "__init__" if walk.program.language == "python" else last_part(cls.name)
    own = walk.program.methods(cls, last)
    chosen = next((each for each in functions if each in own), own[0] if own else None)
    given = [argument(each.name, each.type, record, walk) for each in chosen.parameters] if chosen is not None else []
    made = Call(Name(cls.name), (), (), (), cls.place)
    instance = construct(cls, Given(made, given, {}, ()), walk)
    record.gaps = {key: place for key, place in record.gaps.items() if key[1] != NO_CONSTRUCTOR}
    return instance


def node_options(walk: Walk) -> Instance:
    """Return the options that a container gives a component: they state nothing beside what its launch does."""
    made = Instance(None, library=f"rclcpp::{CLASS}")
    walk.instances.append(made)
    return made


def argument(name: str, type_name: str, record: NodeRecord, walk: Walk) -> Any:
    """Return what a class is given that nothing followed makes: its node where the type is one, else what is not known."""
    plain = without_arguments(inner_type(type_name if "<" in type_name else without_arguments(type_name)))
    known = walk.table.node_class(plain)
    cls = walk.program.find_class(plain) if known is None else None
    library = known[0] if known is not None else library_base(cls, walk) if cls is not None else ""
    if library:
        given = Unknown("what it is given")
        names = [
            name for each in lineage(cls, walk) for name in (*each.fields, *each.initial) if name not in each.fixed
        ]
        made = Instance(cls, library=library, members=dict.fromkeys(names, given), node=record)
        walk.instances.append(made)
        return made
    if last_part(plain) == CLASS:
        return node_options(walk)
    if "string" in type_name and "name" in name and record.name == PLUGIN:
        return Template(PLUGIN)
    return Unknown("what it is given")


# Whose they are


def _forwards(call: Call, function: Function, program: Program) -> bool:
    """Whether a call only hands on the type parameter of its function or class: a wrapper."""
    cls = program.find_class(function.owner, function.place.source) if function.owner and call.types else None
    return any(each in (*function.templates, *(cls.templates if cls is not None else ())) for each in call.types)


def what_creates(function: Function) -> str:
    """Return how a node file names what a function creates."""
    return f"what `{function.last}` in {posixpath.basename(function.place.source)} creates"


def _blame(found: Exploration, function: Function, place: Place) -> None:
    what, cause = what_creates(function), f"C-QoS found nothing that calls `{function.last}`"
    if id(function) in found.executed:
        cause = NOT_FOLLOWED
    nodes = [*(node for nodes in found.result.nodes.values() for node in nodes), *found.result.fragments.values()]
    owners = [node for node in nodes if function.owner and is_of(found, node.cls, function.owner)]
    owners = owners or _of_file(found, place.source)
    owners = [each for each in owners if each.place.source.endswith(tuple(found.table.lists["files"]))]
    for node in owners:
        node.gaps.setdefault((what, cause), place)
    if not owners and not any(each[:2] == (what, cause) for each in found.result.gaps):
        found.result.gaps.append((what, cause, place))


def _of_file(found: Exploration, path: str) -> list[NodeRecord]:
    """Return the nodes of the programs that a file belongs to; of all where it belongs to none."""
    folder, executables = found.package.folder, found.package.executables
    programs = [
        name
        for name, sources in executables.sources.items()
        if path in {posixpath.join(folder, each) for each in sources}
    ]
    programs += [
        name
        for name, (module, _) in executables.scripts.items()
        if path == posixpath.join(folder, f"{module.replace('.', '/')}.py")
    ]
    programs += [name for name, each in executables.files.items() if path == posixpath.join(folder, each)]
    return [node for name, nodes in found.result.nodes.items() if name in programs or not programs for node in nodes]


def is_of(found: Exploration, cls: str, owner: str) -> bool:
    """Whether a class is another one, or is made from it."""
    walk = Walk(found.program, found.table)
    return any(each.name == owner for each in lineage(found.program.find_class(cls), walk))
