"""The command, in a folder with a file of every kind."""

from tests.cli.conftest import cqos, files

__all__ = ["cqos", "files"]
