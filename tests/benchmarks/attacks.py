"""Measures a polite client while strangers attack, beside a bare echo under the same attack.

python tests/benchmarks/attacks.py [--seconds 3] [--only NAME ...]

The last seven are those of which the service did not take enough care before. What they attack is a session or a door, so the polite
client edits a session where sessions are attacked, and calls over TLS where that is.

Everything runs on loopback, in processes that this script starts and ends by their ids; every attack is bounded in number and in
time. The polite client sends a small `CheckPair` every 10 ms and says how long each took. The echo is a plain `grpc.aio` server
that returns a ready answer. A plain `uvicorn` on the same event loop returns an empty one. All share the processors of one
machine, so an attacker takes time from the polite client too: what the echo loses is what no server could keep.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import socket
import statistics
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import grpc
from grpc_health.v1 import health_pb2

from cqos.v1 import check_pb2, report_pb2, session_pb2, system_pb2
from tests.service.raw_sockets import grpc_status
from tests.service.service_process import serving

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PAIR = "/cqos.v1.CheckService/CheckPair"
SYSTEM = "/cqos.v1.CheckService/CheckSystem"
SESSIONS = "/cqos.v1.SessionService/"
EDIT = f"{SESSIONS}Edit"
REFLECTION = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"
WATCH = "/grpc.health.v1.Health/Watch"
_TAKING_HOLD = 0.5  # seconds
SPAWNED = multiprocessing.get_context("forkserver")
"""Starts processes that have imported this module already, and nothing that another thread may hold."""
SPAWNED.set_forkserver_preload([__name__])
POLITE = check_pb2.CheckPairRequest(protocol="ros2", topic={"name": "polite"}).SerializeToString()


def reached(address: str, *options: tuple[str, Any]) -> Any:
    """A channel of plain bytes."""
    return grpc.insecure_channel(address, options)


class Polite(NamedTuple):
    """What a polite client saw: percentiles in milliseconds, and how many of its calls came to nothing."""

    calls: int
    p50: float
    p99: float
    lost: int


Asking: TypeAlias = "Callable[[int], None]"


def _pairs(channel: Any, patience: float) -> Asking:
    """Ask about one pair after the other."""
    ask = channel.unary_unary(PAIR)

    def asked(number: int) -> None:
        question = check_pb2.CheckPairRequest(protocol="ros2", topic={"name": f"polite{number}"})
        ask(question.SerializeToString(), timeout=patience)

    return asked


def _edits(channel: Any, patience: float) -> Asking:
    """Open a session, and edit it again and again."""
    opening = session_pb2.OpenSessionRequest(revision=1, system=system_pb2.System(protocol="ros2"))
    opened = channel.unary_unary(f"{SESSIONS}OpenSession")(opening.SerializeToString(), timeout=patience)
    session = session_pb2.OpenSessionResponse.FromString(opened).session
    ask = channel.unary_unary(f"{SESSIONS}EditSession")

    def asked(number: int) -> None:
        put = session_pb2.Change(put_participant=system_pb2.Participant(id=f"p{number % 10}"))
        edit = session_pb2.EditSessionRequest(
            revision=number + 1,
            base_revision=number,
            session=session,
            changes=session_pb2.Changes(changes=[put]),
        )
        ask(edit.SerializeToString(), timeout=patience)

    return asked


def polite(
    address: str,
    seconds: float,
    pause: float = 0.01,
    least: int = 1,
    *,
    edits: bool = False,
    authority: bytes | None = None,
    patience: float = 20,
) -> Polite:
    """Ask small questions one after the other, for so many seconds and at least so many; each waits as long as ``patience`` says."""
    took, lost = [], 0
    secure = authority and grpc.secure_channel(address, grpc.ssl_channel_credentials(authority))
    with secure or reached(address) as channel:
        ask = (_edits if edits else _pairs)(channel, patience)
        with contextlib.suppress(grpc.RpcError):  # the first one opens the connection
            ask(0)
        until = time.monotonic() + seconds
        number = 0
        while time.monotonic() < until or number < least:
            number += 1
            began = time.monotonic()
            try:
                ask(number)
            except grpc.RpcError:
                lost += 1
            took.append(time.monotonic() - began)
            time.sleep(pause)
    at = statistics.quantiles(took, n=100, method="inclusive") if len(took) > 1 else [*took] * 99
    return Polite(len(took), at[49] * 1000, at[98] * 1000, lost)


# --- the attacks: each goes on until it is ended, and is bounded in number ---


def renaming(bridges: int) -> bytes:
    """A model of few bytes that would grow without end."""

    def end(role: report_pb2.Role.ValueType, participant: str, topic: str) -> system_pb2.Endpoint:
        return system_pb2.Endpoint(role=role, participant=participant, topic=topic)

    system = system_pb2.System(
        protocol="ros2",
        participants=[system_pb2.Participant(id="p"), system_pb2.Participant(id="q")],
        endpoints=[end(report_pb2.ROLE_PUBLISHER, "p", "/x")],
        bridges=[
            system_pb2.Bridge(
                id=f"b{number}",
                routes=[
                    system_pb2.Route(
                        source=end(report_pb2.ROLE_SUBSCRIBER, "p", "*"),
                        target=end(report_pb2.ROLE_PUBLISHER, "q", f"{chr(97 + number)}/*/*"),
                    )
                ],
            )
            for number in range(bridges)
        ],
    )
    system.endpoints[0].id = "w"
    return check_pb2.CheckSystemRequest(system=system).SerializeToString()


def asked(
    address: str, method: str, question: Callable[[int], bytes], connections: int, at_once: int, most: int
) -> None:
    """Send calls over so many connections, so many at a time on each."""

    def flood(which: int) -> None:
        with reached(address, ("grpc.use_local_subchannel_pool", 1)) as channel:
            call = channel.unary_unary(method)
            free = threading.Semaphore(at_once)
            for number in range(which, most, connections):
                free.acquire()
                call.future(question(number), timeout=20).add_done_callback(lambda _done: free.release())
            for _ in range(at_once):
                free.acquire()

    each_in_a_thread(flood, connections)


def each_in_a_thread(work: Callable[[int], None], number: int) -> None:
    """Do work so many times at once."""
    threads = [threading.Thread(target=work, args=(each,), daemon=True) for each in range(number)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def flood_of_pairs(address: str, _web: str) -> None:
    """Two connections, 32 questions in flight on each."""
    asked(
        address,
        PAIR,
        lambda n: check_pb2.CheckPairRequest(protocol="ros2", topic={"name": f"f{n}"}).SerializeToString(),
        *(2, 32, 100_000),
    )


def growing_models(address: str, _web: str) -> None:
    """Models of eight bridges that rename what they carry."""
    asked(address, SYSTEM, lambda _n: renaming(8), 1, 4, 2_000)


def oversized(address: str, _web: str) -> None:
    """Messages of 20 MB, four at a time."""
    data = b"\x00" * 20_000_000
    asked(address, SYSTEM, lambda _n: data, 1, 4, 200)


def held_streams(address: str, method: str, number: int) -> None:
    """Open streams that send headers only."""
    with reached(address) as channel:
        waiting = threading.Event()

        def nothing() -> Iterator[bytes]:
            waiting.wait()
            yield from ()

        kept = [channel.stream_stream(method)(nothing(), timeout=60) for _ in range(number)]
        try:
            while any(each.is_active() for each in kept):
                time.sleep(0.2)
                kept = [
                    each if each.is_active() else channel.stream_stream(method)(nothing(), timeout=60) for each in kept
                ]
                time.sleep(0.3)
        finally:
            waiting.set()


def header_only_streams(address: str, _web: str) -> None:
    """1,100 calls that send only their headers."""
    held_streams(address, PAIR, 1_100)


def session_streams(address: str, _web: str) -> None:
    """3,000 session streams, each with an open system."""
    opening = session_pb2.EditRequest(open=system_pb2.System(protocol="ros2")).SerializeToString()
    with reached(address) as channel:
        waiting = threading.Event()

        def once() -> Iterator[bytes]:
            yield opening
            waiting.wait()

        kept = [channel.stream_stream(EDIT)(once(), timeout=60) for _ in range(300)]
        try:
            for _ in range(2_700):
                kept.append(channel.stream_stream(EDIT)(once(), timeout=60))
                time.sleep(0.002)
            time.sleep(60)
        finally:
            waiting.set()


def health_watches(address: str, _web: str) -> None:
    """1,100 streams that watch health, without a token."""
    with reached(address) as channel:
        asking = health_pb2.HealthCheckRequest().SerializeToString()
        kept = [channel.unary_stream(WATCH)(asking, timeout=60) for _ in range(1_100)]
        time.sleep(60)
        del kept


def rapid_reset(address: str, _web: str) -> None:
    """Calls that are cancelled as soon as they are made."""
    with reached(address) as channel:
        call = channel.unary_unary(PAIR)
        for number in range(200_000):
            call.future(POLITE, timeout=20).cancel()
            if number % 100 == 0:
                time.sleep(0.01)


def silent_connections(address: str, _web: str, number: int = 1_100) -> None:
    """TCP connections on which nothing comes, kept up."""
    host, _, port = address.rpartition(":")
    with contextlib.ExitStack() as stack:
        for _ in range(number):
            with contextlib.suppress(OSError):
                stack.enter_context(socket.create_connection((host, int(port)), timeout=5))
        time.sleep(60)


def silent_at_both_doors(address: str, web: str) -> None:
    """Silent connections to both doors."""
    each_in_a_thread(lambda which: silent_connections((address, web)[which], ""), 2)


def half_heads(_address: str, web: str) -> None:
    """Connections to the browsers' door that send half a head."""
    host, _, port = web.rpartition(":")
    with contextlib.ExitStack() as stack:
        for _ in range(1_100):
            with contextlib.suppress(OSError):
                opened = stack.enter_context(socket.create_connection((host, int(port)), timeout=5))
                opened.sendall(b"POST /cqos.v1.CheckService/CheckPair HTTP/1.1\r\nhost: x\r\n")
        time.sleep(60)


def http_flood(_address: str, web: str) -> None:
    """Requests over HTTP/1.1, eight connections without a pause."""
    import http.client

    def flood(which: int) -> None:
        connection = http.client.HTTPConnection(web, timeout=20)
        for number in range(50_000):
            body = f'{{"protocol": "ros2", "topic": {{"name": "h{which}x{number}"}}}}'
            connection.request("POST", PAIR, body, {"content-type": "application/json"})
            connection.getresponse().read()

    each_in_a_thread(flood, 8)


def deadlines_on_a_worker(address: str, _web: str) -> None:
    """Documents of 30,000 lines with a deadline of 200 ms, one after the other."""
    lines = b"".join(b"  p%d: {publishes: {t%d: {depth: 5}}}\n" % (number, number) for number in range(19_000))
    document = check_pb2.Document(name="a.yaml", content=b"cqos: 1\nprotocol: ros2\nparticipants:\n" + lines)
    opening = session_pb2.OpenSessionRequest(documents=check_pb2.Documents(documents=[document])).SerializeToString()
    with reached(address) as channel:
        for _ in range(100):
            with contextlib.suppress(grpc.RpcError):
                channel.unary_unary(f"{SESSIONS}OpenSession")(opening, timeout=0.2)
            time.sleep(0.05)


def small_chunks(_address: str, web: str) -> None:
    """Bodies of a megabyte in chunks of one byte, eight connections without a pause."""
    head = f"POST {PAIR} HTTP/1.1\r\nhost: x\r\ncontent-type: application/proto\r\ntransfer-encoding: chunked\r\n\r\n"
    body = head.encode() + b"1\r\nx\r\n" * 1_000_000

    def flood(_which: int) -> None:
        host, _, port = web.rpartition(":")
        for _ in range(200):
            with contextlib.suppress(OSError), socket.create_connection((host, int(port)), timeout=20) as opened:
                opened.sendall(body)

    each_in_a_thread(flood, 8)


def silent_at_the_encrypted_door(_address: str, web: str) -> None:
    """1,500 silent connections to the browsers' door, which waits for TLS."""
    silent_connections(web, "", 1_500)


def reflection_streams(address: str, _web: str) -> None:
    """Streams of reflection that send nothing, as many as eight connections take."""

    def hold(_which: int) -> None:
        with reached(address, ("grpc.use_local_subchannel_pool", 1)) as channel:
            waiting = threading.Event()

            def nothing() -> Iterator[bytes]:
                waiting.wait()
                yield from ()

            kept = [channel.stream_stream(REFLECTION)(nothing(), timeout=60) for _ in range(128)]
            time.sleep(60)
            waiting.set()
            del kept

    each_in_a_thread(hold, 8)


def unread_answers(_address: str, web: str) -> None:
    """200 connections that ask for the description of a pack, 50 times each, and read nothing."""
    body = b'{"id": "dds"}'
    head = f"POST /cqos.v1.CatalogueService/GetPack HTTP/1.1\r\nhost: x\r\ncontent-length: {len(body)}\r\n"
    asking = head.encode() + b"content-type: application/json\r\naccept-encoding: identity\r\n\r\n" + body
    host, _, port = web.rpartition(":")
    with contextlib.ExitStack() as stack:
        for _ in range(200):
            with contextlib.suppress(OSError):
                opened = stack.enter_context(socket.create_connection((host, int(port)), timeout=20))
                opened.sendall(asking * 50)
        time.sleep(60)


def copies_of_sessions(address: str, _web: str) -> None:
    """Four sessions of 15 MB, which take all room for copies, and an edit that takes longer than its deadline."""
    opening = session_pb2.EditRequest(open=system_pb2.System(protocol="ros2", name="x" * 15_000_000))
    with reached(address) as channel:
        waiting = threading.Event()

        def once() -> Iterator[bytes]:
            yield opening.SerializeToString()
            waiting.wait()

        kept = [channel.stream_stream(EDIT)(once(), timeout=60) for _ in range(4)]
        time.sleep(60)
        waiting.set()
        del kept


def odd_headers(address: str, _web: str) -> None:
    """Calls whose token ends with a byte that is no UTF-8, one after the other."""
    for _ in range(5_000):
        with contextlib.suppress(OSError):
            grpc_status(address, PAIR, (b"authorization", b"Bearer a-token-of-somebody\xa0"))


OF_SESSIONS = frozenset({"deadlines on a worker", "copies of sessions"})
ENCRYPTED = frozenset({"silent at the encrypted door"})

ATTACKS: dict[str, Callable[[str, str], None]] = {
    each.__name__.replace("_", " "): each
    for each in (
        flood_of_pairs,
        growing_models,
        oversized,
        header_only_streams,
        health_watches,
        session_streams,
        rapid_reset,
        silent_at_both_doors,
        half_heads,
        http_flood,
        deadlines_on_a_worker,
        small_chunks,
        silent_at_the_encrypted_door,
        reflection_streams,
        unread_answers,
        copies_of_sessions,
        odd_headers,
    )
}


@contextlib.contextmanager
def attacking(name: str, address: str, web: str, taking_hold: float = _TAKING_HOLD) -> Iterator[None]:
    """Let a process of its own attack; it is ended by its id."""
    here, there = SPAWNED.Pipe()
    process = SPAWNED.Process(target=attack, args=(there, name, address, web), daemon=True)
    process.start()
    here.recv()
    time.sleep(taking_hold)
    try:
        yield
    finally:
        process.kill()
        process.join()


def attack(ready: Any, name: str, address: str, web: str) -> None:
    """Attack, in the process that was started for it; whatever a server does to it is no fault of ours."""
    ready.send(None)
    with contextlib.suppress(OSError, grpc.RpcError):
        ATTACKS[name](address, web)


def echo(pipe: Any) -> None:
    """Answer every call of one or many messages, and every HTTP request, with the same bytes, in a process of its own."""
    import asyncio

    import uvicorn

    ready = check_pb2.CheckPairResponse(report=report_pb2.PairReport()).SerializeToString() + b"\x00" * 0

    async def page(_scope: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
        await send({"type": "http.response.body", "body": b"{}"})

    async def serve() -> None:
        async def answer(_data: bytes, _context: Any) -> bytes:
            return ready

        async def stream(requests: Any, _context: Any) -> Any:
            async for _ in requests:
                yield ready

        class Anything(grpc.GenericRpcHandler):
            def service(self, details: Any) -> Any:
                if details.method in (EDIT, WATCH, REFLECTION):
                    return grpc.stream_stream_rpc_method_handler(stream)
                return grpc.unary_unary_rpc_method_handler(answer)

        server = grpc.aio.server(options=(("grpc.max_receive_message_length", 16 * 1024 * 1024),))
        server.add_generic_rpc_handlers((Anything(),))
        opened = server.add_insecure_port("127.0.0.1:0")
        await server.start()
        http = socket.create_server(("127.0.0.1", 0))
        pipe.send((f"127.0.0.1:{opened}", f"127.0.0.1:{http.getsockname()[1]}"))
        await uvicorn.Server(uvicorn.Config(page, http="h11", lifespan="off", log_config=None)).serve([http])

    asyncio.run(serve())


@contextlib.contextmanager
def echoing() -> Iterator[tuple[str, str]]:
    """The addresses of an echo, for gRPC and for HTTP."""
    here, there = SPAWNED.Pipe()
    process = SPAWNED.Process(target=echo, args=(there,), daemon=True)
    process.start()
    try:
        yield here.recv()
    finally:
        process.kill()
        process.join()


Rows: TypeAlias = tuple[Polite, Polite]


def measured(names: list[str], seconds: float) -> Iterator[tuple[str, Rows, Rows]]:
    """Yield per attack the polite client at the service and at the echo, calm and under attack."""
    for name in names:
        edits = name in OF_SESSIONS
        with contextlib.ExitStack() as stack:
            arguments, authority = stack.enter_context(_encrypted()) if name in ENCRYPTED else ((), None)
            service = stack.enter_context(serving("--web", "127.0.0.1:0", "--log-level", "error", *arguments))
            web = str(service.addresses["web"])
            calm = polite(service.grpc, seconds, edits=edits, authority=authority)
            with attacking(name, service.grpc, web):
                under = polite(service.grpc, seconds, edits=edits, authority=authority)
        with echoing() as (address, http):
            calm_echo = polite(address, seconds, edits=edits)
            with attacking(name, address, http):
                yield name, (calm, under), (calm_echo, polite(address, seconds, edits=edits))


@contextlib.contextmanager
def _encrypted() -> Iterator[tuple[tuple[str, ...], bytes]]:
    """Yield the options of a service with a certificate, and what to trust."""
    from tests.service.test_process import certificate

    with tempfile.TemporaryDirectory(prefix="cqos-attacks-") as name:
        folder = Path(name)
        certificate(folder, "server")
        options = ("--tls-cert", str(folder / "server.pem"), "--tls-key", str(folder / "server.key"))
        yield options, (folder / "server.pem").read_bytes()


def _cells(calm: Polite, under: Polite) -> list[str]:
    return [f"{calm.p99:.0f} ms", f"{under.p99:.0f} ms", f"{under.lost} of {under.calls}"]


def main(arguments: list[str]) -> None:
    """Print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--only", nargs="*", default=[*ATTACKS])
    given = parser.parse_args(arguments)
    sys.stdout.write("| attack | p99 calm | p99 under attack | lost | echo calm | echo under attack | echo lost |\n")
    sys.stdout.write("| - | - | - | - | - | - | - |\n")
    for name, *pairs in measured(given.only, given.seconds):
        cells = [name]
        for pair in pairs:
            cells += _cells(*pair)
        sys.stdout.write(f"| {' | '.join(cells)} |\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
