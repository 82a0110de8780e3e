"""Folders are walked however deep they lie and wherever links lead, by everything that reads folders."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from cqos_core.files.folder_walk import SkippedFolder, walk

DEEP = 1_600
"""Folders: more than Python calls into each other, and more than a path of Linux has room for."""
SYSTEM = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/t: }}, b: {subscribes: {/t: }}}\n"
assert sys.getrecursionlimit() < DEEP


@pytest.fixture
def hostile(tmp_path):
    """A folder with a system, folders that are too deep, links that lead to themselves, up and out."""
    folder, elsewhere = tmp_path / "folder", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    (folder / "a.yaml").write_text(SYSTEM)
    (elsewhere / "b.yaml").write_text(SYSTEM)
    (folder / "loop").symlink_to(".")
    (folder / "self").symlink_to("self")
    (folder / "out").symlink_to(elsewhere)
    (folder / "root").symlink_to("/")
    start = Path.cwd()
    os.chdir(folder)
    for _ in range(DEEP):
        Path("dd").mkdir()
        os.chdir("dd")
    os.chdir(start)
    yield folder
    _remove(folder / "dd")
    shutil.rmtree(folder)


def _remove(deep):
    """Remove folders that `shutil` cannot, as their paths are too long: move each up, then remove it."""
    inner, moved = deep / "dd", deep.with_name("moved")
    while inner.exists():
        inner.rename(moved)
        deep.rmdir()
        moved.rename(deep)
    deep.rmdir()


def test_a_walk_says_what_it_skips_and_why(hostile):
    skipped: list[SkippedFolder] = []
    seen = [folder for folder, _, _ in walk(str(hostile), skipped)]
    assert len(seen) > 1_000
    causes = {each.path: each.cause for each in skipped if len(each.path) < 1_000}
    elsewhere = os.path.realpath(hostile.parent / "elsewhere")
    assert causes == {f"{hostile}/out": f"a link to {elsewhere}", f"{hostile}/root": "a link to /"}
    (deep,) = (each for each in skipped if len(each.path) >= 1_000)
    assert (deep.cause, deep.refused) == ("File name too long", False)
    assert len(deep.shown) < 200


@pytest.mark.skipif(os.getuid() == 0, reason="root reads every folder")
def test_a_folder_that_may_not_be_read_is_refused(tmp_path):
    (tmp_path / "closed").mkdir(mode=0)
    skipped: list[SkippedFolder] = []
    assert [folder for folder, _, _ in walk(str(tmp_path), skipped)] == [str(tmp_path)]
    assert [(each.path, each.refused) for each in skipped] == [(str(tmp_path / "closed"), True)]


def test_a_walk_is_in_the_order_and_as_far_as_the_caller_wants(tmp_path):
    for name in ("b/2", "b/1", "a/x", "c/y"):
        (tmp_path / name).mkdir(parents=True)
    seen = []
    for folder, folders, _ in walk(str(tmp_path), []):
        seen.append(os.path.relpath(folder, tmp_path))
        folders[:] = sorted(each for each in folders if each != "c")
    assert seen == [".", "a", "a/x", "b", "b/1", "b/2"]


def test_a_check_of_such_a_folder_says_what_it_skipped(hostile):
    from tests.command_process import run

    done = run(["check", hostile.name, "--format", "concise"], hostile.parent)
    assert done.code == 0, done.err
    assert "folder/a.yaml: compatible" in done.out
    assert "folder/root (a link to /)" in done.err
    assert "File name too long" in done.err
    done = run(["init", hostile.name], hostile.parent)
    assert done.code == 0, done.err


def test_an_editor_checks_a_document_in_such_a_folder(hostile):
    pytest.importorskip("cqos_lsp")
    from cqos_lsp.document_checks import Checker

    path = str(hostile / "a.yaml")
    text = SYSTEM.replace("subscribes: {/t: }", "subscribes: {/t: {durability: transient_local}}").encode()
    found = Checker().check({path: text}, [str(hostile)], lambda _, __: None)
    assert [each.code for each in found.analyses[0].report.findings] == ["ROS102"]


def test_a_workspace_of_such_a_folder_says_what_it_skipped(hostile):
    pytest.importorskip("cqos_ros2")
    from cqos_ros2_workspace.launch.workspace import find_packages

    package = hostile / "dd" / "dd" / "p"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>p</name></package>")
    (package / "out").symlink_to("/")
    found = find_packages(str(hostile))
    assert [*found.packages] == ["p"]
    assert found.files_of("p").keys() == {"package.xml"}
    said = [each.cause for each, _ in found.passed_over()]
    assert any("root (a link to /)" in each for each in said)
    assert any("out (a link to /)" in each for each in said)
    assert any("File name too long" in each for each in said)
    shutil.rmtree(package)


def test_learning_from_such_a_folder_says_what_it_skipped(hostile):
    pytest.importorskip("cqos_ros2")
    from cqos_ros2_sources.walk.call_tables import protocols, tables
    from cqos_ros2_sources.walk.clients import learn_clients

    for protocol in protocols():
        gaps = learn_clients(str(hostile), tables((), protocol), protocol).gaps
        assert ("what a folder holds", "a link to /", "root") in gaps
        assert len(gaps) == len({*gaps}) == 3


def test_an_audit_of_such_a_folder_ends(hostile):
    from plugins.fleet.tests.needed import needed
    from tests.command_process import run

    for name in ("narwhals", "duckdb", "pyarrow"):
        needed(name)
    done = run(["audit", hostile.name], hostile.parent)
    assert done.code == 0, done.err
