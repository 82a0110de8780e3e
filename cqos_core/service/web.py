"""The door for browsers: Connect and gRPC-Web on one HTTP port, around the same `Calls`.

Browsers have no streams of requests, so that only calls of one message are there. HTTP 1.1 allows no more.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
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
from cqos_core.service.answers import EDIT, METHODS, PAIRS
from cqos_core.service.calls import failure
from cqos_core.service.connections import KEPT_SECONDS, Connections, patient
from cqos_core.service.observing import REQUEST_ID
from cqos_core.service.open_sessions import REQUESTS, SESSIONS
from cqos_core.service.settings import Files, joined, split_address

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from starlette.requests import Request
    from starlette.types import ASGIApp

    from cqos_core.service.callers import Caller
    from cqos_core.service.calls import Calls
    from cqos_core.service.observing import Watch
    from cqos_core.service.settings import Settings

_BACKLOG: Final = 1024
_RELOAD_SECONDS: Final = 2.0
_PREFLIGHT_SECONDS: Final = 7200
# The extensions that gRPC-Web and Connect need where a page comes from elsewhere.
_REQUEST_HEADERS: Final = (
    *("authorization", "content-type", "connect-protocol-version", "connect-timeout-ms"),
    *("grpc-timeout", "x-grpc-web", "x-user-agent", REQUEST_ID, "traceparent", "tracestate"),
)
_KINDS: Final = (
    *("application/json", "application/proto"),
    *("application/grpc-web", "application/grpc-web+proto", "application/grpc-web+json"),
)
_RESPONSE_HEADERS: Final = ("grpc-status", "grpc-message", "grpc-status-details-bin", REQUEST_ID)


class _Sent(NamedTuple):
    """A message as it came, and in which form."""

    json: bool
    data: bytes


class _WebForm:
    """Takes and gives bytes as they are: what is large is decoded where it is answered."""

    def __init__(self, *, json: bool) -> None:
        self._json = json

    def name(self) -> str:
        return "json" if self._json else "proto"

    def encode(self, message: bytes) -> bytes:
        return message

    def decode(self, data: bytes | bytearray, message_class: Any) -> _Sent:  # noqa: ARG002 - of all codecs
        return _Sent(self._json, bytes(data))


class _Exchange:
    """One HTTP request.

    Attributes:
        caller: who makes it, as soon as it is let in.
        request_id: by which the log calls it.
        size: bytes that came.
        answered: bytes of the answer.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self.caller: Caller | None = None
        self.request_id = ""
        self.size = 0
        self.answered = 0
        self._calling = contextlib.ExitStack()
        self._reading = contextlib.ExitStack()
        self._hold: Callable[[int], None] = lambda _size: None

    def begin(self, calls: Calls, metadata: Mapping[str, str], peer: str) -> None:
        """Let its caller in.

        Raises:
            Refused: it has no token that is known, or too many calls under way.
        """
        self.caller = self._calling.enter_context(calls.calling(metadata, peer))
        self._hold = self._reading.enter_context(calls.callers.holding(self.caller))

    def came(self, size: int) -> None:
        """Count what came of its body.

        Raises:
            Refused: there is too much under way.
        """
        self.size += size
        self._hold(size)

    def read(self) -> None:
        """Forget its body, which is a message now."""
        self._reading.close()

    def end(self) -> None:
        """Give back what it had."""
        self._reading.close()
        self._calling.close()


_EXCHANGE: Final[ContextVar[_Exchange]] = ContextVar("exchange")


class _Admission:
    """Lets callers in before anything that they send is read, and watches what comes of it."""

    def __init__(self, calls: Calls) -> None:
        self._calls = calls

    async def on_start(self, context: Any) -> Watch:
        metadata = dict(context.request_headers.items())
        peer = context.client_address or ""
        method = f"/{context.method.service_name}/{context.method.name}"
        watch = self._calls.observer.begin(method, metadata, peer)
        exchange = _EXCHANGE.get()
        exchange.request_id = context.response_headers[REQUEST_ID] = watch.request_id
        try:
            exchange.begin(self._calls, metadata, peer)
        except Refused as refused:
            watch.refused(refused)
            raise _error(refused) from None
        watch.caller = "" if exchange.caller is None else self._calls.shown(exchange.caller)
        return watch

    async def on_end(self, watch: Watch, _context: Any, error: Exception | None) -> None:
        exchange = _EXCHANGE.get()
        exchange.end()
        watch.size = exchange.size
        if error is None:
            watch.answered = exchange.answered
            watch.end("OK")
        else:
            watch.end(_status(error.code) if isinstance(error, ConnectError) else "UNKNOWN")


class _Application(ConnectASGIApplication[Any]):
    """The calls of all services; what comes of a request is counted as it comes, and has to come in time."""

    def __init__(self, calls: Calls) -> None:
        super().__init__(
            service=calls,
            endpoints=_endpoints,
            interceptors=[_Admission(calls)],
            read_max_bytes=calls.limits.message_bytes,
            codecs=[_WebForm(json=False), _WebForm(json=True)],
        )
        self._seconds = calls.limits.seconds
        self._beginning = asyncio.Lock()

    @property
    def path(self) -> str:
        return "/"

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        if (answer := _unspoken(scope)) is not None:
            await answer(scope, receive, send)
            return
        exchange = _Exchange()
        _EXCHANGE.set(exchange)
        until = asyncio.get_running_loop().time() + self._seconds
        more = True

        async def counted() -> Any:
            nonlocal more
            if not more:  # it waits for the end of the connection
                return await receive()
            try:
                message = await asyncio.wait_for(receive(), until - asyncio.get_running_loop().time())
            except asyncio.TimeoutError:
                text = f"the request did not come within {self._seconds:g} seconds"
                raise ConnectError(Code.DEADLINE_EXCEEDED, text) from None
            more = message.get("more_body", False)
            try:
                exchange.came(len(message.get("body", b"")))
            except Refused as refused:
                raise _error(refused) from None
            return message

        # A small request is answered in one go. One begins in each turn of the loop, so that others come between two.
        async with self._beginning:
            await asyncio.sleep(0)
        await super().__call__(scope, counted, send)


def _unspoken(scope: Any) -> JSONResponse | None:
    """Say what is wrong with a request that is none of any protocol here; they would say nothing but a number."""
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


class WebDoor:
    """An HTTP server around `Calls`."""

    def __init__(self, calls: Calls, settings: Settings) -> None:
        """Open the address.

        Raises:
            CqosError: it cannot be opened.
        """
        self._socket = _opened(settings)
        host, port = self._socket.getsockname()[:2]
        self.address = joined(host, port)
        self._calls = calls
        config = uvicorn.Config(
            application(calls, settings),
            http=patient(Connections(settings.limits)),
            log_config=None,
            access_log=False,
            server_header=False,
            lifespan="off",
            # A caller could state any address with them.
            proxy_headers=False,
            # One is accepted in a turn of the loop: up to Python 3.13 as many as this, from 3.14 on one more.
            backlog=0 if sys.version_info >= (3, 14) else 1,
            timeout_keep_alive=KEPT_SECONDS,
            timeout_graceful_shutdown=max(int(settings.grace), 1),
            ssl_certfile=settings.certificate,
            ssl_keyfile=settings.key,
            ssl_ca_certs=settings.client_authority,
            ssl_cert_reqs=CERT_REQUIRED if settings.client_authority else CERT_NONE,
        )
        config.load()
        self._context = config.ssl
        self._files = Files(settings) if settings.encrypted else None
        self._settings = settings
        self._server = _Server(config)
        self._running: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Answer from now on."""
        self._running = asyncio.create_task(self._server.serve(sockets=[self._socket]))
        self._watching = asyncio.create_task(self._reload())
        while not self._server.started and not self._running.done():  # noqa: ASYNC110 - uvicorn has no event for it
            await asyncio.sleep(0.01)
        if self._running.done():
            await self._running
        else:
            self._socket.listen(_BACKLOG)  # so many wait in the kernel

    async def _reload(self) -> None:
        """Take new certificates from their files, for connections from then on."""
        while self._files is not None and self._context is not None:
            await asyncio.sleep(_RELOAD_SECONDS)
            if self._files.changed():
                self._context.load_cert_chain(self._settings.certificate or "", self._settings.key)

    async def stop(self, grace: float) -> None:  # noqa: ARG002 - of all doors; uvicorn knows it
        """Take no more calls, and end when those under way are answered, or after the time of grace."""
        self._server.should_exit = True
        self._watching.cancel()
        if self._running is not None:
            await self._running


class _Server(uvicorn.Server):
    """Leaves signals to the process, which has two doors."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def _opened(settings: Settings) -> socket.socket:
    host, port = split_address("--web", settings.web or "")
    try:
        family, _, _, _, target = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        # Only of sockets that say TCP does asyncio take the delay that otherwise comes before every answer but the first.
        opened = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if settings.processes > 1:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        opened.bind(target)
    except OSError as error:
        raise CqosError(f"cannot listen on {settings.web}: {error.strerror}") from None
    return opened


def application(calls: Calls, settings: Settings) -> ASGIApp:
    """Return the ASGI application; others may mount it beside their own pages."""

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


def _endpoints(calls: Calls) -> Mapping[str, Any]:
    """Every call of one message, found by its descriptor."""
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
            _unary(calls, path),
        )
        for path, method in methods.items()
    }


def _unary(calls: Calls, method: str) -> Any:
    async def handle(sent: _Sent, context: Any) -> bytes:
        exchange = _EXCHANGE.get()
        assert exchange.caller is not None  # noqa: S101 - it was let in before its message was read
        exchange.read()
        remaining = None if context.timeout_ms is None else context.timeout_ms / 1000
        try:
            answered = await calls.unary(exchange.caller, method, sent.data, remaining, browser=True, json=sent.json)
        except Refused as refused:
            raise _error(refused) from None
        except Exception as error:  # noqa: BLE001 - one call shall not end the others
            raise _error(failure(error, exchange.request_id)) from None
        exchange.answered = len(answered)
        return answered

    return handle


def _status(code: Code) -> str:
    """The name that gRPC has for it."""
    return "CANCELLED" if code is Code.CANCELED else code.name


def _error(refused: Refused) -> ConnectError:
    status = refused.status()
    details = [ErrorDetail(Detail(type_url=each.type_url, value=each.value)) for each in status.details]
    return ConnectError(Code[code_pb2.Code.Name(status.code)], status.message, details)
