"""Findings arrive in the editor: those of `cqos check`, of the text that is open, in every file of the system."""

import pytest

from plugins.editor.tests.client import Client

PAIR = """\
cqos: 1
protocol: ros2
participants:
  a: {publishes: {/scan: {reliability: best_effort}}}
  b: {subscribes: {/scan: {reliability: reliable}}}
"""


def test_findings_have_both_places_and_follow_the_text(editor, tmp_path):
    design = tmp_path / "design.yaml"
    design.write_text("cqos: 1\n")
    assert editor.open(design, PAIR) == [("ROS101", 4, 40, 48)]
    [found] = editor.diagnostics[design.as_uri()]
    assert found["severity"] == 1
    [other] = found["relatedInformation"]
    assert other["message"] == "offered here: reliability best_effort"
    assert other["location"]["range"]["start"] == {"line": 3, "character": 39}

    assert editor.change(design, PAIR.replace("best_effort", "reliable")) == []
    assert editor.change(design, PAIR.replace("reliable}}}", "reliable")) == [("CQ001", 4, 26, 48)]
    assert editor.change(design, PAIR.replace("cqos: 1", "cqos: 2")) == [("CQ004", 0, 6, 7)]
    assert editor.change(design, PAIR) == [("ROS101", 4, 40, 48)]


@pytest.mark.parametrize(("encodings", "moved"), [(None, 1), (["utf-8"], 3), (["utf-32", "utf-16"], 0)])
def test_columns_count_units_of_utf_16_unless_the_client_wants_others(tmp_path, encodings, moved):
    with Client(encodings=encodings) as editor:
        assert editor.open(tmp_path / "design.yaml", PAIR.replace("  b:", "  \U0001d4b7:")) == [
            ("ROS101", 4, 40 + moved, 48 + moved)
        ]


def test_an_included_file_counts_as_it_is_open_and_shows_its_findings(editor, tmp_path):
    """The disk has other texts than the editor, and the mistake stands in the file that is included."""
    whole, part = tmp_path / "whole.yaml", tmp_path / "part.yaml"
    whole.write_text(PAIR)
    part.write_text("cqos: 1\n")
    editor.work_in(tmp_path)
    first, *_, last = PAIR.splitlines(keepends=True)
    assert editor.open(whole, f"{first}include: part.yaml\nprotocol: ros2\nparticipants:\n{last}") == [
        ("CQ401", 4, 19, 24),
        ("CQ404", 0, 0, 0),
    ]
    assert editor.open(part, PAIR.replace(last, "")) == []
    assert editor.shown(whole) == [("ROS101", 4, 40, 48)]
    assert editor.change(part, PAIR.replace(last, "").replace("best_effort", "bst_effort")) == [("CQ203", 3, 39, 49)]
    assert editor.change(part, PAIR.replace(last, "").replace("best_effort", "reliable")) == []
    assert editor.shown(whole) == []


def test_parts_of_a_folder_are_checked_together_and_configurations_are_read_from_the_editor(editor, tmp_path):
    config, design, pack = tmp_path / "cqos.toml", tmp_path / "design.yaml", tmp_path / "telegrams.yaml"
    config.write_text("")
    pack.write_text(PACK)
    design.write_text(PAIR)
    editor.work_in(tmp_path)
    assert editor.open(design, PAIR.replace("protocol: ros2\n", ""))[0][0] == "CQ201"
    assert editor.open(config, 'protocol = "ros2"\n') == []
    assert editor.shown(design) == [("ROS101", 3, 40, 48)]
    assert editor.change(config, 'protocl = "ros2"\n') == [("CQ006", 0, 0, 16)]
    assert editor.change(config, 'protocol = "telegrams"\npacks = ["telegrams.yaml"]\n') == []
    assert editor.change(design, TELEGRAMS) == [("TEL101", 4, 38, 43)]
    assert editor.open(pack, PACK.replace("requested(limit)", "requested(limt)")) == [("CQ011", 10, 14, 47)]


PACK = """\
cqos_pack: 1
id: telegrams
title: Telegrams
policies:
  cycle: {kind: duration, default: 100ms, roles: [publisher], doc: Time between two telegrams., clause: Part 4}
  limit: {kind: duration, default: infinite, roles: [subscriber]}
  mode: {kind: choice, values: [slow, fast], default: slow}
presets:
  quick: {settings: {mode: fast}, doc: For drives.}
rules:
  - requires: offered(cycle) <= requested(limit)
    code: TEL101
    name: cycle-longer-than-limit
    because: the receiver reports a fault between two telegrams
"""
TELEGRAMS = """\
cqos: 1
protocol: telegrams
participants:
  press: {publishes: {force: {cycle: 200ms}}}
  panel: {subscribes: {force: {limit: 150ms}}}
"""
