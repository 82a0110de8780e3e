"""What calls may take of memory: requests under way are bounded in bytes, and a worker that took all of its is replaced."""

import contextlib
import http.client
import json
import os
import signal
import socket
import sys
import threading
import time
from dataclasses import replace
from typing import Any

import grpc
import pytest

from cqos.v1 import check_pb2, check_pb2_grpc
from cqos_core.remote.client import ServiceError
from cqos_core.remote.refusal import Refused
from cqos_core.service.caller_quotas import Callers
from cqos_core.service.settings import Limits
from cqos_core.service.telemetry import Meter
from tests.service.service_process import serving
from tests.service.test_robustness import metric, refused, violations
from tests.service.test_sessions import two

MIB = 1024 * 1024
LITTLE = 64 * MIB
"""A worker needs more than half of it for its start."""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="no limit of memory here")


def document(endpoints, length=0):
    """A request for a YAML file of so many publishers and at least so many bytes."""
    lines = (f"  p{number}: {{publishes: {{t{number}: {{depth: 5}}}}}}\n" for number in range(endpoints))
    text = "cqos: 1\nprotocol: ros2\nparticipants:\n" + "".join(lines) + "#" * length
    return check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=text.encode())])


@pytest.fixture(scope="module")
def tight():
    with serving("--max-worker-memory", str(LITTLE), "--heavy-workers", "1", "--max-seconds", "30") as running:
        yield running


@pytest.fixture
def checks(tight):
    with grpc.insecure_channel(tight.grpc) as channel:
        yield check_pb2_grpc.CheckServiceStub(channel)


@pytest.mark.parametrize(
    "heavy", [document(1, 15 * MIB), document(10_000)], ids=["a long request", "a request that makes much of little"]
)
def test_a_worker_that_took_all_its_memory_is_replaced(heavy, tight, checks):
    checks.CheckDocument(document(1), timeout=60)
    for _ in range(3):
        before, written = set(tight.children()), len(tight.lines)
        error = refused(checks.CheckDocument, heavy, timeout=120)
        if error.code() != grpc.StatusCode.DEADLINE_EXCEEDED:
            break
        # Once in a while CPython has no 32 bytes left in which to begin with the handling of a MemoryError, and tries that again
        # and again (`PyLong_FromLong` below `exception_unwind` in ceval.c). Then the worker is ended when its time is over.
    assert error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
    assert violations(error) == {"request": f"answering it takes more memory than the {LITTLE} bytes that are allowed"}
    ended = tight.wait_for(lambda line: line["event"] == "worker ended" and line in tight.lines[written:])
    assert ended["why"] == "it took all memory that it may have"
    assert checks.CheckDocument(document(2), timeout=60).report.endpoints == 2
    assert before - set(tight.children())  # a worker of sessions may stand beside it


def test_a_session_that_takes_all_memory_hears_so_and_those_beside_it_go_on(tight):
    with tight.client() as client, client.session(two()) as beside:
        assert beside.report().endpoints == 2
        with (
            client.session(replace(two(), name="n" * 15 * MIB)) as greedy,
            pytest.raises(ServiceError, match="it takes more memory than") as raised,
        ):
            greedy.report()
        assert raised.value.code == "RESOURCE_EXHAUSTED"
        beside.remove("w")
        assert beside.report().endpoints == 1
        with client.session(two()) as again:
            assert again.report().endpoints == 2


def test_a_call_whose_workers_are_killed_twice_says_so():
    """The operating system kills workers when memory is short; the killed process gets no notice."""
    with serving("--heavy-workers", "2") as own, grpc.insecure_channel(own.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        (first,) = own.children()
        os.kill(first, signal.SIGSTOP)  # so that the call stays under way until its worker is killed
        under_way = checks.CheckDocument.future(document(1), timeout=60)
        time.sleep(0.5)
        assert checks.CheckDocument(document(2), timeout=60).report.endpoints == 2
        (second,) = set(own.children()) - {first}
        os.kill(second, signal.SIGSTOP)
        for worker in (first, second):
            assert not under_way.done()
            os.kill(worker, signal.SIGKILL)
            time.sleep(0.5)
        assert under_way.code() == grpc.StatusCode.UNAVAILABLE
        assert "memory" not in under_way.details()
        why = "the worker process ended while it answered (signal SIGKILL)"
        assert own.wait_for(lambda line: line["event"] == "worker ended")["why"] == why
        assert "Unknown child process" not in own.log
        assert checks.CheckDocument(document(1), timeout=60).report.endpoints == 1


# --- the bytes of all requests ---


def test_bytes_of_requests_are_counted_as_they_come_and_given_back():
    callers = Callers(Limits(message_bytes=100, total_bytes=400, inline_bytes=10, share=0.5), Meter())
    with contextlib.ExitStack() as stack:
        one, other, third = (stack.enter_context(callers.count_call(name)) for name in ("one", "other", "third"))
        for _ in range(2):
            hold = stack.enter_context(callers.hold_request(one))
            hold(60)
            hold(40)
        message = (
            "one caller may have 200 of the 400 bytes of requests at the same time; of yours 200 are under way, and "
        )
        with callers.hold_request(one) as hold, pytest.raises(Refused, match=f"{message}these are 11 more; send fewer"):
            hold(11)
        with callers.hold_request(one) as hold:
            hold(10)  # one that needs no worker does not wait
        stack.enter_context(callers.hold_request(other))(100)
        stack.enter_context(callers.hold_request(third))(99)
        message = (
            "requests of 399 bytes are under way, and these are 12 more, this service takes 400 at the same time; try"
        )
        with callers.hold_request(third) as hold, pytest.raises(Refused, match=message):
            hold(12)
        with callers.hold_request(third) as hold:
            hold(5)
            with pytest.raises(Refused):
                hold(6)
    with callers.count_call("one") as one, callers.hold_request(one) as hold:
        hold(200)
    assert callers._held == 0


def test_one_message_is_always_taken_however_small_the_share():
    callers = Callers(Limits(message_bytes=100, total_bytes=100, share=0.01), Meter())
    with callers.count_call("one") as one, callers.hold_request(one) as hold:
        hold(100)


TOKENS = ("a-token-of-somebody", "a-token-of-another")


@pytest.fixture(scope="module")
def narrow_in_bytes(tmp_path_factory):
    """A service that takes twelve megabytes at the same time, of each caller a half, and is slow to answer."""
    file = tmp_path_factory.mktemp("tokens") / "tokens"
    file.write_text("\n".join(TOKENS), encoding="utf-8")
    with serving(
        *("--token-file", str(file), "--max-message-bytes", "2000000", "--max-total-bytes", "12000000"),
        *("--heavy-workers", "1", "--web", "127.0.0.1:0", "--metrics", "127.0.0.1:0"),
    ) as running:
        yield running


def test_one_caller_has_its_share_of_bytes_and_no_more(narrow_in_bytes):
    with grpc.insecure_channel(narrow_in_bytes.grpc) as channel:
        checks: Any = check_pb2_grpc.CheckServiceStub(channel)
        one, other = ([("authorization", f"Bearer {token}")] for token in TOKENS)
        under_way = [checks.CheckDocument.future(document(200, 1_000_000 + n), metadata=one) for n in range(10)]
        refused = [each for each in under_way if each.code() == grpc.StatusCode.RESOURCE_EXHAUSTED]
        assert 1 <= len(refused) <= 5  # some are answered before the last ones come
        message = "one caller may have 6000000 of the 12000000 bytes of requests at the same time"
        assert all(each.details().startswith(message) for each in refused)
        again = [checks.CheckDocument.future(document(200, 1_100_000 + n), metadata=one) for n in range(5)]
        assert checks.CheckDocument(document(200, 1_000_000), metadata=other, timeout=60).report.endpoints == 200
        assert {each.code() for each in again} == {grpc.StatusCode.OK}
    assert metric(narrow_in_bytes, "cqos_requests_in_flight_bytes") == 0


def test_an_edit_counts_as_well(narrow_in_bytes):
    """Not for as long as its session is open, but until it is answered."""
    with narrow_in_bytes.client(token=TOKENS[0]) as client, contextlib.ExitStack() as stack:
        sessions = [stack.enter_context(client.session(replace(two(), name=f"{n:01900000}"))) for n in range(5)]
        assert [session.report().endpoints for session in sessions] == [2] * 5
    assert metric(narrow_in_bytes, "cqos_requests_in_flight_bytes") == 0
    with grpc.insecure_channel(narrow_in_bytes.grpc) as channel:
        edit: Any = channel.stream_stream("/cqos.v1.SessionService/Edit")
        given = [("authorization", f"Bearer {TOKENS[0]}")]
        error = refused(lambda: list(edit(iter([b" " * 2_500_000]), metadata=given)))
        assert "this service takes 2000000" in error.details()


PAIR = "/cqos.v1.CheckService/CheckDocument"


def half_sent(service, token, length, sent):
    """A call to the server for browsers that stays half sent."""
    host, _, port = service.addresses["web"].rpartition(":")
    connection = socket.create_connection((host, int(port)))
    head = f"POST {PAIR} HTTP/1.1\r\nhost: x\r\ncontent-type: application/proto\r\nauthorization: Bearer {token}\r\n"
    connection.sendall(f"{head}content-length: {length}\r\n\r\n".encode() + b"\n" * sent)
    return connection


def test_what_comes_to_the_server_for_browsers_counts_from_its_first_byte(narrow_in_bytes):
    with contextlib.ExitStack() as stack:
        for _ in range(4):
            stack.enter_context(half_sent(narrow_in_bytes, TOKENS[1], 1_500_000, 1_400_000))
        until = time.monotonic() + 20
        while metric(narrow_in_bytes, "cqos_requests_in_flight_bytes") < 5_600_000:
            assert time.monotonic() < until
        last = stack.enter_context(half_sent(narrow_in_bytes, TOKENS[1], 1_500_000, 1_400_000))
        answer = http.client.HTTPResponse(last)
        answer.begin()
        answered = json.loads(answer.read())
        assert (answer.status, answered["code"]) == (429, "resource_exhausted")
        assert answered["message"].startswith("one caller may have 6000000 of the 12000000 bytes of requests")
    until = time.monotonic() + 20
    while metric(narrow_in_bytes, "cqos_requests_in_flight_bytes"):
        assert time.monotonic() < until


def test_nothing_is_read_of_those_who_are_not_let_in(narrow_in_bytes):
    with half_sent(narrow_in_bytes, "wrong-token-wrong-token", 1_500_000, 0) as connection:
        answer = http.client.HTTPResponse(connection)
        answer.begin()
        assert (answer.status, json.loads(answer.read())["code"]) == (401, "unauthenticated")


@pytest.fixture(scope="module")
def impatient():
    with serving("--web", "127.0.0.1:0", "--max-seconds", "0.5") as running:
        yield running


def test_a_request_that_does_not_come_is_not_waited_for(impatient):
    with half_sent(impatient, "", 10, 5) as connection:
        answer = http.client.HTTPResponse(connection)
        answer.begin()
        content = json.loads(answer.read())
    assert (answer.status, content["code"]) == (504, "deadline_exceeded")
    assert content["message"] == "the request did not come within 0.5 seconds"


@pytest.mark.parametrize(
    ("is_late", "code", "message"),
    [
        (True, "DEADLINE_EXCEEDED", "the request did not come within 0.5 seconds"),
        (False, "INVALID_ARGUMENT", "the call has no request message"),
    ],
)
def test_a_native_call_without_its_message_is_refused(is_late, code, message, impatient):
    never = threading.Event()

    def messages():
        if is_late:
            never.wait(20)
        yield from ()

    with grpc.insecure_channel(impatient.grpc) as channel:
        call: Any = channel.stream_unary("/cqos.v1.CheckService/CheckPair")
        with pytest.raises(grpc.RpcError) as refused:
            call(messages(), timeout=10)
        never.set()
    error: Any = refused.value
    assert (error.code().name, error.details()) == (code, message)


@pytest.mark.parametrize(
    "head", [b"", b"POST / HTTP/1.1\r\nhost: x\r\n", b"GET /healthz HTTP/1.1\r\nhost: x\r\n\r\nGET /he"]
)
def test_a_connection_on_which_no_request_comes_is_closed(head, impatient):
    """Neither before the first one nor after; else a caller that opens enough of them keeps all others out."""
    host, _, port = impatient.addresses["web"].rpartition(":")
    with socket.create_connection((host, int(port)), timeout=10) as connection:
        connection.sendall(head)
        while connection.recv(1000):
            pass
    with contextlib.closing(http.client.HTTPConnection(impatient.addresses["web"], timeout=10)) as kept:
        for _ in range(8):  # one that is used is kept
            kept.request("GET", "/healthz")
            assert kept.getresponse().read() == b"serving\n"
            time.sleep(0.2)
        assert kept.sock is not None


def test_a_limit_below_the_size_of_one_message_is_refused(capsys):
    from cqos_core.cli import main

    arguments = ("--max-total-bytes", "2000", "--max-message-bytes", "3000")
    assert main(["serve", "--no-config", *arguments]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--max-total-bytes 2000 leaves no room for one message, which may have 3000 (--max-message-bytes)" in said
