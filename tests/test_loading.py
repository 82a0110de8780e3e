"""From paths to sources: what is found, what is refused."""

import os
from pathlib import Path

import pytest

from cqos_core.files import source_files
from cqos_core.files.file_search import File, find_files
from cqos_core.files.ignore_patterns import read_ignore_patterns
from cqos_core.files.importer_choice import recognise
from cqos_core.files.path_loader import load_paths
from cqos_core.files.source_files import read_path
from cqos_core.files.source_reader import read_source
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.plugins import load_plugins


def problems_of(call, *arguments):
    with pytest.raises(InputError) as raised:
        call(*arguments)
    return raised.value.problems


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("b.yaml", "a.bpmn", "c.dat", ".hidden.yaml", "deep/d.JSON", ".git/e.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("x")
    return tmp_path


def test_a_folder_is_searched_for_the_endings_that_importers_name(folder):
    found = find_files(["."], load_plugins())
    assert found.files == [File(path, ".") for path in ("./a.bpmn", "./b.yaml", "./deep/d.JSON")]
    assert (len(found.skipped), found.problems) == (1, [])


def test_an_importer_limits_the_search_to_its_own_endings(folder):
    assert [file.path for file in find_files(["."], load_plugins(), "bpmn").files] == ["./a.bpmn"]


def test_each_file_is_found_once_and_named_beats_found(folder):
    (folder / "link.yaml").symlink_to("b.yaml")
    files = find_files([".", "b.yaml", "deep/../b.yaml", "-", "-"], load_plugins()).files
    assert [file.path for file in files] == ["./a.bpmn", "b.yaml", "./deep/d.JSON", "-"]
    assert [file.named for file in files] == [False, True, False, True]


def test_a_folder_that_cannot_be_searched_is_a_problem(folder, monkeypatch):
    def refuse(path):
        raise PermissionError(13, "Permission denied", path)

    monkeypatch.setattr(os, "scandir", refuse)
    (problem,) = load_paths(["deep"]).problems
    assert str(problem) == "deep: the folder cannot be searched: Permission denied"


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("missing", "No such file or directory"),
        (".", "Is a directory"),
        ("x" * 5000, "File name too long"),
        ("a\0b", "embedded null byte"),
    ],
    ids=["missing", "folder", "long", "null"],
)
def test_an_unreadable_path_is_reported_with_the_reason(folder, path, reason):
    (problem,) = problems_of(read_path, path)
    assert (problem.code, problem.message) == ("CQ001", f"cannot be read: {reason}")


def test_a_file_that_never_ends_is_refused(monkeypatch):
    monkeypatch.setattr(source_files, "_MAXIMUM_BYTES", 1000)
    (problem,) = problems_of(read_path, "/dev/zero")
    assert problem.code == "CQ002"
    assert len(read_path("/dev/zero", 10).data) == 10


def test_an_importer_that_fails_to_look_claims_nothing(monkeypatch):
    def fail(*_):
        raise ZeroDivisionError

    plugins = load_plugins()
    monkeypatch.setattr(plugins, "broken", [])
    monkeypatch.setattr(plugins, "_failed", set())
    monkeypatch.setattr("cqos_core.importers.format_detection.claims_bpmn", fail)
    for _ in range(2):
        info = recognise(Source("x.yaml", b"cqos: 1\n"), plugins)
        assert info is not None
        assert info.name == "yaml"
    assert [(broken.name, broken.reason) for broken in plugins.broken] == [("bpmn", "ZeroDivisionError")]


def test_an_unrecognised_format_is_an_error_with_help():
    (problem,) = problems_of(read_source, Source("x", b"hello"))
    assert problem.code == "CQ003"
    assert (problem.help or "").startswith("`cqos packs` lists")
    (problem,) = problems_of(read_source, Source("x", b"hello"), "nonsense")
    assert "there is no importer `nonsense`" in problem.message


def test_a_protocol_is_for_sources_that_state_none():
    stated = read_source(Source("x.yaml", b"cqos: 1\nprotocol: mqtt\nparticipants: {}\n"), protocol="ros2")
    unstated = read_source(Source("x.yaml", b"cqos: 1\nparticipants: {}\n"), protocol="ros2")
    assert (stated.protocol, unstated.protocol) == ("mqtt", "ros2")


def test_progress_of_reading_is_reported_step_by_step(folder):
    steps = []
    load_paths(["."], step=lambda done, of: steps.append((done, of)))
    assert steps == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
def test_an_included_pipe_without_a_writer_is_refused(tmp_path):
    os.mkfifo(tmp_path / "common.yaml")
    system = tmp_path / "system.yaml"
    system.write_text("cqos: 1\ninclude: [common.yaml]\nparticipants: {a: {}}\n")
    (problem,) = load_paths([str(system)]).problems
    assert problem.code == "CQ001"
    assert problem.message == "cannot be read: it is no regular file"
    assert (problem.place.source, problem.place.line) == (str(system), 2)


def write(folder, **texts):
    for name, text in texts.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def test_generated_and_ignored_files_are_not_read(tmp_path, monkeypatch):
    write(
        tmp_path,
        **dict.fromkeys(
            (
                *("build/a.yaml", "pkg/install/a.yaml", "log/a.yaml", "web/node_modules/a.yaml"),
                *("pkg/secret/a.yaml", "pkg/x_test.yaml", "pkg/kept_test.yaml", "pkg/deep/er/b.yaml", "pkg/c.yaml"),
                "old/a.yaml",
            ),
            "x",
        ),
        **{".gitignore": "# comment\n*_test.yaml\n!kept_test.yaml\n", "pkg/.gitignore": "/secret/\ndeep/**/b.yaml\n"},
    )
    monkeypatch.chdir(tmp_path)
    found = find_files(["."], load_plugins(), None, [read_ignore_patterns(["old/"], ".")])
    assert [file.path for file in found.files] == ["./pkg/c.yaml", "./pkg/kept_test.yaml"]
    assert sorted(found.not_searched) == [
        *("./build", "./log", "./old", "./pkg/install", "./pkg/secret", "./web/node_modules"),
    ]
    assert [file.path for file in find_files(["build"], load_plugins()).files] == ["build/a.yaml"]


def test_what_is_ignored_above_a_folder_holds_in_it_as_far_as_the_repository_goes(tmp_path):
    write(tmp_path, **{".gitignore": "*", "repo/.gitignore": "a.yaml", "repo/pkg/a.yaml": "x", "repo/pkg/b.yaml": "x"})
    (tmp_path / "repo" / ".git").mkdir()
    assert [Path(file.path).name for file in find_files([str(tmp_path / "repo/pkg")], load_plugins()).files] == [
        "b.yaml"
    ]


@pytest.mark.parametrize(
    ("pattern", "path", "excluded"),
    [
        ("a.yaml", "x/y/a.yaml", True),
        ("/a.yaml", "x/a.yaml", None),
        ("x/a.yaml", "x/a.yaml", True),
        ("x/*.yaml", "x/y/a.yaml", None),
        ("x/**/a.yaml", "x/a.yaml", True),
        ("**/y/a.yaml", "x/y/a.yaml", True),
        ("x/**", "x/y/a.yaml", True),
        ("?.yaml", "a.yaml", True),
        ("[!a].yaml", "a.yaml", None),
        ("[ab].yaml", "b.yaml", True),
        ("[b", "[b", None),
        ("a.yaml/", "a.yaml", None),
        ("\\#a", "#a", True),
        ("a  ", "a", True),
        ("!a.yaml", "a.yaml", False),
    ],
)
def test_patterns_are_those_of_gitignore(pattern, path, excluded, tmp_path):
    assert read_ignore_patterns([pattern], str(tmp_path)).decide(str(tmp_path / path), is_folder=False) is excluded
