"""What is not installed is answered with the line that adds it, and the table behind that is true."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections import Counter
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from cqos_core.model.optional_features import Feature, absent, advice, features, install_line, origin
from cqos_core.plugins import load_plugins

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
DEVELOPING = {"test", "lint"}
KINDS = ("commands", "formatters", "exporters", "functions", "importers", "translators", "packs")


def project(folder):
    return tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]


# The table


@pytest.mark.parametrize("feature", features().values(), ids=lambda each: each.name)
def test_a_feature_is_where_the_table_says(feature):
    there = project(feature.folder)
    assert there["name"] == feature.distribution
    extras = there.get("optional-dependencies", {})
    needed = [Requirement(text) for text in (extras[feature.extra] if feature.extra else there["dependencies"])]
    every = range(10, 15)
    runs = [n for n in every if any(each.marker is None or each.marker.evaluate(python(n)) for each in needed)]
    oldest, newest = (int((each or usual)[2:]) for each, usual in ((feature.oldest, "3.10"), (feature.newest, "3.14")))
    assert runs == [n for n in every if oldest <= n <= newest]


@pytest.mark.parametrize("feature", features().values(), ids=lambda each: each.name)
def test_a_feature_needs_what_its_distribution_needs(feature):
    ours = {row.distribution for row in features().values()} - {"cqos-core"}
    stated = {features()[each].distribution for each in feature.needs}
    assert stated == {Requirement(text).name for text in project(feature.folder)["dependencies"]} & ours


def python(minor):
    return {"python_version": f"3.{minor}", "python_full_version": f"3.{minor}.0"}


def test_the_table_has_every_extra_and_all_that_our_plugins_register():
    projects = [project(file.parent) for file in (ROOT / "pyproject.toml", *ROOT.glob("plugins/*/pyproject.toml"))]
    stated = {(row.distribution, row.extra) for row in features().values() if row.extra}
    extras = {(each["name"], extra) for each in projects for extra in each.get("optional-dependencies", {})}
    assert stated == {each for each in extras if each[0] != "cqos" and each[1] not in DEVELOPING}

    plugins = load_plugins()
    for kind in KINDS:
        table = {name: row.distribution for row in features().values() for name in row.brings.get(kind, ())}
        registered = {name: plugins.owner(kind, name).split()[0] for name in getattr(plugins, kind)}
        ours = {name: owner for name, owner in registered.items() if owner in {each["name"] for each in projects}}
        assert table == {name: owner for name, owner in ours.items() if owner != "cqos-core"}
    options = {each.option for info in plugins.importers.values() for each in info.options}
    assert options == {name for row in features().values() for name in row.brings.get("options", ())}
    named = Counter((kind, name) for row in features().values() for kind, names in row.brings.items() for name in names)
    assert set(named.values()) == {1}


def test_nothing_that_is_installed_is_absent():
    assert [absent(kind) for kind in KINDS] == [{}] * len(KINDS)


# README and the page about installing

EXTRAS = {"modeler": "web", "prove": "cyclonedds", "serve": "web", "snapshot dds": "cyclonedds"}
"""The extras that commands need, or features of them that the pages show."""


def test_the_lines_of_the_docs_install_every_command_that_they_name():
    text = "\n".join((ROOT / page).read_text(encoding="utf-8") for page in ("README.md", "docs/install.md"))
    named = set(re.findall(r"(?:`|^\$ )cqos ((?:snapshot )?[a-z][a-z-]*)", text, re.MULTILINE)) - {"packs"}
    assert named >= {"check", "audit", "repair", "suggest", "prove", "snapshot dds", "modeler", "lsp"}
    commands = load_plugins().commands
    assert named <= set(commands)

    folders, extras = set(), set()
    for line in re.findall(r"^pip install (.*)$", text, re.MULTILINE):
        for target in shlex.split(line):
            name, _, extra = target.rstrip("]").partition("[")
            folders |= {path.resolve() for path in (ROOT.glob(name) if "*" in name else [ROOT / name])}
            extras |= {(project(name)["name"], each) for each in extra.split(",") if each}
    installed = {project(folder.relative_to(ROOT))["name"] for folder in folders}
    for name in named:
        assert load_plugins().owner("commands", name).split()[0] in installed
        if name in EXTRAS:
            feature = features()[EXTRAS[name]]
            assert (feature.distribution, feature.extra) in extras, f"no line is for `cqos {name}`"


def test_every_line_of_documentation_installs_what_exists():
    lines = []
    for file in (ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("plugins/*/README.md")):
        found = re.findall(r"pip install ([^`#|\n]*)", file.read_text(encoding="utf-8"))
        lines += [(file.name, target) for each in found for target in shlex.split(each) if "[" in target]
    assert lines
    for page, target in lines:
        name, _, extra = target.rstrip("]").partition("[")
        there = ROOT / name if name.startswith(".") else FOLDERS[name]
        assert set(extra.split(",")) <= set(project(there)["optional-dependencies"]), f"{page}: {target}"


FOLDERS = {
    project(file.parent)["name"]: file.parent
    for file in (ROOT / "pyproject.toml", *ROOT.glob("plugins/*/pyproject.toml"))
}


# The line, by where C-QoS was installed from

SPARK, WEB, LSP = (
    Feature("spark", "cqos-fleet", "plugins/fleet", "spark"),
    Feature("web", "cqos-core", ".", "web"),
    Feature("lsp", "cqos-lsp", "plugins/editor"),
)


def line(feature, place):
    """The arguments of `pip install` in a line."""
    text = install_line(feature, place)
    return shlex.split(text)[shlex.split(text).index("install") + 1 :]


@pytest.fixture
def clone(tmp_path):
    for feature in (SPARK, WEB, LSP):
        (tmp_path / "my clone" / feature.folder).mkdir(parents=True, exist_ok=True)
        (tmp_path / "my clone" / feature.folder / "pyproject.toml").touch()
    return tmp_path / "my clone"


LIVE_OF_CLONE = Feature("live", "cqos-live", "plugins/live")
DDS = Feature("dds", "cqos-dds", "plugins/dds_full")


def test_what_a_distribution_needs_and_no_index_has_comes_with_it(clone, monkeypatch):
    monkeypatch.chdir(clone)
    place = {"url": clone.as_uri(), "dir_info": {"editable": True}}
    (clone / "plugins/live").mkdir()
    (clone / "plugins/live/pyproject.toml").touch()
    text = install_line(LIVE_OF_CLONE, place, [DDS])
    assert shlex.split(text)[-4:] == ["-e", "./plugins/dds_full", "-e", "./plugins/live"]
    place = {"url": "https://example.org/cqos.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}}
    assert install_line(LIVE_OF_CLONE, place, [DDS]).endswith(
        "'cqos-dds @ git+https://example.org/cqos.git@abc#subdirectory=plugins/dds_full' "
        "'cqos-live @ git+https://example.org/cqos.git@abc#subdirectory=plugins/live'"
    )
    assert install_line(LIVE_OF_CLONE, {}, [DDS]).endswith("install cqos-live")


def test_from_an_index():
    assert [line(each, {}) for each in (SPARK, WEB, LSP)] == [["cqos[spark]"], ["cqos[web]"], ["cqos-lsp"]]


def test_from_a_clone(clone, monkeypatch):
    place = {"url": clone.as_uri(), "dir_info": {}}
    found = [line(each, place) for each in (SPARK, WEB, LSP)]
    assert found == [[f"{clone}/plugins/fleet[spark]"], [f"{clone}[web]"], [f"{clone}/plugins/editor"]]
    monkeypatch.chdir(clone)
    assert [line(each, place) for each in (SPARK, WEB, LSP)] == [
        ["./plugins/fleet[spark]"],
        [".[web]"],
        ["./plugins/editor"],
    ]


def test_from_a_clone_that_is_edited_in_place(clone, monkeypatch):
    monkeypatch.chdir(clone)
    place = {"url": clone.as_uri(), "dir_info": {"editable": True}}
    assert [line(each, place) for each in (SPARK, LSP)] == [
        ["-e", "./plugins/fleet[spark]"],
        ["-e", "./plugins/editor"],
    ]


def test_from_a_clone_that_is_gone(clone):
    shutil.rmtree(clone)
    text = install_line(SPARK, {"url": clone.as_uri(), "dir_info": {}})
    assert text.startswith(f"in a clone of C-QoS ({clone} is none any more): ")
    assert text.endswith("install './plugins/fleet[spark]'")


def test_from_a_wheel_in_a_folder(tmp_path):
    place = {"url": (tmp_path / "cqos_core-0.1.0-py3-none-any.whl").as_uri(), "archive_info": {}}
    assert line(SPARK, place) == ["--find-links", str(tmp_path), "cqos[spark]"]


def test_from_a_git_address():
    place = {"url": "https://example.org/cqos.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}}
    at = "git+https://example.org/cqos.git@abc"
    assert line(SPARK, place) == [f"cqos-fleet[spark] @ {at}#subdirectory=plugins/fleet"]
    assert line(WEB, place) == [f"cqos-core[web] @ {at}"]


def test_on_a_python_that_a_feature_does_not_run_on(monkeypatch):
    monkeypatch.setattr(sys, "version_info", (3, 10, 1))
    assert advice("web") == "use Python 3.11 or newer; this is Python 3.10"
    monkeypatch.setattr(sys, "version_info", (3, 14, 0))
    assert advice("cyclonedds") == "use Python 3.13 or older; this is Python 3.14"
    assert "install" in advice("web")


def test_the_pip_that_is_named_is_that_of_this_python(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert install_line(WEB, {}) == shlex.join([sys.executable, "-m", "pip", "install", "cqos[web]"])
    (tmp_path / "pip").touch(mode=0o755)
    assert install_line(WEB, {}) == shlex.join([sys.executable, "-m", "pip", "install", "cqos[web]"])
    (tmp_path / "python").touch(mode=0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert install_line(WEB, {}) == "pip install 'cqos[web]'"


# What the command says, in an installation that lacks something


@pytest.fixture
def lacking(tmp_path, monkeypatch):
    """Run the command in an installation without some packages, and with these of our distributions only."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments, ours=("cqos_core",), without=()):
        site = tmp_path / "site"
        shutil.rmtree(site, ignore_errors=True)
        site.mkdir()
        for each in Path(sysconfig.get_path("purelib")).iterdir():
            mine = re.match(r"(_?cqos\w*)-.*\.dist-info", each.name)
            wanted = mine[1] in ours if mine else each.name not in without and each.suffix != ".pth"
            if wanted:
                (site / each.name).symlink_to(each)
        folders = {package.name: [package.parent] for package in ROOT.glob("plugins/*/cqos_*")}
        folders["cqos_core"] = [ROOT, ROOT / "proto/python"]
        path = [str(site), *(str(folder) for name in ours for folder in folders[name])]
        script = f"import sys; sys.path += {path!r}; from cqos_core.cli import main; sys.exit(main(sys.argv[1:]))"
        return subprocess.run(
            [sys.executable, "-S", "-I", "-c", script, *map(str, arguments)],
            env={name: value for name, value in os.environ.items() if name not in {"FORCE_COLOR", "CQOS_DEBUG"}},
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )

    return run


def check_advice(done, *words):
    """The message has two lines, what is missing and what to write, and what it says to install exists."""
    assert done.returncode == 2, done.stderr
    what, *lines = done.stderr.splitlines()
    assert what.startswith("error: ")
    assert all(word in what for word in words)
    assert lines
    assert lines[0].startswith("help: ")
    for text in lines:
        if text.startswith("help: use Python "):
            continue
        parts = shlex.split(text.removeprefix("help: "))
        target, extra = re.fullmatch(r"(.*?)(?:\[(\w+)\])?", parts[-1]).groups()
        assert "install" in parts
        content = project(Path(target).relative_to(ROOT))
        assert extra is None or extra in content["optional-dependencies"]
    return what, lines


SYSTEM = str(ROOT / "examples" / "mobile_robot.yaml")


@pytest.mark.parametrize(
    "command", [name for row in features().values() for name in row.brings.get("commands", ())], ids=str
)
def test_a_command_of_a_distribution_that_is_not_installed(lacking, command):
    what, _ = check_advice(lacking(*command.split(), "x"))
    assert what == f"error: `cqos {command}` is not installed"


def test_the_first_word_of_several_commands(lacking):
    what, lines = check_advice(lacking("snapshot"))
    assert what == "error: `cqos snapshot dds` and `cqos snapshot mqtt` are not installed"
    assert len(lines) == 1


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("check", SYSTEM, "--format", "html"), "the format `html`"),
        (("convert", SYSTEM, "--to", "dot"), "the exporter `dot`"),
        (("check", SYSTEM, "--from", "rviz"), "the importer `rviz`"),
        (("check", SYSTEM, "--protocol", "mqtt"), "the rule pack `mqtt`"),
        (("check", SYSTEM, "--option", "ros2.distro=humble"), "the rule pack `ros2`"),
        (("check", SYSTEM, "--launch", "a.launch.py"), "the option `--launch`"),
        (("packs", "dds"), "the rule pack `dds`"),
        (("packs", "x", "--as", "sql"), "the translator `sql`"),
    ],
    ids=lambda each: each if isinstance(each, str) else " ".join(each[2:]),
)
def test_a_name_of_a_distribution_that_is_not_installed(lacking, arguments, named):
    what, _ = check_advice(lacking(*arguments))
    assert what == f"error: {named} is not installed"


def test_an_unknown_option_of_another_command_is_only_unknown(lacking):
    done = lacking("rule", "ROS101", "--launch", "x")
    assert (done.returncode, "install" in done.stderr) == (2, False)


LIVE = ("cqos_core", "cqos_dds", "cqos_live", "cqos_mqtt")
ENGINES = ("duckdb", "narwhals", "polars", "pyarrow")


@pytest.mark.parametrize(
    ("arguments", "ours", "without", "named"),
    [
        (("audit", SYSTEM), ("cqos_core", "cqos_fleet"), ENGINES, "`cqos audit`"),
        (("audit", SYSTEM, "--engine", "polars"), ("cqos_core", "cqos_fleet"), ("polars",), "`cqos audit`"),
        (("audit", SYSTEM, "--spark", "spark://x:1"), ("cqos_core", "cqos_fleet"), ("pyspark",), "--spark"),
        (("repair", SYSTEM), ("cqos_core", "cqos_planning", "cqos_ros2"), ("ortools",), "OR-tools"),
        (("suggest", SYSTEM), ("cqos_core", "cqos_planning", "cqos_ros2"), ("ortools",), "OR-tools"),
        (("snapshot", "dds"), LIVE, ("cyclonedds",), "`cqos snapshot dds`"),
        (("serve", "--listen", "127.0.0.1:0", "--web", "127.0.0.1:0"), ("cqos_core",), ("starlette",), "--web"),
        (
            ("serve", "--listen", "127.0.0.1:0", "--metrics", "127.0.0.1:0"),
            ("cqos_core",),
            ("prometheus_client",),
            "--met",
        ),
        (("serve", "--listen", "127.0.0.1:0", "--tracing"), ("cqos_core",), ("opentelemetry",), "--tracing"),
        (("modeler", "--no-browser"), ("cqos_core",), ("starlette",), "the modeler"),
    ],
    ids=lambda each: " ".join(each)[:40].replace(SYSTEM, "") if isinstance(each, tuple) else each,
)
def test_an_extra_that_is_not_installed(lacking, arguments, ours, without, named):
    what, _ = check_advice(lacking(*arguments, ours=ours, without=without), named)
    options = set(re.findall(r"--[a-z]+", what)) - set(arguments)
    assert options == set(), "names an option that was not given"


SOURCES = ("cqos_core", "cqos_ros2", "cqos_ros2_sources", "cqos_ros2_workspace")


def test_sources_in_cpp_without_their_parser(lacking, tmp_path):
    package = tmp_path / "talker"
    package.mkdir()
    (package / "package.xml").write_text("<package format='3'><name>talker</name></package>")
    (package / "a.cpp").write_text("int main() {}\n")
    without = ("tree_sitter", "tree_sitter_cpp")
    check_advice(lacking("learn", package, ours=SOURCES, without=without), "C++")


def test_a_pair_without_the_middleware_to_run_it_on(lacking, tmp_path):
    system = tmp_path / "s.yaml"
    ends = {"a": {"publishes": {"t": {"durability": "volatile"}}}}
    ends["b"] = {"subscribes": {"t": {"durability": "transient_local"}}}
    system.write_text(json.dumps({"cqos": 1, "protocol": "dds", "participants": ends}))
    done = lacking("prove", system, "--on", "cyclonedds", ours=LIVE, without=("cyclonedds", DIST_INFO))
    check_advice(done, "Cyclone DDS is not installed")


DIST_INFO = next((each.name for each in Path(sysconfig.get_path("purelib")).glob("cyclonedds-*.dist-info")), "")


def test_this_environment_was_installed_from_this_clone():
    """Else these tests would try the lines of an index only."""
    assert "dir_info" in origin()
