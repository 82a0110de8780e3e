"""The plugin of bpmnlint, run by bpmnlint itself against a running service."""

import contextlib
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PLUGIN = ROOT / "modeler" / "bpmnlint-plugin-cqos"
EXAMPLES = ROOT / "examples"


@pytest.fixture
def lint(service, kept, tmp_path):
    """Return a function that lints one model with rules, and returns exit code and output."""
    if not (shutil.which("npm") and shutil.which("node")):
        if os.environ.get("CI") == "true":
            pytest.fail("npm is missing")
        pytest.skip("npm is missing")
    here = kept("bpmnlint", (PLUGIN / "package-lock.json").read_text(encoding="utf-8"))
    if not (here / "node_modules").exists():
        made = tmp_path / "made"
        shutil.copytree(PLUGIN, made, ignore=shutil.ignore_patterns("node_modules"))
        subprocess.run(["npm", "ci", "--ignore-scripts"], cwd=made, check=True, capture_output=True, timeout=180)
        with contextlib.suppress(OSError):  # another process of the tests was first
            shutil.move(made / "node_modules", here / "node_modules")
    folder = tmp_path / "node_modules" / "bpmnlint-plugin-cqos"
    shutil.copytree(PLUGIN, folder, ignore=shutil.ignore_patterns("node_modules"))
    (folder / "node_modules").symlink_to(here / "node_modules")
    (tmp_path / "package.json").write_text("{}", encoding="utf-8")

    def run(model, rules, address=service.web):
        configured = {"extends": [rules]} if isinstance(rules, str) else {"rules": rules}
        (tmp_path / ".bpmnlintrc").write_text(json.dumps(configured), encoding="utf-8")
        shutil.copy(model, tmp_path / "model.bpmn")
        done = subprocess.run(
            ["node", folder / "node_modules" / "bpmnlint" / "bin" / "bpmnlint.js", "model.bpmn"],
            cwd=tmp_path,
            env={**os.environ, "CQOS_SERVICE": address},
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
        return done.returncode, (done.stdout + done.stderr).strip()

    return run


def test_the_paper_s_example_has_warnings_about_its_timer_only(lint):
    code, said = lint(EXAMPLES / "smart_agriculture.bpmn", "plugin:cqos/recommended")
    assert code == 0
    reported = {(line.split()[0], line.rpartition("(")[2][:5]) for line in said.splitlines() if "(BP" in line}
    throws, catches = ("Drone_ThrowReq", "Station_ThrowResp"), ("Station_CatchReq", "Drone_CatchResp")
    timer = {("Drone_Start", "BP101"), ("Drone_Start", "BP102")}
    assert reported == {*((each, "BP101") for each in throws), *((each, "BP102") for each in catches)} | timer
    assert said.count(" warning ") == said.count("(BP10")
    assert lint(EXAMPLES / "smart_agriculture.bpmn", {"cqos/warning": ["warn", {"ignore": ["BP101", "BP102"]}]}) == (
        0,
        "",
    )


def test_the_incompatible_pair_is_reported_at_both_events(lint):
    code, said = lint(EXAMPLES / "smart_agriculture_incompatible.bpmn", "plugin:cqos/recommended")
    reported = [line.split() for line in said.splitlines() if line.startswith("  ")]
    assert code == 1
    assert {(words[0], word) for words in reported for word in words if word.startswith("(ROS")} == {
        (event, code) for event in ("Drone_ThrowReq", "Station_CatchReq") for code in ("(ROS101)", "(ROS104)")
    }


def test_a_rule_takes_codes_to_report_and_to_ignore(lint):
    model = EXAMPLES / "smart_agriculture_incompatible.bpmn"
    assert "ROS104" not in lint(model, {"cqos/error": ["error", {"only": ["ROS101"]}]})[1]
    assert lint(model, {"cqos/error": ["error", {"ignore": ["ROS101", "ROS104"]}]}) == (0, "")


def test_notes_are_reported_on_request(lint):
    code, said = lint(EXAMPLES / "smart_agriculture.bpmn", "plugin:cqos/all")
    assert code == 0
    assert said.count(" info ") == 7  # six notes, one of them at both ends of a pair


def test_a_service_that_does_not_answer_is_an_error(lint):
    code, said = lint(EXAMPLES / "smart_agriculture.bpmn", "plugin:cqos/recommended", "http://127.0.0.1:9")
    assert code == 1
    assert "not checked: C-QoS at http://127.0.0.1:9: no answer" in said


def test_a_model_that_the_service_refuses_is_an_error(lint):
    code, said = lint(EXAMPLES / "smart_agriculture.bpmn", {"cqos/error": ["error", {"protocol": "telegraph"}]})
    assert code == 1
    assert "there is no rule pack `telegraph`" in said
