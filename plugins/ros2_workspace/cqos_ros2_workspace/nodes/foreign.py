"""Node files of other tools as facts of the same form: NoDL, and node designs of the Autoware System Designer.

NoDL: ros-tooling/nodl 0.3.1, nodl_schema. Designs: autowarefoundation/autoware_system_designer, node.json of format 0.3.0. By its
building/runtime/ports.py the code calls an input ``~/input/NAME`` and an output ``~/output/NAME``, save where ``remap_target`` states a name.
"""

from __future__ import annotations

import json
import posixpath
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from cqos_core.importers.tree import MappingNode, SequenceNode
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_ros2.importers import nodl
from cqos_ros2_workspace.launch.parameter_files import plain, tree_of
from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.reading import POLICIES, read_node_file

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_ros2_workspace.nodes.reading import NodeFile

DESIGN: Final = b"autoware_system_design_format"
_SILENT: Final = "the file states no quality of service"
_DEFAULTS: Final = {"subscribers": "~/input/{}", "publishers": "~/output/{}"}
_OF_DESIGN: Final = {"subscribers": "subscribes", "publishers": "publishes", "servers": "serves", "clients": "calls"}
_NAMES: Final = {"deadline_ns": "deadline", "lifespan_ns": "lifespan"} | {
    key: field.policy for key, field in nodl.FIELDS.items()
}


def read_design(path: str, data: bytes) -> NodeFile | None:
    """Return what a node design of the Autoware System Designer states; None where it states no node."""
    return _node_file(path, design_document(path, data))


def design_document(path: str, data: bytes) -> dict[str, Any] | None:
    """Return the node file, as data, of a node design of the Autoware System Designer; None where it states no node."""
    root = tree_of(data, path, None)
    document = {} if isinstance(root, Unknown) else plain(root)
    package, launch = _map(_map(document).get("package")), _map(_map(document).get("launch"))
    key = launch.get("executable") or launch.get("plugin")
    if not isinstance(root, MappingNode) or not isinstance(package.get("name"), str) or not isinstance(key, str):
        return None
    node: dict[str, Any] = {"plugin": launch["plugin"]} if isinstance(launch.get("plugin"), str) else {}
    for section, direction in _OF_DESIGN.items():
        for entry, line in _entries(root, section):
            stated = [each for each in (entry.get("global"), entry.get("remap_target")) if isinstance(each, str)]
            name = next(iter(stated), "") or _DEFAULTS.get(section, "").format(entry["name"])
            made = _endpoint(entry, "message_type", lambda qos: qos, path, line)
            action = "/action/" in str(entry.get("message_type"))
            where = {"serves": "action_servers", "calls": "action_clients"}[direction] if action else direction
            _add(node.setdefault(where, {}), str(name) or f"({entry['name']})", made, known=bool(name))
    if "base" in document:
        node["unread"] = [{"what": "what its base states", "cause": "bases of designs are not read"}]
    return _document(package["name"], key, node)


def read_nodl(path: str, data: bytes, package: str) -> NodeFile | None:
    """Return what a NoDL document of version 2 states; None where it is none."""
    return _node_file(path, nodl_document(path, data, package))


def nodl_document(path: str, data: bytes, package: str) -> dict[str, Any] | None:
    """Return the node file, as data, of a NoDL document of version 2; None where it is none."""
    root = tree_of(data, path, None)
    document = {} if isinstance(root, Unknown) else _map(plain(root))
    if not isinstance(root, MappingNode) or document.get("nodl_version") != nodl.VERSION:
        return None
    name = posixpath.basename(path).removesuffix(nodl.ENDING)
    node: dict[str, Any] = {"name": name.partition(".")[0]}
    for section, kind in nodl.SECTIONS.items():
        direction = form.BY_KIND[kind]
        for entry, line in _entries(root, section):
            _add(node.setdefault(direction, {}), entry["name"], _endpoint(entry, "type", _policies, path, line))
    if "include" in document:
        node["unread"] = [{"what": "what the documents state that it includes", "cause": "these are not read"}]
    return _document(package, name.partition(".")[0], node)


def _entries(root: MappingNode, section: str) -> Iterator[tuple[dict[str, Any], int]]:
    """Yield the named entries of a section, each with its line."""
    _, found = root.entries.get(section, (None, None))
    for each in found.items if isinstance(found, SequenceNode) else ():
        entry = _map(plain(each))
        if isinstance(entry.get("name"), str):
            yield entry, each.line or 1


def _endpoint(
    entry: dict[str, Any], type_key: str, policies: Callable[[dict[str, Any]], dict[str, Any]], path: str, line: int
) -> dict[str, Any]:
    stated = {name: _text(value) for name, value in policies(_map(entry.get("qos"))).items() if value is not None}
    other = [name for name, value in stated.items() if name not in POLICIES or isinstance(value, (list, dict))]
    made: dict[str, Any] = {"qos": stated or {"unknown": _SILENT}}
    if not stated and "/msg/" not in str(entry.get(type_key)):
        del made["qos"]  # services and actions have the default of the library
    if other:
        made["qos"] = {"unknown": f"the file states `{other[0]}`, which C-QoS does not know"}
    if isinstance(entry.get(type_key), str):
        made["type"] = entry[type_key]
    return {**made, "at": f"{posixpath.basename(path)}:{line}"}


def _policies(qos: dict[str, Any]) -> dict[str, Any]:
    """Return the policies of NoDL by their names; durations are whole nanoseconds, and 0 stands for no limit."""
    found = {}
    for key, value in qos.items():
        time = key.endswith("_ns") and isinstance(value, int)
        found[_NAMES.get(key, key)] = (f"{value}ns" if value else "infinite") if time else value
    return found


def _text(value: Any) -> Any:
    return value.lower() if isinstance(value, str) else value


def _add(endpoints: dict[str, Any], name: str, made: dict[str, Any], *, known: bool = True) -> None:
    cause = {} if known else {"unknown": "the design states no `remap_target`"}
    endpoints.setdefault(name, []).append({**made, **cause})


def _map(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _document(package: str, key: str, node: dict[str, Any]) -> dict[str, Any]:
    return {"cqos_nodes": form.VERSION, "package": package, "nodes": {key: node}}


def _node_file(path: str, document: dict[str, Any] | None) -> NodeFile | None:
    if document is None:
        return None
    try:
        found = read_node_file(Source(f"<learned>/{posixpath.basename(path)}", json.dumps(document).encode()))
    except InputError:
        return None
    return replace(found, sources=posixpath.dirname(path))
