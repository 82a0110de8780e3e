"""Nodes whose endpoints stand elsewhere: RViz (`-d FILE`), ros_gz_bridge (`config_file`, or words on the command line), ros2_control."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.model.problems import InputError
from cqos_core.model.settings import Setting
from cqos_core.model.source import ReadContext, Source
from cqos_ros2.importers import gz_bridge, nodl, rviz
from cqos_ros2_workspace.controllers import add_controllers, add_manager
from cqos_ros2_workspace.launch.values import Unknown, first_unknown
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.endpoint_templates import Filled

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.system import Endpoint, System
    from cqos_ros2_workspace.launch.launch_result import Launched
    from cqos_ros2_workspace.launch.workspace import Workspace
    from cqos_ros2_workspace.node_places import Placed
    from cqos_ros2_workspace.nodes.endpoint_templates import FilledNode

_READERS: Final = {"rviz": rviz.read, "gz_bridge": gz_bridge.read, "nodl": nodl.read}
_WORD: Final = re.compile(r"(?P<topic>[^@\[\]]+)@(?P<type>[^@\[\]]+)(?:(?P<way>[@\[\]])(?P<gz>.*))?")
_WAYS: Final = {"@": ("publishes", "subscribes"), "[": ("publishes",), "]": ("subscribes",)}
_OVERRIDABLE: Final = {
    "publishes": ("deadline", "depth", "durability", "history", "liveliness", "reliability"),
    "subscribes": ("history", "depth", "reliability"),
    "serves": (),
}
"""Policies that ends of ros_gz_bridge let be overridden (factory.hpp)."""


def add_configured(placed: Placed, result: FilledNode, launched: Launched, workspace: Workspace) -> None:
    """Add the endpoints that a file or the command line of a node states."""
    if placed.facts is None:
        _nodl(placed, result, launched, workspace)
        return
    kind = placed.facts.get(form.CONFIGURED_BY)
    if kind == "rviz":
        words = placed.instance.arguments
        path = next((words[n + 1] for n, word in enumerate(words[:-1]) if word in {"-d", "--display-config"}), None)
        if path is None:
            result.gaps.append(Unknown("its displays: RViz takes the configuration of the user", placed.place))
        else:
            _file(kind, path, placed, result, launched, workspace)
    elif kind == "gz_bridge":
        given = placed.given().get("config_file")
        unknown = placed.unknown_parameters()
        if given is not None and given.value != "":
            _file(kind, given.value, placed, result, launched, workspace)
        elif unknown is not None:
            result.gaps.append(unknown)
        for word in placed.instance.arguments:
            result.endpoints += _words(word, placed, result)
    elif kind == "ros2_control":
        add_controllers(placed, result, launched)
    elif kind == "ros2_control_spawner":
        add_manager(placed, result, launched)


def _nodl(placed: Placed, result: FilledNode, launched: Launched, workspace: Workspace) -> None:
    """Add what the NoDL document of a node says: the file `EXECUTABLE.nodl.yaml` of its package, where no node file is."""
    package, name = placed.instance.package, f"{placed.instance.executable}{nodl.ENDING}"
    if placed.depth or not isinstance(package, str) or package not in workspace.packages:
        return
    found = workspace.files_of(package).get(name, ())
    if len(found) != 1:
        return
    if isinstance(placed.instance.name, str) and placed.instance.name:
        _file("nodl", found[0], placed, result, launched, workspace)
    else:
        result.gaps.append(Unknown("the launch states no name, and neither does its NoDL document", placed.place))


def _file(
    kind: str, path: object, placed: Placed, result: FilledNode, launched: Launched, workspace: Workspace
) -> None:
    if not isinstance(path, str):
        result.gaps.append(first_unknown(path) or Unknown("its configuration is not known", placed.place))
        return
    real = workspace.find(path, placed.place)
    data = real if isinstance(real, Unknown) else workspace.read(real, placed.place)
    if isinstance(real, Unknown) or isinstance(data, Unknown):
        result.gaps.append(
            data if isinstance(data, Unknown) else Unknown("its configuration is not found", placed.place)
        )
        return
    launched.files.setdefault(real, data)
    try:
        system: System = _READERS[kind](Source(real, data), ReadContext())
    except InputError as error:
        problem = error.problems[0]
        result.gaps.append(
            Unknown(f"its configuration cannot be read: {problem.message}", problem.place or placed.place)
        )
        return
    for each in system.endpoints:
        result.endpoints.append(_taken(each, kind, placed))
    result.notes += system.notes


def _taken(each: Endpoint, kind: str, placed: Placed) -> Filled:
    direction = form.BY_KIND[each.kind, each.role]
    return Filled(
        direction,
        each.topic or "",
        each.type or "",
        each.profiles[0].name if each.profiles else "",
        each.settings,
        each.place or placed.place,
        each.place,
        overridable=_OVERRIDABLE[direction] if kind == "gz_bridge" else (),
        optional=kind == "rviz" or each.external,
        dialect=each.dialect,
        room=each.room,
    )


def _words(word: object, placed: Placed, result: FilledNode) -> Iterator[Filled]:
    """Yield what one word ``TOPIC@TYPE[GZ_TYPE`` bridges."""
    if not isinstance(word, str):
        result.gaps.append(first_unknown(word) or Unknown("a word of its command line", placed.place))
        return
    found = _WORD.fullmatch(word.strip())
    if found is None or word.startswith("-"):
        return
    topic, type_name = found["topic"], found["type"]
    if "/srv/" in type_name:
        yield Filled("serves", topic, type_name, "", {}, placed.place)
        return
    for direction in _WAYS.get(found["way"] or "", ()):
        settings = {"depth": Setting("10", placed.place, derived=True)}
        yield Filled(direction, topic, type_name, "", settings, placed.place, overridable=_OVERRIDABLE[direction])
