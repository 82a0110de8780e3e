"""Features that are not in every installation, and the command that installs each.

``optional_features.json`` is the table: a feature, its distribution, the folder of that in a clone, its extra, the Pythons that it runs on, and
the commands, formats and other names that it brings. The line is for the place that C-QoS was installed from: a clone, a folder of
wheels, a git address, or a package index. Nothing imports this module until something is missing.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import field
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
        brings: names that plugins register, by kind (``commands``, ``formatters``, …), and ``options`` of commands.
    """

    name: str
    distribution: str
    folder: str
    extra: str = ""
    oldest: str = ""
    newest: str = ""
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
    return install_line(feature, origin())


def _version(text: str) -> tuple[int, ...]:
    return tuple(map(int, text.split(".")))


def origin() -> Mapping[str, Any]:
    """Return where the core was installed from, as pip has recorded it (PEP 610); empty: from an index."""
    try:
        return json.loads(distribution(_CORE).read_text("direct_url.json") or "{}")  # type: ignore[no-any-return]
    except PackageNotFoundError:  # it runs from its files
        return {}


def install_line(feature: Feature, place: Mapping[str, Any]) -> str:
    """Return the command that adds a feature where C-QoS was installed from a place."""
    extra = f"[{feature.extra}]" if feature.extra else ""
    named = f"{_WHOLE}{extra}" if extra else feature.distribution
    address = place.get("url", "")
    if revision := place.get("vcs_info"):
        folder = "" if feature.folder == "." else f"#subdirectory={feature.folder}"
        at = f"{revision['vcs']}+{address}@{revision['commit_id']}"
        return _pip(f"{feature.distribution}{extra} @ {at}{folder}")
    if not address.startswith("file:"):
        return _pip(named)
    path = Path(url2pathname(urlsplit(address).path))
    if "dir_info" not in place:
        return _pip("--find-links", str(path.parent), named)
    project = path / feature.folder
    editable = ("-e",) if place["dir_info"].get("editable") else ()
    if not (project / "pyproject.toml").is_file():
        return f"in a clone of C-QoS ({path} is none any more): {_pip(f'./{feature.folder}{extra}')}"
    if path == Path.cwd():
        return _pip(*editable, f"{feature.folder if feature.folder == '.' else f'./{feature.folder}'}{extra}")
    return _pip(*editable, f"{project}{extra}")


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
