"""A caller with many requests delays no other caller, and gets an error above its limits."""

import asyncio
import contextlib
import socket
import subprocess
import sys
import threading
import time
from datetime import date
from functools import partial
from typing import Any, cast

import grpc
import pytest
import uvicorn
from uvicorn.server import ServerState

from cqos.v1 import check_pb2, check_pb2_grpc
from cqos_core.remote.client import ServiceError
from cqos_core.remote.refusal import CALLER_QUOTA, Refused
from cqos_core.service import grpc_server
from cqos_core.service.browser_connections import Connections, IdleTimeoutProtocol
from cqos_core.service.call_dispatch import CallDispatcher
from cqos_core.service.caller_quotas import caller_address
from cqos_core.service.fair_scheduler import FairPool
from cqos_core.service.settings import Limits, Settings
from cqos_core.service.telemetry import Telemetry
from cqos_core.service.web_server import application
from cqos_core.service.worker_frames import ANSWER, ANSWER_JSON
from tests.benchmarks.attacks import PAIR
from tests.service.caller_process import heavy
from tests.service.test_sessions import two

# --- whose turn it is ---


class Simulated(asyncio.SelectorEventLoop):
    """A loop whose clock is at once where the next sleeper wakes, so that nothing depends on the machine."""

    now = 0.0
    _ready: Any
    _scheduled: Any

    def time(self):
        return self.now

    def _run_once(self):
        if not self._ready and self._scheduled:
            self.now = max(self.now, self._scheduled[0]._when)
        cast("Any", super())._run_once()


def simulated(work):
    with contextlib.closing(Simulated()) as loop:
        return loop.run_until_complete(work)


async def ready(_thing):
    """Nothing has to be done between two uses."""


def used(seconds, finished, name):
    """Return work that takes so long, and adds its name to ``finished`` when it is done."""

    async def work(_thing):
        await asyncio.sleep(seconds)
        finished.append(name)

    return work


def test_a_caller_is_served_by_the_time_it_used_and_not_by_its_calls():
    async def run():
        finished: list[str] = []
        turns = FairPool([1], ready)
        many = [asyncio.create_task(turns.use("large", used(0.05, finished, "large"))) for _ in range(6)]
        few = [asyncio.create_task(turns.use("small", used(0.001, finished, "small"))) for _ in range(10)]
        await asyncio.gather(*many, *few)
        return finished

    finished = simulated(run())
    assert finished[0] == "large"  # it came first
    assert finished[1:11] == ["small"] * 10
    assert finished[11:] == ["large"] * 5


def test_equals_take_turns():
    async def run():
        finished: list[str] = []
        turns = FairPool([1], ready)
        await asyncio.gather(*(turns.use(name, used(0.02, finished, name)) for name in "aaaabbbbcccc"))
        return finished

    finished = simulated(run())
    for place in range(0, 12, 3):
        assert sorted(finished[place : place + 3]) == ["a", "b", "c"]


def test_only_who_is_alone_uses_all_at_the_same_time():
    async def run(*callers, after=0.0):
        begun = dict.fromkeys(callers, 0)
        most = dict.fromkeys(callers, 0)
        turns = FairPool([1, 2, 3], ready)

        def work(name):
            async def do(_thing):
                begun[name] += 1
                most[name] = max(most[name], begun[name])
                await asyncio.sleep(0.005)
                begun[name] -= 1

            return do

        await turns.use("somebody", ready)
        await asyncio.sleep(after)
        await asyncio.gather(*(turns.use(name, work(name)) for _ in range(10) for name in callers))
        return most

    assert simulated(run("a", after=61)) == {"a": 3}
    assert simulated(run("a", after=59)) == {"a": 2}  # the first caller may come again
    assert simulated(run("a", "b")) == {"a": 2, "b": 2}


def test_a_queue_that_is_full_has_a_place_for_those_who_have_fewer():
    async def run():
        finished: list[str] = []
        turns = FairPool([1], ready, most_waiting=4)
        many = [asyncio.create_task(turns.use("a", used(0.01, finished, "a"))) for _ in range(5)]
        await asyncio.sleep(0)
        with pytest.raises(Refused, match="4 calls wait already, 4 of them yours"):
            await turns.use("a", used(0.01, finished, "a"))
        few = [asyncio.create_task(turns.use(name, used(0.01, finished, name))) for name in "bbc"]
        ended = await asyncio.gather(*many, *few, return_exceptions=True)
        return finished, [str(each) for each in ended]

    finished, ended = simulated(run())
    refused = "calls of yours wait, and others need a place, too; send fewer at a time"
    # Of the four that waited, the last three had to go, one for each of the others.
    assert [refused in each for each in ended] == [False, False, True, True, True, False, False, False]
    assert sorted(finished) == ["a", "a", "b", "b", "c"]


def test_who_goes_away_leaves_its_place_and_what_it_had_to_others():
    async def run():
        finished: list[str] = []
        turns = FairPool([1], ready, most_waiting=1)
        at_work = asyncio.create_task(turns.use("a", used(0.02, finished, "a")))
        await asyncio.sleep(0.001)
        waiting = asyncio.create_task(turns.use("a", used(0.02, finished, "never")))
        await asyncio.sleep(0.001)
        for each in (waiting, at_work):
            each.cancel()
        await asyncio.sleep(0)
        with pytest.raises(TimeoutError):
            await turns.use("b", used(0, finished, "too late"), 0.001)
        await turns.use("b", used(0, finished, "b"), 1)
        return finished

    assert simulated(run()) == ["a", "b"]


def test_failed_work_raises_and_its_worker_is_restored():
    restored = []

    async def restore(thing):
        restored.append(thing)

    async def fail(_thing):
        raise ValueError("no")

    async def run():
        turns = FairPool([7], restore)
        with pytest.raises(ValueError, match="no"):
            await turns.use("a", fail)
        await turns.use("a", ready)

    simulated(run())
    assert restored[0] == 7


@pytest.mark.parametrize(
    ("peer", "name"),
    [
        ("ipv4:192.0.2.1:5000", "192.0.2.1"),
        ("192.0.2.1:5000", "192.0.2.1"),
        ("ipv6:%5B2001:db8::1%5D:5000", "2001:db8::/64"),
        ("ipv6:%5Bfe80::1%25eth0%5D:5000", "fe80::/64"),
        ("ipv6:%5B::ffff:192.0.2.1%5D:5000", "192.0.2.1"),
        # On one machine all callers have one address, so the connection distinguishes them.
        ("ipv4:127.0.0.1:5000", "127.0.0.1:5000"),
        ("ipv6:%5B::1%5D:5000", "[::1]:5000"),
        ("ipv6:%5B::ffff:127.0.0.1%5D:5000", "[::ffff:127.0.0.1]:5000"),
        ("unix:", "unix:"),
        ("", ""),
    ],
)
def test_callers_without_credentials_are_named_by_their_address(peer, name):
    assert caller_address(peer) == name


# --- with processes that really call ---


class CallerProcess:
    """A caller in a process of its own."""

    def __init__(self, service, kind, number):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.service.caller_process", service.grpc, kind, str(number)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._lines: list[str] = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self._lines.append(line)

    def _wait_for(self, number):
        until = time.monotonic() + 60
        while len(self._lines) < number:
            assert time.monotonic() < until, "it says nothing"
            assert self._process.poll() is None or len(self._lines) >= number, "it ended"
            time.sleep(0.01)

    def begin(self):
        """Let it call when it is ready, and wait for the first answer."""
        self._wait_for(1)
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        self._wait_for(2)

    def done(self):
        """Wait for its end."""
        self._process.wait(120)
        return self.answers()

    def answers(self):
        """Return its answers, each with the time."""
        return [
            (float(time_), answer) for time_, _, answer in (line.strip().partition(" ") for line in self._lines[1:])
        ]

    def end(self):
        self._process.kill()
        self._process.wait()
        self._reader.join()
        self._process.stdin.close()
        self._process.stdout.close()


@pytest.mark.parametrize(
    ("greedy", "modest", "at_most"),
    [
        # Before, the queue was one for all, and the large ones had come first.
        (("flood", 60), ("trickle", 10), 20),
        # Each stream had its turn, regardless of its caller: more than 60 of their pairs for each of the other's.
        (("streams", 50), ("pairs", 10), 300),
        # And each session: more than 20 of their edits for each of the other's.
        (("edits", 20), ("drawing", 10), 40),
    ],
    ids=["documents and models", "pairs", "sessions"],
)
def test_one_who_asks_for_little_is_served_between_those_who_ask_for_much(service, greedy, modest, at_most):
    many, few = CallerProcess(service, *greedy), CallerProcess(service, *modest)
    try:
        few._wait_for(1)
        many.begin()
        began = time.monotonic()
        few.begin()
        served = few.done()
        assert [answer for _, answer in served] == ["OK"] * modest[1]
        ended = served[-1][0]
        meanwhile = [answer for when, answer in many.answers() if began <= when <= ended]
        assert len(meanwhile) <= at_most
        # The greedy caller is still served.
        many._wait_for(len(many.answers()) + 2)
        assert {answer for _, answer in many.answers()} == {"OK"}
    finally:
        many.end()
        few.end()


TOKENS = ("a-token-of-somebody", "a-token-of-another")


def test_one_caller_has_its_share_of_calls_and_no_more(tmp_path, start):
    """Tokens tell them apart, here over one connection."""
    (tmp_path / "tokens").write_text("\n".join(TOKENS), encoding="utf-8")
    arguments = ("--token-file", str(tmp_path / "tokens"), "--max-calls", "16", "--max-share", "0.25")
    with start(*arguments) as service, grpc.insecure_channel(service.grpc) as channel:
        checks: Any = check_pb2_grpc.CheckServiceStub(channel)
        one, other = ([("authorization", f"Bearer {token}")] for token in TOKENS)
        under_way = [checks.CheckSystem.future(heavy(number), metadata=one) for number in range(10)]
        refused = [each for each in under_way if each.code() == grpc.StatusCode.RESOURCE_EXHAUSTED]
        assert len(refused) == 6
        message = "one caller may have 4 of the 16 calls at the same time, and so many of yours are under way"
        assert {each.details() for each in refused} == {f"{message}; send fewer at a time"}
        assert not service.log.count(TOKENS[0])
        again = [checks.CheckSystem.future(heavy(100 + number), metadata=one) for number in range(2)]
        checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2"), metadata=other, timeout=20)
        assert {each.code() for each in again} == {grpc.StatusCode.OK}


def test_one_caller_has_its_share_of_sessions_and_no_more(narrow):
    with narrow.client() as client:
        with client.session(two()) as one, client.session(two()) as other, client.session(two()) as third:
            one.report()
            other.report()
            with pytest.raises(ServiceError, match="one caller may have 2 of the 4 sessions") as raised:
                third.report()
            assert raised.value.code == "RESOURCE_EXHAUSTED"
            elsewhere = CallerProcess(narrow, "drawing", 3)
            try:
                elsewhere.begin()
                assert [answer for _, answer in elsewhere.done()] == ["OK"] * 3
            finally:
                elsewhere.end()
        # It has its places back when the service hears that it has gone.
        until = time.monotonic() + 20
        while True:
            with client.session(two()) as again:
                try:
                    assert again.report().endpoints == 2
                    break
                except ServiceError:
                    assert time.monotonic() < until


# --- the loop of the serving process ---


def test_requests_of_browsers_begin_one_in_a_turn_of_the_loop():
    """Else eight of them are answered in one go, and every step of other calls waits for that."""
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": "POST",
        "path": PAIR,
        "raw_path": b"",
        "query_string": b"",
        "headers": [(b"content-type", b"application/json")],
        "client": ("192.0.2.1", 5000),
        "server": ("127.0.0.1", 80),
        "scheme": "http",
    }

    async def run():
        calls = CallDispatcher(Settings(), Telemetry(Settings()))
        asked = application(calls, Settings())
        turn = 0
        answered: list[int] = []

        async def counting():
            nonlocal turn
            while len(answered) < 8:
                turn += 1
                await asyncio.sleep(0)

        async def ask(number):
            body = f'{{"protocol": "ros2", "topic": {{"name": "t{number}"}}}}'.encode()
            calls._answers.put((f"json {PAIR}", date.today(), body), b"{}")  # noqa: DTZ011 - as the service has it

            messages = [{"type": "http.request", "body": body, "more_body": False}]

            async def receive():
                return messages.pop() if messages else await asyncio.Event().wait()

            async def send(message):
                if message["type"] == "http.response.start":
                    assert message["status"] == 200
                    answered.append(turn)

            await asked(dict(scope), receive, send)

        await asyncio.gather(counting(), *map(ask, range(8)))
        await calls.close()
        assert len(set(answered)) == 8, answered

    asyncio.run(run())


def test_requests_of_browsers_are_answered_by_workers(monkeypatch):
    """Beside calls of gRPC the loop has only HTTP to do for them."""

    async def run():
        calls = CallDispatcher(Settings(), Telemetry(Settings()))
        asked = []

        async def answer(_caller, kind, method, data, _seconds):
            asked.append((kind, method, data))
            return b"answer"

        monkeypatch.setattr(calls.pool, "call", answer)
        with calls.count_call({}, "ipv4:192.0.2.1:5000") as caller:
            for json in (False, True):
                for _ in range(2):  # the second one from memory
                    assert await calls.unary(caller, PAIR, b"", None, browser=True, json=json) == b"answer"
        assert asked == [(ANSWER, PAIR, b""), (ANSWER_JSON, PAIR, b"")]

    asyncio.run(run())


def test_connections_of_browsers_are_accepted_one_in_a_turn_of_the_loop():
    turn, made = 0, []

    class Counted(IdleTimeoutProtocol):
        def connection_made(self, transport):
            made.append(turn)
            super().connection_made(transport)

    async def run():
        nonlocal turn
        held = Connections(Limits())
        settings = Settings(web="127.0.0.1:0")
        config = uvicorn.Config(application(CallDispatcher(settings, Telemetry(settings)), settings), lifespan="off")
        config.load()
        kind = cast("Any", type("Protocol", (Counted,), {"held": held}))
        with socket.create_server(("127.0.0.1", 0)) as listening, contextlib.ExitStack() as stack:
            listening.setblocking(False)
            for _ in range(20):
                stack.enter_context(socket.create_connection(listening.getsockname()))
            speaking = partial(kind, config, ServerState(), {})
            accepting = asyncio.ensure_future(held.accept(listening, speaking, None))
            while len(made) < 20:
                turn += 1
                await asyncio.sleep(0)
            accepting.cancel()

    asyncio.run(run())
    assert len(set(made)) == 20


def test_streams_that_are_refused_together_end_one_in_a_turn_of_the_loop(monkeypatch):
    monkeypatch.setattr(grpc_server, "_REFUSING_SECONDS", 0)

    class Context:
        def invocation_metadata(self):
            return ()

        async def abort(self, code, _message, _trailing):
            assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
            ended.append(turn)

    ended: list[int] = []
    turn = 0

    async def run():
        nonlocal turn
        settings = Settings(listen="127.0.0.1:0")
        door = grpc_server.GrpcServer(CallDispatcher(settings, Telemetry(settings)), settings)
        refused = Refused("RESOURCE_EXHAUSTED", "too many", reason=CALLER_QUOTA)
        tasks = [asyncio.ensure_future(door._refuse(Context(), refused, "")) for _ in range(20)]
        while not all(task.done() for task in tasks):
            turn += 1
            await asyncio.sleep(0)
        await door.stop(0)

    asyncio.run(run())
    assert len(ended) == 20
    assert len(set(ended)) == 20
