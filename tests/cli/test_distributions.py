"""Each distribution works with what it needs alone: no other part is imported, and what is missing is named with the line that adds it."""

import sys
from importlib.abc import MetaPathFinder
from importlib.metadata import entry_points
from pathlib import Path

import pytest

import cqos_core
from cqos_core import plugins
from cqos_core.model import optional_features as table
from cqos_core.model.optional_features import features
from cqos_core.model.problems import CqosError

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    row.distribution: [each.name for each in (ROOT / row.folder).glob("cqos_*/")] for row in features().values()
}
ALONE = {row.distribution: row for row in features().values() if row.brings}
COMMANDS = {name: row.distribution for row in features().values() for name in row.brings.get("commands", ())}
PAIR = """
cqos: 1
protocol: ros2
participants:
  lidar: {publishes: {/scan: {reliability: best_effort}}}
  planner: {subscribes: {/scan: {reliability: reliable}}}
"""


class Absent(MetaPathFinder):
    """Finds no module of some packages."""

    def __init__(self, hidden):
        self.hidden = hidden

    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in self.hidden:
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)


def with_needed(*distributions):
    """Return distributions with those that they need."""
    rows = [ALONE[each] for each in distributions]
    needed = {features()[each].distribution for row in rows for each in row.needs}
    return {"cqos-core", *distributions, *needed}


@pytest.fixture
def only(monkeypatch):
    """Hide all distributions but some: their plugins, their metadata and their modules."""

    def hide(*kept):
        hidden = {package for name, packages in PACKAGES.items() if name not in kept for package in packages}
        entries = [each for each in entry_points(group="cqos") if each.dist.name in kept]
        monkeypatch.setattr(plugins, "entry_points", lambda group: entries)
        monkeypatch.setattr(table, "_is_installed", kept.__contains__)
        for name in [each for each in sys.modules if each.partition(".")[0] in hidden]:
            monkeypatch.delitem(sys.modules, name)
        monkeypatch.setattr(sys, "meta_path", [Absent(hidden), *sys.meta_path])
        plugins.load_plugins.cache_clear()

    yield hide
    plugins.load_plugins.cache_clear()


@pytest.mark.parametrize("distribution", ["cqos-core", *ALONE])
def test_a_distribution_alone(distribution, only, cqos):
    kept = with_needed(distribution) if distribution in ALONE else {"cqos-core"}
    only(*kept)
    found = plugins.load_plugins()
    assert found.broken == []
    for kind in plugins.KINDS:
        brought = {name for row in features().values() if row.distribution in kept for name in row.brings.get(kind, ())}
        there = {name for name in getattr(found, kind) if not found.owner(kind, name).startswith("cqos-core ")}
        assert there == brought
        for name in there:
            if kind != "importers":
                getattr(found, kind)[name].load()
    for info in found.importers.values():
        for load in (info.load_claim, info.load_reader, info.load_inserter, info.load_drawn):
            load()
    for name, owner in COMMANDS.items():
        done = cqos(*name.split(), "--help")
        if owner in kept:
            assert (done.code, done.err) == (0, "")
        else:
            assert done.code == 2
            said, *lines = done.err.splitlines()
            assert said == f"error: `cqos {name}` is not installed"
            assert len(lines) == 1
            assert lines[0].startswith("help: ")
            assert features_of(owner).folder in lines[0]


def features_of(distribution):
    return next(row for row in features().values() if row.distribution == distribution and row.brings)


def test_the_library_says_what_plans_need(only, files):
    only("cqos-core", "cqos-ros2")
    (files / "pair.yaml").write_text(PAIR)
    assert cqos_core.check(files / "pair.yaml").verdict == "incompatible"
    for make in (cqos_core.repair, cqos_core.suggest):
        with pytest.raises(CqosError, match=r"^`cqos-planning` is not installed; .*install .*plugins/planning"):
            make(files / "pair.yaml")
    assert cqos_core.RepairPlan.__module__.startswith("cqos_core.")


def test_a_workspace_says_that_sources_were_not_read(only, cqos, files):
    only(*with_needed("cqos-ros2-workspace"))
    bot = files / "src" / "bot"
    (bot / "launch").mkdir(parents=True)
    (bot / "package.xml").write_text("<package format='3'><name>bot</name></package>")
    (bot / "CMakeLists.txt").write_text("add_executable(driver driver.cpp)\n")
    (bot / "driver.cpp").write_text("int main() {}\n")
    (bot / "launch" / "bot.launch.xml").write_text("<launch><node pkg='bot' exec='driver'/></launch>")
    done = cqos("check", "src", "--launch", "bot:bot.launch.xml", "--format", "json")
    assert "its sources were not read" in done.out
    assert "plugins/ros2_sources" in done.out


def test_a_folder_with_launch_files_is_not_clean_where_nothing_reads_them(only, cqos, files):
    only("cqos-core", "cqos-ros2")
    src = files / "src"
    (src / "launch").mkdir(parents=True)
    (src / "launch" / "bot.launch.py").write_text("def generate_launch_description(): ...")
    (src / "pair.yaml").write_text(PAIR.replace("best_effort", "reliable"))
    done = cqos("check", "src")
    assert done.code == 2
    assert "src/pair.yaml: compatible" in done.out
    assert "src/launch/bot.launch.py: `cqos-ros2-workspace` reads it and is not installed" in done.err
    assert "plugins/ros2_workspace" in done.err
    assert cqos("check", "src", "--exclude", "*.launch.py").code == 0
    only("cqos-core")
    assert "cqos-ros2-workspace" not in cqos("check", "src").err


def test_pairs_become_a_model_for_spin_without_what_runs_them(only, cqos, files):
    only("cqos-core", "cqos-mqtt")
    ends = "{a: {publishes: {t: {qos: 1}}}, b: {subscribes: {t: {qos: 1}}}}"
    (files / "mqtt.yaml").write_text(f"cqos: 1\nprotocol: mqtt\nparticipants: {ends}\n")
    done = cqos("convert", "mqtt.yaml", "--to", "promela")
    assert done.code == 0
    assert "#if PAIR == 1" in done.out
