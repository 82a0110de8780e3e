"""Sets of parameters that generate_parameter_library makes of a YAML file: which there are, and the object that a program gets of one.

Source: generate_parameter_library, README.md and its templates: a class ``ParamListener`` in the namespace that the file names; a
prefix ends with a dot; parameters of parameters (``__map_…``) are not followed.
"""

from __future__ import annotations

import os
import posixpath
import re
from typing import TYPE_CHECKING, Any, Final

import yaml

from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.walk.endpoint_calls import OWN_WORDS, declare
from cqos_ros2_sources.walk.values import MISSING, Instance, NodeRecord, Template
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_sources.walk.endpoint_calls import Given
    from cqos_ros2_sources.walk.frames import Walk
    from cqos_ros2_workspace.launch.workspace import Workspace

LISTENER: Final = "ParamListener"
_NAMED: Final = re.compile(
    rb"generate_parameter_(?:library|module)\s*\(\s*[\"']?[\w${}.-]+[\"']?[\s,]+[\"']?([^\s\"',)]+\.ya?ml)"
)
_PREFIXES: Final = ("${CMAKE_CURRENT_SOURCE_DIR}/", "${PROJECT_SOURCE_DIR}/", "./")
_LARGEST: Final = 200_000
_DEEPEST: Final = 8
_MOST: Final = 1_000


def read_sets(package: str, workspace: Workspace) -> dict[str, Any]:
    """Return the sets of parameters of a package: the tree of each file by its namespace; what cannot be read is left out."""
    found: dict[str, Any] = {}
    files = workspace.files_of(package)
    for path in sorted([*files.get("CMakeLists.txt", []), *files.get("setup.py", [])]):
        data = workspace.read(path, None)
        for written in _NAMED.findall(data) if isinstance(data, bytes) else ():
            inner = written.decode("utf-8", "replace")
            for prefix in _PREFIXES:
                inner = inner.removeprefix(prefix)
            near = posixpath.normpath(posixpath.join(os.path.dirname(path), inner))  # noqa: PTH120 - as places have it
            if near in files.get(posixpath.basename(inner), []):
                found.update(_tree(workspace.read(near, None)))
    return found


def _tree(data: Any) -> dict[str, Any]:
    try:
        read = yaml.safe_load(data) if isinstance(data, bytes) and len(data) <= _LARGEST else None
    except (yaml.YAMLError, ValueError, RecursionError):
        return {}
    return {str(name): tree for name, tree in read.items() if isinstance(tree, dict)} if isinstance(read, dict) else {}


def parameter_set(name: str, given: Given, walk: Walk) -> Instance | None:
    """Return the object of a set of parameters, with the value of each; None where a name means none."""
    sets = walk.program.parameter_sets
    if not sets or last_part(name) != LISTENER:
        return None
    around = (name if name != LISTENER else walk.frame.function.name).replace("::", ".").split(".")
    tree = next((sets[each] for each in reversed(around) if each in sets), None)
    if tree is None:
        return None
    asked = given.arguments[0] if given.arguments else None
    node = asked.node or asked.members.get("#node") if isinstance(asked, Instance) else None
    prefix = given.arguments[1] if len(given.arguments) > 1 else ""
    node = node if isinstance(node, NodeRecord) else walk.current
    known = isinstance(prefix, str) and node is not None
    start = f"{prefix}." if isinstance(prefix, str) and prefix and not prefix.endswith(".") else prefix
    return _object(tree, start if known else "", node if known else None, [_MOST])


def _object(tree: dict[Any, Any], prefix: str, node: NodeRecord | None, left: list[int], depth: int = 0) -> Instance:
    """Return an object with a member for each parameter and each group of them."""
    made = Instance(None, library="#parameters")
    for key, each in tree.items():
        left[0] -= 1
        name, inner = str(key), isinstance(each, dict)
        named = f"{prefix}{name}"
        if (
            left[0] < 0
            or depth > _DEEPEST
            or name.startswith("__map_")
            or not inner
            or node is None
            or named in OWN_WORDS
        ):
            made.members[name] = Unknown("a parameter that is not followed")
        elif isinstance(each.get("type"), str):
            declare(node, f"{prefix}{name}", each.get("default_value", MISSING))
            made.members[name] = Template(f"${{{prefix}{name}}}")
        else:
            made.members[name] = _object(each, f"{prefix}{name}.", node, left, depth + 1)
    return made
