"""Measures `CheckSystem` beside a bare echo of messages of the same size, in the same run.

python tests/benchmarks/service.py [--seconds 5] [--rounds 3] [--clients 1 8 64] [--workers 1]

The echo is a plain `grpc.aio` server in a process of its own. It decodes a `CheckSystemRequest` and returns a ready
`CheckSystemResponse` of the size of the real answer. The same client calls both: processes with the synchronous client of
grpcio, which send bytes and do not decode the answer. The client is the slower half, so the figures are what these clients
get, not what the server could do. The rounds alternate between both servers, because the speed of a machine changes over time.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import multiprocessing
import statistics
import sys
import threading
import time
from typing import TYPE_CHECKING, Any, NamedTuple

import grpc

from cqos.v1 import check_pb2, report_pb2, system_pb2
from cqos_core.remote.asked import decode
from cqos_core.remote.request_systems import read_system
from cqos_core.service.call_handlers import answer
from tests.service.service_process import serving

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

METHOD = "/cqos.v1.CheckService/CheckSystem"


class Measured(NamedTuple):
    """What one load gave: calls per second, and percentiles of the time of a call in milliseconds."""

    rate: float
    p50: float
    p95: float
    p99: float


def measured(took: Sequence[float], seconds: float) -> Measured:
    """Put the seconds that calls took together, which were made within ``seconds``; a busy machine may answer only one."""
    several = took if len(took) > 1 else [*took, *took]
    at = statistics.quantiles(several, n=100, method="inclusive")
    return Measured(len(took) / seconds, at[49] * 1000, at[94] * 1000, at[98] * 1000)


def model(endpoints: int, number: int) -> bytes:
    """A model that no other number gives, so that no answer is known before."""
    system = system_pb2.System(
        name=f"model {number}",
        protocol="ros2",
        participants=[system_pb2.Participant(id="a"), system_pb2.Participant(id="b")],
        endpoints=[
            system_pb2.Endpoint(
                id=f"Event_{number:05}_{each}",
                role=report_pb2.ROLE_SUBSCRIBER if each % 2 else report_pb2.ROLE_PUBLISHER,
                topic=f"topic_{each // 2}",
                participant="ab"[each % 2],
                settings={"reliability": "reliable", "deadline": "2s", "depth": str(number % 90 + 10)},
            )
            for each in range(endpoints)
        ],
    )
    return check_pb2.CheckSystemRequest(revision=number + 1, system=system).SerializeToString()


# --- the echo ---


def echo(port: Any, response: bytes) -> None:
    """Decode what comes, and return always the same: in a process of its own."""
    ready = check_pb2.CheckSystemResponse.FromString(response)

    async def serve() -> None:
        async def check(request: check_pb2.CheckSystemRequest, _context: Any) -> check_pb2.CheckSystemResponse:
            ready.revision = request.revision
            return ready

        server = grpc.aio.server()
        handler = grpc.unary_unary_rpc_method_handler(
            check,
            check_pb2.CheckSystemRequest.FromString,
            check_pb2.CheckSystemResponse.SerializeToString,
        )
        service, _, name = METHOD.strip("/").partition("/")
        server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(service, {name: handler}),))
        opened = server.add_insecure_port("127.0.0.1:0")
        await server.start()
        port.send(opened)
        await server.wait_for_termination()

    asyncio.run(serve())


@contextlib.contextmanager
def echoing(response: bytes) -> Iterator[str]:
    """The address of an echo."""
    here, there = multiprocessing.get_context("spawn").Pipe()
    process = multiprocessing.get_context("spawn").Process(target=echo, args=(there, response), daemon=True)
    process.start()
    try:
        yield f"127.0.0.1:{here.recv()}"
    finally:
        process.kill()
        process.join()


# --- the clients ---


def ask(address: str, shares: Sequence[Sequence[bytes]], seconds: float, together: Any, results: Any) -> None:
    """Let some clients ask, each with a connection and messages of its own, one call after another.

    All begin when all are connected, those of the other processes too, or some would be measured with less company.
    """
    took: list[float] = []
    connected, begin = threading.Barrier(len(shares) + 1), threading.Barrier(len(shares) + 1)

    def one(messages: Sequence[bytes]) -> None:
        options = (("grpc.use_local_subchannel_pool", 1), ("grpc.max_receive_message_length", -1))
        with grpc.insecure_channel(address, options) as channel:
            call: Any = channel.unary_unary(METHOD)
            call(messages[-1])
            connected.wait()
            begin.wait()
            until = time.perf_counter() + seconds
            for message in itertools.cycle(messages):
                began = time.perf_counter()
                call(message)
                ended = time.perf_counter()
                took.append(ended - began)
                if ended > until:
                    return

    threads = [threading.Thread(target=one, args=(share,)) for share in shares]
    for thread in threads:
        thread.start()
    connected.wait()
    together.wait()
    begin.wait()
    for thread in threads:
        thread.join()
    results.put(took)


def measure(address: str, messages: Sequence[bytes], clients: int, seconds: float) -> list[float]:
    """Return the seconds that each call took; the clients are in up to four processes."""
    context = multiprocessing.get_context("spawn")
    results = context.Queue()
    processes = min(clients, 4)
    together = context.Barrier(processes)
    shares = [messages[number::clients] for number in range(clients)]
    started = [
        context.Process(
            target=ask,
            args=(address, shares[number::processes], seconds, together, results),
        )
        for number in range(processes)
    ]
    for each in started:
        each.start()
    took = list(itertools.chain.from_iterable(results.get() for _ in started))
    for each in started:
        each.join()
    return took


# --- the figures ---


def where_time_goes(endpoints: int) -> str:
    """Microseconds of one answer to a new model with values that were met before, by step, without any network."""
    from cqos_core.api import context
    from cqos_core.checking.checker import check_system
    from cqos_core.remote.messages import report_message

    steps: dict[str, list[float]] = {"decode": [], "to values": [], "check": [], "to message": [], "encode": []}
    for number in range(300):
        message = model(endpoints, number)
        times = [time.perf_counter()]
        request = decode(check_pb2.CheckSystemRequest, message)
        times.append(time.perf_counter())
        system = read_system(request.system, 100_000)
        times.append(time.perf_counter())
        report = check_system(system, context())
        times.append(time.perf_counter())
        made = report_message(report)
        times.append(time.perf_counter())
        made.SerializeToString()
        times.append(time.perf_counter())
        for step, (before, after) in zip(steps, itertools.pairwise(times), strict=True):
            steps[step].append(after - before)
    return ", ".join(f"{step} {statistics.median(took[100:]) * 1e6:.0f} µs" for step, took in steps.items())


def run(
    seconds: float, clients: Sequence[int], endpoints: Sequence[int], workers: int = 1, rounds: int = 1
) -> list[str]:
    """Measure everything, the service with so many processes, the echo with one; return the rows of a table."""
    rows = ["| endpoints | clients | what | calls/s | of the echo | p50 ms | p95 ms | p99 ms |"]
    rows.append("| --------- | ------- | ---- | ------- | ----------- | ------ | ------ | ------ |")
    for number in endpoints:
        messages = [model(number, each) for each in range(256)]
        response = answer(METHOD, messages[0], 100_000)
        with serving("--log-level", "warning", "--workers", str(workers)) as service, echoing(response) as echoed:
            for count in clients:
                took: dict[str, list[float]] = {"echo": [], "models not seen before": [], "the same model again": []}
                for _ in range(rounds):
                    took["echo"] += measure(echoed, messages, count, seconds)
                    took["models not seen before"] += measure(service.grpc, new(number, seconds), count, seconds)
                    took["the same model again"] += measure(service.grpc, messages[:1] * 64, count, seconds)
                bare = measured(took["echo"], seconds * rounds)
                for what, each in took.items():
                    found = measured(each, seconds * rounds)
                    share = "" if what == "echo" else f"{found.rate / bare.rate:.0%}"
                    figures = f"{found.p50:.1f} | {found.p95:.1f} | {found.p99:.1f}"
                    rows.append(f"| {number} | {count} | {what} | {found.rate:.0f} | {share} | {figures} |")
        sizes = f"{len(messages[0])} bytes asked, {len(response)} answered"
        rows.append(f"\n{number} endpoints: {sizes}; one answer without the network: {where_time_goes(number)}\n")
    return rows


def new(endpoints: int, seconds: float) -> list[bytes]:
    """Models that the service has not seen yet: more than it can answer in the time, so that none comes twice."""
    first = next(_rounds) * 100_000
    return [model(endpoints, first + each) for each in range(int(seconds * 40_000 / (endpoints + 4)) + 256)]


_rounds = itertools.count(1)


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="CheckSystem beside a bare echo")
    parser.add_argument("--seconds", type=float, default=5.0, help="of every load in every round")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--clients", type=int, nargs="+", default=[1, 8, 64])
    parser.add_argument("--endpoints", type=int, nargs="+", default=[4, 200])
    parser.add_argument("--workers", type=int, default=1, help="processes of the service")
    given = parser.parse_args(arguments)
    sys.stdout.write("\n".join(run(given.seconds, given.clients, given.endpoints, given.workers, given.rounds)) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
