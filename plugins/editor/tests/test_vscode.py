"""The extension for VS Code: its settings are those of the server, its types hold, and it can be bundled."""

import json
import os
import shutil
import subprocess
from dataclasses import fields
from pathlib import Path

import pytest

from cqos_lsp.server import Settings

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "editors" / "vscode"
MANIFEST = json.loads((FOLDER / "package.json").read_text(encoding="utf-8"))
DECLARED = MANIFEST["contributes"]["configuration"]["properties"]


def test_its_settings_are_those_of_the_server():
    own = {f"cqos.{each.name}": each.default for each in fields(Settings)}
    assert {name: about["default"] for name, about in DECLARED.items() if name != "cqos.command"} == own
    assert all(Settings.of({"cqos": {"hints": value}}).hints == value for value in DECLARED["cqos.hints"]["enum"])
    assert Settings.of({"hints": "some", "notes": 1}) == Settings.of(None) == Settings()
    page = (ROOT / "docs" / "editors.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in DECLARED)


def test_its_manifest_starts_the_command():
    assert DECLARED["cqos.command"]["default"] == ["cqos", "lsp"]
    assert MANIFEST["main"] == "./dist/extension.js"
    assert MANIFEST["license"] == "Apache-2.0"
    assert all(
        name in ["name", "displayName", "version", "publisher", "engines", "main", "contributes"] or MANIFEST[name]
        for name in MANIFEST
    )


@pytest.mark.skipif(shutil.which("npm") is None and not os.environ.get("CI"), reason="npm is not installed")
def test_its_types_hold_and_it_can_be_bundled(tmp_path):
    def npm(*arguments):
        done = subprocess.run(["npm", *arguments], cwd=FOLDER, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr

    if not (FOLDER / "node_modules" / "vscode-languageclient").is_dir():
        npm("ci", "--no-audit", "--no-fund", "--prefer-offline")
    npm("run", "check")
    npm("run", "bundle", "--", f"--outfile={tmp_path / 'extension.js'}")
    assert "activate" in (tmp_path / "extension.js").read_text(encoding="utf-8")
