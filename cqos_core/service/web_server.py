"""The server for browsers: Connect and gRPC-Web on one HTTP port.

Browsers cannot stream requests over HTTP/1.1, so it offers only calls of one message.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from contextvars import ContextVar
from ssl import CERT_NONE, CERT_REQUIRED
from typing import TYPE_CHECKING, Any, Final, NamedTuple
from urllib.parse import parse_qs

import uvicorn
from connectrpc.code import Code
from connectrpc.errors import ConnectError, ErrorDetail
from connectrpc.method import IdempotencyLevel, MethodInfo, StreamType
from connectrpc.server import ConnectASGIApplication, Endpoint
from google.protobuf import descriptor_pool
from google.rpc import code_pb2
from protobuf.wkt import Any as Detail
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.cors import CORSMiddleware
from starlette.responses import JSONResponse, PlainTextResponse
from starlette.routing import Mount, Route

from cqos_core.model.problems import CqosError
from cqos_core.remote.refusal import Refused
from cqos_core.service import named_files, static_page
from cqos_core.service.browser_connections import ABORT, KEPT_SECONDS, Connections, idle_timeout_protocol
from cqos_core.service.call_dispatch import internal_error
from cqos_core.service.call_handlers import EDIT, METHODS, PAIRS
from cqos_core.service.open_sessions import REQUESTS, SESSIONS
from cqos_core.service.settings import CertificateFiles, address_text, split_address
from cqos_core.service.telemetry import REQUEST_ID

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterator, Mapping

    from starlette.requests import Request
    from starlette.types import ASGIApp

    from cqos_core.service.call_dispatch import CallDispatcher
    from cqos_core.service.caller_quotas import Caller
    from cqos_core.service.settings import Settings
    from cqos_core.service.telemetry import CallRecord

_BACKLOG: Final = 1024
_UNREAD_BYTES: Final = 256 * 1024
"""Send buffer of a connection in the kernel, which would else grow to megabytes."""
_RELOAD_SECONDS: Final = 2.0
_PREFLIGHT_SECONDS: Final = 7200
# Headers that gRPC-Web and Connect need for pages of other origins.
_REQUEST_HEADERS: Final = (
    *("authorization", "content-type", "connect-protocol-version", "connect-timeout-ms"),
    *("grpc-timeout", "x-grpc-web", "x-user-agent", REQUEST_ID, "traceparent", "tracestate"),
)
_KINDS: Final = (
    *("application/json", "application/proto"),
    *("application/grpc-web", "application/grpc-web+proto", "application/grpc-web+json"),
)
_RESPONSE_HEADERS: Final = ("grpc-status", "grpc-message", "grpc-status-details-bin", REQUEST_ID)


class _EncodedMessage(NamedTuple):
    """An encoded message, and its encoding."""

    json: bool
    data: bytes


class _BytesCodec:
    """A codec that passes bytes through: large messages are decoded where they are answered."""

    def __init__(self, *, json: bool) -> None:
        self._json = json

    def name(self) -> str:
        return "json" if self._json else "proto"

    def encode(self, message: bytes) -> bytes:
        return message

    def decode(self, data: bytes | bytearray, message_class: Any) -> _EncodedMessage:  # noqa: ARG002 - of all codecs
        return _EncodedMessage(self._json, bytes(data))


class _Exchange:
    """One HTTP request. Its quotas are counted in the loop of `CallDispatcher`, which runs in another thread.

    Attributes:
        caller: the caller, once it is admitted.
        request_id: its id in the log.
        size: bytes of the body so far.
        answered: bytes of the answer.
    """

    def __init__(self, calls: CallDispatcher, loop: asyncio.AbstractEventLoop, abort: Callable[[], None]) -> None:
        """Take the dispatcher and its loop; ``abort`` ends the connection."""
        self.caller: Caller | None = None
        self.request_id = ""
        self.size = 0
        self.answered = 0
        self._calls, self._loop = calls, loop
        self._calling = contextlib.ExitStack()
        self._reading = contextlib.ExitStack()
        self._unread = contextlib.ExitStack()
        self._hold: Callable[[int], None] = lambda _size: None
        here = asyncio.get_running_loop()

        def ended() -> None:
            here.call_soon_threadsafe(abort)

        self._abort = ended

    async def _there(self, work: Coroutine[Any, Any, Any]) -> Any:
        """Run ``work`` in the loop of the dispatcher."""
        return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(work, self._loop))

    async def begin(self, metadata: Mapping[str, str], peer: str) -> None:
        """Admit the caller.

        Raises:
            Refused: it has no token that is known, or too many calls under way.
        """

        async def begun() -> None:
            self.caller = self._calling.enter_context(self._calls.count_call(metadata, peer))
            self._hold = self._reading.enter_context(self._calls.callers.hold_request(self.caller))

        await self._there(begun())

    async def came(self, size: int) -> None:
        """Count bytes of the body.

        Raises:
            Refused: too many bytes are under way.
        """

        async def counted() -> None:
            self._hold(size)

        self.size += size
        await self._there(counted())

    async def answer(self, method: str, sent: _EncodedMessage, remaining: float | None) -> bytes:
        """Answer the message; its body counts no longer, and the answer counts until `read`.

        Raises:
            Refused: it is not answered.
            FailedError: a worker failed.
        """
        caller = self.caller
        assert caller is not None  # noqa: S101 - it was let in before its message was read

        async def answered() -> bytes:
            self._reading.close()
            answer = await self._calls.unary(caller, method, sent.data, remaining, browser=True, json=sent.json)
            self._unread.enter_context(self._calls.callers.hold_answer(caller, len(answer), self._abort))
            return answer

        answer: bytes = await self._there(answered())
        self.answered = len(answer)
        return answer

    def end(self) -> None:
        """Release the place of the call."""
        self._loop.call_soon_threadsafe(self._reading.close)
        self._loop.call_soon_threadsafe(self._calling.close)

    def read(self) -> None:
        """Release the bytes of the answer: it was read, or its caller is gone."""
        self._loop.call_soon_threadsafe(self._unread.close)


_EXCHANGE: Final[ContextVar[_Exchange]] = ContextVar("exchange")


class _Admission:
    """Admits callers before their message is read, and records their calls."""

    def __init__(self, calls: CallDispatcher) -> None:
        self._calls = calls

    async def on_start(self, context: Any) -> CallRecord:
        metadata = dict(context.request_headers.items())
        peer = context.client_address or ""
        method = f"/{context.method.service_name}/{context.method.name}"
        watch = self._calls.telemetry.begin(method, metadata, peer)
        exchange = _EXCHANGE.get()
        exchange.request_id = context.response_headers[REQUEST_ID] = watch.request_id
        try:
            await exchange.begin(metadata, peer)
        except Refused as refused:
            watch.refused(refused)
            raise _error(refused) from None
        watch.caller = "" if exchange.caller is None else self._calls.shown(exchange.caller)
        return watch

    async def on_end(self, watch: CallRecord, _context: Any, error: Exception | None) -> None:
        exchange = _EXCHANGE.get()
        exchange.end()
        watch.size = exchange.size
        if error is None:
            watch.answered = exchange.answered
            watch.end("OK")
        else:
            watch.end(_status(error.code) if isinstance(error, ConnectError) else "UNKNOWN")


class _Application(ConnectASGIApplication[Any]):
    """The ASGI application of all services. It counts the bytes of a request as they come, and bounds their time."""

    def __init__(self, calls: CallDispatcher) -> None:
        super().__init__(
            service=calls,
            endpoints=lambda _calls: _endpoints(),
            interceptors=[_Admission(calls)],
            read_max_bytes=calls.limits.message_bytes,
            codecs=[_BytesCodec(json=False), _BytesCodec(json=True)],
        )
        self._calls, self._loop = calls, asyncio.get_running_loop()
        self._seconds = calls.limits.seconds
        self._beginning = asyncio.Lock()

    @property
    def path(self) -> str:
        return "/"

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        if (answer := _protocol_refusal(scope)) is not None:
            await answer(scope, receive, send)
            return
        exchange = _Exchange(self._calls, self._loop, scope.get(ABORT, _keep_connection))
        _EXCHANGE.set(exchange)
        until = asyncio.get_running_loop().time() + self._seconds
        more = True

        async def counted() -> Any:
            nonlocal more
            if not more:  # Connect waits for the end of the connection
                return await receive()
            try:
                # `asyncio.wait_for` may lose a cancellation.
                async with asyncio.timeout_at(until):  # type: ignore[attr-defined,unused-ignore] # Python 3.11, as `web`
                    message = await receive()
            except TimeoutError:
                text = f"the request did not come within {self._seconds:g} seconds"
                raise ConnectError(Code.DEADLINE_EXCEEDED, text) from None
            more = message.get("more_body", False)
            try:
                await exchange.came(len(message.get("body", b"")))
            except Refused as refused:
                raise _error(refused) from None
            return message

        # One request begins in each turn of the loop, so that other work comes between two.
        async with self._beginning:
            await asyncio.sleep(0)
        try:
            await super().__call__(scope, counted, send)
        finally:
            exchange.end()
            exchange.read()


def _keep_connection() -> None:
    """Do nothing: a server that is not ours has its own limits for connections."""


def _protocol_refusal(scope: Any) -> JSONResponse | None:
    """Return an answer that explains why a request fits no protocol here; the protocols would only send a status."""
    if (text := _header_fault(scope["headers"])) is not None:
        return JSONResponse({"code": "invalid_argument", "message": text}, 400)
    path, method = scope["path"], scope["method"]
    encoding = parse_qs(scope["query_string"].decode("utf-8", "replace")).get("encoding", [""])[0]
    kind = dict(scope["headers"]).get(b"content-type", b"").partition(b";")[0].strip().lower().decode("latin-1")
    sent = f"`{kind[:60]}` is not spoken here" if kind else "a content-type is needed"
    kinds = ", ".join(_KINDS)
    for is_wrong, status, code, text, headers in (
        (
            path in (PAIRS, EDIT),
            *(404, "unimplemented", f"{path} takes a stream of requests, which gRPC alone has (--listen)", None),
        ),
        (
            path not in REQUESTS,
            *(
                404,
                "unimplemented",
                f"there is no call {path[:100]}; there is for instance {next(iter(METHODS))}",
                None,
            ),
        ),
        (
            method not in {"GET", "POST"},
            *(405, "unimplemented", f"{method[:20]} is not taken: POST is, and GET", {"allow": "GET, POST"}),
        ),
        (
            method == "GET" and path in SESSIONS,
            *(405, "unimplemented", "GET is not taken here: a session changes", {"allow": "POST"}),
        ),
        (
            method == "GET" and encoding not in {"proto", "json"},
            *(415, "invalid_argument", "a GET states `encoding=json` or `encoding=proto`, and its `message`", None),
        ),
        (
            method == "POST" and kind not in _KINDS,
            *(415, "invalid_argument", f"{sent}: it is one of {kinds}; gRPC itself has another address (--listen)"),
            {"accept-post": kinds},
        ),
    ):
        if is_wrong:
            return JSONResponse({"code": code, "message": text}, status, headers)
    return None


def _header_fault(headers: list[tuple[bytes, bytes]]) -> str | None:
    """Return a message about a header that is not UTF-8, without its value, which may be a token."""
    for name, value in headers:
        try:
            value.decode()
        except UnicodeDecodeError:
            return f"the header `{name.decode('ascii', 'replace')[:60]}` is not UTF-8"
    return None


class WebServer:
    """The HTTP server around a `CallDispatcher`."""

    def __init__(self, calls: CallDispatcher, settings: Settings) -> None:
        """Open the address.

        Raises:
            CqosError: it cannot be opened.
        """
        self._socket = _opened(settings)
        host, port = self._socket.getsockname()[:2]
        self.address = address_text(host, port)
        self._calls = calls
        connections = Connections(settings.limits)
        config = uvicorn.Config(
            application(calls, settings),
            http=idle_timeout_protocol(connections),
            log_config=None,
            access_log=False,
            server_header=False,
            lifespan="off",
            # With these, a caller could claim any address.
            proxy_headers=False,
            timeout_keep_alive=KEPT_SECONDS,
            timeout_graceful_shutdown=max(int(settings.grace), 1),
            ssl_certfile=settings.certificate,
            ssl_keyfile=settings.key,
            ssl_ca_certs=settings.client_authority,
            ssl_cert_reqs=CERT_REQUIRED if settings.client_authority else CERT_NONE,
        )
        config.load()
        self._context = config.ssl
        self._files = CertificateFiles(settings) if settings.encrypted else None
        self._settings = settings
        self._server = _Server(config, self._socket, connections)
        self._thread = threading.Thread(target=self._serve, name="browsers", daemon=True)
        self._failed: BaseException | None = None

    async def start(self) -> None:
        """Start to answer in a thread with its own loop, so that browsers never delay gRPC calls."""
        self._socket.listen(_BACKLOG)  # so many wait in the kernel
        self._thread.start()
        await asyncio.to_thread(self._server.ready.wait)
        if self._failed is not None:
            raise self._failed

    def _serve(self) -> None:
        try:
            asyncio.run(self._served())
        except BaseException as error:  # noqa: BLE001 - raised again in `start` or `stop`
            self._failed = error
            self._server.ready.set()

    async def _served(self) -> None:
        watching = asyncio.ensure_future(self._reload())
        try:
            await self._server.serve(sockets=[self._socket])
        finally:
            watching.cancel()

    async def _reload(self) -> None:
        """Reload certificates from their files for new connections."""
        while self._files is not None and self._context is not None:
            await asyncio.sleep(_RELOAD_SECONDS)
            if self._files.changed():
                self._context.load_cert_chain(self._settings.certificate or "", self._settings.key)

    async def stop(self, grace: float) -> None:  # noqa: ARG002 - the signature of both servers; uvicorn knows it
        """Accept no more calls, and stop when those under way are answered, or after the time of grace."""
        self._server.should_exit = True
        await asyncio.to_thread(self._thread.join)
        if self._failed is not None:
            raise self._failed


class _Server(uvicorn.Server):
    """Accepts connections itself, and leaves signals to the process.

    Attributes:
        ready: set when it accepts connections, or failed to.
    """

    def __init__(self, config: uvicorn.Config, listening: socket.socket, connections: Connections) -> None:
        super().__init__(config)
        self.ready = threading.Event()
        self._listening, self._connections = listening, connections
        self._accepting: asyncio.Task[None] | None = None

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:  # noqa: ARG002 - it is the one we know
        """Accept connections; uvicorn would keep any number without TLS handshake for a minute."""
        await self.lifespan.startup()
        self._listening.setblocking(False)
        kind: Any = self.config.http_protocol_class
        self.servers = []
        self._accepting = asyncio.ensure_future(
            self._connections.accept(
                self._listening, lambda: kind(self.config, self.server_state, self.lifespan.state), self.config.ssl
            )
        )
        self.started = True
        self.ready.set()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept no more connections, and complete the requests under way."""
        if self._accepting is not None:
            self._accepting.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._accepting
        self._connections.leave()
        await super().shutdown(sockets)


def _opened(settings: Settings) -> socket.socket:
    host, port = split_address("--web", settings.web or "")
    try:
        family, _, _, _, target = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        # asyncio sets TCP_NODELAY only on sockets that state TCP; else every further answer is delayed.
        opened = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD_BYTES)
        if settings.processes > 1:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        opened.bind(target)
    except OSError as error:
        raise CqosError(f"cannot listen on {settings.web}: {error.strerror}") from None
    return opened


def application(calls: CallDispatcher, settings: Settings) -> ASGIApp:
    """Return the ASGI application, which others may mount beside their own pages."""

    async def healthy(_request: Request) -> PlainTextResponse:
        draining = calls.leaving
        return PlainTextResponse("draining\n" if draining else "serving\n", 503 if draining else 200)

    cors = Middleware(
        CORSMiddleware,
        allow_origins=settings.origins,
        allow_methods=["GET", "POST"],
        allow_headers=_REQUEST_HEADERS,
        expose_headers=_RESPONSE_HEADERS,
        max_age=_PREFLIGHT_SECONDS,
    )
    pages = [*static_page.routes(), *named_files.routes(settings)] if settings.modeler else []
    routes: list[Route | Mount] = [Route("/healthz", healthy), *pages, Mount("/", app=_Application(calls))]
    return Starlette(routes=routes, middleware=[cors] if settings.origins else [])


def _endpoints() -> Mapping[str, Any]:
    """Return an endpoint for each call of one message, from its descriptor."""
    found: Any = descriptor_pool.Default()
    methods = {path: found.FindMethodByName(path[1:].replace("/", ".")) for path in REQUESTS}
    return {
        path: Endpoint.unary(
            MethodInfo(
                name=method.name,
                service_name=method.containing_service.full_name,
                input=REQUESTS[path],
                output=method.output_type._concrete_class,  # noqa: SLF001
                idempotency_level=IdempotencyLevel.UNKNOWN if path in SESSIONS else IdempotencyLevel.NO_SIDE_EFFECTS,
                stream_type=StreamType.UNARY,
            ),
            _unary(path),
        )
        for path, method in methods.items()
    }


def _unary(method: str) -> Any:
    async def handle(sent: _EncodedMessage, context: Any) -> bytes:
        exchange = _EXCHANGE.get()
        remaining = None if context.timeout_ms is None else context.timeout_ms / 1000
        try:
            return await exchange.answer(method, sent, remaining)
        except Refused as refused:
            raise _error(refused) from None
        except Exception as error:  # noqa: BLE001 - one call must not end the others
            raise _error(internal_error(error, exchange.request_id)) from None

    return handle


def _status(code: Code) -> str:
    """Return the name of a status code in gRPC."""
    return "CANCELLED" if code is Code.CANCELED else code.name


def _error(refused: Refused) -> ConnectError:
    status = refused.status()
    details = [ErrorDetail(Detail(type_url=each.type_url, value=each.value)) for each in status.details]
    return ConnectError(Code[code_pb2.Code.Name(status.code)], status.message, details)
