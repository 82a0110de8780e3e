"""Writes a folder of files: whole, or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from cqos_core.model.problems import InputError, Problem


def write_folder(path: str, files: Mapping[str, str]) -> None:
    """Write a folder with files, by their paths in it.

    Raises:
        InputError: it is there and not empty, or it cannot be written; nothing is left behind.
    """
    target = Path(path)
    try:
        if target.exists() and (not target.is_dir() or any(target.iterdir())):
            raise InputError([Problem("CQ001", f"`{path}` is there and not empty", None, "name a new folder")])
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".cqos-") as scratch:
            made = Path(scratch, "folder")
            for name, text in files.items():
                file = made / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")
            if target.exists():
                target.rmdir()
            shutil.move(os.fspath(made), path)
    except OSError as error:
        message = f"`{path}` cannot be written: {error.strerror or error}"
        raise InputError([Problem("CQ001", message, None, "name another folder with --output")]) from None
