"""What installed distributions say of themselves, as far as a start of the command needs it.

`importlib.metadata` has all of this. It imports the parser of mail messages and that of archives: with what it reads, 35 ms
at each start. This module reads the same files. What is unusual is left to `importlib.metadata`: archives, eggs, other
finders, and distributions that are not ours.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.machinery import PathFinder
from typing import Any, Final, NamedTuple

AUTHORS: Final = "the C-QoS authors"
"""The author of the distributions of C-QoS."""
_FOLDERS: Final = (".dist-info", ".egg-info")


class UnusualError(Exception):
    """Something is installed that only `importlib.metadata` reads."""


class Headers(NamedTuple):
    """The lines about a distribution, as `importlib.metadata` gives them."""

    lines: tuple[tuple[str, str], ...]

    def get_all(self, name: str) -> list[str] | None:
        """Return the values of all lines of a name; None where there is no such line."""
        return [value for key, value in self.lines if key == name.lower()] or None

    def __getitem__(self, name: Any) -> Any:
        """Return the value of the first line of a name; None where there is no such line."""
        return next(iter(self.get_all(name) or ()), None)


class InstalledDistribution(NamedTuple):
    """One of our distributions."""

    metadata: Headers


class InstalledEntry(NamedTuple):
    """An entry point of one of our distributions."""

    name: str
    value: str
    dist: InstalledDistribution

    def load(self) -> Any:
        """Import the module that it names."""
        return importlib.import_module(self.value)


def entry_points(group: str) -> Sequence[Any]:
    """Return the entry points of a group, of all installed distributions."""
    try:
        return _entries(group)
    except UnusualError:
        from importlib.metadata import entry_points as every

        return [*every(group=group)]


def headers(distribution: str) -> Any:
    """Return the lines about one of our distributions: ``headers("cqos-core")["Version"]``."""
    try:
        return _headers(_folders()[_normalised(distribution)])
    except (UnusualError, KeyError):
        from importlib.metadata import metadata

        return metadata(distribution)


def _entries(group: str) -> list[InstalledEntry]:
    found = []
    for folder in _folders().values():
        text = _read(folder, "entry_points.txt")
        if f"[{group}]" not in text:
            continue
        distribution = InstalledDistribution(_headers(folder))
        for name, value in _of_group(text, group):
            if not all(map(str.isidentifier, value.split("."))):
                raise UnusualError
            found.append(InstalledEntry(name, value, distribution))
    return found


def _of_group(text: str, group: str) -> Iterator[tuple[str, str]]:
    within = False
    for line in map(str.strip, text.splitlines()):
        if line.startswith("[") and line.endswith("]"):
            within = line.strip("[]") == group
        elif within and line and not line.startswith("#"):
            name, _, value = line.partition("=")
            yield name.strip(), value.strip()


def _folders() -> dict[str, str]:
    """Return where each distribution is installed, by name; the first on the path wins."""
    return _folders_on(tuple(sys.path))


@cache
def _folders_on(paths: tuple[str, ...]) -> dict[str, str]:
    if any(hasattr(finder, "find_distributions") for finder in sys.meta_path if finder is not PathFinder):
        raise UnusualError
    found: dict[str, str] = {}
    for path in paths:
        try:
            children = os.listdir(path or ".")  # noqa: PTH208
        except OSError:
            if os.path.exists(path):  # noqa: PTH110 - text; an archive, perhaps
                raise UnusualError from None
            continue
        if path.lower().endswith(".egg"):
            raise UnusualError
        for child in children:
            stem, ending = os.path.splitext(child.lower())  # noqa: PTH122
            if ending in _FOLDERS:
                found.setdefault(_normalised(stem.partition("-")[0]), os.path.join(path, child))  # noqa: PTH118
    return found


def _normalised(name: str) -> str:
    name = name.replace("-", "_").replace(".", "_").lower()
    while "__" in name:
        name = name.replace("__", "_")
    return name


def _headers(folder: str) -> Headers:
    """Read the lines about one of our distributions.

    Raises:
        UnusualError: it is none of ours.
    """
    head = (_read(folder, "METADATA") or _read(folder, "PKG-INFO")).partition("\n\n")[0]
    lines = (line.partition(":") for line in head.splitlines() if not line[:1].isspace())
    found = Headers(tuple((name.lower(), value.strip()) for name, _, value in lines))
    if AUTHORS not in (found.get_all("Author") or ()):
        raise UnusualError
    return found


def _read(folder: str, name: str) -> str:
    try:
        with open(os.path.join(folder, name), encoding="utf-8") as file:  # noqa: PTH118, PTH123 - pathlib takes twice as long
            return file.read()
    except UnicodeDecodeError:
        raise UnusualError from None
    except OSError:
        return ""


def normalised(distribution: str) -> str:
    """Spell the name of a distribution as all its spellings are compared."""
    return _normalised(distribution.strip()).replace("_", "-")
