"""Runs the installed command in processes of their own, where plugins come from a folder on the path."""

import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

COMMAND = Path(sys.executable).with_name("cqos")
UNWANTED = {"NO_COLOR", "COLUMNS", "CQOS_DEBUG", "CQOS_LOAD_PLUGINS", "PYTHONPATH"}


class Done(NamedTuple):
    """How a run ended."""

    code: int
    out: str
    err: str


@pytest.fixture
def site(tmp_path):
    """An empty folder for plugins."""
    folder = tmp_path / "site"
    folder.mkdir()
    return folder


class Runner(NamedTuple):
    """Runs the command in ``folder``, with the plugins of ``site``."""

    folder: Path
    site: Path

    def __call__(self, *arguments, **environ):
        kept = {name: value for name, value in os.environ.items() if name not in UNWANTED}
        done = subprocess.run(
            [COMMAND, *map(str, arguments)],
            cwd=self.folder,
            env=kept | {"PYTHONPATH": str(self.site), "PYTHONDONTWRITEBYTECODE": "1"} | environ,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=False,
            timeout=60,
        )
        return Done(done.returncode, done.stdout.decode(), done.stderr.decode())


@pytest.fixture
def cqos(tmp_path, site):
    """What runs the command, in an empty folder."""
    folder = tmp_path / "work"
    folder.mkdir()
    return Runner(folder, site)
