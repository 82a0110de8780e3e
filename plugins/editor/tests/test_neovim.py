"""Neovim with the settings of docs/editors.md: it shows findings, hovers, completes, and applies a fix."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "editors.md").read_text(encoding="utf-8")
DESIGN = """\
cqos: 1
protocol: ros2
participants:
  a: {publishes: {/scan: {reliability: best_effort}}}
  b: {subscribes: {/scan: {reliability: reliable}}}
"""
SCRIPT = Path(__file__).with_name("try.lua")


def snippet(language):
    """Return the first block of a language in the page."""
    return re.search(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)[1]


@pytest.mark.skipif(
    shutil.which("nvim") is None and not os.environ.get("CI"), reason="Neovim is not installed (apt-get install neovim)"
)
def test_neovim_shows_findings_hovers_completes_and_applies_a_fix(tmp_path):
    (tmp_path / "settings.lua").write_text(snippet("lua"))
    (tmp_path / "design.yaml").write_text(DESIGN)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["nvim", "--clean", "--headless", "-c", f"luafile {SCRIPT}"],
        cwd=tmp_path,
        env=os.environ | {"PATH": path, "XDG_STATE_HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=150,
        stdin=subprocess.DEVNULL,
        check=False,
    )
    assert (tmp_path / "said.json").exists(), done.stdout + done.stderr
    said = json.loads((tmp_path / "said.json").read_text())
    [[code, line, column, message]] = said["findings"]
    assert (code, line, column) == ("ROS101", 4, 40)
    assert "offers reliability best_effort" in message
    assert "**reliability** (ROS 2)" in said["hover"]
    assert "reliable" in said["completed"]
    assert said["actions"][0] == "ROS101: offer reliability `reliable` on a/publisher/scan"
    assert "\n".join(said["text"]) + "\n" == DESIGN.replace("best_effort", "reliable")
    assert said["waited"] is True
