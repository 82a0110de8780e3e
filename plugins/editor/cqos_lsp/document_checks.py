"""Checks the systems of open documents after each change, with the files grouped as by `cqos check`."""

from __future__ import annotations

import os
from dataclasses import field, replace
from typing import TYPE_CHECKING, TypeAlias

from cqos_core.checking.checker import check_system
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.files.file_search import find_files
from cqos_core.files.importer_choice import recognise
from cqos_core.files.path_loader import load_paths
from cqos_core.files.source_files import HEAD, read_path
from cqos_core.files.system_merge import merge
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.dataclass import dataclass
from cqos_core.model.exact_columns import with_exact_columns
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.source import Source
from cqos_core.plugins import load_plugins
from cqos_lsp.projects import Project, Projects, is_configuration, is_pack, pack_problems

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.model.report import Report
    from cqos_core.model.system import System
    from cqos_core.plugins import ImporterInfo
    from cqos_core.resolving.resolved_endpoint import Resolved

Texts: TypeAlias = "Mapping[str, bytes]"
"""The open documents by real path."""
Step: TypeAlias = "Callable[[int, int], None]"
"""Called repeatedly during a check; an exception in it ends the check."""


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """One system, checked.

    Attributes:
        files: the files of the system: a whole one, or parts.
        endpoints: the endpoints with their values.
    """

    files: tuple[str, ...]
    system: System
    report: Report
    endpoints: Sequence[Resolved]
    project: Project

    @property
    def sources(self) -> Mapping[str, bytes]:
        """The bytes of all its files, by the names in places."""
        return self.system.sources

    def name_of(self, path: str) -> str | None:
        """Return the name of a file among the sources; None if it is no source."""
        if path in self.sources:
            return path
        return next((name for name in self.sources if os.path.realpath(name) == path), None)


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The result of checking all open documents.

    Attributes:
        analyses: the systems of open documents; for files that cannot be read now, the former ones.
        problems: of files that cannot be read.
        projects: the project of each open document.
        current: ids of the analyses of the present texts.
    """

    analyses: tuple[Analysis, ...] = ()
    problems: tuple[Problem, ...] = ()
    projects: Mapping[str, Project] = field(default_factory=dict)
    current: frozenset[int] = frozenset()

    def of(self, path: str) -> Analysis | None:
        """Return the system of a file: the one that it belongs to itself, else the first that includes it."""
        mine = [each for each in self.analyses if each.name_of(path) is not None]
        return next((each for each in mine if path in each.files), mine[0] if mine else None)

    def is_current(self, analysis: Analysis) -> bool:
        """Whether an analysis is of the present texts."""
        return id(analysis) in self.current


@dataclass(slots=True, eq=False)
class _Unit:
    """The files of one system.

    Attributes:
        stamps: of all its files; empty if it could not be read.
        system: as it was read last.
        last: the last analysis, also if the files cannot be read now.
    """

    files: tuple[str, ...]
    project: Project
    stamps: Mapping[str, object] = field(default_factory=dict)
    problems: tuple[Problem, ...] = ()
    system: System | None = None
    last: Analysis | None = None

    @property
    def others(self) -> set[str]:
        """The files that its files include."""
        return {os.path.realpath(name) for name in self.system.sources} - {*self.files} if self.system else set()


@dataclass(slots=True, eq=False)
class Checker:
    """Checks the systems of open documents; unchanged systems keep their analysis."""

    projects: Projects = field(default_factory=Projects)
    _listed: dict[str, list[str]] = field(default_factory=dict)
    _claims: dict[str, tuple[object, ImporterInfo | None]] = field(default_factory=dict)
    _units: dict[tuple[str, ...], _Unit] = field(default_factory=dict)
    _last: dict[str, Analysis] = field(default_factory=dict)

    def forget(self) -> None:
        """Forget folders and configurations, because files changed outside of the editor."""
        self._listed.clear()
        self.projects.forget()

    def check(self, texts: Texts, folders: Sequence[str], step: Step) -> CheckResult:
        """Read and check every system that has an open document among its files; ``folders`` are those of the workspace."""
        designs = [path for path in texts if not is_configuration(path) and not is_pack(texts[path])]
        units: dict[tuple[str, ...], _Unit] = {}
        by_folder = grouped((self._folder(path, folders, texts), path) for path in designs)
        for folder, opened in by_folder.items():
            units.update((unit.files, unit) for unit in self._units_of(folder, opened, texts, step))
        self._units |= units
        for unit in units.values():
            step(0, 0)
            _judge(unit, step)
        checked = [(unit, unit.last) for unit in units.values() if unit.last is not None]
        projects = {path: self.projects.of(path, texts) for path in texts}
        problems = [
            *(problem for unit in units.values() for problem in unit.problems),
            *(problem for each in projects.values() for problem in each.problems),
            *(problem for path, data in texts.items() if is_pack(data) for problem in pack_problems(path, data)),
        ]
        current = frozenset(id(last) for unit, last in checked if unit.stamps)
        found = CheckResult(tuple(last for _, last in checked), tuple(dict.fromkeys(problems)), projects, current)
        now = {path: analysis for path in designs if (analysis := found.of(path)) is not None}
        lost = {path: self._last[path] for path in designs if path not in now and path in self._last}
        self._last = {**lost, **now}
        return replace(found, analyses=(*found.analyses, *lost.values()))

    def _folder(self, path: str, folders: Sequence[str], texts: Texts) -> str:
        """Return the folder of the workspace in which a search finds a file; empty if there is none."""
        above = sorted((each for each in folders if path.startswith(each.rstrip(os.sep) + os.sep)), key=len)
        return next((each for each in above if path in self._files(each, texts)), "")

    def _files(self, folder: str, texts: Texts) -> list[str]:
        if folder not in self._listed:
            config = self.projects.of(os.path.join(folder, "_"), texts).config  # noqa: PTH118 - a file of the folder
            found = find_files([folder], load_plugins(), None, config.exclude).files
            self._listed[folder] = [os.path.realpath(file.path) for file in found]
        return self._listed[folder]

    def _units_of(self, folder: str, opened: Iterable[str], texts: Texts, step: Step) -> list[_Unit]:
        """Return the units with an open document: grouped as by `cqos check FOLDER`, or single files outside of folders."""
        if not folder:
            return [self._read((path,), texts) for path in opened if self._importer(path, texts) is not None]
        units, parts = [], []
        for path in self._files(folder, texts):
            info = self._importer(path, texts)
            if info is not None and info.whole:
                units.append(self._read((path,), texts))
                step(0, 0)
            elif info is not None:
                parts.append(path)
        included = {other for unit in units for other in unit.others}
        joint = tuple(path for path in parts if path not in included)
        units = [unit for unit in units if unit.files[0] not in included]
        if not texts.keys().isdisjoint(joint):
            units.append(self._read(joint, texts))
        return [unit for unit in units if not texts.keys().isdisjoint({*unit.files, *unit.others})]

    def _importer(self, path: str, texts: Texts) -> ImporterInfo | None:
        """Return the importer of a file; an open file keeps its format while its first lines are edited."""
        stamp = _stamp(path, texts)
        known, info = self._claims.get(path, (None, None))
        if stamp != known:
            found = _recognised(path, texts)
            info = info if found is None and path in texts else found
            self._claims[path] = stamp, info
        return info

    def _read(self, files: tuple[str, ...], texts: Texts) -> _Unit:
        """Return a unit, read again if a file or its configuration changed."""
        projects = {path: self.projects.of(path, texts) for path in files}
        project = projects[files[0]]
        unit = self._units.get(files) or _Unit(files, project)
        if (
            unit.stamps
            and unit.project is project
            and all(_stamp(path, texts) == stamp for path, stamp in unit.stamps.items())
        ):
            return unit
        info = self._claims.get(files[0], (None, None))[1]
        kept = info is not None and len(files) == 1 and _recognised(files[0], texts) is None
        loaded = load_paths(
            files,
            info.name if info is not None and kept else None,
            protocol=lambda path: projects[path].config.protocol,
            texts=texts,
        )
        unit.project, unit.problems, unit.stamps = project, tuple(loaded.problems), {}
        if loaded.systems:
            merged = merge([system for _, system in loaded.systems])
            system = replace(project.config.apply_to(merged), sources=merged.sources)
            unit.system = with_profiles_tried(system, project.config.protocol)
            read = {*files, *map(os.path.realpath, merged.sources)}
            unit.stamps = {path: _stamp(path, texts) for path in read}
        return unit


def _judge(unit: _Unit, step: Step) -> None:
    """Check a unit, if it is not checked yet."""
    system, project = unit.system, unit.project
    if system is None or (unit.last is not None and unit.last.system is system and unit.last.project is project):
        return
    report = with_exact_columns(check_system(system, project.where, step), system.sources)
    unit.last = Analysis(unit.files, system, report, Pipeline(system, project.where).endpoints, project)


def _recognised(path: str, texts: Texts) -> ImporterInfo | None:
    try:
        data = texts[path] if path in texts else read_path(path, HEAD).data
        return recognise(Source(path, data), load_plugins())
    except InputError:
        return None


def _stamp(path: str, texts: Texts) -> object:
    """Return a value that changes with a file: its open text, or its time and size."""
    if path in texts:
        return texts[path]
    try:
        about = os.stat(path)  # noqa: PTH116 - any text may be a path
    except (OSError, ValueError):
        return None
    return about.st_mtime_ns, about.st_size
