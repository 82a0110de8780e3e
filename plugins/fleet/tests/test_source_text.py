"""``cqos packs ID --as`` prints the rules of a pack in another language."""

from __future__ import annotations

import pytest

from tests.command_process import run_here


@pytest.mark.parametrize(
    ("language", "begin"), [("sql", "-- The rules of rule pack"), ("javascript", "// The rules of")]
)
def test_a_pack_is_printed(language, begin, tmp_path):
    done = run_here(["packs", "ros2", "--as", language], tmp_path)
    assert done.code == 0
    assert done.out.startswith(begin)
    assert "ROS101" in done.out


def test_a_language_needs_a_pack(tmp_path):
    done = run_here(["packs", "--as", "sql"], tmp_path)
    assert done.code == 2
    assert "needs the ID of a rule pack" in done.err
