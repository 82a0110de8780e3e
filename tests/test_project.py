"""Checks on the project's own files: what ships, what is pinned, what must not stand in a commit."""

import ast
import os
import re
import runpy
import subprocess
import sys
import tomllib
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, entry_points, packages_distributions
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
PLUGINS = sorted(file.parent for file in ROOT.glob("plugins/*/pyproject.toml"))
PROJECTS = [ROOT, *PLUGINS]

each_project = pytest.mark.parametrize("project", PROJECTS, ids=lambda project: project.name)
each_plugin = pytest.mark.parametrize("plugin", PLUGINS, ids=lambda plugin: plugin.name)
CODE = [project for project in PROJECTS if project.name != "all"]  # that one only names the others
each_project_with_code = pytest.mark.parametrize("project", CODE, ids=lambda project: project.name)


DEVELOPING = {"test", "lint", "docs"}  # extras of those who work on C-QoS itself


@cache
def read_project(project):
    return tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))


def metadata(project):
    return read_project(project)["project"]


def packages(project):
    return [project / name for name in read_project(project)["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]


def requirements(project):
    """What a distribution needs on this Python, also for its tests and lint."""
    extras = metadata(project).get("optional-dependencies", {})
    needed = [Requirement(text) for text in sum(extras.values(), metadata(project).get("dependencies", []))]
    return [each for each in needed if each.marker is None or each.marker.evaluate()]


@cache
def every_pin():
    """The lines of constraints.txt."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return [Requirement(line) for line in lines if line.strip() and not line.startswith("#")]


@cache
def pins():
    """The pinned versions for this Python, by normalised name."""
    return {canonicalize_name(pin.name): pin for pin in every_pin() if pin.marker is None or pin.marker.evaluate()}


@cache
def committed_files():
    """Every file that is tracked or would be with ``git add .``; texts only, by path."""
    listed = subprocess.run(
        ["git", "-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
    ).stdout.decode()
    texts = {}
    for name in filter(None, listed.split("\0")):
        content = (ROOT / name).read_bytes() if (ROOT / name).is_file() else b"\0"
        if b"\0" not in content:
            texts[name] = content.decode(errors="replace")
    return texts


def lines_with(pattern):
    """``file:line: text`` of every line in committed files that the pattern is found in."""
    expression = re.compile(pattern)
    return [
        f"{name}:{number}: {line.strip()[:120]}"
        for name, text in committed_files().items()
        if expression.search(text)
        for number, line in enumerate(text.splitlines(), 1)
        if expression.search(line)
    ]


# --- what must not stand in a commit: assembled here, or this file would be the first to be found ---


def test_no_file_names_the_host_of_a_package_registry():
    hosts = ["py" + "pi.org", "py" + "thonhosted", "n" + "pmjs"]
    mirrors = ["deb", "security", "ftp"]
    assert lines_with("|".join([*map(re.escape, hosts), *(rf"{name}\.d" + "ebian" for name in mirrors)])) == []


def test_no_file_names_a_path_of_the_machine_it_was_written_on():
    places = "|".join(["wo" + "rk", "fa" + "rm", "ro" + "ot"])
    assert lines_with(rf"(?:^|[^A-Za-z0-9_./-])/(?:{places})/") == []


def test_no_file_cites_a_document_that_is_not_here():
    assert lines_with(r"\.\./sha" + "red|DESI" + r"GN \d") == []
    named = re.compile(r"(?<![\w/.-])(?:docs|tests|modeler|proto|deploy)/(?!rules/)[\w./-]+\.md\b")
    cited = {document for text in committed_files().values() for document in named.findall(text)}
    absent = {document for document in cited if not (ROOT / document).exists()}
    assert absent - {"docs/api.md"} == {"docs/design.md"}  # that of the site, which is built; that of rmw_zenoh


# --- what ships ---


@each_project_with_code
def test_every_package_is_typed(project):
    assert [str(package) for package in packages(project) if not (package / "py.typed").is_file()] == []


@each_project_with_code
def test_entry_points_are_in_the_group_and_can_be_loaded(project):
    declared = metadata(project)["entry-points"]["cqos"]
    names = {package.name for package in packages(project)}
    assert declared, "no entry point: C-QoS would not find this distribution"
    for name, target in declared.items():
        assert target.partition(".")[0] in names, "an entry point names a module of its own distribution"
        (installed,) = entry_points(group="cqos", name=name)
        installed.load()


@each_plugin
def test_plugin_has_the_version_of_the_root_and_accepts_it(plugin):
    version = metadata(ROOT)["version"]
    needed = [each for each in requirements(plugin) if each.name.startswith("cqos-")]
    assert metadata(ROOT)["name"] in {each.name for each in needed}
    assert metadata(plugin)["version"] == version
    assert [str(each) for each in needed if version not in each.specifier] == []
    assert metadata(plugin)["requires-python"] == metadata(ROOT)["requires-python"]


# --- what is pinned ---


PINNED = pytest.mark.skipif(
    sys.version_info < (3, 11), reason="versions are pinned for Python 3.11 and newer: several have left 3.10 behind"
)


@PINNED
@each_project
def test_every_direct_dependency_is_pinned_to_a_version_it_allows(project):
    names = {metadata(other)["name"] for other in PROJECTS}
    for requirement in requirements(project):
        if requirement.name in names:
            continue
        pin = pins().get(canonicalize_name(requirement.name))
        assert pin is not None, f"{requirement.name} is not in constraints.txt"
        (exact,) = pin.specifier
        assert exact.version in requirement.specifier, f"{requirement} does not allow {pin}"


owners_of_modules = cache(packages_distributions)  # it reads the records of all that is installed


@each_project_with_code
def test_every_dependency_is_imported(project):
    """What no module imports is a download for nothing; tests and lint have extras of their own."""
    extras = metadata(project).get("optional-dependencies", {})
    stated = sum((extras[name] for name in extras.keys() - DEVELOPING), metadata(project).get("dependencies", []))
    texts = [file.read_text(encoding="utf-8") for package in packages(project) for file in package.rglob("*.py")]
    modules = owners_of_modules()
    ours = {metadata(each)["name"] for each in PROJECTS}
    for name in {Requirement(text).name for text in stated} - ours:
        provided = {
            module for module, owners in modules.items() if canonicalize_name(name) in map(canonicalize_name, owners)
        }
        line = re.compile(rf"\b(?:import|from) (?:{'|'.join(map(re.escape, provided))})\b")
        found = (provided & imported(text) for text in texts if line.search(text))
        assert not provided or any(found), f"nothing imports {name}"


@cache
def imported(text):
    """The modules that a source imports, without their parts."""
    nodes = [*ast.walk(ast.parse(text))]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    return {name.partition(".")[0] for name in names}


@PINNED
def test_every_indirect_dependency_is_pinned():
    passed_over = {canonicalize_name(metadata(project)["name"]) for project in PROJECTS}
    waiting = [requirement for project in PROJECTS for requirement in requirements(project)]
    seen = set()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        if (name, *sorted(requirement.extras)) in seen or name in passed_over:
            continue
        seen.add((name, *sorted(requirement.extras)))
        waiting += [
            needed
            for needed in map(Requirement, distribution(name).requires or [])
            if needed.marker is None
            or any(needed.marker.evaluate({"extra": extra}) for extra in ["", *requirement.extras])
        ]
    assert sorted({name for name, *_ in seen} - set(pins())) == []


@pytest.mark.parametrize("name", sorted(pins()))
def test_pin_can_be_installed_on_the_oldest_python_of_developers(name):
    oldest = "3.11.0"  # that dev.py pins for; 3.11 alone would hide a need of 3.11.5
    try:
        supported = "".join(distribution(name).metadata.get_all("Requires-Python") or [])
    except PackageNotFoundError:
        supported = ""  # wanted on another platform
    assert oldest in SpecifierSet(supported)


def pinned_for_docs():
    """The pins of the site's generator, which no user installs, by normalised name."""
    lines = (ROOT / "docs" / "requirements.txt").read_text(encoding="utf-8").splitlines()
    return {canonicalize_name(Requirement(line).name): Requirement(line) for line in lines if not line.startswith("#")}


def test_no_pin_contradicts_another():
    assert not set(pinned_for_docs()) & set(pins())


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13", "3.14"])
def test_each_python_has_one_pin_of_a_name(version):
    here = [pin for pin in every_pin() if pin.marker is None or pin.marker.evaluate({"python_version": version})]
    names = [canonicalize_name(pin.name) for pin in here]
    assert sorted(names) == sorted({canonicalize_name(pin.name) for pin in every_pin()})
    (family,) = {str(pin.specifier) for pin in here if pin.name.startswith("grpcio")}
    assert family


def test_constraints_are_plain_versions():
    for pin in (*every_pin(), *pinned_for_docs().values()):
        assert pin.url is None
        assert [specifier.operator for specifier in pin.specifier] == ["=="], f"{pin} is no exact version"


# --- how it is run ---


def test_readme_tells_the_commands():
    readme = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert {"python3 dev.py demo", "python3 dev.py test"} <= {line.strip().removeprefix("$ ") for line in readme}


def test_ci_runs_what_the_readme_tells_and_nothing_else():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    preparation = ("#", "set ", "cd ")
    commands = [line for line in script.splitlines() if line and not line.startswith(preparation)]
    assert commands == ["python3 dev.py test"]


def test_the_workflow_runs_what_ci_runs():
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    job = workflow["jobs"]["test"]
    assert job["steps"][-1] == {"run": "bash .ci/run"}
    listed = re.findall(r"Python :: (3\.\d+)", str(metadata(ROOT)["classifiers"]))
    assert job["strategy"]["matrix"]["python"] == listed[: len(job["strategy"]["matrix"]["python"])]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no executable bit")
@pytest.mark.parametrize("script", [".ci/run", "dev.py"])
def test_script_can_be_executed(script):
    assert os.access(ROOT / script, os.X_OK)


def test_dev_script_can_tell_an_old_python_that_it_is_too_old():
    source = (ROOT / "dev.py").read_text(encoding="utf-8")
    ast.parse(source, feature_version=(3, 6))
    before, check, _ = source.partition("if sys.version_info")
    assert check
    assert re.findall("^(?:import|from) .*", before, re.MULTILINE) == ["import sys"]


def test_dev_script_explains_a_wrong_call_in_one_line(tmp_path):
    command = [sys.executable, str(ROOT / "dev.py"), "demo", "--fast"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    expected = "dev.py: demo takes no arguments, found '--fast'\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", expected)


def test_tasks_that_documents_name_exist():
    tasks = {*read_project(ROOT)["tool"]["poe"]["tasks"], "demo", "setup", "TASK"}
    named = {
        (name, task)
        for name, text in committed_files().items()
        for task in re.findall(r"(?:python3 |`)dev\.py ([a-zA-Z]+)", text)
    }
    assert {task for _, task in named} >= {"demo", "test", "setup", "goldens"}
    assert [each for each in sorted(named) if each[1] not in tasks] == []


def test_types_are_checked_for_the_oldest_python():
    assert metadata(ROOT)["requires-python"] == f">={read_project(ROOT)['tool']['mypy']['python_version']}"


# --- plugins are found by looking; import-linter and mypy want names ---


def test_cqos_brings_every_distribution_and_its_extras():
    whole = metadata(ROOT / "plugins" / "all")
    assert whole["name"] == "cqos"
    brought = {Requirement(text).name for text in whole["dependencies"]}
    assert brought == {metadata(project)["name"] for project in CODE}
    passed_on = {
        (extra, metadata(project)["name"])
        for project in CODE
        for extra in metadata(project).get("optional-dependencies", {})
        if extra not in DEVELOPING
    }
    stated = {
        (extra, needed.name)
        for extra, texts in whole["optional-dependencies"].items()
        for needed in map(Requirement, texts)
        if needed.extras == {extra}
    }
    assert stated == passed_on


def test_messages_name_distributions_and_extras_that_exist():
    extras = {
        metadata(project)["name"]: set(metadata(project).get("optional-dependencies", {})) for project in PROJECTS
    }
    named = [
        (name, distribution, extra)
        for name, text in committed_files().items()
        for distribution, extra in re.findall(r"pip install '(cqos[a-z0-9-]*)\[([a-z,]+)\]'", text)
    ]
    assert named
    assert [each for each in named if not set(each[2].split(",")) <= extras.get(each[1], set())] == []


@each_plugin
def test_import_contract_and_mypy_name_the_packages_of_every_plugin(plugin):
    settings = read_project(ROOT)["tool"]["importlinter"]
    (layers,) = (
        [re.split(r"\s*\|\s*", layer) for layer in contract["layers"]]
        for contract in settings["contracts"]
        if contract["type"] == "layers" and "containers" not in contract
    )
    for package in packages(plugin):
        assert package.name in settings["root_packages"]
        assert package.name in read_project(ROOT)["tool"]["mypy"]["packages"]
        assert package.name in {name for layer in layers[:-1] for name in layer}, "it stands above the core"
    assert layers[-1] == ["cqos_core"]


@each_plugin
def test_no_tool_names_a_plugin(plugin):
    names = {
        plugin.relative_to(ROOT).as_posix(),
        metadata(plugin)["name"],
        *(path.name for path in packages(plugin)),
    } - {"cqos"}  # the command has the name of the distribution that brings everything
    for script in ("dev.py", ".ci/run"):
        text = (ROOT / script).read_text(encoding="utf-8")
        assert [name for name in sorted(names) if name in text] == []


def test_every_directory_below_plugins_is_a_distribution():
    found = [path for path in (ROOT / "plugins").iterdir() if path.is_dir() and path.name != "__pycache__"]
    assert sorted(found) == PLUGINS


def test_the_demo_installs_packs_and_waits_for_nothing_heavy():
    light = {metadata(project)["name"] for project in runpy.run_path(str(ROOT / "dev.py"))["light_projects"]()}
    assert light >= {"cqos-core", "cqos-ros2", "cqos-dds", "cqos-mqtt", "cqos-ros2-workspace"}
    for project in CODE:
        needed = {Requirement(text).name for text in metadata(project)["dependencies"]}
        assert (metadata(project)["name"] in light) == (metadata(project)["name"] == "cqos-core" or needed <= light)
