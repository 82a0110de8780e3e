"""Sessions of single calls, by gRPC and by Connect: as a page in a browser edits its documents."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import socket
import time

import grpc
import pytest
from google.protobuf import json_format
from google.rpc import error_details_pb2, status_pb2

from cqos.v1 import check_pb2, report_pb2, session_pb2, session_pb2_grpc, system_pb2
from cqos_core.remote.open_models import OpenModel
from cqos_core.remote.refusal import Refused
from cqos_core.service import open_sessions
from tests.laws.test_open_documents import content_of, followed
from tests.service.test_web import call

SERVICE = "/cqos.v1.SessionService/"
MODEL = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos" id="D">
<signal id="S" name="rain"/><signal id="T" name="wind"/>
<collaboration id="C"><participant id="A" name="Drone" processRef="P"/><participant id="B" processRef="Q"/></collaboration>
<process id="P"><intermediateThrowEvent id="throw" name="Send" qos:reliability="best_effort">
<signalEventDefinition signalRef="S"/></intermediateThrowEvent>
<endEvent id="calm"><signalEventDefinition signalRef="T"/></endEvent></process>
<process id="Q"><startEvent id="catch"><signalEventDefinition signalRef="S"/></startEvent>
<intermediateCatchEvent id="feel"><signalEventDefinition signalRef="T"/></intermediateCatchEvent></process>
</definitions>"""
FIXED = MODEL.replace('qos:reliability="best_effort"', 'qos:reliability="reliable"')
MOVED = MODEL.replace(
    "</definitions>", '<bpmndi xmlns="http://example.org/di"><bounds x="7"/></bpmndi>\n</definitions>'
)


def documents(**files):
    return [check_pb2.Document(name=f"{name}.bpmn", content=text.encode()) for name, text in files.items()]


def opening(**options):
    given = {"revision": 1, "documents": check_pb2.Documents(documents=documents(model=MODEL)), **options}
    return session_pb2.OpenSessionRequest(**given)


def editing(session, revision, base, **files):
    changes = session_pb2.DocumentChanges(put=documents(**files))
    return session_pb2.EditSessionRequest(revision=revision, session=session, base_revision=base, documents=changes)


def stub_of(service):
    channel = grpc.insecure_channel(service.grpc, options=[("grpc.use_local_subchannel_pool", 1)])
    return session_pb2_grpc.SessionServiceStub(channel), channel


@pytest.fixture
def sessions(service):
    stub, channel = stub_of(service)
    with channel:
        yield stub


def reason_of(error):
    """The code and the reason of a refusal."""
    status = status_pb2.Status.FromString(dict(error.trailing_metadata())["grpc-status-details-bin"])
    info = error_details_pb2.ErrorInfo()
    return error.code().name, next((info.reason for each in status.details if each.Unpack(info)), "")


def refused(ask):
    with pytest.raises(grpc.RpcError) as raised:
        ask()
    return reason_of(raised.value)


def codes(report):
    return [each.code for each in report.findings if each.severity == report_pb2.SEVERITY_ERROR]


def test_an_edit_is_answered_by_what_it_changes(sessions):
    opened = sessions.OpenSession(opening(describe=True))
    assert (opened.revision, codes(opened.report), opened.idle_seconds) == (1, ["ROS101"], 900)
    described = {each.id: each for each in opened.endpoints}
    assert set(described) == {"throw", "calm", "catch", "feel"}
    throw = described["throw"]
    assert (throw.role, throw.topic, throw.participant, throw.label) == (
        report_pb2.ROLE_PUBLISHER,
        "/rain",
        "A",
        "Send",
    )
    assert (throw.place.element, throw.protocol) == ("throw", "ros2")
    settings = {each.policy: each for each in throw.settings}
    stated = settings["reliability"]
    assert (stated.value, stated.origin, stated.place.path) == ("best_effort", "explicit", "@qos:reliability")
    assert settings["depth"].origin_kind == report_pb2.ORIGIN_KIND_PRESET
    assert not settings["depth"].HasField("place")
    assert {each.id: each.label for each in opened.participants} == {"A": "Drone", "B": ""}

    edited = sessions.EditSession(editing(opened.session, 2, 1, model=FIXED))
    assert (edited.revision, edited.delta.base_revision, edited.judged) == (2, 1, 1)
    assert [each.id for each in edited.endpoints] == ["throw"]
    assert codes(followed(opened.report, edited.delta)) == []
    back = sessions.EditSession(editing(opened.session, 3, 2, model=MODEL))
    assert content_of(followed(followed(opened.report, edited.delta), back.delta)) == content_of(opened.report)
    sessions.CloseSession(session_pb2.CloseSessionRequest(session=opened.session))


def test_a_shape_that_moves_costs_no_check(sessions):
    opened = sessions.OpenSession(opening(describe=True))
    moved = sessions.EditSession(editing(opened.session, 2, 1, model=MOVED))
    assert (moved.judged, moved.delta.added_findings, list(moved.endpoints)) == (0, [], [])
    assert content_of(followed(opened.report, moved.delta)) == content_of(opened.report)


def test_fixes_are_edits_of_elements(sessions):
    report = sessions.OpenSession(opening()).report
    (finding,) = [each for each in report.findings if each.code == "ROS101"]
    edits = [
        (each.place.element, each.place.path, each.attribute, each.old, each.new) for each in finding.remedies[0].edits
    ]
    assert edits == [("throw", "@qos:reliability", "reliability", "best_effort", "reliable")]


def test_documents_that_cannot_be_read_leave_everything_as_it_was(sessions):
    opened = sessions.OpenSession(opening())
    answer = sessions.EditSession(editing(opened.session, 2, 1, model="<definitions"))
    assert [each.field for each in answer.refusal.problems] == ["documents.put[0].content"]
    (problem,) = answer.refusal.documents
    assert (problem.code, problem.place.source) == ("CQ001", "model.bpmn")
    removed = session_pb2.EditSessionRequest(
        revision=3,
        session=opened.session,
        base_revision=1,
        documents=session_pb2.DocumentChanges(removed=["other.bpmn"]),
    )
    assert sessions.EditSession(removed).refusal.problems[0].field == "documents.removed[0]"
    edited = sessions.EditSession(editing(opened.session, 4, 1, model=FIXED))
    assert edited.delta.base_revision == 1
    code, _ = refused(lambda: sessions.OpenSession(opening(documents=check_pb2.Documents(documents=documents(a="<a")))))
    assert code == "INVALID_ARGUMENT"


def test_several_documents_are_one_system_and_come_and_go(sessions):
    other = MODEL.replace('id="throw"', 'id="third"').replace('"A"', '"X"').replace('"B"', '"Y"')
    opened = sessions.OpenSession(opening(describe=True))
    both = sessions.EditSession(editing(opened.session, 2, 1, other=other))
    assert "third" in {each.id for each in both.endpoints}
    whole = both.report if both.HasField("report") else followed(opened.report, both.delta)
    assert list(whole.sources) == ["model.bpmn", "other.bpmn"]
    gone = sessions.EditSession(
        session_pb2.EditSessionRequest(
            revision=3,
            session=opened.session,
            base_revision=2,
            documents=session_pb2.DocumentChanges(removed=["other.bpmn"]),
        )
    )
    after = gone.report if gone.HasField("report") else followed(whole, gone.delta)
    assert content_of(after) == content_of(opened.report)


def test_a_caller_that_missed_an_answer_gets_the_whole_report(sessions):
    opened = sessions.OpenSession(opening(describe=True))
    sessions.EditSession(editing(opened.session, 2, 1, model=FIXED))
    answer = sessions.EditSession(session_pb2.EditSessionRequest(revision=3, session=opened.session, base_revision=1))
    assert codes(answer.report) == []
    assert len(answer.endpoints) == 4


def test_a_model_is_edited_by_its_parts(sessions):
    system = system_pb2.System(
        protocol="ros2",
        participants=[system_pb2.Participant(id="a"), system_pb2.Participant(id="b")],
        endpoints=[
            system_pb2.Endpoint(id="w", role=report_pb2.ROLE_PUBLISHER, topic="t", participant="a"),
            system_pb2.Endpoint(id="r", role=report_pb2.ROLE_SUBSCRIBER, topic="t", participant="b"),
        ],
    )
    opened = sessions.OpenSession(session_pb2.OpenSessionRequest(revision=1, system=system, describe=True))
    weak = system_pb2.Endpoint(
        id="w", role=report_pb2.ROLE_PUBLISHER, topic="t", participant="a", settings={"reliability": "best_effort"}
    )
    changes = session_pb2.Changes(changes=[session_pb2.Change(put_endpoint=weak)])
    ask = session_pb2.EditSessionRequest(revision=2, session=opened.session, base_revision=1, changes=changes)
    answer = sessions.EditSession(ask)
    whole = answer.report if answer.HasField("report") else followed(opened.report, answer.delta)
    assert codes(whole) == ["ROS101"]
    assert {"w": "best_effort"}.items() <= {
        each.id: fact.value for each in answer.endpoints for fact in each.settings if fact.policy == "reliability"
    }.items()
    wrong = session_pb2.Changes(changes=[session_pb2.Change(remove_endpoint="missing")])
    ask = session_pb2.EditSessionRequest(revision=3, session=opened.session, base_revision=2, changes=wrong)
    assert sessions.EditSession(ask).refusal.problems[0].field == "changes[0].remove_endpoint"
    answer = sessions.EditSession(editing(opened.session, 4, 2, model=MODEL))
    assert answer.refusal.problems[0].field == "documents"


def test_what_bridges_make_too_large_is_refused_and_leaves_a_session_as_it_was():
    """A route that carries every topic adds endpoints that no model states."""
    participants = [system_pb2.Participant(id=each) for each in "ab"]
    endpoints = [
        system_pb2.Endpoint(id=f"w{number}", role=report_pb2.ROLE_PUBLISHER, topic=f"/t{number}", participant="a")
        for number in range(2)
    ]
    route = system_pb2.Route(
        source=system_pb2.Endpoint(role=report_pb2.ROLE_SUBSCRIBER, topic="/*", participant="a"),
        target=system_pb2.Endpoint(role=report_pb2.ROLE_PUBLISHER, topic="/*", participant="b"),
    )
    bridge = system_pb2.Bridge(id="bridge", routes=[route])
    empty = system_pb2.System(protocol="ros2", participants=participants)
    model = OpenModel(4)
    model.open(session_pb2.OpenSessionRequest(revision=1, system=empty).SerializeToString())
    changes = session_pb2.Changes(
        changes=[
            *(session_pb2.Change(put_endpoint=each) for each in endpoints),
            session_pb2.Change(put_bridge=bridge),
        ]
    )
    ask = session_pb2.EditSessionRequest(revision=2, base_revision=1, changes=changes)
    answer = session_pb2.EditSessionResponse.FromString(model.edit(ask.SerializeToString()))
    assert [each.field for each in answer.refusal.problems] == ["changes"]
    again = session_pb2.EditSessionRequest(revision=3)
    report = session_pb2.EditSessionResponse.FromString(model.edit(again.SerializeToString())).report
    assert (report.endpoints, report.topics) == (0, 0)
    whole = system_pb2.System(protocol="ros2", participants=participants, endpoints=endpoints, bridges=[bridge])
    with pytest.raises(Refused, match="bridges carry more topics") as raised:
        OpenModel(4).open(session_pb2.OpenSessionRequest(revision=1, system=whole).SerializeToString())
    assert raised.value.code == "RESOURCE_EXHAUSTED"


def test_only_what_is_asked_for_is_answered(sessions):
    fields = {"paths": ["verdict", "findings.code"]}
    opened = sessions.OpenSession(opening(fields=fields, least_severe=report_pb2.SEVERITY_ERROR))
    assert [each.name for each, _ in opened.report.ListFields()] == ["verdict", "findings"]
    assert [[name.name for name, _ in each.ListFields()] for each in opened.report.findings] == [["code"]]
    edited = sessions.EditSession(editing(opened.session, 2, 1, model=FIXED))
    assert edited.delta.summary.verdict == report_pb2.VERDICT_COMPATIBLE
    assert list(edited.delta.removed_findings) == [0]


def test_a_session_that_is_closed_or_of_another_process_has_a_reason_of_its_own(sessions):
    opened = sessions.OpenSession(opening())
    sessions.CloseSession(session_pb2.CloseSessionRequest(session=opened.session))
    again = lambda: sessions.EditSession(editing(opened.session, 2, 1, model=MODEL))  # noqa: E731
    assert refused(again) == ("FAILED_PRECONDITION", "SESSION_LOST")
    sessions.CloseSession(session_pb2.CloseSessionRequest(session=opened.session))
    for name in ("", "0123abcd.nothing"):
        ask = lambda: sessions.EditSession(editing(name, 2, 1, model=MODEL))  # noqa: B023, E731
        assert refused(ask) == ("FAILED_PRECONDITION", "SESSION_ELSEWHERE")


def test_pages_edit_by_connect_in_binary_and_in_json(service):
    kind = {"content_type": "application/proto"}
    status, _, body = call(service, "POST", f"{SERVICE}OpenSession", opening().SerializeToString(), **kind)
    opened = session_pb2.OpenSessionResponse.FromString(body)
    assert (status, codes(opened.report)) == (200, ["ROS101"])
    asked = json_format.MessageToJson(editing(opened.session, 2, 1, model=FIXED)).encode()
    status, _, body = call(service, "POST", f"{SERVICE}EditSession", asked, content_type="application/json")
    assert (status, json.loads(body)["delta"]["baseRevision"]) == (200, "1")
    status, _, body = call(
        service,
        "POST",
        f"{SERVICE}EditSession",
        editing("0123abcd.nothing", 2, 1, model=FIXED).SerializeToString(),
        **kind,
    )
    said = json.loads(body)
    assert (status, said["code"]) == (400, "failed_precondition")
    assert [each["type"] for each in said["details"]] == ["google.rpc.ErrorInfo"]
    status, headers, _ = call(service, "GET", f"{SERVICE}EditSession?encoding=json&message=%7B%7D")
    assert (status, headers["allow"]) == (405, "POST")


def test_sessions_are_bounded_in_number_and_bytes(start):
    limits = ("--max-sessions", "2", "--max-share", "1", "--max-message-bytes", "4000")
    with start(*limits, "--max-total-bytes", "8000") as own:
        stub, channel = stub_of(own)
        with channel:
            one = stub.OpenSession(opening()).session
            stub.OpenSession(opening())
            assert refused(lambda: stub.OpenSession(opening())) == ("RESOURCE_EXHAUSTED", "CALLER_QUOTA")
            large = MODEL.replace("</definitions>", f"<!--{'x' * 2800}--></definitions>")
            ask = lambda: stub.EditSession(editing(one, 2, 1, model=large))  # noqa: E731
            assert refused(ask) == ("RESOURCE_EXHAUSTED", "CALLER_QUOTA")
            assert stub.EditSession(editing(one, 3, 1, model=FIXED)).delta.base_revision == 1


def test_a_session_that_nobody_edits_is_closed_and_leaves_its_place(forgetful):
    stub, channel = stub_of(forgetful)
    with channel:
        first, second = opened_at_last(stub), opened_at_last(stub)
        assert first != second
        ask = lambda: stub.EditSession(editing(first, 2, 1, model=FIXED))  # noqa: E731
        assert refused(ask) == ("FAILED_PRECONDITION", "SESSION_LOST")


def opened_at_last(stub):
    """Open a session as soon as there is a place for it, however long the ones before are kept on a busy machine."""
    until = time.monotonic() + 60
    while True:
        try:
            return stub.OpenSession(opening()).session
        except grpc.RpcError as error:
            if reason_of(error)[1] != "CALLER_QUOTA" or time.monotonic() > until:
                raise
            time.sleep(0.05)


def test_what_is_kept_of_edits_counts_as_a_whole(start):
    """Names of documents, and edits that change nothing, are kept as well."""
    empty = '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"/>'
    limits = ("--session-workers", "1", "--max-share", "1", "--max-message-bytes", "4000", "--max-total-bytes", "8000")
    with start(*limits) as own:
        stub, channel = stub_of(own)
        with channel:
            files = stub.OpenSession(opening()).session
            names = [f"{number}{'n' * 2000}" for number in range(5)]
            asks = [editing(files, number + 2, 1, **{name: empty}) for number, name in enumerate(names)]
            assert refused(lambda: [stub.EditSession(ask) for ask in asks]) == ("RESOURCE_EXHAUSTED", "CALLER_QUOTA")
            system = system_pb2.System(protocol="ros2")
            drawn = stub.OpenSession(session_pb2.OpenSessionRequest(revision=1, system=system)).session
            asked = session_pb2.EditSessionRequest(session=drawn, revision=2, changes=session_pb2.Changes())
            assert refused(lambda: [stub.EditSession(asked) for _ in range(200)]) == (
                "RESOURCE_EXHAUSTED",
                "CALLER_QUOTA",
            )


def test_a_session_whose_worker_dies_goes_on_in_another_one(start):
    """Its worker is that of other callers, too: what they ask for must not end it."""
    with start("--heavy-workers", "1") as own:
        stub, channel = stub_of(own)
        with channel:
            before = set(own.children())
            opened = stub.OpenSession(opening(describe=True))
            second = stub.EditSession(editing(opened.session, 2, 1, model=FIXED))
            model = session_pb2.OpenSessionRequest(revision=1, system=system_pb2.System(protocol="ros2"))
            drawn = stub.OpenSession(model)
            put = session_pb2.Change(put_participant=system_pb2.Participant(id="p"))
            change = session_pb2.Changes(changes=[put])
            asked = session_pb2.EditSessionRequest(session=drawn.session, revision=2, base_revision=1, changes=change)
            stub.EditSession(asked)
            for home in set(own.children()) - before:
                os.kill(home, signal.SIGKILL)
            third = stub.EditSession(editing(opened.session, 3, 2, model=MODEL))
            assert third.delta.base_revision == 2
            reports = followed(followed(opened.report, second.delta), third.delta)
            assert content_of(reports) == content_of(opened.report)
            assert [each.id for each in third.endpoints] == ["throw"]
            end = system_pb2.Endpoint(id="e", role=report_pb2.ROLE_PUBLISHER, participant="p", topic="/t")
            change = session_pb2.Changes(changes=[session_pb2.Change(put_endpoint=end)])
            asked = session_pb2.EditSessionRequest(session=drawn.session, revision=3, base_revision=2, changes=change)
            edited = stub.EditSession(asked)
            assert (edited.HasField("refusal"), edited.revision) == (False, 3)


@pytest.mark.skipif(not hasattr(socket, "SO_REUSEPORT"), reason="no shared ports here")
def test_an_edit_that_reaches_another_process_says_so_and_a_caller_goes_on(start):
    """As a page does: where the session is not, it opens another one with its documents."""
    with start("--workers", "2", "--heavy-workers", "1") as own:
        until = time.monotonic() + 60
        while len([line for line in own.lines if line["event"] == "serving"]) < 2 and time.monotonic() < until:
            time.sleep(0.05)
        stub, channel = stub_of(own)
        with channel:
            opened = stub.OpenSession(opening())
            reasons = set()
            for number in range(60):
                other, another = stub_of(own)
                with another:
                    try:
                        other.EditSession(editing(opened.session, number + 2, number + 1, model=FIXED))
                        reasons.add("")
                    except grpc.RpcError as error:
                        reasons.add(reason_of(error)[1])
                        fresh = other.OpenSession(opening())
                        assert codes(fresh.report) == ["ROS101"]
                        other.CloseSession(session_pb2.CloseSessionRequest(session=fresh.session))
                if len(reasons) > 1:
                    break
        assert reasons == {"", "SESSION_ELSEWHERE"}


def test_a_session_is_its_callers_where_tokens_tell_who_calls(start, tmp_path):
    file = tmp_path / "tokens"
    file.write_text("0123456789abcdef-one\n0123456789abcdef-two\n", encoding="utf-8")
    with start("--token-file", str(file)) as own:
        stub, channel = stub_of(own)
        with channel:
            mine, other = ([("authorization", f"Bearer 0123456789abcdef-{name}")] for name in ("one", "two"))
            opened = stub.OpenSession(opening(), metadata=mine)
            ask = editing(opened.session, 2, 1, model=FIXED)
            assert refused(lambda: stub.EditSession(ask, metadata=other)) == ("FAILED_PRECONDITION", "SESSION_LOST")
            assert stub.EditSession(ask, metadata=mine).delta.base_revision == 1
        assert re.search(r"\.[\w-]{24}$", opened.session)


def test_what_is_described_is_what_is_judged(client, tmp_path):
    file = tmp_path / "model.bpmn"
    file.write_text(MODEL, encoding="utf-8")
    found = client.describe(str(file))
    assert [each.id for each in found.endpoints] == ["throw", "calm", "catch", "feel"]
    assert found.endpoints[0].place.line == 4
    assert {each.policy: each.value for each in found.endpoints[0].settings}["reliability"] == "best_effort"


def test_elements_are_named_for_members_that_have_other_ids(service):
    shared = MODEL.replace('processRef="Q"', 'processRef="P"')
    with grpc.insecure_channel(service.grpc) as channel:
        ask = channel.unary_unary(
            "/cqos.v1.CheckService/CheckDocument",
            request_serializer=check_pb2.CheckDocumentRequest.SerializeToString,
            response_deserializer=check_pb2.CheckDocumentResponse.FromString,
        )
        answer = ask(check_pb2.CheckDocumentRequest(documents=documents(model=shared)), timeout=60)
    assert answer.elements["throw@B"] == "throw"
    assert "throw" not in answer.elements


@pytest.mark.parametrize(("raised", "logged"), [(ZeroDivisionError("a defect"), 1), (Refused("NOT_FOUND", "gone"), 0)])
def test_a_defect_in_work_for_which_no_caller_waits_is_logged(raised, logged, monkeypatch):
    told: list[str] = []
    monkeypatch.setattr(open_sessions, "log_event", lambda _level, event, **_fields: told.append(event))

    async def work():
        raise raised

    async def abandoned():
        sessions = open_sessions.OpenSessions.__new__(open_sessions.OpenSessions)
        sessions._running = set()
        sessions._later(work())
        await asyncio.gather(*sessions._running, return_exceptions=True)

    asyncio.run(abandoned())
    assert told == ["internal error"] * logged
