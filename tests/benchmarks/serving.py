"""Rows of the service: processor time of a call, of client and server, beside a bare echo of the same size in the same run."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import multiprocessing
import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import grpc
from google.protobuf.field_mask_pb2 import FieldMask

from cqos.v1 import check_pb2, report_pb2, system_pb2
from tests.benchmarks import inputs
from tests.benchmarks.library import Row
from tests.service.service_process import serving

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

SERVICE: Final = "cqos.v1.CheckService"
TICKS: Final = os.sysconf("SC_CLK_TCK")
ROUNDS: Final = 3
_models = itertools.count(1)


VERDICT: Final = ("verdict",)
"""The fields that a caller asks for who reads nothing else."""


def model(endpoints: int, fields: Sequence[str] = ()) -> check_pb2.CheckSystemRequest:
    """A model that was not seen before: new names, diverse values, a mistake on one topic of ten."""
    number = next(_models)
    system = system_pb2.System(
        name=f"model {number}",
        protocol="ros2",
        participants=[system_pb2.Participant(id="a"), system_pb2.Participant(id="b")],
        endpoints=[
            system_pb2.Endpoint(
                id=f"Event_{number:05}_{each}",
                role=report_pb2.ROLE_SUBSCRIBER if each % 2 else report_pb2.ROLE_PUBLISHER,
                topic=f"topic_{number}_{each // 2}",
                participant="ab"[each % 2],
                settings=inputs.pair(number * 7 + each // 2)[each % 2],
            )
            for each in range(endpoints)
        ],
    )
    return check_pb2.CheckSystemRequest(revision=number, system=system, fields=_mask(fields))


def _mask(fields: Sequence[str]) -> FieldMask | None:
    return FieldMask(paths=fields) if fields else None


def asked_pair() -> check_pb2.CheckPairRequest:
    """A pair that was not seen before."""
    number = next(_models)
    offered, requested = inputs.pair(number)
    return check_pb2.CheckPairRequest(revision=number, protocol="ros2", offered=offered, requested=requested)


def asked_of_stream() -> check_pb2.CheckPairsRequest:
    """The same, for the stream."""
    return check_pb2.CheckPairsRequest(pair=asked_pair())


# --- the echo ---


def echo(port: Any, method: str, request_type: str, answer_type: str, answer: bytes, streamed: bool) -> None:
    """Decode what comes, and return always the same: in a process of its own."""
    ready = getattr(check_pb2, answer_type).FromString(answer)

    async def one(request: Any, _context: Any) -> Any:
        ready.revision = getattr(request, "revision", 0)
        return ready

    async def all_of(requests: Any, _context: Any) -> Any:
        async for _ in requests:
            yield ready

    async def serve() -> None:
        server = grpc.aio.server()
        make = grpc.stream_stream_rpc_method_handler if streamed else grpc.unary_unary_rpc_method_handler
        codec = (getattr(check_pb2, request_type).FromString, getattr(check_pb2, answer_type).SerializeToString)
        handler = make(all_of if streamed else one, *codec)
        server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, {method: handler}),))
        port.send(server.add_insecure_port("127.0.0.1:0"))
        await server.start()
        await server.wait_for_termination()

    asyncio.run(serve())


@contextlib.contextmanager
def echoing(*arguments: Any) -> Iterator[tuple[str, int]]:
    """The address and the process id of an echo."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=echo, args=(there, *arguments), daemon=True)
    process.start()
    try:
        yield f"127.0.0.1:{here.recv()}", process.pid or 0
    finally:
        process.kill()
        process.join()


# --- what a call costs ---


def of_process(pid: int) -> float:
    """Processor time of a process and those it started, in seconds."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    return sum(map(int, fields[11:15])) / TICKS + sum(map(of_process, map(int, children)))


def cost(address: str, pid: int, method: str, streamed: bool, messages: list[bytes]) -> float:
    """Processor time of one call in seconds, of client and server."""
    with grpc.insecure_channel(address, (("grpc.max_receive_message_length", -1),)) as channel:
        path = f"/{SERVICE}/{method}"
        unary: Any = channel.unary_unary(path)
        stream: Any = channel.stream_stream(path)

        def ask(some: list[bytes]) -> None:
            if streamed:
                assert sum(1 for _ in stream(iter(some))) == len(some)
            else:
                for message in some:
                    unary(message)

        ask(messages[:1])
        before = of_process(pid) + time.process_time()
        ask(messages[1:])
        return (of_process(pid) + time.process_time() - before) / (len(messages) - 1)


def service(scale: float) -> Iterator[Row]:
    """Measure calls of models and pairs that the service has not seen, one client, one after another."""
    loads: tuple[tuple[str, str, Callable[[], Any], int, float, str], ...] = (
        ("gRPC `CheckSystem`, 4 endpoints", "CheckSystem", lambda: model(4), 2000, 0.45, "a bare echo"),
        ("gRPC `CheckSystem`, 200 endpoints", "CheckSystem", lambda: model(200), 200, 0.08, "a bare echo"),
        ("gRPC `CheckSystem`, 4, `verdict` alone", "CheckSystem", lambda: model(4, VERDICT), 2000, 0.65, "a bare echo"),
        (
            "gRPC `CheckSystem`, 200, `verdict` alone",
            "CheckSystem",
            lambda: model(200, VERDICT),
            200,
            0.3,
            "a bare echo",
        ),
        ("gRPC `CheckPair`", "CheckPair", asked_pair, 2000, 0, "a bare echo"),
        ("gRPC stream `CheckPairs`", "CheckPairs", asked_of_stream, 4000, 0, "an echo stream"),
    )
    with serving("--log-level", "warning") as running:
        for what, method, make, whole, target, beside in loads:
            streamed = method.endswith("s")
            count = max(20, int(whole * scale))
            with grpc.insecure_channel(running.grpc, (("grpc.max_receive_message_length", -1),)) as channel:
                path, first = f"/{SERVICE}/{method}", make().SerializeToString()
                one: Any = channel.unary_unary(path)
                several: Any = channel.stream_stream(path)
                answer = next(iter(several(iter([first])))) if streamed else one(first)
            with echoing(method, f"{method}Request", f"{method}Response", answer, streamed) as (address, pid):
                ours, bare = float("inf"), float("inf")
                for _ in range(ROUNDS):
                    messages = [make().SerializeToString() for _ in range(count)]
                    bare = min(bare, cost(address, pid, method, streamed, messages))
                    ours = min(ours, cost(running.grpc, running.process.pid, method, streamed, messages))
            yield Row(
                f"{what}, not seen before", beside, f"{ours * 1e6:,.0f} µs a call", bare / ours, target, least=True
            )
