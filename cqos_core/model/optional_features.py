"""Features that are not in every installation, and the command that installs each.

``optional_features.json`` is the table: a feature, its distribution, the folder of that in a clone, its extra, the Pythons that it runs
on, the features whose distributions it needs beside the core, and the commands, formats and other names that it brings. The line is for
the place that C-QoS was installed from: a clone, a folder of wheels, a git address, or a package index. Nothing imports this module until
something is missing, or a folder is searched.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import field
from fnmatch import fnmatch
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit
from urllib.request import url2pathname

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import MissingError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_CORE: Final = "cqos-core"
_WHOLE: Final = "cqos"
"""The distribution that has the extras of all others."""


@dataclass(frozen=True, slots=True)
class Feature:
    """One optional feature: a row of the table.

    Attributes:
        name: what code calls it.
        distribution: what brings it.
        folder: where that is in a clone.
        extra: of the distribution; empty: none is needed.
        oldest: version of Python that it runs on; empty: as C-QoS itself.
        newest: version of Python that it runs on; empty: any.
        needs: the features whose distributions its own needs, beside the core.
        brings: names that plugins register, by kind (``commands``, ``formatters``, …), ``options`` of commands, and patterns of names of
            ``files`` that are not read without it, although they say what runs.
    """

    name: str
    distribution: str
    folder: str
    extra: str = ""
    oldest: str = ""
    newest: str = ""
    needs: Sequence[str] = ()
    brings: Mapping[str, Sequence[str]] = field(default_factory=dict)


@cache
def features() -> dict[str, Feature]:
    """Return the table, by name."""
    rows = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
    return {row["name"]: Feature(**row) for row in rows}


def absent(kind: str) -> dict[str, Feature]:
    """Return the names of a kind that distributions bring which are not installed, each with its feature."""
    rows = [row for row in features().values() if kind in row.brings and not _is_installed(row.distribution)]
    return {name: row for row in rows for name in row.brings[kind]}


def unread_files(paths: Sequence[str]) -> dict[str, Feature]:
    """Return the first of some paths that each distribution would read which is not installed, although what it needs is."""
    found: dict[str, Feature] = {}
    for row in {row.name: row for row in absent("files").values()}.values():
        if all(_is_installed(features()[each].distribution) for each in row.needs):
            own = (path for path in paths if any(fnmatch(path, each) for each in row.brings["files"]))
            found |= dict.fromkeys(sorted(own)[:1], row)
    return found


def missing(name: str, what: str) -> MissingError:
    """Return the error that something needs a feature: ``what`` it is, and the line that adds it."""
    return MissingError(what, advice(name))


def advice(name: str) -> str:
    """Return the line that adds a feature to this installation, or what else it takes."""
    feature, version = features()[name], sys.version_info[:2]
    here = f"this is Python {version[0]}.{version[1]}"
    if feature.oldest and version < _version(feature.oldest):
        return f"use Python {feature.oldest} or newer; {here}"
    if feature.newest and version > _version(feature.newest):
        return f"use Python {feature.newest} or older; {here}"
    needed = [features()[each] for each in feature.needs]
    return install_line(feature, origin(), [each for each in needed if not _is_installed(each.distribution)])


def _version(text: str) -> tuple[int, ...]:
    return tuple(map(int, text.split(".")))


def origin() -> Mapping[str, Any]:
    """Return where the core was installed from, as pip has recorded it (PEP 610); empty: from an index."""
    try:
        return json.loads(distribution(_CORE).read_text("direct_url.json") or "{}")  # type: ignore[no-any-return]
    except PackageNotFoundError:  # it runs from its files
        return {}


def install_line(feature: Feature, place: Mapping[str, Any], needed: Sequence[Feature] = ()) -> str:
    """Return the command that adds a feature where C-QoS was installed from a place, and what it needs that an index does not have."""
    extra = _extra(feature)
    named = f"{_WHOLE}{extra}" if extra else feature.distribution
    address, every = place.get("url", ""), (*needed, feature)
    if revision := place.get("vcs_info"):
        at = f"{revision['vcs']}+{address}@{revision['commit_id']}"
        folders = ("" if each.folder == "." else f"#subdirectory={each.folder}" for each in every)
        return _pip(
            *(f"{each.distribution}{_extra(each)} @ {at}{end}" for each, end in zip(every, folders, strict=True))
        )
    if not address.startswith("file:"):
        return _pip(named)
    path = Path(url2pathname(urlsplit(address).path))
    if "dir_info" not in place:
        return _pip("--find-links", str(path.parent), named)
    editable = ("-e",) if place["dir_info"].get("editable") else ()
    near = [f"{each.folder if each.folder == '.' else f'./{each.folder}'}{_extra(each)}" for each in every]
    if not (path / feature.folder / "pyproject.toml").is_file():
        return f"in a clone of C-QoS ({path} is none any more): {_pip(*near)}"
    targets = near if path == Path.cwd() else [f"{path / each.folder}{_extra(each)}" for each in every]
    return _pip(*(word for target in targets for word in (*editable, target)))


def _extra(feature: Feature) -> str:
    return f"[{feature.extra}]" if feature.extra else ""


def _pip(*arguments: str) -> str:
    """Return the command that installs into this Python: ``pip``, where that is the pip of this Python."""
    python = sys.executable or "python"
    beside = shutil.which("pip")
    if beside is not None and Path(beside).parent == Path(python).parent:
        program = ["pip", "install"]
    elif find_spec("pip") is None and shutil.which("uv"):
        program = ["uv", "pip", "install", "--python", python]
    else:
        program = [python, "-m", "pip", "install"]
    words = [*program, *arguments]
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


def _is_installed(name: str) -> bool:
    try:
        distribution(name)
    except PackageNotFoundError:
        return False
    return True
