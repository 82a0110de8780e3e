"""Settings for all tests: hypothesis profiles, and the option of the soak."""

from __future__ import annotations

import gc
import os
import sys
from typing import TYPE_CHECKING

from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    import pytest

if sys.version_info < (3, 11):
    import tomli

    sys.modules["tomllib"] = tomli  # the tests read the files of the project with it

# No deadline: how long one example takes says nothing here, machines differ and coverage doubles it.
settings.register_profile("base", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True)
# The tests give the same answer every time; `dev.py explore` looks for new examples, and what it finds becomes a case.
settings.register_profile("fixed", parent=settings.get_profile("base"), derandomize=True, max_examples=24)
settings.register_profile("explore", parent=settings.get_profile("base"), max_examples=2_000)
settings.load_profile(os.environ.get("CQOS_HYPOTHESIS", "fixed"))


def pytest_collection_finish() -> None:
    """Leave what the tests are made of out of every later collection of garbage: it stays until the end."""
    gc.freeze()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add our options."""
    parser.addoption("--soak", type=float, default=2.0, help="seconds that the service is kept under mixed load")
