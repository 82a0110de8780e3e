"""The workspace on disk: its packages by `package.xml`, and the files that launch files name in them. Nothing outside is read."""

from __future__ import annotations

import os
import posixpath
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cqos_core.files.folder_walk import SkippedFolder, walk
from cqos_core.files.ignore_patterns import GENERATED_FOLDERS
from cqos_core.files.source_files import read_path
from cqos_core.model.problems import InputError
from cqos_core.model.settings import Place
from cqos_core.model.source import Source
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Callable

LARGEST_FILE: Final = 2 * 1024 * 1024
"""How many bytes a launch or parameter file may have."""
MOST_FOLDERS: Final = 50_000
_MARKS: Final = frozenset(("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE"))
_MANIFEST: Final = "package.xml"
_DESIGNER: Final = b"autoware_system_designer"
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
"""Names of packages, as the ROS tools take them. They become names of files."""
PACKAGE_PATH: Final = re.compile(r"\$\(find-pkg-(?:share|prefix) ([^()]+)\)(?:/(.*))?", re.DOTALL)


def _content(path: str) -> bytes:
    return read_path(path).data


@dataclass(slots=True)
class Workspace:
    """A workspace.

    Attributes:
        root: its folder; what links lead out of it is not read.
        packages: folders of packages by their names.
        versions: of the packages that state one.
        designs: packages with designs of the Autoware System Designer.
        repeated: packages that stand there several times, each with the folder that is passed over.
        unreadable: package files that cannot be read.
        skipped: folders that cannot be read, and links that lead out of the workspace.
        cut: the search stopped at the largest number of folders.
        open: returns the content of a file.
    """

    root: str
    packages: dict[str, str] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    designs: list[str] = field(default_factory=list)
    repeated: list[tuple[str, str]] = field(default_factory=list)
    unreadable: list[Unknown] = field(default_factory=list)
    skipped: list[SkippedFolder] = field(default_factory=list)
    cut: bool = False
    open: Callable[[str], bytes] = _content
    _files: dict[str, dict[str, list[str]]] = field(default_factory=dict)

    def passed_over(self) -> list[tuple[Unknown, str]]:
        """Return which packages are not read, and what to do about each."""
        return [
            *(
                (
                    Unknown(f"another package `{name}`, which is passed over", Place(folder)),
                    "put a COLCON_IGNORE into one",
                )
                for name, folder in self.repeated
            ),
            *((each, "correct the file, because the package is passed over") for each in self.unreadable),
            *(
                (Unknown(f"the folder is not searched: {each.shown}", None), "packages and files in it may be missing")
                for each in dict.fromkeys(self.skipped)
            ),
            *(
                [(Unknown("too many folders, so packages may be missing", None), "name one of them")]
                if self.cut
                else []
            ),
        ]

    def find(self, path: str, place: Place | None) -> str | Unknown:
        """Return the file on disk that a path of a launch file names."""
        found = PACKAGE_PATH.fullmatch(path)
        if found is None:
            if not path.startswith("/"):
                return Unknown(f"the path `{path[:120]}` is relative to where the launch is started", place)
            return path if self.holds(path) else Unknown(f"`{path[:120]}` is outside of the workspace", place)
        package, rest = found[1].strip(), posixpath.normpath(found[2] or ".")
        folder = self.packages.get(package)
        if folder is None:
            return Unknown(f"the package `{package[:80]}` is not in the workspace", place)
        if rest.startswith(".."):
            return Unknown(f"`{rest[:120]}` leads out of the package `{package}`", place)
        direct = os.path.join(folder, rest)  # noqa: PTH118 - paths of launch files are texts
        if os.path.exists(direct):  # noqa: PTH110
            return direct if self.holds(direct) else Unknown(f"`{rest[:120]}` is a link out of the workspace", place)
        # An installation may flatten folders: the only file of that name is the one.
        named = self.files_of(package).get(posixpath.basename(rest), [])
        if len(named) == 1:
            return named[0]
        what = f"has {len(named)} files of that name" if named else "has no such file"
        return Unknown(f"`{rest[:120]}`: the package `{package}` {what}", place)

    def missing(self, path: str) -> str:
        """Return the package that a path names and the workspace does not have; empty where it has all."""
        found = PACKAGE_PATH.fullmatch(path)
        name = found[1].strip() if found else ""
        return name if name not in self.packages else ""

    def holds(self, path: str) -> bool:
        """Whether a path lies in the workspace, wherever links on it lead."""
        try:
            real = os.path.realpath(path)
        except (OSError, ValueError):
            return False
        return real == self.root or real.startswith(self.root.rstrip(os.sep) + os.sep)

    def read(self, path: str, place: Place | None) -> bytes | Unknown:
        """Return the content of a file of the workspace."""
        try:
            if not os.path.isfile(path):  # noqa: PTH113 - answers False for any path that no file system takes
                return Unknown(f"`{path[:120]}` is no file", place)
            if not self.holds(path):
                return Unknown(f"`{path[:120]}` is outside of the workspace", place)
            if os.path.getsize(path) > LARGEST_FILE:  # noqa: PTH202
                return Unknown(f"the file has more than {LARGEST_FILE // 1024**2} MiB", Place(path))
            return self.open(path)
        except InputError as error:
            return Unknown(error.problems[0].message, error.problems[0].place)
        except OSError as error:
            return Unknown(f"cannot be read: {error.strerror or error}", Place(path))

    def files_of(self, package: str) -> dict[str, list[str]]:
        """Return the files of a package by their names."""
        if package not in self._files:
            found: dict[str, list[str]] = {}
            for folder, inner, names in walk(self.packages[package], self.skipped):
                inner[:] = sorted(each for each in inner if not each.startswith(".") and each not in GENERATED_FOLDERS)
                for name in names:
                    path = os.path.join(folder, name)  # noqa: PTH118
                    if not os.path.islink(path):  # noqa: PTH114
                        found.setdefault(name, []).append(path)
            self._files[package] = found
        return self._files[package]

    def launch_files(self, package: str, name: str) -> list[str]:
        """Return the files of a package that ``ros2 launch PACKAGE NAME`` may mean."""
        if "/" in name:
            found = self.find(f"$(find-pkg-share {package})/{name}", None)
            return [found] if isinstance(found, str) else []
        return sorted(self.files_of(package).get(name, []))

    def all_launch_files(self, package: str) -> list[str]:
        """Return the names of the launch files of a package."""
        known = self.files_of(package)
        return sorted(name for name in known if ".launch" in name or name.endswith("_launch.py"))

    def module(self, name: str, beside: str) -> str | None:
        """Return the file of a Python module of a package, else of one beside the file that imports it."""
        folder = self.packages.get(name.partition(".")[0], posixpath.dirname(beside))
        inner = os.path.join(folder, *name.split("."))  # noqa: PTH118
        return next((path for path in (f"{inner}.py", f"{inner}/__init__.py") if os.path.isfile(path)), None)  # noqa: PTH113

    def short(self, path: str) -> str:
        """Return a path relative to the workspace."""
        inside = path.startswith(self.root.rstrip(os.sep) + os.sep)
        return os.path.relpath(path, self.root) if inside else path


def root_of(path: str) -> str:
    """Return the folder of the workspace that a file is in: ``src`` above its package, else its repository, else its package.

    Where other packages stand beside the package, it is the folder that they are in.
    """
    start = Path(os.path.realpath(path))
    package = next((each for each in start.parents if (each / _MANIFEST).is_file()), None)
    if package is None:
        return str(start.parent)
    source = next((each for each in package.parents if each.name == "src"), None)
    repository = next((each for each in (package, *package.parents) if (each / ".git").exists()), None)
    return str(source or repository or (package.parent if _beside_others(package) else package))


def _beside_others(package: Path) -> bool:
    """Whether other packages stand beside a package, as in the sources of a repository without its history."""
    try:
        return any((each / _MANIFEST).is_file() for each in package.parent.iterdir() if each.name != package.name)
    except OSError:
        return False


def find_packages(folder: str) -> Workspace:
    """Find the packages of a workspace: folders with a ``package.xml``, as colcon finds them."""
    workspace = Workspace(os.path.realpath(folder))
    count = 0
    for inner, folders, names in walk(workspace.root, workspace.skipped):
        count += 1
        if count > MOST_FOLDERS:
            workspace.cut = True
            break
        if _MARKS & set(names):
            folders.clear()
            continue
        if _MANIFEST in names:
            folders.clear()
            _add(workspace, inner)
            continue
        folders[:] = sorted(each for each in folders if not each.startswith(".") and each not in GENERATED_FOLDERS)
    return workspace


def _add(workspace: Workspace, folder: str) -> None:
    from cqos_core.importers.xml_source import children, local, parse_xml, text_of

    path = os.path.join(folder, _MANIFEST)  # noqa: PTH118
    data = workspace.read(path, Place(path))
    if isinstance(data, Unknown):
        workspace.unreadable.append(data)
        return
    try:
        root = parse_xml(Source(path, data), 20_000)
    except InputError as error:
        workspace.unreadable.append(Unknown(error.problems[0].message, error.problems[0].place))
        return
    name = next((text_of(each) for each in children(root, "name")), "") if local(root) == "package" else ""
    if not _NAME.fullmatch(name):
        what = f"`{name[:80]}` is no name of a package" if name else "it names no package"
        workspace.unreadable.append(Unknown(what, Place(path, 1)))
    elif name in workspace.packages:
        workspace.repeated.append((name, folder))
    else:
        workspace.packages[name] = folder
        if _DESIGNER in data:
            workspace.designs.append(name)
        workspace.versions[name] = next((text_of(each) for each in children(root, "version")), "")
