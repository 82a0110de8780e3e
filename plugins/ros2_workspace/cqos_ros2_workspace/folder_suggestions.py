"""Suggestions how a path is checked as a workspace: by its launch file, or by the commands that lead to one."""

from __future__ import annotations

import os
import posixpath
import re
import shlex
from typing import TYPE_CHECKING, Final

from cqos_core.model.folder_suggestion import FolderSuggestion
from cqos_core.model.problems import InputError
from cqos_ros2_workspace.launch_choice import entrance_of
from cqos_ros2_workspace.path_context import (
    MANIFEST,
    all_below,
    as_written,
    between,
    content,
    is_below,
    is_launch,
    may_be_launch,
    not_ignored,
    package_around,
    root_around,
    workspace_around,
)
from cqos_ros2_workspace.sources import (
    CLIENTS,
    MOST_SOURCES,
    ROS,
    SOURCES,
    check_command,
    new_launch,
    new_manifest,
    of_clients,
    of_sources,
    plain,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_NODES: Final = re.compile(rb"^[\"']?cqos_nodes[\"']?[ \t]*:", re.MULTILINE)
_ROBOTS: Final = (".urdf", ".xacro", ".sdf")
_OF_PACKAGES: Final = (MANIFEST, "CMakeLists.txt", "setup.py", "setup.cfg")
_PARAMETERS: Final = re.compile(rb"^[ \t]*[\"']?ros__parameters[\"']?[ \t]*:", re.MULTILINE)
_ENDINGS: Final = (*SOURCES, *_ROBOTS, ".xml", ".yaml", ".yml", ".launch", ".txt", ".cfg")
_STORAGE: Final = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")


def find(path: str, files: Sequence[str] | None) -> list[FolderSuggestion]:
    """Return the entrances at a path; see `cqos_core.model.folder_suggestion.FolderSuggester`."""
    if files is None:
        return [each for each in (_of_file(path),) if each is not None]
    kept = not_ignored(files)
    launches = [each for each in kept if may_be_launch(each) and is_launch(each, content(each))]
    manifests = [each for each in kept if posixpath.basename(each) == MANIFEST]
    if not launches and not manifests and (installed := _installed(path)):
        return _of_workspaces(installed, *_listing(installed))
    if launches or manifests:
        return _of_workspaces(path, launches, manifests)
    found = _without_package(path, kept)
    return [] if found is None else [found]


def _of_file(path: str) -> FolderSuggestion | None:
    lower = path.lower()
    if lower.endswith(_STORAGE):
        return _of_storage(posixpath.dirname(path) or ".", path)
    if not lower.endswith(_ENDINGS) or not os.path.isfile(path):  # noqa: PTH113
        return None
    data = content(path)
    if is_launch(path, data):
        return _of_launch_file(path)
    if _NODES.search(data) and lower.endswith((".yaml", ".yml")):
        return _of_node_file(path, "this")
    if lower.endswith(SOURCES) and ROS.search(data):
        return of_sources(path, package_around(path))
    if lower.endswith(SOURCES) and CLIENTS.search(data):
        return of_clients(posixpath.dirname(path) or ".", "this is the source of a client of a broker")
    if posixpath.basename(path) in _OF_PACKAGES or lower.endswith(_ROBOTS) or _PARAMETERS.search(data):
        return _of_package_file(path)
    return None


def _of_launch_file(path: str) -> FolderSuggestion:
    folder = workspace_around(path)
    if folder is None:
        folder = posixpath.dirname(path) or "."
        message = (
            "this is a launch file, and no workspace is around it: no folder above it has `src`, `install` or a package.xml, "
            "so packages that it names are not found"
        )
        return FolderSuggestion(folder, message, commands=(check_command(folder, path),))
    return FolderSuggestion(folder, "", path, f"{path} is a launch file")


def _of_node_file(path: str, shown: str) -> FolderSuggestion:
    from cqos_core.model.source import Source
    from cqos_ros2_workspace.nodes.reading import read_node_file

    try:
        known = read_node_file(Source(path, content(path)))
    except InputError as error:
        first = error.problems[0]
        line = "" if first.place is None or first.place.line is None else f", line {first.place.line}"
        message = f"{shown} is a node file that cannot be used{line}: {first.message}"
        return FolderSuggestion("", message, commands=(f"cqos learn {shlex.quote(package_around(path) or '.')}",))
    message = (
        f"{shown} is a node file: it states the endpoints of nodes of the package `{known.package}`, and a check reads it where "
        "a launch file starts these nodes"
    )
    nodes = [(known.package, each) for each in known.nodes]
    folder = workspace_around(path)
    if folder is not None and package_around(path) is not None:
        ways = [each for each in find(folder, all_below(folder)) if each.choices]
        if ways:
            likely = ways[0]
            return FolderSuggestion("", message, commands=(check_command(likely.folder, likely.choices[0]),))
        return FolderSuggestion("", message, commands=new_launch(folder, nodes))
    new = f"check_{plain(known.package)}"
    commands = (
        f"mkdir -p {new} && cp {shlex.quote(path)} {new}",
        new_manifest(known.package, new),
        *new_launch(new, nodes),
    )
    return FolderSuggestion("", message, commands=commands)


def _of_package_file(path: str) -> FolderSuggestion | None:
    """Return the command that checks the workspace of a file that no importer reads alone."""
    folder = workspace_around(path)
    if folder is None or package_around(path) is None:
        return None
    ways = find(folder, all_below(folder))
    if not ways:
        return None
    likely = ways[0]
    message = (
        "this file has no quality of service of its own, and a check reads it where a launch file starts its nodes"
    )
    commands = (check_command(likely.folder, likely.choices[0]),) if likely.choices else likely.commands
    return FolderSuggestion("", message, commands=commands)


def _of_storage(folder: str, path: str = "") -> FolderSuggestion:
    what = f"{'this' if path else posixpath.basename(path) or 'this folder'} is the storage of a rosbag2 recording"
    shown = shlex.quote(folder)
    if os.path.isfile(posixpath.join(folder, "metadata.yaml")):  # noqa: PTH113
        message = f"{what}; its quality of service stands in `metadata.yaml` beside it"
        return FolderSuggestion("", message, commands=(f"cqos check {shown}",))
    message = f"{what} without `metadata.yaml`, in which its quality of service stands; `ros2 bag reindex` writes it"
    return FolderSuggestion("", message, commands=(f"ros2 bag reindex {shown}", f"cqos check {shown}"))


def _of_workspaces(path: str, launches: Sequence[str], manifests: Sequence[str]) -> list[FolderSuggestion]:
    """Return an entrance for each workspace in a folder, or that the folder is in."""
    package = None if any(posixpath.dirname(each) == path.rstrip("/") for each in manifests) else package_around(path)
    groups: dict[str, tuple[list[str], list[str]]] = {}
    if package is not None:
        groups[as_written(root_around(path), path)] = ([*launches], [*manifests])
    else:
        folders = _workspaces(path, [posixpath.dirname(each) for each in manifests], launches)
        for folder in folders:
            groups[folder] = ([], [])
        for number, each_kind in enumerate((launches, manifests)):
            for each in each_kind:
                groups[next(folder for folder in folders if is_below(folder, each))][number].append(each)
    with_launch = [folder for folder, (own, _) in groups.items() if own]
    found: list[tuple[FolderSuggestion, int]] = []
    for folder, (own, packages) in groups.items():
        if own:
            inside = [posixpath.dirname(each) for each in packages]
            found.append(entrance_of(folder, own, inside, alone=len(with_launch) == 1))
        else:
            sources = of_sources(folder, folder)
            found += [(sources, -1)] if sources is not None else []
    # What starts most is the most likely.
    return [entrance for entrance, _ in sorted(found, key=lambda each: -each[1])]


def _workspaces(path: str, packages: Iterable[str], launches: Iterable[str]) -> list[str]:
    """Return the folders of workspaces below a path, the deepest first: those with `src`, repositories, folders of packages."""
    with_src: set[str] = set()
    others: set[str] = set()
    for package in packages:
        inside = posixpath.relpath(package, path).split("/")
        if "src" in inside:
            with_src.add(posixpath.join(path, *inside[: inside.index("src")]).rstrip("/"))
        elif inside[-2:-1] == ["share"]:  # installed, each package in a folder of its own or all in one
            own = inside[-3:-2] == inside[-1:]
            others.add(posixpath.join(path, *inside[: -3 if own else -2]).rstrip("/"))
        else:
            repository = next(
                (each for each in between(path, package) if os.path.exists(posixpath.join(each, ".git"))),  # noqa: PTH110
                None,
            )
            others.add(repository or (package if package == path else posixpath.dirname(package)))
    for launch in launches:
        if not any(is_below(each, launch) for each in with_src | others):
            others.add(posixpath.dirname(launch))
    every = with_src | others
    kept = with_src | {each for each in others if not any(is_below(other, each) for other in every if other != each)}
    return sorted(kept, key=lambda each: (-each.count("/"), each))


def _without_package(path: str, files: Sequence[str]) -> FolderSuggestion | None:
    """Return what to do with sources or storages of recordings that lie in no package below the path."""
    storages = [each for each in files if each.lower().endswith(_STORAGE)]
    bare = [folder for each in storages if not os.path.isfile(f"{(folder := posixpath.dirname(each))}/metadata.yaml")]  # noqa: PTH113
    if bare:
        return _of_storage(bare[0])
    node_files = [each for each in files if each.endswith(".node.yaml") and _NODES.search(content(each))]
    if node_files:
        return _of_node_file(node_files[0], node_files[0])
    sources = [each for each in files if each.lower().endswith(SOURCES)][:MOST_SOURCES]
    texts = [content(each) for each in sources]
    if any(map(ROS.search, texts)):
        return of_sources(path, package_around(path))
    if any(map(CLIENTS.search, texts)):
        return of_clients(path, "these are sources of clients of a broker")
    return None


def _installed(path: str) -> str:
    """Return the folder `install` of a built workspace whose sources are not there; empty if there is none."""
    from cqos_ros2_workspace.launch.workspace import find_packages

    inner = posixpath.join(path, "install")
    return inner if os.path.isdir(inner) and find_packages(inner).packages else ""  # noqa: PTH112


def _listing(folder: str) -> tuple[list[str], list[str]]:
    every = all_below(folder)
    launches = [each for each in every if may_be_launch(each) and is_launch(each, content(each))]
    return launches, [each for each in every if posixpath.basename(each) == MANIFEST]
