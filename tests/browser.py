"""What tests of pages share: how Chromium starts, how long it may take, what a missing one means."""

from __future__ import annotations

import os
from typing import NoReturn

import pytest

FLAGS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
WAIT = 90_000
"""Milliseconds: other tests take most of the machine meanwhile."""


def missing(what: str) -> NoReturn:
    """A missing component is a skip on a laptop, and a failure where CI runs."""
    if os.environ.get("CI") == "true":
        pytest.fail(f"{what} is missing")
    pytest.skip(f"{what} is missing")
