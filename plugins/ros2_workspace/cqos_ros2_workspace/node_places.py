"""Places of the nodes of a launch: full name, process, parameters and remaps of each, and the nodes inside of others."""

from __future__ import annotations

import posixpath
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from cqos_ros2_workspace.launch.values import Unknown, first_unknown
from cqos_ros2_workspace.naming import Rule, rules_of
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.endpoint_templates import FilledNode, Filling, Parameter
from cqos_ros2_workspace.parameters import ParameterReader, Sections

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.importers.document_form import Entry
    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.launch.launch_result import Instance, Launched
    from cqos_ros2_workspace.launch.workspace import Workspace
    from cqos_ros2_workspace.nodes.library import Library
    from cqos_ros2_workspace.nodes.reading import NodeFile

_DEEPEST: Final = 4


@dataclass(slots=True)
class Process:
    """What a process gives its nodes: parameters, remaps, and the namespace of nodes that state none."""

    sections: Sections
    rules: list[Rule]
    namespace: str


@dataclass(slots=True)
class Placed:
    """One node.

    Attributes:
        address: its full name.
        depth: how many nodes around it create each other and it; 0: the launch starts it.
        sections: the parameters that it is given.
        rules: remaps of the launch, in the order in which they are tried.
        own: remaps of its code, which come before them.
        file, facts: what is known of it; None where no node file is.
        cause: why nothing is known of it; empty where something is.
    """

    instance: Instance
    address: str
    name: str
    namespace: str
    process: Process
    sections: list[Sections]
    rules: list[Rule]
    file: NodeFile | None = None
    facts: Entry | None = None
    cause: str = ""
    depth: int = 0
    own: list[Rule] = field(default_factory=list)

    @property
    def place(self) -> Place:
        """Where the launch states it."""
        return self.instance.place

    def given(self) -> dict[str, Parameter]:
        """Return the parameters that it is given, as far as they are known."""
        found: dict[str, Parameter] = {}
        for each in self.sections:
            found.update(each.of(self.address))
        return found

    def unknown_parameters(self) -> Unknown | None:
        """Return why further parameters may be given; None where all are known."""
        return next((each.unknown for each in self.sections if each.unknown is not None), None)

    def filled(self, library: Library, distro: str) -> FilledNode:
        """Return its endpoints for one distribution."""
        result = FilledNode()
        if self.file is None or self.facts is None:
            return result
        values = [(each.of(self.address), each.unknown) for each in reversed(self.sections)]

        def parameter(name: str) -> Parameter | None:
            for known, unknown in values:
                if unknown is not None:
                    return Parameter(Unknown(unknown.cause, unknown.place), unknown.place)
                if name in known:
                    return known[name]
            return None

        namespace = self.namespace.rstrip("/")
        variables = {"node": self.name, "namespace": namespace, "above": namespace.rpartition("/")[0]}
        try:
            Filling(library, parameter, variables, distro, result, self.file).fill(self.facts)
        except RecursionError:
            result.gaps.append(Unknown("its node file is nested too deep to be followed", self.place))
        return result


class Placing:
    """Places the nodes of one launch.

    Attributes:
        nodes: those that are placed.
        unknown: nodes whose package, executable or name is not known, each with the cause.
        undecided: nodes that start under a condition that is not decided.
        later: nodes that start on an event of the launch.
    """

    def __init__(self, launched: Launched, workspace: Workspace, library: Library) -> None:
        """Place every node of ``launched``."""
        self.nodes: list[Placed] = []
        self.unknown: list[tuple[Instance, Unknown]] = []
        self.undecided: list[Instance] = []
        self.later: list[Instance] = []
        self._library = library
        self._reader = ParameterReader(launched, workspace)
        instances = [each for each in map(started, launched.instances) if each is not None]
        self._containers = {_name_of(each): each for each in instances if each.kind != "component" and not each.guards}
        self._processes: dict[int, Process] = {}
        for number, instance in enumerate(instances):
            if instance.guards:
                self.undecided.append(instance)
            elif instance.after.startswith("event"):
                self.later.append(instance)
            else:
                self._add(instance, number)

    def _add(self, instance: Instance, number: int) -> None:
        parts = (instance.package, instance.executable, instance.namespace)
        unknown = first_unknown([*parts, instance.name if instance.name is not None else ""])
        if unknown is not None or not all(isinstance(each, str) for each in parts):
            self.unknown.append((instance, unknown or Unknown("it depends on what the launch leaves open")))
            return
        package, executable = str(instance.package), str(instance.executable)
        found = self._library.node(package, executable)
        facts = found[1] if found else None
        own = _own_rules(facts)
        alone = instance.kind != "component" and facts is not None and facts.get(form.GLOBAL_ARGUMENTS) is False
        name = instance.name if isinstance(instance.name, str) and instance.name and not alone else None
        name = _own(own, "__node", "__name") or name or (facts.get(form.NAME) if facts is not None else None)
        stated = facts.get(form.NAMESPACE) if facts is not None else None
        given = "" if alone else str(instance.namespace)
        namespace = _own(own, "__ns") or given or f"/{(stated or '').strip('/')}"
        process = self._process(instance, number)
        rules = [] if alone else rules_of(instance, number)
        known_name = name or f"({package}/{executable})"
        address = f"{namespace.rstrip('/')}/{known_name.lstrip('/')}"
        sections = [] if alone else [process.sections]
        if instance.kind == "component":
            sections = [process.sections, self._reader.of_component(instance.parameters, address)]
            rules = [*rules, *process.rules]
        placed = Placed(instance, address, known_name, namespace, process, sections, rules, own=own)
        if found is not None and name is not None:
            placed.file, placed.facts = found
        else:
            unread = self._library.unread.get(package, "")
            missing = f"no node file for `{package}` `{executable}`{f', and {unread}' if unread else ''}"
            placed.cause = missing if found is None else "it has no name"
        self.nodes.append(placed)

    def _process(self, instance: Instance, number: int) -> Process:
        """Return the process that a node runs in: its own, or that of its container."""
        if instance.kind != "component":
            rules = rules_of(instance, number)
            return Process(self._reader.of_process(instance), rules, str(instance.namespace) or "/")
        container = self._containers.get(f"/{str(instance.container).lstrip('/')}")
        if container is None:
            unknown = Unknown(f"the container `{str(instance.container)[:80]}` is not in the launch", instance.place)
            return Process(Sections(unknown=unknown), [], "/")
        if id(container) not in self._processes:
            self._processes[id(container)] = self._process(container, -1)
        return self._processes[id(container)]

    def inside(self, placed: Placed, filled: FilledNode) -> Iterator[Placed]:
        """Yield the nodes that a node creates; that it creates any is a gap where too many are around it."""
        if filled.inside and placed.depth >= _DEEPEST:
            filled.gaps.append(Unknown("the nodes that it creates are nested too deep", placed.place))
            return
        for each in filled.inside:
            package, _, executable = each.node.partition("/")
            found = self._library.node(package, executable)
            stated = found[1].get(form.NAMESPACE) if found is not None else None
            own = _own_rules(None if found is None else found[1])
            namespace = _own(own, "__ns") or f"/{(each.namespace.strip('/') or stated or '').strip('/')}"
            address = f"{namespace.rstrip('/')}/{each.name}"
            process, instance = placed.process, placed.instance
            inner = Placed(instance, address, each.name, namespace, process, [process.sections], process.rules, own=own)
            inner.depth = placed.depth + 1
            if found is None:
                inner.cause = f"no node file for `{package}` `{executable}`"
            else:
                inner.file, inner.facts = found
            yield inner


def _own_rules(facts: Entry | None) -> list[Rule]:
    """Return the remaps that a node file states of a node."""
    stated = (facts.get(form.REMAPS) if facts is not None else None) or {}
    return [Rule(source, each.value, each.place, _IN_CODE) for source, each in stated.items()]


def _own(rules: list[Rule], *sources: str) -> str:
    """Return what a node renames its name or namespace to; empty where it does not."""
    return next((str(rule.target) for rule in rules if rule.source in sources), "")


_IN_CODE: Final = -2
"""The owner of remaps that no instance states."""
_COMMANDS: Final = {"MicroXRCEAgent": "px4", "micro-xrce-dds-agent": "px4"}
"""Packages of node files by the commands, which are no nodes, that bring their endpoints."""


def started(instance: Instance) -> Instance | None:
    """Return the node that an instance is, or whose endpoints it brings; None of any other process."""
    if instance.kind != "process":
        return instance
    words = [word for each in instance.arguments if isinstance(each, str) for word in each.split()]
    package = _COMMANDS.get(posixpath.basename(words[0])) if words else None
    return replace(instance, package=package, executable="MicroXRCEAgent") if package else None


def _name_of(instance: Instance) -> str:
    """Return the full name of a container; empty where it is not known."""
    name, space = instance.name, instance.namespace
    if not isinstance(name, str) or not isinstance(space, str):
        return ""
    return f"{space.rstrip('/')}/{name.lstrip('/')}"


def distribution(environment: Mapping[str, object], given: str) -> str:
    """Return the ROS 2 distribution: the one that is given, else the one of the environment; empty where it is not stated."""
    stated = environment.get("ROS_DISTRO")
    return given or (stated if isinstance(stated, str) else "")
