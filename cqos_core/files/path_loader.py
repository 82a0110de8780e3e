"""Loads paths as systems: finds files, reads them, and collects their problems."""

from __future__ import annotations

import os
from dataclasses import field
from itertools import count
from typing import TYPE_CHECKING

from cqos_core.files.detected_inputs import DetectedInputs, detect_inputs, folders_read_whole
from cqos_core.files.file_search import File, FoundFiles, find_files
from cqos_core.files.importer_choice import claims_source, recognise
from cqos_core.files.source_files import HEAD, STDIN, STDIN_NAME, open_file, read_path
from cqos_core.files.source_reader import GivenSource, included_parts, read_all
from cqos_core.model.dataclass import dataclass
from cqos_core.model.folder_suggestion import ProblemWithLines
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place
from cqos_core.model.source import Opener, Source, no_files
from cqos_core.model.system import System
from cqos_core.plugins import ImporterInfo, Plugins, load_plugins

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.files.detected_inputs import DetectedInput
    from cqos_core.files.ignore_patterns import IgnorePatterns
    from cqos_core.model.folder_suggestion import FolderSuggestion
    from cqos_core.model.optional_features import Feature


@dataclass(frozen=True, slots=True)
class FileOutcome:
    """The result of reading one file: a system, or problems."""

    file: File
    system: System | None = None
    problems: tuple[Problem, ...] = ()


@dataclass(slots=True)
class Loaded:
    """The result of reading paths.

    Attributes:
        outcomes: one per file that was read, or should have been.
        skipped: number of files of other formats in folders.
        not_searched: folders that were skipped: generated, or excluded.
        parts: files that are no systems of their own, each with one that includes it.
        unsearched: problems of directories that cannot be searched.
        detected: inputs that importers detected at named paths.
        folders: what was read as one folder, by path, so that it can be read again.
        left: parts of systems that are not read beside a detected input, each with its importer.
        covered: parts of systems in a folder whose files the detected input refers to.
        lacking: files in folders that a distribution reads which is not installed, one of each.
    """

    outcomes: list[FileOutcome] = field(default_factory=list)
    skipped: int = 0
    not_searched: tuple[str, ...] = ()
    parts: dict[str, str] = field(default_factory=dict)
    unsearched: tuple[Problem, ...] = ()
    detected: DetectedInputs = field(default_factory=DetectedInputs)
    folders: dict[str, GivenSource] = field(default_factory=dict)
    left: list[tuple[File, ImporterInfo]] = field(default_factory=list)
    covered: list[File] = field(default_factory=list)
    lacking: Mapping[str, Feature] = field(default_factory=dict)

    @property
    def systems(self) -> list[tuple[str, System]]:
        """The systems that were read, each with its path."""
        return [(each.file.path, each.system) for each in self.outcomes if each.system is not None]

    @property
    def unused(self) -> list[str]:
        """The covered parts to which nothing that was read refers."""
        read = {os.path.realpath(name) for _, system in self.systems for name in system.sources}
        return [each.path for each in self.covered if os.path.realpath(each.path) not in read]

    @property
    def problems(self) -> list[Problem]:
        """Everything that could not be read, and why; once, also where it is in a file that several include."""
        found = (problem for each in self.outcomes for problem in each.problems)
        return [*self.unsearched, *dict.fromkeys(found)]


def with_texts(texts: Mapping[str, bytes]) -> Opener:
    """Return an opener of files; ``texts`` has bytes by real path that replace those of files."""

    def opener(name: str, relative_to: str) -> Source:
        path = os.path.join(os.path.dirname(relative_to), name)  # noqa: PTH118, PTH120 - as in `find_files`
        data = None if name.endswith("/") else texts.get(os.path.realpath(path))
        return open_file(name, relative_to) if data is None else Source(path, data)

    return opener


def folder_reader(plugins: Plugins, switches: Mapping[str, Mapping[str, str]]) -> str:
    """Return the importer that reads folders as one system, as its switch asks for; empty where none does."""
    able = ((info.name, info.folder_option) for info in plugins.importers.values())
    return next((name for name, option in able if option is not None and option.switch in switches.get(name, ())), "")


def load_paths(
    paths: Iterable[str],
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    stdin: Source | None = None,
    *,
    protocol: str | Callable[[str], str | None] | None = None,
    excluded: Sequence[IgnorePatterns] = (),
    step: Callable[[int, int], None] = lambda _done, _all: None,
    texts: Mapping[str, bytes] | None = None,
    entering: bool = False,
) -> Loaded:
    """Read every path; directories are searched. Nothing is raised: problems are collected.

    Args:
        paths: files and directories; ``-`` is ``stdin``.
        importer: read all of them with this importer.
        switches: importer switches by importer and name.
        stdin: the source for ``-``.
        protocol: of files that state none, or a function that returns it for a path.
        excluded: patterns of files and folders that a search skips.
        step: called after each file with the number of read files and the number of all.
        texts: bytes by real path that replace those of files.
        entering: read detected inputs, unless the caller states an importer or the switch for folders. If a person has
            to choose, only whole systems of folders are read.
    """
    plugins, named = load_plugins(), [*paths]
    reader = folder_reader(plugins, switches or {})
    found, whole = _files(named, plugins, importer, excluded, reader)
    not_searched, unsearched = tuple(found.not_searched), tuple(found.problems)
    loaded = Loaded(skipped=len(found.skipped), not_searched=not_searched, unsearched=unsearched)
    if entering and not reader and importer is None:
        _enter(named, found, loaded, plugins)
    detected = loaded.detected
    folders = whole | {file.path for file in detected.taken}
    opener = with_texts(texts) if texts else open_file
    done = count(1)
    given: dict[int, GivenSource] = {}
    results: dict[int, System | InputError] = {}
    for position, file in enumerate(found.files):
        try:
            if file.path in whole:
                given[position] = GivenSource(Source(file.path, b""), opener, reader)
                continue
            if same := detected.taken.get(file):
                given[position] = _through(same, file.path, opener)
                continue
            if file.path in detected.refused and file.named:
                results[position] = _refused(file.path, detected.refused[file.path])
                continue
            source = stdin if file.path == STDIN and stdin is not None else _open(file, plugins, importer, texts)
            if source is not None:
                own = no_files if source.name == STDIN_NAME else opener
                meant = protocol(file.path) if callable(protocol) else protocol
                given[position] = GivenSource(source, own, importer, meant)
                continue
            loaded.skipped += 1
        except InputError as error:
            results[position] = error
        step(next(done), len(found.files))
    loaded.folders = {each.source.name: each for each in given.values() if each.source.name in folders}
    read = read_all([*given.values()], switches, step=lambda: step(next(done), len(found.files)))
    results |= zip(given, read, strict=True)
    _divide([_outcome(found.files[position], result) for position, result in sorted(results.items())], loaded)
    return loaded


def _enter(paths: Sequence[str], found: FoundFiles, loaded: Loaded, plugins: Plugins) -> None:
    """Detect inputs, and replace the named files by them."""
    folders = [path for path in paths if os.path.isdir(path)]  # noqa: PTH112 - as in `find_files`
    if folders:
        from cqos_core.model.optional_features import unread_files

        loaded.lacking = unread_files([each.path for each in (*found.files, *found.skipped) if not each.named])
    detected = loaded.detected = detect_inputs(found, folders, plugins, lambda path: _is_unclaimed(path, plugins))
    entered = {item.path for same in detected.taken.values() for item in same}
    kept = []
    for file in found.files:
        part = _part(file, plugins) if file.folder in detected.narrowed else None
        if part is not None and not detected.covers(file.path):
            loaded.left.append((file, part))
        elif part is not None:
            loaded.covered.append(file)
        elif not (file.named and file.path in entered):
            kept.append(file)
    detected.leave_open({file.folder for file, _ in loaded.left})
    # The files beside an open choice would be an incomplete system.
    found.files = [] if detected.open and any(each.named for each in kept) else [*detected.taken, *kept]


def _is_unclaimed(path: str, plugins: Plugins) -> bool:
    """Whether no importer reads the file at a path; other problems are reported when it is read."""
    try:
        return recognise(read_path(path, HEAD), plugins) is None
    except InputError:
        return False


def _refused(path: str, entrance: FolderSuggestion) -> InputError:
    return InputError([ProblemWithLines("CQ003", entrance.message, Place(path), "write", entrance.commands)])


def _through(detected: Sequence[DetectedInput], folder: str, opener: Opener) -> GivenSource:
    info = detected[0].importer
    switch = info.options[0].switch  # with which it reads folders
    value = "\n".join(dict.fromkeys(item.entrance.value for item in detected))
    return GivenSource(Source(folder, b""), opener, info.name, None, {info.name: {switch: value}})


def _part(file: File, plugins: Plugins) -> ImporterInfo | None:
    """Return the importer of a file, if it is a part of a system."""
    try:
        info = recognise(read_path(file.path, HEAD), plugins)
    except InputError:
        return None  # what is wrong with it is found where it is read
    return None if info is None or info.whole else info


def _outcome(file: File, result: System | InputError) -> FileOutcome:
    return FileOutcome(file, result) if isinstance(result, System) else FileOutcome(file, problems=result.problems)


def _files(
    paths: Sequence[str], plugins: Plugins, importer: str | None, excluded: Sequence[IgnorePatterns], reader: str
) -> tuple[FoundFiles, set[str]]:
    """Return the files of paths, and the folders that the importer ``reader`` reads as one system."""
    if not reader:
        return find_files(paths, plugins, importer, excluded), set()
    folders = [path for path in paths if os.path.isdir(path)]  # noqa: PTH112 - as in `find_files`
    every = find_files(folders if len(folders) > 1 else (), plugins, importer, excluded)
    whole = {*folders_read_whole(folders, every, plugins.importers[reader], plugins)}
    found = find_files([path for path in paths if path not in whole], plugins, importer, excluded)
    found.files[:0] = [File(path) for path in paths if path in whole]
    return found, whole


def _divide(outcomes: Sequence[FileOutcome], loaded: Loaded) -> None:
    """Add outcomes to the result; files that others include are listed as parts."""
    parts = included_parts({each.file.path: each.system for each in outcomes if each.system is not None})
    for each in outcomes:
        whole = parts.get(os.path.realpath(each.file.path))
        if whole is None:
            loaded.outcomes.append(each)
        else:
            loaded.parts[each.file.path] = whole


def _open(
    file: File, plugins: Plugins, importer: str | None, texts: Mapping[str, bytes] | None = None
) -> Source | None:
    """Read a file; return None if it was found in a folder and no importer claims it.

    A YAML file in a folder may be anything. A file that was named must be readable.
    """
    data = texts.get(os.path.realpath(file.path)) if texts else None
    given = None if data is None else Source(file.path, data)
    if not file.named:
        head = given or read_path(file.path, HEAD)
        claimed = (
            claims_source(plugins.importers[importer], head.name, head.data[:HEAD], plugins)
            if importer
            else recognise(head, plugins)
        )
        if not claimed:
            return None
    return given or read_path(file.path)
