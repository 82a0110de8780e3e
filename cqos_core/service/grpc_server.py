"""The gRPC server: `grpc.aio` with reflection and health."""

from __future__ import annotations

import asyncio
import re
import time
from contextlib import AbstractContextManager, asynccontextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import grpc
from google.rpc import code_pb2
from grpc_health.v1 import health, health_pb2
from grpc_reflection.v1alpha import reflection, reflection_pb2

from cqos.v1 import catalogue_pb2, check_pb2, session_pb2
from cqos_core.model.problems import CqosError
from cqos_core.remote.asked import decode
from cqos_core.remote.refusal import CALLER_QUOTA, Refused, fitted
from cqos_core.service.call_dispatch import EVICTED, MessageStream, internal_error
from cqos_core.service.call_handlers import EDIT, PAIRS
from cqos_core.service.caller_quotas import caller_address
from cqos_core.service.open_sessions import REQUESTS
from cqos_core.service.settings import CertificateFiles, address_text, split_address
from cqos_core.service.telemetry import REQUEST_ID

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from cqos_core.service.call_dispatch import CallDispatcher
    from cqos_core.service.caller_quotas import Caller
    from cqos_core.service.settings import Settings
    from cqos_core.service.telemetry import CallRecord

SERVICES: Final = tuple(
    file.DESCRIPTOR.services_by_name[name].full_name
    for file, name in (
        (catalogue_pb2, "CatalogueService"),
        (check_pb2, "CheckService"),
        (session_pb2, "SessionService"),
    )
)
_REFLECTION: Final = f"/{reflection.SERVICE_NAME}/ServerReflectionInfo"
_HEAD_ROOM: Final = 1024 * 1024
ERROR_BYTES: Final = "cqos-error-bytes"
"""The header in which a caller states how many bytes of error details it takes."""
_DETAILS: Final = 4 * 1024
"""For callers without the header: with the message, the details fit into the 8 KiB of gRPC."""
_MOST_DETAILS: Final = 1024 * 1024
_KEEPALIVE_MS: Final = 60_000
_HANDSHAKE_MS: Final = 10_000
_STREAMS: Final = 128
"""Concurrent calls on one connection; clients queue further ones."""
_HEALTH_SECONDS: Final = 5.0
_REFUSING_SECONDS: Final = 0.5
"""Delay of a refusal for exceeded quotas, so that a caller that retries at once takes no time of others."""


class GrpcServer:
    """The gRPC server around a `CallDispatcher`."""

    def __init__(self, calls: CallDispatcher, settings: Settings) -> None:
        """Open the address.

        Raises:
            CqosError: it cannot be opened.
        """
        self._calls = calls
        self._settings = settings
        self._refusing = asyncio.Lock()
        self._server = grpc.aio.server(
            # Calls are counted per caller after admission. A limit here would let strangers use up all places.
            options=(
                ("grpc.max_concurrent_streams", max(_STREAMS, 2 * settings.limits.sessions)),
                ("grpc.server_handshake_timeout_ms", _HANDSHAKE_MS),
                ("grpc.max_connection_idle_ms", int(settings.limits.idle_seconds * 1000)),
                # A message little larger than our limit is refused by us, with the limit in words.
                ("grpc.max_receive_message_length", settings.limits.message_bytes + _HEAD_ROOM),
                ("grpc.max_send_message_length", -1),
                ("grpc.so_reuseport", int(settings.processes > 1)),
                # A vanished caller holds a session no longer than this.
                ("grpc.keepalive_time_ms", _KEEPALIVE_MS),
                ("grpc.keepalive_timeout_ms", _KEEPALIVE_MS // 3),
                ("grpc.http2.min_recv_ping_interval_without_data_ms", _KEEPALIVE_MS // 6),
            ),
        )
        self.health = health.aio.HealthServicer()
        watched: dict[str, Any] = {
            "Check": grpc.stream_unary_rpc_method_handler(self._health_checked),
            "Watch": grpc.stream_stream_rpc_method_handler(self._health_watched),
        }
        self._server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(health.SERVICE_NAME, watched),))
        names = [*SERVICES, health.SERVICE_NAME, reflection.SERVICE_NAME]
        answers = partial(self._several, _REFLECTION, _Reflection(calls, names).answers)
        reflected: dict[str, Any] = {_REFLECTION.rpartition("/")[2]: grpc.stream_stream_rpc_method_handler(answers)}
        self._server.add_generic_rpc_handlers(
            (grpc.method_handlers_generic_handler(reflection.SERVICE_NAME, reflected),)
        )
        for service in SERVICES:
            handlers = grpc.method_handlers_generic_handler(service, self._handlers(service))
            self._server.add_generic_rpc_handlers((handlers,))
        self.address = self._open(settings)

    def _open(self, settings: Settings) -> str:
        host, port = split_address("--listen", settings.listen)
        try:
            if settings.encrypted:
                opened = self._server.add_secure_port(address_text(host, port), _credentials(settings))
            else:
                opened = self._server.add_insecure_port(address_text(host, port))
        except RuntimeError:
            opened = 0
        if not opened:
            raise CqosError(f"cannot listen on {settings.listen}: it is in use, or not an address of this machine")
        return address_text(host, opened)

    def _handlers(self, service: str) -> dict[str, Any]:
        """Return handlers of bytes: large messages are decoded where they are answered.

        Calls of one message are streams, too, so that their caller is admitted before the message is read.
        """
        streams = {PAIRS: self._calls.pairs, EDIT: self._calls.edit}
        handlers: dict[str, Any] = {
            **{method: grpc.stream_unary_rpc_method_handler(partial(self._one, method)) for method in REQUESTS},
            **{
                method: grpc.stream_stream_rpc_method_handler(partial(self._several, method, answer))
                for method, answer in streams.items()
            },
        }
        return {
            method.rpartition("/")[2]: handler
            for method, handler in handlers.items()
            if method.startswith(f"/{service}/")
        }

    async def _one(self, method: str, _requests: Any, context: Any) -> bytes:
        """Answer a call of one message."""
        async with self._watched(method, context) as (watch, caller):
            waiting = partial(self._calls.callers.waiting_place, caller)
            data = await _only_message(context, self._calls.limits.seconds, waiting)
            watch.size = len(data)
            answered = await self._calls.unary(caller, method, data, context.time_remaining())
            watch.answered = len(answered)
            return answered

    async def _several(
        self,
        method: str,
        stream: Callable[..., AsyncIterator[bytes]],
        requests: AsyncIterator[bytes],
        context: Any,
    ) -> AsyncIterator[bytes]:
        """Answer a stream."""
        async with self._watched(method, context) as (watch, caller):
            async for answered in stream(caller, requests):
                watch.answered += len(answered)
                yield answered

    @asynccontextmanager
    async def _watched(self, method: str, context: Any) -> AsyncIterator[tuple[CallRecord, Caller]]:
        """Admit the caller, and record how its call ends."""
        calls, metadata, peer = self._calls, _metadata(context), context.peer()
        watch = calls.telemetry.begin(method, metadata, peer)
        try:
            with calls.count_call(metadata, peer, self._certificate(context)) as caller:
                watch.caller = calls.shown(caller)
                yield watch, caller
        except Refused as refused:
            watch.refused(refused)
            await self._refuse(context, refused, watch.request_id)
            raise
        except (asyncio.CancelledError, GeneratorExit):
            watch.end("CANCELLED")
            raise
        except Exception as error:
            ours = internal_error(error, watch.request_id)
            watch.end(ours.code)
            await _abort(context, ours, watch.request_id)
            raise
        watch.end("OK")

    def _certificate(self, context: Any) -> str:
        """Return the names in the certificate of a caller; empty if none is required."""
        if self._settings.client_authority is None:
            return ""
        return b" ".join(sorted(context.peer_identities() or ())).decode("utf-8", "replace")

    async def start(self) -> None:
        """Start to answer."""
        await self._server.start()
        for name in ("", *SERVICES):
            await self.health.set(name, health_pb2.HealthCheckResponse.SERVING)

    async def leave(self) -> None:
        """Report in health checks that the service ends; calls are still accepted."""
        await self.health.enter_graceful_shutdown()

    async def stop(self, grace: float) -> None:
        """Accept no more calls, and stop when those under way are answered, or after ``grace`` seconds."""
        await self._server.stop(grace)

    async def _health_checked(self, _requests: Any, context: Any) -> bytes:
        """Answer a health check of any caller, at any load."""
        try:
            request = health_pb2.HealthCheckRequest.FromString(await _only_message(context, _HEALTH_SECONDS))
        except Refused as refused:
            await _abort(context, refused, "")
            raise
        response: Any = await self.health.Check(request, context)
        return bytes(response.SerializeToString())

    async def _health_watched(self, _requests: Any, context: Any) -> AsyncIterator[bytes]:
        """Answer a health watch, within the limit of watches."""
        try:
            with self._calls.callers.count_watch(caller_address(context.peer())):
                request = health_pb2.HealthCheckRequest.FromString(await _only_message(context, _HEALTH_SECONDS))
                watched: asyncio.Queue[bytes] = asyncio.Queue()
                written: Any = _QueueContext(context, watched)
                task = asyncio.ensure_future(self.health.Watch(request, written))
                try:
                    while True:
                        yield await watched.get()
                finally:
                    task.cancel()
                    with suppress(asyncio.CancelledError):
                        await task
        except Refused as refused:
            await self._refuse(context, refused, "")
            raise

    async def _refuse(self, context: Any, refused: Refused, request_id: str) -> None:
        """End a refused call: one in each turn of the loop, and with a delay if the caller exceeds its quota.

        Else hundreds of refused streams would end in one turn, and all other calls would wait.
        """
        if refused.reason == CALLER_QUOTA or refused.code == "UNAUTHENTICATED":
            await asyncio.sleep(_REFUSING_SECONDS)
        async with self._refusing:
            await asyncio.sleep(0)
            await _abort(context, refused, request_id)


class _QueueContext:
    """The context of a call that puts its answers into a queue."""

    def __init__(self, context: Any, answers: asyncio.Queue[bytes]) -> None:
        self._context = context
        self._answers = answers

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    async def write(self, message: Any) -> None:
        self._answers.put_nowait(message.SerializeToString())


def _in_own_place(_give_way: Callable[[], None]) -> AbstractContextManager[None]:
    """Return the context of a wait that is never evicted."""
    return nullcontext()


async def _only_message(
    context: Any, seconds: float, waiting: Callable[[Callable[[], None]], AbstractContextManager[None]] = _in_own_place
) -> bytes:
    """Return the message of a call.

    Raises:
        Refused: none arrives in time, or the call is evicted.
    """
    loop, task = asyncio.get_running_loop(), cast("asyncio.Task[Any]", asyncio.current_task())
    ended: list[Refused] = []

    def end(refused: Refused) -> None:
        ended.append(refused)
        task.cancel()

    too_late = Refused("DEADLINE_EXCEEDED", f"the request did not come within {seconds:g} seconds")
    late = loop.call_later(seconds, end, too_late)  # `asyncio.wait_for` takes another task
    try:
        with waiting(lambda: end(Refused("RESOURCE_EXHAUSTED", f"the call is ended: {EVICTED}", reason=CALLER_QUOTA))):
            data = await context.read()
    except asyncio.CancelledError:
        if context.cancelled() or not ended:
            raise
        raise ended[0] from None
    finally:
        late.cancel()
    if data is grpc.aio.EOF:
        raise Refused("INVALID_ARGUMENT", "the call has no request message")
    return bytes(data)


class _Reflection(reflection.aio.ReflectionServicer):
    """Reflection of the services."""

    def __init__(self, calls: CallDispatcher, names: list[str]) -> None:
        super().__init__(names)
        self._calls = calls

    async def answers(self, caller: Caller, requests: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
        """Answer a stream, within the caller's share of the time of this process.

        Raises:
            Refused: a message cannot be decoded, or none came in time.
        """
        heard = MessageStream(self._calls, caller, requests, _reflection_ended)
        while (data := await heard.next()) is not None:
            request = decode(reflection_pb2.ServerReflectionRequest, data)
            await self._calls.callers.time_for(caller)
            began = time.perf_counter()
            answers: Any = self.ServerReflectionInfo(_single(request), None)
            found = [answer.SerializeToString() async for answer in answers]
            self._calls.callers.answered_here(caller, time.perf_counter() - began)
            for each in found:
                yield each


async def _single(request: Any) -> AsyncIterator[Any]:
    yield request


def _reflection_ended(why: str) -> Refused:
    return Refused("ABORTED", f"the stream of reflection is ended: {why}; begin another one")


def _metadata(context: Any) -> dict[str, str]:
    """Return the metadata of a call, as far as it is text."""
    return {name: value for name, value in context.invocation_metadata() or () if isinstance(value, str)}


_CODES: Final = {code.name: code for code in grpc.StatusCode}


async def _abort(context: Any, refused: Refused, request_id: str) -> None:
    given = _metadata(context).get(ERROR_BYTES, "")
    # A number of thousands of digits is refused.
    most = min(int(given), _MOST_DETAILS) if re.fullmatch("[0-9]{1,9}", given) else _DETAILS
    status = fitted(refused.status(), most)
    trailing = (("grpc-status-details-bin", status.SerializeToString()), (REQUEST_ID, request_id))
    await context.abort(_CODES[code_pb2.Code.Name(status.code)], status.message, trailing)


def _credentials(settings: Settings) -> grpc.ServerCredentials:
    """Return credentials that reload certificates from their files for new connections."""
    files = CertificateFiles(settings)

    def configuration() -> Any:
        authority = None if settings.client_authority is None else content(settings.client_authority)
        pair = (content(settings.key), content(settings.certificate))
        return grpc.ssl_server_certificate_configuration([pair], root_certificates=authority)

    def content(path: str | None) -> bytes:
        return Path(path or "").read_bytes()

    def changed() -> Any:
        return configuration() if files.changed() else None

    return grpc.dynamic_ssl_server_credentials(
        configuration(), changed, require_client_authentication=settings.client_authority is not None
    )
