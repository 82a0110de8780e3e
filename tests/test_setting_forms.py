"""The forms that a setting takes on its way through a check are those of docs/how-it-works.md."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "how-it-works.md").read_text(encoding="utf-8")


def listed(*kinds: str) -> set[str]:
    """The classes that the page lists for these files."""
    section = PAGE.partition("## The forms of a setting")[2].partition("\n## ")[0]
    rows = (line for line in section.splitlines() if line.startswith(tuple(f"| {kind} " for kind in kinds)))
    return {name for row in rows for name in re.findall(r"`([\w.]+)`", row)}


@pytest.mark.parametrize("kind", ["yaml", "bpmn"])
def test_a_setting_takes_the_listed_forms_only(kind):
    # In a process of its own: what another test made known would not be made again.
    command = [sys.executable, "-m", "tests.setting_forms", kind]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == listed(kind.upper(), "both")
