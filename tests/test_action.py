"""The steps of `action.yml`, run as a runner of GitHub runs them; the installation is that of this test run. And the hook of pre-commit."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from cqos_core.model.optional_features import features
from cqos_core.plugins import load_plugins

ROOT = Path(__file__).resolve().parents[1]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS = {step.get("name", step.get("uses")): step for step in ACTION["runs"]["steps"]}


@pytest.fixture
def work(tmp_path):
    """A folder with both examples of the paper."""
    folder = tmp_path / "work"
    folder.mkdir()
    for name in ("smart_agriculture.yaml", "smart_agriculture_incompatible.bpmn"):
        shutil.copy(ROOT / "examples" / name, folder)
    return folder


@pytest.fixture
def act(tmp_path, work):
    """Run a step with inputs in that folder; code, output, the summary."""
    summary = tmp_path / "summary.md"

    def run(name, **inputs):
        step = STEPS[name]
        known = {key: value["default"] for key, value in ACTION["inputs"].items()} | inputs
        given = {
            key: re.sub(r"\$\{\{ inputs\.([\w-]+) \}\}", lambda found: known[found[1]], text)
            for key, text in step.get("env", {}).items()
        }
        around = {
            "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
            "GITHUB_STEP_SUMMARY": str(summary),
            "RUNNER_TEMP": str(tmp_path),
            "GITHUB_ACTION_PATH": str(ROOT),
        }
        command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
        done = subprocess.run(command, cwd=work, env=around | given, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, summary.read_text(encoding="utf-8") if summary.exists() else ""

    return run


def test_findings_are_annotations_rows_of_the_summary_and_results(act, work):
    code, out, summary = act("Check", sarif="cqos.sarif")
    assert code == 1
    assert out.count("::error file=smart_agriculture_incompatible.bpmn,line=") == 2
    assert summary.count("| error ROS10") == 2
    results = json.loads((work / "cqos.sarif").read_text(encoding="utf-8"))["runs"][0]["results"]
    assert {"ROS101", "ROS104"} <= {result["ruleId"] for result in results}


def test_a_design_that_fits_ends_well(act, work):
    code, _, summary = act("Check", paths="smart_agriculture.yaml", arguments="--fail-on warning --no-config")
    assert code == 0
    assert "**compatible**" in summary
    assert not (work / "cqos.sarif").exists()


def test_inputs_are_never_run(act, work):
    code, _, _ = act("Check", paths="$(touch owned) `touch owned`; touch owned")
    assert code == 2
    assert not (work / "owned").exists()


def test_a_file_that_cannot_be_read_is_an_annotation_and_ends_with_2(act, work):
    (work / "broken.yaml").write_text("cqos: 1\nparticipants: [", encoding="utf-8")
    code, out, _ = act("Check")
    assert code == 2
    assert "file=broken.yaml" in out


def test_the_code_scanning_step_takes_the_file_that_the_check_writes():
    upload = STEPS["Upload to code scanning"]
    assert upload["with"]["sarif_file"] == STEPS["Check"]["env"]["SARIF"] == "${{ inputs.sarif }}"
    assert "inputs.sarif != ''" in upload["if"]


def test_the_hook_of_pre_commit_sees_files_of_every_format_and_brings_every_reader():
    [hook] = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    for importer in load_plugins().importers.values():
        for suffix in importer.suffixes:
            assert re.search(hook["files"], f"folder/name{suffix}"), f"{importer.name}: {suffix}"
    readers = {row.folder for row in features().values() if "importers" in row.brings}
    sources = features()["ros2_sources"].folder  # which a check of a workspace calls
    assert {*hook["additional_dependencies"]} == {f"./{folder}" for folder in (*readers, sources)}


@pytest.mark.skipif(
    importlib.util.find_spec("pre_commit") is None and os.environ.get("CI") != "true", reason="pre-commit is missing"
)
def test_pre_commit_runs_the_hook_on_the_whole_folder_when_a_design_changes(tmp_path, work):
    """The hook as it is published, with the C-QoS of this test run in place of one that pre-commit installs."""
    [hook] = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    del hook["additional_dependencies"]
    config = {"repos": [{"repo": "local", "hooks": [hook | {"language": "system"}]}]}
    (work / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    around = {
        "PATH": path,
        "HOME": str(tmp_path),
        "PRE_COMMIT_HOME": str(tmp_path / "cache"),
        "GIT_CONFIG_NOSYSTEM": "1",
    }

    def do(*command):
        done = subprocess.run(command, cwd=work, env=around, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def commit(name):
        assert do("git", "add", name)[0] == 0
        return do("git", "-c", "user.name=a", "-c", "user.email=a@example.org", "commit", "-m", name)

    assert do("git", "init")[0] == 0
    assert do("pre-commit", "install")[0] == 0
    fits, clashes = "smart_agriculture.yaml", "smart_agriculture_incompatible.bpmn"
    code, said = commit(clashes)
    assert (code, "error[ROS101]" in said) == (1, True)
    (work / clashes).rename(tmp_path / clashes)
    assert do("git", "rm", "-q", "--cached", clashes)[0] == 0
    code, said = commit(fits)
    assert (code, "Passed" in said) == (0, True), said
    (work / "notes.md").write_text("nothing that is checked", encoding="utf-8")
    code, said = commit("notes.md")
    assert (code, "no files to check" in said) == (0, True), said
