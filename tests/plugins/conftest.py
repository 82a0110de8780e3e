"""Runs the command in processes of their own, where plugins come from a folder on the path."""

import os
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.command_process import run

UNWANTED = {"NO_COLOR", "COLUMNS", "CQOS_DEBUG", "CQOS_LOAD_PLUGINS", "PYTHONPATH"}


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
        return run(arguments, self.folder, kept | {"PYTHONPATH": str(self.site)} | environ)


@pytest.fixture
def cqos(tmp_path, site):
    """What runs the command, in an empty folder."""
    folder = tmp_path / "work"
    folder.mkdir()
    return Runner(folder, site)
