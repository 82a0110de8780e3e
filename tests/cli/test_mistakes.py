"""Thirty mistakes that people make in a system file: what the command says, to the letter.

``python -m tests.cli.test_mistakes`` writes the texts anew; then read them as the person who made the mistake.
"""

import os
from pathlib import Path

import pytest

from tests.command import run

FOLDER = Path(__file__).with_name("mistakes")
FILES = sorted(FOLDER.glob("*.yaml"))


def said(file):
    done = run(["check", file.name, "--no-config"], FOLDER, {**os.environ, "COLUMNS": "100"}, together=True)
    return f"{done.out}exit code {done.code}\n"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_mistake_is_named_with_its_place_and_what_to_do(file):
    text = said(file)
    assert text == file.with_suffix(".txt").read_text(encoding="utf-8")
    assert f"{file.name}:" in text
    assert "help: " in text
    assert ": compatible: " not in text


def test_there_are_thirty():
    assert len(FILES) == 30


if __name__ == "__main__":
    for each in FILES:
        each.with_suffix(".txt").write_text(said(each), encoding="utf-8")
