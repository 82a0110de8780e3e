"""What is known, and what is new."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.analysis.baseline import read_baseline, write_baseline
from cqos_core.model.finding import Finding, Severity, Side, Verdict
from cqos_core.model.problems import InputError
from cqos_core.model.report import Report
from cqos_core.model.settings import Place


def finding(code="ROS101", topic="scan", members=("a", "b"), **more):
    sides = (Side("subscriber", tuple(members), place=Place("x.yaml", 1)),) if members else ()
    values = {"severity": Severity.ERROR, "message": "it does not fit", **more}
    return Finding(code=code, name="a-name", topic=topic, sides=sides, **values)


def report(*findings):
    return Report(Verdict.INCOMPATIBLE, findings=findings)


def baseline_of(*findings, file=None, path="known.json"):
    return read_baseline(path, write_baseline(path, [(file, report(*findings))]).encode())


def is_known(known, now, file=None):
    (marked,) = known.mark(report(now), file).findings
    assert marked.accepted in {None, f"known: it is in the baseline {known.path}"}
    return marked.accepted is not None


def test_what_was_there_is_known_and_fails_no_more():
    known = baseline_of(finding())
    assert is_known(known, finding())
    assert not known.mark(report(finding())).fails()
    assert known.gone() == 0


@pytest.mark.parametrize(
    ("now", "expected"),
    [
        (finding(members=("a",)), True),
        (finding(message="other words"), True),
        (finding(severity=Severity.WARNING), True),
        (finding(members=("a", "b", "c")), False),
        (finding(members=("c",)), False),
        (finding(members=()), False),
        (finding(topic="map"), False),
        (finding(topic=None), False),
        (finding(more_topics=("map",)), False),
        (finding(more_codes=("ROS102",)), False),
        (finding(code="ROS102"), False),
    ],
    ids=lambda value: (
        "" if isinstance(value, bool) else f"{value.code} {value.topic} {value.endpoints} {value.message}"
    ),
)
def test_a_finding_is_known_by_code_topic_and_endpoints(now, expected):
    assert is_known(baseline_of(finding()), now) is expected


def test_new_pairs_of_old_endpoints_are_new():
    known = baseline_of(finding(members=("a", "x")), finding(members=("b", "y")))
    assert is_known(known, finding(members=("b", "y")))
    assert not is_known(known, finding(members=("a", "y")))


def test_one_cause_on_several_topics_is_known_on_each_of_them():
    known = baseline_of(finding(more_topics=("map", "tf")))
    assert is_known(known, finding(topic="map", more_topics=("tf",)))
    assert not is_known(known, finding(topic="map", more_topics=("odom",)))


def test_rules_of_one_cause_are_known_each_and_further_ones_are_new():
    known = baseline_of(finding(more_codes=("ROS102", "ROS103")))
    assert is_known(known, finding(code="ROS102", more_codes=("ROS103",)))
    assert not is_known(known, finding(code="ROS102", more_codes=("ROS104",)))


def test_a_merged_finding_is_known_if_each_of_its_rules_is():
    one, other = finding(), finding("ROS102", members=("a", "b", "c"))
    merged = finding(more_codes=("ROS102",), message="two rules at once")
    known = baseline_of(one, other)
    assert is_known(known, merged)
    assert known.gone() == 0
    assert not is_known(baseline_of(one), merged)
    assert not is_known(baseline_of(one, finding("ROS102", members=("a",))), merged)
    assert not is_known(known, finding(more_codes=("ROS102", "ROS103")))


def test_findings_without_topic_and_endpoints_differ_by_their_messages():
    known = baseline_of(finding("CQ603", None, (), message="`ROS1`", severity=Severity.WARNING))
    assert is_known(known, finding("CQ603", None, (), message="`ROS1`"))
    assert not is_known(known, finding("CQ603", None, (), message="`ROS2`"))


def test_an_entry_may_be_about_one_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").mkdir()
    known = baseline_of(finding(), file="a/x.yaml", path="a/known.json")
    assert [entry.file for entry in known.entries] == ["x.yaml"]
    assert is_known(known, finding(), str(tmp_path / "a" / "x.yaml"))
    assert not is_known(known, finding(), "a/y.yaml")
    assert not is_known(known, finding())


def test_entries_are_gone_only_if_their_file_was_checked():
    known = baseline_of(finding(), file="x.yaml")
    assert known.gone(["y.yaml"]) == 0
    assert known.gone(["x.yaml"]) == 1
    assert baseline_of(finding()).gone(["y.yaml"]) == 1


def test_notes_and_accepted_findings_are_not_kept():
    kept = baseline_of(finding(severity=Severity.NOTE), finding(accepted="we know"), finding(severity=Severity.WARNING))
    assert len(kept.entries) == 1


def test_the_reason_of_an_acceptance_stays():
    known = baseline_of(finding())
    (marked,) = known.mark(report(finding(accepted="we know"))).findings
    assert marked.accepted == "we know"
    assert known.gone() == 0


def test_the_file_can_be_compared_line_by_line():
    one, other = finding(members=("b", "a")), finding(topic="map")
    text = write_baseline("k", [(None, report(one, other))])
    assert text == write_baseline("k", [(None, report(other, one, one))])
    assert json.loads(text)["baseline"] == 1
    assert text.endswith("}\n")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it is no JSON"),
        ("[" * 100_000, "it is no JSON"),
        ("[]", "no object with the key `baseline`"),
        ('{"version": 1, "findings": []}', "no object with the key `baseline`"),
        ('{"baseline": 2, "findings": []}', "it has version 2, this C-QoS reads version 1"),
        ('{"baseline": 1}', "`findings` is no list"),
        ('{"baseline": 1, "findings": [1]}', "`findings[0]` is no object"),
        ('{"baseline": 1, "findings": [{"code": "X"}]}', "`findings[0].message` is no text"),
        (
            '{"baseline": 1, "findings": [{"code": "X", "message": "", "topics": "t"}]}',
            "`findings[0].topics` is no list",
        ),
    ],
    ids=lambda value: value[:60],
)
def test_a_malformed_baseline_is_refused_with_the_reason(text, said):
    with pytest.raises(InputError) as raised:
        read_baseline("known.json", text.encode())
    (problem,) = raised.value.problems
    assert (problem.code, problem.place) == ("CQ606", Place("known.json"))
    assert said in problem.message
    assert problem.help == "write it anew with --write-baseline"


NAMES = st.sampled_from("abcde")
FINDINGS = st.builds(
    finding,
    code=st.sampled_from(["ROS101", "ROS102", "CQ404"]),
    topic=st.none() | NAMES,
    members=st.lists(NAMES, max_size=4),
    message=st.sampled_from(["one", "other"]),
    more_topics=st.lists(NAMES, max_size=2).map(tuple),
)


@given(st.lists(FINDINGS, max_size=5), FINDINGS)
def test_a_baseline_knows_what_it_was_written_from_and_never_hides_an_endpoint(old, new):
    known = baseline_of(*old)
    assert not known.mark(report(*old)).fails()
    if is_known(known, new):
        assert any(each.code == new.code and set(new.endpoints) <= set(each.endpoints) for each in old)
