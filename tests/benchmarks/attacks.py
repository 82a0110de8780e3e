"""Measures a polite client while strangers attack, beside a bare echo under the same attack.

python tests/benchmarks/attacks.py [--seconds 3] [--only NAME ...]

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
import threading
import time
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import grpc
from grpc_health.v1 import health_pb2

from cqos.v1 import check_pb2, report_pb2, session_pb2, system_pb2
from tests.service.running import serving

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PAIR = "/cqos.v1.CheckService/CheckPair"
SYSTEM = "/cqos.v1.CheckService/CheckSystem"
EDIT = "/cqos.v1.SessionService/Edit"
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


def polite(address: str, seconds: float, pause: float = 0.01, least: int = 1) -> Polite:
    """Ask small questions one after the other, for so many seconds and at least so many."""
    took, lost = [], 0
    with reached(address) as channel:
        ask = channel.unary_unary(PAIR)
        ask(POLITE, timeout=20)
        until = time.monotonic() + seconds
        number = 0
        while time.monotonic() < until or number < least:
            number += 1
            question = check_pb2.CheckPairRequest(
                protocol="ros2", topic={"name": f"polite{number}"}
            ).SerializeToString()
            began = time.monotonic()
            try:
                ask(question, timeout=20)
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
                if details.method in (EDIT, WATCH):
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
        with serving("--web", "127.0.0.1:0", "--log-level", "error") as service:
            web = str(service.addresses["web"])
            calm = polite(service.grpc, seconds)
            with attacking(name, service.grpc, web):
                under = polite(service.grpc, seconds)
        with echoing() as (address, http):
            calm_echo = polite(address, seconds)
            with attacking(name, address, http):
                yield name, (calm, under), (calm_echo, polite(address, seconds))


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
