"""Detects inputs at named paths that an importer reads only with an option, such as a launch file in a folder."""

from __future__ import annotations

import os
from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from cqos_core.files.file_search import File
from cqos_core.files.source_files import STDIN
from cqos_core.model.dataclass import dataclass
from cqos_core.plugins import FAULTS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from cqos_core.files.file_search import FoundFiles
    from cqos_core.model.folder_suggestion import FolderSuggestion
    from cqos_core.plugins import ImporterInfo, Plugins


class DetectedInput(NamedTuple):
    """One input that an importer detected at a named path."""

    path: str
    importer: ImporterInfo
    entrance: FolderSuggestion


@dataclass(slots=True)
class DetectedInputs:
    """The detected inputs of all named paths.

    Attributes:
        taken: inputs that are read, by the file or folder to read; those of one folder are read together.
        open: inputs among which a person has to choose.
        refused: named files that need another command first.
        beside: inputs in folders that need another command first.
        narrowed: named folders of which only whole systems are read beside the detected input.
        inside: folders whose files the importer reads by itself.
    """

    taken: dict[File, list[DetectedInput]] = field(default_factory=dict)
    open: list[DetectedInput] = field(default_factory=list)
    refused: dict[str, FolderSuggestion] = field(default_factory=dict)
    beside: list[DetectedInput] = field(default_factory=list)
    narrowed: set[str] = field(default_factory=set)
    inside: set[str] = field(default_factory=set)

    def leave_open(self, folders: Collection[str | None]) -> None:
        """Make inputs of some folders a choice, if they are not at the top of their folder: other files lie beside them."""
        for file, same in [*self.taken.items()]:
            if (
                file.folder in folders
                and not _same(file.path, file.folder or "")
                and all(each.entrance.choices for each in same)
            ):
                self.open += self.taken.pop(file)

    def renamed(self, names: Mapping[str, str]) -> DetectedInputs:
        """Return the inputs with other beginnings of paths, also within texts."""

        def text(value: str) -> str:
            for start, new in names.items():
                value = value.replace(start, new).replace(start.rstrip(os.sep), f"{new}.")
            return value

        def own(item: DetectedInput) -> DetectedInput:
            stated = {each.name: getattr(item.entrance, each.name) for each in fields(item.entrance)}
            new: dict[str, Any] = {
                name: text(each) if isinstance(each, str) else tuple(map(text, each)) for name, each in stated.items()
            }
            return DetectedInput(text(item.path), item.importer, replace(item.entrance, **new))

        return DetectedInputs(
            {
                replace(file, path=text(file.path), folder=file.folder and text(file.folder)): [*map(own, same)]
                for file, same in self.taken.items()
            },
            [*map(own, self.open)],
            self.refused,
            [*map(own, self.beside)],
        )

    def covers(self, path: str) -> bool:
        """Whether an importer reads the file at ``path`` by itself."""
        return any(_holds(folder, path) for folder in self.inside)


def detect_inputs(
    found: FoundFiles, folders: Sequence[str], plugins: Plugins, unclaimed: Callable[[str], bool]
) -> DetectedInputs:
    """Detect the inputs at named paths.

    Args:
        found: the files that the paths stand for.
        folders: the named folders.
        plugins: whose importers are asked.
        unclaimed: whether no importer reads the file at a path.
    """
    detected = DetectedInputs()
    for file in found.files:
        if file.named and file.path != STDIN and unclaimed(file.path):
            for item in _at(file.path, None, plugins):
                _add_file(item, folders, detected)
    for folder in folders:
        if folder not in detected.narrowed:
            below = [each.path for each in (*found.files, *found.skipped) if each.folder == folder]
            for item in _at(folder, below, plugins):
                _add_folder(item, detected)
    return detected


def folders_read_whole(folders: Sequence[str], found: FoundFiles, info: ImporterInfo, plugins: Plugins) -> list[str]:
    """Return the folders in which an importer detects inputs; all folders if it detects none."""
    if len(folders) < 2 or not info.folder_suggestions:  # noqa: PLR2004 - there is nothing to tell apart
        return [*folders]
    below = {
        folder: [each.path for each in (*found.files, *found.skipped) if each.folder == folder] for folder in folders
    }
    own = [
        folder
        for folder in folders
        if any(item.importer is info and item.entrance.choices for item in _at(folder, below[folder], plugins))
    ]
    return own or [*folders]


def _add_file(item: DetectedInput, folders: Sequence[str], detected: DetectedInputs) -> None:
    if not item.entrance.value:
        detected.refused[item.path] = item.entrance
        return
    around = next((each for each in folders if _holds(each, item.path)), None)
    if around is not None:
        item = item._replace(entrance=replace(item.entrance, folder=around))
        detected.narrowed.add(around)
        detected.inside.add(around)
    detected.taken.setdefault(File(item.entrance.folder, around), []).append(item)


def _add_folder(item: DetectedInput, detected: DetectedInputs) -> None:
    entrance = item.entrance
    if entrance.value:
        detected.taken.setdefault(File(entrance.folder, item.path), []).append(item)
    elif entrance.choices:
        detected.open.append(item)
    else:
        detected.beside.append(item)
        return
    detected.narrowed.add(item.path)
    detected.inside.update(entrance.inside)


def _at(path: str, files: Sequence[str] | None, plugins: Plugins) -> list[DetectedInput]:
    """Return the inputs that importers detect; an importer that fails is skipped, so that a broken plugin stops no other."""
    found: list[DetectedInput] = []
    for info in plugins.importers.values():
        if info.folder_suggestions:
            try:
                found += [DetectedInput(path, info, each) for each in info.load_folder_suggester()(path, files)]
            except FAULTS as error:
                if plugins.shipped("importers", info.name):
                    raise
                plugins.note_failure("importers", info.name, error, f"could not look at {path}")
    return found


def _same(one: str, other: str) -> bool:
    return os.path.realpath(one) == os.path.realpath(other)


def _holds(folder: str, path: str) -> bool:
    inside, real = os.path.realpath(folder), os.path.realpath(path)
    return real == inside or real.startswith(inside.rstrip(os.sep) + os.sep)
