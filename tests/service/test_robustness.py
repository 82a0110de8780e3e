"""What strangers send, and what that costs others: nothing, or a clear refusal."""

import os
import signal
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import grpc
import pytest
from google.rpc import error_details_pb2, status_pb2
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos.v1 import check_pb2, check_pb2_grpc, report_pb2, system_pb2
from cqos_core import InputError
from cqos_core.remote.client import ServiceError

ROOT = Path(__file__).resolve().parents[2]
CHECK = "/cqos.v1.CheckService/"
SEEDS = [
    (ROOT / "examples" / name).read_bytes()
    for name in ("smart_agriculture.yaml", "smart_agriculture_incompatible.bpmn")
]
UNARY = ("CheckSystem", "CheckDocument", "CheckPair", "Explain", "Convert")


@pytest.fixture(scope="module")
def channel(service):
    with grpc.insecure_channel(service.grpc) as opened:
        yield opened


@pytest.fixture(scope="module")
def checks(channel):
    return check_pb2_grpc.CheckServiceStub(channel)


def raw(channel, method, data, **options):
    """Send bytes as a request, whatever they are."""
    return channel.unary_unary(f"{CHECK}{method}")(data, timeout=30, **options)


def refused(call, *arguments, **options):
    with pytest.raises(grpc.RpcError) as raised:
        call(*arguments, **options)
    return raised.value


def violations(error):
    """Fields and descriptions of google.rpc.BadRequest."""
    status = status_pb2.Status.FromString(dict(error.trailing_metadata())["grpc-status-details-bin"])
    assert status.message == error.details()
    bad = error_details_pb2.BadRequest()
    assert any(detail.Unpack(bad) for detail in status.details)
    return {each.field: each.description for each in bad.field_violations}


def still_answers(checks):
    answer = checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2"), timeout=10)
    return answer.report.verdict == report_pb2.VERDICT_COMPATIBLE


def system(endpoints, topics=1, *, varied=False, **settings):
    """A model of one participant and so many endpoints, half of each kind; if varied, none is like another."""
    return system_pb2.System(
        protocol="ros2",
        participants=[system_pb2.Participant(id="n")],
        endpoints=[
            system_pb2.Endpoint(
                id=f"e{number}",
                role=report_pb2.ROLE_PUBLISHER if number % 2 else report_pb2.ROLE_SUBSCRIBER,
                topic=f"t{number // 2 % topics}",
                participant="n",
                settings={**settings, "depth": str(number + 1), "deadline": f"{number + 1}ms"} if varied else settings,
            )
            for number in range(endpoints)
        ],
    )


# --- what tools ask ---


def test_reflection_tells_services_and_files(channel):
    stub: Any = reflection_pb2_grpc.ServerReflectionStub(channel)
    asked = [
        reflection_pb2.ServerReflectionRequest(list_services=""),
        reflection_pb2.ServerReflectionRequest(file_containing_symbol="cqos.v1.CheckService"),
    ]
    listed, described = stub.ServerReflectionInfo(iter(asked), timeout=10)
    assert {each.name for each in listed.list_services_response.service} == {
        "cqos.v1.CatalogueService",
        "cqos.v1.CheckService",
        "cqos.v1.SessionService",
        "grpc.health.v1.Health",
        "grpc.reflection.v1alpha.ServerReflection",
    }
    assert any(b"CheckSystem" in file for file in described.file_descriptor_response.file_descriptor_proto)


@pytest.mark.parametrize("name", ["", "cqos.v1.CheckService", "cqos.v1.SessionService"])
def test_health_is_serving(channel, name):
    stub: Any = health_pb2_grpc.HealthStub(channel)
    answer = stub.Check(health_pb2.HealthCheckRequest(service=name), timeout=10)
    assert answer.status == health_pb2.HealthCheckResponse.SERVING


def test_every_call_echoes_its_revision(service, client, checks):
    number = 2**64 - 1
    document = check_pb2.Document(name="a.yaml", content=b"cqos: 1\nparticipants: {a: {}}\n")
    documents = check_pb2.Documents(documents=[document])
    assert checks.CheckSystem(check_pb2.CheckSystemRequest(revision=number)).revision == number
    # From memory as well.
    assert checks.CheckSystem(check_pb2.CheckSystemRequest(revision=300)).revision == 300
    assert checks.CheckSystem(check_pb2.CheckSystemRequest()).revision == 0
    assert checks.CheckPair(check_pb2.CheckPairRequest(revision=number, protocol="ros2")).revision == number
    request = check_pb2.CheckDocumentRequest(revision=number, documents=[document])
    assert checks.CheckDocument(request).revision == number
    convert = check_pb2.ConvertRequest(revision=number, documents=documents, exporter="yaml")
    assert checks.Convert(convert).revision == number
    explain = check_pb2.ExplainRequest(revision=number, system=system(2), publisher="e1", subscriber="e0")
    assert checks.Explain(explain).revision == number


def test_a_revision_counts_wherever_it_stands_in_the_message(channel):
    model = check_pb2.CheckSystemRequest(system=system(2)).SerializeToString()
    five, six = (check_pb2.CheckSystemRequest(revision=number).SerializeToString() for number in (5, 6))
    # The last one of a field counts, in whatever order a writer puts fields.
    for data, expected in (
        (five + model, 5),
        (model + six, 6),
        (five + model + six, 6),
        (five + six + model, 6),
        (model, 0),
    ):
        answer = check_pb2.CheckSystemResponse.FromString(raw(channel, "CheckSystem", data))
        assert (answer.revision, answer.report.endpoints) == (expected, 2)


def test_an_empty_model_is_an_ok_report_that_says_so(checks):
    report = checks.CheckSystem(check_pb2.CheckSystemRequest(), timeout=10).report
    assert report.verdict == report_pb2.VERDICT_UNKNOWN
    assert [finding.code for finding in report.findings] == ["CQ404"]


# --- bad requests are named ---


def test_a_wrong_field_is_named(checks):
    request = check_pb2.CheckSystemRequest(system=system(2))
    request.system.endpoints[1].participant = "nobody"
    request.system.endpoints[1].role = report_pb2.ROLE_UNSPECIFIED
    error = refused(checks.CheckSystem, request)
    assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert violations(error) == {
        "system.endpoints[1].role": "a role is needed: ROLE_PUBLISHER or ROLE_SUBSCRIBER",
        "system.endpoints[1].participant": "`nobody` is none of the participants",
    }


@pytest.mark.parametrize(
    ("method", "request_", "field"),
    [
        ("CheckPair", check_pb2.CheckPairRequest(protocol="telegraph"), "protocol"),
        ("CheckDocument", check_pb2.CheckDocumentRequest(), "documents"),
        (
            "CheckDocument",
            check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=b"?")]),
            "documents[0].content",
        ),
        (
            "CheckDocument",
            check_pb2.CheckDocumentRequest(documents=[check_pb2.Document()], reading=check_pb2.Reading(importer="x")),
            "reading.importer",
        ),
        (
            "CheckDocument",
            check_pb2.CheckDocumentRequest(
                documents=[check_pb2.Document(content=SEEDS[0])],
                reading=check_pb2.Reading(switches={"x": system_pb2.Options(settings={"a": "b"})}),
            ),
            "reading.switches[x]",
        ),
        ("Explain", check_pb2.ExplainRequest(), "input"),
        ("Explain", check_pb2.ExplainRequest(system=system(2), publisher="x", subscriber="e0"), "publisher"),
        ("Explain", check_pb2.ExplainRequest(system=system(2), publisher="e1", subscriber="y"), "subscriber"),
        ("Convert", check_pb2.ConvertRequest(system=system(2), exporter="clay"), "exporter"),
        (
            "Convert",
            check_pb2.ConvertRequest(system=system(2), exporter="yaml", settings={"profiles": "x"}),
            "settings[profiles]",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_cannot_be_answered_names_its_field(checks, method, request_, field):
    error = refused(getattr(checks, method), request_, timeout=10)
    assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert set(violations(error)) == {field}


def mistakes(number):
    """A document with so many."""
    lines = "".join(f"  p{each}: {{publishes: [t]}}\n" for each in range(number))
    return f"cqos: 1\nprotocol: ros2\nparticipants:\n{lines}".encode()


@pytest.mark.parametrize("word", ["x", "ümläut", "長い"])
@pytest.mark.parametrize("number", [5, 20, 50, 250])
def test_a_long_list_of_mistakes_is_cut_to_the_limit_of_grpc(checks, number, word):
    """Above its limit gRPC drops all error details and reports only that they are too large."""
    request = check_pb2.CheckDocumentRequest(
        documents=[check_pb2.Document(name=f"{word}.yaml", content=mistakes(number))]
    )
    for _ in range(3):  # what is near the limit is refused now and then
        error = refused(checks.CheckDocument, request, timeout=20)
        assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert error.details().endswith(f"(and {number - 1} more)")
    listed, info = report_pb2.InputProblems(), error_details_pb2.ErrorInfo()
    details = status_pb2.Status.FromString(dict(error.trailing_metadata())["grpc-status-details-bin"]).details
    assert any(detail.Unpack(listed) for detail in details)
    left_out = int(info.metadata["left_out"]) if any(detail.Unpack(info) for detail in details) else 0
    assert len(listed.problems) + left_out == number
    assert len(listed.problems) >= min(number, 5)


def test_a_caller_that_takes_more_says_how_much(client, service):
    with pytest.raises(InputError) as raised:
        cqos.check(mistakes(60))
    here = raised.value.problems
    assert len(here) == 60
    with pytest.raises(InputError) as raised:
        client.check(mistakes(60))
    assert raised.value.problems == here
    with pytest.raises(InputError) as raised:
        client.check(mistakes(800))
    *listed, last = raised.value.problems
    assert len(listed) > 60
    assert last.message == f"{800 - len(listed)} more problems are not listed"
    for nonsense in ("-1", "x", "9" * 30, ""):
        given = (("cqos-error-bytes", nonsense),)
        with grpc.insecure_channel(service.grpc) as channel:
            error = refused(
                check_pb2_grpc.CheckServiceStub(channel).CheckPair, check_pb2.CheckPairRequest(), metadata=given
            )
        assert set(violations(error)) == {"protocol"}


def test_a_message_is_never_longer_than_callers_take(checks):
    request = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(name="ä" * 50_000, content=b"x")])
    error = refused(checks.CheckDocument, request, timeout=20)
    assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert error.details().startswith("ääää")
    assert error.details().endswith("…")


def test_an_unknown_pack_is_not_found(client):
    with pytest.raises(ServiceError) as raised:
        client.pack("telegraph")
    assert (raised.value.code, [each.field for each in raised.value.fields]) == ("NOT_FOUND", ["id"])


# --- hostile bytes ---


@pytest.mark.parametrize("method", UNARY)
def test_a_message_that_is_none_is_refused(channel, checks, method):
    error = refused(raw, channel, method, b"\x0f\xff\xff\xff")
    assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert "cannot be decoded" in error.details()
    assert still_answers(checks)


def test_text_that_is_not_utf_8_is_refused(channel, checks):
    error = refused(raw, channel, "CheckPair", b"\x12\x04\xff\xfe\xfd\xfc")
    assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert "not UTF-8" in error.details()
    assert still_answers(checks)


@pytest.mark.parametrize(
    ("size", "expected"), [(2_000_100, "this service takes 2000000"), (5_000_000, "larger than max")]
)
def test_an_oversized_message_is_refused(checks, size, expected):
    request = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=b" " * size)])
    error = refused(checks.CheckDocument, request, timeout=10)
    assert error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
    assert expected in error.details()
    assert still_answers(checks)


HOSTILE = {
    "entities": b'<?xml version="1.0"?><!DOCTYPE d [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">'
    b'<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;">]><definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL">&c;'
    b"</definitions>",
    "a file of the machine": b'<?xml version="1.0"?><!DOCTYPE d [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
    b'<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL">&x;</definitions>',
    "nesting": b'<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL">' + b"<a>" * 100_000,
    "aliases": b"cqos: 1\na: &a [x, x]\n"
    + b"".join(b"%c: &%c [*%c, *%c, *%c]\n" % (n, n, n - 1, n - 1, n - 1) for n in range(98, 120)),
    "flow nesting": b"cqos: 1\nprofiles: " + b"[" * 100_000,
    "an include": b"cqos: 1\ninclude: [/etc/passwd]\n",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_document_is_refused_and_tells_nothing(checks, name):
    request = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=HOSTILE[name])])
    error = refused(checks.CheckDocument, request, timeout=20)
    assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert "root:" not in error.details()
    assert still_answers(checks)


def test_deep_values_are_no_internal_error(checks):
    deep = "[" * 5_000 + "]" * 5_000
    report = checks.CheckSystem(check_pb2.CheckSystemRequest(system=system(2, depth=deep)), timeout=20).report
    assert any(finding.severity == report_pb2.SEVERITY_ERROR for finding in report.findings)
    assert still_answers(checks)


@given(data=st.binary(max_size=300), method=st.sampled_from(UNARY))
def test_the_decoder_never_fails_by_our_fault(channel, data, method):
    try:
        raw(channel, method, data)
    except grpc.RpcError as error:
        allowed = {grpc.StatusCode.INVALID_ARGUMENT, grpc.StatusCode.NOT_FOUND, grpc.StatusCode.RESOURCE_EXHAUSTED}
        assert error.code() in allowed, error.details()  # noqa: PT017 - many requests are good


@given(
    seed=st.sampled_from(SEEDS),
    cuts=st.lists(
        st.tuples(st.integers(0, 17_000), st.integers(0, 40), st.binary(max_size=12)), min_size=1, max_size=4
    ),
)
def test_the_document_call_never_fails_by_our_fault(checks, seed, cuts):
    for start, length, put in cuts:
        seed = seed[:start] + put + seed[start + length :]
    request = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=seed)])
    try:
        checks.CheckDocument(request, timeout=30)
    except grpc.RpcError as error:
        assert error.code() == grpc.StatusCode.INVALID_ARGUMENT, error.details()  # noqa: PT017 - many can be read


# --- callers that are slow, gone or many ---


def test_too_many_endpoints_are_refused(narrow):
    with narrow.client() as client:
        yaml = b"cqos: 1\nprotocol: ros2\ninstances: {n: [%s]}\nparticipants: {'p${n}': {publishes: {t: default}}}\n"
        with pytest.raises(ServiceError) as raised:
            client.check(yaml % b",".join(b"n%d" % number for number in range(4)))
        assert raised.value.code == "RESOURCE_EXHAUSTED"
        assert raised.value.fields[0].field == "documents"
    with grpc.insecure_channel(narrow.grpc) as channel:
        stub = check_pb2_grpc.CheckServiceStub(channel)
        error = refused(stub.CheckSystem, check_pb2.CheckSystemRequest(system=system(4)))
        assert error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
        assert violations(error) == {"system.endpoints": "there are 4 endpoints, this service takes 3"}


def test_a_call_that_takes_too_long_is_ended_and_its_worker_replaced(start):
    with (
        start("--max-seconds", "1", "--heavy-workers", "1") as hasty,
        grpc.insecure_channel(hasty.grpc) as channel,
    ):
        checks = check_pb2_grpc.CheckServiceStub(channel)
        (before,) = hasty.children()
        os.kill(before, signal.SIGSTOP)  # what is asked of it takes for ever
        again = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=SEEDS[0])])
        began = time.monotonic()
        error = refused(checks.CheckDocument, again)
        assert error.code() == grpc.StatusCode.DEADLINE_EXCEEDED
        assert time.monotonic() - began < 30
        hasty.wait_for(lambda line: line["event"] == "worker ended")
        until = time.monotonic() + 60
        while True:  # another process has to start first, which takes longer than a second on a busy machine
            try:
                checks.CheckDocument(again)
                break
            except grpc.RpcError:
                assert time.monotonic() < until
        assert still_answers(checks)
        assert before not in hasty.children(), "the worker was replaced"


def test_an_expired_deadline_ends_the_call(service, checks):
    error = refused(
        checks.CheckSystem, check_pb2.CheckSystemRequest(system=system(3_000, topics=1_500, varied=True)), timeout=0.05
    )
    assert error.code() == grpc.StatusCode.DEADLINE_EXCEEDED
    assert still_answers(checks)


def test_a_heavy_request_keeps_no_small_one_waiting(checks):
    heavy = check_pb2.CheckSystemRequest(system=system(1_200, topics=600, varied=True))
    small = check_pb2.CheckPairRequest(protocol="ros2", offered={"reliability": "best_effort"})
    checks.CheckPair(small)
    with ThreadPoolExecutor(2) as threads:
        under_way = [threads.submit(checks.CheckSystem, heavy, timeout=120) for _ in range(2)]
        waited = []
        first = time.monotonic()
        while not all(each.done() for each in under_way):
            began = time.monotonic()
            checks.CheckPair(small, timeout=10)
            waited.append(time.monotonic() - began)
            time.sleep(0.01)
        took = time.monotonic() - first
        assert all(len(each.result().report.groups) == 600 for each in under_way)
    assert len(waited) > 10
    waited.sort()
    assert waited[len(waited) * 9 // 10] < took / 4


def test_a_slow_reader_delays_no_other_call(channel, checks):
    pair = check_pb2.CheckPairsRequest(pair=check_pb2.CheckPairRequest(protocol="ros2"))
    slow = checks.CheckPairs(pair for _ in range(1_000))
    assert next(slow).report.verdict == report_pb2.VERDICT_COMPATIBLE
    began = time.monotonic()
    for _ in range(20):
        assert still_answers(checks)
    assert time.monotonic() - began < 5
    assert sum(1 for _ in slow) == 999


def test_a_client_that_vanishes_leaves_nothing_behind(start):
    # A service of its own: other tests leave sessions of single calls, which stay open for their next call.
    with start("--metrics", "127.0.0.1:0") as service:
        with service.client() as client:
            begun = [client.session() for _ in range(3)]
            for session in begun:
                session.report()
        # And some that say no goodbye at all.
        for _ in range(5):
            host, _, port = service.grpc.rpartition(":")
            with socket.create_connection((host, int(port))) as connection:
                connection.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\x00\x00")
        left: dict[str, float] = {}
        for _ in range(100):
            left = {name: metric(service, name) for name in ("cqos_sessions_open", "cqos_calls_in_flight")}
            if not any(left.values()):
                break
            time.sleep(0.05)
        assert not any(left.values()), left


def metric(service, name):
    import urllib.request

    with urllib.request.urlopen(f"http://{service.addresses['metrics']}/metrics", timeout=10) as answer:
        lines = answer.read().decode().splitlines()
    return sum(float(line.rpartition(" ")[2]) for line in lines if line.startswith((f"{name} ", f"{name}{{")))


def test_metrics_count_calls_by_method_and_code(service, checks):
    name = 'cqos_calls_total{code="OK",method="/cqos.v1.CheckService/CheckPair"}'
    before = metric(service, name)
    assert still_answers(checks)
    assert metric(service, name) == before + 1


def test_two_hundred_clients_at_once(service):
    failures: list[BaseException] = []
    ready = threading.Barrier(20)

    def many(number):
        try:
            ready.wait(30)
            for each in range(10):
                with service.client() as client:
                    depth = str(number * 10 + each + 1)
                    report = client.check_pair("ros2", {"depth": depth}, {"reliability": "reliable"})
                    assert report.verdict == "compatible"
                    assert next(p for p in report.policies if p.policy == "depth").offered.value == depth
        except BaseException as error:  # noqa: BLE001 - the test reports it
            failures.append(error)

    threads = [threading.Thread(target=many, args=(number,)) for number in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert failures == []
