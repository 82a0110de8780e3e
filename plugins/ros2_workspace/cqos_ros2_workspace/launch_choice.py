"""Which launch file of a workspace is meant: the one that includes all others, or a choice among those that no other includes."""

from __future__ import annotations

import os
import posixpath
from typing import TYPE_CHECKING, Final

from cqos_core.model.finding import plural
from cqos_core.model.folder_suggestion import FolderSuggestion
from cqos_ros2_workspace.path_context import is_test

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_ros2_workspace.launch.includes import Includes
    from cqos_ros2_workspace.launch.workspace import Workspace

_MOST_DESCRIBED: Final = 5
_MOST_SHOWN: Final = 8
_MOST_INCLUDES: Final = 4


def entrance_of(
    folder: str, launches: Sequence[str], packages: Sequence[str], *, alone: bool
) -> tuple[FolderSuggestion, int]:
    """Return the entrance to a workspace, and how much its first choice starts.

    The entrance is its launch file, or the choice among those that no other includes.
    """
    from cqos_ros2_workspace.launch.includes import includes_of, started_by
    from cqos_ros2_workspace.launch.workspace import find_packages

    real = {os.path.realpath(each): each for each in launches}
    workspace = find_packages(folder)
    tests = [each for each in real if is_test(real[each], folder)]
    counted = [each for each in real if each not in tests] or [*real]
    includes = includes_of(counted, workspace)
    names = {each: _value(each, real[each], workspace) for each in real}
    roots = includes.roots()
    first = roots[0]
    others = len(counted) - 1
    reason = ""
    if alone and len(roots) == 1 and {first} | includes.reached(first) >= {*counted}:
        every = f"includes all {others} others" if others > 1 else "includes the other one"
        reason = f"of the launch files of {folder}, {names[first]} {every}"
        if not others:
            reason = f"{names[first]} is the only launch file of {folder}"
        if len(counted) < len(real):
            reason += f" (without {plural(len(real) - len(counted), 'launch file')} of tests)"
    weights = {each: (len(includes.reached(each)), started_by(each, workspace)) for each in roots}
    roots.sort(key=lambda each: (not _brings_up(names[each]), -sum(weights[each]), names[each]))
    details = [_described(names[each], includes, weights[each][1], names, each) for each in roots[:_MOST_DESCRIBED]]
    details += _others([names[each] for each in roots[_MOST_DESCRIBED:]], "further ones that no other includes")
    details += _others([names[each] for each in counted if each not in roots], "included by others")
    details += _others([names[each] for each in tests if each not in counted], "of tests")
    what = plural(len(counted), "launch file")
    value = names[first] if reason else ""
    choices = tuple(names[each] for each in roots)
    entrance = FolderSuggestion(folder, what, value, reason, choices, (*details,), inside=(*packages,))
    return entrance, sum(weights[roots[0]])


def _described(name: str, includes: Includes, nodes: int, names: dict[str, str], path: str) -> str:
    direct = [_last(names.get(each, each)) for each in includes.direct.get(path, {}) if each != path]
    what = f"starts {plural(nodes, 'node')}" if nodes else "starts no node that C-QoS follows"
    if direct:
        what += f", includes {_list(direct, _MOST_INCLUDES)}"
    return f"{name}: {what}"


def _others(names: Sequence[str], what: str) -> list[str]:
    return [f"{what}: {_list([_last(each) for each in names])}"] if names else []


def _list(names: Sequence[str], most: int = _MOST_SHOWN) -> str:
    known = [*dict.fromkeys(names)]
    more = len(known) - most
    return ", ".join(known[:most]) + (f" and {more} more" if more > 0 else "")


def _last(name: str) -> str:
    return posixpath.basename(name.rpartition(":")[2])


def _brings_up(name: str) -> bool:
    return "bringup" in name.lower()


def _value(real: str, written: str, workspace: Workspace) -> str:
    """Return how ``--launch`` names a file: by its package, if the name is the only one there."""
    packages = [name for name, folder in workspace.packages.items() if real.startswith(f"{folder}/")]
    if packages and workspace.launch_files(packages[0], posixpath.basename(real)) == [real]:
        return f"{packages[0]}:{posixpath.basename(real)}"
    return written
