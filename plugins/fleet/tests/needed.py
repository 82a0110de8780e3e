"""What the tests of columns need: without it they are skipped on a laptop, and fail in CI."""

from __future__ import annotations

import importlib
import importlib.util
import os
import shutil
from typing import Any

import pytest


def needed(name: str, *, program: bool = False) -> Any:
    """Return a module, or the path of a program."""
    found = shutil.which(name) if program else importlib.util.find_spec(name)
    if found is None and os.environ.get("CI") != "true":
        pytest.skip(f"{name} is not installed")
    assert found is not None, f"{name} is not installed"
    return found if program else importlib.import_module(name)
