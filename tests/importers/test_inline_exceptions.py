"""Exceptions in comments of system files: what they accept, and what becomes of those that accept nothing."""

import pytest

from cqos_core import check, read

HEAD = "cqos: 1\nprotocol: ros2\n"
PAIR = """participants:
  a: {publishes: {/t: {reliability: best_effort}}}%s
  b:
    subscribes:
      /t:%s
        reliability: reliable%s
"""


def found(text):
    """Code, line and reason of acceptance of each error and warning."""
    report = check(text.encode())
    return [
        (each.code, each.place and each.place.line, each.accepted)
        for each in report.findings
        if each.severity != "note"
    ]


def one(text):
    (entry,) = found(text)
    return entry


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("rule", ["ROS101", "ros101", "reliability-weaker-than-requested", "ROS104, ROS101"])
def test_a_comment_at_either_end_or_at_the_setting_accepts_the_finding(place, rule):
    comments = ["", "", ""]
    comments[place] = f"  # cqos: ignore[{rule}] losses are fine"
    accepted = [entry for entry in found(HEAD + PAIR % tuple(comments)) if entry[0] == "ROS101"]
    assert accepted == [("ROS101", 8, "losses are fine")]


def test_a_comment_of_its_own_line_is_about_the_next_line_with_more():
    text = HEAD + PAIR % ("", "\n        # cqos: ignore[ROS101] losses are fine\n\n        # why not", "")
    assert one(text)[2] == "losses are fine"


def test_a_comment_is_about_its_endpoint_only():
    text = HEAD + (PAIR % ("", "", "  # cqos: ignore[ROS101] x")) + "  c: {subscribes: {/t: {reliability: reliable}}}\n"
    assert [accepted for _, _, accepted in found(text)] == ["x", None]


def test_a_comment_at_a_topic_accepts_for_all_its_endpoints():
    topic = "topics:\n  /t: {period: 1s}  # cqos: ignore[ROS101] x\n"
    text = HEAD + topic + (PAIR % ("", "", "")) + "  c: {subscribes: {/t: {reliability: reliable}}}\n"
    assert {accepted for code, _, accepted in found(text) if code == "ROS101"} == {"x"}


def test_a_comment_at_a_profile_accepts_for_all_that_use_it_and_is_one_exception():
    text = HEAD + (
        "profiles:\n  base: {reliability: best_effort}  # cqos: ignore[ROS101] x\n  loose: {profile: base}\n"
        "participants:\n  a: {publishes: {/t: {profile: loose}, /u: {profile: loose}}}\n"
        "  b: {subscribes: {/t: {reliability: reliable}, /u: {reliability: best_effort}}}\n"
    )
    assert [(code, accepted) for code, _, accepted in found(text)] == [("ROS101", "x")]


def test_instances_of_one_endpoint_are_one_exception():
    text = HEAD + (
        "instances: {n: 3}\nparticipants:\n  'a${n}': {publishes: {'/t${n}': {reliability: best_effort}}}\n"
        "  b: {subscribes: {'/t${n}': {reliability: reliable}}} # cqos: ignore[ROS101] x\n"
    )
    assert {accepted for _, _, accepted in found(text)} == {"x"}


def test_an_exception_that_matches_nothing_is_reported_once():
    text = HEAD + PAIR % ("", "", "  # cqos: ignore[ROS101, ROS104] x")
    assert found(text)[1:] == [("CQ601", 8, None)]


@pytest.mark.parametrize(
    ("comment", "said"),
    [
        ("ignore[ROS101]", "the exception from ROS101 gives no reason, so it accepts nothing"),
        ("ignore ROS101 x", "the exception `ignore ROS101 x` names no rule in brackets, so it accepts nothing"),
        ("ignore[] x", "the exception `ignore[] x` names no rule in brackets, so it accepts nothing"),
        ("ingore[ROS101] x", "the exception `ingore[ROS101] x` names no rule in brackets, so it accepts nothing"),
    ],
)
def test_an_exception_that_is_incomplete_accepts_nothing_and_is_reported(comment, said):
    report = check((HEAD + PAIR % ("", "", f" # cqos: {comment}")).encode())
    assert [(each.code, each.message) for each in report.findings if each.code == "CQ607"] == [("CQ607", said)]
    assert not report.ok


def test_an_exception_beside_nothing_is_reported():
    assert {code for code, _, _ in found(HEAD + PAIR % ("", "", "") + "# cqos: ignore[ROS101] x\n")} == {
        "ROS101",
        "CQ607",
    }
    text = (HEAD + PAIR % ("", "", "")).replace("participants:", "participants: # cqos: ignore[ROS101] x")
    assert ("CQ607", 3, None) in found(text)


@pytest.mark.parametrize("line", ["# cqos: 1", "system: 'a # cqos: ignore[ROS101] x'", "# cqos: see the manual"])
def test_texts_and_other_comments_are_no_exceptions(line):
    assert [code for code, _, _ in found(f"{HEAD}{line}\n" + PAIR % ("", "", ""))] == ["ROS101"]


def test_letters_before_the_comment_and_other_encodings_do_not_move_it():
    text = HEAD + "system: Käse\n" + PAIR % ("", "", "  # cqos: ignore[ROS101] Käse läuft")
    assert one(text)[2] == "Käse läuft"
    report = check(text.encode("utf-16"))
    assert [each.accepted for each in report.findings if each.code == "ROS101"] == ["Käse läuft"]


def test_it_is_an_acceptance_with_the_place_of_the_comment(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(HEAD + PAIR % ("", "", "  # cqos: ignore[ROS101] x"), encoding="utf-8")
    (entry,) = read(file).accept
    assert (entry.rule, entry.because, entry.endpoint) == ("ROS101", "x", "b/subscriber/t")
    assert str(entry.place) == f"{file}:8:32"
    assert check(read(file)).ok
