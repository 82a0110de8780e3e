"""What is checked as one system: whole systems, and parts put together."""

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
    """What is checked as one system.

    Attributes:
        path: of its only file, else of the folder or of the first file.
        named: whether all its paths were given, so that the caller expects something to be in them.
        files: the paths of all its files.
        folder: the named folder in which it was found; empty if its own path was given.
    """

    path: str
    systems: list[System]
    named: bool
    files: tuple[str, ...] = ()
    folder: str = ""


def check_units(loaded: Loaded, grouping: str) -> tuple[list[CheckUnit], str]:
    """Group what was read into systems, and say how, where the paths alone do not tell.

    Named files are one system, with all that is in folders named beside them. A folder that holds nothing but parts is as
    good as a file. In any other folder whole systems stand alone, except where one calls processes of another, and parts are put
    together. ``grouping`` is ``each`` or
    ``together`` where the caller decides.
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
    """Return whole systems one by one, but those together that run processes of each other."""
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
