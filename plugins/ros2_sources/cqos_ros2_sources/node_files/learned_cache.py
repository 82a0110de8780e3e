"""A cache of learned packages, valid while the bytes of their sources and of those that they depend on are the same."""

from __future__ import annotations

import json
import os
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.files.source_files import read_path
from cqos_core.model.problems import InputError
from cqos_ros2_sources.programs.packages import dependencies
from cqos_ros2_workspace import executables
from cqos_ros2_workspace.executables import files

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_ros2_sources.programs.packages import Parsed
    from cqos_ros2_workspace.launch.workspace import Workspace


_READ: Final = (
    ".cpp",
    ".hpp",
    ".h",
    ".cc",
    ".hh",
    ".cxx",
    ".hxx",
    ".ipp",
    ".inl",
    ".tpp",
    ".c",
    ".ino",
    ".py",
    ".cfg",
    ".txt",
    ".xml",
    ".toml",
    ".yaml",
)
"""Endings of files that may change what is learned."""


@lru_cache(maxsize=1)
def _program() -> bytes:
    """Return a digest of this part of C-QoS: another one may learn something else."""
    digest = sha256()
    for path in (*sorted(Path(__file__).parents[1].rglob("*")), Path(executables.__file__)):
        if path.suffix in {".py", ".yaml"}:
            digest.update(path.read_bytes())
    return digest.digest()


def key_of(package: str, workspace: Workspace, calls: Sequence[str], parsed: Parsed) -> str:
    """Return a digest of all that learning a package reads."""
    digest = sha256(_program())
    for path in calls:
        digest.update(Path(path).read_bytes() if Path(path).is_file() else b"")
    for name in (package, *dependencies(package, workspace)):
        if name not in parsed.digests:
            parsed.digests[name] = _digest(name, workspace)
        digest.update(parsed.digests[name])
    return digest.hexdigest()


def _digest(package: str, workspace: Workspace) -> bytes:
    folder, digest = workspace.packages[package], sha256()
    for path in files(package, workspace):
        if not path.endswith(_READ):
            continue
        data = workspace.read(path, None)
        content = data if isinstance(data, bytes) else data.cause.encode()
        digest.update(f"{package}\0{os.path.relpath(path, folder)}\0{len(content)}\0".encode("utf-8", "replace"))
        digest.update(content)
    return digest.digest()


def kept(package: str, folder: str, key: str) -> dict[str, Any] | None:
    """Return what was learned of a package, where it still holds."""
    try:
        found = json.loads(read_path(str(_file(package, folder))).data)
    except (InputError, ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) and found.get("key") == key else None


def keep(package: str, folder: str, key: str, found: dict[str, Any]) -> None:
    """Keep what was learned of a package; where nothing can be written, it is learned again next time."""
    path = _file(package, folder)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.with_suffix(f".{os.getpid()}")
        draft.write_bytes(json.dumps({"key": key, **found}).encode())
        draft.replace(path)
    except (OSError, ValueError):
        return


def _file(package: str, folder: str) -> Path:
    place = sha256(os.path.realpath(folder).encode("utf-8", "surrogateescape")).hexdigest()[:16]
    base = os.environ.get("XDG_CACHE_HOME")
    home = Path(base) if base else Path("~/.cache").expanduser()
    return home / "cqos" / "learned" / f"{place}-{package}.json"
