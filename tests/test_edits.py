"""Edits as new texts: comments and layout stay, and nothing is changed but what an edit names."""

import pytest

import cqos_core as cqos
from cqos_core import Edit, Place
from cqos_core.files.text_edits import edited_text
from cqos_core.files.yaml_edits import insert
from cqos_core.model.source import Source
from cqos_core.plugins import load_plugins, named

insert_bpmn = named(load_plugins().importers["bpmn"].inserter)


def change(text, *edits, inserter=insert):
    made = edited_text(Source("s", text.encode()), edits, lambda: inserter)
    return made.data.decode(), [reason for _, reason in made.left]


def replace(line, column, old, new, name="care"):
    return Edit(Place("s", line, column), name, old, new)


def add(line, column, value, name="care"):
    return Edit(Place("s", line, column), name, None, value)


@pytest.mark.parametrize(
    ("before", "edit", "after"),
    [
        ("t: {care: plain}  # cheap\n", replace(1, 11, "plain", "signed"), "t: {care: signed}  # cheap\n"),
        ("t:\r\n  care: 'plain'\r\n", replace(2, 9, "plain", "it's"), "t:\r\n  care: 'it''s'\r\n"),
        ('{"t": {"care": "plain"}}', replace(1, 16, "plain", "signed"), '{"t": {"care": "signed"}}'),
        ('{"t": {"care": ["a"]}}', replace(1, 16, "[a]", "[b, c]"), '{"t": {"care": ["b", "c"]}}'),
        ("t:\n  care: [a, b] # both\n", replace(2, 9, "[a, b]", "[a]"), "t:\n  care: [a] # both\n"),
        ("t:\n  care:\n  - a\n  - b\nu: 1\n", replace(3, 3, "[a, b]", "[a]"), "t:\n  care: [a]\nu: 1\n"),
        (
            "t:\n  will:\n    topic: gone # here\n    qos: 2\n",
            replace(3, 5, "2", "1", "will.qos"),
            "t:\n  will:\n    topic: gone # here\n    qos: 1\n",
        ),
        ("t: {depth: 5, care: plain}", replace(1, 21, "plain", "signed"), "t: {depth: 5, care: signed}"),
        ("listener 1883\nmax_qos 2\n", replace(2, None, "2", "1"), "listener 1883\nmax_qos 1\n"),
        ("<a>\n <b k='plain &amp; x'/>\n</a>", replace(2, 5, "plain & x", "<y>"), "<a>\n <b k='&lt;y&gt;'/>\n</a>"),
        ("<a>\n <kind> PLAIN </kind>\n</a>", replace(2, 2, "PLAIN", "SIGNED"), "<a>\n <kind> SIGNED </kind>\n</a>"),
    ],
)
def test_a_value_is_replaced_where_it_stands(before, edit, after):
    assert change(before, edit) == (after, [])


@pytest.mark.parametrize(
    ("before", "edit", "after"),
    [
        ("p:\n  t: {}  # none\n", add(2, 3, "signed"), "p:\n  t: {care: signed}  # none\n"),
        ("p:\n  t: { copies: 1 }\n", add(2, 3, "signed"), "p:\n  t: { copies: 1, care: signed }\n"),
        ("p:\n  t:\nq: 1\n", add(2, 3, "signed"), "p:\n  t: {care: signed}\nq: 1\n"),
        ("p:\n  t: ~\n", add(2, 3, "signed"), "p:\n  t: {care: signed}\n"),
        ("p:\n  t: fast # profile\n", add(2, 3, "signed"), "p:\n  t: {profile: fast, care: signed} # profile\n"),
        (
            "p:\n  t:\n    copies: 1  # one\n  u: 2\n",
            add(2, 3, "signed"),
            "p:\n  t:\n    copies: 1  # one\n    care: signed\n  u: 2\n",
        ),
        (
            "p:\n  t:\n  - id: a\n    copies: 1\n  - id: b\n",
            add(3, 5, "signed"),
            "p:\n  t:\n  - id: a\n    copies: 1\n    care: signed\n  - id: b\n",
        ),
        (
            "p:\n  t:\n    needs:\n      latest: true\n",
            add(2, 3, "signed"),
            "p:\n  t:\n    care: signed\n    needs:\n      latest: true\n",
        ),
        ('{"p": {"t": {}}}', add(1, 8, "signed"), '{"p": {"t": {"care": "signed"}}}'),
        ("p:\n  t: {}", add(2, 3, "a: b"), 'p:\n  t: {care: "a: b"}'),
    ],
)
def test_a_setting_is_added_to_a_map(before, edit, after):
    assert change(before, edit) == (after, [])


def test_several_settings_of_one_map_are_added_together():
    text, left = change("t: {}", add(1, 1, "signed"), add(1, 1, "5", "copies"))
    assert (text, left) == ("t: {care: signed, copies: 5}", [])


@pytest.mark.parametrize(
    ("text", "edit", "reason"),
    [
        ("t: {care: signed}", replace(1, 11, "plain", "x"), "`plain` does not stand there"),
        ("a: &a {}\nt: *a\n", add(2, 1, "x"), "has no place for `care`"),
        ("- [a, b]", add(1, 3, "x"), "has no place"),
        ("max_qos 2 2", replace(1, None, "2", "1"), "`2` does not stand there"),
    ],
)
def test_what_cannot_be_edited_is_left(text, edit, reason):
    after, (left,) = change(text, edit)
    assert after == text
    assert reason in left


def test_of_two_edits_of_one_text_one_is_left():
    text, left = change("t: plain", replace(1, 4, "plain", "a"), replace(1, 4, "plain", "b"))
    assert text in {"t: a", "t: b"}
    assert left == ["another edit changes the same text"]


def test_the_encoding_of_a_file_stays():
    data = "t: plain # ü\n".encode("utf-16")
    source = Source("s", data)
    made = edited_text(source, [replace(1, 4, "plain", "signed")], lambda: None)
    assert made.data.decode("utf-16") == "t: signed # ü\n"


BPMN = """<?xml version="1.0"?>
<d xmlns:q="http://qos" id="d">
  <e id="x" name="n"/>
</d>
"""


def test_a_setting_is_added_to_an_element_with_the_prefix_of_its_document():
    edit = Edit(Place("s", 3, None, "x"), "reliability", None, "reliable")
    text, left = change(BPMN, edit, inserter=insert_bpmn)
    assert left == []
    assert '<e q:reliability="reliable" id="x" name="n"/>' in text


def test_a_document_without_the_namespace_gets_it():
    edit = Edit(Place("s", 3, None, "x"), "reliability", None, "reliable")
    text, _ = change(BPMN.replace(' xmlns:q="http://qos"', ""), edit, inserter=insert_bpmn)
    assert '<e xmlns:qos="http://qos" qos:reliability="reliable" id="x"' in text


SYSTEM = b"""cqos: 1
protocol: ros2
participants:
  lidar: {publishes: {/scan: {reliability: best_effort}}}   # cheap
  planner: {subscribes: {/scan: {reliability: reliable}}}
"""


def test_apply_gives_new_texts_and_a_diff():
    (finding,) = cqos.check(SYSTEM).findings
    edited = cqos.apply(SYSTEM, finding.remedies[:1])
    assert edited.left == ()
    assert "+  lidar: {publishes: {/scan: {reliability: reliable}}}   # cheap" in edited.diff()
    assert cqos.check(edited.texts["<bytes>"]).verdict == "compatible"


def test_apply_writes_files_only_when_asked(tmp_path):
    file = tmp_path / "system.yaml"
    file.write_bytes(SYSTEM)
    report = cqos.check(file)
    edited = cqos.apply(file, report.findings[0].remedies[:1])
    assert file.read_bytes() == SYSTEM
    edited.write()
    assert cqos.check(file).verdict == "compatible"


def test_an_edit_of_another_input_is_left():
    stranger = Edit(Place("elsewhere.yaml", 1, 1), "reliability", "a", "b")
    assert [reason for _, reason in cqos.apply(SYSTEM, [stranger]).left] == ["`elsewhere.yaml` is none of the inputs"]


def test_what_was_observed_is_never_edited():
    seen = SYSTEM.replace(b"{reliability: best_effort}", b"{reliability: best_effort, observed: true}")
    (finding,) = [each for each in cqos.check(seen).findings if each.code == "ROS101"]
    assert [bool(remedy.edits) for remedy in finding.remedies if remedy.role == "publisher"] == [False]
