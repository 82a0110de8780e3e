"""Groups files into the systems to check: whole systems, and parts that are merged."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import plural

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.files.file_search import File
    from cqos_core.files.path_loader import Loaded
    from cqos_core.model.system import System

    Read = tuple[File, System]


@dataclass(frozen=True, slots=True)
class CheckUnit:
    """The files that are checked as one system.

    Attributes:
        path: of its only file, else of the folder or of the first file.
        named: whether the caller named all its paths, and so expects endpoints in them.
        files: the paths of all its files.
        folder: the named folder in which it was found; empty if its own path was given.
    """

    path: str
    systems: list[System]
    named: bool
    files: tuple[str, ...] = ()
    folder: str = ""


def check_units(loaded: Loaded, grouping: str) -> tuple[list[CheckUnit], str]:
    """Return the groups of files to check, and a note on the grouping if the paths do not make it clear.

    Named files are one system, with all files in folders named beside them. A folder with parts only counts as a file. In any
    other folder, whole systems are checked one by one, except those that call processes of each other, and parts are merged.
    ``grouping`` is ``each`` or ``together`` if the caller decides.
    """
    read = [(each.file, each.system) for each in loaded.outcomes if each.system is not None]
    if grouping == "each":
        return [_unit([pair]) for pair in read], ""
    wholes = [pair for pair in read if not pair[1].partial]
    parts = [pair for pair in read if pair[1].partial]
    collections = {file.folder for file, _ in wholes}
    apart = None not in collections and all(file.folder in collections for file, _ in parts)
    if grouping == "together" or not apart:
        how = f"{plural(len(read), 'file')} checked as one system; --each checks each by itself"
        found = any(file.folder is not None for file, _ in read) and wholes and len(read) > 1
        return ([_unit(read, named=True)] if read else []), how if found and grouping != "together" else ""
    joint = [_unit(parts, named=len(wholes) == 0)] if parts else []
    apiece = _calling_together(wholes)
    how = ""
    if wholes and parts:
        separate = "1 whole system" if len(apiece) == 1 else f"{len(apiece)} whole systems, one by one,"
        together = "1 part of a system" if len(parts) == 1 else f"{len(parts)} parts of systems, put together"
        how = f"checked {separate} and {together}; --together checks all as one system"
    return [*apiece, *joint], how


def _calling_together(wholes: Sequence[Read]) -> list[CheckUnit]:
    """Return whole systems one by one, except that systems which call processes of each other are one."""
    if not any(system.processes for _, system in wholes):
        return [_unit([pair]) for pair in wholes]
    from cqos_core.bpmn.calls import calling_together

    groups = [[wholes[at] for at in group] for group in calling_together([system for _, system in wholes])]
    return [replace(_unit(group), path=group[0][0].path) for group in groups]


def _unit(read: Sequence[Read], *, named: bool | None = None) -> CheckUnit:
    file = read[0][0]
    folder = file.folder if len(read) > 1 and len({file.folder for file, _ in read}) == 1 else None
    files = tuple(each.path for each, _ in read)
    systems = [system for _, system in read]
    return CheckUnit(folder or file.path, systems, file.named if named is None else named, files, file.folder or "")
