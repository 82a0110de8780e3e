"""Files are written whole or not at all."""

import os
import stat
from pathlib import Path

import pytest

from cqos_core import CqosError
from cqos_core.cli.file_output import write_file


def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path):
    write_file(str(tmp_path / "a"), "text\n")
    (tmp_path / "b").write_text("text\n")
    assert (tmp_path / "a").read_text() == "text\n"
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


def test_an_old_file_keeps_its_permissions_and_a_link_stays_a_link(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    write_file(str(link), "new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_a_protected_file_is_left_alone(tmp_path, monkeypatch):
    (tmp_path / "a").write_text("old")
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everywhere
    with pytest.raises(CqosError, match=r"cannot write .*/a: Permission denied"):
        write_file(str(tmp_path / "a"), "new")
    assert (tmp_path / "a").read_text() == "old"


def test_nothing_is_left_behind_where_writing_fails(tmp_path, monkeypatch):
    (tmp_path / "a").write_text("old")

    def fail(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(CqosError, match=r"cannot write .*/a: No space left on device"):
        write_file(str(tmp_path / "a"), "new")
    assert [file.name for file in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_text() == "old"


def test_a_device_is_written_to_rather_than_replaced():
    write_file(os.devnull, "text")
    assert not Path(os.devnull).is_file()


def test_half_characters_are_spelled(tmp_path):
    write_file(str(tmp_path / "a"), "a\udcffb")
    assert (tmp_path / "a").read_text() == "a\\udcffb"


def test_an_output_that_cannot_be_written_is_an_error_and_the_rest_is_written(cqos, files, monkeypatch):
    def fail(path, _):
        raise CqosError(f"cannot write {path}: Read-only file system")

    monkeypatch.setattr("cqos_core.cli.outputs.write_file", fail)
    done = cqos("check", "fits.yaml", "--format", "json", "--output", "a.json", "--format", "concise")
    assert done.code == 2
    assert "error: cannot write a.json: Read-only file system\n" in done.err
    assert "compatible" in done.out


SYSTEM = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/t: }}, b: {subscribes: {/t: }}}\n"


@pytest.mark.parametrize("spelling", ["designs/a.yaml", "./designs/a.yaml", "link", "hard"])
@pytest.mark.parametrize(
    "command",
    [
        ("check", "designs", "--output"),
        ("check", "designs", "--write-baseline"),
        ("convert", "designs/a.yaml", "--to", "yaml", "--output"),
        ("prove", "designs/a.yaml", "--output"),
    ],
)
def test_no_output_replaces_an_input(command, spelling, cqos, files):
    file = files / "designs" / "a.yaml"
    file.parent.mkdir()
    file.write_text(SYSTEM)
    (files / "link").symlink_to(file)
    (files / "hard").hardlink_to(file)
    done = cqos(*command, spelling)
    assert done.code == 2
    assert f"`{spelling}` is an input and would be overwritten" in done.err
    assert file.read_text() == SYSTEM
