"""Runs the command: in this process where that makes no difference, else as a user does."""

import io
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cqos_core.cli import main
from tests import command_process
from tests.command_process import Done

COMMAND = Path(sys.executable).with_name("cqos")
CASES = Path(__file__).with_name("cases")


def environment(**changes):
    """The environment of a run: nothing in it that changes how text looks."""
    left = {
        name: value
        for name, value in os.environ.items()
        if name not in {"NO_COLOR", "FORCE_COLOR", "COLUMNS", "CQOS_DEBUG"}
    }
    return left | changes


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder to run in, with a file of every kind."""
    monkeypatch.chdir(tmp_path)
    for case in CASES.iterdir():
        shutil.copy(case, tmp_path)
    return tmp_path


@pytest.fixture
def cqos(files, capfd, monkeypatch):
    """Run the command in this process."""

    def run(*arguments, stdin=None):
        if stdin is not None:
            monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        capfd.readouterr()
        code = main([str(argument) for argument in arguments])
        done = capfd.readouterr()
        return Done(code, done.out, done.err)

    return run


@pytest.fixture
def forked(files):
    """Run the command in a process of its own, without its start."""

    def run(*arguments, stdin="", **environ):
        return command_process.run(arguments, files, environment(**environ), stdin.encode())

    return run


@pytest.fixture
def real(files):
    """Run the installed command in a process of its own."""

    def run(*arguments, stdin="", **environ):
        done = subprocess.run(
            [COMMAND, *map(str, arguments)],
            cwd=files,
            env=environment(**environ),
            input=stdin.encode(),
            capture_output=True,
            check=False,
            timeout=60,
        )
        return Done(done.returncode, done.stdout.decode(), done.stderr.decode())

    return run
