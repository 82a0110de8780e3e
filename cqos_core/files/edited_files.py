"""Edits applied to files, in memory or on disk."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from cqos_core.files.atomic_writes import replace_all
from cqos_core.files.importer_choice import recognise
from cqos_core.files.source_files import read_path
from cqos_core.files.text_edits import edited_text, replacements
from cqos_core.model.dataclass import dataclass
from cqos_core.model.encoding import decode
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InputError
from cqos_core.model.source import Inserter, Replacement, Source
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from cqos_core.model.finding import Edit
    from cqos_core.model.system import System


@dataclass(frozen=True, slots=True)
class Edited:
    """Texts before and after edits.

    Attributes:
        before: the bytes of every source, by name.
        texts: the new bytes of those that differ.
        left: edits that could not be applied, each with the reason.
    """

    before: Mapping[str, bytes]
    texts: Mapping[str, bytes]
    left: tuple[tuple[Edit, str], ...] = ()

    def diff(self) -> str:
        """Return the changes as a unified diff."""
        return "".join(
            line for name, data in self.texts.items() for line in _diff(name, decode(self.before[name]), decode(data))
        )

    def write(self) -> None:
        """Write every changed text to the file of its name, each whole or not at all.

        Raises:
            ChangedFileError: a file no longer holds what was read of it; none is written.
            OSError: a file cannot be written; it holds what it held before.
        """
        replace_all(self.texts, self.before)


def _diff(name: str, before: str, after: str) -> Iterable[str]:
    for line in difflib.unified_diff(before.splitlines(keepends=True), after.splitlines(keepends=True), name, name):
        yield line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"


def apply_edits(sources: Mapping[str, bytes], edits: Iterable[Edit], importer: str | None = None) -> Edited:
    """Apply edits to texts by the name of their source; ``importer`` reads all of them, if given."""
    edits = list(dict.fromkeys(edits))
    left = [
        (each, f"`{each.place.source}` is none of the inputs") for each in edits if each.place.source not in sources
    ]
    texts = {}
    for name, own in grouped((each.place.source, each) for each in edits).items():
        if name in sources:
            source = Source(name, sources[name])
            made = edited_text(source, own, partial(_inserter, source, importer))
            left += made.left
            if made.data != sources[name]:
                texts[name] = made.data
    return Edited(dict(sources), texts, tuple(left))


def replacements_of(
    sources: Mapping[str, bytes], edits: Iterable[Edit], importer: str | None = None
) -> dict[str, list[Replacement]]:
    """Return the replacements of edits by the name of their source; nothing if one edit cannot be applied."""
    found = {}
    for name, own in grouped((each.place.source, each) for each in edits).items():
        source = Source(name, sources.get(name, b""))
        found[name], left = replacements(source, own, partial(_inserter, source, importer))
        if left or name not in sources:
            return {}
    return found


def _inserter(source: Source, importer: str | None) -> Inserter | None:
    try:
        info = recognise(source, load_plugins(), importer)
    except InputError:
        return None
    return None if info is None else info.load_inserter()


def opened_sources(systems: Iterable[System], edits: Iterable[Edit] = ()) -> dict[str, bytes]:
    """Return the bytes of every file that systems were read from, and of further ones that edits name."""
    found = {name: data for system in systems for name, data in system.sources.items()}
    for name in {edit.place.source: None for edit in edits if edit.place.source not in found}:
        with suppress(InputError):  # `apply_edits` reports a source that is no input
            found[name] = read_path(name).data
    return found
