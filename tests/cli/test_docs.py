"""The docs that are derived are up to date."""

import re
import subprocess
import sys
from pathlib import Path

from cqos_core.plugins import load_plugins

ROOT = Path(__file__).resolve().parents[2]


def test_derived_docs_do_not_drift():
    # Pages of rules are not in git: what builds the site makes them, and ends if no case of a rule makes a system that reports it.
    command = [sys.executable, str(ROOT / "docs" / "generate.py"), "--kept", "--check"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_every_command_of_ours_is_documented():
    text = (ROOT / "docs" / "command.md").read_text(encoding="utf-8")
    ours = [name for name, info in load_plugins().commands.items() if info.command.startswith("cqos_core.")]
    documented = re.findall(r"<!-- help: cqos ([\w-]+) -->", text)
    assert [name for name in documented if name in ours] == ours
