"""System files under cases/yaml: those that read cleanly, and the exact messages on the others.

``bad/x.yaml`` is refused with the problems in ``bad/x.txt``, ``trap/x.yaml`` is read with the notes in ``trap/x.txt``.
"""

from pathlib import Path

import pytest

from cqos_core.model.codes import CODES
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place
from cqos_core.model.source import ReadContext, Source
from cqos_core.plugins import load_plugins, named

read = named(load_plugins().importers["yaml"].reader)
CASES = Path(__file__).parent / "cases" / "yaml"


def case_files(folder):
    return [
        pytest.param(file, id=file.name)
        for file in sorted((CASES / folder).iterdir())
        if file.suffix in {".yaml", ".json"}
    ]


def open_case(name, relative_to):
    path = Path(relative_to).parent / name
    try:
        return Source(str(path), (CASES / path).read_bytes())
    except OSError as error:
        raise InputError([Problem("CQ007", f"cannot open `{path}`: {error.strerror}", Place(relative_to))]) from None


def read_case(file):
    return read(Source(str(file.relative_to(CASES)), file.read_bytes()), ReadContext(open_case))


def said(problem):
    return f"{problem.code} {problem}"


def expected(file):
    return file.with_suffix(".txt").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("file", case_files("good"))
def test_good_file_is_read_without_a_word(file):
    assert read_case(file).notes == []


@pytest.mark.parametrize("file", case_files("bad"))
def test_bad_file_is_refused_with_every_problem(file):
    with pytest.raises(InputError) as refused:
        read_case(file)
    assert [said(problem) for problem in refused.value.problems] == expected(file)


@pytest.mark.parametrize("file", case_files("trap"))
def test_a_trap_is_a_warning_and_the_rest_is_read(file):
    notes = read_case(file).notes
    assert [f"{note.code} {note.place}: {note.message} ({note.help})" for note in notes] == expected(file)
    assert {(note.severity, note.code) for note in notes} <= {("warning", code) for code in ("CQ019", "CQ020", "CQ021")}


def test_every_code_of_the_reader_has_a_case():
    lines = [line for folder in ("bad", "trap") for file in (CASES / folder).glob("*.txt") for line in expected(file)]
    of_the_reader = {code for code in CODES if code.startswith("CQ") and code < "CQ029"}  # that is about what was read
    assert {line.split()[0] for line in lines} == of_the_reader
