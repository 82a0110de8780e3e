"""The door for gRPC: `grpc.aio` with reflection and health."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import grpc
from google.rpc import code_pb2
from grpc_health.v1 import health, health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection, reflection_pb2_grpc

from cqos.v1 import catalogue_pb2, check_pb2, session_pb2
from cqos_core.problems import CqosError
from cqos_core.service.answers import EDIT, METHODS, PAIRS
from cqos_core.service.calls import failure
from cqos_core.service.observing import REQUEST_ID
from cqos_core.service.refusal import Refused, fitted
from cqos_core.service.settings import joined, split_address

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from cqos_core.service.callers import Caller
    from cqos_core.service.calls import Calls
    from cqos_core.service.settings import Settings

SERVICES: Final = tuple(
    file.DESCRIPTOR.services_by_name[name].full_name
    for file, name in (
        (catalogue_pb2, "CatalogueService"),
        (check_pb2, "CheckService"),
        (session_pb2, "SessionService"),
    )
)
_HEAD_ROOM: Final = 1024 * 1024
ERROR_BYTES: Final = "cqos-error-bytes"
"""In which callers say how many bytes of details they take with an error."""
_DETAILS: Final = 4 * 1024
"""For those who say nothing: in text and with the message, within the 8 KiB that gRPC lets them take."""
_MOST_DETAILS: Final = 1024 * 1024
_KEEPALIVE_MS: Final = 60_000


class NativeDoor:
    """A gRPC server around `Calls`."""

    def __init__(self, calls: Calls, settings: Settings) -> None:
        """Open the address.

        Raises:
            CqosError: it cannot be opened.
        """
        self._calls = calls
        self._settings = settings
        self._server = grpc.aio.server(
            maximum_concurrent_rpcs=settings.limits.calls,
            options=(
                # What is larger than our own limit by little shall hear from us what the limit is.
                ("grpc.max_receive_message_length", settings.limits.message_bytes + _HEAD_ROOM),
                ("grpc.max_send_message_length", -1),
                ("grpc.so_reuseport", int(settings.processes > 1)),
                # A caller that is gone without a word holds a session no longer than this.
                ("grpc.keepalive_time_ms", _KEEPALIVE_MS),
                ("grpc.keepalive_timeout_ms", _KEEPALIVE_MS // 3),
                ("grpc.http2.min_recv_ping_interval_without_data_ms", _KEEPALIVE_MS // 6),
            ),
        )
        self.health = health.aio.HealthServicer()
        health_pb2_grpc.add_HealthServicer_to_server(self.health, self._server)
        names = [*SERVICES, health.SERVICE_NAME, reflection.SERVICE_NAME]
        add_reflection: Any = reflection_pb2_grpc.add_ServerReflectionServicer_to_server
        add_reflection(_Reflection(calls, names), self._server)
        for service in SERVICES:
            handlers = grpc.method_handlers_generic_handler(service, dict(self._handlers(service)))
            self._server.add_generic_rpc_handlers((handlers,))
        self.address = self._open(settings)

    def _open(self, settings: Settings) -> str:
        host, port = split_address("--listen", settings.listen)
        try:
            if settings.encrypted:
                opened = self._server.add_secure_port(joined(host, port), _credentials(settings))
            else:
                opened = self._server.add_insecure_port(joined(host, port))
        except RuntimeError:
            opened = 0
        if not opened:
            raise CqosError(f"cannot listen on {settings.listen}: it is in use, or not an address of this machine")
        return joined(host, opened)

    def _handlers(self, service: str) -> Any:
        """Handlers that take and give bytes: what is large is decoded where it is answered."""
        for method in (name for name in (*METHODS, PAIRS, EDIT) if name.startswith(f"/{service}/")):
            name = method.rpartition("/")[2]
            if method == PAIRS:
                yield name, grpc.stream_stream_rpc_method_handler(self._streamed(method, self._calls.pairs))
            elif method == EDIT:
                yield name, grpc.stream_stream_rpc_method_handler(self._streamed(method, self._calls.edit))
            else:
                yield name, grpc.unary_unary_rpc_method_handler(self._unary(method))

    def _unary(self, method: str) -> Any:
        calls = self._calls

        async def handle(data: bytes, context: Any) -> bytes:
            metadata, peer = _metadata(context), context.peer()
            watch = calls.observer.begin(method, metadata, peer, len(data))
            try:
                with calls.calling(metadata, peer, self._certificate(context)) as caller:
                    answered = await calls.unary(caller, method, data, context.time_remaining())
            except Refused as refused:
                watch.end(refused.code)
                await _abort(context, refused, watch.request_id)
                raise
            except asyncio.CancelledError:
                watch.end("CANCELLED")
                raise
            except Exception as error:
                ours = failure(error, watch.request_id)
                watch.end(ours.code)
                await _abort(context, ours, watch.request_id)
                raise
            watch.end("OK", len(answered))
            return answered

        return handle

    def _streamed(self, method: str, answer: Callable[[Caller, AsyncIterator[bytes]], AsyncIterator[bytes]]) -> Any:
        calls = self._calls

        async def handle(requests: AsyncIterator[bytes], context: Any) -> AsyncIterator[bytes]:
            metadata, peer = _metadata(context), context.peer()
            watch = calls.observer.begin(method, metadata, peer, 0)
            size = 0
            try:
                with calls.calling(metadata, peer, self._certificate(context)) as caller:
                    async for answered in answer(caller, requests):
                        size += len(answered)
                        yield answered
            except Refused as refused:
                watch.end(refused.code, size)
                await _abort(context, refused, watch.request_id)
                raise
            except (asyncio.CancelledError, GeneratorExit):
                watch.end("CANCELLED", size)
                raise
            except Exception as error:
                ours = failure(error, watch.request_id)
                watch.end(ours.code, size)
                await _abort(context, ours, watch.request_id)
                raise
            watch.end("OK", size)

        return handle

    def _certificate(self, context: Any) -> str:
        """Whom the certificate of a caller names; empty where none is asked for."""
        if self._settings.client_authority is None:
            return ""
        return b" ".join(sorted(context.peer_identities() or ())).decode("utf-8", "replace")

    async def start(self) -> None:
        """Answer from now on."""
        await self._server.start()
        for name in ("", *SERVICES):
            await self.health.set(name, health_pb2.HealthCheckResponse.SERVING)

    async def stop(self, grace: float) -> None:
        """Take no more calls, and end when those under way are answered, or after ``grace`` seconds."""
        await self.health.enter_graceful_shutdown()
        await self._server.stop(grace)


class _Reflection(reflection.aio.ReflectionServicer):
    """Says what there is to those who are let in."""

    def __init__(self, calls: Calls, names: list[str]) -> None:
        super().__init__(names)
        self._calls = calls

    async def ServerReflectionInfo(self, request_iterator: Any, context: Any) -> Any:  # noqa: N802 - the method's name
        try:
            self._calls.admit(_metadata(context))
        except Refused as refused:
            await _abort(context, refused, "")
        answers: Any = super().ServerReflectionInfo(request_iterator, context)
        async for answer in answers:
            yield answer


def _metadata(context: Any) -> dict[str, str]:
    """What a caller says beside its message, as far as it is text."""
    return {name: value for name, value in context.invocation_metadata() or () if isinstance(value, str)}


_CODES: Final = {code.name: code for code in grpc.StatusCode}


async def _abort(context: Any, refused: Refused, request_id: str) -> None:
    given = _metadata(context).get(ERROR_BYTES, "")
    # A number of thousands of digits is none.
    most = min(int(given), _MOST_DETAILS) if re.fullmatch("[0-9]{1,9}", given) else _DETAILS
    status = fitted(refused.status(), most)
    trailing = (("grpc-status-details-bin", status.SerializeToString()), (REQUEST_ID, request_id))
    await context.abort(_CODES[code_pb2.Code.Name(status.code)], status.message, trailing)


def _credentials(settings: Settings) -> grpc.ServerCredentials:
    def content(path: str | None) -> bytes:
        return Path(path or "").read_bytes()

    authority = None if settings.client_authority is None else content(settings.client_authority)
    return grpc.ssl_server_credentials(
        [(content(settings.key), content(settings.certificate))],
        root_certificates=authority,
        require_client_auth=authority is not None,
    )
