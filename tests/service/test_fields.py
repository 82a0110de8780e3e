"""A caller pays for what it reads: fields of a report and severities that it asks for, and no others."""

import base64
import json

import grpc
import pytest
from google.protobuf import field_mask_pb2

import cqos_core as cqos
from cqos.v1 import check_pb2, check_pb2_grpc, report_pb2
from cqos_core import Finding, Severity
from cqos_core.remote.asked import write_pair
from cqos_core.remote.client import ServiceError
from cqos_core.remote.messages import report_message

SYSTEM = """
cqos: 1
protocol: ros2
participants:
  a: {publishes: {/scan: {reliability: best_effort}, /lonely: {}}}
  b: {subscribes: {/scan: {reliability: reliable, depth: 1}}}
"""


@pytest.fixture(scope="module")
def report():
    return cqos.check(SYSTEM.encode())


def kept(message, *paths):
    """What is left of a message with some of its fields: an independent way, by the library of protobuf."""
    masked = type(message)()
    for path in paths:
        first, _, rest = path.partition(".")
        if not rest:
            field_mask_pb2.FieldMask(paths=[first]).MergeMessage(message, masked, True, True)
            continue
        for position, each in enumerate(getattr(message, first)):
            while len(getattr(masked, first)) <= position:
                getattr(masked, first).add()
            getattr(masked, first)[position].MergeFrom(kept(each, rest))
    return masked


@pytest.mark.parametrize(
    "paths",
    [
        ("verdict",),
        ("counts", "topics"),
        ("findings.code", "findings.severity", "groups"),
        ("findings.remedies", "findings.place", "findings.sides.members"),
        ("groups.pairs", "findings.sides.facts.origin_kind"),
    ],
)
def test_a_message_has_the_fields_that_were_asked_for(report, paths):
    assert report_message(report, frozenset(paths)) == kept(report_message(report), *paths)


def test_words_and_fixes_that_no_field_asks_for_are_not_computed(monkeypatch):
    def never(*_arguments):
        raise AssertionError("it was computed")

    report = cqos.check(SYSTEM.encode())
    assert report.findings  # made and brought into order, which reads words
    for name in ("message", "remedies"):
        monkeypatch.setattr(Finding, name, property(never))
    assert len(report_message(report, frozenset({"verdict", "counts", "findings.code"})).findings) == len(
        report.findings
    )
    with pytest.raises(AssertionError, match="it was computed"):
        report_message(report)


def test_counts_are_those_of_the_whole_report(report):
    assert {finding.severity for finding in report.findings} >= {Severity.ERROR, Severity.NOTE}
    whole, errors = report_message(report), report_message(report, least_severe=Severity.ERROR)
    assert (errors.counts, errors.verdict) == (whole.counts, whole.verdict)
    assert list(errors.findings) == [each for each in whole.findings if each.severity == report_pb2.SEVERITY_ERROR]


def test_the_service_sends_what_was_asked_for(client, report):
    for inputs in (SYSTEM.encode(), cqos.read(SYSTEM.encode())):
        found = client.check(inputs, fields=["verdict", "findings.code", "findings.severity"], least_severe="warning")
        louder = [each for each in report.findings if each.severity is not Severity.NOTE]
        assert found.verdict == report.verdict
        assert [each.code for each in found.findings] == [each.code for each in louder]
        assert {each.message for each in found.findings} == {""}
        assert not found.groups
    assert client.check_system(cqos.read(SYSTEM.encode()), fields=["topics"]).topics == report.topics


def test_pairs_and_streams_of_pairs_too(service):
    asked = check_pb2.CheckPairRequest(
        protocol="ros2", requested={"depth": "1"}, fields=field_mask_pb2.FieldMask(paths=["verdict"])
    )
    wanted = kept(write_pair(report_pb2.PairReport(), cqos.check_pair("ros2", {}, {"depth": "1"})), "verdict")
    with grpc.insecure_channel(service.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        assert checks.CheckPair(asked, timeout=20).report == wanted
        (answer,) = checks.CheckPairs(iter([check_pb2.CheckPairsRequest(pair=asked)]), timeout=20)
        assert answer.report == wanted


def test_json_writes_fields_as_json_does(service):
    body = {"protocol": "ros2", "fields": "verdict,findings.code"}
    headers = {"content-type": "application/json"}
    service.page.request("POST", "/cqos.v1.CheckService/CheckPair", json.dumps(body), headers)
    assert json.load(service.page.getresponse())["report"].keys() <= {"verdict", "findings"}


def test_json_leaves_out_less_severe_findings_in_calls_and_in_sessions(service, report):
    documents = {"documents": [{"name": "fleet.yaml", "content": base64.b64encode(SYSTEM.encode()).decode()}]}
    asked = {"leastSevere": "SEVERITY_WARNING"}
    calls = {
        "/cqos.v1.CheckService/CheckDocument": {**documents, **asked},
        "/cqos.v1.SessionService/OpenSession": {"documents": documents, **asked},
    }
    louder = [each.code for each in report.findings if each.severity is not Severity.NOTE]
    assert len(louder) < len(report.findings)
    for path, body in calls.items():
        service.page.request("POST", path, json.dumps(body), {"content-type": "application/json"})
        answer = json.load(service.page.getresponse())["report"]
        assert [each["code"] for each in answer["findings"]] == louder
        assert sum(int(answer["counts"].get(each, 0)) for each in ("errors", "warnings", "notes")) == len(
            report.findings
        )


def test_a_field_that_there_is_not_is_refused_with_those_that_there_are(client):
    with pytest.raises(ServiceError) as caught:
        client.check(SYSTEM.encode(), fields=["verdict", "findings.colour"])
    (problem,) = caught.value.fields
    assert problem.field == "fields"
    assert problem.description.startswith("`findings.colour`: no field `colour`; there are code, name, severity, ")
    with pytest.raises(ServiceError, match="at most 100"):
        client.check(SYSTEM.encode(), fields=["verdict"] * 101)
