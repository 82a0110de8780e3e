"""Tests of repairs need the solver; a laptop may lack it, CI may not."""

import importlib.util
import os

import pytest

from tests.cli.conftest import cqos, files

__all__ = ["cqos", "files"]


@pytest.fixture(scope="session")
def solver():
    if importlib.util.find_spec("ortools") is None and os.environ.get("CI") != "true":
        pytest.skip("OR-tools is not installed: pip install ./plugins/planning")
