"""One serving process, and several that share a port: ``python -m cqos_core.service.server_process``.

Settings come as a line on standard input, which is held open as long as the process shall serve.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import Any, Final

from cqos_core.model.garbage_collection import collect_new_objects_only
from cqos_core.model.problems import CqosError
from cqos_core.service.log_lines import ALWAYS, log_event, start_logging
from cqos_core.service.settings import Settings, address_text, split_address
from cqos_core.service.telemetry import Telemetry, end_tracing

_METRICS_FOLDER: Final = "PROMETHEUS_MULTIPROC_DIR"
_STOPPING: Final = (signal.SIGTERM, signal.SIGINT)
_UNABLE: Final = 2
"""The exit code of a process that cannot follow its settings, so that it is not restarted."""


def serve(settings: Settings, started: Callable[[dict[str, str]], None] | None = None) -> None:
    """Serve until a signal; a single process calls ``started`` with the addresses instead of logging them.

    Raises:
        CqosError: the settings cannot be followed.
    """
    settings.check()
    start_logging(settings.log_level, settings.log_format)
    if settings.processes > 1:
        _supervise(settings)
    else:
        asyncio.run(serve_here(settings, started))


async def serve_here(
    settings: Settings,
    started: Callable[[dict[str, str]], None] | None = None,
    ending: asyncio.Event | None = None,
) -> None:
    """Serve in this process, until a signal or ``ending``.

    Start and end are logged, unless ``started`` is called with the addresses.
    """
    # gRPC is slow to import, and help needs none of it.
    from cqos_core.service.call_dispatch import CallDispatcher
    from cqos_core.service.grpc_server import GrpcServer

    calls = CallDispatcher(settings, Telemetry(settings))
    ending = ending or asyncio.Event()
    level = ALWAYS if started is None else logging.INFO
    loop = asyncio.get_running_loop()
    for each in _STOPPING:
        with suppress(NotImplementedError):  # Windows
            loop.add_signal_handler(each, ending.set)
    native = GrpcServer(calls, settings)
    addresses = {"grpc": native.address}
    web: Any = None
    stack = ExitStack()
    try:
        if settings.web is not None:
            web = _web_server(calls, settings)
            addresses["web"] = web.address
        if settings.metrics is not None and settings.processes == 1:
            addresses["metrics"] = stack.enter_context(_serving_metrics(settings.metrics))
        # Both load all rule packs: this process, and the first worker.
        await asyncio.gather(calls.pool.warm(), asyncio.to_thread(calls.warm))
        collect_new_objects_only()
        await native.start()
        if web is not None:
            await web.start()
        log_event(level, "serving", **addresses, pid=os.getpid(), tls=settings.encrypted)
        if settings.tokens and not settings.encrypted:
            log_event(logging.WARNING, "others on the network can read tokens without TLS")
        if started is not None:
            started(addresses)
        # The page opens a session at once; other clients may never open one.
        _warming = asyncio.ensure_future(calls.sessions.warm()) if settings.modeler else None
        await ending.wait()
        log_event(level, "draining", leaving=settings.leaving, grace=settings.grace)
        # Load balancers see it in the health check; calls on their way are still answered.
        calls.leaving = True
        await native.leave()
        await asyncio.sleep(settings.leaving)
        calls.drain()
        await asyncio.gather(native.stop(settings.grace), *([] if web is None else [web.stop(settings.grace)]))
    finally:
        await calls.close()
        stack.close()
        if settings.tracing:
            end_tracing()
    log_event(level, "stopped")


def _web_server(calls: Any, settings: Settings) -> Any:
    try:
        from cqos_core.service.web_server import WebServer
    except ImportError as error:
        from cqos_core.model.optional_features import missing

        what = "the modeler" if settings.modeler else "--web"
        raise missing("web", f"{what} needs a web server, which is not installed ({error})") from None
    return WebServer(calls, settings)


@contextmanager
def _serving_metrics(address: str) -> Iterator[str]:
    """Serve Prometheus metrics, of one process or of all that share a folder, and yield the address."""
    from prometheus_client import REGISTRY, CollectorRegistry, start_http_server

    host, port = split_address("--metrics", address)
    registry = REGISTRY
    if _METRICS_FOLDER in os.environ:
        from prometheus_client.multiprocess import MultiProcessCollector

        registry = CollectorRegistry()
        MultiProcessCollector(registry)  # type: ignore[no-untyped-call]
    try:
        server, thread = start_http_server(port, host, registry)
    except OSError as error:
        raise CqosError(f"cannot listen on {address}: {error.strerror}") from None

    try:
        yield address_text(host, server.server_port)
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


# Several processes


def _supervise(settings: Settings) -> None:
    """Run several processes that share the port."""
    with ExitStack() as stack:
        # The sockets are bound and do not listen: they reserve the port for all processes.
        settings = replace(settings, listen=_held(stack, settings.listen))
        if settings.web is not None:
            settings = replace(settings, web=_held(stack, settings.web))
        if settings.metrics is not None:
            os.environ[_METRICS_FOLDER] = stack.enter_context(tempfile.TemporaryDirectory(prefix="cqos-metrics-"))
            settings = replace(settings, metrics=stack.enter_context(_serving_metrics(settings.metrics)))
        asyncio.run(_keep_running(settings))


def _held(stack: ExitStack, address: str) -> str:
    if not hasattr(socket, "SO_REUSEPORT"):
        raise CqosError("--workers needs a system on which processes can share a port")
    host, port = split_address("--listen", address)
    family, _, _, _, target = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    held = stack.enter_context(socket.socket(family, socket.SOCK_STREAM))
    held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    try:
        held.bind(target)
    except OSError as error:
        raise CqosError(f"cannot listen on {address}: {error.strerror}") from None
    return address_text(host, held.getsockname()[1])


async def _keep_running(settings: Settings) -> None:
    ending = asyncio.Event()
    for each in _STOPPING:
        asyncio.get_running_loop().add_signal_handler(each, ending.set)
    addresses = {"grpc": settings.listen, "web": settings.web, "metrics": settings.metrics}
    log_event(ALWAYS, "starting", **addresses, processes=settings.processes)
    unable = await asyncio.gather(*(_keep_one(settings, ending) for _ in range(settings.processes)))
    log_event(ALWAYS, "stopped all")
    if any(unable):
        raise CqosError("a process cannot follow the settings; it has said why")


async def _keep_one(settings: Settings, ending: asyncio.Event) -> bool:
    """Run one process, and restart it when it dies; return whether it could not start at all, which ends all."""
    waiting = asyncio.ensure_future(ending.wait())
    pause = 0.0
    while not ending.is_set():
        began = time.monotonic()
        child = await asyncio.create_subprocess_exec(
            sys.executable, "-m", __name__ if __name__ != "__main__" else "cqos_core.service.server_process", stdin=-1
        )
        assert child.stdin is not None  # noqa: S101 - it is a pipe
        child.stdin.write(settings.to_json().encode() + b"\n")
        ended = asyncio.ensure_future(child.wait())
        await asyncio.wait({ended, waiting}, return_when=asyncio.FIRST_COMPLETED)
        if ended.done() and ended.result() == _UNABLE:
            ending.set()
            return True
        if ended.done() and not ending.is_set():
            log_event(logging.ERROR, "process died", pid=child.pid, exit_code=ended.result())
            _forget_metrics(child.pid)
            pause = 0.0 if time.monotonic() - began > 10 else min(pause * 2 + 0.2, 10)  # noqa: PLR2004 - seconds
            await asyncio.wait({waiting}, timeout=pause)
        elif not ended.done():
            with suppress(ProcessLookupError):
                child.send_signal(signal.SIGTERM)
            await ended
    waiting.cancel()
    return False


def _forget_metrics(number: int) -> None:
    if _METRICS_FOLDER in os.environ:
        from prometheus_client.multiprocess import mark_process_dead

        mark_process_dead(number)  # type: ignore[no-untyped-call]


async def _serve_while_held(settings: Settings) -> None:
    """Serve until the parent process exits, so that no orphan keeps the port."""
    ending, loop, held = asyncio.Event(), asyncio.get_running_loop(), sys.stdin.fileno()

    def gone() -> None:
        loop.remove_reader(held)
        ending.set()

    loop.add_reader(held, gone)  # nothing more is sent, so it becomes readable at its end
    await serve_here(settings, ending=ending)


def main() -> None:
    """Serve as one of several processes."""
    settings = Settings.from_json(sys.stdin.readline())
    start_logging(settings.log_level, settings.log_format)
    try:
        asyncio.run(_serve_while_held(settings))
    except CqosError as error:
        log_event(logging.ERROR, "cannot serve", why=str(error))
        sys.exit(_UNABLE)


if __name__ == "__main__":
    main()
