"""Every resource that a stranger can take is bounded in number and time, and nobody else loses anything by it."""

import asyncio
import contextlib
import http.client
import json
import os
import select
import signal
import socket
import threading
import time
from dataclasses import replace

import grpc
import pytest

from cqos_core.remote.refusal import Refused
from cqos_core.service.browser_connections import IdleTimeoutProtocol
from cqos_core.service.call_dispatch import CallDispatcher
from cqos_core.service.caller_quotas import Callers, SharedBytes
from cqos_core.service.settings import Limits, Settings
from cqos_core.service.telemetry import Meter, Telemetry
from cqos_core.service.web_server import WebServer
from tests.benchmarks.attacks import EDIT, PAIR, POLITE, reached
from tests.service.raw_sockets import connected, grpc_status
from tests.service.test_open_sessions import FIXED, MODEL, editing, opening, stub_of
from tests.service.test_process import certificate
from tests.service.test_sessions import two

REFLECTION = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"
PAIRS = "/cqos.v1.CheckService/CheckPairs"
TOKEN, OTHER = "a-secret-token-of-somebody", "a-token-of-another-one"
ENDED = 15
"""Seconds in which what has a limit of half a second ends, also on a busy machine."""


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    """A folder with the tokens of two callers."""
    folder = tmp_path_factory.mktemp("guarded")
    (folder / "tokens").write_text(f"{TOKEN}\n{OTHER}\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def impatient(start):
    """A service that waits for nothing, and takes few calls."""
    with start("--web", "127.0.0.1:0", "--max-seconds", "0.5", "--max-calls", "16") as running:
        yield running


# --- a deadline ends an answer, and nothing else ---


def test_a_deadline_of_one_caller_ends_no_session_of_another(start):
    with start("--session-workers", "1", "--max-sessions", "2", "--max-share", "1") as own:
        one, channel = stub_of(own)
        other, elsewhere = stub_of(own)
        with channel, elsewhere:
            before = set(own.children())
            opened = one.OpenSession(opening())
            (home,) = set(own.children()) - before
            os.kill(home, signal.SIGSTOP)  # what is asked of it takes for ever
            for ask in (
                lambda: other.OpenSession(opening(), timeout=0.2),
                lambda: one.EditSession(editing(opened.session, 2, 1, model=FIXED), timeout=0.2),
            ):
                with pytest.raises(grpc.RpcError) as raised:
                    ask()
                assert raised.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED
            os.kill(home, signal.SIGCONT)
            again = one.EditSession(editing(opened.session, 3, 1, model=MODEL), timeout=60)
            assert again.revision == 3
            assert not any(line["event"] == "worker ended" for line in own.lines)
            until = time.monotonic() + 60
            opened = None
            while opened is None:  # the place of the session that nobody waited for is free when its work is done
                assert time.monotonic() < until
                with contextlib.suppress(grpc.RpcError):
                    opened = other.OpenSession(opening(), timeout=60)


# --- copies of sessions ---


def test_bytes_of_who_has_most_go_first():
    callers = Callers(Limits(share=0.75), Meter())
    gone: list[str] = []
    with contextlib.ExitStack() as stack:
        many, few, third = (stack.enter_context(callers.count_call(name)) for name in ("many", "few", "third"))
        shared = SharedBytes(100)
        assert shared.put(many, 1, 40, lambda: gone.append("first"))
        assert shared.put(many, 2, 35, lambda: gone.append("second"))
        assert not shared.put(many, 3, 1, lambda: None)  # more than its share
        assert shared.put(few, 1, 20, lambda: gone.append("few"))
        assert shared.put(third, 1, 20, lambda: gone.append("third"))
        assert (gone, shared.held, shared.of("many")) == (["first"], 75, 35)
        assert not shared.put(third, 2, 50, lambda: None)  # nobody has more
        for name, key in (("many", 2), ("few", 1), ("third", 1), ("third", 1)):
            shared.forget(name, key)
        assert shared.held == 0


def test_a_caller_that_keeps_much_takes_no_copy_of_another(guarded, start):
    """A session whose copy is gone ends with its process."""
    sizes = ("--max-message-bytes", "2000000", "--max-total-bytes", "8000000", "--max-sessions", "16")
    arguments = ("--session-workers", "1", "--token-file", str(guarded / "tokens"), *sizes)
    with (
        start(*arguments) as own,
        own.client(token=TOKEN) as greedy,
        own.client(token=OTHER) as modest,
        contextlib.ExitStack() as stack,
    ):
        before = set(own.children())
        for _ in range(4):
            stack.enter_context(greedy.session(replace(two(), name="g" * 490_000))).report()
        session = stack.enter_context(modest.session(replace(two(), name="m" * 50_000)))
        session.report()
        (home,) = set(own.children()) - before
        os.kill(home, signal.SIGKILL)
        session.remove("w")
        assert session.report().endpoints == 1


# --- streams ---


@pytest.mark.parametrize("method", [REFLECTION, PAIRS, EDIT])
def test_a_stream_that_sends_nothing_ends(method, impatient):
    never = threading.Event()

    def nothing():
        never.wait(ENDED)
        yield from ()

    with reached(impatient.grpc) as channel:
        stream = channel.stream_stream(method)(nothing(), timeout=ENDED)
        assert stream.code() is grpc.StatusCode.ABORTED
        assert "nothing was heard for 0.5 seconds" in stream.details()
        never.set()


@pytest.fixture(scope="module")
def few(start):
    """A service that takes eight calls, two of each caller."""
    with start("--max-calls", "8", "--max-share", "0.25") as running:
        yield running


@pytest.mark.parametrize("method", [REFLECTION, PAIRS, PAIR])
def test_streams_over_many_connections_lock_nobody_out(method, few):
    never = threading.Event()

    def nothing():
        never.wait(60)
        yield from ()

    with contextlib.ExitStack() as stack:
        for _ in range(6):  # each is a caller of its own, and has two of the eight places
            channel = stack.enter_context(reached(few.grpc, ("grpc.use_local_subchannel_pool", 1)))
            held = [channel.stream_stream(method)(nothing(), timeout=60) for _ in range(2)]
            for each in held:
                stack.callback(each.cancel)
        with reached(few.grpc, ("grpc.use_local_subchannel_pool", 1)) as channel:
            for _ in range(20):
                channel.unary_unary(PAIR)(POLITE, timeout=20)
        never.set()


def test_who_has_most_calls_gives_way_while_it_waits():
    callers = Callers(Limits(calls=4, share=0.5), Meter())
    given: list[str] = []
    with contextlib.ExitStack() as stack:
        for name in ("a", "a", "b", "b"):
            caller = stack.enter_context(callers.count_call(name))
            if name == "a":
                stack.enter_context(callers.waiting_place(caller, lambda: given.append("a")))
        stack.enter_context(callers.count_call("c"))
        assert given == ["a"]
        with pytest.raises(Refused, match="all that this service takes"), callers.count_call("d"):
            pass  # of `a` one is left, and `b` waits for nobody
    assert (callers.calls, callers._going, callers._waiting) == (0, 0, {})


# --- the server for browsers ---


def test_nothing_that_browsers_send_delays_grpc_calls(monkeypatch):
    parsing, may_go_on = threading.Event(), threading.Event()
    went_on: list[bool] = []

    def parsed(_protocol, _data):
        parsing.set()
        went_on.append(may_go_on.wait(5))

    monkeypatch.setattr(IdleTimeoutProtocol, "data_received", parsed)

    async def run():
        settings = Settings(web="127.0.0.1:0")
        calls = CallDispatcher(settings, Telemetry(settings))
        door = WebServer(calls, settings)
        await door.start()
        with connected(door.address) as connection:
            connection.sendall(b"GET /healthz HTTP/1.1\r\nhost: x\r\n\r\n")
            while not parsing.is_set():  # noqa: ASYNC110 - it is set in another thread
                await asyncio.sleep(0)
            may_go_on.set()
        await door.stop(0)
        await calls.close()

    asyncio.run(run())
    assert went_on[0]


HEAD = f"POST {PAIR} HTTP/1.1\r\nhost: x\r\ncontent-type: application/proto\r\ntransfer-encoding: chunked\r\n".encode()


def answered(connection):
    """The status, the headers and the content of an answer, after which the connection ends."""
    answer = http.client.HTTPResponse(connection)
    answer.begin()
    content = answer.read()
    with contextlib.suppress(ConnectionError):
        assert connection.recv(1) == b""
    return answer.status, answer.getheader("connection"), content


def test_many_small_chunks_are_refused(service):
    with connected(service.addresses["web"]) as connection:
        connection.sendall(HEAD + b"\r\n" + b"1\r\nx\r\n" * 2_000)
        assert answered(connection)[:2] == (400, "close")
    with connected(service.addresses["web"]) as connection:  # as a program does that writes in lines
        connection.sendall(HEAD + b"\r\n" + (b"32\r\n" + b"\n" * 50 + b"\r\n") * 250 + b"0\r\n\r\n")
        answer = http.client.HTTPResponse(connection)
        answer.begin()
        assert json.loads(answer.read())["code"] == "invalid_argument"
        assert not answer.will_close


def test_the_rest_of_a_refused_request_is_dropped_and_its_answer_arrives(guarded, start):
    with start("--web", "127.0.0.1:0", "--token-file", str(guarded / "tokens")) as own:
        with connected(own.addresses["web"]) as connection:
            connection.sendall(HEAD + b"\r\n1\r\nx\r\n")
            status, closing, content = answered(connection)
            assert (status, closing, json.loads(content)["code"]) == (401, "close", "unauthenticated")
        # --- and what stands in headers is in no log and in no answer ---
        for more in (b"\xa0", b"\xc2\xa0", b"\xff"):
            given = b"Bearer " + TOKEN.encode() + more
            assert grpc_status(own.grpc, PAIR, (b"authorization", given), (b"x-secret", given)) == 1
            with connected(own.addresses["web"]) as connection:
                connection.sendall(HEAD + b"authorization: " + given + b"\r\n\r\n0\r\n\r\n")
                answer = http.client.HTTPResponse(connection)
                answer.begin()
                assert answer.status in (400, 401)
                assert TOKEN.encode() not in answer.read()
        own.wait_for(lambda line: "Invalid encoding" in str(line["event"]))
    assert TOKEN not in own.log


def test_a_silent_connection_to_an_encrypted_server_is_closed_in_time_and_number(guarded, start):
    certificate(guarded, "server")
    tls = ("--tls-cert", str(guarded / "server.pem"), "--tls-key", str(guarded / "server.key"))
    with (
        start("--web", "127.0.0.1:0", "--max-calls", "4", "--max-seconds", "2", *tls) as own,
        contextlib.ExitStack() as stack,
    ):
        silent = [stack.enter_context(connected(own.addresses["web"])) for _ in range(6)]
        for each in silent[:2]:  # six are more than four, and the oldest go first
            with contextlib.suppress(ConnectionError):
                assert each.recv(1) == b""
        began = time.monotonic()
        silent[-1].settimeout(40)
        with contextlib.suppress(ConnectionError):
            assert silent[-1].recv(1) == b""
        assert time.monotonic() - began < 30  # without a limit of its own the negotiation has a minute


def test_an_answer_that_nobody_reads_ends(monkeypatch):
    """One that is ready at once: its time is that of the reader alone, however busy the machine is."""

    async def run():
        settings = Settings(web="127.0.0.1:0", limits=Limits(seconds=3))
        calls = CallDispatcher(settings, Telemetry(settings))
        answered = asyncio.Event()

        async def large(*_given, **_named):
            answered.set()
            return b"x" * 8_000_000

        monkeypatch.setattr(calls, "unary", large)
        door = WebServer(calls, settings)
        await door.start()
        with socket.socket() as connection:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            host, _, port = door.address.rpartition(":")
            connection.connect((host, int(port)))
            connection.sendall(HEAD.replace(b"transfer-encoding: chunked", b"content-length: 0") + b"\r\n")
            await asyncio.wait_for(answered.wait(), 60)
            watched = select.poll()
            watched.register(connection, 0)
            assert await asyncio.to_thread(watched.poll, 60_000), "it is still there"
        await door.stop(0)
        await calls.close()

    asyncio.run(run())
