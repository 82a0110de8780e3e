"""Only what was read is replaced: nothing that another program writes meanwhile is lost."""

import os
import threading
from pathlib import Path

import pytest

import cqos_core as cqos
from cqos_core.files import atomic_writes
from cqos_core.files.atomic_writes import ChangedFileError, is_same_file, replace_all, replace_whole, write_new


@pytest.fixture
def file(tmp_path):
    found = tmp_path / "a"
    found.write_bytes(b"old\n")
    return found


def names(folder):
    return sorted(each.name for each in folder.iterdir())


def test_what_was_read_is_replaced(file):
    replace_whole(str(file), b"new\n", b"old\n")
    assert file.read_bytes() == b"new\n"
    assert names(file.parent) == ["a"]


def test_what_changed_since_it_was_read_is_left(file):
    file.write_bytes(b"other\n")
    with pytest.raises(ChangedFileError, match="another program changed the file"):
        replace_whole(str(file), b"new\n", b"old\n")
    assert file.read_bytes() == b"other\n"
    assert names(file.parent) == ["a"]


def test_what_changes_while_the_draft_is_written_is_left(file, monkeypatch):
    real = os.fsync

    def slow(descriptor):
        file.write_bytes(b"old\nmore\n")
        real(descriptor)

    monkeypatch.setattr(os, "fsync", slow)
    with pytest.raises(ChangedFileError):
        replace_whole(str(file), b"new\n", b"old\n")
    assert file.read_bytes() == b"old\nmore\n"
    assert names(file.parent) == ["a"]


def test_a_line_that_is_added_between_the_last_comparison_and_the_replacement_is_kept(file, monkeypatch):
    appended = file.open("ab")
    monkeypatch.setattr(atomic_writes, "_is_being_written", lambda _: False)  # as on systems that do not tell
    real = Path.replace

    def replace(draft, target):
        appended.write(b"late\n")
        appended.flush()
        return real(draft, target)

    monkeypatch.setattr(Path, "replace", replace)
    replace_whole(str(file), b"new\n", b"old\n")
    appended.close()
    assert file.read_bytes() == b"new\nlate\n"


@pytest.mark.skipif(not hasattr(__import__("fcntl"), "F_SETLEASE"), reason="only Linux tells who has a file open")
def test_a_file_that_another_program_has_open_for_writing_is_left(file):
    with file.open("ab"), pytest.raises(ChangedFileError, match="open for writing"):
        replace_whole(str(file), b"new\n", b"old\n")
    assert file.read_bytes() == b"old\n"
    with file.open("rb"):
        replace_whole(str(file), b"new\n", b"old\n")
    assert file.read_bytes() == b"new\n"


def test_a_file_that_is_gone_is_not_made_again(file):
    file.unlink()
    with pytest.raises(ChangedFileError, match="another program removed the file"):
        replace_whole(str(file), b"new\n", b"old\n")
    assert names(file.parent) == []


def test_of_several_files_none_is_written_where_one_has_changed(tmp_path):
    texts, before = {}, {}
    for name in "ab":
        path = tmp_path / name
        path.write_bytes(b"old")
        texts[str(path)], before[str(path)] = b"new", b"old"
    (tmp_path / "b").write_bytes(b"other")
    with pytest.raises(ChangedFileError):
        replace_all(texts, before)
    assert (tmp_path / "a").read_bytes() == b"old"


def test_a_replaced_file_keeps_mode_owner_and_link(file):
    file.chmod(0o604)
    link = file.with_name("link")
    link.symlink_to(file)
    owner = file.stat().st_uid, file.stat().st_gid
    if os.getuid() == 0:
        owner = 1234, 4321
        os.chown(file, *owner)
    replace_whole(str(link), b"new\n", b"old\n")
    assert link.is_symlink()
    assert file.read_bytes() == b"new\n"
    assert (file.stat().st_uid, file.stat().st_gid) == owner
    assert file.stat().st_mode & 0o777 == 0o604


def test_a_new_file_replaces_none(file):
    with pytest.raises(ChangedFileError, match="there already"):
        write_new(str(file), b"new\n")
    assert file.read_bytes() == b"old\n"
    write_new(str(file.with_name("b")), b"new\n")
    assert names(file.parent) == ["a", "b"]


def test_one_file_has_many_paths(file, monkeypatch):
    monkeypatch.chdir(file.parent)
    Path("link").symlink_to("a")
    Path("hard").hardlink_to("a")
    Path("b").write_bytes(b"old\n")
    for other in ("a", "./a", "link", "hard", f"../{file.parent.name}/a"):
        assert is_same_file(str(file), other)
    assert not is_same_file("a", "b")
    assert not is_same_file("a", "missing")
    assert is_same_file("missing", "./missing")


SYSTEM = """cqos: 1
protocol: ros2
participants:
  lidar: {publishes: {/scan: {reliability: best_effort}}}
  planner: {subscribes: {/scan: {reliability: reliable}}}
"""


def test_apply_refuses_a_file_that_another_program_changed(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(SYSTEM)
    report = cqos.check(str(file))
    edited = cqos.apply(str(file), [report.findings[0].remedies[0]])
    file.write_text(SYSTEM + "# more\n")
    with pytest.raises(OSError, match="another program changed the file"):
        edited.write()
    assert file.read_text() == SYSTEM + "# more\n"


def test_no_line_of_a_program_that_appends_all_the_time_is_lost(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(SYSTEM)
    done = threading.Event()
    written: list[str] = []

    def append():
        while not done.is_set():
            with file.open("a") as other:
                other.write(f"# {len(written)}\n")
            written.append(f"# {len(written)}")

    other = threading.Thread(target=append)
    other.start()
    try:
        for _ in range(60):
            before = file.read_bytes()
            try:
                replace_whole(str(file), before + b"# mine\n", before)
            except ChangedFileError:
                continue
    finally:
        done.set()
        other.join()
    assert [each for each in file.read_text().splitlines() if each.startswith("# ") and each != "# mine"] == written
