"""Walks of the programs of a package: the nodes of its executables and components, each walk with its own limits."""

from __future__ import annotations

import posixpath
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from cqos_core.model.settings import Place
from cqos_ros2_sources.programs.names import fits, last_part
from cqos_ros2_sources.programs.program import Attribute, Call, Function, Name, Reference, call_name
from cqos_ros2_sources.programs.statement_search import calls_in
from cqos_ros2_sources.unread.lost_calls import note_unfollowed
from cqos_ros2_sources.unread.unreached_code import HOMELESS, argument, node_options, not_reached, types_of_members
from cqos_ros2_sources.walk.callbacks import run_later
from cqos_ros2_sources.walk.calls import invoke
from cqos_ros2_sources.walk.endpoint_calls import PLUGIN, Given
from cqos_ros2_sources.walk.frames import Frame, TooMuchError, Walk
from cqos_ros2_sources.walk.functions import method_of
from cqos_ros2_sources.walk.objects import construct
from cqos_ros2_sources.walk.python_imports import run_imports
from cqos_ros2_sources.walk.values import Instance, NodeRecord
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_ros2_sources.programs.packages import Package
    from cqos_ros2_sources.programs.program import Class, Program
    from cqos_ros2_sources.walk.call_tables import Table

_NOWHERE: Final = Function("", (), (), Place(""))


@dataclass(slots=True)
class Explored:
    """What a package makes.

    Attributes:
        nodes: those of each executable or component, the first one first.
        plugins: the class as a component, by executable or class.
        fragments: what classes make that pluginlib loads.
        gaps: what is not known, its cause, where.
    """

    nodes: dict[str, list[NodeRecord]] = field(default_factory=dict)
    plugins: dict[str, str] = field(default_factory=dict)
    fragments: dict[str, NodeRecord] = field(default_factory=dict)
    gaps: list[tuple[str, str, Place]] = field(default_factory=list)


@dataclass(slots=True)
class Exploration:
    """One language of a package while it is explored.

    Attributes:
        made_at: places of calls that were understood as making something.
        executed: functions that were walked.
        at_run_time: functions that change parameters while a node runs.
        noted: functions with creating calls that nodes name as not followed.
        functions: those of the program.
        members: types of members and of what stands at the top of files, by name.
        creating: names of calls that create something.
        loaded: classes that pluginlib loads; fragments of their own say what they create.
    """

    package: Package
    program: Program
    table: Table
    result: Explored
    made_at: set[tuple[str, int]] = field(default_factory=set)
    executed: set[int] = field(default_factory=set)
    at_run_time: set[str] = field(default_factory=set)
    noted: set[int] = field(default_factory=set)
    functions: list[Function] = field(init=False)
    members: dict[str, str] = field(init=False)
    creating: list[bytes] = field(init=False)
    loaded: set[str] = field(init=False)

    def __post_init__(self) -> None:
        """Put together what every search for creating calls needs."""
        self.functions = [each for found in self.program.functions.values() for each in found]
        self.members = types_of_members(self.program)
        self.creating = [each.encode() for each in self.table.calls]
        plugins = (self.program.find_class(written, at.source) for written, at in self.program.plugins.items())
        self.loaded = {each.name for each in plugins if each is not None}

    def keep(self, name: str, record: NodeRecord) -> None:
        """Add a fragment; what stands in one file under one name is one fragment."""
        fragments = self.result.fragments
        known = fragments.setdefault(name, record) if record.made else record
        if known is not record and known.place.source == record.place.source:
            known.made += record.made
            known.parameters = {**record.parameters, **known.parameters}
        elif known is not record:
            fragments[f"{name} in {posixpath.basename(record.place.source)}"] = record

    def walk(self, key: str, start: Callable[[Walk], None]) -> Walk:
        """Walk one program or component from its start, then its life cycle, then its callbacks."""
        walk = Walk(self.program, self.table, at_run_time=self.at_run_time)
        walk.frames.append(Frame(_NOWHERE, None))
        try:
            start(walk)
            _life_cycle(walk)
            run_later(walk)
        except (TooMuchError, RecursionError):
            cause = "it takes more steps than C-QoS follows"
            for node in walk.nodes:
                node.gaps["all that comes later", cause] = node.place
            if not walk.nodes:
                self.result.gaps.append((f"the program {key}", cause, Place(self.package.folder)))
        self.made_at |= walk.made_at
        self.executed |= walk.executed
        for name, record in walk.strays.items():
            self.keep(name, record)
        for place in walk.homeless:
            self.result.gaps.append((f"what line {place.line} creates", HOMELESS, place))
        return walk


def explore(package: Package, tables: dict[str, Table]) -> Explored:
    """Return what the executables, components and plugins of a package make."""
    result = Explored()
    for language, program in package.programs.items():
        found = Exploration(package, program, tables[language], result)
        found.at_run_time = _at_run_time(program, tables[language])
        if language == "cpp":
            _programs(found)
            _components(found)
            _plugins(found)
        else:
            _scripts(found)
        not_reached(found)
    result.gaps += [("what a file creates", cause, place) for cause, place in package.gaps]
    return result


def _at_run_time(program: Program, table: Table) -> set[str]:
    """Return the functions that change parameters while a node runs: what they set is no value of its start."""
    found: set[str] = set()
    names = [each.encode() for each in table.lists["at_run_time"]]
    for functions in program.functions.values():
        for function in functions:
            for each in calls_in(function.body) if function.mentions(names) else ():
                if last_part(call_name(each)) in table.lists["at_run_time"]:
                    found |= {
                        last_part(given.name) for given in each.arguments if isinstance(given, (Reference, Attribute))
                    }
    return found


# C++


def _programs(found: Exploration) -> None:
    """Walk `main` of each executable."""
    mains = [each for each in found.program.functions.get("main", []) if each.place.source in found.package.own]
    folder, present = found.package.folder, found.package.present
    listed = {
        name: {posixpath.normpath(posixpath.join(folder, each)) for each in sources}
        for name, sources in found.package.executables.sources.items()
    }
    stated = set().union(*listed.values())
    unresolved = [name for name, paths in listed.items() if paths.isdisjoint(present)]
    for name, paths in listed.items():
        own = [each for each in mains if each.place.source in paths]
        if not own:
            own = [each for each in mains if posixpath.splitext(posixpath.basename(each.place.source))[0] == name]
        if not own and unresolved == [name]:  # of no other executable the sources are not known
            own = [each for each in mains if each.place.source not in stated] if len(mains) == 1 else []
        if len(own) == 1:
            _keep(found, name, found.walk(name, lambda walk, main=own[0]: _main(main, walk)))  # type: ignore[misc]


def _keep(found: Exploration, name: str, walk: Walk) -> None:
    """Keep the nodes that the program or component ``name`` makes."""
    if walk.nodes:
        note_unfollowed(found, walk, walk.nodes)
        found.result.nodes[name] = walk.nodes


def _main(main: Function, walk: Walk) -> None:
    invoke(
        main, None, [Unknown(f"`{each.name}` of the command line", main.place) for each in main.parameters], {}, walk
    )


def _components(found: Exploration) -> None:
    """Walk the classes that are registered as components."""
    by_class = {plugin: name for name, plugin in found.package.executables.components.items()}
    registered = dict(found.program.registered)
    for plugin in by_class:
        registered.setdefault(plugin, Place(found.package.folder))
    for written, place in registered.items():
        cls = found.program.find_class(written, place.source)
        if cls is None:
            found.result.gaps.append((f"the component {written}", "its class is not in what was read", place))
            continue
        name = cls.name.strip(":")
        for key, nodes in found.result.nodes.items():
            if len(nodes) == 1 and fits(nodes[0].cls, name):
                found.result.plugins.setdefault(key, name)
        executable = next((key for plugin, key in by_class.items() if fits(plugin, name)), "")
        if executable:
            found.result.plugins[executable] = name
        elif name in found.result.plugins.values():
            continue
        walk = found.walk(name, lambda walk, cls=cls: _object(cls, walk))  # type: ignore[misc]
        _keep(found, executable or name, walk)


def _object(cls: Class, walk: Walk) -> None:
    constructors = walk.program.methods(cls, last_part(cls.name))
    counts = sorted(len(each.parameters) for each in constructors)
    count = 1 if not counts or 1 in counts else counts[0]
    made = Call(Name(cls.name), (), (), (), cls.place)
    construct(cls, Given(made, [node_options(walk)] * count, {}, ()), walk)


def _plugins(found: Exploration) -> None:
    """Walk the classes that pluginlib loads: each is a fragment, whose names begin with that of the plugin."""
    for written, place in found.program.plugins.items():
        cls = found.program.find_class(written, place.source)
        if cls is None:
            found.result.gaps.append((f"the plugin {written}", "its class is not in what was read", place))
            continue
        record = NodeRecord(cls.name, PLUGIN, "", place)

        def start(walk: Walk, cls: Class = cls, record: NodeRecord = record) -> None:
            walk.current = record
            made = Call(Name(cls.name), (), (), (), cls.place)
            instance = construct(cls, Given(made, [], {}, ()), walk)
            record.gaps.clear()
            walk.current = record
            if not isinstance(instance, Instance):
                return
            for name in walk.table.lists["plugin"]:
                for method in method_of(cls, name, walk)[:1]:
                    if id(method) not in walk.executed:
                        invoke(
                            method,
                            instance,
                            [argument(each.name, each.type, record, walk) for each in method.parameters],
                            {},
                            walk,
                        )

        walk = found.walk(written, start)
        note_unfollowed(found, walk, [record, *walk.nodes])
        if record.made or record.gaps:
            found.result.fragments[cls.name.strip(":")] = record
        inner = [each for each in walk.nodes if each.made]
        if inner:  # nodes of its own
            found.result.nodes.setdefault(cls.name.strip(":"), inner)


# Python


def _imported_main(main: Function, walk: Walk) -> None:
    run_imports(main.place.source, walk, itself=True)
    _main(main, walk)


def _scripts(found: Exploration) -> None:
    """Walk the functions that console scripts name, and the files that are installed as programs."""
    executables = found.package.executables
    for name, (module, function) in executables.scripts.items():
        own = [
            each
            for each in found.program.functions.get(function, [])
            if not each.owner and fits(each.name, f"{module}.{function}") and each.name.endswith(f"{module}.{function}")
        ]
        if len(own) != 1:
            found.result.gaps.append(
                (f"the program {name}", f"`{module}:{function}` is not one function", Place(found.package.folder))
            )
            continue
        _keep(found, name, found.walk(name, lambda walk, main=own[0]: _imported_main(main, walk)))  # type: ignore[misc]
    for name, path in executables.files.items():
        script = found.program.scripts.get(posixpath.normpath(posixpath.join(found.package.folder, path)))
        if script is None:
            continue

        def start(walk: Walk, script: Function = script) -> None:
            walk.frame.names["__name__"] = "__main__"
            from cqos_ros2_sources.walk.statements import run

            run_imports(script.place.source, walk, itself=False)
            walk.frames.append(Frame(script, None, names={"__name__": "__main__"}))
            run(script.body, walk)
            walk.frames.pop()

        _keep(found, name, found.walk(name, start))


# After the start


def _life_cycle(walk: Walk) -> None:
    """Walk what the life cycle of a node calls."""
    walk.starting = False
    walk.current = walk.nodes[0] if len(walk.nodes) == 1 else None
    for instance in [*walk.instances]:
        if instance.node is None or not instance.node.lifecycle:
            continue
        walk.current = instance.node
        for name in walk.table.lists["lifecycle"]:
            for method in method_of(instance.cls, name, walk)[:1]:
                if id(method) not in walk.executed:
                    arguments = [Unknown("the state before") for _ in method.parameters]
                    invoke(method, instance, arguments, {}, walk)
