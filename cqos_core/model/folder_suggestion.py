"""Suggestions for a path that no importer reads as it is named: importers may read it as a folder with a switch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import Problem

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True, slots=True)
class FolderSuggestion:
    """One way to read the files at a path.

    Attributes:
        folder: what the importer reads.
        message: what is there, and what is missing for a check.
        value: of the switch ``folders_with``, if it is certain.
        reason: why it is certain.
        choices: values among which a person chooses, the most likely first.
        details: lines about the choices.
        commands: lines for a shell that lead to a check, if no value of the switch does.
        inside: folders whose files the importer reads by itself.
    """

    folder: str
    message: str
    value: str = ""
    reason: str = ""
    choices: tuple[str, ...] = ()
    details: tuple[str, ...] = ()
    commands: tuple[str, ...] = ()
    inside: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ProblemWithLines(Problem):
    """A problem whose help goes on in lines that are shown as they are, since a person pastes them."""

    lines: tuple[str, ...] = ()


class FolderSuggester(Protocol):
    """Finds suggestions for a path, without running anything there."""

    def __call__(self, path: str, files: Sequence[str] | None) -> Sequence[FolderSuggestion]:
        """Return the suggestions for ``path``, the most likely first; ``files`` are those below it, None if it is a file."""
