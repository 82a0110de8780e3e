"""The example plugin, built as a wheel and installed: what it adds is there like what we ship."""

import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "examples" / "plugin"
PLANT = SAMPLE / "plant.csv"
PROJECT = tomllib.loads((SAMPLE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DISTRIBUTION = f"{PROJECT['name']} {PROJECT['version']}"


def run(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    """Build the wheel; without network, because the build backend is among our tests' needs."""
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, SAMPLE)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="session")
def installed(wheel, tmp_path_factory):
    """Install the wheel into a folder of its own, which needs only to be on the path."""
    folder = tmp_path_factory.mktemp("site")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-index"]
    run(*pip, "--no-compile", "--target", folder, wheel, env=os.environ | {"PIP_USER": "0"})
    return folder


@pytest.fixture
def site(installed):
    return installed


def test_the_wheel_holds_the_package_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        shipped = {name for name in archive.namelist() if ".dist-info/" not in name}
    package = SAMPLE / "cqos_fieldlink"
    assert shipped == {f"cqos_fieldlink/{file.name}" for file in package.iterdir() if file.is_file()}


def test_its_pack_judges_what_its_importer_reads(cqos):
    done = cqos("check", PLANT, "--format", "json")
    assert (done.code, done.err) == (1, "")
    report = json.loads(done.out)
    assert report["verdict"] == "incompatible"
    assert [finding["code"] for finding in report["findings"]] == ["FLK101", "FLK102"]
    assert {group["protocol"] for group in report["groups"]} == {"fieldlink"}


def test_its_pack_judges_what_our_importer_reads(cqos):
    text = "cqos: 1\nprotocol: fieldlink\nparticipants:\n  a: {publishes: {x: fast}}\n  b: {subscribes: {x: {timeout: 15ms}}}\n"
    (cqos.folder / "plant.yaml").write_text(text, encoding="utf-8")
    done = cqos("check", "plant.yaml", "--format", "concise")
    assert (done.code, done.err) == (0, "")
    assert "warning[FLK201]" in done.out


def test_its_files_are_found_in_folders(cqos):
    (cqos.folder / "plant.csv").write_bytes(PLANT.read_bytes())
    (cqos.folder / "table.csv").write_text("a;b\n", encoding="utf-8")
    done = cqos("check", ".", "--format", "concise")
    assert done.code == 1
    assert "./plant.csv:6:30: error[FLK102]" in done.out
    assert done.err == "note: 1 file of other formats skipped\n"


def test_its_importer_tells_what_is_wrong_with_a_file(cqos):
    (cqos.folder / "bad.csv").write_text("fieldlink links;2\ndevice;direction;sginal\n", encoding="utf-8")
    done = cqos("check", "bad.csv")
    assert done.code == 2
    assert "error[CQ006] bad.csv:2:18: there is no column `sginal`\n" in done.err


def test_its_formatter_renders_and_its_command_runs(cqos):
    done = cqos("check", ROOT / "examples" / "smart_agriculture_incompatible.bpmn", "--format", "markdown")
    assert (done.code, done.err) == (1, "")
    assert "| error ROS101 | " in done.out
    assert "Commands of plugins:\n  graph  Draw who talks to whom, for Graphviz.\n" in cqos("--help-all").out
    assert cqos("graph", "missing.csv")[:2] == (2, "")


def test_the_inventory_names_where_everything_comes_from(cqos):
    done = cqos("packs")
    assert (done.code, done.err) == (0, "")
    for name in ("fieldlink", "links", "markdown", "graph"):
        assert re.search(rf"^  {name} .* {re.escape(DISTRIBUTION)}$", done.out, re.MULTILINE)
    assert "timeout-after-one-lost-telegram" in cqos("packs", "fieldlink").out


def test_it_can_be_left_out(cqos):
    done = cqos("check", PLANT, CQOS_LOAD_PLUGINS="")
    assert done.code == 2
    assert "no installed importer recognises this format" in done.err
    assert cqos("check", PLANT, CQOS_LOAD_PLUGINS=PROJECT["name"]).code == 1


def test_help_imports_nothing_of_it_but_its_hooks(site):
    script = "import sys; from cqos_core.cli import main; main(['--help']); print(*sys.modules, file=sys.stderr)"
    env = os.environ | {"PYTHONPATH": str(site)}
    done = subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True)
    assert [name for name in done.stderr.split() if name.startswith("cqos_fieldlink")] == ["cqos_fieldlink"]


def test_its_readme_says_what_happens(cqos):
    (cqos.folder / "plant.csv").write_bytes(PLANT.read_bytes())
    page = (SAMPLE / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```console\n\$ cqos (.+)\n((?:.*\n)*?)^```$", page, re.MULTILINE)
    assert blocks
    for command, expected in blocks:
        assert cqos(*command.split()).out == expected


def test_its_own_tests_pass(site, tmp_path):
    command = [sys.executable, "-m", "pytest", "--quiet", "-p", "no:cacheprovider", SAMPLE / "tests"]
    env = {"PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    run(*command, "--rootdir", SAMPLE, "--config-file", os.devnull, cwd=tmp_path, env=os.environ | env)
