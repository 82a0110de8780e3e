"""Findings about an end that leave all its pairs at best unknown."""

from dataclasses import replace

import pytest

from cqos_core import Endpoint, Participant, Place, Session, Setting, System, check, explain
from cqos_core.language.expression import as_condition, offered, requested
from cqos_core.model.system import ImportNote, Role
from cqos_core.packs.rule import forbids, requires
from cqos_core.packs.rule_docs import as_text, rule_page
from tests.made_up_protocol import CARE, POST, RETURNED, checked, reader, world, writer


def test_an_error_of_the_importer_about_an_endpoint_leaves_its_pairs_unknown():
    system = world(writer("box", "w"), writer("box", "v"), reader("box", "r"))
    note = ImportNote("CQ042", "error", "a part of `w` is not understood", endpoint="w")
    verdicts = {"w": "unknown", "v": "compatible"}
    report = checked(replace(system, notes=[note]))
    assert {pair.publisher: str(pair.verdict) for pair in report.pairs} == verdicts
    assert {group.codes for group in report.groups if "w" in group.publishers} == {("CQ042",)}
    session = Session(system, packs=[POST])
    assert session.report().verdict == "compatible"
    session.set_notes([note])
    assert session.report().verdict == "unknown"
    assert checked(replace(system, notes=[replace(note, severity="warning")])).verdict == "compatible"


def test_a_client_that_names_none_of_several_brokers_is_not_compatible_with_anything():
    text = """
cqos: 1
protocol: mqtt
brokers: {one: {}, two: {}}
participants:
  a: {broker: one, publishes: {t: {}}}
  b: {subscribes: {t: {}}}
  c: {broker: one, subscribes: {t: {}}}
"""
    report = check(text.encode())
    verdicts = {pair.subscriber.partition("/")[0]: str(pair.verdict) for pair in report.pairs}
    assert verdicts == {"b": "unknown", "c": "compatible"}
    assert [group.codes for group in report.groups if "b/subscriber/t" in group.subscribers] == [("CQ216",)]


def test_groups_of_endpoints_are_refused_where_the_protocol_has_none():
    text = """
cqos: 1
protocol: {protocol}
participants:
  a: {publishers: {front: {reliability: reliable, publishes: {t: {}}}}, subscribes: {u: {}}}
  b: {subscribes: {t: {}}}
  c: {publishes: {v: {}}}
  d: {subscribes: {v: {}}}
"""
    report = check(text.replace("{protocol}", "ros2").encode())
    (finding,) = [each for each in report.findings if each.code == "CQ202"]
    assert "participant `a` states `publishers`, which ROS 2 does not know" in finding.message
    assert (finding.place.line, finding.help) == (5, "write `publishes:` and `subscribes:` at the participant itself")
    assert {pair.topic: str(pair.verdict) for pair in report.pairs} == {"/t": "unknown", "/v": "compatible"}
    assert "CQ202" not in {each.code for each in check(text.replace("{protocol}", "dds").encode()).findings}


def report_with(kind, care="unknown", **more):
    rule = kind(CARE >= "signed", code="POST999", name="of-one-end", because="it is so", role="subscriber", **more)
    packs = [replace(POST, rules=(*POST.rules, rule))]
    return checked(writer("box", care="insured"), reader("box", care=care), packs=packs)


def what_a_rule_says(kind, **more):
    report = report_with(kind, **more)
    said = [(str(finding.severity), finding.endpoints) for finding in report.findings if finding.code == "POST999"]
    return said, {code for group in report.groups for code in group.codes if code == "POST999"}


def test_a_requirement_on_an_end_that_cannot_be_decided_leaves_its_pairs_unknown():
    assert what_a_rule_says(requires, severity="error") == ([("warning", ("reader",))], {"POST999"})
    assert what_a_rule_says(requires, severity="note") == ([("note", ("reader",))], set())


def test_what_cannot_be_decided_stays_silent_about_creation_and_what_is_forbidden():
    assert what_a_rule_says(requires, severity="error", creation=True) == ([], set())
    assert what_a_rule_says(forbids, severity="error") == ([], set())


@pytest.mark.parametrize(
    ("severity", "care", "said", "verdict"),
    [
        ("error", "signed", "error", "incompatible"),
        ("error", "unknown", "warning", "unknown"),
        ("error", "usual", "warning", "unknown"),
        ("error", "insured", None, "compatible"),
        ("warning", "signed", "warning", "compatible"),
        ("warning", "unknown", None, "compatible"),
    ],
)
def test_an_error_that_forbids_pairs_leaves_those_unknown_that_it_cannot_decide(severity, care, said, verdict):
    condition = (offered(CARE) == "insured") & (requested(CARE) == "signed")
    rule = forbids(condition, code="POST999", name="of-pairs", because="it is so", severity=severity)
    packs = [replace(POST, rules=(*POST.rules, rule))]
    report = checked(writer("box", care="insured"), reader("box", care=care), packs=packs)
    assert report.verdict == verdict
    assert [str(each.severity) for each in report.findings if each.code == "POST999"] == ([said] if said else [])


def test_the_page_of_such_a_rule_says_so():
    rule = forbids(offered(CARE) > requested(CARE), code="POST999", name="n", because="b", severity="error")
    pack = replace(POST, rules=(*POST.rules, rule))
    text = " ".join(as_text(rule_page(next(each for each in pack.bound_rules if each.rule is rule), pack)).split())
    assert "Error; a warning if it cannot be decided." in text
    assert "If this holds for a publisher and a subscriber that match, the pair is incompatible." in text


def test_a_requirement_that_holds_under_some_assumptions_is_one_of_them():
    report = report_with(requires, care="usual")
    assert (report.verdict, "POST999" in {finding.code for finding in report.findings}) == ("compatible", False)
    assert {each.option: each.values for each in report.assumed} == {"post.carrier": ("train", "ship")}


def test_a_requirement_on_an_end_is_not_decided_by_what_its_role_lacks():
    system = world(writer("box"), reader("box"))
    rule = requires(as_condition(RETURNED), code="POST999", name="of-one-end", because="it is so")
    report = checked(system, packs=[replace(POST, rules=(*POST.rules, rule))])
    assert [finding.endpoints for finding in report.findings if finding.code == "POST999"] == [("writer",)]


def not_read(line: int, code: str = "CQ040") -> ImportNote:
    return ImportNote(code, "warning", f"line {line} is not read", Place("file", line))


@pytest.mark.parametrize(
    ("notes", "told"),
    [
        ([not_read(3), not_read(4)], ["line 3 is not read"]),
        ([not_read(4)], ["line 4 is not read"]),
        ([not_read(3), not_read(3, "CQ041")], ["line 3 is not read"]),
        (
            [ImportNote("CQ042", "error", "it is not understood", endpoint="subscriber"), not_read(3)],
            ["it is not understood", "line 3 is not read"],
        ),
    ],
)
def test_a_pair_names_what_its_importer_did_not_read(notes, told):
    """What an importer reports stands at a value, or somewhere; a pair that it leaves open has a cause in any case."""
    unread = Setting("", Place("file", 3), unknown="it is not read", reported="CQ040")
    ends: dict[Role, Setting] = {"publisher": unread, "subscriber": Setting("reliable")}
    system = System(protocol="ros2", notes=notes)
    for role, reliability in ends.items():
        system.participants[role] = Participant(role)
        stated = {"reliability": reliability}
        system.endpoints.append(Endpoint(id=role, role=role, topic="/t", participant=role, settings=stated))
    report = explain(system, publisher="publisher", subscriber="subscriber")
    assert report.verdict == "unknown"
    assert [each.message for each in report.findings] == told
