"""State of `cqos modeler` between its runs, in a folder that only its user can read: drafts, and the secret of its keys."""

from __future__ import annotations

import hashlib
import hmac
import json
import os
import re
from pathlib import Path
from typing import Any, Final

from cqos_core.files.atomic_writes import write_whole
from cqos_core.service.settings import new_key

MOST_DRAFTS: Final = 50
"""The oldest draft is removed when there are more."""
_SECRET_LENGTH: Final = 32
_TAB: Final = re.compile(r"[a-z0-9-]{1,64}")


def state_folder() -> Path:
    """Return the folder; it need not exist."""
    base = os.environ.get("XDG_STATE_HOME") or (os.environ.get("LOCALAPPDATA") if os.name == "nt" else None)
    return (Path(base) if base else Path.home() / ".local" / "state") / "cqos"


def user_secret() -> str:
    """Return the secret of this user, from which the keys of all runs are made. It stays on this machine.

    Raises:
        OSError: the folder cannot be written.
    """
    file = _private(state_folder()) / "modeler.key"
    secret = file.read_text(encoding="ascii", errors="replace") if file.exists() else ""
    if len(secret) < _SECRET_LENGTH:  # a broken file would make keys that can be guessed
        secret = new_key()
        file.touch(mode=0o600)
        write_whole(str(file), secret.encode("ascii"))
    return secret


def port_secret(secret: str, port: int) -> str:
    """Return the secret that a page at a port keeps, to make the key of the next run there.

    The page never sends it, because another program may have the port by then.
    """
    return _sum(secret, f"port {port}")


def run_key(resume: str, nonce: str) -> str:
    """Return the key of a run, from `port_secret` and its nonce; the nonce is no secret."""
    return _sum(resume, nonce)


def _sum(key: str, text: str) -> str:
    return hmac.new(key.encode(), text.encode(), hashlib.sha256).hexdigest()


class Drafts:
    """Unsaved diagrams, one JSON file for each tab of a browser.

    A draft belongs to a file by its real path. A diagram that is in no file belongs to the folder in which the modeler runs.
    """

    def __init__(self, named: tuple[str, ...]) -> None:
        """Keep drafts of a run with these files."""
        self._run = new_key()
        self._folder = state_folder() / "drafts"
        self._files = [os.path.realpath(each) for each in named]
        self._here = str(Path.cwd().resolve())

    def earlier(self) -> list[dict[str, Any]]:
        """Return the drafts of earlier runs with these files, newest first; `file` is the number of the file, or None."""
        found = []
        for path in self._paths():
            draft = _read(path)
            if draft is None or draft.pop("run") == self._run:
                continue
            file, folder = draft.pop("path"), draft.pop("folder")
            if file in self._files:
                found.append({**draft, "tab": path.stem, "file": self._files.index(file)})
            elif file is None and folder == self._here:
                found.append({**draft, "tab": path.stem, "file": None})
        return found

    def keep(self, tab: str, content: dict[str, Any]) -> None:
        """Keep a draft in place of the earlier one of this tab.

        Raises:
            OSError: it cannot be written.
            ValueError: `content` or the name of the tab has another form.
        """
        number = content.pop("file")
        if number is not None and not 0 <= number < len(self._files):
            raise ValueError("`cqos modeler` was started without this file")
        path = self._path(tab)
        whose = {"run": self._run, "path": None if number is None else self._files[number], "folder": self._here}
        _private(self._folder)
        path.touch(mode=0o600)
        write_whole(str(path), json.dumps({**content, **whose}).encode())
        for each in self._paths()[MOST_DRAFTS:]:
            each.unlink(missing_ok=True)

    def forget(self, tab: str) -> None:
        """Remove the draft of a tab, if there is one.

        Raises:
            OSError: it cannot be removed.
            ValueError: the name of the tab has another form.
        """
        self._path(tab).unlink(missing_ok=True)

    def _path(self, tab: str) -> Path:
        if not _TAB.fullmatch(tab):
            raise ValueError("the name of a tab has the letters a to z, digits and `-`")
        return self._folder / f"{tab}.json"

    def _paths(self) -> list[Path]:
        """Return the files, newest first."""
        times = {}
        for path in self._folder.glob("*.json"):
            try:
                times[path] = path.stat().st_mtime_ns
            except FileNotFoundError:  # another run removed it
                continue
        return sorted(times, key=lambda path: times[path], reverse=True)


def _read(path: Path) -> dict[str, Any] | None:
    """Return a draft, or None for a file that another run removed, or that no modeler wrote."""
    try:
        content = json.loads(path.read_bytes())
    except (FileNotFoundError, ValueError):
        return None
    return content if isinstance(content, dict) and {"run", "path", "folder"} <= content.keys() else None


def _private(folder: Path) -> Path:
    """Make a folder that only the user can open."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.chmod(0o700)
    return folder
