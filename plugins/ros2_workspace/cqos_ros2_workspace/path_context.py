"""The context of a path: its package, its workspace, the files below it, and its launch files. Nothing is executed."""

from __future__ import annotations

import os
import posixpath
import re
from typing import TYPE_CHECKING, Final

from cqos_core.files.source_files import read_path
from cqos_core.model.problems import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

MANIFEST: Final = "package.xml"
_MARKS: Final = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")
_LAUNCH_NAME: Final = re.compile(r".*(?:\.launch|(?:\.launch|_launch)\.(?:py|xml|ya?ml))", re.IGNORECASE)
_LAUNCH_FOLDER: Final = re.compile(r"(?:.*/)?launch(?:es)?/(?:.*/)?[^/]+\.(?:py|xml|ya?ml)", re.IGNORECASE)
_PYTHON: Final = re.compile(rb"^(?:async[ \t]+)?def[ \t]+generate_launch_description\b", re.MULTILINE)
_XML: Final = re.compile(rb"<launch[\s>/]")
_ROS1: Final = re.compile(rb"<node\b[^>]*\stype[ \t]*=")
_ROS2: Final = re.compile(
    rb"<(?:node|composable_node|node_container)\b[^>]*\s(?:exec|plugin)[ \t]*=|find-pkg-share|<let\b|\$\(var "
)
_YAML: Final = re.compile(rb"^launch[ \t]*:", re.MULTILINE)
_TEST: Final = re.compile(rb"^[ \t]*(?:import|from)[ \t]+launch_testing\b", re.MULTILINE)
_TESTS: Final = frozenset(("test", "tests", "testing"))
_LARGEST: Final = 2 * 1024 * 1024


def package_around(path: str) -> str | None:
    """Return the package that a path is in, as the path is written."""
    real = os.path.realpath(path)
    for each in (real, *_parents(real)):
        if os.path.isfile(posixpath.join(each, MANIFEST)):  # noqa: PTH113
            return as_written(each, path)
    return None


def root_around(path: str) -> str:
    """Return the folder of the workspace that a package or a file of one is in, by its real path."""
    from cqos_ros2_workspace.launch.workspace import root_of

    return root_of(posixpath.join(path, MANIFEST) if os.path.isdir(path) else path)  # noqa: PTH112


def workspace_around(path: str) -> str | None:
    """Return the folder of the workspace that a file is in: around its package, else one above that has packages in `src` or `install`."""
    from cqos_ros2_workspace.launch.workspace import find_packages

    if package_around(path) is not None:
        return as_written(root_around(path), path)
    for each in _parents(os.path.realpath(path)):
        for name in ("src", "install"):
            inner = posixpath.join(each, name)
            if len(each) > 1 and os.path.isdir(inner) and find_packages(inner).packages:  # noqa: PTH112
                return as_written(each if name == "src" else inner, path)
    return None


def as_written(folder: str, path: str) -> str:
    """Return an absolute folder as a person writes it who wrote the path."""
    return folder if os.path.isabs(path) else os.path.relpath(folder, os.path.realpath("."))  # noqa: PTH117


def _parents(path: str) -> list[str]:
    parents = []
    while path not in {"", "/"} and posixpath.dirname(path) != path:
        path = posixpath.dirname(path)
        parents.append(path)
    return parents


def between(top: str, path: str) -> list[str]:
    """Return the folders from a path up to the folder ``top`` that it is in."""
    return [path, *(each for each in _parents(path) if is_below(top, each))]


def is_below(folder: str, path: str) -> bool:
    """Whether a path is a folder or lies in it, both written alike."""
    return folder in {path, "."} or path.startswith(f"{folder.rstrip('/')}/")


def not_ignored(files: Sequence[str]) -> list[str]:
    """Return files outside of folders that colcon passes over."""
    marked = tuple(f"{posixpath.dirname(each)}/" for each in files if posixpath.basename(each) in _MARKS)
    return [each for each in files if not each.startswith(marked)] if marked else [*files]


def all_below(folder: str) -> list[str]:
    """Return the files of the packages of a folder, and of the folder itself."""
    from cqos_core.files.folder_walk import SkippedFolder, walk
    from cqos_core.files.ignore_patterns import GENERATED_FOLDERS

    skipped: list[SkippedFolder] = []
    found = []
    for inner, folders, names in walk(folder, skipped):
        folders[:] = sorted(each for each in folders if not each.startswith(".") and each not in GENERATED_FOLDERS)
        found += [posixpath.join(inner, each) for each in sorted(names)]
    return not_ignored(found)


def may_be_launch(path: str) -> bool:
    """Whether a file has the name or the folder of a launch file."""
    return bool(_LAUNCH_NAME.fullmatch(path) or _LAUNCH_FOLDER.fullmatch(path))


def is_launch(path: str, data: bytes) -> bool:
    """Whether a file is a launch file of ROS 2, by what stands in it."""
    lower = path.lower()
    if lower.endswith(".py"):
        return _PYTHON.search(data) is not None
    if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return _XML.search(data) is not None and (_ROS1.search(data) is None or _ROS2.search(data) is not None)
    return lower.endswith((".yaml", ".yml", ".launch")) and _YAML.search(data) is not None


def is_test(path: str, folder: str) -> bool:
    """Whether a launch file of a workspace is for tests."""
    inside = posixpath.relpath(path, folder).split("/")
    named = bool(_TESTS & {*inside[:-1]}) or inside[-1].startswith("test_")
    return named or _TEST.search(content(path)) is not None


def content(path: str) -> bytes:
    """Return what a file begins with; nothing where it cannot be read."""
    try:
        return read_path(path, _LARGEST).data if os.path.isfile(path) else b""  # noqa: PTH113
    except InputError:
        return b""
