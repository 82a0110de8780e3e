"""The node files that are there: those of a workspace first, then those that come with C-QoS."""

from __future__ import annotations

import posixpath
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

from cqos_core.model.problems import InputError, MissingError
from cqos_core.model.settings import Place
from cqos_core.model.source import Source
from cqos_core.plugins import function
from cqos_ros2.importers.nodl import ENDING as NODL
from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.nodes import foreign, form
from cqos_ros2_workspace.nodes.reading import ENDING, NodeFile, read_node_file
from cqos_ros2_workspace.nodes.version_fit import fit

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.importers.document_form import Entry
    from cqos_core.model.problems import Problem
    from cqos_ros2_workspace.launch.workspace import Workspace
    from cqos_ros2_workspace.nodes.version_fit import Fit

SHIPPED: Final = Path(__file__).parent / "shipped"
LEARNED: Final = "<learned>/"
"""What the names of node files begin with that were made of sources and never written."""
_SHIPPED: Final = "<cqos>/"
_OURS: Final = b"cqos_nodes"
_HEAD: Final = 4096


class LearnedNodes(Protocol):
    """What the sources of a package say about its nodes."""

    @property
    def text(self) -> str:
        """The node file."""

    @property
    def document(self) -> dict[str, Any]:
        """The node file as data."""

    @property
    def files(self) -> tuple[str, ...]:
        """The sources that it names."""

    @property
    def empty(self) -> bool:
        """Whether no node was found."""


class SourceReader(Protocol):
    """Reads packages of one workspace, each source once."""

    def __call__(self, package: str, workspace: Workspace) -> LearnedNodes:
        """Return what the sources of a package say about its nodes.

        Raises:
            InputError: what they say cannot be written down.
            MissingError: they cannot be read here; the text says why, and the help what to install.
        """


def new_reader() -> SourceReader:
    """Return what reads the sources of packages.

    Raises:
        MissingError: it is not installed.
    """
    try:
        reader: SourceReader = function("ros2-sources")()
    except MissingError as error:
        raise MissingError("its sources were not read", error.help) from None
    return reader


@dataclass(slots=True)
class Library:
    """Looks up nodes and fragments.

    Attributes:
        workspace: whose node files come first; None: without a workspace.
        sources: the node files that were read, by name.
        problems: what is wrong with node files of the workspace.
        unread: why the sources of a package of the workspace were not read, by its name.
    """

    workspace: Workspace | None = None
    sources: dict[str, bytes] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    unread: dict[str, str] = field(default_factory=dict)
    _learned: dict[str, list[NodeFile]] = field(default_factory=dict)
    _reader: SourceReader | None = None
    _designs: dict[str, list[NodeFile]] | None = None
    _read: dict[str, list[NodeFile]] = field(default_factory=dict)

    def node(self, package: str, executable: str) -> tuple[NodeFile, Entry] | None:
        """Return what is known of a node by its executable or class; None where nothing is."""
        for file in (*self._files(package), *self._sources(package, executable)):
            found = file.nodes.get(executable)
            if found is None:
                found = next((each for each in file.nodes.values() if each.get(form.PLUGIN) == executable), None)
            if found is not None:
                return file, found
        return None

    def fragment(self, name: str) -> tuple[NodeFile, Entry] | None:
        """Return a fragment by its name; a class is looked up in the file of its first part."""
        package = name.partition("::")[0]
        for file in (*self._files(package), *self._sources(package, name)):
            if name in file.fragments:
                return file, file.fragments[name]
        return None

    def classes(self, package: str) -> list[str]:
        """Return the names of the fragments that node files of a package have."""
        return [name for file in self._files(package) for name in file.fragments]

    def fit(self, file: NodeFile, distro: str) -> Fit | None:
        """Return which facts of a file that comes with C-QoS its package in the workspace takes; None where it is of any version, or not there."""
        workspace = self.workspace
        if workspace is None or not file.versions or file.package not in workspace.packages:
            return None
        if not file.name.startswith(_SHIPPED):
            return None
        place = Place(posixpath.join(workspace.packages[file.package], "package.xml"))
        found = fit(file.versions, workspace.versions.get(file.package, ""), place, distro)
        return found if found.same else found._replace(unread=self._unread(file.package))

    def read(self, file: NodeFile, part: Entry) -> tuple[NodeFile, Entry] | None:
        """Return what the sources in the workspace say about a node or fragment of a file that comes with C-QoS."""
        both = (*file.nodes.items(), *file.fragments.items())
        names = [*(name for name, each in both if each is part), part.get(form.PLUGIN)]
        for learned in self._of_sources(file.package):
            for name in names:
                found = learned.nodes.get(name or "") or learned.fragments.get(name or "")
                if found is not None:
                    return learned, found
        return None

    def _unread(self, package: str) -> str:
        self._of_sources(package)
        return self.unread.get(package, "")

    def _files(self, package: str) -> list[NodeFile]:
        known = self._read.get(package)
        if known is None:
            known = self._read[package] = [
                *self._of_workspace(package),
                *self._foreign(package),
                *self._shipped(package),
            ]
        return known

    def _of_workspace(self, package: str) -> list[NodeFile]:
        workspace = self.workspace
        if workspace is None or package not in workspace.packages:
            return []
        read = []
        for path in _ending(workspace, [package], ENDING):
            data = workspace.read(path, None)
            if isinstance(data, Unknown) or _OURS not in data[:_HEAD]:
                continue  # other tools use the same ending
            read += self._one(Source(path, data))
        return read

    def _foreign(self, package: str) -> list[NodeFile]:
        """Return what node files of other tools say of a package: NoDL in it, and designs of Autoware in any package that has such."""
        workspace = self.workspace
        if workspace is None or package not in workspace.packages:
            return []
        if self._designs is None:
            self._designs = {}
            for path in _ending(workspace, workspace.designs, ENDING):
                data = workspace.read(path, None)
                design = foreign.read_design(path, data) if isinstance(data, bytes) and foreign.DESIGN in data else None
                if design is not None and isinstance(data, bytes):
                    self._designs.setdefault(design.package, []).append(design)
                    self.sources[path] = data
        found = list(self._designs.get(package, ()))
        for path in _ending(workspace, [package], NODL):
            data = workspace.read(path, None)
            made = foreign.read_nodl(path, data, package) if isinstance(data, bytes) else None
            if made is not None and isinstance(data, bytes):
                found.append(made)
                self.sources[path] = data
        return found

    def _shipped(self, package: str) -> list[NodeFile]:
        path = SHIPPED / f"{package}{ENDING}"
        if not package.isidentifier() or not path.is_file():
            return []
        return self._one(Source(f"{_SHIPPED}{path.name}", path.read_bytes()))

    def _sources(self, package: str, name: str) -> list[NodeFile]:
        """Return what the sources of a package of the workspace say, where no node file has a node or fragment."""
        return [] if any(_has(file, name) for file in self._files(package)) else self._of_sources(package)

    def _of_sources(self, package: str) -> list[NodeFile]:
        if self.workspace is None:
            return []
        if package not in self._learned:
            self._learned[package] = self._learn(package, self.workspace)
        return self._learned[package]

    def _learn(self, package: str, workspace: Workspace) -> list[NodeFile]:
        if package not in workspace.packages:
            return []
        try:
            self._reader = self._reader or new_reader()
            learned = self._reader(package, workspace)
        except MissingError as error:
            self.unread[package] = f"{error.what}: {error.help}"
            return []
        except InputError as error:
            self.unread[package] = f"what its sources say cannot be written down: {error.problems[0].message}"
            return []
        if learned.empty:
            self.unread[package] = "its sources were read, and no node was found in them"
            return []
        read = read_node_file(Source(f"{LEARNED}{package}{ENDING}", learned.text.encode()))
        folder = workspace.packages[package]
        for path in learned.files:
            data = workspace.read(path, None)
            if isinstance(data, bytes):
                self.sources[path] = data
        return [replace(read, sources=folder)]

    def _one(self, source: Source) -> list[NodeFile]:
        try:
            found = read_node_file(source)
        except InputError as error:
            self.problems += error.problems
            return []
        self.sources[source.name] = source.data
        return [found]


def _ending(workspace: Workspace, packages: Iterable[str], ending: str) -> list[str]:
    """Return the files of packages that end so."""
    names = ((name, paths) for each in packages for name, paths in workspace.files_of(each).items())
    return sorted(path for name, paths in names if name.endswith(ending) for path in paths)


def _has(file: NodeFile, name: str) -> bool:
    return (
        name in file.nodes
        or name in file.fragments
        or any(each.get(form.PLUGIN) == name for each in file.nodes.values())
    )
